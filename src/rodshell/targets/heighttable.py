"""A text table of heights: rows of a lattice, or points x, y, z that are a whole lattice."""

from pathlib import Path

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.targets.meshfile import file_bytes, require_few_heights

POINT = 3  # numbers in a row of points x, y, z; heights need more each way
EVEN = 0.02  # of a step: coordinates go in equal steps, but for their rounding
LEAP = 4.0  # times the change to the next row: so much more a row of coordinates is off, and hardly a surface
SQUARE = 0.01  # relative: by how much the proportion of points may differ from that of the size


def read_table(path: Path, size: tuple[float, float]) -> tuple[Floats, Floats, Floats]:
    """Heights (rows, columns) in the file's unit, and the x of columns and y of rows, centred on the origin.

    Rows of heights lie in equal steps within `size` = (width, depth), the largest y first; points lie where they say,
    scaled to that size. Cells are parted by semicolons, tabs, commas or blanks; unless by commas, a comma is a point.

    Raises
    ------
    InputError : no such file, no table of numbers, no lattice. Empty cells and "nan" are holes.
    """
    table = _numbers(path, _cells(path))
    if np.isinf(table).any():
        raise InputError(f"{path} holds infinite heights: leave the cell empty where there is no surface")
    if table.shape[1] == POINT:
        return _lattice(path, table, size)
    for line, what in ((table, "row"), (table.T, "column")):
        if _is_coordinates(line):
            raise InputError(
                f"{path}: its first {what} seems to hold coordinates ({line[0, 1]:g} to {line[0, -1]:g} in equal "
                "steps) and not heights: delete it"
            )
    x, y = (np.linspace(-0.5, 0.5, count) for count in table.shape[::-1])
    return table, size[0] * x, -size[1] * y


def _cells(path: Path) -> list[list[str]]:
    try:
        text = file_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{path} is not text in UTF-8: save it as CSV in UTF-8") from None
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in ";\t," if lines and mark in lines[0]), None)
    columns = len(lines[0].split(separator)) if lines else 0
    require_few_heights(path, len(lines), 1 if columns == POINT else columns)
    rows = [[cell.strip() for cell in line.split(separator)] for line in lines]
    return rows if separator == "," else [[cell.replace(",", ".") for cell in row] for row in rows]


def _numbers(path: Path, rows: list[list[str]]) -> Floats:
    """The table (rows, columns); of points without their header."""
    widths = {len(row) for row in rows}
    if len(widths) != 1:
        raise InputError(f"{path}: its rows have {min(widths, default=0)} to {max(widths, default=0)} heights: "
                         "give as many in every row")  # fmt: skip
    if not any(map(_is_number, rows[0])):
        if len(rows[0]) != POINT:
            raise InputError(f"{path}: its first row is a header ({', '.join(rows[0])[:40]}): delete it")
        rows = rows[1:]
    try:
        return np.array([[float(cell) if cell else np.nan for cell in row] for row in rows]).reshape(-1, widths.pop())
    except ValueError as reason:
        raise InputError(f"{path} is no table of numbers ({str(reason)[:60]}): give rows of heights") from None


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _lattice(path: Path, points: Floats, size: tuple[float, float]) -> tuple[Floats, Floats, Floats]:
    """Points (n, 3) in any order as a lattice."""
    if not np.isfinite(points[:, :2]).all():
        raise InputError(f"{path} seems to hold points x, y, z, and some have no x or y: give every point both")
    (x, column), (y, row) = (np.unique(points[:, k], return_inverse=True) for k in (0, 1))
    places = np.unique(row * len(x) + column)
    if len(points) != len(x) * len(y) or len(places) != len(points):
        raise InputError(
            f"{path} seems to hold points x, y, z: {len(points)} with {len(x)} different x and {len(y)} different y, "
            "which is no whole lattice: sample heights on a lattice, one for each x and y, or mesh the points"
        )
    heights = np.full((len(y), len(x)), np.nan)
    heights[row, column] = points[:, 2]
    width, depth = float(np.ptp(x)), float(np.ptp(y))
    if abs(width * size[1] - depth * size[0]) > SQUARE * width * size[1]:
        raise InputError(
            f"{path}: its points span {width:g} x {depth:g}, which is not in the proportion of target.size, "
            f"{size[0]:g} x {size[1]:g} m: give their width and depth"
        )
    x, y = ((at - (at[0] + at[-1]) / 2) / np.ptp(at) for at in (x, y))
    return heights[::-1], size[0] * x, size[1] * y[::-1]


def _is_coordinates(table: Floats) -> bool:
    """Whether the first row, its corner aside, goes in equal steps far from the rows below."""
    if min(table.shape) < POINT + 1:
        return False
    first, second, third = table[:3, 1:]
    steps = np.diff(first)
    even = np.ptp(steps) < EVEN * abs(steps.mean())
    return bool(even and np.nanmax(np.abs(first - second)) > LEAP * np.nanmax(np.abs(second - third)))
