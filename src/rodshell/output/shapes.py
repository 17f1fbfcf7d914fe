"""The shapes that an archive holds: flat, the stages of the way up, draped, popped."""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import OutputError
from rodshell.output.archive import GAPS, SHELLS, Archive

CAPTIONS = {
    "flat": "Flat, as cut and laid out",
    "draped": "Draped on the target",
    "popped_pinned": "PopUp up, pinned ends (free to turn)",
    "popped_clamped": "PopUp up, clamped ends (directions held)",
}
STAGE = "stage_"


@dataclass(frozen=True)
class Shape:
    """One shape of the grid.

    Parameters
    ----------
    name : "flat", "draped", "popped_pinned", "popped_clamped", or "stage_1", ... of the way up.
    positions : (n, 3) [m].
    gap : (n,) signed distances to the target [m], where known.
    stress : (k,) [Pa] and curvature : (k,) [1/m] at each entry of `rod_nodes`, where known.
    """

    name: str
    caption: str
    positions: Floats
    gap: Floats | None = None
    stress: Floats | None = None
    curvature: Floats | None = None

    @property
    def flat(self) -> bool:
        return self.name == "flat"


def shape_names(archive: Archive) -> list[str]:
    """All shapes, in the order in which they come about."""
    stages = [f"{STAGE}{k}" for k in range(1, len(archive.states.get("history_share", ())) - 1)]
    states = archive.states
    return [name for name in ("flat", *stages, *SHELLS) if name.startswith(STAGE) or name in states]


def shape_of(archive: Archive, name: str) -> Shape:
    """A shape by its name.

    Raises
    ------
    OutputError : the archive has no such shape.
    """
    known, states = shape_names(archive), archive.states
    if name not in known:
        raise OutputError(f"no state {name!r} in this result: it has {', '.join(known) or 'none'}")
    if name.startswith(STAGE):
        k = int(name.removeprefix(STAGE))
        caption = f"On the way up: ends {100 * states['history_share'][k]:.0f} % of the way"
        stress, curvature = (states[f"history_{what}"][k] if f"history_{what}" in states else None for what in WHAT)
        return Shape(name, caption, np.asarray(states["history"][k], dtype=float), None, stress, curvature)
    ends = name.removeprefix("popped_")
    stress, curvature = (states.get(f"{what}_{ends}") for what in WHAT)
    gap = states.get(GAPS.get(name, ""))
    return Shape(name, CAPTIONS[name], np.asarray(states[name], dtype=float), gap, stress, curvature)


WHAT = ("stress", "curvature")
