"""Elimination orders: nested dissection by place, which knows that a gridshell's mesh lies in a plane."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

LEAF = 6  # blocks that are not divided further
UNBALANCED = 0.3  # the smaller part of a cut holds at least this share


def dissect(places: Floats, pairs: Ints) -> Ints:
    """Order blocks so that separators come last: first both parts of a cut, each dissected, then what joins them.

    Parameters
    ----------
    places : (n, d) where each block lies; any coordinates in which neighbours are near will do.
    pairs : (m, 2) blocks that are coupled in the matrix.

    Returns
    -------
    (n,) blocks in the order of their elimination.
    """
    order = np.empty(len(places), dtype=np.intp)
    local = np.empty(len(places), dtype=np.intp)
    tasks = [(0, np.arange(len(places)), pairs)]  # where the blocks' positions begin in the order, blocks, pairs
    while tasks:
        begin, blocks, coupled = tasks.pop()
        if len(blocks) <= LEAF:
            order[begin : begin + len(blocks)] = blocks
            continue
        local[blocks] = np.arange(len(blocks))
        ends = local[coupled]
        left = _cut(places[blocks], ends)
        across = left[ends[:, 0]] != left[ends[:, 1]]
        touching = ends[across]
        sides = [np.unique(touching[left[touching] == side]) for side in (True, False)]
        joining = sides[0] if len(sides[0]) <= len(sides[1]) else sides[1]
        part = np.where(left, 0, 1)
        part[joining] = 2
        kinds = part[ends]
        for side in (0, 1):
            chosen = blocks[part == side]
            inner = coupled[(kinds[:, 0] == side) & (kinds[:, 1] == side)]
            tasks.append((begin, chosen, inner))
            begin += len(chosen)
        order[begin : begin + len(joining)] = blocks[joining]
    return order


def _cut(places: Floats, ends: Ints) -> NDArray[np.bool_]:
    """(n,) which blocks lie before a straight cut across the longest extent that few pairs cross."""
    axis = int(np.argmax(np.ptp(places, axis=0)))
    x = places[:, axis]
    by_place = np.argsort(x, kind="stable")
    rank = np.empty(len(x), dtype=np.intp)
    rank[by_place] = np.arange(len(x))
    low, high = rank[ends].min(axis=1), rank[ends].max(axis=1)
    crossing = np.cumsum(np.bincount(low, minlength=len(x)) - np.bincount(high, minlength=len(x)))
    first = max(1, int(UNBALANCED * len(x)))
    window = np.arange(first - 1, len(x) - first)  # a cut after this rank
    balance = np.abs(2 * (window + 1) / len(x) - 1.0)
    best = window[np.argmin(crossing[window] * (1.0 + balance))]
    return np.asarray(rank <= best)
