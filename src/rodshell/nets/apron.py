"""The apron: a net's rods, continued past the ends of the target.

A rod that ends at the rim is free from its last joint on: there it would follow a geodesic, not the net, and its end
would be up to millimetres off. So the net that is bound to a target is continued by an apron, two more rings of joints
past every end, on the surface's smooth continuation, with all the lines that meet there; the apron is cut off
afterwards. Across an opening the net simply continues: the drape ignores it.
"""

from collections.abc import Sequence

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.kernels import njit
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
        _Family(number, stations, offsets, np.ascontiguousarray(live), rods, clearance)
        for number, (stations, offsets, live) in enumerate(((u, v, alive.T), (v, u, alive)))
    ]
    both = families[0].joints.T | families[1].joints
    (u_rods, u_whole), (v_rods, v_whole) = (
        families[0].prolonged(np.ascontiguousarray(both.T)),
        families[1].prolonged(both),
    )
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
        laid = np.array([(rod.offset, rod.start, rod.end) for rod in self.rods]).reshape(-1, 3)
        found = _stretches(stations, offsets, live, laid, clearance)
        self.stretches, self.line_of, self.stretch_of, self.first_rod, self.ends, self.joints = found

    def prolonged(self, joints: Bools) -> tuple[list[FlatRod], Ints]:
        """A rod for each stretch with rods on it, or with at least two `joints` (m, n): from the first to the last
        joint, its own ends included; and which of them each rod is a piece of."""
        kept, ends = _prolong(self.stations, self.stretches, joints, self.first_rod, self.ends)
        columns = self.first_rod[kept].tolist(), self.offsets[self.line_of[kept]].tolist(), ends.tolist()
        label = f"apron {FAMILIES[self.number].upper()}"
        rods = [
            self.rods[rod].cut(a, b)
            if rod >= 0
            else lattice_rod(self.number, f"{label} {c:+.4f}", c, a, b, virtual=True)
            for rod, c, (a, b) in zip(*columns, strict=True)
        ]
        return rods, np.searchsorted(kept, self.stretch_of)


@njit("f1 f1 b2 f2 f")
def _stretches(stations, offsets, live, rods, clearance):  # type: ignore[no-untyped-def]
    """Of each node (m, n) its stretch; of each stretch (k,) its line; of each rod (r,) its stretch; of each stretch its
    first rod, or -1, and where its rods start and end (k, 2); and the joints (m, n), see `_Family`. Each of `rods`
    (r, 3) has an offset, a start and an end."""
    (lines, nodes), count = live.shape, 0
    stretches, joints = np.empty((lines, nodes), dtype=np.int64), np.zeros((lines, nodes), dtype=np.bool_)
    line_of = np.empty(lines * (nodes + 1), dtype=np.int64)
    for m in range(lines):
        line_of[count] = m
        for n in range(nodes):
            if not live[m, n]:
                count += 1
                line_of[count] = m
            stretches[m, n] = count
        count += 1
    stretch_of, first_rod, ends = np.empty(len(rods), dtype=np.int64), np.full(count, -1), np.empty((count, 2))
    for k in range(count):
        ends[k, 0], ends[k, 1] = np.inf, -np.inf
    for rod in range(len(rods)):
        line, node, middle, least = 0, 0, 0.5 * (rods[rod, 1] + rods[rod, 2]), np.inf
        for m in range(1, lines):
            if abs(offsets[m] - rods[rod, 0]) < abs(offsets[line] - rods[rod, 0]):
                line = m
        for n in range(nodes):
            if live[line, n] and abs(stations[n] - middle) < least:
                node, least = n, abs(stations[n] - middle)
        k = stretch_of[rod] = stretches[line, node]
        if first_rod[k] < 0:
            first_rod[k] = rod
        ends[k, 0], ends[k, 1] = min(ends[k, 0], rods[rod, 1]), max(ends[k, 1], rods[rod, 2])
    for k in range(count):
        if first_rod[k] >= 0:
            first, stop = -RINGS, RINGS
            for n in range(nodes):
                first += stations[n] <= ends[k, 0] - clearance
                stop += stations[n] < ends[k, 1] + clearance
            for n in range(max(first, 0), min(stop, nodes)):
                joints[line_of[k], n] |= live[line_of[k], n]
    return stretches, line_of, stretch_of, first_rod, ends, joints


@njit("f1 i2 b2 i1 f2")
def _prolong(stations, stretches, joints, first_rod, ends):  # type: ignore[no-untyped-def]
    """The stretches (k,) with rods, or with at least two `joints` (m, n), and their ends (k, 2), moved to these."""
    count, kept, used = np.zeros(len(ends), dtype=np.int64), np.empty(len(ends), dtype=np.int64), 0
    ends = ends.copy()
    for m in range(len(joints)):
        for n in range(len(stations)):
            if joints[m, n]:
                k, at = stretches[m, n], stations[n]
                ends[k, 0], ends[k, 1] = min(ends[k, 0], at), max(ends[k, 1], at)
                count[k] += 1
    for k in range(len(ends)):
        if first_rod[k] >= 0 or count[k] > 1:
            kept[used], ends[used, 0], ends[used, 1] = k, ends[k, 0], ends[k, 1]
            used += 1
    return kept[:used], ends[:used]
