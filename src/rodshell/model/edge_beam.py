"""Beams along the edge of a shell: rods of their own section that join the ends of others.

A beam has a node at each rod end on it, and is free of stress in the shape that the rod ends have when it is fitted:
it is made to the edge as drawn. Its own unknowns are the twist angles of its edges, after all others of the shell.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from rodshell.arrays import Floats, Ints, State
from rodshell.layout import FlatGrid, FlatRod, GridMesh, mesh_grid
from rodshell.layout.flatgrid import Crossings
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.elements import Elements, Stretch
from rodshell.rods.section import Rod
from rodshell.rods.supports import BeamAlong
from rodshell.validation import brief

STRAIGHT = 1e-6  # of a turn from edge to edge: less does not keep a beam from turning about itself


@dataclass(frozen=True, eq=False)
class FittedBeam:
    """A beam along rod ends, on a shell.

    Args:
        along: what was asked for.
        mesh: of the beam alone, straight; of a ring cut open, its first edge following its last again.
        blocks: (k,) block of the shell that holds each of the beam's own blocks, nodes before twist angles.
        bend, stretch: its energies, on the blocks of the shell.
        creep: by how much its deflections grow under permanent loads; None: not known.
    """

    along: BeamAlong
    mesh: GridMesh
    blocks: Ints
    bend: BendTwist
    stretch: Stretch
    creep: float | None = None

    __repr__ = brief

    @staticmethod
    def fitted(along: BeamAlong, *, nodes: Ints, state: State, normals: Floats, first: int) -> "FittedBeam":
        """A beam free of stress in a state.

        Args:
            along: of b rod ends.
            nodes: (b,) block of each of them in `state` (N, 3).
            normals: (b, 3) of the shell at them, towards which the section's first direction points.
            first: block of its first twist angle.
        """
        rod, closed = along.rod, along.closed
        edges = len(nodes) if closed else len(nodes) - 1
        order = np.arange(edges + (2 if closed else 1)) % len(nodes)
        points = state[nodes[order]]
        lengths = np.linalg.norm(np.diff(points, axis=0), axis=1)
        stations = np.append(0.0, np.cumsum(lengths))
        line = FlatRod(along.name, "free", None, 0.0, float(stations[-1]), (0.0, 0.0), (1.0, 0.0))
        none = Crossings(np.empty((0, 2), dtype=np.intp), np.empty((0, 2)))
        mesh = mesh_grid(FlatGrid((line,), none), np.inf, marks=[stations[1:-1].tolist()])
        at_nodes = np.empty(mesh.node_count, dtype=np.intp)
        at_nodes[mesh.rod_nodes] = nodes[order]
        blocks = np.append(at_nodes, first + np.arange(len(order) - 1) % edges)
        directors = np.zeros((first + edges, 3))
        directors[first:] = (normals[order[:-1]] + normals[order[1:]])[:edges]
        angles = mesh.node_count + np.arange(len(order) - 1)
        stencils = np.column_stack(
            [mesh.rod_nodes[:-2], angles[:-1], mesh.rod_nodes[1:-1], angles[1:], mesh.rod_nodes[2:]]
        )
        voronoi = 0.5 * (lengths[:-1] + lengths[1:])
        there = np.vstack([state[:first], np.zeros((edges, 3))])
        bend = BendTwist.starting_at(
            blocks[stencils], there, directors,
            bend_stiffness=np.array(rod.bend_stiffnesses) / voronoi[:, None],
            twist_stiffness=rod.twist_stiffness / voronoi,
        ).relaxed(there)  # fmt: skip
        pairs = np.column_stack([nodes[order[:-1]], nodes[order[1:]]])[:edges]
        stretch = Stretch.elastic(pairs, lengths[:edges].copy(), np.full(edges, rod.stretch_stiffness))
        return FittedBeam(along, mesh, blocks, bend, stretch, along.creep)

    @property
    def rod(self) -> Rod:
        return self.along.rod

    @property
    def elements(self) -> tuple[Elements, ...]:
        return self.bend, self.stretch

    def with_elements(self, elements: Sequence[Any]) -> "FittedBeam":
        """The same beam with its source frames elsewhere."""
        bend, stretch = elements
        return replace(self, bend=bend, stretch=stretch)

    @property
    def angles(self) -> Ints:
        """(e,) blocks of its twist angles."""
        return self.blocks[self.mesh.node_count :][: len(self.stretch.blocks)]

    @property
    def loose(self) -> Ints:
        """Block of a twist angle by which it is kept from turning about itself, or none if its bends do."""
        bends = np.abs(self.bend.natural_curvature).max(initial=0.0)
        return self.angles[len(self.angles) // 2 :][: int(bends < STRAIGHT)]

    @property
    def length(self) -> float:
        """[m]"""
        return float(self.stretch.rest_lengths.sum())

    def times(self, factor: float) -> "FittedBeam":
        """The same beam so many times as stiff."""
        bend, stretch = self.bend, self.stretch
        stiffer = bend.with_stiffness(factor * np.column_stack([bend.bend_stiffness, bend.twist_stiffness]))
        return replace(self, bend=stiffer, stretch=replace(stretch, stiffness=factor * stretch.stiffness))

    def add_mass(self, mass: Floats) -> None:
        """Add its mass to that of the shell's blocks (N, 3) [kg, of twist angles kg m2]."""
        lengths = self.stretch.rest_lengths
        for side in self.stretch.blocks.T:
            np.add.at(mass, side, 0.5 * self.rod.mass_per_length * lengths[:, None])
        mass[self.angles, 0] += self.rod.rotary_inertia * lengths

    def forces(self, state: State) -> Floats:
        """(e,) axial forces [N], tension positive, of the edges of `mesh`."""
        forces = self.stretch.stiffness * self.stretch.strains(state)
        return np.asarray(forces[np.arange(len(self.mesh.edges)) % len(forces)])
