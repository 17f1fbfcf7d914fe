"""A meshed grid of rods and joints as a sum of energies, with its clamps and, where needed, its twist angles.

The state's blocks are the nodes, then the ghost nodes of the clamps, then the twist angles of the edges (and of the
ghost edges, where needed), then, with a penalty coupling, the nodes and the twist angles of the linkers, then the twist
angles of the beams along its edge.

The coupling decides the nodes [HQK 2.2]. With shared DOFs rods have one node at a joint, and linkers have no unknowns.
With a penalty each rod and each linker has its own: `like` is the block of the shared form that each copies, and the
mass of that block is divided equally among its copies, so that none is counted twice.

Eccentric joints lay the rods in two layers, whose mesh gives each rod its own nodes (`GridMesh.in_layers`).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints, NodePositions, State
from rodshell.errors import InputError
from rodshell.geometry.frames import adapted, parallel_transport, signed_angle, unit
from rodshell.joints import (
    Ball,
    Coupling,
    ExplicitPenalty,
    ImplicitPenalty,
    Joint,
    SharedDofs,
    Ties,
    require_joint,
)
from rodshell.joints.crossings import UP, Corners, LinkerBend, RodNodes
from rodshell.joints.joint import elastic_joints, refuse_mixtures
from rodshell.joints.ties import offset_ties
from rodshell.layout import GridMesh
from rodshell.model.assembly import ANGLE, Freedom
from rodshell.model.edge_beam import FittedBeam
from rodshell.model.potential import Potential
from rodshell.model.rod_sections import RodSections
from rodshell.rods.bend_twist import BendTwist, frames_among
from rodshell.rods.elements import Elements, Stretch, is_bends, turned, with_frames
from rodshell.rods.isotropic import IsotropicBend
from rodshell.rods.section import Rod
from rodshell.rods.supports import CLAMPED, PINNED
from rodshell.validation import flag, instance

OFFSET_STIFFNESS = 10.0  # times that of an edge in stretch: ties of eccentric joints
Direction = tuple[float, float, float]
_Item = TypeVar("_Item")
COUPLING = "a rodshell coupling such as rodshell.SharedDofs()"


@dataclass(frozen=True, eq=False)
class Shell:
    """The assembled shell. Build it with `of`.

    Args:
        mesh: its nodes and edges, rods sharing their nodes at joints.
        coupling: how rods that meet at a joint are tied.
        node_count: number of the rods' nodes: the mesh's, or more where rods do not share them.
        within: energies of single rods and linkers: bending, and twist where needed.
        between: energies between rods and linkers: joints and ties.
        ends: (2m,) block of each rod end, start and end of each rod in turn.
        ghosts: (2m,) block of the ghost node past each end, or empty if the ends are pinned.
        angles: number of twist angles, or 0.
        spinning: (s,) block of one twist angle of each rod that could otherwise spin about itself.
        like: (N,) the block of the shared form that each block copies: with shared DOFs the block itself.
        edge_mass: (e,) mass of each edge [kg].
        edge_inertia: (e,) moment of inertia of each edge about its tangent [kg m2].
        joint_mass: (c,) mass of each crossing's joint [kg].
        springs: energies of the supports, which act on the rods' ends.
        beams: along its edge.
        turning: (2m,) stiffness against turning of each clamped end [N m/rad], 0 free to turn; None: all are rigid.
        slides: orthonormal directions along which rod ends may move, by the number of the end; others are held.
        turns: (g, 2, 2) how each flat grid, from which frames are transported, is turned in its plane, of rows x, y.
    """

    mesh: GridMesh
    coupling: Coupling
    node_count: int
    within: tuple[Elements, ...]
    between: tuple[Elements, ...]
    stretch: Stretch
    ends: Ints
    ghosts: Ints
    angles: int
    spinning: Ints
    like: Ints
    edge_mass: Floats
    edge_inertia: Floats
    joint_mass: Floats
    springs: tuple[Elements, ...] = ()
    beams: tuple[FittedBeam, ...] = ()
    turning: Floats | None = None
    slides: Mapping[int, Sequence[Direction]] = field(default_factory=dict)
    turns: Floats = field(default_factory=lambda: np.eye(2)[None])

    def __repr__(self) -> str:
        ends = CLAMPED if len(self.ghosts) else PINNED
        coupled = "" if isinstance(self.coupling, SharedDofs) else f", {self.coupling.name} coupling"
        return f"Shell({self.node_count} nodes, {len(self.stretch.blocks)} edges, {ends}{coupled})"

    @staticmethod
    def of(
        mesh: GridMesh,
        rod: Rod | Sequence[Rod],
        *,
        clamped: bool = False,
        joint: Joint | Sequence[Joint] | None = None,
        coupling: Coupling | None = None,
        twist: bool | None = None,
        isotropic: bool | None = None,
    ) -> "Shell":
        """Assemble a mesh.

        Args:
            mesh: if joints are eccentric and its rods share nodes, `Shell.mesh` is that mesh in layers.
            rod: the same for all, or one for each rod of the grid; where a rod of the grid has a profile, its section
                changes along it. Linkers without a rod of their own have the unchanged section.
            clamped: each rod continues to a ghost node past its end that holds its direction there. The end's Voronoi
                length is half its last edge, so that the clamp acts exactly at the end (second order). A rod may spin
                in its clamp.
            joint: the same for all, or one for each crossing of the grid; None: ball joints.
            coupling: None: shared DOFs. Eccentric joints are tied by springs with any coupling.
            twist: give the rods twist angles; None: if any energy depends on them.
            isotropic: False: give all rods frames, as one of them needs in a larger shell; None: if these rods need
                them.

        Raises:
            InputError: an argument is of the wrong kind; rods or joints are not as many as those of the grid; joints
                exclude each other; `twist` is False although an energy depends on twist angles.
        """
        instance("mesh", mesh, GridMesh)
        require_joint(joint)
        if coupling is not None:
            instance("coupling", coupling, Coupling, COUPLING)
        clamped, twist = flag("clamped", clamped), None if twist is None else flag("twist", twist)
        return _Builder(mesh, rod, joint, coupling or SharedDofs(), clamped, twist, isotropic).shell()

    @property
    def elements(self) -> tuple[Elements, ...]:
        """All energies but the stretch, those of explicit ties included: an equilibrium is the same."""
        return (*self.within, *self.between, *self.springs, *(part for beam in self.beams for part in beam.elements))

    @property
    def energies(self) -> Potential:
        """The sum of all energies."""
        return Potential((*self.elements, self.stretch))

    @property
    def explicit(self) -> tuple[Elements, ...]:
        """The elements whose forces a motion freezes at the start of each step."""
        return self.between if isinstance(self.coupling, ExplicitPenalty) else ()

    @cached_property
    def frames(self) -> BendTwist | None:
        """The elements that carry the rods' material frames; None where rods have none."""
        return frames_among(self.within)

    @property
    def yields(self) -> bool:
        """Whether its supports let the rods' ends move."""
        return bool(self.slides or self.springs or self.beams) or self.turning is not None

    @property
    def first_angle(self) -> int:
        """Block of the first edge's twist angle."""
        return self.node_count + len(self.ghosts)

    @property
    def node_blocks(self) -> Ints:
        """(k,) block that holds each entry of `mesh.rod_nodes`."""
        shared = self.node_count == self.mesh.node_count
        return self.mesh.rod_nodes if shared else np.arange(len(self.mesh.rod_nodes))

    @cached_property
    def flat_coordinates(self) -> Floats:
        """(N, 2) coordinates of each block in the flat grid [m]; of a twist angle those of its edge's middle."""
        flat = self.mesh.flat[:, :2]
        ghosts = flat[self.mesh.ends.ravel()[: len(self.ghosts)]]
        angles = np.empty((0, 2))
        if self.angles:
            angles = np.vstack([flat[self.mesh.edges].mean(axis=1), ghosts])[: self.angles]
        shared = np.concatenate([flat, ghosts, angles])
        of_beams = [shared[self.like[beam.stretch.blocks]].mean(axis=1) for beam in self.beams]
        return np.concatenate([shared, *of_beams]).take(self.like, axis=0)

    @cached_property
    def mass(self) -> Floats:
        """(N, 3) lumped mass of each block's components [kg; of twist angles kg m2]."""
        mesh, (start, end), (first, second) = self.mesh, self.mesh.edges.T, self.mesh.joint_pairs.T
        half, of_joints = 0.5 * self.edge_mass, 0.5 * self.joint_mass  # half of a joint's mass on either rod
        of_nodes = np.zeros(mesh.node_count)
        for nodes, share in ((start, half), (end, half), (first, of_joints), (second, of_joints)):
            of_nodes += np.bincount(nodes, share, minlength=mesh.node_count)
        shared = np.zeros((int(self.like.max()) + 1, 3))
        shared[: mesh.node_count] = of_nodes[:, None]
        if self.angles:
            angles = mesh.node_count + len(self.ghosts)
            shared[angles : angles + len(mesh.edges), 0] = self.edge_inertia
        mass = np.asarray(shared[self.like] / np.bincount(self.like)[self.like][:, None])
        for beam in self.beams:
            beam.add_mass(mass)
        return mass

    def state(self, positions: NodePositions, tangents: Floats | None = None, normals: Floats | None = None) -> Floats:
        """(N, 3) state of the shell.

        Args:
            tangents: (2m, 3) outward unit tangents at the rod ends, which clamped ends need.
            normals: (n, 3) of the surface at the nodes. Each edge's first material director is turned towards them;
                None: the directors are those of the flat grid, moved by the smallest rotation.
        """
        shared = np.zeros((int(self.like.max()) + 1, 3))
        shared[: len(positions)] = positions
        state = shared.take(self.like, axis=0)
        if len(self.ghosts):
            assert tangents is not None
            state[self.ghosts] = state[self.ends] + last_edges(self.mesh)[:, None] * tangents
        if self.angles and normals is not None:
            self._turn_directors(state, normals)
        return state

    def positions(self, state: State) -> Floats:
        """(n, 3) positions of the mesh's nodes in a `state` (N, 3) [m]; of nodes that a penalty ties, their mean."""
        if self.node_count == self.mesh.node_count:  # nodes that rods share
            return state[: self.node_count].copy()
        result, visits = np.zeros((self.mesh.node_count, 3)), np.zeros(self.mesh.node_count)
        np.add.at(result, self.mesh.rod_nodes, state[self.node_blocks])
        np.add.at(visits, self.mesh.rod_nodes, 1.0)
        return result / visits[:, None]

    def freedom(self) -> Freedom:
        """All nodes free, ghosts fixed, one free component a twist angle; rods that could spin freely are held."""
        free = Freedom.free(len(self.like)).with_directions(self.ghosts)
        turning = np.flatnonzero(self.like >= self.mesh.node_count + len(self.ghosts))
        return free.with_directions(turning, ANGLE).with_directions(self.spinning) if len(turning) else free

    def with_elements(self, elements: tuple[Elements, ...]) -> "Shell":
        """The same shell with other `elements`, as many and in the same order: with their source frames elsewhere."""
        parts, rest = list[tuple[Elements, ...]](), elements
        for group in (self.within, self.between, self.springs, *(beam.elements for beam in self.beams)):
            parts.append(rest[: len(group)])
            rest = rest[len(group) :]
        within, between, springs, *of_beams = parts
        beams = tuple(beam.with_elements(part) for beam, part in zip(self.beams, of_beams, strict=True))
        return replace(self, within=within, between=between, springs=springs, beams=beams)

    def with_beams(self, beams: Sequence[FittedBeam]) -> "Shell":
        """The same shell with beams along its edge, whose twist angles follow its blocks in their order."""
        count = sum(len(beam.angles) for beam in beams)
        like = np.append(self.like, int(self.like.max()) + 1 + np.arange(count))
        spinning = np.concatenate([self.spinning, *(beam.loose for beam in beams)]).astype(np.intp)
        return replace(self, beams=tuple(beams), like=like, spinning=spinning)

    @cached_property
    def grid_of(self) -> Ints:
        """(N,) which of the grids that lie side by side each block belongs to."""
        of_rods = self.mesh.grid_of_rods
        of_ends, of_edges = np.repeat(of_rods, 2), of_rods[self.mesh.edge_rods]
        of_angles = np.append(of_edges, of_ends)[: self.angles]
        of_beams = [np.repeat(of_ends[beam.along.ends[0]], len(beam.angles)) for beam in self.beams]
        return np.concatenate([self.mesh.grid_of_nodes, of_ends[: len(self.ghosts)], of_angles, *of_beams])[self.like]

    def turned(self, turns: Floats) -> "Shell":
        """The same shell of flat grids that are turned in their plane (g, 2, 2), of rows x, y, so that no edge of a
        shell that lies the other way round has to be turned right round from there."""
        of_grids = [turns[self.grid_of[element.blocks[:, 0]]] for element in self.elements]
        frames = self.with_elements(tuple(map(turned, self.elements, of_grids)))
        return replace(frames, turns=self.turns @ turns)

    def with_frames_of(self, elements: tuple[Elements, ...]) -> "Shell":
        """The same shell with the source frames of the elements of another one on the same mesh, with other
        stiffnesses, so that twist angles mean the same in both."""
        return self.with_elements(tuple(map(with_frames, self.elements, elements)))

    def with_turning(self, turning: Floats) -> "Shell":
        """The same shell, its clamps being as stiff as that: in series with what of the rods is in them.

        Args:
            turning: (2m,) stiffness of each [N m/rad]; `inf` is rigid, 0 lets the rod's end turn.
        """
        before = np.full(len(turning), np.inf) if self.turning is None else self.turning
        within = list[Elements]()
        for element in self.within:
            if is_bends(element):
                row, column = np.nonzero((element.blocks >= self.node_count) & (element.blocks < self.first_angle))
                end, bends = element.blocks[row, column] - self.node_count, element.bend_stiffness.copy()
                with np.errstate(divide="ignore", invalid="ignore"):
                    softness = 1.0 / bends[row] + (1.0 / turning[end] - 1.0 / before[end])[:, None]
                    bends[row] = np.nan_to_num(1.0 / softness)
                twist = getattr(element, "twist_stiffness", np.zeros(len(bends)))
                element = element.with_stiffness(np.column_stack([bends[:, 0], bends[:, -1], twist]))
            within.append(element)
        return replace(self, within=tuple(within), turning=turning)

    def held_ends(self) -> Freedom:
        """As `freedom`, with every rod end held in place, or along all but its directions."""
        held = self.freedom().with_directions(self.ends)
        for end, directions in self.slides.items():
            held = held.with_directions(self.ends[[end]], *directions)
        return held

    def _turn_directors(self, state: Floats, normals: Floats) -> None:
        """Set the twist angles so that the first directors are as near to the normals as they can be."""
        flat = self.mesh.flat[self.mesh.edges]
        before, now = (unit(np.diff(ends, axis=1)[:, 0]) for ends in (flat, state[self.stretch.blocks]))
        before[:, :2] = (before[:, None, :2] @ self.turns[self.grid_of[self.stretch.blocks[:, 0]]])[:, 0]
        moved = parallel_transport(adapted(np.broadcast_to(UP, before.shape), before), before, now)
        wanted = adapted(unit(normals[self.mesh.edges].sum(axis=1)), now)
        self.turn_edges(state, signed_angle(moved, wanted, now))

    def turn_edges(self, state: Floats, turns: Floats) -> None:
        """Add `turns` (e,) [rad] to the twist angles in `state` of the mesh's edges and their copies."""
        first = self.mesh.node_count + len(self.ghosts)
        turning = np.flatnonzero((self.like >= first) & (self.like < first + len(turns)))
        state[turning, 0] += turns[self.like[turning] - first]


class _Builder:
    """The assembly of a shell, step by step."""

    def __init__(
        self,
        mesh: GridMesh,
        rod: Rod | Sequence[Rod],
        joint: Joint | Sequence[Joint] | None,
        coupling: Coupling,
        clamped: bool,
        twist: bool | None,
        isotropic: bool | None = None,
    ) -> None:
        for item in rod if isinstance(rod, Sequence) else (rod,):
            instance("rod", item, Rod)
        self.rods = _per_item(rod, len(mesh.grid.rods), "rods")
        self.joints, self.joint_of = _kinds(
            _per_item(Ball() if joint is None else joint, len(mesh.grid.crossings), "crossings")
        )
        if isinstance(joint, Sequence):
            refuse_mixtures(mesh.joint_nodes, joint)
        eccentricity = max((item.eccentricity for item in self.joints), default=0.0)
        if eccentricity and not mesh.layered:
            mesh = mesh.in_layers(eccentricity)
        self.mesh, self.coupling = mesh, coupling
        self.sections = RodSections.of(mesh, self.rods)
        self.stiffness = self.sections.nodes
        self.curved = any(line.curve is not None for line in mesh.grid.rods)
        alike = bool((self.stiffness[:, 0] == self.stiffness[:, 1]).all())
        self.isotropic = isotropic is not False and alike and not self.curved
        needed = not self.isotropic or any(item.turns_frames for item in self.joints)
        self.twist = needed if twist is None else twist
        if needed and not self.twist:
            raise InputError("these rods or joints need twist angles: leave out twist=False")
        self.apart = mesh.layered or not isinstance(coupling, SharedDofs)
        self.parts = mesh.apart if self.apart and not mesh.layered else mesh
        n = self.parts.node_count
        ends = 2 * len(mesh.grid.rods)
        self.ghosts = n + np.arange(ends if clamped else 0)
        self.first_angle = n + len(self.ghosts)
        self.angles = (len(mesh.edges) + (0 if self.isotropic else len(self.ghosts))) if self.twist else 0
        self.size = self.first_angle + self.angles
        self.rod_nodes = RodNodes(mesh, self.parts.rod_nodes, self.first_angle)
        self.like = np.arange(mesh.node_count + len(self.ghosts) + self.angles)
        if self.apart:
            self.like = np.append(mesh.rod_nodes, self.like[mesh.node_count :])

    def _of_joints(self, value: Callable[[Joint], object], kind: type = float) -> NDArray[Any]:
        """A value of each joint (c,), float or bool."""
        return np.array([value(joint) for joint in self.joints], dtype=kind)[self.joint_of]

    def shell(self) -> Shell:
        mesh, parts = self.mesh, self.parts
        stretch = Stretch.elastic(parts.edges, mesh.edge_lengths, self.sections.stretch)
        bends = self._bends()
        linkers, linker_ties = self._linkers()
        within, between = (*bends, *linkers), (*self._elastic(), *self._ties(), *linker_ties)
        return Shell(
            mesh, self.coupling, parts.node_count, within, between, stretch,
            parts.ends.ravel(), self.ghosts, self.angles, self._spinning(), self.like,
            mesh.edge_lengths * self.sections.mass, mesh.edge_lengths * self.sections.rotary_inertia,
            self._of_joints(lambda joint: joint.mass),
        )  # fmt: skip

    def _spinning(self) -> Ints:
        """Block of the first twist angle of each rod that could spin about itself."""
        if not self.twist:
            return np.empty(0, dtype=np.intp)
        round_rods = np.logical_and.reduceat(self.stiffness[:, 0] == self.stiffness[:, 1], self.mesh.rod_start)
        holding = self._of_joints(lambda joint: joint.holds_normals, bool)
        held = np.unique(self.mesh.grid.crossings.rods[holding])
        bent = [k for k, line in enumerate(self.mesh.grid.rods) if line.curve is not None]
        loose = np.setdiff1d(np.flatnonzero(round_rods), [*held, *bent])
        return self.first_angle + np.searchsorted(self.mesh.edge_rods, loose)

    def _bends(self) -> tuple[Elements, ...]:
        """Bending and twist of single rods. Isotropic rods bend without their frames: see `ElasticRod`."""
        mesh, parts = self.mesh, self.parts
        stiffness = self.stiffness if self.twist else self.stiffness[:, :1]  # without twist angles all are alike
        nodes, per_length = parts.bends, stiffness[mesh.bend_entries] / mesh.voronoi_lengths[:, None]
        if len(self.ghosts):
            rows = np.column_stack([_inner_nodes(parts), parts.ends.ravel(), self.ghosts])
            at_clamps = stiffness[mesh.end_entries] / (0.5 * last_edges(mesh)[:, None])
        if self.isotropic:
            bends, of_bends = nodes, per_length[:, 0]
            if len(self.ghosts):
                bends, of_bends = np.vstack([bends, rows]), np.append(of_bends, at_clamps[:, 0])
            elements: tuple[Elements, ...] = (IsotropicBend(np.ascontiguousarray(bends), of_bends.copy()),)
            if not self.twist:
                return elements
        edge = self.first_angle + np.arange(len(mesh.edges))
        same_rod = mesh.edge_rods[1:] == mesh.edge_rods[:-1]
        angles = np.column_stack([edge[:-1][same_rod], edge[1:][same_rod]])
        if self.isotropic:
            return (*elements, self._bend_twist(nodes, angles, np.zeros((len(nodes), 2)), per_length[:, 2]))
        if len(self.ghosts):
            last = np.searchsorted(mesh.edge_rods, np.arange(len(self.rods)), side="right") - 1
            first = np.searchsorted(mesh.edge_rods, np.arange(len(self.rods)))
            ghost_angles = self.first_angle + len(edge) + np.arange(len(self.ghosts))
            pairs = np.column_stack([edge[np.column_stack([first, last]).ravel()], ghost_angles])
            # at a start the ghost comes first: an edge has the direction of its rod
            rows[::2], pairs[::2] = rows[::2, ::-1], pairs[::2, ::-1]
            nodes, angles = np.vstack([nodes, rows]), np.vstack([angles, pairs])
            per_length = np.vstack([per_length, at_clamps])
        bend_twist = self._bend_twist(nodes, angles, per_length[:, :2], per_length[:, 2])
        if not self.curved:
            return (bend_twist,)
        at_rest = mesh.rest_curvatures[mesh.bend_entries] * mesh.voronoi_lengths
        if len(self.ghosts):
            at_rest = np.append(at_rest, mesh.rest_curvatures[mesh.end_entries] * 0.5 * last_edges(mesh))
        turned = -2.0 * np.tan(0.5 * at_rest)  # m2 = t x z is on the right
        return (replace(bend_twist, natural_curvature=np.column_stack([0.0 * turned, turned])),)

    def _bend_twist(self, nodes: Ints, angles: Ints, bend: Floats, twist: Floats) -> BendTwist:
        blocks = np.column_stack([nodes[:, 0], angles[:, 0], nodes[:, 1], angles[:, 1], nodes[:, 2]])
        return BendTwist.starting_at(blocks, self._flat(), UP, bend_stiffness=bend, twist_stiffness=twist)

    def _flat(self) -> Floats:
        """(size, 3) the flat state, ghosts straight on."""
        flat = np.zeros((self.size, 3))
        flat[: self.parts.node_count] = self.parts.flat
        if len(self.ghosts):
            ends, inner = self.parts.ends.ravel(), _inner_nodes(self.parts)
            flat[self.ghosts] = 2 * self.parts.flat[ends] - self.parts.flat[inner]
        return flat

    def _elastic(self) -> tuple[Elements, ...]:
        """Joints other than linkers."""
        joints = [self.joints[kind] for kind in self.joint_of.tolist()]
        return elastic_joints(self.rod_nodes, np.arange(len(joints)), joints, self.stiffness, self.size)

    def _linkers(self) -> tuple[list[Elements], list[Elements]]:
        """Linkers, and the ties of those with their own unknowns, whose blocks are added here."""
        linkers, ties = list[Elements](), list[Elements]()
        for kind, joint in enumerate(self.joints):
            if not joint.corners:
                continue
            crossings = np.flatnonzero(self.joint_of == kind)
            corners = Corners.of(self.rod_nodes, crossings, joint.corners)
            blocks = corners.blocks
            if self.apart:
                blocks = self.size + np.arange(5 * len(blocks)).reshape(-1, 5)
                self.size += blocks.size
                self.like = np.append(self.like, self.like[corners.blocks])
                c1, c2 = self._penalties()
                nodes = np.column_stack([blocks[:, ::2].ravel(), corners.blocks[:, ::2].ravel()])
                angles = np.column_stack([blocks[:, 1::2].ravel(), corners.blocks[:, 1::2].ravel()])
                ties += [
                    _ties(nodes, c1),
                    _ties(np.column_stack([blocks[:, 2], corners.joints[:, 1]]), c1),
                    _ties(angles, c2),
                ]
            flat = self._flat()
            if self.apart:
                flat[blocks] = flat[corners.blocks]
            if joint.rod is None:
                unchanged = np.array([(*rod.bend_stiffnesses, rod.twist_stiffness) for rod in self.rods])
                stiffness = unchanged[corners.rods].mean(axis=1)
            else:
                stiffness = np.tile([*joint.rod.bend_stiffnesses, joint.rod.twist_stiffness], (len(blocks), 1))
            linkers.append(LinkerBend.of(corners, blocks, flat, stiffness))
        return linkers, ties

    def _ties(self) -> list[Elements]:
        """Between the nodes of rods at joints without linkers."""
        if not self.apart:
            return []
        eccentricity = self._of_joints(lambda joint: joint.eccentricity)
        centric = (eccentricity == 0.0) & self._of_joints(lambda joint: not joint.corners, bool)
        pairs = self.rod_nodes.blocks[self.rod_nodes.at_crossings[centric]]
        ties = [_ties(pairs, self._penalties()[0])] if centric.any() else []
        return [*ties, *offset_ties(self.rod_nodes, eccentricity, self._offset_stiffness(), self.size)]

    def _offset_stiffness(self) -> Floats:
        """(c,) stiffness of eccentric ties [N/m].

        Ties a hundred thousand times stiffer, as of a penalty, would have a geometric stiffness that outweighs bending
        already at the micrometres by which rods miss their distance in an initial guess.
        """
        mesh, rods = self.mesh, self.mesh.grid.crossings.rods
        if not isinstance(self.coupling, SharedDofs):
            return np.full(len(rods), self._penalties()[0])
        edges = np.array([np.median(grid.edge_lengths) for grid in mesh.grids])
        least = min(rod.stretch_stiffness for rod in self.rods)
        return OFFSET_STIFFNESS * least / edges[mesh.grid_of_rods[rods[:, 0]]]

    def _penalties(self) -> tuple[float, float]:
        """C1 [N/m] and C2 [N m/rad]; by default those of the softest rod."""
        coupling = ImplicitPenalty() if isinstance(self.coupling, SharedDofs) else self.coupling
        edge = np.median(self.mesh.edge_lengths)
        values = [coupling.with_defaults(rod, edge) for rod in set(self.rods)]
        return min(float(value.C1 or 0.0) for value in values), min(float(value.C2 or 0.0) for value in values)


def _per_item(value: _Item | Sequence[_Item], count: int, items: str) -> tuple[_Item, ...]:
    """A tuple of `count` values, from one for all or one for each."""
    if not isinstance(value, Sequence):
        return (value,) * count
    if len(value) != count:
        raise InputError(f"the grid has {count} {items}: give one value for all, or one for each, not {len(value)}")
    return tuple(value)


def _kinds(joints: tuple[Joint, ...]) -> tuple[tuple[Joint, ...], Ints]:
    """The different ones among joints, and which of these each is."""
    if joints and joints.count(joints[0]) == len(joints):
        return joints[:1], np.zeros(len(joints), dtype=np.intp)
    number = {joint: kind for kind, joint in enumerate(dict.fromkeys(joints))}
    return tuple(number), np.array([number[joint] for joint in joints], dtype=np.intp)


def _ties(pairs: Ints, stiffness: float) -> Ties:
    return Ties(pairs, np.full(len(pairs), stiffness))


def _inner_nodes(mesh: GridMesh) -> Ints:
    """(2m,) neighbour of each rod end."""
    return np.column_stack([mesh.rod_nodes[mesh.rod_start + 1], mesh.rod_nodes[mesh.rod_stop - 2]]).ravel()


def last_edges(mesh: GridMesh) -> Floats:
    """(2m,) rest length of the edge at each rod end of a `mesh` [m]."""
    s, first, stop = mesh.stations, mesh.rod_start, mesh.rod_stop
    return np.column_stack([s[first + 1] - s[first], s[stop - 1] - s[stop - 2]]).ravel()
