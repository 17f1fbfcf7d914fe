"""A drawing: paths, marks and texts on named layers, y up [mm]. DXF, SVG, PDF and PNG are written from it."""

import pathlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from math import cos, sin
from typing import Literal, NamedTuple, TypeVar

import numpy as np

from rodshell.arrays import Floats
from rodshell.geometry.bounds import bounds

_Anchor = Literal["start", "middle", "end"]
T = TypeVar("T", float, Floats)

INK, SOFT, PALE, PAPER = "#22282f", "#6c757d", "#c9ced3", "#ffffff"
FAMILIES = ("#1f5f8b", "#a8552a", "#2b7a4b")  # of the rods of a grid's first, second and third family
LETTER = 0.62  # width of a capital or digit over the text size
TEXT = 3.43  # mm: size of usual texts on paper, whose capitals are 2.5 mm high, the usual nominal size of ISO 3098
SMALL = 0.75  # size of the smallest texts over the usual one: where capitals are 2.5 mm high, these have 1.9 mm
LINE = 0.95  # height of a line of text over its size, a little air included,
BELOW = 0.2  # of which this much is below its baseline

# The typeface of PDF and PNG: DejaVu Sans Condensed 2.37, unchanged, under the licence in fonts/LICENSE.txt. It covers
# Latin, Greek and Cyrillic, and is about as wide as Helvetica, in which browsers and CAD programs show the same
# drawings. System fonts are never used, so that files are the same on every computer.
_FONTS = pathlib.Path(__file__).with_name("fonts")
REGULAR, BOLD = (_FONTS / f"DejaVuSansCondensed{weight}.ttf" for weight in ("", "-Bold"))
CAPITAL = 0.729  # height of a capital over the text size


@dataclass(frozen=True)
class Layer:
    """How a layer looks.

    Args:
        colour: "#rrggbb".
        pen: width of its lines [mm of paper].
        number: of the colour in AutoCAD's table.
        dash: lengths of a dash and of the gap after it [mm of paper]; empty: lines are solid.
    """

    colour: str
    pen: float
    number: int
    dash: tuple[float, ...] = ()


LAYERS = {
    "CUT": Layer(INK, 0.35, 7),
    "MARK": Layer("#b3372c", 0.18, 1),
    "LABEL": Layer(INK, 0.13, 3),
    "BOUNDARY-FLAT": Layer("#8f8a7c", 0.25, 5, (3.0, 1.5)),
    "BOUNDARY-FINAL": Layer("#1f5f8b", 0.25, 6),
    "DIM": Layer(SOFT, 0.13, 8),
    "TITLE": Layer(INK, 0.18, 7),
}
FORBIDDEN = '<>/\\":;?*|=`,'  # in a layer's name [DXF reference]


class Pen(NamedTuple):
    """How a path or mark looks that does not look like its layer.

    Args:
        colour: of the line, "#rrggbb".
        width: of the line [mm]; 0: there is none.
        dash: lengths of dashes and gaps in turn [mm].
        fill: colour of the inside; "": it is not filled.
    """

    colour: str
    width: float
    dash: tuple[float, ...] = ()
    fill: str = ""


class Path(NamedTuple):
    """A polyline.

    Args:
        points: (k, 2) [mm], or (k, 3) in space, which only DXF shows.
        layer: a key of `LAYERS`.
        pen: None: that of the layer.
        name: the rod that it stands for; note : shown where the pointer is, in SVG.
    """

    points: Floats
    layer: str
    closed: bool = False
    pen: Pen | None = None
    name: str = ""
    note: str = ""

    @property
    def flat(self) -> bool:
        return bool(self.points.shape[1] == 2)


class Mark(NamedTuple):
    """A circle.

    Args:
        at: (2,) its middle [mm].
        radius: [mm].
        layer, pen, note: as of `Path`.
    """

    at: Floats
    radius: float
    layer: str
    pen: Pen | None = None
    note: str = ""


class Text(NamedTuple):
    """One line of text.

    Args:
        at: (2,) where its baseline starts, is centred or ends, as `anchor` says [mm].
        size: of the font [mm].
        angle: of the baseline against x [rad].
        colour: "": that of the layer.
        halo: colour of a rim that sets it off against lines behind it; "": none. PDF and DXF have none.
    """

    text: str
    at: Floats
    size: float
    layer: str
    anchor: _Anchor = "start"
    angle: float = 0.0
    bold: bool = False
    colour: str = ""
    halo: str = ""

    def box(self) -> Floats:
        """(4, 2) corners of the room that it takes [mm], each letter taken as wide as a broad one."""
        x, y = self.at.tolist()
        return np.array(corners(x, y, cos(self.angle), sin(self.angle), self.size, len(self.text), BACK[self.anchor]))


BACK: dict[_Anchor, float] = {"start": 0.0, "middle": -0.5, "end": -1.0}  # where a text begins, in its widths


def corners(x: T, y: T, c: T, s: T, size: T, letters: T, back: T) -> list[tuple[T, T]]:
    """x and y of the four corners of a text's room, or of many: of numbers, or of arrays (t,).

    Args:
        c, s: cosine and sine of the angle of its baseline.
        back: where it begins, see `BACK`.
    """
    width = LETTER * size * letters
    left = back * width
    right, low, high = left + width, -BELOW * size, (LINE - BELOW) * size
    return [(x + c * u - s * v, y + s * u + c * v) for u, v in ((left, low), (right, low), (right, high), (left, high))]


@dataclass(frozen=True)
class Drawing:
    """A drawing.

    Args:
        text: usual size of its texts [mm]; pens are as wide as on paper with texts of the size TEXT.
        left_out: what found no room, in words.
    """

    name: str
    title: str
    text: float
    paths: tuple[Path, ...] = ()
    marks: tuple[Mark, ...] = ()
    texts: tuple[Text, ...] = ()
    left_out: tuple[str, ...] = ()

    def pen(self, item: Path | Mark) -> Pen:
        """The item's own pen, or that of its layer."""
        return self._pens[item.layer] if item.pen is None else item.pen

    @cached_property
    def _pens(self) -> dict[str, Pen]:
        """The pen of each layer."""
        wide = self.pen_scale
        return {
            name: Pen(layer.colour, wide * layer.pen, tuple(wide * dash for dash in layer.dash))
            for name, layer in LAYERS.items()
        }

    @property
    def pen_scale(self) -> float:
        """Width of its lines over that of the same lines on paper."""
        return self.text / TEXT

    def box(self) -> tuple[Floats, Floats]:
        """Lowest and highest x and y (2,), (2,) of all that is in the plane [mm]."""
        return self._box

    @cached_property
    def _box(self) -> tuple[Floats, Floats]:
        cloud = np.concatenate([corner for extents in self._extents for corner in extents])
        return bounds(cloud) if len(cloud) else (np.zeros(2), np.ones(2))

    @cached_property
    def _extents(self) -> tuple[tuple[Floats, Floats], ...]:
        """Lowest and highest x and y (n, 2), (n, 2) of each path in the plane, each mark and each text's room [mm]."""
        paths = [path.points for path in self.paths if path.flat]
        starts = np.cumsum([0, *map(len, paths)])[:-1]
        points = np.concatenate([np.empty((0, 2)), *paths])
        at = np.array([mark.at for mark in self.marks]).reshape(-1, 2)
        radius = np.array([mark.radius for mark in self.marks]).reshape(-1, 1)
        rows = [(*t.at.tolist(), cos(t.angle), sin(t.angle), t.size, len(t.text), BACK[t.anchor]) for t in self.texts]
        boxes = np.array(corners(*np.array(rows).reshape(-1, 7).T))
        return (
            (np.minimum.reduceat(points, starts), np.maximum.reduceat(points, starts)),
            (at - radius, at + radius),
            (boxes.min(axis=0).T, boxes.max(axis=0).T),
        )

    def placed(self, scale: float, shift: Floats) -> "Drawing":
        """The drawing scaled about the origin, with pens and texts, then shifted (2,) [mm]; without paths in space."""

        def moved(points: Floats) -> Floats:
            return np.asarray(scale * points + shift)

        def pen(item: Path | Mark) -> Pen | None:
            look = item.pen
            return look and look._replace(width=scale * look.width, dash=tuple(scale * dash for dash in look.dash))

        return replace(
            self,
            text=scale * self.text,
            paths=tuple(path._replace(points=moved(path.points), pen=pen(path)) for path in self.paths if path.flat),
            marks=tuple(
                mark._replace(at=moved(mark.at), radius=scale * mark.radius, pen=pen(mark)) for mark in self.marks
            ),
            texts=tuple(text._replace(at=moved(text.at), size=scale * text.size) for text in self.texts),
        )

    def clipped(self, low: Floats, high: Floats) -> "Drawing":
        """The part within the rectangle from `low` to `high` (2,) [mm]; paths in space are left out, and marks and
        texts that cross its border."""
        flat = [path for path in self.paths if path.flat]
        extents = self._extents
        inside, marks, texts = (np.all((lowest >= low) & (highest <= high), axis=1) for lowest, highest in extents)
        near = np.all((extents[0][1] >= low) & (extents[0][0] <= high), axis=1)
        paths = list[Path]()
        for path, whole in compress(zip(flat, inside.tolist(), strict=True), near):
            if whole:
                paths.append(path)
            else:
                points = np.vstack([path.points, path.points[:1]]) if path.closed else path.points
                paths += [path._replace(points=part, closed=False) for part in _inside(points, low, high)]
        return replace(
            self, paths=tuple(paths), marks=tuple(compress(self.marks, marks)), texts=tuple(compress(self.texts, texts))
        )

    def __add__(self, other: "Drawing") -> "Drawing":
        """This one with the other's content on top."""
        return replace(
            self, paths=self.paths + other.paths, marks=self.marks + other.marks, texts=self.texts + other.texts,
            left_out=self.left_out + other.left_out,
        )  # fmt: skip


@dataclass
class Pencil:
    """Collects the parts of a drawing; `look` are further fields of `Path`, `Mark` and `Text`."""

    paths: list[Path] = field(default_factory=list)
    marks: list[Mark] = field(default_factory=list)
    texts: list[Text] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)

    def line(self, points: Iterable[Iterable[float]], layer: str, **look: object) -> None:
        """Add a polyline of points (k, 2), or (k, 3) in space [mm]."""
        self.paths.append(Path(np.array(points, dtype=float), layer, **look))  # type: ignore[arg-type]

    def mark(self, at: Iterable[float], radius: float, layer: str, **look: object) -> None:
        """Add a circle about `at` (2,) [mm]."""
        self.marks.append(Mark(np.array(at, dtype=float), radius, layer, **look))  # type: ignore[arg-type]

    def write(self, text: str, at: Iterable[float], size: float, layer: str, **look: object) -> None:
        """Add a line of text; `at` (2,) [mm] as of `Text`."""
        self.texts.append(Text(text, np.array(at, dtype=float), size, layer, **look))  # type: ignore[arg-type]

    def leave_out(self, count: int, of: int, what: str) -> None:
        """Record that `count` of such texts found no room, in words; nothing for 0."""
        if count:
            self.left_out.append(f"{'all' if count == of > 1 else count} of {of} {what}")

    def done(self, name: str, title: str, text: float) -> Drawing:
        """The drawing of all that was added, `text` being the usual size of its texts [mm]."""
        return Drawing(name, title, text, tuple(self.paths), tuple(self.marks), tuple(self.texts), tuple(self.left_out))


def within(box: Floats, low: Floats, high: Floats) -> bool:
    """Whether all points (k, 2) lie in the rectangle from `low` to `high` (2,)."""
    (left, bottom), (right, top) = low.tolist(), high.tolist()
    return all(left <= x <= right and bottom <= y <= top for x, y in box.tolist())


def _inside(points: Floats, low: Floats, high: Floats) -> Iterator[Floats]:
    """The pieces of a polyline (k, 2) inside a rectangle."""
    from ezdxf.math import Vec2  # here, as few drawings are cut into sheets
    from ezdxf.math.clipping import ClippingRect2d

    window = ClippingRect2d(Vec2(low.tolist()), Vec2(high.tolist()))
    for piece in window.clip_polyline(Vec2.list(points.tolist())):
        yield np.array([(point.x, point.y) for point in piece])
