"""Drape: lay the flat grid on the target."""

from collections.abc import Sequence
from math import isfinite
from numbers import Real
from typing import Literal

import numpy as np

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
from rodshell.units import shown

Method = Literal["bound", "gravity", "paper"]


def require(name: str, value: object, kind: type, wanted: str = "") -> None:
    """Refuse an argument of another kind, with one sentence in place of what it would break later.

    Raises
    ------
    InputError : it says what the argument is, and what it must be: `wanted`, by default a `kind`.
    """
    if not isinstance(value, kind):
        made = type(value).__name__
        what = shown(value) if isinstance(value, str | int | float) else f"a{'n' * (made[0] in 'AEIOU')} {made}"
        raise InputError(f"{name} must be {wanted or f'a rodshell {kind.__name__}'}, not {what}")


def _require_point(name: str, value: object) -> None:
    pair = value if isinstance(value, Sequence | np.ndarray) and not isinstance(value, str) else ()
    if len(pair) != 2 or not all(isinstance(one, Real) and isfinite(one) for one in pair):
        raise InputError(f"{name} must be two finite numbers x, y in m, not {value!r}")


def drape(
    layout: GridLayout,
    rod: Rod,
    target: Target,
    *,
    method: Method = "bound",
    anchor: tuple[float, float] | None = None,
    gravity: float = 9.81,
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
    gravity : acceleration [m/s2], for methods "gravity" and "paper".
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
        require(name, value, kind)
    if start is not None:
        require("start", start, Draped, "what an earlier rodshell.drape returned")
    if anchor is not None:
        _require_point("anchor", anchor)
    if method == "bound":
        return bound_drape(target, layout, rod, anchor=anchor, near=start, joint=joint, progress=progress)
    if method == "gravity":
        return gravity_drape(target, layout, rod, anchor=anchor, gravity=gravity, joint=joint, progress=progress)
    if method == "paper":
        from rodshell.formfinding.falling import falling_drape  # with the dynamics

        return falling_drape(
            target, layout, rod, anchor=anchor, gravity=gravity, joint=joint, fall=fall, progress=progress
        )
    raise InputError(f'drape method must be "bound", "gravity" or "paper", not {method!r}')
