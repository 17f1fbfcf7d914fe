"""A support of one's own: rod ends that slide outwards against springs, as on posts that give way.

What a stiff spring carries is the push of the pinned shell on its support; softer ones give way, and carry less.
"""

import numpy as np

import rodshell as rs

rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=25e9, density=1900))
layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.045, length="auto", edge=0.015)
form = rs.find_form(rs.Hemisphere(radius=0.2), layout, rod, ends="pinned")
pinned, points = form.popped["pinned"], form.boundary.points
outwards = points * (1, 1, 0) / np.linalg.norm(points[:, :2], axis=1)[:, None]
nodes = form.footprint.mesh.ends.reshape(-1, 1)


def on_posts(k: float) -> rs.PopUp:
    """Ends that slide along `outwards` alone, against springs of stiffness k [N/m]."""
    springs = rs.LocalEnergy(nodes, lambda x: k / 2 * ((x[:, 0] - points) * outwards).sum(axis=1) ** 2)
    return rs.settle(pinned, springs, free={end: [way] for end, way in enumerate(outwards)})


push = -(pinned.equilibrium.gradient[nodes[:, 0]] * outwards).sum(axis=1)  # of the rods on their supports [N]
pushes = []
for k in (1e6, 1e3, 100.0):
    shell = on_posts(k)
    slid = ((shell.positions[nodes[:, 0]] - points) * outwards).sum(axis=1)
    print(f"k = {k:7g} N/m: ends slide by up to {1e3 * slid.max():6.3f} mm, springs push with {k * slid.sum():.2f} N")
    assert shell.report.stable
    pushes.append(k * slid)
assert np.allclose(pushes[0], push, rtol=0, atol=0.01 * push.max())
assert push.sum() > pushes[1].sum() > pushes[2].sum() > 0
