"""The rows of the paper's Figs 6 and 7: setup, draped, trimmed, and the flat grid with G0 and the exact net."""

from collections.abc import Iterable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from gridshell.layout import FlatGrid, GridMesh
from gridshell.output.svg import document, label, number, tag
from gridshell.output.view import RIGHT, UP
from gridshell.paper.drapes import HEIGHT, WORDS, Drape
from gridshell.targets import Target

Floats = NDArray[np.float64]

PAPER, INK, SOFT, TARGET = "#fdfdfb", "#22282f", "#7b838a", "#e2dccd"
FAMILY = {"u": "#1f5f8b", "v": "#a8552a"}
NET, G0 = "#22282f", "#2f8f4e"
PANEL, GAP, HEAD, TEXT = 230.0, 16.0, 40.0, 12.0  # drawing units
TITLES = ("1  the flat grid above the target", "2  draped", "3  trimmed", "4  flat: G0 (dots), the exact net (dashed)")


def rows_svg(drapes: Sequence[Drape]) -> str:
    """A row of four panels for each."""
    width, height = 4 * PANEL + 5 * GAP, len(drapes) * (PANEL + HEAD) + GAP
    rows = [tag("rect", x=0, y=0, width=width, height=height, fill=PAPER)]
    for down, one in enumerate(drapes):
        title = (
            f"({one.case.label})  {one.case.target.name}, spacing {1e3 * one.case.spacing:g} mm: {WORDS[one.method]}"
        )
        rows.append(label(title, GAP, down * (PANEL + HEAD) + 18, TEXT, fill=INK, font_weight="600"))
        for across, (text, panel) in enumerate(zip(TITLES, _panels(one), strict=True)):
            left, top = GAP + across * (PANEL + GAP), down * (PANEL + HEAD) + HEAD
            caption = label(text, 0, -6, 10.0, fill=SOFT)
            rows.append(tag("g", caption, *panel, transform=f"translate({number(left)} {number(top)})"))
    return document((0, 0, width, height), *rows)


def _panels(one: Drape) -> Iterator[list[str]]:
    target, whole = one.case.target, one.draped.mesh
    dome = _dome(target)
    flat = whole.flat + [0.0, 0.0, dome[:, 2].max() + HEIGHT]
    seen = np.vstack([dome, flat, one.draped.positions])
    for mesh, positions in ((whole, flat), (whole, one.draped.positions), (one.trimmed.mesh, one.trimmed.positions)):
        frame = seen if mesh is whole else np.vstack([dome, positions])
        place = _Place(_projected(frame))
        body = tag("polygon", points=_points(_hull(place(_projected(dome)))), fill=TARGET, stroke="none")
        yield [body, *_rods(mesh, place(_projected(positions)))]
    yield _plan(one)


def _plan(one: Drape) -> list[str]:
    """The trimmed grid in its plane, its ends, and the ends of the exact net."""
    mesh = one.trimmed.mesh
    ends, net = mesh.flat[mesh.ends.ravel(), :2], _net_ends(mesh.grid, one.net)
    place = _Place(np.vstack([ends, net]) * [1.0, -1.0])
    dots = [tag("circle", cx=x, cy=y, r=2.2, fill=G0) for x, y in place(ends * [1.0, -1.0]).tolist()]
    dashed = tag(
        "polygon", points=_points(_around(place(net * [1.0, -1.0]))), fill="none", stroke=NET, stroke_width=1.0,
        stroke_dasharray="5 3",
    )  # fmt: skip
    return [*_rods(mesh, place(mesh.flat[:, :2] * [1.0, -1.0])), dashed, *dots]


def _net_ends(grid: FlatGrid, net: Floats) -> Floats:
    """(2m, 2) where the exact net's rods end in the flat grid [m]."""
    along, across = net.ravel(), np.repeat([rod.offset for rod in grid.rods], 2)
    of_u = np.repeat([rod.family == "u" for rod in grid.rods], 2)
    return np.column_stack([np.where(of_u, along, across), np.where(of_u, across, along)])


class _Place:
    """From the plane of a picture to a panel, the whole of it filled, keeping proportions."""

    def __init__(self, everything: Floats) -> None:
        self._low, spread = everything.min(axis=0), np.ptp(everything, axis=0)
        self._scale = 0.96 * PANEL / float(spread.max())
        self._shift = 0.5 * (PANEL - self._scale * spread)

    def __call__(self, points: Floats) -> Floats:
        return np.asarray((points - self._low) * self._scale + self._shift)


def _projected(points: Floats) -> Floats:
    """(n, 2), y down."""
    return np.column_stack([points @ RIGHT, -(points @ UP)])


def _dome(target: Target) -> Floats:
    """(n, 3) points of the target inside its end, and of the ground that it covers."""
    half = target.size
    grid = np.linspace(-half, half, 161)
    xy = np.column_stack([one.ravel() for one in np.meshgrid(grid, grid)])
    points = np.column_stack([xy, target.height(xy)])
    points = points[np.isfinite(points[:, 2])]
    points = points[target.margin(points) >= 0]
    if target.base is None:
        return points
    ground = points.copy()
    ground[:, 2] = target.base
    return np.vstack([points, ground])


def _rods(mesh: GridMesh, at: Floats) -> Iterable[str]:
    for k, rod in enumerate(mesh.grid.rods):
        yield tag(
            "polyline", points=_points(at[mesh.nodes_of(k)]), fill="none", stroke=FAMILY[rod.family], stroke_width=0.8,
            stroke_linejoin="round",
        )  # fmt: skip


def _around(points: Floats) -> Floats:
    """The points in order of their angle about their middle."""
    apart = points - points.mean(axis=0)
    return points[np.argsort(np.arctan2(apart[:, 1], apart[:, 0]))]


def _hull(points: Floats) -> Floats:
    from scipy.spatial import ConvexHull

    return points[ConvexHull(points).vertices]


def _points(points: Floats) -> str:
    return " ".join(f"{number(x)},{number(y)}" for x, y in points.tolist())
