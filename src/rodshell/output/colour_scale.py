"""Colours that stand for numbers: of rods in a picture (gap, stress, height), and of the trials of a search."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from math import degrees, inf
from typing import TYPE_CHECKING, Literal

import numpy as np

from rodshell.arrays import Floats, Ints, largest_at
from rodshell.output.drawing import Pen, Pencil
from rodshell.output.grid import Shape, shape_of
from rodshell.output.svg import document, label, number, tag
from rodshell.results.archive import Archive, made_once
from rodshell.results.judged.stress import by_code
from rodshell.results.states import is_shell, shells_among
from rodshell.results.wording import MINUS, nice_step, nice_ticks
from rodshell.units import PRESSURES

if TYPE_CHECKING:
    from rodshell.formfinding.search import Trial

Colour = Literal["gap", "stress", "curvature", "force"]

# Maps of even steps in lightness, by a few control points.
# Signed: dark in the middle, so that rods without a gap are drawn in ink on light paper.
SIGNED = ("#39b5e6", "#2f86b4", "#2f5a7a", "#333b46", "#7c4a35", "#bf6434", "#f28c3a")
STRESS = ("#2b3a55", "#3f6f8f", "#6fa287", "#c9b458", "#dd8a3a", "#b3372c")
HEIGHT = ("#352a6b", "#33508a", "#24768e", "#26988a", "#4cb873", "#9bc94f")
BINS = 33  # colours in use; odd, so that a gap of 0 has its own
ABOVE = "#e0007a"  # of utilisations above 100 %
STAGES = "history_stress"
FINEST = 1e-3  # mm; smaller gaps are drawn like none


@dataclass(frozen=True, eq=False)
class Scale:
    """What colours a shell's rods.

    Args:
        values: (k,) at each entry of `rod_nodes`, in the unit that the caption names.
        low, high: values at both ends of the map.
        colours: control points of the map, evenly spaced, "#rrggbb".
        caption: what the values are, with their unit.
        above: colour "#rrggbb" of values above `high`, the last of the palette; "": there are none.
    """

    values: Floats
    low: float
    high: float
    colours: tuple[str, ...]
    caption: str
    above: str = ""

    @property
    def bins(self) -> Ints:
        """(k,) index in the palette of each value's colour."""
        share = np.nan_to_num((self.values - self.low) / (self.high - self.low), nan=0.5)
        last = BINS - 1 - bool(self.above)
        found = np.rint(np.clip(share, 0, 1) * last).astype(np.intp)
        return np.where(share > 1, BINS - 1, found)

    @property
    def palette(self) -> list[str]:
        """Colours "#rrggbb" of all bins."""
        if self.above:
            return [*hex_colours(self.colours, np.linspace(0, 1, BINS - 1)), self.above]
        return hex_colours(self.colours, np.linspace(0, 1, BINS))


def scale_of(archive: Archive, shape: Shape, colour: Colour) -> Scale | None:
    """The scale of a shape, the same for all shapes of an archive; None where its rods have the colours of families.

    Args:
        colour: "stress"; "curvature"; "force", along the rods; or "gap": signed distance to the target, or height where
            there is no target.
    """
    nodes = archive.states["rod_nodes"]
    if colour != "gap":
        return _SCALES[colour](archive, shape, shape.known[colour]) if colour in shape.known else None
    if shape.gap is not None:
        return gap_scale(shape.gap[nodes], _largest_of_all_gaps(archive))
    if shape.flat or archive.results.target:
        return None
    heights = 1e3 * shape.positions[nodes, 2]  # mm, as at the axes of the picture
    low, high = float(heights.min()), float(heights.max())
    return Scale(heights, low, max(high, low + FINEST), HEIGHT, "height in mm")


def gap_scale(gaps: Floats, largest: float) -> Scale:
    """The scale of signed distances to the target (k,) [m], `largest` [mm] of all shapes that have the scale."""
    factor, unit = (1e3, "m") if largest >= 1e3 else (1.0, "mm")
    return _scale(1e3 / factor * gaps, max(largest, FINEST) / factor, SIGNED, f"gap to target in {unit}, + outside")


def largest_gap(archive: Archive, shape: Shape) -> tuple[float, Floats]:
    """The largest gap [mm], signed, and its place (3,) [m], from the agreement, which looks between nodes too."""
    assert shape.gap is not None
    points, gaps = shape.positions, 1e3 * np.nan_to_num(shape.gap)
    worst = largest_at(np.abs(gaps))
    found = next((gap for ends, gap in archive.results.agreement.items() if shape.name == f"popped_{ends}"), None)
    if found is None or found.where is None or found.max is None:
        return float(gaps[worst]), points[worst]
    place = np.array(found.where, dtype=float)
    nearest = int(np.argmin(np.linalg.norm(points - place, axis=1)))
    return float(np.copysign(1e3 * found.max, gaps[nearest])), place


@made_once
def _largest_of_all_gaps(archive: Archive) -> float:
    """The largest gap [mm], without its sign, of all shapes that have one."""
    shapes = [shape_of(archive, name) for name in shells_among(archive.states)]
    return max((abs(largest_gap(archive, shape)[0]) for shape in shapes if shape.gap is not None), default=0.0)


def _of_all_shapes(archive: Archive, what: str) -> Iterator[tuple[str, Floats]]:
    """The arrays of stress, curvature or force in the shapes on all supports, and in the stages of the deployment."""
    for name, values in archive.states.items():
        if name.startswith(f"{what}_") or name == f"history_{what}":
            yield name, values


def _stress_scale(archive: Archive, shape: Shape, stress: Floats) -> Scale:
    """Utilisation where the strength is known and the stress alone decides, else the stress in a unit of its size."""
    bending, final = archive.results.bending, is_shell(shape.name)
    strength = bending.strength if bending and not by_code(archive.results) else None
    erection = (bending.erection_strength if bending else None) or strength
    known = [(name, float(np.max(values))) for name, values in _of_all_shapes(archive, "stress")]
    if strength and erection:
        unit, caption, full = (strength if final else erection) / 100, "utilisation in %", 100.0
        if strength != erection:
            caption += ", permanent" if final else ", erection"
        top = max(100 * largest / (erection if name == STAGES else strength) for name, largest in known)
    else:
        top, full = max(largest for _, largest in known), inf
        unit, name = next((entry for entry in PRESSURES if top >= entry[0]), PRESSURES[-1])
        caption, top = f"stress in {name}", top / unit
    values = stress / unit
    caption += f", here up to {float(np.max(values)):.3g}"
    if top > full:
        return replace(_scale(values, full, STRESS, f"{caption}, above {full:.0f} in magenta"), above=ABOVE)
    return _scale(values, max(top, FINEST), STRESS, caption)


def _curvature_scale(archive: Archive, _: Shape, curvature: Floats) -> Scale:
    top = max(float(np.max(values)) for _, values in _of_all_shapes(archive, "curvature"))
    caption = f"curvature in 1/m, here up to {float(np.max(curvature)):.3g}"
    return _scale(np.asarray(curvature, dtype=float), max(top, FINEST), STRESS, caption)


def _force_scale(archive: Archive, _: Shape, force: Floats) -> Scale:
    """Normal forces; signed as gaps are, so that rods without a force are drawn in ink."""
    top = max(float(np.abs(values).max()) for _, values in _of_all_shapes(archive, "force"))
    unit, name = (1e3, "kN") if top >= 1e3 else (1.0, "N") if top >= 1.0 else (1e-3, "mN")
    return _scale(force / unit, max(top / unit, FINEST), SIGNED, f"normal force in {name}, + tension")


_SCALES = {"stress": _stress_scale, "curvature": _curvature_scale, "force": _force_scale}


def _scale(values: Floats, largest: float, colours: tuple[str, ...], caption: str) -> Scale:
    """From 0 to the largest value, rounded up to a whole number of ticks; of a signed map from its opposite."""
    step = nice_step(largest, 4)
    limit = float(step * np.ceil(largest / step - 1e-9))
    return Scale(values, -limit if colours is SIGNED else 0.0, limit, colours, caption)


def colour_bar(pencil: Pencil, scale: Scale, right: float, y: float) -> None:
    """Draw the map with ticks and caption; it ends at x = `right`, the baseline of its numbers is y [drawing units]."""
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


def hex_colours(points: tuple[str, ...], shares: Floats) -> list[str]:
    """Colours "#rrggbb" at shares (k,) of a map of evenly spaced control points: from 0, the first, to 1, the last."""
    table = np.array([[int(point[i : i + 2], 16) for i in (1, 3, 5)] for point in points], dtype=float)
    at = np.linspace(0.0, 1.0, len(points))
    channels = [np.interp(shares, at, table[:, k]) for k in range(3)]
    return [f"#{r:02x}{g:02x}{b:02x}" for r, g, b in np.rint(channels).astype(int).T.tolist()]


@lru_cache(maxsize=4096)
def mixed(colour: str, other: str, share: float) -> str:
    """A mixture of two colours "#rrggbb" with a share of the other, 0 to 1."""
    return hex_colours((colour, other), np.array([share]))[0]


CELL, ROW, LEFT, TOP = 84, 30, 190, 64
NONE = "#f4f4f4"  # of a cell whose trial failed


def search_svg(title: str, trials: "Sequence[Trial]", best: "Trial") -> str:
    """Values in cells, dark the smallest; what failed stays empty; the best has a frame."""
    anchors = list(dict.fromkeys(trial.anchor for trial in trials))
    headings = list(dict.fromkeys(trial.heading for trial in trials))
    values = np.array([trial.value for trial in trials])
    low, high = values[np.isfinite(values)].min(), values[np.isfinite(values)].max()
    shares = np.clip((values - low) / (high - low if high > low else 1.0), 0.0, 1.0)
    colours = hex_colours(HEIGHT, np.where(np.isfinite(values), shares, 1.0))
    width, height = LEFT + CELL * len(headings) + 20, TOP + ROW * len(anchors) + 20
    parts = [tag("rect", width=width, height=height, fill="white"), label(title, 20, 24, 13, font_weight="bold")]
    for k, heading in enumerate(headings):
        words = f"{degrees(heading):.0f}°"
        parts.append(label(words, LEFT + CELL * (k + 0.5), TOP - 10, 13, text_anchor="middle"))
    for k, (x, y) in enumerate(anchors):
        parts.append(label(f"({x:.4g}, {y:.4g}) m", 20, TOP + ROW * (k + 0.65), 13))
    for trial, colour in zip(trials, colours, strict=True):
        x, y = LEFT + CELL * headings.index(trial.heading), TOP + ROW * anchors.index(trial.anchor)
        text, ink, fill = (
            (f"{trial.value:.3g}", "white", colour) if np.isfinite(trial.value) else ("none", "#888", NONE)
        )
        frame = {"stroke": "#d33", "stroke_width": 3} if trial is best else {}
        parts.append(tag("rect", x=x + 2, y=y + 2, width=CELL - 4, height=ROW - 4, fill=fill, **frame))
        parts.append(label(text, x + CELL / 2, y + ROW * 0.65, 13, text_anchor="middle", fill=ink))
    return document((0, 0, width, height), *parts)
