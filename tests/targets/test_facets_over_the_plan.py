"""The uppermost facet over points of the plan: the one that a comparison of all with all finds, at a fraction of it."""

import numpy as np
import pytest

import rodshell as rs
from tests.targets.meshes import Floats, capped_sphere, sheet, strewn


def one_by_one(target: rs.Freeform, xy: Floats) -> Floats:
    """z (n,) of the uppermost facet: every facet is compared with every point."""
    a, b, c = target.surface.vertices[target.surface.faces.T]
    z = np.full(len(xy), np.nan)
    for n, (x, y) in enumerate(xy.tolist()):
        wedge = np.stack(
            [(p[:, 0] - x) * (q[:, 1] - y) - (p[:, 1] - y) * (q[:, 0] - x) for p, q in ((b, c), (c, a), (a, b))]
        )
        total = wedge.sum(axis=0)
        over = ((wedge >= 0).all(axis=0) | (wedge <= 0).all(axis=0)) & (total != 0)
        heights = (wedge * [a[:, 2], b[:, 2], c[:, 2]]).sum(axis=0)[over] / total[over]
        z[n] = heights.max() if len(heights) else np.nan
    return z


MESHES = {
    "even": sheet(lambda x, y: 1 - 0.3 * x**2 - 0.2 * y**2, 1.0, 30),
    "of any size, some of them slivers": strewn(lambda x, y: 1 - 0.3 * x**2, 1.0, 800, crowd=3.0),
    "with an overhang": capped_sphere(14, 2.5),
}


@pytest.mark.parametrize("name", MESHES)
def test_heights_are_those_of_all_facets_compared_bit_for_bit(name):
    target = rs.Freeform.of(*MESHES[name])
    x, faces = target.surface.vertices, target.surface.faces
    inside = np.random.default_rng(0).uniform(-1.2, 1.2, (200, 2))
    xy = np.vstack([inside, x[::9, :2], 0.5 * (x[faces[::9, 0], :2] + x[faces[::9, 1], :2]), [[np.nan, 0.0]]])
    found = target._heights_of_facets(xy)
    np.testing.assert_array_equal(found, one_by_one(target, xy))
    assert 0 < np.isnan(found).sum() < len(xy)
