"""The rods and joints of a result, with their flat geometry."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.layout.outline import outlines
from rodshell.output.archive import Archive, made_once, printable


@dataclass(frozen=True)
class RodRecord:
    """One rod of a result.

    Parameters
    ----------
    flat : (2, 2) x, y of its two ends in the flat state [m].
    nodes : (k,) its nodes in the states, from start to end; empty if the states do not hold them.
    joints : (id of the rod that is met, distance from the start [m]) of each joint.
    more : what else the result says of it: cut_length, mass, layer, splices, min_radius, ...
    """

    id: str
    family: str
    offset: float | None
    start: float
    end: float
    length: float
    flat: Floats
    nodes: Ints
    joints: tuple[tuple[str, float], ...]
    more: Mapping[str, Any] = field(default_factory=dict)

    @property
    def cut_length(self) -> float:
        """With its end allowances [m]."""
        return float(self.more.get("cut_length", self.length))

    @property
    def allowance(self) -> float:
        """By which it goes on past each end [m]."""
        return 0.5 * (self.cut_length - self.length)

    def from_cut_end(self, at: float) -> float:
        """As the workshop measures what lies at the distance `at` from the start: its allowance comes before [m]."""
        return at + self.allowance

    @property
    def splices(self) -> tuple[float, ...]:
        """Distances of its splices from the start [m]."""
        return tuple(self.more.get("splices") or ())

    @property
    def layer(self) -> int | None:
        """1 the lowest; None where it is not known."""
        return self.more.get("layer")

    def point(self, at: float) -> Floats:
        """x, y [m] of the flat point at the distance `at` from the start."""
        along = self.flat[1] - self.flat[0]
        return np.asarray(self.flat[0] + at / np.linalg.norm(along) * along)


@dataclass(frozen=True)
class JointRecord:
    """Where two rods meet: rod indices, and the distance from each rod's start [m]."""

    rods: tuple[int, int]
    at: tuple[float, float]
    id: str

    def over(self, rods: list[RodRecord]) -> str:
        """The id of the rod that lies above, or "" where the layers are not known."""
        low, high = (rods[k] for k in self.rods)
        if low.layer is None or high.layer is None:
            return ""
        return low.id if low.layer > high.layer else high.id


@made_once
def rods_of(archive: Archive) -> list[RodRecord]:
    """All rods, in the order of the result."""
    nodes = _nodes(archive)
    flat = archive.states.get("flat")
    return [
        _record(entry, nodes[k] if k < len(nodes) else np.empty(0, dtype=np.intp), flat)
        for k, entry in enumerate(archive.result.get("rods", []))
    ]


def joints_of(rods: list[RodRecord]) -> list[JointRecord]:
    """Every joint once, in the order of the rods; the rod that comes first is named first."""
    index = {rod.id: k for k, rod in enumerate(rods)}
    back = {(rod.id, other): at for rod in rods for other, at in rod.joints}
    return [
        JointRecord((k, index[other]), (at, back[other, rod.id]), f"{rod.id}/{other}")
        for k, rod in enumerate(rods)
        for other, at in rod.joints
        if index.get(other, -1) > k and (other, rod.id) in back
    ]


def joint_places(archive: Archive, positions: Floats) -> dict[str, Floats]:
    """Place (3,) [m] in a shape (n, 3) of each joint that has nodes there, by its id: between its two rods."""
    return {name: positions[nodes].mean(axis=0) for name, nodes in _joint_nodes(archive).items()}


@made_once
def _joint_nodes(archive: Archive) -> dict[str, list[int]]:
    """The nodes of each joint that has some, on both of its rods, by its id: one node twice, or one in either layer."""
    rods, flat = rods_of(archive), archive.states.get("flat")
    nodes = dict[str, list[int]]()
    if flat is None:
        return nodes
    stations = [np.linalg.norm(flat[rod.nodes] - flat[rod.nodes[:1]], axis=1) for rod in rods]
    for joint in joints_of(rods):
        if all(len(rods[k].nodes) for k in joint.rods):
            places = zip(joint.rods, joint.at, strict=True)
            nodes[joint.id] = [int(rods[k].nodes[np.abs(stations[k] - at).argmin()]) for k, at in places]
    return nodes


def outlines_of(rods: list[RodRecord]) -> list[Ints]:
    """Rod ends along each outline of the flat grid, see `outlines`."""
    return _outlines(np.array([rod.flat for rod in rods], dtype=float).tobytes())


@lru_cache(maxsize=4)
def _outlines(flat: bytes) -> list[Ints]:
    """Kept for the next drawing of the same grid."""
    return outlines(np.frombuffer(flat).reshape(-1, 2, 2))


def _nodes(archive: Archive) -> list[Ints]:
    if "rod_nodes" not in archive.states or "rod_start" not in archive.states:
        return []
    return np.split(archive.states["rod_nodes"].astype(np.intp), archive.states["rod_start"][1:])


def _record(entry: dict[str, Any], nodes: Ints, flat: Floats | None) -> RodRecord:
    family, start, end = entry["family"], float(entry["start"]), float(entry["end"])
    offset = None if entry.get("offset") is None else float(entry["offset"])
    if family == "u" and offset is not None:
        ends = np.array([[start, offset], [end, offset]])
    elif family == "v" and offset is not None:
        ends = np.array([[offset, start], [offset, end]])
    elif flat is not None and len(nodes):
        ends = np.asarray(flat[nodes[[0, -1]], :2], dtype=np.float64)
    else:
        ends = np.array([[start, 0.0], [end, 0.0]])
    joints = tuple((printable(str(joint["with"])), float(joint["at"])) for joint in entry.get("joints", []))
    return RodRecord(
        printable(str(entry["id"])),
        family,
        offset,
        start,
        end,
        float(entry.get("length", end - start)),
        ends,
        nodes,
        joints,
        entry,
    )
