"""glTF 2.0, binary: each rod swept along its final shape, coloured by the gap to the target. Metres, y up."""

import json
import struct
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats
from rodshell.geometry.frames import cross, directors_along, unit
from rodshell.output.colour_scale import scale_of
from rodshell.output.grid import rods_of, shape_of
from rodshell.results import Archive
from rodshell.results.records import Section

ROUND = 8  # sides of a circle
SLENDER = 1e-3  # of the shell's size: thickness of a rod whose section has no shape
FLOAT, INDEX, VERTICES, ELEMENTS = 5126, 5125, 34962, 34963  # glTF's numbers for types and uses


def glb_bytes(archive: Archive, state: str) -> bytes:
    """One node, mesh and name for each rod.

    Parameters
    ----------
    state : "draped", "popped_pinned" or "popped_clamped".
    """
    shape, rods = shape_of(archive, state), [rod for rod in rods_of(archive) if len(rod.nodes) > 1]
    outline = section_outline(archive, float(np.ptp(shape.positions, axis=0).max()))
    scale = scale_of(archive, shape, "gap")
    colours = None
    if scale is not None:
        palette = np.array([[int(c[k : k + 2], 16) / 255 for k in (1, 3, 5)] for c in scale.palette]) ** 2.2
        colours = np.split(palette[scale.bins], np.cumsum([len(rod.nodes) for rod in rods])[:-1])
    file = _Glb()
    for k, rod in enumerate(rods):
        points, normals, faces = swept(shape.positions[rod.nodes], outline)
        shades = None if colours is None else np.repeat(colours[k], len(outline), axis=0)
        file.add(rod.id, points, normals, faces, shades)
    return file.content()


def section_outline(archive: Archive, size: float) -> Floats:
    """(s, 2) corners of the rods' section [m], across and up; of a section without a shape, a thin circle.

    Up is m1, the normal of the grid: a rectangle's width and an ellipse's a lie there.

    Parameters
    ----------
    size : of the shell [m], for the thickness of a section without a shape.
    """
    section = (archive.results.rod.section if archive.results.rod else None) or Section()
    if section.kind == "rectangle" and section.height is not None and section.width is not None:
        w, h = 0.5 * section.height, 0.5 * section.width
        return np.array([[w, -h], [w, h], [-w, h], [-w, -h]])
    radius = section.radius or SLENDER * size
    a, b = section.a or radius, section.b or radius
    angle = np.linspace(0, 2 * np.pi, ROUND, endpoint=False)
    return np.column_stack([b * np.cos(angle), a * np.sin(angle)])


def swept(curve: Floats, outline: Floats) -> tuple[Floats, Floats, NDArray[np.uint32]]:
    """A tube: points and normals (k s, 3), triangles (t, 3), the outline (s, 2) swept along a curve (k, 3).

    The frame has no twist and begins as upright as possible. The ends are open.

    Parameters
    ----------
    curve : (k, 3) nodes [m]; outline : (s, 2) corners across and up [m].
    """
    edges = unit(np.diff(curve, axis=0))
    up = np.array([0.0, 0.0, 1.0]) if abs(edges[0, 2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    directors = directors_along(edges, up)
    raised = unit(np.vstack([directors[:1], directors[:-1] + directors[1:], directors[-1:]]))
    tangents = unit(np.vstack([edges[:1], edges[:-1] + edges[1:], edges[-1:]]))
    across = unit(cross(raised, tangents))
    raised = cross(tangents, across)
    ring = outline[None, :, 0, None] * across[:, None] + outline[None, :, 1, None] * raised[:, None]
    points = (curve[:, None] + ring).reshape(-1, 3)
    s = len(outline)
    k, j = np.meshgrid(np.arange(len(curve) - 1), np.arange(s), indexing="ij")
    a, b = k * s + j, k * s + (j + 1) % s
    faces = np.stack([a, b, b + s, a, b + s, a + s], axis=-1).reshape(-1, 3)
    return points, unit(ring.reshape(-1, 3)), faces.astype(np.uint32)


class _Glb:
    """Collects meshes; every array goes to the one buffer."""

    def __init__(self) -> None:
        self._views: list[dict[str, Any]] = []
        self._accessors: list[dict[str, Any]] = []
        self._meshes: list[dict[str, Any]] = []
        self._nodes: list[dict[str, Any]] = []
        self._parts: list[bytes] = []
        self._length = 0

    def add(
        self, name: str, points: Floats, normals: Floats, faces: NDArray[np.uint32], colours: Floats | None
    ) -> None:
        upright = [np.column_stack([x[:, 0], x[:, 2], -x[:, 1]]).astype(np.float32) for x in (points, normals)]
        attributes = {"POSITION": self._array(upright[0], "VEC3", VERTICES, bounds=True)}
        attributes["NORMAL"] = self._array(upright[1], "VEC3", VERTICES)
        if colours is not None:
            attributes["COLOR_0"] = self._array(colours.astype(np.float32), "VEC3", VERTICES)
        indices = self._array(faces.ravel(), "SCALAR", ELEMENTS)
        primitive = {"attributes": attributes, "indices": indices, "material": 0}
        self._nodes.append({"name": name, "mesh": len(self._meshes)})
        self._meshes.append({"name": name, "primitives": [primitive]})

    def content(self) -> bytes:
        tree = {
            "asset": {"version": "2.0", "generator": "rodshell"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self._nodes)))}],
            "nodes": self._nodes,
            "meshes": self._meshes,
            "materials": [
                {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.7}, "doubleSided": True}
            ],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": self._length}],
        }
        text = json.dumps(tree, separators=(",", ":"), ensure_ascii=False).encode()
        text += b" " * (-len(text) % 4)
        body = b"".join(self._parts)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(body), 0x004E4942) + body
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks

    def _array(self, values: NDArray[Any], kind: str, use: int, *, bounds: bool = False) -> int:
        """Index of a new accessor; every item is of four bytes, so that all are aligned."""
        data = np.ascontiguousarray(values).tobytes()
        self._views.append({"buffer": 0, "byteOffset": self._length, "byteLength": len(data), "target": use})
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": INDEX if values.dtype == np.uint32 else FLOAT,
            "count": len(values),
            "type": kind,
        }
        if bounds:
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self._accessors.append(accessor)
        self._parts.append(data)
        self._length += len(data)
        return len(self._accessors) - 1
