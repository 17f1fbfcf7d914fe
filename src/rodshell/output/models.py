"""The shell in space for other programs: OBJ and VTK polylines, COMPAS, Rhino, glTF.

Rhino files are in millimetres, all others in metres. In VTK two rods share no points, so that a joint can have the
stress of both; arrays are binary (base64, packed). COMPAS JSON is plain JSON, so that COMPAS need not be installed:
`compas.json_load("popped_clamped.json")` gives {"rods": [Polyline, ...], "grid": Graph, "cells": Mesh}. glTF 2.0 is
binary, y up: each rod is swept along its final shape and coloured by the gap to the target.
"""

import base64
import json
import struct
import tempfile
import zlib
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.errors import needs_package
from rodshell.geometry.frames import cross, directors_along, unit
from rodshell.output import grid
from rodshell.output.colour_scale import scale_of
from rodshell.output.drawings.flat import flat_plan
from rodshell.output.grid import STAGE, Shape
from rodshell.output.sections import section_outline, section_widths
from rodshell.output.svg import tag
from rodshell.results import Archive

COMPRESSION = 3  # half the time of 6, for files that are 5 % longer
COLOURS = {"CUT": (34, 40, 47), "MARK": (179, 55, 44), "FINAL": (31, 95, 139), "BOUNDARY-FINAL": (43, 122, 75)}


def obj_text(archive: Archive, state: str) -> str:
    """All nodes [m], then one object with one polyline for each rod."""
    nodes = archive.states[state]
    text = f"# rodshell, {state}, metres\n"
    text += len(nodes) * "v %.9f %.9f %.9f\n" % tuple(nodes.ravel().tolist())
    for rod in grid.meshed_rods(archive):
        text += f"o {' '.join(rod.id.split()) or 'rod'}\nl {' '.join(map(str, (rod.nodes + 1).tolist()))}\n"
    return text


def vtp_text(archive: Archive, name: str) -> str:
    """A shape [m]: gap [m], stress [Pa] and curvature [1/m] at the points; each line's index in `rods`."""
    shape, rods = grid.deployed_shape(archive, name), grid.meshed_rods(archive)
    nodes = archive.states["rod_nodes"]
    offsets = np.cumsum([len(rod.nodes) for rod in rods], dtype=np.int64)
    counts = {"Points": len(nodes), "Lines": len(rods), "Verts": 0, "Strips": 0, "Polys": 0}
    piece = tag(
        "Piece",
        tag("PointData", *(_data_array(key, values) for key, values in _known(shape, nodes)), ""),
        tag("CellData", _data_array("rod", np.arange(len(rods)))),
        tag("Points", _data_array("Points", shape.positions[nodes], NumberOfComponents="3")),
        tag("Lines", _data_array("connectivity", np.arange(len(nodes))), _data_array("offsets", offsets)),
        **{f"NumberOf{key}": str(count) for key, count in counts.items()},
    )
    return _vtk_file("PolyData", tag("PolyData", piece))


def time_series(archive: Archive) -> Iterator[tuple[str, str]]:
    """Names and contents of the stages from flat to popped, and of the collection that ParaView opens."""
    stages = [name for name in grid.shape_names(archive) if name.startswith(STAGE)]
    if not stages:
        return
    shares, entries = archive.states["history_share"].tolist(), []
    for share, name in zip(shares, ["flat", *stages, archive.deployed], strict=True):
        yield f"pop_up/{name}.vtp", vtp_text(archive, name)
        entries.append(tag("DataSet", timestep=f"{share:.6f}", group="", part="0", file=f"pop_up/{name}.vtp"))
    yield "pop_up.pvd", _vtk_file("Collection", tag("Collection", *entries))


def _known(shape: Shape, nodes: Ints) -> Iterator[tuple[str, Floats]]:
    if shape.gap is not None and np.isfinite(shape.gap).all():
        yield "gap", shape.gap[nodes]
    for key in ("stress", "curvature"):
        if key in shape.known:
            yield key, np.asarray(shape.known[key], dtype=np.float64)


def _data_array(name: str, values: NDArray[np.generic], **attributes: str) -> str:
    kind = {"f": "Float64", "i": "Int64"}[values.dtype.kind]
    data = np.ascontiguousarray(values).tobytes()
    packed = zlib.compress(data, COMPRESSION)
    header = np.array([1, len(data), len(data), len(packed)], dtype=np.uint32).tobytes()
    text = (base64.b64encode(header) + base64.b64encode(packed)).decode()
    return tag("DataArray", text, type=kind, Name=name, format="binary", **attributes)


def _vtk_file(kind: str, body: str) -> str:
    head = {"version": "1.0", "byte_order": "LittleEndian", "compressor": "vtkZLibDataCompressor"}
    words = " ".join(f'{key}="{value}"' for key, value in head.items())
    return f'<?xml version="1.0"?>\n<VTKFile type="{kind}" {words} header_type="UInt32">{body}</VTKFile>\n'


def compas_json(archive: Archive, state: str) -> str:
    """A state of the shell; the graph's nodes are joints, its edges the rods between them."""
    positions, rods = archive.states[state], grid.meshed_rods(archive)
    joint_positions = grid.joint_places(archive, positions)
    lines = [
        {"dtype": "compas.geometry/Polyline", "data": {"points": positions[rod.nodes].tolist()}, "name": rod.id}
        for rod in rods
    ]
    node = {repr(name): dict(zip("xyz", at.tolist(), strict=True)) for name, at in joint_positions.items()}
    edge: dict[str, dict[str, Any]] = {name: {} for name in node}
    on_rod: dict[int, list[tuple[float, str]]] = {}
    for joint in grid.joints_of(rods):
        for rod_index, at in zip(joint.rods, joint.at, strict=True):
            on_rod.setdefault(rod_index, []).append((at, repr(joint.id)))
    for rod_index, row in on_rod.items():
        for (_, a), (_, b) in pairwise(sorted(row)):
            edge[a][b] = {"rod": rods[rod_index].id}
    graph = {
        "dtype": "compas.datastructures/Graph",
        "data": {
            "attributes": {},
            "default_node_attributes": {"x": 0.0, "y": 0.0, "z": 0.0},
            "default_edge_attributes": {},
            "node": node,
            "edge": edge,
            "max_node": -1,
        },
        "name": archive.name,
    }
    found = {"rods": lines, "grid": graph, "cells": _cells(archive, edge, joint_positions)}
    return json.dumps(found, ensure_ascii=False) + "\n"


def _cells(archive: Archive, edge: dict[str, dict[str, Any]], positions: dict[str, Floats]) -> dict[str, Any]:
    """The mesh of COMPAS whose vertices are the joints, upper side out."""
    names = [repr(name) for name in positions]
    index = {name: k for k, name in enumerate(names)}
    flat = np.array([*grid.joint_places(archive, archive.states["flat"]).values()]).reshape(-1, 3)
    pairs = np.array([(index[a], index[b]) for a, to in edge.items() for b in to], dtype=np.intp).reshape(-1, 2)
    faces = [face if grid.opens(flat[face[::-1], :2]) else [] for face in grid.faces_of(pairs, flat)]
    vertex = [{"joint": name} | dict(zip("xyz", at.tolist(), strict=True)) for name, at in positions.items()]
    found = [face for face in faces if len(face) > 2]
    return {
        "dtype": "compas.datastructures/Mesh",
        "data": {
            "attributes": {},
            "default_vertex_attributes": {"x": 0.0, "y": 0.0, "z": 0.0},
            "default_edge_attributes": {},
            "default_face_attributes": {},
            "vertex": {str(k): known for k, known in enumerate(vertex)},
            "face": {str(k): face for k, face in enumerate(found)},
            "facedata": {},
            "edgedata": {},
            "max_vertex": len(vertex) - 1,
            "max_face": len(found) - 1,
        },
        "name": archive.name,
    }


def rhino_bytes(archive: Archive) -> bytes:
    """The whole model.

    Raises:
        InputError: rhino3dm is not installed.
    """
    with needs_package("a 3dm file", "rhino3dm", "rhino"):
        import rhino3dm as r

    model: Any = r.File3dm()
    model.Settings.ModelUnitSystem = r.UnitSystem.Millimeters
    layers = {}
    for name, colour in COLOURS.items():
        layer = r.Layer()
        layer.Name, layer.Color = name, (*colour, 255)
        layers[name] = model.Layers.Add(layer)

    def about(where: str, name: str, figures: dict[str, str] | None = None):  # type: ignore[no-untyped-def]
        attributes: Any = r.ObjectAttributes()
        attributes.Name, attributes.LayerIndex = name, layers[where]
        for key, value in (figures or {}).items():
            attributes.SetUserString(key, value)
        return attributes

    def polyline(points: np.ndarray):  # type: ignore[no-untyped-def]
        result = r.Point3dList()
        for x, y, z in points.tolist():
            result.Add(x, y, z)
        return result

    plan = flat_plan(archive)
    mm = plan.rounding.mm
    for rod, course in zip(plan.rods, plan.courses, strict=True):
        figures = {"length_mm": mm(rod.length), "cut_length_mm": mm(rod.cut_length)}
        joints = " ".join(f"{other}:{mm(rod.from_cut_end(at))}" for other, at in rod.joints)
        figures |= {"layer": str(rod.record.layer), "joints_from_cut_end_mm": joints}
        flat = polyline(np.column_stack([course, np.zeros(len(course))]))
        model.Objects.AddPolyline(flat, about("CUT", rod.id, figures))
        if archive.final and len(rod.nodes):
            curve = 1e3 * archive.states[archive.final][rod.nodes]
            model.Objects.AddPolyline(polyline(curve), about("FINAL", rod.id, figures))
    for joint, (x, y) in zip(plan.joints, plan.marks.tolist(), strict=True):
        model.Objects.AddPoint(r.Point3d(x, y, 0.0), about("MARK", joint.id))
    if archive.final:
        for name, at in grid.joint_places(archive, archive.states[archive.final]).items():
            model.Objects.AddPoint(r.Point3d(*(1e3 * at).tolist()), about("MARK", name))
    for beam, points in grid.beams_along_edge(archive):
        about_it = {"length_mm": mm(1e3 * (beam.length or 0.0)), "mass_kg": f"{beam.mass or 0.0:.1f}"}
        model.Objects.AddPolyline(polyline(1e3 * points), about("BOUNDARY-FINAL", beam.name or "", about_it))
    for outline in plan.boundary:
        closed = np.vstack([outline, outline[:1]])
        model.Objects.AddPolyline(polyline(closed), about("BOUNDARY-FINAL", "boundary"))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "model.3dm"
        model.Write(str(path), 7)
        return path.read_bytes()


FLOAT, INDEX, VERTICES, ELEMENTS = 5126, 5125, 34962, 34963  # glTF's numbers for types and uses


def glb_bytes(archive: Archive, state: str) -> bytes:
    """One node, mesh and name for each rod."""
    shape, rods = grid.shape_of(archive, state), grid.meshed_rods(archive)
    section = archive.results.rod.section if archive.results.rod else None
    outline = section_outline(section, float(np.ptp(shape.positions, axis=0).max()))
    scale = scale_of(archive, shape, "gap")
    colours = None
    if scale is not None:
        palette = np.array([[int(c[k : k + 2], 16) / 255 for k in (1, 3, 5)] for c in scale.palette]) ** 2.2
        colours = np.split(palette[scale.bins], np.cumsum([len(rod.nodes) for rod in rods])[:-1])
    file = _Glb()
    for k, rod in enumerate(rods):
        points, normals, faces = swept(shape.positions[rod.nodes], outline, section_widths(archive, rod))
        shades = None if colours is None else np.repeat(colours[k], len(outline), axis=0)
        file.add(rod.id, points, normals, faces, shades)
    for beam, points in grid.beams_along_edge(archive) if state == grid.ON_BEAMS else ():
        around = section_outline(beam.rod.section if beam.rod else None, float(np.ptp(points, axis=0).max()))
        file.add(beam.name or "", *swept(points, around), None)
    return file.content()


def swept(curve: Floats, outline: Floats, widths: Floats | None = None) -> tuple[Floats, Floats, NDArray[np.uint32]]:
    """A tube: points and normals (k s, 3), triangles (t, 3), the outline (s, 2) swept along a curve (k, 3).

    The frame has no twist and begins as upright as possible. The ends are open.

    Args:
        widths: (k, 2) by which these are multiplied at each node; None: by 1.
    """
    edges = unit(np.diff(curve, axis=0))
    up = np.array([0.0, 0.0, 1.0]) if abs(edges[0, 2]) < 0.9 else np.array([1.0, 0.0, 0.0])
    directors = directors_along(edges, up)
    raised = unit(np.vstack([directors[:1], directors[:-1] + directors[1:], directors[-1:]]))
    tangents = unit(np.vstack([edges[:1], edges[:-1] + edges[1:], edges[-1:]]))
    across = unit(cross(raised, tangents))
    raised = cross(tangents, across)
    corners = outline[None] if widths is None else outline[None] * widths[:, None]
    ring = corners[..., 0, None] * across[:, None] + corners[..., 1, None] * raised[:, None]
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
        self._body = bytearray()

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
        self._meshes.append({"name": name, "primitives": [primitive]})

    def content(self) -> bytes:
        tree = {
            "asset": {"version": "2.0", "generator": "rodshell"},
            "scene": 0,
            "scenes": [{"nodes": list(range(len(self._meshes)))}],
            "nodes": [{"name": mesh["name"], "mesh": k} for k, mesh in enumerate(self._meshes)],
            "meshes": self._meshes,
            "materials": [
                {"pbrMetallicRoughness": {"metallicFactor": 0.0, "roughnessFactor": 0.7}, "doubleSided": True}
            ],
            "accessors": self._accessors,
            "bufferViews": self._views,
            "buffers": [{"byteLength": len(self._body)}],
        }
        text = json.dumps(tree, separators=(",", ":"), ensure_ascii=False).encode()
        text += b" " * (-len(text) % 4)
        chunks = struct.pack("<II", len(text), 0x4E4F534A) + text
        chunks += struct.pack("<II", len(self._body), 0x004E4942) + self._body
        return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks

    def _array(self, values: NDArray[Any], kind: str, use: int, *, bounds: bool = False) -> int:
        """Index of a new accessor; every item is of four bytes, so that all are aligned."""
        data = np.ascontiguousarray(values).tobytes()
        self._views.append({"buffer": 0, "byteOffset": len(self._body), "byteLength": len(data), "target": use})
        accessor: dict[str, Any] = {
            "bufferView": len(self._views) - 1,
            "componentType": INDEX if values.dtype == np.uint32 else FLOAT,
            "count": len(values),
            "type": kind,
        }
        if bounds:
            accessor |= {"min": values.min(axis=0).tolist(), "max": values.max(axis=0).tolist()}
        self._accessors.append(accessor)
        self._body += data
        return len(self._accessors) - 1
