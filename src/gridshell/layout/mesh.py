"""Nodes and edges on a flat grid: a node at every joint and rod end, and equal edges between them."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from gridshell.geometry.curves import on_curve
from gridshell.layout.flatgrid import FlatGrid, FlatRod, whole_rods

Ints = NDArray[np.intp]
Floats = NDArray[np.float64]


@dataclass(frozen=True)
class GridMesh:
    """A flat grid divided into edges; rods share one node at a joint.

    Parameters
    ----------
    grid : the rods and joints that were meshed.
    flat : (n, 3) node positions in the flat, unstressed state, z = 0 [m].
    rod_nodes : (k,) nodes of all rods in a row, in the order of `grid.rods`.
    rod_start : (m,) where each rod begins in `rod_nodes`.
    stations : (k,) material coordinate of each entry of `rod_nodes` on its rod [m].
    joint_nodes : (c,) node of each of the grid's crossings.
    """

    grid: FlatGrid
    flat: Floats
    rod_nodes: Ints
    rod_start: Ints
    stations: Floats
    joint_nodes: Ints

    @property
    def node_count(self) -> int:
        return len(self.flat)

    def rod_slice(self, rod: int) -> slice:
        stop = self.rod_start[rod + 1] if rod + 1 < len(self.rod_start) else len(self.rod_nodes)
        return slice(int(self.rod_start[rod]), int(stop))

    def nodes_of(self, rod: int) -> Ints:
        """Nodes along one rod, from its start to its end."""
        return self.rod_nodes[self.rod_slice(rod)]

    @cached_property
    def _rod_of(self) -> Ints:
        lengths = np.diff(np.append(self.rod_start, len(self.rod_nodes)))
        return np.repeat(np.arange(len(self.rod_start)), lengths)

    @cached_property
    def edges(self) -> Ints:
        """(e, 2) nodes of each edge, rod by rod."""
        return self._windows(2)

    @cached_property
    def edge_rods(self) -> Ints:
        """(e,) rod of each edge."""
        return self._rod_of[:-1][self._rod_of[1:] == self._rod_of[:-1]]

    @cached_property
    def edge_lengths(self) -> Floats:
        """(e,) rest lengths [m]."""
        return np.diff(self.stations)[self._rod_of[1:] == self._rod_of[:-1]]

    @cached_property
    def bends(self) -> Ints:
        """(b, 3) nodes of each pair of consecutive edges of a rod."""
        return self._windows(3)

    @cached_property
    def bend_rods(self) -> Ints:
        """(b,) rod of each bend."""
        return self._rod_of[:-2][self._rod_of[2:] == self._rod_of[:-2]]

    @cached_property
    def voronoi_lengths(self) -> Floats:
        """(b,) half the rest length of the two edges of each bend [m] (HQK Eq 1b, of the rest state: ERRATA)."""
        whole = (self.stations[2:] - self.stations[:-2])[self._rod_of[2:] == self._rod_of[:-2]]
        return 0.5 * whole

    @cached_property
    def ends(self) -> Ints:
        """(m, 2) first and last node of each rod."""
        return np.column_stack([self.rod_nodes[self.rod_start], self.rod_nodes[self.rod_stop - 1]])

    @property
    def rod_stop(self) -> Ints:
        return np.append(self.rod_start[1:], len(self.rod_nodes))

    def _windows(self, width: int) -> Ints:
        last = len(self.rod_nodes) - width + 1
        inside = self._rod_of[width - 1 :] == self._rod_of[:last]
        columns = [self.rod_nodes[k : k + last][inside] for k in range(width)]
        return np.column_stack(columns)

    def tributary_lengths(self) -> Floats:
        """(n,) rod length that each node stands for: half of every edge that meets there [m]."""
        total = np.zeros(self.node_count)
        np.add.at(total, self.edges, 0.5 * self.edge_lengths[:, None])
        return total

    def prolong(self, positions: Floats, fine: "GridMesh", *, rods: Sequence[int] | None = None) -> Floats:
        """Positions (n, 3) of the nodes of `fine`, by local cubics along each rod of this mesh [m].

        `rods` names, for each rod of `fine`, the rod of this mesh that it is a part of; default: the same.
        """
        result = np.empty((fine.node_count, 3))
        for k, rod in enumerate(rods if rods is not None else range(len(self.rod_start))):
            here, there = self.rod_slice(rod), fine.rod_slice(k)
            curve = on_curve(self.stations[here], positions[self.rod_nodes[here]], fine.stations[there])
            result[fine.rod_nodes[there]] = curve
        return result


CROWDED = 1e-3  # of the usual edge: a node that near to a rod's end is left out; at 2e-3 all goes well


def mesh_grid(grid: FlatGrid, edge: float, *, marks: Sequence[Sequence[float]] | None = None) -> GridMesh:
    """Divide a flat grid: every span between joints and every tail into the fewest equal edges of at most `edge` [m].

    `marks`, for each rod the material coordinates [m] of further points that must be nodes.
    """
    joints_on = [list[tuple[float, int]]() for _ in grid.rods]
    merged = _merge_joints(grid)
    for node, pair, at in zip(merged.tolist(), grid.crossings.rods.tolist(), grid.crossings.at.tolist(), strict=True):
        for k, s in zip(pair, at, strict=True):
            joints_on[k].append((s, node))
    count = int(merged.max(initial=-1)) + 1
    fixed, starts = list[tuple[float, int]](), list[int]()
    for k, (rod, joints) in enumerate(zip(grid.rods, joints_on, strict=True)):
        tiny = 1e-9 * rod.length
        joints.sort()
        here = [mark for n, mark in enumerate(joints) if n == 0 or mark[1] != joints[n - 1][1]]
        for s in (rod.start, *(marks[k] if marks is not None else ()), rod.end):
            if all(abs(s - other) > tiny for other, _ in here):
                here.append((s, count))
                count += 1
        starts.append(len(fixed))
        fixed += sorted(here)
    s, nodes = np.array([s for s, _ in fixed]), np.array([node for _, node in fixed], dtype=np.intp)
    rod_of = np.repeat(np.arange(len(starts)), np.diff([*starts, len(fixed)]))
    edges = np.ones(len(s), dtype=np.intp)  # from each fixed point to the next of its rod, and one place for the last
    spans = np.flatnonzero(rod_of[1:] == rod_of[:-1])
    edges[spans] = edge_counts(s[spans + 1] - s[spans], edge)
    after = np.repeat(np.arange(len(s)), edges)
    first = np.cumsum(edges) - edges
    step = np.arange(len(after)) - first[after]
    following = np.minimum(after + 1, len(s) - 1)
    stations = s[after] + (s[following] - s[after]) * step / edges[after]
    rod_nodes = np.where(step > 0, count - 1 + np.cumsum(step > 0), nodes[after])
    flat = np.zeros((count + int(np.count_nonzero(step)), 3))
    origin, direction = np.array([rod.origin for rod in grid.rods]), np.array([rod.direction for rod in grid.rods])
    line = rod_of[after]
    flat[rod_nodes, :2] = origin[line] + stations[:, None] * direction[line]
    return GridMesh(grid, flat, rod_nodes, first[starts], stations, merged)


def cut_mesh(mesh: GridMesh, rods: Sequence[FlatRod], *, margin: float) -> tuple[GridMesh, Ints]:
    """The part of a mesh that belongs to `rods`: pieces of its rods, cut at nodes; and its nodes (n,) in `mesh`.

    Joints closer than `margin` [m] to an end of either rod are not made: each rod keeps a node of its own, unless
    it would crowd the end, where it would make an edge far shorter and stiffer than the others.
    """
    joint_of = {
        tuple(pair): int(node) for pair, node in zip(mesh.grid.crossings.rods.tolist(), mesh.joint_nodes, strict=True)
    }
    index = whole_rods(mesh.grid.rods, rods)
    grid = FlatGrid.of(rods, margin=margin)
    known = np.array([(min(index[a], index[b]), max(index[a], index[b])) in joint_of for a, b in grid.crossings.rods])
    grid = FlatGrid(grid.rods, grid.crossings.select(known.astype(bool)))
    joints = [joint_of[min(index[a], index[b]), max(index[a], index[b])] for a, b in grid.crossings.rods]
    shared = {node: k for k, node in enumerate(dict.fromkeys(joints))}
    on_rod = [set[int]() for _ in rods]
    for (a, b), node in zip(grid.crossings.rods, joints, strict=True):
        on_rod[a].add(node)
        on_rod[b].add(node)
    source = list(shared)
    nodes, stations, starts = list[int](), list[float](), list[int]()
    for rod, place, joined in zip(rods, index, on_rod, strict=True):
        starts.append(len(nodes))
        s = mesh.stations[mesh.rod_slice(place)]
        tiny = 1e-9 * rod.length
        inside = np.flatnonzero((s >= rod.start - tiny) & (s <= rod.end + tiny))
        from_end = np.minimum(s[inside] - s[inside[0]], s[inside[-1]] - s[inside])
        crowding = (from_end < CROWDED * float(np.median(np.diff(s)))) & (from_end > 0.0)
        here = mesh.nodes_of(place)[inside].tolist()
        for node, station, near in zip(here, s[inside].tolist(), crowding.tolist(), strict=True):
            if node in joined:
                nodes.append(shared[node])
            elif near:
                continue
            else:
                nodes.append(len(source))
                source.append(node)
            stations.append(station)
    chosen = np.array(source, dtype=np.intp)
    part = GridMesh(
        grid, mesh.flat[chosen], np.array(nodes, dtype=np.intp), np.array(starts, dtype=np.intp),
        np.array(stations), np.array([shared[node] for node in joints], dtype=np.intp),
    )  # fmt: skip
    return part, chosen


def edge_counts(lengths: Floats, edge: float) -> Ints:
    """(n,) fewest equal edges of at most `edge` that make up each of `lengths` (an edge may be 1e-6 too long)."""
    return np.maximum(1, np.ceil(lengths / edge - 1e-6)).astype(np.intp)


def _merge_joints(grid: FlatGrid) -> Ints:
    """Node of each crossing: crossings at one point (three rods or more) share their node.

    They are neighbours along each of their rods, no further apart than round-off takes them.
    """
    rods, at = grid.crossings.rods.ravel(), grid.crossings.at.ravel()
    order = np.lexsort((at, rods))
    tiny = 1e-7 * max((rod.length for rod in grid.rods), default=0.0)
    together = (np.diff(rods[order]) == 0) & (np.diff(at[order]) < tiny)
    joint = order // 2
    node = np.arange(len(grid.crossings))
    for a, b in zip(joint[:-1][together], joint[1:][together], strict=True):
        node[node == node[b]] = node[a]
    return np.unique(node, return_inverse=True)[1].astype(np.intp)
