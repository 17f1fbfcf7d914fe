"""Several simple gridshells joined at seams: a roof of two bumps cut in its valley, and a ball that no one net covers.

`python examples/seams.py NAME ...` keeps the results in out/NAME; without names nothing is kept.
"""

import sys
from math import degrees
from pathlib import Path

import numpy as np

import rodshell as rs

LATH = rs.Rod(rs.Circle(radius=0.01), rs.Material(youngs_modulus=30e9, density=1900.0, poisson_ratio=0.3))
LAYOUT = rs.GridLayout.orthogonal(spacing=0.8, edge=0.2)


def bumps() -> rs.Target:
    formula = "2.2*exp(-((x - 2.2)^2 + y^2)/4.5) + 1.8*exp(-((x + 2.2)^2 + y^2)/4.5)"
    return rs.HeightField(formula=formula, domain=rs.Disc(5.0))


def ball() -> rs.Target:
    """A sphere to four fifths of its height."""
    return rs.Cap(radius=5.0, base=-3.0)


def check(form: rs.Form) -> None:
    """Both patches end at the very same points, converged and stable."""
    assert form.status == "converged"
    for ends in form.popped:
        place = {
            (found.name, rod.name, side): found.popped[ends].positions[found.footprint.mesh.ends[k, side]]
            for found in form.patches
            for k, rod in enumerate(found.footprint.rods)
            for side in (0, 1)
        }
        for meeting in form.meetings:
            first, second = ((end.patch, end.rod, end.side) for end in meeting.ends)
            assert np.array_equal(place[first], place[second])
        assert form.popped[ends].report.stable


def roof() -> rs.Form:
    """In a valley a free grid springs off its target; a seam there holds it down."""
    whole = rs.find_form(bumps(), LAYOUT, LATH, ends=("clamped",))
    form = rs.find_form(bumps(), LAYOUT, LATH, seams=[[(0.0, -6.0), (0.0, 6.0)]])
    assert form.agreement["clamped"].rms < 0.2 * whole.agreement["clamped"].rms
    return form


def sphere() -> rs.Form:
    """Rods of both families become parallel on the whole; on its halves they meet at 30 degrees and more."""
    try:
        rs.find_form(ball(), LAYOUT, LATH)
    except rs.NetLimitError as reason:
        print(reason)
    form = rs.find_form(ball(), LAYOUT, LATH, seams=[[(-6.0, 0.0), (6.0, 0.0)]])
    assert min(degrees(patch.draped.net.min_angle) for patch in form.patches) > 30.0
    assert form.agreement["clamped"].rms_relative < 5e-4
    return form


if __name__ == "__main__":
    for name, make in {"roof": roof, "sphere": sphere}.items():
        form = make()
        check(form)
        gaps = ", ".join(f"{ends} {100 * gap.rms_relative:.3f} %" for ends, gap in form.agreement.items())
        print(f"{name}: {len(form.footprint.rods)} rods, {len(form.meetings)} meet at the seam, gap rms {gaps}")
        if name in sys.argv[1:]:
            form.save(Path("out") / name)
