"""What every elastic energy offers: a value, an exact gradient and an exact Hessian on small stencils.

The state of a shell is an (N, 3) array of *blocks*. A node is a block of three coordinates [m]; the twist
angle of an edge is a block of which only the first component is used [rad]. An element set names, for each
of its m elements, the k blocks that it touches: 2 for stretch, 3 for isotropic bending, 5 for bending and
twist (x, theta, x, theta, x). A solver sees only the sum of such sets.
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
        """Energy [J] at `state` (N, 3); adds its gradient to `gradient` (N, 3).

        Fills `hessians` (m, 3k, 3k) with the element Hessians, unless it is empty; rows and columns of the
        unused components of a twist angle are zero.
        """
        ...

    def refreshed(self, state: Floats) -> Self:
        """The same energy with its source frames moved to `state`; called at every accepted iterate."""
        ...
