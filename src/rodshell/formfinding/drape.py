"""Drape: lay the flat grid on the target."""

from typing import Literal, get_args

from rodshell.errors import InputError
from rodshell.formfinding.bound import bound_drape
from rodshell.formfinding.draped import Draped
from rodshell.formfinding.fall import Fall
from rodshell.formfinding.gravity import gravity_drape
from rodshell.formfinding.progress import Progress, silent
from rodshell.joints import Joint
from rodshell.layout import GridLayout
from rodshell.rods.section import Rod
from rodshell.targets import Target
from rodshell.validation import choice, instance, point

Method = Literal["bound", "gravity", "paper"]


STANDARD_GRAVITY = 9.81  # m/s2, as in the paper
METHODS: tuple[Method, ...] = get_args(Method)


def drape(
    layout: GridLayout,
    rod: Rod,
    target: Target,
    *,
    method: Method = "bound",
    anchor: tuple[float, float] | None = None,
    gravity: float | None = None,
    joint: Joint | None = None,
    fall: Fall | None = None,
    start: Draped | None = None,
    progress: Progress = silent,
) -> Draped:
    """Lay a flat grid of rods on a target.

    Parameters
    ----------
    method : "bound" marches the inextensible net and binds the grid to it; "gravity" lets the user's own rods
        fall on the target (static equilibrium, frictionless unilateral contact), from flat; "paper" lets them
        fall in time, as the paper does.
    anchor : x, y of the point of the target under the layout's middle [m]; default: the target's highest point.
    gravity : acceleration [m/s2], for methods "gravity" and "paper"; default: 9.81.
    joint : what the rods do to each other where they cross, for methods "gravity" and "paper"; ball joints
        without. The bound drape's net is a matter of geometry: the joint's eccentricity lays its rods in two layers.
    fall : height, time stepping, coupling, friction and drag, for method "paper".
    start : a grid draped before. Method "bound" looks for the net near the one found then, which changes nothing but
        the time. The others always fall from flat: without friction a grid that starts where another lay may turn
        and end elsewhere.

    Raises
    ------
    InputError, NetLimitError : the layout does not fit the target; no net exists.
    """
    for name, value, kind in (("layout", layout, GridLayout), ("rod", rod, Rod), ("target", target, Target)):
        instance(name, value, kind)
    if start is not None:
        instance("start", start, Draped, "what an earlier rodshell.drape returned")
    if anchor is not None:
        point("anchor", anchor)
    _uses_all(choice("method", method, METHODS), gravity, fall)
    gravity = STANDARD_GRAVITY if gravity is None else gravity
    if method == "bound":
        return bound_drape(target, layout, rod, anchor=anchor, near=start, joint=joint, progress=progress)
    if method == "gravity":
        return gravity_drape(target, layout, rod, anchor=anchor, gravity=gravity, joint=joint, progress=progress)
    from rodshell.formfinding.falling import falling_drape  # with the dynamics

    return falling_drape(target, layout, rod, anchor=anchor, gravity=gravity, joint=joint, fall=fall, progress=progress)


def _uses_all(method: Method, gravity: float | None, fall: Fall | None) -> None:
    """InputError where an argument is given that the method does not use."""
    if method == "bound" and gravity is not None:
        raise InputError(f'gravity = {gravity} m/s2: method "bound" has no gravity: leave it out, or use "gravity"')
    if method != "paper" and fall is not None:
        raise InputError(f'fall: nothing falls with method "{method}": leave it out, or use method "paper"')
