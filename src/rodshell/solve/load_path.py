"""The path of equilibria under a load that grows: where it first loses its stability, and what follows.

The path begins at t = 0 and is followed by its arc length (`arc_length`). At each stable point the lowest modes of the
stiffness, and how it changes along the path, say how far away the first singular stiffness is. Steps go for it from
below until a stable and an unstable point enclose it; the inertia of the stiffness says which is which. The factor of
the stable one is the answer, so that it is never larger than what was found to be stable. A stiffness that jumps, such
as that of a cable that goes slack, is not foreseen: there the two points close in on the jump.

No step leaves the path for another, lower one: a point counts only if it lies where the path leads, within a share of
the step.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Literal

import numpy as np

from rodshell.arrays import Floats
from rodshell.solve.arc_length import STRAYED, ArcLength, Point
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.load import Load

Limit = Literal["unstable unloaded", "limit point", "bifurcation", "none", "lost"]

CLOSE = 2e-3  # of the factor: the last stable point is as near as this to the first unstable one
_ROUNDED = 0.2  # of `close`: where round-off in EA hides more of the lowest stiffness, signs of modes mean nothing
MOST = 100.0  # times the load: a path is not followed further
MOST_FACTORIZATIONS = 120
FARTHEST = 0.1  # of the length that a node moves from point to point
SHRINKAGE, GROWTH = 0.4, 3.0  # of a step that failed; at most, from one step to the next
_RETURNED = 0.5  # of a step, back from its end: a mode without stiffness there may have been unstable in between
_PASSING = 0.5  # of `close`, of the arc so far: the shortest step past a singular stiffness
_UNEXPLAINED = 4.0  # times the arc to an unstable point: if no mode loses its stiffness nearer, it may be on another
APART = 0.5  # path, and is, if it lies so far off the tangent, over the arc to it: a jump of the stiffness leaves none
UNACCOUNTED = 0.4  # of the factor that a step gains, by the trapezoidal rule: more is another path
TURNING = 0.5  # of its mean so far: a smaller rate of the factor says that the path turns back
ALONG = 0.02  # cosine: where the path is less along the mode that gives way, it is left sideways
NEARBY = 1e-4  # of the length: no other path is so near, and the tangent need not foresee where this one leads
_RECEDING = 1.1  # times as far as it was foreseen: a singular stiffness that moves away as it is approached
LEAST = 1e-5  # of the arc so far: shorter steps are given up; of the length: the least that counts as the arc so far
FLAT, _MOST_TURNS = 1e-6, 6  # of the factor: a turning point is as near as this; points that are spent on it


@dataclass(frozen=True, eq=False)
class PathPoint:
    """A point of a path.

    Args:
        arc: root mean square displacement of the nodes along the path so far [m].
        negative_modes: of the stiffness; 0 says stable.
        equilibrium: the structure there, under the factor; what its problem carries as load is the whole load.
    """

    factor: float
    arc: float
    negative_modes: int
    equilibrium: Equilibrium

    @property
    def state(self) -> Floats:
        """(n, 3) node positions [m] and twist angles [rad]."""
        return self.equilibrium.state

    @property
    def forces(self) -> Floats:
        """(e,) axial forces of the edges [N]."""
        return self.equilibrium.forces


@dataclass(frozen=True, eq=False)
class LoadPath:
    """A path of equilibria under t times a load.

    Args:
        factor: the largest t up to which the path is stable, `close` to where it is lost; 0 where the unloaded
            structure is not stable.
        limit: what ends the stable path: "limit point", the load cannot grow; "bifurcation", the structure leaves the
            path sideways (one that is not quite symmetric has a limit point nearby instead); "none", nothing up to the
            largest factor asked for; "lost", the path could not be followed further, and nothing is known above
            `factor`: from the start where EA is so large (over EI/L^2 some 1e11) that round-off in it hides how stiff
            the structure is; "unstable unloaded".
        points: in the order of the path; the stable ones come first.
        mode: (n, 3) how it gives way, the largest component of a node's displacement being 1; None unless the limit is
            a limit point or a bifurcation.
        place: block of the node that the mode moves farthest, or None.
        turns: the points where t has an extremum: limit points, found to `FLAT`, where the path was followed past them.
    """

    factor: float
    limit: Limit
    points: tuple[PathPoint, ...]
    mode: Floats | None
    place: int | None
    turns: tuple[PathPoint, ...]
    factorizations: int

    def __repr__(self) -> str:
        return f"LoadPath({self.limit} at {self.factor:.5g}, {len(self.points)} points)"

    @property
    def last_stable(self) -> PathPoint | None:
        """The stable point with the largest factor before the loss; None where the unloaded structure is unstable."""
        stable = [point for point in self.points if point.factor == self.factor and not point.negative_modes]
        return stable[0] if stable else None

    def at(self, factor: float) -> Equilibrium | None:
        """The stable equilibrium at one of the `stations` asked for, or None where that was not reached.

        Args:
            factor: t, as it was given to `load_path`.
        """
        found = [point for point in self.points if point.factor == factor and not point.negative_modes]
        return found[0].equilibrium if found else None


def load_path(
    unloaded: Equilibrium,
    load: Load | Floats,
    *,
    most: float = MOST,
    close: float = CLOSE,
    stations: Sequence[float] = (1.0,),
    past_limit: bool = False,
    most_factorizations: int = MOST_FACTORIZATIONS,
    progress: Callable[[int, float], None] = lambda count, factor: None,
) -> LoadPath:
    """Follow a structure from equilibrium without the load until it loses its stability, or further.

    Args:
        unloaded: the equilibrium at factor 0; its edges elastic, its supports at rest. A load that it has stays as it
            is.
        load: what grows, at factor 1: dead forces (n, 3) [N], or a `Load`; not zero in the free directions.
        most: factor up to which the path is followed; past a limit, down to minus this, too.
        close: accuracy of the factor, relative.
        stations: factors at which the equilibrium is wanted, on the stable path; see `LoadPath.at`.
        past_limit: continue along the same path, through limit points and past bifurcations, until t is beyond `most`.
        most_factorizations: the path ends when they are used up.
        progress: called at every step with the factorisations made and the factor reached; what it raises ends the
            path.

    Raises:
        InputError: the load does not fit the structure.
    """
    search = _Search(unloaded, Load.of(load), most, close, sorted(stations), most_factorizations, progress)
    return search.run(past_limit)


class _Search:
    """One search along a path; arguments as of `load_path`."""

    def __init__(
        self, unloaded: Equilibrium, load: Load, most: float, close: float, stations: Sequence[float],
        most_factorizations: int, progress: Callable[[int, float], None],
    ) -> None:  # fmt: skip
        self.path = ArcLength(unloaded, load)
        self.most, self.close, self.stations = most, close, stations
        self.most_factorizations, self.progress = most_factorizations, progress
        self.stable: list[Point] = []
        self.turns: list[Point] = []

    def run(self, past_limit: bool) -> LoadPath:
        here = self.path.begin()
        if here is None or here.negative_modes:
            return LoadPath(0.0, "unstable unloaded", (), None, None, (), self.path.factorizations)
        self.stable.append(here)
        known = self.path.round_off <= _ROUNDED * self.close
        limit, beyond = self._to_the_loss(here) if known else ("lost", None)
        mode, place, last = None, None, self.stable[-1]
        if beyond is not None:
            mode = self.path.losing_mode(beyond)  # round-off alone may turn the rate of the factor next to it
            if limit == "limit point" and self.path.alignment(last.motion, mode) < ALONG:
                limit = "bifurcation"
            place = int(np.argmax(np.linalg.norm(np.where(self.path.is_node[:, None], mode, 0.0), axis=1)))
        points = [*self.stable]
        if past_limit and beyond is not None:
            points += self._onwards(last, beyond)
        public = {id(point): self._public(point) for point in points}
        return LoadPath(
            last.factor, limit, tuple(public.values()), mode, place,
            tuple(public[id(point)] for point in self.turns), self.path.factorizations,
        )  # fmt: skip

    def _public(self, point: Point) -> PathPoint:
        return PathPoint(point.factor, point.arc, point.negative_modes, self.path.equilibrium(point))

    def _to_the_loss(self, here: Point) -> tuple[Limit, Point | None]:
        """Why the stable path ends, and the first unstable point; the stable ones are collected."""
        beyond, before, longest = None, None, np.inf
        share = 0.5  # of the way to the singular stiffness ahead that is gone: by how well the last point foresaw it
        while self.path.factorizations < self.most_factorizations:
            self.progress(self.path.factorizations, here.factor)
            if here.factor >= self.most:
                return "none", None
            if beyond is not None and _peak(here, beyond) - here.factor <= self.close * here.factor:
                return "limit point" if beyond.rate < 0 else "bifurcation", beyond
            step = min(self._next_step(here, beyond, share), longest)
            if step <= LEAST * max(here.arc, LEAST * self.path.length):
                if here.ahead * here.rate <= self.close * here.factor:  # so near that its far side was not found
                    return "limit point" if here.rate * here.arc < TURNING * here.factor else "bifurcation", None
                break
            there = self.path.point(here, before or beyond, step)
            if there is not None and not (there.negative_modes or self._follows(here, there, step)):
                there = None
            if there is None and step * here.rate < self.close * here.factor:
                jumped = self.path.unstable_next(here, step)
                if jumped is not None:
                    return "limit point", jumped
            if there is None and step * self.path.reach(here.motion) < NEARBY * self.path.length:
                there = self.path.point(here, None, step, near=NEARBY)
            if there is None:
                longest = SHRINKAGE * step
                continue
            longest = min(GROWTH, sqrt(0.5 * STRAYED / max(there.strayed, 1e-9))) * step
            if there.negative_modes:
                beyond, share = there, 0.98 * min(share, 1.0)
                continue
            self._add(here, there)
            foreseen, now = here.ahead, step + there.ahead
            share = _share(now, foreseen)
            before, here = here, there
            if beyond is not None and self._elsewhere(here, beyond):
                beyond = None
        return "lost", None

    def _add(self, here: Point, there: Point) -> None:
        """Add a stable point, and those at stations on the way to it."""
        for station in self.stations:
            if here.factor < station < there.factor:
                found = self.path.at_factor(station, here, there)
                if found is not None and not found.negative_modes:
                    self.stable.append(found)
        self.stable.append(there)

    def _follows(self, here: Point, there: Point, step: float) -> bool:
        """Whether a stable point is the next on the stable path: no stiffness vanished in between, as its own change
        shows, and the factor is what its rates at both ends add up to."""
        if -there.behind < _RETURNED * step:
            return False
        left = there.factor - here.factor - 0.5 * step * (here.rate + there.rate)
        return abs(left) <= UNACCOUNTED * step * max(here.rate, there.rate)

    def _elsewhere(self, here: Point, beyond: Point) -> bool:
        """Whether an unstable point is not on the path of the stable one before it."""
        span = beyond.arc - here.arc
        if here.ahead <= _UNEXPLAINED * span or here.strayed >= 0.1 * STRAYED:
            return False
        off = beyond.state - here.state - span * here.motion
        return self.path.reach(off) > APART * self.path.reach(span * here.motion)

    def _next_step(self, here: Point, beyond: Point | None, share: float) -> float:
        """How far to go: for the singular stiffness ahead, from below until it is near enough to pass."""
        near = here.ahead * here.rate < 0.4 * self.close * here.factor
        step = max(2.0 * here.ahead, _PASSING * self.close * here.arc) if near else share * here.ahead
        if beyond is not None:
            span = beyond.arc - here.arc
            return float(np.clip(step, 0.05 * span, 0.95 * span)) if here.ahead < span else 0.5 * span
        longest = min(self._farthest(here), -2.0 * here.behind, 1.02 * (self.most - here.factor) / here.rate)
        return min(step, longest)

    def _farthest(self, here: Point) -> float:
        """The longest step from a point [m]."""
        return FARTHEST * self.path.length / max(self.path.reach(here.motion), 1e-300)

    # Past the loss of stability

    def _onwards(self, before: Point, here: Point) -> list[Point]:
        """The points from the first unstable one on, until the factor is beyond the largest asked for."""
        points = [*self._turn(before, here), here]
        step = 0.1 * self._farthest(here)
        while self.path.factorizations < self.most_factorizations and abs(here.factor) < self.most:
            self.progress(self.path.factorizations, here.factor)
            left = (self.most - abs(here.factor)) / max(abs(here.rate), 1e-300)
            step = min(step, self._farthest(here), 1.02 * left if here.rate * here.factor > 0 else np.inf)
            if step <= LEAST * self.path.length:
                break
            there = self.path.point(here, before if here.arc - before.arc > 0.1 * step else None, step)
            if there is None:
                step *= SHRINKAGE
                continue
            points += [*self._turn(here, there), there]
            before, here = here, there
            step *= min(GROWTH, sqrt(0.5 * STRAYED / max(there.strayed, 1e-9)))
        return points

    def _turn(self, here: Point, there: Point) -> list[Point]:
        """The limit point between two points, if there is one: by the cubic through both until it is met."""
        if here.rate * there.rate >= 0:
            return []
        best = None
        for _ in range(_MOST_TURNS):
            span, scale = there.arc - here.arc, max(abs(here.factor), abs(there.factor))
            share, top = _turning(here, there)
            if best is not None and abs(top - best.factor) <= FLAT * scale:
                break
            found = self.path.point(here, there, share * span)
            if found is None:
                break
            best = found
            here, there = (found, there) if found.rate * here.rate > 0 else (here, found)
        if best is None:
            return []
        self.turns.append(best)
        return [best]


def _share(now: float, foreseen: float) -> float:
    """The share of the way to the singular stiffness that the next step may go, by what was foreseen of the last one.

    One that recedes is run after: past it lies a stable point, or an unstable one that encloses it.
    """
    if not (np.isfinite(now) and np.isfinite(foreseen)):
        return 0.5
    if now > _RECEDING * foreseen:
        return min(now / foreseen, GROWTH)
    return 1.0 - min(0.5, max(0.02, abs(now - foreseen) / now))


def _cubic(here: Point, beyond: Point, share: Floats) -> Floats:
    """The factor between two points, at shares of the arc, by the cubic through both."""
    span = beyond.arc - here.arc
    rise = (1 + 2 * share) * (1 - share) ** 2 * here.factor + share**2 * (3 - 2 * share) * beyond.factor
    return np.asarray(rise + span * share * (1 - share) * ((1 - share) * here.rate - share * beyond.rate))


def _peak(here: Point, beyond: Point) -> float:
    """The largest factor between two points, by the cubic through both: at a limit point above the last one's."""
    return beyond.factor if beyond.rate >= 0 else float(_cubic(here, beyond, np.linspace(0.0, 1.0, 101)).max())


def _turning(here: Point, there: Point) -> tuple[float, float]:
    """Share of the arc, and factor, where the cubic between two points whose rates differ in sign is flat."""
    share = np.linspace(0.02, 0.98, 193)
    factor = _cubic(here, there, share)
    at = int(np.argmax(factor if here.rate > 0 else -factor))
    return float(share[at]), float(factor[at])
