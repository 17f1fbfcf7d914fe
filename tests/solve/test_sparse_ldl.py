"""The multifrontal factorisation against NumPy's dense eigenvalues and solutions, and against SuperLU."""

import numpy as np
import pytest
import scipy.sparse as sparse
from scipy.sparse.linalg import splu

import rodshell as rs
from rodshell.solve import dense, sparse_ldl
from rodshell.solve.sparse_ldl import Multifrontal, SingularError, dissect

RANDOM = np.random.default_rng(20211)


def upper(matrix):
    triangle = sparse.triu(sparse.csc_matrix(matrix), format="csc")
    triangle.sort_indices()
    return triangle


def random_matrix(size, density, shift):
    """Symmetric, every diagonal stored; `shift` on the diagonal decides the inertia."""
    part = sparse.random(size, size, density, random_state=RANDOM, data_rvs=RANDOM.standard_normal)
    return (part + part.T + sparse.diags(np.full(size, shift) + 0.1 * RANDOM.standard_normal(size))).tocsc()


def grid_matrix(count, directions=3):
    """A square grid with `directions` unknowns a node, coupled to the second neighbours as bending is; places too."""
    line = sparse.diags([1, -4, 6.5, -4, 1], [-2, -1, 0, 1, 2], shape=(count, count))
    mixing = RANDOM.standard_normal((directions, directions))
    matrix = sparse.kron(sparse.kronsum(line, line), mixing @ mixing.T + np.eye(directions)).tocsc()
    x, y = np.meshgrid(np.arange(count), np.arange(count), indexing="ij")
    return matrix, np.repeat(np.column_stack([x.ravel(), y.ravel()]).astype(float), directions, axis=0)


@pytest.mark.parametrize("size", [1, 2, 7, 40, 200])
@pytest.mark.parametrize("shift", [40.0, 0.5, -3.0])
@pytest.mark.parametrize("placed", [False, True])
def test_solution_and_inertia_are_those_of_the_dense_matrix(size, shift, placed):
    matrix = random_matrix(size, min(1.0, 4 / size), shift)
    triangle = upper(matrix)
    places = RANDOM.random((size, 2)) if placed else None
    factors = Multifrontal(triangle.indptr, triangle.indices, places).factor(triangle.data)
    assert factors.negative == np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0)
    right = RANDOM.standard_normal(size)
    scale = np.linalg.cond(matrix.toarray())
    exact = np.linalg.solve(matrix.toarray(), right)
    # unpivoted elimination may lose some digits, one step of refinement wins them back: 1e-14 cond measured
    assert np.abs(factors.solve(right) - exact).max() <= 1e-11 * scale * np.abs(exact).max()


@pytest.mark.parametrize("directions", [1, 2, 3])
def test_grid_agrees_with_superlu_and_dissection_saves_fill(directions):
    matrix, places = grid_matrix(30, directions)
    triangle = upper(matrix)
    placed = Multifrontal(triangle.indptr, triangle.indices, places)
    unplaced = Multifrontal(triangle.indptr, triangle.indices)
    right = RANDOM.standard_normal(matrix.shape[0])
    exact = splu(matrix.tocsc()).solve(right)
    negative = np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0)
    for factors in (solver.factor(triangle.data) for solver in (placed, unplaced)):
        assert factors.negative == negative
        assert np.abs(factors.solve(right) - exact).max() < 1e-10 * np.abs(exact).max()
    assert placed.fill < 1.3 * unplaced.fill


def test_large_fronts_go_through_blas_and_still_agree():
    """A dense block of 400 unknowns is one front far above the size from which updates are blocked."""
    size = 400
    part = RANDOM.standard_normal((size, size))
    matrix = part + part.T + np.diag(np.where(np.arange(size) % 3, 60.0, -60.0))
    triangle = upper(matrix)
    factors = Multifrontal(triangle.indptr, triangle.indices).factor(triangle.data)
    assert factors.negative == np.count_nonzero(np.linalg.eigvalsh(matrix) < 0)
    right = RANDOM.standard_normal(size)
    assert np.abs(matrix @ factors.solve(right) - right).max() < 1e-9


def multiplications(plan):
    """Of the factorisation: each pivot takes its row off those below."""
    rows, pivots = np.diff(plan.row_start), np.diff(plan.first)
    return sum(int(((n - np.arange(k)) ** 2).sum()) for n, k in zip(rows, pivots, strict=True))


def test_dissection_of_a_shell_takes_a_third_of_the_multiplications_of_minimum_degree():
    """0.30 measured; 0.40 where cuts are where the fewest couplings cross, whatever number of blocks they leave."""
    rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
    trimmed = rs.trim(rs.drape(rs.GridLayout.orthogonal(spacing=0.03, edge=0.005), rod, rs.Hemisphere(radius=0.2)))
    solver = rs.pop_up(rs.map_back(trimmed), trimmed.boundary, rod).equilibrium.problem.pattern.solver
    other = Multifrontal(solver.indptr, solver.indices)
    assert multiplications(solver.plan) < 0.34 * multiplications(other.plan)


def test_memory_that_was_not_set_is_not_read(monkeypatch):
    """It may hold anything, also what is no number: minus one as an integer, for one. A thread may have set none."""
    kernels = {"_numeric": (-4, -3), "_forward": (-2, -1), "_backward": (-2, -1)}  # places of their scratch memory
    for name, places in kernels.items():

        def spoilt(*given, kernel=getattr(sparse_ldl, name), places=places):
            for place in places:
                given[place][:] = np.nan
            return kernel(*given)

        monkeypatch.setattr(sparse_ldl, name, spoilt)

    def spoilt_room(numbers):
        memory = dense.room(numbers)
        memory[:] = np.nan
        return memory

    monkeypatch.setattr(sparse_ldl, "room", spoilt_room)
    matrix, places = grid_matrix(20)
    triangle, right = upper(matrix), RANDOM.standard_normal(matrix.shape[0])
    factors = Multifrontal(triangle.indptr, triangle.indices, places).factor(triangle.data)
    np.testing.assert_allclose(matrix @ factors.solve(right), right, atol=1e-10 * np.abs(right).max())


@pytest.mark.parametrize("bad", [False, True])
def test_threads_share_the_work_and_change_no_bit(monkeypatch, bad):
    matrix, places = grid_matrix(50)
    matrix = matrix - 3.0 * sparse.eye(matrix.shape[0])
    triangle = upper(matrix)
    right, found = RANDOM.standard_normal(matrix.shape[0]), []
    if bad:
        triangle.data[triangle.indptr[1000] - 1] = np.nan
    for count in (1, 2, 5):
        monkeypatch.setattr(sparse_ldl, "threads", lambda count=count: count)
        solver = Multifrontal(triangle.indptr, triangle.indices, places)
        assert len(solver.plan.part_start) > 6  # one thread alone would be no test
        assert sorted(solver.plan.parts) == list(range(len(solver.plan.first) - 1))
        if bad:
            with pytest.raises(SingularError):
                solver.factor(triangle.data)
            continue
        factors = solver.factor(triangle.data)
        found.append((factors.negative, factors.solve(right).tobytes()))
    assert all(one == found[0] for one in found)
    if not bad:
        theirs = splu(matrix.tocsc(), "MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        assert np.count_nonzero(theirs.U.diagonal() < 0) == found[0][0] > 0  # Sylvester's law: no row was exchanged
        np.testing.assert_array_equal(theirs.perm_r, theirs.perm_c)
        exact = theirs.solve(right)
        assert np.abs(np.frombuffer(found[0][1]) - exact).max() < 1e-9 * np.abs(exact).max()


def test_what_is_eliminated_at_the_same_time_needs_only_what_was_before():
    """Every supernode once; its children in levels before its own, or before it in the same piece; no memory shared
    by update matrices that are needed at the same time."""
    matrix, places = grid_matrix(50)
    triangle = upper(matrix)
    plan = Multifrontal(triangle.indptr, triangle.indices, places).plan
    done = set[int]()
    for level in plan.levels:
        before = frozenset(done)
        for piece in level:
            here = set[int]()
            for s in piece.tolist():
                children = plan.children[plan.child_start[s] : plan.child_start[s + 1]].tolist()
                assert all(child in before or child in here for child in children)
                here.add(s)
            assert done.isdisjoint(here)
            done |= here
    assert done == set(range(len(plan.first) - 1))
    assert len(plan.levels) > 2
    assert max(len(level) for level in plan.levels[1:]) > 1  # else threads share nothing above the parts
    above = np.concatenate([piece for level in plan.levels[1:] for piece in level])
    below = (np.diff(plan.row_start) - np.diff(plan.first))[above]
    order = np.argsort(plan.update_start[above])
    starts, sizes = plan.update_start[above][order], (below * (below + 1) // 2)[order]
    assert (starts[:-1] + sizes[:-1] <= starts[1:]).all()


def test_blocks_whose_unknowns_are_coupled_differently():
    """A block is coupled as its unknowns are together: here each of three at a place has neighbours of its own."""
    size, places = 60, np.repeat(RANDOM.random((20, 2)), 3, axis=0)
    matrix = random_matrix(size, 0.08, 9.0)
    triangle = upper(matrix)
    factors = Multifrontal(triangle.indptr, triangle.indices, places).factor(triangle.data)
    assert factors.negative == np.count_nonzero(np.linalg.eigvalsh(matrix.toarray()) < 0)
    right = RANDOM.standard_normal(size)
    assert np.abs(matrix @ factors.solve(right) - right).max() < 1e-12


def test_refactoring_the_same_pattern_forgets_the_old_values():
    matrix, places = grid_matrix(12)
    triangle = upper(matrix)
    solver = Multifrontal(triangle.indptr, triangle.indices, places)
    factors = solver.factor(triangle.data, reuse=solver.factor(-triangle.data))
    assert factors.negative == 0
    right = np.ones(matrix.shape[0])
    assert np.abs(matrix @ factors.solve(right) - right).max() < 1e-9


def test_factors_stay_as_they_are_whatever_else_is_factorised():
    """Nor can factors be used whose memory was given away."""
    matrix, _ = grid_matrix(12)
    triangle, right = upper(matrix), RANDOM.standard_normal(matrix.shape[0])
    solver = Multifrontal(triangle.indptr, triangle.indices)
    first = solver.factor(triangle.data)
    before, other = first.solve(right), None
    for scale in (-1.0, 3.0, 0.1):
        other = solver.factor(scale * triangle.data, reuse=other)
        np.testing.assert_allclose(other.solve(right), before / scale, rtol=1e-9)
    np.testing.assert_array_equal(first.solve(right), before)
    again = solver.factor(triangle.data, reuse=first)
    np.testing.assert_array_equal(again.solve(right), before)
    with pytest.raises(AssertionError, match="given to another"):
        first.solve(right)


def test_nearly_singular_system_is_solved_to_a_small_residual():
    matrix, places = grid_matrix(12)
    lowest = np.linalg.eigvalsh(matrix.toarray())[0]
    matrix = (matrix - (lowest - 1e-9) * sparse.eye(matrix.shape[0])).tocsc()
    triangle = upper(matrix)
    factors = Multifrontal(triangle.indptr, triangle.indices, places).factor(triangle.data)
    assert factors.negative == 0
    right = RANDOM.standard_normal(matrix.shape[0])
    x = factors.solve(right)
    assert np.abs(matrix @ x - right).max() < 1e-12 * np.abs(x).max() * np.abs(triangle.data).max()


def test_digits_lost_to_a_small_pivot_are_won_back():
    """Elimination without pivoting loses eight digits here: 1e-8 beside entries of order 1."""
    matrix = np.array([[1e-8, 1.0, 0.3], [1.0, 1e-8, 0.7], [0.3, 0.7, 2.0]])
    triangle = upper(matrix)
    factors = Multifrontal(triangle.indptr, triangle.indices, np.arange(3.0)[:, None]).factor(triangle.data)
    assert factors.negative == np.count_nonzero(np.linalg.eigvalsh(matrix) < 0)
    exact = np.array([1.0, -2.0, 3.0]) / 7
    assert np.abs(factors.solve(matrix @ exact) - exact).max() < 1e-14


@pytest.mark.parametrize(("pivot", "looked_at"), [(4.0, 1), (1e-8, 3)])
def test_solutions_are_looked_at_until_they_are_accurate(monkeypatch, pivot, looked_at):
    matrix, found = np.array([[pivot, 1.0, 0.3], [1.0, pivot, 0.7], [0.3, 0.7, 2.0]]), []
    residual = sparse_ldl._residual
    monkeypatch.setattr(sparse_ldl, "_residual", lambda *given: found.append(1) or residual(*given))
    triangle = upper(matrix)
    factors = Multifrontal(triangle.indptr, triangle.indices, np.arange(3.0)[:, None]).factor(triangle.data)
    assert not factors.solve(np.zeros(3)).any()  # which says nothing of the factors
    found.clear()
    for right in np.eye(3):
        assert np.abs(matrix @ factors.solve(right) - right).max() < 1e-14
    assert len(found) == looked_at


@pytest.mark.parametrize("bad", [0.0, np.nan, np.inf])
def test_vanishing_pivot_is_refused(bad):
    triangle = upper(np.diag([1.0, 2.0, 3.0]))
    triangle.data[1] = bad
    with pytest.raises(SingularError):
        Multifrontal(triangle.indptr, triangle.indices).factor(triangle.data)


def test_dissection_orders_every_block_once_and_separators_last():
    matrix, places = grid_matrix(20, 1)
    coupled = sparse.csr_matrix(matrix - sparse.diags(matrix.diagonal()))
    coupled.eliminate_zeros()
    order = dissect(places, coupled.indptr.astype(np.int64), coupled.indices.astype(np.int64))
    assert sorted(order) == list(range(400))
    last = places[order[-40:]]  # the first separator: two lines of nodes, since bending couples second neighbours
    assert np.ptp(last, axis=0).min() == 1.0


def rods_graph(count, inner):
    """Graph of `count` rods across as many others, with `inner` nodes in each span and past the last joints, and where
    the nodes lie: each is coupled to two on each side, along its rods. Joints are numbered with the first rods."""
    step, numbers = inner + 1, {}
    stations = range(-inner, (count - 1) * step + inner + 1)
    rods = [[(x, y * step) for x in stations] for y in range(count)]
    rods += [[(x * step, y) for y in stations] for x in range(count)]
    for rod in rods:
        for node in rod:
            numbers.setdefault(node, len(numbers))
    graph = np.zeros((len(numbers), len(numbers)), dtype=bool)
    for rod in rods:
        nodes = [numbers[node] for node in rod]
        for apart in (1, 2):
            graph[nodes[apart:], nodes[:-apart]] = graph[nodes[:-apart], nodes[apart:]] = True
    return graph, np.array(list(numbers))


@pytest.mark.parametrize("inner", [1, 4, 5])
def test_inner_nodes_of_spans_are_eliminated_first(inner):
    """Against elimination by its definition: whoever is eliminated leaves all that it was coupled to coupled."""
    graph, places = rods_graph(5, inner)
    coupled = sparse.csr_matrix(graph)
    first, kept, start, neighbours = sparse_ldl._without_spans(
        coupled.indptr.astype(np.int64), coupled.indices.astype(np.int64)
    )
    assert len(first) == (0 if inner == 1 else 2 * 5 * 6 * (inner - 1))
    assert sorted([*first, *kept]) == list(range(len(places)))
    for b in first:
        left = np.flatnonzero(graph[b])
        graph[np.ix_(left, left)] = True
        graph[b] = graph[:, b] = False
    np.fill_diagonal(graph, False)
    found = sparse.csr_matrix((np.ones(len(neighbours)), neighbours, start), shape=(len(kept), len(kept))).toarray()
    assert np.array_equal(found, graph[np.ix_(kept, kept)])


def test_blocks_that_are_not_coupled_as_wholes_are_taken_apart():
    """Nodes of two unknowns, of which only the first of each is coupled to the next node."""
    size = 20
    matrix = sparse.lil_matrix(4.0 * sparse.identity(size))
    for k in range(0, size - 2, 2):
        matrix[k, k + 2] = matrix[k + 2, k] = 1.0
        matrix[k, k + 1] = matrix[k + 1, k] = 0.5
    triangle, right = upper(matrix.tocsr()), RANDOM.standard_normal(size)
    factors = Multifrontal(triangle.indptr, triangle.indices, np.repeat(np.arange(10.0), 2)[:, None]).factor(
        triangle.data
    )
    assert np.abs(matrix @ factors.solve(right) - right).max() < 1e-14


def test_what_memory_held_before_does_not_matter(monkeypatch):
    """Kernels read some numbers past what is theirs; nothing of it may get into the solution."""
    matrix, places = grid_matrix(23)
    triangle, right = upper(matrix), RANDOM.standard_normal(matrix.shape[0])
    found = []
    for rubbish in (0.0, np.nan, 1e300):
        make = sparse_ldl.room

        def filled(numbers, make=make, rubbish=rubbish):
            memory = make(numbers)
            memory[:] = rubbish
            return memory

        with monkeypatch.context() as patched:
            patched.setattr(sparse_ldl, "room", filled)
            patched.setattr(dense, "room", filled)
            factors = Multifrontal(triangle.indptr, triangle.indices, places).factor(triangle.data)
            found.append(factors.solve(right))
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(found[2], found[0])


@pytest.mark.parametrize("count", [1, 3, 4, 9])
def test_many_right_hand_sides_have_the_bits_of_each_alone(count):
    matrix, places = grid_matrix(20)
    triangle, right = upper(matrix), RANDOM.standard_normal((count, matrix.shape[0]))
    solver = Multifrontal(triangle.indptr, triangle.indices, places)
    together, alone = solver.factor(triangle.data), solver.factor(triangle.data)
    np.testing.assert_array_equal(together.solve(right), [alone.solve(row) for row in right])
    np.testing.assert_array_equal(together.solve(right[::-1]), [alone.solve(row) for row in right[::-1]])


def test_scratch_memory_that_another_thread_takes_first_is_no_fault():
    class TakenMeanwhile(list):
        def __bool__(self):
            return True  # it was still there when it was looked for

    matrix, places = grid_matrix(9)
    triangle, right = upper(matrix), RANDOM.standard_normal(matrix.shape[0])
    solver = Multifrontal(triangle.indptr, triangle.indices, places)
    before = solver.factor(triangle.data).solve(right)
    solver._spare = TakenMeanwhile()
    np.testing.assert_array_equal(solver.factor(triangle.data).solve(right), before)
