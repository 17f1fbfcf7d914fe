"""What a colour means in a picture: the signed gap to the target, or the height where there is no target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gridshell.output.archive import GAPS, Archive
from gridshell.output.colours import HEIGHT, SIGNED, hex_colours
from gridshell.output.plan import nice_step, nice_ticks
from gridshell.output.svg import label, number, tag
from gridshell.output.wording import MINUS

Floats = NDArray[np.float64]

BINS = 33  # colours in use; odd, so that a gap of 0 has its own
FINEST = 1e-3  # mm; smaller gaps are drawn like none


@dataclass(frozen=True)
class Scale:
    """Colours of the nodes of a shell.

    Parameters
    ----------
    values : (n,) of the nodes [mm].
    low, high : values at both ends of the map [mm].
    colours : control points of the map.
    """

    values: Floats
    low: float
    high: float
    colours: tuple[str, ...]
    caption: str

    @property
    def bins(self) -> NDArray[np.intp]:
        """(n,) index in the palette of each node's colour."""
        share = np.nan_to_num((self.values - self.low) / (self.high - self.low), nan=0.5)
        return np.rint(np.clip(share, 0, 1) * (BINS - 1)).astype(np.intp)

    @property
    def palette(self) -> list[str]:
        return hex_colours(self.colours, np.linspace(0, 1, BINS))


def scale_of(archive: Archive, state: str) -> Scale:
    """The scale of a state in space; a gap is on one symmetric scale for all states, to compare them."""
    if GAPS[state] in archive.states:
        known = [archive.states[name] for name in GAPS.values() if name in archive.states]
        largest = max(float(np.nanmax(np.abs(gaps), initial=0.0)) for gaps in known)
        largest = max(1e3 * largest, FINEST)
        step = nice_step(largest, 4)
        limit = float(step * np.ceil(largest / step - 1e-9))
        caption = "gap to target in mm, + outside"
        return Scale(1e3 * archive.states[GAPS[state]], -limit, limit, SIGNED, caption)
    heights = 1e3 * archive.states[state][:, 2]
    low, high = float(heights.min()), float(heights.max())
    return Scale(heights, low, max(high, low + FINEST), HEIGHT, "height in mm")


def colour_bar(scale: Scale, right: float, y: float, ink: str, soft: str) -> str:
    """The map with its ticks [mm] and its caption, ending at x = `right`, ticks' baseline at `y`."""
    length = 200.0
    left, step, parts = right - length, length / BINS, []
    for k, colour in enumerate(scale.palette):
        box = {"x": left + k * step, "y": y - 22, "width": length - k * step, "height": 8.0}
        parts.append(tag("rect", **box, fill=colour))  # each up to the end: no seams
    for value in nice_ticks(scale.low, scale.high, 4):
        x = left + length * (value - scale.low) / (scale.high - scale.low)
        shown = number(value, 6).replace("-", MINUS)
        parts.append(label(shown, x, y, 12.5, text_anchor="middle", fill=soft))
    parts.append(label(scale.caption, left - 12, y - 13, 13, text_anchor="end", fill=ink))
    return "".join(parts)
