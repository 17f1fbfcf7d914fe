"""A meshed grid of rods as a sum of energies, with its clamps and, where they matter, its twist angles.

The state's blocks are the mesh's nodes, then the ghost nodes of the clamps, then the twist angles.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gridshell.joints import Ball, Joint
from gridshell.layout import GridMesh
from gridshell.model.freedom import Freedom
from gridshell.rods.bend_twist import BendTwist
from gridshell.rods.elements import Elements
from gridshell.rods.isotropic_bend import IsotropicBend
from gridshell.rods.section import Rod
from gridshell.rods.stretch import Stretch

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]


@dataclass(frozen=True)
class Shell:
    """The assembled shell.

    Parameters
    ----------
    mesh : its nodes and edges.
    elements : bending, and twist where it matters.
    stretch : the edges.
    ends : (2m,) node of each rod end, start and end of each rod in turn.
    ghosts : (2m,) ghost node past each end, or empty where the ends are pinned.
    angles : number of twist angles (one for each edge), or 0.
    """

    mesh: GridMesh
    elements: tuple[Elements, ...]
    stretch: Stretch
    ends: Ints
    ghosts: Ints
    angles: int

    @staticmethod
    def of(
        mesh: GridMesh, rod: Rod, *, clamped: bool = False, joint: Joint | None = None, twist: bool | None = None
    ) -> "Shell":
        """Assemble a mesh of equal rods.

        clamped : each rod goes on to a ghost node past its end that holds its direction there. The end's
            Voronoi length is half its last edge, so that the clamp acts exactly at the end (second order).
        twist : carry twist angles; None decides by `twist_matters`.
        """
        n = mesh.node_count
        bends, lengths = mesh.bends, mesh.voronoi_lengths
        ghosts = np.empty(0, dtype=np.intp)
        if clamped:
            ghosts = n + np.arange(2 * len(mesh.grid.rods))
            outward = np.column_stack([_inner_nodes(mesh), mesh.ends.ravel(), ghosts])
            bends = np.vstack([bends, outward])
            lengths = np.append(lengths, 0.5 * _last_edges(mesh))
        stretch = Stretch.elastic(mesh.edges, mesh.edge_lengths, np.full(len(mesh.edges), rod.stretch_stiffness))
        carried = twist_matters(joint or Ball()) if twist is None else twist
        elements: tuple[Elements, ...]
        if carried:
            elements = (_bend_twist(mesh, rod, n + len(ghosts)),)
            if clamped:  # a clamp holds the direction and lets the rod spin
                elements += (IsotropicBend(outward, rod.bend_stiffness / (0.5 * _last_edges(mesh))),)
        else:
            elements = (IsotropicBend(bends, rod.bend_stiffness / lengths),)
        return Shell(mesh, elements, stretch, mesh.ends.ravel(), ghosts, len(mesh.edges) if carried else 0)

    @property
    def places(self) -> Floats:
        """(N, 2) where each block lies in the flat grid [m]; a twist angle in the middle of its edge."""
        flat = self.mesh.flat[:, :2]
        ghosts = flat[self.ends[: len(self.ghosts)]]
        middles = flat[self.mesh.edges].mean(axis=1) if self.angles else np.empty((0, 2))
        return np.vstack([flat, ghosts, middles])

    def state(self, positions: Floats, tangents: Floats | None = None) -> Floats:
        """State blocks from node positions (n, 3) and outward end tangents (2m, 3); angles start at zero."""
        blocks = [positions]
        if len(self.ghosts):
            assert tangents is not None
            blocks.append(positions[self.ends] + _last_edges(self.mesh)[:, None] * tangents)
        return np.vstack([*blocks, np.zeros((self.angles, 3))])

    def positions(self, state: Floats) -> Floats:
        """(n, 3) positions of the mesh's nodes in a state [m]."""
        return state[: self.mesh.node_count]

    def freedom(self) -> Freedom:
        """All nodes free, ghosts fixed, one free component a twist angle; one angle of each rod is held."""
        n, ghosts = self.mesh.node_count, len(self.ghosts)
        free = Freedom.free(n + ghosts + self.angles).with_directions(self.ghosts)
        if self.angles:
            first = n + ghosts
            free = free.with_directions(first + np.arange(self.angles), (1.0, 0.0, 0.0))
            spin = np.searchsorted(self.mesh.edge_rods, np.arange(len(self.mesh.grid.rods)))
            free = free.with_directions(first + spin)  # nothing else holds a rod's spin about itself
        return free

    def held_ends(self) -> Freedom:
        """As `freedom`, with every rod end held in place."""
        return self.freedom().with_directions(self.ends)


def twist_matters(joint: Joint) -> bool:
    """Whether any energy of the shell depends on the twist angles.

    It does not for naturally straight rods with equal bending stiffness in all directions (every section so
    far), unless a joint ties their frames: the twist energy's minimum is then zero, reached at any shape.
    """
    return joint.turns_frames


def _bend_twist(mesh: GridMesh, rod: Rod, first_angle: int) -> BendTwist:
    bends = mesh.bends
    edge = first_angle + np.arange(len(mesh.edges))
    same = mesh.edge_rods[1:] == mesh.edge_rods[:-1]
    before, after = edge[:-1][same], edge[1:][same]
    blocks = np.column_stack([bends[:, 0], before, bends[:, 1], after, bends[:, 2]])
    flat = np.zeros((first_angle + len(edge), 3))
    flat[: mesh.node_count] = mesh.flat
    length = mesh.voronoi_lengths
    return BendTwist.starting_at(
        blocks, flat, (0.0, 0.0, 1.0),
        bend_stiffness=(rod.bend_stiffness / length)[:, None], twist_stiffness=rod.twist_stiffness / length,
    )  # fmt: skip


def _inner_nodes(mesh: GridMesh) -> Ints:
    """(2m,) neighbour of each rod end."""
    return np.column_stack([mesh.rod_nodes[mesh.rod_start + 1], mesh.rod_nodes[mesh.rod_stop - 2]]).ravel()


def _last_edges(mesh: GridMesh) -> Floats:
    """(2m,) rest length of the edge at each rod end [m]."""
    s, first, stop = mesh.stations, mesh.rod_start, mesh.rod_stop
    return np.column_stack([s[first + 1] - s[first], s[stop - 1] - s[stop - 2]]).ravel()
