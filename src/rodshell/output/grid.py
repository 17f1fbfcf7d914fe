"""The grid of an archive: its rods and joints in the flat plan, its outlines, and its shapes from flat to popped up."""

import tomllib
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import OutputError
from rodshell.figures.form import EdgeBeam, Rod
from rodshell.geometry.planar_motion import PlanarMotion
from rodshell.layout.flatgrid import FlatGrid, FlatRod
from rodshell.layout.mesh import mesh_grid
from rodshell.results.archive import Archive, made_once
from rodshell.results.states import BENT, DRAPED, GAP, POPPED, shells_among
from rodshell.rods.supports import SUPPORTS

CAPTIONS = {"flat": "Flat, as cut and laid out", DRAPED: "Draped on the target"}
STAGE = "stage_"
ON_BEAMS = f"{POPPED}given"  # the shape that has beams along its edge
FEWEST = 3  # ends of an outline
AXES = {"u": 0, "v": 1}  # that rods of a family run along, by the format of result.json
STRAIGHT = 1e-6  # of a rod's length, which it leaves its chord by: it is straight


def beams_along_edge(archive: Archive) -> list[tuple[EdgeBeam, Floats]]:
    """Each beam along the edge, and (b, 3) its rod ends in their order [m], a ring's first one again at its end:
    where they stand in the shape on it."""
    results, known = archive.results, archive.states.get(ON_BEAMS)
    points = np.array(results.boundary, dtype=float)
    if known is not None and len(rods := meshed_rods(archive)) == len(results.rods):
        points = known[end_nodes(rods)]
    numbers = {name: k for k, name in enumerate(results.rod_ends)}
    found = []
    for beam in results.edge_beams:
        ends = [numbers[name] for name in (*beam.ends, *beam.ends[: beam.kind == "ring"])]
        found.append((beam, points[ends]))
    return found


@dataclass(frozen=True, eq=False)
class GridRod:
    """One rod of a result, with its geometry.

    Args:
        course: (k, 2) x, y of points along it in the flat state [m]: its two ends, or more where it bends there.
        nodes: (k,) its nodes in the states, from start to end; empty if the states do not hold them.
    """

    record: Rod
    course: Floats
    nodes: Ints

    @property
    def id(self) -> str:
        return self.record.id

    @property
    def family(self) -> str:
        return self.record.family

    @property
    def axis(self) -> int | None:
        """The axis of the flat plan that it runs along at its offset, x or y; None: it has both its own ends."""
        return None if self.record.offset is None else AXES.get(self.record.family)

    @property
    def length(self) -> float:
        """Between its supports [m]."""
        return self.record.end - self.record.start if self.record.length is None else self.record.length

    @property
    def joints(self) -> tuple[tuple[str, float], ...]:
        """Of each joint the id of the rod that is met, and the distance from the start [m]."""
        return tuple((joint.other, joint.at) for joint in self.record.joints)

    @property
    def cut_length(self) -> float:
        """With its end allowances [m]."""
        return self.length if self.record.cut_length is None else self.record.cut_length

    @property
    def allowance(self) -> float:
        """Length that is added at each end [m]."""
        return 0.5 * (self.cut_length - self.length)

    def from_cut_end(self, at: float) -> float:
        """Distance from the cut end of the start [m] of what lies at the distance `at` from the start."""
        return at + self.allowance

    @property
    def flat(self) -> Floats:
        """(2, 2) x, y of its two ends in the flat state [m]."""
        return self.course[[0, -1]]

    @cached_property
    def stations(self) -> Floats:
        """(k,) distances of the points of its course from the start [m]."""
        return along(self.course)

    def point(self, at: float) -> Floats:
        """(2,) x, y [m] of the flat point at the distance `at` from the start, which may lie beyond its ends."""
        k = int(np.clip(np.searchsorted(self.stations, at) - 1, 0, len(self.stations) - 2))
        (first, second), start = self.course[k : k + 2], self.stations[k]
        return np.asarray(first + (at - start) / (self.stations[k + 1] - start) * (second - first))

    def heading(self, at: float) -> Floats:
        """(2,) direction of the flat rod at the distance `at` from the start, half an edge to either side."""
        step = 0.5 * float(np.diff(self.stations).min())
        return self.point(at + step) - self.point(at - step)

    @property
    def as_cut(self) -> Floats:
        """(k, 2) its course with its allowances at both ends [m]."""
        ends = self.point(-self.allowance), self.point(self.length + self.allowance)
        return np.vstack([ends[0], self.course[1:-1], ends[1]])


def along(points: Floats) -> Floats:
    """(k,) distances of points (k, d) of a polyline from its first, along it [m]."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1)))


def node_stations(archive: Archive, rod: GridRod) -> Floats:
    """(k,) distances of a rod's nodes from its start [m]; its flat state may not keep them if it is assembled in place,
    so that rods along curves of the target are measured there."""
    if archive.results.flat_state is None:
        return along(archive.states["flat"][rod.nodes])
    found = along(archive.states[DRAPED][rod.nodes])
    return np.asarray(found * (rod.length / found[-1]))


@dataclass(frozen=True)
class GridJoint:
    """Where two rods meet: rod indices, and the distance from each rod's start [m]."""

    rods: tuple[int, int]
    at: tuple[float, float]
    id: str

    def over(self, rods: list[GridRod]) -> str:
        """The id of the rod that lies above, or "" where the layers are not known."""
        low, high = (rods[k].record for k in self.rods)
        if low.layer is None or high.layer is None:
            return ""
        return low.id if low.layer > high.layer else high.id


@made_once
def rods_of(archive: Archive) -> list[GridRod]:
    """All rods, in the order of the result."""
    states, rods, nodes = archive.states, archive.results.rods, list[Ints]()
    if "rod_nodes" in states and "rod_start" in states:
        nodes = np.split(states["rod_nodes"].astype(np.intp), states["rod_start"][1:])
    nodes += [np.empty(0, dtype=np.intp)] * len(rods)
    return [_grid_rod(rod, along, states.get("flat")) for rod, along in zip(rods, nodes, strict=False)]


def meshed_rods(archive: Archive) -> list[GridRod]:
    """The rods whose nodes the states hold: all, or none."""
    return [rod for rod in rods_of(archive) if len(rod.nodes)]


def end_nodes(rods: Iterable[GridRod]) -> Ints:
    """(2 m,) the nodes of start and end of each rod in turn."""
    return np.array([rod.nodes[[0, -1]] for rod in rods], dtype=np.intp).ravel()


def family_numbers(families: Iterable[str]) -> list[int]:
    """For the family of each rod, which one of the grid it is, from 0, in the order in which they come."""
    names = list(families)
    numbers = {family: k for k, family in enumerate(dict.fromkeys(names))}
    return [numbers[family] for family in names]


def joints_of(rods: list[GridRod]) -> list[GridJoint]:
    """Every joint once, in the order of the rods; the rod that comes first is named first."""
    index = {rod.id: k for k, rod in enumerate(rods)}
    back = {(rod.id, other): at for rod in rods for other, at in rod.joints}
    return [
        GridJoint((k, index[other]), (at, back[other, rod.id]), f"{rod.id}/{other}")
        for k, rod in enumerate(rods)
        for other, at in rod.joints
        if index.get(other, -1) > k and (other, rod.id) in back
    ]


def joint_places(archive: Archive, positions: Floats) -> dict[str, Floats]:
    """Place (3,) [m] in a shape (n, 3) of each joint that has nodes there, by its id: between its two rods."""
    nodes = archive.states.get("rod_nodes", np.empty(0))
    return {joint.id: positions[nodes[entries]].mean(axis=0) for joint, entries in joint_entries(archive)}


@made_once
def outlines_of(archive: Archive) -> list[Ints]:
    """Rod ends along each outline of the flat grid, those of rod k being 2 k and 2 k + 1, see `outlines`."""
    return outlines(np.array([rod.flat for rod in rods_of(archive)], dtype=float).reshape(-1, 2, 2))


@made_once
def joint_entries(archive: Archive) -> list[tuple[GridJoint, list[int]]]:
    """Every joint of rods that have nodes, and the entry of `rod_nodes` on either rod that lies nearest to it: one node
    twice, or one in either layer."""
    if "flat" not in archive.states:
        return []
    rods = meshed_rods(archive)
    starts: list[int] = np.cumsum([0, *(len(rod.nodes) for rod in rods)]).tolist()
    stations = [node_stations(archive, rod) for rod in rods]

    def entry(rod: int, at: float) -> int:
        return starts[rod] + int(np.abs(stations[rod] - at).argmin())

    return [(joint, [*map(entry, joint.rods, joint.at)]) for joint in joints_of(rods)]


def _grid_rod(rod: Rod, nodes: Ints, flat: Floats | None) -> GridRod:
    course = np.array([[rod.start, 0.0], [rod.end, 0.0]])
    if rod.offset is not None and rod.family in AXES:
        course = np.full((2, 2), rod.offset)
        course[:, AXES[rod.family]] = rod.start, rod.end
    elif flat is not None and len(nodes):
        course = np.asarray(flat[nodes, :2], dtype=np.float64)
        chord, off = course[-1] - course[0], course - course[0]
        if np.abs(off[:, 0] * chord[1] - off[:, 1] * chord[0]).max() < STRAIGHT * float(chord @ chord):
            course = course[[0, -1]]
    return GridRod(rod, course, nodes)


@dataclass(frozen=True, eq=False)
class Shape:
    """One shape of the grid.

    Args:
        name: "flat", "draped", "popped_pinned", "popped_clamped", or "stage_1", ... of the deployment.
        positions: (n, 3) [m].
        gap: (n,) signed distances to the target [m], where known.
        known: (k,) at each entry of `rod_nodes`, where known: "stress" [Pa], "curvature" [1/m] and "force", the normal
            force [N], tension positive.
    """

    name: str
    caption: str
    positions: Floats
    gap: Floats | None = None
    known: Mapping[str, Floats] = field(default_factory=dict)

    @property
    def flat(self) -> bool:
        return self.name == "flat"


def shape_names(archive: Archive) -> list[str]:
    """All shapes, in the order of the deployment."""
    stages = [f"{STAGE}{k}" for k in range(1, len(archive.states.get("history_share", ())) - 1)]
    states, flat = archive.states, ("flat",) if lies_flat(archive) else ()
    return [name for name in (*flat, *stages, *shells_among(states)) if name.startswith(STAGE) or name in states]


def lies_flat(archive: Archive) -> bool:
    """Whether there is a flat grid to be drawn; else the shell is assembled in place."""
    flat = archive.results.flat_state
    return flat is None or flat.lies_flat is not False


def caption_of(archive: Archive, state: str) -> str:
    """What a state shows, in words."""
    if archive.is_lost(state):
        return f"Not popped up, {state.removeprefix(POPPED)} ends: where the computation stopped"
    return CAPTIONS.get(state) or f"Popped up, {supported(state)}"


def holes_text(archive: Archive) -> str:
    """How large the holes at the joints are, in words; "" where rods cross by slots."""
    made = archive.results.fabrication
    if made is not None and made.slot_depth:
        return ""
    given = tomllib.loads(archive.case_toml).get("strength", {}).get("hole") or "to be given"
    return f"holes {given if isinstance(given, str) else f'{1e3 * given:g} mm'}"


def supported(state: str, *more: str) -> str:
    """With which ends a popped-up state is, with notes on them."""
    name = state.removeprefix(POPPED)
    notes = "; ".join([*([SUPPORTS[name].note] if name in SUPPORTS else []), *more])
    return f"{name} ends{f' ({notes})' if notes else ''}"


def shape_of(archive: Archive, name: str) -> Shape:
    """A shape by its name, one of `shape_names`.

    Raises:
        OutputError: the archive has no such shape.
    """
    known, states = shape_names(archive), archive.states
    if name not in known:
        raise OutputError(f"no state {name!r} in this result: it has {', '.join(known) or 'none'}")
    if name.startswith(STAGE):
        k = int(name.removeprefix(STAGE))
        caption = f"Deployment at {100 * states['history_share'][k]:.0f} %"
        bent = {what: states[f"history_{what}"][k] for what in BENT if f"history_{what}" in states}
        return Shape(name, caption, np.asarray(states["history"][k], dtype=float), known=bent)
    ends = name.removeprefix(POPPED)
    bent = {what: states[f"{what}_{ends}"] for what in (*BENT, "force") if f"{what}_{ends}" in states}
    return Shape(name, caption_of(archive, name), np.asarray(states[name], dtype=float), states.get(GAP + ends), bent)


def deployed_shape(archive: Archive, name: str) -> Shape:
    """A shape as the deployment passes it: the flat grid not in the axes of its drawings, but where it is laid out on
    site before its ends move."""
    shape, final = shape_of(archive, name), archive.final
    if not shape.flat or final is None:
        return shape
    ends = end_nodes(meshed_rods(archive))
    return replace(shape, positions=laid_out(shape.positions, archive.states[final], ends))


def laid_out(flat: Floats, final: Floats, ends: Ints) -> Floats:
    """The flat grid (n, 3), moved in its plane to below a shape (n, 3), where its deployment begins: the rod ends, at
    nodes (e,), come as near as they can to where they end."""
    goals = final[ends]
    return PlanarMotion.onto(flat[ends], goals).moved(flat, float(goals[:, 2].min()))


def outlines(rods: Floats) -> list[Ints]:
    """Find the outlines of a flat grid: closed curves through its rod ends, around it and around each of its openings.

    Only the rods say in which order their ends follow each other: the grid is a plane graph, and a walk around one of
    its faces, keeping it on the left, meets the ends that stick out into that face in their order.

    Grids that do not touch each other have one outline each. No end is in two outlines, and none has fewer than three.

    Args:
        rods: (m, 2, 2) the two ends of each straight rod [m].

    Returns:
        For each outline the ends (k,) along it, 2 r for the start of rod r and 2 r + 1 for its end: counterclockwise
        around a grid, clockwise around an opening. Outlines with most ends come first.
    """
    if not len(rods):
        return []
    graph = mesh_grid(FlatGrid.of([_line(ends) for ends in rods]), np.inf)
    ends_at = dict[int, list[int]]()
    for end, node in enumerate(graph.ends.ravel().tolist()):
        ends_at.setdefault(node, []).append(end)
    faces = [[node for node in face if node in ends_at] for face in faces_of(graph.edges, graph.flat)]
    result, done = list[Ints](), set[int]()
    for face in sorted(faces, key=len, reverse=True):
        here = [node for node in dict.fromkeys(face) if node not in done]
        ends = [end for node in here for end in ends_at[node]]
        if len(ends) >= FEWEST:
            result.append(np.array(ends[::-1], dtype=np.intp))
            done.update(here)
    return result


def _line(ends: Floats) -> FlatRod:
    along = ends[1] - ends[0]
    length = float(np.hypot(*along))
    (x, y), (dx, dy) = ends[0].tolist(), (along / length).tolist()
    return FlatRod("", "free", None, 0.0, length, (x, y), (dx, dy))


def opens(outline: Floats) -> bool:
    """Whether an outline of points (k, 2) runs around an opening."""
    x, y = outline.T
    return bool(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)) < 0)


def faces_of(edges: Ints, flat: Floats) -> list[list[int]]:
    """Nodes around each face of a plane graph: from an edge to the next one on its left."""
    both = np.concatenate([edges, edges[:, ::-1]])
    along = flat[both[:, 1], :2] - flat[both[:, 0], :2]
    turned = np.lexsort((np.arctan2(along[:, 1], along[:, 0]), both[:, 0]))
    fans = dict[int, list[int]]()
    for start, stop in both[turned].tolist():
        fans.setdefault(start, []).append(stop)
    onward = dict[tuple[int, int], tuple[int, int]]()
    for node, fan in fans.items():
        for k, other in enumerate(fan):
            onward[other, node] = (node, fan[k - 1])  # the next one clockwise from where it came
    faces = list[list[int]]()
    while onward:
        step, face = next(iter(onward)), list[int]()
        while step in onward:
            face.append(step[1])
            step = onward.pop(step)
        faces.append(face)
    return faces
