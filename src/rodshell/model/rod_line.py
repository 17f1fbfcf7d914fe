"""A rod at rest: its nodes and edges, its clamped ends, and where it bends, with the length of rod at each bend."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import adapted, cross, directors_along, dot, parallel_transport, signed_angle
from rodshell.rods.section import Rod
from rodshell.validation import brief, described, direction, finite, instance, short

End = Literal["start", "end"]
Rods = Rod | Sequence[Rod] | Callable[[float], Rod]
Clamps = Sequence[End] | Mapping[End, ArrayLike]


_FOLDED = -1 + 1e-9  # cosine of a turn that has no curvature


@dataclass(frozen=True, eq=False)
class RodLine:
    """Nodes in a row and what follows from them. Build it with `of`.

    Args:
        nodes: (n, 3) [m].
        closed: a ring: the last edge leads back to the first node.
        edges: (e, 2) nodes of each edge.
        tangents: (e, 3) unit tangents of the edges.
        lengths: (e,) of the edges [m].
        clamps: (3,) unit tangent along the rod at each clamped end.
    """

    nodes: Floats
    closed: bool
    edges: Ints
    tangents: Floats
    lengths: Floats
    clamps: dict[End, Floats]

    __repr__ = brief

    @staticmethod
    def of(rest: ArrayLike, *, closed: bool, clamped: Clamps) -> "RodLine":
        """The line through the nodes (n, 3) of an unloaded rod [m], or a ring, clamped at some ends.

        Args:
            clamped: "start" and "end" as far as they are clamped, or these with a tangent (3,) along the rod; without,
                the tangent is extrapolated from the last two edges.

        Raises:
            InputError: there are fewer than 3 nodes, an edge has no length, the rod folds back on itself, or a clamp is
                not an end or points against the rod.
        """
        count = _points(rest)
        nodes = finite("the positions of a rod's nodes", rest, count, 3).copy()
        starts = np.arange(count if closed else count - 1)
        edges = np.column_stack([starts, (starts + 1) % count])
        apart = nodes[edges[:, 1]] - nodes[edges[:, 0]]
        lengths = np.linalg.norm(apart, axis=1)
        if not lengths.all():
            raise InputError(f"edge {int(np.argmin(lengths))} of the rod has no length: its nodes must lie apart")
        tangents = apart / lengths[:, None]
        turns = dot(tangents, np.roll(tangents, -1, axis=0))[: None if closed else -1]
        if turns.min() < _FOLDED:
            raise InputError(
                f"the rod folds back on itself after edge {int(np.argmin(turns))}: it has no curvature there"
            )
        return RodLine(nodes, closed, edges, tangents, lengths, _clamps(clamped, tangents, lengths, closed))

    def rods(self, rod: Rods) -> list[Rod]:
        """The rod of each edge: the same for all, one for each, or a function of the arc length of its middle [m].

        Raises:
            InputError: they are not rods, or not as many as there are edges.
        """
        count = len(self.lengths)
        if isinstance(rod, Rod):
            return [rod] * count
        if callable(rod):
            result = [rod(float(s)) for s in np.cumsum(self.lengths) - 0.5 * self.lengths]
        else:
            result = list(rod) if isinstance(rod, Sequence) and not isinstance(rod, str) else [rod]
            if len(result) != count and all(isinstance(item, Rod) for item in result):
                raise InputError(f"a rod of {count} edges takes as many rods, one for each edge, not {len(result)}")
        for item in result:
            instance("rod", item, Rod)
        return result

    def directors(self, director: ArrayLike | None) -> Floats:
        """(e, 3) first material directors of the edges.

        Args:
            director: (3,) of the first edge, transported along the rod without twist; (e, 3) of each edge; None: z, or
                x where the rod starts within 25 degrees of z.
        """
        if director is None:
            director = (0.0, 0.0, 1.0) if abs(self.tangents[0, 2]) < 0.9 else (1.0, 0.0, 0.0)
        if np.ndim(director) == 2:
            return adapted(finite("the directors, one for each edge,", director, len(self.tangents), 3), self.tangents)
        return directors_along(self.tangents, direction("the director", director))

    def inner_bends(self) -> tuple[Ints, Ints]:
        """(m,) nodes at which the rod bends, and (m, 2) edges before and after; without the clamps."""
        nodes = np.arange(len(self.nodes)) if self.closed else np.arange(1, len(self.nodes) - 1)
        return nodes, np.column_stack([(nodes - 1) % len(self.nodes), nodes])

    def end_director(self, directors: Floats, end: End) -> Floats:
        """(3,) director at a clamp: that of the last edge, transported there with the twist of the two last edges, by
        the directors (e, 3) of the edges."""
        order = slice(0, 2) if end == "start" else slice(-1, -3, -1)
        (d0, d1), (t0, t1), (l0, l1) = directors[order], self.tangents[order], self.lengths[order]
        twist = signed_angle(parallel_transport(d1, t1, t0), d0, t0)  # from the inner edge to the last
        turn, tangent = twist * l0 / (l0 + l1), self.clamps[end]
        moved = parallel_transport(d0, t0, tangent)
        return np.asarray(np.cos(turn) * moved + np.sin(turn) * cross(tangent, moved))

    def mass(self, size: int, rods: list[Rod], angles: slice) -> Floats:
        """(size, 3) lumped mass of each block: half of each edge's at either node [kg]; rotary inertia [kg m2] in those
        of the twist angles, if there are any."""
        mass = np.zeros((size, 3))
        half = 0.5 * self.lengths * [rod.mass_per_length for rod in rods]
        for side in range(2):
            np.add.at(mass, self.edges[:, side], half[:, None])
        if angles.stop > angles.start:
            mass[angles, 0] = self.lengths * [rod.rotary_inertia for rod in rods]
        return mass


@dataclass(frozen=True, eq=False)
class RodBends:
    """The bends of a rod: at its inner nodes in turn, then at its clamps. Build them with `of`.

    Args:
        size: number of blocks of the rod.
        angles: blocks of the edges' twist angles.
        blocks: (b, 5) as of `BendTwist`; without twist angles the numbers of angles mean nothing.
        lengths: (b,) rest length of rod at each bend (Voronoi length; half an edge at a clamp) [m].
        stiffness: (b, 3) EI1, EI2 and GJ over that length [N m].
        like: (b,) the inner node whose natural strains it shares, counted from the first.
    """

    size: int
    angles: slice
    blocks: Ints
    lengths: Floats
    stiffness: Floats
    like: Ints

    __repr__ = brief

    @staticmethod
    def of(line: RodLine, stiffness: Floats, twist: bool) -> "RodBends":
        """The bends of a line.

        Args:
            stiffness: (e, 3) EI1, EI2 and GJ of the edges [N m2]; the compliances of the half edges on either side of a
                node add up.
            twist: the rod has twist angles.
        """
        n, (middles, edges) = len(line.nodes), line.inner_bends()
        angles = slice(n, n + (len(line.edges) if twist else 0))
        blocks = np.column_stack(
            [line.edges[edges[:, 0], 0], n + edges[:, 0], middles, n + edges[:, 1], line.edges[edges[:, 1], 1]]
        )
        compliance = 0.5 * line.lengths[:, None] / stiffness
        at_bends = 1.0 / (compliance[edges[:, 0]] + compliance[edges[:, 1]])
        lengths, like = 0.5 * line.lengths[edges].sum(axis=1), np.arange(len(middles))
        for k, end in enumerate(line.clamps):
            ghost, (edge, last, inner) = angles.stop + k, (0, 0, 1) if end == "start" else (n - 2, n - 1, n - 2)
            row = [ghost, ghost + len(line.clamps), last, n + edge, inner]
            blocks = np.vstack([blocks, row if end == "start" else row[::-1]])
            lengths = np.append(lengths, 0.5 * line.lengths[edge])
            at_bends = np.vstack([at_bends, stiffness[edge] / lengths[-1]])
            like = np.append(like, 0 if end == "start" else n - 3)
        size = angles.stop + len(line.clamps) * (2 if twist else 1)
        return RodBends(size, angles, blocks, lengths, at_bends, like)

    def rest_state(self, line: RodLine, directors: Floats) -> tuple[Floats, Floats]:
        """(size, 3) state at rest, and in the rows of the twist angles the directors (e, 3) of their edges."""
        state, frames = np.zeros((self.size, 3)), np.zeros((self.size, 3))
        state[: len(line.nodes)], frames[self.angles] = line.nodes, directors
        for k, (end, tangent) in enumerate(line.clamps.items()):
            ghost = self.angles.stop + k
            state[ghost] = ghost_position(end, line.nodes[0 if end == "start" else -1], line.lengths, tangent)
            frames[ghost + len(line.clamps)] = line.end_director(directors, end)
        return state, frames


def ghost_position(end: End, position: Floats, lengths: Floats, tangent: Floats) -> Floats:
    """(3,) position of the ghost node of a clamped end, one last edge of the rod past it [m].

    Args:
        position, tangent: (3,) of the end, and along the rod there.
        lengths: (e,) of the rod's edges [m].
    """
    edge, outward = (0, -1.0) if end == "start" else (-1, 1.0)
    return np.asarray(position + outward * lengths[edge] * tangent)


def _points(rest: ArrayLike) -> int:
    """How many nodes there are."""
    try:
        shape = np.shape(rest)
    except ValueError:  # rows of different lengths
        shape = ()
    if len(shape) != 2 or shape[0] < 3:
        what = f"an array {shape}" if shape else described(rest)
        raise InputError(f"a rod needs 3 nodes or more, (n, 3) in m, not {what}")
    return int(shape[0])


def _clamps(clamped: Clamps, tangents: Floats, lengths: Floats, closed: bool) -> dict[End, Floats]:
    """Unit tangent at each clamp."""
    wanted: dict[End, ArrayLike | None]
    if isinstance(clamped, str) or not isinstance(clamped, Sequence | Mapping):
        raise InputError(f'clamped must be a sequence of ends, such as ("start",), not {described(clamped)}')
    wanted = dict(clamped) if isinstance(clamped, Mapping) else dict.fromkeys(clamped)
    if wanted and closed:
        raise InputError("a closed ring has no ends to clamp")
    result: dict[End, Floats] = {}
    for end, tangent in wanted.items():
        if end not in ("start", "end"):
            raise InputError(f'a rod is clamped at its "start" or "end", not {short(end)}')
        (t0, t1), (l0, l1) = (x[:2] if end == "start" else x[-1:-3:-1] for x in (tangents, lengths))
        if tangent is None:
            tangent = t0 + (t0 - t1) * l0 / (l0 + l1)  # extrapolated from the two last edges, to second order
        result[end] = direction(f'the tangent at the "{end}"', tangent)
        if result[end] @ t0 < _FOLDED:
            raise InputError(f'the tangent at the "{end}" points against the rod: it runs along it, from start to end')
    return result
