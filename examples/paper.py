"""The paper's pipeline: rods dropped on a hemisphere, trimmed, mapped back, popped up, against the exact G0.

W. Huang, L. Qin, M. Khalid Jawed, J. Appl. Mech. 88 (2021). The paper's dome and rod [Eq 13a, section 3.2], on a wider
grid so that it runs in seconds. For another target change the first line, and the length so that rods hang over its
end; for the paper's grid, `rodshell paper fig6`. Linkers resist the scissoring of the net, more so on a coarse mesh
[docs/equations.md, E10]: the shell leaves the target, and on an ellipsoid the grid creeps on without friction.
"""

import numpy as np

import rodshell as rs

target = rs.Hemisphere(radius=0.2)  # Eq 13a; rs.Paraboloid(0.2, 0.12), rs.Ellipsoid(0.2, 0.15, 0.12), or a formula:
# rs.HeightField(function=lambda x, y: 0.1 - 2 * x**2 - 3 * y**2, domain=rs.Disc(0.18))
rod = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))  # Eqs 1a-c; G = E/3
layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, length=0.9)
exact = {line.name: line for line in rs.chebyshev_net(target, layout).rods}  # inextensible rods on the target

for joint in (rs.Ball(), rs.Linker()):  # Eq 5; Eq 6, with shared DOFs ("mapping", section 2.2)
    fallen = rs.drape(layout, rod, target, joint=joint, method=rs.Fall(height=0.05))  # Eqs 3, 4, 8-12, Algorithm 1
    trimmed = rs.trim(fallen)  # G, Fig 6(3)
    footprint = rs.map_back(trimmed)  # G0, Fig 6(4)
    popped = rs.pop_up(footprint, trimmed.boundary, rod, joint=joint, ends="pinned")  # Fig 1
    pairs = [(line, exact[line.name]) for line in footprint.rods]
    off = 1e3 * np.abs([(net.start - line.start, line.end - net.end) for line, net in pairs])
    print(f"{joint}: {fallen.report.sentence}, t = {fallen.rest.time:.1f} s, strain {fallen.report.max_strain:.2%}")
    print(f"  G0 off the exact one: at most {off.max():.2f} mm, median {np.median(off):.2f} mm")
    print(f"  popped up, {rs.agreement(popped, target)}")
    assert popped.report.stable
    assert fallen.rest.at_rest or fallen.warnings
