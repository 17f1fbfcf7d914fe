"""As many patches as a mesh's shape needs, whatever its triangles; how near they come is told."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.results.results import Results
from rodshell.results.summary import summary_text
from rodshell.targets import Freeform
from tests.targets.meshes import Floats, Mesh, sheet, strewn
from tests.targets.test_trianglemesh import roof, rough


def bump(x: Floats, y: Floats) -> Floats:
    """A dome of 10 m with a hump of 1 m: meshed by 33 x 33 vertices, its faces meet at up to 22.5 degrees."""
    return 2.5 - 0.05 * (x**2 + y**2) + np.exp(-((x - 1.3) ** 2 + (y + 0.7) ** 2) / 1.62)


def spot(x: Floats, y: Floats) -> Floats:
    return 0.3 * np.exp(-150 * (x**2 + y**2))


def split_in_four(points: Floats, faces: np.ndarray) -> Mesh:
    """The same polyhedron."""
    ends = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    edges, middle = np.unique(ends, axis=0, return_inverse=True)
    ab, bc, ca = len(points) + middle.reshape(3, -1)
    a, b, c = faces.T
    parts = (a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)
    return np.vstack([points, points[edges].mean(axis=1)]), np.vstack([np.column_stack(part) for part in parts])


COARSE = sheet(bump, 5.0, 33)


@pytest.mark.parametrize("mesh", [COARSE, split_in_four(*COARSE)], ids=["as it is", "split in four"])
def test_the_same_polyhedron_is_followed_whatever_its_triangles(mesh: Mesh) -> None:
    """33 x 33 vertices on the surface: .2 % of the size; on the middles of edges, too: .4 %, since chords lie below it.

    The first was refused: a patch was as wide as three edges."""
    target = Freeform.of(*mesh)
    x, y = np.random.default_rng(0).uniform(-4.8, 4.8, (2, 500))
    off = target.height_at(np.column_stack([x, y])) - bump(x, y)
    assert np.abs(off).max() < 5e-3 * target.size
    assert np.sqrt(np.mean(off**2)) < 1e-3 * target.size


def test_a_mesh_that_is_fine_only_where_it_curves_is_followed() -> None:
    """A spot of .2 m in a square of 2 m, in whose middle most vertices lie: 2.5e-3 measured; it was refused."""
    target = Freeform.of(*strewn(spot, 1.0, 3000, crowd=3.0))
    x, y = np.random.default_rng(0).uniform(-0.3, 0.3, (2, 500))
    assert np.abs(target.height_at(np.column_stack([x, y])) - spot(x, y)).max() < 4e-3 * target.size


def test_noise_is_not_followed() -> None:
    """Moved by 6e-4 of the size (rms), vertices are as far from the surface, which is nearer to the smooth one."""
    points, faces = sheet(lambda x, y: 0.3 * np.cos(x) * np.cos(y), 1.0, 60)
    smooth = points.copy()
    points[:, 2] += np.random.default_rng(0).normal(0, 6e-4, len(points))
    target = Freeform.of(points, faces)
    assert target._fitted.cubics < len(points) / 3
    assert 4e-4 < target.deviation.rms / target.size < 6e-4
    assert np.std(target.level(smooth)[0]) < 3e-4


def test_slivers_do_not_turn_the_normals_of_a_rough_mesh() -> None:
    """Of 4,000 strewn vertices, moved by 5e-4 of the size, the mesh was refused for some of its normals."""
    points, faces = rough()
    target = Freeform.of(points, faces)
    assert target.surface.normals[:, 2].min() > 0.6
    assert np.std(roof(*points[:, :2].T) - target.height_at(points[:, :2])) < 5e-4


def test_the_distance_of_the_vertices_is_the_targets_deviation() -> None:
    target = Freeform.of(*COARSE)
    off = np.abs(target.level(target.surface.vertices)[0])
    assert target.deviation == pytest.approx((off.max(), np.sqrt(np.mean(off**2))))
    assert rs.Hemisphere(1.0).deviation is None


def test_the_summary_says_how_far_the_surface_is_from_its_mesh() -> None:
    results = Results.of({"target": {"reference_size": 2.0, "deviation": {"max": 0.0123, "rms": 0.004}}})
    assert "target    smooth surface against the mesh: max 12.3 mm, rms 4.00 mm" in summary_text(results, verbose=True)
