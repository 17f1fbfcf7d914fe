"""What a colour means in a picture: the gap to the target, the stress, or the height where there is no target."""

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gridshell.output.archive import GAPS, Archive
from gridshell.output.colours import HEIGHT, SIGNED, STRESS, hex_colours
from gridshell.output.drawing import Pen, Pencil
from gridshell.output.plan import nice_step, nice_ticks
from gridshell.output.shapes import Shape
from gridshell.output.svg import number
from gridshell.output.wording import MINUS, PRESSURES

Floats = NDArray[np.float64]
Colour = Literal["gap", "stress"]

BINS = 33  # colours in use; odd, so that a gap of 0 has its own
FINEST = 1e-3  # mm; smaller gaps are drawn like none


@dataclass(frozen=True)
class Scale:
    """Colours of a shell.

    Parameters
    ----------
    values : (k,) at each entry of `rod_nodes`.
    low, high : values at both ends of the map.
    colours : control points of the map.
    """

    values: Floats
    low: float
    high: float
    colours: tuple[str, ...]
    caption: str

    @property
    def bins(self) -> NDArray[np.intp]:
        """(k,) index in the palette of each value's colour."""
        share = np.nan_to_num((self.values - self.low) / (self.high - self.low), nan=0.5)
        return np.rint(np.clip(share, 0, 1) * (BINS - 1)).astype(np.intp)

    @property
    def palette(self) -> list[str]:
        return hex_colours(self.colours, np.linspace(0, 1, BINS))


def scale_of(archive: Archive, shape: Shape, colour: Colour) -> Scale | None:
    """The scale of a shape, one for all shapes, to compare them; None where nothing is known to colour it by."""
    nodes = archive.states["rod_nodes"]
    if colour == "stress":
        return None if shape.stress is None else _stress_scale(archive, shape.stress)
    if shape.gap is not None:
        known = [archive.states[name] for name in GAPS.values() if name in archive.states]
        largest = max(float(np.nanmax(np.abs(gaps), initial=0.0)) for gaps in known)
        largest = max(1e3 * largest, FINEST)
        step = nice_step(largest, 4)
        limit = float(step * np.ceil(largest / step - 1e-9))
        return Scale(1e3 * shape.gap[nodes], -limit, limit, SIGNED, "gap to target in mm, + outside")
    if shape.flat or archive.result.get("target"):
        return None
    heights = 1e3 * shape.positions[nodes, 2]
    low, high = float(heights.min()), float(heights.max())
    return Scale(heights, low, max(high, low + FINEST), HEIGHT, "height in mm")


def _stress_scale(archive: Archive, stress: Floats) -> Scale:
    """Utilisation where the strength is known, else the stress in a unit of its size."""
    strength = (archive.result.get("bending") or {}).get("strength")
    known = [values for name, values in archive.states.items() if "stress" in name]
    top = max(float(np.max(values)) for values in known)
    if strength:
        unit, caption = strength / 100, "utilisation in %"
    else:
        unit, name = next((one for one in PRESSURES if top >= one[0]), PRESSURES[-1])
        caption = f"stress in {name}"
    high = max(top / unit, FINEST)
    step = nice_step(high, 4)
    return Scale(stress / unit, 0.0, float(step * np.ceil(high / step - 1e-9)), STRESS, caption)


def colour_bar(pencil: Pencil, scale: Scale, right: float, y: float) -> None:
    """The map with its ticks and its caption, ending at x = `right`, ticks' baseline at `y`."""
    length = 200.0
    left, step = right - length, length / BINS
    for k, colour in enumerate(scale.palette):  # each under the next: no seams
        x, stop = left + k * step, min(left + (k + 2) * step, right)
        corners = [(x, y + 14), (stop, y + 14), (stop, y + 22), (x, y + 22)]
        pencil.line(corners, "TITLE", closed=True, pen=Pen(colour, 0.0, fill=colour))
    for value in nice_ticks(scale.low, scale.high, 4):
        x = left + length * (value - scale.low) / (scale.high - scale.low)
        shown = number(value, 6).replace("-", MINUS)
        pencil.write(shown, (x, y), 12.5, "DIM", anchor="middle")
    pencil.write(scale.caption, (left - 12, y + 13), 13.0, "TITLE", anchor="end")
