"""Nodes and edges on a flat grid: a node at every joint and rod end, and equal edges between them.

Several meshed grids can be merged into one, side by side.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.curves import on_curve
from rodshell.layout.flatgrid import Crossings, FlatGrid, FlatRod, sides, whole_rods
from rodshell.layout.profile import Profile
from rodshell.units import length_text
from rodshell.untrusted import limit, raised
from rodshell.validation import finite, instance, listed, positive

MOST_NODES = 4_000_000  # of a net or a mesh
CROWDED = 0.01  # of the usual edge: nodes closer to an end are left out: round-off in forces grows as the inverse cube


@dataclass(frozen=True, eq=False, repr=False)
class GridMesh:
    """A flat grid divided into edges; make one with `mesh_grid`.

    Rods share one node at a joint, or are in two layers (`in_layers`). Two meshes are equal only if they are the same
    object.

    Args:
        grid: the rods and joints that were meshed.
        flat: (n, 3) node positions in the flat, unstressed state [m]; z = 0, or the height of the rod's layer.
        rod_nodes: (k,) nodes of all rods, one rod after the other in the order of `grid.rods`.
        rod_start: (m,) where each rod begins in `rod_nodes`.
        stations: (k,) material coordinate of each entry of `rod_nodes` on its rod [m].
        joint_nodes: (c,) node of each of the grid's crossings, on its first rod.
        second_nodes: (c,) the same on its second rod, where rods are in layers and share no nodes; None: the same node.
        side_by_side: the grids that it consists of, in the order of their rods, nodes and crossings; empty: of one.
    """

    grid: FlatGrid
    flat: Floats
    rod_nodes: Ints
    rod_start: Ints
    stations: Floats
    joint_nodes: Ints
    second_nodes: Ints | None = None
    side_by_side: tuple["GridMesh", ...] = ()

    @property
    def grids(self) -> tuple["GridMesh", ...]:
        """The meshes of all grids that lie side by side, of which it is the only one or consists."""
        return self.side_by_side or (self,)

    @cached_property
    def grid_of_rods(self) -> Ints:
        """(m,) grid that each rod belongs to."""
        return np.repeat(np.arange(len(self.grids)), [len(mesh.grid.rods) for mesh in self.grids])

    @cached_property
    def grid_of_nodes(self) -> Ints:
        """(n,) grid that each node belongs to."""
        return np.repeat(np.arange(len(self.grids)), [mesh.node_count for mesh in self.grids])

    @cached_property
    def apart(self) -> "GridMesh":
        """The same rods, each with its own nodes, k in all, in the order of `rod_nodes`; without joints."""
        nodes = np.arange(len(self.rod_nodes))
        return replace(self, flat=self.flat[self.rod_nodes], rod_nodes=nodes, joint_nodes=np.arange(0))

    def __repr__(self) -> str:
        return f"GridMesh({len(self.grid.rods)} rods, {self.node_count} nodes, {len(self.joint_nodes)} joints)"

    @property
    def node_count(self) -> int:
        """Number of nodes n."""
        return len(self.flat)

    def place(self, entry: int) -> tuple[str, float]:
        """Of an entry of `rod_nodes`: the rod's name, and the distance from its start [m]."""
        rod = self.grid.rods[int(np.searchsorted(self.rod_start, entry, side="right")) - 1]
        return rod.name, float(self.stations[entry]) - rod.start

    def rod_slice(self, rod: int) -> slice:
        """The entries of `rod_nodes` and `stations` that belong to a rod."""
        return slice(int(self.rod_start[rod]), int(self.rod_stop[rod]))

    def nodes_of(self, rod: int) -> Ints:
        """Nodes along one rod, from its start to its end."""
        return self.rod_nodes[self.rod_slice(rod)]

    @cached_property
    def rod_of(self) -> Ints:
        """(k,) rod of each entry of `rod_nodes`."""
        return np.repeat(np.arange(len(self.rod_start)), self.rod_stop - self.rod_start)

    @cached_property
    def edge_entries(self) -> Ints:
        """(e,) entry of `rod_nodes` at which each edge begins; it ends at the next."""
        return np.delete(np.arange(len(self.rod_nodes)), self.rod_stop - 1)

    @cached_property
    def edges(self) -> Ints:
        """(e, 2) nodes of each edge, rod by rod."""
        return np.asarray(self.rod_nodes[self.edge_entries[:, None] + [0, 1]])

    @cached_property
    def edge_rods(self) -> Ints:
        """(e,) rod of each edge."""
        return self.rod_of[self.edge_entries]

    @cached_property
    def edge_lengths(self) -> Floats:
        """(e,) rest lengths [m]."""
        return np.asarray(self.stations[self.edge_entries + 1] - self.stations[self.edge_entries])

    @cached_property
    def bend_entries(self) -> Ints:
        """(b,) entry of `rod_nodes` in the middle of each bend."""
        return np.delete(np.arange(len(self.rod_nodes)), self.end_entries)

    @cached_property
    def bends(self) -> Ints:
        """(b, 3) nodes of each pair of consecutive edges of a rod."""
        return np.asarray(self.rod_nodes[self.bend_entries[:, None] + [-1, 0, 1]])

    @cached_property
    def bend_rods(self) -> Ints:
        """(b,) rod of each bend."""
        return self.rod_of[self.bend_entries]

    @cached_property
    def voronoi_lengths(self) -> Floats:
        """(b,) half the rest length of the two edges of each bend [m] [HQK Eq 1b, of the rest state: see ERRATA]."""
        return np.asarray(0.5 * (self.stations[self.bend_entries + 1] - self.stations[self.bend_entries - 1]))

    @cached_property
    def end_entries(self) -> Ints:
        """(2m,) entries of `rod_nodes` at the start and the end of each rod in turn."""
        return np.column_stack([self.rod_start, self.rod_stop - 1]).ravel()

    @cached_property
    def ends(self) -> Ints:
        """(m, 2) first and last node of each rod."""
        return np.asarray(self.rod_nodes[self.end_entries].reshape(-1, 2))

    @property
    def joint_pairs(self) -> Ints:
        """(c, 2) nodes of each crossing on its two rods."""
        second = self.joint_nodes if self.second_nodes is None else self.second_nodes
        return np.column_stack([self.joint_nodes, second])

    @cached_property
    def at_crossings(self) -> Ints:
        """(c, 2) entries of `rod_nodes` at each crossing of the grid, of its first and its second rod."""
        key = self.rod_of * self.node_count + self.rod_nodes
        order = np.argsort(key, kind="stable")
        wanted = self.grid.crossings.rods * self.node_count + self.joint_pairs
        return np.asarray(order[np.searchsorted(key[order], wanted)])

    @cached_property
    def beside_crossings(self) -> Ints:
        """(c, 2, 2) entries of `rod_nodes` before and after each crossing on both its rods; at a rod's end its own."""
        entries, rods = self.at_crossings, self.grid.crossings.rods
        before, after = np.maximum(entries - 1, self.rod_start[rods]), np.minimum(entries + 1, self.rod_stop[rods] - 1)
        return np.stack([before, after], axis=2)

    @cached_property
    def between_crossings(self) -> tuple[Ints, Floats]:
        """Of each entry of `rod_nodes` the crossings before and after it on its rod (k, 2), and how far it is on the
        way from the first to the second (k,), 0 to 1; before a rod's first crossing and past its last both are that.

        Raises:
            ValueError: some rod crosses no other.
        """
        if (self.grid.joint_counts() == 0).any():
            raise ValueError("a rod that crosses no other has nothing to interpolate between")
        entries = self.at_crossings.ravel()
        order = np.argsort(entries, kind="stable")
        entries, crossings = entries[order], order // 2
        after = np.searchsorted(entries, np.arange(len(self.rod_nodes)), side="right")
        around = np.clip(np.column_stack([after - 1, after]), 0, len(entries) - 1)
        elsewhere = self.rod_of[entries[around]] != self.rod_of[:, None]
        around = np.where(elsewhere, around[:, ::-1], around)
        first, last = self.stations[entries[around]].T
        share = np.clip((self.stations - first) / np.where(last > first, last - first, 1.0), 0.0, 1.0)
        return crossings[around], share

    @property
    def layered(self) -> bool:
        """Whether rods are in two layers, each with its own nodes."""
        return self.second_nodes is not None

    @property
    def heights(self) -> Floats:
        """(n,) height of each node's layer above the surface between the layers [m]."""
        return self.flat[:, 2]

    def in_layers(self, eccentricity: float) -> "GridMesh":
        """The same rods in two layers; node k of the result is entry k of this mesh's `rod_nodes`.

        Args:
            eccentricity: distance of the layers [m].

        Raises:
            InputError: the rods need more than two layers.
        """
        side, pairs = sides(self.grid)[self.rod_of], self.at_crossings
        flat = self.flat[self.rod_nodes]
        flat[:, 2] = 0.5 * eccentricity * side
        nodes = np.arange(len(self.rod_nodes))
        return GridMesh(self.grid, flat, nodes, self.rod_start, self.stations, pairs[:, 0], pairs[:, 1])

    @cached_property
    def rod_stop(self) -> Ints:
        """(m,) where each rod ends in `rod_nodes`: one past its last entry."""
        return np.append(self.rod_start[1:], len(self.rod_nodes))

    def with_profiles(self, profiles: Profile | Sequence[Profile | None] | None) -> "GridMesh":
        """The same mesh of rods whose sections change along them; arguments as of `FlatGrid.with_profiles`."""
        return replace(self, grid=self.grid.with_profiles(profiles))

    @cached_property
    def rest_curvatures(self) -> Floats:
        """(k,) of the rods at rest at each entry of `rod_nodes`, positive to the left in the plane [1/m]."""
        result = np.zeros(len(self.rod_nodes))
        for k, rod in enumerate(self.grid.rods):
            if rod.curve is not None:
                result[self.rod_slice(k)] = rod.curve.at(self.stations[self.rod_slice(k)])
        return result

    def prolong(self, positions: Floats, fine: "GridMesh", *, rods: Sequence[int] | None = None) -> Floats:
        """Interpolate positions on another mesh of the same rods, by local cubics along each rod.

        Args:
            positions: (n, 3) of the nodes of this mesh [m].
            rods: for each rod of `fine` the rod of this mesh that it is a part of; default: the same.

        Returns:
            (n, 3) positions of the nodes of `fine` [m].
        """
        result = np.empty((fine.node_count, 3))
        for k, rod in enumerate(rods if rods is not None else range(len(self.rod_start))):
            here, there = self.rod_slice(rod), fine.rod_slice(k)
            curve = on_curve(self.stations[here], positions[self.rod_nodes[here]], fine.stations[there])
            result[fine.rod_nodes[there]] = curve
        return result


def mesh_grid(grid: FlatGrid, edge: float, *, marks: Sequence[Sequence[float]] | None = None) -> GridMesh:
    """Divide a flat grid into edges: each span between joints, and each end of a rod, into the fewest equal edges.

    Args:
        edge: longest edge [m]; infinite: as few edges as possible.
        marks: for each rod the material coordinates of further points that must be nodes [m].

    Raises:
        InputError: a value is of the wrong kind; the edge is not positive; not as many marks as rods.
    """
    instance("grid", grid, FlatGrid)
    edge = positive("edge", edge, "m", infinite=True)
    if marks is not None:
        marks = [listed("marks", row, "a list for each rod") for row in listed("marks", marks, "a list for each rod")]
        if len(marks) != len(grid.rods):
            raise InputError(f"{len(grid.rods)} rods need as many lists of marks, not {len(marks)}")
    first, s, nodes, count, joint_nodes = _fixed_points(grid, [()] * len(grid.rods) if marks is None else marks)
    lines = np.array([(*rod.origin, *rod.direction) for rod in grid.rods])
    edges = edge_counts(np.diff(s), edge)
    if edges.sum() > limit(MOST_NODES):
        raise InputError(
            f"the grid would have {edges.sum()} edges of {length_text(edge)}: check its unit, use a longer edge, such "
            f"as {length_text(float(np.diff(grid.ends).max()) / 100)}, {raised(MOST_NODES, edges.sum())}"
        )
    flat, rod_nodes, rod_start, stations = _divided(lines, first, s, nodes, edges, count)
    return GridMesh(grid, flat, rod_nodes, rod_start, stations, joint_nodes)


def _fixed_points(grid: FlatGrid, marks: Sequence[Sequence[float]]) -> tuple[Ints, Floats, Ints, int, Ints]:
    """The points that must be nodes, along one rod after the other: of each rod where they begin; material coordinate
    [m] and node of each; the number of nodes; and the node of each crossing.

    The start, the marks and the end of each rod get a new node each, unless there is a joint or an earlier one of them.
    """
    rows = [(rod.start, *more, rod.end) for rod, more in zip(grid.rods, marks, strict=True)]
    counts, crossings = [len(row) for row in rows], grid.crossings.rods
    given = finite("marks", [s for row in rows for s in row], sum(counts))
    lengths, sides = np.diff(grid.ends).ravel(), crossings.size  # both sides of each crossing, then the given points
    rod = np.append(crossings.ravel(), np.repeat(np.arange(len(rows)), counts))
    s = np.append(grid.crossings.at.ravel(), given)
    order = np.lexsort((s, rod))
    joints, joint_nodes = _merged_joints(order[order < sides], rod, s, len(crossings), 1e-7 * lengths.max(initial=0.0))
    new = np.append(True, (np.diff(rod[order]) > 0) | (np.diff(s[order]) > 1e-9 * lengths[rod[order[1:]]]))
    first = np.repeat(np.minimum.reduceat(order, np.flatnonzero(new)), np.diff(np.append(np.flatnonzero(new), len(s))))
    joint = np.append(np.repeat(joint_nodes, 2), np.full(len(given), -1))[order]
    _, once = np.unique(rod[order] * (joints + 1) + joint, return_index=True)  # three rods make three crossings
    # of points at one place the first is kept, and every joint once
    kept = np.where(order < sides, np.isin(np.arange(len(order)), once), order == first)
    placed = np.sort(order[kept & (order >= sides)])
    node = np.append(np.repeat(joint_nodes, 2), joints + np.searchsorted(placed, np.arange(sides, len(s))))
    order = order[kept]
    begin = np.searchsorted(rod[order], np.arange(len(rows) + 1))
    return begin, s[order], node[order], joints + len(placed), joint_nodes


def _merged_joints(order: Ints, rod: Ints, s: Floats, count: int, tiny: float) -> tuple[int, Ints]:
    """The number of joints, and the node of each of so many crossings: crossings at one point (of three rods or more)
    share their node.

    They are neighbours along each of their rods, with no more than round-off between them: less than `tiny` [m].
    `order` has the sides of the crossings along one rod after the other, see `_fixed_points`.
    """
    near = np.flatnonzero((np.diff(rod[order]) == 0) & (np.diff(s[order]) < tiny))
    if not len(near):
        return count, np.arange(count)
    pairs = order[near] // 2, order[near + 1] // 2
    joints, labels = connected_components(coo_array((np.ones(len(near)), pairs), shape=(count, count)), directed=False)
    return int(joints), labels.astype(np.intp)


def _divided(
    lines: Floats, begin: Ints, s: Floats, nodes: Ints, edges: Ints, count: int
) -> tuple[Floats, Ints, Ints, Floats]:
    """Node positions, `rod_nodes`, `rod_start` and stations of rods with origin and direction `lines` (m, 4).

    The `count` nodes of their fixed points come first, see `_fixed_points`; `edges` of each is the number of edges up
    to the next of its rod.
    """
    parts = np.append(edges, 1)
    parts[begin[1:] - 1] = 1
    starts = np.cumsum(parts) - parts
    point = np.repeat(np.arange(len(s)), parts)
    rod = np.repeat(np.arange(len(lines)), np.diff(np.append(starts, parts.sum())[begin]))
    step = np.arange(len(point)) - starts[point]
    stations = s[point] + (np.append(s[1:], s[-1:])[point] - s[point]) * step / parts[point]
    rod_nodes = np.where(step == 0, nodes[point], count - 1 + np.cumsum(step > 0))
    flat = np.zeros((count + int(np.count_nonzero(step)), 3))
    flat[rod_nodes, :2] = lines[rod, :2] + stations[:, None] * lines[rod, 2:]
    return flat, rod_nodes, starts[begin[:-1]], stations


def cut_mesh(mesh: GridMesh, rods: Sequence[FlatRod], *, margin: float = 0.0) -> tuple[GridMesh, Ints]:
    """Cut a part out of a mesh.

    Where a joint of the mesh is not in the part, because it is too close to an end, each rod keeps its own node, unless
    that would be so close to the end that it makes an edge far shorter and stiffer than the other edges.

    Args:
        rods: pieces of its rods, cut at nodes.
        margin: joints closer to an end of either rod are not in the part [m].

    Returns:
        The part, and its nodes (n,) in `mesh`.
    """
    grid, joints = mesh.grid.cut(rods, margin=margin)
    index = whole_rods(mesh.grid.rods, rods)
    spans, limits = spans_along(mesh, grid.ends, index), np.full(len(rods), CROWDED * mesh.edge_lengths.max())
    crossing_nodes = mesh.joint_nodes[joints]
    part, nodes, left_out = _cut(mesh, grid, spans, crossing_nodes, limits)
    if left_out:
        part, nodes, _ = _cut(mesh, grid, spans, crossing_nodes, CROWDED * _usual_edges(mesh)[index])
    return part, nodes


def _cut(
    mesh: GridMesh, grid: FlatGrid, spans: Ints, crossing_nodes: Ints, limits: Floats
) -> tuple[GridMesh, Ints, int]:
    """The part of a mesh with the rods of `grid`, which have the entries `spans` (m, 2), and its nodes in the mesh, at
    which their crossings are (c,); and the number of nodes that are left out, because they are closer than `limits`
    (m,) [m] to an end and not at a joint.
    """
    rod_nodes, stations = mesh.rod_nodes, mesh.stations
    counts = 1 + spans[:, 1] - spans[:, 0]
    piece, stops = np.repeat(np.arange(len(spans)), counts), np.cumsum(counts)
    entry = np.arange(len(piece)) + (spans[:, 0] - stops + counts)[piece]
    low, high = stations[spans].T
    from_end = np.minimum(stations[entry] - low[piece], high[piece] - stations[entry])
    at_joints = grid.crossings.rods * mesh.node_count + crossing_nodes[:, None]
    joined = np.isin(piece * mesh.node_count + rod_nodes[entry], at_joints)
    kept = joined | (from_end <= 0.0) | (from_end >= limits[piece])
    left_out, piece, entry, joined = len(kept) - int(kept.sum()), piece[kept], entry[kept], joined[kept]
    known, first = np.unique(crossing_nodes, return_index=True)
    known = known[np.argsort(first)]
    number = np.full(mesh.node_count, -1)
    number[known] = np.arange(len(known))
    part = np.where(joined, number[rod_nodes[entry]], len(known) - 1 + np.cumsum(~joined))
    nodes = np.append(known, rod_nodes[entry[~joined]])
    begin = np.searchsorted(piece, np.arange(len(spans)))
    flat = mesh.flat.take(nodes, axis=0)
    return GridMesh(grid, flat, part, begin, stations[entry], number[crossing_nodes]), nodes, left_out


def spans_along(mesh: GridMesh, ends: Floats, whole: Ints) -> Ints:
    """(m, 2) the first and the last entry of a mesh's `rod_nodes` on each piece of a rod.

    Args:
        ends: (m, 2) material coordinates of start and end of each piece [m].
        whole: (m,) the rod of the mesh that it belongs to.
    """
    spans = np.empty((len(ends), 2), dtype=np.intp)
    for k, (rod, (start, end)) in enumerate(zip(whole.tolist(), ends.tolist(), strict=True)):
        here, tiny = mesh.rod_slice(rod), 1e-9 * (end - start)
        s = mesh.stations[here]
        low = min(int(np.searchsorted(s, start - tiny)), len(s) - 1)
        high = max(int(np.searchsorted(s, end + tiny, side="right")) - 1, low)
        spans[k] = here.start + low, here.start + high
    return spans


def _usual_edges(mesh: GridMesh) -> Floats:
    """(m,) median length of the edges of each rod [m]."""
    order = np.lexsort((mesh.edge_lengths, mesh.edge_rods))
    count = np.bincount(mesh.edge_rods, minlength=len(mesh.grid.rods))
    low, high = (np.cumsum(count) - count + half for half in ((count - 1) // 2, count // 2))
    return np.asarray(0.5 * (mesh.edge_lengths[order[low]] + mesh.edge_lengths[order[high]]))


def edge_counts(lengths: Floats, edge: float) -> Ints:
    """Number of equal edges into which lengths are divided.

    Args:
        lengths: (n,) [m].
        edge: longest edge, which may be exceeded by 1e-6 of it [m].

    Returns:
        (n,) the smallest possible numbers.
    """
    return np.maximum(1, np.ceil(lengths / edge - 1e-6)).astype(np.intp)


def side_by_side(meshes: Mapping[str, GridMesh], gap: float) -> GridMesh:
    """Grids in a row, each moved but not rotated and centred on the x axis, and the row on the origin.

    Args:
        gap: between two grids [m].

    Returns:
        Rods, nodes and joints of one grid after the other; rod U01 of grid A is A-U01.
    """
    low = {name: mesh.flat[:, :2].min(axis=0) for name, mesh in meshes.items()}
    high = {name: mesh.flat[:, :2].max(axis=0) for name, mesh in meshes.items()}
    width = sum(float(high[name][0] - low[name][0]) + gap for name in meshes) - gap
    left, moved = -0.5 * width, list[GridMesh]()
    for name, mesh in meshes.items():
        shift = np.array([left - low[name][0], -0.5 * (low[name][1] + high[name][1])])
        moved.append(_moved(name, mesh, shift))
        left += float(high[name][0] - low[name][0]) + gap
    return _merged(moved)


def _moved(name: str, mesh: GridMesh, shift: Floats) -> GridMesh:
    """A mesh displaced in the plane, with `name` before the names of its rods."""
    along = np.array([_along(rod, shift) for rod in mesh.grid.rods])
    rods = tuple(_moved_rod(name, rod, shift) for rod in mesh.grid.rods)
    crossings = Crossings(mesh.grid.crossings.rods, mesh.grid.crossings.at + along[mesh.grid.crossings.rods])
    flat, stations = mesh.flat + np.append(shift, 0.0), mesh.stations + along[mesh.rod_of]
    return replace(mesh, grid=FlatGrid(rods, crossings, mesh.grid.passed), flat=flat, stations=stations)


def _along(rod: FlatRod, shift: Floats) -> float:
    """Change of a rod's material coordinates: those on the lines of a lattice are measured from its middle."""
    return 0.0 if rod.offset is None else float(shift @ np.array(rod.direction))


def _moved_rod(name: str, rod: FlatRod, shift: Floats) -> FlatRod:
    if rod.offset is None:
        x, y = np.array(rod.origin) + shift
        moved = rod._replace(origin=(float(x), float(y)))
    else:
        by = _along(rod, shift)
        moved = rod.cut(rod.start + by, rod.end + by, float(shift @ np.array(rod.across)))
    return moved._replace(name=f"{name}-{rod.name}")


def _merged(meshes: list[GridMesh]) -> GridMesh:
    """Merge meshes that share no nodes."""
    rods = np.cumsum([0, *(len(mesh.grid.rods) for mesh in meshes)])
    nodes = np.cumsum([0, *(mesh.node_count for mesh in meshes)])
    entries = np.cumsum([0, *(len(mesh.rod_nodes) for mesh in meshes)])
    crossings = Crossings(
        np.concatenate([mesh.grid.crossings.rods + by for mesh, by in zip(meshes, rods, strict=False)]),
        np.concatenate([mesh.grid.crossings.at for mesh in meshes]),
    )
    return GridMesh(
        FlatGrid(tuple(rod for mesh in meshes for rod in mesh.grid.rods), crossings),
        np.concatenate([mesh.flat for mesh in meshes]),
        np.concatenate([mesh.rod_nodes + by for mesh, by in zip(meshes, nodes, strict=False)]),
        np.concatenate([mesh.rod_start + by for mesh, by in zip(meshes, entries, strict=False)]),
        np.concatenate([mesh.stations for mesh in meshes]),
        np.concatenate([mesh.joint_nodes + by for mesh, by in zip(meshes, nodes, strict=False)]),
        np.concatenate([mesh.joint_pairs[:, 1] + by for mesh, by in zip(meshes, nodes, strict=False)])
        if any(mesh.layered for mesh in meshes)
        else None,
        tuple(meshes),
    )
