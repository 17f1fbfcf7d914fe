"""Neighbours in a lattice of cells against looking at every pair."""

import numpy as np
import pytest

from rodshell.targets.smooth_field import CellList
from tests.targets.meshes import Floats


def surface(count: int = 400) -> Floats:
    x, y = np.random.default_rng(0).uniform(-1, 1, (2, count))
    return np.column_stack([x, y, 0.4 * x * y])


def places() -> Floats:
    """Near the surface, off it, and far outside on every side."""
    rng = np.random.default_rng(1)
    return np.vstack(
        [surface(100) + rng.normal(0, 0.1, (100, 3)), rng.uniform(-3, 3, (60, 3)), 40 * np.eye(3), [[-9] * 3]]
    )


def apart(x: Floats, points: Floats) -> Floats:
    return np.asarray(np.linalg.norm(x[:, None] - points, axis=2))


@pytest.mark.parametrize("cell", [0.03, 0.1, 0.7, 5.0])
@pytest.mark.parametrize("count", [1, 7])
def test_the_nearest_are_those_of_all_pairs(cell, count):
    points, x = surface(), places()
    exact = apart(x, points)
    distance, index = CellList.of(points, cell).nearest(x, count)
    assert np.array_equal(index, np.argsort(exact, axis=1)[:, :count])
    assert distance == pytest.approx(np.sort(exact, axis=1)[:, :count], rel=1e-14)


def test_up_to_a_limit_the_nearest_are_found_and_what_is_no_point_has_none():
    points, x = surface(), places()
    exact = apart(x, points).min(axis=1)
    distance = CellList.of(points, 0.05).nearest(x, limit=0.2)[0][:, 0]
    near = exact <= 0.2
    assert 20 < near.sum() < len(x) - 20
    assert distance[near] == pytest.approx(exact[near], rel=1e-14)
    assert (distance[~near] > 0.2).all()
    assert CellList.of(points, 0.05).nearest(np.array([[np.nan, 0.0, 0.0]]))[0] == np.inf


@pytest.mark.parametrize("radius", [0.01, 0.15, 0.6])
def test_lists_within_a_radius_are_those_of_all_pairs(radius):
    points, x = surface(), places()
    exact = apart(x, points)
    for ordered in (False, True):
        begin, near, away = CellList.of(points, 0.1).within(x, radius, ordered=ordered)
        assert begin[0] == 0
        assert begin[-1] == len(near) == len(away) == np.count_nonzero(exact <= radius)
        for n in range(len(x)):
            here = slice(begin[n], begin[n + 1])
            assert set(near[here]) == set(np.flatnonzero(exact[n] <= radius))
            assert away[here] == pytest.approx(exact[n, near[here]], rel=1e-14)
            assert not ordered or (np.diff(away[here]) >= 0).all()


def test_spread_points_are_apart_and_every_other_is_near_one():
    points = surface()
    chosen = CellList.of(points, 0.1).spread(0.1)
    own = apart(points[chosen], points[chosen]) + np.eye(len(chosen))
    assert own.min() > 0.1
    assert apart(points, points[chosen]).min(axis=1).max() <= 0.1
    assert chosen[0] == 0  # the first comes first: rims lie there


def test_points_along_a_line_get_wider_cells_and_no_more_of_them():
    points = np.column_stack([np.linspace(0, 1, 50), np.linspace(0, 1, 50), np.linspace(0, 1, 50)])
    cells = CellList.of(points, 1e-3)
    assert np.prod(cells.shape) <= 64 * 50
    assert np.array_equal(cells.nearest(points)[1][:, 0], np.arange(50))
