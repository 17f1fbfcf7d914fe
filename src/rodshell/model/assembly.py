"""The sum of element Hessians in the free directions, as the upper triangle of a sparse matrix."""

from collections.abc import Sequence
from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.model.freedom import Freedom


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
        count = freedom.count
        everywhere = np.arange(len(count))[:, None]
        start, rows = _pattern([*element_blocks, everywhere], count)
        indptr, indices, above, slot = _columns(start, rows, freedom.first, count)
        slots = tuple(_find_slots(blocks, count, start, rows, slot) for blocks in element_blocks)
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


def _pattern(element_blocks: Sequence[Ints], count: Ints) -> tuple[Ints, Ints]:
    """The stored blocks, above and on the diagonal: rows[start[j] : start[j + 1]] of block column j, ascending."""
    total = np.zeros(len(count) + 1, dtype=np.int64)
    for blocks in element_blocks:
        _count_pairs(blocks, count, total)
    start = np.cumsum(total)
    rows, place = np.empty(start[-1], dtype=np.int64), start[:-1].copy()
    for blocks in element_blocks:
        _fill_pairs(blocks, count, place, rows)
    return _unique_rows(start, rows)


@nb.njit(cache=True)
def _count_pairs(blocks, count, total):  # type: ignore[no-untyped-def]
    for m in range(blocks.shape[0]):
        for b in range(blocks.shape[1]):
            for a in range(blocks.shape[1]):
                i, j = blocks[m, a], blocks[m, b]
                if (i < j or a == b) and count[i] > 0 and count[j] > 0:
                    total[j + 1] += 1


@nb.njit(cache=True)
def _fill_pairs(blocks, count, place, rows):  # type: ignore[no-untyped-def]
    for m in range(blocks.shape[0]):
        for b in range(blocks.shape[1]):
            for a in range(blocks.shape[1]):
                i, j = blocks[m, a], blocks[m, b]
                if (i < j or a == b) and count[i] > 0 and count[j] > 0:
                    rows[place[j]] = i
                    place[j] += 1


@nb.njit(cache=True)
def _unique_rows(start, rows):  # type: ignore[no-untyped-def]
    """Each column's rows ascending, once each; a few dozen at most, so by insertion."""
    n = len(start) - 1
    kept, used = np.zeros(n + 1, dtype=np.int64), 0
    for j in range(n):
        begin = used
        for e in range(start[j], start[j + 1]):
            i, k = rows[e], used
            while k > begin and rows[k - 1] > i:
                k -= 1
            if k > begin and rows[k - 1] == i:
                continue
            for back in range(used, k, -1):
                rows[back] = rows[back - 1]
            rows[k] = i
            used += 1
        kept[j + 1] = used
    return kept, rows[:used].copy()


@nb.njit(cache=True)
def _columns(start, rows, first, count):  # type: ignore[no-untyped-def]
    """The pattern by unknowns; rows above each diagonal block; and where each stored block begins in the values."""
    n, unknowns = len(start) - 1, int(count.sum())
    indptr, above, slot = np.zeros(unknowns + 1, dtype=np.int64), np.zeros(n, dtype=np.int64), np.empty_like(rows)
    begin = 0
    for j in range(n):
        height = 0
        for e in range(start[j], start[j + 1]):
            slot[e] = begin + height
            if rows[e] < j:
                height += count[rows[e]]
        above[j] = height
        for c in range(count[j]):
            begin += height + c + 1
            indptr[first[j] + c + 1] = begin
    indices = np.empty(begin, dtype=np.int64)
    for j in range(n):
        for c in range(count[j]):
            k = indptr[first[j] + c]
            for e in range(start[j], start[j + 1]):
                i = rows[e]
                for r in range(count[i] if i != j else c + 1):
                    indices[k] = first[i] + r
                    k += 1
    return indptr, indices, above, slot


@nb.njit(cache=True)
def _find_slots(blocks, count, start, rows, slot):  # type: ignore[no-untyped-def]
    """(m, k, k) where each pair of an element's blocks begins in the values, -1 if it is not stored."""
    k = blocks.shape[1]
    slots = np.full((blocks.shape[0], k, k), -1, dtype=np.int64)
    for m in range(blocks.shape[0]):
        for b in range(k):
            for a in range(k):
                i, j = blocks[m, a], blocks[m, b]
                if (i < j or a == b) and count[i] > 0 and count[j] > 0:
                    e = start[j]
                    while rows[e] != i:
                        e += 1
                    slots[m, a, b] = slot[e]
    return slots


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
