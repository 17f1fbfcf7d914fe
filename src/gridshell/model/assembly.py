"""The sum of element Hessians in the free directions, as the upper triangle of a sparse matrix."""

from collections.abc import Sequence
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from gridshell.model.freedom import Freedom

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Assembly:
    """Where each block of each element's Hessian goes; made once per pattern.

    The pattern depends on which blocks the elements touch and on how many free directions each block has,
    not on the directions. Compressed columns, rows ascending, every diagonal present.

    Parameters
    ----------
    indptr, indices : the pattern (CSC, upper triangle).
    """

    indptr: NDArray[np.int64]
    indices: NDArray[np.int64]
    _count: Ints
    _above: Ints  # (n,) rows above the diagonal block in a block's columns
    _slots: tuple[Ints, ...]  # per element set (m, k, k): where the block begins in the data, -1 if not stored

    @staticmethod
    def of(element_blocks: Sequence[Ints], freedom: Freedom) -> "Assembly":
        """Plan the assembly of element sets with `blocks` (m, k) each."""
        count, n = freedom.count, len(freedom.count)
        diagonal = np.flatnonzero(count > 0)
        keys = [_pair_keys(blocks, count) for blocks in element_blocks]
        flat = np.unique(np.concatenate([diagonal * (n + 1), *(key[key >= 0] for key in keys)]))
        column, row = flat // n, flat % n
        tall = np.cumsum(count[row]) - count[row]
        start = np.searchsorted(column, np.arange(n))
        before = tall - np.append(tall, 0)[start[column]]  # rows above this block in its column
        above = np.zeros(n, dtype=np.intp)
        above[column[row == column]] = before[row == column]
        stored = above * count + count * (count + 1) // 2
        begin = np.cumsum(stored) - stored
        slot = begin[column] + before
        slots = tuple(
            np.where(key >= 0, slot[np.minimum(np.searchsorted(flat, key), len(flat) - 1)], -1) for key in keys
        )
        block = np.repeat(np.arange(n), count)
        heights = above[block] + np.arange(len(block)) - freedom.first[block] + 1
        indptr = np.concatenate([[0], np.cumsum(heights)])
        indices = _row_indices(column, row, start, freedom.first, count, above, begin, int(indptr[-1]))
        return Assembly(indptr, indices, count, above, slots)

    def assemble(self, hessians: Sequence[Floats], element_blocks: Sequence[Ints], freedom: Freedom) -> Floats:
        """Values of the reduced Hessian for element Hessians (m, 3k, 3k) of each set."""
        data = np.zeros(len(self.indices))
        for k, (hessian, blocks) in enumerate(zip(hessians, element_blocks, strict=True)):
            self.add(k, hessian, blocks, freedom, data)
        return data

    def add(self, which: int, hessian: Floats, blocks: Ints, freedom: Freedom, data: Floats) -> None:
        """Add the Hessians (m, 3k, 3k) of one of the element sets to the values `data`."""
        if len(blocks):
            _scatter(hessian, blocks, self._slots[which], self._count, self._above, freedom.directions, data)

    @property
    def diagonal(self) -> Ints:
        """Positions of the diagonal in the values."""
        return np.asarray(self.indptr[1:] - 1)


def _pair_keys(blocks: Ints, count: Ints) -> Ints:
    """(m, k, k) key column * n + row of each pair of an element's blocks in the upper triangle, else -1."""
    row, column = blocks[:, :, None], blocks[:, None, :]
    keys = column * len(count) + row
    k = blocks.shape[1]
    stored = (row < column) | np.eye(k, dtype=bool)
    return np.where(stored & (count[row] > 0) & (count[column] > 0), keys, -1)


@nb.njit(cache=True)
def _row_indices(column, row, start, first, count, above, begin, total):  # type: ignore[no-untyped-def]
    """Row index of every stored value."""
    indices = np.empty(total, dtype=np.int64)
    for entry in range(len(column)):
        j, i = column[entry], row[entry]
        before = 0
        for earlier in range(start[j], entry):
            before += count[row[earlier]]
        for c in range(count[j]):
            base = begin[j] + c * above[j] + c * (c + 1) // 2 + before
            for r in range(count[i] if i != j else c + 1):
                indices[base + r] = first[i] + r
    return indices


@nb.njit(cache=True, error_model="numpy")
def _scatter(hessians, blocks, slots, count, above, directions, data):  # type: ignore[no-untyped-def]
    """Add T' H T of every element; T holds the free directions of its blocks as columns."""
    k = blocks.shape[1]
    for m in range(blocks.shape[0]):
        for b in range(k):
            j = blocks[m, b]
            for a in range(k):
                base = slots[m, a, b]
                if base < 0:
                    continue
                i = blocks[m, a]
                for c in range(count[j]):
                    d0, d1, d2 = directions[j, c, 0], directions[j, c, 1], directions[j, c, 2]
                    w0 = hessians[m, 3 * a, 3 * b] * d0 + hessians[m, 3 * a, 3 * b + 1] * d1
                    w0 += hessians[m, 3 * a, 3 * b + 2] * d2
                    w1 = hessians[m, 3 * a + 1, 3 * b] * d0 + hessians[m, 3 * a + 1, 3 * b + 1] * d1
                    w1 += hessians[m, 3 * a + 1, 3 * b + 2] * d2
                    w2 = hessians[m, 3 * a + 2, 3 * b] * d0 + hessians[m, 3 * a + 2, 3 * b + 1] * d1
                    w2 += hessians[m, 3 * a + 2, 3 * b + 2] * d2
                    begin = base + c * above[j] + c * (c + 1) // 2
                    for r in range(count[i] if i != j else c + 1):
                        data[begin + r] += (
                            directions[i, r, 0] * w0 + directions[i, r, 1] * w1 + directions[i, r, 2] * w2
                        )
