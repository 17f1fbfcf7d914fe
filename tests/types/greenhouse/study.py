"""A greenhouse of wires: formed by calls and as a job, compared, changed, saved and read."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import assert_type

import numpy as np
from numpy.typing import NDArray

import rodshell as rs

HEADINGS = ("0 deg", "45 deg")  # of the layout


def wires() -> rs.Rod:
    return rs.Rod(section=rs.Circle(radius=5e-4), material=rs.Material.preset("petg"))


def targets() -> Sequence[rs.Target]:
    """Surfaces of each kind that is made without a file."""
    return (
        rs.Hemisphere(radius=0.2),
        rs.Cap(radius=0.2, base=0.05),
        rs.Paraboloid(radius=0.2, height=0.1),
        rs.Ellipsoid(a=0.2, b=0.15, c=0.1),
        rs.HeightField(formula="0.1 - 2*x^2 - 2*y^2", domain=rs.Disc(0.2)),
    )


def methods() -> tuple[rs.Bound | rs.Gravity | rs.Fall, ...]:
    return (rs.Bound(), rs.Gravity(acceleration=9.81), rs.Fall(height=0.05, coupling=rs.SharedDofs(), time_step=0.01))


def by_stages(target: rs.Target, layout: rs.GridLayout, rod: rs.Rod) -> float:
    """Each stage by itself; the root mean square of the gap, over the size."""
    draped = rs.drape(layout, rod, target, method=rs.Bound(), anchor=(0.0, 0.0))
    trimmed = rs.trim(draped)
    footprint, boundary = rs.map_back(trimmed), trimmed.boundary
    popped = rs.pop_up(footprint, boundary, rod, ends="pinned")
    assert_type(popped, rs.PopUp)
    assert_type(popped.positions, NDArray[np.float64])
    stable: bool = popped.report.stable
    gap = rs.agreement(popped, target)
    assert_type(gap, rs.Agreement)
    return gap.rms_relative if stable else float("inf")


def by_call(folder: Path) -> rs.Form:
    """The short way: everything in one call."""
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.02)
    form = rs.find_form(
        rs.Paraboloid(radius=0.2, height=0.1), layout, wires(), method=rs.Bound(), ends=("pinned", "clamped"),
        joint=rs.Ball(mass=1e-4),
    )  # fmt: skip
    assert_type(form, rs.Form)
    worst = max(form.agreement[ends].max_relative for ends in form.popped)
    level: str = form.verdict.level
    print(repr(form), level, worst, form.status, form.warnings[:1])
    saved: Path = form.save(folder)
    print(form.summary(), saved)
    return form


def by_job(case: Path) -> dict[str, float]:
    """The same case under several headings, each from the last one's form."""
    job = rs.Job.load(str(case))
    form = job.run()
    gaps = {"as it is": form.agreement["pinned"].rms_relative}
    for heading in HEADINGS:
        turned = job.changed(layout__rotate=heading)
        assert_type(turned, rs.Job)
        assert turned != job or heading == HEADINGS[0]
        form = turned.run(warm_start=form)
        gaps[heading] = form.agreement["pinned"].rms_relative
    patches: int = len(form.patches)
    print(patches, "patch")
    return gaps


def refused() -> str:
    """What a user gets wrong arrives as one class of errors."""
    try:
        rs.Hemisphere(radius=-1.0)
    except rs.InputError as error:
        return str(error)
    except rs.RodshellError:
        raise
    return ""
