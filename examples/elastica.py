"""A cantilever under an end load: Euler's elastica, its tip turned by 80 degrees.

The exact tip is known in elliptic integrals [Bisshopp and Drucker 1945]. The error falls to a quarter each time
the edges are halved.
"""

from math import asin, pi, radians, sin, sqrt

import numpy as np
from scipy.special import ellipeinc, ellipkinc

import rodshell as rs

LENGTH = 0.5  # m
wire = rs.Rod(
    section=rs.Circle(radius=0.2e-3), material=rs.Material(youngs_modulus=200e9, density=7850, poisson_ratio=0.3)
)

# exact: the load that turns the tip by 80 degrees, and where the tip then is
turn = radians(80)
k = sqrt((1 + sin(turn)) / 2)
phi = asin(1 / (k * sqrt(2)))
alpha = ellipkinc(pi / 2, k**2) - ellipkinc(phi, k**2)
load = alpha**2 * wire.bend_stiffness / LENGTH**2
exact = LENGTH * np.array(
    [sqrt(2 * sin(turn)) / alpha, 0, -1 + 2 / alpha * (ellipeinc(pi / 2, k**2) - ellipeinc(phi, k**2))]
)
print(f"load {load:.4f} N turns the tip by 80 degrees and brings it to x = {exact[0]:.5f} m, z = {exact[2]:.5f} m")

errors = []
for edges in (40, 80, 160):
    nodes = np.linspace((0, 0, 0), (LENGTH, 0, 0), edges + 1)
    rod = rs.ElasticRod.of(nodes, wire, clamped={"start": (1, 0, 0)})
    shape = rs.solve_rod(rod, loads=rs.RodLoads(forces={-1: (0, 0, -load)}))
    errors.append(np.linalg.norm(shape.positions[-1] - exact))
    print(f"{edges:4d} edges: tip off by {1e3 * errors[-1]:.4f} mm, {shape.report.iterations} iterations")

rate = np.log2(errors[0] / errors[2]) / 2
force, moment = shape.support("start")
print(f"order of convergence {rate:.2f}; the clamp carries {force[2]:.4f} N and {moment[1]:.5f} N m")

assert abs(rate - 2) < 0.1
assert errors[-1] < 1e-4 * LENGTH
assert np.isclose(force[2], load)
assert np.isclose(moment[1], -load * exact[0], rtol=1e-3)
