"""Where rods meet: their nodes, edges and sections at each crossing, and the linkers in its corners.

The section of a rod at a node has a tangent T and a normal N. They are means over the one or two edges of the rod at
the node, N of their material directors m1. The section lies between the middles of the two edges, so that the nearer
edge has the larger weight: to second order T and N are the rod's own tangent and director there. Frames, sources and
spin are those of `rods.bend_twist`, which derives them; the kernels here serve every energy of sections. An edge's
unknowns are its vector e and its twist angle theta.

The paper's linkers are 3-node rods around a corner, from an edge of one rod to an edge of another [HQK 2.2, Eq 6].

A linker in the corner (x_e, joint, x_f) is a bend and a twist between the edge e, which runs to the joint, and the
edge f, which leaves it, at rest in the flat corner. It has no stretch energy, and no mass but its share of the blocks
that it is tied to. In two opposite corners both edges go as they do in their rods; in the other two one of them is
reversed: its tangent, its second director and its twist angle change sign.
"""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Bools, Floats, Ints, State
from rodshell.geometry.frames import adapted, parallel_transport, unit
from rodshell.kernels import njit
from rodshell.layout import GridMesh
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.elements import NO_HESSIANS
from rodshell.validation import brief

UP = (0.0, 0.0, 1.0)  # normal of the flat grid


@dataclass(frozen=True, eq=False)
class RodNodes:
    """A mesh as its rods see it: *rod node* k is entry k of `mesh.rod_nodes`, a node as one of its rods has it. Methods
    take the indices of some, and a side: 0 before them, 1 after.

    Args:
        mesh: the mesh, its rods sharing their nodes at joints or lying in layers.
        blocks: (k,) block of the state that holds each rod node: that of the mesh's node, or the rod's own where rods
            do not share nodes.
        first_angle: block of the first edge's twist angle; those of the other edges follow.
    """

    mesh: GridMesh
    blocks: Ints
    first_angle: int

    def __repr__(self) -> str:
        return f"RodNodes({len(self.blocks)} of {len(self.mesh.rod_start)} rods)"

    @property
    def rods(self) -> Ints:
        """(k,) rod of each rod node."""
        return self.mesh.rod_of

    @property
    def at_crossings(self) -> Ints:
        """(c, 2) rod nodes at each crossing of the grid, of its first and its second rod."""
        return self.mesh.at_crossings

    def has_edge(self, rod_nodes: Ints, side: int) -> Bools:
        """Whether the rod has an edge on this side of each rod node."""
        rods = self.rods[rod_nodes]
        limit = self.mesh.rod_start[rods] if side == 0 else self.mesh.rod_stop[rods] - 1
        return np.asarray(rod_nodes != limit)

    def edge(self, rod_nodes: Ints, side: int) -> Ints:
        """Edge on this side of each rod node, where there is one; edges are counted rod by rod."""
        return np.asarray(rod_nodes - self.rods[rod_nodes] - (1 - side))

    def angle(self, rod_nodes: Ints, side: int) -> Ints:
        """Block of that edge's twist angle."""
        return np.asarray(self.first_angle + self.edge(rod_nodes, side))

    def neighbour(self, rod_nodes: Ints, side: int) -> Ints:
        """Block of the node at that edge's other end."""
        return np.asarray(self.blocks[rod_nodes + (1 if side else -1)])

    def directions(self, rod_nodes: Ints) -> Floats:
        """(.., 2) unit direction of the rod of each rod node in the flat grid."""
        table = np.array([rod.direction for rod in self.mesh.grid.rods])
        return np.asarray(table[self.rods[rod_nodes]])

    def inverse_lengths(self, rod_nodes: Ints) -> Floats:
        """Sum of 1/length over the edges at each rod node [1/m]."""
        total = np.zeros(len(rod_nodes))
        for side in range(2):
            there = self.has_edge(rod_nodes, side)
            total[there] += 1.0 / self.mesh.edge_lengths[self.edge(rod_nodes[there], side)]
        return total

    def flat_state(self, size: int) -> Floats:
        """(size, 3) state of the flat grid [m], all angles 0."""
        state = np.zeros((size, 3))
        state[self.blocks] = self.mesh.flat[self.mesh.rod_nodes]
        return state


@dataclass(frozen=True, eq=False)
class OfSections:
    """What energies of sections have in common: joints, all with the same number of edges. Build them with
    `starting_at`.

    Args:
        blocks: (m, k) the nodes and twist angles that a joint touches, each once.
        legs: (l, 4) edges of each joint, see `Stencils`; they run as they do in their rod.
        weights: (m, l) share of each edge in its rod's section; those of a rod add up to 1.
        source_tangents, source_directors: (m, l, 3) t and d1 of each edge in its source frame.
    """

    blocks: Ints
    legs: Ints
    weights: Floats
    source_tangents: Floats
    source_directors: Floats

    @classmethod
    def starting_at(
        cls, blocks: Ints, legs: Ints, state: State, directors: ArrayLike, *, weights: Floats, **rest: Any
    ) -> Self:
        """Joints whose source frames are those of `state`.

        Args:
            blocks, legs, weights: see the class.
            directors: (N, 3), in the row of each twist angle the first director of its edge; or (3,), the same for all.
            rest: what else the energy has, by name.
        """
        tangents = _tangents(state, blocks, legs)
        wanted = np.broadcast_to(np.asarray(directors, dtype=float), state.shape)[blocks[:, legs[:, 2]]]
        return cls(np.ascontiguousarray(blocks), legs, weights, tangents, adapted(wanted, tangents), **rest)

    @property
    def angle_columns(self) -> Ints:
        return self.legs[:, 2]

    def refreshed(self, state: State) -> Self:
        """The same joints with their source frames at `state` (N, 3)."""
        tangents = _tangents(state, self.blocks, self.legs)
        directors = parallel_transport(self.source_directors, self.source_tangents, tangents)
        return replace(self, source_tangents=tangents, source_directors=adapted(directors, tangents))


def _tangents(state: State, blocks: Ints, legs: Ints) -> Floats:
    """(m, l, 3) unit tangents of the joints' edges."""
    return unit(state[blocks[:, legs[:, 1]]] - state[blocks[:, legs[:, 0]]])


class Stencils(NamedTuple):
    """Joints whose rods have edges on the same sides, so that they touch as many blocks in the same order.

    members : (m,) bool, which of the pairs they are.
    blocks : (n, k) nodes and twist angles of each.
    legs : (l, 4) for each edge the columns of `blocks` of its first node, its second node and its twist angle, and its
        rod, 0 or 1.
    middles : (2,) columns of the joint's node on either rod.
    weights : (n, l) share of each edge in its rod's section.
    """

    members: Bools
    blocks: Ints
    legs: Ints
    middles: Ints
    weights: Floats


def stencils(rod_nodes: RodNodes, pairs: Ints) -> Iterator[Stencils]:
    """The joints between the rod nodes `pairs` (m, 2), set by set of those that are alike.

    Args:
        pairs: (m, 2) rod nodes that meet, on the first and on the second rod.
    """
    sides = np.column_stack([rod_nodes.has_edge(pairs[:, rod], side) for rod in range(2) for side in range(2)])
    for pattern in np.unique(sides, axis=0):
        members = (sides == pattern).all(axis=1)
        yield Stencils(members, *_stencil(rod_nodes, pairs[members], pattern.reshape(2, 2)))


def _stencil(rod_nodes: RodNodes, pairs: Ints, has_edge: Bools) -> tuple[Ints, Ints, Ints, Floats]:
    columns, legs, middles, weights = list[Ints](), list[tuple[int, int, int, int]](), [0, 0], list[Floats]()
    lengths = rod_nodes.mesh.edge_lengths
    for rod in range(2):
        here = pairs[:, rod]
        if rod == 0 or not np.array_equal(rod_nodes.blocks[here], columns[0]):  # rods that do not share their node
            middles[rod] = len(columns)
            columns.append(rod_nodes.blocks[here])
        for side in np.flatnonzero(has_edge[rod]).tolist():
            middle, outer, angle = middles[rod], len(columns), len(columns) + 1
            columns += [rod_nodes.neighbour(here, side), rod_nodes.angle(here, side)]
            legs.append((middle, outer, angle, rod) if side else (outer, middle, angle, rod))
            weights.append(1.0 / (lengths[rod_nodes.edge(here, side)] * rod_nodes.inverse_lengths(here)))
    return np.column_stack(columns), np.array(legs), np.array(middles), np.column_stack(weights)


@njit(error_model="numpy")
def frame(x, blocks, leg, source, director, t, m1, m2, w, half):  # type: ignore[no-untyped-def]
    """Length of an edge; its tangent, material directors, spin w, and (source + t) / (1 + source.t).

    Args:
        x: (N, 3) node positions [m] and twist angles [rad].
        blocks: (k,) nodes and twist angles of the joint.
        leg: (4,) the edge, see `Stencils`.
        source, director: (3,) tangent and first director of the edge's source frame.
        t, m1, m2: (3,) filled with the unit tangent and the material directors.
        w: (3,) filled with the spin of the frame by the edge vector [1/m].
        half: (3,) filled with (source + t) / (1 + source.t).
    """
    square, both, along = 0.0, 1.0, 0.0
    for k in range(3):
        t[k] = x[blocks[leg[1]], k] - x[blocks[leg[0]], k]
        square += t[k] * t[k]
    length = np.sqrt(square)
    for k in range(3):
        t[k] /= length
        both += source[k] * t[k]
        along += director[k] * t[k]
    theta = x[blocks[leg[2]], 0]
    cos, sin = np.cos(theta), np.sin(theta)
    for k in range(3):
        half[k] = (source[k] + t[k]) / both
    for k in range(3):
        k1, k2 = (k + 1) % 3, (k + 2) % 3
        w[k] = (source[k1] * t[k2] - source[k2] * t[k1]) / (both * length)
        d1 = director[k] - along * half[k]
        d2 = t[k1] * (director[k2] - along * half[k2]) - t[k2] * (director[k1] - along * half[k1])
        m1[k] = cos * d1 + sin * d2
        m2[k] = cos * d2 - sin * d1
    return length


@njit(error_model="numpy")
def by_edge(weight, length, t, m1, m2, w, jacobian):  # type: ignore[no-untyped-def]
    """(6, 4) derivatives of the edge's share of T and N by (e, theta); dm1 = -(m1.dt) t + m2 (dtheta - w.de).

    Args:
        weight: share of the edge in its rod's section.
        length: of the edge [m].
        t, m1, m2, w: (3,) tangent, material directors and spin of the edge, see `frame`.
        jacobian: (6, 4), filled; its rows are the components of T and N.
    """
    for i in range(3):
        for j in range(3):
            delta = 1.0 if i == j else 0.0
            jacobian[i, j] = weight * (delta - t[i] * t[j]) / length
            jacobian[3 + i, j] = -weight * (t[i] * m1[j] / length + m2[i] * w[j])
        jacobian[i, 3] = 0.0
        jacobian[3 + i, 3] = weight * m2[i]


@njit(error_model="numpy")
def of_edge(weight, by_t, by_n, length, t, m1, m2, w, half, local):  # type: ignore[no-untyped-def]
    """Add the second derivatives of t and m1, contracted with the energy's derivatives by T and N, to `local` (4, 4).

    As in `bend_twist`: first for a frame that does not spin, then the spin dtheta -> dtheta - w.de, then the
    symmetric part of the derivative of w; what is antisymmetric cancels.

    Args:
        weight: share of the edge in its rod's section.
        by_t, by_n: (3,) derivatives of the energy by T and N [J].
        length: of the edge [m].
        t, m1, m2, w, half: (3,) see `frame`.
        local: (4, 4), to which is added, by the edge vector and the twist angle.
    """
    tt, nt, n1, n2 = 0.0, 0.0, 0.0, 0.0
    for k in range(3):
        tt += weight * by_t[k] * t[k]
        nt += weight * by_n[k] * t[k]
        n1 += weight * by_n[k] * m1[k]
        n2 += weight * by_n[k] * m2[k]
    square = length * length
    for i in range(3):
        ti, ni = weight * by_t[i] - tt * t[i], weight * by_n[i] - nt * t[i]
        for j in range(3):
            tj, nj = weight * by_t[j] - tt * t[j], weight * by_n[j] - nt * t[j]
            delta = 1.0 if i == j else 0.0
            value = -(t[i] * tj + ti * t[j]) - tt * (delta - t[i] * t[j])
            value += nt * (t[i] * m1[j] + m1[i] * t[j]) - 0.5 * (m1[i] * nj + ni * m1[j])
            value /= square
            value += nt / length * (w[i] * m2[j] + m2[i] * w[j]) - n1 * w[i] * w[j]
            value += 0.5 * n2 / length * (w[i] * (t[j] + half[j]) + (t[i] + half[i]) * w[j])
            local[i, j] += value
        mixed = -nt * m2[i] / length + n1 * w[i]
        local[i, 3] += mixed
        local[3, i] += mixed
    local[3, 3] -= n1


@njit(error_model="numpy")
def spread(local, leg, other, hessian):  # type: ignore[no-untyped-def]
    """Add `local` (4, 4), by (e, theta) of two edges, to the rows and columns of their nodes and angles.

    Args:
        local: (4, 4) second derivatives by the edge vector and twist angle of one edge (rows) and of another (columns).
        leg, other: (4,) the edges of the rows and of the columns, see `Stencils`.
        hessian: (3k, 3k) of the joint, to which is added.
    """
    for i in range(3):
        for j in range(3):
            value = local[i, j]
            hessian[3 * leg[0] + i, 3 * other[0] + j] += value
            hessian[3 * leg[0] + i, 3 * other[1] + j] -= value
            hessian[3 * leg[1] + i, 3 * other[0] + j] -= value
            hessian[3 * leg[1] + i, 3 * other[1] + j] += value
        hessian[3 * leg[0] + i, 3 * other[2]] -= local[i, 3]
        hessian[3 * leg[1] + i, 3 * other[2]] += local[i, 3]
        hessian[3 * leg[2], 3 * other[0] + i] -= local[3, i]
        hessian[3 * leg[2], 3 * other[1] + i] += local[3, i]
    hessian[3 * leg[2], 3 * other[2]] += local[3, 3]


@dataclass(frozen=True, eq=False)
class Corners:
    """The corners of crossings in which linkers lie.

    Args:
        blocks: (n, 5) outer node and twist angle of e, joint (on the rod of e), twist angle and outer node of f.
        joints: (n, 2) block of the joint on the rod of e and on that of f: the same where they share it.
        signs: (n, 2) -1 for a reversed edge.
        lengths: (n,) Voronoi length of the corner: half of both edges [m].
        rods: (n, 2) rod of e and of f.
    """

    blocks: Ints
    joints: Ints
    signs: Floats
    lengths: Floats
    rods: Ints

    __repr__ = brief

    @staticmethod
    def of(rod_nodes: RodNodes, crossings: Ints, wanted: int) -> "Corners":
        """Corners of some crossings (m,) of the grid.

        Args:
            wanted: 2 for two opposite corners, as in the paper, or 4 for all; where a rod ends, all that there are.
        """
        pairs = rod_nodes.at_crossings[crossings]
        rows = []
        full = np.ones(len(pairs), dtype=bool)
        for rod_of in range(2):
            full &= rod_nodes.has_edge(pairs[:, rod_of], 0) & rod_nodes.has_edge(pairs[:, rod_of], 1)
        # the rod and side of e and of f; the paper's two come first
        for number, (e, f) in enumerate((((0, 0), (1, 1)), ((1, 0), (0, 1)), ((0, 0), (1, 0)), ((0, 1), (1, 1)))):
            (rod_e, side_e), (rod_f, side_f) = e, f
            there = rod_nodes.has_edge(pairs[:, rod_e], side_e) & rod_nodes.has_edge(pairs[:, rod_f], side_f)
            if wanted == 2 and number >= 2:
                there &= ~full
            a, b = pairs[there, rod_e], pairs[there, rod_f]
            lengths = rod_nodes.mesh.edge_lengths
            far_e, angle_e = rod_nodes.neighbour(a, side_e), rod_nodes.angle(a, side_e)
            far_f, angle_f = rod_nodes.neighbour(b, side_f), rod_nodes.angle(b, side_f)
            rows.append(
                (
                    np.column_stack([far_e, angle_e, rod_nodes.blocks[a], angle_f, far_f]),
                    np.column_stack([rod_nodes.blocks[a], rod_nodes.blocks[b]]),
                    np.tile([-1.0 if side_e else 1.0, 1.0 if side_f else -1.0], (len(a), 1)),
                    0.5 * (lengths[rod_nodes.edge(a, side_e)] + lengths[rod_nodes.edge(b, side_f)]),
                    np.column_stack([rod_nodes.rods[a], rod_nodes.rods[b]]),
                )
            )
        return Corners(*(np.concatenate(parts) for parts in zip(*rows, strict=True)))


@dataclass(frozen=True, eq=False)
class LinkerBend:
    """Bends and twists of linkers. Build them with `of`.

    Args:
        blocks: (n, 5) as in `BendTwist`.
        signs: (n, 2) -1 where the twist angle belongs to the reversed edge.
        bends: the same elements on separate rows, five each, with the signs of the linkers' angles.
    """

    blocks: Ints
    signs: Floats
    bends: BendTwist

    angle_columns = 1, 3
    __repr__ = brief

    @staticmethod
    def of(corners: Corners, blocks: Ints, flat: Floats, stiffness: Floats) -> "LinkerBend":
        """Linkers at rest in the flat grid.

        Args:
            blocks: (n, 5) their blocks: those of the corners, or copies of them.
            flat: (N, 3) state of the flat grid [m].
            stiffness: (n, 3) EI1, EI2 and GJ [N m2].
        """
        rows = np.arange(5 * len(blocks)).reshape(-1, 5)
        per_length = stiffness / corners.lengths[:, None]
        local = _signed(flat, blocks, corners.signs)
        bends = BendTwist.starting_at(
            rows, local, UP, bend_stiffness=per_length[:, :2], twist_stiffness=per_length[:, 2]
        ).relaxed(local)  # fmt: skip
        return LinkerBend(np.ascontiguousarray(blocks), corners.signs, bends)

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        local = _signed(state, self.blocks, self.signs)
        by_local = np.zeros_like(local)
        energy = self.bends.evaluate(local, by_local, hessians)
        by_local[1::5] *= self.signs[:, :1]
        by_local[3::5] *= self.signs[:, 1:]
        np.add.at(gradient, self.blocks.ravel(), by_local)
        if len(hessians):
            for column, sign in ((3, self.signs[:, :1]), (9, self.signs[:, 1:])):
                hessians[:, column, :] *= sign
                hessians[:, :, column] *= sign
        return energy

    def refreshed(self, state: State) -> Self:
        """The same linkers with their source frames at `state` (N, 3)."""
        return replace(self, bends=self.bends.refreshed(_signed(state, self.blocks, self.signs)))

    def moments(self, state: State) -> Floats:
        """(n, 3) moments of the two bends and of the twist of each linker at `state` (N, 3) [N m]."""
        bends = self.bends
        strains = bends.strains(_signed(state, self.blocks, self.signs))
        natural = np.column_stack([bends.natural_curvature, bends.natural_twist])
        return np.asarray(np.column_stack([bends.bend_stiffness, bends.twist_stiffness]) * (strains - natural))


def _signed(state: State, blocks: Ints, signs: Floats) -> Floats:
    """(5n, 3) the blocks of each linker, with the signs of its angles."""
    local = state[blocks]
    local[:, 1] *= signs[:, :1]
    local[:, 3] *= signs[:, 1:]
    return local.reshape(-1, 3)
