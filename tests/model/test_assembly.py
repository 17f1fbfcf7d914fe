"""Assembly in free directions against dense matrices, and the sparse solver against numpy's dense ones.

All quantities are without units and of the order of 1.
"""

import numpy as np
import pytest
from numpy.linalg import eigvalsh, norm

from rodshell.model import Assembly, Freedom
from rodshell.solve.sparse_ldl import Multifrontal, SingularError

BLOCKS = 14
WIDTHS = (1, 2, 3, 5)  # blocks of a surface curvature, an edge, a bend, a bend with twist
SEEDS = range(8)


def random_freedom(rng, counts=None):
    """Random counts 0 to 3, and random orthonormal directions; all four counts occur."""
    if counts is None:
        counts = rng.permutation(np.append([0, 1, 2, 3], rng.integers(0, 4, BLOCKS - 4)))
    rotations = np.linalg.qr(rng.normal(size=(len(counts), 3, 3)))[0]
    return Freedom(np.ascontiguousarray(rotations), np.asarray(counts, dtype=np.intp))


def random_elements(rng, blocks=BLOCKS):
    """Element sets of all widths; their blocks in any order; each with its symmetric Hessians."""
    sets, hessians = [], []
    for width in WIDTHS:
        count = int(rng.integers(4, 9))
        sets.append(np.array([rng.choice(blocks, width, replace=False) for _ in range(count)], dtype=np.intp))
        half = rng.normal(size=(count, 3 * width, 3 * width))
        hessians.append(half + half.transpose(0, 2, 1))
    return sets, hessians


def dense_sum(sets, hessians, blocks=BLOCKS):
    total = np.zeros((3 * blocks, 3 * blocks))
    for stencils, matrices in zip(sets, hessians, strict=True):
        for stencil, matrix in zip(stencils, matrices, strict=True):
            rows = np.concatenate([[3 * block, 3 * block + 1, 3 * block + 2] for block in stencil])
            total[np.ix_(rows, rows)] += matrix
    return total


def dense_directions(freedom):
    """T, one column for each free direction, block by block."""
    columns = []
    for block, (directions, count) in enumerate(zip(freedom.directions, freedom.count, strict=True)):
        for direction in directions[:count]:
            column = np.zeros(3 * len(freedom.count))
            column[3 * block : 3 * block + 3] = direction
            columns.append(column)
    return np.array(columns).reshape(-1, 3 * len(freedom.count)).T


def dense_upper(assembly, data):
    size = len(assembly.indptr) - 1
    result = np.zeros((size, size))
    for column in range(size):
        here = slice(assembly.indptr[column], assembly.indptr[column + 1])
        result[assembly.indices[here], column] = data[here]
    return result


def assert_equals_dense_sum(sets, hessians, freedom):
    assembly = Assembly.of(sets, freedom)
    data = assembly.assemble(hessians, sets, freedom)
    t = dense_directions(freedom)
    expected = t.T @ dense_sum(sets, hessians, len(freedom.count)) @ t
    # sums of some ten products of numbers of order 1, in another order
    np.testing.assert_allclose(dense_upper(assembly, data), np.triu(expected), rtol=0, atol=1e-13 * norm(expected))
    return assembly, data


# Assembly


@pytest.mark.parametrize("seed", SEEDS)
def test_reduced_hessian_is_the_dense_sum_between_free_directions(seed):
    rng = np.random.default_rng(seed)
    assert_equals_dense_sum(*random_elements(rng), random_freedom(rng))


@pytest.mark.parametrize("seed", SEEDS)
def test_pattern_has_every_diagonal_and_ascending_rows_above_it(seed):
    rng = np.random.default_rng(seed)
    sets, _ = random_elements(rng)
    freedom = random_freedom(rng)
    assembly = Assembly.of([blocks[:1] for blocks in sets], freedom)  # most blocks are touched by nothing
    assert len(assembly.indptr) == freedom.size + 1
    for column in range(freedom.size):
        rows = assembly.indices[assembly.indptr[column] : assembly.indptr[column + 1]]
        assert np.all(np.diff(rows) > 0)
        assert rows[-1] == column
    np.testing.assert_array_equal(assembly.indices[assembly.diagonal], np.arange(freedom.size))


@pytest.mark.parametrize("seed", SEEDS)
def test_pattern_holds_the_couplings_of_the_elements_and_no_others(seed):
    rng = np.random.default_rng(seed)
    sets, hessians = random_elements(rng)
    freedom = random_freedom(rng)
    assembly = Assembly.of(sets, freedom)
    t = dense_directions(freedom) != 0
    touched = dense_sum(sets, [np.ones_like(matrices) for matrices in hessians]) != 0
    coupled = (t.T.astype(int) @ touched @ t) > 0
    np.testing.assert_array_equal(
        dense_upper(assembly, np.ones(len(assembly.indices))) != 0, np.triu(coupled | np.eye(freedom.size, dtype=bool))
    )


def test_one_plan_serves_directions_that_turn():
    """The count of free directions is the plan's, the directions are those of each evaluation."""
    rng = np.random.default_rng(11)
    sets, hessians = random_elements(rng)
    planned = random_freedom(rng)
    assembly = Assembly.of(sets, planned)
    turned = random_freedom(rng, planned.count)
    t = dense_directions(turned)
    expected = np.triu(t.T @ dense_sum(sets, hessians) @ t)
    data = assembly.assemble(hessians, sets, turned)
    np.testing.assert_allclose(dense_upper(assembly, data), expected, rtol=0, atol=1e-13 * norm(expected))


def test_elements_of_the_same_blocks_add_up():
    rng = np.random.default_rng(12)
    blocks = np.tile(np.array([[3, 1, 2]], dtype=np.intp), (4, 1))
    half = rng.normal(size=(4, 9, 9))
    assert_equals_dense_sum([blocks], [half + half.transpose(0, 2, 1)], random_freedom(rng, [3, 2, 3, 1]))


def test_an_empty_set_of_elements_adds_nothing():
    rng = np.random.default_rng(13)
    freedom = random_freedom(rng)
    sets, hessians = random_elements(rng)
    _, alone = assert_equals_dense_sum(sets, hessians, freedom)
    nothing = np.empty((0, 3), dtype=np.intp)
    _, with_nothing = assert_equals_dense_sum([*sets, nothing], [*hessians, np.empty((0, 9, 9))], freedom)
    np.testing.assert_array_equal(alone, with_nothing)


# Free directions


@pytest.mark.parametrize("seed", SEEDS)
def test_expanding_and_reducing_are_the_dense_directions_and_their_transpose(seed):
    rng = np.random.default_rng(seed)
    freedom = random_freedom(rng)
    t = dense_directions(freedom)
    q, gradient = rng.normal(size=freedom.size), rng.normal(size=(BLOCKS, 3))
    # three products each; and adjoint: g.(T q) = (T' g).q
    np.testing.assert_allclose(freedom.expand(q).ravel(), t @ q, rtol=0, atol=1e-14)
    np.testing.assert_allclose(freedom.reduce(gradient), t.T @ gradient.ravel(), rtol=0, atol=1e-14)
    assert np.sum(gradient * freedom.expand(q)) == pytest.approx(freedom.reduce(gradient) @ q, abs=1e-13)
    np.testing.assert_allclose(freedom.reduce(freedom.expand(q)), q, rtol=0, atol=1e-14)


def test_taking_directions_away_leaves_the_other_blocks_as_they_were():
    free = Freedom.free(4)
    less = free.with_directions(np.array([1]), (0.0, 0.6, 0.8)).with_directions(np.array([3]))
    assert free.size == 12
    assert less.count.tolist() == [3, 1, 3, 0]
    assert less.first.tolist() == [0, 3, 4, 7]
    np.testing.assert_array_equal(
        less.expand(np.arange(1.0, 8.0)), [[1, 2, 3], [0, 0.6 * 4, 0.8 * 4], [5, 6, 7], [0, 0, 0]]
    )


# The sparse solver


def chain_matrix(rng, size=40):
    """Symmetric, sparse, of random sign: a random band and a few far couplings; and its pattern."""
    dense = np.diag(rng.normal(size=size) * 3)
    for apart in (1, 2):
        side = np.diag(rng.normal(size=size - apart), apart)
        dense += side + side.T
    for i, j in rng.choice(size, (6, 2), replace=False):
        dense[i, j] = dense[j, i] = rng.normal()
    return dense


def compressed(dense):
    """Upper triangle by columns: indptr, indices, data; every diagonal stored."""
    indptr, indices, data = [0], [], []
    for column in range(len(dense)):
        rows = [row for row in range(column + 1) if dense[row, column] != 0 or row == column]
        indices += rows
        data += dense[rows, column].tolist()
        indptr.append(len(indices))
    return np.array(indptr), np.array(indices), np.array(data)


def assert_inertia_and_solution(solver, dense, data, reuse=None):
    eigenvalues = eigvalsh(dense)
    factors = solver.factor(data, reuse=reuse)
    assert factors.negative == np.count_nonzero(eigenvalues < 0)
    x = np.random.default_rng(0).normal(size=len(dense))
    found = factors.solve(dense @ x)
    condition = np.abs(eigenvalues).max() / np.abs(eigenvalues).min()
    # 0.26 measured: factors without pivoting may grow, the refinement makes up for it
    assert norm(found - x) <= 2.0 * np.finfo(float).eps * condition * norm(x)
    return factors


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("negative", [0, 3, 20, 40])
def test_solver_counts_negative_eigenvalues_and_solves(seed, negative):
    dense = chain_matrix(np.random.default_rng(seed))
    eigenvalues = np.concatenate([[-12.0], eigvalsh(dense), [12.0]])
    dense -= 0.5 * (eigenvalues[negative] + eigenvalues[negative + 1]) * np.eye(len(dense))
    indptr, indices, data = compressed(dense)
    solver = Multifrontal(indptr, indices)
    assert assert_inertia_and_solution(solver, dense, data).negative == negative


@pytest.mark.parametrize("side", [1e-9, -1e-9])
@pytest.mark.parametrize("seed", SEEDS)
def test_solver_tells_the_sign_of_a_nearly_vanishing_eigenvalue(seed, side):
    dense = chain_matrix(np.random.default_rng(seed))
    middle = eigvalsh(dense)[7]
    dense += (side - middle) * np.eye(len(dense))
    indptr, indices, data = compressed(dense)
    assert np.abs(eigvalsh(dense)).min() == pytest.approx(1e-9, rel=1e-3)
    assert_inertia_and_solution(Multifrontal(indptr, indices), dense, data)


@pytest.mark.parametrize("tiny", [1e-4, 1e-8])
def test_refinement_makes_up_for_tiny_pivots(tiny):
    """A well conditioned saddle whose pivots are as small as `tiny`: unpivoted factors alone lose as many digits."""
    rng = np.random.default_rng(23)
    half = 3 * np.eye(20) + np.triu(rng.normal(size=(20, 20))) * (rng.random((20, 20)) < 0.2)
    dense = np.block([[tiny * np.eye(20), half], [half.T, -tiny * np.eye(20)]])
    indptr, indices, data = compressed(dense)
    # without refinement 6e-16 / tiny was measured
    assert_inertia_and_solution(Multifrontal(indptr, indices), dense, data)


def test_solver_keeps_its_pattern_for_new_values():
    rng = np.random.default_rng(21)
    dense = chain_matrix(rng)
    indptr, indices, data = compressed(dense)
    solver = Multifrontal(indptr, indices)
    factors = solver.factor(data)
    for shift in (20.0, 0.3, -20.0, 5.0):
        shifted = dense + shift * np.eye(len(dense))
        factors = assert_inertia_and_solution(solver, shifted, compressed(shifted)[2], reuse=factors)


@pytest.mark.parametrize(
    "dense",
    [np.zeros((1, 1)), np.diag([1.0, 0.0, 2.0]), np.ones((2, 2)), np.array([[1, 2, 0], [2, 4, 0], [0, 0, 1.0]])],
    ids=["nothing", "a free motion", "two alike", "dependent rows"],
)
def test_a_vanishing_pivot_is_an_error(dense):
    indptr, indices, data = compressed(dense)
    with pytest.raises(SingularError):
        Multifrontal(indptr, indices).factor(data)


def test_values_that_are_not_finite_are_an_error():
    dense = np.diag([1.0, 2.0, 3.0])
    indptr, indices, data = compressed(dense)
    for bad in (np.nan, np.inf):
        with pytest.raises(SingularError):
            Multifrontal(indptr, indices).factor(np.array([1.0, bad, 3.0]))
    solver = Multifrontal(indptr, indices)
    with pytest.raises(SingularError):
        solver.factor(np.array([1.0, np.nan, 3.0]), reuse=solver.factor(data))


def test_solver_recovers_after_a_singular_system():
    rng = np.random.default_rng(22)
    dense = chain_matrix(rng)
    indptr, indices, data = compressed(dense)
    solver = Multifrontal(indptr, indices)
    with pytest.raises(SingularError):
        solver.factor(np.zeros_like(data))
    factors = assert_inertia_and_solution(solver, dense, data)
    with pytest.raises(SingularError):
        solver.factor(np.zeros_like(data), reuse=factors)
    assert_inertia_and_solution(solver, dense, data, reuse=factors)
