"""A popped-up shell with energies and supports of one's own."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from numpy.typing import ArrayLike

from rodshell.formfinding.popup import PopUp
from rodshell.formfinding.supports import at_rest, energies_of, slides_of
from rodshell.progress import Progress, require_progress, silent
from rodshell.rods.elements import Elements
from rodshell.solve.equilibrium import MOST_ITERATIONS
from rodshell.validation import instance


def settle(
    popped: PopUp,
    energies: Elements | Sequence[Elements] = (),
    *,
    free: Mapping[int, Sequence[ArrayLike]] | None = None,
    progress: Progress = silent,
) -> PopUp:
    """Let a popped-up shell come to rest with further energies, and with rod ends that may move.

    Args:
        popped: the shell, in equilibrium.
        energies: what acts on its nodes in addition to rods and joints: a `LocalEnergy`, or what has its methods.
        free: directions (up to three, at right angles) along which rod ends may move, by the number of the end in
            `footprint.points`: 2 i is the start of rod i, 2 i + 1 its end. A spring there is one of the energies.

    Returns:
        The shell in its new equilibrium; `report.stable` says whether it stays there.

    Raises:
        InputError: there is no such end; its directions are not at right angles; a clamped end is to move; an energy
            names a node that the shell has not.
    """
    instance("popped", popped, PopUp, "what rodshell.pop_up returned")
    require_progress(progress)
    added = energies_of(energies, popped.footprint.mesh.node_count)
    slides = slides_of(popped.support, {} if free is None else free, popped.support.turning(popped.boundary.points))
    shell, found = at_rest(
        replace(popped.shell, between=(*popped.shell.between, *added), slides={**popped.shell.slides, **slides}),
        popped.equilibrium,
        lambda k, step: progress("settle", f"iteration {k} of at most {MOST_ITERATIONS}", step),
    )
    return replace(popped, shell=shell, equilibrium=found, alone=())
