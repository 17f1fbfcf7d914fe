"""Free directions of each block of the state, and the sum of element Hessians in them as a sparse matrix."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import accumulate, pairwise
from typing import NamedTuple

import numpy as np
from scipy.sparse import csc_matrix, diags

from rodshell.arrays import Floats, Ints, Longs
from rodshell.kernels import njit
from rodshell.threads import in_threads, threads
from rodshell.validation import brief

ANGLE = (1.0, 0.0, 0.0)  # the direction of a twist angle's block that is used
WORTHWHILE = 300_000  # values from which on threads share the assembly


@dataclass(frozen=True, eq=False)
class Freedom:
    """Free directions of each block [HQK Eq 12].

    Supports, prescribed motion and sliding on a surface all remove directions. The reduced system in the free
    directions is symmetric (ERRATA E14 to HQK Eq 11, whose row-filtered form is not).

    A direction of zero length is blocked: it stays among the unknowns, where a solver puts 1 on the diagonal, so that
    nodes that touch and leave at each step of a motion need no new pattern of the matrix.

    Args:
        directions: (n, 3, 3); `directions[i, k]` is the k-th free direction of block i, orthonormal.
        count: (n,) number of free directions, 0 to 3.
    """

    directions: Floats
    count: Ints

    def __repr__(self) -> str:
        return f"Freedom({len(self.count)} blocks, {self.size} free directions)"

    @staticmethod
    def free(blocks: int) -> "Freedom":
        """So many `blocks`, each free along x, y and z."""
        directions = np.zeros((blocks, 3, 3))
        directions.reshape(blocks, 9)[:, ::4] = 1.0  # its diagonals
        return Freedom(directions, np.full(blocks, 3, dtype=np.intp))

    def with_directions(self, blocks: Ints, *directions: tuple[float, float, float]) -> "Freedom":
        """The same, but these `blocks` (k,) free along the given orthonormal directions only (none: fixed)."""
        table, count = self.directions.copy() if directions else self.directions, self.count.copy()
        for k, direction in enumerate(directions):
            table[blocks, k] = direction
        count[blocks] = len(directions)
        return Freedom(table, count)

    @cached_property
    def first(self) -> Ints:
        """(n,) index of each block's first reduced DOF."""
        return np.cumsum(self.count) - self.count

    @cached_property
    def size(self) -> int:
        """Number of reduced DOFs."""
        return int(self.count.sum())

    @cached_property
    def _slots(self) -> tuple[Ints, Ints]:
        block = np.repeat(np.arange(len(self.count)), self.count)
        return block, np.arange(self.size) - self.first[block]

    @cached_property
    def blocked(self) -> Ints:
        """Reduced DOFs whose direction is zero."""
        block, k = self._slots
        return np.flatnonzero(~self.directions[block, k].any(axis=1))

    def expand(self, q: Floats) -> Floats:
        """Displacements (n, 3) of reduced DOFs (size,)."""
        return np.asarray(_expand(np.ascontiguousarray(q), self.directions, self.count))

    def reduce(self, gradient: Floats) -> Floats:
        """Components (size,) of a gradient (n, 3) in the free directions."""
        return np.asarray(_reduce(np.ascontiguousarray(gradient), self.directions, self.count, self.size))

    def within(self, gradient: Floats) -> Floats:
        """The part of a gradient (n, 3) that acts along the free directions."""
        return self.expand(self.reduce(gradient))

    def reduce_diagonal(self, diagonal: Floats) -> Floats:
        """(size,) diagonal of T' diag(d) T for the components (n, 3) of d, such as masses."""
        block, k = self._slots
        return np.asarray(np.einsum("ij,ij->i", diagonal[block], self.directions[block, k] ** 2))


class BlockRows(NamedTuple):
    """A pattern in blocks of unknowns: those of block k `begin` (b + 1,) one after the other, and in its columns there
    are the blocks rows[start[k] : start[k + 1]] above itself, ascending."""

    begin: Longs
    start: Longs
    rows: Longs


@dataclass(frozen=True, eq=False)
class Assembly:
    """Position of each block of each element's Hessian in a sparse matrix; made once per pattern. Build it with `of`.

    The pattern depends on which blocks the elements touch and on how many free directions each block has, not on the
    directions. Compressed columns, rows ascending, every diagonal present.

    Args:
        indptr, indices: the pattern (CSC, upper triangle).
    """

    indptr: Longs
    indices: Longs
    rows: BlockRows
    _count: Ints
    _above: Ints  # (n,) rows above the diagonal block in a block's columns
    _slots: tuple[Ints, ...]  # per element set (m, k, k): where the block begins in the data, -1 if not stored

    __repr__ = brief

    @staticmethod
    def of(element_blocks: Sequence[Ints], freedom: Freedom) -> "Assembly":
        """Plan the assembly of element sets on `element_blocks`, (m, k) each, in the directions of `freedom`."""
        widths = np.array([blocks.shape[1] for blocks in element_blocks], dtype=np.int64)
        numbers = np.array([len(blocks) for blocks in element_blocks], dtype=np.int64)
        flat = np.concatenate([np.arange(0), *(blocks.ravel() for blocks in element_blocks)])
        indptr, indices, above, every, *rows = _pattern(flat, numbers, widths, freedom.count)
        stops = pairwise(accumulate((blocks.size * blocks.shape[1] for blocks in element_blocks), initial=0))
        slots = tuple(
            every[begin:stop].reshape(*blocks.shape, blocks.shape[1])
            for (begin, stop), blocks in zip(stops, element_blocks, strict=True)
        )
        return Assembly(indptr, indices, BlockRows(*rows), freedom.count, above, slots)

    def has_pattern_of(self, other: "Assembly") -> bool:
        """Whether the matrices of another assembly have the same pattern, whatever elements they are summed from."""
        return np.array_equal(self.indptr, other.indptr) and np.array_equal(self.indices, other.indices)

    def assemble(self, hessians: Sequence[Floats], element_blocks: Sequence[Ints], freedom: Freedom) -> Floats:
        """(nnz,) values of the reduced Hessian, from the element Hessians (m, 3k, 3k) and blocks (m, k) of each set.

        Args:
            hessians: of each set; empty: none of this set.
            freedom: free directions, as many of each block as in the plan.
        """
        data, every = np.zeros(len(self.indices)), zip(hessians, element_blocks, self._slots, strict=True)
        sets = [(hessian, blocks, slots) for hessian, blocks, slots in every if len(hessian)]
        parts = self._parts

        def add(part: int, _: int) -> None:
            for hessian, blocks, slots in sets:
                _scatter(hessian, blocks, slots, self._count, self._above, freedom.directions, *parts[part], data)

        in_threads(add, len(parts))
        return data

    def add(self, index: int, hessian: Floats, blocks: Ints, freedom: Freedom, data: Floats) -> None:
        """Add the Hessians (m, 3k, 3k) of the element set `index`, on `blocks` (m, k), to the values `data` (nnz,);
        `freedom` as of `assemble`."""
        if len(blocks):
            every = 0, len(self._count)
            _scatter(hessian, blocks, self._slots[index], self._count, self._above, freedom.directions, *every, data)

    @cached_property
    def _parts(self) -> list[tuple[int, int]]:
        """Ranges of blocks in whose columns about as many values are stored, one for each thread."""
        count = threads() if len(self.indices) >= WORTHWHILE else 1
        if count == 1:
            return [(0, len(self._count))]
        columns = np.searchsorted(self.indptr, np.linspace(0, len(self.indices), count + 1))
        stops = np.searchsorted(np.cumsum(self._count), columns).tolist()
        return list(pairwise([0, *stops[1:-1], len(self._count)]))

    def upper(self, data: Floats) -> csc_matrix:
        """The upper triangle (dofs, dofs) of the matrix with the values `data` (nnz,)."""
        size = len(self.indptr) - 1
        return csc_matrix((data, self.indices, self.indptr), shape=(size, size))

    def matrix(self, data: Floats) -> csc_matrix:
        """Both triangles (dofs, dofs) of the matrix with the values `data` (nnz,)."""
        upper = self.upper(data)
        return csc_matrix(upper + upper.T - diags(upper.diagonal()))

    @property
    def diagonal(self) -> Ints:
        """Positions of the diagonal in the values."""
        return np.asarray(self.indptr[1:] - 1)


@njit("i1 i1 i1 i1")
def _pattern(flat, numbers, widths, count):  # type: ignore[no-untyped-def]
    """The pattern by unknowns, every diagonal present; rows above each diagonal block; where the values of each pair of
    an element's blocks begin, those of all elements in a row, (k, k) of each, -1 if they are not stored; and the
    `BlockRows` of those with unknowns.

    The blocks of all elements lie in a row in `flat`, of each set `numbers` of elements with `widths` of blocks.
    """
    n, start = len(count), np.zeros(len(count) + 1, dtype=np.int64)  # where there is room for each block's rows
    begin, pairs = 0, 0
    for s in range(len(widths)):
        k = widths[s]
        for e in range(begin, begin + numbers[s] * k):
            start[flat[e] + 1] += k - 1
        begin, pairs = begin + numbers[s] * k, pairs + numbers[s] * k * k
    stop = np.empty(n, dtype=np.int64)
    for j in range(n):
        start[j + 1] += start[j]
        stop[j] = start[j]
    rows, slots, begin, slot = np.empty(start[n], dtype=np.int64), np.empty(pairs, dtype=np.int64), 0, 0
    for s in range(len(widths)):  # the rows of each block column once each, and which of them each pair is
        k = widths[s]
        for _ in range(numbers[s]):
            for a in range(k):
                for b in range(a):
                    i, j, upper, lower = flat[begin + a], flat[begin + b], slot + a * k + b, slot + b * k + a
                    if i > j:
                        i, j, upper, lower = j, i, lower, upper
                    e = start[j]
                    while e < stop[j] and rows[e] != i:
                        e += 1
                    if i == j or count[i] == 0 or count[j] == 0:
                        e = -1
                    elif e == stop[j]:
                        rows[e] = i
                        stop[j] += 1
                    slots[upper], slots[lower] = e, -1
            begin, slot = begin + k, slot + k * k
    total, most = 0, 0
    for j in range(n):
        total, most = total + stop[j] - start[j], max(most, stop[j] - start[j])
    ascending, order, diagonal = (
        np.empty(total, dtype=np.int64),
        np.empty(most, dtype=np.int64),
        np.empty(n, dtype=np.int64),
    )
    kept, above, used, values, unknowns = np.empty(n + 1, dtype=np.int64), np.empty(n, dtype=np.int64), 0, 0, 0
    for j in range(n):  # a few dozen rows at most, sorted; `rows` then says where the values of each begin
        first, high = used, 0
        for e in range(start[j], stop[j]):
            k = used
            while k > first and ascending[k - 1] > rows[e]:
                ascending[k], order[k - first] = ascending[k - 1], order[k - 1 - first]
                k -= 1
            ascending[k], order[k - first] = rows[e], e
            used += 1
        for k in range(first, used):
            rows[order[k - first]] = values + high
            high += count[ascending[k]]
        kept[j], above[j], diagonal[j] = first, high, values + high
        values += count[j] * high + count[j] * (count[j] + 1) // 2
        unknowns += count[j]
    kept[n], begin, slot = used, 0, 0
    for s in range(len(widths)):
        k = widths[s]
        for _ in range(numbers[s]):
            for a in range(k):
                for b in range(k):
                    if a == b:
                        slots[slot] = diagonal[flat[begin + a]]
                    elif slots[slot] >= 0:
                        slots[slot] = rows[slots[slot]]
                    slot += 1
            begin += k
    indptr, indices, first_of = np.zeros(unknowns + 1, dtype=np.int64), np.empty(values, dtype=np.int64), stop
    block_begin, block_start, block_of = np.empty(n + 1, dtype=np.int64), np.empty(n + 1, dtype=np.int64), diagonal
    value, unknown, blocks = 0, 0, 0
    for j in range(n):
        first_of[j] = unknown
        for c in range(count[j]):
            for e in range(kept[j], kept[j + 1]):
                i = ascending[e]
                for r in range(first_of[i], first_of[i] + count[i]):
                    indices[value] = r
                    value += 1
            for r in range(c + 1):
                indices[value] = first_of[j] + r
                value += 1
            unknown += 1
            indptr[unknown] = value
        if count[j] > 0:
            block_begin[blocks], block_start[blocks], block_of[j] = first_of[j], kept[j], blocks
            blocks += 1
            for e in range(kept[j], kept[j + 1]):
                ascending[e] = block_of[ascending[e]]
    block_begin[blocks], block_start[blocks] = unknown, used
    begins, starts = block_begin[: blocks + 1].copy(), block_start[: blocks + 1].copy()
    return indptr, indices, above, slots, begins, starts, ascending


@njit("f3 i2 i3 i1 i1 f3 i i f1", nogil=True)
def _scatter(hessians, blocks, slots, count, above, directions, low, high, data):  # type: ignore[no-untyped-def]
    """Add T' H T of every element, in the columns of blocks from `low` to before `high`; T holds the free directions of
    its blocks as columns."""
    k, whole = blocks.shape[1], np.empty(len(count), dtype=np.bool_)
    for i in range(len(count)):  # free along x, y and z: T is 1
        d = directions[i]
        whole[i] = count[i] == 3 and d[0, 0] == 1.0 and d[1, 1] == 1.0 and d[2, 2] == 1.0
    for m in range(blocks.shape[0]):
        for b in range(k):
            j = blocks[m, b]
            if not low <= j < high:
                continue
            for a in range(k):
                base = slots[m, a, b]
                if base < 0:
                    continue
                i, p, q = blocks[m, a], 3 * a, 3 * b
                if whole[i] and whole[j]:
                    for c in range(3):
                        for r in range(3 if i != j else c + 1):
                            data[base + r] += hessians[m, p + r, q + c]
                        base += above[j] + c + 1
                    continue
                h00, h01, h02 = hessians[m, p, q], hessians[m, p, q + 1], hessians[m, p, q + 2]
                h10, h11, h12 = hessians[m, p + 1, q], hessians[m, p + 1, q + 1], hessians[m, p + 1, q + 2]
                h20, h21, h22 = hessians[m, p + 2, q], hessians[m, p + 2, q + 1], hessians[m, p + 2, q + 2]
                for c in range(count[j]):
                    d0, d1, d2 = directions[j, c, 0], directions[j, c, 1], directions[j, c, 2]
                    w0 = h00 * d0 + h01 * d1 + h02 * d2
                    w1 = h10 * d0 + h11 * d1 + h12 * d2
                    w2 = h20 * d0 + h21 * d1 + h22 * d2
                    for r in range(count[i] if i != j else c + 1):
                        data[base + r] += directions[i, r, 0] * w0 + directions[i, r, 1] * w1 + directions[i, r, 2] * w2
                    base += above[j] + c + 1


@njit("f1 f3 i1")
def _expand(q, directions, count):  # type: ignore[no-untyped-def]
    result, at = np.zeros((len(count), 3)), 0
    for i in range(len(count)):
        for k in range(count[i]):
            for d in range(3):
                result[i, d] += q[at] * directions[i, k, d]
            at += 1
    return result


@njit("f2 f3 i1 i")
def _reduce(gradient, directions, count, size):  # type: ignore[no-untyped-def]
    result, at = np.empty(size), 0
    for i in range(len(count)):
        for k in range(count[i]):
            total = 0.0
            for d in range(3):
                total += gradient[i, d] * directions[i, k, d]
            result[at] = total
            at += 1
    return result
