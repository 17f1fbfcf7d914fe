"""Pairs of points that are near each other, by cells of a lattice: without SciPy's trees, whose import takes longer
than all that a shell of usual size needs here."""

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.bounds import bounds

MOST_CELLS = 2**20  # along an axis, so that a cell's number is a whole number of 64 bits
PART = 2**15  # points that are looked at together, to bound the memory


def near_pairs(points: Floats, radius: float) -> Ints:
    """Pairs (k, 2) of points that are at most `radius` apart, the lower index first, in no order.

    Cells are at least as wide as the radius, so that a near point lies in the same cell or in one of its neighbours;
    those above each other have consecutive numbers and are searched as one.

    Args:
        points: (n, 3) coordinates [m].
        radius: largest distance [m], positive.
    """
    if len(points) < 2:
        return np.empty((0, 2), dtype=np.intp)
    low, high = bounds(points)
    extent = (high - low).max()
    cell = np.floor((points - low) / max(radius, extent / MOST_CELLS)).astype(np.int64) + 1
    rows = cell.max(axis=0) + 2  # one empty cell at each end: a neighbour's number is never that of another row
    number = (cell[:, 0] * rows[1] + cell[:, 1]) * rows[2] + cell[:, 2]
    order = np.argsort(number, kind="stable")
    number, columns, found = number[order], np.ascontiguousarray(points[order].T), list[Ints]()
    beside = [(across * rows[1] + along) * rows[2] for across, along in ((0, 1), (1, -1), (1, 0), (1, 1))]
    for begin in range(0, len(points), PART):
        here = np.arange(begin, min(begin + PART, len(points)))
        at = number[here]
        found += _within(columns, here, here + 1, np.searchsorted(number, at + 1, "right"), radius)
        for step in beside:
            start = np.searchsorted(number, at + step - 1)
            stop = np.searchsorted(number, at + step + 1, "right")
            found += _within(columns, here, start, stop, radius)
    first, second = (order[np.concatenate(half)] for half in (found[::2], found[1::2]))
    return np.column_stack([np.minimum(first, second), np.maximum(first, second)])


def _within(columns: Floats, here: Ints, start: Ints, stop: Ints, radius: float) -> tuple[Ints, Ints]:
    """Of the pairs of each place of `here` with those from `start` to `stop`, the near ones: places in `columns`."""
    count = stop - start
    first = np.repeat(here, count)
    second = np.arange(len(first)) + np.repeat(start - np.cumsum(count) + count, count)
    apart = np.zeros(len(first))
    for column in columns:
        apart += (column[first] - column[second]) ** 2
    near = apart <= radius**2
    return first[near], second[near]
