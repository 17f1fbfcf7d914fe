"""A drawing as PNG, by Pillow: drawn larger and reduced, so that lines have soft edges."""

import io

import numpy as np

from gridshell.output.drawing import LAYERS, Drawing, Text
from gridshell.output.wording import MINUS

FINER = 2  # pixels drawn for each pixel kept, in both directions


def drawing_png(drawing: Drawing, width: int = 1280) -> bytes:
    """The drawing `width` pixels wide. Dashes are drawn through; texts stand level."""
    from PIL import Image, ImageDraw

    low, high = drawing.box()
    scale = FINER * width / float(high[0] - low[0])
    size = np.rint(scale * (high - low)).astype(int).tolist()
    image = Image.new("RGB", (size[0], size[1]), "white")
    canvas = ImageDraw.Draw(image)
    for path in drawing.paths:
        pen = drawing.pen(path)
        pixels = scale * (path.points - (low[0], high[1])) * (1, -1)
        points = [tuple(point) for point in pixels.tolist()]
        if path.closed and pen.fill:
            canvas.polygon(points, fill=pen.fill)
        if pen.width:
            whole = [*points, points[0]] if path.closed else points
            canvas.line(whole, fill=pen.colour, width=max(round(scale * pen.width), 1))
    for text in drawing.texts:
        _write(canvas, text, scale, low, high)
    stream = io.BytesIO()
    image.reduce(FINER).save(stream, "PNG", compress_level=5)
    return stream.getvalue()


def _write(canvas, text: Text, scale: float, low: np.ndarray, high: np.ndarray) -> None:  # type: ignore[no-untyped-def]
    from PIL import ImageFont  # its own font has no minus sign

    font = ImageFont.load_default(scale * text.size)
    x, y = scale * (text.at - (low[0], high[1])) * (1, -1)
    anchor = {"start": "l", "middle": "m", "end": "r"}[text.anchor] + "s"
    canvas.text(
        (x, y), text.text.replace(MINUS, "-"), fill=text.colour or LAYERS[text.layer].colour, font=font, anchor=anchor,
        stroke_width=round(2 * scale) if text.halo else 0, stroke_fill=text.halo or None,
    )  # fmt: skip
