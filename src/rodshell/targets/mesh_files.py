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
from rodshell.targets.apart import read_apart, unreadable
from rodshell.targets.gltf import gltf_counts, gltf_parts
from rodshell.targets.trianglemesh import FARTHEST, MOST_FACES, require_indices
from rodshell.units import shown
from rodshell.untrusted import limit, raised, read_bytes

CURVE_FILES = (".obj", ".dxf")
MESH_FILES = (".obj", ".stl", ".ply", ".off", ".glb", ".gltf")
IN_METRES = (".glb", ".gltf")  # the standard of these formats fixes the unit
LARGEST_FILE = 300e6  # bytes
SMALLEST, LARGEST = 1e-3, 1e3  # m: extents that a gridshell can have
WHOLE = 0.97  # of the vertices of a complete file belong to faces; fewer in a truncated one
HEAD = 4000  # bytes that hold the header
MOST_HEIGHTS = MOST_FACES // 2
MOST_PARTS = 500  # nodes, solids, properties: readers need time for each pair of them
MOST_STROKES = 5_000  # curves of a drawing: they are joined end to end
NO_INDEX = re.compile(rb"^f[ \t](?:.*[ \t])?-?0+(?![^\s/]).*", re.MULTILINE)  # indices begin at 1
SAG = 2e-5  # of a curve's extent: how finely arcs and splines of a DXF are divided


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
    _require_bounds(path, data)
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
    InputError : the file is missing, empty, a device or too large, or cannot be read.
    """
    data = read_bytes(path, LARGEST_FILE, smaller="reduce the mesh, as about 20,000 triangles are enough")
    if not data:
        raise InputError(f"{path} is empty: export it again")
    return data


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
    if kind == ".obj":  # materials split a mesh, each at the cost of a search through all vertices
        return re.sub(rb"^usemtl .*$", b"", recoded(data), flags=re.MULTILINE)
    if kind == ".off" or (kind == ".stl" and data[:5].lower() == b"solid" and b"facet" in data[:HEAD]):
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


def _require_bounds(path: Path, data: bytes) -> None:
    """Refuse what would cost far more memory or time than a file of its size, before it is read."""
    kind, counts = path.suffix.lower(), dict[str, int]()
    if kind == ".stl":
        counts = {"solids": data.count(b"endsolid")}
    elif kind == ".ply":
        counts = {"properties": data[: data.find(b"end_header")].count(b"property")}
    elif kind == ".obj" and (wrong := NO_INDEX.search(data)):
        raise InputError(f"{path} is damaged: a face refers to vertex 0 ({shown(wrong[0].decode())}): export it again")
    elif kind in IN_METRES:
        counts = gltf_counts(path, data)
    for what, count in counts.items():
        if count > limit(MOST_PARTS):
            raise InputError(
                f"{path} has {count} {what}, and at most {limit(MOST_PARTS):.0f} are read: join its meshes, "
                f"{raised(MOST_PARTS, count)}"
            )


def _loaded(path: Path, data: bytes) -> dict[str, Any]:
    """The meshes in a file by name, transformed to their positions in the scene."""
    import trimesh

    kind = path.suffix[1:].lower()
    parts = gltf_parts(path, data) if kind == "gltf" else {}  # nothing else is opened, whatever the file names
    try:
        with np.errstate(all="ignore"):  # values that are not finite are refused later, with their place
            scene = trimesh.load_scene(
                io.BytesIO(data), file_type=kind, resolver=parts, process=False, skip_materials=True
            )
            placed = dict(scene.graph[node][::-1] for node in scene.graph.nodes_geometry)
            found: dict[str, Any] = {}
            for geometry, transform in placed.items():
                mesh = scene.geometry[geometry]
                if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
                    x = np.asarray(mesh.vertices, dtype=float) @ transform[:3, :3].T + transform[:3, 3]
                    found[str(geometry)] = (x, np.asarray(mesh.faces, dtype=np.intp))
    except MemoryError:
        raise InputError(f"{path} announces more data than fits into memory: it is damaged; export it again") from None
    except Exception as reason:  # a damaged file can break a reader anywhere
        raise unreadable(path, path.suffix[1:].upper(), reason) from None
    for vertices, faces in found.values():
        require_indices(vertices, faces, str(path))
    return found


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
    strokes = _of_dxf(path, data, FARTHEST / unit) if path.suffix.lower() == ".dxf" else _of_obj(path, data)
    far = max((float(np.abs(stroke).max()) * unit for stroke in strokes if len(stroke)), default=0.0)
    _require_near(path, far)
    return [stroke * unit for stroke in strokes if len(stroke) > 1]


def _require_few_strokes(path: Path, count: int) -> None:
    if count > limit(MOST_STROKES):
        raise InputError(
            f"{path} has {count} curves, and at most {limit(MOST_STROKES):.0f} are read: draw one polyline around the "
            f"shell, {raised(MOST_STROKES, count)}"
        )


def _require_near(path: Path, far: float) -> None:
    if not far <= FARTHEST:
        raise InputError(f"{path} has curves with coordinates up to {far:.3g} m: draw them near the origin")


def _of_obj(path: Path, data: bytes) -> list[Floats]:
    """The `l` elements of an OBJ."""
    points, lines = list[list[float]](), list[list[int]]()
    try:
        for words in map(str.split, recoded(data).decode("utf-8").splitlines()):
            if words[:1] == ["v"]:
                points.append([float(word) for word in words[1:4]])
            elif words[:1] == ["l"]:
                lines.append([int(word.split("/")[0]) for word in words[1:]])
        _require_few_strokes(path, len(lines))
        x = np.array(points, dtype=float).reshape(len(points), 3)
        return [x[[k - 1 if k > 0 else k or len(x) for k in line]] for line in lines]  # 0 is refused
    except (ValueError, IndexError) as reason:
        raise unreadable(path, "a drawing of curves", reason) from None


def _of_dxf(path: Path, data: bytes, farthest: float) -> list[Floats]:
    request = {"sag": SAG, "most": limit(MOST_STROKES), "farthest": farthest}
    found = read_apart(Path(__file__).with_name("dxf_curves.py"), path, data, "a drawing of curves", **request)
    _require_few_strokes(path, int(found["count"]))
    if "points" not in found:
        _require_near(path, float(found["far"]) * FARTHEST / farthest)
    return np.split(found["points"], found["ends"][1:-1])
