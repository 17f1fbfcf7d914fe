"""What the viewer shows, as bytes: every shape that was computed, from flat to popped up, and what its colours mean.

A scene is a header in JSON, which names parts of the binary data behind it by their place. Coordinates take 16 bits of
the largest extent, colours 8: a stage of 8000 segments with two colours takes 64 kB.
"""

import json
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.geometry.frames import cross, unit
from rodshell.output.colour_scale import Colour, Scale, largest_gap, scale_of
from rodshell.output.grid import GridJoint, GridRod, Shape, joints_of, rods_of, shape_names, shape_of
from rodshell.output.models import section_outline
from rodshell.output.pictures import FAMILIES, SEGMENTS
from rodshell.output.schedules import Table, heading, joints_table, rods_table
from rodshell.results import Archive, wording
from rodshell.results.wording import nice_ticks, rounding_of

STEPS = 65535  # of a coordinate: 16 bits
COLOURS: tuple[Colour, ...] = ("stress", "gap", "curvature", "force")
UNKNOWN = 255  # in place of the index of a colour
VERSION = 1


@dataclass(frozen=True)
class Scene:
    """What the viewer shows.

    Parameters
    ----------
    header : names, captions, colours; arrays as {"at": first byte, "type": "u1"|"i1"|"u2"|"u4"|"f4", "count": n}.
    data : the arrays, each beginning at a multiple of four bytes.
    """

    header: Mapping[str, Any]
    data: bytes

    def content(self) -> bytes:
        """The length of the header (4 bytes, little endian), the header, and the data."""
        text = json.dumps(self.header, separators=(",", ":"), ensure_ascii=True).encode()
        text += b" " * (-len(text) % 4)
        return len(text).to_bytes(4, "little") + text + self.data


def scene_of(archive: Archive, *, schedules: bool = True) -> Scene | None:
    """All shapes of an archive; None where it has no shape in space.

    The draped shape is shown too; the flat one is placed where the deployment begins, if that is known.

    Parameters
    ----------
    schedules : whether rods and joints have the rows of the schedules with them, which takes most of the time.
    """
    rods = [rod for rod in rods_of(archive) if len(rod.nodes)]
    names = [name for name in _in_order(shape_names(archive)) if rods]
    if len(names) < 2:
        return None
    data = _Data()
    joints = _drawn_joints(archive, rods)
    entries, counts = _entries(archive, rods, joints)
    nodes = archive.states["rod_nodes"][entries]
    shapes = [_placed(archive, name) for name in names]
    target = archive.states.get("target_points")
    cloud = np.concatenate([*(shape.positions[nodes] for shape in shapes), *([] if target is None else [target])])
    low, size = cloud.min(axis=0), float(np.ptp(cloud, axis=0).max())
    scales = [_scales(archive, shape) for shape in shapes]
    known = {kind: scale for coloured in scales for kind, scale in coloured.items()}
    kinds = {kind: known[kind] for kind in COLOURS if kind in known}
    at = {int(entry): k for k, entry in enumerate(entries)}
    meeting = np.array([[at[entry] for entry in pair] for _, pair in joints], dtype=np.uint32).reshape(-1, 2)
    outline, laths = _outline(archive, size)
    header: dict[str, Any] = {
        "version": VERSION,
        "name": archive.name,
        "size": size,
        "low": low.tolist(),
        "box": ((cloud.max(axis=0) - low) / size).tolist(),
        "rods": [_rod(rod, count) for rod, count in zip(rods, counts, strict=True)],
        "joints": {"ids": [joint.id for joint, _ in joints], "entries": data.add(meeting)},
        "outline": (outline / size).tolist(),
        "kinds": {kind: scale.caption.split(" in ")[0] for kind, scale in kinds.items()},
        "palettes": {kind: scale.palette for kind, scale in kinds.items()},
        "stages": [
            _stage(archive, shape, coloured, data, nodes=nodes, entries=entries, low=low, size=size,
                   normals=_normals(shape.positions[nodes], counts, meeting) if laths else None)
            for shape, coloured in zip(shapes, scales, strict=True)
        ],
        "rows": {},
    }  # fmt: skip
    if schedules:
        tables = {"rod": rods_table(archive, brief=True), "joint": joints_table(archive, brief=True)}
        header["rows"] = {kind: _rows(table) for kind, table in tables.items()}
    if target is not None:
        faces = archive.states["target_faces"]
        points = np.rint((target - low) / size * STEPS).astype("<u2")
        header["target"] = {"points": data.add(points), "faces": data.add(faces.astype("<u4"))}
    header["supports"] = _supports(archive, rods, at, data)
    return Scene(header, data.content())


def _rod(rod: GridRod, count: int) -> dict[str, Any]:
    return {"id": rod.id, "count": count, "ink": FAMILIES[rod.family == "v"]}


class _Data:
    """Collects arrays."""

    def __init__(self) -> None:
        self._parts: list[bytes] = []
        self._length = 0

    def add(self, values: NDArray[Any]) -> dict[str, Any]:
        """Where the values stand."""
        plain = np.ascontiguousarray(values)
        part = plain.tobytes()
        here = {"at": self._length, "type": f"{plain.dtype.kind}{plain.dtype.itemsize}", "count": int(plain.size)}
        part += b"\0" * (-len(part) % 4)
        self._parts.append(part)
        self._length += len(part)
        return here

    def content(self) -> bytes:
        return b"".join(self._parts)


def _in_order(names: list[str]) -> list[str]:
    """Draped, flat, the deployment, popped up: as they are found."""
    return [name for name in names if name == "draped"] + [name for name in names if name != "draped"]


def _placed(archive: Archive, name: str) -> Shape:
    """The flat grid is shown where the deployment begins."""
    shape = shape_of(archive, name)
    if shape.flat and "history" in archive.states:
        return Shape("flat", shape.caption, np.asarray(archive.states["history"][0], dtype=float))
    return shape


def _drawn_joints(archive: Archive, rods: list[GridRod]) -> list[tuple[GridJoint, tuple[int, int]]]:
    """Every joint whose rods have nodes, and the entry of `rod_nodes` on either rod that lies nearest to it."""
    if "flat" not in archive.states:
        return []
    starts = np.cumsum([0, *(len(rod.nodes) for rod in rods)])
    flat = archive.states["flat"]
    stations = [np.linalg.norm(flat[rod.nodes] - flat[rod.nodes[0]], axis=1) for rod in rods]
    found = []
    for joint in joints_of(rods):
        pairs = zip(joint.rods, joint.at, strict=True)
        first, second = (int(starts[k] + np.abs(stations[k] - place).argmin()) for k, place in pairs)
        found.append((joint, (first, second)))
    return found


def _entries(
    archive: Archive, rods: list[GridRod], joints: list[tuple[GridJoint, tuple[int, int]]]
) -> tuple[Ints, list[int]]:
    """Entries of `rod_nodes` that are drawn, those of ends and joints among them, and how many of them each rod has."""
    lengths = [len(rod.nodes) for rod in rods]
    stride = max(1, -(-sum(lengths) // SEGMENTS))
    kept = {entry for _, pair in joints for entry in pair} if stride > 1 else set[int]()
    first, parts = 0, []
    for length in lengths:
        here = {*range(first, first + length, stride), first + length - 1}
        parts.append(sorted(here | {entry for entry in kept if first <= entry < first + length}))
        first += length
    return np.array([entry for part in parts for entry in part], dtype=np.intp), [len(part) for part in parts]


def _scales(archive: Archive, shape: Shape) -> dict[Colour, Scale]:
    """Scales by which the shape is coloured."""
    kinds: tuple[Colour, ...] = () if shape.flat else COLOURS
    found = {colour: scale_of(archive, shape, colour) for colour in kinds}
    return {colour: scale for colour, scale in found.items() if scale is not None}


def _stage(
    archive: Archive, shape: Shape, scales: dict[Colour, Scale], data: _Data, *,
    nodes: Ints, entries: Ints, low: Floats, size: float, normals: Floats | None,
) -> dict[str, Any]:  # fmt: skip
    coordinates = np.rint((shape.positions[nodes] - low) / size * STEPS).astype("<u2")
    stage: dict[str, Any] = {"name": shape.name, "caption": shape.caption, "points": data.add(coordinates)}
    if normals is not None:
        stage["normals"] = data.add(np.rint(127 * normals).astype(np.int8))
    stage["colours"] = {
        kind: {
            "bins": data.add(np.where(np.isfinite(scale.values), scale.bins, UNKNOWN)[entries].astype(np.uint8)),
            "caption": scale.caption,
            "ticks": _ticks(scale),
            "worst": _worst(archive, shape, kind, scale, low, size),
        }
        for kind, scale in scales.items()
    }
    return stage


def _ticks(scale: Scale) -> list[tuple[float, str]]:
    """Places of numbers at the colour bar, from 0 to 1, and the numbers."""
    spread = scale.high - scale.low
    return [((value - scale.low) / spread, f"{value + 0.0:g}") for value in nice_ticks(scale.low, scale.high, 4)]


def _worst(archive: Archive, shape: Shape, kind: Colour, scale: Scale, low: Floats, size: float) -> dict[str, Any]:
    """The place of the largest value, over the size, and the value in words."""
    if kind == "gap" and shape.gap is not None:
        largest, place = largest_gap(archive, shape)
        rounding = rounding_of(archive.results)
        return {
            "at": ((place - low) / size).tolist(),
            "text": wording.millimetres(abs(largest) * 1e-3, rounding=rounding),
        }
    worst = int(np.nanargmax(np.abs(scale.values)))
    unit = scale.caption.split(" in ")[-1].split(",")[0]
    place = shape.positions[archive.states["rod_nodes"][worst]]
    return {"at": ((place - low) / size).tolist(), "text": f"{scale.values[worst]:.3g} {unit}"}


def _outline(archive: Archive, size: float) -> tuple[Floats, bool]:
    """The section's outline (s, 2) [m], across and up; and whether it matters how it is turned."""
    outline = section_outline(archive, size)
    radii = np.linalg.norm(outline, axis=1)
    return outline, bool(np.ptp(radii) > 1e-6 * radii.max() or len(outline) == 4)


def _normals(points: Floats, counts: list[int], meeting: NDArray[np.uint32]) -> Floats:
    """Unit normals (k, 3) of laths at each entry: at a joint across both rods, as a bolt holds them, between joints
    turned evenly from one to the next."""
    first = np.cumsum([0, *counts])
    tangents, normals = np.empty_like(points), np.zeros_like(points)
    for a, b in pairwise(first):
        tangents[a:b] = unit(np.gradient(points[a:b], axis=0))
    if len(meeting):
        across = cross(tangents[meeting[:, 0]], tangents[meeting[:, 1]])
        across *= np.where(across[:, 2:] < 0, -1.0, 1.0)
        normals[meeting[:, 0]] = normals[meeting[:, 1]] = across
    for a, b in pairwise(first):
        known = np.flatnonzero(np.abs(normals[a:b]).any(axis=1))
        if len(known):
            at = np.arange(b - a)
            for axis in range(3):
                normals[a:b, axis] = np.interp(at, known, normals[a:b][known, axis])
        else:
            normals[a:b, 2] = 1.0
    normals -= np.einsum("ij,ij->i", normals, tangents)[:, None] * tangents
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    return np.asarray(np.divide(normals, length, out=np.zeros_like(normals), where=length > 0))


def _supports(archive: Archive, rods: list[GridRod], at: Mapping[int, int], data: _Data) -> dict[str, Any]:
    """Entries of all rod ends, and by stage the forces on them: their directions and sizes over the largest."""
    starts = np.cumsum([0, *(len(rod.nodes) for rod in rods)])
    ends = np.array([[at[int(a)], at[int(b) - 1]] for a, b in pairwise(starts)], dtype="<u4")
    forces: dict[str, Any] = {}
    if len(rods) == len(archive.results.rods):
        for end, reactions in archive.results.reactions.items():
            values = np.array(reactions.forces, dtype=float).reshape(-1, 3)
            largest = float(np.linalg.norm(values, axis=1).max(initial=0.0))
            if len(values) == ends.size and largest > 0:
                scaled = (values / largest).astype("<f4")
                forces[f"popped_{end}"] = {"forces": data.add(scaled), "largest": wording.newtons(largest)}
    return {"entries": data.add(ends), "reactions": forces}


def _rows(table: Table) -> dict[str, Any]:
    """A schedule by the name in its first column."""
    columns, rows = table
    return {"columns": [heading(column) for column in columns], "rows": {row[0]: row for row in rows}}
