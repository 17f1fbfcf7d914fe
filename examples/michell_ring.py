"""A twisted ring leaves its plane: Michell's instability.

A straight rod is bent to a ring, twisted by some turns and glued. The ring stays plane up to a total twist of
2 pi sqrt(3) EI/GJ [Michell 1889]. A little more, and it jumps out, turns into an eight and, since nothing keeps this
rod from passing through itself, back into a ring: with two turns less.
"""

from math import pi, sqrt

import numpy as np

import rodshell as rs

EDGES, LENGTH = 80, 1.0  # m
rubber = rs.Rod(
    section=rs.Circle(radius=2e-3), material=rs.Material(youngs_modulus=2e6, density=1100, poisson_ratio=0.5)
)
critical = 2 * pi * sqrt(3) * rubber.bend_stiffness / rubber.twist_stiffness
print(f"EI/GJ = {rubber.bend_stiffness / rubber.twist_stiffness:.2f}: critical twist {critical / (2 * pi):.3f} turns")

angle = 2 * pi * np.arange(EDGES) / EDGES
circle = LENGTH / (2 * pi) * np.column_stack([np.cos(angle), np.sin(angle), np.zeros(EDGES)])
nudged = circle + 1e-3 * LENGTH * np.column_stack([0 * angle, 0 * angle, np.sin(2 * angle)])

lost = {}
for share in (0.9, 0.98, 1.02, 1.1):
    ring = rs.ElasticRod.of(circle, rubber, closed=True, natural_twist=share * critical / LENGTH)
    shape = rs.solve_rod(
        ring,
        rs.RodSupports(positions={0: None}, along={EDGES // 2: [(1, 0, 0)], EDGES // 4: [(1, 0, 0), (0, 1, 0)]}),
        start=ring.state(nudged),
        steps=4,
    )
    glued = share * critical / (2 * pi)
    left = glued - shape.strains.twist.mean() * LENGTH / (2 * pi)
    lost[share] = glued - left
    print(f"glued after {glued:.3f} turns, {share:.2f} of the critical twist: twist left {left:.3f} turns")
    assert shape.report.stable

assert np.allclose([lost[0.9], lost[0.98]], 0, atol=1e-6)
assert np.allclose([lost[1.02], lost[1.1]], 2, atol=1e-3)
