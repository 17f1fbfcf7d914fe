"""The line of a rod at rest: its edges, its clamped ends, and the stretches of rod that its bends stand for."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import adapted, directors_along, parallel_transport, signed_angle
from rodshell.geometry.vectors import cross, dot
from rodshell.rods.section import Rod
from rodshell.validation import direction, finite

End = Literal["start", "end"]
Rods = Rod | Sequence[Rod] | Callable[[float], Rod]
Clamps = Sequence[End] | Mapping[End, ArrayLike]


@dataclass(frozen=True)
class RodLine:
    """Nodes in a row and what follows from them.

    Parameters
    ----------
    nodes : (n, 3) [m]; closed : the last edge leads back to the first node.
    edges : (e, 2) nodes of each; tangents : (e, 3); lengths : (e,) [m].
    clamps : the tangent along the rod at each clamped end.
    """

    nodes: Floats
    closed: bool
    edges: Ints
    tangents: Floats
    lengths: Floats
    clamps: dict[End, Floats]

    @staticmethod
    def of(rest: ArrayLike, *, closed: bool, clamped: Clamps) -> "RodLine":
        """Raises InputError where `rest` or a clamp makes no rod."""
        count = np.shape(rest)[0] if np.ndim(rest) == 2 else 0
        if count < 3:
            raise InputError(f"a rod needs 3 nodes or more, (n, 3), not an array {np.shape(rest)}")
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
        """One for each edge."""
        count = len(self.lengths)
        if isinstance(rod, Rod):
            return [rod] * count
        if callable(rod):
            result = [rod(float(s)) for s in np.cumsum(self.lengths) - 0.5 * self.lengths]
        else:
            result = list(rod) if isinstance(rod, Sequence) else [rod]
            if len(result) != count and all(isinstance(one, Rod) for one in result):
                raise InputError(f"a rod of {count} edges takes as many rods, one for each edge, not {len(result)}")
        wrong = [one for one in result if not isinstance(one, Rod)]
        if wrong:
            raise InputError(f"a rod is made of Rod(section, material), not of {wrong[0]!r}")
        return result

    def directors(self, director: ArrayLike | None) -> Floats:
        """(e, 3) first material directors: of the first edge, carried along without twist, or one for each."""
        if director is None:
            director = (0.0, 0.0, 1.0) if abs(self.tangents[0, 2]) < 0.9 else (1.0, 0.0, 0.0)
        if np.ndim(director) == 2:
            return adapted(finite("the directors, one for each edge,", director, len(self.tangents), 3), self.tangents)
        return directors_along(self.tangents, direction("the director", director))

    def bends(self) -> tuple[Ints, Ints]:
        """(m,) nodes where the rod bends, and (m, 2) edges before and after; the clamps come on top."""
        nodes = np.arange(len(self.nodes)) if self.closed else np.arange(1, len(self.nodes) - 1)
        return nodes, np.column_stack([(nodes - 1) % len(self.nodes), nodes])

    def ghost(self, end: End) -> Floats:
        """(3,) where the rod would go on past a clamped end by its last edge [m]."""
        edge, node, outward = (0, 0, -1.0) if end == "start" else (-1, -1, 1.0)
        return np.asarray(self.nodes[node] + outward * self.lengths[edge] * self.clamps[end])

    def end_director(self, directors: Floats, end: End) -> Floats:
        """(3,) director at a clamp: that of the last edge, carried there with the twist of the two last edges."""
        order = slice(0, 2) if end == "start" else slice(-1, -3, -1)
        (d0, d1), (t0, t1), (l0, l1) = directors[order], self.tangents[order], self.lengths[order]
        twist = signed_angle(parallel_transport(d1, t1, t0), d0, t0)  # from the inner edge to the last
        turn, tangent = twist * l0 / (l0 + l1), self.clamps[end]
        carried = parallel_transport(d0, t0, tangent)
        return np.asarray(np.cos(turn) * carried + np.sin(turn) * cross(tangent, carried))

    def mass(self, size: int, rods: list[Rod], angles: slice) -> Floats:
        """(size, 3) mass [kg]: half of each edge's at either node; rotary inertia [kg m2] of its angle, if any."""
        mass = np.zeros((size, 3))
        half = 0.5 * self.lengths * [rod.mass_per_length for rod in rods]
        for side in range(2):
            np.add.at(mass, self.edges[:, side], half[:, None])
        if angles.stop > angles.start:
            mass[angles, 0] = self.lengths * [rod.rotary_inertia for rod in rods]
        return mass


_FOLDED = -1 + 1e-9  # cosine of a turn that has no side


def _clamps(clamped: Clamps, tangents: Floats, lengths: Floats, closed: bool) -> dict[End, Floats]:
    """Tangent at each clamp."""
    wanted: dict[End, ArrayLike | None]
    if isinstance(clamped, str):
        raise InputError(f'clamped takes the ends in a row, such as ("{clamped}",), not {clamped!r}')
    wanted = dict(clamped) if isinstance(clamped, Mapping) else dict.fromkeys(clamped)
    if wanted and closed:
        raise InputError("a closed ring has no ends to clamp")
    result: dict[End, Floats] = {}
    for end, tangent in wanted.items():
        if end not in ("start", "end"):
            raise InputError(f'a rod is clamped at its "start" or "end", not {end!r}')
        (t0, t1), (l0, l1) = (x[:2] if end == "start" else x[-1:-3:-1] for x in (tangents, lengths))
        if tangent is None:
            tangent = t0 + (t0 - t1) * l0 / (l0 + l1)  # that of the two last edges, to second order
        result[end] = direction(f'the tangent at the "{end}"', tangent)
        if result[end] @ t0 < _FOLDED:
            raise InputError(f'the tangent at the "{end}" points against the rod: it runs along it, from start to end')
    return result
