"""Unilateral frictionless contact as an energy: the augmented Lagrangian of gap >= 0 at every node."""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.rods.elements import NO_HESSIANS
from rodshell.targets import Target


@dataclass(frozen=True)
class UnilateralContact:
    """E = (max(0, p - k gap)^2 - p^2) / 2k for each node; its force is max(0, p - k gap) along the normal.

    Parameters
    ----------
    target : its body, closed by the wall under its rim.
    blocks : (m, 1) nodes.
    stiffness : (m,) k [N/m].
    multipliers : (m,) p [N]: the contact force at the solution, updated from outside.
    """

    target: Target
    blocks: Ints
    stiffness: Floats
    multipliers: Floats

    def forces(self, state: Floats) -> Floats:
        """(m,) contact forces [N]."""
        gap = self.target.contact(state[self.blocks[:, 0]]).distance
        return np.maximum(0.0, self.multipliers - self.stiffness * gap)

    def updated(self, state: Floats) -> "UnilateralContact":
        """The next multipliers: the forces at `state`."""
        return replace(self, multipliers=self.forces(state))

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        nodes = self.blocks[:, 0]
        gap = self.target.contact(state[nodes])
        force = np.maximum(0.0, self.multipliers - self.stiffness * gap.distance)
        gradient[nodes] -= force[:, None] * gap.normal
        if len(hessians):
            push = np.where(force > 0, self.stiffness, 0.0)[:, None, None]
            hessians[:] = push * gap.normal[:, :, None] * gap.normal[:, None, :] - force[:, None, None] * gap.hessian
        return float(np.sum((force**2 - self.multipliers**2) / (2 * self.stiffness)))

    def refreshed(self, state: Floats) -> Self:
        return self
