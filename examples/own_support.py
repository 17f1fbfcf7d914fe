"""A support of one's own: rod ends that slide outwards against springs, as on posts that give way.

What stiff posts carry is the push of the pinned shell on its supports; softer ones give way, and carry less.
"""

from dataclasses import dataclass

import numpy as np

import rodshell as rs


def outwards(points):
    return points * (1, 1, 0) / np.linalg.norm(points[:, :2], axis=1)[:, None]


@dataclass(frozen=True)
class Posts(rs.Support):
    stiffness: float = 1e3  # N/m

    def free(self, points):
        return {end: [way] for end, way in enumerate(outwards(points))}

    def energies(self, ends, points):
        ways = outwards(points)
        return [rs.LocalEnergy(ends[:, None], lambda x: self.stiffness / 2 * ((x[:, 0] - points) * ways).sum(1) ** 2)]

    def figures(self, moved, forces):  # in result.json, in the summary and in the report
        return {**super().figures(moved, forces), "work of the posts": (-np.sum(moved * forces) / 2, "J")}


rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=25e9, density=1900))
layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.045, length="auto", edge=0.015)
form = rs.find_form(rs.Hemisphere(0.2), layout, rod, ends=["pinned", Posts("stiff", stiffness=1e6), Posts("soft")])
print(form.summary())
push = {name: -np.sum(held.forces * outwards(form.boundary.points)) for name, held in form.checks.reactions.items()}
assert all(popped.report.stable for popped in form.popped.values())
assert np.isclose(push["stiff"], push["pinned"], rtol=1e-3)
assert push["pinned"] > push["soft"] > 0
