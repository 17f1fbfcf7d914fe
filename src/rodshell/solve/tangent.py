"""The tangent stiffness at a state with given axial forces: its factors, its negative modes, its lowest modes."""

from collections.abc import Sequence

import numpy as np
from scipy.sparse import csc_matrix

from rodshell.arrays import Floats
from rodshell.rods.elements import Elements
from rodshell.solve.problem import Problem, pattern_of

CLOSE = 1e-2  # last change of the lowest eigenvalue, over it: modes only say how far to go
MOST_ITERATIONS = 12


class Tangent:
    """Stiffness and gradient of a problem, with one pattern and one set of factors: the last state counts.

    The supports must not move (`Supports` without `moved`). Axial forces are unknowns of their own, as in
    `mixed_newton`: the geometric stiffness is that of the forces given.
    """

    def __init__(self, problem: Problem, state: Floats) -> None:
        self._stretch = problem.stretch
        self.free = problem.constraint.freedom(state)
        everywhere = np.arange(len(state))[:, None]  # as in `NewtonStep`, whose pattern serves here
        self._blocks = (*(element.blocks for element in problem.elements), problem.stretch.blocks, everywhere)
        self.pattern = pattern_of(problem, self._blocks, self.free)
        self._hessians = [np.zeros((len(b), 3 * b.shape[1], 3 * b.shape[1])) for b in self._blocks]
        self._scale = np.empty(0)
        self.factorizations = 0

    def gradient(self, elements: Sequence[Elements], state: Floats, forces: Floats) -> Floats:
        """(n, 3) gradient of the elements and of edges that carry the axial forces (e,) [N]; without loads."""
        gradient = np.zeros_like(state)
        for element in elements:
            element.evaluate(state, gradient)
        self._stretch.add_axial(state, forces, gradient)
        return gradient

    def factor(self, elements: Sequence[Elements], state: Floats, forces: Floats) -> int:
        """Factorise the stiffness at a state (n, 3) with axial forces (e,) [N]; the number of its negative modes.

        Raises
        ------
        SingularError : a pivot vanishes.
        """
        self._data = self._values(elements, state, forces)
        if not len(self._scale):  # modes are measured by the first stiffness's diagonal: metres and radians alike
            self._scale = 1.0 / np.sqrt(np.abs(self._data[self.pattern.assembly.diagonal]))
        self.factorizations += 1
        return self.pattern.solver.factor(self._data)

    def solve(self, load: Floats) -> Floats:
        """(n, 3) displacements under forces (n, 3), by the last factors."""
        return self.free.expand(self.pattern.solver.solve(self.free.reduce(load)))

    def lowest(self, count: int, start: Floats | None = None) -> tuple[Floats, Floats]:
        """The `count` lowest modes of the last stiffness, which is stable: values (k,) ascending and modes (k, dofs).

        By orthogonal iteration with the inverse [Golub and Van Loan 2013, section 8.2.4]; a mode's square sum over the
        scale is 1. The values are a little too large, never too small.
        start : (k, dofs) modes of a state nearby, or None.
        """
        size, scale = self.free.size, self._scale
        if start is None:  # no symmetry of the shell is one of this start
            start = np.sin(1.0 + np.arange(size) ** 2 * np.arange(1, 1 + min(count, size))[:, None]) * scale
        scaled, largest = _orthonormal(start / scale), 0.0
        for _ in range(MOST_ITERATIONS):
            images = np.array([self.pattern.solver.solve(row / scale) for row in scaled]) / scale
            inverse, turn = np.linalg.eigh(_products(scaled, images))
            scaled = _orthonormal(np.einsum("ji,jk->ik", turn[:, ::-1], images))
            if abs(largest - inverse[-1]) <= CLOSE * inverse[-1]:
                break
            largest = inverse[-1]
        return 1.0 / inverse[::-1], scaled * scale

    def change(self, elements: Sequence[Elements], state: Floats, forces: Floats, modes: Floats, step: float) -> Floats:
        """(k, k) change of the last stiffness to that at the state given, over `step`, between modes (k, dofs)."""
        data = (self._values(elements, state, forces) - self._data) / step
        size, assembly = self.free.size, self.pattern.assembly
        upper = csc_matrix((data, assembly.indices, assembly.indptr), shape=(size, size))
        half = _products(modes, np.array([upper @ mode for mode in modes]))
        return half + half.T - _products(modes, upper.diagonal() * modes)

    def _values(self, elements: Sequence[Elements], state: Floats, forces: Floats) -> Floats:
        unused = np.zeros_like(state)
        for element, hessians in zip(elements, self._hessians, strict=False):
            element.evaluate(state, unused, hessians)
        self._stretch.with_forces(forces).evaluate(state, unused, self._hessians[-2])
        return self.pattern.assembly.assemble(self._hessians, self._blocks, self.free)


def _orthonormal(rows: Floats) -> Floats:
    """By Gram and Schmidt, twice, the first row first."""
    result = rows.copy()
    for k, row in enumerate(result):
        for _ in range(2):
            row -= np.einsum("i,ik->k", np.einsum("ik,k->i", result[:k], row), result[:k])
            row /= np.sqrt(np.einsum("k,k->", row, row))
    return result


def _products(a: Floats, b: Floats) -> Floats:
    """(k, k) inner products of rows; threads of a BLAS would cost more than they save."""
    return np.asarray(np.einsum("ik,jk->ij", a, b))
