"""Pictures of a shape in space: its rods, near ones over far ones, coloured by gap or stress; as SVG and PNG.

The view is axonometric: from the right, the front and above, without perspective.
"""

from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.bounds import bounds
from rodshell.output import grid
from rodshell.output.colour_scale import FINEST, Colour, Scale, colour_bar, largest_gap, mixed, scale_of
from rodshell.output.drawing import FAMILIES, Drawing, Path, Pen, Pencil
from rodshell.output.grid import STAGE, Shape
from rodshell.output.svg import number, picture_document
from rodshell.results.archive import Archive, made_once
from rodshell.results.states import DRAPED, POPPED, is_shell, shells_among
from rodshell.results.wording import MINUS, UNDER, nice_ticks, shown_length
from rodshell.rods.supports import clamped_among

AZIMUTH, ELEVATION = np.radians(-62.0), np.radians(27.0)  # of the eye
_C, _S, _CE, _SE = np.cos(AZIMUTH), np.sin(AZIMUTH), np.cos(ELEVATION), np.sin(ELEVATION)
RIGHT = np.array([-_S, _C, 0.0])
UP = np.array([-_SE * _C, -_SE * _S, _CE])
TOWARDS = np.array([_CE * _C, _CE * _S, _SE])


@dataclass(frozen=True, eq=False)
class View:
    """A box in space [m] drawn `width` units wide.

    Args:
        low, high: (3,) corners of the box [m].
        shift: (2,) added to the projected coordinates, so that the box's upper left corner is (0, 0).
        size: (2,) width and height of the drawn box.
    """

    low: Floats
    high: Floats
    scale: float
    shift: Floats
    size: Floats

    @staticmethod
    def of(points: Floats, width: float) -> "View":
        """The view of all points (n, 3) [m] and of the ground below them."""
        low, high = bounds(points)
        corners = np.array([[x, y, low[2]] for x in (low[0], high[0]) for y in (low[1], high[1])])
        corners = np.concatenate([corners, points])
        plane = np.column_stack([corners @ RIGHT, corners @ UP])
        left_bottom, right_top = bounds(plane)
        spread = right_top - left_bottom
        scale = width / max(spread[0], 1e-12)
        left_top = np.array([left_bottom[0], right_top[1]])
        return View(low, high, float(scale), -scale * left_top, scale * spread)

    def project(self, points: Floats) -> Floats:
        """(n, 2) drawing coordinates, y up, of the points (n, 3) [m]."""
        return np.asarray(self.scale * np.column_stack([points @ RIGHT, points @ UP]) + self.shift)

    def depth(self, points: Floats) -> Floats:
        """(n,) nearness of the points to the eye, 0 (far) to 1 (near)."""
        if not len(points):
            return np.empty(0)
        nearness = points @ TOWARDS
        return np.asarray((nearness - nearness.min()) / max(np.ptp(nearness), 1e-12))


def ground_axes(pencil: Pencil, view: View, colour: str, text: float) -> None:
    """The box's ground with millimetre ticks on its front edges, and the height on the left."""
    (x0, y0, z0), (x1, y1, z1) = view.low, view.high
    thin, pale = Pen(colour, 0.8), Pen(mixed(colour, "#ffffff", 0.55), 0.8)
    corners = np.array([[x0, y0, z0], [x1, y0, z0], [x1, y1, z0], [x0, y1, z0]])
    pencil.line(view.project(corners), "DIM", closed=True, pen=pale)
    span = 0.02 * max(x1 - x0, y1 - y0)

    def ticks(axis: int, start: list[float], out: list[float], count: int, above: float = -np.inf) -> None:
        """Short lines outwards from places along an axis through `start`, and these in mm beyond them."""
        for value in nice_ticks(1e3 * view.low[axis], 1e3 * view.high[axis], count):
            if value > above:
                at, off = np.where(np.arange(3) == axis, 1e-3 * value, start), np.array(out)
                a, b, c = view.project(np.array([at, at + off, at + 2.6 * off]))
                anchor = "end" if b[0] < a[0] - 1 else "start" if b[0] > a[0] + 1 else "middle"
                pencil.line([a, b], "DIM", pen=thin)
                shown = number(value).replace("-", MINUS)
                pencil.write(shown, c - (0, 0.35 * text), text, "DIM", anchor=anchor, colour=colour)

    ticks(0, [x0, y0, z0], [0, -span, 0], 5)
    ticks(1, [x1, y0, z0], [span, 0, 0], 5)
    middle = np.array([[(x0 + x1) / 2, y0 - 8 * span, z0], [x1 + 8 * span, (y0 + y1) / 2, z0]])
    for name, at in zip("xy", view.project(middle), strict=True):
        pencil.write(f"{name}, mm", at - (0, 0.35 * text), text, "DIM", anchor="middle", colour=colour)
    if z1 - z0 > span:
        foot, top = view.project(np.array([[x0, y0, z0], [x0, y0, z1]]))
        pencil.line([foot, top], "DIM", pen=thin)
        pencil.write("z, mm", top + (0, 0.8 * text), text, "DIM", anchor="middle", colour=colour)
        ticks(2, [x0, y0, z0], [-0.6 * span, -0.6 * span, 0], 3, above=1e3 * (z0 + 0.05 * (z1 - z0)))


Polylines = list[list[tuple[int, slice]]]

WIDTH = 540.0  # drawing units of the shell itself
SIDE, TOP, BELOW, BAR = 50.0, 22.0, 40.0, 28.0  # margins; the colour bar needs more below
FRAMES, COLUMNS, GUTTER, CAPTION = 6, 3, 14.0, 34.0  # shapes of the deployment: all, a row; room at the sides, below
PAPER, INK, SOFT, GROUND = "#fdfdfb", "#22282f", "#7b838a", "#f1efe8"
DEPTHS = 20  # layers of depth: rods of a nearer layer pass over those of a farther one,
LAG = 2  # and are set off against those so many layers farther: rods that meet at a joint do not cut each other
PIECE = 5.0  # drawing units: about the length of a piece, or of an edge that is longer; finer ones make files large
LEVEL = 0.01  # of its width: an outline that rises more is not filled, which would look like a surface
FADE = 0.42  # share of paper in the colour of the farthest rods


def picture_svg(archive: Archive, state: str, colour: Colour = "gap") -> str:
    """A picture of "flat", "draped", "popped_pinned", "popped_clamped" or "stage_1", ... as a complete SVG.

    All final shapes share one view, as the stages of the deployment do, and all shapes one colour scale.

    Args:
        colour: of the rods: "gap" to the target (without a target: height), or "stress".

    Raises:
        OutputError: the archive has no such state.
    """
    return picture_document(picture(archive, state, colour))


@made_once
def picture(archive: Archive, state: str, colour: Colour = "gap") -> Drawing:
    """The same as a drawing in units of about a pixel, y up, on a ground of paper; laid out once for every format."""
    shape = grid.shape_of(archive, state)
    points, view = shape.positions, _view(archive, shape)
    scale = scale_of(archive, shape, colour)
    pencil = Pencil()
    ends = grid.end_nodes(grid.meshed_rods(archive))
    front = view.depth(points[ends]) > 0.5
    ground_axes(pencil, view, SOFT, 12.5)
    _ground_curves(pencil, view, shape, archive)
    drawn = _Rods.of(archive, view, shape, scale)
    drawn.draw(pencil, range(DEPTHS // 2))
    _supports(pencil, view, points[ends[~front]], state, len(ends))
    drawn.draw(pencil, range(DEPTHS // 2, DEPTHS))
    _supports(pencil, view, points[ends[front]], state, len(ends))
    if colour == "gap" and shape.gap is not None and scale is not None:
        _largest(pencil, archive, shape, view)
    if scale is not None:
        colour_bar(pencil, scale, WIDTH, -float(view.size[1]) - BELOW - BAR + 10)
    width, height = view.size + (2 * SIDE, TOP + BELOW + (0.0 if shape.flat else BAR))
    return _on_paper(pencil.done(state, shape.caption, 12.5), width, height)


MODE = 0.06  # of the shell's width: the largest displacement of a mode as it is drawn


def mode_picture(archive: Archive, ends: str, state: str) -> Drawing:
    """A mode, an array (n, 3) of the states, drawn as displacements of the shell over the shell as it stands."""
    shape, pencil = grid.shape_of(archive, POPPED + ends), Pencil()
    motion = archive.states[state]
    size = MODE * float(np.ptp(shape.positions[:, 0]))
    moved = replace(shape, positions=shape.positions + size * motion / max(float(np.abs(motion).max()), 1e-300))
    view = View.of(np.concatenate([shape.positions, moved.positions]), WIDTH)
    still = _Rods.of(archive, view, shape, None)
    replace(still, palette=[mixed(SOFT, PAPER, 0.6)] * len(still.palette)).draw(pencil, range(DEPTHS), halos=False)
    _Rods.of(archive, view, moved, None).draw(pencil, range(DEPTHS), halos=False)
    return _on_paper(pencil.done(state, "Mode", 12.5), WIDTH + 2 * SIDE, float(view.size[1]) + TOP + BELOW)


def deployment_picture(archive: Archive) -> Drawing:
    """The way from flat to popped up in FRAMES shapes side by side, coloured as of `picture`."""
    known = grid.shape_names(archive)
    names = [name for name in known if name.startswith(STAGE) or name in ("flat", archive.deployed)]
    chosen = np.unique(np.rint(np.linspace(0, len(names) - 1, FRAMES)).astype(int))
    view, whole, last = _view_of(archive, stages=True), Pencil(), None
    width = WIDTH + 2 * SIDE
    share = (width - 2 * GUTTER) / COLUMNS / WIDTH
    cell = np.array([share * WIDTH, -share * float(view.size[1]) - CAPTION])
    for k, name in enumerate(names[entry] for entry in chosen):
        shape, ground = grid.deployed_shape(archive, name), Pencil()
        scale = scale_of(archive, shape, "stress")
        last = scale or last
        _ground_curves(ground, view, shape, archive)
        corner = cell * (k % COLUMNS, k // COLUMNS) + (GUTTER - SIDE, 0.0)
        whole.paths += ground.done("", "", 12.5).placed(share, corner).paths
        drawn = _Rods.of(archive, view, shape, scale, share)
        drawn = replace(drawn, plane=share * drawn.plane + corner, pen=share * drawn.pen)
        drawn.draw(whole, range(DEPTHS), halos=False)
        middle = corner[0] + share * float(view.project(shape.positions)[:, 0].mean())
        words = shape.caption.partition(",")[0]
        whole.write(words, (middle, corner[1] + cell[1] + 0.6 * CAPTION), 12.5, "TITLE", anchor="middle")
    bottom = float(cell[1]) * -(-len(chosen) // COLUMNS)
    if last is not None:
        bottom -= BAR + 10.0
        colour_bar(whole, replace(last, caption=last.caption.partition(",")[0]), WIDTH, bottom)
    return _on_paper(whole.done("pop_up", "Deployment", 12.5), width, 2 * TOP - bottom)


def _on_paper(drawing: Drawing, width: float, height: float) -> Drawing:
    """The drawing on a rectangle of paper whose upper left corner is (-SIDE, TOP)."""
    corners = [(-SIDE, TOP), (width - SIDE, TOP), (width - SIDE, TOP - height), (-SIDE, TOP - height)]
    paper = Pencil()
    paper.line(corners, "TITLE", closed=True, pen=Pen(PAPER, 0.0, fill=PAPER))
    return paper.done(drawing.name, drawing.title, 12.5) + drawing


def _view(archive: Archive, shape: Shape) -> View:
    """One view for all shapes in space, and one for the flat grid; stages spread further than the final shell."""
    if shape.flat:
        return View.of(shape.positions, WIDTH)
    return _view_of(archive, stages=not is_shell(shape.name))


@made_once
def _view_of(archive: Archive, *, stages: bool) -> View:
    shells = [archive.states[name] for name in shells_among(archive.states)]
    return View.of(np.concatenate([*shells, *(archive.states["history"] if stages else ())]), WIDTH)


def _pieces(archive: Archive, length: float) -> tuple[Ints, Ints, Ints]:
    """Entries (d,) of `rod_nodes` that are drawn, at which of them each piece (s,) of a rod to the next begins, and the
    index (s,) of its rod. A piece has about a length [m]: of rods with shorter edges, nodes are left out evenly."""
    rods = grid.meshed_rods(archive)
    whole, edges = sum(rod.length for rod in rods), sum(len(rod.nodes) - 1 for rod in rods)
    stride = max(1, round(length * edges / max(whole, 1e-12)))
    drawn, owner, first = list[int](), list[int](), 0
    for k, rod in enumerate(rods):
        last = first + len(rod.nodes) - 1
        chosen = [*range(first, last, stride), last]
        drawn += chosen
        owner += [k] * len(chosen)
        first = last + 1
    of_rod = np.array(owner, dtype=np.intp)
    begins = np.flatnonzero(of_rod[1:] == of_rod[:-1])
    return np.array(drawn, dtype=np.intp), begins, of_rod[begins]


@dataclass(frozen=True, eq=False)
class _Rods:
    """The rods of a picture, layer by layer.

    Args:
        plane: (d, 2) the drawn nodes.
        halos, lines: by layer, the farthest first: indices in the palette, and drawn nodes of polylines.
        fade: share of paper in the farthest colours.
        pen: width of the rods in the middle [drawing units].
    """

    plane: Floats
    halos: Polylines
    lines: Polylines
    palette: list[str]
    fade: float
    pen: float

    @staticmethod
    def of(archive: Archive, view: View, shape: Shape, scale: Scale | None, share: float = 1.0) -> "_Rods":
        """Of a shape, whose lengths are drawn at a share of the view's scale."""
        rods, (drawn, first, of_rod) = grid.meshed_rods(archive), _pieces(archive, PIECE / (share * view.scale))
        nodes = archive.states["rod_nodes"][drawn]
        nearness = view.depth(shape.positions)[nodes]
        near = 0.5 * (nearness[first] + nearness[first + 1])
        layer = np.minimum((near * DEPTHS).astype(np.intp), DEPTHS - 1)
        if scale is None:
            families = grid.family_numbers(rod.family for rod in rods)
            shade = (np.array(families, dtype=np.intp) % len(FAMILIES))[of_rod]
            palette, fade = list(FAMILIES), 0.0 if shape.flat else FADE
        else:
            bins = scale.bins[drawn]
            shade = np.rint(0.5 * (bins[first] + bins[first + 1])).astype(np.intp)
            palette, fade = scale.palette, FADE
        pen = float(np.clip(0.12 * WIDTH / max(len(rods), 1), 0.45, 1.7))
        halos, lines = (_polylines(first, layer, shades) for shades in (np.zeros_like(shade), shade))
        return _Rods(view.project(shape.positions)[nodes], halos, lines, palette, fade, pen)

    def draw(self, pencil: Pencil, layers: range, *, halos: bool = True) -> None:
        """Some layers from far to near, each over halos of paper that set off what passes over it and farther ones."""
        for depth in layers:
            for nearer in range(0 if depth == 0 else depth + LAG, min(depth + LAG + 1, DEPTHS) if halos else 0):
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
    return (depth + 0.5) / DEPTHS


def _polylines(first: Ints, layer: Ints, shade: Ints) -> Polylines:
    """Pieces that follow each other on a rod in one layer and shade as one; the shades of a layer ascend."""
    order = np.lexsort((shade, layer))
    first, layer, shade = first[order], layer[order], shade[order]
    ends = np.flatnonzero((np.diff(layer) != 0) | (np.diff(shade) != 0) | (np.diff(first) > 1))
    begin, end = (np.concatenate(parts)[: len(first)] for parts in (([0], ends + 1), (ends, [len(first) - 1])))
    columns = (layer[begin], shade[begin], first[begin], first[end] + 2)
    lines: Polylines = [[] for _ in range(DEPTHS)]
    for depth, colour, low, high in zip(*(column.tolist() for column in columns), strict=True):
        lines[depth].append((colour, slice(low, high)))
    return lines


def _ground_curves(pencil: Pencil, view: View, shape: Shape, archive: Archive) -> None:
    """The boundary: closed curves through the rods' ends, openings on top of what they open."""
    rods = grid.meshed_rods(archive)
    ends = grid.end_nodes(rods)
    for loop in grid.outlines_of(archive) if rods else ():
        outline = shape.positions[ends[loop]]
        fill = ""
        if np.ptp(outline[:, 2]) < LEVEL * np.ptp(outline[:, :2]):
            fill = PAPER if grid.opens(np.array([rod.flat for rod in rods]).reshape(-1, 2)[loop]) else GROUND
        pencil.line(view.project(outline), "BOUNDARY-FINAL", closed=True, pen=Pen(SOFT, 1.0, fill=fill))


def _supports(pencil: Pencil, view: View, ends: Floats, state: str, count: int) -> None:
    """Some of a shell's `count` rod ends: rings where they turn freely, discs where they are clamped."""
    if state in ("flat", DRAPED):
        return
    radius = float(np.clip(200 / count, 0.6, 2.6))
    fill = INK if clamped_among([state.removeprefix(POPPED)]) else PAPER
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
    size = shown_length(archive.results)(1e-3 * abs(gap))
    text = size if size.startswith(UNDER) else f"{MINUS if gap < 0 else '+'}{size}"
    _dot(pencil, np.array([x, y]), 6.0, Pen(INK, 1.1))
    anchor = "end" if side < 0 else "start"
    pencil.write(text, (x + 9 * side, y + 7), 13.0, "TITLE", anchor=anchor, bold=True, halo=PAPER)
