"""Work that threads share: all of it is done, what fails is raised, and the bits do not depend on the threads."""

import numpy as np
import pytest
from scipy.sparse import linalg
from threadpoolctl import threadpool_info, threadpool_limits

import rodshell as rs
from rodshell import threads
from rodshell.model import Assembly, Freedom, Shell, assembly
from rodshell.rods import elements
from rodshell.solve.modes import linear_buckling
from tests.solve import stability_problems as known

ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
RANDOM = np.random.default_rng(3)


@pytest.mark.parametrize("most", [1, 2, 5])
def test_every_piece_is_done_once(most):
    done = []
    threads.in_threads(lambda piece, thread: done.append((piece, thread)), 40, most=most)
    assert sorted(piece for piece, _ in done) == list(range(40))
    assert all(0 <= thread < most for _, thread in done)


@pytest.mark.parametrize("bad", [0, 7])
def test_what_a_piece_raises_is_raised(bad):
    def work(piece, _):
        if piece == bad:
            raise ZeroDivisionError(piece)

    with pytest.raises(ZeroDivisionError):
        threads.in_threads(work, 8, most=2)


def test_the_number_of_threads_can_be_set(monkeypatch):
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    assert threads.threads() == 1
    monkeypatch.setenv("NUMBA_NUM_THREADS", "0")
    assert threads.threads() == 1


def blas_threads():
    return {library["num_threads"] for library in threadpool_info() if library["user_api"] == "blas"}


def test_while_modes_are_looked_for_the_blas_has_one_thread(monkeypatch):
    """It would keep ours from the processors: on two, a load check took five times as long."""
    column, asked = known.eulers_column(), list[set[int]]()
    lanczos = linalg.eigsh

    def listen(*given, **options):
        asked.append(blas_threads())
        return lanczos(*given, **options)

    monkeypatch.setattr("rodshell.solve.modes.eigsh", listen)
    with threadpool_limits(2, user_api="blas"):
        before = blas_threads()
        linear_buckling(column.unloaded, column.load)
        assert blas_threads() == before
    assert asked == [{1}]


def bent_shell():
    """A grid of 8 x 8 rods in a random state, and its elements."""
    layout = rs.GridLayout.orthogonal(rods=(8, 8), spacing=0.03, edge=0.01, length=0.3)
    shell = Shell.of(rs.mesh_grid(layout.flat_grid((8, 8), 0.3), 0.01), ROD)
    state = shell.state(shell.mesh.flat + 1e-3 * RANDOM.standard_normal(shell.mesh.flat.shape))
    return shell, state, (*shell.elements, shell.stretch)


def evaluated(sets, state):
    gradient = np.zeros_like(state)
    hessians = [np.zeros((len(one.blocks), 3 * one.blocks.shape[1], 3 * one.blocks.shape[1])) for one in sets]
    elements.evaluate_all(sets, state, gradient, hessians)
    return gradient, hessians


def test_elements_evaluated_in_halves_are_those_of_one_piece(monkeypatch):
    _, state, sets = bent_shell()
    whole, hessians = evaluated(sets, state)
    monkeypatch.setattr(elements, "WORTHWHILE", 10)
    halves, found = evaluated(sets, state)
    np.testing.assert_allclose(halves, whole, rtol=0, atol=1e-13 * np.abs(whole).max())
    assert all(one.tobytes() == other.tobytes() for one, other in zip(found, hessians, strict=True))
    monkeypatch.setenv("NUMBA_NUM_THREADS", "1")
    assert evaluated(sets, state)[0].tobytes() == halves.tobytes()


def test_a_matrix_that_threads_assemble_has_the_same_bits(monkeypatch):
    shell, state, sets = bent_shell()
    _, hessians = evaluated(sets, state)
    blocks, free = [one.blocks for one in sets], shell.held_ends()
    whole = Assembly.of(blocks, free).assemble(hessians, blocks, free)
    dense = np.zeros((3 * len(state), 3 * len(state)))  # as a slow twin: every pair of unknowns by itself
    for of_set, set_blocks in zip(hessians, blocks, strict=True):
        unknowns = (3 * set_blocks[:, :, None] + np.arange(3)).reshape(len(set_blocks), -1)
        for hessian, at in zip(of_set, unknowns, strict=True):
            dense[np.ix_(at, at)] += hessian
    kept = np.repeat(free.count == 3, 3)
    monkeypatch.setattr(assembly, "WORTHWHILE", 10)
    for count in (2, 3, 4):
        monkeypatch.setattr(assembly, "threads", lambda count=count: count)
        plan = Assembly.of(blocks, free)
        data = plan.assemble(hessians, blocks, free)
        assert data.tobytes() == whole.tobytes()
        upper = dense[kept][:, kept]
        rows, columns = plan.indices, np.repeat(np.arange(len(plan.indptr) - 1), np.diff(plan.indptr))
        np.testing.assert_allclose(data, upper[rows, columns], rtol=0, atol=1e-12 * np.abs(upper).max())


def test_blocks_without_free_directions_need_no_part(monkeypatch):
    monkeypatch.setattr(assembly, "WORTHWHILE", 0)
    monkeypatch.setattr(assembly, "threads", lambda: 2)
    blocks, free = [np.array([[0, 1]])], Freedom.free(2).with_directions(np.array([0, 1]))
    assert len(Assembly.of(blocks, free).assemble([np.ones((1, 6, 6))], blocks, free)) == 0
