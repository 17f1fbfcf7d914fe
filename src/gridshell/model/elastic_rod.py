"""One elastic rod on its own [HQK 2.1]: nodes, twist angles, and the sum of its energies.

The state's blocks are the n nodes, then the twist angle of each edge, then what the clamps hold: a ghost node
for each clamped end and, where the rod carries twist angles, the twist angle of each ghost edge.

A clamped rod goes on past its end to a ghost node, one edge out along the clamp's tangent. Between the ghost
edge and the last edge lies half an edge of rod, so that direction and material frame are held exactly at the
end: second order, where holding the last edge itself would act half an edge inside (first order).
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.sparse import csc_matrix, diags

from gridshell.errors import InputError
from gridshell.geometry.frames import adapted, directors_along, parallel_transport, signed_angle
from gridshell.geometry.vectors import cross, dot, unit
from gridshell.model.assembly import Assembly
from gridshell.model.freedom import Freedom
from gridshell.rods.bend_twist import BendTwist
from gridshell.rods.elements import Elements
from gridshell.rods.isotropic_bend import IsotropicBend
from gridshell.rods.section import Rod
from gridshell.rods.stretch import Stretch

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
End = Literal["start", "end"]
Rods = Rod | Sequence[Rod] | Callable[[float], Rod]
Clamps = Sequence[End] | Mapping[End, ArrayLike]

_SPIN = (1.0, 0.0, 0.0)  # the one component of an angle block that means anything


@dataclass(frozen=True)
class RodStrains:
    """Strains of a rod; its b bends are those of the inner nodes in turn, then those of the clamped ends.

    axial : (edges,) [-].
    curvature : (b, 2) towards m1 and m2, per unit length [1/m].
    twist : (b,) per unit length [rad/m].
    """

    axial: Floats
    curvature: Floats
    twist: Floats


@dataclass(frozen=True)
class ElasticRod:
    """One rod, open or a closed ring. Build it with `of`.

    The reference frames are data of the elements: the twist angles of a state are counted from them. Each
    edge's frame is carried from its source, at first the rest shape, to a state by the smallest rotation;
    `refreshed` moves the source, and belongs after each accepted step.

    Parameters
    ----------
    rest : (n, 3) rest positions of the nodes [m].
    closed : a ring; its last edge leads back to the first node.
    elements : bending and twist: `BendTwist`; where the rod is isotropic and naturally straight `IsotropicBend`,
        and beside it a `BendTwist` without bending stiffness for the twist, if any. (Material curvatures are
        averaged over frames that differ by the twist of a node, which softens strongly twisted meshes; ERRATA E2.)
    stretch : the edges.
    mass : (N, 3) lumped mass of each block's components: of a node [kg]; of a twist angle the rotary inertia
        [kg m2] in component 0, else 0. Ghosts have none.
    bend_lengths : (b,) rest length of rod that each bend stands for (Voronoi length; half an edge at a clamp) [m].
    clamps, clamp_tangents : the clamped ends, and (c, 3) the tangents along the rod there at rest.
    free_spin : the energy does not change when the rod spins about itself, its ends with it.
    """

    rest: Floats
    closed: bool
    elements: tuple[Elements, ...]
    stretch: Stretch
    mass: Floats
    bend_lengths: Floats
    clamps: tuple[End, ...]
    clamp_tangents: Floats
    free_spin: bool

    @staticmethod
    def of(
        rest: ArrayLike,
        rod: Rods,
        *,
        closed: bool = False,
        natural: Literal["straight", "rest"] | ArrayLike = "straight",
        natural_twist: ArrayLike = 0.0,
        twist: bool = True,
        director: ArrayLike | None = None,
        clamped: Clamps = (),
    ) -> "ElasticRod":
        """A rod through the nodes `rest` (n, 3) [m], whose edges have their rest lengths there.

        Parameters
        ----------
        rod : one for all, one for each edge, or a function of the arc length [m] of the edge's middle. Between
            two edges the compliances of their halves add up.
        natural : "straight"; "rest", free of stress at rest, frames included; or (b, 2) curvatures towards m1
            and m2 per unit length [1/m] at the inner nodes (of a ring: at all nodes), or (2,) for all.
        natural_twist : per unit length [rad/m], (b,) or one for all; beyond the rest shape's if that is natural.
        twist : carry twist angles. An open, isotropic, naturally straight and untwisted rod has no need of them
            as long as nothing holds or loads its frames (it may spin in its clamps): it bends as it does with
            them, at less cost.
        director : first material director m1, (3,) of the first edge, carried along without twist, or (edges, 3);
            its part across the edge is used. By default z, or x where the rod starts within 25 degrees of z.
        clamped : ends that are clamped, ("start", "end"), or the tangent along the rod at each as it is at rest,
            {"start": (1, 0, 0)}; by default that of the two edges next to the end, to second order.
        """
        nodes = _checked(rest)
        tangents, lengths, edges = _edges(nodes, closed)
        rods = _one_per_edge(rod, lengths)
        stiffness = np.array([(*one.bend_stiffnesses, one.twist_stiffness) for one in rods])
        stretch = Stretch.elastic(edges, lengths, np.array([one.stretch_stiffness for one in rods]))
        directors = _directors(tangents, director)
        clamps = _clamps(clamped, tangents, lengths, closed)

        n, angles, count = len(nodes), len(edges) if twist else 0, len(clamps)
        ghosts = n + angles + np.arange(count)
        state = np.zeros((n + angles + count * (2 if twist else 1), 3))
        state[:n] = nodes
        frames = np.zeros_like(state)
        if twist:
            frames[n : n + angles] = directors
        blocks, bend_lengths, of_bends, like = _bends(n, edges, lengths, stiffness, closed)
        for k, (end, tangent) in enumerate(clamps.items()):
            edge, inner = (0, 1) if end == "start" else (n - 2, n - 2)
            last, outward = (0, -1) if end == "start" else (n - 1, 1)
            state[ghosts[k]] = nodes[last] + outward * lengths[edge] * tangent
            ghost_angle = n + angles + count + k
            row = [ghosts[k], ghost_angle, last, n + edge, inner]
            blocks = np.vstack([blocks, row if end == "start" else row[::-1]])
            bend_lengths = np.append(bend_lengths, 0.5 * lengths[edge])
            of_bends = np.vstack([of_bends, stiffness[edge] / (0.5 * lengths[edge])])
            like = np.append(like, 0 if end == "start" else n - 3)
            if twist:
                frames[ghost_angle] = _end_director(directors, tangents, lengths, tangent, end)

        straight = isinstance(natural, str) and natural == "straight"
        rate = np.broadcast_to(np.asarray(natural_twist, dtype=float), (int(like.max()) + 1,))[like]
        free_spin = straight and bool((stiffness[:, 0] == stiffness[:, 1]).all())
        elements: tuple[Elements, ...] = ()
        if free_spin:
            elements = (IsotropicBend(np.ascontiguousarray(blocks[:, ::2]), of_bends[:, 0].copy()),)
            of_bends[:, :2] = 0.0
        if twist:
            bends = BendTwist.starting_at(
                blocks, state, frames, bend_stiffness=of_bends[:, :2], twist_stiffness=of_bends[:, 2]
            )
            if isinstance(natural, str) and natural == "rest":
                bends = bends.relaxed(state)
            elif not straight:
                curvature = np.broadcast_to(np.asarray(natural, dtype=float), (int(like.max()) + 1, 2))[like]
                bends = replace(bends, natural_curvature=curvature * bend_lengths[:, None])
            elements += (replace(bends, natural_twist=bends.natural_twist + rate * bend_lengths),)
        elif closed or not free_spin or rate.any():
            raise InputError("only an open, isotropic, naturally straight and untwisted rod goes without twist angles")
        mass = _lumped(len(state), n, edges, lengths, rods, twist)
        held = np.array(list(clamps.values())).reshape(-1, 3)
        return ElasticRod(nodes, closed, elements, stretch, mass, bend_lengths, tuple(clamps), held, free_spin)

    @property
    def explicit(self) -> tuple[Elements, ...]:
        """None: every energy of one rod is implicit."""
        return ()

    # Blocks

    @property
    def node_count(self) -> int:
        return len(self.rest)

    @property
    def edge_count(self) -> int:
        return len(self.stretch.blocks)

    @property
    def block_count(self) -> int:
        return len(self.mass)

    @property
    def twists(self) -> bool:
        """Whether the rod carries twist angles."""
        return isinstance(self.elements[-1], BendTwist)

    @property
    def nodes(self) -> slice:
        return slice(0, self.node_count)

    @property
    def angles(self) -> slice:
        """Blocks of the twist angles of the edges; empty where the rod carries none."""
        return slice(self.node_count, self.node_count + (self.edge_count if self.twists else 0))

    @property
    def ghosts(self) -> Ints:
        """Block of the ghost node of each clamp."""
        return self.angles.stop + np.arange(len(self.clamps))

    @property
    def ghost_angles(self) -> Ints:
        """Block of the twist angle of each clamp; empty where the rod carries none."""
        return self.angles.stop + len(self.clamps) + np.arange(len(self.clamps) if self.twists else 0)

    @property
    def clamped_nodes(self) -> Ints:
        """Node of each clamp."""
        return np.array([0 if end == "start" else self.node_count - 1 for end in self.clamps], dtype=np.intp)

    def freedom(self) -> Freedom:
        """Nodes free in space, angles in their one component; clamps fixed: the end, its ghost and their angle."""
        free = Freedom.free(self.block_count).with_directions(np.arange(self.block_count)[self.angles], _SPIN)
        return free.with_directions(np.concatenate([self.clamped_nodes, self.ghosts, self.ghost_angles]))

    # States

    def state(
        self,
        positions: ArrayLike | None = None,
        angles: ArrayLike | None = None,
        tangents: Mapping[End, ArrayLike] | None = None,
    ) -> Floats:
        """(N, 3) state of node positions (n, 3) [m] and twist angles (edges,) [rad]; the rest shape and 0 by default.

        tangents : of the clamps, along the rod; by default those at rest. Their twist angles are 0.
        """
        state = np.zeros((self.block_count, 3))
        state[self.nodes] = self.rest if positions is None else positions
        if angles is not None:
            if not self.twists:
                raise InputError("this rod carries no twist angles: build it with twist=True")
            state[self.angles, 0] = angles
        for k, end in enumerate(self.clamps):
            tangent = unit(np.asarray((tangents or {}).get(end, self.clamp_tangents[k]), dtype=float))
            state[self.ghosts[k]] = self.ghost_position(end, state[self.clamped_nodes[k]], tangent)
        return state

    def ghost_position(self, end: End, position: Floats, tangent: Floats) -> Floats:
        """(3,) where the ghost of a clamp lies [m] whose end is at `position` with the unit `tangent`."""
        edge = 0 if end == "start" else self.edge_count - 1
        return np.asarray(position + (-1 if end == "start" else 1) * self.stretch.rest_lengths[edge] * tangent)

    def refreshed(self, state: Floats) -> "ElasticRod":
        """The same rod with its source frames moved to `state`: no strain and no angle changes."""
        return replace(self, elements=tuple(element.refreshed(state) for element in self.elements))

    def reference_directors(self, state: Floats) -> Floats:
        """(edges + clamps, 3) first reference director of each edge, then of each ghost edge."""
        bends = self._bend_twist.refreshed(state)
        directors = np.empty((self.block_count, 3))
        for side in range(2):
            directors[bends.blocks[:, 1 + 2 * side]] = bends.source_directors[:, side]
        return np.vstack([directors[self.angles], directors[self.ghost_angles]])

    def material_frames(self, state: Floats) -> Floats:
        """(edges, 3, 3) rows m1, m2, t of each edge."""
        edge = state[self.stretch.blocks[:, 1]] - state[self.stretch.blocks[:, 0]]
        d1, t = self.reference_directors(state)[: self.edge_count], unit(edge)
        theta = state[self.angles, :1]
        m1 = np.cos(theta) * d1 + np.sin(theta) * cross(t, d1)
        return np.stack([m1, cross(t, m1), t], axis=1)

    def strains(self, state: Floats) -> RodStrains:
        """Of a rod without twist angles the curvatures are towards directors carried along it without twist."""
        bends = self._bend_twist.strains(state) if self.twists else self._untwisted_strains(state)
        bends = bends / self.bend_lengths[:, None]
        return RodStrains(self.stretch.strains(state), bends[:, :2], bends[:, 2])

    def energy(self, state: Floats) -> float:
        """[J]"""
        scrap = np.zeros_like(state)
        return sum(part.evaluate(state, scrap) for part in (*self.elements, self.stretch))

    def gradient(self, state: Floats) -> Floats:
        """(N, 3) of the energy [N, of angles N m]."""
        gradient = np.zeros_like(state)
        for part in (*self.elements, self.stretch):
            part.evaluate(state, gradient)
        return gradient

    def hessian(self, state: Floats, freedom: Freedom | None = None) -> csc_matrix:
        """Of the energy in the free directions of `freedom` (by default the rod's own), symmetric."""
        free = self.freedom() if freedom is None else freedom
        parts = (*self.elements, self.stretch)
        hessians = [np.empty((len(p.blocks), 3 * p.blocks.shape[1], 3 * p.blocks.shape[1])) for p in parts]
        for part, values in zip(parts, hessians, strict=True):
            part.evaluate(state, np.zeros_like(state), values)
        blocks = [part.blocks for part in parts]
        assembly = Assembly.of(blocks, free)
        data = assembly.assemble(hessians, blocks, free)
        upper = csc_matrix((data, assembly.indices, assembly.indptr), shape=(free.size, free.size))
        return csc_matrix(upper + upper.T - diags(upper.diagonal()))

    def weight(self, gravity: ArrayLike) -> Floats:
        """(N, 3) forces of gravity [N] for its acceleration (3,) [m/s2]."""
        load = np.zeros_like(self.mass)
        load[self.nodes] = self.mass[self.nodes] * np.asarray(gravity, dtype=float)
        return load

    def _untwisted_strains(self, state: Floats) -> Floats:
        """(b, 3) integrated curvatures and no twist, of an open rod without twist angles."""
        ghosts = dict(zip(self.clamps, self.ghosts, strict=True))
        inner = np.arange(self.node_count)
        chain = [ghosts[end] for end in self.clamps if end == "start"], inner, [ghosts[e] for e in ghosts if e == "end"]
        tangents = unit(np.diff(state[np.concatenate(chain).astype(np.intp)], axis=0))
        d1 = _directors(tangents, None)
        before, after = tangents[:-1], tangents[1:]
        both = 1.0 + dot(before, after)
        bends = [(dot(after, d[:-1]) - dot(before, d[1:])) / both for d in (d1, cross(tangents, d1))]
        table = np.column_stack([*bends, 0.0 * both])
        first = 1 if "start" in ghosts else 0
        at_clamps = [0 if end == "start" else len(table) - 1 for end in self.clamps]
        return np.vstack([table[first : first + self.node_count - 2], table[at_clamps]])

    @property
    def _bend_twist(self) -> BendTwist:
        bends = self.elements[-1]
        if not isinstance(bends, BendTwist):
            raise InputError("this rod carries no frames: build it with twist=True")
        return bends


def _checked(rest: ArrayLike) -> Floats:
    nodes = np.array(rest, dtype=float)
    if nodes.ndim != 2 or nodes.shape[1] != 3 or len(nodes) < 3 or not np.isfinite(nodes).all():
        raise InputError(f"a rod needs the finite positions of 3 nodes or more, (n, 3), not an array {nodes.shape}")
    return nodes


def _edges(nodes: Floats, closed: bool) -> tuple[Floats, Floats, Ints]:
    """Unit tangents (edges, 3), lengths (edges,) [m] and nodes (edges, 2)."""
    starts = np.arange(len(nodes) if closed else len(nodes) - 1)
    edges = np.column_stack([starts, (starts + 1) % len(nodes)])
    apart = nodes[edges[:, 1]] - nodes[edges[:, 0]]
    lengths = np.linalg.norm(apart, axis=1)
    if not lengths.all():
        raise InputError(f"edge {int(np.argmin(lengths))} of the rod has no length: its nodes must lie apart")
    return apart / lengths[:, None], lengths, edges


def _one_per_edge(rod: Rods, lengths: Floats) -> list[Rod]:
    if isinstance(rod, Rod):
        return [rod] * len(lengths)
    if callable(rod):
        return [rod(float(s)) for s in np.cumsum(lengths) - 0.5 * lengths]
    rods = list(rod)
    if len(rods) != len(lengths):
        raise InputError(f"a rod of {len(lengths)} edges takes as many rods, one for each edge, not {len(rods)}")
    return rods


def _directors(tangents: Floats, director: ArrayLike | None) -> Floats:
    """(edges, 3) first directors."""
    if director is None:
        director = (0.0, 0.0, 1.0) if abs(tangents[0, 2]) < 0.9 else (1.0, 0.0, 0.0)
    given = np.asarray(director, dtype=float)
    if given.shape == (3,):
        return directors_along(tangents, given)
    if given.shape != tangents.shape:
        raise InputError(f"directors are (3,), or one for each edge {tangents.shape}, not {given.shape}")
    return adapted(given, tangents)


def _clamps(clamped: Clamps, tangents: Floats, lengths: Floats, closed: bool) -> dict[End, Floats]:
    """Tangent at each clamp."""
    wanted: dict[End, ArrayLike | None]
    wanted = dict(clamped) if isinstance(clamped, Mapping) else dict.fromkeys(clamped)
    if wanted and closed:
        raise InputError("a closed ring has no ends to clamp")
    result: dict[End, Floats] = {}
    for end, tangent in wanted.items():
        if end not in ("start", "end"):
            raise InputError(f'a rod is clamped at its "start" or "end", not {end!r}')
        if tangent is None:
            (t0, t1), (l0, l1) = (x[:2] if end == "start" else x[-1:-3:-1] for x in (tangents, lengths))
            tangent = t0 + (t0 - t1) * l0 / (l0 + l1)
        result[end] = unit(np.asarray(tangent, dtype=float))
    return result


def _bends(n: int, edges: Ints, lengths: Floats, stiffness: Floats, closed: bool) -> tuple[Ints, Floats, Floats, Ints]:
    """Of the bends at inner nodes: blocks (b, 5), rest lengths (b,) [m], stiffnesses (b, 3) [N m], and their places.

    Half an edge lies on either side: the compliances of the two add up.
    """
    middles = np.arange(n) if closed else np.arange(1, n - 1)
    before, after = (middles - 1) % n, middles
    blocks = np.column_stack([edges[before, 0], n + before, middles, n + after, edges[after, 1]])
    compliance = 0.5 * lengths[:, None] / stiffness
    of_bends = 1.0 / (compliance[before] + compliance[after])
    return blocks, 0.5 * (lengths[before] + lengths[after]), of_bends, np.arange(len(middles))


def _end_director(directors: Floats, tangents: Floats, lengths: Floats, tangent: Floats, end: End) -> Floats:
    """(3,) director at a clamp: that of the last edge, carried there with the twist that the two last edges show."""
    order = slice(0, 2) if end == "start" else slice(-1, -3, -1)
    (d0, d1), (t0, t1), (l0, l1) = directors[order], tangents[order], lengths[order]
    twist = signed_angle(parallel_transport(d1, t1, t0), d0, t0)  # from the inner edge to the last
    turn = twist * l0 / (l0 + l1)
    carried = parallel_transport(d0, t0, tangent)
    return np.asarray(np.cos(turn) * carried + np.sin(turn) * cross(tangent, carried))


def _lumped(size: int, n: int, edges: Ints, lengths: Floats, rods: list[Rod], twist: bool) -> Floats:
    """(size, 3) mass [kg]: half of each edge's at either node; rotary inertia [kg m2] of its angle."""
    mass = np.zeros((size, 3))
    half = 0.5 * lengths * [rod.mass_per_length for rod in rods]
    for side in range(2):
        np.add.at(mass, edges[:, side], half[:, None])
    if twist:
        mass[n : n + len(edges), 0] = lengths * [rod.rotary_inertia for rod in rods]
    return mass
