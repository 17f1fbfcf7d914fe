"""Neighbours of points: points of a surface sorted into the cells of a lattice, searched by compiled loops.

Points of a surface lie evenly, so that cells of one size are faster than a tree.
"""

from dataclasses import dataclass

import numpy as np
from numba import njit

from rodshell.arrays import Floats, Ints

MOST_CELLS = 64  # for each point


@dataclass(frozen=True, eq=False)
class CellList:
    """Points sorted into cells; make one with `CellList.of`.

    Parameters
    ----------
    points : (n, 3) [m].
    low : (3,) corner of the first cell [m].
    shape : (3,) number of cells along each axis.
    cell : width of a cell [m].
    start : (cells + 1,) where the points of each cell begin in `order`; cells are counted with z fastest.
    order : (n,) indices of the points, cell by cell.
    """

    points: Floats
    low: Floats
    shape: Ints
    cell: float
    start: Ints
    order: Ints

    @staticmethod
    def of(points: Floats, cell: float) -> "CellList":
        """Sort points (n, 3) [m] into cells of the width `cell` [m], wider where there would be too many."""
        low, shape, cell = _lattice_over(points, cell)
        return CellList(points, low, shape, cell, *_sorted(points, low, shape, cell))

    @property
    def _lattice(self) -> tuple[Floats, Floats, Ints, float, Ints, Ints]:
        return self.points, self.low, self.shape, self.cell, self.start, self.order

    def nearest(self, x: Floats, count: int = 1, limit: float = np.inf) -> tuple[Floats, Ints]:
        """The nearest points, nearest first.

        Parameters
        ----------
        x : (n, 3) points whose neighbours are wanted [m].
        count : of neighbours of each.
        limit : neighbours further away need not be found; their distance is then infinite [m].

        Returns
        -------
        Distances (n, count) [m] and indices (n, count).
        """
        distance, index = np.full(len(x) * count, np.inf), np.zeros(len(x) * count, dtype=np.intp)
        _nearest(x, *self._lattice, count, limit, distance, index)
        return np.sqrt(distance).reshape(-1, count), index.reshape(-1, count)

    def within(self, x: Floats, radius: float, *, ordered: bool = False) -> tuple[Ints, Ints, Floats]:
        """All points within a radius.

        Parameters
        ----------
        x : (m, 3) points whose neighbours are wanted [m].
        radius : [m].
        ordered : whether the nearest come first.

        Returns
        -------
        Where the list of each point begins (m + 1,), the lists one after the other (k,), and the distances (k,) [m].
        """
        most = _most_within(x, *self._lattice, radius)
        begin, near, away = np.zeros(len(x) + 1, dtype=np.intp), np.empty(most, dtype=np.intp), np.empty(most)
        _within(x, *self._lattice, radius, ordered, begin, near, away)
        return begin, near[: begin[-1]], away[: begin[-1]]

    def spread(self, distance: float) -> Ints:
        """Indices of points at least `distance` [m] apart, such that every other point is closer to one of them."""
        free = np.ones(len(self.points), dtype=bool)
        _thin(*self._lattice, distance, free)
        return np.flatnonzero(free)


@njit(cache=True)
def _lattice_over(points, cell):  # type: ignore[no-untyped-def]
    """Corner, number of cells each way, and their width, for a lattice that holds all points."""
    low, high = points[0].copy(), points[0].copy()
    for n in range(len(points)):
        for k in range(3):
            low[k], high[k] = min(low[k], points[n, k]), max(high[k], points[n, k])
    while True:
        shape = np.floor((high - low) / cell) + 1.0
        if shape[0] * shape[1] * shape[2] <= MOST_CELLS * len(points):
            return low, shape.astype(np.intp), cell
        cell *= 1.3


@njit(cache=True)
def _sorted(points, low, shape, cell):  # type: ignore[no-untyped-def]
    """Sort points into their cells, by counting."""
    cells = np.zeros(len(points), dtype=np.intp)
    start = np.zeros(shape[0] * shape[1] * shape[2] + 1, dtype=np.intp)
    for n in range(len(points)):
        for k in range(3):
            cells[n] = cells[n] * shape[k] + int(np.floor((points[n, k] - low[k]) / cell))
        start[cells[n] + 1] += 1
    for k in range(1, len(start)):
        start[k] += start[k - 1]
    filled, order = start[:-1].copy(), np.empty(len(points), dtype=np.intp)
    for n in range(len(points)):
        order[filled[cells[n]]] = n
        filled[cells[n]] += 1
    return start, order


@njit(cache=True)
def _box(x, n, low, shape, cell, reach):  # type: ignore[no-untyped-def]
    """First and last cell plus one along x, y and z, of those up to `reach` cells from that of the n-th point."""
    i, j, k = (
        int(np.floor((x[n, 0] - low[0]) / cell)), int(np.floor((x[n, 1] - low[1]) / cell)),
        int(np.floor((x[n, 2] - low[2]) / cell)),
    )  # fmt: skip
    k_from, k_stop = max(k - reach, 0), max(min(k + reach + 1, shape[2]), 0)
    i_from = max(i - reach, 0) if k_from < k_stop else shape[0]
    return i_from, min(i + reach + 1, shape[0]), max(j - reach, 0), min(j + reach + 1, shape[1]), k_from, k_stop


@njit(cache=True)
def _square(x, n, points, c):  # type: ignore[no-untyped-def]
    """Square of the distance between the n-th and the c-th point."""
    return (x[n, 0] - points[c, 0]) ** 2 + (x[n, 1] - points[c, 1]) ** 2 + (x[n, 2] - points[c, 2]) ** 2


@njit(cache=True)
def _keep(distance, index, first, last, d, c):  # type: ignore[no-untyped-def]
    """Insert c at the distance d into the entries `first` to `last`, which are in order; the last one is dropped."""
    k = last
    while k > first and distance[k - 1] > d:
        distance[k], index[k] = distance[k - 1], index[k - 1]
        k -= 1
    distance[k], index[k] = d, c


@njit(cache=True)
def _nearest(x, points, low, shape, cell, start, order, count, limit, distance, index):  # type: ignore[no-untyped-def]
    """Squares of distances. A neighbour is final once it is nearer than the cells that were not searched."""
    for n in range(len(x)):
        if not np.isfinite(x[n, 0] + x[n, 1] + x[n, 2]):
            continue
        first, last = n * count, (n + 1) * count - 1
        reach, found = 1, False
        while not found and (2 * reach + 1) ** 2 < len(points):  # to look into more rows of cells would be slower
            distance[first : last + 1] = np.inf
            i_from, i_stop, j_from, j_stop, k_from, k_stop = _box(x, n, low, shape, cell, reach)
            for i in range(i_from, i_stop):
                for j in range(j_from, j_stop):
                    row = (i * shape[1] + j) * shape[2]
                    for q in range(start[row + k_from], start[row + k_stop]):
                        d = _square(x, n, points, order[q])
                        if d < distance[last]:
                            _keep(distance, index, first, last, d, order[q])
            found = reach * cell >= min(limit, np.sqrt(distance[last]))
            reach *= 2
        if not found:
            distance[first : last + 1] = np.inf
            for c in range(len(points)):
                d = _square(x, n, points, c)
                if d < distance[last]:
                    _keep(distance, index, first, last, d, c)


@njit(cache=True)
def _most_within(x, points, low, shape, cell, start, order, radius):  # type: ignore[no-untyped-def]
    """An upper bound of the entries of all lists together."""
    count, reach = 0, int(np.ceil(radius / cell))
    for n in range(len(x)):
        i_from, i_stop, j_from, j_stop, k_from, k_stop = _box(x, n, low, shape, cell, reach)
        for i in range(i_from, i_stop):
            for j in range(j_from, j_stop):
                row = (i * shape[1] + j) * shape[2]
                count += start[row + k_stop] - start[row + k_from]
    return count


@njit(cache=True)
def _within(x, points, low, shape, cell, start, order, radius, ordered, begin, near, away):  # type: ignore[no-untyped-def]
    """List the neighbours one after the other; each list begins at `begin` (n + 1,)."""
    reach = int(np.ceil(radius / cell))
    for n in range(len(x)):
        last = begin[n]
        i_from, i_stop, j_from, j_stop, k_from, k_stop = _box(x, n, low, shape, cell, reach)
        for i in range(i_from, i_stop):
            for j in range(j_from, j_stop):
                row = (i * shape[1] + j) * shape[2]
                for q in range(start[row + k_from], start[row + k_stop]):
                    d = _square(x, n, points, order[q])
                    if d <= radius * radius:
                        _keep(away, near, begin[n] if ordered else last, last, np.sqrt(d), order[q])
                        last += 1
        begin[n + 1] = last


@njit(cache=True)
def _thin(points, low, shape, cell, start, order, distance, free):  # type: ignore[no-untyped-def]
    """Each point that is still free removes the later ones that are too close to it."""
    reach = int(np.ceil(distance / cell))
    for n in range(len(points)):
        if not free[n]:
            continue
        i_from, i_stop, j_from, j_stop, k_from, k_stop = _box(points, n, low, shape, cell, reach)
        for i in range(i_from, i_stop):
            for j in range(j_from, j_stop):
                row = (i * shape[1] + j) * shape[2]
                for q in range(start[row + k_from], start[row + k_stop]):
                    if order[q] > n and _square(points, n, points, order[q]) <= distance * distance:
                        free[order[q]] = False
