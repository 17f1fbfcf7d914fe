"""Shells that meet their target when they carry their own weight: tubes of glass fibre, and laths of larch."""

from collections.abc import Iterator

import rodshell as rs
from rodshell.formfinding import Stages
from rodshell.formfinding.popup import Ends
from rodshell.refining.refine import refine
from tests.acceptance.rows import Row

TUBE = rs.Rod(rs.Tube(radius=0.0417 / 2, thickness=0.0035), rs.Material(25e9, 1750, 0.3))
LATH = rs.Rod(rs.RectangularSection(width=0.035, height=0.05), rs.Material(12e9, 590, shear=0.7e9))
LAYOUT = rs.GridLayout.orthogonal(spacing=1.0, edge=0.5)


def rows() -> Iterator[Row]:
    for name, target, rod, joint in (
        ("tubes, cap of 16 m", rs.Cap(10.0, 4.0), TUBE, rs.Ball()),
        ("laths with pins, paraboloid of 16 m", rs.Paraboloid(8.0, 4.0), LATH, rs.Pin()),
    ):
        ends: Ends
        for ends in ("pinned", "clamped"):
            stages = rs.find_form(target, LAYOUT, rod, joint=joint, ends=ends).stages
            yield from rows_of(f"{name}, {ends}", stages)


def rows_of(name: str, stages: Stages) -> Iterator[Row]:
    unloaded, found = refine(stages, "taper"), refine(stages, "taper", under_weight=True)
    assert found.loaded is not None
    before, after = (100 * gap.rms_relative for gap in found.loaded)
    note = f"before {before:.3f} %, unloaded {100 * found.gap_after.rms_relative:.4f} %"
    yield Row(name, "gap rms under its own weight", after, 0.1, "%", note)
    if "clamped" in name:  # on the target already, so that unloaded there is next to nothing to do
        return
    most = 3 * unloaded.factorizations
    yield Row(
        name, "factorisations, three times unloaded", found.factorizations, most, note=f"{len(found.steps)} evaluations"
    )
