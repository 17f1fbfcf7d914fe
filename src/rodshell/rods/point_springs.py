"""Springs between nodes and points of space, along the axes: supports that yield."""

from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Floats, Ints, State
from rodshell.rods.elements import NO_HESSIANS, WithoutFrames
from rodshell.validation import brief


@dataclass(frozen=True, eq=False)
class PointSprings(WithoutFrames):
    """Springs along x, y and z between nodes and points.

    Args:
        blocks: (m, 1) the nodes.
        points: (m, 3) where the springs are free of force [m].
        stiffness: (m, 3) [N/m].
    """

    blocks: Ints
    points: Floats
    stiffness: Floats

    __repr__ = brief

    def times(self, factor: float) -> "PointSprings":
        """Springs so many times as stiff."""
        return replace(self, stiffness=factor * self.stiffness)

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        moved = state[self.blocks[:, 0]] - self.points
        np.add.at(gradient, self.blocks[:, 0], self.stiffness * moved)
        if hessians.size:
            hessians[:] = self.stiffness[:, :, None] * np.eye(3)
        return 0.5 * float(np.sum(self.stiffness * moved * moved))
