"""Static equilibrium by Newton's method with the axial forces as unknowns.

Stiff edges make the plain Newton method crawl: the geometric stiffness of an axial force EA eps evaluated at
a strain that is not yet equilibrated is wild. Here each edge carries its force N as an unknown, updated with
the linearised strain; the same iteration serves elastic edges (N = EA eps at the end) and inextensible ones
(eps = 0 at the end, EA being a penalty that any size serves). On a curved constraint it is the SQP method on
a manifold: steps in the tangent directions, the constraint's curvature in the Hessian, a retraction after.

Near the end a factorisation serves for the steps after it, too, which then cost a gradient and a solve (chord steps).
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace

import numba as nb
import numpy as np
from numpy.typing import NDArray

from gridshell.model import Assembly, Freedom
from gridshell.rods.elements import NO_HESSIANS, Elements
from gridshell.rods.stretch import Stretch
from gridshell.solve.constraint import Constraint
from gridshell.solve.linear import LinearSolver, Qdldl, SingularError
from gridshell.solve.multifrontal import Multifrontal
from gridshell.solve.report import SolveReport, Status

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Progress = Callable[[int, float], None]


@dataclass(frozen=True)
class Pattern:
    """Which blocks (m, k) of unknowns the energies couple, each block with `count` (n,) free directions; and what
    follows from that alone: the assembly's maps, and a solver with its order of elimination."""

    blocks: tuple[Ints, ...]
    count: Ints
    assembly: Assembly
    solver: LinearSolver

    def serves(self, blocks: tuple[Ints, ...], count: Ints) -> bool:
        """Whether another problem has this pattern."""
        here, there = (*self.blocks, self.count), (*blocks, count)
        return len(here) == len(there) and all(map(np.array_equal, here, there))


@dataclass(frozen=True)
class Problem:
    """A shell in equilibrium: elastic elements, edges, loads and a constraint.

    Parameters
    ----------
    elements : every energy but the stretch.
    stretch : the edges.
    inextensible : the strain must vanish (the edges' stiffness is a penalty), else edges are elastic.
    constraint : supports or a surface.
    length : characteristic length of the shape [m]: steps are measured by it.
    load : (n, 3) dead forces [N], or None.
    places : (n, 2) where the blocks lie in the flat grid, from which the order of elimination follows, or None.
    pattern : of a problem that was solved before; where this one has the same, it need not be analysed again.
    """

    elements: tuple[Elements, ...]
    stretch: Stretch
    constraint: Constraint
    length: float
    inextensible: bool = False
    load: Floats | None = None
    places: Floats | None = None
    pattern: Pattern | None = None


@dataclass(frozen=True)
class Equilibrium:
    """A state (n, 3), its axial forces (e,) [N], its gradient (n, 3) [N] without constraint forces, and figures.

    The twist angles of the state belong to the source frames of `elements`, which are at the state. `pattern` serves
    the next solve of this shell, and keeps the factors alive. Where the state is not stable, `mode` (n, 3) is the
    direction of the most negative curvature, its largest displacement being 1.
    """

    state: Floats
    forces: Floats
    gradient: Floats
    report: SolveReport
    elements: tuple[Elements, ...]
    pattern: Pattern
    mode: Floats | None = None


TOLERANCE = 1e-13  # of the length: estimate of the error that is left
FORCE_TOLERANCE = 1e-10  # of the largest axial force: the same for the forces
LEAST_FORCE = 1e-6  # of EA: axial forces smaller than this are not known better
STRAIN_TOLERANCE = 2e-6
CURVED = 20.0  # times the square of Newton's step is left after it: 6 to 23 measured on smooth targets
LONGEST_STEP = 0.15  # of the length
NEAR = 0.02  # of the length: a step this short leads to the equilibrium at hand, be it a saddle
NUDGE = 0.01  # of the length, along the mode of an unstable equilibrium
STALE = 1e-3  # of the largest axial force: by more they must not change after the negative modes are counted
CHORD = 5e-3  # of the length: after a Newton step this short the factorisation serves for the next one, too
SLOW = 0.1  # of the last step: a chord step that is longer is not made
SHIFT_GROWTH = 8.0
TINY = 1e-300  # no step is shorter, but for none at all


def find_equilibrium(
    problem: Problem,
    state: Floats,
    forces: Floats,
    *,
    descend: bool = False,
    most_iterations: int = 60,
    progress: Progress | None = None,
) -> Equilibrium:
    """Equilibrium near `state` (n, 3) [m] with axial forces near `forces` (e,) [N].

    Never raises for a solve that does not converge: the report's status says so, and the last state comes with it.

    Parameters
    ----------
    descend : shift every indefinite Hessian, so as to slide off saddles, not only those far from equilibrium.
    """
    begin = time.perf_counter()
    step = _Step(problem, state)
    status = Status.STALLED
    while step.iterations + step.counts <= most_iterations:
        new = step.counts
        try:
            moved, state_next, forces_next, mismatch = step.take(state, forces, descend)
        except SingularError:
            status = Status.DIVERGED
            break
        if not (np.isfinite(moved) and np.isfinite(forces_next).all()):
            status = Status.DIVERGED
            break
        state, forces = state_next, forces_next
        if progress is not None and new:
            progress(step.iterations, moved / problem.length)
        if step.settled and mismatch < STRAIN_TOLERANCE:
            status = Status.CONVERGED
            break
        step.refresh(state)
    gradient = step.gradient(state, forces)
    residual = problem.constraint.freedom(state).reduce(gradient)
    report = SolveReport(
        status=status,
        dofs=step.dofs,
        iterations=step.iterations,
        factorizations=step.factorizations,
        seconds=time.perf_counter() - begin,
        force_residual=float(np.abs(residual).max(initial=0.0)),
        max_strain=float(np.abs(problem.stretch.strains(state)).max()),
        negative_modes=step.negative_modes,
    )
    mode = step.lowest_mode() if status is Status.CONVERGED and step.negative_modes else None
    step.refresh(state)
    return Equilibrium(state, forces, gradient, report, step.elements, step.pattern, mode)


def find_stable(
    problem: Problem, state: Floats, forces: Floats, *, most_iterations: int = 60, progress: Progress | None = None
) -> Equilibrium:
    """As `find_equilibrium`; where that ends on a saddle, slide off along its mode, to either side in turn.

    Returns the saddle, with its negative modes counted, where neither side leads to a stable equilibrium.
    The report counts the work of all solves.
    """
    first = find_equilibrium(problem, state, forces, most_iterations=most_iterations, progress=progress)
    tries = [first]
    if first.mode is not None:
        for side in (1.0, -1.0):
            start = first.state + side * NUDGE * problem.length * first.mode
            tries.append(
                find_equilibrium(
                    replace(problem, elements=first.elements, pattern=first.pattern),
                    start,
                    first.forces,
                    descend=True,
                    most_iterations=2 * most_iterations,
                    progress=progress,
                )
            )
            if tries[-1].report.stable:
                break
    best = tries[-1] if tries[-1].report.stable else first
    return replace(best, report=best.report.after(*(one.report for one in tries if one is not best)))


def linear_solver(
    indptr: NDArray[np.int64], indices: NDArray[np.int64], free: Freedom, places: Floats | None
) -> LinearSolver:
    """The solver for a pattern: ordered by the `places` (n, 2) of the blocks in the flat grid, if they are known."""
    if places is None:
        return Qdldl(indptr, indices)
    return Multifrontal(indptr, indices, np.repeat(places, free.count, axis=0))


def _pattern(problem: Problem, blocks: tuple[Ints, ...], free: Freedom) -> Pattern:
    """The pattern of a problem: the one that comes with it, or a new one."""
    if problem.pattern is not None and problem.pattern.serves(blocks, free.count):
        return problem.pattern
    assembly = Assembly.of(blocks, free)
    solver = linear_solver(assembly.indptr, assembly.indices, free, problem.places)
    return Pattern(blocks, free.count, assembly, solver)


class _Step:
    """One iteration, with the buffers, the pattern and the factorisation that all iterations share."""

    def __init__(self, problem: Problem, state: Floats) -> None:
        self._problem = problem
        self.elements = problem.elements
        free = problem.constraint.freedom(state)
        everywhere = np.arange(len(state))[:, None]
        self._blocks = (*(element.blocks for element in problem.elements), problem.stretch.blocks, everywhere)
        self.pattern = _pattern(problem, self._blocks, free)
        self._assembly, self._solver = self.pattern.assembly, self.pattern.solver
        self._hessians = [np.zeros((len(b), 3 * b.shape[1], 3 * b.shape[1])) for b in self._blocks]
        self.dofs = free.size
        self.iterations = 0
        self.factorizations = 0
        self.negative_modes = 0
        self._shift = 0.0
        self._factored = state, np.empty(0)  # where the matrix is from
        self._last = np.inf, np.inf  # length of the last step and change of the forces, both relative
        self._chord = self._was_chord = self.settled = False

    @property
    def counts(self) -> bool:
        """Whether the next step is an iteration: chord steps in a row stand for one of Newton's."""
        return not (self._chord and self._was_chord)

    def refresh(self, state: Floats) -> None:
        self.elements = tuple(element.refreshed(state) for element in self.elements)

    def gradient(self, state: Floats, forces: Floats) -> Floats:
        """Gradient (n, 3) of energy and load with the given axial forces [N]."""
        gradient = np.zeros_like(state) if self._problem.load is None else -self._problem.load
        for element in self.elements:
            element.evaluate(state, gradient)
        self._problem.stretch.add_axial(state, forces, gradient)
        return gradient

    def take(self, state: Floats, forces: Floats, descend: bool) -> tuple[float, Floats, Floats, float]:
        """Length of the step, the next state and forces, and how far these are from matching the strains."""
        problem = self._problem
        if not self._chord:
            self._factored = state, forces
        at, strains = self._factored[0], problem.stretch.strains(state)
        base = forces if problem.inextensible else np.zeros_like(forces)
        stretch = problem.stretch.with_forces(forces, multipliers=base)
        self._free = free = problem.constraint.freedom(state)
        gradient = np.zeros_like(state) if problem.load is None else -problem.load
        for element, hessians in zip(self.elements, self._hessians, strict=False):
            element.evaluate(state, gradient, NO_HESSIANS if self._chord else hessians)
        if self._chord:  # what the edges lack acts along those of the matrix, else strains do not settle
            stretch.add_axial(state, forces, gradient)
            stretch.add_axial(at, base + stretch.stiffness * strains - forces, gradient)
        else:
            by_force = gradient.copy()
            stretch.add_axial(state, forces, by_force)
            stretch.evaluate(state, gradient, self._hessians[-2])
            curvature = problem.constraint.curvature(state, by_force)
            self._hessians[-1][:] = curvature if len(curvature) else 0.0
        prescribed = problem.constraint.remaining(state)
        if prescribed is not None:
            gradient += self._times(prescribed)
        motion = free.expand(self._direction(-free.reduce(gradient), descend))
        if prescribed is not None:
            motion += prescribed
        reach = float(np.sqrt(np.einsum("ij,ij->i", motion, motion).max()))
        if self._chord and not reach <= SLOW * self._last[0] * problem.length:  # of no use: Newton's step instead
            self._chord = False
            return self.take(state, forces, descend)
        share = min(1.0, LONGEST_STEP * problem.length / reach) if reach > 0 else 1.0
        strains += stretch.elongation(at, motion)
        forces_next = forces + share * (base + stretch.stiffness * strains - forces)
        state_next = problem.constraint.retract(state + share * motion)
        left = problem.stretch.strains(state_next)
        if not problem.inextensible:
            left = left - forces_next / problem.stretch.stiffness
        self._judge(reach / problem.length, forces, forces_next)
        return reach, state_next, forces_next, float(np.abs(left).max())

    def _judge(self, moved: float, before: Floats, after: Floats) -> None:
        """Whether the error that is left is small enough, and whether the factorisation serves for another step.

        After Newton's step the error is about its square; after a chord step it shrinks as from the last step to this.
        The last factorisation is made where the forces are nearly those of the equilibrium: it counts its modes.
        """
        self.iterations += self.counts
        size = max(float(np.abs(after).max(initial=0.0)), LEAST_FORCE * float(self._problem.stretch.stiffness.max()))
        changed, since = (float(np.abs(after - old).max(initial=0.0)) / size for old in (before, self._factored[1]))
        shrunk = moved / max(self._last[0], TINY), changed / max(self._last[1], TINY)
        rates = shrunk if self._chord else (CURVED * moved, changed)
        self.settled = moved * rates[0] < TOLERANCE and changed * rates[1] < FORCE_TOLERANCE and since < STALE
        self._was_chord, self._last = self._chord, (moved, changed)
        count_again = since >= STALE > changed / 3
        self._chord = moved < CHORD and not count_again and not self.negative_modes

    def _times(self, motion: Floats) -> Floats:
        """(n, 3) product of the Hessian last evaluated with displacements (n, 3)."""
        result = np.zeros_like(motion)
        for hessians, blocks in zip(self._hessians, self._blocks, strict=True):
            _add_product(hessians, blocks, motion, result)
        return result

    def lowest_mode(self) -> Floats:
        """(n, 3) eigenvector of the most negative eigenvalue of the Hessian last evaluated."""
        self._shift_until_definite()
        mode = self._free.expand(self._inverse_iteration(12)[0])
        return mode / np.sqrt(np.einsum("ij,ij->i", mode, mode).max())

    def _direction(self, right: Floats, descend: bool) -> Floats:
        """Newton's step; where the Hessian is indefinite and equilibrium is far, that of the shifted Hessian."""
        if self._chord:
            return self._solver.solve(right)
        self._data = self._assembly.assemble(self._hessians, self._blocks, self._free)
        regular = self._count_negative_modes()
        if self.negative_modes and regular and not descend:
            step = self._solver.solve(right)
            if np.abs(step).max() < NEAR * self._problem.length:
                return step
        if self.negative_modes:
            self._shift_until_definite()
        return self._solver.solve(right)

    def _count_negative_modes(self) -> bool:
        """Factorise the Hessian; whether that can be done. A mode without stiffness counts as a negative one."""
        self.factorizations += 1
        try:
            self.negative_modes = self._solver.factor(self._data)
        except SingularError:
            if not np.isfinite(self._data).all():
                raise
            self.negative_modes = 1
            return False
        return True

    def _shift_until_definite(self) -> None:
        """Factorise with the diagonal shifted by about twice the most negative eigenvalue.

        A Newton step then doubles what the state has of its mode. The search begins where a wave as long as the
        shell is soft against the bending of an edge, or below the last shift that sufficed.
        """
        bending = self._hessians[0]
        slender = float(self._problem.stretch.rest_lengths.mean()) / self._problem.length
        softest = slender**4 * float(np.trace(bending, axis1=1, axis2=2).mean()) / bending.shape[1]
        shift, tries = max(softest, self._shift / SHIFT_GROWTH), 0
        while self._factor_shifted(shift) and tries < 40:
            shift, tries = SHIFT_GROWTH * shift, tries + 1
        lowest = self._inverse_iteration(4)[1] - shift
        if 0.0 < -2.0 * lowest < 0.5 * shift and not self._factor_shifted(-2.0 * lowest):
            shift = -2.0 * lowest
        self._shift = shift

    def _factor_shifted(self, shift: float) -> int:
        shifted = self._data.copy()
        shifted[self._assembly.diagonal] += shift
        self.factorizations += 1
        return self._solver.factor(shifted)

    def _inverse_iteration(self, steps: int) -> tuple[Floats, float]:
        """Eigenvector (dofs,) of the smallest eigenvalue of the matrix last factorised, and that eigenvalue."""
        v = np.sin(1.0 + np.arange(self._free.size) ** 2)  # no symmetry of the shell is one of this start
        for _ in range(steps):
            v /= np.linalg.norm(v)
            image = self._solver.solve(v)
            smallest = 1.0 / float(v @ image)
            v = image
        return v, smallest


@nb.njit(cache=True)
def _add_product(hessians, blocks, motion, result):  # type: ignore[no-untyped-def]
    """Add to `result` (n, 3) what elements with `hessians` (m, 3k, 3k) on `blocks` (m, k) make of displacements."""
    for m in range(blocks.shape[0]):
        for a in range(blocks.shape[1]):
            for b in range(blocks.shape[1]):
                i, j = blocks[m, a], blocks[m, b]
                for k in range(3):
                    for d in range(3):
                        result[i, k] += hessians[m, 3 * a + k, 3 * b + d] * motion[j, d]
