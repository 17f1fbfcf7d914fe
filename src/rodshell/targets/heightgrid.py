"""Heights on a lattice, from a table (CSV) or a grey image, as a surface in triangles."""

from pathlib import Path

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.targets.greyimage import read_image
from rodshell.targets.heighttable import read_table
from rodshell.targets.nurbs import grid_triangles
from rodshell.units import length_text

TABLES = (".csv", ".txt")
GRID_FILES = (*TABLES, ".png", ".pgm", ".jpg", ".jpeg", ".tif", ".tiff")
FEWEST = 4  # heights each way


def read_heights(path: Path, size: tuple[float, float], height: float | None) -> tuple[Floats, Ints, tuple[str, ...]]:
    """Vertices (n, 3) [m], centred on the origin, triangles (m, 3), and what a user should read about them.

    Parameters
    ----------
    size : width along x and depth along y; the file's first row lies at the far end, y = depth / 2.
    height : of a CSV None or the factor of its numbers; of an image the height of white, black being 0.

    Raises
    ------
    InputError : no such file, damaged, no lattice of numbers. Empty cells and "nan" are holes.
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
                "heights were smoothed within a step; an image of 16 bits needs no smoothing",
            )
    if min(z.shape) < FEWEST:
        raise InputError(f"{path} has {z.shape[0]} x {z.shape[1]} heights: give {FEWEST} or more each way")
    across, along = np.meshgrid(x, y)
    faces = grid_triangles(*z.shape)[:, ::-1]
    known = np.isfinite(z.ravel())
    points = np.column_stack([across.ravel(), along.ravel(), height * z.ravel()])
    return points, faces[known[faces].all(axis=1)], notes
