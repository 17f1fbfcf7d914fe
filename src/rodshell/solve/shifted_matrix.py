"""A Hessian and its factors; where it is indefinite, those of the Hessian with its diagonal shifted until it is not."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.solve.problem import MatrixPattern
from rodshell.solve.sparse_ldl import Factors, SingularError
from rodshell.solve.tangent import subspace_iteration

GROWTH, MOST_SHIFTS = 8.0, 40
_LEAST_SHIFT = 1e-3  # of the first shift that is tried for several: smaller eigenvalues may be round-off


class ShiftedMatrix:
    """The matrix of an iteration; the memory of its factors serves for all of them.

    Args:
        units: (dofs,) what the motion of each unknown is measured by [m, rad].

    Attributes:
        values: (nnz,) of the matrix as it was given last, in the order of the pattern.
        negative_modes: of the matrix as it was given, not shifted; a mode without stiffness counts as a negative one.
    """

    def __init__(self, pattern: MatrixPattern, units: Floats) -> None:
        self._pattern, self._units = pattern, units
        self.values = np.empty(0)
        self._factors: Factors | None = None
        self._shift = 0.0
        self.negative_modes = 0
        self.factorizations = 0

    def factorise(self, values: Floats) -> bool:
        """Factorise another matrix; whether that can be done.

        Args:
            values: (nnz,) in the order of the pattern.

        Raises:
            SingularError: some are not finite.
        """
        self.values = values
        try:
            self.negative_modes = self._factor(values)
        except SingularError:
            if not np.isfinite(values).all():
                raise
            self.negative_modes = 1
            return False
        return True

    def solve(self, right: Floats) -> Floats:
        """Solutions for (dofs,) or (k, dofs), by the last factors."""
        assert self._factors is not None
        return self._factors.solve(right)

    def shift_until_definite(self, softest: float, start: Floats, *, down: bool = False) -> None:
        """Factorise with the diagonal shifted by about twice the most negative eigenvalue, motions in their units.

        A Newton step then doubles what the state has of its mode. The search begins at the `softest` stiffness [J], or
        below the last shift that sufficed, and goes up; first `down`, next to a saddle, whose mode may be much softer.

        start : (1, dofs) motion in its units, of which the lowest mode is a part.
        """
        shift, tries = max(softest, self._shift / GROWTH), 0
        negative = self._factor_shifted(shift)
        while down and not negative and shift > _LEAST_SHIFT * softest:
            shift /= GROWTH
            negative = self._factor_shifted(shift)
        while negative and tries < MOST_SHIFTS:
            shift, tries = GROWTH * shift, tries + 1
            negative = self._factor_shifted(shift)
        less = 2.0 * (shift - self.lowest(start, sweeps=4)[1])  # of an eigenvalue that may be too high
        if 0.0 < less < 0.5 * shift:
            if self._factor_shifted(less):
                self._factor_shifted(shift)
            else:
                shift = less
        self._shift = shift

    def lowest(self, start: Floats, *, sweeps: int) -> tuple[Floats, float]:
        """Eigenvector (dofs,) of the smallest eigenvalue of the matrix last factorised, and that eigenvalue [J], by so
        many `sweeps` of the inverse iteration from `start` (1, dofs)."""
        units = self._units
        values, (row, *_), _ = subspace_iteration(
            lambda rows: self.solve(rows / units) / units, start, settled=1, tolerance=0.0, most_sweeps=sweeps
        )
        return row * units, 1.0 / float(values[0])

    def _factor_shifted(self, shift: float) -> int:
        shifted = self.values.copy()
        shifted[self._pattern.assembly.diagonal] += shift / self._units**2
        return self._factor(shifted)

    def _factor(self, values: Floats) -> int:
        """The number of negative modes."""
        self.factorizations += 1
        self._factors = self._pattern.solver.factor(values, reuse=self._factors)
        return self._factors.negative
