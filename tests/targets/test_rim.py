"""Signed distance to a rim against all its edges, and where it is known in closed form."""

import numpy as np
import pytest

from rodshell.targets.rim import Rim
from tests.targets.meshes import Floats


def flat(x: Floats) -> Floats:
    return np.asarray(x * [1, 1, 0])


def up(x: Floats) -> Floats:
    return np.tile([0.0, 0.0, 1.0], (len(x), 1))


def ring(radius: float, count: int = 40) -> Floats:
    angle = np.arange(count) * 2 * np.pi / count
    return np.column_stack([radius * np.cos(angle), radius * np.sin(angle), 0 * angle])


def test_between_two_circles_it_is_the_nearer_one_that_counts():
    rim = Rim.of([ring(1.0), ring(0.3)[::-1]], flat, up)
    r, angle = np.meshgrid(np.linspace(0.05, 1.4, 60), np.linspace(0, 6.2, 31))
    r, angle = r.ravel(), angle.ravel()
    x = np.column_stack([r * np.cos(angle), r * np.sin(angle), 0 * r])
    assert rim.distance(x) == pytest.approx(np.minimum(1 - r, r - 0.3), abs=2e-5)


def test_at_corners_it_is_signed_as_between_both_edges():
    """A square: inside by the nearest side; outside beside a corner by the way to it, seen along the bisector."""
    corner = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]], dtype=float)
    rim = Rim.of([corner], flat, up)
    x, y = np.random.default_rng(0).uniform(-0.99, 0.99, (2, 500))
    inside = np.column_stack([x, y, 0 * x])
    assert rim.distance(inside) == pytest.approx(1 - np.maximum(np.abs(x), np.abs(y)), abs=1e-12)
    beyond = np.array([[1.3, 1.1, 0.0], [-1.2, -1.2, 0.0]])
    bisector = np.sqrt(0.5)
    assert rim.distance(beyond) == pytest.approx([-(0.3 + 0.1) * bisector, -(0.2 + 0.2) * bisector], rel=1e-12)


def test_in_any_order_of_points_the_nearest_edge_is_that_of_all_edges():
    """A curve that comes close to itself, points at random: the last point's edge misleads none."""
    t = np.linspace(0, 2 * np.pi, 300, endpoint=False)
    curve = np.column_stack([(1 + 0.7 * np.cos(5 * t)) * np.cos(t), (1 + 0.7 * np.cos(5 * t)) * np.sin(t), 0 * t])
    rim = Rim.of([curve], flat, up)
    x = np.random.default_rng(1).uniform(-1.8, 1.8, (400, 3)) * [1, 1, 0.1]
    a, b = rim.points, rim.points[rim.after]
    along = b - a
    share = np.clip(np.einsum("nki,ki->nk", x[:, None] - a, along) / np.einsum("ki,ki->k", along, along), 0, 1)
    off = x[:, None] - a - share[..., None] * along
    away = np.linalg.norm(off, axis=2)
    edge = np.argmin(away, axis=1)
    pick = np.arange(len(x))
    within = (share[pick, edge] > 0) & (share[pick, edge] < 1)
    exact = np.einsum("ni,ni->n", off[pick, edge], rim.inward[edge])
    assert within.mean() > 0.8
    assert rim.distance(x)[within] == pytest.approx(exact[within], abs=1e-12)
