"""Sheets of paper: a frame with a title block, drawings at a standard scale, split where they are too large."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from math import ceil

import numpy as np
from numpy.typing import NDArray

from rodshell.output.drawing import INK, LETTER, SOFT, Drawing, Pen, Pencil, Text
from rodshell.output.drawings.titleblock import TitleBlock, scale_bar
from rodshell.output.labels import Room

Floats = NDArray[np.float64]
Compose = Callable[[float], Drawing]  # a drawing for the text size [mm at 1:1]

SCALES = (1, 2, 2.5, 3, 4, 5, 7.5, 10, 15, 20, 25, 30, 40, 50, 75, 100, 150, 200, 250, 300, 400, 500, 1000, 2000, 5000)
TEXT = 2.0  # mm of paper
MARGIN, BLOCK = 10.0, 20.0  # around the frame; height of the title block
OVERLAP = 10.0  # mm of paper that a sheet shows beyond its match lines
MOST_TILES = 12  # sheets that a true-size plan may take


@dataclass(frozen=True)
class Sheet:
    """What is on one sheet, before it is numbered: content in mm of paper, its title and its scale (0: none)."""

    title: str
    content: Drawing
    scale: float


def room(paper: tuple[float, float]) -> tuple[Floats, Floats]:
    """Lower left and upper right corner of what a sheet has for its drawing [mm]."""
    return np.array([MARGIN + 4, MARGIN + BLOCK + 4]), np.array(paper) - MARGIN - 4


def fitted(compose: Compose, paper: tuple[float, float]) -> Sheet:
    """A drawing on one sheet, in the middle, at the largest standard scale at which it fits."""
    low, high = room(paper)
    bare = np.subtract(*compose(0.01).box()[::-1])  # hardly any text: the least that it can take
    for scale in (one for one in SCALES if np.all(bare / one <= high - low)):
        drawing = compose(TEXT * scale)
        bottom, top = drawing.box()
        if np.all((top - bottom) / scale <= high - low):
            break
    shift = 0.5 * (low + high) - 0.5 * (bottom + top) / scale
    return Sheet(drawing.title, drawing.placed(1 / scale, shift), scale)


def tiled(compose: Compose, paper: tuple[float, float]) -> Iterator[Sheet]:
    """A drawing at true size over as many sheets as it takes, with match lines; nothing where those are too many."""
    low, high = room(paper)
    drawing = compose(1.5 * TEXT)
    bottom, top = drawing.box()
    size = high - low - 2 * OVERLAP
    count = np.maximum(np.ceil((top - bottom) / size).astype(int), 1)
    if not 1 < count.prod() <= MOST_TILES:
        return
    origin = 0.5 * (bottom + top) - 0.5 * count * size  # the tiles' common corner
    for row in range(count[1]):
        for column in range(count[0]):
            corner = origin + size * (column, count[1] - 1 - row)
            shift = low + OVERLAP - corner
            part = drawing.clipped(low - shift, high - shift).placed(1.0, shift)
            lines = _match_lines(low + OVERLAP, high - OVERLAP, (row, column), count, part.texts)
            yield Sheet(
                f"{drawing.title} 1:1, part {_part(row, column)} of {_part(*(count[::-1] - 1))}", part + lines, 1
            )


def table(
    title: str, columns: Sequence[str], rows: Sequence[Sequence[str]], paper: tuple[float, float]
) -> Iterator[Sheet]:
    """A table over as many sheets as it takes, in as many columns side by side as fit."""
    low, high = room(paper)
    widths = [max(map(len, cells)) for cells in zip(columns, *rows, strict=True)]
    steps = TEXT * (LETTER * np.array(widths) + 1.2)
    width = float(steps.sum()) + 2 * TEXT
    beside = max(int((high[0] - low[0] + 2 * TEXT) // width), 1)
    line = 1.9 * TEXT
    tall = int((high[1] - low[1]) // line) - 2
    per_sheet = tall * beside
    pages = max(ceil(len(rows) / per_sheet), 1)
    for page in range(pages):
        pencil = Pencil()
        mine = rows[page * per_sheet : (page + 1) * per_sheet]
        for block in range(ceil(len(mine) / tall) or 1):
            _block(pencil, columns, mine[block * tall : (block + 1) * tall], low[0] + block * width, high[1], steps)
        many = f", {page + 1} of {pages}" if pages > 1 else ""
        yield Sheet(title + many, pencil.done("table", title, TEXT), 0)


def bound(sheets: Sequence[Sheet], block: TitleBlock, paper: tuple[float, float]) -> list[Drawing]:
    """The sheets with frames and title blocks, numbered."""
    return [
        replace(
            _frame(block, sheet, k, len(sheets), paper) + sheet.content,
            name=f"sheet-{k}", title=sheet.title, text=sheet.content.text,
        )
        for k, sheet in enumerate(sheets, start=1)
    ]  # fmt: skip


def _block(
    pencil: Pencil, columns: Sequence[str], rows: Sequence[Sequence[str]], left: float, top: float, steps: Floats
) -> None:
    line = 1.9 * TEXT
    edges = left + np.append(0.0, np.cumsum(steps))
    for k, cells in enumerate((columns, *rows)):
        y = top - (k + 1) * line
        for j, cell in enumerate(cells):
            number = k > 0 and cell[-1:].isdigit() and cell[:1] in "-.0123456789"
            x, anchor = (edges[j + 1] - 1.2 * TEXT, "end") if number else (edges[j], "start")
            pencil.write(cell, (x, y), TEXT, "LABEL", anchor=anchor, bold=k == 0)
        pencil.line([(left, y - 0.5 * TEXT), (edges[-1] - TEXT, y - 0.5 * TEXT)], "DIM")


def _frame(block: TitleBlock, sheet: Sheet, number: int, count: int, paper: tuple[float, float]) -> Drawing:
    """Border and title block."""
    pencil, (width, height) = Pencil(), paper
    pencil.line(
        [(MARGIN, MARGIN), (width - MARGIN, MARGIN), (width - MARGIN, height - MARGIN), (MARGIN, height - MARGIN)],
        "TITLE", closed=True, pen=Pen(INK, 0.35),
    )  # fmt: skip
    top = MARGIN + BLOCK
    pencil.line([(MARGIN, top), (width - MARGIN, top)], "TITLE", pen=Pen(INK, 0.35))
    right = width - MARGIN - 4
    left, y = MARGIN + 4, top - 6.5
    pencil.write(f"{block.name}: {sheet.title}", (left, y), 4.0, "TITLE", bold=True)
    for k, line in enumerate(block.lines, start=1):
        pencil.write(line, (left, y - 3.9 * k), 2.2, "TITLE", colour=INK if k == 1 else SOFT)
    pencil.write(f"Sheet {number} of {count}", (right, y), 3.0, "TITLE", anchor="end")
    if sheet.scale:
        pencil.write(f"Scale 1:{sheet.scale:g}", (right - 38, y), 3.0, "TITLE", anchor="end")
        scale_bar(pencil, right, MARGIN + 5.2, 60.0, 2.2, sheet.scale)
    return pencil.done("", "", TEXT)


def _match_lines(
    low: Floats, high: Floats, here: tuple[int, int], count: NDArray[np.intp], texts: Sequence[Text]
) -> Drawing:
    """Lines along which a sheet meets its neighbours, and which these are, clear of the `texts` there."""
    pencil, (row, column), free = Pencil(), here, Room(20.0)
    for text in texts:
        free.take(text.box())
    pen = Pen("#b3372c", 0.25, (6.0, 1.5, 1.0, 1.5))
    sides: tuple[tuple[bool, tuple[int, int], list[Floats], tuple[float, float], float], ...] = (
        (bool(row > 0), (row - 1, column), [np.array([low[0], high[1]]), high], (0.0, 1.5), 0.0),
        (bool(row < count[1] - 1), (row + 1, column), [low, np.array([high[0], low[1]])], (0.0, -1.5 - TEXT), 0.0),
        (bool(column > 0), (row, column - 1), [low, np.array([low[0], high[1]])], (-1.5, 0.0), np.pi / 2),
        (
            bool(column < count[0] - 1),
            (row, column + 1),
            [np.array([high[0], low[1]]), high],
            (1.5 + TEXT, 0.0),
            np.pi / 2,
        ),
    )
    for there, neighbour, line, off, angle in sides:
        if not there:
            continue
        pencil.line(line, "TITLE", pen=pen)
        start, along = line[0] + off, np.array([np.cos(angle), np.sin(angle)])
        words = f"match line to part {_part(*neighbour)}"
        for step in range(4, int(np.linalg.norm(line[1] - line[0])) - 50, 2):
            pencil.write(words, start + step * along, TEXT, "TITLE", angle=angle, colour=pen.colour)
            if free.claim(pencil.texts[-1].box()):
                break
            pencil.texts.pop()
    return pencil.done("", "", TEXT)


def _part(row: int, column: int) -> str:
    return f"{chr(ord('A') + row)}{column + 1}"
