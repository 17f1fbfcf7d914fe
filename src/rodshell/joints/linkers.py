"""The paper's linkers: 3-node rods around a corner, from an edge of one rod to an edge of another [HQK 2.2, Eq 6].

A linker in the corner (x_e, joint, x_f) is a bend and a twist between the edge e, which runs to the joint, and the
edge f, which leaves it, at rest in the flat corner. It has no stretch energy, and no mass but its share of the blocks
that it is tied to. In two opposite corners both edges go as they do in their rods; in the other two one of them is
reversed: its tangent, its second director and its twist angle change sign.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.joints.crossings import RodNodes
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.elements import NO_HESSIANS
from rodshell.validation import brief

UP = (0.0, 0.0, 1.0)


@dataclass(frozen=True, eq=False)
class Corners:
    """The corners of crossings in which linkers lie.

    Parameters
    ----------
    blocks : (n, 5) outer node and twist angle of e, joint (on the rod of e), twist angle and outer node of f.
    joints : (n, 2) block of the joint on the rod of e and on that of f: the same where they share it.
    signs : (n, 2) -1 for a reversed edge.
    lengths : (n,) Voronoi length of the corner: half of both edges [m].
    rods : (n, 2) rod of e and of f.
    """

    blocks: Ints
    joints: Ints
    signs: Floats
    lengths: Floats
    rods: Ints

    __repr__ = brief

    @staticmethod
    def of(rod_nodes: RodNodes, crossings: Ints, wanted: int) -> "Corners":
        """Corners of some crossings of the grid.

        Parameters
        ----------
        crossings : (m,) their indices.
        wanted : 2 for two opposite corners, as in the paper, or 4 for all; where a rod ends, all that there are.
        """
        pairs = rod_nodes.at_crossings[crossings]
        rows = []
        full = np.ones(len(pairs), dtype=bool)
        for rod_of in range(2):
            full &= rod_nodes.has_edge(pairs[:, rod_of], 0) & rod_nodes.has_edge(pairs[:, rod_of], 1)
        # the rod and side of e and of f; the paper's two come first
        for number, (e, f) in enumerate((((0, 0), (1, 1)), ((1, 0), (0, 1)), ((0, 0), (1, 0)), ((0, 1), (1, 1)))):
            (rod_e, side_e), (rod_f, side_f) = e, f
            there = rod_nodes.has_edge(pairs[:, rod_e], side_e) & rod_nodes.has_edge(pairs[:, rod_f], side_f)
            if wanted == 2 and number >= 2:
                there &= ~full
            a, b = pairs[there, rod_e], pairs[there, rod_f]
            lengths = rod_nodes.mesh.edge_lengths
            far_e, angle_e = rod_nodes.neighbour(a, side_e), rod_nodes.angle(a, side_e)
            far_f, angle_f = rod_nodes.neighbour(b, side_f), rod_nodes.angle(b, side_f)
            rows.append(
                (
                    np.column_stack([far_e, angle_e, rod_nodes.blocks[a], angle_f, far_f]),
                    np.column_stack([rod_nodes.blocks[a], rod_nodes.blocks[b]]),
                    np.tile([-1.0 if side_e else 1.0, 1.0 if side_f else -1.0], (len(a), 1)),
                    0.5 * (lengths[rod_nodes.edge(a, side_e)] + lengths[rod_nodes.edge(b, side_f)]),
                    np.column_stack([rod_nodes.rods[a], rod_nodes.rods[b]]),
                )
            )
        return Corners(*(np.concatenate(parts) for parts in zip(*rows, strict=True)))


@dataclass(frozen=True, eq=False)
class LinkerBend:
    """Bends and twists of linkers. Build them with `of`.

    Parameters
    ----------
    blocks : (n, 5) as in `BendTwist`.
    signs : (n, 2) -1 where the twist angle belongs to the reversed edge.
    bends : the same elements on separate rows, five each, with the signs of the linkers' angles.
    """

    blocks: Ints
    signs: Floats
    bends: BendTwist

    __repr__ = brief

    @staticmethod
    def of(corners: Corners, blocks: Ints, flat: Floats, stiffness: Floats) -> "LinkerBend":
        """Linkers at rest in the flat grid.

        Parameters
        ----------
        corners : n, where they lie.
        blocks : (n, 5) their blocks: those of the corners, or copies of them.
        flat : (N, 3) state of the flat grid [m].
        stiffness : (n, 3) EI1, EI2 and GJ [N m2].
        """
        rows = np.arange(5 * len(blocks)).reshape(-1, 5)
        per_length = stiffness / corners.lengths[:, None]
        local = _signed(flat, blocks, corners.signs)
        bends = BendTwist.starting_at(
            rows, local, UP, bend_stiffness=per_length[:, :2], twist_stiffness=per_length[:, 2]
        ).relaxed(local)  # fmt: skip
        return LinkerBend(np.ascontiguousarray(blocks), corners.signs, bends)

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        local = _signed(state, self.blocks, self.signs)
        by_local = np.zeros_like(local)
        energy = self.bends.evaluate(local, by_local, hessians)
        by_local[1::5] *= self.signs[:, :1]
        by_local[3::5] *= self.signs[:, 1:]
        np.add.at(gradient, self.blocks.ravel(), by_local)
        if len(hessians):
            for column, sign in ((3, self.signs[:, :1]), (9, self.signs[:, 1:])):
                hessians[:, column, :] *= sign
                hessians[:, :, column] *= sign
        return energy

    def refreshed(self, state: Floats) -> Self:
        """The same linkers with their source frames at `state` (N, 3)."""
        return replace(self, bends=self.bends.refreshed(_signed(state, self.blocks, self.signs)))

    def moments(self, state: Floats) -> Floats:
        """(n, 3) moments of the two bends and of the twist of each linker at `state` (N, 3) [N m].

        Parameters
        ----------
        state : (N, 3) node positions [m] and twist angles [rad].
        """
        bends = self.bends
        strains = bends.strains(_signed(state, self.blocks, self.signs))
        natural = np.column_stack([bends.natural_curvature, bends.natural_twist])
        return np.asarray(np.column_stack([bends.bend_stiffness, bends.twist_stiffness]) * (strains - natural))


def _signed(state: Floats, blocks: Ints, signs: Floats) -> Floats:
    """(5n, 3) the blocks of each linker, with the signs of its angles."""
    local = state[blocks]
    local[:, 1] *= signs[:, :1]
    local[:, 3] *= signs[:, 1:]
    return local.reshape(-1, 3)
