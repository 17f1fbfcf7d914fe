"""A strip with natural curvature and twist coils into its helix, and a pull draws it out again.

Curvature kappa and twist tau per unit length make a helix of radius kappa / (kappa^2 + tau^2) and pitch
2 pi tau / (kappa^2 + tau^2).
"""

from math import pi

import numpy as np

import rodshell as rs

EDGES, LENGTH, KAPPA, TAU = 160, 0.6, 40.0, 15.0  # m, 1/m, rad/m
strip = rs.Rod(
    section=rs.RectangularSection(width=0.2e-3, height=1e-3),
    material=rs.Material(youngs_modulus=200e9, density=7850, poisson_ratio=0.3),
)
nodes = np.linspace((0, 0, 0), (0, 0, LENGTH), EDGES + 1)
rod = rs.ElasticRod.of(nodes, strip, natural=(KAPPA, 0), natural_twist=TAU, clamped={"start": (0, 0, 1)})

coiled = rs.solve_rod(rod, steps=20)
edges = np.diff(coiled.positions, axis=0)
turning = np.cross(edges[1] - edges[0], edges[2] - edges[1])
axis = turning / np.linalg.norm(turning)
across = edges - np.outer(edges @ axis, axis)
step = np.arccos(across[0] @ across[1] / (across[0] @ across[0]))
radius = np.linalg.norm(across[0]) / (2 * np.sin(step / 2))
pitch = 2 * pi * (edges[0] @ axis) / step
print(f"radius {1e3 * radius:.3f} mm (exact {1e3 * KAPPA / (KAPPA**2 + TAU**2):.3f} mm)")
print(f"pitch  {1e3 * pitch:.3f} mm (exact {1e3 * 2 * pi * TAU / (KAPPA**2 + TAU**2):.3f} mm)")
print(f"energy left {coiled.energy / rod.energy(rod.state()):.1e} of the straight strip's")

reach = (coiled.positions[-1] - coiled.positions[0]) @ axis
drawn = rs.solve_rod(coiled.rod, loads=rs.RodLoads(forces={-1: 0.05 * axis}), start=coiled, steps=4)
longer = (drawn.positions[-1] - drawn.positions[0]) @ axis
print(f"a pull of 50 mN draws it from {1e3 * reach:.1f} to {1e3 * longer:.1f} mm")

assert np.isclose(radius, KAPPA / (KAPPA**2 + TAU**2), rtol=5e-3)
assert np.isclose(pitch, 2 * pi * TAU / (KAPPA**2 + TAU**2), rtol=5e-3)
assert coiled.energy < 1e-12 * rod.energy(rod.state())
assert longer > 1.02 * reach
assert drawn.report.stable
