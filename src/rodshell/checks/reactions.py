"""Reactions: what each support carries in equilibrium, and the balance of forces and moments.

The gradient of the elastic energy at a held end is the force of its support. A clamp acts on the ghost node past
the end too: its force there is the clamp's moment about the end. No part of this sees the balance, so the sums
check it: they vanish only if every free node is in equilibrium.
"""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats
from rodshell.model import Shell
from rodshell.solve.equilibrium import Equilibrium


@dataclass(frozen=True)
class Reactions:
    """Forces and moments of the supports on both ends of each rod in turn.

    Parameters
    ----------
    points : (2m, 3) where they act [m].
    forces : (2m, 3) [N].
    moments : (2m, 3), each about its own point [N m]; zero where the ends are pinned.
    """

    points: Floats
    forces: Floats
    moments: Floats

    @property
    def sum_of_forces(self) -> Floats:
        """(3,) [N]"""
        return np.asarray(self.forces.sum(axis=0))

    @property
    def about_middle(self) -> Floats:
        """(2m, 3) moments about the middle of all points [N m]."""
        return np.asarray(np.cross(self.points - self.points.mean(axis=0), self.forces) + self.moments)

    @property
    def sum_of_moments(self) -> Floats:
        """(3,) about the middle of all points [N m]."""
        return np.asarray(self.about_middle.sum(axis=0))

    @property
    def force_imbalance(self) -> float:
        """Size of the sum of forces over the largest force."""
        return _share(self.sum_of_forces, self.forces)

    @property
    def moment_imbalance(self) -> float:
        """Size of the sum of moments over the largest moment about the middle."""
        return _share(self.sum_of_moments, self.about_middle)


def reactions(shell: Shell, found: Equilibrium) -> Reactions:
    """Reactions of a shell without loads whose ends are held.

    Parameters
    ----------
    shell : with its source frames at the equilibrium.
    found : the equilibrium; its gradient at the held ends is what the supports exert.
    """
    state, gradient = found.state, found.gradient
    points = state[shell.ends]
    forces, moments = gradient[shell.ends], np.zeros_like(points)
    if len(shell.ghosts):
        at_ghosts = gradient[shell.ghosts]
        forces = forces + at_ghosts
        moments = np.cross(state[shell.ghosts] - points, at_ghosts)
    return Reactions(points, forces, moments)


def _share(total: Floats, parts: Floats) -> float:
    largest = float(np.linalg.norm(parts, axis=1).max(initial=0.0))
    return float(np.linalg.norm(total)) / largest if largest > 0 else 0.0
