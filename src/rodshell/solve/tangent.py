"""The tangent stiffness of an equilibrium: its factors, its inertia, its lowest modes.

K is the second derivative of the elastic energy in the free directions. Axial forces are unknowns of their own in the
Newton iteration (`equilibrium`), but the tangent is that of the whole elastic structure: edges contribute their
axial stiffness EA and the geometric stiffness of the axial forces at hand; a surface that holds nodes contributes its
curvature times its contact forces. Where edges are inextensible, their stiffness is a penalty, and so it is in K.
"""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.sparse.linalg import LinearOperator, eigsh
from threadpoolctl import threadpool_limits

from rodshell.arrays import Floats, State
from rodshell.errors import InputError
from rodshell.model import Freedom
from rodshell.model.potential import product, room_for
from rodshell.rods.elements import evaluate_all, is_stressed
from rodshell.solve.problem import NO_CURVATURE, MatrixPattern, Problem
from rodshell.solve.sparse_ldl import Factors, SingularError

GUARDS = 4  # vectors of the subspace iteration beyond the modes that are asked for
MOST_SWEEPS, FEW_SWEEPS = 200, 12
FIRST_SHIFT = 1e-9  # of the mean diagonal: the first shift of a stiffness that is not positive definite
SHIFT_GROWTH, MOST_SHIFTS = 8.0, 40
BELOW = 1.5  # times the lowest eigenvalue: the shift that serves in the end


@dataclass(frozen=True, eq=False)
class Modes:
    """Modes K x = s W x, ascending: values s (k,), and shapes x (k, N, 3) with x' W x = 1.

    W is the lumped mass [kg], s then a squared angular frequency [1/s2]; or the identity, and s a stiffness [N/m].

    Args:
        settled: whether the values did; if not, they are too large, and the shapes span no more than a space that is
            rich in the lowest modes.
    """

    values: Floats
    shapes: Floats
    settled: bool = True


@dataclass(frozen=True, eq=False)
class Tangent:
    """The tangent stiffness K at a state, factorised. It never changes: nothing that another solve does reaches it.

    Args:
        state: (N, 3) [m, at twist angles rad].
        forces: (e,) axial forces of the edges [N].
        freedom: the free directions at the state.
        values: (nnz,) upper triangle of K in the free directions, in the order of the pattern.
        pattern: what belongs to the pattern alone, shared with other solves.
        factors: the factors of K, its own.
    """

    state: Floats
    forces: Floats
    freedom: Freedom
    values: Floats
    pattern: MatrixPattern
    factors: Factors

    @property
    def negative_modes(self) -> int:
        """Number of negative eigenvalues of K; 0 says stable."""
        return self.factors.negative

    def solve(self, loads: Floats) -> Floats:
        """Displacements K^-1 f [m, rad] in the free directions; zero across them.

        Args:
            loads: (N, 3) forces [N, at twist angles N m], or (k, N, 3) of k cases.
        """
        return self._of_fields("loads", loads, self.factors.solve)

    def product(self, motions: Floats) -> Floats:
        """Forces K x in the free directions; zero across them.

        Args:
            motions: (N, 3) displacements [m, rad], or (k, N, 3) of k cases; their part in the free directions counts.
        """
        return self._of_fields(
            "displacements",
            motions,
            lambda rows: np.array([self.pattern.solver.product(self.values, row) for row in rows]),
        )

    def lowest_modes(
        self,
        count: int,
        *,
        mass: Floats | None = None,
        tolerance: float = 1e-12,
        most_sweeps: int = MOST_SWEEPS,
        guards: int = GUARDS,
    ) -> Modes:
        """The `count` lowest modes, or as many as there are; negative ones first where the state is not stable.

        By subspace iteration with the inverse [Bathe 2014, section 11.6], shifted where K is not positive definite.
        `Modes.settled` says whether it converged. Certified modes of a stable state are those of `solve.modes`.

        Args:
            mass: (N, 3) lumped mass of each component [kg, of a twist angle kg m2], some of which may be 0; None: the
                modes of K itself.
            tolerance: relative error of the eigenvalues, as their residuals estimate it.
            most_sweeps: the iteration ends after so many in any case: a few give directions that are good enough to
                search in.
            guards: further vectors that are iterated: the more, the faster the modes asked for converge.

        Raises:
            InputError: the mass has another shape, is negative, or is zero everywhere.
            SingularError: the state is not stable along a motion without mass.
        """
        size = self.freedom.size
        weight = np.ones(size) if mass is None else self.freedom.reduce_diagonal(self._checked_mass(mass))
        root = np.sqrt(weight)
        count = min(count, int(np.count_nonzero(root)))
        factors, shift = self._positive_definite(weight)

        def inverse(rows: Floats) -> Floats:
            return root * factors.solve(root * rows)

        start = np.random.default_rng(0).standard_normal((size, min(count + guards, int(np.count_nonzero(root))))).T
        values, rows, settled = subspace_iteration(
            inverse, start, settled=count, tolerance=tolerance, most_sweeps=most_sweeps
        )
        shapes = factors.solve(root * rows[:count])
        shapes /= np.sqrt(np.einsum("ki,i,ki->k", shapes, weight, shapes))[:, None]
        expanded = np.array([self.freedom.expand(shape) for shape in shapes]).reshape(count, *self.state.shape)
        return Modes(1.0 / values[:count] - shift, expanded, settled)

    def _of_fields(self, what: str, fields: Floats, apply: Callable[[Floats], Floats]) -> Floats:
        """A function of reduced vectors (k, dofs) applied to one field (N, 3) or to many (k, N, 3)."""
        shape, free = self.state.shape, self.freedom
        if fields.shape[-2:] != shape or fields.ndim not in (2, 3):
            raise InputError(f"the {what} have the shape {fields.shape}: give {shape}, or (k, {shape[0]}, {shape[1]})")
        rows = [free.reduce(field) for field in fields.reshape(-1, *shape)]
        results = apply(np.array(rows).reshape(len(rows), free.size))
        return np.array([free.expand(row) for row in results]).reshape(fields.shape)

    def _checked_mass(self, mass: Floats) -> Floats:
        if mass.shape != self.state.shape:
            raise InputError(f"the mass has the shape {mass.shape}: give {self.state.shape}")
        if not (mass >= 0).all() or not mass.any():
            raise InputError("the mass must not be negative, nor zero everywhere; leave it out for the modes of K")
        return mass

    def _positive_definite(self, weight: Floats) -> tuple[Factors, float]:
        """Factors of K + shift W without negative eigenvalues, and the shift; K's own where it has none."""
        if not self.negative_modes:
            return self.factors, 0.0
        diagonal = np.abs(self.values[self.pattern.assembly.diagonal])
        shift = FIRST_SHIFT * float(diagonal.mean() / weight.mean())
        for _ in range(MOST_SHIFTS):
            factors = self._shifted(shift, weight)
            if not factors.negative:
                break
            shift *= SHIFT_GROWTH
        else:
            raise SingularError("the state is not stable along a motion without mass: give mass to all that moves")
        root = np.sqrt(weight)
        start = np.random.default_rng(0).standard_normal((1, len(weight)))
        value, *_ = subspace_iteration(
            lambda rows: root * factors.solve(root * rows),
            start,
            settled=1,
            tolerance=1e-2,
            most_sweeps=MOST_SWEEPS,
        )
        near = BELOW * (shift - 1.0 / float(value[0]))
        if near < shift and not (closer := self._shifted(near, weight)).negative:
            return closer, near
        return factors, shift

    def _shifted(self, shift: float, weight: Floats) -> Factors:
        values = self.values.copy()
        values[self.pattern.assembly.diagonal] += shift * weight
        return self.pattern.solver.factor(values)


class TangentAssembly:
    """The tangent stiffness of a structure, at one state after another.

    Its buffers serve for all states; what it returns is not touched again. Where supports are on their way (`Supports`
    with nodes still to move), what their motion takes is `product`. Methods take what acts at a state: a problem on the
    same blocks, its source frames at, or near, the state; and the axial forces (e,) of the edges there [N].

    Args:
        problem: the structure at any state (N, 3), for the pattern.

    Attributes:
        blocks: (m, k) of each set of energies, of the edges, and of the constraint's curvature.
        hessians: (m, 3k, 3k) of each of these at the last state; of a constraint that is not `curved` empty.
    """

    def __init__(self, problem: Problem, state: Floats) -> None:
        self.blocks = problem.blocks(len(state))
        self.pattern = problem.pattern_at(state)
        self.hessians = [*room_for(self.blocks[:-1]), NO_CURVATURE]

    @property
    def curved(self) -> bool:
        """Whether the constraint turns its free directions."""
        return len(self.hessians[-1]) > 0

    def linearise(
        self, problem: Problem, state: Floats, forces: Floats, *, multipliers: Floats | None = None
    ) -> Floats:
        """Evaluate all Hessians at a state.

        Args:
            multipliers: (e,) N0 [N]; None: those of the edges.

        Returns:
            (N, 3) gradient of energy and load [N], the edges carrying N0 + EA eps.
        """
        gradient = problem.without_edges(state, self.hessians[:-2])
        by_force = gradient.copy()
        problem.stretch.add_axial(state, forces, by_force)
        self.hessians[-1] = problem.constraint.curvature(state, by_force)
        stretch = problem.stretch.with_forces(forces, multipliers=multipliers)
        evaluate_all((stretch,), state, gradient, self.hessians[-2:-1])
        return gradient

    def assembled(self, free: Freedom) -> Floats:
        """(nnz,) values of K at the last state in the free directions, in the order of the pattern."""
        return self.pattern.assembly.assemble(self.hessians, self.blocks, free)

    def product(self, motion: Floats) -> Floats:
        """(N, 3) product of the Hessian at the last state with displacements, across the free directions too."""
        return product(self.hessians[:-1], self.blocks[:-1], motion)

    def values(self, problem: Problem, state: Floats, forces: Floats) -> tuple[Freedom, Floats]:
        """The free directions, and the values (nnz,) of K in the order of the pattern."""
        self.linearise(problem, state, forces)
        free = problem.constraint.freedom(state)
        return free, self.assembled(free)

    def stress_values(self, problem: Problem, state: State, change: Floats, motion: Floats) -> Floats:
        """(nnz,) values of the change of K with the internal forces alone, the geometry being frozen.

        Args:
            change: (e,) of the axial forces [N].
            motion: (N, 3) along which moments change, of the elements that are `Stressed` [m, rad].
        """
        hessians = room_for(self.blocks)
        for element, values in zip(problem.elements, hessians, strict=False):
            if is_stressed(element):
                element.stress_stiffness(state, motion, values)
        problem.stretch.axial_stiffness(state, change, hessians[-2])
        return self.pattern.assembly.assemble(hessians, self.blocks, problem.constraint.freedom(state))

    def tangent(self, problem: Problem, state: Floats, forces: Floats) -> Tangent:
        """The tangent at a state.

        Raises:
            SingularError: a pivot vanishes.
        """
        free, values = self.values(problem, state, forces)
        factors = self.pattern.solver.factor(values)
        return Tangent(_fixed(state.copy()), _fixed(forces.copy()), free, _fixed(values), self.pattern, factors)


def _fixed(array: Floats) -> Floats:
    """A view that cannot be written to. The array itself can: Numba compiles a kernel again for arrays that cannot."""
    view = array.view()
    view.flags.writeable = False
    return view


def subspace_iteration(
    apply: Callable[[Floats], Floats],
    start: Floats,
    *,
    settled: int,
    tolerance: float,
    most_sweeps: int,
) -> tuple[Floats, Floats, bool]:
    """The largest eigenvalues of a symmetric positive operator, and their directions, by subspace iteration with
    Rayleigh and Ritz's values, which are a little too small, never too large [Golub and Van Loan 2013, 8.2.4].

    Args:
        apply: the operator, on each of the vectors (m, n).
        start: (m, n) vectors to begin with.
        settled: so many of the largest eigenvalues must have settled.
        tolerance: of the square of these ones' residuals over the eigenvalue, which is about the relative error of the
            eigenvalue [Parlett 1998, section 11.7].
        most_sweeps: it ends after so many in any case.

    Returns:
        Values (m,) descending, directions (m, n), orthogonal but not of unit length, and whether the values settled.
    """
    rows, done = start, False
    for _ in range(most_sweeps):
        rows = orthonormal(rows)
        images = apply(rows)
        values, turn = np.linalg.eigh(np.einsum("ik,jk->ij", rows, images))
        values, turn = values[::-1], turn[:, ::-1]
        before, rows = np.einsum("ji,jk->ik", turn, rows), np.einsum("ji,jk->ik", turn, images)
        left = rows - values[:, None] * before
        done = bool((np.einsum("ik,ik->i", left, left) <= tolerance * values**2)[:settled].all())
        if done:
            break
    return values, rows, done


def generic(size: int, count: int) -> Floats:
    """(count, size) rows to begin an iteration with, or fewer: the same at every run, and no symmetry of a structure is
    one of theirs."""
    return np.asarray(np.sin(1.0 + np.arange(size) ** 2 * np.arange(1, 1 + min(count, size))[:, None]))


def negative_mode(inverse: Callable[[Floats], Floats], start: Floats, *, tolerance: float) -> Floats:
    """(n,) direction of the negative eigenvalue of a symmetric matrix that is nearest to zero.

    Args:
        inverse: of the matrix, on a vector (n,) or on each of many (k, n).
        start: (m, n) directions near which it is looked for: it is found at once if it is one of the m softest.
        tolerance: as of `subspace_iteration`.
    """
    values, (row, *_), settled = subspace_iteration(
        lambda rows: -inverse(rows), start, settled=1, tolerance=tolerance, most_sweeps=FEW_SWEEPS
    )
    if settled and values[0] > 0:
        return np.asarray(row)
    size = start.shape[1]
    operator = LinearOperator((size, size), matvec=inverse, dtype=float)
    with threadpool_limits(limits=1, user_api="blas"):
        return np.asarray(eigsh(operator, k=1, which="SA", v0=start[0], tol=tolerance)[1][:, 0])


def orthonormal(rows: Floats) -> Floats:
    """Rows (m, n), made orthogonal and of unit length by Gram and Schmidt, twice, the first row first.

    Sums are those of one thread: a BLAS would divide them among its threads, whose waiting costs more than it saves.
    """
    result = rows.copy()
    for k, row in enumerate(result):
        for _ in range(2):
            row -= np.einsum("i,ik->k", np.einsum("ik,k->i", result[:k], row), result[:k])
            row /= np.sqrt(np.einsum("k,k->", row, row))
    return result
