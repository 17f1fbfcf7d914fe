"""Rods as they are drawn: the lines of a layout from a file."""

from pathlib import Path

import numpy as np

from rodshell.case.csv_rows import csv_rows
from rodshell.errors import InputError
from rodshell.targets.curve_files import read_strokes
from rodshell.units import parse_quantity

MOST_POINTS = 200_000


def read_drawn_rods(path: Path, unit: float) -> dict[str, list[list[float]]]:
    """The lines by the names of their rods [m]: R01, R02 and so on where a file has none.

    Args:
        path: a CSV table with a row a point, its columns rod, x, y and, for lines in space, z; or an OBJ, DXF or 3dm
            file with a curve a rod.
        unit: length of the file's unit [m]; a 3dm file that states its own is read in that.

    Raises:
        InputError: the file is missing or damaged, a cell is not a number, a rod has one point.
    """
    if path.suffix.lower() != ".csv":
        lines = read_strokes(path, unit)
        if not lines or not all(np.isfinite(line).all() for line in lines):
            raise InputError(f"{path} has no curve with finite coordinates: draw one for each rod")
        if not np.ptp(np.concatenate([line[:, 2] for line in lines])):  # a plan
            lines = [line[:, :2] for line in lines]
        return {f"R{k:02d}": line.tolist() for k, line in enumerate(lines, start=1)}
    header, rows = csv_rows(path, MOST_POINTS)
    axes = [name for name in ("x", "y", "z") if name in header]
    if "rod" not in header or axes[:2] != ["x", "y"]:
        raise InputError(
            f"{path} needs the columns rod, x, y and, for lines in space, z: it has {', '.join(header[:9])}"
        )
    found = dict[str, list[list[float]]]()
    for where, row in rows:
        point = [unit * parse_quantity(row[name], "number", f"{where}, {name}") for name in axes]
        found.setdefault(row["rod"].strip(), []).append(point)
    for name, points in found.items():
        if len(points) < 2 or not name:
            raise InputError(
                f"{path}: rod {name!r} has {len(points)} point: give a name and two points or more to each"
            )
    return found
