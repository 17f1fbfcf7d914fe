"""One elastic rod on its own [HQK 2.1]: nodes, twist angles, and the sum of its energies.

The state's blocks are the n nodes, then the twist angle of each edge, then what the clamps hold: a ghost node
for each clamped end and, where the rod carries twist angles, the twist angle of each ghost edge.

A clamped rod goes on past its end to a ghost node, one edge out along the clamp's tangent. Between the ghost
edge and the last edge lies half an edge of rod, so that direction and material frame are held exactly at the
end: second order, where holding the last edge itself would act half an edge inside (first order).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_matrix, diags

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.vectors import cross, unit
from rodshell.model.assembly import Assembly
from rodshell.model.freedom import Freedom
from rodshell.model.rod_line import Clamps, End, RodLine, Rods
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.elements import Elements
from rodshell.rods.isotropic import IsotropicBend, IsotropicBendTwist
from rodshell.rods.stretch import Stretch
from rodshell.validation import direction, finite, vector

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
    elements : bending and twist: `BendTwist`; where the rod is isotropic and naturally straight
        `IsotropicBendTwist`, or `IsotropicBend` where it carries no twist angles.
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
        line = RodLine.of(rest, closed=closed, clamped=clamped)
        rods = line.rods(rod)
        bends = _Bends.of(line, np.array([(*one.bend_stiffnesses, one.twist_stiffness) for one in rods]), twist)
        straight = isinstance(natural, str) and natural == "straight"
        count = int(bends.like.max()) + 1
        rate = finite("natural_twist", natural_twist, count)[bends.like]
        free_spin = straight and bool((bends.stiffness[:, 0] == bends.stiffness[:, 1]).all())
        elements: Elements
        if twist:
            state, frames = bends.rest_state(line, line.directors(director))
            found = (IsotropicBendTwist if free_spin else BendTwist).starting_at(
                bends.blocks,
                state,
                frames,
                bend_stiffness=bends.stiffness[:, :2],
                twist_stiffness=bends.stiffness[:, 2],
            )
            if isinstance(natural, str) and natural == "rest":
                found = found.relaxed(state)
            elif not straight:
                if isinstance(natural, str):
                    raise InputError(f'natural is "straight", "rest" or curvatures [1/m], not {natural!r}')
                curvature = finite("natural curvatures", natural, count, 2)[bends.like]
                found = replace(found, natural_curvature=curvature * bends.lengths[:, None])
            elements = replace(found, natural_twist=found.natural_twist + rate * bends.lengths)
        elif closed or not free_spin or rate.any():
            raise InputError("only an open, isotropic, naturally straight and untwisted rod goes without twist angles")
        else:
            elements = IsotropicBend(np.ascontiguousarray(bends.blocks[:, ::2]), bends.stiffness[:, 0].copy())
        stretch = Stretch.elastic(line.edges, line.lengths, np.array([one.stretch_stiffness for one in rods]))
        mass = line.mass(bends.size, rods, bends.angles)
        held = np.array(list(line.clamps.values())).reshape(-1, 3)
        return ElasticRod(
            line.nodes, closed, (elements,), stretch, mass, bends.lengths, tuple(line.clamps), held, free_spin
        )

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
    def length(self) -> float:
        """At rest [m]."""
        return float(self.stretch.rest_lengths.sum())

    @property
    def bend_energy(self) -> float:
        """EI/L [J], of the softer direction, the mean along the rod: what a bend by about a radian stores."""
        bends = self.elements[0]
        stiffness = bends.stiffness if isinstance(bends, IsotropicBend) else self._bend_twist.bend_stiffness.min(axis=1)
        return float((stiffness * self.bend_lengths).mean() / self.length)

    @property
    def twists(self) -> bool:
        """Whether the rod carries twist angles."""
        return isinstance(self.elements[0], BendTwist)

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
        nodes = self.rest if positions is None else positions
        state[self.nodes] = finite("the positions of this rod's nodes", nodes, self.node_count, 3)
        if angles is not None:
            if not self.twists:
                raise InputError("this rod carries no twist angles: build it with twist=True")
            state[self.angles, 0] = finite("the twist angles of this rod", angles, self.edge_count)
        for k, end in enumerate(self.clamps):
            tangent = direction(f'the tangent at the "{end}"', (tangents or {}).get(end, self.clamp_tangents[k]))
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
        """A rod without twist angles has no directors: its curvatures are their size, and 0."""
        bends = self.elements[0]
        if isinstance(bends, IsotropicBend):
            curvature = bends.curvatures(state)
            strains = np.column_stack([curvature, 0 * curvature, 0 * curvature])
        else:
            strains = self._bend_twist.strains(state)
        strains = strains / self.bend_lengths[:, None]
        return RodStrains(self.stretch.strains(state), strains[:, :2], strains[:, 2])

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
        load[self.nodes] = self.mass[self.nodes] * vector("gravity", gravity)
        return load

    @property
    def _bend_twist(self) -> BendTwist:
        bends = self.elements[0]
        if not isinstance(bends, BendTwist):
            raise InputError("this rod carries no frames: build it with twist=True")
        return bends


@dataclass(frozen=True)
class _Bends:
    """Where a rod bends: at its inner nodes in turn, then at its clamps.

    size : blocks of the rod; angles : those of the edges' twist angles.
    blocks : (b, 5) as of `BendTwist`; without twist angles the numbers of angles mean nothing.
    lengths : (b,) rest length of rod that each stands for [m]; stiffness : (b, 3) EI1, EI2, GJ over that [N m].
    like : (b,) the inner node whose natural strains it shares, counted from the first.
    """

    size: int
    angles: slice
    blocks: Ints
    lengths: Floats
    stiffness: Floats
    like: Ints

    @staticmethod
    def of(line: RodLine, stiffness: Floats, twist: bool) -> "_Bends":
        """stiffness : (edges, 3) EI1, EI2, GJ [N m2]; of the half edges at either side of a node compliances add up."""
        n, (middles, edges) = len(line.nodes), line.bends()
        angles = slice(n, n + (len(line.edges) if twist else 0))
        blocks = np.column_stack(
            [line.edges[edges[:, 0], 0], n + edges[:, 0], middles, n + edges[:, 1], line.edges[edges[:, 1], 1]]
        )
        compliance = 0.5 * line.lengths[:, None] / stiffness
        of_bends = 1.0 / (compliance[edges[:, 0]] + compliance[edges[:, 1]])
        lengths, like = 0.5 * line.lengths[edges].sum(axis=1), np.arange(len(middles))
        for k, end in enumerate(line.clamps):
            ghost, (edge, last, inner) = angles.stop + k, (0, 0, 1) if end == "start" else (n - 2, n - 1, n - 2)
            row = [ghost, ghost + len(line.clamps), last, n + edge, inner]
            blocks = np.vstack([blocks, row if end == "start" else row[::-1]])
            lengths = np.append(lengths, 0.5 * line.lengths[edge])
            of_bends = np.vstack([of_bends, stiffness[edge] / lengths[-1]])
            like = np.append(like, 0 if end == "start" else n - 3)
        size = angles.stop + len(line.clamps) * (2 if twist else 1)
        return _Bends(size, angles, blocks, lengths, of_bends, like)

    def rest_state(self, line: RodLine, directors: Floats) -> tuple[Floats, Floats]:
        """(size, 3) state at rest, and in the rows of the twist angles the directors of their edges."""
        state, frames = np.zeros((self.size, 3)), np.zeros((self.size, 3))
        state[: len(line.nodes)], frames[self.angles] = line.nodes, directors
        for k, end in enumerate(line.clamps):
            ghost = self.angles.stop + k
            state[ghost] = line.ghost(end)
            frames[ghost + len(line.clamps)] = line.end_director(directors, end)
        return state, frames
