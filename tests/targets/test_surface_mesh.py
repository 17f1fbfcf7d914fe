"""Triangles of a target: they lie on it, cover it, and end where it ends."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.arrays import Floats, Ints
from rodshell.targets.surface_mesh import surface_mesh


def area(points: Floats, faces: Ints) -> float:
    a, b, c = (points[faces[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def outer_edges(faces: Ints) -> Ints:
    """Edges with one triangle only."""
    edges = np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1)
    found, count = np.unique(edges, axis=0, return_counts=True)
    return found[count == 1]


def test_a_cap_is_covered_to_its_rim() -> None:
    cap = rs.Cap(radius=0.2, base=0.1)
    around = cap.lift(np.array([[-0.17, 0.0], [0.17, 0.0], [0.0, 0.17], [0.0, -0.17]]))
    points, faces = surface_mesh(cap, around)
    np.testing.assert_allclose(np.linalg.norm(points, axis=1), 0.2, atol=1e-9)
    assert area(points, faces) == pytest.approx(2 * np.pi * 0.2 * 0.1, rel=2e-3)
    np.testing.assert_allclose(cap.margin(points[np.unique(outer_edges(faces))]), 0.0, atol=1e-5)


def test_every_triangle_has_three_corners_and_looks_up() -> None:
    bumps = rs.HeightField(formula="0.1*(1 - x^2 - y^2)*(1.2 + cos(4*x))", domain=rs.Disc(0.9))
    points, faces = surface_mesh(bumps, bumps.lift(np.array([[-0.8, 0.0], [0.8, 0.0], [0.0, 0.8], [0.0, -0.8]])))
    assert np.isfinite(points).all()
    a, b, c = (points[faces[:, k]] for k in range(3))
    assert (np.cross(b - a, c - a)[:, 2] >= 0).all()
    np.testing.assert_allclose(bumps.margin(points[np.unique(outer_edges(faces))]), 0.0, atol=1e-4)


def test_the_whole_of_a_target_is_shown_however_small_the_shell_on_it() -> None:
    dome = rs.Hemisphere(0.2)
    points, faces = surface_mesh(dome, dome.lift(np.array([[0.05, 0.0], [0.09, 0.0], [0.07, 0.02]])))
    assert area(points, faces) == pytest.approx(2 * np.pi * 0.2**2, rel=2e-3)


def test_an_l_shaped_roof_is_whole_with_its_corners_though_the_shell_covers_one_leg() -> None:
    x, y = np.meshgrid(np.linspace(0, 14, 57), np.linspace(-9, 5, 57), indexing="ij")
    corners = np.column_stack([x.ravel(), y.ravel(), 3 + 0.8 * np.sin(x.ravel() / 4) * np.cos(y.ravel() / 5)])
    index = np.arange(len(corners)).reshape(x.shape)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    triangles = np.concatenate([np.column_stack([a, b, c]), np.column_stack([a, c, d])])
    middle = corners[triangles].mean(axis=1)
    used, roof = np.unique(triangles[(middle[:, 1] > 0) | (middle[:, 0] < 5)], return_inverse=True)
    target = rs.Freeform.of(corners[used], roof.reshape(-1, 3))
    points, faces = surface_mesh(target, target.lift(np.array([[1.0, 1.0], [4.0, 1.0], [4.0, 4.0], [1.0, 4.0]])))
    assert area(points, faces) == pytest.approx(area(corners[used], roof.reshape(-1, 3)), rel=1e-3)
    edge = points[np.unique(outer_edges(faces))]
    np.testing.assert_allclose(target.margin(edge), 0.0, atol=2e-3)
