"""How much of its own weight a popped-up shell carries, and how much snow on top: a check of every form.

The weight is that of the rods and joints, lumped at the nodes as in the motions, acting along -z. A shell carries a
load where the path of equilibria that begins at the unloaded shell is stable up to there. A linear buckling factor is
not enough: the unloaded shell is bent, and sinks before it buckles. Snow grows on the shell under its whole weight, on
the plan that belongs to each node. Loads that are asked for, combinations and bracing are in `rodshell.loads`.
"""

from collections.abc import Callable

import numpy as np

from rodshell.arrays import Floats
from rodshell.figures.checks import SelfWeight
from rodshell.formfinding.methods import STANDARD_GRAVITY
from rodshell.model import Shell
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.load_path import Limit, load_path
from rodshell.solve.modes import linear_buckling

MOST = 100.0  # times its own weight: a shell that carries more is not loaded further
SNOW, MOST_SNOW = 1e3, 10.0  # [Pa]; times that


def shown_limit(limit: Limit) -> str:
    """What ended a path, in words of result.json."""
    return "not followed" if limit == "lost" else limit


def self_weight(
    shell: Shell, found: Equilibrium, *, mass: Floats | None = None, gravity: float = STANDARD_GRAVITY,
    most: float = MOST, progress: Callable[[int, float], None] = lambda count, factor: None,
) -> tuple[SelfWeight, Equilibrium | None]:  # fmt: skip
    """Load a shell with its own weight until it is no longer stable; also its equilibrium under the whole weight, None
    where it does not carry it.

    Args:
        found: the equilibrium of the shell without loads, its ends held, with or without bracing.
        mass: (n,) of the nodes, with that of bracing [kg]; None: the shell's.
        gravity: [m/s2].
        most: largest factor that is looked for.
        progress: as of `load_path`.
    """
    if not shell.mass[shell.stretch.blocks, 2].all():  # joints may have some even then
        return SelfWeight(load_factor=None, deflection=None, limit="no mass"), None
    load, mass = np.zeros_like(found.state), shell.mass[:, 2] if mass is None else mass
    load[: len(mass), 2] = -gravity * mass
    end = load_path(found, load, most=most, progress=progress)
    deflection, whole = None, end.at(1.0)
    if whole is not None:
        moved = shell.positions(whole.state) - shell.positions(found.state)
        deflection = float(np.linalg.norm(moved, axis=1).max())
    found_weight = SelfWeight(
        load_factor=None if end.limit == "none" else end.factor, deflection=deflection, limit=shown_limit(end.limit),
        factorizations=end.factorizations,
    )  # fmt: skip
    return found_weight, whole


def linear_factor(shell: Shell, found: Equilibrium, *, most: float = MOST) -> float:
    """Times its own weight at which a shell buckles linearly, from its stable equilibrium without loads; infinite:
    above `most`."""
    weight = np.zeros_like(found.state)
    weight[: len(shell.mass), 2] = -STANDARD_GRAVITY * shell.mass[:, 2]
    return float(np.min(linear_buckling(found, weight, 1, most=most).factors, initial=np.inf))


def snow_carried(under_weight: Equilibrium, plan: Floats, progress: Callable[[int, float], None]) -> float | None:
    """Uniform snow on the plan up to which a shell under its whole weight is stable, or is known to be [Pa]; None: more
    than is looked for.

    Args:
        plan: (n,) of the plan that each node takes [m2].
        progress: as of `load_path`.
    """
    load = np.zeros_like(under_weight.state)
    load[: len(plan), 2] = -SNOW * plan
    end = load_path(under_weight, load, most=MOST_SNOW, stations=(), progress=progress)
    return None if end.limit == "none" else SNOW * end.factor
