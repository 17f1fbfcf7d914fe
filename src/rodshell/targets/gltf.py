"""What a glTF file announces, checked before it is read: counts, sizes, and the files that it names."""

import json
from pathlib import Path, PurePosixPath
from typing import Any
from urllib.parse import unquote

from rodshell.errors import InputError
from rodshell.targets.apart import unreadable
from rodshell.units import shown
from rodshell.untrusted import limit, raised, read_bytes

LARGEST = 300e6  # bytes of all numbers that a file announces, and of all files that it names
COMPONENTS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT2": 4, "MAT3": 9, "MAT4": 16}
WIDEST = 4  # bytes of a component
DAMAGED = (ValueError, TypeError, KeyError, AttributeError, IndexError, RecursionError)


def gltf_counts(path: Path, data: bytes) -> dict[str, int]:
    """How many there are of the parts of a glTF file that cost time.

    Raises:
        InputError: it is not a glTF file, or announces more numbers than are read.
    """
    try:
        tree = _tree(path, data)
        size = sum(_whole(part["count"]) * COMPONENTS[part["type"]] * WIDEST for part in tree.get("accessors", ()))
        counts = {what: len(tree.get(what, ())) for what in ("nodes", "meshes", "accessors", "bufferViews")}
        counts["children"] = sum(len(node.get("children", ())) for node in tree.get("nodes", ()))
        counts["primitives"] = sum(len(mesh["primitives"]) for mesh in tree.get("meshes", ()))
    except DAMAGED as reason:
        raise unreadable(path, path.suffix[1:].upper(), reason) from None
    if size > limit(LARGEST):
        raise InputError(
            f"{path} announces {size / 1e6:.4g} MB of numbers, and at most {limit(LARGEST) / 1e6:.4g} MB are read: "
            f"reduce the mesh, {raised(LARGEST, size)}"
        )
    return counts


def gltf_parts(path: Path, data: bytes) -> dict[str, bytes]:
    """The contents of the files that a .gltf file names as its buffers, by these names.

    Raises:
        InputError: it is not a glTF file; a name leads out of its folder; a file is missing or too large.
    """
    try:
        names = [str(part.get("uri", "data:")) for part in _tree(path, data).get("buffers", ())]
    except DAMAGED as reason:
        raise unreadable(path, path.suffix[1:].upper(), reason) from None
    parts, left = dict[str, bytes](), limit(LARGEST)
    for name in dict.fromkeys(name for name in names if not name.startswith("data:")):
        parts[name] = _beside(path, name, left)
        left -= len(parts[name])
    return parts


def _beside(path: Path, name: str, most: float) -> bytes:
    """The content of a file that lies in the folder of `path` or below it, and is named so."""
    plain = unquote(name)
    relative = PurePosixPath(plain)
    if relative.is_absolute() or ".." in relative.parts or any(mark in plain for mark in ":\\\0") or not plain:
        raise InputError(f"{path} names the file {shown(name)}: only files in its own folder are read")
    try:
        place = (path.parent / relative).resolve()
        inside = place.is_relative_to(path.parent.resolve())
    except (OSError, RuntimeError, ValueError):  # a name too long, or a loop of links
        inside = False
    if not inside:
        raise InputError(f"{path} names the file {shown(name)}: only files in its own folder are read")
    return read_bytes(place, most / limit(1.0))


def _tree(path: Path, data: bytes) -> Any:
    """The JSON of a file, .glb or .gltf."""
    if path.suffix.lower() == ".glb":
        tree = json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
        if any(not str(part.get("uri", "data:")).startswith("data:") for part in tree.get("buffers", ())):
            raise InputError(f"{path} names further files: save it as one file, or as .gltf")
        return tree
    return json.loads(data)


def _whole(count: Any) -> int:
    if type(count) is not int or not 0 <= count < 2**63:
        raise ValueError(f"a count of {count}")
    return count
