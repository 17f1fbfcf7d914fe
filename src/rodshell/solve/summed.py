"""The matrix of a Newton iteration: summed from element Hessians in the free directions, factorised, solved."""

from collections.abc import Callable, Sequence
from typing import Protocol

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.model import Assembly, Freedom
from rodshell.solve.banded import Banded
from rodshell.solve.linear import LinearSolver, Qdldl
from rodshell.solve.multifrontal import Multifrontal

WIDEST = 64  # half bandwidth beyond which a fill-reducing ordering wins over the band


class SummedMatrix(Protocol):
    """A symmetric matrix in the free directions. The counts of free directions stay; the directions may turn."""

    def clear(self) -> None:
        """Set it to zero."""
        ...

    def add(self, which: int, hessians: Floats, blocks: Ints, free: Freedom) -> None:
        """Add the Hessians (m, 3k, 3k) of the elements, or of a part, `blocks` (m, k) of the set number `which`."""
        ...

    def add_blocks(self, diagonal: Floats, full: Floats, free: Freedom) -> None:
        """Add to each block itself: diagonal (N, 3), and a matrix, full (N, 3, 3) or empty; one where blocked."""
        ...

    def factor(self) -> int:
        """Factorise; the number of negative pivots. Raises SingularError where a pivot vanishes or is not finite."""
        ...

    def solve(self, field: Floats, free: Freedom) -> Floats:
        """(N, 3) solution for the part of `field` (N, 3) in the free directions; zero across them."""
        ...


class SparseSum:
    """A matrix of any pattern, by a sparse solver."""

    def __init__(
        self, element_blocks: Sequence[Ints], free: Freedom, solver: Callable[..., LinearSolver] = Qdldl
    ) -> None:
        everywhere = np.arange(len(free.count))[:, None]
        self._last = len(element_blocks)
        self._everywhere = everywhere
        self._assembly = Assembly.of([*element_blocks, everywhere], free)
        self._solver = solver(self._assembly.indptr, self._assembly.indices)
        self._data = np.zeros(len(self._assembly.indices))

    def clear(self) -> None:
        self._data[:] = 0.0

    def add(self, which: int, hessians: Floats, blocks: Ints, free: Freedom) -> None:
        self._assembly.add(which, hessians, blocks, free, self._data)

    def add_blocks(self, diagonal: Floats, full: Floats, free: Freedom) -> None:
        own = diagonal[:, :, None] * np.eye(3)
        self.add(self._last, own + full if len(full) else own, self._everywhere, free)
        self._data[self._assembly.diagonal[free.blocked]] = 1.0

    def factor(self) -> int:
        return self._solver.factor(self._data)

    def solve(self, field: Floats, free: Freedom) -> Floats:
        return free.expand(self._solver.solve(free.reduce(field)))


def narrow_or_sparse(element_blocks: Sequence[Ints], free: Freedom) -> SummedMatrix:
    """`Banded` where the band is narrow, as of one rod; `SparseSum` else, as of a shell."""
    banded = Banded(element_blocks, free, widest=WIDEST)
    return banded if banded.half_bandwidth <= WIDEST else SparseSum(element_blocks, free)


def narrow_or_dissected(places: Floats) -> Callable[[Sequence[Ints], Freedom], SummedMatrix]:
    """`Banded` where the band is narrow; else by the multifrontal solver, blocks lying at `places` (N, d) [m]."""

    def make(element_blocks: Sequence[Ints], free: Freedom) -> SummedMatrix:
        banded = Banded(element_blocks, free, widest=WIDEST)
        if banded.half_bandwidth <= WIDEST:
            return banded
        of_unknowns = np.repeat(places, free.count, axis=0)
        return SparseSum(element_blocks, free, lambda start, rows: Multifrontal(start, rows, of_unknowns))

    return make


__all__ = ["SparseSum", "SummedMatrix", "narrow_or_dissected", "narrow_or_sparse"]
