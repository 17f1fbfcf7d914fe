"""Sheets of paper: a frame with a title block, drawings at a standard scale, split where they are too large.

The title block says what a drawing is, of which rods, by whom, when, to which tolerance, what it is not, and the
verdict on the shell where that is not good.
"""

import os
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from datetime import UTC, datetime
from itertools import product, zip_longest
from math import ceil
from textwrap import wrap

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.figures.form import Material, RodType
from rodshell.figures.records import json_text
from rodshell.geometry.boxes import length_beneath
from rodshell.output.drawing import INK, LETTER, PAPER, SMALL, SOFT, TEXT, Drawing, Pen, Pencil, Text, within
from rodshell.output.grid import holes_text, supported
from rodshell.output.labels import Label, Room, closed_segments, nearby, segments, take, thin
from rodshell.output.schedules import Table, head
from rodshell.results import Archive
from rodshell.results.archive import input_hash
from rodshell.results.results import Drawings
from rodshell.results.states import DRAPED
from rodshell.results.verdict import verdict_of
from rodshell.results.wording import joint_rows, nice_step, rounded, rounding_of, section_text, stress

NOTE = "Design aid, not code compliance"
NOT_GIVEN = "not given"
MORE = " (more: report.html)"  # after a verdict that is shortened or has several reasons
WARNING = "#b3372c"
COLUMNS = 4  # of entries, side by side
BAR = 60.0  # length of the scale bar [mm], about
TRUE_SIZE = ", 1:1"  # after the title of a drawing in a separate file
Compose = Callable[[float], Drawing]  # a drawing for the text size [mm at 1:1]
Paper = tuple[float, float]  # width and height of a sheet [mm]

SCALES = (1, 2, 2.5, 3, 4, 5, 7.5, 10, 15, 20, 25, 30, 40, 50, 75, 100, 150, 200, 250, 300, 400, 500, 1000, 2000, 5000)
FINE = SMALL * TEXT  # of tables and of the title block: capitals of 1.9 mm, the least on a sheet
MARGIN, BLOCK = 10.0, 34.0  # around the frame; height of the title block
ROW = 1.45 * FINE  # from line to line of the title block
LONGEST = 64  # letters in a line of a cell
_LEADING = 1.9 * FINE  # from line to line of a table
OVERLAP = 10.0  # mm of paper that a sheet shows beyond its match lines
_MOST_TILES = 12  # sheets that the parts of one drawing may take


@dataclass(frozen=True)
class TitleBlock:
    """What every drawing of a set says.

    Args:
        entries: what it is called and what it is: project, author, date, section, material, ...
        summary: the cut list in one line.
        verdict: level and first reason of a verdict that is not good, with `MORE` where there are others; else "".
    """

    name: str
    entries: tuple[tuple[str, str], ...]
    summary: str
    verdict: str = ""

    def verdict_within(self, width: float, size: float) -> str:
        """The verdict in a line of at most a width [mm] in a size [mm]."""
        if len(self.verdict) <= int(width / (LETTER * size)):
            return self.verdict
        return shortened(self.verdict.removesuffix(MORE), width - len(MORE) * LETTER * size, size) + MORE

    def notes(self, drawing: Drawing) -> list[str]:
        """The lines below the entries of a drawing; the last names what it leaves out."""
        left_out = f"Left out for lack of room: {'; '.join(drawing.left_out)}." if drawing.left_out else ""
        return [f"{self.summary}. {NOTE}.", *filter(None, [left_out])]


def title_block(archive: Archive, summary: str) -> TitleBlock:
    """The title block of an archive, with the cut list in one line as its `summary`."""
    results = archive.results
    given, rod = results.drawings or Drawings(), results.rod or RodType()
    kept = results.plain()
    source = archive.case_toml or json_text({key: kept.get(key) for key in ("rods", "boundary")})
    entries = (
        ("Project", given.project or NOT_GIVEN),
        ("Drawn by", given.author or NOT_GIVEN),
        ("Date", given.date or (source_date() or datetime.now(UTC)).date().isoformat()),
        ("Revision", given.revision or "-"),
        ("Section", section_text(rod.section) or NOT_GIVEN),
        ("Material", _material(rod.material) or NOT_GIVEN),
        ("Joints", ", ".join(filter(None, [_in_words(joint_rows(results.joint)) or "ball", holes_text(archive)]))),
        ("Supports", supported(final) if (final := archive.final or DRAPED) != DRAPED else "none, as draped"),
        ("Units", f"mm, shown to {rounding_of(results).words}"),
        ("Tolerance", NOT_GIVEN if given.tolerance is None else f"{1e3 * given.tolerance:g} mm"),
        ("Input", input_hash(source, archive.inputs)),
        ("Made by", f"rodshell {results.version_rodshell or '(version unknown)'}"),
    )
    found = verdict_of(results)
    verdict = "" if found.level == "good" else found.headline + (MORE if len(found.reasons) > 1 else "")
    return TitleBlock(given.name or archive.name, entries, summary, verdict)


def source_date() -> datetime | None:
    """The time in UTC that SOURCE_DATE_EPOCH gives in seconds since 1970; None where it gives none."""
    try:
        return datetime.fromtimestamp(int(os.environ["SOURCE_DATE_EPOCH"]), UTC)
    except (KeyError, ValueError, OverflowError, OSError):
        return None


def _in_words(rows: Iterable[tuple[str, str]]) -> str:
    """ "pin, eccentricity 4 mm"."""
    return ", ".join(value if key == "kind" else f"{key} {value}" for key, value in rows)


def _material(material: Material | None) -> str:
    """ "larch, E 11 GPa, 470 kg/m3": its name where it has one."""
    if material is None:
        return ""
    words = [material.preset] if material.preset else []
    if material.youngs_modulus is not None:
        words.append(f"E {stress(material.youngs_modulus)}")
    if material.density is not None:
        words.append(f"{rounded(material.density, 4)} kg/m\N{SUPERSCRIPT THREE}")
    return ", ".join(words)


def with_title(drawing: Drawing, block: TitleBlock) -> Drawing:
    """The drawing with its title block and a scale bar below: for a sheet without a frame."""
    (left, bottom), (right, _) = drawing.box()
    size, pencil = drawing.text, Pencil()
    y = bottom - 2.6 * size
    pencil.line([(left, y + 1.6 * size), (right, y + 1.6 * size)], "TITLE")
    pencil.write(f"{block.name}: {drawing.title.lower()}{TRUE_SIZE}", (left, y), 1.4 * size, "TITLE", bold=True)
    rows = [block.entries[k : k + COLUMNS] for k in range(0, len(block.entries), COLUMNS)]
    entries = (" \N{MIDDLE DOT} ".join(f"{label}: {value}" for label, value in row) for row in rows)
    lines = [*entries, *block.notes(drawing)]
    for k, line in enumerate(lines, start=1):
        pencil.write(line, (left, y - 1.5 * k * size), size, "TITLE")
    if block.verdict:
        lines.append(block.verdict_within(max(right - left, max(map(len, lines)) * LETTER * size), size))
        pencil.write(lines[-1], (left, y - 1.5 * len(lines) * size), size, "TITLE", bold=True, colour=WARNING)
    end = left + max(right - left, 0.25 * (right - left) + 4 * size)
    _scale_bar(pencil, end, y - (1.5 * len(lines) + 2) * size, 0.25 * (right - left), size, 1.0)
    return drawing + pencil.done("", "", size)


def shortened(text: str, width: float, size: float) -> str:
    """A text that takes at most a width [mm] in a size [mm]; what is cut off is shown by dots."""
    letters = int(width / (LETTER * size))
    return text if len(text) <= letters else text[: letters - 1].rstrip() + "\N{HORIZONTAL ELLIPSIS}"


def _bar_length(longest: float, scale: float) -> float:
    """The round length of a scale bar, in mm of a sheet at 1:`scale` as `longest`."""
    return nice_step(scale * longest, 2) * 2 / scale


def _scale_bar(pencil: Pencil, right: float, y: float, longest: float, text: float, scale: float) -> None:
    """A bar of a round length of at most about `longest`, ending at `right`; all in mm of a sheet at 1:`scale`."""
    length = _bar_length(longest, scale)
    for k in range(4):
        x = right - length + k * length / 4
        corners = _corners(np.array([x, y]), np.array([x + length / 4, y + 0.4 * text]))
        pencil.line(corners, "TITLE", closed=True, pen=Pen(INK, 0.06 * text, fill=INK if k % 2 == 0 else PAPER))
    pencil.write("0", (right - length, y - text), 0.8 * text, "TITLE", anchor="middle")
    pencil.write(f"{scale * length:g} mm", (right, y - text), 0.8 * text, "TITLE", anchor="end")


# Sheets


@dataclass(frozen=True)
class Sheet:
    """What is on one sheet, before it is numbered: content in mm of paper, its title and its scale (0: none)."""

    title: str
    content: Drawing
    scale: float


def room(paper: Paper) -> tuple[Floats, Floats]:
    """Lower left and upper right corner of what a sheet has for its drawing [mm]."""
    return np.array([MARGIN + 4, MARGIN + BLOCK + 4]), np.array(paper) - MARGIN - 4


@dataclass(frozen=True)
class Layout:
    """A drawing, laid out as few times as it takes: DXF and SVG show it at 1:1, sheets of paper from the same texts.

    Args:
        whole: as its one sheet shows it; scale : of that sheet.
        detail: with smaller texts where the sheet has no room for all, else the same; for files at 1:1.
        parts: what the parts on several sheets are cut from; None: there are none.
    """

    whole: Drawing
    scale: float
    detail: Drawing
    parts: Drawing | None
    scale_of_parts: float

    def sheets(self, paper: Paper) -> Iterator[Sheet]:
        """The whole on one sheet of a paper [mm], in the middle, and its parts."""
        low, high = room(paper)
        bottom, top = self.whole.box()
        shift = 0.5 * (low + high) - 0.5 * (bottom + top) / self.scale
        yield Sheet(self.whole.title, self.whole.placed(1 / self.scale, shift), self.scale)
        if self.parts is not None:
            yield from tiled(self.parts, paper, self.scale_of_parts)


def laid_out(compose: Compose, extent: Floats, paper: Paper, finest: float, *, true_size: bool = False) -> Layout:
    """A drawing, laid out for one sheet and, where that leaves something out, in detail.

    The parts are at the smallest scale that shows all, or the largest there is.

    Args:
        compose: makes the drawing for a text size [mm at 1:1].
        extent: (2,) at least what the drawing takes without texts [mm].
        finest: size of the texts with which a file at 1:1 shows all that it can [mm].
        true_size: the parts are templates at 1:1 wherever that takes no more than MOST_TILES sheets.
    """
    whole, scale = fitted(compose, extent, paper)
    parts, of_parts = None, 1.0
    possible = [smaller for smaller in SCALES if smaller < scale and _fits_on(extent / smaller, paper)]
    templates = [1] if true_size and 1 in possible else []
    for smaller in templates or (possible[::-1] if whole.left_out else []):
        finer = compose(TEXT * smaller)
        if _fits_on(_size(finer) / smaller, paper):
            parts, of_parts = finer, smaller
            if not finer.left_out:
                break
    detail = parts or whole
    if detail.left_out and detail.text > finest:
        detail = compose(finest)
    return Layout(whole, scale, detail, parts, of_parts)


def fitted(compose: Compose, extent: Floats, paper: Paper) -> tuple[Drawing, float]:
    """A drawing with the texts of a sheet, and the largest standard scale at which one sheet has room for it."""
    low, high = room(paper)
    for scale in SCALES:
        if np.any(extent / scale > high - low) and scale != SCALES[-1]:
            continue
        drawing = compose(TEXT * scale)
        extent = _size(drawing)  # with larger texts it takes no less
        if np.all(extent / scale <= high - low):
            break
    return drawing, scale


def _size(drawing: Drawing) -> Floats:
    """(2,) its width and height [mm]."""
    low, high = drawing.box()
    return np.asarray(high - low)


def _tiles(extent: Floats, paper: Paper) -> Ints:
    """Sheets (2,) across and down that an extent (2,) of a drawing takes [mm of paper]."""
    low, high = room(paper)
    return np.maximum(np.ceil(extent / (high - low - 2 * OVERLAP)), 1).astype(np.intp)


def _fits_on(extent: Floats, paper: Paper) -> bool:
    """Whether an extent (2,) of a drawing [mm of paper] takes no more sheets than it may."""
    return bool(_tiles(extent, paper).prod() <= _MOST_TILES)


def tiled(drawing: Drawing, paper: Paper, scale: float = 1) -> Iterator[Sheet]:
    """A drawing, at 1:1, over as many sheets at 1:`scale` as it takes, with match lines; nothing where that is one or
    too many."""
    low, high = room(paper)
    drawing = drawing.placed(1 / scale, np.zeros(2))
    bottom, top = drawing.box()
    size, count = high - low - 2 * OVERLAP, _tiles(top - bottom, paper)
    if not 1 < count.prod() <= _MOST_TILES:
        return
    origin = 0.5 * (bottom + top) - 0.5 * count * size  # the tiles' common corner
    for row in range(count[1]):
        for column in range(count[0]):
            corner = origin + size * (column, count[1] - 1 - row)
            shift = low + OVERLAP - corner
            part = drawing.clipped(low - shift, high - shift).placed(1.0, shift)
            lines = _match_lines(low + OVERLAP, high - OVERLAP, (row, column), count, part)
            here, last = _part(row, column), _part(*(count[::-1] - 1))
            yield Sheet(f"{drawing.title} 1:{scale:g}, part {here} of {last}", part + lines, scale)


def table(title: str, content: Table, paper: Paper) -> Iterator[Sheet]:
    """A table over as many sheets as it takes, in as many columns side by side as fit."""
    if not content:
        return
    low, high = room(paper)
    broken = ([wrap(cell, LONGEST) for cell in row] for row in zip(*content.values(), strict=True))
    rows = [line for row in broken for line in zip_longest(*row, fillvalue="")]
    cells = [max(map(len, column), default=0) for column in zip(*rows, strict=True)] or [0] * len(content)
    heads = [_wrapped(*head(name), width) for name, width in zip(content, cells, strict=True)]
    widths = [max(width, *map(len, words)) for width, words in zip(cells, heads, strict=True)]
    steps = FINE * (LETTER * np.array(widths) + 1.2)
    width = float(steps.sum()) + 2 * FINE
    abreast = max(int((high[0] - low[0] + 2 * FINE) // width), 1)
    tall = int((high[1] - low[1]) // _LEADING) - max(map(len, heads)) - 1
    per_sheet = tall * abreast
    pages = max(ceil(len(rows) / per_sheet), 1)
    for page in range(pages):
        pencil = Pencil()
        rows_here = rows[page * per_sheet : (page + 1) * per_sheet]
        for block in range(ceil(len(rows_here) / tall) or 1):
            _block(pencil, heads, rows_here[block * tall : (block + 1) * tall], low[0] + block * width, high[1], steps)
        many = f", {page + 1} of {pages}" if pages > 1 else ""
        yield Sheet(title + many, pencil.done("table", title, TEXT), 0)


def _wrapped(words: str, unit: str, width: int) -> list[str]:
    """A head in lines of about the width of its column's cells [letters], its unit in the last."""
    return wrap(words, max(width, 8), break_long_words=False) + ([f"[{unit}]"] if unit else [])


def bound(sheets: Sequence[Sheet], block: TitleBlock, paper: Paper) -> list[Drawing]:
    """The sheets with frames and title blocks, numbered."""
    return [
        replace(
            _frame(block, sheet, k, len(sheets), paper) + sheet.content,
            name=f"sheet-{k}", title=sheet.title, text=sheet.content.text,
        )
        for k, sheet in enumerate(sheets, start=1)
    ]  # fmt: skip


def _block(
    pencil: Pencil, heads: Sequence[Sequence[str]], rows: Sequence[Sequence[str]], left: float, top: float,
    steps: Floats,
) -> None:  # fmt: skip
    """Heads over a line, their last lines level, and the rows."""
    edges, deep = left + np.append(0.0, np.cumsum(steps)), max(map(len, heads))
    numeric = [all(_number(row[k]) or not row[k] for row in rows) for k in range(len(heads))]
    lines = zip(*([""] * (deep - len(words)) + list(words) for words in heads), strict=True)
    for k, cells in enumerate((*lines, *rows), start=1):
        y = top - k * _LEADING
        for j, cell in enumerate(cells):
            x, anchor = (edges[j + 1] - 1.2 * FINE, "end") if numeric[j] else (edges[j], "start")
            if cell:
                pencil.write(cell, (x, y), FINE, "LABEL", anchor=anchor, bold=k <= deep)
        if k >= deep:
            pencil.line([(left, y - 0.5 * FINE), (edges[-1] - FINE, y - 0.5 * FINE)], "DIM")


def _number(cell: str) -> bool:
    return cell[-1:].isdigit() and cell[:1] in "-.0123456789"


def _frame(block: TitleBlock, sheet: Sheet, number: int, count: int, paper: Paper) -> Drawing:
    """Border and title block."""
    pencil, width = Pencil(), paper[0]
    border = _corners(np.full(2, MARGIN), np.array(paper) - MARGIN)
    pencil.line(border, "TITLE", closed=True, pen=Pen(INK, 0.35))
    top = MARGIN + BLOCK
    pencil.line([(MARGIN, top), (width - MARGIN, top)], "TITLE", pen=Pen(INK, 0.35))
    left, right, y = MARGIN + 4, width - MARGIN - 4, top - 6.5
    title = shortened(f"{block.name}: {sheet.title}", right - left - 80, 5.0)
    pencil.write(title, (left, y), 5.0, "TITLE", bold=True)
    pencil.write(f"Sheet {number} of {count}", (right, y), TEXT, "TITLE", anchor="end")
    y, step, start = y - 5.9, (right - left) / COLUMNS, 9.5 * LETTER * FINE  # after the longest label
    for k, (label, value) in enumerate(block.entries):
        x, down = left + step * (k % COLUMNS), y - ROW * (k // COLUMNS)
        pencil.write(label, (x, down), FINE, "TITLE", colour=SOFT)
        pencil.write(shortened(value, step - start - 2.0, FINE), (x + start, down), FINE, "TITLE")
    y -= ROW * ceil(len(block.entries) / COLUMNS)
    room = right - left - (_bar_length(BAR, sheet.scale) + 3 * TEXT if sheet.scale else 0.0)
    notes = block.notes(sheet.content)
    for k, line in enumerate(notes):
        written = shortened(line, room, FINE)
        pencil.write(written, (left, y - 0.3 - ROW * k), FINE, "TITLE", colour=SOFT if k == 0 else WARNING)
    if block.verdict:
        written, below = block.verdict_within(room, FINE), y - 0.3 - ROW * len(notes)
        pencil.write(written, (left, below), FINE, "TITLE", bold=True, colour=WARNING)
    if sheet.scale:
        pencil.write(f"Scale 1:{sheet.scale:g}", (right - 38, top - 7.0), TEXT, "TITLE", anchor="end")
        _scale_bar(pencil, right, MARGIN + 5.2, BAR, TEXT, sheet.scale)
    return pencil.done("", "", TEXT)


def _match_lines(low: Floats, high: Floats, here: tuple[int, int], count: Ints, part: Drawing) -> Drawing:
    """Lines along which a sheet meets its neighbours, with their names clear of the texts of its `part` of the drawing.

    A name is next to its line or a row farther out, where it has the least length of drawn lines beneath it: none, or a
    few that cross it, rather than a rod that it lies along. Of equal positions the first is taken, in this order of
    rows; lengths count in steps of the text's size, so that each line across the name counts as one. A name that finds
    no free position in its two rows is led aside; where there is none either, it is counted as left out.
    """
    pencil, (row, column), free, missing = Pencil(), here, Room(20.0), 0
    for text in part.texts:
        box = text.box()
        if not within(box, low, high):
            free.take(box)
    drawn = segments(path.points for path in part.paths if not within(path.points, low, high))
    pen = Pen(WARNING, 0.25, (6.0, 1.5, 1.0, 1.5))
    corners = _corners(low, high)
    sides = (
        ((row - 1, column), corners[[3, 2]], (0.0, 1.5), 0.0),
        ((row + 1, column), corners[[0, 1]], (0.0, -1.5 - TEXT), 0.0),
        ((row, column - 1), corners[[0, 3]], (-1.5, 0.0), np.pi / 2),
        ((row, column + 1), corners[[1, 2]], (1.5 + TEXT, 0.0), np.pi / 2),
    )
    shared = [side for side in sides if 0 <= side[0][0] < count[1] and 0 <= side[0][1] < count[0]]
    for neighbour, line, off, angle in shared:
        pencil.line(line, "TITLE", pen=pen)
        along, up = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
        words = f"match line to part {_part(*neighbour)}"
        steps = np.arange(4, int(np.linalg.norm(line[1] - line[0])) - 50, 2)[:, None] * along
        middle = off + 0.5 * TEXT * up  # of the name's height, from its line
        shifts = np.concatenate([steps + share * middle - 0.5 * TEXT * up for share in (1, 2)])
        written = Text(words, line[0], TEXT, "TITLE", angle=angle, colour=pen.colour)
        crossed = np.ceil(length_beneath(written.box(), shifts, drawn) / TEXT)
        ordered = shifts[np.argsort(crossed, kind="stable")]
        if free.write(pencil, (written._replace(at=line[0] + shift) for shift in ordered)):
            continue
        if aside := _led_aside(words, line, part, pencil.texts, low - OVERLAP, high + OVERLAP):
            take(aside, TEXT, free)
            pencil.line(aside.leader(TEXT), "TITLE", pen=Pen(WARNING, 0.18))
            pencil.texts.append(aside.written(TEXT)._replace(layer="TITLE", colour=pen.colour))
        else:
            missing += 1
    pencil.leave_out(missing, len(shared), "names of match lines")
    return pencil.done("", "", TEXT)


def _corners(low: Floats, high: Floats) -> Floats:
    """(4, 2) the corners of a rectangle, counterclockwise from its lower left one."""
    return np.array([low, (high[0], low[1]), high, (low[0], high[1])])


def _led_aside(
    words: str, line: Floats, part: Drawing, names: Sequence[Text], low: Floats, high: Floats
) -> Label | None:
    """The name of a match line next to it, with a line to it, within a sheet from `low` to `high` (2,): clear of all
    texts, and of drawn lines too where there is room for that. None: there is no free place."""
    taken = Room(20.0)
    for text in (*part.texts, *names):
        taken.take(text.box())
    for side in closed_segments(_corners(low, high)):
        taken.take(thin(side, 0.1))
    inwards = 0.5 * (low + high) - 0.5 * (line[0] + line[1])
    shares = np.array([0.5, 0.4, 0.6, 0.3, 0.7, 0.2, 0.8, 0.1, 0.9])
    drawn = segments(path.points for path in part.paths)
    for lines, share in product((drawn, drawn[:0]), shares):
        label = nearby(words, line[0] + share * (line[1] - line[0]), inwards, TEXT, taken, lines)
        if label is not None and within(label.box(TEXT), low, high):
            return label
    return None


def _part(row: int, column: int) -> str:
    return f"{chr(ord('A') + row)}{column + 1}"
