"""The net with an apron: two more rings of joints past the target's end.

A rod that ends at the rim runs freely from its last joint: there it would follow a geodesic, not the net,
and its end would lie up to millimetres to the side. So the net that is bound to a target goes on past every
end, on the surface's smooth continuation, with all the lines that meet there; the apron is cut off afterwards.
"""

import numpy as np
from numpy.typing import NDArray

from gridshell.layout import FlatGrid, FlatRod
from gridshell.nets.chebyshev import ChebyshevNet

RINGS = 2  # one leaves the ends 0.5 mm off the net on a 0.2 m hemisphere at 40 mm spacing, two 0.1 mm


def with_apron(net: ChebyshevNet, clearance: float) -> FlatGrid:
    """The rods of `net`, each prolonged past both its ends, the first joint there being `clearance` [m] or more away.

    Lines that are only met there become virtual rods. A rod keeps its end where the net goes no further.
    """
    u, v = net.lines
    alive = np.isfinite(
        net.net.points[np.searchsorted(net.net.u, u - 1e-12)][:, np.searchsorted(net.net.v, v - 1e-12), 0]
    )
    rod_at: dict[tuple[str, int], FlatRod] = {}
    met = {"u": np.zeros((len(v), len(u)), dtype=bool), "v": np.zeros((len(u), len(v)), dtype=bool)}
    for rod in net.rods:
        stations, offsets, live = (u, v, alive.T) if rod.family == "u" else (v, u, alive)
        line = int(np.argmin(np.abs(offsets - rod.offset)))
        rod_at[rod.family, line] = rod
        first = int(np.searchsorted(stations, rod.start - clearance, side="right")) - RINGS
        last = int(np.searchsorted(stations, rod.end + clearance, side="left")) + RINGS - 1
        span = np.arange(max(first, 0), min(last, len(stations) - 1) + 1)
        met[rod.family][line, span[live[line, span]]] = True
    points = met["u"] | met["v"].T
    rods = list[FlatRod]()
    for family, stations, offsets, table in (("u", u, v, points), ("v", v, u, points.T)):
        for line, offset in enumerate(offsets):
            rods += _prolonged(rod_at.get((family, line)), family, float(offset), stations[table[line]])
    return FlatGrid.of(rods)


def _prolonged(rod: FlatRod | None, family: str, offset: float, met: NDArray[np.float64]) -> list[FlatRod]:
    """A rod from the first to the last joint met on its line, its own ends included."""
    if rod is not None:
        return [rod.cut(min(rod.start, *met), max(rod.end, *met)) if len(met) else rod]
    if len(met) < 2:
        return []
    make = FlatRod.u if family == "u" else FlatRod.v
    return [make(f"apron {family.upper()} {offset:+.4f}", offset, float(met[0]), float(met[-1]), virtual=True)]
