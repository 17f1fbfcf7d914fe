"""A load of one's own: sand that was heaped over a dome in a cone, as for a test to failure.

What acts is the weight of the sand over each node's part of the plan; its sum is the volume of the cone.
"""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

import rodshell as rs

REACH = 0.15  # m, the cone's radius
PEAK = 20.0  # Pa in its middle


@dataclass(frozen=True)
class HeapedSand:
    """A cone of sand on the plan, about the axis."""

    lasting: ClassVar = "short"
    peak: float  # Pa

    def forces(self, nodes):
        """(n, 3) [N]."""
        away = np.linalg.norm(nodes.tributary.plan_positions, axis=1)
        return nodes.downwards(self.peak * np.maximum(1 - away / REACH, 0.0) * nodes.tributary.plan)


rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=25e9, density=1900))
layout = rs.GridLayout.orthogonal(rods=(13, 13), spacing=0.032, length="auto", edge=0.016)
form = rs.find_form(rs.Hemisphere(radius=0.2), layout, rod, ends="clamped")
loads = rs.Loads(loads={"sand": HeapedSand(PEAK)}, combinations={"heap": {"sand": 1.0}})
found = rs.check_loads(form, loads).shells["heap"]["clamped"]
weight = PEAK * np.pi * REACH**2 / 3
print(f"{weight:.3f} N of sand: the dome sinks by up to {1e3 * found.max_deflection:.2f} mm")
assert np.isclose(found.load_sum[2], -weight, rtol=0.01)
assert np.isclose(found.reaction_sum[2], weight, rtol=0.01)
