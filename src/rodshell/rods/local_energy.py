"""An energy of one's own: its formula alone, for a joint law, a support, a membrane or a load that the package has not.

Gradients come from complex steps, exact to round-off [Squire and Trapp 1998], Hessians from central differences of
these, to about 1e-8: Newton's method takes an iteration more now and then, and arrives at the same equilibrium.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints, State
from rodshell.errors import InputError
from rodshell.rods.elements import NO_HESSIANS, WithoutFrames
from rodshell.validation import array, function_of

TINY = 1e-200  # complex step: no difference is taken, so nothing is lost
STEP = 1e-6  # of the extent of the nodes: step of the differences


@dataclass(frozen=True, eq=False)
class LocalEnergy(WithoutFrames):
    """A sum of energies of a few nodes each, see `rodshell.settle`.

    Args:
        blocks: (m, k) the nodes of each of its m parts.
        formula: of the positions (m, k, 3) of these nodes [m], the energy (m,) of each part [J]: written with NumPy,
            and for complex numbers too (`np.sqrt((v * v).sum(-1))` in place of `np.linalg.norm(v, axis=-1)`; no `abs`,
            which forgets the step). A force that is constant is an energy as well, less the work that it does.

    Raises:
        InputError: the formula is not a function of positions; the nodes are not a table of whole numbers.
    """

    blocks: Ints
    formula: Callable[[NDArray[Any]], NDArray[Any]]

    def __post_init__(self) -> None:
        blocks = array("the nodes of an energy", self.blocks, np.intp, None, None)
        if (blocks < 0).any():
            raise InputError(f"the nodes of an energy are counted from 0: {blocks.min()} is below")
        object.__setattr__(self, "blocks", np.ascontiguousarray(blocks))
        wanted = "a function of the positions (m, k, 3) of nodes"
        function_of("the formula of an energy", self.formula, wanted, np.zeros((*blocks.shape, 3)))

    def times(self, factor: float) -> "LocalEnergy":
        """The energy times a factor."""
        formula = self.formula
        return LocalEnergy(self.blocks, lambda at: factor * formula(at))

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        at = state[self.blocks]
        np.add.at(gradient, self.blocks, self._gradient(at))
        if hessians.size:
            step = STEP * float(np.ptp(state[self.blocks.ravel()], axis=0).max() or 1.0)
            for k, x in np.ndindex(at.shape[1:]):
                ahead, behind = at.copy(), at.copy()
                ahead[:, k, x] += step
                behind[:, k, x] -= step
                change = self._gradient(ahead) - self._gradient(behind)
                hessians[:, :, 3 * k + x] = change.reshape(len(at), -1) / (2 * step)
            hessians[:] = 0.5 * (hessians + hessians.swapaxes(1, 2))
        return float(self._energies(at).sum())

    def _gradient(self, at: Floats) -> Floats:
        gradient = np.empty_like(at)
        for k, x in np.ndindex(at.shape[1:]):
            stepped = at.astype(complex)
            stepped[:, k, x] += 1j * TINY
            gradient[:, k, x] = self._energies(stepped).imag / TINY
        return gradient

    def _energies(self, at: NDArray[Any]) -> NDArray[Any]:
        found = np.asarray(self.formula(at))
        if found.shape != at.shape[:1]:
            raise InputError(
                f"the formula of an energy gives an array of shape {found.shape}: give one energy for each of its "
                f"{len(at)} parts"
            )
        if np.iscomplexobj(at) and not np.iscomplexobj(found):
            raise InputError(
                "the formula of an energy gives real numbers for complex positions, so that it has no gradient: "
                "leave abs, real and norm out of it"
            )
        return found
