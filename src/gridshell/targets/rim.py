"""Closed curves on a surface, between what is the shell and what is not."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from gridshell.geometry.curves import on_curve
from gridshell.geometry.vectors import cross, dot, unit

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

CORNER = 0.5  # cosine of 60 degrees between edges of a loop: it is not rounded there
POINTS = 1500  # on each loop


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

    @cached_property
    def _before(self) -> Ints:
        result = np.empty_like(self.after)
        result[self.after] = np.arange(len(self.after))
        return result

    @cached_property
    def _tree(self) -> "cKDTree":
        from scipy.spatial import cKDTree

        return cKDTree(self.points)

    def distance(self, x: Floats) -> Floats:
        """Signed distance (n,) of points near the surface to the nearest loop [m], positive inside."""
        nearest = self._tree.query(x)[1]
        start = np.stack([nearest, self._before[nearest]])
        a, b = self.points[start], self.points[self.after[start]]
        along = b - a
        share = np.clip(np.einsum("kni,kni->kn", x - a, along) / np.einsum("kni,kni->kn", along, along), 0.0, 1.0)
        off = x - a - share[..., None] * along
        which = np.argmin(np.einsum("kni,kni->kn", off, off), axis=0)
        pick = np.arange(len(x))
        edge, share, off = start[which, pick], share[which, pick], off[which, pick]
        inward = self.inward[edge]
        for at_end, neighbour in ((share <= 0.0, self._before), (share >= 1.0, self.after)):
            inward = np.where(at_end[:, None], inward + self.inward[neighbour[edge]], inward)  # beside a corner
        return dot(off, inward) / np.linalg.norm(inward, axis=1)


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
