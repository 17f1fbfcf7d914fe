"""Meshes and curves in files: OBJ, STL, PLY, OFF, glTF; polylines of OBJ and DXF."""

import codecs
import io
import re
from collections.abc import Mapping
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.curves import closed_loops, join_end_to_end
from rodshell.targets.trianglemesh import MOST_FACES
from rodshell.units import shown

CURVE_FILES = (".obj", ".dxf")
MESH_FILES = (".obj", ".stl", ".ply", ".off", ".glb", ".gltf")
IN_METRES = (".glb", ".gltf")  # the standard of these formats fixes the unit
LARGEST_FILE = 300e6  # bytes
SMALLEST, LARGEST = 1e-3, 1e3  # m: extents that a gridshell can have
WHOLE = 0.97  # of the vertices of a complete file belong to faces; fewer in a truncated one
HEAD = 4000  # bytes that hold the header
MOST_HEIGHTS = MOST_FACES // 2
LONGEST = 120  # characters quoted from a reader's message
SAG = 1e-4  # of a curve's extent: how finely arcs and splines of a DXF are divided


def read_mesh(path: str | PathLike[str], unit: float | None, name: str | None = None) -> tuple[Floats, Ints]:
    """Read the surface in a mesh file.

    Parameters
    ----------
    path : an OBJ, STL, PLY, OFF or glTF file.
    unit : length of the file's unit [m]; None only for a format that fixes it.
    name : object name, if the file has several.

    Returns
    -------
    Vertices (n, 3) [m] and triangles (m, 3).

    Raises
    ------
    InputError : the file is missing, damaged or truncated; it has no surface or no unit; its size is implausible.
    """
    path = Path(path)
    data = _in_utf8(path, file_bytes(path))
    meshes = _loaded(path, data)
    if not meshes:
        raise InputError(f"{path} has no faces, or is damaged: export the surface as a mesh of triangles")
    if name is not None:
        if name not in meshes:
            raise InputError(f"{path} has no object named {shown(name)}: it has {', '.join(map(shown, meshes))}")
        meshes = {name: meshes[name]}
    vertices, faces = _merged(list(meshes.values()))
    if name is None:
        _require_whole(path, data, vertices, faces)
    return in_metres(vertices, faces, unit, path), faces


def require_few_heights(path: Path, rows: int, columns: int) -> None:
    """Refuse a lattice with too many heights before it is read: it is meshed with two faces for each height."""
    if rows * columns > MOST_HEIGHTS:
        raise InputError(
            f"{path} has {rows} x {columns} heights: scale it down to {MOST_HEIGHTS / 1e6:g} million or fewer"
        )


def file_bytes(path: Path) -> bytes:
    """The content of a file.

    Raises
    ------
    InputError : the file is missing, empty or too large, or cannot be read.
    """
    if not path.is_file():
        raise InputError(f"there is no file named {shown(str(path))}: check the path")
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{path} is empty: export it again")
    if size > LARGEST_FILE:
        raise InputError(f"{path} has {size / 1e6:.0f} MB: reduce the mesh; about 20,000 triangles are enough")
    try:
        return path.read_bytes()
    except OSError as reason:
        raise InputError(f"{path} cannot be read: {reason.strerror}") from None


def in_metres(vertices: Floats, faces: Ints, unit: float | None, path: Path) -> Floats:
    """Scale vertices to metres, and refuse a size that no gridshell has.

    Parameters
    ----------
    vertices : (n, 3) in the file's unit.
    faces : (m, 3); only vertices of faces count for the size.
    unit : length of the file's unit [m]; None only for a format that fixes it.
    path : of the file, for the message.

    Raises
    ------
    InputError : no unit, or a surface smaller than 1 mm or larger than 1 km.
    """
    used = vertices[np.unique(faces)] if len(faces) else vertices
    extent = np.ptp(used, axis=0) if len(used) and np.isfinite(used).all() else np.full(3, np.nan)
    if unit is None:
        if path.suffix.lower() not in IN_METRES and np.isfinite(extent).all():  # else it is refused for that
            raise InputError(
                f"{path} does not state its unit (it is {_units(extent)} wide): give it, such as --unit mm (in Python "
                "unit=0.001)"
            )
        unit = 1.0
    require_size(path, extent, unit)
    return vertices * unit


def require_size(path: Path, extent: Floats, unit: float, *, instead: str = "give another unit") -> None:
    """Refuse a size that no gridshell has; one that is not finite is left to other checks.

    Parameters
    ----------
    path : of the file, for the message.
    extent : (k,) widths along x, y and perhaps z in the file's unit.
    unit : length of the file's unit [m].
    instead : what can be done.

    Raises
    ------
    InputError : smaller than 1 mm or larger than 1 km.
    """
    largest = float(extent.max()) * unit
    if np.isfinite(largest) and largest > 0 and not SMALLEST <= largest <= LARGEST:
        raise InputError(
            f"{path} is {largest:.3g} m wide in this unit ({_units(extent)}): {instead}, for {SMALLEST:g} to "
            f"{LARGEST:g} m"
        )


def _units(extent: Floats) -> str:
    """Widths in the file's unit."""
    return " x ".join(f"{float(f'{side:.4g}'):.10g}" for side in extent) + " units"


def _in_utf8(path: Path, data: bytes) -> bytes:
    """The content with its text in UTF-8, as the reader expects it: names and comments may be encoded otherwise."""
    kind = path.suffix.lower()
    if kind == ".ply":
        head, end, body = data.partition(b"end_header")
        return recoded(head) + end + body
    if kind in (".obj", ".off") or (kind == ".stl" and data[:5].lower() == b"solid" and b"facet" in data[:HEAD]):
        return recoded(data)
    return data


def recoded(text: bytes) -> bytes:
    """Text in UTF-8, UTF-16 or a Windows code page as UTF-8."""
    try:
        text.decode("utf-8")
    except UnicodeDecodeError:
        utf16 = text.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        return text.decode("utf-16" if utf16 else "cp1252", "replace").encode("utf-8")
    return text


def _loaded(path: Path, data: bytes) -> dict[str, Any]:
    """The meshes in a file by name, transformed to their positions in the scene."""
    import trimesh

    kind = path.suffix[1:].lower()
    inputs = {"file_obj": str(path)} if kind == "gltf" else {"file_obj": io.BytesIO(data), "file_type": kind}
    try:
        with np.errstate(all="ignore"):  # values that are not finite are refused later, with their place
            scene = trimesh.load_scene(**inputs, process=False, skip_materials=True)
            found: dict[str, Any] = {}
            for node in scene.graph.nodes_geometry:
                transform, geometry = scene.graph[node]
                mesh = scene.geometry[geometry]
                if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
                    x = np.asarray(mesh.vertices, dtype=float) @ transform[:3, :3].T + transform[:3, 3]
                    found[str(geometry)] = (x, np.asarray(mesh.faces, dtype=np.intp))
            return found
    except MemoryError:
        raise InputError(f"{path} announces more data than fits into memory: it is damaged; export it again") from None
    except Exception as reason:  # a damaged file can break a reader anywhere
        raise InputError(
            f"{path} cannot be read as {path.suffix[1:].upper()}: it is damaged or of another format; export it again "
            f"(the reader says: {cause(reason)})"
        ) from None


def cause(reason: Exception) -> str:
    """The message of a reader's exception, on one short line."""
    said = " ".join(str(reason).split())[:LONGEST]
    return f"{type(reason).__name__}: {said}" if said else type(reason).__name__


def _merged(meshes: list[tuple[Floats, Ints]]) -> tuple[Floats, Ints]:
    first = np.cumsum([0] + [len(x) for x, _ in meshes])
    return np.vstack([x for x, _ in meshes]), np.vstack([f + k for (_, f), k in zip(meshes, first, strict=False)])


def _require_whole(path: Path, data: bytes, vertices: Floats, faces: Ints) -> None:
    """Refuse a truncated file. Readers accept truncated text: the result is compared with counts in the file."""
    used, kind = len(np.unique(faces)), path.suffix.lower()
    announced: Mapping[str, int] = {}
    if kind == ".obj":
        listed = len(re.findall(rb"^\s*v\s", data, re.MULTILINE))
        if used < WHOLE * listed:
            raise InputError(
                f"{path} seems to be truncated: {listed - used} of its {listed} vertices belong to no face: export it "
                "again"
            )
    elif kind == ".ply":
        head = data[:HEAD].decode("ascii", "replace")
        announced = {what: int(n) for what, n in re.findall(r"element (vertex|face) (\d+)", head)}
    elif kind == ".off" and (numbers := re.search(rb"OFF\s*(?:#.*\s*)*(\d+)\s+(\d+)", data[:HEAD])):
        announced = {"vertex": int(numbers[1]), "face": int(numbers[2])}
    for what, count in announced.items():
        there = len(vertices if what == "vertex" else faces)
        if there < count:
            raise InputError(
                f"{path} seems to be truncated: it has {there} of {count} entries for {what}: export it again"
            )


def read_curves(path: Path, unit: float) -> list[Floats]:
    """Read closed curves from an OBJ or DXF file.

    Parameters
    ----------
    path : of the file.
    unit : length of the file's unit [m].

    Returns
    -------
    Closed polylines (n, 3) [m], the longest first: the edge of the shell, then its openings.

    Raises
    ------
    InputError : the file is missing or damaged, or has no closed curve.
    """
    loops = closed_loops(_strokes(path, unit))
    if not loops or not all(np.isfinite(loop).all() for loop in loops):
        raise InputError(f"{path} has no closed curve with finite coordinates: draw one polyline around the shell")
    return loops


def read_lines(path: Path, unit: float) -> list[Floats]:
    """Read open and closed curves from an OBJ or DXF file; those that touch end to end are joined.

    Parameters
    ----------
    path : of the file.
    unit : length of the file's unit [m].

    Returns
    -------
    Polylines (n, 3) [m].

    Raises
    ------
    InputError : the file is missing or damaged, or has no curve.
    """
    lines = join_end_to_end(_strokes(path, unit))
    if not lines or not all(np.isfinite(line).all() for line in lines):
        raise InputError(f"{path} has no line with finite coordinates: draw a polyline along each seam")
    return lines


def _strokes(path: Path, unit: float) -> list[Floats]:
    """Polylines (n, 3) [m] in the order of the file."""
    data = file_bytes(path)
    if path.suffix.lower() not in CURVE_FILES:
        raise InputError(f"{path}: curves are read from {' or '.join(CURVE_FILES)} files")
    try:
        strokes = _of_dxf(path) if path.suffix.lower() == ".dxf" else _of_obj(data)
    except Exception as reason:  # a damaged file can break a reader anywhere
        raise InputError(
            f"{path} cannot be read as a drawing of curves: it is damaged or of another format; export it again "
            f"(the reader says: {cause(reason)})"
        ) from None
    return [np.asarray(stroke, dtype=float) * unit for stroke in strokes if len(stroke) > 1]


def _of_obj(data: bytes) -> list[Floats]:
    """The `l` elements of an OBJ."""
    points, lines = list[list[float]](), list[list[int]]()
    for words in map(str.split, recoded(data).decode("utf-8").splitlines()):
        if words[:1] == ["v"]:
            points.append([float(word) for word in words[1:4]])
        elif words[:1] == ["l"]:
            lines.append([int(word.split("/")[0]) for word in words[1:]])
    x = np.array(points)
    return [x[[k - 1 if k > 0 else k for k in line]] for line in lines]


def _of_dxf(path: Path) -> list[Floats]:
    import ezdxf
    from ezdxf import path as curves

    space = ezdxf.readfile(path).modelspace()
    kinds = "LINE LWPOLYLINE POLYLINE ARC CIRCLE ELLIPSE SPLINE"
    found = [curves.make_path(entity) for entity in space.query(kinds)]
    strokes = list[Floats]()
    for curve in found:
        rough = np.array([tuple(p) for p in curve.flattening(1e9)])
        sag = SAG * max(float(np.ptp(rough, axis=0).max()), 1e-12)
        strokes.append(np.array([tuple(p) for p in curve.flattening(sag)]))
    return strokes
