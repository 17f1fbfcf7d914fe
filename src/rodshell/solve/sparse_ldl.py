"""Sparse symmetric indefinite systems: LDL^T without pivoting, the analysis of a pattern apart from the factors.

A solver is what follows from the pattern alone: it never changes and serves any number of matrices. Each factorisation
gives `Factors` of its own.

In a multifrontal factorisation the columns of the factor fall into *supernodes* with one row structure. Each has a
dense *front*: its own columns, summed with the update matrices of its children in the elimination tree; its pivots are
eliminated, what remains is the update matrix for its parent (Duff and Reid 1983). Dense work on contiguous blocks
(`dense`), the order of elimination by nested dissection of the unknowns' coordinates (`dissect`) or, where they have
none, by minimum degree; the symbolic phase once per pattern (`symbolic`).
"""

from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu

from rodshell.arrays import Floats, Longs
from rodshell.kernels import njit
from rodshell.model import BlockRows
from rodshell.solve.dense import (
    OVERWRITTEN,
    PAD,
    add_rows,
    backward,
    eliminate,
    forward,
    padded,
    room,
    subtract_product,
    workspace,
)
from rodshell.solve.simd_kernels import ROWS, matrix_view
from rodshell.solve.symbolic import Plan, blocks_of, coupled, plan_of
from rodshell.threads import in_threads, threads

_ACCURATE = 1e-13  # a residual this small, relative to the diagonal times x, needs no refinement
SURELY = 1e-14  # and after this small a one, no other is looked at
_NONE_ABOVE = np.empty(0, dtype=np.int64)
_GIVEN_AWAY = "the memory of these factors was given to another factorisation"


class SingularError(ArithmeticError):
    """A pivot of the factorisation is zero: nothing holds some motion."""


class _Scratch(NamedTuple):
    """Memory for one factorisation or solution at a time; nothing in it is needed afterwards."""

    threads: list[tuple[Floats, Floats]]  # of each thread: a front's pivot rows, and the dense kernels' workspace
    stacks: Floats  # update matrices
    fronts: list[tuple[Floats, Floats]]  # of each thread: a front's part of `ROWS` solutions, and scratch of them


class Multifrontal:
    """Multifrontal LDL^T of matrices of one pattern, upper triangle in compressed columns.

    Args:
        indptr, indices: the pattern, every diagonal present.
        coordinates: (n, d) where each unknown lies, or (b, d) where each of the `blocks` does, for nested dissection;
            None orders by minimum degree.
        blocks: of unknowns that lie at one place; None: they are looked for.
    """

    def __init__(
        self, indptr: Longs, indices: Longs, coordinates: Floats | None = None, *, blocks: BlockRows | None = None
    ) -> None:
        indptr, indices = (np.ascontiguousarray(part, dtype=np.int64) for part in (indptr, indices))
        self.indptr, self.indices = indptr, indices
        if coordinates is None:
            graph = coupled(indptr, blocks_of(indptr, indices, np.arange(len(indptr))))
            order = _minimum_degree(indptr, indices)
        else:
            if blocks is None:
                blocks = blocks_of(indptr, indices, _block_begins(coordinates))
                coordinates = coordinates[blocks.begin[:-1]]
            graph = coupled(indptr, blocks)
            order = dissect(coordinates, graph.start, graph.neighbours)
        self.plan = plan_of(indptr, graph, order)
        self.parts, self.levels = self.plan.each, self.plan.levels
        self._spare = list[_Scratch]()  # scratch memory that no factorisation is using

    @property
    def fill(self) -> int:
        """Stored values of the factor, with the padding of its rows."""
        return int(self.plan.panel_start[-1])

    def factor(self, data: Floats, *, reuse: "Factors | None" = None) -> "Factors":
        """The factors of the matrix with the values `data`, which they keep: it must not be changed afterwards.

        Args:
            data: (nnz,) values of the upper triangle, in the order of the pattern.
            reuse: factors by this solver that are not needed any more: the new ones take over their memory, and solving
                with the old ones is an error from then on.

        Raises:
            SingularError: a pivot vanishes or is not finite.
        """
        memory = None if reuse is None else reuse.given_away()
        data = np.ascontiguousarray(data, dtype=np.float64)
        panels, pivots = memory or (room(self.fill), np.empty(len(self.indptr) - 1))
        scratch = self.take_scratch()
        regular = _eliminate_all(self.plan, self.levels, data, scratch, panels, pivots)
        self.give_back(scratch)
        if not regular:
            raise SingularError("a pivot of the factorisation vanishes")
        return Factors(self, data, panels, pivots)

    def product(self, data: Floats, x: Floats) -> Floats:
        """(n,) product A x of the symmetric matrix whose upper triangle has the values `data` (nnz,)."""
        data = np.require(data, requirements="W")  # that of a tangent cannot be written to, see there
        residual, *_ = _residual(self.indptr, self.indices, data, np.ascontiguousarray(x), np.zeros(len(x)))
        return np.asarray(-residual)

    @cached_property
    def above(self) -> tuple[Longs, Longs]:
        """Permuted unknowns (m,) of the plan's last part, if it is not the only one; and the place (n,) of each unknown
        among them, or -1."""
        plan, place = self.plan, np.full(len(self.indptr) - 1, -1)
        *separate, last = self.parts
        columns = [np.arange(plan.first[s], plan.first[s + 1]) for s in last.tolist()] if separate else []
        unknowns = np.concatenate([*columns, np.arange(0)])
        place[unknowns] = np.arange(len(unknowns))
        return unknowns, place

    def take_scratch(self) -> _Scratch:
        """Scratch memory, which is to be given back."""
        try:  # popped at once: another thread may take the last
            return self._spare.pop()
        except IndexError:
            plan, count = self.plan, range(threads())
            eliminated = [(room(plan.largest_panel), workspace(plan.largest_front)) for _ in count]
            largest = plan.largest_front + PAD
            solved = [(room(ROWS * largest), room(ROWS * largest)) for _ in count]
            return _Scratch(eliminated, room(plan.stack_size), solved)

    def give_back(self, scratch: _Scratch) -> None:
        """Keep scratch memory for the next factorisation or solution."""
        self._spare.append(scratch)


class Factors:
    """The factors of one matrix. They never change, unless their memory is given to another factorisation.

    Attributes:
        negative: number of negative pivots, which is that of negative eigenvalues (Sylvester's law of inertia).
    """

    def __init__(self, solver: Multifrontal, data: Floats, panels: Floats, pivots: Floats) -> None:
        self._solver, self._data = solver, data
        self._memory: tuple[Floats, Floats] | None = (panels, pivots)
        self._surely = False  # solutions are accurate
        self.negative = int(np.count_nonzero(pivots < 0))

    def given_away(self) -> tuple[Floats, Floats] | None:
        """The memory, for other factors; these cannot be used any more."""
        memory, self._memory = self._memory, None
        return memory

    def solve(self, right: Floats) -> Floats:
        """Solution for a right-hand side (n,), or for each of many (k, n), with one step of iterative refinement where
        it is not accurate.

        Accuracy is a matter of the factors more than of the right-hand side: after an accurate solution no other is
        looked at.
        """
        right = np.ascontiguousarray(right, dtype=np.float64)
        x = self._substitute(right)
        rows = () if self._surely else zip(x.reshape(-1, x.shape[-1]), right.reshape(-1, x.shape[-1]), strict=True)
        for solution, given in rows:
            residual, left, size = _residual(self._solver.indptr, self._solver.indices, self._data, solution, given)
            if left > _ACCURATE * size:
                solution += self._substitute(residual)
            self._surely = 0.0 < left <= SURELY * size
            if self._surely:
                break
        return x

    def _substitute(self, right: Floats) -> Floats:
        """Solutions for a right-hand side (n,) or for many (k, n), `ROWS` of which share the reading of the factors."""
        rows = right.reshape(-1, right.shape[-1])
        result = np.empty_like(rows)
        for k in range(0, len(rows), ROWS):
            result[k : k + ROWS] = self._solved(rows[k : k + ROWS])
        return result.reshape(right.shape)

    def _solved(self, right: Floats) -> Floats:
        """(m, n) of at most `ROWS` right-hand sides."""
        assert self._memory is not None, _GIVEN_AWAY
        solver, plan, (panels, pivots) = self._solver, self._solver.plan, self._memory
        x, parts, scratch = right.take(plan.order, axis=1), solver.parts, solver.take_scratch()
        fronts, last = (plan.first, plan.row_start, plan.rows, plan.panel_start, panels), len(parts) - 1
        memory, (above, place) = scratch.fronts, solver.above
        # each part's own, so that the sum does not depend on the threads
        sums = np.zeros((last, len(x), len(above)))

        def rise(part: int, thread: int) -> None:
            _forward(parts[part], x, place, sums[part], *fronts, *memory[thread])

        def descend(part: int, thread: int) -> None:
            _backward(parts[part], x, *fronts, pivots, *memory[thread])

        if last:
            in_threads(rise, last, most=len(memory))
            x[:, above] += sums.sum(axis=0)
        _forward(parts[last], x, _NONE_ABOVE, np.empty((len(x), 0)), *fronts, *memory[0])
        descend(last, 0)
        in_threads(descend, last, most=len(memory))
        solver.give_back(scratch)
        result = np.empty_like(x)
        result[:, plan.order] = x
        return result


def _eliminate_all(
    plan: Plan, levels: list[list[Longs]], data: Floats, scratch: _Scratch, panels: Floats, pivots: Floats
) -> bool:
    """Eliminate all supernodes, level by level, those of one level each by whichever thread is free; the bits do not
    depend on the threads. False where a pivot vanishes or is not finite."""
    regular = list[bool]()
    for level in levels:

        def run(k: int, thread: int, level: list[Longs] = level) -> None:
            regular.append(
                _numeric(
                    level[k], data, plan.first, plan.row_start,
                    plan.child_start, plan.children, plan.run_start, plan.runs,
                    plan.entry_start, plan.entry_source, plan.entry_place,
                    plan.panel_start, plan.update_start, scratch.stacks, *scratch.threads[thread], panels, pivots,
                )
            )  # fmt: skip

        in_threads(run, len(level), most=len(scratch.threads))
        if not all(regular):
            return False
    return True


def _block_begins(coordinates: Floats) -> Longs:
    """Where blocks begin: unknowns in a row that lie at one place, such as the directions of a node; and their end."""
    other = np.zeros(len(coordinates[1:]), dtype=bool)
    for along in coordinates.T:
        other |= along[1:] != along[:-1]
    return np.concatenate([[0], 1 + np.flatnonzero(other), [len(coordinates)]])


def _minimum_degree(indptr: Longs, indices: Longs) -> Longs:
    """The order by minimum degree, as SuperLU finds it."""
    size = len(indptr) - 1
    data = np.full(len(indices), 1e-3 / max(1, size))
    data[indptr[1:] - 1] = 0.5
    upper = csc_matrix((data, indices, indptr), shape=(size, size))
    return np.argsort(splu(upper + upper.T, "MMD_AT_PLUS_A", diag_pivot_thresh=0.0).perm_c).astype(np.int64)


@njit("i1 f1 i1 i1 i1 i1 i1 i2 i1 i1 i1 i1 i1 f1 f1 f1 f1 f1", nogil=True)
def _numeric(  # type: ignore[no-untyped-def]
    part, data, first, row_start, child_start, children, run_start, runs, entry_start, entry_source, entry_place,
    panel_start, update_start, stacks, unscaled, work, panels, pivots,
):  # fmt: skip
    """Eliminate the supernodes of a `part`, front by front; False where a pivot vanishes or is not finite.

    A front of `size` rows and `width` pivots is kept as its pivots' rows (width, padded), in `unscaled` while it is
    eliminated, then divided by the pivots in `panels`; and as its update matrix, upper triangle, in `stacks`.
    """
    for s in part:
        size, width = row_start[s + 1] - row_start[s], first[s + 1] - first[s]
        stride = padded(size)
        rows = matrix_view(unscaled, 0, width, stride)
        rows[:] = 0.0
        for e in range(entry_start[s], entry_start[s + 1]):
            unscaled[entry_place[e]] += data[entry_source[e]]
        for e in range(child_start[s], child_start[s + 1]):
            child = _update(children[e], first, row_start, update_start, stacks)
            add_rows(rows, child, runs[run_start[e] : run_start[e + 1]], width)
        panel = matrix_view(panels, panel_start[s], width, stride)
        if not eliminate(rows, panel, pivots[first[s] : first[s + 1]], work):
            return False
        update = _update(s, first, row_start, update_start, stacks)
        subtract_product(panel, rows, width, OVERWRITTEN, update[:, :], work)  # of the type that `eliminate` gives
        for e in range(child_start[s], child_start[s + 1]):
            child = _update(children[e], first, row_start, update_start, stacks)
            add_rows(update, child, runs[run_start[e] : run_start[e + 1]], size)
    return True


@njit(inline="always")
def _update(s, first, row_start, update_start, stacks):  # type: ignore[no-untyped-def]
    """The update matrix (n, padded) of a front."""
    size = row_start[s + 1] - row_start[s] - (first[s + 1] - first[s])
    return matrix_view(stacks, update_start[s], size, padded(size))


@njit("i1 i1 f1 f1 f1")
def _residual(indptr, indices, data, x, right):  # type: ignore[no-untyped-def]
    """right - A x of a matrix stored by its upper triangle; its largest entry, and that of |D x|, D being its
    diagonal."""
    residual, left, size = right.copy(), 0.0, 0.0
    for j in range(len(x)):
        last, total, here = indptr[j + 1] - 1, 0.0, x[j]
        for e in range(indptr[j], last):
            i = indices[e]
            residual[i] -= data[e] * here
            total += data[e] * x[i]
        product = data[last] * here
        residual[j] -= total + product
        size = max(size, abs(product))
    for j in range(len(x)):
        left = max(left, abs(residual[j]))
    return residual, left, size


@njit("i1 f2 i1 f2 i1 i1 i1 i1 f1 f1 f1", nogil=True)
def _forward(part, x, above, sums, first, row_start, rows, panel_start, panels, local, aside):  # type: ignore[no-untyped-def]
    """Forward substitution in place, supernode by supernode of a `part`, for each row of `x` (m, n). What goes to
    unknowns outside of the part is added to `sums` (m, l), at the place that `above` (n,) gives them; it is -1 within
    the part, or empty."""
    count = len(x)
    for s in part:
        begin, at = first[s], row_start[s]
        size, width = row_start[s + 1] - at, first[s + 1] - begin
        stride = padded(size)
        panel, values = matrix_view(panels, panel_start[s], width, stride), matrix_view(local, 0, count, stride)
        for r in range(count):
            right, whole = values[r], x[r]
            for i in range(width):
                right[i] = whole[begin + i]
            for i in range(width, stride):
                right[i] = 0.0
        if count == 1:
            forward(panel, values, 1, aside)
        else:
            forward(panel, values, count, aside)
        for r in range(count):
            right, whole = values[r], x[r]
            for i in range(width):
                whole[begin + i] = right[i]
            for i in range(width, size):
                row = rows[at + i]
                if len(above) > 0 and above[row] >= 0:
                    sums[r, above[row]] += right[i]
                else:
                    whole[row] += right[i]


@njit("i1 f2 i1 i1 i1 i1 f1 f1 f1 f1", nogil=True)
def _backward(part, x, first, row_start, rows, panel_start, panels, pivots, local, aside):  # type: ignore[no-untyped-def]
    """Backward substitution in place, supernode by supernode of a `part`, for each row of `x` (m, n)."""
    count = len(x)
    for k in range(len(part) - 1, -1, -1):
        s = part[k]
        begin, at = first[s], row_start[s]
        size, width = row_start[s + 1] - at, first[s + 1] - begin
        stride = padded(size)
        panel, values = matrix_view(panels, panel_start[s], width, stride), matrix_view(local, 0, count, stride)
        for r in range(count):
            right, whole = values[r], x[r]
            for i in range(size):
                right[i] = whole[rows[at + i]]
            for i in range(size, stride):
                right[i] = 0.0
        if count == 1:
            backward(panel, pivots[begin : begin + width], values, 1, aside)
        else:
            backward(panel, pivots[begin : begin + width], values, count, aside)
        for r in range(count):
            right, whole = values[r], x[r]
            for i in range(width):
                whole[begin + i] = right[i]


_LEAF = 12  # blocks that are not divided further
_UNBALANCED = 0.3  # the smaller part of a cut holds at least this share
NEAREST = 4  # blocks to which one within a span is coupled, two on each side
SHORT = 3  # blocks within a span that are not worth to be taken together


def dissect(coordinates: Floats, start: Longs, neighbours: Longs) -> Longs:
    """Order blocks so that separators come last: first both parts of a cut, each dissected, then what joins them.

    The inner nodes of a span come before all others: what is cut is a graph of joints and a single node of each span,
    coupled as they are after that elimination.

    Args:
        coordinates: (n, d) where each block lies; any in which neighbours are near are suitable.
        start, neighbours: the blocks coupled to block i are neighbours[start[i] : start[i + 1]].

    Returns:
        (n,) blocks in the order of their elimination.
    """
    inner, kept, start, neighbours = _without_spans(start, neighbours)
    points = np.ascontiguousarray(coordinates[kept], dtype=np.float64)
    along = np.argsort(points.T, axis=1, kind="stable").astype(np.int64)
    _dissect(points, along, start, neighbours)
    return np.concatenate([inner, kept[along[0]]])


@njit("i1 i1")
def _without_spans(start, neighbours):  # type: ignore[no-untyped-def]
    """Blocks within spans, without the first of each, so that those of two spans are not coupled; all others; and the
    graph of these after the elimination of the first. Blocks within a span follow one after the other."""
    n, b = len(start) - 1, 0
    first_of = np.empty(n, dtype=np.int64)  # of its span, or -1
    while b < n:
        first, inside = b, True
        while inside and b < n:
            coupled = 0
            for e in range(start[b], start[b + 1]):
                coupled += first <= neighbours[e] < b
            inside = start[b + 1] - start[b] <= NEAREST and coupled >= min(2, b - first)
            b += inside
        for k in range(first, b):
            first_of[k] = first + 1 if b - first > SHORT and k > first else -1
        if b == first:
            first_of[b] = -1
            b += 1
    inner, kept, place = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    count = 0
    for b in range(n):
        place[b] = count
        inner[b - count] = kept[count] = b
        count += first_of[b] < 0
    mark, used = np.empty(n, dtype=np.int64), 0
    graph_start, graph = np.zeros(count + 1, dtype=np.int64), np.empty(NEAREST * len(neighbours), dtype=np.int64)
    for b in range(n):
        mark[b] = -1
    for k in range(count):
        mark[kept[k]] = k
        for e in range(start[kept[k]], start[kept[k] + 1]):
            a = neighbours[e]
            if first_of[a] < 0:
                if mark[a] != k:
                    mark[a], graph[used] = k, place[a]
                    used += 1
                continue
            a = first_of[a]
            while a < n and mark[a] != k and first_of[a] == first_of[neighbours[e]]:  # all that its span is coupled to
                mark[a] = k
                for i in range(start[a], start[a + 1]):
                    c = neighbours[i]
                    if first_of[c] < 0 and mark[c] != k:
                        mark[c], graph[used] = k, place[c]
                        used += 1
                a += 1
        graph_start[k + 1] = used
    return inner[: n - count].copy(), kept[:count].copy(), graph_start, graph[:used].copy()


@njit("f2 i2 i1 i1")
def _dissect(coordinates, along, start, neighbours):  # type: ignore[no-untyped-def]
    """Segments of the rows of `along` (d, n), blocks sorted by each coordinate, are divided in place until they are
    small, and stay sorted; `segment` is the segment of each block."""
    n = len(coordinates)
    segment, rank, part = np.zeros(n, dtype=np.int64), np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    first, last = np.empty(n, dtype=np.int64), np.empty(n, dtype=np.int64)
    touching, kept = np.empty((2, n + 1), dtype=np.int64), np.empty((3, n + 1), dtype=np.int64)
    begins, ends = np.empty(n + 2, dtype=np.int64), np.empty(n + 2, dtype=np.int64)  # a stack of segments
    begins[0], ends[0], height = 0, n, 1
    newest = 0
    while height > 0:
        height -= 1
        begin, end = begins[height], ends[height]
        if end - begin <= _LEAF:
            continue
        here, longest = segment[along[0, begin]], _longest(coordinates, along, begin, end)
        for k in range(begin, end):
            rank[along[longest, k]] = k - begin
        cut, joining = _best_cut(
            along[longest, begin:end], segment, here, rank, start, neighbours, first, last, touching
        )
        for k in range(begin, end):
            b = along[longest, k]
            side = 1 if rank[b] > cut else 0
            joins = last[b] > cut if joining == 0 else first[b] <= cut
            part[b] = 2 if side == joining and joins else side
        for d in range(len(along)):
            row, lower, upper, joined = along[d], 0, 0, 0
            for k in range(begin, end):
                b = row[k]
                kept[0, lower] = kept[1, upper] = kept[2, joined] = b
                lower += part[b] == 0
                upper += part[b] == 1
                joined += part[b] == 2
            for k in range(lower):
                row[begin + k] = kept[0, k]
            for k in range(upper):
                row[begin + lower + k] = kept[1, k]
            for k in range(joined):
                row[begin + lower + upper + k] = kept[2, k]
        middle, stop = begin + lower, begin + lower + upper
        for k in range(begin, end):
            segment[along[0, k]] = newest + 1 if k < middle else (newest + 2 if k < stop else -1)
        newest += 2
        begins[height], ends[height] = begin, middle
        begins[height + 1], ends[height + 1] = middle, stop
        height += 2


@njit(inline="always")
def _longest(coordinates, along, begin, end):  # type: ignore[no-untyped-def]
    """The coordinate in which a segment is longest."""
    axis, longest = 0, -1.0
    for d in range(len(along)):
        extent = coordinates[along[d, end - 1], d] - coordinates[along[d, begin], d]
        if extent > longest:
            axis, longest = d, extent
    return axis


@njit(inline="always")
def _best_cut(blocks, segment, here, rank, start, neighbours, first, last, touching):  # type: ignore[no-untyped-def]
    """Rank of the last block before the cut that the fewest blocks join, near the middle of the sorted `blocks` of a
    segment; and the side that these are on. `first` and `last` (n,) return the lowest and the highest rank to which
    each block is coupled in the segment, its own among them; `touching` (2, n + 1) is scratch."""
    n = len(blocks)
    for k in range(n + 1):
        touching[0, k] = touching[1, k] = 0
    for k in range(n):
        b, low, high = blocks[k], k, k
        for e in range(start[b], start[b + 1]):
            other = neighbours[e]
            at = rank[other] if segment[other] == here else k
            low, high = min(low, at), max(high, at)
        first[b], last[b] = low, high
        touching[0, k] += 1  # before the cut, and coupled to what is behind it: from this cut on, up to the last
        touching[0, high] -= 1
        touching[1, low] += 1  # behind the cut
        touching[1, k] -= 1
    margin = max(1, int(_UNBALANCED * n))
    best, least, joining, before, behind = margin - 1, np.inf, 0, 0, 0
    for k in range(n - margin):
        before += touching[0, k]
        behind += touching[1, k]
        cost = min(before, behind) * (1.0 + abs(2.0 * (k + 1) / n - 1.0))
        if k >= margin - 1 and cost < least:
            best, least, joining = k, cost, 0 if before <= behind else 1
    return best, joining
