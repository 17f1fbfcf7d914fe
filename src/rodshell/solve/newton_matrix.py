"""The matrix of a Newton iteration: summed from element Hessians in the free directions, factorised, solved.

As a band (`Banded`) by LDL^T without pivoting in O(n b^2), b being the half bandwidth: a rod whose unknowns stand in
the order x_0, theta_0, x_1, theta_1, ... has b = 10, whatever its length. The order is found by reverse Cuthill-McKee
on the chains of blocks that the stencils are, so that a ring (b about twice as large), supports and other numberings
need nothing else. Elements are summed straight into the band. Without pivots the band does not grow, and the signs of
D are the inertia. Matrices of any other pattern go to a sparse solver (`SparseSum`).
"""

from collections.abc import Sequence
from typing import Protocol

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from rodshell.arrays import Floats, Ints
from rodshell.kernels import njit
from rodshell.model import Assembly, Freedom
from rodshell.solve.problem import linear_solver
from rodshell.solve.sparse_ldl import Factors, SingularError

WIDEST = 64  # half bandwidth beyond which a fill-reducing ordering wins over the band
LANES = 4  # rows of the band are as long as whole vectors of so many numbers


class SummedMatrix(Protocol):
    """A symmetric matrix in the free directions. The counts of free directions stay; the directions may turn."""

    def clear(self) -> None:
        """Set it to zero."""
        ...

    def add(self, number: int, hessians: Floats, blocks: Ints, free: Freedom) -> None:
        """Add the Hessians (m, 3k, 3k) of a set of elements on `blocks` (m, k), or of a part of it.

        Args:
            number: of the set, among those that the matrix was made for.
        """
        ...

    def add_blocks(self, diagonal: Floats, full: Floats, free: Freedom) -> None:
        """Add to each block itself; a blocked direction gets a one.

        Args:
            diagonal: (N, 3) diagonal of each block.
            full: (N, 3, 3) a matrix for each block, or empty.
        """
        ...

    def factor(self) -> int:
        """Factorise; the number of negative pivots. Raises SingularError where a pivot vanishes or is not finite."""
        ...

    def solve(self, field: Floats, free: Freedom) -> Floats:
        """(N, 3) solution for the part of `field` (N, 3) in the free directions; zero across them."""
        ...


class Banded:
    """A symmetric matrix in the free directions, as a band (see `SummedMatrix`).

    Args:
        element_blocks: (m, k) blocks of each element, for each set of elements.
        free: the free directions; their counts stay, they may turn.
        order: (N,) blocks in the order of the band; None finds it.
        widest: where the half bandwidth is larger, no room is made: look at it and do without.

    Attributes:
        values: (size + b, b + 1 or some more); row j holds A[j, j], A[j + 1, j], ..., and once it is factorised L and
            D.
    """

    def __init__(
        self, element_blocks: Sequence[Ints], free: Freedom, order: Ints | None = None, *, widest: int | None = None
    ) -> None:
        self._order = _chain_order(element_blocks, len(free.count)) if order is None else np.asarray(order)
        counts = free.count[self._order]
        self._first = np.empty(len(counts), dtype=np.intp)
        self._first[self._order] = np.cumsum(counts) - counts
        self._count = free.count
        self.size = int(counts.sum())
        self.half_bandwidth = max((_reach(blocks, self._first, free.count) for blocks in element_blocks), default=0)
        if widest is None or self.half_bandwidth <= widest:
            # Rows past the end and columns past the band spare the kernels their bounds: they hold zeros.
            width = LANES * (max(1, self.half_bandwidth) // LANES + 1)
            self.values = np.zeros((self.size + self.half_bandwidth, width))
            self._work = np.zeros(self.size + self.half_bandwidth + 1)
        self._free: Freedom | None = None
        self._narrow = np.flatnonzero(free.count < 3)
        self._axes = np.tile(np.eye(3), (len(free.count), 1, 1))
        self._plain = np.ones(len(free.count), dtype=bool)

    def clear(self) -> None:
        self.values[:] = 0.0

    def add(self, number: int, hessians: Floats, blocks: Ints, free: Freedom) -> None:
        """See `SummedMatrix.add`; the number of their set does not matter."""
        self._look_at(free)
        _add(hessians, blocks, self._first, self._count, self._axes, self._plain, self.values)

    def add_blocks(self, diagonal: Floats, full: Floats, free: Freedom) -> None:
        self._look_at(free)
        _add_blocks(diagonal, full, self._first, self._count, self._axes, self._plain, self.values)

    def factor(self) -> int:
        if self._free is not None:
            _turn_whole(self.values, self.half_bandwidth, self._first[self._whole], self._free.directions[self._whole])
        negative, singular = _factor(self.values, self.size, self.half_bandwidth)
        if singular >= 0:
            block = self._order[np.searchsorted(self._first[self._order], singular, side="right") - 1]
            raise SingularError(f"a pivot of block {block} is zero or not finite")
        return int(negative)

    def solve(self, field: Floats, free: Freedom) -> Floats:
        solution = np.empty_like(field)
        _solve(
            self.values, self.size, self.half_bandwidth, field, self._first, self._count, free.directions,
            self._work, solution,
        )  # fmt: skip
        return solution

    def _look_at(self, free: Freedom) -> None:
        if free is not self._free:
            along = np.einsum("nkk->nk", free.directions) == 1.0
            narrow = self._narrow
            turned = ~along.all(axis=1)
            turned[narrow] = False
            self._whole = np.flatnonzero(turned)
            self._plain[narrow] = (along[narrow] | (np.arange(3) >= free.count[narrow, None])).all(axis=1)
            self._axes[narrow] = free.directions[narrow]
            self._free = free


class SparseSum:
    """A matrix of any pattern, by a sparse solver.

    Args:
        element_blocks: (m, k) blocks of each element, for each set of elements.
        coordinates: (N, d) where the blocks lie [m], by which they are ordered, if that is known.
    """

    def __init__(self, element_blocks: Sequence[Ints], free: Freedom, coordinates: Floats | None = None) -> None:
        everywhere = np.arange(len(free.count))[:, None]
        self._last = len(element_blocks)
        self._everywhere = everywhere
        self._assembly = Assembly.of([*element_blocks, everywhere], free)
        self._solver = linear_solver(self._assembly, free, coordinates)
        self._data = np.zeros(len(self._assembly.indices))
        self._factors: Factors | None = None

    def clear(self) -> None:
        self._data[:] = 0.0

    def add(self, number: int, hessians: Floats, blocks: Ints, free: Freedom) -> None:
        self._assembly.add(number, hessians, blocks, free, self._data)

    def add_blocks(self, diagonal: Floats, full: Floats, free: Freedom) -> None:
        blocks = diagonal[:, :, None] * np.eye(3)
        self.add(self._last, blocks + full if len(full) else blocks, self._everywhere, free)
        self._data[self._assembly.diagonal[free.blocked]] = 1.0

    def factor(self) -> int:
        self._factors = self._solver.factor(self._data, reuse=self._factors)
        return self._factors.negative

    def solve(self, field: Floats, free: Freedom) -> Floats:
        assert self._factors is not None
        return free.expand(self._factors.solve(free.reduce(field)))


def narrow_or_sparse(
    element_blocks: Sequence[Ints], free: Freedom, *, coordinates: Floats | None = None
) -> SummedMatrix:
    """`Banded` where the band is narrow, as of one rod; `SparseSum` else, as of a shell. Parameters as of these."""
    banded = Banded(element_blocks, free, widest=WIDEST)
    return banded if banded.half_bandwidth <= WIDEST else SparseSum(element_blocks, free, coordinates)


def _chain_order(element_blocks: Sequence[Ints], count: int) -> Ints:
    """Blocks in an order in which neighbours in a stencil are near each other."""
    pairs = [np.column_stack([b[:, k], b[:, k + 1]]) for b in element_blocks for k in range(b.shape[1] - 1)]
    row, column = np.vstack([*pairs, np.empty((0, 2), dtype=np.intp)]).T
    graph = coo_matrix((np.ones(len(row), dtype=np.int8), (row, column)), shape=(count, count)).tocsr()
    order = np.asarray(reverse_cuthill_mckee((graph + graph.T).tocsr(), symmetric_mode=True), dtype=np.intp)
    place = np.empty(count, dtype=np.intp)
    place[order] = np.arange(count)
    falling = np.count_nonzero(place[row] > place[column]) > len(row) // 2
    return order[::-1] if falling else order  # elements whose blocks stand in their own order are summed faster


def _reach(blocks: Ints, first: Ints, count: Ints) -> int:
    """Largest distance between two unknowns of one element."""
    lowest = np.where(count > 0, first, len(first) * 3)[blocks].min(axis=1, initial=len(first) * 3)
    highest = np.where(count > 0, first + count - 1, -1)[blocks].max(axis=1, initial=-1)
    return max(0, int((highest - lowest).max(initial=0)))


@njit("f3 i2 i1 i1 f3 b1 f2")
def _add(hessians, blocks, first, count, directions, plain_blocks, band):  # type: ignore[no-untyped-def]
    """Add T' H T of every element; T holds the free directions of its blocks as columns, or leaves plain ones alone.

    Indices are unsigned, which spares the check for negative ones: half of the time.
    """
    k = blocks.shape[1]
    place, component = np.empty(3 * k, dtype=np.uint64), np.empty(3 * k, dtype=np.uint64)
    turned = np.empty((3 * k, 3 * k))
    for m in range(blocks.shape[0]):
        at, together = first[blocks[m, 0]], True
        for a in range(k):
            i = blocks[m, a]
            together = together and plain_blocks[i] and count[i] == 3 and first[i] == at + 3 * a
        if together:  # as of a rod without twist: the rows are pieces of the band's
            for p in range(3 * k):
                line, row = band[np.uint64(at + p)], hessians[m, p]
                for q in range(3 * k - p):
                    line[q] += row[p + q]
            continue
        h, size, plain, rising = hessians[m], 0, True, True
        for a in range(k):
            i = blocks[m, a]
            plain = plain and plain_blocks[i]
            for c in range(count[i]):
                place[size], component[size] = first[i] + c, 3 * a + c
                rising = rising and (size == 0 or place[size] > place[size - 1])
                size += 1
        if not plain:
            _turn(h, blocks[m], count, directions, turned)
            h = turned
        for p in range(size):
            at, row = place[p], h[component[p]]
            if rising:
                line = band[at]
                for q in range(p, size):
                    line[place[q] - at] += row[component[q]]
                continue
            for q in range(p + 1):
                to = place[q]
                if to <= at:
                    band[to, at - to] += row[component[q]]
                else:
                    band[at, to - at] += row[component[q]]


@njit(error_model="numpy")
def _turn(h, blocks, count, directions, turned):  # type: ignore[no-untyped-def]
    """T' h T of one element: entry r of a block is that of its r-th free direction."""
    for a in range(len(blocks)):
        for b in range(len(blocks)):
            i, j = blocks[a], blocks[b]
            for r in range(count[i]):
                for c in range(count[j]):
                    value = 0.0
                    for k in range(3):
                        for n in range(3):
                            value += directions[i, r, k] * h[3 * a + k, 3 * b + n] * directions[j, c, n]
                    turned[3 * a + r, 3 * b + c] = value


@njit("f2 f3 i1 i1 f3 b1 f2")
def _add_blocks(diagonal, full, first, count, directions, plain_blocks, band):  # type: ignore[no-untyped-def]
    """Add T' (diag(diagonal) + full) T of each block."""
    for i in range(len(diagonal)):
        if plain_blocks[i] and not len(full):
            for c in range(count[i]):
                band[first[i] + c, 0] += diagonal[i, c]
            continue
        for c in range(count[i]):
            for r in range(c, count[i]):
                value = 0.0
                for k in range(3):
                    value += directions[i, r, k] * diagonal[i, k] * directions[i, c, k]
                    if len(full):
                        for n in range(3):
                            value += directions[i, r, k] * full[i, k, n] * directions[i, c, n]
                if r == c and directions[i, c, 0] == directions[i, c, 1] == directions[i, c, 2] == 0.0:
                    value = 1.0  # blocked
                band[first[i] + c, r - c] += value


@njit("f2 i i1 f3")
def _turn_whole(band, b, first, directions):  # type: ignore[no-untyped-def]
    """Turn rows and columns of blocks of three unknowns from x, y, z to their directions; blocked ones get a one."""
    block = np.empty((3, 3))
    for m in range(len(first)):
        at, d = first[m], directions[m]
        for j in range(max(0, at + 2 - b), at):  # to the left; what is coupled to one of the three is so to all
            row, v0, v1, v2 = band[j], band[j, at - j], band[j, at - j + 1], band[j, at - j + 2]
            for r in range(3):
                row[at - j + r] = d[r, 0] * v0 + d[r, 1] * v1 + d[r, 2] * v2
        for i in range(at + 3, at + b + 1):  # below
            v0, v1, v2 = band[at, i - at], band[at + 1, i - at - 1], band[at + 2, i - at - 2]
            for r in range(3):
                band[at + r, i - at - r] = d[r, 0] * v0 + d[r, 1] * v1 + d[r, 2] * v2
        for r in range(3):
            for c in range(r, 3):
                block[r, c] = block[c, r] = band[at + r, c - r]
        for r in range(3):
            for c in range(r, 3):
                value = 0.0
                for k in range(3):
                    value += d[r, k] * (block[k, 0] * d[c, 0] + block[k, 1] * d[c, 1] + block[k, 2] * d[c, 2])
                band[at + r, c - r] = value
            if d[r, 0] == d[r, 1] == d[r, 2] == 0.0:
                band[at + r, 0] = 1.0


@njit("f2 i i")
def _factor(a, size, b):  # type: ignore[no-untyped-def]
    """L D L^T in place: a[j, k] holds A[j + k, j], and then 1 / D[j] (k = 0) and L[j + k, j].

    Returns the number of negative pivots, and the index of the first that is zero or not finite (else -1).
    """
    width = a.shape[1]
    negative = 0
    pivot_row = np.zeros(2 * width)  # whole rows are subtracted: past the band from zeros, by zeros
    for j in range(size):
        pivot = a[j, 0]
        if pivot == 0.0 or not np.isfinite(pivot):
            return negative, j
        if pivot < 0.0:
            negative += 1
        inverse = 1.0 / pivot
        for k in range(width):
            pivot_row[k] = a[j, k]
        a[j, 0] = inverse
        for i in range(1, b + 1):
            multiple = pivot_row[i] * inverse
            a[j, i] = multiple
            below = a[j + i]
            for k in range(width):
                below[k] -= multiple * pivot_row[i + k]
    return negative, -1


@njit("f2 i i f2 i1 i1 f3 f1 f2", fastmath={"reassoc", "contract"})
def _solve(a, size, b, field, first, count, directions, x, solution):  # type: ignore[no-untyped-def]
    """Solve L D L^T for the part of the field in the free directions; `x` is room for the unknowns, b zeros behind."""
    for i in range(len(field)):
        for c in range(count[i]):
            d = directions[i, c]
            x[first[i] + c] = d[0] * field[i, 0] + d[1] * field[i, 1] + d[2] * field[i, 2]
    for j in range(size):
        value, row = x[j], a[j]
        for i in range(1, b + 1):
            x[j + i] -= row[i] * value
    for j in range(size - 1, -1, -1):
        row, far = a[j], 0.0
        for i in range(2, b + 1):
            far += row[i] * x[j + i]
        x[j] = (x[j] * row[0] - far) - row[1] * x[j + 1]  # the neighbour last: it is the one still awaited
    for i in range(len(field)):
        for k in range(3):
            solution[i, k] = 0.0
        for c in range(count[i]):
            for k in range(3):
                solution[i, k] += x[first[i] + c] * directions[i, c, k]
