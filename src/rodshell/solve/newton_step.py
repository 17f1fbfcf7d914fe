"""One step of Newton's method with the axial forces as unknowns, and how far to go.

Near the end a factorisation also serves the next steps, which then cost one gradient and one solve (chord steps).

A step along which rods turn by an angle a leaves them strained by a^2/2, with forces that may buckle them. The next
factorisation shows it: where it counts several more negative modes than the last, the step was too long, and only a
part of it is taken. This is a trust region whose measure are the modes; the energy does not serve, since it jumps with
those strains.
"""

from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.geometry.frames import dot
from rodshell.rods.elements import twist_angles
from rodshell.solve.problem import Problem
from rodshell.solve.shifted_matrix import ShiftedMatrix
from rodshell.solve.tangent import TangentAssembly, generic

# A motion is measured by `Problem.unit`: shares of the length, or turns
TOLERANCE = 1e-13  # motion: estimate of the error that is left
_FORCE_TOLERANCE = 1e-9  # of the largest axial force: the same for the forces, of which round-off leaves as much
_LEAST_FORCE = 1e-6  # of EA: axial forces smaller than this are not known better
_CURVED = 20.0  # times the square of Newton's step is left after it: 6 to 23 measured on smooth targets
MULTIPLIERS = 5e-3  # of the last change is left in forces that are multipliers of a penalty: 2e-4 to 1e-3 measured
_LONGEST_STEP = 0.15  # motion
PART = 0.25  # of a step that was too long is taken
LONGER = 2.0  # growth of the longest step after one that was not
NEAR = 0.02  # motion: a step this short leads to the equilibrium at hand, be it a saddle,
NEARER = 0.5  # and at most so much of the last ones: past a limit point nothing is near, and steps do not shrink
_STALE = 1e-3  # of the largest axial force: by more they must not change after the negative modes are counted
_ELASTIC = 1 / 3  # of their last change: the next one of elastic forces after a step of Newton's, at most
AGAIN = 3.0  # times as much of the last change as that was of the one before: the next one after a chord step, at most
CHORD = 5e-3  # motion: after a Newton step this short the factorisation serves for the next one, too
SLOW = 0.1  # of the last step: a chord step that is longer is not made
_SIDEWAYS = 1e-6  # of a mode: it goes up and down by as much
TINY = 1e-300  # no step is shorter, except zero


@dataclass(frozen=True, eq=False)
class Step:
    """A step: from where, at how many negative modes; the whole motion (n, 3), `reach` far, with the change (e,) of the
    forces; and the share taken of both."""

    state: Floats
    forces: Floats
    problem: Problem
    negative_modes: int
    motion: Floats
    change: Floats
    reach: float
    share: float


@dataclass(frozen=True, eq=False, kw_only=True)
class _Iterate:
    """Where an iteration is, and what its steps so far say of the next one.

    Args:
        state, forces: (n, 3) [m, rad], and axial forces (e,) [N].
        problem: with its source frames at, or near, the state.
        strains: (e,) of the edges [-]; mismatch : how far the forces are from matching them [-].
        step, length: the last step, and how long it is; moved, changed : the last whole step and its change of the
            forces, both relative.
        longest: the longest step allowed; nearest : the last step that was near.
        shifted: the last step was one of the shifted Hessian.
        chord: the next step is by the factors at hand; was_chord : the last one was.
        settled: whether the error that is left is small enough.
    """

    state: Floats
    forces: Floats
    problem: Problem
    strains: Floats
    mismatch: float = np.inf
    step: Step | None = None
    length: float = np.inf
    moved: float = np.inf
    changed: float = np.inf
    longest: float = _LONGEST_STEP
    nearest: float = np.inf
    shifted: bool = False
    chord: bool = False
    was_chord: bool = False
    settled: bool = False
    iterations: int = 0

    @property
    def counts(self) -> bool:
        """Whether the next step is an iteration: chord steps in a row stand for one of Newton's."""
        return not (self.chord and self.was_chord)

    @property
    def finite(self) -> bool:
        return bool(np.isfinite(self.length) and np.isfinite(self.forces).all())

    def refreshed(self) -> "_Iterate":
        """The same with the source frames of the elements at the state."""
        return replace(self, problem=self.problem.refreshed(self.state))


class TooManyModesError(Exception):
    """The start of an iteration has too many negative modes for an equilibrium to be near."""


class NewtonStep:
    """Takes the steps of one iteration, with the matrix and the buffers that these share.

    Args:
        descend, limit_steps, most_modes: as of `find_equilibrium`.
    """

    def __init__(
        self,
        problem: Problem,
        state: Floats,
        *,
        descend: bool = False,
        limit_steps: bool = False,
        most_modes: int | None = None,
    ) -> None:
        self._problem, self._descend, self._limit_steps = problem, descend, limit_steps
        self._most_modes = most_modes
        self._unit = problem.unit(len(state))
        self.assembly = TangentAssembly(problem, state)
        free = problem.constraint.freedom(state)
        self.matrix = ShiftedMatrix(self.assembly.pattern, self._unit[:, 0].repeat(free.count))
        self._least_force = _LEAST_FORCE * float(problem.stretch.stiffness.max())
        self._no_forces = np.zeros(len(problem.stretch.blocks))
        self._factored, self._free = (state, self._no_forces), free  # where the matrix is from

    def start(self, state: Floats, forces: Floats) -> _Iterate:
        """Where the iteration begins: in a state (n, 3) with axial forces (e,) [N]."""
        strains = self._problem.stretch.strains(state)
        return _Iterate(state=state, forces=forces, problem=self._problem, strains=strains)

    def take(self, here: _Iterate) -> _Iterate:
        """The next iterate.

        Raises:
            SingularError: a pivot vanishes, and not by a mode without stiffness.
            TooManyModesError: the start has more negative modes than are allowed.
        """
        problem, stretch, state, forces = here.problem, here.problem.stretch, here.state, here.forces
        base = forces if problem.inextensible else self._no_forces
        if here.chord:  # what the edges lack acts along those of the matrix, else strains do not settle
            gradient = problem.gradient(state, forces)
            if self.assembly.curved:  # less the constraint's forces, which act across the free directions of this state
                gradient = problem.constraint.freedom(state).within(gradient)
            stretch.add_axial(self._factored[0], base + stretch.stiffness * here.strains - forces, gradient)
        else:
            self._factored, self._free = (state, forces), problem.constraint.freedom(state)
            gradient = self.assembly.linearise(problem, state, forces, multipliers=base)
        prescribed = problem.constraint.remaining(state)
        if prescribed is not None:
            gradient += self.assembly.product(prescribed)
        right = -self._free.reduce(gradient)
        direction, here = (self.matrix.solve(right), here) if here.chord else self._direction(here, right)
        if direction is None:
            return self._shortened(here)
        motion = self._free.expand(direction)
        if prescribed is not None:
            motion += prescribed
        reach = self._reach(motion)
        if here.chord and not reach <= SLOW * here.moved:  # of no use: Newton's step instead
            return self.take(replace(here, chord=False))
        share = min(1.0, here.longest / reach) if reach > 0 else 1.0
        change = base + stretch.stiffness * (here.strains + stretch.elongation(self._factored[0], motion)) - forces
        step = Step(state, forces, problem, self.matrix.negative_modes, motion, change, reach, share)
        return self._judged(here, step)

    def lowest_mode(self) -> Floats:
        """(n, 3) eigenvector of the most negative eigenvalue of the Hessian last evaluated, its largest motion 1; to
        the side on which it goes up on the whole, so that every run, size and heading of a structure has the same."""
        start = self._generic_motion()
        self.matrix.shift_until_definite(self._softest, start, down=True)
        mode = self._free.expand(self.matrix.lowest(start, sweeps=12)[0])
        return upwards(mode / self._unit) * self._unit / self._reach(mode)

    def _reach(self, motion: Floats) -> float:
        """Largest motion of a block (n, 3), over its unit."""
        shares = motion / self._unit
        return float(np.sqrt(dot(shares, shares).max()))

    @property
    def _softest(self) -> float:
        """How soft a wave as long as the shell is against the bending of an edge [J]."""
        hessians, blocks = self.assembly.hessians[0], self.assembly.blocks[0]
        bending, units = np.einsum("mii->mi", hessians), self._unit[blocks, 0].repeat(3, axis=1)
        slender = float(self._problem.stretch.rest_lengths.mean()) / self._problem.length
        return slender**4 * float((bending * units**2).mean())

    def _generic_motion(self) -> Floats:
        """(1, dofs) of `generic_motion` where the matrix is from."""
        state = self._factored[0]
        return self._free.reduce(generic_motion(state, twist_angles(self._problem.elements, len(state))))[None]

    def _direction(self, here: _Iterate, right: Floats) -> tuple[Floats | None, _Iterate]:
        """Newton's step; where the Hessian is indefinite and equilibrium is far, that of the shifted Hessian, but None
        where the step that led there was too long. And the iterate with what is known then."""
        matrix = self.matrix
        regular = matrix.factorise(self.assembly.assembled(self._free))
        if matrix.factorizations == 1 and self._most_modes is not None and matrix.negative_modes > self._most_modes:
            raise TooManyModesError
        if matrix.negative_modes and regular and not self._descend:
            step = matrix.solve(right)
            reach = self._reach(self._free.expand(step))
            before = min(here.nearest, np.inf if here.shifted else here.moved) if self._limit_steps else np.inf
            if reach < min(NEAR, NEARER * before):  # to the equilibrium at hand, be it a saddle
                return step, replace(here, nearest=reach, shifted=False)
        if self._limit_steps and _too_far(here.step, matrix.negative_modes):
            return None, here
        if matrix.negative_modes:
            shifted = True
            matrix.shift_until_definite(self._softest, self._generic_motion())
        else:
            shifted = False
        return matrix.solve(right), replace(here, longest=min(LONGER * here.longest, _LONGEST_STEP), shifted=shifted)

    def _after(self, step: Step) -> tuple[Floats, Floats]:
        """State and forces after a step."""
        state = self._problem.constraint.retract(step.state + step.share * step.motion)
        return state, step.forces + step.share * step.change

    def _shortened(self, here: _Iterate) -> _Iterate:
        """After a part of the last step in its place: no iteration of its own."""
        assert here.step is not None
        step = replace(here.step, share=PART * here.step.share)
        (state, forces), length = self._after(step), step.share * step.reach
        return replace(
            here, state=state, forces=forces, problem=step.problem, strains=self._problem.stretch.strains(state),
            mismatch=np.inf, step=step, length=length, longest=length,
        )  # fmt: skip

    def _judged(self, here: _Iterate, step: Step) -> _Iterate:
        """After a step: whether the error that is left is small enough, and whether the factors serve for another one.

        After Newton's step the error is about its square; after a chord step it shrinks as from the last step to this.
        The last factorisation is made where the forces are nearly those of the equilibrium: it counts its modes.
        """
        stretch, multipliers = self._problem.stretch, self._problem.inextensible
        state, forces = self._after(step)
        strains, moved = stretch.strains(state), step.reach
        left = strains if multipliers else strains - forces / stretch.stiffness
        size = max(float(np.abs(forces).max(initial=0.0)), self._least_force)
        changed, since = (
            float(np.abs(forces - old).max(initial=0.0)) / size for old in (here.forces, self._factored[1])
        )
        shrunk = moved / max(here.moved, TINY), changed / max(here.changed, TINY)
        rates = shrunk if here.chord else (max(_CURVED * moved, changed), MULTIPLIERS if multipliers else changed)
        settled = moved * rates[0] < TOLERANCE and changed * rates[1] < _FORCE_TOLERANCE and since < _STALE
        foreseen = AGAIN * shrunk[1] if here.chord else MULTIPLIERS if multipliers else _ELASTIC
        count_again = since >= _STALE > foreseen * changed
        return replace(
            here, state=state, forces=forces, strains=strains, mismatch=float(np.abs(left).max()),
            step=step, length=moved, moved=moved, changed=changed, settled=settled, was_chord=here.chord,
            chord=moved < CHORD and not count_again and not self.matrix.negative_modes,
            iterations=here.iterations + here.counts,
        )  # fmt: skip


def _too_far(last: Step | None, negative_modes: int) -> bool:
    """Whether a step was not short and led to more negative modes than it began with: by several, which are rods that
    buckle; one more is a saddle on the way."""
    return last is not None and negative_modes > last.negative_modes + 1 and last.share * last.reach > NEAR


def generic_motion(state: Floats, twists: Bools) -> Floats:
    """(n, 3) a motion to begin an iteration with, of which all modes are a part, in axes that turn with the structure:
    which of several equal modes is found, and how nearly, is the same at every heading.

    Args:
        state: (n, 3) nodes [m] and twist angles [rad]; twists : (n,) which of its blocks are angles.
    """
    numbers, nodes = generic(state.size, 1).reshape(-1, 3), state[~twists]
    x, y, _ = generic(len(nodes), 1)[0] @ (nodes - nodes.mean(axis=0))
    x, y = (x, y) if np.hypot(x, y) > _SIDEWAYS * np.ptp(nodes[:, 2]) else (1.0, 0.0)  # upright: any
    axes = np.array([(x, y, 0.0), (-y, x, 0.0), (0.0, 0.0, np.hypot(x, y))]) / np.hypot(x, y)
    return np.where(twists[:, None], numbers, numbers @ axes)


def upwards(mode: Floats) -> Floats:
    """A mode (n, 3) in its units, or its opposite: that which goes up on the whole, or first, where it goes up and
    down by as much; along x or y where it does not go up."""
    size = np.abs(mode).max(axis=0)
    along = mode[:, 2 if size[2] > _SIDEWAYS * size.max() else int(np.argmax(size))]
    whole = float(along.sum())
    if abs(whole) <= _SIDEWAYS * float(np.abs(along).sum()):
        whole = float(along[np.argmax(np.abs(along) > 0.5 * np.abs(along).max())])
    return np.asarray(np.copysign(1.0, whole) * mode)
