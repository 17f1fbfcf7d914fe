"""Sheets as one PDF at true scale: a millimetre of a sheet is one on paper. The same bytes for the same sheets.

Lines, circles and lines of Helvetica are all that a sheet has, and of PDF [ISO 32000-1] they need a dozen operators:
less than a general library costs to load. Letters outside Windows-1252 come out as question marks.
"""

import zlib
from collections.abc import Iterator, Sequence
from math import cos, sin

from rodshell.output.drawing import LAYERS, Drawing, Mark, Path, Pen, Text

LEVEL = 4  # of compression: half the time of 6, for files that are 8 % longer
POINTS = 72 / 25.4  # of a millimetre
_H = 0.5522847  # handles of four cubics that make a circle, over its radius
ROUND = (
    (1, 0), (1, _H), (_H, 1), (0, 1), (-_H, 1), (-1, _H), (-1, 0), (-1, -_H), (-_H, -1), (0, -1), (_H, -1), (1, -_H),
    (1, 0),
)  # fmt: skip
CIRCLE = "%.3f %.3f m" + 4 * (3 * " %.3f %.3f" + " c")

# widths of Helvetica's letters from the space to the tilde, in thousandths of its size [Adobe's font metrics]
WIDTHS = dict(enumerate([
    278, 278, 355, 556, 556, 889, 667, 191, 333, 333, 389, 584, 278, 333, 278, 278, 556, 556, 556, 556, 556, 556, 556,
    556, 556, 556, 278, 278, 584, 584, 584, 556, 1015, 667, 667, 722, 722, 667, 611, 778, 722, 278, 500, 667, 556, 833,
    722, 778, 667, 778, 722, 667, 611, 722, 667, 944, 667, 667, 611, 278, 278, 278, 469, 556, 333, 556, 556, 500, 556,
    556, 278, 556, 556, 222, 222, 500, 222, 833, 556, 556, 556, 556, 333, 500, 278, 556, 500, 722, 500, 500, 500, 334,
    260, 334, 584,
], start=ord(" ")))  # fmt: skip
OTHER = 556  # a letter without a width counts as a digit


def drawings_pdf(sheets: Sequence[Drawing], paper: tuple[float, float], title: str) -> bytes:
    """Each drawing on a page of its own of the size `paper` [mm], its origin at the lower left; with bookmarks."""
    first = 7  # the objects before the pages; each page has three: itself, its content, its bookmark
    pages = [first + 3 * k for k in range(len(sheets))]
    width, height = POINTS * paper[0], POINTS * paper[1]
    objects = [
        b"<< /Type /Catalog /Pages 2 0 R /Outlines 3 0 R /PageMode /UseOutlines >>",
        _dictionary(f"/Type /Pages /Count {len(pages)} /Kids [{' '.join(f'{page} 0 R' for page in pages)}]"),
        _dictionary(f"/Type /Outlines /Count {len(pages)} /First {first + 2} 0 R /Last {pages[-1] + 2} 0 R"),
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica /Encoding /WinAnsiEncoding >>",
        b"<< /Type /Font /Subtype /Type1 /BaseFont /Helvetica-Bold /Encoding /WinAnsiEncoding >>",
        b"<< /Title " + _string(title) + b" /Creator (rodshell) >>",
    ]
    for k, (sheet, page) in enumerate(zip(sheets, pages, strict=True)):
        content = zlib.compress("\n".join(_content(sheet)).encode("cp1252", "replace"), LEVEL)
        beside = f"/Prev {page - 1} 0 R " * (k > 0) + f"/Next {page + 5} 0 R" * (k < len(pages) - 1)
        objects += [
            _dictionary(
                f"/Type /Page /Parent 2 0 R /MediaBox [0 0 {width:.3f} {height:.3f}] /Contents {page + 1} 0 R "
                "/Resources << /Font << /F0 4 0 R /F1 5 0 R >> >>"
            ),
            f"<< /Length {len(content)} /Filter /FlateDecode >>\nstream\n".encode() + content + b"\nendstream",
            b"<< /Title " + _string(sheet.title) + f" /Parent 3 0 R /Dest [{page} 0 R /Fit] {beside} >>".encode(),
        ]
    return _file(objects)


def _file(objects: Sequence[bytes]) -> bytes:
    """The objects, numbered from 1, with the table of where each begins."""
    parts, places, length = [b"%PDF-1.4\n%\xe2\xe3\xcf\xd3\n"], list[int](), 0
    for number, body in enumerate(objects, start=1):
        length += len(parts[-1])
        places.append(length)
        parts.append(b"%d 0 obj\n%b\nendobj\n" % (number, body))
    length += len(parts[-1])
    rows = "".join(f"{place:010d} 00000 n \n" for place in places)
    count = len(objects) + 1
    trailer = f"trailer\n<< /Size {count} /Root 1 0 R /Info 6 0 R >>\nstartxref\n{length}\n%%EOF\n"
    return b"".join([*parts, f"xref\n0 {count}\n0000000000 65535 f \n{rows}{trailer}".encode()])


def _content(sheet: Drawing) -> Iterator[str]:
    """What a page draws, line by line, in mm."""
    yield f"{POINTS:.6f} 0 0 {POINTS:.6f} 0 0 cm 1 j"
    last: Pen | None = None
    items: list[Path | Mark] = [*sheet.paths, *sheet.marks]
    for item in items:
        pen = sheet.pen(item)
        if pen != last:
            yield _pen(pen)
            last = pen
        how = ("B" if pen.width else "f") if pen.fill else "S"
        yield f"{_outline(item)} {how}"
    colour = ""
    for text in sheet.texts:
        own = text.colour or LAYERS[text.layer].colour
        if own != colour:
            yield f"{_colour(own)} rg"
            colour = own
        yield _text(text)


def _pen(pen: Pen) -> str:
    dash = " ".join(f"{length:.2f}" for length in pen.dash)
    inside = f" {_colour(pen.fill)} rg" if pen.fill else ""
    return f"{_colour(pen.colour)} RG {pen.width:.3f} w [{dash}] 0 d{inside}"


def _outline(item: Path | Mark) -> str:
    if isinstance(item, Path):
        lines = " l ".join(["%.3f %.3f"] * len(item.points)) % tuple(item.points.ravel().tolist())
        return lines.replace(" l ", " m ", 1) + (" l h" if item.closed else " l")
    (x, y), r = item.at.tolist(), item.radius
    return CIRCLE % tuple([at + r * share for shares in ROUND for at, share in zip((x, y), shares, strict=True)])


def _text(text: Text) -> str:
    (x, y), angle, size = text.at.tolist(), text.angle, text.size
    c, s = (cos(angle), sin(angle)) if angle else (1.0, 0.0)
    if text.anchor != "start":
        back = (0.5 if text.anchor == "middle" else 1.0) * _width(text.text) * size
        x, y = x - back * c, y - back * s
    turn = f"{c:.5f} {s:.5f} {-s:.5f} {c:.5f}"
    return f"BT /F{int(text.bold)} {size:.3f} Tf {turn} {x:.3f} {y:.3f} Tm ({_escaped(text.text)}) Tj ET"


def _width(text: str) -> float:
    """Width of a line of Helvetica over its size."""
    return sum([WIDTHS.get(ord(letter), OTHER) for letter in text]) / 1000


def _string(text: str) -> bytes:
    """A PDF string."""
    return b"(" + _escaped(text).encode("cp1252", "replace") + b")"


def _escaped(text: str) -> str:
    return text.replace("\\", r"\\").replace("(", r"\(").replace(")", r"\)")


def _dictionary(content: str) -> bytes:
    return f"<< {content} >>".encode()


def _colour(colour: str) -> str:
    """ "#rrggbb" as three shares."""
    return " ".join(f"{int(colour[k : k + 2], 16) / 255:.3f}" for k in (1, 3, 5))
