"""A drawing as PNG, by Pillow: drawn larger and reduced, so that lines have soft edges."""

import struct
import zlib
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from rodshell.output.drawing import LAYERS, Drawing, Text
from rodshell.results.wording import MINUS

FINER = 2  # pixels drawn for each pixel kept, in both directions


def drawing_png(drawing: Drawing, width: int = 1280) -> bytes:
    """The drawing `width` pixels wide. Dashes are drawn through; texts stand level."""
    from PIL import Image, ImageDraw

    low, high = drawing.box()
    scale = FINER * width / float(high[0] - low[0])
    size = np.rint(scale * (high - low)).astype(int).tolist()
    image = Image.new("RGB", (size[0], size[1]), "white")
    canvas = ImageDraw.Draw(image)
    cloud = np.concatenate([np.empty((0, 2)), *(path.points for path in drawing.paths)])
    pixels, begin = (scale * (cloud - (low[0], high[1])) * (1, -1)).ravel().tolist(), 0
    for path in drawing.paths:
        pen, stop = drawing.pen(path), begin + path.points.size
        points, begin = pixels[begin:stop], stop
        if path.closed and pen.fill:
            canvas.polygon(points, fill=_ink(pen.fill))
        if pen.width:
            whole = points + points[:2] if path.closed else points
            canvas.line(whole, fill=_ink(pen.colour), width=max(round(scale * pen.width), 1))
    for text in drawing.texts:
        _write(canvas, text, scale, low, high)
    return _file(np.asarray(image.reduce(FINER)))


@lru_cache(maxsize=4096)
def _ink(colour: str) -> tuple[int, ...]:
    """ "#rrggbb" as three numbers."""
    return tuple(int(colour[k : k + 2], 16) for k in (1, 3, 5))


def _file(pixels: NDArray[np.uint8]) -> bytes:
    """A PNG file of pixels (height, width, 3) [ISO 15948].

    Rows are not filtered: for lines on paper that is shorter than what Pillow chooses, and three times as fast.
    """
    height, width, _ = pixels.shape
    rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)
    rows[:, 1:] = pixels.reshape(height, -1)
    head = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(rows.tobytes(), 3)), (b"IEND", b""))
    parts = (
        struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)) for kind, data in chunks
    )
    return b"\x89PNG\r\n\x1a\n" + b"".join(parts)


def _write(canvas, text: Text, scale: float, low: np.ndarray, high: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    font = _font(scale * text.size)
    x, y = scale * (text.at - (low[0], high[1])) * (1, -1)
    anchor = {"start": "l", "middle": "m", "end": "r"}[text.anchor] + "s"
    canvas.text(
        (x, y), text.text.replace(MINUS, "-"), fill=text.colour or LAYERS[text.layer].colour, font=font, anchor=anchor,
        stroke_width=round(2 * scale) if text.halo else 0, stroke_fill=text.halo or None,
    )  # fmt: skip


@lru_cache(maxsize=16)
def _font(size: float):  # type: ignore[no-untyped-def]
    from PIL import ImageFont

    return ImageFont.load_default(size)
