"""Points of NURBS surfaces against closed forms."""

import numpy as np
import pytest

from rodshell.targets.nurbs import Nurbs


@pytest.mark.parametrize("degree", [1, 2, 3, 5])
def test_greville_abscissae_as_control_points_give_the_parameters(degree):
    """On knots of any multiplicity, up to both ends."""
    knots = np.concatenate([[0.0] * (degree + 1), [0.3, 0.5, 0.5, 0.9], [2.0] * (degree + 1)])
    greville = np.array([knots[k + 1 : k + degree + 1].mean() for k in range(len(knots) - degree - 1)])
    controls = np.ones((len(greville), len(greville), 4))
    controls[..., 0], controls[..., 1] = greville[:, None], greville
    u, v = np.meshgrid(np.linspace(0, 2, 41), np.linspace(0, 2, 17))
    found = Nurbs((degree, degree), (knots, knots), controls).at(u, v)
    np.testing.assert_allclose(found, np.stack([u, v, np.ones_like(u)], axis=-1), atol=1e-14)


def test_a_cubic_spline_is_that_of_its_truncated_powers():
    """On uniform knots B(t) = sum (-1)^k C(4, k) (t - k)+^3 / 6."""
    t = np.linspace(3, 4, 11)
    for k in range(4):
        controls = np.ones((4, 2, 4)) * np.array([1.0, 1.0, 0.0, 1.0])
        controls[k, :, 2] = 1.0
        surface = Nurbs((3, 1), (np.arange(8.0), np.array([0.0, 0.0, 1.0, 1.0])), controls)
        powers = sum(c * np.maximum(t - k - j, 0) ** 3 for j, c in enumerate((1, -4, 6, -4, 1))) / 6
        assert surface.at(t, np.full(11, 0.5))[:, 2] == pytest.approx(powers, abs=1e-14)


def test_a_rational_surface_lies_on_its_torus():
    """Circles of four quadratic arcs around the tube and around the axis; knots that are not clamped would end it."""
    root = np.sqrt(0.5)
    circle = np.array([[1, 0], [1, 1], [0, 1], [-1, 1], [-1, 0], [-1, -1], [0, -1], [1, -1], [1, 0]], dtype=float)
    weight = np.array([1, root, 1, root, 1, root, 1, root, 1])
    knots = np.array([0, 0, 0, 1, 1, 2, 2, 3, 3, 4, 4, 4], dtype=float)
    r, z = 3 + circle[:, 0], circle[:, 1]
    x = np.stack(np.broadcast_arrays(r[:, None] * circle[:, 0], r[:, None] * circle[:, 1], z[:, None]), axis=2)
    w = weight[:, None] * weight
    torus = Nurbs((2, 2), (knots, knots), np.concatenate([w[..., None] * x, w[..., None]], axis=2))
    points, faces = torus.triangles()
    assert np.hypot(np.hypot(points[:, 0], points[:, 1]) - 3, points[:, 2]) == pytest.approx(1.0, abs=1e-14)
    assert len(faces) == 2 * (round(len(points) ** 0.5) - 1) ** 2
