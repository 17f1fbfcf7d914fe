"""Bounds of points against NumPy's own reduction."""

import numpy as np
import pytest

from rodshell.geometry.bounds import bounds


@pytest.mark.parametrize("shape", [(1, 2), (7, 3), (5000, 2)])
def test_bounds_are_the_lowest_and_highest_coordinates(shape: tuple[int, int]) -> None:
    points = np.random.default_rng(3).normal(size=shape)
    low, high = bounds(points)
    np.testing.assert_array_equal(low, points.min(axis=0))
    np.testing.assert_array_equal(high, points.max(axis=0))
