"""What every figure has: the paper's rod, targets and grids, a table, pictures and a status."""

import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from os import PathLike
from typing import Any

import numpy as np
from scipy.spatial import ConvexHull

from rodshell.arrays import Bools, Floats
from rodshell.layout import GridLayout, GridMesh
from rodshell.output.drawing import FAMILIES
from rodshell.output.grid import family_numbers
from rodshell.output.pictures import RIGHT, TOWARDS, UP
from rodshell.output.schedules import csv_text
from rodshell.output.svg import document, label, number, tag
from rodshell.results.folder import ResultFolder, open_folder
from rodshell.results.results import FORMAT
from rodshell.rods.materials import Material
from rodshell.rods.section import Circle, Rod
from rodshell.targets import Ellipsoid, Hemisphere, Paraboloid, Target

ROD = Rod(Circle(radius=1e-3), Material(youngs_modulus=1e6, density=1e3))  # r 1 mm, E 1 MPa, G = E/3, 1 g/cm3
LENGTH, HEIGHT = 1.2, 0.05  # [m] of the rods, and H
EDGE = 0.015  # [m]; the paper's "8000 DOFs" are this mesh, its stated 5 mm have four times as many


@dataclass(frozen=True)
class Case:
    """A target and a grid.

    Args:
        label: its letter in the paper's figure.
        rods: number of rods of the two families.
        spacing, edge: of the rods, and length of their edges [m].
    """

    label: str
    target: Target
    rods: tuple[int, int]
    spacing: float = 0.03
    edge: float = EDGE

    @property
    def layout(self) -> GridLayout:
        """The orthogonal grid."""
        return GridLayout.orthogonal(rods=self.rods, spacing=self.spacing, edge=self.edge, length=LENGTH)


CASES = (
    Case("a", Hemisphere(0.2), (17, 17)),
    Case("b", Paraboloid(0.2, 0.12), (15, 15)),
    Case("c", Ellipsoid(0.2, 0.15, 0.12), (11, 15)),
)
"""Of Figs 1, 6 and 8."""

WIDE_CASES = (
    Case("1", Hemisphere(0.2), (13, 13), spacing=0.04, edge=0.02),
    Case("2", Hemisphere(0.2), (11, 11), spacing=0.05, edge=0.025),
)
"""Of Fig 7."""


PAPER, INK, SOFT, _BODY = "#fdfdfb", "#22282f", "#7b838a", "#e2dccd"
FLAT, FINAL = "#2f8f4e", "#8a3fa0"  # G0, G
PANEL, GAP, HEAD, TEXT = 230.0, 16.0, 40.0, 12.0  # drawing units
TARGET_COLOURS = {"hemisphere": "#1f5f8b", "paraboloid": "#a8552a", "ellipsoid": "#2f8f4e"}
FAR = 0.22  # opacity of what lies behind


def rows_of_panels(rows: list[tuple[str, list[tuple[str, list[str]]]]]) -> str:
    """A drawing of rows of panels.

    Args:
        rows: each a title and panels, each panel a caption and its marks.
    """
    across = max(len(panels) for _, panels in rows)
    width, height = across * PANEL + (across + 1) * GAP, len(rows) * (PANEL + HEAD) + GAP
    parts = [tag("rect", x=0, y=0, width=width, height=height, fill=PAPER)]
    for down, (title, panels) in enumerate(rows):
        parts.append(label(title, GAP, down * (PANEL + HEAD) + 18, TEXT, fill=INK, font_weight="600"))
        for k, (text, marks) in enumerate(panels):
            left, top = GAP + k * (PANEL + GAP), down * (PANEL + HEAD) + HEAD
            caption = label(text, 0, -6, 10.0, fill=SOFT)
            parts.append(tag("g", caption, *marks, transform=f"translate({number(left)} {number(top)})"))
    return document((0, 0, width, height), *parts)


class PanelScale:
    """From the plane of a picture (n, 2), y down, to a panel, which `everything` (n, 2) fills without distortion."""

    def __init__(self, everything: Floats) -> None:
        self._low, spread = everything.min(axis=0), np.ptp(everything, axis=0)
        self._scale = 0.96 * PANEL / float(spread.max())
        self._shift = 0.5 * (PANEL - self._scale * spread)

    def __call__(self, points: Floats) -> Floats:
        return np.asarray((points - self._low) * self._scale + self._shift)


def from_above(points: Floats) -> Floats:
    """(n, 2) of points (n, 2) or (n, 3) seen in plan, y down."""
    return points[:, :2] * [1.0, -1.0]


def _from_aside(points: Floats) -> Floats:
    """(n, 2) of points (n, 3) in the axonometric view, y down."""
    return np.column_stack([points @ RIGHT, -(points @ UP)])


def standing(target: Target, mesh: GridMesh, positions: Floats, *, hides: bool = True) -> list[str]:
    """A grid on or above its target in the axonometric view.

    Args:
        target: drawn as a filled body.
        positions: (n, 3) of its nodes [m].
        hides: draw the rods on the body's far side pale.
    """
    body = _body(target)
    to_panel = PanelScale(_from_aside(np.vstack([body, positions])))
    near = np.ones(len(positions), dtype=bool)
    if hides:
        near = target.contact(positions).normal @ TOWARDS >= 0
    outline = to_panel(_from_aside(body))
    filled = tag("polygon", points=joined(outline[ConvexHull(outline).vertices]), fill=_BODY, stroke="none")
    return [filled, *rod_lines(mesh, to_panel(_from_aside(positions)), near)]


def rod_lines(mesh: GridMesh, at: Floats, near: Bools | None = None) -> Iterator[str]:
    """Every rod by its nodes' points `at` (n, 2) in the drawing; pale where a node of an edge is not `near` (n,)."""
    families = family_numbers(rod.family for rod in mesh.grid.rods)
    for k in range(len(mesh.grid.rods)):
        nodes = mesh.nodes_of(k)
        seen = np.ones(len(nodes) - 1, dtype=bool) if near is None else near[nodes[1:]] & near[nodes[:-1]]
        changes = [0, *(np.flatnonzero(seen[1:] != seen[:-1]) + 1).tolist(), len(seen)]
        for first, last in pairwise(changes):
            shade = {} if seen[first] else {"stroke_opacity": FAR}
            yield tag(
                "polyline", points=joined(at[nodes[first : last + 1]]), fill="none", stroke=FAMILIES[families[k]],
                stroke_width=0.8, stroke_linejoin="round", **shade,
            )  # fmt: skip


def dots(at: Floats, colour: str, radius: float = 2.2) -> Iterator[str]:
    """Dots at the points `at` (n, 2) in the drawing."""
    for x, y in at.tolist():
        yield tag("circle", cx=x, cy=y, r=radius, fill=colour)


def closed(at: Floats, colour: str, **attributes: Any) -> str:
    """A closed curve through the points `at` (n, 2) in the drawing, in the order of their angle about their middle."""
    apart = at - at.mean(axis=0)
    order = np.argsort(np.arctan2(apart[:, 1], apart[:, 0]))
    look = {"fill": "none", "stroke_width": 1.0} | attributes
    return tag("polygon", points=joined(at[order]), stroke=colour, **look)


def joined(points: Floats) -> str:
    """Points (n, 2) as SVG writes them."""
    return " ".join(f"{number(x)},{number(y)}" for x, y in points.tolist())


def _body(target: Target) -> Floats:
    """(n, 3) points of the target inside its end, and of the ground that it covers."""
    half = target.size
    grid = np.linspace(-half, half, 161)
    xy = np.column_stack([axis.ravel() for axis in np.meshgrid(grid, grid)])
    points = np.column_stack([xy, target.height_at(xy)])
    points = points[np.isfinite(points[:, 2])]
    points = points[target.margin(points) >= 0]
    if target.base is None:
        return points
    ground = points.copy()
    ground[:, 2] = target.base
    return np.vstack([points, ground])


# Logarithmic charts

_CHART, CHART_EDGE, _CHART_GAP, _CHART_TEXT = (360.0, 260.0), 56.0, 40.0, 11.0  # drawing units
MARGIN = 0.06  # of a chart's logarithmic span, at each end
LEGENDS = 3  # in a row
LINE = "#e2e4e5"


@dataclass(frozen=True)
class Series:
    """Points (x, y), all positive, with one `sign` in one `colour`; `lined`: with a line through them."""

    x: Sequence[float]
    y: Sequence[float]
    colour: str
    sign: str = "\N{BLACK CIRCLE}"
    lined: bool = False


@dataclass(frozen=True)
class Chart:
    """One chart with the titles `across` and `up` of its axes; `legend`: words with their colours, below it."""

    series: Sequence[Series]
    across: str
    up: str
    legend: Sequence[tuple[str, str]] = ()


def charts_svg(charts: Sequence[Chart], words: str = "") -> str:
    """Logarithmic charts side by side, with `words` below all of them."""
    lines = max(-(-len(chart.legend) // LEGENDS) for chart in charts)
    wide, tall = _CHART
    width, height = len(charts) * (wide + CHART_EDGE) + _CHART_GAP, tall + 90 + 15 * lines + (22 if words else 0)
    parts = [tag("rect", x=0, y=0, width=width, height=height, fill=PAPER)]
    for across, chart in enumerate(charts):
        left = CHART_EDGE + across * (wide + CHART_EDGE)
        parts.append(tag("g", *_marks(chart), transform=f"translate({number(left)} 24)"))
    parts.append(label(words, CHART_EDGE, height - 14, _CHART_TEXT, fill=INK))
    return document((0, 0, width, height), *parts)


def _marks(chart: Chart) -> list[str]:
    wide, tall = _CHART
    x, y = (np.concatenate([getattr(series, name) for series in chart.series]) for name in "xy")
    at_x, at_y = _scale(x, wide), _scale(y, tall)
    parts = [
        tag("rect", x=0, y=0, width=wide, height=tall, fill="none", stroke=SOFT, stroke_width=0.8),
        label(chart.across, wide / 2, tall + 34, _CHART_TEXT, fill=INK, text_anchor="middle"),
        label(chart.up, 0, -8, _CHART_TEXT, fill=INK),
    ]
    for value in _ticks(x):
        at = float(at_x(value))
        parts.append(tag("line", x1=at, x2=at, y1=0, y2=tall + 4, stroke=LINE, stroke_width=0.8))
        parts.append(label(f"{value:g}", at, tall + 16, 9.0, fill=SOFT, text_anchor="middle"))
    for value in _ticks(y):
        at = tall - float(at_y(value))
        parts.append(tag("line", x1=-4, x2=wide, y1=at, y2=at, stroke=LINE, stroke_width=0.8))
        parts.append(label(f"{value:g}", -7, at + 3, 9.0, fill=SOFT, text_anchor="end"))
    for series in chart.series:
        points = np.column_stack([at_x(np.asarray(series.x)), tall - at_y(np.asarray(series.y))])
        if series.lined:
            parts.append(tag("polyline", points=joined(points), fill="none", stroke=series.colour, stroke_width=1.0))
        for px, py in points.tolist():
            parts.append(label(series.sign, px, py + 4, 13.0, fill=series.colour, text_anchor="middle"))
    for k, (text, colour) in enumerate(chart.legend):
        left, down = k % LEGENDS * wide / LEGENDS, tall + 56 + 15 * (k // LEGENDS)
        parts.append(label(text, left, down, _CHART_TEXT, fill=colour))
    return parts


def _scale(values: Floats, room: float) -> Callable[[Floats | float], Floats]:
    """From a value to its position along a logarithmic axis."""
    low, high = np.log10(values.min()), np.log10(values.max())
    span = max(high - low, 0.1)
    return lambda value: room * (MARGIN + (1 - 2 * MARGIN) * (np.log10(value) - low) / span)


def _ticks(values: Floats) -> Floats:
    """Powers of ten between the smallest and the largest value, and numbers between them where these are few."""
    low, high = float(values.min()), float(values.max())
    decades = 10.0 ** np.arange(np.floor(np.log10(low)), np.ceil(np.log10(high)) + 1)
    between = (1,) if high > 300 * low else (1, 2, 5) if high > 8 * low else (1, 2, 3, 4, 6, 8)
    steps = np.outer(decades, between).ravel()
    return np.asarray(steps[(steps >= 0.999 * low) & (steps <= 1.001 * high)])


Row = tuple[str, ...]
VERSION = 1  # of the keys of a figure's result.json


class Part(ABC):
    """What a figure has several of: a shell, a run, a line of its table."""

    @property
    def status(self) -> str:
        """ "converged", or what did not converge."""
        return "converged"

    @abstractmethod
    def rows(self) -> list[Row]:
        """Its rows of the table, mostly one."""

    @abstractmethod
    def result(self) -> dict[str, Any]:
        """Its entry in result.json, SI."""


class Figure(ABC):
    """A figure or a study of the paper, computed.

    Attributes:
        name: such as "fig6".
        title: the line above the table.
        columns: heads of the table's columns.
        key: of the parts in result.json.
    """

    name: str
    title: str
    columns: Row
    key: str
    parts: tuple[Part, ...]

    @abstractmethod
    def pictures(self) -> dict[str, str]:
        """SVG drawings by name."""

    @property
    def status(self) -> str:
        """ "converged", or that of the first part that did not converge."""
        return next((part.status for part in self.parts if part.status != "converged"), "converged")

    def rows(self) -> list[Row]:
        """The table."""
        return [row for part in self.parts for row in part.rows()]

    def content(self) -> dict[str, Any]:
        """The figure's part of result.json, SI."""
        return {self.key: [part.result() for part in self.parts]}

    def tables(self) -> Mapping[str, Iterable[Sequence[object]]]:
        """Further tables with their heads, by name."""
        return {}

    def texts(self) -> Mapping[str, str]:
        """Further files, by file name."""
        return {}

    def footing(self) -> str:
        """A line below the table."""
        return ""

    def summary(self) -> str:
        """The table as text."""
        parts = (self.title, _aligned(self.columns, self.rows()), self.footing())
        return "\n\n".join(part for part in parts if part)

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        head = {"format": FORMAT, "version": VERSION, "units": "SI", "figure": self.name, "status": self.status}
        return head | self.content()

    def save(self, folder: str | PathLike[str] | ResultFolder) -> None:
        """Write the figure's files to `folder`.

        Raises:
            OutputError: it cannot be written, or files that rodshell did not write would have to be replaced.
        """
        tables = {"table": [self.columns, *self.rows()], **self.tables()}
        files = {"result.json": json.dumps(self.result(), indent=1) + "\n", "table.txt": self.summary() + "\n"}
        files |= {f"{name}.csv": csv_text(table) for name, table in tables.items()}
        files |= {f"{name}.svg": picture for name, picture in self.pictures().items()} | dict(self.texts())
        with open_folder(folder, reserved=list(files)) as place:
            for name, content in files.items():
                place.put(name, content)
            place.commit()


def _aligned(columns: Row, rows: Sequence[Row]) -> str:
    """A table as text, with its `columns` aligned."""
    table = [columns, *rows]
    widths = [max(len(row[k]) for row in table) for k in range(len(columns))]
    lines = ("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table)
    return "\n".join(line.rstrip() for line in lines)
