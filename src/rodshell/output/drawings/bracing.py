"""The bracing plan: the diagonals of the cells in the final shape, with their true lengths."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.output.archive import Archive
from rodshell.output.drawing import BELOW, LETTER, LINE, SMALL, Drawing, Pen, Pencil, Text
from rodshell.output.drawings.final import axes, seen_from_above
from rodshell.output.labels import Room, runs_through, upright
from rodshell.output.rods import joint_places
from rodshell.output.rounding import rounding_of

ENDS = ("from", "to")
NUMBERS = (1.0, 0.9, 0.82, SMALL)  # sizes of a number that are tried, in text sizes
CLEAR = 0.2  # of its size, between a number and the middle of its cell
SIDES = ((-1, 0.3), (1, 0.3), (-1, -0.85), (1, -0.85))  # half of the diagonal, and its baseline off it in its sizes


def bracing_drawing(archive: Archive, text: float) -> Drawing:
    """The diagonals of the cells in the final shape, seen from above, with their true lengths.

    Each number stands off all rods and diagonals of its cell, as large as finds room; where there is none the table
    has it.
    """
    pencil, final = Pencil(), archive.final
    assert final is not None
    seen_from_above(pencil, archive, text)
    places = joint_places(archive, archive.states[final])
    braces = (archive.result.get("fabrication") or {}).get("bracing", [])
    cells = zip(braces[::2], braces[1::2], strict=True)  # both diagonals of a cell follow each other
    braces = [one for cell in cells if all(one[end] in places for one in cell for end in ENDS) for one in cell]
    ends = 1e3 * np.array([[places[one[end]][:2] for end in ENDS] for one in braces]).reshape(-1, 2, 2)
    for brace, line in zip(braces, ends, strict=True):
        pencil.line(line, "DIM", pen=Pen("#b08a2e", 0.07 * text), note=f"{brace['from']} to {brace['to']}")
    other = ends.reshape(-1, 2, 2, 2)[:, ::-1].reshape(-1, 2, 2)
    mm = rounding_of(archive.result).mm
    found = _numbers([mm(brace["final"]) for brace in braces], ends, other, text)
    pencil.texts += found
    pencil.leave_out(len(braces) - len(found), len(braces), "lengths of diagonals (table Bracing)")
    axes(pencil, text)
    return pencil.done("bracing", "Bracing, true lengths in the final shape", text)


def _numbers(words: list[str], ends: Floats, other: Floats, text: float) -> list[Text]:
    """The numbers that find room along the diagonals (n, 2, 2) of cells with the `other` diagonals (n, 2, 2)."""
    (a, b), (c, d) = ends.transpose(1, 0, 2), other.transpose(1, 0, 2)
    angle = np.array([upright(float(one)) for one in np.arctan2(*(b - a).T[::-1])])
    along, above = (np.column_stack(one) for one in ((np.cos(angle), np.sin(angle)), (-np.sin(angle), np.cos(angle))))
    middle, wide = 0.5 * (a + b), LETTER * np.array([len(one) for one in words], dtype=float)
    lines = np.stack([[a, c], [c, b], [b, d], [d, a], [a, b], [c, d]]).transpose(2, 0, 1, 3) - middle[:, None, None]
    seen = np.einsum("nkpi,jni->nkpj", lines, np.stack([along, above]))  # along and across the diagonal
    room, found = Room(3 * text), dict[int, Text]()
    for size, (side, up) in ((text * share, side) for share in NUMBERS for side in SIDES):
        off = side * (CLEAR + 0.5 * wide) * size
        centre = np.column_stack([off, np.full(len(words), (up + 0.5 * LINE - BELOW) * size)])
        half = 0.5 * size * np.column_stack([wide, np.full(len(words), LINE)])
        met = runs_through((seen - centre[:, None, None]) / half[:, None, None]).any(axis=1)
        for k in np.flatnonzero(~met).tolist():
            at = middle[k] + off[k] * along[k] + up * size * above[k]
            written = Text(words[k], at, size, "LABEL", "middle", float(angle[k]), colour="#6b5212")
            if k not in found and room.claim(written.box()):
                found[k] = written
    return list(found.values())
