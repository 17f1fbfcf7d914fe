"""Following an equilibrium along a path of loads or supports.

`follow` wants the end, from t = 0 to t = 1, by whatever stable equilibria Newton's method finds on the way. `trace`
wants the path: it goes on only from one equilibrium to the next on the same branch, and tells them by their energy.
Between two equilibria on one branch the work of the supports accounts for the change of energy; where it does not,
the step was too long, or the branch has ended in a limit point or a bifurcation. What happens there in reality is a
snap: at held supports the energy falls until the structure rests in another stable equilibrium.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Floats
from rodshell.solve.equilibrium import Equilibrium, find_equilibrium, find_stable
from rodshell.solve.problem import Problem, Supports
from rodshell.solve.report import SolveReport, Status

EASY = 5  # a step that needs no more iterations may be followed by a longer one
MOST = 25
SMALLEST_STEP = 1e-3
MOST_OF_ALL = 400  # iterations of the whole path; the paths that arrive take 30 to 100
UNACCOUNTED = 0.02  # of the energy: more than the trapezoidal rule leaves of a short step along one branch
MOST_A_STEP = 8  # iterations of a step along a branch
TINY = 1e-300
DISTURBANCE = 1e-3  # of the length, along the mode of an unstable equilibrium, from where the energy falls


def follow(
    problem_at: Callable[[float], Problem],
    state: Floats,
    forces: Floats,
    *,
    first_step: float,
    progress: Callable[[float, int, float], None] | None = None,
) -> Equilibrium:
    """Move from t = 0 to t = 1 by steps that halve on failure and grow back.

    Parameters
    ----------
    problem_at : the problem at t, its constraint saying where the prescribed blocks are then; its energies are the
        same at all t, and their source frames are carried along the path. The first
        iteration of each step carries them there with the tangent stiffness: it is the tangent predictor.
    state, forces : equilibrium, or a guess of it, at t = 0.

    Returns
    -------
    The equilibrium at t = 1, or at the last t reached, with the status STALLED. Iterations,
    factorizations and seconds of the report are those of the whole path, failed steps included.
    """
    t, step = 0.0, first_step
    reports = list[SolveReport]()
    last: Equilibrium | None = None
    while t < 1.0:
        there = min(1.0, t + step)

        def at_share(iteration: int, residual: float, there: float = there) -> None:
            if progress is not None:
                progress(there, iteration, residual)

        problem = problem_at(there)
        if last is not None:
            problem = going_on(problem, last)
        found = find_stable(problem, state, forces, most_iterations=MOST, progress=at_share)
        reports.append(found.report)
        if found.report.converged:
            t, state, forces, last = there, found.state, found.forces, found
            if found.report.iterations <= EASY:
                step *= 1.6
        else:
            step = 0.4 * min(step, there - t)
        if found.report.status is Status.OUT_OF_TIME:
            break
        if t < 1.0 and (step < SMALLEST_STEP or sum(report.iterations for report in reports) > MOST_OF_ALL):
            break
    ended = last or found
    report = ended.report.after(*(report for report in reports if report is not ended.report))
    if t >= 1.0:
        return replace(ended, report=report)
    late = found.report.status is Status.OUT_OF_TIME
    status = Status.OUT_OF_TIME if late else Status.STALLED
    return replace(ended, report=replace(report, status=status, reason=found.report.reason))


@dataclass(frozen=True)
class Snap:
    """Where a branch of stable equilibria ended and the structure went to another one.

    Parameters
    ----------
    start, stop : of the step in t in which it happened.
    moved : how far the node went that went farthest [m].
    """

    start: float
    stop: float
    moved: float


@dataclass(frozen=True)
class Trace:
    """How far a path was traced: the last t with its stable equilibrium, the snaps on the way, and the work."""

    t: float
    found: Equilibrium
    snaps: tuple[Snap, ...]
    factorizations: int


def trace(
    problem_at: Callable[[float], Problem], here: Equilibrium, start: float, stop: float, *,
    shortest: float, snap: bool, most_factorizations: int, progress: Callable[[float], None] = lambda t: None,
) -> Trace:  # fmt: skip
    """Go from the stable equilibrium `here` at t = `start` towards `stop`, up or down, branch by branch.

    Parameters
    ----------
    problem_at : the problem at t, its constraint being `Supports` with prescribed blocks; source frames as in `follow`.
    shortest : step in t at which a branch that cannot be followed has ended.
    snap : whether to go down the energy there and on from where that leads; else the path ends there.
    most_factorizations : the path ends when they are used up.
    progress : called with t before each step; it may raise an error to end the path.

    Returns
    -------
    The path; its t is `stop` where it arrived.
    """
    t, step, done, snaps = start, abs(stop - start), 0, list[Snap]()
    while t != stop:
        progress(t)
        step = min(step, abs(stop - t))
        there = stop if step == abs(stop - t) else t + float(np.copysign(step, stop - t))
        problem = going_on(problem_at(there), here)
        found = find_stable(problem, here.state, here.forces, most_iterations=MOST_A_STEP)
        done += found.report.factorizations
        if not found.report.stable or unaccounted(here, found):
            if done >= most_factorizations or (step <= shortest and not snap):
                break
            if step > shortest:
                step = max(0.4 * step, shortest)
                continue
            found = _fallen(problem, here, found)
            done += found.report.factorizations
            if not found.report.stable:
                break
            if surplus(here, found) < -UNACCOUNTED:
                snaps.append(Snap(t, there, farthest(here, found)))
            step = 4 * shortest
        elif found.report.iterations <= EASY:
            step *= 1.6
        t, here = there, found
    return Trace(t, here, tuple(snaps), done)


def going_on(problem: Problem, last: Equilibrium) -> Problem:
    """The problem with the source frames and the pattern of an equilibrium of the same structure.

    Parameters
    ----------
    problem : the next one on a path.
    last : the equilibrium that the next solve starts from.
    """
    return replace(problem, elements=last.elements, pattern=last.problem.pattern)


def unaccounted(here: Equilibrium, there: Equilibrium) -> bool:
    """Whether the energies of two equilibria differ by other than the work done on the prescribed blocks between them,
    by the trapezoidal rule; parameters as for `surplus`."""
    return abs(surplus(here, there)) > UNACCOUNTED


def surplus(here: Equilibrium, there: Equilibrium) -> float:
    """Energy gained beyond the work done on the prescribed blocks, over the larger energy; negative where it fell.

    Parameters
    ----------
    here, there : equilibria of one structure under one load, the second with prescribed `Supports`.
    """
    supports = there.problem.constraint
    assert isinstance(supports, Supports)
    moved, before, after = supports.moved, here.energy, there.energy
    work = 0.5 * float(np.sum((here.gradient + there.gradient)[moved] * (there.state - here.state)[moved]))
    return (after - before - work) / max(abs(before), abs(after), TINY)


def farthest(here: Equilibrium, there: Equilibrium) -> float:
    """Largest distance of a node between two equilibria of one structure [m]."""
    nodes = np.unique(here.problem.stretch.blocks)
    return float(np.linalg.norm(there.state[nodes] - here.state[nodes], axis=1).max())


def _fallen(problem: Problem, here: Equilibrium, found: Equilibrium) -> Equilibrium:
    """The stable equilibrium down the energy, the supports being where the problem has them.

    By Newton's method with shifted Hessians, which takes a fifth of the work of the steepest descent and mostly leads
    to the same equilibrium; by the descent where that fails or gains energy.
    """
    from rodshell.solve.relax import relax  # rarely wanted: imported with the dynamics only then

    supports, state, forces = problem.constraint, here.state, here.forces
    assert isinstance(supports, Supports)
    if found.mode is not None:
        state, forces = found.state + DISTURBANCE * problem.length * found.mode, found.forces
        problem = replace(problem, elements=found.elements)
    down = find_equilibrium(problem, state, forces, descend=True)
    if down.report.stable and surplus(here, down) < UNACCOUNTED:
        return down
    state = state.copy()
    state[supports.moved] = supports.goals
    slid = relax(problem, state)
    return replace(slid, report=slid.report.after(down.report))
