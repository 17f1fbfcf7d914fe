"""The flat grid over the target: what every fall starts from, and whether it stayed on top."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.layout import FlatGrid, GridLayout, GridMesh
from rodshell.nets import chebyshev_net
from rodshell.targets import Target

OVERHANG = 4.0  # spacings that a rod of automatic length hangs over the target's end
SLIPPED = 0.2  # of the size: a joint of the axes that has moved so far from its vertical plane has slid off


def standing_point(target: Target, anchor: tuple[float, float] | None) -> Floats:
    """(3,) the point of the target under the layout's middle [m].

    Raises
    ------
    InputError : the anchor lies outside the target.
    """
    x, y = anchor if anchor is not None else target.summit
    top = target.lift(np.array([[x, y]]))[0]
    if target.margin(top[None])[0] <= 0:
        raise InputError(f"the anchor ({x:g}, {y:g}) m lies outside the target: choose a point inside its rim")
    return np.asarray(top)


def falling_grid(target: Target, layout: GridLayout, anchor: tuple[float, float] | None) -> FlatGrid:
    """The layout's grid; "auto" takes the lines that the net finds on the target, and lengths that hang over."""
    if layout.rods != "auto" and layout.length != "auto":
        return layout.flat_grid(layout.rods, layout.length)
    net = chebyshev_net(target, layout, anchor=anchor)
    rods = [rod for rod in net.rods if not rod.virtual]
    if layout.length != "auto":
        half = layout.length / 2
        return FlatGrid.of([rod.cut(*(layout.middle(rod.family) + end for end in (-half, half))) for rod in rods])
    over = OVERHANG * max(layout.spacing)
    return FlatGrid.of([rod.cut(rod.start - over, rod.end + over) for rod in rods])


def middle_marks(grid: FlatGrid, layout: GridLayout) -> list[tuple[float, ...]]:
    """A node where the axes cross, if a rod lies there, on every level."""
    return [(0.0,) if rod.offset == 0.0 and rod.start < 0.0 < rod.end else () for rod in grid.rods]


def over(mesh: GridMesh, layout: GridLayout, top: Floats) -> Floats:
    """The flat grid turned to its heading, its middle at the point `top` (3,) [m]."""
    c, s = np.cos(layout.rotate), np.sin(layout.rotate)
    return mesh.flat @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + top


def slid_off(mesh: GridMesh, state: Floats, layout: GridLayout, top: Floats, target: Target) -> bool:
    """Whether the rod nearest the heading's axis has left the vertical plane that symmetry would keep it in."""
    rods = [k for k, rod in enumerate(mesh.grid.rods) if rod.family == "u"]
    axis = min(rods, key=lambda k: abs(mesh.grid.rods[k].offset))
    across = np.array([-np.sin(layout.rotate), np.cos(layout.rotate), 0.0])
    x = state[mesh.nodes_of(axis)]
    inside = target.margin(x) > 0
    sideways = (x - top) @ across - mesh.grid.rods[axis].offset
    return bool(np.abs(sideways[inside]).max(initial=0.0) > SLIPPED * target.size)
