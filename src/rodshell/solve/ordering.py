"""Elimination orders: nested dissection by coordinates, since a gridshell's mesh lies in a plane."""

import numba as nb
import numpy as np

from rodshell.arrays import Floats, Longs

LEAF = 12  # blocks that are not divided further
UNBALANCED = 0.3  # the smaller part of a cut holds at least this share


def dissect(coordinates: Floats, start: Longs, neighbours: Longs) -> Longs:
    """Order blocks so that separators come last: first both parts of a cut, each dissected, then what joins them.

    Parameters
    ----------
    coordinates : (n, d) where each block lies; any coordinates in which neighbours are near will do.
    start, neighbours : the blocks coupled to block i are neighbours[start[i] : start[i + 1]].

    Returns
    -------
    (n,) blocks in the order of their elimination.
    """
    along = np.argsort(coordinates, axis=0, kind="stable").T.astype(np.int64)
    return np.asarray(_dissect(np.ascontiguousarray(coordinates, dtype=np.float64), along, start, neighbours))


@nb.njit(cache=True)
def _dissect(coordinates, along, start, neighbours):  # type: ignore[no-untyped-def]
    """Segments of the rows of `along` (d, n), blocks sorted by each coordinate, are divided in place until they are
    small, and stay sorted; `segment` tells which one a block is in."""
    n = len(coordinates)
    segment = np.zeros(n, dtype=np.int64)
    rank, crossing, part = np.empty(n, dtype=np.int64), np.empty(n + 1, dtype=np.int64), np.empty(n, dtype=np.int8)
    kept, size = np.empty((3, n), dtype=np.int64), np.zeros(3, dtype=np.int64)
    begins, ends = [0], [n]
    newest = 0
    while len(begins) > 0:
        begin, end = begins.pop(), ends.pop()
        if end - begin <= LEAF:
            continue
        here = segment[along[0, begin]]
        blocks = along[_longest(coordinates, along, begin, end), begin:end].copy()
        for k in range(len(blocks)):
            rank[blocks[k]] = k
        best = _best_cut(blocks, segment, here, rank, start, neighbours, crossing)
        _separate(blocks, segment, here, rank, best, start, neighbours, part)
        for row in along:
            size[:] = 0
            for b in row[begin:end]:
                side = part[b]
                kept[side, size[side]] = b
                size[side] += 1
            at = begin
            for side in range(3):
                row[at : at + size[side]] = kept[side, : size[side]]
                at += size[side]
        newest += 2
        at = begin
        for side in range(3):
            for b in along[0, at : at + size[side]]:
                segment[b] = newest - side if side < 2 else -1
            if side < 2 and size[side] > 0:
                begins.append(at)
                ends.append(at + size[side])
            at += size[side]
    return along[0].copy()


@nb.njit(cache=True)
def _longest(coordinates, along, begin, end):  # type: ignore[no-untyped-def]
    """The coordinate in which a segment is longest."""
    axis, longest = 0, -1.0
    for d in range(len(along)):
        extent = coordinates[along[d, end - 1], d] - coordinates[along[d, begin], d]
        if extent > longest:
            axis, longest = d, extent
    return axis


@nb.njit(cache=True)
def _best_cut(blocks, segment, here, rank, start, neighbours, crossing):  # type: ignore[no-untyped-def]
    """Rank of the last block before the straight cut that few couplings cross, near the middle."""
    n = len(blocks)
    crossing[: n + 1] = 0
    for b in blocks:
        for e in range(start[b], start[b + 1]):
            other = neighbours[e]
            if segment[other] == here and rank[other] > rank[b]:
                crossing[rank[b]] += 1
                crossing[rank[other]] -= 1
    margin = max(1, int(UNBALANCED * n))
    best, least, across = margin - 1, np.inf, 0
    for k in range(n - margin):
        across += crossing[k]
        cost = across * (1.0 + abs(2.0 * (k + 1) / n - 1.0))
        if k >= margin - 1 and cost < least:
            best, least = k, cost
    return best


@nb.njit(cache=True)
def _separate(blocks, segment, here, rank, best, start, neighbours, part):  # type: ignore[no-untyped-def]
    """Parts 0 before and 1 after the cut, and 2, which joins them: those on one side that are coupled to the other."""
    touching = np.zeros(2, dtype=np.int64)
    for b in blocks:
        side = 0 if rank[b] <= best else 1
        part[b] = side
        for e in range(start[b], start[b + 1]):
            other = neighbours[e]
            if segment[other] == here and (rank[other] <= best) != (side == 0):
                part[b] = 3 + side
                touching[side] += 1
                break
    joining = 0 if touching[0] <= touching[1] else 1
    for b in blocks:
        if part[b] >= 3:
            part[b] = 2 if part[b] - 3 == joining else part[b] - 3
