"""The net with an apron: two more rings of joints past the target's end.

A rod that ends at the rim runs freely from its last joint: there it would follow a geodesic, not the net,
and its end would lie up to millimetres to the side. So the net that is bound to a target goes on past every
end, on the surface's smooth continuation, with all the lines that meet there; the apron is cut off afterwards.
Across an opening the net simply goes on: the drape does not know of it.
"""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.layout import FlatGrid, FlatRod
from rodshell.nets.chebyshev import ChebyshevNet

RINGS = 2  # one leaves the ends 0.5 mm off the net on a 0.2 m hemisphere at 40 mm spacing, two 0.1 mm


def with_apron(net: ChebyshevNet, clearance: float) -> FlatGrid:
    """The rods of `net`, each prolonged past both its ends, the first joint there being `clearance` [m] or more away.

    Pieces of a line are one rod where the net goes on between them. Lines that are only met become virtual rods.
    A rod keeps its end where the net goes no further.
    """
    u, v = net.lines
    alive = np.isfinite(
        net.net.points[np.searchsorted(net.net.u, u - 1e-12)][:, np.searchsorted(net.net.v, v - 1e-12), 0]
    )
    lines = {"u": _Lines.of(u, v, alive.T), "v": _Lines.of(v, u, alive)}
    spans: dict[tuple[str, int, int], FlatRod] = {}
    for rod in net.rods:
        key = (rod.family, *lines[rod.family].stretch_of(rod))
        joined = spans.get(key, rod)
        spans[key] = joined.cut(min(joined.start, rod.start), max(joined.end, rod.end))
    met = {family: np.zeros(family_lines.live.shape, dtype=bool) for family, family_lines in lines.items()}
    for (family, line, _), rod in spans.items():
        stations, live = lines[family].stations, lines[family].live[line]
        first = int(np.searchsorted(stations, rod.start - clearance, side="right")) - RINGS
        last = int(np.searchsorted(stations, rod.end + clearance, side="left")) + RINGS - 1
        span = np.arange(max(first, 0), min(last, len(stations) - 1) + 1)
        met[family][line, span[live[span]]] = True
    spanned: dict[tuple[str, int], set[int]] = {}
    for family, line, stretch in spans:
        spanned.setdefault((family, line), set()).add(stretch)
    points = met["u"] | met["v"].T
    rods = list[FlatRod]()
    for family, table in (("u", points), ("v", points.T)):
        own = lines[family]
        for line, offset in enumerate(own.offsets.tolist()):
            stations, stretches = own.stations[table[line]], own.stretches[line][table[line]]
            for stretch in sorted(spanned.get((family, line), set()).union(stretches.tolist())):
                rods += _prolonged(spans.get((family, line, stretch)), family, offset, stations[stretches == stretch])
    return FlatGrid.of(rods)


@dataclass(frozen=True)
class _Lines:
    """Lines of one family: at `offsets` (m,), crossed at `stations` (n,), with nodes where `live` (m, n).

    `stretches` (m, n) numbers the runs of nodes along each line; a stretch ends where the net has no node.
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


def _prolonged(rod: FlatRod | None, family: str, offset: float, met: Floats) -> list[FlatRod]:
    """A rod from the first to the last joint met on its line, its own ends included."""
    if rod is not None:
        return [rod.cut(min(rod.start, *met), max(rod.end, *met)) if len(met) else rod]
    if len(met) < 2:
        return []
    make = FlatRod.u if family == "u" else FlatRod.v
    return [make(f"apron {family.upper()} {offset:+.4f}", offset, float(met[0]), float(met[-1]), virtual=True)]
