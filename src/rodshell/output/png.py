"""A drawing as PNG: lines by aggdraw, which draws soft edges; texts and the file by Pillow."""

from collections.abc import Sequence
from functools import lru_cache
from io import BytesIO
from zlib import Z_RLE

import numpy as np
from aggdraw import Brush, Draw
from aggdraw import Pen as Stroke
from PIL import Image, ImageDraw, ImageFont

from rodshell.arrays import Floats
from rodshell.errors import OutputError
from rodshell.output.drawing import BOLD, LAYERS, REGULAR, Drawing, Path, Text

CAP = 0.5  # pixels
LONGEST = 20_000.0  # drawing units, of which a picture is some 900 wide: lower letters cannot be drawn
COLOURS = 256  # of a file at most: a third of the bytes, and no colour off by more than a tenth
HALO = 2.0  # width of a text's halo, in drawing units


def drawing_png(drawing: Drawing, width: int = 1280) -> bytes:
    """A PNG file of a drawing.

    Parameters
    ----------
    drawing : paths and level texts; dashes, marks and angles of texts, which pictures do not have, are not drawn.
    width : of the image [pixels].
    """
    low, high = drawing.box()
    across, up = (high - low).tolist()
    if max(across, up) > LONGEST:
        raise OutputError(f"{drawing.title}: a point lies so far from the others that no picture can show both")
    scale = width / across
    corner = np.array([low[0], high[1]])
    size = (width, round(scale * up))
    canvas = Draw("RGB", size, "white")
    last, stroke = None, None
    for path, points in zip(drawing.paths, _lines(drawing.paths, corner, scale), strict=True):
        pen = drawing.pen(path)
        if path.closed and pen.fill:
            canvas.polygon(points, None, Brush(pen.fill))
        if pen.width:
            if pen is not last:
                last, stroke = pen, Stroke(pen.colour, scale * pen.width)
            canvas.line(points + points[:2] if path.closed else points, stroke)
    image = Image.frombytes("RGB", size, canvas.tobytes())
    letters = ImageDraw.Draw(image)
    for text in drawing.texts:
        _write(letters, text, _pixels(text.at, corner, scale), scale)
    if image.getcolors(COLOURS) is None:
        image = image.quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    return _png(image)


def _png(image: Image.Image) -> bytes:
    """A PNG file of an image, packed by run lengths: pictures are mostly paper."""
    file = BytesIO()
    image.save(file, "PNG", compress_type=Z_RLE)
    return file.getvalue()


def _lines(paths: Sequence[Path], corner: Floats, scale: float) -> list[list[float]]:
    """The points of each path in pixels, x, y, x, y, ...

    Open lines are CAP longer at both ends: where two meet, their soft ends would show as a seam.
    """
    pieces = [path.points for path in paths]
    count = np.array([*map(len, pieces)], dtype=np.intp)
    points = _pixels(np.concatenate([np.empty((0, 2)), *pieces]), corner, scale)
    stop = np.cumsum(count)
    still_open = (count > 1) & ~np.array([path.closed for path in paths], dtype=bool)
    first, last = (stop - count)[still_open], stop[still_open] - 1
    for end, inside in ((first, first + 1), (last, last - 1)):
        along = points[end] - points[inside]
        points[end] += CAP * along / np.maximum(np.linalg.norm(along, axis=1), 1e-9)[:, None]
    flat = points.ravel().tolist()
    return [flat[2 * (end - size) : 2 * end] for end, size in zip(stop.tolist(), count.tolist(), strict=True)]


def _pixels(points: Floats, corner: Floats, scale: float) -> Floats:
    """Points (..., 2), y up, as pixels from the upper left `corner`, y down."""
    return np.asarray(scale * (points - corner) * (1, -1))


def _write(letters: ImageDraw.ImageDraw, text: Text, at: Floats, scale: float) -> None:
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
def _font(bold: bool, size: float) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(str(BOLD if bold else REGULAR), size)
