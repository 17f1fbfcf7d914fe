"""Static equilibrium by Newton's method with the axial forces as unknowns.

Stiff edges make the plain Newton method crawl: the geometric stiffness of an axial force EA eps evaluated at
a strain that is not yet equilibrated is wild. Here each edge carries its force N as an unknown, updated with
the linearised strain; the same iteration serves elastic edges (N = EA eps at the end) and inextensible ones
(eps = 0 at the end, EA being a penalty that any size serves). On a curved constraint it is the SQP method on
a manifold: steps in the tangent directions, the constraint's curvature in the Hessian, a retraction after.

The steps are those of `newton_step`. `SolveReport` says how a solve ended, here and for every other solver.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from enum import Enum
from functools import cached_property

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import OutOfTimeError
from rodshell.layout import GridLayout, Layout
from rodshell.model import Potential
from rodshell.rods.elements import Elements
from rodshell.solve.newton_step import NewtonStep, TooManyModesError
from rodshell.solve.problem import Problem
from rodshell.solve.sparse_ldl import SingularError
from rodshell.solve.tangent import Tangent, TangentAssembly


class Status(Enum):
    """Typed results; `sentence` says what to do."""

    CONVERGED = "converged"
    STALLED = "stalled"
    DIVERGED = "diverged"
    LOST_CONTACT = "lost contact"
    MOVING = "not at rest"
    BUCKLED = "buckled"
    OUT_OF_TIME = "out of time"

    @property
    def sentence(self) -> str:
        """It on a lattice of straight rods."""
        return self.sentence_on(GridLayout)

    def sentence_on(self, layout: Layout | type[GridLayout]) -> str:
        """It with the advice that fits a lattice."""
        return _SENTENCES[self].format(closer=layout.closer, elsewhere=layout.elsewhere)


_SENTENCES = {
    Status.CONVERGED: "converged",
    Status.STALLED: "stopped at the largest number of iterations above its tolerance; refine the mesh, or "
    "choose {closer}",
    Status.DIVERGED: "the iteration diverged; choose {closer}, or {elsewhere}",
    Status.LOST_CONTACT: "the grid lost contact with the target (without friction nothing holds it there); "
    "use method = bound",
    Status.BUCKLED: "was given up at its start: released from the target, the rods would buckle between their joints "
    "in very many places; {closer}, a flatter target or, of laths, narrower ones may do",
    Status.OUT_OF_TIME: "was out of time",
    Status.MOVING: "was not at rest when its time was over; give it a longer duration, or drag",
}


@dataclass(frozen=True)
class SolveReport:
    """Figures of one solve.

    Args:
        force_residual: largest component of the gradient in the free directions [N].
        max_strain: largest axial strain, or constraint strain where rods are inextensible [-].
        negative_modes: of the exact Hessian in the free directions at the final state; 0 says stable.
        reason: when and where it was out of time, or "".
    """

    status: Status
    dofs: int
    iterations: int
    factorizations: int
    seconds: float
    force_residual: float
    max_strain: float
    negative_modes: int
    reason: str = ""

    @property
    def sentence(self) -> str:
        """How it ended, and what to do."""
        return self.reason or self.status.sentence

    @property
    def converged(self) -> bool:
        return self.status is Status.CONVERGED

    @property
    def stable(self) -> bool:
        return self.converged and self.negative_modes == 0

    def after(self, *earlier: "SolveReport") -> "SolveReport":
        """This report with the work of earlier solves added."""
        return replace(
            self,
            iterations=self.iterations + sum(report.iterations for report in earlier),
            factorizations=self.factorizations + sum(report.factorizations for report in earlier),
            seconds=self.seconds + sum(report.seconds for report in earlier),
        )


Progress = Callable[[int, float], None]

STRAIN_TOLERANCE = 2e-6
REPEATED, _ALIKE = 12, 1e-3  # steps; and how near to each other
MOST_ITERATIONS = 60
LONGEST_SLIDE = 120  # iterations off a saddle
NUDGE = 0.01  # motion along the mode of an unstable equilibrium where the search for the lowest energy begins
FARTHEST = 0.16  # where it ends
PROBE = 1e-3  # motion of the differences of gradients


@dataclass(frozen=True, eq=False)
class Equilibrium:
    """How a solve ended: a state with its axial forces.

    Args:
        problem: what was solved, the source frames of its elements being at the state (its twist angles belong to
            them), with the pattern that serves the next solve of this structure.
        state: (n, 3) [m, at twist angles rad].
        forces: (e,) axial forces [N].
        gradient: (n, 3) of energy and load, without constraint forces [N].
        mode: (n, 3) where the state is not stable, the direction of the most negative curvature, its largest motion
            being 1 (`Problem.unit`); else None.
    """

    problem: Problem
    state: Floats
    forces: Floats
    gradient: Floats
    report: SolveReport
    mode: Floats | None = None

    @property
    def elements(self) -> tuple[Elements, ...]:
        """Every energy but the stretch, with its source frames at the state."""
        return self.problem.elements

    @property
    def energy(self) -> float:
        """Elastic energy less the work of the load [J]."""
        return self.problem.potential(self.state)

    @cached_property
    def tangent(self) -> Tangent:
        """The tangent stiffness at this state, which is factorised when it is first asked for.

        Raises:
            SingularError: some motion has no stiffness.
        """
        return TangentAssembly(self.problem, self.state).tangent(self.problem, self.state, self.forces)


def find_equilibrium(
    problem: Problem,
    state: Floats,
    forces: Floats,
    *,
    descend: bool = False,
    limit_steps: bool = False,
    most_modes: int | None = None,
    most_iterations: int = MOST_ITERATIONS,
    progress: Progress | None = None,
) -> Equilibrium:
    """Equilibrium near a state.

    Never raises for a solve that does not converge: the report's status says so, and the last state comes with it.

    Args:
        problem: the source frames of its elements being at, or near, the state.
        state: (n, 3) first guess [m, at twist angles rad].
        forces: (e,) first guess of the axial forces [N].
        descend: shift every indefinite Hessian, so as to slide off saddles, not only those far from equilibrium.
        limit_steps: for a start from afar: take only a part of steps that were too long. Not on a path, whose own steps
            are shortened instead.
        most_modes: where the start has more negative modes, it is given up at once (BUCKLED); None: never.
        most_iterations: chord steps in a row count as one.
        progress: called with the number and the length of each step, as the solver measures it; an OutOfTimeError
            that it raises ends the solve with that status.
    """
    begin = time.perf_counter()
    newton = NewtonStep(problem, state, descend=descend, limit_steps=limit_steps, most_modes=most_modes)
    here, status, steps, reason = newton.start(state, forces), Status.STALLED, list[float](), ""
    while here.iterations + here.counts <= most_iterations:
        try:
            there = newton.take(here)
        except TooManyModesError:
            status = Status.BUCKLED
            break
        except SingularError:
            status = Status.DIVERGED
            break
        if not there.finite:
            here, status = replace(here, iterations=there.iterations), Status.DIVERGED
            break
        counted, here = here.counts, there
        if progress is not None and counted:
            try:
                progress(here.iterations, here.length)
            except OutOfTimeError as late:
                reason = str(late)
        if here.settled and here.mismatch < STRAIN_TOLERANCE:
            status = Status.CONVERGED
            break
        if reason:
            status = Status.OUT_OF_TIME
            break
        steps.append(here.length)
        if _repeats(steps):
            break
        here = here.refreshed()
    matrix, state, forces = newton.matrix, here.state, here.forces
    mode = newton.lowest_mode() if status is Status.CONVERGED and matrix.negative_modes else None
    gradient = here.problem.gradient(state, forces)
    residual = problem.constraint.freedom(state).reduce(gradient)
    report = SolveReport(
        status=status,
        dofs=len(residual),
        iterations=here.iterations,
        factorizations=matrix.factorizations,
        seconds=time.perf_counter() - begin,
        force_residual=float(np.abs(residual).max(initial=0.0)),
        max_strain=float(np.abs(here.strains).max()),
        negative_modes=matrix.negative_modes,
        reason=reason if status is Status.OUT_OF_TIME else "",
    )
    solved = replace(here.refreshed().problem, pattern=newton.assembly.pattern)
    return Equilibrium(solved, state, forces, gradient, report, mode)


def _repeats(steps: list[float]) -> bool:
    """Whether the last `REPEATED` steps are as long as those two before: back and forth between two states."""
    last = np.array(steps[-REPEATED - 2 :])
    return len(last) == REPEATED + 2 and bool(np.all(np.abs(last[2:] - last[:-2]) <= _ALIKE * last[2:]))


def beside(saddle: Equilibrium, mode: Floats) -> tuple[Floats, Floats]:
    """Where the energy is lowest along the valley that leaves an unstable equilibrium along its mode.

    The valley is x = x0 + q v + q^2 w / 2 + ..., K w = -E'''[v, v] across v [Koiter 1945]: of thin rods the mode alone
    would stretch the edges, which hides how deep it is.

    Args:
        mode: (n, 3) v, its largest motion 1.

    Returns:
        State (n, 3) and axial forces (e,) there; `NUDGE` along the mode where the valley is not seen.
    """
    problem, state, stretch = saddle.problem, saddle.state, saddle.problem.stretch
    shares, nudged = mode / problem.unit(len(state)) ** 2, (state + NUDGE * mode, saddle.forces)
    try:
        tangent = saddle.tangent
    except SingularError:
        return nudged
    second = problem.energies.gradient(state + PROBE * mode)
    problem.energies.add_gradient(state - PROBE * mode, second)
    for elements in problem.energies.sets:
        second -= 2.0 * Potential((elements,)).gradient(state)
    bend = tangent.solve(-second / PROBE**2)
    bend -= np.vdot(shares, bend) / np.vdot(shares, mode) * mode

    def at_share(q: float) -> tuple[float, Floats]:
        there = problem.constraint.retract(state + q * mode + 0.5 * q**2 * bend)
        return problem.potential(there), there

    q, (energy, there) = NUDGE, at_share(NUDGE)
    here = saddle.energy
    while energy >= here and q > NUDGE / 4**6:
        q *= 0.25
        energy, there = at_share(q)
    if energy >= here:
        return nudged
    for factor in (2.0, 0.5):
        while q * factor <= FARTHEST and (further := at_share(q * factor))[0] < energy:
            q, (energy, there) = q * factor, further
    return there, stretch.stiffness * stretch.strains(there)


def find_stable(
    problem: Problem,
    state: Floats,
    forces: Floats,
    *,
    limit_steps: bool = False,
    most_modes: int | None = None,
    most_iterations: int = MOST_ITERATIONS,
    slide: bool = True,
    neutral: float = 0.0,
    progress: Progress | None = None,
) -> Equilibrium:
    """As `find_equilibrium`; where that ends on a saddle, slide off along its mode, to either side in turn.

    Args:
        problem, state, forces, limit_steps, most_modes, most_iterations, progress: see `find_equilibrium`.
        slide: whether to leave a saddle.
        neutral: where the energy falls along a single mode by less than this [J], nothing resists that mode, and it
            makes no saddle.

    Returns:
        The stable equilibrium; the saddle, with its negative modes counted, where neither side leads to one. The report
        counts the work of all solves.
    """
    first = _without_neutral(
        find_equilibrium(
            problem,
            state,
            forces,
            limit_steps=limit_steps,
            most_modes=most_modes,
            most_iterations=most_iterations,
            progress=progress,
        ),
        neutral,
    )
    tries = [first]
    if slide and first.mode is not None:
        counted = replace(first.report, factorizations=first.report.factorizations + 1)  # that of the tangent
        tries[0] = first = replace(first, report=counted)
        for side in (1.0, -1.0):
            assert first.mode is not None
            start, forces_there = beside(first, side * first.mode)
            found = find_equilibrium(
                first.problem,
                start,
                forces_there,
                descend=True,
                most_iterations=min(2 * most_iterations, LONGEST_SLIDE),
                progress=progress,
            )
            tries.append(_without_neutral(found, neutral))
            if tries[-1].report.stable or tries[-1].report.status is Status.OUT_OF_TIME:
                break
    last = tries[-1].report
    best = tries[-1] if last.stable or last.status is Status.OUT_OF_TIME else first
    return replace(best, report=best.report.after(*(tried.report for tried in tries if tried is not best)))


def _without_neutral(found: Equilibrium, neutral: float) -> Equilibrium:
    """An equilibrium, its one negative mode not counted if along it the energy [J] does not fall but by round-off."""
    if found.mode is None or found.report.negative_modes != 1 or not neutral:
        return found
    energies = Potential((*found.elements, found.problem.stretch.with_forces(found.forces)))
    if energies.curvature(found.state, found.mode) <= -neutral:
        return found
    return replace(found, mode=None, report=replace(found.report, negative_modes=0))
