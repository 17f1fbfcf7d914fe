"""Pictures of a shell: its rods in space, near ones over far ones, coloured by their gap to the target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gridshell.errors import OutputError
from gridshell.output.archive import SHELLS, Archive
from gridshell.output.colours import HEIGHT, SIGNED, hex_colours, mixed
from gridshell.output.models import GAPS
from gridshell.output.plan import nice_step, nice_ticks
from gridshell.output.rods import RodRecord, end_curve, rods_of
from gridshell.output.svg import document, label, number, tag
from gridshell.output.view import View, ground_axes

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

WIDTH = 540.0  # drawing units of the shell itself
PAPER, INK, SOFT, GROUND = "#fdfdfb", "#22282f", "#7b838a", "#f1efe8"
FAMILIES = ("#1f5f8b", "#a8552a")
LAYERS, BINS, SEGMENTS = 20, 33, 14000  # of depth and colour; pieces of rods at most, so that files stay small
FADE = 0.42  # share of paper in the colour of the farthest rods


@dataclass(frozen=True)
class Scale:
    """What colours mean: a value (n,) for each node, from `low` to `high`, [mm] or none for the flat state."""

    values: Floats
    low: float
    high: float
    colours: tuple[str, ...]
    caption: str

    @property
    def bins(self) -> Ints:
        """(n,) index of each node's colour."""
        share = (self.values - self.low) / (self.high - self.low)
        return np.asarray(np.rint(np.clip(np.nan_to_num(share, nan=0.5), 0, 1) * (BINS - 1)), dtype=np.intp)

    @property
    def palette(self) -> list[str]:
        return hex_colours(self.colours, np.linspace(0, 1, BINS))


@dataclass(frozen=True)
class Pieces:
    """Parts of rods between two drawn nodes, rod by rod: nodes (s, 2), rod index (s,)."""

    nodes: Ints
    rod: Ints


def picture_svg(archive: Archive, state: str) -> str:
    """A picture of "flat", "draped", "popped_pinned" or "popped_clamped" as a complete SVG.

    All states in space share one view and one colour scale, so that they can be compared.
    """
    if state not in archive.states or state not in ("flat", *SHELLS):
        known = [name for name in ("flat", *SHELLS) if name in archive.states]
        raise OutputError(f"no state {state!r} in this result: it has {', '.join(known) or 'none'}")
    points, rods = np.asarray(archive.states[state], dtype=float), rods_of(archive)
    shells = [archive.states[name] for name in SHELLS if name in archive.states] if state != "flat" else [points]
    view = View.of(np.concatenate(shells), WIDTH)
    scale = None if state == "flat" else _scale(archive, state)
    ends = np.array([rod.nodes[[0, -1]] for rod in rods if len(rod.nodes) > 1], dtype=np.intp).ravel()
    front = view.depth(points[ends]) > 0.5 if len(ends) else np.empty(0, dtype=bool)
    left, top, right, below = 44.0, 20.0, 44.0, 66.0 if scale is not None else 40.0
    bar = "" if scale is None else _colour_bar(scale, float(view.size[0]), float(view.size[1]) + 62.0)
    return document(
        (-left, -top, view.size[0] + left + right, view.size[1] + top + below),
        tag("rect", x=-left, y=-top, width=view.size[0] + left + right, height=view.size[1] + top + below, fill=PAPER),
        ground_axes(view, SOFT, 11.0),
        _ground_curve(view, points[ends]),
        _supports(view, points[ends][~front], state),
        _rods(view, points, rods, scale),
        _supports(view, points[ends][front], state),
        _largest(view, points, rods, scale) if state in GAPS and GAPS[state] in archive.states else "",
        bar,
    )


def _scale(archive: Archive, state: str) -> Scale:
    """The signed gap, on one symmetric scale for all states; the height where there is no target."""
    if GAPS[state] in archive.states:
        largest = max(
            float(np.nanmax(np.abs(archive.states[name]), initial=0)) for name in GAPS.values() if name in archive.states
        )
        step = nice_step(max(1e3 * largest, 1e-3), 4)
        limit = step * np.ceil(max(1e3 * largest, 1e-3) / step - 1e-9)
        return Scale(1e3 * archive.states[GAPS[state]], -limit, limit, SIGNED, "gap to target in mm, + outside")
    heights = 1e3 * archive.states[state][:, 2]
    low, high = float(heights.min()), float(heights.max())
    return Scale(heights, low, max(high, low + 1e-3), HEIGHT, "height in mm")


def _pieces(rods: list[RodRecord]) -> Pieces:
    """At most about SEGMENTS pieces: of finely divided rods, nodes are left out evenly."""
    total = sum(len(rod.nodes) for rod in rods)
    stride = max(1, -(-total // SEGMENTS))
    pairs, owner = [], []
    for k, rod in enumerate(rods):
        keep = np.unique(np.append(np.arange(0, len(rod.nodes), stride), len(rod.nodes) - 1)) if len(rod.nodes) else []
        nodes = rod.nodes[np.asarray(keep, dtype=np.intp)]
        pairs.append(np.column_stack([nodes[:-1], nodes[1:]]))
        owner.append(np.full(max(len(nodes) - 1, 0), k))
    return Pieces(np.concatenate(pairs or [np.empty((0, 2), dtype=np.intp)]), np.concatenate(owner or [np.empty(0)]))


def _rods(view: View, points: Floats, rods: list[RodRecord], scale: Scale | None) -> str:
    """All rods, layer by layer from far to near, each with a halo of paper that shows what passes over what."""
    pieces = _pieces(rods)
    if not len(pieces.nodes):
        return ""
    nearness = view.depth(points)[pieces.nodes].mean(axis=1)
    layer = np.minimum((nearness * LAYERS).astype(np.intp), LAYERS - 1)
    if scale is None:
        colour, palette = (np.array([rod.family == "v" for rod in rods], dtype=np.intp))[pieces.rod], list(FAMILIES)
    else:
        colour, palette = np.rint(scale.bins[pieces.nodes].mean(axis=1)).astype(np.intp), scale.palette
    plane = view.project(points)
    pen = float(np.clip(0.06 * WIDTH / (len(rods) / 2), 0.45, 1.7))
    parts = []
    for depth in np.unique(layer):
        mine = np.flatnonzero(layer == depth)
        near = (depth + 0.5) / LAYERS
        width = pen * (0.75 + 0.4 * near)
        parts.append(tag("path", d=_path(plane, pieces, mine), stroke=PAPER, stroke_width=2.2 * width))
        for shade in np.unique(colour[mine]):
            ink = mixed(palette[shade], PAPER, FADE * (1 - near) ** 1.3 if scale is not None else 0.0)
            path = _path(plane, pieces, mine[colour[mine] == shade])
            parts.append(tag("path", d=path, stroke=ink, stroke_width=width, stroke_linecap="round"))
    return tag("g", *parts, fill="none", stroke_linejoin="round")


def _path(plane: Floats, pieces: Pieces, chosen: Ints) -> str:
    """Path data of the chosen pieces; pieces that follow each other on a rod are one polyline."""
    words, last = [], -1
    for piece in chosen.tolist():
        a, b = pieces.nodes[piece]
        if piece != last + 1 or pieces.rod[piece] != pieces.rod[last]:
            words.append(f"M{number(plane[a, 0], 1)} {number(plane[a, 1], 1)}")
        words.append(f"L{number(plane[b, 0], 1)} {number(plane[b, 1], 1)}")
        last = piece
    return "".join(words)


def _ground_curve(view: View, ends: Floats) -> str:
    """The boundary: the closed curve through the rods' ends."""
    if len(ends) < 3:
        return ""
    outline = " ".join(f"{number(x, 1)},{number(y, 1)}" for x, y in view.project(end_curve(ends)))
    return tag("polygon", points=outline, fill=GROUND, stroke=SOFT, stroke_width=1.0, stroke_linejoin="round")


def _supports(view: View, ends: Floats, state: str) -> str:
    """The rods' ends: rings where they turn freely, discs where they are clamped."""
    if state not in ("popped_pinned", "popped_clamped"):
        return ""
    radius = float(np.clip(200 / max(len(ends), 1), 0.6, 2.6))
    dots = [tag("circle", cx=x, cy=y, r=radius) for x, y in view.project(ends)]
    return tag("g", *dots, fill=INK if state == "popped_clamped" else PAPER, stroke=INK, stroke_width=0.4 * radius)


def _largest(view: View, points: Floats, rods: list[RodRecord], scale: Scale | None) -> str:
    """A ring around the largest gap, and its size."""
    if scale is None or not rods or not np.nanmax(np.abs(scale.values), initial=0) > 1e-3:
        return ""
    node = int(np.nanargmax(np.abs(scale.values)))
    x, y = view.project(points[node][None])[0]
    shown = f"{scale.values[node]:+.3g} mm".replace("-", "\N{MINUS SIGN}")
    ring = tag("circle", cx=x, cy=y, r=6, fill="none", stroke=INK, stroke_width=1.1)
    side = -1 if x > view.size[0] / 2 else 1
    text = {"text_anchor": "start" if side > 0 else "end", "font_weight": "600"}
    at = (x + 9 * side, y - 7)
    halo = label(shown, *at, 12, fill=PAPER, stroke=PAPER, stroke_width=4, stroke_linejoin="round", **text)
    return ring + halo + label(shown, *at, 12, fill=INK, **text)


def _colour_bar(scale: Scale, width: float, y: float) -> str:
    """At the lower right: the map, its ticks in mm, and what it shows."""
    length, x0 = 200.0, width - 200.0
    step, parts = length / BINS, []
    for k, colour in enumerate(scale.palette):
        parts.append(tag("rect", x=x0 + k * step, y=y - 26, width=step + 0.5, height=8, fill=colour,
                         shape_rendering="crispEdges"))  # fmt: skip
    for value in nice_ticks(scale.low, scale.high, 4):
        x = x0 + length * (value - scale.low) / (scale.high - scale.low)
        shown = number(value, 6).replace("-", "\N{MINUS SIGN}")
        parts.append(label(shown, x, y - 5, 11, text_anchor="middle", fill=SOFT))
    parts.append(label(scale.caption, x0 - 12, y - 18, 12, text_anchor="end", fill=INK))
    return "".join(parts)
