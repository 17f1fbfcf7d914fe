"""Nodes and edges on a flat grid: a node at every joint and rod end, and equal edges between them.

Several meshed grids can be merged into one, side by side.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.curves import on_curve
from rodshell.kernels import njit
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
        stop = self.rod_start[rod + 1] if rod + 1 < len(self.rod_start) else len(self.rod_nodes)
        return slice(int(self.rod_start[rod]), int(stop))

    def nodes_of(self, rod: int) -> Ints:
        """Nodes along one rod, from its start to its end."""
        return self.rod_nodes[self.rod_slice(rod)]

    @cached_property
    def rod_of(self) -> Ints:
        """(k,) rod of each entry of `rod_nodes`."""
        return np.repeat(np.arange(len(self.rod_start)), self.rod_stop - self.rod_start)

    @property
    def edges(self) -> Ints:
        """(e, 2) nodes of each edge, rod by rod."""
        return self._stencils.edges

    @property
    def edge_rods(self) -> Ints:
        """(e,) rod of each edge."""
        return self._stencils.edge_rods

    @property
    def edge_lengths(self) -> Floats:
        """(e,) rest lengths [m]."""
        return self._stencils.edge_lengths

    @property
    def bends(self) -> Ints:
        """(b, 3) nodes of each pair of consecutive edges of a rod."""
        return self._stencils.bends

    @property
    def bend_rods(self) -> Ints:
        """(b,) rod of each bend."""
        return self._stencils.bend_rods

    @property
    def voronoi_lengths(self) -> Floats:
        """(b,) half the rest length of the two edges of each bend [m] [HQK Eq 1b, of the rest state: see ERRATA]."""
        return self._stencils.voronoi_lengths

    @cached_property
    def _stencils(self) -> "_Stencils":
        return _Stencils(*_edges_and_bends(self.rod_nodes, self.rod_start, self.stations))

    @cached_property
    def ends(self) -> Ints:
        """(m, 2) first and last node of each rod."""
        return np.column_stack([self.rod_nodes[self.rod_start], self.rod_nodes[self.rod_stop - 1]])

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

    def tributary_lengths(self) -> Floats:
        """Rod length (n,) that each node represents: half of every edge at the node [m]."""
        total = np.zeros(self.node_count)
        np.add.at(total, self.edges, 0.5 * self.edge_lengths[:, None])
        return total

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


class _Stencils(NamedTuple):
    """Edges and bends; see the properties of `GridMesh` of the same names."""

    edges: Ints
    edge_rods: Ints
    edge_lengths: Floats
    bends: Ints
    bend_rods: Ints
    voronoi_lengths: Floats


@njit("i1 i1 f1")
def _edges_and_bends(rod_nodes, rod_start, stations):  # type: ignore[no-untyped-def]
    edge_count, bend_count, stop = 0, 0, len(rod_nodes)
    for rod in range(len(rod_start) - 1, -1, -1):
        edge_count += stop - rod_start[rod] - 1
        bend_count += max(stop - rod_start[rod] - 2, 0)
        stop = rod_start[rod]
    edges, edge_rods = np.empty((edge_count, 2), dtype=np.int64), np.empty(edge_count, dtype=np.int64)
    bends, bend_rods = np.empty((bend_count, 3), dtype=np.int64), np.empty(bend_count, dtype=np.int64)
    lengths, voronoi, e, b = np.empty(edge_count), np.empty(bend_count), 0, 0
    for rod in range(len(rod_start)):
        stop = rod_start[rod + 1] if rod + 1 < len(rod_start) else len(rod_nodes)
        for k in range(rod_start[rod], stop - 1):
            edges[e, 0], edges[e, 1] = rod_nodes[k], rod_nodes[k + 1]
            edge_rods[e], lengths[e] = rod, stations[k + 1] - stations[k]
            e += 1
            if k + 2 < stop:
                bends[b, 0], bends[b, 1], bends[b, 2] = rod_nodes[k], rod_nodes[k + 1], rod_nodes[k + 2]
                bend_rods[b], voronoi[b] = rod, 0.5 * (stations[k + 2] - stations[k])
                b += 1
    return edges, edge_rods, lengths, bends, bend_rods, voronoi


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
    given, begin = list[float](), [0]
    for rod, more in zip(grid.rods, marks, strict=True):
        given += (rod.start, *more, rod.end)
        begin.append(len(given))
    found: tuple[Ints, Floats, Ints, int, Ints] = _fixed(
        grid.crossings.rods, grid.crossings.at, finite("marks", given, len(given)), np.array(begin)
    )
    return found


@njit("i2 f2 f1 i1")
def _fixed(crossings, at, given, begin):  # type: ignore[no-untyped-def]
    """See `_fixed_points`: `crossings` (c, 2) and where they are (c, 2); the `given` points, rod by rod, of which those
    of each rod `begin` (m + 1,) there."""
    rods, sides, longest = len(begin) - 1, 2 * len(crossings), 0.0
    size = sides + len(given)  # both sides of each crossing, then the given points
    rod, s, first = np.empty(size, dtype=np.int64), np.empty(size), np.zeros(rods + 1, dtype=np.int64)
    for k in range(sides):
        rod[k], s[k] = crossings[k // 2, k % 2], at[k // 2, k % 2]
    for r in range(rods):
        longest = max(longest, given[begin[r + 1] - 1] - given[begin[r]])
        for k in range(begin[r], begin[r + 1]):
            rod[sides + k], s[sides + k] = r, given[k]
    for k in range(size):
        first[rod[k] + 1] += 1
    for r in range(rods):
        first[r + 1] += first[r]
    order, stop = np.empty(size, dtype=np.int64), first[:rods].copy()
    for k in range(size):  # sorted along each rod by insertion: crossings mostly come in order
        n = stop[rod[k]]
        stop[rod[k]] += 1
        while n > first[rod[k]] and s[order[n - 1]] > s[k]:
            order[n] = order[n - 1]
            n -= 1
        order[n] = k
    joint_nodes, joints = _merge_joints(order, rod, s, sides, 1e-7 * longest)
    node, kept = np.empty(size, dtype=np.int64), np.zeros(size, dtype=np.bool_)
    for r in range(rods):
        tiny, last, before, best = 1e-9 * (given[begin[r + 1] - 1] - given[begin[r]]), -np.inf, -1, -1
        for n in range(first[r], first[r + 1]):
            k = order[n]
            if k < sides:
                node[k] = joint_nodes[k // 2]
                again, before = node[k] == before, node[k]
                if again:  # each joint once on each of its rods: three rods make three crossings
                    continue
            if s[k] - last > tiny:
                best = size
            # of points at one place the first is kept, and every joint
            if k < sides or k < best:
                if sides <= best < size:
                    kept[best] = False
                kept[k], best = True, min(best, k)
            last = s[k]
    count = joints
    for k in range(sides, size):
        if kept[k]:
            node[k] = count
            count += 1
    stations, nodes, used = np.empty(size), np.empty(size, dtype=np.int64), 0
    for r in range(rods):
        start, first[r] = first[r], used
        for n in range(start, first[r + 1]):
            if kept[order[n]]:
                stations[used], nodes[used] = s[order[n]], node[order[n]]
                used += 1
    first[rods] = used
    return first, stations[:used], nodes[:used], count, joint_nodes


@njit()
def _merge_joints(order, rod, s, sides, tiny):  # type: ignore[no-untyped-def]
    """The node of each crossing, and their number: crossings at one point (of three rods or more) share their node.

    They are neighbours along each of their rods, with no more than round-off between them: less than `tiny` [m].
    `order` has the points along one rod after the other, see `_fixed`.
    """
    node, before = np.arange(sides // 2), -1
    used = np.zeros(len(node), dtype=np.int64)
    for k in order:
        if k < sides:
            if before >= 0 and rod[k] == rod[before] and s[k] - s[before] < tiny:
                old, new = node[k // 2], node[before // 2]
                for c in range(len(node)):
                    if node[c] == old:
                        node[c] = new
            before = k
    for c in range(len(node)):
        used[node[c]] = 1
    joints = 0
    for c in range(len(node)):
        if used[c]:
            used[c] = joints
            joints += 1
    for c in range(len(node)):
        node[c] = used[node[c]]
    return node, joints


@njit("f2 i1 f1 i1 i1 i")
def _divided(lines, begin, s, nodes, edges, count):  # type: ignore[no-untyped-def]
    """Node positions, `rod_nodes`, `rod_start` and stations of rods with origin and direction `lines` (m, 4).

    The `count` nodes of their fixed points come first, see `_fixed_points`; `edges` of each is the number of edges up
    to the next of its rod.
    """
    size, rods = len(s), len(lines)
    for rod in range(rods):
        for k in range(begin[rod], begin[rod + 1] - 1):
            size += edges[k] - 1
    flat, stations = np.zeros((count + size - len(s), 3)), np.empty(size)
    rod_nodes, rod_start, entry = np.empty(size, dtype=np.int64), np.empty(rods, dtype=np.int64), 0
    for rod in range(rods):
        rod_start[rod] = entry
        for k in range(begin[rod], begin[rod + 1]):
            last = k + 1 == begin[rod + 1]
            for step in range(1 if last else edges[k]):
                node, at = nodes[k], s[k]
                if step > 0:
                    node, at = count, s[k] + (s[k + 1] - s[k]) * step / edges[k]
                    count += 1
                rod_nodes[entry], stations[entry] = node, at
                for axis in range(2):
                    flat[node, axis] = lines[rod, axis] + at * lines[rod, 2 + axis]
                entry += 1
    return flat, rod_nodes, rod_start, stations


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
    source = spans, mesh.rod_nodes, mesh.stations, grid.crossings.rods, mesh.joint_nodes[joints], mesh.node_count
    nodes, *part, left_out = _cut(*source, limits)
    if left_out:
        nodes, *part, _ = _cut(*source, CROWDED * _usual_edges(mesh)[index])
    return GridMesh(grid, mesh.flat.take(nodes, axis=0), *part), nodes


@njit("i2 i1 f1 i2 i1 i f1")
def _cut(spans, rod_nodes, stations, crossings, crossing_nodes, node_count, limits):  # type: ignore[no-untyped-def]
    """Nodes of the part in the mesh; its `rod_nodes`, `rod_start`, stations and joint nodes; the number of nodes that
    are left out, because they are closer than `limits` (m,) [m] to an end and not at a joint.

    The pieces have the entries `spans` (m, 2), and cross in pairs `crossings` (c, 2) at the nodes `crossing_nodes`.
    """
    number, joined = np.full(node_count, -1), np.full(node_count, -1)
    last, before = np.full(len(spans), -1), np.empty(2 * len(crossings), dtype=np.int64)  # crossings of each piece
    size = 0
    for piece in range(len(spans)):
        size += spans[piece, 1] + 1 - spans[piece, 0]
    nodes, joints, count = np.empty(size, dtype=np.int64), np.empty(len(crossings), dtype=np.int64), 0
    for k in range(2 * len(crossings)):
        node, piece = crossing_nodes[k // 2], crossings[k // 2, k % 2]
        if number[node] < 0:
            number[node], nodes[count] = count, node
            count += 1
        joints[k // 2] = number[node]
        before[k], last[piece] = last[piece], k
    part, starts, s, used = np.empty(size, dtype=np.int64), np.empty(len(spans), dtype=np.int64), np.empty(size), 0
    for piece in range(len(spans)):
        low, high, k = spans[piece, 0], spans[piece, 1], last[piece]
        starts[piece] = used
        while k >= 0:
            joined[crossing_nodes[k // 2]] = piece
            k = before[k]
        for entry in range(low, high + 1):
            node, at = rod_nodes[entry], stations[entry]
            if joined[node] == piece:
                part[used] = number[node]
            elif 0.0 < min(at - stations[low], stations[high] - at) < limits[piece]:
                continue
            else:
                part[used], nodes[count] = count, node
                count += 1
            s[used] = at
            used += 1
    return nodes[:count], part[:used], starts, s[:used], joints, size - used


def spans_along(mesh: GridMesh, ends: Floats, whole: Ints) -> Ints:
    """(m, 2) the first and the last entry of a mesh's `rod_nodes` on each piece of a rod.

    Args:
        ends: (m, 2) material coordinates of start and end of each piece [m].
        whole: (m,) the rod of the mesh that it belongs to.
    """
    return np.asarray(_spans(mesh.rod_start[whole], mesh.rod_stop[whole] - 1, mesh.stations, ends))


@njit("i1 i1 f1 f2")
def _spans(first, last, stations, ends):  # type: ignore[no-untyped-def]
    spans = np.empty((len(ends), 2), dtype=np.int64)
    for k in range(len(ends)):
        low, high, tiny = first[k], last[k], 1e-9 * (ends[k, 1] - ends[k, 0])
        while low < high and stations[low] < ends[k, 0] - tiny:
            low += 1
        while low < high and stations[high] > ends[k, 1] + tiny:
            high -= 1
        spans[k, 0], spans[k, 1] = low, high
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
