"""A drawing as PNG: lines by aggdraw, which draws soft edges, texts and the file by Pillow."""

from collections.abc import Sequence
from functools import lru_cache
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from rodshell.arrays import Floats
from rodshell.output.drawing import LAYERS, Drawing, Path, Text
from rodshell.output.fonts import BOLD, REGULAR

if TYPE_CHECKING:
    from PIL.ImageDraw import ImageDraw
    from PIL.ImageFont import FreeTypeFont

CAP = 0.5  # pixels
HALO = 2.0  # width of a text's halo, in drawing units


def drawing_png(drawing: Drawing, width: int = 1280) -> bytes:
    """A PNG file of a drawing.

    Parameters
    ----------
    drawing : paths and level texts; dashes, marks and angles of texts, which pictures do not have, are not drawn.
    width : of the image [pixels].
    """
    from aggdraw import Brush, Draw
    from aggdraw import Pen as Stroke
    from PIL import Image, ImageDraw

    low, high = drawing.box()
    scale = width / float(high[0] - low[0])
    corner = np.array([low[0], high[1]])
    image = Image.new("RGB", (width, round(scale * float(high[1] - low[1]))), "white")
    canvas = Draw(image)
    for path, points in zip(drawing.paths, _lines(drawing.paths, corner, scale), strict=True):
        pen = drawing.pen(path)
        if path.closed and pen.fill:
            canvas.polygon(points, None, Brush(pen.fill))
        if pen.width:
            canvas.line(points + points[:2] if path.closed else points, Stroke(pen.colour, scale * pen.width))
    canvas.flush()
    letters = ImageDraw.Draw(image)
    for text in drawing.texts:
        _write(letters, text, _pixels(text.at, corner, scale), scale)
    stream = BytesIO()
    image.save(stream, "PNG", compress_level=3)
    return stream.getvalue()


def _lines(paths: Sequence[Path], corner: Floats, scale: float) -> list[list[float]]:
    """The points of each path in pixels, x, y, x, y, ...

    Open lines are CAP longer at both ends: where two meet, their soft ends would show as a seam.
    """
    count = np.array([len(path.points) for path in paths])
    points = _pixels(np.concatenate([np.empty((0, 2)), *(path.points for path in paths)]), corner, scale)
    stop = np.cumsum(count)
    still_open = np.array([not path.closed and len(path.points) > 1 for path in paths])
    first, last = (stop - count)[still_open], stop[still_open] - 1
    for end, inside in ((first, first + 1), (last, last - 1)):
        along = points[end] - points[inside]
        points[end] += CAP * along / np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
    flat = points.ravel().tolist()
    return [flat[2 * (end - size) : 2 * end] for end, size in zip(stop.tolist(), count.tolist(), strict=True)]


def _pixels(points: Floats, corner: Floats, scale: float) -> Floats:
    """Points (..., 2), y up, as pixels from the upper left `corner`, y down."""
    return np.asarray(scale * (points - corner) * (1, -1))


def _write(letters: "ImageDraw", text: Text, at: Floats, scale: float) -> None:
    letters.text(
        tuple(at.tolist()),
        text.text,
        fill=text.colour or LAYERS[text.layer].colour,
        font=_font(text.bold, scale * text.size),
        anchor={"start": "ls", "middle": "ms", "end": "rs"}[text.anchor],
        stroke_width=round(HALO * scale) if text.halo else 0,
        stroke_fill=text.halo or None,
    )


@lru_cache(maxsize=16)
def _font(bold: bool, size: float) -> "FreeTypeFont":
    from PIL import ImageFont

    return ImageFont.truetype(str(BOLD if bold else REGULAR), size)
