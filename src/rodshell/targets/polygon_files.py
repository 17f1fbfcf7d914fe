"""Readers of the formats whose faces have any number of corners: OBJ, with its curves; OFF; PLY.

Of a damaged file they raise whatever exception it leads to.
"""

import io
import re
import struct
from array import array
from collections.abc import Sequence
from contextlib import suppress
from itertools import chain, islice, pairwise
from typing import NamedTuple

import numpy as np

from rodshell.targets.polygons import Polygons

NUMBERS = {  # of a PLY file, as `struct` names them
    "char": "b", "uchar": "B", "short": "h", "ushort": "H", "int": "i", "uint": "I", "float": "f", "double": "d",
    "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "float32": "f", "float64": "d",
}  # fmt: skip
CORNERS = ("vertex_index", "vertex_indices")


class _Faces:
    """Points and faces as they are read, a few bytes a number."""

    def __init__(self) -> None:
        self.points, self.corners, self.sizes = array("d"), array("q"), array("q")

    @property
    def known(self) -> int:
        return len(self.points) // 3

    def add_point(self, words: Sequence[bytes | float]) -> None:
        x, y, z = words
        self.points.extend((float(x), float(y), float(z)))

    def add(self, corners: Sequence[int]) -> None:
        self.corners.extend(corners)
        self.sizes.append(len(corners))

    def polygons(self) -> Polygons:
        corners, sizes = (np.array(values, dtype=np.intp) for values in (self.corners, self.sizes))
        return Polygons(np.array(self.points).reshape(-1, 3), corners, sizes)


class ObjContent(NamedTuple):
    """What is read of an OBJ file.

    Args:
        lines: polylines, each the indices of its points.
        named: for each name of an object or a group the runs of its faces, each by its first face and the one after it.
    """

    polygons: Polygons
    lines: list[list[int]]
    named: dict[str, list[tuple[int, int]]]


def obj_content(data: bytes) -> ObjContent:
    """Read faces and polylines of an OBJ file."""
    faces, lines = _Faces(), list[list[int]]()
    begun: list[tuple[int, bytes, str]] = []  # from which face on, "o" or "g", its names
    for words in map(bytes.split, io.BytesIO(data.replace(b"\\\n", b" "))):
        key = words[0] if words else b""
        if key == b"v":
            faces.add_point(words[1:4])
        elif key == b"f":
            faces.add([_index(word, faces.known) for word in words[1:]])
        elif key == b"l":
            lines.append([_index(word, faces.known) for word in words[1:]])
        elif key in (b"o", b"g"):
            begun.append((len(faces.sizes), key, b" ".join(words[1:]).decode("utf-8", "replace")))
    named = dict[str, list[tuple[int, int]]]()
    for kind in (b"o", b"g"):  # a group continues where the next object begins
        starts = [(first, name) for first, of, name in begun if of == kind]
        for (first, name), (stop, _) in pairwise([*starts, (len(faces.sizes), "")]):
            if stop > first:
                named.setdefault(name, []).append((first, stop))
    return ObjContent(faces.polygons(), lines, named)


def _index(word: bytes, known: int) -> int:
    """The index of a point, from 0 on, of a corner such as 7/1/2, or -1 for the last point so far."""
    number = int(word.partition(b"/")[0])
    if number == 0:
        raise ValueError(f"a face refers to vertex 0 ({word.decode()})")
    return number - 1 if number > 0 else known + number


def off_content(data: bytes) -> tuple[Polygons, dict[str, int]]:
    """Read an OFF file: its faces, and the numbers of vertices and faces that it announces."""
    lines = filter(None, (line.partition(b"#")[0].split() for line in io.BytesIO(data)))
    kind, *counts = next(lines)
    if not re.fullmatch(b"(ST|C|N)*OFF", kind):
        raise ValueError("it does not begin with OFF")
    vertices, faces = (int(word) for word in (counts or next(lines))[:2])
    found = _Faces()
    for words in islice(lines, vertices):
        found.add_point(words[:3])
    for words in islice(lines, faces):
        found.add([int(word) for word in words[1 : 1 + int(words[0])]])
    return found.polygons(), {"vertex": vertices, "face": faces}


def ply_content(data: bytes) -> tuple[Polygons, dict[str, int]]:
    """Read a PLY file, text or binary, as `off_content` does; it has fewer faces if it ends too early."""
    head, _, body = data.partition(b"end_header")
    _, _, body = body.partition(b"\n")
    form, announced, properties = "ascii", dict[str, int](), dict[str, list[list[str]]]()
    for line in map(str.split, head.decode("utf-8", "replace").splitlines()):
        match line:
            case ["format", form, *_]:
                pass
            case ["element", element, rows]:
                announced[element], properties[element] = int(rows), []
            case ["property", *described]:
                properties[element].append(described)
    words, at = chain.from_iterable(map(bytes.split, io.BytesIO(body))), 0
    order = ">" if form == "binary_big_endian" else "<"

    def values(count: int, kind: str) -> Sequence[float]:
        nonlocal at
        if form == "ascii":
            found = [float(word) for word in islice(words, count)]
            if len(found) < count:
                raise EOFError
            return found
        packed = struct.Struct(f"{order}{count}{NUMBERS[kind]}")
        at += packed.size
        return packed.unpack_from(body, at - packed.size)

    found = _Faces()
    with suppress(EOFError, struct.error):
        for name, count in announced.items():
            for _ in range(count if properties[name] else 0):
                row = dict[str, Sequence[float]]()
                for *counted, kind, what in properties[name]:
                    row[what] = values(int(values(1, counted[1])[0]) if counted else 1, kind)
                if name == "vertex":
                    found.add_point([row[axis][0] for axis in "xyz"])
                elif name == "face":
                    found.add([int(corner) for corner in row[next(filter(row.__contains__, CORNERS))]])
    return found.polygons(), {what: announced.get(what, 0) for what in ("vertex", "face")}
