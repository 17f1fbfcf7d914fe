"""Cables: straight between two nodes, elastic in tension, without any force when slack.

    E = EA/2 eps^2 l0 where eps = |x_b - x_a|/l0 - 1 > 0, else 0

A slack cable has exactly no energy, no force and no stiffness; its weight does not sag it. The Hessian jumps where it
becomes taut, the force does not.
"""

from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Bools, Floats, Ints, State
from rodshell.rods.elements import NO_HESSIANS, WithoutFrames
from rodshell.validation import brief


@dataclass(frozen=True, eq=False)
class CableStretch(WithoutFrames):
    """Tension-only members.

    Args:
        blocks: (m, 2) nodes of each cable.
        rest_lengths: (m,) at which it becomes taut [m].
        stiffness: (m,) EA [N].
    """

    blocks: Ints
    rest_lengths: Floats
    stiffness: Floats

    __repr__ = brief

    def times(self, factor: float) -> "CableStretch":
        """Cables so many times as stiff."""
        return replace(self, stiffness=factor * self.stiffness)

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        apart, length, strain = self._strains(state)
        taut = np.flatnonzero(strain > 0)
        if len(hessians):
            hessians[:] = 0.0
        force, axis = self.stiffness[taut] * strain[taut], apart[taut] / length[taut, None]
        pull = force[:, None] * axis
        np.subtract.at(gradient, self.blocks[taut, 0], pull)
        np.add.at(gradient, self.blocks[taut, 1], pull)
        if len(hessians):
            across = force / length[taut]
            along = self.stiffness[taut] / self.rest_lengths[taut] - across
            local = along[:, None, None] * axis[:, :, None] * axis[:, None, :] + across[:, None, None] * np.eye(3)
            hessians[taut, :3, :3] = hessians[taut, 3:, 3:] = local
            hessians[taut, :3, 3:] = hessians[taut, 3:, :3] = -local
        return 0.5 * float(np.sum(force * strain[taut] * self.rest_lengths[taut]))

    def stress_stiffness(self, state: State, motion: Floats, hessians: Floats) -> None:
        """Of the change of the tensions: see `Stressed.stress_stiffness`; slack cables stay slack, taut ones taut."""
        apart, length, strain = self._strains(state)
        axis = apart / length[:, None]
        along = np.einsum("ij,ij->i", axis, motion[self.blocks[:, 1]] - motion[self.blocks[:, 0]])
        change = np.where(strain > 0, self.stiffness * along / self.rest_lengths, 0.0) / length
        local = change[:, None, None] * (np.eye(3) - axis[:, :, None] * axis[:, None, :])
        hessians[:, :3, :3] = hessians[:, 3:, 3:] = local
        hessians[:, :3, 3:] = hessians[:, 3:, :3] = -local

    def forces(self, state: State) -> Floats:
        """(m,) tension [N] at `state` (N, 3); 0 where slack."""
        return np.asarray(self.stiffness * np.maximum(self._strains(state)[2], 0.0))

    def taut(self, state: State) -> Bools:
        """(m,) whether each cable carries a force at `state` (N, 3)."""
        return np.asarray(self._strains(state)[2] > 0)

    def _strains(self, state: State) -> tuple[Floats, Floats, Floats]:
        """From node to node (m, 3), its length (m,) [m], and the strains (m,), those of slack cables negative."""
        apart = state[self.blocks[:, 1]] - state[self.blocks[:, 0]]
        length = np.linalg.norm(apart, axis=1)
        return apart, length, length / self.rest_lengths - 1.0
