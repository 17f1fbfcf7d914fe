"""Closed curves on a surface, between what is the shell and what is not."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numba import njit

from rodshell.arrays import Floats, Ints
from rodshell.geometry.curves import on_curve
from rodshell.geometry.vectors import cross, dot, unit

CORNER = 0.5  # cosine of 60 degrees between edges of a loop: it is not rounded there
POINTS = 1500  # on each loop
IN_A_BALL = 32  # of these


@dataclass(frozen=True, eq=False)
class Rim:
    """Closed polylines on a surface, fine enough to be taken for smooth curves.

    Parameters
    ----------
    points : (n, 3) of all loops in a row [m].
    inward : (n, 3) unit vectors in the surface, across the edge from each point to the next, towards the shell.
    after : (n,) index of the next point of the loop.
    """

    points: Floats
    inward: Floats
    after: Ints

    @staticmethod
    def of(loops: Sequence[Floats], onto: Callable[[Floats], Floats], normal: Callable[[Floats], Floats]) -> "Rim":
        """Loops (n, 3), the shell on the left seen from outside; `onto` puts points on the surface."""
        points, edges, after, count = list[Floats](), list[Floats](), list[Ints](), 0
        for loop in loops:
            x = onto(_rounded(loop))
            x = x[np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1) > 0]
            points.append(x)
            edges.append(np.roll(x, -1, axis=0) - x)
            after.append(count + (np.arange(len(x)) + 1) % len(x))
            count += len(x)
        x, along = np.vstack(points), np.vstack(edges)
        return Rim(x, unit(cross(normal(x + 0.5 * along), along)), np.concatenate(after))

    @property
    def loops(self) -> int:
        return int(np.count_nonzero(self.after <= np.arange(len(self.after))))

    @cached_property
    def _before(self) -> Ints:
        result = np.empty_like(self.after)
        result[self.after] = np.arange(len(self.after))
        return result

    @cached_property
    def _balls(self) -> tuple[Ints, Floats, Floats]:
        """Balls around a few points in a row each: where these begin (k + 1,), centres (k, 3) and radii (k,) [m]."""
        start = np.append(np.arange(0, len(self.points), IN_A_BALL), len(self.points))
        parts = [self.points[a:b] for a, b in pairwise(start.tolist())]
        centres = np.array([part.mean(axis=0) for part in parts])
        radii = [np.linalg.norm(part - centre, axis=1).max() for part, centre in zip(parts, centres, strict=True)]
        return start, centres, np.array(radii)

    def distance(self, x: Floats) -> Floats:
        """Signed distance (n,) of points near the surface to the nearest loop [m], positive inside."""
        result = np.empty(len(x))
        _distance(x, self.points, self.inward, self.after, self._before, *self._balls, result)
        return result

    def feet(self, x: Floats) -> tuple[Ints, Floats]:
        """The edge (n,) nearest to each point (n, 3), and the share (n,) of it that lies before the nearest point."""
        edge, share = np.empty(len(x), dtype=np.intp), np.empty(len(x))
        _feet(x, self.points, self.after, self._before, *self._balls, edge, share)
        return edge, share

    def at(self, edge: Ints, share: Floats) -> Floats:
        """Points (n, 3) on the edges [m]."""
        first = self.points[edge]
        return np.asarray(first + share[:, None] * (self.points[self.after[edge]] - first))


@njit(cache=True, error_model="numpy")
def _distance(x, points, inward, after, before, start, centres, radii, result):  # type: ignore[no-untyped-def]
    """From the nearest edge; beside a corner both edges count."""
    edge = 0
    for n in range(len(x)):
        edge, along = _nearest(x, n, points, after, before, start, centres, radii, edge)
        ex, ey, ez = _edge(points, edge, after[edge])
        ix, iy, iz = inward[edge]
        if along <= 0.0 or along >= 1.0:
            beside = before[edge] if along <= 0.0 else after[edge]
            ix, iy, iz = ix + inward[beside, 0], iy + inward[beside, 1], iz + inward[beside, 2]
        ox, oy, oz = (
            x[n, 0] - along * ex - points[edge, 0],
            x[n, 1] - along * ey - points[edge, 1],
            x[n, 2] - along * ez - points[edge, 2],
        )
        result[n] = (ox * ix + oy * iy + oz * iz) / np.sqrt(ix * ix + iy * iy + iz * iz)


@njit(cache=True, error_model="numpy")
def _feet(x, points, after, before, start, centres, radii, edges, shares):  # type: ignore[no-untyped-def]
    edge = 0
    for n in range(len(x)):
        edge, shares[n] = _nearest(x, n, points, after, before, start, centres, radii, edge)
        edges[n] = edge


@njit(cache=True, error_model="numpy")
def _nearest(x, n, points, after, before, start, centres, radii, guess):  # type: ignore[no-untyped-def]
    """That edge of those two that meet in the point nearest to the n-th which is nearer, and the share of it that lies
    before the foot. Where the `guess` is near, most balls are too far away to be looked into."""
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


@njit(cache=True)
def _square(px, py, pz, points, k):  # type: ignore[no-untyped-def]
    return (px - points[k, 0]) ** 2 + (py - points[k, 1]) ** 2 + (pz - points[k, 2]) ** 2


@njit(cache=True)
def _edge(points, k, after):  # type: ignore[no-untyped-def]
    return points[after, 0] - points[k, 0], points[after, 1] - points[k, 1], points[after, 2] - points[k, 2]


def _rounded(loop: Floats) -> Floats:
    """A finer loop, by cubics through its points between corners."""
    before, ahead = loop - np.roll(loop, 1, axis=0), np.roll(loop, -1, axis=0) - loop
    cosine = dot(before, ahead) / np.maximum(np.linalg.norm(before, axis=1) * np.linalg.norm(ahead, axis=1), 1e-300)
    corners = np.flatnonzero(cosine < CORNER)
    pieces = max(1, int(np.ceil(POINTS / len(loop))))
    if len(corners) == 0:
        reach = min(3, len(loop))
        return _piece(np.vstack([loop[-reach:], loop, loop[: reach + 1]]), pieces)[reach * pieces : -reach * pieces - 1]
    turned = np.roll(loop, -corners[0], axis=0)
    stops = np.append(corners - corners[0], len(loop))
    closed = np.vstack([turned, turned[:1]])
    return np.vstack([_piece(closed[a : b + 1], pieces)[:-1] for a, b in pairwise(stops.tolist())])


def _piece(points: Floats, pieces: int) -> Floats:
    s = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))
    fine = np.interp(np.arange((len(s) - 1) * pieces + 1) / pieces, np.arange(len(s)), s)
    if len(points) < 4:
        return np.column_stack([np.interp(fine, s, points[:, k]) for k in range(3)])
    return on_curve(s, points, fine)
