"""CSV tables as people save them: cells parted by commas, semicolons or tabs; unless by commas, a comma is a decimal
point."""

import csv
from collections.abc import Iterator
from pathlib import Path

from rodshell.errors import InputError
from rodshell.untrusted import limit, raised, read_text

Row = tuple[str, dict[str, str]]
"""How a row is named in a message, and its cells by column."""

NAMES = ("id", "rod")  # columns of text


def csv_rows(path: Path, most: int) -> tuple[list[str], Iterator[Row]]:
    """The columns of a table, and its rows that are not blank.

    Args:
        most: lines that are read, before RODSHELL_LIMITS.

    Raises:
        InputError: no such file, more lines, not CSV; and when the rows are read: one has another number of cells.
    """
    lines = read_text(path, instead="give a CSV table").splitlines()
    if len(lines) > limit(most):
        raise InputError(
            f"{path} has {len(lines)} lines, and at most {limit(most):.0f} are read: give fewer, "
            f"{raised(most, len(lines))}"
        )
    delimiter = max(",;\t", key=lines[0].count) if lines else ","
    reader = csv.reader(lines, delimiter=delimiter)
    try:
        table = [(reader.line_num, cells) for cells in reader]
    except csv.Error as reason:
        raise InputError(f"{path} line {reader.line_num} is not a row of a CSV table: {reason}") from None
    header = [name.strip() for name in table[0][1]] if table else []
    return header, _rows(path, table[1:], header, delimiter)


def _rows(path: Path, lines: list[tuple[int, list[str]]], header: list[str], delimiter: str) -> Iterator[Row]:
    for number, cells in lines:
        where = f"{path} line {number}"
        if not any(cell.strip() for cell in cells):
            continue
        if len(cells) != len(header):
            raise InputError(f"{where} has {len(cells)} cells, the header {len(header)}: give one for each")
        if delimiter != ",":
            named = zip(header, cells, strict=True)
            cells = [cell if name in NAMES else cell.replace(",", ".") for name, cell in named]
        yield where, dict(zip(header, cells, strict=True))
