"""Where a target ends: regions of the plan, and closed curves on a surface.

A region is the domain of a height field, or is enclosed by a rim in plan. A rim separates the shell from the rest of a
surface. It is the polyline that a drawing or a mesh gives: its sides are straight seen from above, or along the normal
where the surface is steep, and its corners are corners. It is a smooth curve only where six points or more turn by
little, and alike (`Rim.of`). Jagged edges of meshes are smoothed.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise, zip_longest
from typing import Literal, Protocol

import numpy as np
from scipy.sparse import coo_matrix, diags_array
from scipy.sparse.linalg import spsolve

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.curves import TOUCH, on_curve
from rodshell.geometry.frames import cross, dot, unit
from rodshell.kernels import njit
from rodshell.validation import keep, numbers, positive

UPRIGHT = 0.2  # upward part of a normal: a steeper surface is not seen from above, and may overhang its edge
CORNER = 0.25  # [rad], 14 degrees, as of 25 points on a circle: a loop is not rounded where its edges turn by more
UNLIKE = 3.0  # times: curvatures of a polyline that differ by more from point to point are not those of one curve
ON_A_CURVE = 6  # points in a row, at least: fewer are corners between straight sides
POINTS = 1500  # on each loop
IN_A_BALL = 32  # points in each bounding ball

# jagged edges
SHARP = 0.35  # [rad], 20 degrees: an edge between two such turns to opposite sides is a jog
FEWEST = 4  # successive jogs that make an edge jagged: a real corner or notch has fewer
RUN = 2.5  # times sqrt(n): edges between successive jogs; a lattice cut along a circle of n edges has 1.1 sqrt(n)
MOST, RMS = 1.0, 0.35  # edge lengths: moves of vertices, largest and rms; steps of a lattice deviate by 0.29 rms
HALVINGS = 20

Given = Literal["plan", "space", "surface"]  # where a loop is drawn


class Domain(Protocol):
    """A region of the plan."""

    @property
    def half_extent(self) -> tuple[float, float]:
        """Half the width along x and along y [m]."""

    def holds(self, xy: Floats) -> Bools:
        """Whether (n,) points `xy` (n, 2) of the plan are inside or on the edge."""

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
        """Signed distance (n,) [m] of points `xy` (n, 2) to the edge, negative inside, its gradient (n, 2) and Hessian
        (n, 2, 2) [1/m]."""


@dataclass(frozen=True)
class Disc:
    """A disc around the origin of the plan.

    Args:
        radius: [m].

    Raises:
        InputError: the radius is not a positive number.
    """

    radius: float

    def __post_init__(self) -> None:
        keep(self, positive, "m", "radius", what="domain {}")

    @property
    def half_extent(self) -> tuple[float, float]:
        return self.radius, self.radius

    def holds(self, xy: Floats) -> Bools:
        return np.asarray(np.hypot(xy[:, 0], xy[:, 1]) <= self.radius)

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
        r = np.maximum(np.hypot(xy[:, 0], xy[:, 1]), 1e-300)
        n = xy / r[:, None]
        hessian = (np.eye(2) - n[:, :, None] * n[:, None, :]) / r[:, None, None]
        return r - self.radius, n, hessian


@dataclass(frozen=True)
class EllipseDomain:
    """The points with (x/a)^2 + (y/b)^2 <= 1.

    Args:
        a, b: half-axes along x and y [m].

    Raises:
        InputError: a half-axis is not a positive number.
    """

    a: float
    b: float

    def __post_init__(self) -> None:
        keep(self, positive, "m", "a", "b", what="domain {}")

    @property
    def half_extent(self) -> tuple[float, float]:
        return self.a, self.b

    def holds(self, xy: Floats) -> Bools:
        return np.asarray(np.hypot(xy[:, 0] / self.a, xy[:, 1] / self.b) <= 1.0)

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
        axes = np.array([self.a, self.b])
        # closest point: x_k = a_k^2 p_k / (a_k^2 + t) with sum (a_k p_k / (a_k^2 + t))^2 = 1;
        # in s = t + min(a)^2 the root is bracketed and the function convex, so Newton from the left end
        # converges monotonically; a little off the axes: on the long axis a closest point has a mirror image
        p = np.maximum(np.abs(xy), 1e-12 * axes)
        low = np.min(axes) ** 2
        shift = axes**2 - low
        t = np.maximum(np.max(axes * p - shift, axis=1), 1e-14 * low)
        _find_roots(axes * p, shift, 1e-14 * low, t)
        foot = np.where(xy < 0, -1.0, 1.0) * axes**2 * p / (t[:, None] + shift)
        normal = foot / axes**2
        normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        d = np.einsum("ij,ij->i", xy - foot, normal)
        curvature = 1.0 / (self.a**2 * self.b**2 * np.sum((foot / axes**2) ** 2, axis=1) ** 1.5)
        along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        bend = curvature / np.maximum(1.0 + d * curvature, 1e-3)
        return d, normal, bend[:, None, None] * along[:, :, None] * along[:, None, :]


@dataclass(frozen=True)
class Rectangle:
    """A rectangle centred on the origin of the plan: |x| <= width/2 and |y| <= depth/2.

    Args:
        size: width along x and depth along y [m].

    Raises:
        InputError: the size is not a pair of positive numbers.
    """

    size: tuple[float, float]

    def __post_init__(self) -> None:
        size = numbers("domain size", self.size, "two lengths in m: width along x, depth along y", 2)
        object.__setattr__(self, "size", tuple(positive("domain size", side, "m") for side in size))

    @property
    def half_extent(self) -> tuple[float, float]:
        return self.size[0] / 2, self.size[1] / 2

    def holds(self, xy: Floats) -> Bools:
        return np.asarray((np.abs(xy) <= self.half_extent).all(axis=1))

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
        q = np.abs(xy) - np.array(self.half_extent)
        outside = np.maximum(q, 0.0)
        corner = np.hypot(outside[:, 0], outside[:, 1])
        d = corner + np.minimum(np.max(q, axis=1), 0.0)
        nearest = np.eye(2)[np.argmax(q, axis=1)]
        n = np.where(corner[:, None] > 0, outside / np.maximum(corner, 1e-300)[:, None], nearest)
        bent = (outside > 0).all(axis=1)
        along = np.stack([-n[:, 1], n[:, 0]], axis=1) * np.sign(xy)
        hessian = np.where(bent, 1.0 / np.maximum(corner, 1e-300), 0.0)[:, None, None]
        return d, n * np.where(xy < 0, -1.0, 1.0), hessian * along[:, :, None] * along[:, None, :]


@njit("f2 f1 f f1")
def _find_roots(ap, shift, least, t):  # type: ignore[no-untyped-def]
    """Newton's method on  sum_k (a_k p_k / (t + shift_k))^2 = 1  for each row of ap, in place from below the root."""
    for n in range(len(t)):
        for _ in range(60):
            f, slope = -1.0, 0.0
            for k in range(2):
                part = (ap[n, k] / (t[n] + shift[k])) ** 2
                f += part
                slope -= 2.0 * part / (t[n] + shift[k])
            step = -f / min(slope, -1e-300) if slope < 0 else 0.0
            t[n] = max(t[n] + step, least)
            if abs(step) <= 1e-14 * t[n]:
                break


@dataclass(frozen=True, eq=False)
class Rim:
    """Closed polylines on a surface, fine enough to replace smooth curves; make one with `Rim.of`.

    Args:
        points: (n, 3) points of all loops, one loop after the other [m].
        inward: (n, 3) unit vectors in the surface, across the edge from each point to the next, towards the shell.
        after: (n,) index of the next point of the loop.
        off: largest distance to the rim from the loops, each in the sense in which it is given [m].
    """

    points: Floats
    inward: Floats
    after: Ints
    off: float = 0.0

    @staticmethod
    def of(
        loops: Sequence[Floats],
        onto: Callable[[Floats], Floats],
        normal: Callable[[Floats], Floats],
        given: Sequence[Given] = (),
    ) -> "Rim":
        """Refine loops into a rim, as they are drawn, with cubics where their points are those of a smooth curve.

        A point is a corner where the loop turns by more than 14 degrees, or curves three times as much as at both its
        neighbours. A straight side ends where the loop curves three times as much beyond as before, and turns as at the
        first of equal edges. Between corners and such ends six points or more are joined by cubics, and fewer by sides.

        Args:
            loops: closed polylines (n, 3) with the shell on their left, seen from outside [m].
            onto: moves points (n, 3) onto the surface.
            normal: outward unit normals (n, 3) of the surface at points.
            given: of each loop, how `off` is measured: seen from above, from its points in space and from its sides on
                the surface, or from these alone (default).
        """
        points, laid, plan, after, count = list[Floats](), [np.empty((0, 3))], [np.empty((0, 3))], list[Ints](), 0
        for all_points, sense in zip_longest(loops, given):
            length = np.linalg.norm(np.roll(all_points, -1, axis=0) - all_points, axis=1)
            loop = all_points[length > TOUCH * length.sum()]
            up = normal(onto(loop))
            upright = np.abs(up[:, 2:]) > UPRIGHT
            straight, smooth = _refined(loop, np.where(upright, np.copysign([0.0, 0.0, 1.0], up[:, 2:]), up))
            x = onto(smooth)
            if sense == "plan":
                plan.append(straight)
            else:
                laid.append(onto(straight[(straight != smooth).any(axis=1)]))
                laid += [loop] if sense == "space" else []
            x = x[np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1) > 0]
            points.append(x)
            after.append(count + (np.arange(len(x)) + 1) % len(x))
            count += len(x)
        x, onward = np.vstack(points), np.concatenate(after)
        along = x[onward] - x
        rim = Rim(x, unit(cross(normal(x + 0.5 * along), along)), onward)
        above = np.array([1.0, 1.0, 0.0])
        seen = replace(rim, points=above * rim.points)._farthest(above * np.vstack(plan))
        return replace(rim, off=max(seen, rim._farthest(np.vstack(laid))))

    def __repr__(self) -> str:
        return f"Rim({len(self.points)} points in {self.loops} loop{'s' * (self.loops != 1)})"

    @property
    def loops(self) -> int:
        """Number of loops."""
        return int(np.count_nonzero(self.after <= np.arange(len(self.after))))

    @cached_property
    def _before(self) -> Ints:
        result = np.empty_like(self.after)
        result[self.after] = np.arange(len(self.after))
        return result

    @cached_property
    def _balls(self) -> tuple[Ints, Floats, Floats]:
        """Balls, each around a run of points: where the runs begin (k + 1,), centres (k, 3) and radii (k,) [m]."""
        start = np.append(np.arange(0, len(self.points), IN_A_BALL), len(self.points))
        parts = [self.points[a:b] for a, b in pairwise(start.tolist())]
        centres = np.array([part.mean(axis=0) for part in parts])
        radii = [np.linalg.norm(part - centre, axis=1).max() for part, centre in zip(parts, centres, strict=True)]
        return start, centres, np.array(radii)

    def distance(self, x: Floats) -> Floats:
        """Signed distance (n,) [m] of points `x` (n, 3) near the surface to the nearest loop, positive inside."""
        edge, share = self.feet(x)
        other = np.where(share <= 0.0, self._before[edge], np.where(share >= 1.0, self.after[edge], edge))
        inward = self.inward[edge] + self.inward[other]  # at a corner the mean of both sides decides
        return dot(x - self.at(edge, share), inward) / np.sqrt(dot(inward, inward))

    def feet(self, x: Floats) -> tuple[Ints, Floats]:
        """The closest points of the rim to `x` (n, 3), as `at` takes them: the index (n,) of the nearest edge, and the
        fraction (n,) of it before the closest point."""
        edge, share = np.empty(len(x), dtype=np.intp), np.empty(len(x))
        _feet(x, self.points, self.after, self._before, *self._balls, edge, share)
        return edge, share

    def _farthest(self, x: Floats) -> float:
        """The largest distance of points (n, 3) from the rim [m]."""
        return float(np.linalg.norm(x - self.at(*self.feet(x)), axis=1).max(initial=0.0))

    def at(self, edge: Ints, share: Floats) -> Floats:
        """Points (n, 3) [m] on the edges (n,), at fractions `share` (n,) of their lengths."""
        first = self.points[edge]
        return np.asarray(first + share[:, None] * (self.points[self.after[edge]] - first))


@njit("f2 f2 i1 i1 i1 f2 f1 i1 f1")
def _feet(x, points, after, before, start, centres, radii, edges, shares):  # type: ignore[no-untyped-def]
    edge = 0
    for n in range(len(x)):
        edge, shares[n] = _nearest(x, n, points, after, before, start, centres, radii, edge)
        edges[n] = edge


@njit(error_model="numpy")
def _nearest(x, n, points, after, before, start, centres, radii, guess):  # type: ignore[no-untyped-def]
    """The nearer of the two edges that meet in the rim's point nearest to the n-th point, and the fraction of it before
    the closest point. With a near `guess` most balls are too far away to be searched."""
    px, py, pz = x[n, 0], x[n, 1], x[n, 2]
    nearest, least = guess, _square(px, py, pz, points, guess)
    far = np.sqrt(least)
    for ball in range(len(radii)):
        if _square(px, py, pz, centres, ball) < (far + radii[ball]) ** 2:
            for k in range(start[ball], start[ball + 1]):
                square = _square(px, py, pz, points, k)
                if square < least:
                    least, nearest = square, k
            far = np.sqrt(least)
    least, edge, along = np.inf, nearest, 0.0
    for k in (nearest, before[nearest]):
        ex, ey, ez = _edge(points, k, after[k])
        share = (px - points[k, 0]) * ex + (py - points[k, 1]) * ey + (pz - points[k, 2]) * ez
        share = min(max(share / (ex * ex + ey * ey + ez * ez), 0.0), 1.0)
        square = _square(px - share * ex, py - share * ey, pz - share * ez, points, k)
        if square < least:
            least, edge, along = square, k, share
    return edge, along


@njit()
def _square(px, py, pz, points, k):  # type: ignore[no-untyped-def]
    return (px - points[k, 0]) ** 2 + (py - points[k, 1]) ** 2 + (pz - points[k, 2]) ** 2


@njit()
def _edge(points, k, after):  # type: ignore[no-untyped-def]
    return points[after, 0] - points[k, 0], points[after, 1] - points[k, 1], points[after, 2] - points[k, 2]


def _turns(loop: Floats, sight: Floats) -> Floats:
    """Angles (n,) by which a closed polyline turns to the left at its points, seen against `sight` (n, 3)."""
    ahead = np.roll(loop, -1, axis=0) - loop
    before = np.roll(ahead, 1, axis=0)
    level = dot(before, ahead) - dot(before, sight) * dot(ahead, sight)
    return np.arctan2(dot(cross(before, ahead), sight), level)


def _refined(loop: Floats, sight: Floats) -> tuple[Floats, Floats]:
    """Some `POINTS` points of a loop or more, evenly spaced on each of its sides; and the same where it is smooth."""
    ahead, number = np.roll(loop, -1, axis=0) - loop, len(loop)
    length = np.linalg.norm(ahead, axis=1)
    s = np.cumsum(length) - length
    around = float(length.sum())
    count = np.ceil(POINTS * np.maximum(length / around, 1 / number)).astype(np.intp)
    begin, total = np.cumsum(count) - count, int(count.sum())
    side = np.repeat(np.arange(number), count)
    share = (np.arange(total) - begin[side]) / count[side]
    straight = loop[side] + share[:, None] * ahead[side]
    smooth, at = straight.copy(), s[side] + share * length[side]
    stops = np.flatnonzero(_stops(_turns(loop, sight), length))
    runs = list(pairwise([*stops.tolist(), *(stops[:1] + number).tolist()])) or [(-3, number + 3)]
    for first, last in runs:
        if last - first + 1 >= ON_A_CURVE:
            lap, k = np.divmod(np.arange(first, last + 1), number)
            rows = np.arange(total) if first < 0 else np.arange(begin[first], begin[k[-1]] + lap[-1] * total)
            beyond, rows = np.divmod(rows, total)
            smooth[rows] = on_curve(s[k] + lap * around, loop[k], at[rows] + beyond * around)
    return straight, smooth


def _stops(turn: Floats, length: Floats) -> Bools:
    """(n,) which points of a loop are corners, or ends of straight sides; see `Rim.of`."""
    turn, before = np.abs(turn), np.roll(length, 1)
    curvature = 2 * turn / (length + before)
    result = turn > CORNER
    curvature[result] = 0.0
    result |= curvature > UNLIKE * np.maximum(np.roll(curvature, 1), np.roll(curvature, -1))
    curvature[result] = 0.0
    for step, side in ((1, length), (-1, before)):
        straight, curved, further = (np.roll(curvature, k * step) for k in (1, -1, -2))
        foot = (UNLIKE * straight < curved) & (curvature < 0.7 * curved) & (further < 1.2 * curved)  # no inflection
        result |= foot & (2 * turn / side > 0.5 * curved)  # it turns as half an edge of the curve
    return result


def smooth_loop(loop: Floats, normals: Floats) -> Floats | None:
    """The loop (n, 3) with the jagged parts smoothed, such as missing faces leave; None if no part is jagged.

    It is a smoothing spline with third differences [Eilers and Marx 1996], which hardly shrink a circle: the smoothest
    whose vertices move by at most an edge length, and in the mean by what the steps of a lattice explain. Vertices
    outside of jagged parts do not move.

    Args:
        loop: (n, 3) closed polyline [m].
        normals: (n, 3) of the surface there.
    """
    free = _jagged(loop, normals)
    if not free.any():
        return None
    length = np.linalg.norm(np.roll(loop, -1, axis=0) - loop, axis=1)
    edge = np.max([np.roll(length, k) for k in (-1, 0, 1, 2)], axis=0)[:, None]  # the longest nearby

    def allowed(tried: Floats) -> bool:
        off = np.linalg.norm((tried - loop) / edge, axis=1)[free]
        return bool(off.max() <= MOST and np.sqrt(np.mean(off**2)) <= RMS)

    return smoothest(loop, lambda weight: _splined(loop, edge, free, weight), allowed, (-4.0, 10.0), HALVINGS)


def smoothest(
    given: Floats, splined: Callable[[float], Floats], allowed: Callable[[Floats], bool], powers: tuple[float, float],
    halvings: int,
) -> Floats:  # fmt: skip
    """The smoothing spline with the largest weight between two powers of ten that is allowed; else what is given."""
    (low, high), best = powers, given
    for _ in range(halvings):
        middle = (low + high) / 2
        tried = splined(10**middle)
        if allowed(tried):
            low, best = middle, tried
        else:
            high = middle
    return best


def _jagged(loop: Floats, normals: Floats) -> Bools:
    """(n,) which vertices are in jagged parts: rows of jogs at short distances."""
    count, turn = len(loop), _turns(loop, normals)
    after = np.roll(turn, -1)
    jogs = np.flatnonzero((turn * after < 0) & (np.minimum(np.abs(turn), np.abs(after)) > SHARP))
    result = np.zeros(count, dtype=bool)
    for row in _rows(jogs, count):
        if len(row) >= FEWEST:
            result[np.arange(row[0], row[-1] + 2) % count] = True
    return result


def _rows(jogs: Ints, count: int) -> list[Ints]:
    """The jogs of a closed loop in rows with short gaps; indices of the last may be larger than `count`."""
    if len(jogs) == 0:
        return []
    gaps = np.diff(jogs, append=jogs[0] + count)
    long = np.flatnonzero(gaps > RUN * np.sqrt(count))
    if len(long) == 0:
        return [np.append(jogs, jogs[0] + count)]
    first = long[-1] + 1  # a row begins after a long gap
    turned = np.concatenate([jogs[first:], jogs[:first] + count])
    return np.split(turned, np.flatnonzero(np.diff(turned) > RUN * np.sqrt(count)) + 1)


def _splined(loop: Floats, edge: Floats, free: Bools, weight: float) -> Floats:
    """The z (n, 3) that minimise |(z - loop) / edge|^2 + weight |third differences of z around the loop / edge|^2,
    with the vertices that are not free held."""
    count = len(loop)
    rows = np.arange(count)
    third = coo_matrix(
        (
            np.concatenate([np.full(count, factor) for factor in (-1.0, 3.0, -3.0, 1.0)]),
            (np.tile(rows, 4), np.concatenate([(rows + k) % count for k in range(4)])),
        )
    ).tocsr()
    third = diags_array(2 / (np.roll(edge[:, 0], -1) + np.roll(edge[:, 0], -2))) @ third
    keep = diags_array(1 / edge[:, 0] ** 2)
    system = (keep + weight * (third.T @ third)).tocsc()
    result = loop.copy()
    right = (keep @ loop - system[:, ~free] @ loop[~free])[free]
    result[free] = spsolve(system[free][:, free].tocsc(), right)
    return result
