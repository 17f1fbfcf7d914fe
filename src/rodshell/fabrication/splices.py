"""Where to splice a rod that is longer than its stock: off the joints and off sharp bends."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats

Way = tuple[int, int, float, int]  # to a stop: pieces so far, short ones of them, worst bend, the stop before


def splices(
    length: float, joints: ArrayLike, stock: float, *, places: ArrayLike, curvature: ArrayLike, short: float = 0.0
) -> list[float] | None:
    """Distances of the splices from the rod's start [m]; None where stock of this length cannot do.

    A splice lies halfway between two neighbouring joints, as far from both as can be. Of all choices with the
    fewest pieces those are taken with the fewest `short` ones, and of these the one whose sharpest bend at a splice is
    the least.

    Parameters
    ----------
    length : of the rod as cut [m], over which all distances are measured.
    joints : distances of the joints from the start [m].
    stock : longest piece [m].
    short : pieces under this length are avoided [m].
    places, curvature : the rod's bend [1/m] at some ascending distances from the start [m].
    """
    if length <= stock:
        return []
    at = np.unique(np.asarray(joints, dtype=float))
    middles = 0.5 * (at[:-1] + at[1:])
    bend = np.interp(middles, np.asarray(places, dtype=float), np.asarray(curvature, dtype=float))
    stops = np.concatenate([[0.0], middles, [length]])
    return _fewest(stops, np.concatenate([[0.0], bend, [0.0]]), stock, short)


def _fewest(stops: Floats, bend: Floats, stock: float, short: float) -> list[float] | None:
    """The way from the first stop to the last in the fewest steps of at most `stock`, then in the fewest under `short`,
    then of the least worst bend.
    """
    best: list[Way | None] = [(0, 0, 0.0, -1)]
    for k in range(1, len(stops)):
        ways = [
            (way[0] + 1, way[1] + (stops[k] - stops[j] < short), max(way[2], float(bend[k])), j)
            for j, way in enumerate(best)
            if way is not None and stops[k] - stops[j] <= stock
        ]
        best.append(min(ways) if ways else None)
    return _back(stops, best)


def _back(stops: Floats, best: Sequence[Way | None]) -> list[float] | None:
    found = list[float]()
    way = best[-1]
    if way is None:
        return None
    while way is not None and way[3] > 0:
        found.append(float(stops[way[3]]))
        way = best[way[3]]
    return found[::-1]
