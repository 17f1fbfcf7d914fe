"""Sparse symmetric indefinite systems: one interface, here on QDLDL (LDL^T without pivoting, AMD ordering)."""

from typing import Protocol

import numpy as np
import qdldl
from numpy.typing import NDArray
from scipy.sparse import csc_matrix

from rodshell.arrays import Floats


class LinearSolver(Protocol):
    """Factorises matrices of one pattern, upper triangle in compressed columns."""

    def factor(self, data: Floats) -> int:
        """Factorise; the number of negative pivots, which is that of negative eigenvalues.

        Raises
        ------
        SingularError : a pivot vanishes.
        """
        ...

    def solve(self, right: Floats) -> Floats:
        """Solution of the system last factorised, with one step of iterative refinement."""
        ...


class SingularError(ArithmeticError):
    """A pivot of the factorisation is zero: nothing holds some motion."""


class Qdldl:
    """LDL^T by QDLDL; the ordering and the symbolic phase are kept from the first factorisation on."""

    def __init__(self, indptr: NDArray[np.int64], indices: NDArray[np.int64]) -> None:
        self._indptr, self._indices = indptr, indices
        self._solver: qdldl.Solver | None = None

    def factor(self, data: Floats) -> int:
        size = len(self._indptr) - 1
        self._matrix = csc_matrix((data, self._indices, self._indptr), shape=(size, size))
        try:
            if self._solver is None:
                self._solver = qdldl.Solver(self._matrix, upper=True)
            else:
                self._solver.update(self._matrix, upper=True)
        except RuntimeError as error:
            self._solver = None
            raise SingularError(str(error)) from error
        pivots = np.asarray(self._solver.factors()[1])
        if not np.isfinite(pivots).all():
            raise SingularError("the factorisation is not finite")
        if not pivots.all():  # QDLDL's update does not say so, and leaves the pivots after it as they were
            raise SingularError("a pivot of the factorisation is zero")
        return int(np.count_nonzero(pivots < 0))

    def solve(self, right: Floats) -> Floats:
        assert self._solver is not None
        x = np.asarray(self._solver.solve(right))
        residual = right - self._matrix @ x - self._matrix.T @ x + self._matrix.diagonal() * x
        return x + np.asarray(self._solver.solve(residual))
