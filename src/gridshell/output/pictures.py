"""Pictures of a shell: its rods in space, near ones over far ones, coloured by their gap to the target."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gridshell.errors import OutputError
from gridshell.output.archive import GAPS, SHELLS, Archive
from gridshell.output.colours import mixed
from gridshell.output.rods import RodRecord, end_curve, rods_of
from gridshell.output.scale import FINEST, Scale, colour_bar, scale_of
from gridshell.output.svg import document, label, number, tag
from gridshell.output.view import View, ground_axes
from gridshell.output.wording import MINUS

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

WIDTH = 540.0  # drawing units of the shell itself
SIDE, TOP, BELOW, BAR = 50.0, 22.0, 40.0, 28.0  # margins; the colour bar needs more below
PAPER, INK, SOFT, GROUND = "#fdfdfb", "#22282f", "#7b838a", "#f1efe8"
FAMILIES = ("#1f5f8b", "#a8552a")
LAYERS = 20  # of depth: rods of a nearer layer pass over those of a farther one
SEGMENTS = 14000  # pieces of rods at most, so that files stay small
FADE = 0.42  # share of paper in the colour of the farthest rods


@dataclass(frozen=True)
class Pieces:
    """Parts of rods between two drawn nodes, rod by rod: nodes (s, 2), rod index (s,)."""

    nodes: Ints
    rod: Ints


def picture_svg(archive: Archive, state: str) -> str:
    """A picture of "flat", "draped", "popped_pinned" or "popped_clamped" as a complete SVG.

    All states in space share one view and one colour scale, so that they can be compared.

    Raises
    ------
    OutputError : the archive has no such state.
    """
    known = [name for name in ("flat", *SHELLS) if name in archive.states]
    if state not in known:
        raise OutputError(f"no state {state!r} in this result: it has {', '.join(known) or 'none'}")
    points, rods = np.asarray(archive.states[state], dtype=float), rods_of(archive)
    seen = [state] if state == "flat" else [name for name in known if name != "flat"]
    view = View.of(np.concatenate([archive.states[name] for name in seen]), WIDTH)
    scale = None if state == "flat" else scale_of(archive, state)
    ends = np.array([rod.nodes[[0, -1]] for rod in rods if len(rod.nodes) > 1], dtype=np.intp).ravel()
    front = view.depth(points[ends]) > 0.5
    layers, half = _layers(view, points, rods, scale), LAYERS // 2
    width, height = view.size + (2 * SIDE, TOP + BELOW + (0.0 if scale is None else BAR))
    return document(
        (-SIDE, -TOP, width, height),
        tag("rect", x=-SIDE, y=-TOP, width=width, height=height, fill=PAPER),
        ground_axes(view, SOFT, 12.5),
        _ground_curve(view, points[ends]),
        *layers[:half],
        _supports(view, points[ends[~front]], state, len(ends)),
        *layers[half:],
        _supports(view, points[ends[front]], state, len(ends)),
        "" if scale is None or GAPS[state] not in archive.states else _largest(archive, state, view, scale),
        "" if scale is None else colour_bar(scale, WIDTH, float(view.size[1]) + BELOW + BAR - 10, INK, SOFT),
    )


def _pieces(rods: list[RodRecord]) -> Pieces:
    """At most about SEGMENTS pieces: of finely divided rods, nodes are left out evenly."""
    stride = max(1, -(-sum(len(rod.nodes) for rod in rods) // SEGMENTS))
    pairs, owner = [np.empty((0, 2), dtype=np.intp)], [np.empty(0, dtype=np.intp)]
    for k, rod in enumerate(rods):
        last = len(rod.nodes) - 1
        nodes = rod.nodes[np.unique([*range(0, last, stride), last])] if last > 0 else rod.nodes
        pairs.append(np.column_stack([nodes[:-1], nodes[1:]]))
        owner.append(np.full(len(pairs[-1]), k))
    return Pieces(np.concatenate(pairs), np.concatenate(owner))


def _layers(view: View, points: Floats, rods: list[RodRecord], scale: Scale | None) -> list[str]:
    """The rods in LAYERS groups from far to near, each over a halo of paper that sets it off."""
    pieces, plane = _pieces(rods), view.project(points)
    nearness = view.depth(points)[pieces.nodes].mean(axis=1)
    layer = np.minimum((nearness * LAYERS).astype(np.intp), LAYERS - 1)
    if scale is None:
        families = np.array([rod.family == "v" for rod in rods], dtype=np.intp)
        colour, palette, fade = families[pieces.rod], list(FAMILIES), 0.0
    else:
        colour = np.rint(scale.bins[pieces.nodes].mean(axis=1)).astype(np.intp)
        palette, fade = scale.palette, FADE
    pen = float(np.clip(0.12 * WIDTH / max(len(rods), 1), 0.45, 1.7))
    groups = []
    for depth in range(LAYERS):
        mine = np.flatnonzero(layer == depth)
        near = (depth + 0.5) / LAYERS
        width = pen * (0.75 + 0.4 * near)
        parts = [tag("path", d=_path(plane, pieces, mine), stroke=PAPER, stroke_width=2.2 * width)]
        for shade in np.unique(colour[mine]):
            ink = mixed(palette[shade], PAPER, fade * (1 - near) ** 1.3)
            line = _path(plane, pieces, mine[colour[mine] == shade])
            parts.append(tag("path", d=line, stroke=ink, stroke_width=width, stroke_linecap="round"))
        groups.append(tag("g", *parts, fill="none", stroke_linejoin="round") if len(mine) else "")
    return groups


def _path(plane: Floats, pieces: Pieces, chosen: Ints) -> str:
    """Path data of the chosen pieces; pieces that follow each other on a rod are one polyline."""
    words, last = [], -2
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


def _supports(view: View, ends: Floats, state: str, count: int) -> str:
    """Some of a shell's `count` rod ends: rings where they turn freely, discs where they are clamped."""
    if state not in ("popped_pinned", "popped_clamped") or not len(ends):
        return ""
    radius = float(np.clip(200 / count, 0.6, 2.6))
    fill = INK if state == "popped_clamped" else PAPER
    dots = [tag("circle", cx=x, cy=y, r=radius) for x, y in view.project(ends)]
    return tag("g", *dots, fill=fill, stroke=INK, stroke_width=0.4 * radius)


def _largest(archive: Archive, state: str, view: View, scale: Scale) -> str:
    """A ring around the largest gap, and its size: the agreement's own, which also looks between the nodes."""
    points, gaps = archive.states[state], np.nan_to_num(scale.values)
    place, gap = points[int(np.argmax(np.abs(gaps)))], float(gaps[int(np.argmax(np.abs(gaps)))])
    found = (archive.result.get("agreement") or {}).get(state.removeprefix("popped_")) or {}
    if found.get("where") is not None and found.get("max") is not None:
        place = np.array(found["where"], dtype=float)
        nearest = int(np.argmin(np.linalg.norm(points - place, axis=1)))
        gap = float(np.copysign(1e3 * found["max"], gaps[nearest]))
    if abs(gap) <= FINEST:
        return ""
    x, y = view.project(place[None])[0]
    side, anchor = (-1, "end") if x > view.size[0] / 2 else (1, "start")
    text = f"{gap:+.3g} mm".replace("-", MINUS)

    def words(**paint: str) -> str:
        return label(text, x + 9 * side, y - 7, 13, text_anchor=anchor, font_weight="600", **paint)

    ring = tag("circle", cx=x, cy=y, r=6.0, fill="none", stroke=INK, stroke_width=1.1)
    return ring + words(fill=PAPER, stroke=PAPER, stroke_width="4", stroke_linejoin="round") + words(fill=INK)
