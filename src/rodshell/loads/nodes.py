"""What loads act on: the nodes of a shell, with the areas of the target that belong to them."""

from collections.abc import Sequence
from dataclasses import dataclass
from math import cos, sin

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.targets.tributary import Tributary
from rodshell.units import length_text
from rodshell.validation import brief

REACH = 1.0  # distances of two rods: a point load farther from every rod is refused


@dataclass(frozen=True, eq=False)
class LoadedNodes:
    """The nodes of a shell that loads act on.

    Args:
        positions: (n, 3) of the unloaded shell [m].
        mass: (n,) of rods and joints, lumped [kg].
        tributary: areas of the target that each node takes.
        spacing: distance of two neighbouring rods [m].
    """

    positions: Floats
    mass: Floats
    tributary: Tributary
    spacing: float

    __repr__ = brief

    @property
    def slopes(self) -> Floats:
        """(n,) angle of the surface with the plan at each node [rad]."""
        sizes = np.maximum(np.linalg.norm(self.tributary.vectors, axis=1), 1e-300)
        return np.asarray(np.arccos(np.clip(self.tributary.vectors[:, 2] / sizes, -1.0, 1.0)))

    def along(self, direction: float) -> Floats:
        """(n, 2) middles of the nodes' plan areas in axes along a `direction` [rad] and across it, from the middle of
        the plan's extent in each of them [m]."""
        x, y = self.tributary.plan_positions.T
        axes = np.array([cos(direction) * x + sin(direction) * y, cos(direction) * y - sin(direction) * x])
        return np.asarray((axes - 0.5 * (axes.min(axis=1) + axes.max(axis=1))[:, None]).T)

    def nearest(self, at: Sequence[float], what: str) -> int:
        """The node that is nearest to a point of the plan [m].

        Raises:
            InputError: `what` acts there, and no rod is near.
        """
        away = np.linalg.norm(self.positions[:, :2] - np.asarray(at), axis=1)
        nearest = int(np.argmin(away))
        if away[nearest] > REACH * self.spacing:
            raise InputError(
                f"{what} acts at ({at[0]:g}, {at[1]:g}) m, {length_text(float(away[nearest]))} away from the nearest "
                "rod: move it onto the shell"
            )
        return nearest

    def downwards(self, size: Floats) -> Floats:
        """(n, 3) forces of this size (n,) on each node, straight down."""
        result = np.zeros((len(size), 3))
        result[:, 2] = -size
        return result
