"""An energy of one's own: a dome that is blown up.

The work of a pressure is the pressure times the volume below the skin: of each triangle, its plan area times its mean
height. What the supports then carry in sum is known without any shell: the pressure times the plan area within its rim.
"""

import numpy as np
from scipy.spatial import ConvexHull, Delaunay

import rodshell as rs

PRESSURE = 200.0  # Pa
rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=25e9, density=1900))
layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.045, length="auto", edge=0.015)
form = rs.find_form(rs.Hemisphere(radius=0.2), layout, rod, ends="pinned")
dome, flat = form.popped["pinned"], form.footprint.mesh.flat[:, :2]


def less_work(x: np.ndarray) -> np.ndarray:
    """Of triangles with the corners x (m, 3, 3) [J]."""
    first, second = x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]
    area = 0.5 * (first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0])
    return -PRESSURE * area * x[:, :, 2].mean(axis=1)


skin = rs.LocalEnergy(Delaunay(flat).simplices, less_work)
blown = rs.settle(dome, skin)
before, after = (-less_work(shell.positions[skin.blocks]).sum() / PRESSURE for shell in (dome, blown))
carries = -blown.equilibrium.gradient[:, 2].sum()
print(
    f"the volume grows by {100 * (after / before - 1):.2f} %, and the supports hold the dome down with {carries:.4f} N"
)
rim = dome.positions[ConvexHull(flat).vertices, :2]
assert blown.report.stable
assert after > before
assert np.isclose(carries, PRESSURE * ConvexHull(rim).volume, rtol=1e-9)
