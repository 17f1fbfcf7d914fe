"""Imperfect structures: an equilibrium displaced in the shape of given modes, so that a path can begin there.

A structure is never built as it was computed. The deviation that an engineer assumes, say span/500 in the shape of the
lowest modes, is one of the structure as it stands under its permanent load. A bending-active structure has no geometry
free of stress that could be displaced: its shape is the equilibrium of bent rods. So the displaced shape is held by
misfit forces p = K d, with K the tangent stiffness and d the deviation, which stay as the load grows. To first order
that is a deviation free of stress: K (x - x0 - d) + t Ks (x - x0) = t W under t times a load W, and both amplify a
buckling mode by 1 / (1 - t / tc). Equivalent forces are what design codes allow in place of a geometric imperfection
[EN 1993-1-1, 5.3.2(7)]. The bending moments of p, of the order of EI times the curvature of d, are in the structure
from the start, and are on the safe side.
"""

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import ConvergenceError, InputError
from rodshell.solve.arc_length import ArcLength
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.load import Load


def imperfect(equilibrium: Equilibrium, modes: Floats, amplitude: float) -> Equilibrium:
    """The equilibrium displaced by an amplitude in the shape of modes, held there by misfit forces.

    The path of the imperfect structure is `load_path` from here. Both signs of the amplitude count: a structure may be
    sensitive to one alone.

    Args:
        equilibrium: a stable one, under the permanent load.
        modes: (n, 3) a mode, or (k, n, 3) several, which are added with equal largest displacements [m, rad].
        amplitude: displacement of the node that moves farthest [m]; negative: to the other side.

    Returns:
        With the misfit forces among its load; the displacement along the shape is the amplitude, and the nodes are
        where that leaves the structure in equilibrium: inextensible rods also move by its square.

    Raises:
        InputError: the modes have another shape, or do not move.
        ConvergenceError: there is no equilibrium so far off.
    """
    state, shapes = equilibrium.state, np.asarray(modes, dtype=float)
    if shapes.shape[-2:] != state.shape or shapes.ndim not in (2, 3) or not np.isfinite(shapes).all():
        raise InputError(f"the modes have the shape {shapes.shape}: give {state.shape} or (k, {state.shape[0]}, 3)")
    nodes = np.unique(equilibrium.problem.stretch.blocks)

    def farthest(motion: Floats) -> float:
        return float(np.linalg.norm(motion[nodes], axis=1).max())

    each = shapes.reshape(-1, *state.shape)
    if not all(farthest(shape) > 0 for shape in each):
        raise InputError("a mode of the imperfection moves no node: give modes that do")
    shape = np.sum([mode / farthest(mode) for mode in each], axis=0)
    if farthest(shape) < 1e-9:
        raise InputError("the modes of the imperfection cancel each other: give them with other signs")
    deviation = amplitude / farthest(shape) * shape
    if amplitude == 0:
        return equilibrium
    found = ArcLength(equilibrium, Load(forces=equilibrium.tangent.product(deviation)))
    point = found.displaced(deviation)
    if point is None:
        raise ConvergenceError(
            f"no equilibrium was found with an imperfection of {amplitude:.4g} m: give a smaller one, or other modes"
        )
    return found.equilibrium(point)
