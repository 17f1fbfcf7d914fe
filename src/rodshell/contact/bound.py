"""Nodes bound to a target: each slides on the surface in its two tangent directions, or less."""

from dataclasses import dataclass
from functools import cached_property

import numba as nb
import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.vectors import dot
from rodshell.model import Freedom
from rodshell.targets import Gap, Target


@dataclass(frozen=True)
class BoundToTarget:
    """Every node on the surface; a constraint with curvature.

    Parameters
    ----------
    target : the surface, continued past its end.
    count : (n,) free directions of each node: 2 in the tangent plane; 1 along `guides`; 0 held.
    guides : (n, 3) direction that a node with one freedom follows (its part in the tangent plane).
    """

    target: Target
    count: Ints
    guides: Floats

    @cached_property
    def _surface(self) -> "_Latest":
        return _Latest(self.target)

    def freedom(self, state: Floats) -> Freedom:
        return Freedom(_tangents(self._surface.at(state).normal, self.guides), self.count)

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        surface = self._surface.at(state)
        return -dot(surface.normal, gradient)[:, None, None] * surface.hessian

    def remaining(self, state: Floats) -> Floats | None:
        return None

    def retract(self, state: Floats) -> Floats:
        return self.target.retract(state)

    def contact_forces(self, state: Floats, gradient: Floats) -> Floats:
        """(n,) force of the target on each node along the outward normal [N]; negative where it pulls."""
        return dot(self._surface.at(state).normal, gradient)


class _Latest:
    """Normals and curvature of a target where they were last asked for: a solver asks several times at one state."""

    def __init__(self, target: Target) -> None:
        self._target = target
        self._points = np.empty((0, 3))
        self._found = target.on_surface(self._points)

    def at(self, points: Floats) -> Gap:
        if not np.array_equal(points, self._points):
            self._points, self._found = points.copy(), self._target.on_surface(points)
        return self._found


@nb.njit(cache=True, error_model="numpy")
def _tangents(steepest, guides):  # type: ignore[no-untyped-def]
    """(n, 3, 3) two directions across `steepest` (n, 3), the first nearest to `guides` (n, 3); the third is zero."""
    directions = np.zeros((len(steepest), 3, 3))
    for i in range(len(steepest)):
        n, g, along, across = steepest[i], guides[i], directions[i, 0], directions[i, 1]
        length = np.sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2])
        share = (g[0] * n[0] + g[1] * n[1] + g[2] * n[2]) / length**2
        for k in range(3):
            along[k] = g[k] - share * n[k]
        width = np.sqrt(along[0] ** 2 + along[1] ** 2 + along[2] ** 2)
        for k in range(3):
            along[k] /= width
        for k in range(3):
            a, b = (k + 1) % 3, (k + 2) % 3
            across[k] = (n[a] * along[b] - n[b] * along[a]) / length
    return directions
