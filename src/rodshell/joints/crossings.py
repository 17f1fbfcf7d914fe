"""Where rods meet: the places of a mesh at which two rods cross, and the edges of each rod there."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.layout import GridMesh


@dataclass(frozen=True)
class Places:
    """A mesh seen from its rods: *place* k is entry k of `mesh.rod_nodes`, a rod's visit to one of its nodes.

    Parameters
    ----------
    mesh : the mesh, its rods sharing their nodes at joints or lying in layers.
    blocks : (k,) block of the state that holds each place: its node's, or one of its own where rods do not share.
    first_angle : block of the first edge's twist angle; the others follow.
    """

    mesh: GridMesh
    blocks: Ints
    first_angle: int

    @cached_property
    def rods(self) -> Ints:
        """(k,) rod of each place."""
        return np.repeat(np.arange(len(self.mesh.rod_start)), self.mesh.rod_stop - self.mesh.rod_start)

    @cached_property
    def of_crossings(self) -> Ints:
        """(c, 2) places of each crossing of the grid, on its first and its second rod."""
        key = self.rods * self.mesh.node_count + self.mesh.rod_nodes
        order = np.argsort(key, kind="stable")
        wanted = self.mesh.grid.crossings.rods * self.mesh.node_count + self.mesh.joint_pairs
        return np.asarray(order[np.searchsorted(key[order], wanted)])

    def has(self, places: Ints, side: int) -> np.ndarray:
        """Whether the rod goes on from each place: before it (side 0), after it (side 1)."""
        limit = self.mesh.rod_start[self.rods[places]] if side == 0 else self.mesh.rod_stop[self.rods[places]] - 1
        return np.asarray(places != limit)

    def edge(self, places: Ints, side: int) -> Ints:
        """Edge before (side 0) or after (side 1) each place, where there is one; edges are counted rod by rod."""
        return np.asarray(places - self.rods[places] - (1 - side))

    def angle(self, places: Ints, side: int) -> Ints:
        """Block of that edge's twist angle."""
        return np.asarray(self.first_angle + self.edge(places, side))

    def neighbour(self, places: Ints, side: int) -> Ints:
        """Block of the node at that edge's other end."""
        return np.asarray(self.blocks[places + (1 if side else -1)])

    def directions(self, places: Ints) -> Floats:
        """(.., 2) unit direction of the rod of each place in the flat grid."""
        table = np.array([rod.direction for rod in self.mesh.grid.rods])
        return np.asarray(table[self.rods[places]])

    def softness(self, places: Ints) -> Floats:
        """Sum of 1/length over the edges at each place [1/m]."""
        total = np.zeros(len(places))
        for side in range(2):
            there = self.has(places, side)
            total[there] += 1.0 / self.mesh.edge_lengths[self.edge(places[there], side)]
        return total

    def flat(self, size: int) -> Floats:
        """(size, 3) state of the flat grid, all angles 0."""
        state = np.zeros((size, 3))
        state[self.blocks] = self.mesh.flat[self.mesh.rod_nodes]
        return state
