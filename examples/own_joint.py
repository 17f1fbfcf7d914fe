"""A joint law of one's own: the further the rods at a joint scissor from flat, the stiffer the joint gets.

The moment K phi + C phi^3 against a turn phi is the slope of K phi^2 / 2 + C phi^4 / 4. Without C it is a spring in
shear, which the package has as well; with it the rods scissor less, and the moments at a joint still balance.
"""

import numpy as np

import rodshell as rs

SPACING = 0.045  # m
rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=25e9, density=1900))
layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=SPACING, length="auto", edge=0.005)
form = rs.find_form(rs.Ellipsoid(a=0.2, b=0.16, c=0.14), layout, rod, ends="pinned")
free, mesh = form.popped["pinned"], form.footprint.mesh
around = mesh.rod_nodes[mesh.beside_crossings].reshape(-1, 4)  # before and after each joint, on both of its rods
K = 0.1 * rod.bend_stiffness / SPACING  # N m/rad


def turns(x: np.ndarray) -> np.ndarray:
    """By which rods through nodes x (m, 4, 3) have turned against each other since they were flat, at right angles."""
    first, second = x[:, 1] - x[:, 0], x[:, 3] - x[:, 2]
    lengths = np.sqrt((first * first).sum(axis=1) * (second * second).sum(axis=1))
    return np.arccos((first * second).sum(axis=1) / lengths) - np.pi / 2


def law(c: float) -> rs.LocalEnergy:
    return rs.LocalEnergy(around, lambda x: K * turns(x) ** 2 / 2 + c * turns(x) ** 4 / 4)


spring = rs.pop_up(form.footprint, form.boundary, rod, ends="pinned", joint=rs.Spring(shear=K))
soft, hard = rs.settle(free, law(0.0)), rs.settle(free, law(10 * K))
for name, shell in (("free", free), ("K", soft), ("K, C = 10 K", hard)):
    print(f"{name:>11}: rods turn by up to {np.degrees(np.abs(turns(shell.positions[around])).max()):.2f} degrees")
    assert shell.report.stable
moved = np.abs(spring.positions - free.positions).max()
assert np.abs(soft.positions - spring.positions).max() < 0.02 * moved
assert np.abs(turns(hard.positions[around])).max() < np.abs(turns(soft.positions[around])).max()
