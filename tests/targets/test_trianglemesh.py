"""Triangle meshes: equal rows, creases and what is none, stray objects."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.targets.trianglemesh import sound_mesh, unique_rows
from tests.targets.meshes import Mesh, capped_sphere, sheet, strewn


@pytest.mark.parametrize("largest", [3, 1000, 5_000_000, 2**40])
def test_equal_rows_are_of_one_kind_however_large_their_numbers(largest):
    """The product of all ranges may exceed 64 bits."""
    rng = np.random.default_rng(0)
    rows = rng.integers(0, largest, (40, 4))[rng.integers(0, 40, 300)]
    rows[0] = largest
    first, kind = unique_rows(rows)
    expected, number = np.unique(rows, axis=0, return_inverse=True)
    assert len(first) == len(expected)
    assert np.array_equal(rows[first][kind], rows)
    assert len(set(zip(kind.tolist(), number.reshape(-1).tolist(), strict=True))) == len(expected)
    for one in range(len(first)):
        assert first[one] == np.flatnonzero(kind == one)[0]


def test_rows_that_a_key_of_64_bits_would_take_for_one_are_two():
    most = 2**32 - 1
    rows = np.array([[0, most, most], [1, 5, 7], [2, 5, 7], [1, 5, 7]])
    first, kind = unique_rows(rows)
    assert sorted(first.tolist()) == [0, 1, 2]
    assert kind[1] == kind[3] != kind[2]


def roof(x, y):
    return 0.2 * np.cos(x) * np.cos(y)


def rough() -> Mesh:
    """Strewn vertices, with many slivers, moved by some 5e-4 of the size: single edges turn by up to 100 degrees."""
    points, faces = strewn(roof, 1.0, 4000, seed=1)
    points[:, 2] += np.random.default_rng(0).normal(0, 5e-4, len(points))
    return points, faces


def without_area() -> Mesh:
    """Some faces are split at the middle of an edge, of which the neighbour does not know: between them is a third.

    The middle is rounded as in a file, so that its face has an area, and any normal."""
    points, faces = sheet(roof, 1.0, 15)
    points, faces = points.tolist(), faces.tolist()
    for a, b, c in faces[7:-30:9]:
        faces.remove([a, b, c])
        middle = len(points)
        points.append([round(0.5 * (p + q), 5) for p, q in zip(points[a], points[b], strict=True)])
        faces += [[a, middle, c], [middle, b, c], [a, b, middle]]
    return np.array(points), np.array(faces)


@pytest.mark.parametrize("make", [rough, without_area])
def test_slivers_noise_and_faces_without_area_are_no_creases(make):
    points, faces = make()
    mesh, repairs, *_ = sound_mesh(points, faces, "the mesh")
    assert repairs == []
    assert len(mesh.faces) == len(faces)


def test_a_crease_lined_with_slivers_is_one():
    """A half ball whose floor begins with a ring that is a thousandth of its radius wide."""
    ball, faces = capped_sphere(20, np.pi / 2)
    rim = np.flatnonzero(np.abs(ball[:, 2]) < 1e-12)
    ring, middle, after = np.arange(len(rim)) + len(ball), len(ball) + len(rim), np.roll(np.arange(len(rim)), -1)
    points = np.vstack([ball, 0.999 * ball[rim], [[0.0, 0.0, 0.0]]])
    strip = [[rim, ring, rim[after]], [rim[after], ring, ring[after]], [np.full(len(rim), middle), ring[after], ring]]
    faces = np.vstack([faces, *(np.column_stack(part) for part in strip)])
    mesh, repairs, _, creased, _ = sound_mesh(points, faces, "the mesh")
    assert mesh.vertices[:, 2].min() > -1e-12
    assert mesh.areas.sum() == pytest.approx(2 * np.pi, rel=2e-3)
    assert repairs == []
    assert "creases" in creased


def test_stray_objects_with_less_than_a_hundredth_of_the_area_are_left_out_whatever_they_are():
    points, faces = sheet(roof, 1.0, 20)
    corners = np.array([[2.0, 2, 0], [2.1, 2, 0], [2, 2.1, 0], [2, 2, 0.1], [2.1, 2.1, 0.1]])
    book = np.array([[0, 1, 2], [0, 1, 3], [0, 1, 4]])  # three leaves on one edge
    alone, *_ = sound_mesh(points, faces, "the mesh")
    mesh, repairs, *_ = sound_mesh(np.vstack([points, corners]), np.vstack([book + len(points), faces]), "the mesh")
    np.testing.assert_array_equal(mesh.vertices, alone.vertices)
    assert repairs == ["separate pieces with 0.42 % of the area were left out (3 faces)"]
    larger = 4 * corners - [9, 9, 9]
    with pytest.raises(rs.InputError, match=r"2 separate pieces \(the largest two have 94 and 6 %"):
        sound_mesh(np.vstack([points, larger]), np.vstack([faces, book + len(points)]), "the mesh")


def test_slivers_at_a_cut_do_not_turn_the_normals_at_its_edge():
    """A torus cut by two planes, one of which leaves slivers: the correction at the edge turned a normal by 90 deg."""
    import trimesh

    torus = trimesh.creation.torus(6.0, 2.0, major_sections=96, minor_sections=48)
    x, faces = torus.vertices, torus.faces
    for normal, origin in (([0.0, 0, 1], [0.0, 0, 0.8]), ([1.0, 0, 0], [1.0, 0, 0])):
        x, faces, *_ = trimesh.intersections.slice_faces_plane(x, faces, np.array(normal), np.array(origin))
    mesh = rs.Freeform.of(x, faces).surface
    exact = mesh.vertices * (1 - 6 / np.hypot(*mesh.vertices[:, :2].T))[:, None] * [1, 1, 0] + mesh.vertices * [0, 0, 1]
    cosine = (mesh.normals * exact).sum(axis=1) / np.linalg.norm(exact, axis=1)
    assert cosine.min() > np.cos(np.radians(20))
