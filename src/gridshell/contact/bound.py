"""Nodes bound to a target: each slides on the surface in its two tangent directions, or less."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gridshell.geometry.vectors import cross, dot, unit
from gridshell.model import Freedom
from gridshell.targets import Target

Floats = NDArray[np.float64]


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
    count: NDArray[np.intp]
    guides: Floats

    def freedom(self, state: Floats) -> Freedom:
        normal = self.target.on_surface(state).normal
        along = self.guides - dot(self.guides, normal)[:, None] * normal
        along = unit(along)
        directions = np.zeros((len(state), 3, 3))
        directions[:, 0], directions[:, 1] = along, cross(normal, along)
        return Freedom(directions, self.count)

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        surface = self.target.on_surface(state)
        return -dot(surface.normal, gradient)[:, None, None] * surface.hessian

    def remaining(self, state: Floats) -> Floats | None:
        return None

    def retract(self, state: Floats) -> Floats:
        return self.target.retract(state)

    def contact_forces(self, state: Floats, gradient: Floats) -> Floats:
        """(n,) force of the target on each node along the outward normal [N]; negative where it pulls."""
        return dot(self.target.on_surface(state).normal, gradient)
