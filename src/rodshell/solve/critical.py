"""The load factor at which a shell first loses its stability, limit points and bifurcations alike.

The path of equilibria under t W begins at t = 0. It is followed by its arc length s, the root mean square displacement
of the nodes, each point on a plane across the last tangent [Riks 1979; Crisfield 1991, section 9.3]. The tangent is
dx/ds = v/|v|, dt/ds = 1/|v| with v = K^-1 W; where the shell is stable, t grows, and it turns back at a limit point.

At each point the lowest modes of the stiffness, and how it changes along the path, say how far away the first
singular stiffness is. Steps go for it from below until a stable and an unstable point enclose it. The factor of the
stable one is the answer, so that it is never larger than what was found to be stable.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from math import sqrt
from typing import Literal

import numpy as np
from scipy.sparse import csc_matrix

from rodshell.arrays import Floats
from rodshell.rods.elements import Elements
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.sparse_ldl import SingularError
from rodshell.solve.tangent import Tangent, TangentAssembly, by_projections, subspace_iteration

Limit = Literal["unstable unloaded", "limit point", "bifurcation", "none", "lost"]

CLOSE = 2e-3  # of the factor: the last stable point is as near as this to the first unstable one
MODES = 4  # lowest ones that are looked at
MODES_CLOSE, MOST_SWEEPS = 1e-2, 12  # relative change of the lowest eigenvalue: modes only say how far to go
MOST_FACTORIZATIONS = 120
MOST_STEPS = 12  # of Newton's method for a point
FARTHEST = 0.1  # of the length that a node moves from point to point
STRAYED = 0.3  # of a step: a point so far off its prediction may be on another path. Half of it is aimed at
SHRINKAGE, GROWTH = 0.4, 3.0  # of a step that failed; at most, from one step to the next
RETURNED = 0.5  # of a step, back from its end: a mode without stiffness there may have been unstable in between
PASSING = 0.5 * CLOSE  # of the arc so far: the shortest step past a singular stiffness
UNEXPLAINED = 4.0  # times the arc to an unstable point: if no mode loses its stiffness nearer, it is on another path
LEAST = 1e-5  # of the arc so far: shorter steps are given up; of the length: the least that counts as the arc so far
SETTLED, SETTLED_FORCE = 1e-10, 1e-8  # of the length and of the largest axial force: last change of a point
CHORD, SLOW = 5e-3, 0.2  # as in `newton_step`
SAME_STIFFNESS = 1e-5, 1e-4  # of length and force: factors from this near are those of the point
PROBE = 1e-5  # of the length: displacement over which the stiffness's change is taken


@dataclass(frozen=True)
class Critical:
    """Where a path of equilibria under t W first loses its stability.

    Parameters
    ----------
    factor : the largest t found stable, `CLOSE` to where stability is lost; 0 where the unloaded shell is not stable.
    limit : what ends the stable path: "limit point", the load cannot grow; "bifurcation", the shell leaves the path
        sideways; "none", nothing up to the largest factor asked for; "lost", the path could not be followed
        further, and nothing is known above `factor`.
    state : (n, 3) the equilibrium at t = 1, or None where that was not reached.
    """

    factor: float
    limit: Limit
    state: Floats | None
    factorizations: int


@dataclass(frozen=True)
class _Point:
    """An equilibrium on the path, at `arc` [m].

    Parameters
    ----------
    motion (n, 3), change (e,), rate : derivatives by the arc of state, forces and factor.
    strayed : how far it lies off its prediction, over the step.
    ahead, behind : arc to the nearest singular stiffness on either side, as the stiffness of the `modes` changes here.
    """

    factor: float
    arc: float
    state: Floats
    forces: Floats
    elements: tuple[Elements, ...]
    negative_modes: int
    motion: Floats
    change: Floats
    rate: float
    strayed: float = 0.0
    modes: Floats | None = None
    ahead: float = np.inf
    behind: float = -np.inf


def first_critical(
    unloaded: Equilibrium,
    load: Floats,
    *,
    most: float = 100.0,
    progress: Callable[[int, float], None] = lambda count, factor: None,
) -> Critical:
    """Follow a structure from equilibrium without the load until it loses its stability.

    Parameters
    ----------
    unloaded : the equilibrium at factor 0; its edges elastic, its supports at rest. A load that it has stays as it is.
    load : (n, 3) W, the dead load that grows, at factor 1 [N]; not zero in the free directions.
    most : factor up to which the path is followed.
    progress : called at every step with the factorisations made and the factor reached; what it raises ends the
        search.
    """
    path, length = _Path(unloaded, load), unloaded.problem.length
    here = path.begin(unloaded)
    if here is None or here.negative_modes:
        return Critical(0.0, "unstable unloaded", None, path.factorizations)
    limit: Limit = "lost"
    beyond, before, unit_state, longest = None, None, None, np.inf
    doubt = 0.5  # share of the way ahead that is left: how well the last point foresaw this one
    while path.factorizations < MOST_FACTORIZATIONS:
        progress(path.factorizations, here.factor)
        if here.factor >= most:
            limit = "none"
            break
        if beyond is not None and _peak(here, beyond) - here.factor <= CLOSE * here.factor:
            limit = "limit point" if beyond.rate < 0 else "bifurcation"
            break
        step = min(path.next_step(here, beyond, most, doubt), longest)
        if step <= LEAST * max(here.arc, LEAST * length):
            break
        there = path.point(here, before or beyond, step)
        if there is None or (there.negative_modes == 0 and -there.behind < RETURNED * step):
            longest = SHRINKAGE * step
            continue
        longest = min(GROWTH, sqrt(0.5 * STRAYED / max(there.strayed, 1e-9))) * step
        if there.negative_modes:
            beyond = there
            continue
        if here.factor < 1.0 <= there.factor:
            unit_state = path.at_one(here, there)
        foreseen, now = here.ahead, step + there.ahead
        doubt = min(0.5, max(0.02, abs(now - foreseen) / now)) if np.isfinite(now) and np.isfinite(foreseen) else 0.5
        before, here = here, there
        if beyond is not None and here.ahead > UNEXPLAINED * (beyond.arc - here.arc) and here.strayed < 0.1 * STRAYED:
            beyond = None
    if limit == "lost" and here.ahead * here.rate <= CLOSE * here.factor:
        limit = "limit point"  # so sharp a turn that its far side was not found, but no farther than that
    return Critical(here.factor, limit, unit_state, path.factorizations)


def _peak(here: _Point, beyond: _Point) -> float:
    """The largest factor between two points, by the cubic through both: at a limit point above the last one's."""
    if beyond.rate >= 0:
        return beyond.factor
    share, span = np.linspace(0.0, 1.0, 101), beyond.arc - here.arc
    rise = (1 + 2 * share) * (1 - share) ** 2 * here.factor + share**2 * (3 - 2 * share) * beyond.factor
    return float((rise + span * share * (1 - share) * ((1 - share) * here.rate - share * beyond.rate)).max())


class _Path:
    """Points on the path of a problem under a growing load."""

    def __init__(self, unloaded: Equilibrium, load: Floats) -> None:
        self._problem, self._load = unloaded.problem, load
        problem = unloaded.problem
        self._constant = np.zeros_like(load) if problem.load is None else problem.load
        self._nodes = np.unique(problem.stretch.blocks)  # the other blocks are angles
        self._assembly = TangentAssembly(problem, unloaded.state)
        self._scale = np.empty(0)
        self._least_force = 1e-6 * float(problem.stretch.stiffness.max())
        self.factorizations = 0

    def begin(self, unloaded: Equilibrium) -> _Point | None:
        """The unloaded structure; None where its stiffness is singular."""
        self.factorizations += 1
        try:
            tangent = unloaded.tangent
        except SingularError:
            return None
        # modes are measured by the first stiffness's diagonal: metres and radians alike
        self._scale = 1.0 / np.sqrt(np.abs(tangent.values[tangent.pattern.assembly.diagonal]))
        return self._on_path(0.0, unloaded.state, unloaded.forces, unloaded.elements, tangent)

    def _tangent(self, elements: tuple[Elements, ...], state: Floats, forces: Floats) -> Tangent:
        self.factorizations += 1
        return self._assembly.tangent(elements, state, forces)

    def next_step(self, here: _Point, beyond: _Point | None, most: float, doubt: float) -> float:
        """How far to go: for the singular stiffness ahead, from below until it is near enough to pass."""
        near = here.ahead * here.rate < 0.4 * CLOSE * here.factor
        step = max(2.0 * here.ahead, PASSING * here.arc) if near else (1 - doubt) * here.ahead
        if beyond is not None:
            span = beyond.arc - here.arc
            return float(np.clip(step, 0.05 * span, 0.95 * span)) if here.ahead < span else 0.5 * span
        reach = self._reach(here.motion)
        longest = min(FARTHEST * self._problem.length / reach, -here.behind, 1.02 * (most - here.factor) / here.rate)
        return min(step, longest)

    def point(self, here: _Point, other: _Point | None, step: float) -> _Point | None:
        """The point a step further; None where Newton's method does not find it, or strays from the prediction.

        other : a point that tells the curvature of the path, or None.
        """
        state, forces = here.state + step * here.motion, here.forces + step * here.change
        if other is not None:
            half = 0.5 * step**2 / (other.arc - here.arc)
            state, forces = state + half * (other.motion - here.motion), forces + half * (other.change - here.change)
        reach = self._reach(state - here.state)
        found = self._correct(
            state, forces, here.factor + step * here.rate, here.elements, across=here.motion, near=STRAYED * reach
        )
        if found is None:
            return None
        point = self._on_path(*found, here, step)
        return replace(point, strayed=self._reach(point.state - state) / reach)

    def at_one(self, here: _Point, there: _Point) -> Floats | None:
        """(n, 3) the state at factor 1 between two points."""
        span = there.arc - here.arc
        share = (1.0 - here.factor) / (there.factor - here.factor)
        bend = 0.5 * share * (share - 1) * span
        state = (1 - share) * here.state + share * there.state + bend * (there.motion - here.motion)
        forces = (1 - share) * here.forces + share * there.forces + bend * (there.change - here.change)
        near = STRAYED * self._reach(there.state - here.state)
        found = self._correct(state, forces, 1.0, here.elements, near=near)
        return None if found is None else found[1]

    def _correct(
        self, state: Floats, forces: Floats, factor: float, elements: tuple[Elements, ...], *,
        across: Floats | None = None, near: float = np.inf,
    ) -> tuple[float, Floats, Floats, tuple[Elements, ...], Tangent] | None:  # fmt: skip
        """Newton's method to the equilibrium at this factor, or on the plane through the state `across` a motion
        (n, 3), at most `near` [m] away: factor, state, forces and elements there, and the tangent next to it."""
        stretch, length, first = self._problem.stretch, self._problem.length, state
        last, chord = np.inf, False
        elements = _refreshed(elements, state)
        try:
            for _ in range(MOST_STEPS):
                if not chord:
                    tangent = self._tangent(elements, state, forces)
                    at, axial, along = state, forces, tangent.solve(self._load)
                strains = stretch.strains(state)
                gradient = self._assembly.gradient(elements, state, forces) - self._constant - factor * self._load
                stretch.add_axial(at, stretch.stiffness * strains - forces, gradient)
                motion, more = tangent.solve(-gradient), 0.0
                if across is not None:
                    more = self._inner(across, first - state - motion) / self._inner(across, along)
                    motion = motion + more * along
                moved = float(np.abs(motion).max()) / length
                if not self._reach(state + motion - first) <= near:
                    return None
                if chord and moved > SLOW * last:
                    chord = False
                    continue
                after = stretch.stiffness * (strains + stretch.elongation(at, motion))
                size = max(float(np.abs(after).max(initial=0.0)), self._least_force)
                changed = float(np.abs(after - forces).max(initial=0.0)) / size
                state, forces, factor = state + motion, after, factor + more
                elements = _refreshed(elements, state)
                last, chord = moved, moved < CHORD
                if moved < SETTLED and changed < SETTLED_FORCE:
                    since = float(np.abs(state - at).max()) / length, float(np.abs(forces - axial).max()) / size
                    if since[0] > SAME_STIFFNESS[0] or since[1] > SAME_STIFFNESS[1]:
                        tangent = self._tangent(elements, state, forces)
                    return factor, state, forces, elements, tangent
        except SingularError:
            pass
        return None

    def _on_path(
        self, factor: float, state: Floats, forces: Floats, elements: tuple[Elements, ...], tangent: Tangent,
        last: _Point | None = None, step: float = 0.0,
    ) -> _Point:  # fmt: skip
        """The point at a state with its tangent, a step after the last point."""
        along = tangent.solve(self._load)
        rate = 1.0 / sqrt(self._inner(along, along))
        if last is not None and self._inner(along, last.motion) < 0:
            rate = -rate
        motion = rate * along
        stretch = self._problem.stretch
        change = stretch.stiffness * stretch.elongation(state, motion)
        arc, modes = (0.0, None) if last is None else (last.arc + step, last.modes)
        point = _Point(factor, arc, state, forces, elements, tangent.negative_modes, motion, change, rate)
        return point if tangent.negative_modes else self._looking_ahead(point, tangent, modes)

    def _looking_ahead(self, here: _Point, tangent: Tangent, start: Floats | None) -> _Point:
        """With its modes and the nearest singular stiffness, as the stiffness of the lowest modes changes here."""
        values, modes = self._lowest_modes(tangent, start)
        step = PROBE * self._problem.length / self._reach(here.motion)
        state, forces = here.state + step * here.motion, here.forces + step * here.change
        _, ahead_values = self._assembly.values(here.elements, state, forces)
        change = _between(modes, tangent.pattern.upper((ahead_values - tangent.values) / step))
        root = 1.0 / np.sqrt(values)
        loss = np.linalg.eigvalsh(-change * root[:, None] * root)  # 1/m: the modes' stiffness vanishes at 1/loss
        ahead = 1.0 / loss[-1] if loss[-1] > 0 else np.inf
        behind = 1.0 / loss[0] if loss[0] < 0 else -np.inf
        return replace(here, modes=modes, ahead=float(ahead), behind=float(behind))

    def _lowest_modes(self, tangent: Tangent, start: Floats | None) -> tuple[Floats, Floats]:
        """The `MODES` lowest modes of a stable tangent: values (k,) ascending and modes (k, dofs), whose square sum
        over the scale is 1.

        start : (k, dofs) modes of a state nearby, or None.
        """
        scale, size = self._scale, tangent.freedom.size
        if start is None:  # no symmetry of the shell is one of this start
            start = np.sin(1.0 + np.arange(size) ** 2 * np.arange(1, 1 + min(MODES, size))[:, None]) * scale
        inverse, rows = subspace_iteration(
            lambda row: tangent.factors.solve(row / scale) / scale,
            start / scale, settled=1, tolerance=MODES_CLOSE, most_sweeps=MOST_SWEEPS, orthonormalise=by_projections,
        )  # fmt: skip
        return 1.0 / inverse, by_projections(rows) * scale

    def _reach(self, motion: Floats) -> float:
        """Largest displacement of a node [m]."""
        return float(np.abs(motion[self._nodes]).max())

    def _inner(self, a: Floats, b: Floats) -> float:
        """Mean inner product of the nodes' displacements [m2]."""
        return float(np.einsum("ij,ij->", a[self._nodes], b[self._nodes])) / len(self._nodes)


def _refreshed(elements: Sequence[Elements], state: Floats) -> tuple[Elements, ...]:
    return tuple(element.refreshed(state) for element in elements)


def _between(modes: Floats, upper: csc_matrix) -> Floats:
    """(k, k) x' A y between modes (k, dofs), of a symmetric matrix given by its upper triangle."""
    half = _products(modes, np.array([upper @ mode for mode in modes]))
    return half + half.T - _products(modes, upper.diagonal() * modes)


def _products(a: Floats, b: Floats) -> Floats:
    """(k, k) inner products of rows."""
    return np.asarray(np.einsum("ik,jk->ij", a, b))
