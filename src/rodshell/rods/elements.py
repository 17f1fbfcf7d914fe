"""What every elastic energy offers: a value, an exact gradient and an exact Hessian on small stencils.

The state of a shell is an (N, 3) array of *blocks*. A node is a block of three coordinates [m]; the twist
angle of an edge is a block of which only the first component is used [rad]. An element set names, for each
of its m elements, the k blocks that it touches: 2 for stretch, 3 for isotropic bending, 5 for bending and
twist (x, theta, x, theta, x). A solver sees only the sum of such sets [HQK Eq 1, 2, 4].
"""

from typing import Protocol, Self

import numpy as np

from rodshell.arrays import Floats, Ints

NO_HESSIANS = np.empty((0, 0, 0))


class Elements(Protocol):
    """A sum of local energies.

    Attributes
    ----------
    blocks : (m, k) blocks of each element.
    """

    @property
    def blocks(self) -> Ints: ...

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], with its gradient and, where wanted, its Hessians.

        Parameters
        ----------
        state : (N, 3) node positions [m] and twist angles [rad].
        gradient : (N, 3), to which the energy's gradient is added [N, for angles N m].
        hessians : (m, 3k, 3k), filled with the element Hessians unless empty; rows and columns of the unused
            components of a twist angle are zero.
        """
        ...

    def refreshed(self, state: Floats) -> Self:
        """The same energy with its source frames moved to `state`; called at each accepted iterate."""
        ...
