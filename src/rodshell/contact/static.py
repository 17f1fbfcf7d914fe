"""Contact with a target in statics: nodes bound to its surface (a constraint), and unilateral contact (an energy)."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.kernels import njit
from rodshell.model import Freedom
from rodshell.rods.elements import NO_HESSIANS, WithoutFrames
from rodshell.targets import Target
from rodshell.targets.target import shape_operators
from rodshell.validation import brief


@dataclass(frozen=True, eq=False)
class BoundToTarget:
    """Every node on the surface, where it slides in its two tangent directions, or fewer; a constraint with curvature.

    Args:
        target: the surface, continued past its end.
        count: (n,) free directions of each node: 2 in the tangent plane; 1 along `guides`; 0 held.
        guides: (n, 3) direction that a node with one free direction follows (its part in the tangent plane).
    """

    target: Target
    count: Ints
    guides: Floats

    __repr__ = brief

    @cached_property
    def _latest(self) -> list[tuple[Floats, Freedom]]:
        """The latest state (n, 3) [m] with its free directions."""
        return []

    def freedom(self, state: Floats) -> Freedom:
        """The free directions of the nodes (n, 3) [m], which are kept: a solver asks for them several times a state."""
        if not (self._latest and state is self._latest[0][0]):
            gradient = self.target.level(state)[1]
            self._latest[:] = [(state, Freedom(_tangents(gradient, self.guides), self.count))]
        return self._latest[0][1]

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        """(n, 3, 3) what the surface's curvature adds to the Hessian for a `gradient` (n, 3) [N]."""
        _, slope, hessian = self.target.implicit(state)
        normal, curvature = np.empty_like(slope), np.empty_like(hessian)
        shape_operators(slope, hessian, -gradient, normal, curvature)
        return curvature

    def remaining(self, state: Floats) -> Floats | None:
        """None: nothing is prescribed."""
        return None

    def retract(self, state: Floats) -> Floats:
        """The nodes (n, 3) put back on the surface [m]."""
        return self.target.retract(state)


@dataclass(frozen=True, eq=False)
class UnilateralContact(WithoutFrames):
    """Unilateral, frictionless contact as an energy: the augmented Lagrangian of gap >= 0 at every node.

    E = (max(0, p - k gap)^2 - p^2) / 2k for each node; its force is max(0, p - k gap) along the normal.

    Args:
        target: its body, closed by the wall below its rim.
        blocks: (m, 1) nodes.
        stiffness: (m,) k [N/m].
        multipliers: (m,) p [N]: the contact force at the solution, updated by the caller.
    """

    target: Target
    blocks: Ints
    stiffness: Floats
    multipliers: Floats

    __repr__ = brief

    def forces(self, state: Floats) -> Floats:
        """(m,) contact forces [N] at `state` (N, 3)."""
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


@njit("f2 f2")
def _tangents(steepest, guides):  # type: ignore[no-untyped-def]
    """(n, 3, 3) two directions across `steepest` (n, 3), the first nearest to `guides` (n, 3); the third is zero."""
    directions = np.empty((len(steepest), 3, 3))
    for i in range(len(steepest)):
        nx, ny, nz = steepest[i, 0], steepest[i, 1], steepest[i, 2]
        gx, gy, gz = guides[i, 0], guides[i, 1], guides[i, 2]
        square = nx * nx + ny * ny + nz * nz
        share = (gx * nx + gy * ny + gz * nz) / square
        ax, ay, az = gx - share * nx, gy - share * ny, gz - share * nz
        bx, by, bz = ny * az - nz * ay, nz * ax - nx * az, nx * ay - ny * ax
        to_a = 1.0 / np.sqrt(ax * ax + ay * ay + az * az)
        to_b = to_a / np.sqrt(square)
        directions[i, 0, 0], directions[i, 0, 1], directions[i, 0, 2] = to_a * ax, to_a * ay, to_a * az
        directions[i, 1, 0], directions[i, 1, 1], directions[i, 1, 2] = to_b * bx, to_b * by, to_b * bz
        directions[i, 2, 0] = directions[i, 2, 1] = directions[i, 2, 2] = 0.0
    return directions
