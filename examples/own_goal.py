"""A goal of one's own for a refinement: headroom about the middle, in addition to the gap to the target.

A goal is a row of small numbers, whose squares are added up, and their slopes (q, n) by the variables.
"""

import numpy as np

import rodshell as rs
from rodshell.refining.objectives import Gap
from rodshell.refining.refine import refine
from rodshell.refining.structure import Point

WANTED = 0.14  # m, within 60 mm of the axis
rod = rs.Rod(section=rs.RectangularSection(width=2e-3, height=4e-3), material=rs.Material(10e9, 600.0))
layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.05, length="auto", edge=0.025)
form = rs.find_form(rs.Paraboloid(radius=0.2, height=0.15), layout, rod, ends="pinned", joint=rs.Pin())
middle = np.flatnonzero(np.hypot(*form.footprint.mesh.flat[:, :2].T) < 0.06)


class Headroom:
    """How far nodes about the middle lie below the height wanted, over the size; zero where there is room."""

    def residuals(self, here: Point) -> np.ndarray:
        return np.maximum(WANTED - here.state[middle, 2], 0.0) / here.structure.target.size

    def slopes(self, here: Point) -> np.ndarray:
        low = here.state[middle, 2] < WANTED
        return -(here.response.motions[:, middle, 2] * low).T / here.structure.target.size


gap, room = refine(form.stages, "taper"), refine(form.stages, "taper", objectives=[Gap(), Headroom()])
lowest = [float(found.after.popped["pinned"].positions[middle, 2].min()) for found in (gap, room)]
print(f"for the gap alone: {1e3 * gap.gap_after.rms:.2f} mm rms, headroom {1e3 * lowest[0]:.1f} mm")
print(f"for both: {1e3 * room.gap_after.rms:.2f} mm rms, headroom {1e3 * lowest[1]:.1f} mm of {1e3 * WANTED:.0f}")
assert lowest[1] > lowest[0]
assert gap.gap_after.rms < room.gap_after.rms
