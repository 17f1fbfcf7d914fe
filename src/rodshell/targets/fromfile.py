"""A target from a file of any kind that is read: mesh, NURBS surface, or heights on a lattice."""

from os import PathLike
from pathlib import Path

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.targets.curvefile import read_curves
from rodshell.targets.freeform import Freeform
from rodshell.targets.heightgrid import GRID_FILES, read_heights
from rodshell.targets.meshfile import MESH_FILES, in_metres, read_mesh
from rodshell.targets.placement import Placement
from rodshell.targets.rhino import RHINO_FILES, read_3dm
from rodshell.targets.step import STEP_FILES, read_step
from rodshell.units import shown

File = str | PathLike[str]

SURFACE_FILES = (*MESH_FILES, *RHINO_FILES, *STEP_FILES)
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
    """The surface in an OBJ, STL, PLY, OFF, glTF, 3dm or STEP file.

    Parameters
    ----------
    unit : length of the file's unit [m]; None where the format has one of its own.
    name : of the object wanted, where there are several (3dm: or of its layer; STEP: of a face or of what it
        belongs to, or the face's number).
    base : z of a plane under which there is no shell [m], after placement.
    boundary : an OBJ or DXF with closed curves on the surface, in the same unit and placed with it: the longest
        bounds the shell, the others are openings.

    Raises
    ------
    InputError : the file cannot be used; one sentence says why.
    """
    path = Path(file)
    curves: list[Floats] = []
    if path.suffix.lower() in MESH_FILES:
        kind, (vertices, faces) = "mesh", read_mesh(path, unit, name)
    elif path.suffix.lower() in RHINO_FILES:
        kind, (vertices, faces, trims, own) = "nurbs", read_3dm(path, name)
        unit = own if unit is None else unit
        vertices = in_metres(vertices, faces, unit, path)
        curves = [trim * (unit or 1.0) for trim in trims]
    elif path.suffix.lower() in STEP_FILES:
        if unit is not None:
            raise InputError(f"{path}: STEP files say their unit: leave it out, or scale the target")
        kind, (vertices, faces, curves) = "nurbs", read_step(path, name)
        vertices = in_metres(vertices, faces, 1.0, path)
    else:
        raise InputError(f"{path} is no surface file: give one of {', '.join(SURFACE_FILES)}")
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
    """The surface through heights on a lattice: a CSV with a row of heights for each y or with points x, y, z, or a
    grey image.

    Parameters
    ----------
    size : width along x and depth along y [m], centred on the origin; the first row is that of the largest y.
    height : of a CSV the length of its unit [m], default 1; of an image the height of white [m].
    base, boundary, placement : as of `surface_from`, the boundary in metres.

    Raises
    ------
    InputError : the file cannot be used; one sentence says why.
    """
    path = Path(file)
    if path.suffix.lower() not in GRID_FILES:
        raise InputError(f"{path} holds no lattice of heights: give one of {', '.join(GRID_FILES)}")
    vertices, faces, notes = read_heights(path, size, height)
    source: dict[str, object] = {"kind": "heights", "size": list(size), "height": height}
    return _placed(path, vertices, faces, [], 1.0, base, boundary, placement, source, notes)


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
        curves = curves + read_curves(Path(boundary), unit)
        source["boundary"] = str(Path(boundary).resolve())
    source |= {"file": str(path.resolve()), "base": base, **placement.parameters()}
    given = {key: value for key, value in source.items() if value is not None}
    placed = tuple(placement(curve) for curve in curves)
    with np.errstate(over="ignore", invalid="ignore"):
        vertices = placement(vertices)
    return Freeform.of(vertices, faces, base=base, curves=placed, source=given, name=shown(path.name), notes=notes)
