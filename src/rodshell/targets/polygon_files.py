"""Readers of the formats whose faces have any number of corners: OBJ, with its curves; OFF; PLY."""

import re
import struct
from array import array
from collections.abc import Generator, Sequence
from itertools import pairwise
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

    def add_point(self, words: Sequence[str | float]) -> None:
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

    Parameters
    ----------
    polygons : the faces.
    lines : polylines, each the indices of its points.
    named : for each name of an object or a group the runs of its faces, each by its first face and the one after it.
    """

    polygons: Polygons
    lines: list[list[int]]
    named: dict[str, list[tuple[int, int]]]


def obj_content(text: str) -> ObjContent:
    """Read faces and polylines of an OBJ file.

    Raises
    ------
    ValueError, IndexError : the text is damaged.
    """
    faces, lines = _Faces(), list[list[int]]()
    begun: list[tuple[int, str, str]] = []  # from which face on, "o" or "g", its names
    for words in map(str.split, text.replace("\\\n", " ").split("\n")):
        key = words[0] if words else ""
        if key == "v":
            faces.add_point(words[1:4])
        elif key == "f":
            faces.add([_index(word, faces.known) for word in words[1:]])
        elif key == "l":
            lines.append([_index(word, faces.known) for word in words[1:]])
        elif key in ("o", "g"):
            begun.append((len(faces.sizes), key, " ".join(words[1:])))
    named = dict[str, list[tuple[int, int]]]()
    for kind in "og":  # a group continues where the next object begins
        starts = [(first, name) for first, of, name in begun if of == kind]
        for (first, name), (stop, _) in pairwise([*starts, (len(faces.sizes), "")]):
            if stop > first:
                named.setdefault(name, []).append((first, stop))
    return ObjContent(faces.polygons(), lines, named)


def _index(word: str, known: int) -> int:
    """The index of a point, from 0 on, of a corner such as 7/1/2, or -1 for the last point so far."""
    number = int(word.partition("/")[0])
    if number == 0:
        raise ValueError(f"a face refers to vertex 0 ({word})")
    return number - 1 if number > 0 else known + number


def off_content(text: str) -> tuple[Polygons, dict[str, int]]:
    """Read an OFF file.

    Returns
    -------
    Its faces, and the numbers of vertices and faces that it announces.

    Raises
    ------
    ValueError, IndexError : the text is damaged.
    """
    lines = [words for line in text.splitlines() if (words := line.partition("#")[0].split())]
    if not re.fullmatch("(ST|C|N)*OFF", lines[0].pop(0)):
        raise ValueError("it does not begin with OFF")
    lines = lines if lines[0] else lines[1:]
    vertices, faces = (int(word) for word in lines[0][:2])
    found = _Faces()
    for words in lines[1 : 1 + vertices]:
        found.add_point(words[:3])
    for words in lines[1 + vertices :][:faces]:
        found.add([int(word) for word in words[1 : 1 + int(words[0])]])
    return found.polygons(), {"vertex": vertices, "face": faces}


def ply_content(data: bytes) -> tuple[Polygons, dict[str, int]]:
    """Read a PLY file, text or binary.

    Returns
    -------
    Its faces, and the numbers of vertices and faces that it announces.

    Raises
    ------
    ValueError, IndexError, KeyError, struct.error : the file is damaged.
    """
    head, _, body = data.partition(b"end_header")
    _, _, body = body.partition(b"\n")
    form, announced, properties = "ascii", dict[str, int](), dict[str, list[list[str]]]()
    for words in map(str.split, head.decode("utf-8", "replace").splitlines()):
        match words:
            case ["format", form, *_]:
                pass
            case ["element", name, count]:
                announced[name], properties[name] = int(count), []
            case ["property", *kind]:
                list(properties.values())[-1].append(kind)
    rows = _of_text(body) if form == "ascii" else _of_bytes(body, ">" if form == "binary_big_endian" else "<")
    next(rows)
    found = _Faces()
    for name, rows_of_it in announced.items():
        names = [kind[-1] for kind in properties[name]]
        wanted = [names.index(axis) for axis in "xyz"] if name == "vertex" else []
        wanted = [names.index(next(filter(CORNERS.__contains__, names)))] if name == "face" else wanted
        for _ in range(rows_of_it if names else 0):
            row = rows.send(properties[name])
            if row is None:
                break
            if name == "vertex":
                found.add_point([row[k][0] for k in wanted])
            elif name == "face":
                found.add([int(corner) for corner in row[wanted[0]]])
    return found.polygons(), {what: announced.get(what, 0) for what in ("vertex", "face")}


Row = list[Sequence[float]] | None
"""The values of each property in one row of an element; None past the end of the file."""


def _of_text(body: bytes) -> Generator[Row, list[list[str]], None]:
    """Rows of a text, for the properties that are sent."""
    kinds = yield None
    for words in map(str.split, body.decode("ascii", "replace").splitlines()):
        if words:
            row, at = list[Sequence[float]](), 0
            for kind in kinds:
                count, at = (int(words[at]), at + 1) if kind[0] == "list" else (1, at)
                row.append([float(word) for word in words[at : at + count]])
                at += count
            kinds = yield row
    while True:
        yield None


def _of_bytes(body: bytes, order: str) -> Generator[Row, list[list[str]], None]:
    """Rows of a binary file, as `_of_text`."""
    kinds, at = (yield None), 0
    while True:
        row = list[Sequence[float]]()
        for kind in kinds:
            count = 1
            if kind[0] == "list":
                (count,) = struct.unpack_from(order + NUMBERS[kind[1]], body, at)
                at += struct.calcsize(NUMBERS[kind[1]])
            row.append(struct.unpack_from(f"{order}{count}{NUMBERS[kind[-2]]}", body, at))
            at += count * struct.calcsize(NUMBERS[kind[-2]])
        kinds = yield row
