"""What the viewer shows, as bytes: every shape that was computed, from flat to popped up, and what its colours mean.

A scene is a header in JSON, which names parts of the binary data behind it by their place. Coordinates take 16 bits of
the largest extent, colours 8: a stage of 8000 segments with two colours takes 64 kB.
"""

import json
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints, largest_at
from rodshell.geometry.bounds import bounds
from rodshell.geometry.frames import cross, unit
from rodshell.output import grid
from rodshell.output.colour_scale import Colour, Scale, largest_gap, scale_of
from rodshell.output.drawing import FAMILIES
from rodshell.output.grid import GridRod, Shape
from rodshell.output.schedules import SCHEDULES, Table, heading
from rodshell.output.sections import section_outline, section_widths
from rodshell.results import Archive, wording
from rodshell.results.states import DRAPED
from rodshell.results.wording import nice_ticks, rounding_of

STEPS = 65535  # of a coordinate: 16 bits
COLOURS: tuple[Colour, ...] = ("stress", "gap", "curvature", "force")
UNKNOWN = 255  # in place of the index of a colour
_SEGMENTS = 14000  # of rods at most, so that pages stay small
VERSION = 1


@dataclass(frozen=True)
class Scene:
    """What the viewer shows.

    Args:
        header: names, captions, colours; arrays as {"at": first byte, "type": "u1"|"i1"|"u2"|"u4"|"f4", "count": n}.
        data: the arrays, each beginning at a multiple of four bytes.
    """

    header: Mapping[str, Any]
    data: bytes

    def content(self) -> bytes:
        """The length of the header (4 bytes, little endian), the header, and the data."""
        text = json.dumps(self.header, separators=(",", ":"), ensure_ascii=True).encode()
        text += b" " * (-len(text) % 4)
        return len(text).to_bytes(4, "little") + text + self.data


@dataclass(frozen=True, eq=False)
class Coloured:
    """What colours a shape, and its worst place: a point (3,) [m], and the value there in words."""

    scale: Scale
    where: Floats
    worst: str


@dataclass(frozen=True, eq=False)
class Drawn:
    """What a scene is made of.

    Args:
        rods: id and family of each rod.
        nodes: (k,) nodes of all rods, one rod after the other; counts : (m,) how many each rod has.
        joints: ids; meeting : (c, 2) entry in `nodes` of each joint on either rod.
        shapes: in their order, with what colours them; a flat one is shown below the last, where the deployment begins.
        outline: size of everything [m] -> (s, 2) corners of the rods' section, across and up [m].
        target: points (p, 3) and triangles (t, 3) of the target, if there is one.
        reactions: by shape, the forces (2 m, 3) at the start and end of each rod over the largest, and that one in
            words.
        rows: of the schedules, by the kind of part.
        widths: (k, 2) of the section at each node, across and up, over those of `outline`; None: the same everywhere.
    """

    name: str
    rods: Sequence[tuple[str, str]]
    nodes: Ints
    counts: Ints
    joints: Sequence[str]
    meeting: Ints
    shapes: Sequence[tuple[Shape, Mapping[Colour, Coloured]]]
    outline: Callable[[float], Floats]
    target: tuple[NDArray[np.floating], Ints] | None = None
    reactions: Mapping[str, tuple[Floats, str]] = field(default_factory=dict)
    rows: Mapping[str, Any] = field(default_factory=dict)
    widths: Floats | None = None

    def scene(self) -> Scene:
        """It as bytes for the viewer."""
        entries = _entries(self.counts, self.meeting)
        nodes, counts = self.nodes[entries], np.diff(np.searchsorted(entries, np.cumsum([0, *self.counts])))
        meeting = np.searchsorted(entries, self.meeting).astype(np.uint32)
        lying = self._lying()
        clouds = [(lying if shape.flat else shape.positions)[nodes] for shape, _ in self.shapes]
        low, high = bounds(np.concatenate([*clouds, *([] if self.target is None else [self.target[0]])]))
        size = high - low
        outline = self.outline(float(size.max()))
        frame = _Frame(low, float(size.max()), entries)
        laths = _laths(outline)
        known = {kind: coloured.scale for _, colours in self.shapes for kind, coloured in colours.items()}
        shown = {kind: known[kind] for kind in COLOURS if kind in known}
        families = dict.fromkeys(family for _, family in self.rods)
        inks = {family: FAMILIES[k % len(FAMILIES)] for k, family in enumerate(families)}
        header: dict[str, Any] = {
            "version": VERSION,
            "name": self.name,
            "size": frame.size,
            "low": low.tolist(),
            "box": (size / frame.size).tolist(),
            "rods": [
                {"id": name, "count": count, "ink": inks[family]}
                for (name, family), count in zip(self.rods, counts.tolist(), strict=True)
            ],
            "families": list(inks.items()),
            "joints": {"ids": list(self.joints), "entries": frame.put(meeting)},
            "outline": (outline / frame.size).tolist(),
            "kinds": {kind: scale.caption.split(" in ")[0] for kind, scale in shown.items()},
            "palettes": {kind: scale.palette for kind, scale in shown.items()},
            "stages": [
                frame.stage(shape, colours, cloud, _normals(cloud, counts, meeting) if laths else None)
                for (shape, colours), cloud in zip(self.shapes, clouds, strict=True)
            ],
            "rows": self.rows,
        }
        if self.widths is not None:
            header["widths"] = frame.put(self.widths[entries].astype("<f4"))
        if self.target is not None:
            points, faces = self.target
            header["target"] = {"points": frame.points(points), "faces": frame.put(faces.astype("<u4"))}
        last = np.cumsum(counts)
        header["supports"] = {
            "entries": frame.put(np.column_stack([last - counts, last - 1]).astype("<u4")),
            "reactions": {
                name: {"forces": frame.put(forces.astype("<f4")), "largest": largest}
                for name, (forces, largest) in self.reactions.items()
            },
        }
        return Scene(header, bytes(frame))

    def _lying(self) -> Floats:
        """The flat grid (n, 3), moved in its plane to below the last shape: a target may be far from the origin."""
        last = np.cumsum(self.counts)
        ends = self.nodes[np.column_stack([last - self.counts, last - 1]).ravel()]
        flat = next((shape.positions for shape, _ in self.shapes if shape.flat), np.zeros((0, 3)))
        final = next((shape.positions for shape, _ in reversed(self.shapes) if not shape.flat), flat)
        if not len(flat):
            return flat
        return grid.laid_out(flat, final, ends)


def scene_of(archive: Archive) -> Scene | None:
    """All shapes of an archive, the draped one among them; None where it has no shape in space."""
    rods = grid.meshed_rods(archive)
    names = sorted(grid.shape_names(archive), key=lambda name: name != DRAPED) if rods else []
    if len(names) < 2:
        return None
    joints, shapes = grid.joint_entries(archive), [grid.shape_of(archive, name) for name in names]
    target = archive.states.get("target_points")
    return Drawn(
        archive.name,
        [(rod.id, rod.family) for rod in rods],
        archive.states["rod_nodes"],
        np.array([len(rod.nodes) for rod in rods]),
        [joint.id for joint, _ in joints],
        np.array([pair for _, pair in joints], dtype=np.intp).reshape(-1, 2),
        [(shape, _colours(archive, shape)) for shape in shapes],
        partial(section_outline, archive.results.rod.section if archive.results.rod else None),
        None if target is None else (target, archive.states["target_faces"]),
        _reactions(archive, rods),
        {kind: _rows(SCHEDULES[f"{kind}s"].brief(archive)) for kind in ("rod", "joint")},
        _widths(archive, rods),
    ).scene()


class _Frame(bytearray):
    """Collects the arrays of a scene, which lies in a cube of `size` [m] from `low` on; some `entries` are drawn."""

    def __init__(self, low: Floats, size: float, entries: Ints) -> None:
        super().__init__()
        self.low, self.size, self.entries = low, size, entries

    def put(self, values: NDArray[Any]) -> dict[str, Any]:
        """Where the values stand."""
        plain = np.ascontiguousarray(values)
        here = {"at": len(self), "type": f"{plain.dtype.kind}{plain.dtype.itemsize}", "count": int(plain.size)}
        self += plain.tobytes()
        self += b"\0" * (-len(self) % 4)
        return here

    def points(self, points: NDArray[np.floating]) -> dict[str, Any]:
        return self.put(np.rint((points - self.low) / self.size * STEPS).astype("<u2"))

    def stage(
        self, shape: Shape, colours: Mapping[Colour, Coloured], cloud: Floats, normals: Floats | None
    ) -> dict[str, Any]:
        stage: dict[str, Any] = {"name": shape.name, "caption": shape.caption, "points": self.points(cloud)}
        if normals is not None:
            stage["normals"] = self.put(np.rint(127 * normals).astype(np.int8))
        stage["colours"] = {kind: self._coloured(coloured) for kind, coloured in colours.items()}
        return stage

    def _coloured(self, coloured: Coloured) -> dict[str, Any]:
        scale = coloured.scale
        bins = np.where(np.isfinite(scale.values), scale.bins, UNKNOWN)[self.entries].astype(np.uint8)
        worst = {"at": ((coloured.where - self.low) / self.size).tolist(), "text": coloured.worst}
        return {"bins": self.put(bins), "caption": scale.caption, "ticks": _ticks(scale), "worst": worst}


def _entries(counts: Ints, meeting: Ints) -> Ints:
    """Entries that are drawn, of all rods: of very many some, those of ends and joints among them."""
    stop = np.cumsum(counts)
    along = np.arange(stop[-1]) - np.repeat(stop - counts, counts)
    drawn = along % max(1, -(-int(stop[-1]) // _SEGMENTS)) == 0
    drawn[stop - 1] = drawn[meeting.ravel()] = True
    return np.flatnonzero(drawn)


def _colours(archive: Archive, shape: Shape) -> dict[Colour, Coloured]:
    """By what the shape is coloured."""
    kinds: tuple[Colour, ...] = () if shape.flat else COLOURS
    found = {kind: scale_of(archive, shape, kind) for kind in kinds}
    return {
        kind: Coloured(scale, *_worst(archive, shape, kind, scale))
        for kind, scale in found.items()
        if scale is not None
    }


def _ticks(scale: Scale) -> list[tuple[float, str]]:
    """Places of numbers at the colour bar, from 0 to 1, and the numbers."""
    spread = scale.high - scale.low
    return [((value - scale.low) / spread, f"{value + 0.0:g}") for value in nice_ticks(scale.low, scale.high, 4)]


def _worst(archive: Archive, shape: Shape, kind: Colour, scale: Scale) -> tuple[Floats, str]:
    """The place of the largest value [m], and the value in words."""
    if kind == "gap" and shape.gap is not None:
        largest, place = largest_gap(archive, shape)
        return place, wording.millimetres(abs(largest) * 1e-3, rounding=rounding_of(archive.results))
    worst = largest_at(np.abs(scale.values))
    unit = scale.caption.split(" in ", 1)[1].split(",")[0]
    return shape.positions[archive.states["rod_nodes"][worst]], f"{scale.values[worst]:.3g} {unit}"


def _widths(archive: Archive, rods: list[GridRod]) -> Floats | None:
    """Of the rods' sections, see `Drawn`; None where no section changes, or the flat grid is not known."""
    each = [section_widths(archive, rod) for rod in rods]
    if all(widths is None for widths in each):
        return None
    known = zip(each, rods, strict=True)
    return np.concatenate([np.ones((len(rod.nodes), 2)) if widths is None else widths for widths, rod in known])


def _laths(outline: Floats) -> bool:
    """Whether it matters how a section (s, 2) is turned."""
    radii = np.linalg.norm(outline, axis=1)
    return bool(np.ptp(radii) > 1e-6 * radii.max() or len(outline) == 4)


def _normals(points: Floats, counts: Ints, meeting: NDArray[np.uint32]) -> Floats:
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


def _reactions(archive: Archive, rods: list[GridRod]) -> dict[str, tuple[Floats, str]]:
    """Forces on all rod ends by shape, see `Drawn`."""
    found = dict[str, tuple[Floats, str]]()
    for end, reactions in archive.results.reactions.items() if len(rods) == len(archive.results.rods) else ():
        values = reactions.forces
        largest = float(np.linalg.norm(values, axis=1).max(initial=0.0))
        if len(values) == 2 * len(rods) and largest > 0:
            found[f"popped_{end}"] = (values / largest, wording.newtons(largest))
    return found


def _rows(table: Table) -> dict[str, Any]:
    """A schedule by the name in its first column."""
    rows = zip(*table.values(), strict=True)
    return {"columns": [heading(column) for column in table], "rows": {row[0]: row for row in rows}}
