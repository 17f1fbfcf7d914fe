"""A drawing as PNG, by Pillow: lines are drawn larger and reduced, which softens their edges."""

from functools import lru_cache
from io import BytesIO
from zlib import Z_RLE

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from rodshell.arrays import Floats
from rodshell.errors import OutputError
from rodshell.output.drawing import BOLD, LAYERS, REGULAR, Drawing, Text

_LARGER = 3  # times, while lines are drawn
LONGEST = 20_000.0  # drawing units, of which a picture is some 900 wide: lower letters cannot be drawn
COLOURS = 256  # of a file at most: a third of the bytes, and no colour off by more than a tenth
_HALO = 2.0  # width of a text's halo, in drawing units


def drawing_png(drawing: Drawing, width: int = 1280) -> bytes:
    """A PNG file of a drawing.

    Args:
        drawing: paths and level texts; dashes, marks and angles of texts, which pictures do not have, are not drawn.
        width: of the image [pixels].
    """
    low, high = drawing.box()
    across, up = (high - low).tolist()
    if max(across, up) > LONGEST:
        raise OutputError(f"{drawing.title}: a point lies so far from the others that no picture can show both")
    scale = width / across
    corner = np.array([low[0], high[1]])
    size = (width, round(scale * up))
    drawn = Image.new("RGB", (_LARGER * size[0], _LARGER * size[1]), "white")
    canvas = ImageDraw.Draw(drawn)
    for path in drawing.paths:
        pen, points = drawing.pen(path), [*map(tuple, _pixels(path.points, corner, _LARGER * scale).tolist())]
        if path.closed and pen.fill:
            canvas.polygon(points, fill=pen.fill)
        if pen.width:
            points += points[:1] if path.closed else []
            canvas.line(points, pen.colour, max(1, round(_LARGER * scale * pen.width)), joint="curve")
    image = drawn.resize(size, Image.Resampling.BOX)
    letters = ImageDraw.Draw(image)
    for text in drawing.texts:
        _write(letters, text, _pixels(text.at, corner, scale), scale)
    if image.getcolors(COLOURS) is None:
        image = image.quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
    file = BytesIO()
    image.save(file, "PNG", compress_type=Z_RLE)  # by run lengths: pictures are mostly paper
    return file.getvalue()


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
        stroke_width=round(_HALO * scale) if text.halo else 0,
        stroke_fill=text.halo or None,
    )


@lru_cache(maxsize=16)
def _font(bold: bool, size: float) -> ImageFont.FreeTypeFont:
    return ImageFont.truetype(str(BOLD if bold else REGULAR), size)
