"""A meshed grid of rods and joints as a sum of energies, with its clamps and, where they matter, its twist angles.

The state's blocks are the nodes, then the ghost nodes of the clamps, then the twist angles of the edges (and of the
ghost edges, where they matter), then, with a penalty coupling, the nodes and the twist angles of the linkers.

The coupling decides the nodes [HQK 2.2]. With shared DOFs rods have one node at a joint, and linkers no unknowns of
their own. With a penalty every rod and every linker has its own: `like` says which block of the shared form each
copies, and the mass of that block is divided among its copies equally, so that none is counted twice.

Eccentric joints lay the rods in two layers, whose mesh gives every rod nodes of its own (`GridMesh.in_layers`).
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import adapted, parallel_transport, signed_angle
from rodshell.geometry.vectors import unit
from rodshell.joints import Ball, Coupling, ExplicitPenalty, ImplicitPenalty, Joint, Linker, SharedDofs, Ties
from rodshell.joints.crossings import RodNodes
from rodshell.joints.joint_stiffness import elastic_joints, refuse_mixtures
from rodshell.joints.linkers import Corners, LinkerBend
from rodshell.joints.offset_tie import offset_ties
from rodshell.layout import GridMesh
from rodshell.model.freedom import Freedom
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.elements import Elements
from rodshell.rods.isotropic import IsotropicBend
from rodshell.rods.section import Rod
from rodshell.rods.stretch import Stretch

UP = (0.0, 0.0, 1.0)
OFFSET_STIFFNESS = 10.0  # of an edge's: ties of eccentric joints
SPIN = (1.0, 0.0, 0.0)  # the one component of an angle block that means anything


@dataclass(frozen=True)
class Shell:
    """The assembled shell. Build it with `of`.

    Parameters
    ----------
    mesh : its nodes and edges, rods sharing their nodes at joints.
    coupling : how its rods hold together.
    node_count : of the rods' nodes: the mesh's, or more where rods do not share them.
    within : energies of single rods and linkers: bending, and twist where it matters.
    between : energies between rods and linkers: joints and ties.
    stretch : the edges.
    ends : (2m,) block of each rod end, start and end of each rod in turn.
    ghosts : (2m,) ghost node past each end, or empty where the ends are pinned.
    angles : number of twist angles, or 0.
    spinning : (s,) blocks of one twist angle of each rod that nothing else keeps from spinning about itself.
    like : (N,) for each block that of the shared form which it copies; there, the block itself.
    mass : (N, 3) lumped mass of each block's components [kg; of twist angles kg m2].
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
    mass: Floats

    @staticmethod
    def of(
        mesh: GridMesh,
        rod: Rod | Sequence[Rod],
        *,
        clamped: bool = False,
        joint: Joint | Sequence[Joint] | None = None,
        coupling: Coupling | None = None,
        twist: bool | None = None,
    ) -> "Shell":
        """Assemble a mesh.

        Parameters
        ----------
        mesh : where joints are eccentric and its rods share nodes, `Shell.mesh` is that mesh in layers.
        rod : one for all, or one for each rod of the grid.
        clamped : each rod goes on to a ghost node past its end that holds its direction there. The end's
            Voronoi length is half its last edge, so that the clamp acts exactly at the end (second order). A rod
            may spin in its clamp.
        joint : one for all, or one for each crossing of the grid; ball joints without.
        coupling : shared DOFs without. Eccentric joints are tied by springs with any coupling.
        twist : carry twist angles; None: where any energy depends on them.

        Raises
        ------
        InputError : rods or joints are not as many as those of the grid; joints that exclude each other.
        """
        return _Builder(mesh, rod, joint, coupling or SharedDofs(), clamped, twist).shell()

    @property
    def elements(self) -> tuple[Elements, ...]:
        """Every energy but the stretch. That of explicit ties is in here too: an equilibrium is the same."""
        return (*self.within, *self.between)

    @property
    def explicit(self) -> tuple[Elements, ...]:
        """Those of the elements whose forces a motion freezes at the start of each step."""
        return self.between if isinstance(self.coupling, ExplicitPenalty) else ()

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
    def places(self) -> Floats:
        """(N, 2) where each block lies in the flat grid [m]; a twist angle in the middle of its edge."""
        flat = self.mesh.flat[:, :2]
        ghosts = flat[self.mesh.ends.ravel()[: len(self.ghosts)]]
        middles = flat[self.mesh.edges].mean(axis=1)
        angles = np.vstack([middles, ghosts])[: self.angles]
        return np.vstack([flat, ghosts, angles])[self.like]

    def state(self, positions: Floats, tangents: Floats | None = None, normals: Floats | None = None) -> Floats:
        """State blocks from the positions (n, 3) of the mesh's nodes and the outward end tangents (2m, 3).

        normals : (n, 3) of the surface at the nodes. Each edge's first material director is turned towards them;
            without, the directors are those of the flat grid, carried along by the smallest rotation.
        """
        shared = np.zeros((self.like.max() + 1, 3))
        shared[: len(positions)] = positions
        state = shared[self.like]
        if len(self.ghosts):
            assert tangents is not None
            state[self.ghosts] = state[self.ends] + last_edges(self.mesh)[:, None] * tangents
        if self.angles and normals is not None:
            self._turn_directors(state, normals)
        return state

    def positions(self, state: Floats) -> Floats:
        """(n, 3) positions of the mesh's nodes in a state [m]; of nodes that a penalty ties, their middle."""
        result, visits = np.zeros((self.mesh.node_count, 3)), np.zeros(self.mesh.node_count)
        np.add.at(result, self.mesh.rod_nodes, state[self.node_blocks])
        np.add.at(visits, self.mesh.rod_nodes, 1.0)
        return result / visits[:, None]

    def freedom(self) -> Freedom:
        """All nodes free, ghosts fixed, one free component a twist angle; what would spin for nothing is held."""
        free = Freedom.free(len(self.like)).with_directions(self.ghosts)
        turning = np.flatnonzero(self.like >= self.mesh.node_count + len(self.ghosts))
        return free.with_directions(turning, SPIN).with_directions(self.spinning)

    def with_elements(self, elements: tuple[Elements, ...]) -> "Shell":
        """The same shell with its elements' source frames elsewhere."""
        count = len(self.within)
        return replace(self, within=elements[:count], between=elements[count:])

    def held_ends(self) -> Freedom:
        """As `freedom`, with every rod end held in place."""
        return self.freedom().with_directions(self.ends)

    def _turn_directors(self, state: Floats, normals: Floats) -> None:
        """Set the twist angles so that the first directors are as near to the normals as they can be."""
        flat = self.mesh.flat[self.mesh.edges]
        before, now = (unit(np.diff(ends, axis=1)[:, 0]) for ends in (flat, state[self.stretch.blocks]))
        carried = parallel_transport(adapted(np.broadcast_to(UP, before.shape), before), before, now)
        wanted = adapted(unit(normals[self.mesh.edges].sum(axis=1)), now)
        self.turn_edges(state, signed_angle(carried, wanted, now))

    def turn_edges(self, state: Floats, turns: Floats) -> None:
        """Add `turns` (e,) [rad] to the twist angles of the rods' edges, and of the linkers that copy them."""
        first = self.mesh.node_count + len(self.ghosts)
        turning = np.flatnonzero((self.like >= first) & (self.like < first + len(turns)))
        state[turning, 0] += turns[self.like[turning] - first]


class _Builder:
    """What the assembly of a shell needs on the way."""

    def __init__(
        self,
        mesh: GridMesh,
        rod: Rod | Sequence[Rod],
        joint: Joint | Sequence[Joint] | None,
        coupling: Coupling,
        clamped: bool,
        twist: bool | None,
    ) -> None:
        self.rods = _one_each(rod, Rod, len(mesh.grid.rods), "rods")
        self.joints = _one_each(joint or Ball(), None, len(mesh.grid.crossings), "crossings")
        if isinstance(joint, Sequence):
            refuse_mixtures(mesh.joint_nodes, self.joints)
        eccentricity = max((one.eccentricity for one in self.joints), default=0.0)
        if eccentricity and not mesh.layered:
            mesh = mesh.in_layers(eccentricity)
        self.mesh, self.coupling = mesh, coupling
        self.stiffness = np.array([(*one.bend_stiffnesses, one.twist_stiffness) for one in self.rods])
        self.isotropic = bool((self.stiffness[:, 0] == self.stiffness[:, 1]).all())
        needed = not self.isotropic or any(one.turns_frames for one in self.joints)
        self.twist = needed if twist is None else twist
        if needed and not self.twist:
            raise InputError("these rods and joints turn frames: they cannot go without twist angles")
        self.apart = mesh.layered or not isinstance(coupling, SharedDofs)
        self.parts = mesh.apart if self.apart and not mesh.layered else mesh
        n = self.parts.node_count
        ends = 2 * len(mesh.grid.rods)
        self.ghosts = n + np.arange(ends if clamped else 0)
        self.first_angle = n + len(self.ghosts)
        self.angles = (len(mesh.edges) + (0 if self.isotropic else len(self.ghosts))) if self.twist else 0
        self.size = self.first_angle + self.angles
        self.rod_nodes = RodNodes(mesh, self.parts.rod_nodes, self.first_angle)
        shared = mesh.node_count
        rest = shared + np.arange(len(self.ghosts) + self.angles)
        self.like = np.append(mesh.rod_nodes if self.apart else np.arange(shared), rest)

    def shell(self) -> Shell:
        mesh, parts = self.mesh, self.parts
        stretch = Stretch.elastic(
            parts.edges, mesh.edge_lengths, np.array([rod.stretch_stiffness for rod in self.rods])[mesh.edge_rods]
        )
        bends = self._bends()
        linkers, linker_ties = self._linkers()
        turned = [n for n, one in enumerate(self.joints) if one.holds_normals]
        steady = np.unique(mesh.grid.crossings.rods[turned]) if self.isotropic else np.arange(len(self.rods))
        loose = np.setdiff1d(np.arange(len(self.rods)), steady) if self.twist else np.empty(0, dtype=np.intp)
        spinning = self.first_angle + np.searchsorted(mesh.edge_rods, loose)
        copies = np.bincount(self.like)
        shared = self._shared_mass()
        mass = shared[self.like] / copies[self.like][:, None]
        within, between = (*bends, *linkers), (*self._elastic(), *self._ties(), *linker_ties)
        return Shell(
            mesh, self.coupling, parts.node_count, within, between, stretch,
            parts.ends.ravel(), self.ghosts, self.angles, spinning, self.like, mass,
        )  # fmt: skip

    def _bends(self) -> tuple[Elements, ...]:
        """Of single rods. Isotropic ones bend without their frames: see `ElasticRod`."""
        mesh, parts = self.mesh, self.parts
        per_length = self.stiffness[mesh.bend_rods] / mesh.voronoi_lengths[:, None]
        edge = self.first_angle + np.arange(len(mesh.edges))
        same = mesh.edge_rods[1:] == mesh.edge_rods[:-1]
        nodes, angles = parts.bends, np.column_stack([edge[:-1][same], edge[1:][same]])
        if len(self.ghosts):
            ends = parts.ends.ravel()
            rows = np.column_stack([_inner_nodes(parts), ends, self.ghosts])
            of_rods = np.repeat(np.arange(len(self.rods)), 2)
            at_clamps = self.stiffness[of_rods] / (0.5 * last_edges(mesh)[:, None])
        if self.isotropic:
            bends, stiffness = nodes, per_length[:, 0]
            if len(self.ghosts):
                bends, stiffness = np.vstack([bends, rows]), np.append(stiffness, at_clamps[:, 0])
            elements: tuple[Elements, ...] = (IsotropicBend(np.ascontiguousarray(bends), stiffness.copy()),)
            if not self.twist:
                return elements
            return (*elements, self._bend_twist(nodes, angles, np.zeros((len(nodes), 2)), per_length[:, 2]))
        if len(self.ghosts):
            last = np.searchsorted(mesh.edge_rods, np.arange(len(self.rods)), side="right") - 1
            first = np.searchsorted(mesh.edge_rods, np.arange(len(self.rods)))
            ghost_angles = self.first_angle + len(edge) + np.arange(len(self.ghosts))
            # at a start the ghost comes first: an edge runs as its rod does
            rows[::2], own = rows[::2, ::-1], edge[np.column_stack([first, last]).ravel()]
            pairs = np.column_stack([own, ghost_angles])
            pairs[::2] = pairs[::2, ::-1]
            nodes, angles = np.vstack([nodes, rows]), np.vstack([angles, pairs])
            per_length = np.vstack([per_length, at_clamps])
        return (self._bend_twist(nodes, angles, per_length[:, :2], per_length[:, 2]),)

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
        which = np.array([n for n, one in enumerate(self.joints) if not isinstance(one, Linker)], dtype=np.intp)
        return elastic_joints(self.rod_nodes, which, [self.joints[n] for n in which], self.stiffness, self.size)

    def _linkers(self) -> tuple[list[Elements], list[Elements]]:
        """Linkers, and the ties that hold those with unknowns of their own; these get their blocks here."""
        linkers, ties = list[Elements](), list[Elements]()
        for joint in {one for one in self.joints if isinstance(one, Linker)}:
            crossings = np.array([n for n, one in enumerate(self.joints) if one == joint], dtype=np.intp)
            corners = Corners.of(self.rod_nodes, crossings, joint.corners)
            blocks = corners.blocks
            if self.apart:
                blocks = self.size + np.arange(5 * len(blocks)).reshape(-1, 5)
                self.size += blocks.size
                self.like = np.append(self.like, self.like[corners.blocks])
                ties.append(self._tied(np.column_stack([blocks[:, ::2].ravel(), corners.blocks[:, ::2].ravel()]), 1))
                ties.append(self._tied(np.column_stack([blocks[:, 2], corners.joints[:, 1]]), 1))
                ties.append(self._tied(np.column_stack([blocks[:, 1::2].ravel(), corners.blocks[:, 1::2].ravel()]), 2))
            flat = self._flat()
            if self.apart:
                flat[blocks] = flat[corners.blocks]
            own = None if joint.rod is None else [*joint.rod.bend_stiffnesses, joint.rod.twist_stiffness]
            stiffness = self.stiffness[corners.rods].mean(axis=1) if own is None else np.tile(own, (len(blocks), 1))
            linkers.append(LinkerBend.of(corners, blocks, flat, stiffness))
        return linkers, ties

    def _ties(self) -> list[Elements]:
        """Between the nodes of rods at joints without linkers."""
        if not self.apart:
            return []
        met = self.rod_nodes.at_crossings
        eccentric = np.array([one.eccentricity for one in self.joints])
        plain = np.array([n for n, one in enumerate(self.joints) if not (eccentric[n] or isinstance(one, Linker))])
        ties = [self._tied(self.rod_nodes.blocks[met[plain.astype(np.intp)]], 1)] if len(plain) else []
        return [*ties, *offset_ties(self.rod_nodes, eccentric, self._offset_stiffness(), self.size)]

    def _offset_stiffness(self) -> float:
        """Of eccentric ties [N/m]. A hundred thousand times stiffer ones, like a penalty's, would make a geometric
        stiffness that outweighs bending of the micrometres by which rods miss their distance in a first guess."""
        if not isinstance(self.coupling, SharedDofs):
            return self._penalty(1)
        edge = float(np.median(self.mesh.edge_lengths))
        return OFFSET_STIFFNESS * min(rod.stretch_stiffness for rod in self.rods) / edge

    def _tied(self, pairs: Ints, which: int) -> Ties:
        return Ties(pairs, np.full(len(pairs), self._penalty(which)))

    def _penalty(self, which: int) -> float:
        """C1 [N/m] or C2 [N m/rad]; the softest rod decides where they are not given."""
        coupling = ImplicitPenalty() if isinstance(self.coupling, SharedDofs) else self.coupling
        edge = float(np.median(self.mesh.edge_lengths))
        of_rods = [coupling.with_defaults(rod, edge) for rod in set(self.rods)]
        return min(float(one.C1 if which == 1 else one.C2) for one in of_rods)  # type: ignore[arg-type]

    def _shared_mass(self) -> Floats:
        mesh = self.mesh
        mass = np.zeros((int(self.like.max()) + 1, 3))
        half = 0.5 * mesh.edge_lengths * np.array([rod.mass_per_length for rod in self.rods])[mesh.edge_rods]
        for side in range(2):
            np.add.at(mass, mesh.edges[:, side], half[:, None])
        of_joints = 0.5 * np.array([one.mass for one in self.joints])
        for nodes in (mesh.joint_nodes, mesh.joint_nodes if mesh.second_nodes is None else mesh.second_nodes):
            np.add.at(mass, nodes, of_joints[:, None])  # half on either rod
        if self.twist:
            first = mesh.node_count + len(self.ghosts)
            rotary = np.array([rod.rotary_inertia for rod in self.rods])[mesh.edge_rods]
            mass[first : first + len(mesh.edges), 0] = mesh.edge_lengths * rotary
        return mass


def _one_each(given, kind, count: int, of_what: str):  # type: ignore[no-untyped-def]
    """A tuple of `count`."""
    if not isinstance(given, Sequence):
        return (given,) * count
    if len(given) != count:
        raise InputError(f"the grid has {count} {of_what}: give one for all, or as many, not {len(given)}")
    return tuple(given)


def _inner_nodes(mesh: GridMesh) -> Ints:
    """(2m,) neighbour of each rod end."""
    return np.column_stack([mesh.rod_nodes[mesh.rod_start + 1], mesh.rod_nodes[mesh.rod_stop - 2]]).ravel()


def last_edges(mesh: GridMesh) -> Floats:
    """(2m,) rest length of the edge at each rod end [m]."""
    s, first, stop = mesh.stations, mesh.rod_start, mesh.rod_stop
    return np.column_stack([s[first + 1] - s[first], s[stop - 1] - s[stop - 2]]).ravel()
