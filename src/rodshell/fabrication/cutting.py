"""Where to splice a rod that is longer than a bar of stock."""

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats

TINY = 1e-9  # of a bar: round-off
Route = tuple[int, int, float, tuple[float, ...]]  # to a stop: pieces, short ones of them, worst bend, stops before it


def splices(
    length: float, joints: ArrayLike, stock: float, *, stations: ArrayLike, curvature: ArrayLike, short: float = 0.0,
    taken: ArrayLike = (),
) -> list[float] | None:  # fmt: skip
    """Distances of the splices from the rod's start [m]; None where stock of this length cannot do.

    A splice lies halfway between two neighbouring joints. The choice has the fewest pieces; among such choices the
    fewest `short` pieces; among those the least bend at its most bent splice.

    Args:
        length: of the rod as cut [m], over which all distances are measured.
        joints: distances of the joints from the start [m].
        stock: longest piece [m].
        short: pieces under this length are avoided [m].
        stations, curvature: the rod's bend [1/m] at some ascending distances from the start [m].
        taken: splices of other laths of the rod; none is made between the same joints [m from the start].
    """
    if length <= stock:
        return []
    at = np.unique(np.asarray(joints, dtype=float))
    middles = 0.5 * (at[:-1] + at[1:])
    apart = np.abs(middles[:, None] - np.asarray(taken, dtype=float))
    middles = middles[(apart > TINY * stock).all(axis=1)]
    bend = np.interp(middles, np.asarray(stations, dtype=float), np.asarray(curvature, dtype=float))
    stops = np.concatenate([[0.0], middles, [length]])
    return _fewest(stops, np.concatenate([[0.0], bend, [0.0]]), stock, short)


def _fewest(stops: Floats, bend: Floats, stock: float, short: float) -> list[float] | None:
    """The stops on the way from the first to the last in the fewest steps of at most `stock`, then in the fewest under
    `short`, then of the least worst bend."""
    reached: list[tuple[float, Route]] = [(float(stops[0]), (0, 0, 0.0, ()))]
    for k in range(1, len(stops)):
        ways = [
            (pieces + 1, few + (stops[k] - stop < short), max(worst, float(bend[k])), (stop, *before))
            for stop, (pieces, few, worst, before) in reached
            if stops[k] - stop <= stock
        ]
        reached += [(float(stops[k]), min(ways))] if ways else []
    last, (_, _, _, before) = reached[-1]
    return [*before[-2::-1]] if last == stops[-1] else None
