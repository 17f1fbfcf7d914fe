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


rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=25e9, density=1900))
layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.045, length="auto", edge=0.015)
ends = ["pinned", Posts("stiff", stiffness=1e6), Posts("posts"), Posts("soft", stiffness=100.0)]
form = rs.find_form(rs.Hemisphere(radius=0.2), layout, rod, ends=ends)
ways = outwards(form.boundary.points)
push = {name: -(found.forces * ways).sum(axis=1) for name, found in form.checks.reactions.items()}  # of each end [N]
for name, forces in push.items():
    print(f"{name:>6}: the rods push with {forces.sum():.2f} N; {form.popped[name]}")
    assert form.popped[name].report.stable
assert np.allclose(push["stiff"], push["pinned"], rtol=0, atol=0.01 * push["pinned"].max())
assert push["pinned"].sum() > push["posts"].sum() > push["soft"].sum() > 0
