"""Meshes in files: OBJ, STL, PLY, OFF, glTF."""

import codecs
import io
from collections.abc import Callable, Mapping
from itertools import islice
from os import PathLike
from pathlib import Path
from typing import NamedTuple, TypeVar

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.targets.apart import unreadable
from rodshell.targets.gltf import gltf_counts, gltf_parts
from rodshell.targets.polygon_files import obj_content, off_content, ply_content
from rodshell.targets.polygons import Polygons
from rodshell.targets.trianglemesh import MOST_FACES, require_indices
from rodshell.units import as_built, shown
from rodshell.untrusted import limit, raised, read_bytes

Content = TypeVar("Content")
Notes = tuple[str, ...]

MESH_FILES = (".obj", ".stl", ".ply", ".off", ".glb", ".gltf")
IN_METRES = (".glb", ".gltf")  # the standard of these formats fixes the unit
STEP_FILES = (".step", ".stp")  # they state theirs, and are read in metres
LARGEST_FILE = 300e6  # bytes
ANOTHER_UNIT = "give another unit"
SMALLEST, LARGEST = 1e-6, 1e3  # m: extents that a gridshell can have, from micro-structures to roofs
LOOSE = 0.03  # of the vertices of a file that belong to no face: more are reported
HEAD = 4000  # bytes that hold the header
MOST_HEIGHTS = MOST_FACES // 2
MOST_PARTS = 500  # nodes, solids, properties: readers need time for each pair of them
NAMES = 20  # of a file's objects that a message lists


class FileSurface(NamedTuple):
    """The surface that a file gives.

    Args:
        vertices: (n, 3) in the file's unit.
        faces: (m, 3) triangles.
        notes: for the user, in sentences.
        trims: closed polylines (n, 3) at which it ends, in addition to its open boundary.
        unit: length of the file's unit [m]; None where the file does not state it, or its format fixes it.
    """

    vertices: Floats
    faces: Ints
    notes: Notes = ()
    trims: tuple[Floats, ...] = ()
    unit: float | None = None


def read_mesh(path: str | PathLike[str], name: str | None = None) -> FileSurface:
    """Read the surface in an OBJ, STL, PLY, OFF or glTF file.

    Args:
        name: of an object or a group, if the file has several.

    Raises:
        InputError: the file is missing, damaged or truncated; it has no surface.
    """
    path = Path(path)
    data = file_bytes(path)
    _require_bounds(path, data)
    vertices, faces = _TRIANGLES.get(path.suffix.lower(), _of_scene)(path, data, name)
    if not len(faces):
        raise InputError(f"{path} has no faces, or is damaged: export the surface as a mesh of triangles")
    listed, notes = len(vertices), Notes()
    loose = listed - len(np.unique(faces))
    if name is None and loose > LOOSE * listed:
        notes = (
            f"{loose} of the {listed} vertices of {path.name} belong to no face: if it lacks any, export it again",
        )
    return FileSurface(vertices, faces, notes)


def require_few_heights(path: Path, rows: int, columns: int) -> None:
    """Refuse a lattice with too many heights before it is read: it is meshed with two faces for each height."""
    if rows * columns > MOST_HEIGHTS:
        raise InputError(
            f"{path} has {rows} x {columns} heights: scale it down to {MOST_HEIGHTS / 1e6:g} million or fewer"
        )


def file_bytes(path: Path) -> bytes:
    """The content of a file.

    Raises:
        InputError: the file is missing, empty, a device or too large, or cannot be read.
    """
    data = read_bytes(path, LARGEST_FILE, smaller="reduce the mesh, as about 20,000 triangles are enough")
    if not data:
        raise InputError(f"{path} is empty: export it again")
    return data


def in_metres(surface: FileSurface, unit: float | None, path: Path) -> FileSurface:
    """Scale a surface to metres, and refuse a size that no gridshell has; only vertices of faces count for it.

    Args:
        unit: length of the file's unit [m]; None for the one that the file states, or that its format fixes.
        path: of the file, for the message.

    Raises:
        InputError: no unit, or a surface smaller than 1 um or larger than 1 km.
    """
    unit = surface.unit if unit is None else unit
    used = surface.vertices[np.unique(surface.faces)]
    extent = np.ptp(used, axis=0) if len(used) and np.isfinite(used).all() else np.full(3, np.nan)  # refused later
    if unit is None and path.suffix.lower() not in (*IN_METRES, *STEP_FILES) and np.isfinite(extent).all():
        raise InputError(
            f"{path} does not state its unit (it is {_units(extent)} wide): give it, such as --unit mm (in Python "
            "unit=0.001)"
        )
    scale = unit or 1.0
    require_size(path, extent, scale)
    trims = tuple(trim * scale for trim in surface.trims)
    return surface._replace(vertices=surface.vertices * scale, trims=trims, unit=unit)


def require_size(path: Path, extent: Floats, unit: float, *, instead: str = ANOTHER_UNIT) -> None:
    """Refuse a size that no gridshell has; one that is not finite is left to other checks.

    Args:
        extent: (k,) widths along x, y and perhaps z in the file's unit.
        unit: length of the file's unit [m].

    Raises:
        InputError: smaller than 1 um or larger than 1 km.
    """
    largest = float(extent.max()) * unit
    if np.isfinite(largest) and largest > 0 and not SMALLEST <= largest <= LARGEST:
        if instead == ANOTHER_UNIT and (likely := as_built(largest, unit)):
            instead += f", such as {next(iter(likely))}"
        raise InputError(
            f"{path} is {largest:.3g} m wide in this unit ({_units(extent)}): {instead}, for {SMALLEST:g} to "
            f"{LARGEST:g} m"
        )


def _units(extent: Floats) -> str:
    """Widths in the file's unit."""
    return " x ".join(f"{float(f'{side:.4g}'):.10g}" for side in extent) + " units"


def recoded(text: bytes) -> bytes:
    """Text in UTF-8, UTF-16 or a Windows code page as UTF-8."""
    try:
        text.decode("utf-8")
    except UnicodeDecodeError:
        utf16 = text.startswith((codecs.BOM_UTF16_LE, codecs.BOM_UTF16_BE))
        return text.decode("utf-16" if utf16 else "cp1252", "replace").encode("utf-8")
    return text.removeprefix(codecs.BOM_UTF8)


def _require_bounds(path: Path, data: bytes) -> None:
    """Refuse what would cost far more memory or time than a file of its size, before it is read."""
    kind, counts = path.suffix.lower(), dict[str, int]()
    if kind == ".stl":
        counts = {"solids": data.count(b"endsolid")}
    elif kind == ".ply":
        counts = {"properties": data[: data.find(b"end_header")].count(b"property")}
    elif kind in IN_METRES:
        counts = gltf_counts(path, data)
    for what, count in counts.items():
        if count > limit(MOST_PARTS):
            raise InputError(
                f"{path} has {count} {what}, and at most {limit(MOST_PARTS):.0f} are read: join its meshes, "
                f"{raised(MOST_PARTS, count)}"
            )


def _of_obj(path: Path, data: bytes, name: str | None) -> tuple[Floats, Ints]:
    faces, _, named = read_with(path, "OBJ", lambda: obj_content(recoded(data)))
    if not data.endswith((b"\n", b"\r", b"\n\0")) and len(faces.points) - 1 not in faces.corners:
        raise InputError(  # it is written in the order of its vertices
            f"{path} seems to be truncated: its last line is not complete, and faces are missing: export it again"
        )
    if name is not None:
        chosen = np.zeros(len(faces.sizes), dtype=bool)
        for first, stop in _named(path, name, named):
            chosen[first:stop] = True
        faces = faces.only(chosen)
    return faces.points, faces.triangles(str(path))


def _of_off(path: Path, data: bytes, name: str | None) -> tuple[Floats, Ints]:
    return _whole(path, name, *read_with(path, "OFF", lambda: off_content(recoded(data))))


def _of_ply(path: Path, data: bytes, name: str | None) -> tuple[Floats, Ints]:
    return _whole(path, name, *read_with(path, "PLY", lambda: ply_content(data)))


def _whole(path: Path, name: str | None, faces: Polygons, announced: dict[str, int]) -> tuple[Floats, Ints]:
    """Faces as triangles, unless there are fewer than the file announces."""
    if name is not None:
        _named(path, name, dict[str, None]())
    for what, there in (("vertex", len(faces.points)), ("face", len(faces.sizes))):
        if there < announced[what]:
            raise InputError(
                f"{path} seems to be truncated: it has {there} of {announced[what]} entries for {what}: export it again"
            )
    return faces.points, faces.triangles(str(path))


def _of_scene(path: Path, data: bytes, name: str | None) -> tuple[Floats, Ints]:
    """The triangles of an STL or glTF file, at their positions in the scene."""
    import trimesh

    kind = path.suffix[1:].lower()
    is_text = kind == "stl" and data[:5].lower() == b"solid" and b"facet" in data[:HEAD]
    parts = gltf_parts(path, data) if kind == "gltf" else {}  # nothing else is opened, whatever the file names

    def scene() -> dict[str, tuple[Floats, Ints]]:
        content, found = io.BytesIO(recoded(data) if is_text else data), dict[str, tuple[Floats, Ints]]()
        scene = trimesh.load_scene(content, file_type=kind, resolver=parts, process=False, skip_materials=True)
        placed = dict(scene.graph[node][::-1] for node in scene.graph.nodes_geometry)
        for geometry, transform in placed.items():
            mesh = scene.geometry[geometry]
            if isinstance(mesh, trimesh.Trimesh) and len(mesh.faces):
                x = np.asarray(mesh.vertices, dtype=float) @ transform[:3, :3].T + transform[:3, 3]
                found[str(geometry)] = (x, np.asarray(mesh.faces, dtype=np.intp))
        return found

    meshes = read_with(path, kind.upper(), scene)
    for vertices, faces in meshes.values():
        require_indices(vertices, faces, str(path))
    chosen = list(meshes.values()) if name is None else [_named(path, name, meshes)]
    first = np.cumsum([0] + [len(x) for x, _ in chosen])
    triangles = [np.empty((0, 3), dtype=np.intp), *(f + k for (_, f), k in zip(chosen, first, strict=False))]
    return np.vstack([np.empty((0, 3)), *(x for x, _ in chosen)]), np.vstack(triangles)


_TRIANGLES = {".obj": _of_obj, ".off": _of_off, ".ply": _of_ply}


def read_with(path: Path, format: str, reader: Callable[[], Content]) -> Content:
    """What a reader of a `format`, as it is called in messages, finds; a damaged file can break it anywhere.

    Raises:
        InputError: the reader fails.
    """
    try:
        with np.errstate(all="ignore"):  # values that are not finite are refused later, with their place
            return reader()
    except MemoryError:
        raise InputError(f"{path} announces more data than fits into memory: it is damaged; export it again") from None
    except Exception as reason:
        raise unreadable(path, format, reason) from None


def _named(path: Path, name: str, parts: Mapping[str, Content]) -> Content:
    """The part of a file that has this name."""
    if name not in parts:
        known = ", ".join([*map(shown, islice(parts, NAMES)), *["..."][: len(parts) // (NAMES + 1)]])
        known = f"it has {known}" if parts else "none in it has a name"
        raise InputError(f"{path} has no object named {shown(name)}: {known}")
    return parts[name]
