"""Symmetric banded systems: LDL^T without pivoting in O(n b^2), b being the half bandwidth.

A rod whose unknowns stand in the order x_0, theta_0, x_1, theta_1, ... has b = 10, whatever its length. The
order is found by reverse Cuthill-McKee on the pattern, so that a ring (b about twice as large), supports and
other numberings need nothing else. Without pivots the band does not grow, and the signs of D are the inertia.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray
from scipy.sparse import csc_matrix
from scipy.sparse.csgraph import reverse_cuthill_mckee

from gridshell.solve.linear import LinearSolver, Qdldl, SingularError

Floats = NDArray[np.float64]
Indices = NDArray[np.int64]

WIDEST = 64  # half bandwidth beyond which a fill-reducing ordering wins over the band


class Banded:
    """LDL^T of a band; the ordering is found once per pattern.

    Parameters
    ----------
    indptr, indices : the pattern, upper triangle in compressed columns.
    order : (n,) unknowns in the order of the band; None finds it.
    refined : refine each solution once. Without, it is one substitution: enough for a Newton iteration whose
        next step corrects it.
    """

    def __init__(
        self, indptr: Indices, indices: Indices, order: Indices | None = None, *, refined: bool = True
    ) -> None:
        size = len(indptr) - 1
        place = np.empty(size, dtype=np.int64)
        self._order = _narrow_order(indptr, indices) if order is None else np.asarray(order, dtype=np.int64)
        place[self._order] = np.arange(size)
        column = place[np.repeat(np.arange(size), np.diff(indptr))]
        row = place[indices]
        apart = np.abs(row - column)
        self.half_bandwidth = int(apart.max(initial=0))
        self._slots = np.minimum(row, column) * (self.half_bandwidth + 1) + apart
        # Rows past the end spare the kernel its bounds: they are only ever multiplied by zeros.
        self._band = np.zeros((size + self.half_bandwidth, self.half_bandwidth + 1))
        self._pattern = indptr, indices
        self._refined = refined
        self._data: Floats | None = None

    def factor(self, data: Floats) -> int:
        _spread(data, self._slots, self._band.reshape(-1))
        self._data = data
        negative, singular = _factor(self._band, len(self._order))
        if singular >= 0:
            self._data = None
            raise SingularError(f"pivot {self._order[singular]} of the banded factorisation is zero or not finite")
        return int(negative)

    def solve(self, right: Floats) -> Floats:
        assert self._data is not None, "factor a matrix first"
        x = self._substituted(right)
        if self._refined:
            x += self._substituted(right - _times(*self._pattern, self._data, x))
        return x

    def _substituted(self, right: Floats) -> Floats:
        ordered = np.zeros(len(self._band))
        ordered[: len(right)] = right[self._order]
        _substitute(self._band, ordered, len(right))
        x = np.empty_like(right)
        x[self._order] = ordered[: len(right)]
        return x


def narrow_or_sparse(indptr: Indices, indices: Indices) -> LinearSolver:
    """`Banded`, not refined, where the band is narrow, as for one rod; `Qdldl` else, as for a shell."""
    banded = Banded(indptr, indices, refined=False)
    return banded if banded.half_bandwidth <= WIDEST else Qdldl(indptr, indices)


def _narrow_order(indptr: Indices, indices: Indices) -> Indices:
    size = len(indptr) - 1
    upper = csc_matrix((np.ones(len(indices), dtype=np.int8), indices, indptr), shape=(size, size))
    return np.asarray(reverse_cuthill_mckee((upper + upper.T).tocsr(), symmetric_mode=True), dtype=np.int64)


@nb.njit(cache=True)
def _spread(data, slots, band):  # type: ignore[no-untyped-def]
    """Values of the pattern to their places in the band (flat)."""
    band[:] = 0.0
    for k in range(len(data)):
        band[slots[k]] = data[k]


@nb.njit(cache=True, error_model="numpy")
def _factor(a, size):  # type: ignore[no-untyped-def]
    """L D L^T in place: a[j, k] holds A[j + k, j], and then D[j] (k = 0) and L[j + k, j].

    Returns the number of negative pivots, and the index of the first that is zero or not finite (else -1).
    """
    b = a.shape[1] - 1
    negative = 0
    for j in range(size):
        pivot = a[j, 0]
        if pivot == 0.0 or not np.isfinite(pivot):
            return negative, j
        if pivot < 0.0:
            negative += 1
        inverse = 1.0 / pivot
        for i in range(1, b + 1):
            multiple = a[j, i] * inverse
            if multiple != 0.0:
                for k in range(b + 1 - i):
                    a[j + i, k] -= multiple * a[j, i + k]
        for i in range(1, b + 1):
            a[j, i] *= inverse
    return negative, -1


@nb.njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract"})
def _substitute(a, x, size):  # type: ignore[no-untyped-def]
    """Solve L D L^T x = x in place; `x` has b zeros past its end."""
    b = a.shape[1] - 1
    for j in range(size):
        value = x[j]
        for i in range(1, b + 1):
            x[j + i] -= a[j, i] * value
    for j in range(size - 1, -1, -1):
        value = x[j] / a[j, 0]
        for i in range(1, b + 1):
            value -= a[j, i] * x[j + i]
        x[j] = value


@nb.njit(cache=True)
def _times(indptr, indices, data, x):  # type: ignore[no-untyped-def]
    """Product of the symmetric matrix with x."""
    result = np.zeros_like(x)
    for j in range(len(x)):
        for entry in range(indptr[j], indptr[j + 1]):
            i = indices[entry]
            result[i] += data[entry] * x[j]
            if i != j:
                result[j] += data[entry] * x[i]
    return result
