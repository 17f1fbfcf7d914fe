"""The band against dense, sparse and LAPACK solvers: chains, rings, shuffled numbers, supports in any direction."""

import numpy as np
import pytest
from scipy.linalg import solveh_banded

from rodshell.model import Freedom
from rodshell.solve.newton_matrix import WIDEST, Banded, SparseSum, narrow_or_sparse
from rodshell.solve.problem import NO_CURVATURE
from rodshell.solve.sparse_ldl import SingularError

BLOCKS = 40


def chain(width, *, ring=False, shuffled=False, seed=0):
    """(m, width) stencils of neighbours in a row of blocks."""
    starts = np.arange(BLOCKS if ring else BLOCKS - width + 1)
    stencils = (starts[:, None] + np.arange(width)) % BLOCKS
    if shuffled:
        rng = np.random.default_rng(seed)
        stencils = rng.permutation(BLOCKS)[rng.permutation(stencils)]
    return stencils


def freedom(rng):
    """Free blocks, angles, fixed ones, and some that slide along a line or in a plane askew."""
    free = Freedom.free(BLOCKS).with_directions(np.arange(1, BLOCKS, 2), (1.0, 0.0, 0.0))
    free = free.with_directions(np.array([4, 5, 20]))
    for block, count in ((6, 2), (7, 1), (30, 2), (11, 3)):
        free = free.with_directions(np.array([block]), *np.linalg.qr(rng.normal(size=(3, 3)))[0][:count])
    return free


def random_hessians(rng, stencils):
    values = rng.normal(size=(len(stencils), 3 * stencils.shape[1], 3 * stencils.shape[1]))
    return values + values.transpose(0, 2, 1)


def dense(hessians, stencils, diagonal, full, free):
    """T' (sum of Hessians) T, and T (3N, size), term by term."""
    total = np.diag(diagonal.ravel())
    for i, block in enumerate(full):
        total[3 * i : 3 * i + 3, 3 * i : 3 * i + 3] += block
    for values, blocks in zip(hessians, stencils, strict=True):
        rows = (3 * blocks[:, None] + np.arange(3)).ravel()
        total[np.ix_(rows, rows)] += values
    columns = [np.kron(np.eye(BLOCKS)[i], free.directions[i, c]) for i in range(BLOCKS) for c in range(free.count[i])]
    t = np.array(columns).T
    return t.T @ total @ t, t


CASES = {
    "chain": {},
    "shuffled": {"shuffled": True},
    "ring": {"ring": True},
    "ring, shuffled": {"ring": True, "shuffled": True},
}


@pytest.mark.parametrize("kind", [Banded, SparseSum])
@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("width", [2, 5])
def test_solution_and_inertia_are_those_of_numpy(kind, case, width):
    rng = np.random.default_rng(width)
    stencils, free = chain(width, **CASES[case]), freedom(rng)
    hessians, field = random_hessians(rng, stencils), rng.normal(size=(BLOCKS, 3))
    full = random_hessians(rng, np.zeros((BLOCKS, 1)))
    matrix = kind([stencils], free)
    for shift in (-60.0, 2.0, 60.0):
        diagonal = shift * rng.uniform(1, 2, size=(BLOCKS, 3))
        matrix.clear()
        matrix.add(0, hessians, stencils, free)
        matrix.add_blocks(diagonal, full, free)
        exact, t = dense(hessians, stencils, diagonal, full, free)
        assert matrix.factor() == np.count_nonzero(np.linalg.eigvalsh(exact) < 0)
        solution = t @ np.linalg.solve(exact, t.T @ field.ravel())
        # without pivoting an indefinite matrix loses digits: 1e-9 is the worst seen
        np.testing.assert_allclose(matrix.solve(field, free).ravel(), solution, atol=1e-7 * np.abs(solution).max())


def test_turning_directions_need_no_new_matrix():
    """As on a surface: the counts stay, the directions turn."""
    rng = np.random.default_rng(3)
    stencils, hessians = chain(3), None
    hessians = random_hessians(rng, stencils)
    field, inertia = rng.normal(size=(BLOCKS, 3)), np.full((BLOCKS, 3), 50.0)
    frees = [freedom(np.random.default_rng(seed)) for seed in (1, 2)]
    kept = Banded([stencils], frees[0])
    for free in frees:
        kept.clear()
        kept.add(0, hessians, stencils, free)
        kept.add_blocks(inertia, NO_CURVATURE, free)
        kept.factor()
        exact, t = dense(hessians, stencils, inertia, [], free)
        np.testing.assert_allclose(
            kept.solve(field, free).ravel(), t @ np.linalg.solve(exact, t.T @ field.ravel()), rtol=1e-10, atol=1e-12
        )


@pytest.mark.parametrize("kind", [Banded, SparseSum])
def test_blocked_directions_keep_their_places_and_do_not_move(kind):
    """Nodes that touch: turned, the last direction zero; or stuck, all three. As if these unknowns were not there."""
    rng = np.random.default_rng(3)
    stencils, free = chain(3), Freedom.free(BLOCKS)
    hessians, field = random_hessians(rng, stencils), rng.normal(size=(BLOCKS, 3))
    inertia = np.full((BLOCKS, 3), 50.0)
    directions, touching, stuck = free.directions.copy(), [0, 3, 4, 5, 17, BLOCKS - 1], [4, 30]
    for node in touching:
        directions[node] = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        directions[node, 2] = 0.0
    directions[stuck] = 0.0
    blocked = Freedom(directions, free.count)
    matrix = kind([stencils], blocked)
    matrix.clear()
    matrix.add(0, hessians, stencils, blocked)
    matrix.add_blocks(inertia, NO_CURVATURE, blocked)
    assert matrix.factor() == 0
    exact, t = dense(hessians, stencils, inertia, [], blocked)
    left = np.abs(t).sum(axis=0) > 0
    assert np.count_nonzero(~left) == len(touching) - 1 + 3 * len(stuck)
    exact, t = exact[np.ix_(left, left)], t[:, left]
    solution = t @ np.linalg.solve(exact, t.T @ field.ravel())
    np.testing.assert_allclose(matrix.solve(field, blocked).ravel(), solution, rtol=1e-10, atol=1e-12)


def test_reordering_narrows_a_shuffled_chain_to_its_width():
    free = Freedom.free(BLOCKS)
    for seed in range(5):
        for width in (2, 3, 5):
            alone = Banded([chain(width, shuffled=True, seed=seed)], free)
            assert alone.half_bandwidth == 3 * width - 1
            ring = Banded([chain(width, ring=True, shuffled=True, seed=seed)], free)
            assert ring.half_bandwidth <= 6 * width - 1  # both arms of a ring side by side


def test_rod_numbered_nodes_first_has_its_band_of_ten():
    """x_0, theta_0, x_1, ... whatever the numbers: 4 unknowns a node, and 11 in an element."""
    n = 30
    nodes, angles = np.arange(n), n + np.arange(n - 1)
    stencils = np.column_stack([nodes[:-2], angles[:-1], nodes[1:-1], angles[1:], nodes[2:]])
    free = Freedom.free(2 * n - 1).with_directions(angles, (1.0, 0.0, 0.0))
    assert Banded([stencils, np.column_stack([nodes[:-1], nodes[1:]])], free).half_bandwidth == 10


def test_given_order_is_used():
    stencils, free = chain(2), Freedom.free(BLOCKS)
    assert Banded([stencils], free, order=np.arange(BLOCKS)[::-1]).half_bandwidth == 5
    assert Banded([stencils], free, order=np.roll(np.arange(BLOCKS), 1)).half_bandwidth == 3 * BLOCKS - 1


def test_positive_band_is_solved_as_by_lapack():
    rng = np.random.default_rng(1)
    stencils, free = chain(4), Freedom.free(BLOCKS)
    matrix, field = Banded([stencils], free, order=np.arange(BLOCKS)), rng.normal(size=(BLOCKS, 3))
    matrix.add(0, random_hessians(rng, stencils), stencils, free)
    matrix.add_blocks(np.full((BLOCKS, 3), 100.0), NO_CURVATURE, free)
    band = matrix.values[: matrix.size, : matrix.half_bandwidth + 1].T.copy()
    assert matrix.factor() == 0
    exact = solveh_banded(band, field.ravel(), lower=True)
    np.testing.assert_allclose(matrix.solve(field, free).ravel(), exact, rtol=1e-12, atol=1e-14)


@pytest.mark.parametrize("value", [0.0, np.nan, np.inf])
def test_pivot_that_vanishes_or_is_not_finite_is_refused(value):
    free = Freedom.free(3).with_directions(np.array([0]))
    matrix = Banded([np.array([[0], [1], [2]])], free, order=np.arange(3))
    diagonal = np.ones((3, 3))
    diagonal[2, 1] = value
    matrix.add_blocks(diagonal, NO_CURVATURE, free)
    with pytest.raises(SingularError, match="block 2 "):
        matrix.factor()


def test_single_unknowns_are_a_band_of_width_zero():
    free = Freedom.free(3).with_directions(np.arange(3), (0.0, 1.0, 0.0))
    matrix = Banded([np.arange(3)[:, None]], free)
    matrix.add_blocks(np.tile([1.0, 4.0, 9.0], (3, 1)), NO_CURVATURE, free)
    assert matrix.half_bandwidth == 0
    assert matrix.factor() == 0
    np.testing.assert_array_equal(matrix.solve(np.full((3, 3), 8.0), free), np.tile([0.0, 2.0, 0.0], (3, 1)))


def test_wide_patterns_go_to_the_sparse_solver():
    widest = (WIDEST + 1) // 3
    for width, kind in ((widest, Banded), (widest + 1, SparseSum)):
        chosen = narrow_or_sparse([np.arange(width)[None, :]], Freedom.free(width))
        assert isinstance(chosen, kind)
