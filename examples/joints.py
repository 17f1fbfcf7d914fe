"""What the joints do to the popped-up shape: from free scissors to welded, on two targets.

The paper leaves open how the mechanics of the joints shape a rodshell (section 3.4). The rods of a net scissor as
they pop up, by 50 degrees at the hemisphere's rim, and a joint that resists this draws the shell away from its
target. Joints here are rigid out of plane and in twist, with a shear stiffness k about their normal from 0 to rigid;
what counts is k over EI / spacing, the stiffness of a rod between two joints.
"""

from math import inf

import numpy as np

import rodshell as rs

SPACING = 0.04
rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
layout = rs.GridLayout.orthogonal(rods="auto", spacing=SPACING, length="auto", edge=0.01)
span = rod.bend_stiffness / SPACING  # N m/rad
RATIOS = (0.0, *10.0 ** np.arange(-3.0, 3.5, 1.0), inf)

print("rms gap to the target over its size, % (unstable states marked *)")
print(f"{'k spacing/EI':>14}" + "".join(f"{name:>22}" for name in ("hemisphere", "ellipsoid")))
print(f"{'ends':>14}" + f"{'pinned':>11}{'clamped':>11}" * 2)
gaps = {}
for ratio in RATIOS:
    row = f"{ratio:14g}"
    for name, target in (("hemisphere", rs.Hemisphere(radius=0.2)), ("ellipsoid", rs.Ellipsoid(a=0.2, b=0.15, c=0.12))):
        trimmed = rs.trim(rs.drape(layout, rod, target))
        footprint = rs.map_back(trimmed)
        for ends in ("pinned", "clamped"):
            joint = rs.Spring(shear=ratio * span if ratio < inf else inf, out_of_plane=inf, twist=inf)
            popped = rs.pop_up(footprint, trimmed.boundary, rod, ends=ends, joint=joint)
            assert popped.report.converged
            gaps[name, ends, ratio] = rs.agreement(popped, target).rms_relative
            row += f"{100 * gaps[name, ends, ratio]:10.4f}{' ' if popped.report.stable else '*'}"
    print(row, flush=True)

for name in ("hemisphere", "ellipsoid"):
    for ends in ("pinned", "clamped"):
        gap = {ratio: gaps[name, ends, ratio] for ratio in RATIOS}
        assert abs(gap[1e-3] - gap[0.0]) < 1e-2 * gap[0.0] + 1e-5  # soft in shear: a pin
        assert abs(gap[1e3] - gap[inf]) < 0.02 * gap[inf]  # stiff in shear: welded
        assert gap[inf] > 1.2 * gap[0.0]  # and welded is another shape
