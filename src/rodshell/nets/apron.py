"""The apron: a net's rods, continued past the ends of the target.

A rod that ends at the rim is free from its last joint on: there it would follow a geodesic, not the net, and its end
would be up to millimetres off. So the net that is bound to a target is continued by an apron, two more rings of joints
past every end, on the surface's smooth continuation, with all the lines that meet there; the apron is cut off
afterwards. Across an opening the net simply continues: the drape ignores it.
"""

from collections.abc import Sequence

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.layout import FlatGrid, FlatRod
from rodshell.nets.compass import Net

RINGS = 2  # of joints: on a 0.2 m hemisphere at 40 mm spacing the ends are 0.1 mm off the net; 0.5 mm with 1 ring


def with_apron(rods: Sequence[FlatRod], net: Net, lines: tuple[Floats, Floats], clearance: float) -> FlatGrid:
    """The flat grid of rods, each prolonged past both ends.

    Pieces of a line become one rod where the net continues between them. Lines that are crossed only there become
    virtual rods. A rod keeps its end where the net ends.

    Parameters
    ----------
    rods : each from end to end of the target.
    net : in which they lie.
    lines : offsets of the lines of the lattice, see `ChebyshevNet` [m].
    clearance : distance of the first joint past an end from that end, at least [m].
    """
    u, v = lines
    rows, columns = np.searchsorted(net.u, u - 1e-12), np.searchsorted(net.v, v - 1e-12)
    alive = np.isfinite(net.points[rows[:, None], columns, 0])
    families = [
        _Family(name, stations, offsets, live, [rod for rod in rods if rod.family == name])
        for name, stations, offsets, live in (("u", u, v, alive.T), ("v", v, u, alive))
    ]
    joints = [family.joints(clearance) for family in families]
    both = joints[0] | joints[1].T
    return FlatGrid.of([*families[0].prolonged(both), *families[1].prolonged(both.T)])


class _Family:
    """The lines of one family, and its rods on them. A stretch of a line ends where the net has no node.

    Parameters
    ----------
    name : "u" or "v".
    stations : (n,) where the lines are crossed [m].
    offsets : (m,) of the lines [m].
    live : (m, n) where the net has nodes.
    rods : of this family.
    """

    def __init__(self, name: str, stations: Floats, offsets: Floats, live: Bools, rods: list[FlatRod]) -> None:
        self.name, self.stations, self.offsets, self.live, self.rods = name, stations, offsets, live, rods
        lines, nodes = live.shape
        self.stretches = np.cumsum(~live, axis=1) + (nodes + 1) * np.arange(lines)[:, None]
        offset, start, end = np.array([(rod.offset, rod.start, rod.end) for rod in rods]).reshape(-1, 3).T
        line = np.abs(offsets - offset[:, None]).argmin(axis=1)
        away = np.where(live[line], np.abs(stations - 0.5 * (start + end)[:, None]), np.inf)
        stretch = self.stretches[line, away.argmin(axis=1)]
        # of each stretch its first rod, or -1, and where its rods start and end
        self.first_rod = np.full(lines * (nodes + 1), -1)
        self.first_rod[stretch[::-1]] = np.arange(len(rods))[::-1]
        self.start, self.end = np.full(len(self.first_rod), np.inf), np.full(len(self.first_rod), -np.inf)
        np.minimum.at(self.start, stretch, start)
        np.maximum.at(self.end, stretch, end)

    def joints(self, clearance: float) -> Bools:
        """(m, n) the nodes of all rods, and of `RINGS` more past their ends."""
        spanned = np.flatnonzero(self.first_rod >= 0)
        first = np.searchsorted(self.stations, self.start[spanned] - clearance, side="right") - RINGS
        last = np.searchsorted(self.stations, self.end[spanned] + clearance, side="left") + RINGS - 1
        node, result = np.arange(len(self.stations)), np.zeros_like(self.live)
        within = (node >= first[:, None]) & (node <= last[:, None])
        np.logical_or.at(result, spanned // (len(node) + 1), within)
        return np.asarray(result & self.live)

    def prolonged(self, joints: Bools) -> list[FlatRod]:
        """A rod for each stretch with rods on it, or with at least two `joints` (m, n): from the first to the last
        joint, its own ends included."""
        start, end, stretch = self.start.copy(), self.end.copy(), self.stretches[joints]
        at = np.broadcast_to(self.stations, joints.shape)[joints]
        np.minimum.at(start, stretch, at)
        np.maximum.at(end, stretch, at)
        kept = np.flatnonzero((self.first_rod >= 0) | (np.bincount(stretch, minlength=len(start)) > 1))
        columns = self.first_rod[kept], self.offsets[kept // (len(self.stations) + 1)], start[kept], end[kept]
        make = FlatRod.u if self.name == "u" else FlatRod.v
        return [
            self.rods[rod].cut(a, b) if rod >= 0 else make(f"apron {self.name.upper()} {c:+.4f}", c, a, b, virtual=True)
            for rod, c, a, b in zip(*(column.tolist() for column in columns), strict=True)
        ]
