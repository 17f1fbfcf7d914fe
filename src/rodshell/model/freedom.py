"""Constraints as free directions: what each block of the state can still do."""

from dataclasses import dataclass
from functools import cached_property

import numba as nb
import numpy as np

from rodshell.arrays import Floats, Ints


@dataclass(frozen=True)
class Freedom:
    """Free directions of each block.

    Supports, prescribed motion and sliding on a surface are all the same: directions taken away. The reduced
    system in the free directions is symmetric (ERRATA to HQK Eq 11, whose row-filtered form is not).

    A direction of zero length is blocked: it keeps its place among the unknowns, where a solver puts a one on the
    diagonal, so that what touches and leaves at each step of a motion needs no new plan of the matrix.

    Parameters
    ----------
    directions : (n, 3, 3); `directions[i, k]` is the k-th free direction of block i, orthonormal.
    count : (n,) number of free directions, 0 to 3.
    """

    directions: Floats
    count: Ints

    @staticmethod
    def free(blocks: int) -> "Freedom":
        """Every node free along x, y, z."""
        return Freedom(np.tile(np.eye(3), (blocks, 1, 1)), np.full(blocks, 3, dtype=np.intp))

    def with_directions(self, blocks: Ints, *directions: tuple[float, float, float]) -> "Freedom":
        """These blocks free along the given orthonormal directions only (none: fixed)."""
        table, count = self.directions.copy(), self.count.copy()
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
        return _expand(q, self.directions, self.count)

    def reduce(self, gradient: Floats) -> Floats:
        """Components (size,) of a gradient (n, 3) in the free directions."""
        return _reduce(gradient, self.directions, self.count, self.size)

    def reduce_diagonal(self, diagonal: Floats) -> Floats:
        """(size,) diagonal of T' diag(d) T for the components (n, 3) of d, such as masses."""
        block, k = self._slots
        return np.asarray(np.einsum("ij,ij->i", diagonal[block], self.directions[block, k] ** 2))


@nb.njit(cache=True)
def _expand(q, directions, count):  # type: ignore[no-untyped-def]
    result, at = np.zeros((len(count), 3)), 0
    for i in range(len(count)):
        for k in range(count[i]):
            for d in range(3):
                result[i, d] += q[at] * directions[i, k, d]
            at += 1
    return result


@nb.njit(cache=True)
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
