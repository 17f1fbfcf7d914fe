"""The net with an apron: two more rings of joints past the target's end.

A rod that ends at the rim is free from its last joint on: there it would follow a geodesic, not the net, and its end
would be up to millimetres off. So the net that is bound to a target is continued past every end, on the surface's
smooth continuation, with all the lines that meet there; the apron is cut off afterwards. Across an opening the net
simply continues: the drape ignores it.
"""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.layout import FlatGrid, FlatRod
from rodshell.nets.chebyshev import ChebyshevNet

RINGS = 2  # with one the ends are 0.5 mm off the net on a 0.2 m hemisphere at 40 mm spacing, with two 0.1 mm


def with_apron(net: ChebyshevNet, clearance: float) -> FlatGrid:
    """The flat grid of a net, with each rod prolonged past both ends.

    Pieces of a line become one rod where the net continues between them. Lines that are crossed only there become
    virtual rods. A rod keeps its end where the net ends.

    Parameters
    ----------
    net : of the layout on the target.
    clearance : distance of the first joint past an end from that end, at least [m].
    """
    u, v = net.lines
    alive = np.isfinite(
        net.net.points[np.searchsorted(net.net.u, u - 1e-12)][:, np.searchsorted(net.net.v, v - 1e-12), 0]
    )
    lines = {"u": _Lines.of(u, v, alive.T), "v": _Lines.of(v, u, alive)}
    spans: dict[tuple[str, int, int], FlatRod] = {}
    for rod in net.rods:
        key = (rod.family, *lines[rod.family].stretch_of(rod))
        known = spans.get(key, rod)
        spans[key] = known.cut(min(known.start, rod.start), max(known.end, rod.end))
    joints = {family: np.zeros(family_lines.live.shape, dtype=bool) for family, family_lines in lines.items()}
    for (family, line, _), rod in spans.items():
        stations, live = lines[family].stations, lines[family].live[line]
        first = int(np.searchsorted(stations, rod.start - clearance, side="right")) - RINGS
        last = int(np.searchsorted(stations, rod.end + clearance, side="left")) + RINGS - 1
        span = np.arange(max(first, 0), min(last, len(stations) - 1) + 1)
        joints[family][line, span[live[span]]] = True
    spanned: dict[tuple[str, int], set[int]] = {}
    for family, line, stretch in spans:
        spanned.setdefault((family, line), set()).add(stretch)
    points = joints["u"] | joints["v"].T
    rods = list[FlatRod]()
    for family, table in (("u", points), ("v", points.T)):
        family_lines = lines[family]
        for line, offset in enumerate(family_lines.offsets.tolist()):
            stations = family_lines.stations[table[line]]
            stretches = family_lines.stretches[line][table[line]]
            for stretch in sorted(spanned.get((family, line), set()).union(stretches.tolist())):
                rods += _prolonged(spans.get((family, line, stretch)), family, offset, stations[stretches == stretch])
    return FlatGrid.of(rods)


@dataclass(frozen=True, eq=False)
class _Lines:
    """Lines of one family.

    Parameters
    ----------
    stations : (n,) where they are crossed [m].
    offsets : (m,) [m].
    live : (m, n) where the net has nodes.
    stretches : (m, n) number of the stretch of each node on its line; a stretch ends where the net has no node.
    """

    stations: Floats
    offsets: Floats
    live: Bools
    stretches: Ints

    @staticmethod
    def of(stations: Floats, offsets: Floats, live: Bools) -> "_Lines":
        return _Lines(stations, offsets, live, np.cumsum(~live, axis=1))

    def stretch_of(self, rod: FlatRod) -> tuple[int, int]:
        """The line and the stretch of it on which a rod lies."""
        line = int(np.argmin(np.abs(self.offsets - rod.offset)))
        away = np.where(self.live[line], np.abs(self.stations - 0.5 * (rod.start + rod.end)), np.inf)
        return line, int(self.stretches[line, np.argmin(away)])


def _prolonged(rod: FlatRod | None, family: str, offset: float, joints: Floats) -> list[FlatRod]:
    """A rod from the first to the last joint on its line, including its own ends."""
    if rod is not None:
        return [rod.cut(min(rod.start, *joints), max(rod.end, *joints)) if len(joints) else rod]
    if len(joints) < 2:
        return []
    make = FlatRod.u if family == "u" else FlatRod.v
    return [make(f"apron {family.upper()} {offset:+.4f}", offset, float(joints[0]), float(joints[-1]), virtual=True)]
