"""Multifrontal LDL^T without pivoting, for the matrices of large grids.

The columns of the factor fall into *supernodes* with one row structure. Each has a dense *front*: its own
columns, summed with the update matrices of its children in the elimination tree; its pivots are eliminated,
what remains is the update matrix for its parent (Duff and Reid 1983). Dense work on contiguous blocks, most of
it by BLAS (`dense`), the order of elimination from where the unknowns lie (`ordering`), the symbolic phase once
per pattern (`symbolic`).
"""

import os
from contextlib import nullcontext
from threading import Thread

import numba as nb
import numpy as np
import qdldl
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from gridshell.solve.dense import blas, dgemm, subtract_product
from gridshell.solve.linear import SingularError
from gridshell.solve.ordering import dissect
from gridshell.solve.symbolic import Blocks, blocks_of, plan_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BLOCK = 32  # pivots eliminated together
STRIP = 64  # rows of an update matrix that are made together: of its lower triangle only their own square is wasted
ACCURATE = 1e-13  # a residual this small, relative to |A| |x|, needs no refinement
MOST_THREADS = 4  # the last part is one thread's work
LARGE = 128  # rows from which on BLAS would use threads for a front


class Multifrontal:
    """LDL^T of matrices of one pattern (upper triangle, compressed columns).

    Parameters
    ----------
    places : (n, d) where each unknown lies, for nested dissection; None orders by approximate minimum degree.
    """

    def __init__(self, indptr: NDArray[np.int64], indices: NDArray[np.int64], places: Floats | None = None) -> None:
        self._indptr, self._indices = indptr, indices
        size = len(indptr) - 1
        blocks = blocks_of(indptr, indices, np.arange(size + 1) if places is None else _first_of_places(places))
        order = _minimum_degree(indptr, indices) if places is None else _dissected(places, blocks)
        self._plan = plan_of(indptr, indices, blocks, order)
        self._panels = np.empty(int(self._plan.panel_start[-1]))
        self._scratch = [np.empty(self._plan.largest_panel) for _ in range(threads())]
        self._stacks = np.empty(self._plan.stack_size)
        self._pivots = np.empty(size)

    @property
    def fill(self) -> int:
        """Stored values of the factor."""
        return len(self._panels)

    def factor(self, data: Floats) -> int:
        plan, self._data = self._plan, data
        with blas().limit(limits=1) if plan.largest_front >= LARGE else nullcontext():
            ok = self._in_parts(data)
        if not ok:
            raise SingularError("a pivot of the factorisation vanishes")
        return int(np.count_nonzero(self._pivots < 0))

    def _in_parts(self, data: Floats) -> bool:
        """Eliminate the parts of the plan, each by whichever thread is free, then the last; the bits do not depend on
        the threads."""
        plan, starts = self._plan, self._plan.part_start
        separate, ok = iter(range(len(starts) - 2)), [True]

        def eliminate(part: int, scratch: Floats) -> bool:
            return _numeric(
                plan.parts[starts[part] : starts[part + 1]], dgemm(), data, plan.first, plan.row_start, plan.relative,
                plan.child_start, plan.children, plan.entry_start, plan.entry_source, plan.entry_place,
                plan.panel_start, plan.update_start, self._stacks, scratch, self._panels, self._pivots,
            )  # fmt: skip

        def work(scratch: Floats) -> None:
            for part in separate:
                ok.append(eliminate(part, scratch))

        others = [Thread(target=work, args=(scratch,)) for scratch in self._scratch[1 : len(starts) - 2]]
        for thread in others:
            thread.start()
        work(self._scratch[0])
        for thread in others:
            thread.join()
        return all(ok) and eliminate(len(starts) - 2, self._scratch[0])

    def solve(self, right: Floats) -> Floats:
        x = self._substitute(right)
        residual, size = _residual(self._indptr, self._indices, self._data, x, right)
        if np.abs(residual).max(initial=0.0) > ACCURATE * size:
            x += self._substitute(residual)
        return x

    def _substitute(self, right: Floats) -> Floats:
        plan = self._plan
        x = right[plan.order]
        _solve(
            x, plan.first, plan.row_start, plan.rows, plan.panel_start, self._panels, self._pivots, plan.largest_front
        )
        result = np.empty_like(x)
        result[plan.order] = x
        return result


def threads() -> int:
    """Threads of a factorisation: NUMBA_NUM_THREADS, by default one per processor, at most `MOST_THREADS`."""
    return min(int(nb.config.NUMBA_NUM_THREADS), os.cpu_count() or 1, MOST_THREADS)


def _dissected(places: Floats, blocks: Blocks) -> Ints:
    """Blocks in the order of a nested dissection of their places."""
    return dissect(places[blocks.begin[:-1]], blocks.start, blocks.neighbours)


def _first_of_places(places: Floats) -> Ints:
    """Where blocks begin: unknowns in a row that lie at one place, such as the directions of a node; and their end."""
    other = (places[1:] != places[:-1]).any(axis=1)
    return np.concatenate([[0], 1 + np.flatnonzero(other), [len(places)]])


def _minimum_degree(indptr: NDArray[np.int64], indices: NDArray[np.int64]) -> NDArray[np.intp]:
    """The AMD order, as QDLDL finds it."""
    size = len(indptr) - 1
    data = np.full(len(indices), 1e-3 / max(1, size))
    data[indptr[1:] - 1] = 1.0
    solver = qdldl.Solver(csc_matrix((data, indices, indptr), shape=(size, size)), upper=True)
    return np.asarray(solver.factors()[2], dtype=np.intp)


@nb.njit(cache=True, error_model="numpy", nogil=True)
def _numeric(  # type: ignore[no-untyped-def]
    part, dgemm, data, first, row_start, relative, child_start, children, entry_start, entry_source, entry_place,
    panel_start, update_start, stacks, unscaled, panels, pivots,
):  # fmt: skip
    """Eliminate the supernodes of a `part`, front by front; False where a pivot vanishes or is not finite.

    A front of `size` rows and `own` pivots is kept as its pivots' rows (own, size), in `unscaled` while it is
    eliminated, then divided by the pivots in `panels`; and as its update matrix, upper triangle, in `stacks`.
    """
    integers, numbers = np.empty(6, dtype=np.int32), np.empty(2)
    for s in part:
        size, own = row_start[s + 1] - row_start[s], first[s + 1] - first[s]
        m = size - own
        rows = unscaled[: own * size].reshape(own, size)
        rows[:] = 0.0
        for e in range(entry_start[s], entry_start[s + 1]):
            unscaled[entry_place[e]] += data[entry_source[e]]
        for e in range(child_start[s], child_start[s + 1]):
            into, update = _child(children[e], first, row_start, relative, update_start, stacks)
            _add_rows(rows, update, into, own)
        panel = panels[panel_start[s] : panel_start[s + 1]].reshape(own, size)
        if not _eliminate(dgemm, integers, numbers, rows, panel, pivots[first[s] : first[s + 1]]):
            return False
        update = stacks[update_start[s] : update_start[s] + m * m].reshape(m, m)
        for a in range(0, m, STRIP):
            b = min(a + STRIP, m)
            subtract_product(
                dgemm, integers, numbers, b - a, m - a, own, panel.ctypes.data + 8 * (own + a), size,
                rows.ctypes.data + 8 * (own + a), size, 0.0, update.ctypes.data + 8 * (a * m + a), m,
            )  # fmt: skip
        for e in range(child_start[s], child_start[s + 1]):
            into, other = _child(children[e], first, row_start, relative, update_start, stacks)
            _add_updates(update, other, into, own)
    return True


@nb.njit(cache=True, error_model="numpy")
def _child(c, first, row_start, relative, update_start, stacks):  # type: ignore[no-untyped-def]
    """Where the rows of a child's update matrix go in its parent's front, and that matrix."""
    into = relative[row_start[c] + first[c + 1] - first[c] : row_start[c + 1]]
    m = len(into)
    return into, stacks[update_start[c] : update_start[c] + m * m].reshape(m, m)


@nb.njit(cache=True, error_model="numpy")
def _add_rows(rows, update, into, own):  # type: ignore[no-untyped-def]
    """Add to the rows of a front's pivots what a child's update matrix has for them."""
    for b in range(len(into)):
        if into[b] >= own:
            break
        row, source = rows[into[b]], update[b]
        for a in range(b, len(into)):
            row[into[a]] += source[a]


@nb.njit(cache=True, error_model="numpy")
def _add_updates(target, update, into, own):  # type: ignore[no-untyped-def]
    """Add a child's update matrix to its parent's, but for what `_add_rows` has added."""
    first = np.searchsorted(into, own)
    for b in range(first, len(into)):
        row, source = target[into[b] - own], update[b]
        for a in range(b, len(into)):
            row[into[a] - own] += source[a]


@nb.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _eliminate(dgemm, integers, numbers, rows, panel, pivots):  # type: ignore[no-untyped-def]
    """Eliminate the pivots of a front: D L^T in `rows` (own, size), L^T in `panel`, D in `pivots`."""
    own, size = rows.shape
    for begin in range(0, own, BLOCK):
        end = min(begin + BLOCK, own)
        for k in range(begin, end):
            row = rows[k, k:]
            after = begin + (k - begin) // 4 * 4
            for q in range(begin, after, 4):
                _subtract_four(
                    row, rows[q, k:], rows[q + 1, k:], rows[q + 2, k:], rows[q + 3, k:],
                    panel[q, k], panel[q + 1, k], panel[q + 2, k], panel[q + 3, k],
                )  # fmt: skip
            for q in range(after, k):
                factor, other = panel[q, k], rows[q, k:]
                for j in range(len(row)):
                    row[j] -= factor * other[j]
            d = row[0]
            if not np.isfinite(d) or d == 0.0:
                return False
            pivots[k] = d
            inverse, scaled = 1.0 / d, panel[k, k:]
            for j in range(len(row)):
                scaled[j] = inverse * row[j]
        if end < own:
            corner = 8 * (begin * size + end)
            subtract_product(
                dgemm, integers, numbers, own - end, size - end, end - begin, panel.ctypes.data + corner, size,
                rows.ctypes.data + corner, size, 1.0, rows.ctypes.data + 8 * (end * size + end), size,
            )  # fmt: skip
    return True


@nb.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _subtract_four(row, r0, r1, r2, r3, f0, f1, f2, f3):  # type: ignore[no-untyped-def]
    for j in range(len(row)):
        row[j] -= f0 * r0[j] + f1 * r1[j] + f2 * r2[j] + f3 * r3[j]


@nb.njit(cache=True, error_model="numpy")
def _residual(indptr, indices, data, x, right):  # type: ignore[no-untyped-def]
    """right - A x of a matrix stored by its upper triangle, and the largest entry of |A| |x|."""
    residual, size = right.copy(), np.zeros(len(x))
    for j in range(len(x)):
        for e in range(indptr[j], indptr[j + 1]):
            i = indices[e]
            product = data[e] * x[j]
            residual[i] -= product
            size[i] += abs(product)
            if i != j:
                product = data[e] * x[i]
                residual[j] -= product
                size[j] += abs(product)
    return residual, size.max() if len(x) else 0.0


@nb.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _solve(x, first, row_start, rows, panel_start, panels, pivots, largest):  # type: ignore[no-untyped-def]
    """Forward and backward substitution in place, supernode by supernode."""
    supers = len(first) - 1
    local = np.empty(largest)
    for s in range(supers):
        size, own = row_start[s + 1] - row_start[s], first[s + 1] - first[s]
        panel = panels[panel_start[s] : panel_start[s + 1]].reshape(own, size)
        here = rows[row_start[s] : row_start[s + 1]]
        values = local[:size]
        values[:own] = x[first[s] : first[s + 1]]
        values[own:] = 0.0
        for k in range(own):
            value, row = values[k], panel[k]
            for i in range(k + 1, size):
                values[i] -= row[i] * value
        x[first[s] : first[s + 1]] = values[:own]
        for i in range(own, size):
            x[here[i]] += values[i]
    for s in range(supers - 1, -1, -1):
        size, own = row_start[s + 1] - row_start[s], first[s + 1] - first[s]
        panel = panels[panel_start[s] : panel_start[s + 1]].reshape(own, size)
        here = rows[row_start[s] : row_start[s + 1]]
        values = local[:size]
        for i in range(own, size):
            values[i] = x[here[i]]
        for k in range(own - 1, -1, -1):
            total, row = 0.0, panel[k]
            for i in range(k + 1, size):
                total += row[i] * values[i]
            values[k] = x[first[s] + k] / pivots[first[s] + k] - total
        x[first[s] : first[s + 1]] = values[:own]
