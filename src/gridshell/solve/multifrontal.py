"""Multifrontal LDL^T without pivoting, for the matrices of large grids.

The columns of the factor fall into *supernodes* with one row structure. Each has a dense *front*: its own
columns, summed with the update matrices of its children in the elimination tree; its pivots are eliminated,
what remains is the update matrix for its parent (Duff and Reid 1983). Dense work on contiguous blocks, the
order of elimination from where the unknowns lie (`ordering`), the symbolic phase once per pattern (`symbolic`).
"""

from contextlib import nullcontext
from functools import lru_cache

import numba as nb
import numpy as np
import qdldl
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from threadpoolctl import ThreadpoolController

from gridshell.solve.linear import SingularError
from gridshell.solve.ordering import dissect
from gridshell.solve.symbolic import plan_of

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

BLOCK = 48  # pivots eliminated together in a large front
LARGE = 128  # rows from which on a front's updates go to BLAS


class Multifrontal:
    """LDL^T of matrices of one pattern (upper triangle, compressed columns).

    Parameters
    ----------
    places : (n, d) where each unknown lies, for nested dissection; None orders by approximate minimum degree.
    """

    def __init__(self, indptr: NDArray[np.int64], indices: NDArray[np.int64], places: Floats | None = None) -> None:
        self._indptr, self._indices = indptr, indices
        size = len(indptr) - 1
        order = _minimum_degree(indptr, indices) if places is None else _dissected(indptr, indices, places)
        self._plan = plan_of(indptr, indices, order)
        self._panels = np.empty(int(self._plan.panel_start[-1]))
        self._pivots = np.empty(size)

    @property
    def fill(self) -> int:
        """Stored values of the factor."""
        return len(self._panels)

    def factor(self, data: Floats) -> int:
        plan, size = self._plan, len(self._pivots)
        self._matrix = csc_matrix((data, self._indices, self._indptr), shape=(size, size))
        with _blas().limit(limits=1) if plan.largest_front >= LARGE else nullcontext():
            ok = _numeric(
                data, plan.first, plan.row_start, plan.rows, plan.relative, plan.child_start, plan.children,
                plan.entry_start, plan.entry_source, plan.entry_place, plan.panel_start, plan.stack_size,
                plan.largest_front, self._panels, self._pivots,
            )  # fmt: skip
        if not ok:
            raise SingularError("a pivot of the factorisation vanishes")
        return int(np.count_nonzero(self._pivots < 0))

    def solve(self, right: Floats) -> Floats:
        x = self._substitute(right)
        residual = right - self._matrix @ x - self._matrix.T @ x + self._matrix.diagonal() * x
        return x + self._substitute(residual)

    def _substitute(self, right: Floats) -> Floats:
        plan = self._plan
        x = right[plan.order]
        _solve(x, plan.first, plan.row_start, plan.rows, plan.panel_start, self._panels, self._pivots)
        result = np.empty_like(x)
        result[plan.order] = x
        return result


@lru_cache
def _blas() -> ThreadpoolController:
    """The BLAS that Numba calls. Its threads are kept to one: on fronts of a few hundred rows they only wait."""
    import scipy.linalg  # noqa: F401  loads that BLAS, so that it is found

    return ThreadpoolController().select(user_api="blas")


def _dissected(indptr: NDArray[np.int64], indices: NDArray[np.int64], places: Floats) -> Ints:
    """Unknowns that lie at one place stay together; the places are dissected."""
    same = np.zeros(len(places), dtype=bool)  # as the unknown before: the directions of one node follow each other
    same[1:] = (places[1:] == places[:-1]).all(axis=1)
    block = np.cumsum(~same) - 1
    begin = np.append(np.flatnonzero(~same), len(places))
    start, neighbours = _coupled(indptr, indices, block, begin)
    order = dissect(places[~same], start, neighbours)
    first = begin[order]
    size = begin[order + 1] - first
    return np.asarray(np.repeat(first - np.cumsum(size) + size, size) + np.arange(len(places)))


@nb.njit(cache=True)
def _coupled(indptr, indices, block, begin):  # type: ignore[no-untyped-def]
    """The other blocks to which each block of unknowns is coupled, as start and neighbours."""
    n = len(begin) - 1
    mark, count = np.full(n, -1, dtype=np.int64), np.zeros(n + 1, dtype=np.int64)
    start, neighbours, place = count, np.empty(0, dtype=np.int64), count
    for sweep in range(2):  # count, then fill
        mark[:] = -1
        for b in range(n):
            for j in range(begin[b], begin[b + 1]):
                for e in range(indptr[j], indptr[j + 1]):
                    a = block[indices[e]]
                    if a != b and mark[a] != b:
                        mark[a] = b
                        if sweep == 0:
                            count[a + 1] += 1
                            count[b + 1] += 1
                        else:
                            neighbours[place[a]], neighbours[place[b]] = b, a
                            place[a] += 1
                            place[b] += 1
        if sweep == 0:
            start = np.cumsum(count)
            place = start.copy()
            neighbours = np.empty(start[n], dtype=np.int64)
    return start, neighbours


def _minimum_degree(indptr: NDArray[np.int64], indices: NDArray[np.int64]) -> NDArray[np.intp]:
    """The AMD order, as QDLDL finds it."""
    size = len(indptr) - 1
    data = np.full(len(indices), 1e-3 / max(1, size))
    data[indptr[1:] - 1] = 1.0
    solver = qdldl.Solver(csc_matrix((data, indices, indptr), shape=(size, size)), upper=True)
    return np.asarray(solver.factors()[2], dtype=np.intp)


@nb.njit(cache=True, error_model="numpy")
def _numeric(  # type: ignore[no-untyped-def]
    data, first, row_start, rows, relative, child_start, children, entry_start, entry_source, entry_place,
    panel_start, stack_size, largest, panels, pivots,
):  # fmt: skip
    """Factorise front by front; False where a pivot vanishes or is not finite."""
    stack = np.empty(max(1, stack_size))
    work = np.empty(largest * largest)
    columns = np.empty((4, largest))
    top = 0
    for s in range(len(first) - 1):
        size, own = row_start[s + 1] - row_start[s], first[s + 1] - first[s]
        front = work[: size * size].reshape(size, size)
        front[:] = 0.0
        flat = work[: size * size]
        for e in range(entry_start[s], entry_start[s + 1]):
            flat[entry_place[e]] += data[entry_source[e]]
        for e in range(child_start[s + 1] - 1, child_start[s] - 1, -1):  # the last child lies on top
            c = children[e]
            begin = row_start[c] + first[c + 1] - first[c]
            m = row_start[c + 1] - begin
            top -= m * m
            update = stack[top : top + m * m].reshape(m, m)
            for a in range(m):
                i = relative[begin + a]
                for b in range(a + 1):
                    front[i, relative[begin + b]] += update[a, b]
        if not _eliminate(front, own, columns, pivots[first[s] : first[s + 1]]):
            return False
        panels[panel_start[s] : panel_start[s + 1]] = front[:, :own].copy().ravel()
        m = size - own
        update = stack[top : top + m * m].reshape(m, m)
        for a in range(m):
            for b in range(a + 1):
                update[a, b] = front[own + a, own + b]
        top += m * m
    return True


@nb.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _eliminate(front, own, columns, pivots):  # type: ignore[no-untyped-def]
    """Eliminate the first `own` pivots of the lower triangle: L in the columns, the Schur complement after them.

    Four pivots at a time, so that each row behind them is read and written once for all four. Of a large front the
    columns past the block follow by BLAS.
    """
    size = front.shape[0]
    block = own if size < LARGE else BLOCK
    for begin in range(0, own, block):
        end = min(begin + block, own)
        reach = size if block == own else end  # columns updated at once
        for k in range(begin, end, 4):
            after = min(k + 4, end)
            for p in range(k, after):
                d = front[p, p]
                if not np.isfinite(d) or d == 0.0:
                    return False
                pivots[p] = d
                column = columns[p - k]
                for i in range(p + 1, size):
                    column[i] = front[i, p]
                    front[i, p] /= d
                for i in range(p + 1, size):
                    for q in range(p + 1, min(i + 1, after)):
                        front[i, q] -= front[i, p] * column[q]
            for i in range(after, size):
                last = min(i + 1, reach)
                if after == k + 4:
                    _subtract_four(front[i, after:last], columns[:, after:last], front[i, k:after])
                else:
                    for p in range(k, after):
                        factor, column = front[i, p], columns[p - k]
                        for j in range(after, last):
                            front[i, j] -= factor * column[j]
        if reach < size and end < size:
            below = front[end:, begin:end].copy()
            scaled = below * pivots[begin:end]
            for a in range(0, size - end, 256):
                b = min(a + 256, size - end)
                front[end + a : end + b, end : end + b] -= np.dot(below[a:b], scaled[:b].T)
    return True


@nb.njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc"})
def _subtract_four(row, columns, factors):  # type: ignore[no-untyped-def]
    f0, f1, f2, f3 = factors[0], factors[1], factors[2], factors[3]
    c0, c1, c2, c3 = columns[0], columns[1], columns[2], columns[3]
    for j in range(len(row)):
        row[j] -= f0 * c0[j] + f1 * c1[j] + f2 * c2[j] + f3 * c3[j]


@nb.njit(cache=True, error_model="numpy")
def _solve(x, first, row_start, rows, panel_start, panels, pivots):  # type: ignore[no-untyped-def]
    """Forward and backward substitution in place, supernode by supernode."""
    supers = len(first) - 1
    for s in range(supers):
        size, own, begin = row_start[s + 1] - row_start[s], first[s + 1] - first[s], first[s]
        panel = panels[panel_start[s] : panel_start[s + 1]].reshape(size, own)
        for i in range(1, size):
            total = 0.0
            for k in range(min(i, own)):
                total += panel[i, k] * x[begin + k]
            x[rows[row_start[s] + i]] -= total
    for s in range(supers - 1, -1, -1):
        size, own, begin = row_start[s + 1] - row_start[s], first[s + 1] - first[s], first[s]
        panel = panels[panel_start[s] : panel_start[s + 1]].reshape(size, own)
        for k in range(own):
            x[begin + k] /= pivots[begin + k]
        for i in range(size - 1, 0, -1):
            value = x[rows[row_start[s] + i]]
            for k in range(min(i, own)):
                x[begin + k] -= panel[i, k] * value
