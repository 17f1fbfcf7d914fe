"""What a solver asks of the supports of a shell: free directions, curvature, and a way back after a step."""

from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.model import Freedom

NO_CURVATURE = np.empty((0, 3, 3))


class Constraint(Protocol):
    """A manifold on which the state moves. The count of free directions of each block never changes."""

    def freedom(self, state: Floats) -> Freedom:
        """Free directions at `state` (n, 3)."""
        ...

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        """(n, 3, 3) contribution -lambda phi'' of the constraint forces to the Hessian, or an empty array."""
        ...

    def remaining(self, state: Floats) -> Floats | None:
        """(n, 3) prescribed displacement still to go, across the free directions [m]; None where nothing moves."""
        ...

    def retract(self, state: Floats) -> Floats:
        """The state moved back onto the manifold after a step along the free directions."""
        ...


@dataclass(frozen=True)
class Supports:
    """Fixed directions that never turn: supports, clamps, ghost nodes.

    Parameters
    ----------
    free : what remains free.
    moved : (k,) blocks that are prescribed, all their directions being fixed; goals : (k, 3) where they go [m].
    """

    free: Freedom
    moved: Ints = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    goals: Floats = field(default_factory=lambda: np.empty((0, 3)))

    def freedom(self, state: Floats) -> Freedom:
        return self.free

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        return NO_CURVATURE

    def remaining(self, state: Floats) -> Floats | None:
        if len(self.moved) == 0:
            return None
        result = np.zeros_like(state)
        result[self.moved] = self.goals - state[self.moved]
        return result

    def retract(self, state: Floats) -> Floats:
        return state
