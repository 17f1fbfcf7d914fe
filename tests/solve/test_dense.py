"""The dense work on fronts against NumPy, for all the ways in which sizes fill tiles or do not, compiled and not."""

import os
import subprocess
import sys

import numpy as np
import pytest
from numba import config, njit

from rodshell.kernels import COMPILED
from rodshell.solve.dense import (
    OVERWRITTEN,
    add_rows,
    backward,
    eliminate,
    forward,
    padded,
    room,
    subtract_product,
    workspace,
)
from rodshell.solve.simd_kernels import LANES, ROWS, adding, multiplying

pytestmark = pytest.mark.skipif(
    COMPILED is not None, reason="parts of kernels, which only Numba calls on their own: RODSHELL_KERNELS=jit"
)

OWN = (1, 3, 4, 5, 8, 11, 33, 70, 140)
MORE = (0, 1, 7, 8, 23, 24, 25, 60, 130)


def front(own, more, seed=0):
    """A symmetric front (own + more rows), indefinite and far from singular; its pivots' rows padded, of which the
    padding and what is below the diagonal may be anything finite."""
    random = np.random.default_rng([own, more, seed])
    size = own + more
    whole = random.standard_normal((size, size))
    whole = whole + whole.T + np.diag(np.where(random.random(size) < 0.3, -1, 1) * (4 * size + random.random(size)))
    stored = room(own * padded(size)).reshape(-1)[: own * padded(size)].reshape(own, padded(size))
    stored[:] = 0.0
    stored[:, :size] = np.triu(whole)[:own]
    return whole, stored


def eliminated(own, more):
    whole, rows = front(own, more)
    panel, pivots, work = room(rows.size)[: rows.size].reshape(rows.shape), np.empty(own), workspace(own + more)
    assert eliminate(rows, panel, pivots, work)
    return whole, rows, panel, pivots, work


@pytest.mark.parametrize("more", MORE)
@pytest.mark.parametrize("own", OWN)
def test_elimination_and_update_give_the_front_again(own, more):
    whole, rows, panel, pivots, work = eliminated(own, more)
    size = own + more
    upper = np.triu(panel[:, :size], 1) + np.eye(own, size)
    np.testing.assert_allclose(np.triu(rows[:, :size]), np.triu(pivots[:, None] * upper), rtol=1e-12, atol=1e-12 * size)
    left = whole - upper.T @ np.diag(pivots) @ upper
    assert np.abs(left[:own]).max() < 1e-13 * np.abs(whole).max() * size
    update = room(more * padded(more))[: more * padded(more)].reshape(more, padded(more))
    subtract_product(panel, rows, own, OVERWRITTEN, update, work)
    update[:, :more] += np.triu(whole[own:, own:])
    np.testing.assert_allclose(np.triu(update[:, :more]), np.triu(left[own:, own:]), atol=1e-13 * size**2)


@pytest.mark.parametrize("more", MORE)
@pytest.mark.parametrize("own", OWN)
def test_substitutions_solve_with_the_front(own, more):
    _, _, panel, pivots, _ = eliminated(own, more)
    size = own + more
    upper = np.triu(panel[:, :size], 1) + np.eye(own, size)
    row, aside = room(padded(size))[None, : padded(size)], room(2 * own)
    values = row[0]
    values[:] = 0.0
    values[:size] = right = np.random.default_rng(own).standard_normal(size)
    forward(panel, row, 1, aside)
    solved = np.linalg.solve(upper[:, :own].T, right[:own])
    np.testing.assert_allclose(values[:own], solved, rtol=1e-11, atol=1e-13)
    np.testing.assert_allclose(values[own:size], right[own:] - upper[:, own:].T @ solved, rtol=1e-11, atol=1e-12)
    values[size:] = 0.0
    known = values[own:size].copy()
    backward(panel, pivots, row, 1, aside)
    expected = np.linalg.solve(upper[:, :own], solved / pivots - upper[:, own:] @ known)
    np.testing.assert_allclose(values[:own], expected, rtol=1e-10, atol=1e-13)
    np.testing.assert_array_equal(values[own:size], known)


@pytest.mark.parametrize("more", MORE)
@pytest.mark.parametrize("own", OWN)
@pytest.mark.parametrize("count", range(2, ROWS + 1))
def test_substitutions_side_by_side_have_the_bits_of_each_alone(own, more, count):
    _, _, panel, pivots, _ = eliminated(own, more)
    stride, known = padded(own + more), slice(own + more, None)
    rows = room(count * stride)[: count * stride].reshape(count, stride)
    rows[:] = np.random.default_rng(own).standard_normal(rows.shape)
    rows[:, known] = 0.0
    alone, aside = [room(stride)[None, :stride] for _ in rows], room(ROWS * own)
    for values, row in zip(alone, rows, strict=True):
        values[:] = row
        forward(panel, values, 1, aside)
    forward(panel, rows, count, aside)
    np.testing.assert_array_equal(rows, np.vstack(alone))
    rows[:, known] = 0.0
    for values in alone:
        values[:, known] = 0.0
        backward(panel, pivots, values, 1, aside)
    backward(panel, pivots, rows, count, aside)
    np.testing.assert_array_equal(rows, np.vstack(alone))


@pytest.mark.parametrize("bad", [0.0, -0.0, np.nan, np.inf, 1e-310])
@pytest.mark.parametrize("at", [0, 2, 4, 6, 40])
def test_a_pivot_that_vanishes_or_is_not_finite_is_told(at, bad):
    rows = np.zeros((42, padded(42)))
    rows[:, :42] = np.eye(42)
    rows[at, at] = bad
    assert not eliminate(rows, np.empty_like(rows), np.empty(42), workspace(42))


@pytest.mark.parametrize("seed", range(20))
def test_a_childs_rows_go_where_they_belong(seed):
    random = np.random.default_rng(seed)
    own, more = random.integers(1, 30, 2)
    size = own + more
    places = np.sort(random.choice(size, random.integers(1, size + 1), replace=False))
    starts = np.flatnonzero(np.diff(places, prepend=-2) != 1)
    runs = np.column_stack([starts, places[starts]])
    count = len(places)
    update = np.full((count, padded(count)), 1e9)  # below the diagonal and in the padding
    update[:, :count] = np.where(np.tri(count, k=-1, dtype=bool), 1e9, random.standard_normal((count, count)))
    expected = np.zeros((size, size))
    expected[np.ix_(places, places)] = np.triu(update[:, :count])
    rows, rest = np.zeros((own, padded(size))), np.zeros((more, padded(more)))
    add_rows(rows, update, runs, own)
    add_rows(rest, update, runs, size)
    np.testing.assert_array_equal(rows[:, :size], expected[:own])
    np.testing.assert_array_equal(rest[:, :more], expected[own:, own:])
    assert not rows[:, size:].any()
    assert not rest[:, more:].any()


_adding, _multiplying = adding(), multiplying(3)


@njit
def added(c, a, count):
    _adding(c.ctypes.data, a.ctypes.data, count)


@njit
def multiplied(y, a, x):
    _multiplying(y.ctypes.data, a.ctypes.data, a.shape[1], x.ctypes.data, len(x))


@pytest.mark.parametrize("count", range(3 * LANES + 2))
def test_only_as_many_numbers_are_added(count):
    c, a = np.arange(40.0), np.full(40, 0.5)
    added(c, a, count)
    np.testing.assert_array_equal(c, np.arange(40.0) + np.where(np.arange(40) < count, 0.5, 0.0))


def test_three_rows_times_a_vector():
    random = np.random.default_rng(1)
    a, x, y = random.standard_normal((3, 40)), random.standard_normal(2 * LANES), np.zeros(4)
    multiplied(y, a, x)
    np.testing.assert_allclose(y[:3], a[:, : len(x)] @ x, rtol=1e-13)
    assert y[3] == 0.0


@pytest.mark.slow
def test_the_same_without_the_compiler():
    """The twins in NumPy do what the kernels do."""
    environment = {**os.environ, "NUMBA_DISABLE_JIT": "1"}
    asked = [
        sys.executable,
        "-m",
        "pytest",
        "-q",
        "-x",
        "-p",
        "no:cacheprovider",
        __file__,
        "-k",
        "front or only or rows",
    ]
    if config.DISABLE_JIT:
        pytest.skip("nothing is compiled: unset NUMBA_DISABLE_JIT")
    ran = subprocess.run(asked, env=environment, capture_output=True, text=True, check=False)
    assert ran.returncode == 0, ran.stdout
