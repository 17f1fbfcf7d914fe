"""How much of its own weight a popped-up shell carries, and how far it sinks under it: a check of every form.

The weight is that of the rods and joints, lumped at the nodes as in the motions, acting along -z. A shell carries a
load where the path of equilibria that begins at the unloaded shell is stable up to there. A linear buckling factor is
not enough: the unloaded shell is bent, and sinks before it buckles. Loads that are asked for, combinations and bracing
are in `rodshell.loads`.
"""

from collections.abc import Callable

import numpy as np

from rodshell.arrays import Floats
from rodshell.figures.checks import SelfWeight
from rodshell.formfinding.methods import STANDARD_GRAVITY
from rodshell.model import Shell
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.load_path import Limit, load_path

MOST = 100.0  # times its own weight: a shell that carries more is not loaded further


def shown_limit(limit: Limit) -> str:
    """What ended a path, in words of result.json."""
    return "not followed" if limit == "lost" else limit


def self_weight(
    shell: Shell,
    found: Equilibrium,
    *,
    mass: Floats | None = None,
    gravity: float = STANDARD_GRAVITY,
    most: float = MOST,
    progress: Callable[[int, float], None] = lambda count, factor: None,
) -> SelfWeight:
    """Load a shell with its own weight until it is no longer stable.

    Args:
        found: the equilibrium of the shell without loads, its ends held, with or without bracing.
        mass: (n,) of the nodes, with that of bracing [kg]; None: the shell's.
        gravity: [m/s2].
        most: largest factor that is looked for.
        progress: as of `load_path`.
    """
    if not shell.mass[shell.stretch.blocks, 2].all():  # joints may have some even then
        return SelfWeight(load_factor=None, deflection=None, limit="no mass")
    load = np.zeros_like(found.state)
    weighed = shell.mass[:, 2] if mass is None else mass
    load[: len(weighed), 2] = -gravity * weighed
    end = load_path(found, load, most=most, progress=progress)
    deflection, whole = None, end.at(1.0)
    if whole is not None:
        moved = shell.positions(whole.state) - shell.positions(found.state)
        deflection = float(np.linalg.norm(moved, axis=1).max())
    return SelfWeight(
        load_factor=None if end.limit == "none" else end.factor, deflection=deflection, limit=shown_limit(end.limit),
        factorizations=end.factorizations,
    )  # fmt: skip
