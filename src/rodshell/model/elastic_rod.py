"""One elastic rod on its own [HQK 2.1]: nodes, twist angles, and the sum of its energies.

The state's blocks are the n nodes, then the twist angle of each edge, then those of the clamps: a ghost node for each
clamped end and, if the rod has twist angles, the twist angle of each ghost edge.

A clamped rod continues past its end to a ghost node, one edge out along the clamp's tangent. Between the ghost edge
and the last edge lies half an edge of rod, so that direction and material frame are held exactly at the end (second
order); holding the last edge itself would act half an edge inside (first order).
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import csc_matrix

from rodshell.arrays import Floats, Ints, State
from rodshell.errors import InputError
from rodshell.geometry.frames import cross, unit
from rodshell.model.assembly import ANGLE, Freedom
from rodshell.model.potential import Potential
from rodshell.model.rod_line import Clamps, End, RodBends, RodLine, Rods, ghost_position
from rodshell.rods.bend_twist import BendTwist, frames_among
from rodshell.rods.elements import BendElements, Elements, Stretch
from rodshell.rods.isotropic import IsotropicBend, IsotropicBendTwist
from rodshell.validation import brief, described, direction, finite, flag, short, vector

Natural = Literal["straight", "rest"] | ArrayLike


@dataclass(frozen=True, eq=False)
class RodStrains:
    """Strains of a rod; its b bends are those of the inner nodes in turn, then those of the clamped ends.

    Args:
        axial: (edges,) [-].
        curvature: (b, 2) towards m1 and m2, per unit length [1/m].
        twist: (b,) per unit length [rad/m].
    """

    axial: Floats
    curvature: Floats
    twist: Floats

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class ElasticRod:
    """One rod, open or a closed ring. Build it with `of`.

    The reference frames are data of the elements: the twist angles of a state are counted from them. Each edge's
    frame is transported from its source, at first the rest shape, to a state by the smallest rotation; `refreshed`
    moves the source and is called after each accepted step.

    Args:
        rest: (n, 3) rest positions of the nodes [m].
        closed: a ring; its last edge leads back to the first node.
        elements: bending and twist: `BendTwist`; where the rod is isotropic and naturally straight
            `IsotropicBendTwist`, or `IsotropicBend` if it has no twist angles.
        mass: (N, 3) lumped mass of each block's components: of a node [kg]; of a twist angle the rotary inertia
            [kg m2] in component 0, else 0. Ghosts have none.
        bend_lengths: (b,) rest length of rod at each bend (Voronoi length; half an edge at a clamp) [m].
        clamp_tangents: (c, 3) unit tangents along the rod there at rest.
        free_spin: the energy does not change when the rod spins about itself together with its ends.
    """

    rest: Floats
    closed: bool
    elements: tuple[BendElements, ...]
    stretch: Stretch
    mass: Floats
    bend_lengths: Floats
    clamps: tuple[End, ...]
    clamp_tangents: Floats
    free_spin: bool

    def __repr__(self) -> str:
        form = "a ring" if self.closed else f"clamped at {' and '.join(self.clamps)}" if self.clamps else "free ends"
        return f"ElasticRod({self.node_count} nodes, {self.length:.4g} m, {form})"

    @staticmethod
    def of(
        rest: ArrayLike,
        rod: Rods,
        *,
        closed: bool = False,
        natural: Natural = "straight",
        natural_twist: ArrayLike = 0.0,
        twist: bool = True,
        director: ArrayLike | None = None,
        clamped: Clamps = (),
    ) -> "ElasticRod":
        """A rod through given nodes, whose edges have their rest lengths there.

        Args:
            rest: (n, 3) nodes [m].
            rod: the same for all edges, one for each, or a function of the arc length [m] of the edge's middle. Between
                two edges the compliances of their halves add up.
            closed: a ring: a last edge leads back to the first node.
            natural: "straight"; "rest", free of stress at rest, frames included; or (b, 2) curvatures towards m1
                and m2 per unit length [1/m] at the inner nodes (of a ring: at all nodes), or (2,) for all.
            natural_twist: per unit length [rad/m], (b,) or one for all; added to that of the rest shape if natural.
            twist: give the rod twist angles. An open, isotropic, naturally straight and untwisted rod does not need
                them as long as nothing holds or loads its frames (it may spin in its clamps): it bends in the same way,
                at less cost.
            director: first material director m1, (3,) of the first edge, transported along without twist, or (edges,
                3); its part across the edge is used. By default z, or x where the rod starts within 25 degrees of z.
            clamped: ends that are clamped, ("start", "end"), or the tangent along the rod at each as it is at rest,
                {"start": (1, 0, 0)}; by default that of the two edges next to the end, to second order.

        Raises:
            InputError: an argument is of the wrong kind or shape, or they exclude each other.
        """
        closed, twist = flag("closed", closed), flag("twist", twist)
        line = RodLine.of(rest, closed=closed, clamped=clamped)
        rods = line.rods(rod)
        stiffness = np.array([(*section.bend_stiffnesses, section.twist_stiffness) for section in rods])
        bends = RodBends.of(line, stiffness, twist)
        rate = finite("natural_twist", natural_twist, int(bends.like.max()) + 1)[bends.like]
        straight = isinstance(natural, str) and natural == "straight"
        free_spin = straight and bool((bends.stiffness[:, 0] == bends.stiffness[:, 1]).all())
        elements: BendElements
        if twist:
            elements = _bend_twist(line, bends, line.directors(director), natural, rate, isotropic=free_spin)
        elif closed or not free_spin or rate.any():
            raise InputError("only an open, isotropic, naturally straight and untwisted rod goes without twist angles")
        else:
            elements = IsotropicBend(np.ascontiguousarray(bends.blocks[:, ::2]), bends.stiffness[:, 0].copy())
        axial = np.array([section.stretch_stiffness for section in rods])
        stretch = Stretch.elastic(line.edges, line.lengths, axial)
        mass = line.mass(bends.size, rods, bends.angles)
        tangents = np.array(list(line.clamps.values())).reshape(-1, 3)
        return ElasticRod(
            line.nodes, closed, (elements,), stretch, mass, bends.lengths, tuple(line.clamps), tangents, free_spin
        )

    @property
    def explicit(self) -> tuple[Elements, ...]:
        """Empty: every energy of a single rod is implicit."""
        return ()

    # Blocks

    @property
    def node_count(self) -> int:
        """Number of nodes, without ghosts."""
        return len(self.rest)

    @property
    def edge_count(self) -> int:
        """Number of edges, without ghost edges."""
        return len(self.stretch.blocks)

    @property
    def block_count(self) -> int:
        """Number of blocks of a state."""
        return len(self.mass)

    @property
    def length(self) -> float:
        """Length at rest [m]."""
        return float(self.stretch.rest_lengths.sum())

    @property
    def bend_energy(self) -> float:
        """EI/L [J] of the softer direction, the mean along the rod: about the energy of a bend by a radian."""
        stiffness = self.elements[0].bend_stiffness.min(axis=1)
        return float((stiffness * self.bend_lengths).mean() / self.length)

    @property
    def twists(self) -> bool:
        """Whether the rod has twist angles."""
        return bool(self.elements[0].angle_columns)

    @property
    def nodes(self) -> slice:
        """Blocks of the nodes."""
        return slice(0, self.node_count)

    @property
    def angles(self) -> slice:
        """Blocks of the twist angles of the edges; empty if the rod has none."""
        return slice(self.node_count, self.node_count + (self.edge_count if self.twists else 0))

    @property
    def ghosts(self) -> Ints:
        """(c,) block of the ghost node of each clamp."""
        return np.asarray(self.angles.stop + np.arange(len(self.clamps)))

    @property
    def ghost_angles(self) -> Ints:
        """(c,) block of the twist angle of each clamp; empty if the rod has none."""
        return np.asarray(self.angles.stop + len(self.clamps) + np.arange(len(self.clamps) if self.twists else 0))

    @property
    def clamped_nodes(self) -> Ints:
        """(c,) node of each clamp."""
        return np.array([0 if end == "start" else self.node_count - 1 for end in self.clamps], dtype=np.intp)

    def freedom(self) -> Freedom:
        """Nodes free in space, angles in their component; clamps fixed: the end, its ghost and their angle."""
        free = Freedom.free(self.block_count).with_directions(np.arange(self.block_count)[self.angles], ANGLE)
        return free.with_directions(np.concatenate([self.clamped_nodes, self.ghosts, self.ghost_angles]))

    # States

    def state(
        self,
        positions: ArrayLike | None = None,
        angles: ArrayLike | None = None,
        tangents: Mapping[End, ArrayLike] | None = None,
    ) -> Floats:
        """(N, 3) state of the rod.

        Args:
            positions: (n, 3) of the nodes [m]; by default those at rest.
            angles: (edges,) twist angles [rad]; by default 0.
            tangents: of the clamps, along the rod; by default those at rest. Their twist angles are 0.

        Raises:
            InputError: an array has another shape; the rod has no twist angles; a tangent is for an end not clamped.
        """
        for end in tangents or {}:
            if end not in self.clamps:
                raise InputError(f'this rod is not clamped at its "{end}", where a tangent is given: leave it out')
        if positions is not None and np.ndim(positions) != 2:
            raise InputError(f"the positions of this rod's nodes must be (n, 3) in m, not {described(positions)}")
        state = np.zeros((self.block_count, 3))
        nodes = self.rest if positions is None else positions
        state[self.nodes] = finite("the positions of this rod's nodes", nodes, self.node_count, 3)
        if angles is not None:
            if not self.twists:
                raise InputError("this rod has no twist angles: build it with twist=True")
            state[self.angles, 0] = finite("the twist angles of this rod", angles, self.edge_count)
        for k, end in enumerate(self.clamps):
            tangent = direction(f'the tangent at the "{end}"', (tangents or {}).get(end, self.clamp_tangents[k]))
            at = state[self.clamped_nodes[k]]
            state[self.ghosts[k]] = ghost_position(end, at, self.stretch.rest_lengths, tangent)
        return state

    def refreshed(self, state: Floats) -> "ElasticRod":
        """The same rod with its source frames moved to `state`: no strain and no angle changes."""
        return replace(self, elements=tuple(element.refreshed(state) for element in self.elements))

    def reference_directors(self, state: State) -> Floats:
        """(edges + clamps, 3) first reference director of each edge, then of each ghost edge, at `state` (N, 3)."""
        bends = self._bend_twist.refreshed(state)
        directors = np.empty((self.block_count, 3))
        for side in range(2):
            directors[bends.blocks[:, 1 + 2 * side]] = bends.source_directors[:, side]
        return np.vstack([directors[self.angles], directors[self.ghost_angles]])

    def material_frames(self, state: State) -> Floats:
        """(edges, 3, 3) rows m1, m2, t of each edge at `state` (N, 3)."""
        edge = state[self.stretch.blocks[:, 1]] - state[self.stretch.blocks[:, 0]]
        d1, t = self.reference_directors(state)[: self.edge_count], unit(edge)
        theta = state[self.angles, :1]
        m1 = np.cos(theta) * d1 + np.sin(theta) * cross(t, d1)
        return np.stack([m1, cross(t, m1), t], axis=1)

    def strains(self, state: State) -> RodStrains:
        """Strains at `state` (N, 3); without twist angles there are no directors: curvatures are (size, 0)."""
        strains = self.elements[0].strains(state) / self.bend_lengths[:, None]
        return RodStrains(self.stretch.strains(state), strains[:, :2], strains[:, 2])

    def energy(self, state: Floats) -> float:
        """Energy at `state` (N, 3) [J]."""
        return self._potential.energy(state)

    def gradient(self, state: Floats) -> Floats:
        """(N, 3) gradient of the energy at `state` (N, 3) [N, for angles N m]."""
        return self._potential.gradient(state)

    def hessian(self, state: State, freedom: Freedom | None = None) -> csc_matrix:
        """Symmetric Hessian of the energy at `state` (N, 3) in the directions of `freedom`, by default the rod's."""
        return self._potential.matrix(state, self.freedom() if freedom is None else freedom)

    def weight(self, gravity: ArrayLike) -> Floats:
        """(N, 3) forces of gravity [N] for its acceleration `gravity` (3,) [m/s2]."""
        load = np.zeros_like(self.mass)
        load[self.nodes] = self.mass[self.nodes] * vector("gravity", gravity)
        return load

    @property
    def _potential(self) -> Potential:
        return Potential((*self.elements, self.stretch))

    @property
    def _bend_twist(self) -> BendTwist:
        if (bends := frames_among(self.elements)) is None:
            raise InputError("this rod has no frames: build it with twist=True")
        return bends


def _bend_twist(
    line: RodLine, bends: RodBends, directors: Floats, natural: Natural, twist_rate: Floats, *, isotropic: bool
) -> BendTwist:
    """Bending and twist with the natural strains that are asked for.

    Args:
        directors: (edges, 3) first material directors at rest.
        twist_rate: (b,) natural twist per length [rad/m].
    """
    state, frames = bends.rest_state(line, directors)
    elements = (IsotropicBendTwist if isotropic else BendTwist).starting_at(
        bends.blocks,
        state,
        frames,
        bend_stiffness=bends.stiffness[:, :2],
        twist_stiffness=bends.stiffness[:, 2],
    )
    if not isinstance(natural, str):
        curvature = finite("natural curvatures", natural, int(bends.like.max()) + 1, 2)[bends.like]
        elements = replace(elements, natural_curvature=curvature * bends.lengths[:, None])
    elif natural == "rest":
        elements = elements.relaxed(state)
    elif natural != "straight":
        raise InputError(f'natural is "straight", "rest" or curvatures [1/m], not {short(natural)}')
    return replace(elements, natural_twist=elements.natural_twist + twist_rate * bends.lengths)
