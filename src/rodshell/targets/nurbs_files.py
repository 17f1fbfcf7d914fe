"""NURBS surfaces in Rhino's 3dm files and in STEP files: points of the whole surface, and its trims as curves."""

import json
import re
from importlib.util import find_spec
from math import degrees, radians
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.errors import InputError
from rodshell.geometry.curves import closed_loops
from rodshell.targets.apart import read_apart
from rodshell.targets.joined_faces import joined
from rodshell.targets.mesh_files import FileSurface, file_bytes
from rodshell.targets.nurbs import FINEST, GRID, PER_SPAN, Nurbs, grid_triangles
from rodshell.units import shown

_ALONG_EDGES = 400  # straight pieces of each trimming edge
MOST_JOINED = 100  # faces of a polysurface
KINK = radians(3.0)  # faces that meet at less are smooth
_LISTED = 12  # faces named in a message

RHINO_FILES = (".3dm",)
RHINO_UNITS = {
    "Microns": 1e-6, "Millimeters": 1e-3, "Centimeters": 1e-2, "Decimeters": 0.1, "Meters": 1.0, "Kilometers": 1e3,
    "Inches": 0.0254, "Feet": 0.3048, "Yards": 0.9144,
}  # fmt: skip

MILLIMETRE = 1e-3  # m: OpenCASCADE converts every unit to millimetres
_LAST_LINE = b"END-ISO-10303-21"
_ABSURD = re.compile(rb"-?\d\.\d*E\+?\d{3,}")  # OpenCASCADE does not terminate with such coordinates
READERS = Path(__file__).parent


def read_3dm(path: Path, name: str | None = None) -> FileSurface:
    """Read one surface of a 3dm file; the untrimmed faces of a polysurface are joined.

    Args:
        name: object or layer name, or the surface's number from 1 on, if the file has several surfaces.

    Raises:
        InputError: the file is missing or damaged; rhino3dm is not installed; the file has no such face, or several.
    """
    found = rhino_content(path, file_bytes(path), name=name)
    if "surfaces" not in found:
        raise _no_single_surface(path, json.loads(str(found["names"])), name, json.loads(str(found["others"])))
    surfaces = [_nurbs(path, found, k) for k in range(int(found["surfaces"]))]
    trims, unit = tuple(closed_loops(found["trims"])), RHINO_UNITS.get(str(found["unit"]))
    if len(surfaces) == 1:
        return FileSurface(*surfaces[0].triangles(), trims=trims, unit=unit)
    vertices, triangles, bend = joined(surfaces, str(path))
    note = (
        f"faces of {path.name} meet at angles of up to {degrees(bend):.0f} degrees: a seam along such an edge "
        "keeps the crease, which is rounded off otherwise"
    )
    return FileSurface(vertices, triangles, (note,) if bend > KINK else (), trims, unit)


def _nurbs(path: Path, found: dict[str, Any], k: int) -> Nurbs:
    """The k-th surface of what `opennurbs` finds."""
    # OpenNURBS omits the first and the last knot
    knots = [np.concatenate([side[:1], side, side[-1:]]) for side in (found[f"knots_u{k}"], found[f"knots_v{k}"])]
    surface = Nurbs(tuple(found[f"degrees{k}"].tolist()), (knots[0], knots[1]), found[f"controls{k}"])
    if surface.fault:
        raise InputError(f"{path} is damaged: {surface.fault}: save it again from Rhino")
    return surface


def rhino_content(path: Path, data: bytes, **request: object) -> dict[str, Any]:
    """What `opennurbs` finds in a 3dm file.

    Args:
        request: the `name` of a surface; or the `most` curves that are read.

    Raises:
        InputError: the file is damaged; rhino3dm is not installed.
    """
    if find_spec("rhino3dm") is None:
        raise InputError(f'{path}: 3dm files need rhino3dm: pip install "rodshell[rhino]"')
    found = read_apart(
        READERS / "opennurbs.py", path, data, "3DM", along_edges=_ALONG_EDGES, most_joined=MOST_JOINED, **request
    )
    if not found:
        raise InputError(f"{path} cannot be read as 3DM: save it again from Rhino")
    return found


def _no_single_surface(
    path: Path, surfaces: list[tuple[str, str, int]], name: str | None, others: list[int]
) -> InputError:
    if not surfaces:
        kinds = zip(others, ("mesh", "SubD", "curve"), ("meshes", "SubDs", "curves"), strict=True)
        there = ", ".join(f"{count} {single if count == 1 else several}" for count, single, several in kinds if count)
        remedy = "export the mesh as OBJ, or save a surface" if others[0] else "save a surface"
        return InputError(f"{path} has {there or 'nothing'}, and no surface: {remedy}")
    number = int(name) if name and name.isdecimal() else 0
    faces = [count for label, layer, count in surfaces if name in (None, label, layer)]
    if not faces and 0 < number <= len(surfaces):
        faces = [surfaces[number - 1][2]]
    if len(faces) == 1:
        return InputError(
            f"{path}: the surface has {faces[0]} faces, of which at most {MOST_JOINED} are joined, and only untrimmed "
            "ones: merge them, or export a mesh"
        )
    names = [[label or layer] if label or layer else [] for label, layer, _ in surfaces]
    return _choose_one(path, f"{len(faces)} surfaces", names, name, "its number, or by its object or layer name")


def _choose_one(path: Path, found: str, parts: list[list[str]], name: str | None, by: str) -> InputError:
    """What is said of a file that has none or several parts of a name; it lists all `parts`, each with its names."""
    named = "" if name is None else f" named {shown(name)}"
    listed = [", ".join([str(k), *map(shown, names)]) for k, names in enumerate(parts[:_LISTED], start=1)]
    available = "; ".join(listed) + ("; ..." if len(parts) > _LISTED else "")
    return InputError(f"{path} has {found}{named}: choose one by {by} (available: {available})")


def read_step(path: Path, name: str | None = None) -> FileSurface:
    """Read one face of a STEP file, in metres, in a separate process (see `opencascade`).

    Args:
        name: of the face or of its shell or solid, or the face's number from 1 on, if the file has several.

    Raises:
        InputError: the file is missing or damaged; OpenCASCADE is not installed; the file has no such face, or several.
    """
    if find_spec("OCP") is None:
        raise InputError(f'{path}: STEP files need OpenCASCADE: pip install "rodshell[step]"')
    data = file_bytes(path)
    if _LAST_LINE not in data[-1000:]:
        raise InputError(f"{path} is truncated: its last line, {_LAST_LINE.decode()}, is missing; export it again")
    if far := _ABSURD.search(data):
        raise InputError(f"{path} is damaged: it has a coordinate {far[0].decode()}; export it again")
    samples = {"grid": GRID, "per_span": PER_SPAN, "finest": FINEST, "along_edges": _ALONG_EDGES}
    parts = read_apart(READERS / "opencascade.py", path, data, "STEP", name=name, **samples)
    if "points" not in parts:
        faces = json.loads(str(parts["names"]))
        if not faces:
            raise InputError(f"{path} has no face: export the surface, not its edges or its mesh, as STEP")
        count = sum(name is None or name in names for names in faces)
        raise _choose_one(path, f"{count} faces", faces, name, "its name or number")
    rows, columns, _ = parts["points"].shape
    vertices, triangles = MILLIMETRE * parts["points"].reshape(-1, 3), grid_triangles(rows, columns)
    return FileSurface(vertices, triangles, trims=tuple(closed_loops(MILLIMETRE * parts["trims"])))
