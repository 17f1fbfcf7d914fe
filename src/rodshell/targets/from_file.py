"""A target from a file: a mesh, a NURBS surface or heights on a lattice; scaled, turned and moved into place."""

import io
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from math import cos, radians
from os import PathLike
from pathlib import Path
from typing import Literal

import numpy as np
from scipy.linalg import solveh_banded
from scipy.sparse import diags_array, eye_array

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.progress import Progress, require_progress, silent
from rodshell.targets.apart import cause
from rodshell.targets.compas_files import COMPAS_FILES, read_compas
from rodshell.targets.curve_files import read_curves
from rodshell.targets.freeform import Freeform
from rodshell.targets.mesh_files import (
    IN_METRES,
    MESH_FILES,
    MOST_HEIGHTS,
    STEP_FILES,
    FileSurface,
    file_bytes,
    in_metres,
    read_mesh,
    require_few_heights,
    require_size,
)
from rodshell.targets.nurbs import grid_triangles
from rodshell.targets.nurbs_files import RHINO_FILES, read_3dm, read_step
from rodshell.targets.rim import smoothest
from rodshell.units import length_text, shown
from rodshell.untrusted import read_text
from rodshell.validation import brief, choice, file_path, instance, keep, number, numbers, positive

File = str | PathLike[str]

_READERS: dict[str, tuple[str, Callable[[Path, str | None], FileSurface]]] = {  # and the kind of target
    **dict.fromkeys(MESH_FILES, ("mesh", read_mesh)),
    **dict.fromkeys(COMPAS_FILES, ("mesh", read_compas)),
    **dict.fromkeys(RHINO_FILES, ("nurbs", read_3dm)),
    **dict.fromkeys(STEP_FILES, ("nurbs", read_step)),
}
TABLES = (".csv", ".txt")
IMAGES = ("PNG", "PPM", "JPEG", "TIFF")  # whatever a file is called, others, such as EPS, are never opened
GRID_FILES = (*TABLES, ".png", ".pgm", ".jpg", ".jpeg", ".tif", ".tiff")
LARGEST_TABLE = 100e6  # bytes: of 1.5 million points, written with 20 digits
STEEP = 60.0  # degrees: a surface that is steeper than this on average may have been turned
CLEAR = 0.3  # length of the mean of its normals from which it is judged: a hemisphere has 0.5, a closed mesh none
FEWEST = 4  # heights each way
POINT = 3  # numbers in a row of points x, y, z; heights need more each way
EVEN = 0.02  # of a step: coordinates go in equal steps, except for rounding
LEAP = 4.0  # times the change to the next row: a row of coordinates differs by more, heights hardly ever
SQUARE = 0.01  # relative difference allowed between the proportions of the points and of the size

COARSE = 1 / 300  # of white: an image whose levels are further apart, such as one of 8 bits, has terraces
ROUNDING = 12**-0.5  # levels, rms: error that rounding to levels adds to a smooth height
MOST_MOVED = 1.0  # levels by which a height may be changed
POWERS, HALVINGS = (-3.0, 8.0), 12  # of the weight: at the largest a bend of a hundred pixels is still followed


def read_heights(path: Path, size: tuple[float, float], height: float | None) -> FileSurface:
    """Read heights on a lattice and mesh them, in metres and centred on the origin; empty cells and "nan" are holes.

    Args:
        size: width along x and depth along y [m]; the file's first row is at the largest y, depth / 2.
        height: of a table the factor of its numbers; of an image the height of white, black being 0 [m]; None for 1.

    Raises:
        InputError: the file is missing or damaged, or its numbers are not a lattice.
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
    widths = np.ptp(points[known], axis=0) if known.any() else np.zeros(3)
    require_size(path, widths, 1.0, instead="give another size or height")
    return FileSurface(points, faces[known[faces].all(axis=1)], notes)


def read_table(path: Path, size: tuple[float, float]) -> tuple[Floats, Floats, Floats]:
    """Read a table of heights, or of points x, y, z that are a complete lattice.

    Cells are separated by semicolons, tabs, commas or blanks; unless by commas, a comma is a decimal point. Empty cells
    are holes; between blanks, which leave no cell empty, "nan" is one.

    Args:
        size: width and depth [m]. Rows of heights are at equal steps within it, the largest y first; points keep their
            proportions and are scaled to it.

    Returns:
        Heights (rows, columns) in the file's unit, x of the columns and y of the rows, centred on the origin [m].

    Raises:
        InputError: the file is missing, is not a table of numbers, or its points are not a lattice.
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
    text = read_text(path, LARGEST_TABLE, instead="save it as CSV in UTF-8")
    lines = [line for line in text.splitlines() if line.strip() and not line.startswith("#")]
    separator = next((mark for mark in ";\t," if lines and mark in lines[0]), None)
    columns = len(lines[0].split(separator, MOST_HEIGHTS)) if lines else 0
    require_few_heights(path, len(lines), 1 if columns == POINT else columns)
    rows = [[cell.strip() for cell in line.split(separator, columns)] for line in lines]
    if separator is None:  # blanks leave no cell empty
        return [["" if cell.lower() == "nan" else cell.replace(",", ".") for cell in row] for row in rows]
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
        table = np.array([[float(cell) if cell else np.nan for cell in row] for row in rows]).reshape(-1, widths.pop())
    except ValueError as reason:
        raise InputError(f"{path} is not a table of numbers ({str(reason)[:60]}): give rows of heights") from None
    for row, column in np.argwhere(np.isnan(table)).tolist():
        if cell := rows[row][column]:
            raise InputError(
                f"{path}: row {row + 1}, column {column + 1} is {shown(cell)}, not a number: leave the cell empty "
                "where there is no surface"
            )
    return table


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
    if len(points) != len(x) * len(y) or len(cells) != len(points) or min(len(x), len(y)) < 2:
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
    """Heights (rows, columns) of a grey image, black being 0 and white 1, and the step between grey levels where that
    is coarse, or None: then terraces are smoothed away within one level.

    Raises:
        InputError: the file is missing or damaged, or has too many pixels (found before they are decoded).
    """
    from PIL import Image

    data = io.BytesIO(file_bytes(path))
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", Image.DecompressionBombWarning)  # the limit here is lower
            opened = Image.open(data, formats=IMAGES)
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
    """Heights (n, m), in multiples of `step`, smoothed by no more than the rounding to its levels explains.

    It is a smoothing spline along both axes [Eilers and Marx 1996], which keeps planes. Its weight is the largest that
    changes heights by the rms error of rounding, and none by more than a step.
    """

    def allowed(tried: Floats) -> bool:
        off = (tried - grey) / step
        return bool(np.std(off) <= ROUNDING and np.abs(off).max() <= MOST_MOVED)

    return smoothest(grey, lambda weight: _splined(_splined(grey, weight).T, weight).T, allowed, POWERS, HALVINGS)


def _splined(values: Floats, weight: float) -> Floats:
    """The z (n, m) that minimise |z - values|^2 + weight |second differences of z along the columns|^2."""
    count = len(values)
    second = diags_array([1.0, -2.0, 1.0], offsets=[0, 1, 2], shape=(count - 2, count))
    system = eye_array(count) + weight * (second.T @ second)
    bands = [np.append(np.zeros(k), system.diagonal(k)) for k in (2, 1, 0)]
    return np.asarray(solveh_banded(bands, values))


@dataclass(frozen=True, kw_only=True)
class Placement:
    """Where the surface of a file is placed: x -> scale turn(x) + move.

    Args:
        up: axis of the file that points upwards, which becomes z before anything else; None: y of glTF, as its standard
            says, and z of other files.
        turn: angles about x, y and z, applied in that order [rad].
        move: along x, y and z, applied last [m].

    Raises:
        InputError: the scale is not positive, or a number is missing or not finite; another axis points upwards.
    """

    up: Literal["z", "y"] | None = None
    scale: float = 1.0
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    move: tuple[float, float, float] = (0.0, 0.0, 0.0)

    __repr__ = brief

    def __post_init__(self) -> None:
        if self.up is not None:
            choice("target up", self.up, ("z", "y"))
        keep(self, positive, "", "scale", what="target {}")
        turn = numbers("target turn", self.turn, "three finite angles about x, y and z in rad", 3, "rad")
        move = numbers("target move", self.move, "three finite lengths along x, y and z in m", 3, "m")
        object.__setattr__(self, "turn", turn)
        object.__setattr__(self, "move", move)

    def __call__(self, x: Floats) -> Floats:
        """Place the points `x` (n, 3) [m]."""
        if self.up == "y":
            x = x[:, [0, 2, 1]] * [1.0, -1.0, 1.0]
        for axis, angle in enumerate(self.turn):
            c, s = np.cos(angle), np.sin(angle)
            i, j = (axis + 1) % 3, (axis + 2) % 3
            turned = x.copy()
            turned[:, i], turned[:, j] = c * x[:, i] - s * x[:, j], s * x[:, i] + c * x[:, j]
            x = turned
        return np.asarray(self.scale * x + np.array(self.move))

    def parameters(self) -> dict[str, object]:
        """The values that differ from the defaults, as they are written in a case file."""
        values = {key: list(value) if isinstance(value, tuple) else value for key, value in vars(self).items()}
        return {key: value for key, value in values.items() if value not in (None, 1.0, [0.0, 0.0, 0.0])}


UNMOVED = Placement()


def surface_from(
    file: File,
    *,
    unit: float | None = None,
    name: str | None = None,
    base: float | None = None,
    boundary: File | None = None,
    placement: Placement = UNMOVED,
    progress: Progress = silent,
) -> Freeform:
    """Make a target of the surface in an OBJ, STL, PLY, OFF, glTF, 3dm or STEP file.

    Args:
        unit: length of the file's unit [m]; None where the file states its unit.
        name: object name, if the file has several (3dm: object or layer name, or number; STEP: name of a face, shell or
            solid, or the number of a face). The untrimmed faces of a 3dm polysurface are joined.
        base: z of a plane below which there is no shell [m], after placement; None for a surface that ends at its edge.
        boundary: path of an OBJ, DXF or 3dm file with closed curves on the surface, in the same unit, unless a 3dm file
            states its own, and placed with it: the longest bounds the shell, the others are openings.
        placement: scales, turns and moves the surface.
        progress: called before the file is read, and at each step of the fit.

    Raises:
        InputError: an argument or a file cannot be used; one sentence says why.
    """
    path = file_path("file", file)
    if unit is not None:
        positive("unit", unit, "m")
    if name is not None:
        instance("name", name, str, "text, the name of an object")
    kind, read = _READERS.get(path.suffix.lower(), ("", None))
    if read is None:
        raise InputError(f"{path} is not a surface file: use one of {', '.join(_READERS)}")
    if unit is not None and path.suffix.lower() in STEP_FILES:
        raise InputError(f"{path}: STEP files state their unit: leave it out, or scale the target")

    def found() -> FileSurface:
        return in_metres(read(path, name), unit, path)

    return _placed(path, found, base, boundary, placement, {"kind": kind, "object": name}, progress)


def heights_from(
    file: File,
    *,
    size: tuple[float, float],
    height: float | None = None,
    base: float | None = None,
    boundary: File | None = None,
    placement: Placement = UNMOVED,
    progress: Progress = silent,
) -> Freeform:
    """Make a target of heights on a lattice: a CSV with a row of heights for each y, a CSV of points, or a grey image.

    Args:
        size: width along x and depth along y [m], centred on the origin; the first row is at the largest y.
        height: of a CSV the length of its unit [m], default 1; of an image the height of white [m], default 1.
        base, boundary, placement, progress: as in `surface_from`, with the boundary in metres.

    Raises:
        InputError: an argument or a file cannot be used; one sentence says why.
    """
    path = file_path("file", file)
    width, depth = numbers("size", size, "two lengths in m: width along x, depth along y", 2, "m")
    positive("size", width, "m")
    positive("size", depth, "m")
    if height is not None:
        positive("height", height, "m")
    if path.suffix.lower() not in GRID_FILES:
        raise InputError(f"{path} is not a file of heights: use one of {', '.join(GRID_FILES)}")
    source: dict[str, object] = {"kind": "heights", "size": [width, depth], "height": height}
    return _placed(
        path, lambda: read_heights(path, (width, depth), height), base, boundary, placement, source, progress
    )


def _placed(
    path: Path, read: Callable[[], FileSurface], base: float | None, boundary: File | None, placement: Placement,
    source: dict[str, object], progress: Progress,
) -> Freeform:  # fmt: skip
    """The target of the surface that is `read` from a file, with what a case says of its `source`."""
    if base is not None:
        number("target base", base, "m")
    instance("placement", placement, Placement)
    require_progress(progress)
    progress("preparing", f"reading {shown(path.name)}", 0.0)
    surface = read()
    curves = list(surface.trims)
    if boundary is not None:
        drawn = file_path("boundary", boundary)
        curves += read_curves(drawn, surface.unit or 1.0)
        source["boundary"] = str(drawn.resolve())
    source |= {"unit": surface.unit, "file": str(path.resolve()), "base": base, **placement.parameters()}
    chosen = {key: value for key, value in source.items() if value is not None}
    usual: Literal["z", "y"] = "y" if path.suffix.lower() in IN_METRES else "z"
    turned = placement if placement.up is not None else replace(placement, up=usual)
    placed = tuple(turned(curve) for curve in curves)
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = turned(surface.vertices)
        if placement.up is None and _stands(vertices, surface.faces):
            other = "z" if usual == "y" else "y"
            raise InputError(
                f"{path} is steeper than {STEEP:.0f} degrees on average: does {other} point upwards in it? Then give "
                f'target.up = "{other}" (--up {other}; in Python Placement(up="{other}")), and otherwise "{usual}"'
            )
    return Freeform.of(
        vertices, surface.faces, base=base, curves=placed, source=chosen, name=shown(path.name), notes=surface.notes,
        progress=progress,
    )  # fmt: skip


def _stands(vertices: Floats, faces: Ints) -> bool:
    """Whether the mean normal of a surface is more level than upright, as of one whose y points upwards.

    The mean follows from the end alone: towers and deep domes on level ground do not stand so, and closed meshes have
    none. What is steep here and there does not matter.
    """
    a, b, c = vertices[faces].transpose(1, 0, 2)
    normals = np.cross(b - a, c - a)
    mean = normals.sum(axis=0)
    length = float(np.linalg.norm(mean))
    clear = length > CLEAR * np.linalg.norm(normals, axis=1).sum()
    return bool(clear and abs(mean[2]) < cos(radians(STEEP)) * length)
