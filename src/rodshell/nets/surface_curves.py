"""Geodesics and asymptotic lines of a target, from end to end, and where such curves cross.

A lath that lies flat on a surface follows a geodesic: it does not bend in its strong direction, and is straight when
developed [Pottmann et al. 2010, Geodesic patterns]. A strip that stands upright follows an asymptotic line, along which
the surface has no normal curvature: two lead through each point where K < 0, none where K > 0 [Schling et al. 2018,
Designing grid structures using asymptotic curve networks].
"""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.integrate import solve_ivp
from scipy.spatial import cKDTree

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import NetLimitError
from rodshell.geometry.frames import cross, dot, unit
from rodshell.layout.flatgrid import Crossings
from rodshell.targets import Target
from rodshell.units import point_text

STEP = 0.02  # of the size, between knots
ACCURACY = 1e-11  # of one step, relative to the size
LONGEST = 20.0  # sizes that a curve may go without reaching the end
NEWTON_STEPS = 30
BISECTIONS = 50
FINER = 4  # places of a step at which openings are looked for
BEYOND = 3.0  # steps past the last knots up to which crossings are known: there broad laths still lie on each other
MET = 1e-4  # steps between curves at a crossing: between their knots both leave the surface by less

Law = Callable[[Target, Floats, Floats], tuple[Floats, Floats]]
"""How curves of a target continue at points (n, 3) that they reach with unit tangents (n, 3): the tangents asked for
there, and their rates [1/m], which are 0 where the tangents follow from the points."""


def geodesic(target: Target, x: Floats, tangents: Floats) -> tuple[Floats, Floats]:
    """The `Law` of curves without curvature in the tangent plane: x'' = -(t H t / |g|^2) g."""
    _, gradient, hessian = target.implicit(x)
    bent = np.einsum("ni,nij,nj->n", tangents, hessian, tangents) / dot(gradient, gradient)
    return tangents, -bent[:, None] * gradient


def asymptotic(target: Target, x: Floats, tangents: Floats) -> tuple[Floats, Floats]:
    """The `Law` of curves without normal curvature: of both directions the one nearest to the last.

    Raises:
        NetLimitError: there is none, since K >= 0; names the place.
    """
    _, gradient, hessian = target.implicit(x)
    normal = unit(gradient)
    along = unit(tangents - dot(tangents, normal)[:, None] * normal)
    across = cross(normal, along)
    pairs = (along, along), (along, across), (across, across)
    a, b, c = (np.einsum("ni,nij,nj->n", left, hessian, right) for left, right in pairs)
    square = b * b - a * c
    if not (square > 0.0).all():
        raise NetLimitError(
            f"the target has no asymptotic lines at {point_text(x[np.argmin(square)])}, where it is not a saddle: "
            "they need negative Gaussian curvature everywhere"
        )
    slope = -a / (b + np.copysign(np.sqrt(square), b))  # the smaller root of a + 2 b q + c q^2 = 0
    return unit(along + slope[:, None] * across), np.zeros_like(along)


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceCurves:
    """Curves on a target by arc length, with s = 0 at their seeds, as quintics between knots at multiples of a step.

    Args:
        step: between knots [m].
        begin: (m + 1,) where the knots of each curve begin.
        before: (m,) knots of each curve before its seed.
        points, tangents: (k, 3) of the knots, the tangents of length 1.
        limits: (m, 2) arc lengths at which each begins and ends, wherever the target does [m]; None: nowhere else.
    """

    target: Target
    step: float
    begin: Ints
    before: Ints
    points: Floats
    tangents: Floats
    limits: Floats | None = None

    def __len__(self) -> int:
        return len(self.before)

    def __repr__(self) -> str:
        return f"SurfaceCurves({len(self)} on {self.target})"

    def at(self, curve: Ints, s: Floats) -> tuple[Floats, Floats]:
        """Points (n, 3) [m] and unit tangents (n, 3) of curves.

        Args:
            curve: (n,) indices of curves.
            s: (n,) arc lengths on them [m].
        """
        place = s / self.step + self.before[curve]
        last = self.begin[curve + 1] - self.begin[curve] - 2
        interval = np.clip(np.floor(place).astype(np.intp), 0, last)
        t = (place - interval)[:, None]
        k, h = self.begin[curve] + interval, self.step
        start, first, second = self.points[k], h * self.tangents[k], 0.5 * h * h * self.bends[k]
        rise = self.points[k + 1] - start - first - second  # what is left to the powers 3 to 5 at the next knot
        turn = h * self.tangents[k + 1] - first - 2 * second
        bend = h * h * self.bends[k + 1] - 2 * second
        third, fourth = 10 * rise - 4 * turn + 0.5 * bend, -15 * rise + 7 * turn - bend
        fifth = 6 * rise - 3 * turn + 0.5 * bend
        points = start + t * (first + t * (second + t * (third + t * (fourth + t * fifth))))
        slopes = first + t * (2 * second + t * (3 * third + t * (4 * fourth + t * 5 * fifth)))
        return points, unit(slopes)

    @cached_property
    def bends(self) -> Floats:
        """(k, 3) second derivatives at the knots [1/m], to fourth order; each curve has three knots or more."""
        x, t, h = self.points, self.tangents, self.step
        result = np.empty_like(x)
        result[1:-1] = 2 * (x[2:] - 2 * x[1:-1] + x[:-2]) / h**2 - (t[2:] - t[:-2]) / (2 * h)
        for k, inward in ((self.begin[:-1], 1), (self.begin[1:] - 1, -1)):
            near, far = k + inward, k + 2 * inward
            result[k] = (16 * x[near] + 7 * x[far] - 23 * x[k]) / (2 * h**2)
            result[k] -= inward * (6 * t[k] + 8 * t[near] + t[far]) / h
        return result

    @property
    def knots(self) -> tuple[Ints, Floats]:
        """The curve (k,) of each knot and its arc length (k,) [m]."""
        curve = np.repeat(np.arange(len(self)), np.diff(self.begin))
        return curve, self.step * (np.arange(len(curve)) - (self.begin[:-1] + self.before)[curve])

    @property
    def reach(self) -> Floats:
        """(m, 2) arc lengths of the first and the last knot of each curve, which lie past the target's end [m]."""
        first = -self.before
        return self.step * np.column_stack([first, first + np.diff(self.begin) - 1])

    @cached_property
    def pieces(self) -> tuple[Ints, Floats]:
        """Of each piece of a curve between ends of the target and of its openings, in their order: the curve (r,), and
        the arc lengths (r, 2) at which it begins and ends [m]."""
        reach = self.reach
        counts = FINER * (np.diff(self.begin) - 1) + 1
        curve = np.repeat(np.arange(len(self)), counts)
        place = np.arange(len(curve)) - (np.cumsum(counts) - counts)[curve]
        s = reach[curve, 0] + self.step / FINER * place
        inside = self._inside(curve, s)
        change = np.flatnonzero((inside[1:] != inside[:-1]) & (curve[1:] == curve[:-1]))
        of, leaves = curve[change], inside[change]
        near, far = np.where(leaves, s[change], s[change + 1]), np.where(leaves, s[change + 1], s[change])
        for _ in range(BISECTIONS):
            middle = 0.5 * (near + far)
            within = self._inside(of, middle)
            near, far = np.where(within, middle, near), np.where(within, far, middle)
        return of[::2], near.reshape(-1, 2)

    def _inside(self, curve: Ints, s: Floats) -> Bools:
        """(n,) whether there is a target, and the curve, at these arc lengths."""
        inside = self.target.margin(self.at(curve, s)[0]) > 0.0
        if self.limits is not None:
            low, high = self.limits[curve].T
            inside &= (low <= s) & (s <= high)
        return inside

    @cached_property
    def ends(self) -> Floats:
        """(m, 2) arc lengths at which the target begins and ends on each curve [m]."""
        of, ends = self.pieces
        each = np.arange(len(self))
        return np.column_stack([ends[np.searchsorted(of, each), 0], ends[np.searchsorted(of, each, "right") - 1, 1]])

    def crossings(self, family: Ints) -> Crossings:
        """Where curves of different families cross, up to `BEYOND` past their last knots.

        Args:
            family: (m,) of each curve.
        """
        curve, s = self.knots
        last = np.zeros(len(self.points), dtype=bool)
        last[self.begin[:-1]] = last[self.begin[1:] - 1] = True
        near = cKDTree(self.points).query_pairs(BEYOND * self.step, output_type="ndarray")
        apart = np.linalg.norm(self.points[near[:, 0]] - self.points[near[:, 1]], axis=1)
        near = near[(apart <= 1.01 * self.step) | last[near].any(axis=1)]
        of = curve[near]
        near = np.where((of[:, 0] < of[:, 1])[:, None], near, near[:, ::-1])
        pairs = near[family[of[:, 0]] != family[of[:, 1]]]
        a, b = curve[pairs].T
        at = s[pairs]
        for _ in range(NEWTON_STEPS):
            (p, along), (q, across) = self.at(a, at[:, 0]), self.at(b, at[:, 1])
            apart, mixed = q - p, dot(along, across)
            sine = np.maximum(1.0 - mixed * mixed, 1e-12)
            by_a, by_b = dot(apart, along), dot(apart, across)
            change = np.column_stack([by_a - mixed * by_b, mixed * by_a - by_b]) / sine[:, None]
            at = at + np.clip(change, -self.step, self.step)
        (p, _), (q, _) = self.at(a, at[:, 0]), self.at(b, at[:, 1])
        (low, high), past = self.reach.T, BEYOND * self.step
        met = np.linalg.norm(p - q, axis=1) < MET * self.step
        for side, each in enumerate((a, b)):
            met &= (at[:, side] >= low[each] - past) & (at[:, side] <= high[each] + past)
        rods, at = np.column_stack([a, b])[met], at[met]
        order = np.lexsort((at[:, 0], rods[:, 1], rods[:, 0]))
        rods, at = rods[order], at[order]
        new = (np.diff(rods, axis=0) != 0).any(axis=1) | (np.diff(at[:, 0]) > MET * self.step)
        kept = np.append(np.ones(min(len(at), 1), dtype=bool), new)
        return Crossings(rods[kept], at[kept])


def trace(target: Target, law: Law, seeds: Floats, tangents: Floats) -> SurfaceCurves:
    """Follow curves both ways from their seeds to the end of the target, all at once.

    Args:
        law: of the curves, `geodesic` or `asymptotic`.
        seeds: (m, 3) points of the target inside its end [m].
        tangents: (m, 3) unit tangents there.

    Raises:
        NetLimitError: a curve does not reach the end, or cannot be continued; names the place.
    """
    step, count = STEP * target.size, len(seeds)
    x, t = np.tile(seeds, (2, 1)), np.vstack([tangents, -tangents])
    t, going = law(target, x, t)[0], np.arange(2 * count)
    knots = [(going, x, t)]
    for _ in range(int(LONGEST / STEP)):
        before, (x, t) = x, _stepped(target, law, x, t, step)
        lost = ~(np.isfinite(x).all(axis=1) & np.isfinite(target.margin(x)))
        if lost.any():
            raise _off_the_end(before[int(np.argmax(lost))], "cannot be continued")
        knots.append((going, x, t))
        left = target.covers(x)  # also across an opening
        going, x, t = going[left], x[left], t[left]
        if len(going) == 0:
            return _joined(target, step, count, knots)
    raise _off_the_end(x[0], f"does not arrive within {LONGEST:g} times the target's size")


def _off_the_end(point: Floats, why: str) -> NetLimitError:
    return NetLimitError(
        f"a rod that leads through {point_text(point)} to the end of the target {why}: use a smaller part of "
        "the target, or another anchor or heading"
    )


def _stepped(target: Target, law: Law, x: Floats, tangents: Floats, step: float) -> tuple[Floats, Floats]:
    """Points (n, 3) and unit tangents (n, 3) of curves a step further [m]; NaN where the target has no continuation."""
    half = x.size

    def rates(_: float, state: Floats) -> Floats:
        ahead, turning = law(target, state[:half].reshape(-1, 3), state[half:].reshape(-1, 3))
        return np.concatenate([ahead.ravel(), turning.ravel()])

    found = solve_ivp(
        rates, (0.0, step), np.concatenate([x.ravel(), tangents.ravel()]), method="DOP853", first_step=step,
        rtol=1e-13, atol=ACCURACY * np.repeat([target.size, 1.0], half),
    )  # fmt: skip
    if not found.success:
        straight = x + step * tangents
        return np.where(np.isfinite(target.level(straight)[0])[:, None], straight, np.nan), tangents
    x, tangents = found.y[:, -1].reshape(2, -1, 3)
    x = target.retract(x)
    tangents, normal = law(target, x, tangents)[0], target.on_surface(x).normal
    return x, unit(tangents - dot(tangents, normal)[:, None] * normal)


def _joined(target: Target, step: float, count: int, knots: list[tuple[Ints, Floats, Floats]]) -> SurfaceCurves:
    """The curves of which both arms, k and k + count, have these `knots`, one after the other."""
    number = np.repeat(np.arange(len(knots)), [len(arms) for arms, _, _ in knots])
    arm, points, tangents = (np.concatenate(parts) for parts in zip(*knots, strict=True))
    back = arm >= count
    kept = ~(back & (number == 0))  # the seed is the first knot of both
    curve, place = (arm % count)[kept], np.where(back, -number, number)[kept]
    points, tangents = points[kept], np.where(back[:, None], -tangents, tangents)[kept]
    order = np.lexsort((place, curve))
    begin = np.searchsorted(curve[order], np.arange(count + 1))
    before = -place[order][begin[:-1]]
    return SurfaceCurves(target, step, begin, before, points[order], tangents[order])
