"""What the paper's pictures of grids are made of: panels, rods with their far sides pale, targets, closed curves."""

from collections.abc import Iterator
from itertools import pairwise
from typing import Any

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.layout import GridMesh
from rodshell.output.svg import document, label, number, tag
from rodshell.output.view import RIGHT, TOWARDS, UP
from rodshell.targets import Target

PAPER, INK, SOFT, BODY = "#fdfdfb", "#22282f", "#7b838a", "#e2dccd"
FAMILY = {"u": "#1f5f8b", "v": "#a8552a"}
FLAT, FINAL = "#2f8f4e", "#8a3fa0"  # G0, G
PANEL, GAP, HEAD, TEXT = 230.0, 16.0, 40.0, 12.0  # drawing units
FAR = 0.22  # opacity of what lies behind


def rows_of_panels(rows: list[tuple[str, list[tuple[str, list[str]]]]]) -> str:
    """A drawing of rows, each a title and panels, each panel a caption and its marks."""
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


class Place:
    """From the plane of a picture (n, 2), y down, to a panel, which everything fills in its own proportions."""

    def __init__(self, everything: Floats) -> None:
        self._low, spread = everything.min(axis=0), np.ptp(everything, axis=0)
        self._scale = 0.96 * PANEL / float(spread.max())
        self._shift = 0.5 * (PANEL - self._scale * spread)

    def __call__(self, points: Floats) -> Floats:
        return np.asarray((points - self._low) * self._scale + self._shift)


def from_above(points: Floats) -> Floats:
    """(n, 2) of points (n, 2) or (n, 3) seen in plan, y down."""
    return points[:, :2] * [1.0, -1.0]


def from_aside(points: Floats) -> Floats:
    """(n, 2) of points (n, 3) in the axonometric view, y down."""
    return np.column_stack([points @ RIGHT, -(points @ UP)])


def standing(target: Target, mesh: GridMesh, positions: Floats, *, hides: bool = True) -> list[str]:
    """A grid on or above its target (n, 3) [m], seen from aside; `hides`: the body's far side is that of the rods."""
    body = _body(target)
    place = Place(from_aside(np.vstack([body, positions])))
    near = np.ones(len(positions), dtype=bool)
    if hides:
        near = target.contact(positions).normal @ TOWARDS >= 0
    filled = tag("polygon", points=joined(_hull(place(from_aside(body)))), fill=BODY, stroke="none")
    return [filled, *rods(mesh, place(from_aside(positions)), near)]


def rods(mesh: GridMesh, at: Floats, near: Bools | None = None, **attributes: Any) -> Iterator[str]:
    """Every rod by its nodes' places (n, 2); pale where one of an edge's nodes is not `near` (n,)."""
    for k, rod in enumerate(mesh.grid.rods):
        nodes = mesh.nodes_of(k)
        seen = np.ones(len(nodes) - 1, dtype=bool) if near is None else near[nodes[1:]] & near[nodes[:-1]]
        changes = [0, *(np.flatnonzero(seen[1:] != seen[:-1]) + 1).tolist(), len(seen)]
        for first, last in pairwise(changes):
            shade = {} if seen[first] else {"stroke_opacity": FAR}
            yield tag(
                "polyline", points=joined(at[nodes[first : last + 1]]), fill="none", stroke=FAMILY[rod.family],
                stroke_width=0.8, stroke_linejoin="round", **shade, **attributes,
            )  # fmt: skip


def dots(at: Floats, colour: str, radius: float = 2.2) -> Iterator[str]:
    for x, y in at.tolist():
        yield tag("circle", cx=x, cy=y, r=radius, fill=colour)


def closed(at: Floats, colour: str, **attributes: Any) -> str:
    """A closed curve through the places (n, 2), in the order of their angle about their middle."""
    apart = at - at.mean(axis=0)
    order = np.argsort(np.arctan2(apart[:, 1], apart[:, 0]))
    given = {"fill": "none", "stroke_width": 1.0} | attributes
    return tag("polygon", points=joined(at[order]), stroke=colour, **given)


def joined(points: Floats) -> str:
    return " ".join(f"{number(x)},{number(y)}" for x, y in points.tolist())


def _body(target: Target) -> Floats:
    """(n, 3) points of the target inside its end, and of the ground that it covers."""
    half = target.size
    grid = np.linspace(-half, half, 161)
    xy = np.column_stack([one.ravel() for one in np.meshgrid(grid, grid)])
    points = np.column_stack([xy, target.height_at(xy)])
    points = points[np.isfinite(points[:, 2])]
    points = points[target.margin(points) >= 0]
    if target.base is None:
        return points
    ground = points.copy()
    ground[:, 2] = target.base
    return np.vstack([points, ground])


def _hull(points: Floats) -> Floats:
    from scipy.spatial import ConvexHull

    return points[ConvexHull(points).vertices]
