"""Seams: curves in the plan along which a target is cut, straight down, into patches."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError

REACH = 1e3  # lengths of an open seam by which its two ends go on straight


@dataclass(frozen=True, eq=False)
class Seam:
    """A polyline in the plan; it goes on straight past both its ends, unless it is closed.

    Parameters
    ----------
    points : (n, 2) as they were given [m].
    """

    points: Floats

    @staticmethod
    def of(points: ArrayLike) -> "Seam":
        """From points (n, 2) or (n, 3), whose heights do not count [m].

        Raises
        ------
        InputError : fewer than two different points, or one that is not finite.
        """
        given = np.asarray(points, dtype=float)
        if given.ndim != 2 or given.shape[1] not in (2, 3) or not np.isfinite(given).all():
            raise InputError(f"a seam is a row of points (x, y) of finite numbers, not of the shape {given.shape}")
        plan = given[:, :2]
        plan = plan[np.append(True, np.linalg.norm(np.diff(plan, axis=0), axis=1) > 0)]
        if len(plan) < 2:
            raise InputError("a seam needs two different points at least: it is a line across the plan")
        return Seam(plan)

    @property
    def closed(self) -> bool:
        return len(self.points) > 3 and bool(np.all(self.points[0] == self.points[-1]))

    @cached_property
    def _corners(self) -> Floats:
        """The points, the first and the last moved far out."""
        x = self.points.copy()
        if not self.closed:
            far = REACH * float(np.linalg.norm(np.ptp(x, axis=0)))
            first, last = x[0] - x[1], x[-1] - x[-2]
            x[0] += far * first / np.linalg.norm(first)
            x[-1] += far * last / np.linalg.norm(last)
        return x

    def distance(self, x: Floats) -> Floats:
        """Signed distance in plan (n,) of the points (n, 2 or 3) [m], positive to the left of the seam's direction."""
        k, share, off = self._nearest(x)
        edge = np.diff(self._corners, axis=0)
        left = np.column_stack([-edge[:, 1], edge[:, 0]]) / np.linalg.norm(edge, axis=1)[:, None]
        joined = self.closed
        before = np.where((share <= 0.0) & ((k > 0) | joined), k - 1, k)
        after = np.where((share >= 1.0) & ((k < len(edge) - 1) | joined), (k + 1) % len(edge), k)
        side = left[before] + left[after]  # at a corner the mean of both sides decides
        return np.asarray(np.copysign(np.linalg.norm(off, axis=1), np.einsum("ni,ni->n", off, side)))

    def _nearest(self, x: Floats) -> tuple[Ints, Floats, Floats]:
        """Of each point (n, 2 or 3): the nearest edge, its share up to the nearest place, and the way from there."""
        start, edge = self._corners[:-1], np.diff(self._corners, axis=0)
        off = x[:, None, :2] - start
        share = np.clip(np.einsum("nki,ki->nk", off, edge) / np.einsum("ki,ki->k", edge, edge), 0.0, 1.0)
        off = off - share[..., None] * edge
        k = np.argmin(np.einsum("nki,nki->nk", off, off), axis=1)
        row = np.arange(len(x))
        return k, share[row, k], off[row, k]
