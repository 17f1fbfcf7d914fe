"""Heights on a lattice, from a table (CSV) or a grey image, as a surface in triangles."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from gridshell.errors import InputError
from gridshell.targets.meshfile import file_bytes
from gridshell.targets.nurbs import grid_triangles

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]

GRID_FILES = (".csv", ".txt", ".png", ".pgm", ".jpg", ".jpeg", ".tif", ".tiff")
FEWEST = 4  # heights each way


def read_heights(path: Path, size: tuple[float, float], height: float | None) -> tuple[Floats, Ints]:
    """Vertices (n, 3) and triangles in the file's unit, centred on the origin.

    Parameters
    ----------
    size : width along x and depth along y; the file's first row lies at the far end, y = depth / 2.
    height : of a CSV None or the factor of its numbers; of an image the height of white, black being 0.

    Raises
    ------
    InputError : no such file, damaged, no lattice of numbers. Empty cells and "nan" are holes.
    """
    z = _table(path) if path.suffix.lower() in (".csv", ".txt") else _image(path)
    if min(z.shape) < FEWEST:
        raise InputError(f"{path} has {z.shape[0]} x {z.shape[1]} heights: give {FEWEST} or more each way")
    z = z * (1.0 if height is None else height)
    y, x = np.meshgrid(np.linspace(size[1], -size[1], z.shape[0]) / 2, np.linspace(-size[0], size[0], z.shape[1]) / 2,
                       indexing="ij")  # fmt: skip
    faces = grid_triangles(*z.shape)[:, ::-1]
    known = np.isfinite(z.ravel())
    return np.column_stack([x.ravel(), y.ravel(), z.ravel()]), faces[known[faces].all(axis=1)]


def _table(path: Path) -> Floats:
    data = file_bytes(path)
    try:
        rows = [line for line in data.decode("utf-8-sig").splitlines() if line.strip() and not line.startswith("#")]
        separator = max(";\t,", key=rows[0].count) if rows else ","
        cells = [[cell.strip() for cell in (row.split(separator) if separator in row else row.split())] for row in rows]
        numbers = [[float(cell) if cell else np.nan for cell in row] for row in cells]
    except ValueError as reason:
        raise InputError(f"{path} is no table of numbers ({str(reason)[:60]}): give rows of heights") from None
    widths = {len(row) for row in numbers}
    if len(widths) != 1:
        raise InputError(f"{path}: its rows have {min(widths, default=0)} to {max(widths, default=0)} heights: "
                         "give as many in every row")  # fmt: skip
    table = np.array(numbers)
    if np.isinf(table).any():
        raise InputError(f"{path} holds infinite heights: leave the cell empty where there is no surface")
    return table


def _image(path: Path) -> Floats:
    file_bytes(path)
    try:
        from PIL import Image
    except ImportError:
        raise InputError(f"{path}: cannot be read as an image: give a PNG or a CSV") from None
    try:
        with Image.open(path) as image:
            image.load()
            if image.mode.startswith("I"):  # 16 bits
                return np.asarray(image, dtype=float) / 65535.0
            return np.asarray(image.convert("F"), dtype=float) / 255.0
    except Exception as reason:  # a damaged image can break a reader anywhere
        raise InputError(f"{path} cannot be read as an image ({str(reason)[:60]}): save it anew") from None
