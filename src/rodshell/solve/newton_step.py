"""One step of Newton's method with the axial forces as unknowns, and how far to go.

Near the end a factorisation also serves the next steps, which then cost one gradient and one solve (chord steps).

A step along which rods turn by an angle a leaves them strained by a^2/2, with forces that may buckle them. The next
factorisation shows it: where it counts several more negative modes than the last, the step was too long, and only a
part of it is taken. This is a trust region whose measure are the modes; the energy does not serve, since it jumps with
those strains.
"""

from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Floats
from rodshell.geometry.frames import dot
from rodshell.kernels import njit
from rodshell.rods.elements import NO_HESSIANS, Elements, evaluate_all
from rodshell.solve.problem import NO_CURVATURE, Problem
from rodshell.solve.sparse_ldl import Factors, SingularError
from rodshell.solve.tangent import generic, subspace_iteration

# A motion is measured by `Problem.unit`: shares of the length, or turns
TOLERANCE = 1e-13  # motion: estimate of the error that is left
FORCE_TOLERANCE = 1e-9  # of the largest axial force: the same for the forces, of which round-off leaves as much
LEAST_FORCE = 1e-6  # of EA: axial forces smaller than this are not known better
CURVED = 20.0  # times the square of Newton's step is left after it: 6 to 23 measured on smooth targets
MULTIPLIERS = 5e-3  # of the last change is left in forces that are multipliers of a penalty: 2e-4 to 1e-3 measured
LONGEST_STEP = 0.15  # motion
PART = 0.25  # of a step that was too long is taken
LONGER = 2.0  # growth of the longest step after one that was not
NEAR = 0.02  # motion: a step this short leads to the equilibrium at hand, be it a saddle,
NEARER = 0.5  # and at most so much of the last ones: past a limit point nothing is near, and steps do not shrink
STALE = 1e-3  # of the largest axial force: by more they must not change after the negative modes are counted
ELASTIC = 1 / 3  # of their last change: the next one of elastic forces after a step of Newton's, at most
AGAIN = 3.0  # times as much of the last change as that was of the one before: the next one after a chord step, at most
CHORD = 5e-3  # motion: after a Newton step this short the factorisation serves for the next one, too
SLOW = 0.1  # of the last step: a chord step that is longer is not made
SHIFT_GROWTH = 8.0
LEAST_SHIFT = 1e-3  # of the first shift that is tried for several: smaller eigenvalues may be round-off
SIDEWAYS = 1e-6  # of a mode: it goes up and down by as much
TINY = 1e-300  # no step is shorter, except zero


@dataclass(frozen=True, eq=False)
class _LastStep:
    """The last step, so that less of it can be taken: from where, at how many negative modes; the whole motion (n, 3),
    `reach` far, with the change (e,) of the forces; and the share taken of both."""

    state: Floats
    forces: Floats
    elements: tuple[Elements, ...]
    negative_modes: int
    motion: Floats
    change: Floats
    reach: float
    share: float


class TooManyModesError(Exception):
    """The start of an iteration has too many negative modes for an equilibrium to be near."""


class NewtonStep:
    """One iteration, with the buffers, the pattern and the factorisation that all iterations share."""

    def __init__(
        self, problem: Problem, state: Floats, *, limit_steps: bool = False, most_modes: int | None = None
    ) -> None:
        self._problem, self._limit_steps, self._most_modes = problem, limit_steps, most_modes
        self.elements = problem.elements
        self._free = problem.constraint.freedom(state)
        self._unit = problem.unit(len(state))
        self._units = self._unit[:, 0].repeat(self._free.count)  # of the unknowns
        self._blocks = problem.blocks(len(state))
        self.pattern = problem.pattern_at(state)
        self._assembly, self._solver = self.pattern.assembly, self.pattern.solver
        self._factors: Factors | None = None  # their memory serves for all factorisations of this iteration
        *sets, _ = self._blocks
        self._hessians = [np.empty((len(b), 3 * b.shape[1], 3 * b.shape[1])) for b in sets]
        self._curvature, self._curved = NO_CURVATURE, True  # until the constraint says that it is not
        self._no_forces = np.zeros(len(problem.stretch.blocks))
        self._least_force = LEAST_FORCE * float(problem.stretch.stiffness.max())
        self._strained = state, problem.stretch.strains(state)
        self.dofs = self._free.size
        self.iterations = 0
        self.factorizations = 0
        self.negative_modes = 0
        self._shift = 0.0
        self._longest = LONGEST_STEP
        self._nearest = np.inf  # the last step that was near
        self._shifted = False  # the last step was one of the shifted Hessian
        self._last_step: _LastStep | None = None
        self._factored = state, self._no_forces  # where the matrix is from
        self._last = np.inf, np.inf  # length of the last step and change of the forces, both relative
        self._chord = self._was_chord = self.settled = False

    @property
    def counts(self) -> bool:
        """Whether the next step is an iteration: chord steps in a row stand for one of Newton's."""
        return not (self._chord and self._was_chord)

    def refresh(self, state: Floats) -> None:
        """Carry the source frames of the elements to `state` (n, 3)."""
        self.elements = tuple(element.refreshed(state) for element in self.elements)

    def gradient(self, state: Floats, forces: Floats) -> Floats:
        """Gradient of energy and load.

        Parameters
        ----------
        state : (n, 3) [m, rad].
        forces : (e,) axial forces that the edges carry [N].
        """
        gradient = np.zeros_like(state) if self._problem.load is None else -self._problem.load
        for element in self.elements:
            element.evaluate(state, gradient)
        self._problem.stretch.add_axial(state, forces, gradient)
        return gradient

    def take(self, state: Floats, forces: Floats, descend: bool) -> tuple[float, Floats, Floats, float]:
        """One step.

        Parameters
        ----------
        state : (n, 3) [m, rad].
        forces : (e,) axial forces [N].
        descend : shift the Hessian wherever it is indefinite.

        Returns
        -------
        Length of the step (`Problem.unit`), the next state and forces, and how far these are from matching the strains
        [-].

        Raises
        ------
        SingularError : a pivot vanishes, and not by a mode without stiffness.
        TooManyModesError : the start has more negative modes than are allowed.
        """
        problem, stretch = self._problem, self._problem.stretch
        if not self._chord:
            self._factored, self._free = (state, forces), problem.constraint.freedom(state)
        at, free, strains = self._factored[0], self._free, self.strains(state)
        base = forces if problem.inextensible else self._no_forces
        gradient = np.zeros_like(state) if problem.load is None else -problem.load
        hessians = [NO_HESSIANS] * len(self.elements) if self._chord else self._hessians[:-1]
        evaluate_all(self.elements, state, gradient, hessians)
        if self._chord:  # what the edges lack acts along those of the matrix, else strains do not settle
            stretch.add_axial(state, forces, gradient)
            if self._curved:  # less the forces of the constraint, which act across the free directions of this state
                gradient = problem.constraint.freedom(state).within(gradient)
            stretch.add_axial(at, base + stretch.stiffness * strains - forces, gradient)
        else:
            if self._curved:
                by_force = gradient.copy()
                stretch.add_axial(state, forces, by_force)
                self._curvature = problem.constraint.curvature(state, by_force)
                self._curved = len(self._curvature) > 0
            axial = stretch.with_forces(forces, multipliers=base)
            evaluate_all((axial,), state, gradient, self._hessians[-1:])
        prescribed = problem.constraint.remaining(state)
        if prescribed is not None:
            gradient += self._times(prescribed)
        direction = self._direction(-free.reduce(gradient), descend)
        if direction is None:
            return self._shorten()
        motion = free.expand(direction)
        if prescribed is not None:
            motion += prescribed
        reach = self._reach(motion)
        if self._chord and not reach <= SLOW * self._last[0]:  # of no use: Newton's step instead
            self._chord = False
            return self.take(state, forces, descend)
        share = min(1.0, self._longest / reach) if reach > 0 else 1.0
        change = base + stretch.stiffness * (strains + stretch.elongation(at, motion)) - forces
        last = _LastStep(state, forces, self.elements, self.negative_modes, motion, change, reach, share)
        state_next, forces_next = self._after(last)
        left = self.strains(state_next)
        if not problem.inextensible:
            left = left - forces_next / stretch.stiffness
        self._judge(reach, forces, forces_next)
        return reach, state_next, forces_next, float(np.abs(left).max())

    def strains(self, state: Floats) -> Floats:
        """(e,) strains of the edges at a state (n, 3), the latest of which is remembered."""
        if state is not self._strained[0]:
            self._strained = state, self._problem.stretch.strains(state)
        return self._strained[1]

    def _reach(self, motion: Floats) -> float:
        """Largest motion of a block (n, 3), over its unit."""
        shares = motion / self._unit
        return float(np.sqrt(dot(shares, shares).max()))

    def _after(self, last: _LastStep) -> tuple[Floats, Floats]:
        """State and forces after a step."""
        self._last_step = last
        state = self._problem.constraint.retract(last.state + last.share * last.motion)
        return state, last.forces + last.share * last.change

    def _shorten(self) -> tuple[float, Floats, Floats, float]:
        """As `take`, for a part of the last step in its place: no iteration of its own."""
        assert self._last_step is not None
        last = replace(self._last_step, share=PART * self._last_step.share)
        self._longest = moved = last.share * last.reach
        self.elements = last.elements
        return moved, *self._after(last), np.inf

    def _near(self, moved: float) -> bool:
        """Whether a step of Newton's so long leads to the equilibrium at hand, be it a saddle."""
        before = min(self._nearest, np.inf if self._shifted else self._last[0]) if self._limit_steps else np.inf
        near = moved < min(NEAR, NEARER * before)
        if near:
            self._nearest = moved
        return near

    def _too_far(self) -> bool:
        """Whether the last step was not short and led to more negative modes than it began with: by several, which are
        rods that buckle; one more is a saddle on the way."""
        last = self._last_step
        if last is None or not self._limit_steps or self.negative_modes <= last.negative_modes + 1:
            return False
        return last.share * last.reach > NEAR

    def _judge(self, moved: float, before: Floats, after: Floats) -> None:
        """Whether the error that is left is small enough, and whether the factorisation serves for another step.

        After Newton's step the error is about its square; after a chord step it shrinks as from the last step to this.
        The last factorisation is made where the forces are nearly those of the equilibrium: it counts its modes.
        """
        self.iterations += self.counts
        size = max(float(np.abs(after).max(initial=0.0)), self._least_force)
        changed, since = (float(np.abs(after - old).max(initial=0.0)) / size for old in (before, self._factored[1]))
        shrunk = moved / max(self._last[0], TINY), changed / max(self._last[1], TINY)
        multipliers = self._problem.inextensible
        rates = shrunk if self._chord else (max(CURVED * moved, changed), MULTIPLIERS if multipliers else changed)
        self.settled = moved * rates[0] < TOLERANCE and changed * rates[1] < FORCE_TOLERANCE and since < STALE
        foreseen = AGAIN * shrunk[1] if self._chord else MULTIPLIERS if multipliers else ELASTIC
        count_again = since >= STALE > foreseen * changed
        self._was_chord, self._last = self._chord, (moved, changed)
        self._chord = moved < CHORD and not count_again and not self.negative_modes

    def _times(self, motion: Floats) -> Floats:
        """(n, 3) product of the Hessian last evaluated with displacements (n, 3)."""
        result = np.zeros_like(motion)
        for hessians, blocks in zip(self._hessians, self._blocks[:-1], strict=True):
            _add_product(hessians, blocks, motion, result)
        return result

    def lowest_mode(self) -> Floats:
        """(n, 3) eigenvector of the most negative eigenvalue of the Hessian last evaluated, its largest motion 1; to
        the side on which it goes up on the whole, so that every run, size and heading of a structure has the same."""
        self._shift_until_definite(down=True)
        mode = self._free.expand(self._inverse_iteration(12)[0])
        return upwards(mode / self._unit) * self._unit / self._reach(mode)

    def _direction(self, right: Floats, descend: bool) -> Floats | None:
        """Newton's step; where the Hessian is indefinite and equilibrium is far, that of the shifted Hessian, but None
        where the step that led there was too long."""
        if self._chord:
            return self._solve(right)
        self._data = self._assembly.assemble([*self._hessians, self._curvature], self._blocks, self._free)
        regular = self._count_negative_modes()
        if self.factorizations == 1 and self._most_modes is not None and self.negative_modes > self._most_modes:
            raise TooManyModesError
        if self.negative_modes and regular and not descend:
            step = self._solve(right)
            if self._near(self._reach(self._free.expand(step))):
                self._shifted = False
                return step
        if self._too_far():
            return None
        self._longest = min(LONGER * self._longest, LONGEST_STEP)
        self._shifted = self.negative_modes > 0
        if self.negative_modes:
            self._shift_until_definite()
        return self._solve(right)

    def _count_negative_modes(self) -> bool:
        """Factorise the Hessian; whether that can be done. A mode without stiffness counts as a negative one."""
        self.factorizations += 1
        try:
            self.negative_modes = self._factor(self._data)
        except SingularError:
            if not np.isfinite(self._data).all():
                raise
            self.negative_modes = 1
            return False
        return True

    def _shift_until_definite(self, *, down: bool = False) -> None:
        """Factorise with the diagonal shifted by about twice the most negative eigenvalue, motions in their units.

        A Newton step then doubles what the state has of its mode. The search begins where a wave as long as the
        shell is soft against the bending of an edge, or below the last shift that sufficed, and goes up; first `down`,
        next to a saddle, whose mode may be much softer.
        """
        bending, units = np.einsum("mii->mi", self._hessians[0]), self._unit[self._blocks[0], 0].repeat(3, axis=1)
        slender = float(self._problem.stretch.rest_lengths.mean()) / self._problem.length
        softest = slender**4 * float((bending * units**2).mean())
        shift, tries = max(softest, self._shift / SHIFT_GROWTH), 0
        negative = self._factor_shifted(shift)
        while down and not negative and shift > LEAST_SHIFT * softest:
            shift /= SHIFT_GROWTH
            negative = self._factor_shifted(shift)
        while negative and tries < 40:
            shift, tries = SHIFT_GROWTH * shift, tries + 1
            negative = self._factor_shifted(shift)
        less = 2.0 * (shift - self._inverse_iteration(4)[1])  # of an eigenvalue that may be too high
        if 0.0 < less < 0.5 * shift:
            if self._factor_shifted(less):
                self._factor_shifted(shift)
            else:
                shift = less
        self._shift = shift

    def _factor_shifted(self, shift: float) -> int:
        shifted = self._data.copy()
        shifted[self._assembly.diagonal] += shift / self._units**2
        self.factorizations += 1
        return self._factor(shifted)

    def _factor(self, data: Floats) -> int:
        """Factorise; the number of negative modes."""
        self._factors = self._solver.factor(data, reuse=self._factors)
        return self._factors.negative

    def _solve(self, right: Floats) -> Floats:
        """By the last factors."""
        assert self._factors is not None
        return self._factors.solve(right)

    def _inverse_iteration(self, sweeps: int) -> tuple[Floats, float]:
        """Eigenvector (dofs,) of the smallest eigenvalue of the matrix last factorised, and that eigenvalue [J]."""
        start, units = generic(self._free.size, 1), self._units
        values, (row, *_), _ = subspace_iteration(
            lambda rows: self._solve(rows / units) / units, start, settled=1, tolerance=0.0, most_sweeps=sweeps
        )
        return row * units, 1.0 / float(values[0])


def upwards(mode: Floats) -> Floats:
    """A mode (n, 3) in its units, or its opposite: that which goes up on the whole, or first, where it goes up and
    down by as much; along x or y where it does not go up."""
    size = np.abs(mode).max(axis=0)
    along = mode[:, 2 if size[2] > SIDEWAYS * size.max() else int(np.argmax(size))]
    whole = float(along.sum())
    if abs(whole) <= SIDEWAYS * float(np.abs(along).sum()):
        whole = float(along[np.argmax(np.abs(along) > 0.5 * np.abs(along).max())])
    return np.asarray(np.copysign(1.0, whole) * mode)


@njit()
def _add_product(hessians, blocks, motion, result):  # type: ignore[no-untyped-def]
    """Add to `result` (n, 3) what elements with `hessians` (m, 3k, 3k) on `blocks` (m, k) make of displacements."""
    for m in range(blocks.shape[0]):
        for a in range(blocks.shape[1]):
            for b in range(blocks.shape[1]):
                i, j = blocks[m, a], blocks[m, b]
                for k in range(3):
                    for d in range(3):
                        result[i, k] += hessians[m, 3 * a + k, 3 * b + d] * motion[j, d]
