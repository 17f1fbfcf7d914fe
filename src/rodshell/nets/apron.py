"""The apron: a net's rods, continued past the ends of the target.

A rod that ends at the rim is free from its last joint on: there it would follow a geodesic, not the net, and its end
would be up to millimetres off. So the net that is bound to a target is continued by an apron, two more rings of joints
past every end, on the surface's smooth continuation, with all the lines that meet there; the apron is cut off
afterwards. Across an opening the net simply continues: the drape ignores it.
"""

from collections.abc import Sequence

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.layout import FlatGrid, FlatRod
from rodshell.layout.gridlayout import FAMILIES, lattice_rod
from rodshell.nets.compass import Net

RINGS = 2  # of joints: on a 0.2 m hemisphere at 40 mm spacing the ends are 0.1 mm off the net; 0.5 mm with 1 ring


def with_apron(
    rods: Sequence[FlatRod], net: Net, lines: tuple[Floats, Floats], clearance: float
) -> tuple[FlatGrid, Ints]:
    """The flat grid of rods, each prolonged past both ends; and the rod of it (m,) that each is a piece of.

    Pieces of a line become one rod where the net continues between them. Lines that are crossed only there become
    virtual rods. A rod keeps its end where the net ends.

    Args:
        rods: each from end to end of the target.
        lines: offsets of the lines of the lattice, see `ChebyshevNet` [m].
        clearance: distance of the first joint past an end from that end, at least [m].
    """
    u, v = lines
    rows, columns = np.searchsorted(net.u, u - 1e-12), np.searchsorted(net.v, v - 1e-12)
    alive = np.isfinite(net.points[rows[:, None], columns, 0])
    families = [
        _Family(number, stations, offsets, live, rods, clearance)
        for number, (stations, offsets, live) in enumerate(((u, v, alive.T), (v, u, alive)))
    ]
    both = families[0].joints.T | families[1].joints
    (u_rods, u_whole), (v_rods, v_whole) = families[0].prolonged(both.T), families[1].prolonged(both)
    whole = np.empty(len(rods), dtype=np.intp)
    along_u = np.array([rod.family == FAMILIES[0] for rod in rods], dtype=bool)
    whole[along_u], whole[~along_u] = u_whole, len(u_rods) + v_whole
    return FlatGrid.of([*u_rods, *v_rods]), whole


class _Family:
    """The lines of one family, and its rods on them. A stretch of a line ends where the net has no node.

    Args:
        stations: (n,) where the lines are crossed [m].
        offsets: (m,) of the lines [m].
        live: (m, n) where the net has nodes.

    Attributes:
        joints: (m, n) the nodes of all rods, and of `RINGS` more past their ends.
    """

    def __init__(
        self, number: int, stations: Floats, offsets: Floats, live: Bools, rods: Sequence[FlatRod], clearance: float
    ) -> None:
        self.number, self.stations, self.offsets = number, stations, offsets
        self.rods = [rod for rod in rods if rod.family == FAMILIES[number]]
        self.stretches = np.cumsum(~live).reshape(live.shape) + np.arange(len(live))[:, None]
        self.line_of = np.repeat(np.arange(len(live)), 1 + (~live).sum(axis=1))
        laid = np.array([(rod.offset, rod.start, rod.end) for rod in self.rods], dtype=float).reshape(-1, 3)
        lines = np.abs(offsets - laid[:, :1]).argmin(axis=1)
        away = np.abs(stations - laid[:, 1:].mean(axis=1, keepdims=True))
        nodes = np.where(live[lines], away, np.inf).argmin(axis=1)
        self.stretch_of = self.stretches[lines, nodes]
        self.first_rod = np.full(len(self.line_of), -1)
        self.first_rod[self.stretch_of[::-1]] = np.arange(len(laid))[::-1]
        self.ends = np.tile([np.inf, -np.inf], (len(self.line_of), 1))
        np.minimum.at(self.ends[:, 0], self.stretch_of, laid[:, 1])
        np.maximum.at(self.ends[:, 1], self.stretch_of, laid[:, 2])
        built, node = np.flatnonzero(self.first_rod >= 0), np.arange(len(stations))
        first = np.searchsorted(stations, self.ends[built, 0] - clearance, side="right") - RINGS
        stop = np.searchsorted(stations, self.ends[built, 1] + clearance) + RINGS
        near = (first[:, None] <= node) & (node < stop[:, None])
        self.joints = np.zeros_like(live)
        np.logical_or.at(self.joints, self.line_of[built], near & live[self.line_of[built]])

    def prolonged(self, joints: Bools) -> tuple[list[FlatRod], Ints]:
        """A rod for each stretch with rods on it, or with at least two `joints` (m, n): from the first to the last
        joint, its own ends included; and which of them each rod is a piece of."""
        on, at, ends = self.stretches[joints], self.stations[np.nonzero(joints)[1]], self.ends.copy()
        np.minimum.at(ends[:, 0], on, at)
        np.maximum.at(ends[:, 1], on, at)
        kept = np.flatnonzero((self.first_rod >= 0) | (np.bincount(on, minlength=len(ends)) > 1))
        columns = self.first_rod[kept].tolist(), self.offsets[self.line_of[kept]].tolist(), ends[kept].tolist()
        label = f"apron {FAMILIES[self.number].upper()}"
        rods = [
            self.rods[rod].cut(a, b)
            if rod >= 0
            else lattice_rod(self.number, f"{label} {c:+.4f}", c, a, b, virtual=True)
            for rod, c, (a, b) in zip(*columns, strict=True)
        ]
        return rods, np.searchsorted(kept, self.stretch_of)
