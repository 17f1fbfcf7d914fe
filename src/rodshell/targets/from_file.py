"""A target from a file: a mesh, a NURBS surface or heights on a lattice; scaled, turned and moved into place."""

from dataclasses import dataclass
from os import PathLike
from pathlib import Path

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.targets.freeform import Freeform
from rodshell.targets.height_files import GRID_FILES, read_heights
from rodshell.targets.mesh_files import MESH_FILES, in_metres, read_curves, read_mesh
from rodshell.targets.nurbs_files import RHINO_FILES, STEP_FILES, read_3dm, read_step
from rodshell.units import shown
from rodshell.validation import file_path, instance, number, numbers, positive

File = str | PathLike[str]

SURFACE_FILES = (*MESH_FILES, *RHINO_FILES, *STEP_FILES)


@dataclass(frozen=True, kw_only=True)
class Placement:
    """Where the surface of a file is placed: x -> scale turn(x) + move.

    Parameters
    ----------
    scale : factor, about the origin.
    turn : angles about x, y and z, applied in that order [rad].
    move : along x, y and z, applied last [m].

    Raises
    ------
    InputError : the scale is not positive, or a number is missing or not finite.
    """

    scale: float = 1.0
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    move: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        positive("target scale", self.scale, "")
        turn = numbers("target turn", self.turn, "three finite angles about x, y and z in rad", 3)
        move = numbers("target move", self.move, "three finite lengths along x, y and z in m", 3)
        object.__setattr__(self, "turn", turn)
        object.__setattr__(self, "move", move)

    def __call__(self, x: Floats) -> Floats:
        """Place the points `x` (n, 3) [m]."""
        for axis, angle in enumerate(self.turn):
            c, s = np.cos(angle), np.sin(angle)
            i, j = (axis + 1) % 3, (axis + 2) % 3
            turned = x.copy()
            turned[:, i], turned[:, j] = c * x[:, i] - s * x[:, j], s * x[:, i] + c * x[:, j]
            x = turned
        return np.asarray(self.scale * x + np.array(self.move))

    def parameters(self) -> dict[str, object]:
        """The values that differ from the defaults, as they are written in a case file."""
        values: dict[str, object] = {"scale": self.scale, "turn": list(self.turn), "move": list(self.move)}
        defaults = {"scale": 1.0, "turn": [0.0, 0.0, 0.0], "move": [0.0, 0.0, 0.0]}
        return {key: value for key, value in values.items() if value != defaults[key]}


UNMOVED = Placement()


def surface_from(
    file: File,
    *,
    unit: float | None = None,
    name: str | None = None,
    base: float | None = None,
    boundary: File | None = None,
    placement: Placement = UNMOVED,
) -> Freeform:
    """Make a target of the surface in an OBJ, STL, PLY, OFF, glTF, 3dm or STEP file.

    Parameters
    ----------
    file : path.
    unit : length of the file's unit [m]; None where the file states its unit.
    name : object name, if the file has several (3dm: object or layer name; STEP: name of a face, shell or solid, or
        the number of a face).
    base : z of a plane below which there is no shell [m], after placement; None for a surface that ends at its edge.
    boundary : path of an OBJ or DXF file with closed curves on the surface, in the same unit and placed with it: the
        longest bounds the shell, the others are openings.
    placement : scales, turns and moves the surface.

    Raises
    ------
    InputError : an argument or a file cannot be used; one sentence says why.
    """
    path = file_path("file", file)
    if unit is not None:
        positive("unit", unit, "m")
    _require_placing(name, base, placement)
    curves: list[Floats] = []
    if path.suffix.lower() in MESH_FILES:
        kind, (vertices, faces) = "mesh", read_mesh(path, unit, name)
    elif path.suffix.lower() in RHINO_FILES:
        kind, (vertices, faces, trims, stated) = "nurbs", read_3dm(path, name)
        unit = stated if unit is None else unit
        vertices = in_metres(vertices, faces, unit, path)
        curves = [trim * (unit or 1.0) for trim in trims]
    elif path.suffix.lower() in STEP_FILES:
        if unit is not None:
            raise InputError(f"{path}: STEP files state their unit: leave it out, or scale the target")
        kind, (vertices, faces, curves) = "nurbs", read_step(path, name)
        vertices = in_metres(vertices, faces, 1.0, path)
    else:
        raise InputError(f"{path} is not a surface file: use one of {', '.join(SURFACE_FILES)}")
    source: dict[str, object] = {"kind": kind, "unit": unit, "object": name}
    return _placed(path, vertices, faces, curves, unit or 1.0, base, boundary, placement, source)


def heights_from(
    file: File,
    *,
    size: tuple[float, float],
    height: float | None = None,
    base: float | None = None,
    boundary: File | None = None,
    placement: Placement = UNMOVED,
) -> Freeform:
    """Make a target of heights on a lattice: a CSV with a row of heights for each y, a CSV of points, or a grey image.

    Parameters
    ----------
    file : path.
    size : width along x and depth along y [m], centred on the origin; the first row is that of the largest y.
    height : of a CSV the length of its unit [m], default 1; of an image the height of white [m], default 1.
    base, boundary, placement : as of `surface_from`, with the boundary in metres.

    Raises
    ------
    InputError : an argument or a file cannot be used; one sentence says why.
    """
    path = file_path("file", file)
    width, depth = numbers("size", size, "two lengths in m: width along x, depth along y", 2)
    positive("size", width, "m")
    positive("size", depth, "m")
    if height is not None:
        positive("height", height, "m")
    _require_placing(None, base, placement)
    if path.suffix.lower() not in GRID_FILES:
        raise InputError(f"{path} is not a file of heights: use one of {', '.join(GRID_FILES)}")
    vertices, faces, notes = read_heights(path, (width, depth), height)
    source: dict[str, object] = {"kind": "heights", "size": [width, depth], "height": height}
    return _placed(path, vertices, faces, [], 1.0, base, boundary, placement, source, notes)


def _require_placing(name: str | None, base: float | None, placement: Placement) -> None:
    if name is not None:
        instance("name", name, str, "text, the name of an object")
    if base is not None:
        number("target base", base, "m")
    instance("placement", placement, Placement)


def _placed(
    path: Path,
    vertices: Floats,
    faces: Ints,
    curves: list[Floats],
    unit: float,
    base: float | None,
    boundary: File | None,
    placement: Placement,
    source: dict[str, object],
    notes: tuple[str, ...] = (),
) -> Freeform:
    if boundary is not None:
        drawn = file_path("boundary", boundary)
        curves = curves + read_curves(drawn, unit)
        source["boundary"] = str(drawn.resolve())
    source |= {"file": str(path.resolve()), "base": base, **placement.parameters()}
    chosen = {key: value for key, value in source.items() if value is not None}
    placed = tuple(placement(curve) for curve in curves)
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = placement(vertices)
    return Freeform.of(vertices, faces, base=base, curves=placed, source=chosen, name=shown(path.name), notes=notes)
