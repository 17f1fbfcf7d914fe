"""A slider: the spacing, heading, anchor or size changes a little, and the flat grid is there again at once.

Each update starts from the last one: `start=` says where to look for the net. The answer is the same as from nothing,
which the example checks; the pop-up of the whole form is found from the last one too.
"""

import time
from collections.abc import Callable

import numpy as np

import rodshell as rs

STEPS = 8
rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))

Design = tuple[rs.Target, rs.GridLayout, tuple[float, float]]


def design(
    *, spacing: float = 0.03, heading: float = 0.0, anchor: float = 0.0, radius: float = 0.2
) -> Design:  # m, rad, m, m
    """17 x 17 rods on a hemisphere, 5 mm edges."""
    layout = rs.GridLayout.orthogonal(rods=(17, 17), spacing=spacing, length=1.4, edge=0.005, rotate=heading)
    return rs.Hemisphere(radius=radius), layout, (anchor, 0.0)


sliders: dict[str, Callable[[float], Design]] = {
    "spacing": lambda t: design(spacing=0.03 + 0.001 * t),
    "heading": lambda t: design(heading=0.1 * t),
    "anchor": lambda t: design(anchor=0.01 * t),
    "size": lambda t: design(radius=0.2 + 0.005 * t),
}

target, layout, anchor = design()
first = rs.drape(layout, rod, target, anchor=anchor)
rs.map_back(rs.trim(first))
print("net, drape, trim and map back, 17 x 17 rods, 5 mm edges")
for name, at in sliders.items():
    draped, times = first, []
    for t in np.linspace(1 / STEPS, 1.0, STEPS):
        target, layout, anchor = at(float(t))
        begin = time.perf_counter()
        draped = rs.drape(layout, rod, target, anchor=anchor, warm_start=draped)
        footprint = rs.map_back(rs.trim(draped))
        times.append(time.perf_counter() - begin)
    afresh = rs.map_back(rs.trim(rs.drape(layout, rod, target, anchor=anchor)))
    assert [line.name for line in footprint.rods] == [line.name for line in afresh.rods]
    apart = float(np.abs(footprint.points - afresh.points).max())
    assert apart < 1e-9 * target.size  # the net's equations are solved to 1e-12
    print(f"{name:>8}: {1 / np.median(times):5.1f} updates a second, {apart:.0e} m from the answer found from nothing")

target, layout, anchor = design()
form = rs.find_form(target, layout, rod, anchor=anchor)
target, layout, anchor = design(spacing=0.0306)
again = rs.find_form(target, layout, rod, anchor=anchor, warm_start=form)
afresh = rs.find_form(target, layout, rod, anchor=anchor)
for ends, popped in again.popped.items():
    assert popped.report.stable
    assert np.abs(popped.positions - afresh.popped[ends].positions).max() < 1e-9 * target.size
