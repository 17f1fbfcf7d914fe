"""Points on the path of equilibria under a load that grows, each found from the last one by its arc length.

The arc length s is the root mean square displacement of the nodes, and of the factor as much as serves where nothing
moves. Each point lies on a plane across the last tangent [Riks 1979; Crisfield 1991, section 9.3]. The unknowns are
state, axial forces and factor; the bordered system

    K dx - W dt = -g,   c.dx = 0

is solved by two right-hand sides of one factorisation of K [Keller 1977], which is symmetric and whose pivots count
its negative eigenvalues. The tangent is dx/ds = v/|v|, dt/ds = 1/|v| with v = dx/dt: on a stable path t grows, and it
turns back at a limit point, where K is singular but the bordered system is not.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from math import sqrt

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.rods.elements import twist_angles
from rodshell.solve.equilibrium import Equilibrium, SolveReport, Status
from rodshell.solve.load import Load, LoadedAssembly
from rodshell.solve.problem import Problem
from rodshell.solve.sparse_ldl import SingularError
from rodshell.solve.tangent import Tangent, generic, negative_mode, orthonormal, subspace_iteration

MODES = 4  # lowest ones that are looked at
_MODES_CLOSE, MOST_SWEEPS = 1e-2, 12  # relative error of the lowest eigenvalue: modes only say how far to go
_RAMPS = 1, 4, 16  # equal parts of a displacement, until one of them succeeds
_LOSING_CLOSE = 1e-5  # relative error of the eigenvalue of the mode that gives way
MOST_STEPS = 12  # of Newton's method for a point
STRAYED = 0.3  # of a step: a point so far off its prediction may be on another path. Half of it is aimed at
NEGLIGIBLE = 1e-6  # of the length: a path no farther off than this is the same
SETTLED, _SETTLED_FORCE = 1e-10, 1e-8  # of the length and of the largest axial force: last change of a point
CHORD, SLOW = 5e-3, 0.2  # as in `newton_step`
FINE = 1e-3  # of how far a point may stray: steps that small, and no longer smaller, are round-off next to a singular K
_SAME_STIFFNESS = 1e-5, 1e-4  # of length and force: factors from this near are those of the point
PROBE, _PROBE_FACTOR = 1e-5, 0.1  # of the length; at most, of the factor: over which the stiffness's change is taken
_PER_FACTOR = 1e-8  # of the length: what a unit of the factor counts as, so that a load may grow where nothing moves
TINY = 1e-300


@dataclass(frozen=True, eq=False)
class Point:
    """An equilibrium on the path, at `arc` [m].

    Args:
        problem: what acts there, its source frames at the state.
        motion (n, 3), change (e,), rate: derivatives by the arc of state, forces and factor.
        strayed: how far it lies off its prediction, over the step.
        ahead, behind: arc to the nearest singular stiffness on either side, as the stiffness of the `modes` changes
            here.
    """

    factor: float
    arc: float
    state: Floats
    forces: Floats
    problem: Problem
    negative_modes: int
    motion: Floats
    change: Floats
    rate: float
    strayed: float = 0.0
    modes: Floats | None = None
    ahead: float = np.inf
    behind: float = -np.inf

    def onwards(self, step: float) -> tuple[Floats, Floats, float]:
        """State, forces and factor a step along the tangent, or back."""
        return self.state + step * self.motion, self.forces + step * self.change, self.factor + step * self.rate


class ArcLength:
    """Finds points on the path of a structure under t times a load.

    Args:
        unloaded: the equilibrium at t = 0, its edges elastic.
    """

    def __init__(self, unloaded: Equilibrium, load: Load) -> None:
        self._unloaded = unloaded
        self._loaded = LoadedAssembly(unloaded.problem, load, unloaded.state)
        problem = self._loaded.problem
        self.length = problem.length
        self.is_node = np.isin(np.arange(len(unloaded.state)), problem.stretch.blocks)
        edge = float(problem.stretch.rest_lengths.mean()) if len(problem.stretch.blocks) else self.length
        angles = twist_angles(problem.elements, len(unloaded.state))
        self._unit = np.where(angles, edge, 1.0)[:, None]  # angles count as small lengths
        self._weight = self._unit**2 / max(1, int(self.is_node.sum()))
        self._per_factor = _PER_FACTOR * self.length
        self._scale = np.empty(0)
        self.round_off = 0.0  # relative error of the lowest stiffness at t = 0, since the stiffest is rounded
        self._least_force = 1e-6 * float(problem.stretch.stiffness.max(initial=0.0))
        self._unstable: tuple[Floats, Tangent]  # the last one that was found, with its tangent
        self.factorizations = 0

    def begin(self) -> Point | None:
        """The structure at t = 0; None where its stiffness is singular.

        Raises:
            InputError: the load moves nothing.
        """
        start, problem = self._unloaded, self._loaded.problem
        try:
            tangent, rate = self._tangent(problem, start.state, start.forces)
        except SingularError:
            return None
        if not (rate.any() or self._loaded.change(problem, start.state, rate).any()):
            raise InputError("the load moves nothing: give one that acts in free directions")
        # modes are measured by the first stiffness's diagonal: metres and radians alike
        self._scale = 1.0 / np.sqrt(np.abs(tangent.values[tangent.pattern.assembly.diagonal]))
        here = self._on_path(0.0, start.state, start.forces, problem, tangent, rate)
        if here.modes is not None:
            self.round_off = self._round_off(tangent, here.modes[0])
        return here

    def _round_off(self, tangent: Tangent, lowest: Floats) -> float:
        """See `round_off`, of the lowest mode (dofs,)."""
        stretch, moved = self._loaded.problem.stretch, tangent.freedom.expand(lowest)
        softest = lowest @ tangent.pattern.solver.product(tangent.values, lowest) / np.square(self._unit * moved).sum()
        stiffest = 2 * (stretch.stiffness / stretch.rest_lengths).max(initial=0.0)  # a node between two edges
        return float(np.finfo(float).eps * stiffest / softest)

    def point(self, here: Point, other: Point | None, step: float, *, near: float = NEGLIGIBLE) -> Point | None:
        """The point a step further; None where Newton's method does not find it, or strays from the prediction.

        Args:
            other: a point that shows the curvature of the path, or None.
            step: arc [m].
            near: of the length: how far it may stray in any case. The tangent foresees no jump of the stiffness.
        """
        state, forces, factor = here.onwards(step)
        if other is not None:
            half = 0.5 * step**2 / (other.arc - here.arc)
            state, forces = state + half * (other.motion - here.motion), forces + half * (other.change - here.change)
            if self._loaded.load.motions is not None:  # supports move as the factor says
                factor += half * (other.rate - here.rate)
        reach = max(self.reach(state - here.state), near * self.length / STRAYED)
        found = self._correct(state, forces, factor, here.problem, across=here, near=STRAYED * reach)
        if found is None:
            return None
        point = self._on_path(*found, here, step)
        return replace(point, strayed=self.reach(point.state - state) / reach)

    def unstable_next(self, here: Point, step: float) -> Point | None:
        """What lies a step [m] along the tangent, so short that its end is as good as the equilibrium, if the stiffness
        is unstable there, as it is where it has jumped; None where it is stable, or singular."""
        state, forces, factor = here.onwards(step)
        problem = self._loaded.at(here.problem, state, factor)
        try:
            tangent, _ = self._tangent(problem, state, forces)
        except SingularError:
            return None
        if not tangent.negative_modes:
            return None
        self._unstable = state, tangent
        return replace(
            here, factor=factor, arc=here.arc + step, state=state, forces=forces, problem=problem, rate=-here.rate,
            negative_modes=tangent.negative_modes, modes=None, ahead=np.inf, behind=-np.inf,
        )  # fmt: skip

    def at_factor(self, factor: float, here: Point, there: Point) -> Point | None:
        """The point at a factor between those of two neighbours on a stable path; None where it is not found."""
        span = there.arc - here.arc
        share = (factor - here.factor) / (there.factor - here.factor)
        bend = 0.5 * share * (share - 1) * span
        state = (1 - share) * here.state + share * there.state + bend * (there.motion - here.motion)
        forces = (1 - share) * here.forces + share * there.forces + bend * (there.change - here.change)
        near = STRAYED * self.reach(there.state - here.state)
        found = self._correct(state, forces, factor, here.problem, near=near)
        return None if found is None else self._on_path(*found, here, share * span, ahead=False)

    def displaced(self, motion: Floats) -> Point | None:
        """The point whose state lies on the plane across a motion (n, 3) from the state at t = 0 [m, rad] through its
        end, near factor 1."""
        for parts in _RAMPS:
            point = self._displaced_by_parts(motion, parts)
            if point is not None:
                return point
        return None

    def _displaced_by_parts(self, motion: Floats, parts: int) -> Point | None:
        """As `displaced`, in so many equal parts."""
        start, stretch, part = self._unloaded, self._loaded.problem.stretch, motion / parts
        point: Point | None = None
        state, forces, problem, factor = start.state, start.forces, start.problem, 0.0
        for _ in range(parts):
            forces = forces + stretch.stiffness * stretch.elongation(state, part)
            found = self._correct(state + part, forces, factor + 1 / parts, problem, across=motion)
            if found is None:
                return None
            point = self._on_path(*found, ahead=False)
            state, forces, problem, factor = point.state, point.forces, point.problem, point.factor
        return point

    def _correct(
        self, state: Floats, forces: Floats, factor: float, problem: Problem, *,
        across: Point | Floats | None = None, near: float = np.inf,
    ) -> tuple[float, Floats, Floats, Problem, Tangent, Floats] | None:  # fmt: skip
        """Newton's method to the equilibrium at this factor, or on the plane through the state `across` a motion.

        Args:
            state, forces, factor: to begin with, what is held being where it is under the factor.
            problem: what acts, its source frames near the state.
            across: normal of the plane, (n, 3), or the tangent at a point, factor and all; None: the factor stays.
            near: the farthest that a node may move [m].

        Returns:
            Factor, state, forces and what acts at the equilibrium; next to it the tangent and the rate of the state;
            None where it is not found.
        """
        loaded, stretch, length, first = self._loaded, self._loaded.problem.stretch, self.length, state
        last, chord, begin = np.inf, False, factor
        normal, rise = (across.motion, across.rate) if isinstance(across, Point) else (across, 0.0)
        rise *= self._per_factor**2
        problem = loaded.at(problem, state, factor)
        try:
            for _ in range(MOST_STEPS):
                if not chord:
                    tangent, along = self._tangent(problem, state, forces)
                    at, axial, taken = state, forces, problem
                strains, gradient = problem.stretch.strains(state), problem.gradient(state, forces)
                stretch.add_axial(at, stretch.stiffness * strains - forces, gradient)
                motion, more = tangent.solve(-gradient), 0.0
                if normal is not None:
                    off = self.inner(normal, first - state - motion) + rise * (begin - factor)
                    more = off / (self.inner(normal, along) + rise)
                    motion = motion + more * along
                moved = self.reach(motion) / length
                if not self.reach(state + motion - first) <= near:
                    return None
                stalled = chord and moved > SLOW * last
                at_round_off = stalled and max(moved, last) * length < FINE * near < np.inf
                if stalled and not at_round_off:
                    chord = False
                    continue
                after = stretch.stiffness * strains + loaded.change(taken, at, motion, more)
                size = max(float(np.abs(after).max(initial=0.0)), self._least_force)
                changed = float(np.abs(after - forces).max(initial=0.0)) / size
                state, forces, factor = state + motion, after, factor + more
                problem = loaded.at(problem, state, factor)
                last, chord = moved, moved < CHORD
                if (moved < SETTLED or at_round_off) and changed < _SETTLED_FORCE:
                    since = self.reach(state - at) / length, float(np.abs(forces - axial).max()) / size
                    if since[0] > _SAME_STIFFNESS[0] or since[1] > _SAME_STIFFNESS[1]:
                        tangent, along = self._tangent(problem, state, forces)
                    return factor, state, forces, problem, tangent, along
        except SingularError:
            pass
        return None

    def equilibrium(self, point: Point) -> Equilibrium:
        """A point as an equilibrium of the structure under its factor."""
        problem, state = point.problem, point.state
        gradient = problem.gradient(state, point.forces)
        residual = problem.constraint.freedom(state).reduce(gradient)
        report = SolveReport(
            Status.CONVERGED, len(residual), 0, 0, 0.0, float(np.abs(residual).max(initial=0.0)),
            float(np.abs(problem.stretch.strains(state)).max(initial=0.0)), point.negative_modes,
        )  # fmt: skip
        return Equilibrium(problem, state, point.forces, gradient, report)

    def losing_mode(self, point: Point) -> Floats:
        """(n, 3) the mode of the negative stiffness that is nearest to zero at an unstable point, its largest
        displacement of a node being 1.
        """
        state, tangent = self._unstable
        if state is not point.state:
            tangent, _ = self._tangent(point.problem, point.state, point.forces)
        size, scale = tangent.freedom.size, self._scale

        def inverse(rows: Floats) -> Floats:
            return tangent.factors.solve(rows / scale) / scale

        start = generic(size, MODES) if point.modes is None else point.modes / scale
        mode = tangent.freedom.expand(negative_mode(inverse, start, tolerance=_LOSING_CLOSE) * scale)
        return np.asarray(mode / self.reach(mode))

    def alignment(self, a: Floats, b: Floats) -> float:
        """Cosine of the angle between motions (n, 3), in the metric of the modes."""
        free = self._unloaded.problem.constraint.freedom(self._unloaded.state)
        x, y = (free.reduce(motion) / self._scale for motion in (a, b))
        (xx, xy), (_, yy) = _products([x, y], np.array([x, y])).tolist()
        return float(abs(xy) / sqrt(max(xx * yy, TINY)))

    def reach(self, motion: Floats) -> float:
        """Largest displacement of a node, or of a twist times an edge [m]; motion (n, 3) [m, rad]."""
        return float(np.abs(self._unit * motion).max())

    def inner(self, a: Floats, b: Floats) -> float:
        """Inner product of displacements (n, 3) over the number of nodes, measured as by `reach` [m2]."""
        return float(np.einsum("ij,ij->", self._weight * a, b))

    def _tangent(self, problem: Problem, state: Floats, forces: Floats) -> tuple[Tangent, Floats]:
        self.factorizations += 1
        return self._loaded.tangent(problem, state, forces)

    def _on_path(
        self, factor: float, state: Floats, forces: Floats, problem: Problem, tangent: Tangent,
        along: Floats, last: Point | None = None, step: float = 0.0, *, ahead: bool = True,
    ) -> Point:  # fmt: skip
        """The point at a state with its tangent, a step after the last point."""
        rate = 1.0 / sqrt(self.inner(along, along) + self._per_factor**2)
        if last is not None and self.inner(along, last.motion) + self._per_factor**2 * last.rate < 0:
            rate = -rate
        motion = rate * along
        change = self._loaded.change(problem, state, motion, rate)
        arc, modes = (0.0, None) if last is None else (last.arc + step, last.modes)
        point = Point(factor, arc, state, forces, problem, tangent.negative_modes, motion, change, rate, modes=modes)
        if tangent.negative_modes:
            self._unstable = state, tangent
        return point if tangent.negative_modes or not ahead else self._looking_ahead(point, tangent, modes)

    def _looking_ahead(self, here: Point, tangent: Tangent, start: Floats | None) -> Point:
        """With its modes and the nearest singular stiffness, as the stiffness of the lowest modes changes here."""
        values, modes = self._lowest_modes(tangent, start)
        step = min(PROBE * self.length / max(self.reach(here.motion), TINY), _PROBE_FACTOR / abs(here.rate))
        # the difference of both sides: that of one has a stiffness of its own, EA times the square of the step, which
        # outweighs the modes of thin rods
        change = (self._values_near(here, step) - self._values_near(here, -step)) / (2 * step)
        between = _products(modes, np.array([tangent.pattern.solver.product(change, mode) for mode in modes]))
        root = 1.0 / np.sqrt(values)
        loss = np.linalg.eigvalsh(-between * root[:, None] * root)  # 1/m: the modes' stiffness vanishes at 1/loss
        return replace(
            here, modes=modes,
            ahead=1.0 / float(loss[-1]) if loss[-1] > 0 else np.inf,
            behind=1.0 / float(loss[0]) if loss[0] < 0 else -np.inf,
        )  # fmt: skip

    def _values_near(self, here: Point, step: float) -> Floats:
        """(nnz,) values of the stiffness a step along the tangent from a point, or back, to first order."""
        state, forces, factor = here.onwards(step)
        return self._loaded.values(self._loaded.at(here.problem, here.state, factor), state, forces)

    def _lowest_modes(self, tangent: Tangent, start: Floats | None) -> tuple[Floats, Floats]:
        """The `MODES` lowest modes of a stable tangent: values (k,) ascending and modes (k, dofs), whose square sum
        over the scale is 1.

        start : (k, dofs) modes of a state nearby, or None.
        """
        scale, size = self._scale, tangent.freedom.size
        inverse, rows, _ = subspace_iteration(
            lambda rows: tangent.factors.solve(rows / scale) / scale,
            generic(size, MODES) if start is None else start / scale,
            settled=1,
            tolerance=_MODES_CLOSE,
            most_sweeps=MOST_SWEEPS,
        )
        return 1.0 / inverse, orthonormal(rows) * scale


def _products(a: Sequence[Floats] | Floats, b: Floats) -> Floats:
    """(k, k) inner products of rows."""
    return np.asarray(np.einsum("ik,jk->ij", a, b))
