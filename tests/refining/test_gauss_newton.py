"""Least squares in a box, by the conditions that a minimum meets."""

import numpy as np
import pytest

from rodshell.refining.gauss_newton import _least_squares


@pytest.mark.parametrize("n", [1, 2, 5])
@pytest.mark.parametrize("reach", [0.05, 0.5, 50.0])
def test_nothing_near_is_better_than_the_step_in_a_box(n: int, reach: float) -> None:
    """The gradient points out of the box where a bound is reached, and vanishes elsewhere."""
    random = np.random.default_rng([n, round(100 * reach)])
    at_bounds = inside = 0
    for _ in range(30):
        matrix, right = random.standard_normal((n, n)) + 2.0 * np.eye(n), random.standard_normal(n)
        low, high = -reach * random.random(n), reach * random.random(n)
        step = _least_squares(matrix, right, low, high)
        gradient = matrix.T @ (matrix @ step - right) / np.linalg.norm(matrix) ** 2
        lowest, highest = step <= low + 1e-9 * reach, step >= high - 1e-9 * reach
        assert (step >= low - 1e-9 * reach).all()
        assert (step <= high + 1e-9 * reach).all()
        assert (gradient[lowest] > -1e-9).all()
        assert (gradient[highest] < 1e-9).all()
        np.testing.assert_allclose(gradient[~(lowest | highest)], 0.0, atol=1e-9)
        at_bounds, inside = at_bounds + int((lowest | highest).any()), inside + int(not (lowest | highest).all())
    assert at_bounds if reach < 1 else inside
