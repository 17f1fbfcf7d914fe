"""What a design does: to the stiffnesses of edges, to their rest lengths, and to where rod ends are held."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array, hstack

from rodshell.arrays import Floats
from rodshell.model.edge_properties import LENGTH, PROPERTIES

STIFFNESSES = 4  # EA, EI1, EI2, GJ


@dataclass(frozen=True, eq=False)
class Change:
    """The effect of n variables on e edges and on k held blocks, with its derivatives.

    Args:
        stiffness: (e, 4) logarithms of the factors on EA, EI1, EI2 and GJ.
        stiffness_slopes: (4e, n).
        lengths: (e,) what is added to the rest lengths [m].
        length_slopes: (e, n) [m].
        held: (k, 3) displacement of the rod ends, and of the ghost nodes of clamps after them [m].
        held_slopes: (n, k, 3) [m].
    """

    stiffness: Floats
    stiffness_slopes: csc_array
    lengths: Floats
    length_slopes: csc_array
    held: Floats
    held_slopes: Floats

    @staticmethod
    def none(edges: int, held: int, variables: int) -> "Change":
        """No effect of so many `variables` on so many `edges` and `held` blocks."""
        return Change(
            np.zeros((edges, STIFFNESSES)), csc_array((STIFFNESSES * edges, variables)),
            np.zeros(edges), csc_array((edges, variables)),
            np.zeros((held, 3)), np.zeros((variables, held, 3)),
        )  # fmt: skip

    @staticmethod
    def together(parts: Sequence["Change"]) -> "Change":
        """The effect of several sets of variables, one after the other: factors multiply, lengths and displacements add
        up.
        """
        return Change(
            sum(part.stiffness for part in parts),  # type: ignore[arg-type]
            csc_array(hstack([part.stiffness_slopes for part in parts])),
            sum(part.lengths for part in parts),  # type: ignore[arg-type]
            csc_array(hstack([part.length_slopes for part in parts])),
            sum(part.held for part in parts),  # type: ignore[arg-type]
            np.concatenate([part.held_slopes for part in parts]),
        )

    def table(self, base: Floats) -> Floats:
        """(e, 5) properties of the edges, by those (e, 5) before."""
        result = base.copy()
        result[:, :LENGTH] *= np.exp(self.stiffness)
        result[:, LENGTH] += self.lengths
        return result

    def property_slopes(self, table: Floats) -> csc_array:
        """(5e, n) derivatives of the logarithms of the properties (e, 5)."""
        stiff, long = coo_array(self.stiffness_slopes), coo_array(self.length_slopes)
        rows = np.append(
            PROPERTIES * (stiff.row // STIFFNESSES) + stiff.row % STIFFNESSES, PROPERTIES * long.row + LENGTH
        )
        values = np.append(stiff.data, long.data / table[long.row, LENGTH])
        return csc_array((values, (rows, np.append(stiff.col, long.col))), shape=(table.size, stiff.shape[1]))
