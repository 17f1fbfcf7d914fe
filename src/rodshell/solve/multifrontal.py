"""Multifrontal LDL^T without pivoting, for the matrices of large grids.

The columns of the factor fall into *supernodes* with one row structure. Each has a dense *front*: its own
columns, summed with the update matrices of its children in the elimination tree; its pivots are eliminated,
what remains is the update matrix for its parent (Duff and Reid 1983). Dense work on contiguous blocks (`dense`), the
order of elimination from where the unknowns lie (`ordering`), the symbolic phase once per pattern (`symbolic`).
"""

import os
from threading import Thread

import numba as nb
import numpy as np
import qdldl
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from rodshell.arrays import Floats, Ints, Longs
from rodshell.solve.dense import add_rows, backward, eliminate, forward, padded, room, subtract_product, workspace
from rodshell.solve.linear import SingularError
from rodshell.solve.ordering import dissect
from rodshell.solve.symbolic import Blocks, blocks_of, plan_of

ACCURATE = 1e-13  # a residual this small, relative to |A| |x|, needs no refinement
MOST_THREADS = 4  # the last part is one thread's work


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
        self._panels = room(int(self._plan.panel_start[-1]))
        self._scratch = [
            (room(self._plan.largest_panel), workspace(self._plan.largest_front)) for _ in range(threads())
        ]
        self._stacks = room(self._plan.stack_size)
        self._pivots = np.empty(size)
        self._local = room(self._plan.largest_front), room(2 * self._plan.largest_front)

    @property
    def fill(self) -> int:
        """Stored values of the factor, with the padding of its rows."""
        return int(self._plan.panel_start[-1])

    def factor(self, data: Floats) -> int:
        self._data = data
        if not self._in_parts(data):
            raise SingularError("a pivot of the factorisation vanishes")
        return int(np.count_nonzero(self._pivots < 0))

    def _in_parts(self, data: Floats) -> bool:
        """Eliminate the parts of the plan, each by whichever thread is free, then the last; the bits do not depend on
        the threads."""
        plan, starts = self._plan, self._plan.part_start
        separate, ok = iter(range(len(starts) - 2)), [True]

        def eliminate(part: int, scratch: tuple[Floats, Floats]) -> bool:
            return _numeric(
                plan.parts[starts[part] : starts[part + 1]], data, plan.first, plan.row_start,
                plan.child_start, plan.children, plan.run_start, plan.runs,
                plan.entry_start, plan.entry_source, plan.entry_place,
                plan.panel_start, plan.update_start, self._stacks, *scratch, self._panels, self._pivots,
            )  # fmt: skip

        def work(scratch: tuple[Floats, Floats]) -> None:
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
        _solve(x, plan.first, plan.row_start, plan.rows, plan.panel_start, self._panels, self._pivots, *self._local)
        result = np.empty_like(x)
        result[plan.order] = x
        return result


def threads() -> int:
    """Threads of a factorisation: NUMBA_NUM_THREADS, by default one per processor, at most `MOST_THREADS`."""
    return min(int(nb.config.NUMBA_NUM_THREADS), os.cpu_count() or 1, MOST_THREADS)


def _dissected(places: Floats, blocks: Blocks) -> Longs:
    """Blocks in the order of a nested dissection of their places."""
    return dissect(places[blocks.begin[:-1]], blocks.start, blocks.neighbours)


def _first_of_places(places: Floats) -> Longs:
    """Where blocks begin: unknowns in a row that lie at one place, such as the directions of a node; and their end."""
    other = (places[1:] != places[:-1]).any(axis=1)
    return np.concatenate([[0], 1 + np.flatnonzero(other), [len(places)]])


def _minimum_degree(indptr: NDArray[np.int64], indices: NDArray[np.int64]) -> Ints:
    """The AMD order, as QDLDL finds it."""
    size = len(indptr) - 1
    data = np.full(len(indices), 1e-3 / max(1, size))
    data[indptr[1:] - 1] = 1.0
    solver = qdldl.Solver(csc_matrix((data, indices, indptr), shape=(size, size)), upper=True)
    return np.asarray(solver.factors()[2], dtype=np.intp)


@nb.njit(cache=True, error_model="numpy", nogil=True)
def _numeric(  # type: ignore[no-untyped-def]
    part, data, first, row_start, child_start, children, run_start, runs, entry_start, entry_source, entry_place,
    panel_start, update_start, stacks, unscaled, work, panels, pivots,
):  # fmt: skip
    """Eliminate the supernodes of a `part`, front by front; False where a pivot vanishes or is not finite.

    A front of `size` rows and `own` pivots is kept as its pivots' rows (own, padded), in `unscaled` while it is
    eliminated, then divided by the pivots in `panels`; and as its update matrix, upper triangle, in `stacks`.
    """
    for s in part:
        size, own = row_start[s + 1] - row_start[s], first[s + 1] - first[s]
        stride = padded(size)
        rows = unscaled[: own * stride].reshape(own, stride)
        rows[:] = 0.0
        for e in range(entry_start[s], entry_start[s + 1]):
            unscaled[entry_place[e]] += data[entry_source[e]]
        for e in range(child_start[s], child_start[s + 1]):
            child = _update(children[e], first, row_start, update_start, stacks)
            add_rows(rows, child, runs[run_start[e] : run_start[e + 1]], 0, own)
        panel = panels[panel_start[s] : panel_start[s + 1]].reshape(own, stride)
        if not eliminate(rows, panel, pivots[first[s] : first[s + 1]], work):
            return False
        update = _update(s, first, row_start, update_start, stacks)
        subtract_product(panel, rows, 0, own, own, 0, update, work)
        for e in range(child_start[s], child_start[s + 1]):
            child = _update(children[e], first, row_start, update_start, stacks)
            add_rows(update, child, runs[run_start[e] : run_start[e + 1]], own, size)
    return True


@nb.njit(cache=True, inline="always")
def _update(s, first, row_start, update_start, stacks):  # type: ignore[no-untyped-def]
    """The update matrix (n, padded) of a front."""
    size = row_start[s + 1] - row_start[s] - (first[s + 1] - first[s])
    stride = padded(size)
    return stacks[update_start[s] : update_start[s] + size * stride].reshape(size, stride)


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


@nb.njit(cache=True, error_model="numpy")
def _solve(x, first, row_start, rows, panel_start, panels, pivots, local, aside):  # type: ignore[no-untyped-def]
    """Forward and backward substitution in place, supernode by supernode."""
    supers = len(first) - 1
    for s in range(supers):
        size, own = row_start[s + 1] - row_start[s], first[s + 1] - first[s]
        panel = panels[panel_start[s] : panel_start[s + 1]].reshape(own, padded(size))
        values = local[: padded(size)]
        values[:own], values[own:] = x[first[s] : first[s + 1]], 0.0
        forward(panel, values, aside)
        x[first[s] : first[s + 1]] = values[:own]
        for i in range(own, size):
            x[rows[row_start[s] + i]] += values[i]
    for s in range(supers - 1, -1, -1):
        size, own = row_start[s + 1] - row_start[s], first[s + 1] - first[s]
        panel = panels[panel_start[s] : panel_start[s + 1]].reshape(own, padded(size))
        values = local[: padded(size)]
        for i in range(size):
            values[i] = x[rows[row_start[s] + i]]
        backward(panel, pivots[first[s] : first[s + 1]], values, aside)
        x[first[s] : first[s + 1]] = values[:own]
