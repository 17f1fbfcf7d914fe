"""A drawing as SVG, and what other SVG files are written with: elements, escaped texts, short numbers."""

from collections.abc import Iterator, Sequence
from functools import cache
from html import escape
from itertools import groupby
from math import degrees
from typing import Any

import numpy as np

from rodshell.output.drawing import LAYERS, PAPER, Drawing, Mark, Path, Pen, Text

SCALE = "1:1 in mm"  # of a drawing's file, after its title
_FLIP = np.array([1.0, -1.0])
SANS = "Inter, 'Helvetica Neue', Helvetica, Arial, 'Liberation Sans', 'DejaVu Sans Condensed', sans-serif"


def number(value: float, digits: int = 2) -> str:
    """A number with at most `digits` decimals, without zeros at its end: "2.5", "-0.01", "0"."""
    text = f"{value:.{digits}f}"
    if "." in text:
        text = text.rstrip("0").rstrip(".")
    return "0" if text == "-0" else text


def tag(name: str, *children: str, **attributes: Any) -> str:
    """An element.

    Args:
        attributes: "-" is written "_"; a "_" at the end, which Python's own words need, is dropped: `class_`.
    """
    words = [name]
    for key, value in attributes.items():
        shown = escape(value) if isinstance(value, str) else number(value, 3)
        attribute = key.rstrip("_").replace("_", "-")
        words.append(f'{attribute}="{shown}"')
    opening = " ".join(words)
    return f"<{opening}>{''.join(children)}</{name}>" if children else f"<{opening}/>"


def label(text: str, x: float, y: float, size: float, **attributes: Any) -> str:
    """One line of text, whose baseline begins at x, y, y down."""
    return tag("text", escape(text), x=x, y=y, font_size=size, **attributes)


def document(view: tuple[float, float, float, float], *children: str, unit: str = "") -> str:
    """A complete SVG file; `view` is x, y, width and height of its view box.

    Args:
        unit: of the file's size, which is that of the view box: "mm", or "" for pixels.
    """
    x, y, width, height = (number(value, 3) for value in view)
    body = "\n".join(child for child in children if child)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}{unit}" height="{height}{unit}" '
        f'viewBox="{x} {y} {width} {height}" font-family="{SANS}">\n{body}\n</svg>\n'
    )


def inline(svg: str) -> str:
    """A complete SVG as part of an HTML page, without namespace and size: the page sets the size."""
    head, rest = svg.split("viewBox", 1)
    return f"<svg viewBox{rest}" if head.startswith("<svg") else svg


def drawing_svg(drawing: Drawing) -> str:
    """An SVG file at true scale, a unit a millimetre; neighbours of one layer and pen are one path or group."""
    margin = 2 * drawing.text
    low, high = drawing.box()
    width, height = high - low + 2 * margin
    return document(
        (low[0] - margin, -high[1] - margin, width, height),
        tag("title", escape(f"{drawing.title}, {SCALE}")),
        tag("rect", x=low[0] - margin, y=-high[1] - margin, width=width, height=height, fill=PAPER),
        *_shapes(drawing),
        *(_text(text) for text in drawing.texts),
        unit="mm",
    )


def picture_document(drawing: Drawing) -> str:
    """An SVG file of a picture in units of about a pixel, y up, which has no scale."""
    low, high = drawing.box()
    view = (float(low[0]), float(-high[1]), *(high - low).tolist())
    return document(view, *_shapes(drawing), *(_text(text) for text in drawing.texts))


def _shapes(drawing: Drawing) -> Iterator[str]:
    """Neighbours of one layer and pen: as one path, or as a group where some have names or notes."""
    items: list[Path | Mark] = [*(path for path in drawing.paths if path.flat), *drawing.marks]
    for (layer, pen), group in groupby(items, key=lambda item: (item.layer, drawing.pen(item))):
        members = list(group)
        anonymous = [item for item in members if isinstance(item, Path) and not (item.name or item.note)]
        if len(anonymous) == len(members):
            yield tag("path", d=_data(anonymous), class_=layer, **_look(pen))
        else:
            shapes = [_path(item) if isinstance(item, Path) else _mark(item) for item in members]
            yield tag("g", *shapes, class_=layer, **_look(pen))


def _data(paths: Sequence[Path]) -> str:
    """Data of paths without names, to 0.01 of a unit; zeros have no sign."""
    points = np.round(np.concatenate([path.points for path in paths]) * _FLIP, 2) + 0.0
    return "".join([_data_of(len(path.points), path.closed) for path in paths]) % tuple(points.ravel().tolist())


@cache
def _data_of(count: int, closed: bool) -> str:
    """The format of the data of a path with so many points; 14 digits show no more than was rounded to."""
    return f"M{'L'.join(['%.14g %.14g'] * count)}{'Z' if closed else ''}"


def _look(pen: Pen) -> dict[str, Any]:
    look: dict[str, Any] = {"fill": pen.fill or "none"}
    if pen.width:
        look |= {"stroke": pen.colour, "stroke_width": number(pen.width, 4), "stroke_linejoin": "round"}
        look["stroke_linecap"] = "butt" if pen.dash else "round"
    if pen.dash:
        look["stroke_dasharray"] = " ".join(number(dash, 3) for dash in pen.dash)
    return look


def _path(path: Path) -> str:
    named = {"data_rod": path.name} if path.name else {}
    inside = [tag("title", escape(path.note))] if path.note else []
    if len(path.points) == 2:
        (x1, y1), (x2, y2) = path.points.tolist()
        return tag("line", *inside, x1=x1, y1=-y1, x2=x2, y2=-y2, **named)
    shape = " ".join(f"{number(x, 3)},{number(-y, 3)}" for x, y in path.points.tolist())
    return tag("polygon" if path.closed else "polyline", *inside, points=shape, **named)


def _mark(mark: Mark) -> str:
    inside = [tag("title", escape(mark.note))] if mark.note else []
    x, y = mark.at.tolist()
    return tag("circle", *inside, cx=x, cy=-y, r=mark.radius)


def _text(text: Text) -> str:
    look: dict[str, Any] = {"fill": text.colour or LAYERS[text.layer].colour}
    if text.anchor != "start":
        look["text_anchor"] = text.anchor
    if text.bold:
        look["font_weight"] = "600"
    if text.halo:
        look |= {"stroke": text.halo, "stroke_width": "4", "stroke_linejoin": "round", "paint_order": "stroke"}
    x, y = text.at.tolist()
    if text.angle:
        look["transform"] = f"rotate({number(-degrees(text.angle), 3)} {number(x, 3)} {number(-y, 3)})"
    return label(text.text, x, -y, text.size, **look)
