"""How far a net has to be marched: to the nodes inside the target's end, some way past them, and no further.

What is bound to a target goes on past its end (`apron`), and a rod is cut between nodes on both sides. All other nodes
of the net would be found for nothing. Which these are is known beforehand from the same net in longer steps.
"""

from dataclasses import dataclass

import numba as nb
import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.nets.compass import ON_SURFACE, Heights, Net, fill_quadrants
from rodshell.nets.cuts import inside_nodes
from rodshell.nets.nearby import march_near
from rodshell.targets import Target

SURELY = 0.96  # of the margin: two nets in different steps end a little elsewhere


@dataclass(frozen=True)
class Covering(Net):
    """A net that covers a target: it is known where nodes are inside, and some way past them.

    Parameters
    ----------
    inside : (nu, nv) nodes inside the target's end, see `inside_nodes`.
    """

    inside: Bools

    def reach(self, past: int) -> Floats:
        """How far it is inside towards -u, +u, -v and +v, and so many nodes more [m]."""
        result = list[float]()
        for s, touched in ((self.u, self.inside.any(axis=1)), (self.v, self.inside.any(axis=0))):
            on = np.flatnonzero(touched) if touched.any() else np.array([0, len(s) - 1])
            result += [-s[max(on[0] - past, 0)], s[min(on[-1] + past, len(s) - 1)]]
        return np.array(result)


def march_covering(
    target: Target,
    u: Floats,
    v: Floats,
    anchor: Floats,
    heading: Floats,
    margin: Floats,
    near: Covering,
    coarser: Net | None = None,
    *,
    heights: Heights = ON_SURFACE,
) -> Covering:
    """As `march_near`, as far as the target and a `margin` (2,) along u and v past its end [m]. Where it ends is taken
    from the net `near` in longer steps; where that was wrong, the march goes on."""
    wanted = wanted_nodes(near, 1, u, v, margin)
    net = march_near(target, u, v, anchor, heading, near, coarser=coarser, wanted=wanted, heights=heights)
    while True:
        found = Covering(u, v, net.points, inside_nodes(target, net), heights=heights)
        more = wanted_nodes(found, 0, u, v, SURELY * margin) & ~wanted
        if not more.any():
            return found
        wanted |= more
        fill_quadrants(target, net, wanted)


def wanted_nodes(near: Covering, past: int, u: Floats, v: Floats, margin: Floats) -> Bools:
    """(nu, nv) nodes of the lines u and v that lie no further than a `margin` (2,) along u or v [m] outside what is
    inside of a net `near`, and all between these and the axes. Its end may lie so many nodes `past` the inside ones.

    All nodes where that net tells nothing, since it has none inside.
    """
    if not near.inside.any():
        return np.ones((len(u), len(v)), dtype=bool)
    return np.asarray(_wanted(near.inside, near.u, near.v, past, u, v, *margin))


@nb.njit(cache=True)
def _wanted(inside, known_u, known_v, past, u, v, margin_u, margin_v):  # type: ignore[no-untyped-def]
    """See `wanted_nodes`. In each quadrant the nodes lie under a stair that only goes down, away from the axis."""
    wanted = np.zeros((len(u), len(v)), dtype=np.bool_)
    i_axis, j_axis, (nu, nv) = np.argmin(np.abs(u)), np.argmin(np.abs(v)), inside.shape
    for quadrant in range(4):
        i_side, j_side = 1 - 2 * (quadrant // 2), 1 - 2 * (quadrant % 2)
        ends, height = np.full(nu + 1, np.inf), np.full(nu + 1, -np.inf)  # where each step ends, and how high it is
        for k in range(nu - 1, -1, -1):
            i, height[k] = (k if i_side > 0 else nu - 1 - k), height[k + 1]
            ends[k] = i_side * known_u[min(max(i + i_side * past, 0), nu - 1)]
            for m in range(nv - 1, -1, -1):
                j = m if j_side > 0 else nv - 1 - m
                if inside[i, j]:
                    height[k] = max(height[k], j_side * known_v[min(max(j + j_side * past, 0), nv - 1)])
                    break
        k, beside = 0, 0
        for i in range(i_axis, len(u) if i_side > 0 else -1, i_side):
            while ends[k] < abs(u[i]):
                k += 1
            while ends[beside] + margin_u < abs(u[i]):
                beside += 1
            for j in range(j_axis, len(v) if j_side > 0 else -1, j_side):
                if abs(v[j]) > max(height[beside], height[k] + margin_v):
                    break
                wanted[i, j] = True
    return wanted
