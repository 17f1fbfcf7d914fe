"""Following an equilibrium along a path of loads or supports, and down its energy to a stable one.

`follow` wants the end, from t = 0 to t = 1, by whatever stable equilibria Newton's method finds on the way. `trace`
wants the path: it continues only to the next equilibrium on the same branch, which it recognises by the energy.
Between two equilibria on one branch the work of the supports accounts for the change of energy; where it does not,
the step was too long, or the branch has ended in a limit point or a bifurcation. What happens there in reality is a
snap: at held supports the energy falls until the structure rests in another stable equilibrium.

`relax` descends to a stable equilibrium from far away, where Newton's method and paths of loads fail.
The state follows the steepest descent of its energy, x' = -D^-1 grad E, by implicit Euler with steps that grow while
they succeed: each minimises E + D |x - x0|^2 / 2h^2 by `ImplicitEuler`, which refuses a step whose matrix is not
positive definite, so that the energy never grows. At first the matrix is nearly D, at last nearly the Hessian:
Levenberg and Marquardt's method, with a step length in place of their factor. D is the diagonal of the Hessian of
the elements where the descent starts, so that metres, radians and soft and stiff places all move at their own pace.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import OutOfTimeError
from rodshell.model import Potential
from rodshell.rods.elements import with_frames
from rodshell.solve.continuation import Continuation
from rodshell.solve.equilibrium import Equilibrium, SolveReport, Status, find_equilibrium, find_stable
from rodshell.solve.implicit_euler import ImplicitEuler, Motion, Refused
from rodshell.solve.newton_matrix import SparseSum
from rodshell.solve.problem import PointLoads, Problem, Supports

EASY = 5  # a step that needs no more iterations may be followed by a longer one
MOST = 25
SMALLEST_STEP = 1e-3
_SNAP = 0.01  # step over which a structure may snap
_MOST_OF_ALL = 400  # iterations of the whole path; the paths that arrive take 30 to 100
UNACCOUNTED = 0.02  # of the energy: more than the trapezoidal rule leaves of a short step along one branch
_MOST_A_STEP = 8  # iterations of a step along a branch
SAME = 1e-3  # of the length: equilibria further apart are different ones
FINER = 10  # steps on the way back after a snap, at most, for each of the shortest ahead
_MOST_BACK = 300  # factorisations of the way back: 2 are usual
TINY = 1e-300
_DISTURBANCE = 1e-3  # largest motion along the mode of an unstable equilibrium, from where the energy falls


def follow(
    problem_at: Callable[[float], Problem],
    state: Floats,
    forces: Floats,
    *,
    first_step: float,
    snap: bool = False,
    neutral: float = 0.0,
    slide: bool = True,
    easy: int = EASY,
    most: int = MOST,
    most_of_all: int | None = _MOST_OF_ALL,
    most_factorizations: int | None = None,
    most_modes: int | None = None,
    progress: Callable[[float, int, float], None] | None = None,
) -> "Trace":
    """Move from t = 0 to t = 1 by steps that shrink on failure and grow back; see `Trace.whole`.

    Args:
        problem_at: the problem at t, its constraint saying where the prescribed blocks are then; its energies are the
            same at all t, and their source frames are carried along the path. The first iteration of each step carries
            them there with the tangent stiffness: it is the tangent predictor.
        state, forces: equilibrium, or a guess of it, at t = 0.
        snap: where short steps fail, as at a limit point, go down the energy to the next stable equilibrium, as the
            structure itself would; its constraint must be `Supports`.
        neutral, slide: as of `find_stable`.
        easy: iterations of a step that may be followed by a longer one.
        most, most_of_all: iterations of a step, and of the path; None: as many as it takes.
        most_factorizations: no step is begun after so many, and no descent takes many more; None: as many as it takes.
        most_modes: the path ends at an equilibrium with more negative modes; None: at none.
    """
    path, reports = Continuation(0.0, 1.0, first_step, SMALLEST_STEP), list[SolveReport]()
    last: Equilibrium | None = None
    while not path.arrived:
        there = path.there

        def at_share(iteration: int, residual: float, there: float = there) -> None:
            if progress is not None:
                progress(there, iteration, residual)

        problem = problem_at(there)
        if last is not None:
            problem, state, forces = going_on(problem, last), last.state, last.forces
        found = find_stable(
            problem, state, forces, slide=slide, neutral=neutral, most_iterations=most, progress=at_share
        )
        reports.append(found.report)
        if found.report.converged:
            path.accept(easy=found.report.iterations <= easy)
            last = found
        else:
            path.shorten()
        if found.report.status is Status.OUT_OF_TIME:
            break
        if snap and last is not None and path.step < _SNAP and not found.report.converged:
            short, path.step = path.step, _SNAP
            left = None if most_factorizations is None else most_factorizations - _made(reports)
            found = _fallen(going_on(problem_at(path.there), last), last, found, most_factorizations=left)
            reports.append(found.report)
            if found.report.stable:
                path.accept()
            last, path.step = (found, 4 * _SNAP) if found.report.stable else (last, short)
        spent = most_of_all is not None and sum(report.iterations for report in reports) > most_of_all
        if path.lost or spent or (most_factorizations is not None and _made(reports) >= most_factorizations):
            break
        if found.report.converged and most_modes is not None and found.report.negative_modes > most_modes:
            break
    return Trace(path.t, last or found, (), tuple(reports))


def _made(reports: Sequence[SolveReport]) -> int:
    """Factorisations of several solves."""
    return sum(report.factorizations for report in reports)


@dataclass(frozen=True)
class Snap:
    """Where a branch of stable equilibria ended and the structure went to another one.

    Args:
        start, stop: of the step in t in which it happened.
        moved: how far the node went that went farthest [m].
    """

    start: float
    stop: float
    moved: float


@dataclass(frozen=True)
class Trace:
    """How far a path was followed: the last t with its equilibrium, the snaps on the way, and all its solves."""

    t: float
    found: Equilibrium
    snaps: tuple[Snap, ...]
    reports: tuple[SolveReport, ...]

    @property
    def factorizations(self) -> int:
        """Of all solves, those of steps that were too long too."""
        return _made(self.reports)

    @property
    def whole(self) -> Equilibrium:
        """The equilibrium at t = 1, or at the last t reached, with the status STALLED or OUT_OF_TIME. Its report counts
        the work of the whole path, failed steps included."""
        report = self.found.report.after(*(report for report in self.reports if report is not self.found.report))
        if self.t < 1.0:
            late = self.reports[-1].status is Status.OUT_OF_TIME
            status = Status.OUT_OF_TIME if late else Status.STALLED
            report = replace(report, status=status, reason=self.reports[-1].reason)
        return replace(self.found, report=report)


def trace(
    problem_at: Callable[[float], Problem], here: Equilibrium, start: float, stop: float, *,
    shortest: float, snap: bool, most_factorizations: int,
    progress: Callable[[float, Equilibrium], None] = lambda t, here: None,
) -> Trace:  # fmt: skip
    """Go from the stable equilibrium `here` at t = `start` towards `stop`, up or down, branch by branch.

    Where a branch ends, the structure snaps, unless the way back undoes that: a path that rises too steeply for the
    shortest step, as where it forks, goes back to where it came from.

    Args:
        problem_at: the problem at t, its constraint being `Supports` with prescribed blocks; source frames as in
            `follow`.
        shortest: step in t at which a branch that cannot be followed has ended.
        snap: whether to go down the energy there and on from where that leads; else the path ends there.
        most_factorizations: the path ends when they are used up.
        progress: called with t and the equilibrium there before each step; it may raise an error to end the path.
    """
    path, snaps, reports = Continuation(start, stop, abs(stop - start), shortest), list[Snap](), list[SolveReport]()
    while not path.arrived:
        progress(path.t, here)
        t, there = path.t, path.there
        problem = going_on(problem_at(there), here)
        found = find_stable(problem, here.state, here.forces, most_iterations=_MOST_A_STEP)
        reports.append(found.report)
        if not found.report.stable or unaccounted(here, found):
            at_shortest = path.length <= shortest
            if _made(reports) >= most_factorizations or (at_shortest and not snap):
                break
            if not at_shortest:
                path.shorten()
                path.step = max(path.step, shortest)
                continue
            found = _fallen(problem, here, found)
            reports.append(found.report)
            if not found.report.stable:
                break
            back = trace(
                problem_at, found, there, t, shortest=shortest / FINER, snap=False, most_factorizations=_MOST_BACK
            )
            reports += back.reports
            if back.t != t or farthest(here, back.found) > SAME * problem.length:
                snaps.append(Snap(t, there, farthest(here, found)))
            path.accept()
            path.step = 4 * shortest
        else:
            path.accept(easy=found.report.iterations <= EASY)
        here = found
    return Trace(path.t, here, tuple(snaps), tuple(reports))


def going_on(problem: Problem, last: Equilibrium) -> Problem:
    """The next problem on a path, with the source frames and the pattern of the equilibrium that it starts from."""
    elements = tuple(map(with_frames, problem.elements, last.elements))
    return replace(problem, elements=elements, pattern=last.problem.pattern)


def unaccounted(here: Equilibrium, there: Equilibrium) -> bool:
    """Whether the energies of two equilibria differ by other than the work done on the prescribed blocks between them,
    by the trapezoidal rule: see `_surplus`."""
    return abs(_surplus(here, there)) > UNACCOUNTED


def _surplus(here: Equilibrium, there: Equilibrium) -> float:
    """Energy gained beyond the work done on the prescribed blocks, over the larger energy; negative where it fell. Of
    equilibria of one structure under one load, the second with prescribed `Supports`."""
    supports = there.problem.constraint
    assert isinstance(supports, Supports)
    moved, before, after = supports.moved, here.energy, there.energy
    work = 0.5 * float(np.sum((here.gradient + there.gradient)[moved] * (there.state - here.state)[moved]))
    return (after - before - work) / max(abs(before), abs(after), TINY)


def farthest(here: Equilibrium, there: Equilibrium) -> float:
    """Largest distance of a node between two equilibria of one structure [m]."""
    nodes = np.unique(here.problem.stretch.blocks)
    return float(np.linalg.norm(there.state[nodes] - here.state[nodes], axis=1).max())


def _fallen(
    problem: Problem, here: Equilibrium, found: Equilibrium, *, most_factorizations: int | None = None
) -> Equilibrium:
    """The stable equilibrium down the energy, the supports being where the problem has them.

    By Newton's method with shifted Hessians, which takes a fifth of the work of the steepest descent and mostly leads
    to the same equilibrium; by the descent where that fails or gains energy, and factorisations are left for it.
    """
    supports, state, forces = problem.constraint, here.state, here.forces
    assert isinstance(supports, Supports)
    if found.mode is not None:
        state, forces = found.state + _DISTURBANCE * found.mode, found.forces
        problem = replace(problem, elements=found.elements)
    down = find_equilibrium(problem, state, forces, descend=True)
    if down.report.stable and _surplus(here, down) < UNACCOUNTED:
        return down
    state = state.copy()
    state[supports.moved] = supports.goals
    left = None if most_factorizations is None else most_factorizations - down.report.factorizations
    if left is not None and left <= 0:
        return down
    slid = relax(problem, state, most_factorizations=left)
    return replace(slid, report=slid.report.after(down.report))


FIRST = 6.0  # the first step leaves 1/36 of D in the matrix
GROWTH, SHRINKAGE = 3.0, 0.25
LONG, SHORT = 1e4, 1e-3  # steps that are long enough to have arrived; too short to be going anywhere
STILL = 1e-5  # motion: a long step that moves by less has arrived near enough for Newton's method
MOST_STEPS = 400


def relax(
    problem: Problem, state: Floats, *,
    most_factorizations: int | None = None, progress: Callable[[int, float], None] | None = None,
) -> Equilibrium:  # fmt: skip
    """The stable equilibrium that lies below a state; the last steps are those of `find_stable`.

    Args:
        state: (N, 3) to begin with [m, at twist angles rad].
        most_factorizations: no step down is taken after so many; None: as many as `MOST_STEPS` take.
        progress: called with the number and the length of each step; an OutOfTimeError that it raises ends the descent.

    Returns:
        Its report counts the descent's work too.
    """
    begin = time.perf_counter()
    edges = problem.stretch.with_forces(None)
    dead = () if problem.load is None else (PointLoads(np.arange(len(state)), problem.load),)
    motion = Motion((*problem.elements, edges), _pace(problem, state), problem.constraint, dead)
    stepper = ImplicitEuler(lambda blocks, free: SparseSum(blocks, free, problem.flat_coordinates))
    still, unit, length, factorizations, number = np.zeros_like(state), problem.unit(len(state)), FIRST, 0, 0
    for number in range(1, MOST_STEPS + 1):
        taken = stepper.take(motion, state, still, time=0.0, step=length)
        factorizations += taken.factorizations
        if isinstance(taken, Refused):
            length *= SHRINKAGE
            if length < SHORT:
                break
            continue
        moved = float(np.abs((taken.state - state) / unit).max())
        state = taken.state
        motion = motion.refreshed(state)
        try:
            if progress is not None:
                progress(number, moved)
        except OutOfTimeError:
            break  # the solve that follows ends at its first iteration, and says so
        if length > LONG and moved < STILL:
            break
        if most_factorizations is not None and factorizations >= most_factorizations:
            break
        length = min(GROWTH * length, GROWTH * LONG)
    forces = problem.stretch.stiffness * problem.stretch.strains(state)
    found = find_stable(replace(problem, elements=motion.elements[:-1]), state, forces, progress=progress)
    work = replace(found.report, iterations=number, factorizations=factorizations, seconds=time.perf_counter() - begin)
    return replace(found, report=found.report.after(replace(work, seconds=work.seconds - found.report.seconds)))


def _pace(problem: Problem, state: Floats) -> Floats:
    """(N, 3) D: the diagonal of the elements' Hessian, one value for each block."""
    diagonal = np.zeros(len(state))
    energies = Potential(problem.elements)
    for blocks, hessians in zip(energies.blocks, energies.hessians(state), strict=True):
        largest = np.abs(np.einsum("mii->mi", hessians)).reshape(*blocks.shape, 3).max(axis=2)
        np.add.at(diagonal, blocks, largest)
    square = problem.unit(len(state))[:, 0] ** 2
    least = 1e-6 * float((diagonal * square).max())
    return np.repeat(np.maximum(diagonal, least / square)[:, None], 3, axis=1)
