"""Which family's rod ends at each point along a seam."""

import numpy as np

from rodshell.arrays import Floats, Ints

LEAVE_OUT = 1.5  # what it costs to leave a rod out: as much as rods at 0.3 spacings, or at 3.4
APART = 4.0  # spacings along the seam that count as one between rods: past them, rods do not crowd
KEPT = 200  # ways of choosing that are followed at a time


def choose_families(place: Floats, points: Floats, price: Floats, spacing: tuple[float, float]) -> Ints:
    """(n,) family of the rod at each of the points (n, 3) along a seam: 0 u, 1 v, -1 none.

    Rods of one family should lie neither crowded nor far apart, so the sum of the squared logarithms of the distances
    between neighbours over the spacing is made smallest, together with the prices (n, 2) of u and v at each point: from
    point to point, by the last rod of either family.

    place : (n, 2) u, v of the points [m]. The offset of a rod of family u is its v.
    """
    offset = place[:, ::-1] / np.array(spacing)
    winding = _running(np.abs(np.diff(offset, axis=0)))
    run = _running(np.linalg.norm(np.diff(points, axis=0), axis=1)[:, None])[:, 0] / (APART * max(spacing))
    best: dict[tuple[int, int], tuple[float, tuple[int, ...]]] = {(-1, -1): (0.0, ())}
    for k in range(len(place)):
        ahead: dict[tuple[int, int], tuple[float, tuple[int, ...]]] = {}
        for last, (cost, chosen) in best.items():
            for family in (0, 1, -1):
                state, more = last, LEAVE_OUT
                if family >= 0:
                    state = (k, last[1]) if family == 0 else (last[0], k)
                    more = float(price[k, family])
                    before = last[family]
                    if before >= 0:
                        apart = max(winding[k, family] - winding[before, family], run[k] - run[before], 1e-9)
                        more += float(np.log(apart) ** 2)
                if cost + more < ahead.get(state, (np.inf,))[0]:
                    ahead[state] = (cost + more, (*chosen, family))
        best = dict(sorted(ahead.items(), key=lambda one: one[1][0])[:KEPT])
    return np.array(min(best.values())[1], dtype=np.intp)


def _running(steps: Floats) -> Floats:
    """Sums (n + 1, k) of the steps (n, k) so far."""
    return np.vstack([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
