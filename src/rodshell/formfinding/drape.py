"""Drape: lay the flat grid on the target, by one of three methods."""

from collections.abc import Sequence
from math import degrees, pi

from rodshell.errors import InputError
from rodshell.formfinding.bound_drape import bound_drape
from rodshell.formfinding.fall_drape import fall_drape
from rodshell.formfinding.gravity_drape import gravity_drape
from rodshell.formfinding.laid import lay
from rodshell.formfinding.methods import Bound, Draped, Gravity, Method, require_method
from rodshell.joints import Joint, require_joint
from rodshell.layout import Layout, SurfaceLattice
from rodshell.progress import Progress, require_progress, silent
from rodshell.rods.section import Rod
from rodshell.targets import Target
from rodshell.validation import instance, point


def drape(
    layout: Layout,
    rod: Rod,
    target: Target,
    *,
    method: Method = Bound(),
    anchor: tuple[float, float] | None = None,
    joint: Joint | None = None,
    warm_start: Draped | None = None,
    progress: Progress = silent,
) -> Draped:
    """Lay a flat grid of rods on a target.

    Args:
        rod: section and material of every rod.
        target: the surface, and where it ends.
        method: `Bound()` marches the inextensible net and binds the grid to it; `Gravity()` lets the rods hang on the
            target (static equilibrium, frictionless unilateral contact), from flat; `Fall()` lets them fall on it in
            time, as the paper does.
        anchor: x, y of the point of the target under the layout's middle [m]; default: the target's highest point.
        joint: the connection of rods where they cross; ball joints by default. `Bound()`, whose net is purely
            geometric, uses its eccentricity, which places the rods in two layers, and whether it holds the rods against
            rolling.
        warm_start: a grid draped before. `Bound()` starts its net from the earlier one, which saves time and gives the
            same result. The others always start from flat: without friction a grid that starts from an earlier result
            may turn and come to rest elsewhere.
        progress: called as progress(stage, detail, residual) at every iteration.

    Raises:
        InputError: a value is of the wrong kind, or the layout does not fit the target or the method.
        NetLimitError: no net covers the target from this anchor and heading.
        StabilityError: the fall's time step is beyond the stability limit of explicit ties.
    """
    require_progress(progress)
    for name, value, kind in (("layout", layout, Layout), ("rod", rod, Rod), ("target", target, Target)):
        instance(name, value, kind)
    require_method(method)
    require_joint(joint)
    if isinstance(joint, Sequence):
        raise InputError("joint must be one rodshell joint for all crossings of a drape, not a sequence of joints")
    if warm_start is not None:
        instance("warm_start", warm_start, Draped, "what an earlier rodshell.drape returned")
    if anchor is not None:
        point("anchor", anchor)
    if isinstance(layout, SurfaceLattice):
        if not isinstance(method, Bound):
            raise InputError(
                f'a lattice "{layout.kind}" follows curves of the target: bind it there (method = bound), or let a '
                "lattice of straight rods hang or fall"
            )
        return lay(target, layout, rod, anchor=anchor, joint=joint, progress=progress)
    if layout.crossing != pi / 2 and not isinstance(method, Bound):
        raise InputError(
            f"layout crossing {degrees(layout.crossing):.4g} degrees: a grid that hangs or falls on its target finds "
            "its angles itself: leave it out, or bind the grid to the target (method = bound)"
        )
    layout = layout.with_edges(method.edges_a_span)
    if isinstance(method, Bound):
        return bound_drape(target, layout, rod, anchor=anchor, warm_start=warm_start, joint=joint, progress=progress)
    if isinstance(method, Gravity):
        return gravity_drape(target, layout, rod, method, anchor=anchor, joint=joint, progress=progress)
    return fall_drape(target, layout, rod, method, anchor=anchor, joint=joint, progress=progress)
