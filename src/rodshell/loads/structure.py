"""The shell that loads act on: erected, braced, its joints locked; its model and its equilibrium without loads.

The erected shell is the popped-up one. It has no weight while its bracing is put in: it is held up until then, by the
scaffold or the crane that erects it. The bracing is fitted to the shell as it stands, and stressed; the shell gives way
to that, and in the equilibrium that it finds its joints are locked, where they are. All loads begin there.
"""

from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.checks.reactions import Reactions, reactions
from rodshell.errors import ConvergenceError
from rodshell.formfinding.popup import PopUp
from rodshell.joints.relative_rotation import is_elastic
from rodshell.layout import GridMesh
from rodshell.model import Shell
from rodshell.model.rod_sections import RodSections
from rodshell.rods.cable import CableStretch
from rodshell.rods.section import Rod
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.modes import frequencies

NO_PAIRS: Ints = np.empty((0, 2), dtype=np.intp)  # of crossings that bracing joins


@dataclass(frozen=True, eq=False)
class LathLayer:
    """A third layer of laths.

    Args:
        shell: the model of the laths alone, each straight when it is free of stress.
        blocks: (N,) the structure's block that holds each of its blocks.
        entries: entries of its mesh's `rod_nodes` at crossings, lath by lath; `crossings` which each of them is at.
    """

    shell: Shell
    blocks: Ints
    rod: Rod
    entries: Ints
    crossings: Ints

    @property
    def pairs(self) -> Ints:
        """(d, 2) neighbouring crossings on each lath."""
        return np.column_stack([self.crossings[:-1], self.crossings[1:]])[self.same_lath]

    def forces(self, axial: Floats) -> Floats:
        """(d,) mean axial force from crossing to crossing [N], tension positive, of those (e,) of the edges."""
        edges = self.entries - self.shell.mesh.rod_of[self.entries]  # which are counted lath by lath
        sums = np.append(0.0, np.cumsum(axial))
        return np.asarray(np.diff(sums[edges])[self.same_lath] / np.diff(edges)[self.same_lath])

    @property
    def same_lath(self) -> Bools:
        """Which crossings are on one lath with the next."""
        return np.asarray(np.diff(self.shell.mesh.rod_of[self.entries]) == 0)

    def alone(self, found: Equilibrium, first: int) -> tuple[Shell, Floats]:
        """The model and the state of the laths alone, of whose elements an equilibrium of grid and laths has the first
        after `first` others."""
        elements = zip(found.elements[first:], self.shell.elements, strict=False)
        alone = tuple(replace(there, blocks=here.blocks) for there, here in elements)  # type: ignore[type-var]
        return self.shell.with_elements(alone), found.state[self.blocks]


@dataclass(frozen=True, eq=False)
class Structure:
    """A shell as loads find it.

    Args:
        shell: the model of the grid, its source frames being at the equilibrium.
        equilibrium: of grid and bracing without loads, its ends held.
        braced: (d, 2) crossings that its bracing joins, the rod ends counted on from them.
        bracing_mass: (n,) mass of the bracing whose weight the mesh's nodes carry [kg]; None: there is no bracing.
        cables: its energy; None: there are no cables.
        laths: its third layer; None: there is none.
        locked: crossings of the joints of each of the shell's last elements, which lock them; empty: none is locked.
    """

    shell: Shell
    equilibrium: Equilibrium
    rod: Rod
    braced: Ints = field(default_factory=NO_PAIRS.copy)
    bracing_mass: Floats | None = None
    cables: CableStretch | None = None
    laths: LathLayer | None = None
    locked: tuple[Ints, ...] = ()

    def __repr__(self) -> str:
        return f"<Structure: {self.shell}, {self.equilibrium.report.status.value}>"

    @staticmethod
    def erected(popped: PopUp, rod: Rod) -> "Structure":
        """The popped-up shell, without bracing."""
        return Structure(popped.shell, popped.equilibrium, rod)

    @property
    def mesh(self) -> GridMesh:
        return self.shell.mesh

    @property
    def size(self) -> int:
        """Number of blocks of the state."""
        return len(self.equilibrium.state)

    @cached_property
    def mass(self) -> Floats:
        """(n,) lumped mass of the mesh's nodes, of rods, joints and bracing [kg]."""
        mass = self.shell.mass[: self.shell.node_count, 2]
        return np.asarray(mass if self.bracing_mass is None else mass + self.bracing_mass)

    def positions(self, found: Equilibrium) -> Floats:
        """(n, 3) positions of the mesh's nodes in an equilibrium of the structure [m]."""
        return self.shell.positions(found.state)

    def bracing_forces(self, found: Equilibrium) -> Floats:
        """(d,) axial force of the bracing from crossing to crossing in an equilibrium of the structure [N]; tension is
        positive, and a slack cable has exactly 0."""
        if self.laths is not None:
            return self.laths.forces(found.forces[len(self.mesh.edges) :])
        return np.zeros(0) if self.cables is None else self.cables.forces(found.state)

    def locked_moments(self, found: Equilibrium) -> Floats:
        """(c,) moment of each locked joint about its normal in an equilibrium of the structure [N m], positive where
        the angle from the first rod to the second has grown; empty where none is locked."""
        if not self.locked:
            return np.zeros(0)
        result, joints = np.zeros(len(self.mesh.grid.crossings)), [*filter(is_elastic, self.shell_at(found).between)]
        for crossings, element in zip(self.locked, joints[-len(self.locked) :], strict=True):
            result[crossings] = element.moments(found.state)[:, 0]
        return result

    @property
    def span(self) -> float:
        """The smaller width of its plan [m]."""
        return float(np.ptp(self.positions(self.equilibrium)[:, :2], axis=0).min())

    def frequencies(self, count: int, cladding: Floats | None = None) -> Floats:
        """(k,) the lowest `count` natural frequencies without loads, at most, ascending [Hz]; none where they are not
        known.

        Args:
            cladding: (n,) its mass at the mesh's nodes [kg]; None: there is none.

        The mass of rods and laths is spread along their edges, so that the frequencies of bending are of fourth order
        in their length (see `solve.modes.frequencies`); joints and cables are at the nodes.
        """
        shell, mass = self.shell, np.zeros((self.size, 3))
        mass[: len(shell.mass)] = shell.mass
        mass[: shell.node_count] += 0.0 if cladding is None else cladding[:, None]
        layer = self.laths
        if layer is not None:
            np.add.at(mass, layer.blocks, layer.shell.mass)
        elif self.bracing_mass is not None:
            mass[: shell.node_count] += self.bracing_mass[:, None]
        spread = np.zeros(len(self.equilibrium.problem.stretch.blocks))
        mesh = self.mesh
        of_rods = RodSections.of(mesh, [self.rod] * len(mesh.grid.rods)).mass * mesh.edge_lengths
        spread[: len(of_rods)] = of_rods
        if layer is not None:
            spread[len(of_rods) :] = layer.rod.mass_per_length * layer.shell.mesh.edge_lengths
        if self.equilibrium.tangent.negative_modes or not of_rods.all():
            return np.zeros(0)
        try:
            return frequencies(self.equilibrium, mass, count, edge_mass=spread).frequencies
        except ConvergenceError:  # one figure of many: it is missing, and the others stand
            return np.zeros(0)

    def shell_at(self, found: Equilibrium) -> Shell:
        """The grid's model with its source frames at an equilibrium of the structure, loaded or not."""
        return self.shell.with_elements(found.elements[: len(self.shell.elements)])

    def support_forces(self, found: Equilibrium) -> Reactions:
        """What the supports exert in an equilibrium, with the springing of the bent rods."""
        return reactions(self.shell, found)

    def reactions(self, found: Equilibrium) -> Reactions:
        """What the supports exert in an equilibrium in addition to what they exert without loads."""
        loaded, before = self.support_forces(found), self.support_forces(self.equilibrium)
        points = found.state[self.shell.ends]
        return Reactions.at(points, loaded.forces - before.forces, loaded.moments - before.moments)
