"""Heights on a lattice in files, as a surface in triangles: tables of text and grey images."""

import warnings
from pathlib import Path

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.targets.mesh_files import MOST_HEIGHTS, cause, file_bytes, require_few_heights
from rodshell.targets.nurbs_files import grid_triangles
from rodshell.units import length_text

TABLES = (".csv", ".txt")
GRID_FILES = (*TABLES, ".png", ".pgm", ".jpg", ".jpeg", ".tif", ".tiff")
FEWEST = 4  # heights each way
POINT = 3  # numbers in a row of points x, y, z; heights need more each way
EVEN = 0.02  # of a step: coordinates go in equal steps, except for rounding
LEAP = 4.0  # times the change to the next row: a row of coordinates differs by more, a surface hardly ever
SQUARE = 0.01  # relative: by how much the proportion of points may differ from that of the size

COARSE = 1 / 300  # of white: an image whose levels are further apart, such as one of 8 bits, has terraces
ROUNDING = 12**-0.5  # levels, rms: error that rounding to levels adds to a smooth height
MOST_MOVED = 1.0  # levels by which a height may be changed
HALVINGS = 12


def read_heights(path: Path, size: tuple[float, float], height: float | None) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Read heights on a lattice and mesh them; empty cells and "nan" are holes.

    Parameters
    ----------
    path : a file of one of the kinds in `GRID_FILES`.
    size : width along x and depth along y [m]; the file's first row is at the largest y, depth / 2.
    height : of a table the factor of its numbers; of an image the height of white, black being 0 [m]; None for 1.

    Returns
    -------
    Vertices (n, 3), centred on the origin [m], triangles (m, 3), and notes for the user, in sentences.

    Raises
    ------
    InputError : the file is missing or damaged, or its numbers are not a lattice.
    """
    height = 1.0 if height is None else height
    notes: tuple[str, ...] = ()
    if path.suffix.lower() in TABLES:
        z, x, y = read_table(path, size)
    else:
        z, step = read_image(path)
        x, y = size[0] * np.linspace(-0.5, 0.5, z.shape[1]), size[1] * np.linspace(0.5, -0.5, z.shape[0])
        if step is not None:
            notes = (
                f"{path.name} has {round(1 / step) + 1} grey levels, steps of {length_text(step * height)}: its "
                "heights were smoothed within one step; an image of 16 bits needs no smoothing",
            )
    if min(z.shape) < FEWEST:
        raise InputError(f"{path} has {z.shape[0]} x {z.shape[1]} heights: at least {FEWEST} each way are needed")
    across, along = np.meshgrid(x, y)
    faces = grid_triangles(*z.shape)[:, ::-1]
    known = np.isfinite(z.ravel())
    points = np.column_stack([across.ravel(), along.ravel(), height * z.ravel()])
    return points, faces[known[faces].all(axis=1)], notes


def read_table(path: Path, size: tuple[float, float]) -> tuple[Floats, Floats, Floats]:
    """Read a table of heights, or of points x, y, z that are a complete lattice.

    Cells are separated by semicolons, tabs, commas or blanks; unless by commas, a comma is a decimal point. Empty cells
    and "nan" are holes.

    Parameters
    ----------
    path : a text file.
    size : width and depth [m]. Rows of heights are at equal steps within it, the largest y first; points keep their
        proportions and are scaled to it.

    Returns
    -------
    Heights (rows, columns) in the file's unit, x of the columns and y of the rows, centred on the origin [m].

    Raises
    ------
    InputError : the file is missing, is not a table of numbers, or its points are not a lattice.
    """
    table = _numbers(path, _cells(path))
    if np.isinf(table).any():
        raise InputError(f"{path} has infinite heights: leave the cell empty where there is no surface")
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
    """The table (rows, columns); a table of points may have a header, which is left out."""
    widths = {len(row) for row in rows}
    if len(widths) != 1:
        raise InputError(f"{path}: its rows have {min(widths, default=0)} to {max(widths, default=0)} heights: "
                         "give every row the same number")  # fmt: skip
    if not any(map(_is_number, rows[0])):
        if len(rows[0]) != POINT:
            raise InputError(f"{path}: its first row is a header ({', '.join(rows[0])[:40]}): delete it")
        rows = rows[1:]
    try:
        return np.array([[float(cell) if cell else np.nan for cell in row] for row in rows]).reshape(-1, widths.pop())
    except ValueError as reason:
        raise InputError(f"{path} is not a table of numbers ({str(reason)[:60]}): give rows of heights") from None


def _is_number(cell: str) -> bool:
    try:
        float(cell or "nan")
    except ValueError:
        return False
    return True


def _lattice(path: Path, points: Floats, size: tuple[float, float]) -> tuple[Floats, Floats, Floats]:
    """Points (n, 3) in any order as a lattice; see `read_table`."""
    if not np.isfinite(points[:, :2]).all():
        raise InputError(f"{path} seems to have points x, y, z, and some lack x or y: give both for every point")
    (x, column), (y, row) = (np.unique(points[:, k], return_inverse=True) for k in (0, 1))
    cells = np.unique(row * len(x) + column)
    if len(points) != len(x) * len(y) or len(cells) != len(points):
        raise InputError(
            f"{path} seems to have points x, y, z: {len(points)} with {len(x)} different x and {len(y)} different y, "
            "which is not a complete lattice: sample one height for each x and y, or mesh the points"
        )
    heights = np.full((len(y), len(x)), np.nan)
    heights[row, column] = points[:, 2]
    width, depth = float(np.ptp(x)), float(np.ptp(y))
    if abs(width * size[1] - depth * size[0]) > SQUARE * width * size[1]:
        raise InputError(
            f"{path}: its points span {width:g} x {depth:g}, which is not in the proportion of target.size, "
            f"{size[0]:g} x {size[1]:g} m: set it to their width and depth"
        )
    x, y = ((at - (at[0] + at[-1]) / 2) / np.ptp(at) for at in (x, y))
    return heights[::-1], size[0] * x, size[1] * y[::-1]


def _is_coordinates(table: Floats) -> bool:
    """Whether the first row, without its corner, goes in equal steps and differs from the rows below."""
    if min(table.shape) < POINT + 1:
        return False
    first, second, third = table[:3, 1:]
    steps = np.diff(first)
    even = np.ptp(steps) < EVEN * abs(steps.mean())
    return bool(even and np.nanmax(np.abs(first - second)) > LEAP * np.nanmax(np.abs(second - third)))


def read_image(path: Path) -> tuple[Floats, float | None]:
    """Read a grey image as heights; where it has few grey levels, its terraces are smoothed away within one level.

    Returns
    -------
    Heights (rows, columns), black being 0 and white 1; and the step between grey levels where that is coarse, or None.

    Raises
    ------
    InputError : the file is missing or damaged, or has too many pixels (found before they are decoded).
    """
    from PIL import Image

    file_bytes(path)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the limit here is lower
            opened = Image.open(path)
        with opened as image:
            require_few_heights(path, image.height, image.width)
            image.load()
            white = 65535.0 if image.mode.startswith("I") else 255.0  # 16 bits or 8
            grey = np.asarray(image if white > 255 else image.convert("F"), dtype=float) / white
    except InputError:
        raise
    except Image.DecompressionBombError:
        raise InputError(
            f"{path} has far too many pixels: scale it down to {MOST_HEIGHTS / 1e6:g} million or fewer"
        ) from None
    except Exception as reason:  # a damaged image can break a reader anywhere
        raise InputError(f"{path} cannot be read as an image ({cause(reason)}): save it again") from None
    step = float(np.diff(np.unique(grey)).min(initial=1.0))
    return (smoothed(grey, step), step) if COARSE < step < 1.0 else (grey, None)


def smoothed(grey: Floats, step: float) -> Floats:
    """Smooth an image as far as the rounding to its levels explains.

    A smoothing spline along both axes [Eilers and Marx 1996], which keeps planes. Its weight is the largest that
    changes heights by the rms error of rounding, and none by more than a step.

    Parameters
    ----------
    grey : (n, m) heights, in multiples of `step`.
    step : between two grey levels.
    """
    low, high = -3.0, 8.0  # powers of ten; at the largest a bend of a hundred pixels is still followed
    best = grey
    for _ in range(HALVINGS):
        middle = (low + high) / 2
        tried = _splined(_splined(grey, 10**middle).T, 10**middle).T
        off = (tried - grey) / step
        if np.std(off) <= ROUNDING and np.abs(off).max() <= MOST_MOVED:
            low, best = middle, tried
        else:
            high = middle
    return best


def _splined(values: Floats, weight: float) -> Floats:
    """The z (n, m) that minimise |z - values|^2 + weight |second differences of z along the columns|^2."""
    from scipy.linalg import solveh_banded

    count = len(values)
    bands = np.zeros((3, count))  # of weight D^T D, D the second differences; the upper ones
    for k, factor in enumerate((1.0, -2.0, 1.0)):
        bands[2, k : count - 2 + k] += factor**2
    bands[1, 1:-1] -= 2.0
    bands[1, 2:] -= 2.0
    bands[0, 2:] += 1.0
    bands *= weight
    bands[2] += 1.0
    return np.asarray(solveh_banded(bands, values))
