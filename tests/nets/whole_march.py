"""A net marched from its axes over all nodes in one go, with which nets that were found faster are compared."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.nets.compass import ON_SURFACE, Heights, Net, axes, fill_quadrants, lay_axes
from rodshell.nets.net_ends import Cuts
from rodshell.targets import Target


def march(
    target: Target, u: Floats, v: Floats, anchor: Floats, heading: Floats, *, heights: Heights = ON_SURFACE
) -> Net:
    """The net of the lines u and v; see `axes` and `Net`."""
    net = Net(u, v, np.full((len(u), len(v), 3), np.nan), heights=heights)
    lay_axes(target, net, axes(target, anchor, heading))
    fill_quadrants(target, net)
    return net


def parts(cuts: Cuts, line: int) -> list[list[float]]:
    """Start and end of each part of one line."""
    return cuts.ends[cuts.line == line].tolist()
