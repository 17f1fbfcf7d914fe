"""Drape: lay the flat grid on the target."""

from typing import Literal

from gridshell.errors import InputError
from gridshell.formfinding.bound import bound_drape
from gridshell.formfinding.draped import Draped
from gridshell.formfinding.gravity import gravity_drape
from gridshell.formfinding.progress import Progress, silent
from gridshell.joints import Joint
from gridshell.layout import GridLayout
from gridshell.rods.section import Rod
from gridshell.targets import Target

Method = Literal["bound", "gravity"]


def drape(
    layout: GridLayout,
    rod: Rod,
    target: Target,
    *,
    method: Method = "bound",
    anchor: tuple[float, float] | None = None,
    gravity: float = 9.81,
    joint: Joint | None = None,
    progress: Progress = silent,
) -> Draped:
    """Lay a flat grid of rods on a target.

    Parameters
    ----------
    method : "bound" marches the inextensible net and binds the grid to it; "gravity" lets the user's own rods
        fall on the target (static equilibrium, frictionless unilateral contact), from flat.
    anchor : x, y of the point of the target under the layout's middle [m]; default: the target's highest point.
    gravity : acceleration [m/s2], for method "gravity".
    joint : what the rods do to each other where they cross, for method "gravity"; ball joints without. The bound
        drape has none: its net is a matter of geometry.

    Raises
    ------
    InputError, NetLimitError : the layout does not fit the target; no net exists.
    """
    if method == "bound":
        return bound_drape(target, layout, rod, anchor=anchor, progress=progress)
    if method == "gravity":
        return gravity_drape(target, layout, rod, anchor=anchor, gravity=gravity, joint=joint, progress=progress)
    raise InputError(f'drape method must be "bound" or "gravity", not {method!r}')
