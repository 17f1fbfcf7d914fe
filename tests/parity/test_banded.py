"""The banded LDL^T against dense and LAPACK solvers, on chains, rings and random narrow patterns."""

import numpy as np
import pytest
from scipy.linalg import solveh_banded
from scipy.sparse import csc_matrix, triu

from gridshell.solve.banded import WIDEST, Banded, narrow_or_sparse
from gridshell.solve.linear import Qdldl, SingularError


def narrow(rng, size, width, *, shuffled=False, ring=False, shift=0.0):
    """A random symmetric matrix of the half bandwidth `width`, dense."""
    matrix = np.zeros((size, size))
    for apart in range(width + 1):
        i = np.arange(size if ring else size - apart)
        values = rng.normal(size=len(i))
        matrix[i, (i + apart) % size] = matrix[(i + apart) % size, i] = values
    matrix += shift * np.eye(size)
    order = rng.permutation(size) if shuffled else np.arange(size)
    return matrix[np.ix_(order, order)]


def stored(matrix, **options):
    """The solver of a dense matrix, and its values in the pattern."""
    upper = csc_matrix(triu(csc_matrix(matrix)))
    upper.sort_indices()
    return Banded(upper.indptr.astype(np.int64), upper.indices.astype(np.int64), **options), upper.data


CASES = {
    "chain": {},
    "shuffled": {"shuffled": True},
    "ring": {"ring": True},
    "ring, shuffled": {"ring": True, "shuffled": True},
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("width", [1, 4, 10])
def test_solution_and_inertia_are_those_of_numpy(case, width):
    rng = np.random.default_rng(width)
    for shift in (-30.0, 1.0, 30.0):
        matrix = narrow(rng, 60, width, shift=shift, **CASES[case])
        solver, data = stored(matrix)
        right = rng.normal(size=60)
        assert solver.factor(data) == np.count_nonzero(np.linalg.eigvalsh(matrix) < 0)
        # 1e-8: without pivoting an indefinite matrix may lose digits; 2e-11 is the worst seen here
        np.testing.assert_allclose(solver.solve(right), np.linalg.solve(matrix, right), rtol=1e-8, atol=1e-10)


def test_reordering_narrows_a_shuffled_band_to_about_its_width():
    rng = np.random.default_rng(0)
    solver, _ = stored(narrow(rng, 300, 4, shuffled=True))
    assert solver.half_bandwidth <= 8
    ring, _ = stored(narrow(rng, 300, 4, shuffled=True, ring=True))
    assert ring.half_bandwidth <= 16  # both arms of a ring side by side


def test_given_order_is_used():
    rng = np.random.default_rng(0)
    matrix = narrow(rng, 50, 3, shift=20.0)
    order = np.arange(50)[::-1]
    solver, data = stored(matrix, order=order)
    solver.factor(data)
    right = rng.normal(size=50)
    assert solver.half_bandwidth == 3
    np.testing.assert_allclose(solver.solve(right), np.linalg.solve(matrix, right), rtol=1e-12)


def test_positive_band_is_solved_as_by_lapack():
    rng = np.random.default_rng(1)
    matrix = narrow(rng, 2000, 10, shift=40.0)
    solver, data = stored(matrix, refined=False)
    right = rng.normal(size=2000)
    band = np.array([np.append(np.diagonal(matrix, k), np.zeros(k)) for k in range(11)])
    assert solver.factor(data) == 0
    np.testing.assert_allclose(solver.solve(right), solveh_banded(band, right, lower=True), rtol=1e-12, atol=1e-14)


def test_refinement_takes_digits_back():
    """A first pivot of 1e-11 costs the others 11 digits; one refinement gives back as many as were left."""
    rng = np.random.default_rng(2)
    matrix = narrow(rng, 200, 4, shift=30.0)
    matrix[0, 0] = 1e-11
    exact = rng.normal(size=200)
    errors = []
    for refined in (False, True):
        solver, data = stored(matrix, order=np.arange(200), refined=refined)
        solver.factor(data)
        errors.append(np.abs(solver.solve(matrix @ exact) - exact).max())
    assert errors[0] > 1e-8
    assert errors[1] < 1e-4 * errors[0]


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_pivot_that_vanishes_or_is_not_finite_is_refused(value):
    matrix = np.diag([1.0, 2.0, 3.0])
    solver, data = stored(matrix)
    data[1] = value
    with pytest.raises(SingularError, match="pivot 1 "):
        solver.factor(data)


def test_wide_patterns_go_to_the_sparse_solver():
    def choose(matrix):
        upper = csc_matrix(triu(csc_matrix(matrix)))
        return narrow_or_sparse(upper.indptr.astype(np.int64), upper.indices.astype(np.int64))

    assert isinstance(choose(np.ones((WIDEST + 2, WIDEST + 2))), Qdldl)
    assert isinstance(choose(np.ones((WIDEST + 1, WIDEST + 1))), Banded)
