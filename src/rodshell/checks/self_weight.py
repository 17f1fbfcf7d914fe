"""How much of its own weight a popped-up shell carries, and how far it sinks under it: a check of every form.

The weight is that of the rods and joints, lumped at the nodes as in the motions, acting along -z. A shell carries a
load where the path of equilibria that begins at the unloaded shell is stable up to there. A linear buckling factor is
not enough: the unloaded shell is bent, and sinks before it buckles. Loads that are asked for, combinations and bracing
are in `rodshell.loads`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rodshell.arrays import Floats
from rodshell.formfinding.methods import STANDARD_GRAVITY
from rodshell.model import Shell
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.load_path import load_path

MOST = 100.0  # times its own weight: a shell that carries more is not loaded further

Limit = Literal["unstable unloaded", "limit point", "bifurcation", "none", "not followed", "no mass"]


@dataclass(frozen=True)
class SelfWeightCheck:
    """How much of its own weight a shell carries.

    Parameters
    ----------
    load_factor : on the weight, up to which the shell is stable; 0 if it is unstable unloaded; None where it is above
        `MOST`, or where no mass is known. At most 0.2 % below where stability is lost.
    deflection : largest displacement of a node under the whole weight [m]; None where the shell does not carry it.
    limit : why the factor is what it is. "limit point": the load cannot grow, the shell snaps through; "bifurcation":
        it gives way sideways; "none": it is stable up to `MOST`; "not followed": it is stable up to the factor, and
        nothing is known above; "no mass": the rods have none, so that nothing is known.
    """

    load_factor: float | None
    deflection: float | None
    limit: Limit
    factorizations: int = 0

    @property
    def at_least(self) -> float:
        """The factor as a number: infinite above `MOST`, 0 where nothing is known."""
        if self.load_factor is not None:
            return self.load_factor
        return np.inf if self.limit == "none" else 0.0


def self_weight(
    shell: Shell,
    found: Equilibrium,
    *,
    mass: Floats | None = None,
    gravity: float = STANDARD_GRAVITY,
    most: float = MOST,
    progress: Callable[[int, float], None] = lambda count, factor: None,
) -> SelfWeightCheck:
    """Load a shell with its own weight until it is no longer stable.

    Parameters
    ----------
    found : the equilibrium of the shell without loads, its ends held, with or without bracing.
    mass : (n,) of the nodes, with that of bracing [kg]; None: the shell's.
    gravity : [m/s2].
    most : largest factor that is looked for.
    progress : as of `load_path`.
    """
    if not shell.mass[shell.stretch.blocks, 2].all():  # joints may have some even then
        return SelfWeightCheck(None, None, "no mass")
    load = np.zeros_like(found.state)
    weighed = shell.mass[:, 2] if mass is None else mass
    load[: len(weighed), 2] = -gravity * weighed
    end = load_path(found, load, most=most, progress=progress)
    deflection, whole = None, end.at(1.0)
    if whole is not None:
        moved = shell.positions(whole.state) - shell.positions(found.state)
        deflection = float(np.linalg.norm(moved, axis=1).max())
    if end.limit == "none":
        return SelfWeightCheck(None, deflection, "none", end.factorizations)
    limit: Limit = "not followed" if end.limit == "lost" else end.limit
    return SelfWeightCheck(end.factor, deflection, limit, end.factorizations)


def weakest(parts: Sequence[SelfWeightCheck]) -> SelfWeightCheck:
    """Of patches that stand by themselves: the smallest factor; the largest deflection if all carry their weight."""
    least = min(parts, key=lambda part: part.at_least)
    sunk = [part.deflection for part in parts]
    deflection = None if None in sunk else max(depth for depth in sunk if depth is not None)
    return SelfWeightCheck(least.load_factor, deflection, least.limit, sum(part.factorizations for part in parts))
