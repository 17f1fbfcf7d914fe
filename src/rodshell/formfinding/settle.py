"""A popped-up shell with energies and supports of one's own."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TypeGuard

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.formfinding.popup import PopUp
from rodshell.progress import Progress, require_progress, silent
from rodshell.rods.elements import Elements
from rodshell.solve.equilibrium import MOST_ITERATIONS, find_stable
from rodshell.solve.problem import Supports
from rodshell.validation import described, direction, instance, listed, mapping, some, whole

ENERGY = "an energy, such as rodshell.LocalEnergy, or a list of them"


def settle(
    popped: PopUp,
    energies: Elements | Sequence[Elements] = (),
    *,
    free: Mapping[int, Sequence[ArrayLike]] | None = None,
    progress: Progress = silent,
) -> PopUp:
    """Let a popped-up shell come to rest with further energies, and with rod ends that may move.

    Parameters
    ----------
    popped : the shell, in equilibrium.
    energies : what acts on its nodes in addition to rods and joints: a `LocalEnergy`, or what has its methods.
    free : directions (up to three, at right angles) along which rod ends may move, by the number of the end in
        `footprint.points`: 2 i is the start of rod i, 2 i + 1 its end. A spring there is one of the energies.

    Returns
    -------
    The shell in its new equilibrium; `report.stable` says whether it stays there.

    Raises
    ------
    InputError : there is no such end; its directions are not at right angles; a clamped end is to move; an energy names
        a node that the shell has not.
    """
    instance("popped", popped, PopUp, "what rodshell.pop_up returned")
    require_progress(progress)
    nodes = popped.footprint.mesh.node_count
    added = (energies,) if _is_energy(energies) else listed("energies", energies, ENERGY)
    for energy in added:
        if not _is_energy(energy):
            raise InputError(f"energies must be {ENERGY}, not {described(energy)}")
        if (energy.blocks >= nodes).any():
            raise InputError(f"an energy acts on node {energy.blocks.max()}: the shell has {nodes}, from 0")
    shell = replace(popped.shell, between=(*popped.shell.between, *added))
    held = shell.held_ends()
    for end, directions in mapping(
        "free", {} if free is None else free, "directions by the number of the rod end"
    ).items():
        block = shell.ends[whole("a rod end in free", end, 0, len(shell.ends) - 1)]
        if popped.ends == "clamped":
            raise InputError("a clamped rod end cannot be set free: pop the shell up with pinned ends")
        held = held.with_directions(np.array([block]), *_directions(end, directions))
    problem = replace(popped.equilibrium.problem, elements=shell.elements, constraint=Supports(held))
    found = find_stable(
        problem, popped.state, popped.forces, limit_steps=True,
        progress=lambda k, step: progress("settle", f"iteration {k} of at most {MOST_ITERATIONS}", step),
    )  # fmt: skip
    return replace(popped, shell=shell.with_elements(found.elements), equilibrium=found, alone=())


def _is_energy(given: object) -> TypeGuard[Elements]:
    return all(hasattr(given, name) for name in ("blocks", "evaluate", "refreshed"))


def _directions(end: int, directions: Sequence[ArrayLike]) -> list[tuple[float, float, float]]:
    name = f"a direction of rod end {end}"
    given = np.array([direction(name, each) for each in some(f"free of rod end {end}", directions, "directions")])
    across: Floats = given @ given.T - np.eye(len(given))
    if len(given) > 3 or np.abs(across).max(initial=0.0) > 1e-9:
        raise InputError(f"the directions along which rod end {end} may move are not at right angles to each other")
    return [(x, y, z) for x, y, z in given.tolist()]
