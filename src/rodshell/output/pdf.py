"""Sheets as one PDF at true scale, by reportlab: a millimetre of a sheet is one on paper. The same bytes each time.

Texts are set in the typeface of `drawing`, of which the file holds the glyphs that it shows.
"""

import os
import warnings
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from io import BytesIO
from itertools import groupby
from math import cos, sin
from threading import Lock

from reportlab import rl_config
from reportlab.lib.colors import Color, HexColor
from reportlab.pdfbase.pdfmetrics import getFont, registerFont, stringWidth
from reportlab.pdfbase.ttfonts import TTFont
from reportlab.pdfgen.canvas import Canvas

from rodshell.errors import OutputWarning
from rodshell.output.drawing import BOLD, LAYERS, REGULAR, Drawing, Mark, Path, Pen, Text
from rodshell.output.drawings.sheets import source_date

POINTS = 72 / 25.4  # of a millimetre
SANS = {False: "rodshell-sans", True: "rodshell-sans-bold"}
_ONE_AT_A_TIME = Lock()
_MOST_NAMED = 10  # characters without a glyph that a warning shows


def drawings_pdf(sheets: Sequence[Drawing], paper: tuple[float, float], title: str) -> bytes:
    """A PDF file with each drawing on a page of its own, and a bookmark for each.

    Args:
        sheets: in mm of paper, their origin at the lower left corner of the page.

    Warns:
        OutputWarning: characters that the typeface has no glyph for; they are drawn as boxes.
    """
    _register_fonts()
    _warn_of_missing_glyphs(text.text for sheet in sheets for text in sheet.texts)
    stream = BytesIO()
    page = (POINTS * paper[0], POINTS * paper[1])
    with _settings():
        canvas = Canvas(stream, page, pageCompression=1, invariant=1, initialFontName=SANS[False])
        canvas.setTitle(title)
        canvas.setCreator("rodshell")
        canvas.setAuthor("")
        canvas.setSubject("")
        canvas.showOutline()
        for number, sheet in enumerate(sheets, start=1):
            canvas.bookmarkPage(str(number))
            canvas.addOutlineEntry(sheet.title, str(number))
            canvas.scale(POINTS, POINTS)
            canvas.setLineJoin(1)
            drawn: list[Path | Mark] = [*sheet.paths, *sheet.marks]
            for pen, items in groupby(drawn, key=sheet.pen):
                _draw(canvas, pen, items)
            _write(canvas, sheet.texts)
            canvas.showPage()
        canvas.save()
    return stream.getvalue()


@contextmanager
def _settings() -> Iterator[None]:
    """Pages as bytes, not as text of ASCII letters, which reportlab prefers: a fifth shorter, and faster. Of
    SOURCE_DATE_EPOCH it sees dates only: anything else it does not survive.

    Both hold for the whole process, so that only one thread at a time writes a file.
    """
    with _ONE_AT_A_TIME:
        before, rl_config.useA85 = rl_config.useA85, 0
        no_date = os.environ.pop("SOURCE_DATE_EPOCH", None) if source_date() is None else None
        try:
            yield
        finally:
            rl_config.useA85 = before
            if no_date is not None:
                os.environ["SOURCE_DATE_EPOCH"] = no_date


@cache
def _register_fonts() -> None:
    for name, file in zip(SANS.values(), (REGULAR, BOLD), strict=True):
        registerFont(TTFont(name, str(file)))


def text_width(text: str, size: float, *, bold: bool = False) -> float:
    """Width of a line of text, in the unit of its `size`."""
    _register_fonts()
    return float(stringWidth(text, SANS[bold], size))


def _warn_of_missing_glyphs(texts: Iterable[str]) -> None:
    glyphs = getFont(SANS[False]).face.charToGlyph
    missing = sorted(letter for letter in set().union(*texts) if ord(letter) not in glyphs)
    if missing:
        more = f" and {len(missing) - _MOST_NAMED} more" if len(missing) > _MOST_NAMED else ""
        warnings.warn(
            f"the PDF shows boxes for characters that its typeface lacks: {' '.join(missing[:_MOST_NAMED])}{more}",
            OutputWarning,
            stacklevel=3,
        )


def _draw(canvas: Canvas, pen: Pen, items: Iterable[Path | Mark]) -> None:
    """Lines and circles of one pen; as one path where they are not filled, which would cut what overlaps."""
    canvas.setStrokeColor(_colour(pen.colour))
    canvas.setLineWidth(pen.width)
    canvas.setDash(list(pen.dash))
    if pen.fill:
        canvas.setFillColor(_colour(pen.fill))
    for group in ([item] for item in items) if pen.fill else (items,):
        path = canvas.beginPath()
        for item in group:
            if isinstance(item, Mark):
                path.circle(*item.at.tolist(), item.radius)
                continue
            first, *others = item.points.tolist()
            path.moveTo(*first)
            for point in others:
                path.lineTo(*point)
            if item.closed:
                path.close()
        canvas.drawPath(path, stroke=int(pen.width > 0), fill=int(bool(pen.fill)))


def _write(canvas: Canvas, texts: Iterable[Text]) -> None:
    """Texts, with a new font and colour only where they change."""
    written = canvas.beginText()
    for (bold, size, colour), group in groupby(texts, key=_look):
        written.setFont(SANS[bold], size)
        written.setFillColor(_colour(colour))
        for text in group:
            (x, y), c, s = text.at.tolist(), cos(text.angle), sin(text.angle)
            if text.anchor != "start":
                back = (0.5 if text.anchor == "middle" else 1.0) * text_width(text.text, size, bold=bold)
                x, y = x - back * c, y - back * s
            if text.angle:
                written.setTextTransform(c, s, -s, c, x, y)
            else:
                written.setTextOrigin(x, y)
            written.textLine(text.text)  # `textOut` would measure it too
    canvas.drawText(written)


def _look(text: Text) -> tuple[bool, float, str]:
    """Weight, size and colour."""
    return text.bold, text.size, text.colour or LAYERS[text.layer].colour


@cache
def _colour(code: str) -> Color:
    """ "#rrggbb" as reportlab has colours."""
    return HexColor(code)
