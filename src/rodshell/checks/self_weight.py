"""How much of its own weight a popped-up shell carries, and how far it sinks under it.

The weight is that of the rods and joints, lumped at the nodes as in the motions, acting along -z. A shell carries a
load where the path of equilibria that begins at the unloaded shell is stable up to there. A linear buckling factor
would not do: the unloaded shell is bent, and sinks before it buckles.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rodshell.formfinding.popup import Ends
from rodshell.model import Shell
from rodshell.solve.critical import first_critical
from rodshell.solve.equilibrium import Equilibrium

GRAVITY = 9.81  # [m/s2]
MOST = 100.0  # times its own weight: what bears more is not loaded further

Limit = Literal["unstable unloaded", "limit point", "bifurcation", "none", "not followed", "no mass"]


@dataclass(frozen=True)
class SelfWeight:
    """How much of its own weight a shell carries.

    Parameters
    ----------
    load_factor : on the weight, up to which the shell is stable; 0 if it is unstable unloaded; None where it is above
        `MOST`, or where no mass is known. At most 0.2 % below where stability is lost.
    deflection : largest displacement of a node under the whole weight [m]; None where the shell does not carry it.
    limit : why the factor is what it is. "limit point": the load cannot grow, the shell snaps through; "bifurcation":
        it gives way sideways; "none": it is stable up to `MOST`; "not followed": it is stable up to the factor, and
        nothing is known above; "no mass": the rods have none, so that nothing is known.
    factorizations : what it took.
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
    gravity: float = GRAVITY,
    most: float = MOST,
    progress: Callable[[int, float], None] = lambda count, factor: None,
) -> SelfWeight:
    """Load a shell with its own weight until it is no longer stable.

    Parameters
    ----------
    found : the equilibrium of the shell without loads, its ends held.
    gravity : [m/s2].
    most : largest factor that is looked for.
    progress : as of `first_critical`.
    """
    if not shell.mass[np.unique(shell.stretch.blocks), 2].all():  # joints may have some even then
        return SelfWeight(None, None, "no mass")
    load = np.zeros_like(found.state)
    load[:, 2] = -gravity * shell.mass[:, 2]
    end = first_critical(found, load, most=most, progress=progress)
    deflection = None
    if end.state is not None:
        moved = shell.positions(end.state) - shell.positions(found.state)
        deflection = float(np.linalg.norm(moved, axis=1).max())
    if end.limit == "none":
        return SelfWeight(None, deflection, "none", end.factorizations)
    limit: Limit = "not followed" if end.limit == "lost" else end.limit
    return SelfWeight(end.factor, deflection, limit, end.factorizations)


def unknown_weights(found: Mapping[Ends, SelfWeight]) -> tuple[str, ...]:
    """Sentences on what is not known.

    Parameters
    ----------
    found : by end condition.
    """
    if any(weight.limit == "no mass" for weight in found.values()):
        return (
            "no mass was given, so that it is not known what share of its own weight the shell bears: "
            "give rod.section.mass",
        )
    return tuple(
        f"with {ends} ends the shell bears at least {_share(weight.load_factor or 0.0)} its own weight; above, its "
        "path could not be followed, and nothing is known"
        for ends, weight in found.items()
        if weight.limit == "not followed"
    )


def weakest(parts: Sequence[SelfWeight]) -> SelfWeight:
    """Of patches that stand by themselves: the smallest factor, and the largest deflection if all carry their weight.

    Parameters
    ----------
    parts : of each patch.
    """
    least = min(parts, key=lambda part: part.at_least)
    sunk = [part.deflection for part in parts]
    deflection = None if None in sunk else max(depth for depth in sunk if depth is not None)
    return SelfWeight(least.load_factor, deflection, least.limit, sum(part.factorizations for part in parts))


def _share(factor: float) -> str:
    return f"{100 * factor:.2g} % of" if factor < 1 else f"{factor:.3g} times"
