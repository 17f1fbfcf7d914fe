"""Contact with a target in statics: nodes bound to its surface (a constraint), and unilateral contact (an energy)."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Self

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.frames import dot
from rodshell.kernels import njit
from rodshell.model import Freedom
from rodshell.rods.elements import NO_HESSIANS
from rodshell.targets import Gap, Target
from rodshell.validation import brief


@dataclass(frozen=True, eq=False)
class BoundToTarget:
    """Every node on the surface, where it slides in its two tangent directions, or fewer; a constraint with curvature.

    Parameters
    ----------
    target : the surface, continued past its end.
    count : (n,) free directions of each node: 2 in the tangent plane; 1 along `guides`; 0 held.
    guides : (n, 3) direction that a node with one free direction follows (its part in the tangent plane).
    """

    target: Target
    count: Ints
    guides: Floats

    __repr__ = brief

    @cached_property
    def _latest(self) -> "_Latest":
        return _Latest(self)

    def freedom(self, state: Floats) -> Freedom:
        """The free directions of the nodes (n, 3) [m]."""
        return self._latest.at(state).freedom

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        """(n, 3, 3) what the surface's curvature adds to the Hessian for a `gradient` (n, 3) [N].

        Parameters
        ----------
        state : (n, 3) nodes [m].
        gradient : (n, 3) of the energy there [N].
        """
        surface = self._latest.at(state).surface
        return -dot(surface.normal, gradient)[:, None, None] * surface.hessian

    def remaining(self, state: Floats) -> Floats | None:
        """None: nothing is prescribed."""
        return None

    def retract(self, state: Floats) -> Floats:
        """The nodes (n, 3) put back on the surface [m]."""
        return self.target.retract(state)


class _Latest:
    """Free directions and curvature at the latest state: a solver needs them several times at each state."""

    def __init__(self, bound: BoundToTarget) -> None:
        self._bound, self._points = bound, np.empty((0, 3))

    def at(self, points: Floats) -> "_Latest":
        """This, at `points` (n, 3) [m]."""
        if not np.array_equal(points, self._points):
            self._points = points.copy()
            self.__dict__.pop("freedom", None)
            self.__dict__.pop("surface", None)
        return self

    @cached_property
    def freedom(self) -> Freedom:
        bound = self._bound
        return Freedom(_tangents(bound.target.level(self._points)[1], bound.guides), bound.count)

    @cached_property
    def surface(self) -> Gap:
        return self._bound.target.on_surface(self._points)


@dataclass(frozen=True, eq=False)
class UnilateralContact:
    """Unilateral, frictionless contact as an energy: the augmented Lagrangian of gap >= 0 at every node.

    E = (max(0, p - k gap)^2 - p^2) / 2k for each node; its force is max(0, p - k gap) along the normal.

    Parameters
    ----------
    target : its body, closed by the wall below its rim.
    blocks : (m, 1) nodes.
    stiffness : (m,) k [N/m].
    multipliers : (m,) p [N]: the contact force at the solution, updated by the caller.
    """

    target: Target
    blocks: Ints
    stiffness: Floats
    multipliers: Floats

    __repr__ = brief

    def forces(self, state: Floats) -> Floats:
        """(m,) contact forces [N] at `state` (N, 3).

        Parameters
        ----------
        state : (N, 3) [m].
        """
        gap = self.target.contact(state[self.blocks[:, 0]]).distance
        return np.maximum(0.0, self.multipliers - self.stiffness * gap)

    def updated(self, state: Floats) -> "UnilateralContact":
        """The next multipliers: the forces at `state`."""
        return replace(self, multipliers=self.forces(state))

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        nodes = self.blocks[:, 0]
        gap = self.target.contact(state[nodes])
        force = np.maximum(0.0, self.multipliers - self.stiffness * gap.distance)
        gradient[nodes] -= force[:, None] * gap.normal
        if len(hessians):
            push = np.where(force > 0, self.stiffness, 0.0)[:, None, None]
            hessians[:] = push * gap.normal[:, :, None] * gap.normal[:, None, :] - force[:, None, None] * gap.hessian
        return float(np.sum((force**2 - self.multipliers**2) / (2 * self.stiffness)))

    def refreshed(self, state: Floats) -> Self:
        """The contact itself: there are no source frames."""
        return self


@njit(error_model="numpy")
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
