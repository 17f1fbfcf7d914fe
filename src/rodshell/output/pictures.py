"""Pictures of a shape: its rods in space, near ones over far ones, coloured by gap or stress."""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.output.colour_scale import FINEST, Colour, Scale, colour_bar, largest_gap, length_unit, mixed, scale_of
from rodshell.output.drawing import Drawing, Path, Pen, Pencil
from rodshell.output.grid import GridRod, Shape, opens, outlines_of, rods_of, shape_of
from rodshell.output.svg import picture_document
from rodshell.output.view import View, ground_axes
from rodshell.results.archive import SHELLS, Archive, made_once
from rodshell.results.wording import MINUS

Polylines = list[list[tuple[int, slice]]]

WIDTH = 540.0  # drawing units of the shell itself
SIDE, TOP, BELOW, BAR = 50.0, 22.0, 40.0, 28.0  # margins; the colour bar needs more below
PAPER, INK, SOFT, GROUND = "#fdfdfb", "#22282f", "#7b838a", "#f1efe8"
FAMILIES = ("#1f5f8b", "#a8552a")
LAYERS = 20  # of depth: rods of a nearer layer pass over those of a farther one,
LAG = 2  # and are set off against those so many layers farther: rods that meet at a joint do not cut each other
SEGMENTS = 14000  # pieces of rods at most, so that files stay small
LEVEL = 0.01  # of its width: an outline that rises more is not filled, which would look like a surface
FADE = 0.42  # share of paper in the colour of the farthest rods


@dataclass(frozen=True)
class Pieces:
    """Parts of rods between two drawn nodes, rod by rod.

    Parameters
    ----------
    drawn : (d,) entries of `rod_nodes` that are drawn.
    first : (s,) at which of them each piece begins; it ends at the next.
    rod : (s,) index of its rod.
    """

    drawn: Ints
    first: Ints
    rod: Ints


def picture_svg(archive: Archive, state: str, colour: Colour = "gap") -> str:
    """A picture of "flat", "draped", "popped_pinned", "popped_clamped" or "stage_1", ... as a complete SVG.

    All final shapes share one view, as the stages of the deployment do, and all shapes one colour scale.

    Parameters
    ----------
    colour : of the rods: "gap" to the target (without a target: height), or "stress".

    Raises
    ------
    OutputError : the archive has no such state.
    """
    return picture_document(picture(archive, state, colour))


def picture(archive: Archive, state: str, colour: Colour = "gap") -> Drawing:
    """The same as a drawing in units of about a pixel, y up, on a ground of paper.

    Parameters
    ----------
    state, colour : as of `picture_svg`.
    """
    shape, rods = shape_of(archive, state), rods_of(archive)
    points, view = shape.positions, _view(archive, shape)
    scale = scale_of(archive, shape, colour)
    pencil = Pencil()
    ends = np.array([rod.nodes[[0, -1]] for rod in rods if len(rod.nodes) > 1], dtype=np.intp).ravel()
    front = view.depth(points[ends]) > 0.5
    ground_axes(pencil, view, SOFT, 12.5)
    _ground_curves(pencil, view, shape, rods)
    drawn = _Rods.of(archive, view, shape, scale)
    drawn.draw(pencil, range(LAYERS // 2))
    _supports(pencil, view, points[ends[~front]], state, len(ends))
    drawn.draw(pencil, range(LAYERS // 2, LAYERS))
    _supports(pencil, view, points[ends[front]], state, len(ends))
    if colour == "gap" and shape.gap is not None and scale is not None:
        _largest(pencil, archive, shape, view)
    if scale is not None:
        colour_bar(pencil, scale, WIDTH, -float(view.size[1]) - BELOW - BAR + 10)
    width, height = view.size + (2 * SIDE, TOP + BELOW + (0.0 if shape.flat else BAR))
    corners = [(-SIDE, TOP), (width - SIDE, TOP), (width - SIDE, TOP - height), (-SIDE, TOP - height)]
    paper = Pencil()
    paper.line(corners, "TITLE", closed=True, pen=Pen(PAPER, 0.0, fill=PAPER))
    return paper.done(state, shape.caption, 12.5) + pencil.done("", "", 12.5)


def _view(archive: Archive, shape: Shape) -> View:
    """One view for all shapes in space, and one for the flat grid; stages spread further than the final shell."""
    if shape.flat:
        return View.of(shape.positions, WIDTH)
    return _view_of_shells(archive) if shape.name in SHELLS else _view_of_all(archive)


@made_once
def _view_of_shells(archive: Archive) -> View:
    return View.of(np.concatenate([archive.states[name] for name in SHELLS if name in archive.states]), WIDTH)


@made_once
def _view_of_all(archive: Archive) -> View:
    shells = [archive.states[name] for name in SHELLS if name in archive.states]
    return View.of(np.concatenate([*shells, *archive.states["history"]]), WIDTH)


@made_once
def _pieces(archive: Archive) -> Pieces:
    """At most about SEGMENTS pieces: of finely divided rods, nodes are left out evenly."""
    lengths = [len(rod.nodes) for rod in rods_of(archive)]
    stride, drawn, first = max(1, -(-sum(lengths) // SEGMENTS)), [np.empty(0, dtype=np.intp)], 0
    for length in lengths:
        drawn.append(first + np.unique([*range(0, length - 1, stride), length - 1][:length]))
        first += length
    owner = np.repeat(np.arange(len(lengths)), [len(entries) for entries in drawn[1:]])
    begins = np.flatnonzero(owner[1:] == owner[:-1])
    return Pieces(np.concatenate(drawn).astype(np.intp), begins, owner[begins])


@dataclass(frozen=True)
class _Rods:
    """The rods of a picture, layer by layer.

    Parameters
    ----------
    plane : (d, 2) the drawn nodes.
    halos, lines : by layer, the farthest first: indices in the palette, and drawn nodes of polylines.
    fade : share of paper in the farthest colours.
    pen : width of the rods in the middle [drawing units].
    """

    plane: Floats
    halos: Polylines
    lines: Polylines
    palette: list[str]
    fade: float
    pen: float

    @staticmethod
    def of(archive: Archive, view: View, shape: Shape, scale: Scale | None) -> "_Rods":
        rods, pieces = rods_of(archive), _pieces(archive)
        nodes = np.concatenate([np.empty(0, dtype=np.intp), *(rod.nodes for rod in rods)])[pieces.drawn]
        nearness = view.depth(shape.positions)[nodes]
        near = 0.5 * (nearness[pieces.first] + nearness[pieces.first + 1])
        layer = np.minimum((near * LAYERS).astype(np.intp), LAYERS - 1)
        if scale is None:
            shade = np.array([rod.family == "v" for rod in rods], dtype=np.intp)[pieces.rod]
            palette, fade = list(FAMILIES), 0.0 if shape.flat else FADE
        else:
            bins = scale.bins[pieces.drawn]
            shade = np.rint(0.5 * (bins[pieces.first] + bins[pieces.first + 1])).astype(np.intp)
            palette, fade = scale.palette, FADE
        pen = float(np.clip(0.12 * WIDTH / max(len(rods), 1), 0.45, 1.7))
        halos, lines = (_polylines(pieces, layer, shades) for shades in (np.zeros_like(shade), shade))
        return _Rods(view.project(shape.positions)[nodes], halos, lines, palette, fade, pen)

    def draw(self, pencil: Pencil, layers: range) -> None:
        """Some layers from far to near, each over halos of paper that set off what passes over it and farther ones."""
        for depth in layers:
            for nearer in range(0 if depth == 0 else depth + LAG, min(depth + LAG + 1, LAYERS)):
                halo = Pen(PAPER, 2.2 * self._width(nearer))
                pencil.paths += [Path(self.plane[chain], "CUT", pen=halo) for _, chain in self.halos[nearer]]
            near, width = _nearness(depth), self._width(depth)
            pens = {
                shade: Pen(mixed(self.palette[shade], PAPER, self.fade * (1 - near) ** 1.3), width)
                for shade in {shade for shade, _ in self.lines[depth]}
            }
            pencil.paths += [Path(self.plane[chain], "CUT", pen=pens[shade]) for shade, chain in self.lines[depth]]

    def _width(self, depth: int) -> float:
        return self.pen * (0.75 + 0.4 * _nearness(depth))


def _nearness(depth: int) -> float:
    """Of the middle of a layer, 0 to 1."""
    return (depth + 0.5) / LAYERS


def _polylines(pieces: Pieces, layer: Ints, shade: Ints) -> Polylines:
    """Pieces that follow each other on a rod in one layer and shade as one; the shades of a layer ascend."""
    order = np.lexsort((shade, layer))
    first, layer, shade = pieces.first[order], layer[order], shade[order]
    ends = np.flatnonzero((np.diff(layer) != 0) | (np.diff(shade) != 0) | (np.diff(first) > 1))
    begin, end = (np.concatenate(parts)[: len(first)] for parts in (([0], ends + 1), (ends, [len(first) - 1])))
    columns = (layer[begin], shade[begin], first[begin], first[end] + 2)
    lines: Polylines = [[] for _ in range(LAYERS)]
    for depth, colour, low, high in zip(*(column.tolist() for column in columns), strict=True):
        lines[depth].append((colour, slice(low, high)))
    return lines


def _ground_curves(pencil: Pencil, view: View, shape: Shape, rods: list[GridRod]) -> None:
    """The boundary: closed curves through the rods' ends, openings on top of what they open."""
    drawn = [rod for rod in rods if len(rod.nodes) > 1]
    ends = np.array([rod.nodes[[0, -1]] for rod in drawn], dtype=np.intp).ravel()
    for loop in outlines_of(drawn):
        outline = shape.positions[ends[loop]]
        fill = ""
        if np.ptp(outline[:, 2]) < LEVEL * np.ptp(outline[:, :2]):
            fill = PAPER if opens(np.array([rod.flat for rod in drawn]).reshape(-1, 2)[loop]) else GROUND
        pencil.line(view.project(outline), "BOUNDARY-FINAL", closed=True, pen=Pen(SOFT, 1.0, fill=fill))


def _supports(pencil: Pencil, view: View, ends: Floats, state: str, count: int) -> None:
    """Some of a shell's `count` rod ends: rings where they turn freely, discs where they are clamped."""
    if state in ("flat", "draped"):
        return
    radius = float(np.clip(200 / count, 0.6, 2.6))
    fill = INK if state == "popped_clamped" else PAPER
    for at in view.project(ends):
        _dot(pencil, at, radius, Pen(INK, 0.4 * radius, fill=fill))


def _dot(pencil: Pencil, at: Floats, radius: float, pen: Pen) -> None:
    """A disc as a path: marks come after all paths, and rods in front must cover it."""
    angle = np.linspace(0, 2 * np.pi, 12, endpoint=False)
    circle = at + radius * np.column_stack([np.cos(angle), np.sin(angle)])
    pencil.line(circle, "MARK", closed=True, pen=pen)


def _largest(pencil: Pencil, archive: Archive, shape: Shape, view: View) -> None:
    """A ring around the largest gap, and its size, both from the agreement."""
    assert shape.gap is not None
    gap, at = largest_gap(archive, shape)
    if abs(gap) <= FINEST:
        return
    x, y = view.project(at[None])[0]
    side = -1 if x > view.size[0] / 2 else 1
    factor, unit = length_unit(abs(gap))
    text = f"{gap / factor:+.3g} {unit}".replace("-", MINUS)
    _dot(pencil, np.array([x, y]), 6.0, Pen(INK, 1.1))
    anchor = "end" if side < 0 else "start"
    pencil.write(text, (x + 9 * side, y + 7), 13.0, "TITLE", anchor=anchor, bold=True, halo=PAPER)
