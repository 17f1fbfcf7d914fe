"""Initial placement: the flat grid over the target, where gravity and fall drapes start, and whether it stays there."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.layout import FlatGrid, GridLayout, GridMesh
from rodshell.nets import chebyshev_net
from rodshell.targets import Target

OVERHANG = 4.0  # spacings that a rod of automatic length hangs over the target's end
SLIPPED = 0.2  # of the size: distance of the heading's axis from its vertical plane at which the grid is lost


def anchor_point(target: Target, anchor: tuple[float, float] | None) -> Floats:
    """(3,) the point of the target under the layout's middle [m].

    Parameters
    ----------
    anchor : x, y [m]; default: the target's highest point.

    Raises
    ------
    InputError : the anchor lies outside the target.
    """
    x, y = anchor if anchor is not None else target.summit
    top = target.lift(np.array([[x, y]]))[0]
    if target.margin(top[None])[0] <= 0:
        raise InputError(f"the anchor ({x:g}, {y:g}) m lies outside the target: choose a point inside its rim")
    return np.asarray(top)


def initial_grid(target: Target, layout: GridLayout, anchor: tuple[float, float] | None) -> FlatGrid:
    """The layout's flat grid; rods "auto" are the lines that the net finds on the target, lengths "auto" hang over.

    Parameters
    ----------
    anchor : x, y of the point under the layout's middle [m]; default: the target's highest point.

    Raises
    ------
    NetLimitError : no net covers the target from this anchor and heading.
    """
    if layout.rods != "auto" and layout.length != "auto":
        return layout.flat_grid(layout.rods, layout.length)
    net = chebyshev_net(target, layout, anchor=anchor)
    rods = [rod for rod in net.rods if not rod.virtual]
    if layout.length != "auto":
        half = layout.length / 2
        return FlatGrid.of([rod.cut(*(layout.middle(rod.family) + end for end in (-half, half))) for rod in rods])
    overhang = OVERHANG * max(layout.spacing)
    return FlatGrid.of([rod.cut(rod.start - overhang, rod.end + overhang) for rod in rods])


def middle_marks(grid: FlatGrid) -> list[tuple[float, ...]]:
    """Stations [m] on each rod where every mesh has a node: where the axes cross, if the rod lies there."""
    return [(0.0,) if rod.offset == 0.0 and rod.start < 0.0 < rod.end else () for rod in grid.rods]


def placed_over(mesh: GridMesh, layout: GridLayout, top: Floats) -> Floats:
    """(n, 3) nodes of the flat grid turned to its heading, its middle at a point [m].

    Parameters
    ----------
    top : (3,) that point [m].
    """
    c, s = np.cos(layout.rotate), np.sin(layout.rotate)
    return np.asarray(mesh.flat @ np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]]) + top)


def lost_contact(mesh: GridMesh, state: Floats, layout: GridLayout, top: Floats, target: Target) -> bool:
    """Whether the grid leaves its place on the target: the rod nearest the heading's axis left its vertical plane.

    Parameters
    ----------
    state : (n, 3) of the mesh's nodes [m].
    top : (3,) the point under the layout's middle [m].
    """
    rods = [k for k, rod in enumerate(mesh.grid.rods) if rod.family == "u"]
    axis = min(rods, key=lambda k: abs(mesh.grid.rods[k].offset))
    across = np.array([-np.sin(layout.rotate), np.cos(layout.rotate), 0.0])
    x = state[mesh.nodes_of(axis)]
    inside = target.margin(x) > 0
    sideways = (x - top) @ across - mesh.grid.rods[axis].offset
    return bool(np.abs(sideways[inside]).max(initial=0.0) > SLIPPED * target.size)
