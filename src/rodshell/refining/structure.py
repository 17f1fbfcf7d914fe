"""The shell that is refined: its edges, its target, and equilibria of it under one design after another."""

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import csr_array

from rodshell.arrays import Floats, Ints
from rodshell.formfinding.methods import STANDARD_GRAVITY
from rodshell.formfinding.popup import PopUp
from rodshell.formfinding.trim import Boundary, Footprint
from rodshell.geometry.curves import on_curve
from rodshell.joints import Joint
from rodshell.layout import GridMesh
from rodshell.model import Shell
from rodshell.model.edge_properties import LENGTH, EdgeProperties
from rodshell.model.rod_sections import RodSections
from rodshell.refining.change import Change
from rodshell.rods.section import Rod
from rodshell.solve.continuation import Continuation
from rodshell.solve.equilibrium import Equilibrium, find_equilibrium
from rodshell.solve.path import farthest
from rodshell.solve.problem import Problem
from rodshell.solve.sensitivity import Parameters, Response, Sensitivity
from rodshell.solve.tangent import Modes
from rodshell.targets import Target

MOST_ITERATIONS = 10  # from a predicted state
STRAYED = 0.05  # of the length: an equilibrium further from the prediction may be another one
SMALLEST_STEP = 0.01  # of a load
_FALLEN = 0.2  # of the length: a step of the load in which a node moves further is a fall
MODES = 3  # of which the lowest may become the lowest of all


@dataclass(frozen=True, eq=False)
class Structure:
    """A popped-up shell, its target, and the properties of its edges before any design.

    Args:
        popped: the shell to be refined.
        rod: section and material of its rods, which have no profiles.
        weight: factor on the shell's own weight under which it is wanted there [-]; 0: without it.
        dead_loads: (n, 3) loads on the mesh's nodes under which it is wanted there [N]; None: none.
    """

    popped: PopUp
    rod: Rod
    joint: Joint
    target: Target
    weight: float = 0.0
    dead_loads: Floats | None = None

    @property
    def mesh(self) -> GridMesh:
        return self.popped.shell.mesh

    @cached_property
    def edges(self) -> EdgeProperties:
        """The edges before any design."""
        table = np.column_stack([self.stiffness(self.mesh), self.mesh.edge_lengths])
        edges = EdgeProperties.of(self.popped.shell, self.joint, table)
        by_stiffness = self.weight * STANDARD_GRAVITY * self.rod.mass_per_length / self.rod.stretch_stiffness
        return replace(edges, weight=np.full(len(table), by_stiffness)) if self.weight else edges

    def load_on(self, shell: Shell) -> Floats:
        """(N, 3) weight and dead loads of a shell with the same nodes [N]."""
        nodes, load = slice(0, shell.first_angle), np.zeros((len(shell.like), 3))
        if self.weight:
            load[nodes, 2] = -self.weight * STANDARD_GRAVITY * shell.mass[nodes, 2]
        if self.dead_loads is not None:
            load[: len(self.dead_loads)] += self.dead_loads
        return load

    @cached_property
    def constant_load(self) -> Floats:
        """(N, 3) the load that does not change with a design: the weight of joints, and the dead loads [N]."""
        load = self.load_on(self.popped.shell)
        return load - self.edges.load(len(load))

    def load(self, edges: EdgeProperties) -> Floats | None:
        """(N, 3) the load on a design [N]; None: none."""
        if not self.weight and self.dead_loads is None:
            return None
        return edges.load(len(self.popped.shell.like)) + self.constant_load

    def stiffness(self, mesh: GridMesh) -> Floats:
        """(e, 4) EA [N], EI1, EI2 and GJ [N m2] of the edges of a mesh.

        Args:
            mesh: of the same rods, with or without profiles.
        """
        sections = RodSections.of(mesh, [self.rod] * len(mesh.grid.rods))
        return np.column_stack([sections.stretch, sections.edges])

    @cached_property
    def held(self) -> Ints:
        """(k,) blocks that a design may move: rod ends, then ghost nodes."""
        return np.append(self.popped.shell.ends, self.popped.shell.ghosts)

    @cached_property
    def sampled(self) -> csr_array:
        """(q, n) weights of the n nodes in the points whose gaps are counted: all nodes, and the middles of edges."""
        mesh, rows, columns, values = self.mesh, list[Ints](), list[Ints](), list[Floats]()
        first = mesh.node_count
        for rod in range(len(mesh.grid.rods)):
            nodes, s = mesh.nodes_of(rod), mesh.stations[mesh.rod_slice(rod)]
            weights = on_curve(s, np.eye(len(s)), 0.5 * (s[:-1] + s[1:]))
            row, column = np.nonzero(weights)
            rows, columns = [*rows, first + row], [*columns, nodes[column]]
            values.append(weights[row, column])
            first += len(s) - 1
        n = np.arange(mesh.node_count)
        entries = np.concatenate([np.ones(len(n)), *values])
        return csr_array((entries, (np.concatenate([n, *rows]), np.concatenate([n, *columns]))), shape=(first, len(n)))

    @cached_property
    def heights(self) -> Floats:
        """(q,) distance of each sampled point's layer from the target [m]."""
        mesh = self.mesh
        return np.append(mesh.heights, mesh.heights[mesh.edges[:, 0]])

    @cached_property
    def mass(self) -> Floats:
        """(N, 3) lumped masses of the nodes, by which modes are measured [kg]; 1 for rods without mass."""
        shell = self.popped.shell
        mass = np.where(shell.mass.any(), shell.mass, 1.0)
        mass[shell.first_angle :] = 0.0
        return mass

    @cached_property
    def lowest(self) -> float:
        """Lowest eigenvalue of the unloaded shell before any design [1/s2]."""
        return float(self.popped.equilibrium.tangent.lowest_modes(1, mass=self.mass).values[0])

    @cached_property
    def span_edges(self) -> Ints:
        """(e,) as `spans`."""
        return spans(self.mesh)


def rebuilt(like: PopUp, mesh: GridMesh, boundary: Boundary, rod: Rod, joint: Joint, near: Equilibrium) -> PopUp:
    """A shell on another grid, with the load of an equilibrium near its own, from which it is solved.

    Args:
        like: the shell whose supports it has.
        boundary: where its rods end.
    """
    shell = Shell.of(mesh, rod, clamped=like.support.holds_directions, joint=joint).with_frames_of(near.elements)
    problem = Problem.of_shell(shell, boundary.points, pattern=near.problem.pattern)
    found = find_equilibrium(replace(problem, load=near.problem.load), near.state, near.forces)
    return PopUp(like.support, "draped", Footprint(mesh), boundary, shell.with_elements(found.elements), found)


def spans(mesh: GridMesh) -> Ints:
    """(e,) number of the span, between two joints or from a joint to an end, that each edge belongs to."""
    joint = np.zeros(mesh.node_count, dtype=bool)
    joint[mesh.joint_pairs.ravel()] = True
    rods = mesh.edge_rods
    begins = np.append(True, (rods[1:] != rods[:-1]) | joint[mesh.edges[1:, 0]])
    return np.cumsum(begins) - 1


@dataclass(frozen=True, eq=False)
class Point:
    """A design and its equilibrium.

    Args:
        values: (n,) of the variables: the design.
    """

    structure: Structure
    values: Floats
    change: Change
    edges: EdgeProperties
    equilibrium: Equilibrium

    @cached_property
    def sensitivity(self) -> Sensitivity:
        """Derivatives here, by one factorisation."""
        return Sensitivity(self.equilibrium, self.edges)

    @cached_property
    def parameters(self) -> Parameters:
        """What the variables change here."""
        change, state = self.change, self.equilibrium.state
        moved = None
        if change.held_slopes.any():
            moved = np.zeros((len(self.values), *state.shape))
            moved[:, self.structure.held] = change.held_slopes
        return Parameters(change.property_slopes(self.edges.table), moved)

    @cached_property
    def response(self) -> Response:
        """State and axial forces by the variables."""
        return self.sensitivity.response(self.parameters)

    @cached_property
    def modes(self) -> Modes:
        """The lowest modes."""
        return self.sensitivity.lowest_modes(MODES, mass=self.structure.mass)

    @property
    def state(self) -> Floats:
        """(N, 3) [m, rad]"""
        return self.equilibrium.state

    @cached_property
    def gaps(self) -> tuple[Floats, Floats]:
        """(q,) signed gaps at the sampled points [m], and (q, 3) the target's normals there."""
        structure = self.structure
        points = structure.sampled @ self.state[: structure.mesh.node_count]
        gap = structure.target.gap(points)
        return gap.distance - structure.heights, gap.normal

    @cached_property
    def rms(self) -> float:
        """Root mean square of the gaps over the target's size [-]."""
        return float(np.sqrt(np.mean(self.gaps[0] ** 2))) / self.structure.target.size

    @cached_property
    def euler_share(self) -> Floats:
        """(s,) compression of each span over its Euler load [-]."""
        table, span = self.edges.table, self.structure.span_edges
        lengths = np.bincount(span, table[:, LENGTH])
        flexible = np.bincount(span, table[:, LENGTH] / table[:, 1])
        forces = np.bincount(span, table[:, LENGTH] * self.equilibrium.forces) / lengths
        return np.asarray(-forces * lengths * flexible / np.pi**2)

    def tried(self, values: Floats, change: Change) -> "tuple[Point | None, int]":
        """The equilibrium of another design of values (n,), from this one's by first order.

        Returns:
            The point, or None where Newton's method does not lead to a stable equilibrium next to the prediction; and
            the number of factorisations that this took.
        """
        step, here = values - self.values, self.equilibrium
        response, held = self.response, self.structure.held
        state = here.state + np.einsum("p,pnx->nx", step, response.motions)
        state[held] = here.state[held] + change.held - self.change.held
        edges = self.edges.at(here.elements).varied(change.table(self.structure.edges.table))
        load = self.structure.load(edges)
        problem = replace(here.problem, elements=edges.shell.elements, stretch=edges.shell.stretch, load=load)
        forces = here.forces + step @ response.forces
        found = find_equilibrium(problem.refreshed(state), state, forces, most_iterations=MOST_ITERATIONS)
        nodes = self.structure.mesh.node_count
        strayed = np.abs(found.state[:nodes] - state[:nodes]).max() > STRAYED * problem.length
        if strayed or not found.report.stable:
            return None, found.report.factorizations
        return Point(self.structure, values, change, edges.at(found.elements), found), found.report.factorizations


def under_load(unloaded: Equilibrium, load: Floats) -> tuple[Equilibrium | None, int]:
    """The equilibrium under a load that grows from that of the problem, by stable equilibria.

    Args:
        unloaded: a stable equilibrium, with or without a load.
        load: (N, 3) in the end [N].

    Returns:
        The equilibrium, None where the shell falls before; and the number of factorisations.
    """
    first = np.zeros_like(load) if unloaded.problem.load is None else unloaded.problem.load
    here, path, made = unloaded, Continuation(0.0, 1.0, 1.0, SMALLEST_STEP), 0
    while not (path.arrived or path.lost):
        there = path.there
        problem = replace(here.problem, load=(1.0 - there) * first + there * load)
        found = find_equilibrium(problem, here.state, here.forces, most_iterations=2 * MOST_ITERATIONS)
        made += found.report.factorizations
        if found.report.stable and farthest(here, found) <= _FALLEN * problem.length:
            path.accept()
            here = found
        else:
            path.shorten()
    return (here if path.arrived else None), made
