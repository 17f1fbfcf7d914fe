"""Surfaces in files: OBJ, STL, PLY, OFF and glTF, in the unit that the user states."""

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
from rodshell.targets.trianglemesh import MOST_FACES
from rodshell.units import shown

MESH_FILES = (".obj", ".stl", ".ply", ".off", ".glb", ".gltf")
IN_METRES = (".glb", ".gltf")  # by their standard
LARGEST_FILE = 300e6  # bytes
SMALLEST, LARGEST = 1e-3, 1e3  # m: extents that a gridshell can have
WHOLE = 0.97  # of the vertices of a sound file belong to faces; of one cut short, fewer
HEAD = 4000  # bytes in which a header lies
MOST_HEIGHTS = MOST_FACES // 2
LONGEST = 120  # characters of a reader's own words


def read_mesh(path: str | PathLike[str], unit: float | None, name: str | None = None) -> tuple[Floats, Ints]:
    """Vertices (n, 3) [m] and triangles (m, 3) of the surface in a file.

    Parameters
    ----------
    unit : length of the file's unit [m]; None only for a format that has one of its own.
    name : of the object wanted, in a file that holds several.

    Raises
    ------
    InputError : no such file, damaged or cut short, without a surface, without a unit, of an absurd size.
    """
    path = Path(path)
    data = _in_utf8(path, file_bytes(path))
    meshes = _loaded(path, data)
    if not meshes:
        raise InputError(f"{path} holds no faces, or is damaged: export the surface as a mesh of triangles")
    if name is not None:
        if name not in meshes:
            raise InputError(f"{path} has no object named {shown(name)}: it holds {', '.join(map(shown, meshes))}")
        meshes = {name: meshes[name]}
    vertices, faces = _joined(list(meshes.values()))
    if name is None:
        _require_whole(path, data, vertices, faces)
    return in_metres(vertices, faces, unit, path), faces


def require_few_heights(path: Path, rows: int, columns: int) -> None:
    """A lattice of heights becomes two faces for each; asked before more than its extent is read."""
    if rows * columns > MOST_HEIGHTS:
        raise InputError(
            f"{path} has {rows} x {columns} heights: scale it down to {MOST_HEIGHTS / 1e6:g} million or fewer"
        )


def file_bytes(path: Path) -> bytes:
    """The content of a file that is there, is none of the largest, and is not empty."""
    if not path.is_file():
        raise InputError(f"there is no file named {shown(str(path))}: give the path of one that is there")
    size = path.stat().st_size
    if size == 0:
        raise InputError(f"{path} is empty: export it anew")
    if size > LARGEST_FILE:
        raise InputError(f"{path} has {size / 1e6:.0f} MB: reduce the mesh; some 20,000 triangles are enough")
    try:
        return path.read_bytes()
    except OSError as reason:
        raise InputError(f"{path} cannot be read: {reason.strerror}") from None


def in_metres(vertices: Floats, faces: Ints, unit: float | None, path: Path) -> Floats:
    """The vertices scaled by the unit, if the result can be a shell."""
    used = vertices[np.unique(faces)] if len(faces) else vertices
    extent = np.ptp(used, axis=0) if len(used) and np.isfinite(used).all() else np.full(3, np.nan)
    size = " x ".join(f"{float(f'{side:.4g}'):.10g}" for side in extent)
    if unit is None:
        if path.suffix.lower() not in IN_METRES:
            raise InputError(f"{path} does not say its unit (it is {size} units wide): give it, such as --unit mm")
        unit = 1.0
    largest = float(extent.max()) * unit
    if np.isfinite(largest) and largest > 0 and not SMALLEST <= largest <= LARGEST:
        raise InputError(
            f"{path} is {largest:.3g} m wide in this unit ({size} units): give another unit, for "
            f"{SMALLEST:g} to {LARGEST:g} m"
        )
    return vertices * unit


def _in_utf8(path: Path, data: bytes) -> bytes:
    """The content, what is text in it as the reader wants it: names and comments may be written otherwise."""
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
    """The meshes in a file by name, each in its place."""
    import trimesh

    kind = path.suffix[1:].lower()
    inputs = {"file_obj": str(path)} if kind == "gltf" else {"file_obj": io.BytesIO(data), "file_type": kind}
    try:
        with np.errstate(all="ignore"):  # what is not finite is refused later, with its place
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
        raise InputError(f"{path} claims to be larger than the memory: it is damaged; export it anew") from None
    except Exception as reason:  # a damaged file can break a reader anywhere
        raise InputError(
            f"{path} cannot be read as {path.suffix[1:].upper()}: it is damaged or of another format; export it anew "
            f"(the reader says: {cause(reason)})"
        ) from None


def cause(reason: Exception) -> str:
    """What a reader says of a file that it cannot read, in one short line."""
    said = " ".join(str(reason).split())[:LONGEST]
    return f"{type(reason).__name__}: {said}" if said else type(reason).__name__


def _joined(meshes: list[tuple[Floats, Ints]]) -> tuple[Floats, Ints]:
    first = np.cumsum([0] + [len(x) for x, _ in meshes])
    return np.vstack([x for x, _ in meshes]), np.vstack([f + k for (_, f), k in zip(meshes, first, strict=False)])


def _require_whole(path: Path, data: bytes, vertices: Floats, faces: Ints) -> None:
    """Text formats can be cut short and still be read: what the file announces must be there."""
    used, kind = len(np.unique(faces)), path.suffix.lower()
    announced: Mapping[str, int] = {}
    if kind == ".obj":
        listed = len(re.findall(rb"^\s*v\s", data, re.MULTILINE))
        if used < WHOLE * listed:
            raise InputError(
                f"{path} seems to be cut short: {listed - used} of its {listed} vertices belong to no face"
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
                f"{path} seems to be cut short: it has {there} entries of {count} for {what}: export it anew"
            )
