"""A section of one's own: bamboo strips, whose fibres lie closer together towards the skin.

E grows over the strip's depth, so that its axis lies off the middle: EA and EI are sums over the depth. Where E is the
same all over, the section is a rectangle, which the package has as well.
"""

import numpy as np

import rodshell as rs

DEPTH, WIDTH = 3e-3, 12e-3  # m
INSIDE, SKIN, SHEAR = 6e9, 22e9, 1e9  # Pa


def strip(inside: float, skin: float) -> rs.GivenSection:
    """A strip with its skin outwards; E grows linearly."""
    depth = (np.arange(1000) + 0.5) / 1000 * DEPTH
    stiffness = (inside + (skin - inside) * depth / DEPTH) * WIDTH * DEPTH / len(depth)  # E dA [N]
    axis = (stiffness @ depth) / stiffness.sum()
    return rs.GivenSection(
        EA=stiffness.sum(), EI1=stiffness @ (depth - axis) ** 2, EI2=stiffness.sum() * WIDTH**2 / 12,
        GJ=SHEAR * rs.RectangularSection(DEPTH, WIDTH).torsion_constant, mass=700 * DEPTH * WIDTH,
        fibre_distances=(max(axis, DEPTH - axis), WIDTH / 2), fibre_modulus=skin,
    )  # fmt: skip


layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.25, length="auto", edge=0.125)
target, mean = rs.Paraboloid(radius=1.0, height=0.5), (INSIDE + SKIN) / 2
wood = rs.Rod(rs.RectangularSection(DEPTH, WIDTH), rs.Material(mean, 700, shear=SHEAR))
even, graded = (rs.Rod(strip(*moduli)) for moduli in ((mean, mean), (INSIDE, SKIN)))
shells = [rs.find_form(target, layout, rod, ends="pinned", joint=rs.Pin()) for rod in (wood, even, graded)]
apart = [float(np.abs(each.popped["pinned"].positions - shells[0].popped["pinned"].positions).max()) for each in shells]
softer = graded.bend_stiffnesses[0] / even.bend_stiffnesses[0]
print(f"graded strips are {1 - softer:.1%} softer than even ones: the shell differs by {1e3 * apart[2]:.3f} mm")
assert apart[1] < 1e-6 < apart[2]
assert all(shell.popped["pinned"].report.stable for shell in shells)
