"""Nodes and edges on a flat grid: a node at every joint and rod end, and equal edges between them.

Several meshed grids can be merged into one, side by side.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.curves import on_curve
from rodshell.layout.flatgrid import Crossings, FlatGrid, FlatRod, sides, whole_rods
from rodshell.layout.profile import Profile

CROWDED = 0.01  # of the usual edge: nodes closer to an end are left out: round-off in forces grows as the inverse cube


@dataclass(frozen=True, eq=False, repr=False)
class GridMesh:
    """A flat grid divided into edges; make one with `mesh_grid`.

    Rods share one node at a joint, or are in two layers (`in_layers`). Two meshes are equal only if they are the same
    object.

    Parameters
    ----------
    grid : the rods and joints that were meshed.
    flat : (n, 3) node positions in the flat, unstressed state [m]; z = 0, or the height of the rod's layer.
    rod_nodes : (k,) nodes of all rods, one rod after the other in the order of `grid.rods`.
    rod_start : (m,) where each rod begins in `rod_nodes`.
    stations : (k,) material coordinate of each entry of `rod_nodes` on its rod [m].
    joint_nodes : (c,) node of each of the grid's crossings, on its first rod.
    second_nodes : (c,) the same on its second rod, where rods are in layers and share no nodes; None: the same node.
    """

    grid: FlatGrid
    flat: Floats
    rod_nodes: Ints
    rod_start: Ints
    stations: Floats
    joint_nodes: Ints
    second_nodes: Ints | None = None

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

    @cached_property
    def edges(self) -> Ints:
        """(e, 2) nodes of each edge, rod by rod."""
        return self._windows(2)

    @cached_property
    def edge_rods(self) -> Ints:
        """(e,) rod of each edge."""
        return np.asarray(self.rod_of[:-1][self.rod_of[1:] == self.rod_of[:-1]])

    @cached_property
    def edge_lengths(self) -> Floats:
        """(e,) rest lengths [m]."""
        return np.asarray(np.diff(self.stations)[self.rod_of[1:] == self.rod_of[:-1]])

    @cached_property
    def around_edges(self) -> list[tuple[Ints, Ints, Floats]]:
        """The nearest entries of `rod_nodes` around each edge: four on a rod that has as many.

        For each number k of entries the edges (m,), their entries (m, k), and where the edges' middles are on their
        rods (m,) [m].
        """
        rods = self.edge_rods
        entry = np.arange(len(rods)) + rods  # an edge begins there
        begin, length = self.rod_start[rods], (self.rod_stop - self.rod_start)[rods]
        middles, result = 0.5 * (self.stations[entry] + self.stations[entry + 1]), list[tuple[Ints, Ints, Floats]]()
        for count in range(2, 5):
            edges = np.flatnonzero(np.minimum(length, 4) == count)
            if len(edges):
                first = np.clip(entry[edges] + 1 - count // 2, begin[edges], begin[edges] + length[edges] - count)
                result.append((edges, first[:, None] + np.arange(count), middles[edges]))
        return result

    @cached_property
    def bends(self) -> Ints:
        """(b, 3) nodes of each pair of consecutive edges of a rod."""
        return self._windows(3)

    @cached_property
    def bend_rods(self) -> Ints:
        """(b,) rod of each bend."""
        return np.asarray(self.rod_of[:-2][self.rod_of[2:] == self.rod_of[:-2]])

    @cached_property
    def voronoi_lengths(self) -> Floats:
        """(b,) half the rest length of the two edges of each bend [m] [HQK Eq 1b, of the rest state: see ERRATA]."""
        whole = (self.stations[2:] - self.stations[:-2])[self.rod_of[2:] == self.rod_of[:-2]]
        return np.asarray(0.5 * whole)

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

        Raises
        ------
        ValueError : some rod crosses no other.
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

        Parameters
        ----------
        eccentricity : distance of the layers [m].

        Raises
        ------
        InputError : the rods need more than two layers.
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

    def _windows(self, width: int) -> Ints:
        last = len(self.rod_nodes) - width + 1
        inside = self.rod_of[width - 1 :] == self.rod_of[:last]
        columns = [self.rod_nodes[k : k + last][inside] for k in range(width)]
        return np.column_stack(columns)

    def with_profiles(self, profiles: Profile | Sequence[Profile | None] | None) -> "GridMesh":
        """The same mesh of rods whose sections change along them; arguments as of `FlatGrid.with_profiles`."""
        return replace(self, grid=self.grid.with_profiles(profiles))

    def tributary_lengths(self) -> Floats:
        """Rod length (n,) that each node represents: half of every edge at the node [m]."""
        total = np.zeros(self.node_count)
        np.add.at(total, self.edges, 0.5 * self.edge_lengths[:, None])
        return total

    def prolong(self, positions: Floats, fine: "GridMesh", *, rods: Sequence[int] | None = None) -> Floats:
        """Interpolate positions on another mesh of the same rods, by local cubics along each rod.

        Parameters
        ----------
        positions : (n, 3) of the nodes of this mesh [m].
        fine : the other mesh.
        rods : for each rod of `fine` the rod of this mesh that it is a part of; default: the same.

        Returns
        -------
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

    Parameters
    ----------
    grid : rods and joints.
    edge : longest edge [m].
    marks : for each rod the material coordinates of further points that must be nodes [m].
    """
    merged = _merge_joints(grid)
    rod_of, s, nodes, count = _fixed_points(grid, merged, marks)
    edges = np.ones(len(s), dtype=np.intp)  # from each fixed point to the next of its rod; 1 for the last
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
    starts = np.searchsorted(rod_of, np.arange(len(grid.rods)))
    return GridMesh(grid, flat, rod_nodes, first[starts], stations, merged)


def _fixed_points(
    grid: FlatGrid, merged: Ints, marks: Sequence[Sequence[float]] | None
) -> tuple[Ints, Floats, Ints, int]:
    """The points that must be nodes, along one rod after the other: rod, material coordinate [m] and node; and the
    number of nodes.

    The joints have the nodes `merged`. Ends and marks get a new node each, unless there is one already.
    """
    given = [[rod.start, *(marks[k] if marks is not None else ()), rod.end] for k, rod in enumerate(grid.rods)]
    rod_of_given = np.repeat(np.arange(len(given)), [len(stations) for stations in given])
    added = np.array([s for stations in given for s in stations])
    # each joint once on each of its rods: three rods make three crossings
    rod, s, nodes = grid.crossings.rods.ravel(), grid.crossings.at.ravel(), np.repeat(merged, 2)
    order = np.lexsort((s, nodes, rod))
    once = order[np.diff(rod[order] * len(rod) + nodes[order], prepend=-1) > 0]
    rod, s = np.concatenate([rod[once], rod_of_given]), np.concatenate([s[once], added])
    nodes = np.concatenate([nodes[once], np.full(len(added), -1)])
    rank = np.concatenate([np.zeros(len(once), dtype=np.intp), 1 + np.arange(len(added))])  # the lowest is kept
    order = np.lexsort((rank, s, rod))
    rod, s, nodes, rank = rod[order], s[order], nodes[order], rank[order]
    tiny = 1e-9 * (grid.ends[:, 1] - grid.ends[:, 0])
    near = (rod[1:] == rod[:-1]) & (s[1:] - s[:-1] <= tiny[rod[1:]])
    group = np.cumsum(np.append(0, ~near))  # points of a rod at one place: the first is kept, and every joint
    first = np.full(group[-1] + 1, len(rank))
    np.minimum.at(first, group, rank)
    out = rank > first[group]
    joints, fresh = int(merged.max(initial=-1)) + 1, np.flatnonzero(~out & (nodes < 0))
    nodes[fresh[np.argsort(rank[fresh])]] = joints + np.arange(len(fresh))
    return rod[~out], s[~out], nodes[~out], joints + len(fresh)


def cut_mesh(mesh: GridMesh, grid: FlatGrid) -> tuple[GridMesh, Ints]:
    """Cut a part out of a mesh.

    Where a joint of the mesh is not in the part, because it is too close to an end, each rod keeps its own node, unless
    that would be so close to the end that it makes an edge far shorter and stiffer than the other edges.

    Parameters
    ----------
    mesh : to be cut.
    grid : pieces of its rods, cut at nodes, and their joints.

    Returns
    -------
    The part, and its nodes (n,) in `mesh`.
    """
    rods, count = grid.rods, len(mesh.grid.rods)
    index = whole_rods(mesh.grid.rods, rods)
    pairs = np.sort(index[grid.crossings.rods], axis=1) @ [count, 1]
    known = np.append(mesh.grid.crossings.rods @ [count, 1], -1)  # the last is not a pair: there may be none
    order = np.argsort(known, kind="stable")
    found = order[np.minimum(np.searchsorted(known, pairs, sorter=order), len(known) - 1)]
    kept = known[found] == pairs
    grid = FlatGrid(grid.rods, grid.crossings.select(kept))
    _, first, joint = np.unique(mesh.joint_nodes[found[kept]], return_index=True, return_inverse=True)
    rank = np.argsort(np.argsort(first))  # joints keep the order of the crossings
    joint = rank[joint]
    shared = mesh.joint_nodes[found[kept]][np.sort(first)]
    piece, entry = entries_along(mesh, rods, index)
    s, node = mesh.stations[entry], mesh.rod_nodes[entry]
    node_of = np.full(len(mesh.flat), -1)
    node_of[shared] = np.arange(len(shared))
    joints = np.append(np.sort((grid.crossings.rods * mesh.node_count + shared[joint][:, None]).ravel()), -1)
    key = piece * mesh.node_count + node
    joined = joints[np.searchsorted(joints[:-1], key)] == key
    starts = np.searchsorted(piece, np.arange(len(rods) + 1))
    from_end = np.minimum(s - s[starts[piece]], s[starts[piece + 1] - 1] - s)
    crowded = ~joined & (from_end > 0.0) & (from_end < CROWDED * mesh.edge_lengths.max())
    if crowded.any():
        crowded &= from_end < CROWDED * _usual_edges(mesh)[index][piece]
    single = ~joined & ~crowded
    nodes = np.where(joined, node_of[node], len(shared) - 1 + np.cumsum(single))
    made = joined | single
    chosen = np.concatenate([shared, node[single]])
    starts = np.searchsorted(piece[made], np.arange(len(rods)))
    return GridMesh(grid, mesh.flat[chosen], nodes[made], starts, s[made], joint), chosen


def entries_along(mesh: GridMesh, rods: Sequence[FlatRod], whole: Ints) -> tuple[Ints, Ints]:
    """Find all nodes on pieces of rods.

    Parameters
    ----------
    mesh : of the whole rods.
    rods : pieces.
    whole : (m,) the rod of the mesh that each piece belongs to.

    Returns
    -------
    Piece (k,), and entry (k,) of the mesh's `rod_nodes` and `stations`, of each.
    """
    begin, length = mesh.rod_start[whole], (mesh.rod_stop - mesh.rod_start)[whole]
    piece = np.repeat(np.arange(len(rods)), length)
    entry = np.arange(len(piece)) + np.repeat(begin - (np.cumsum(length) - length), length)
    start, end = np.array([(rod.start, rod.end) for rod in rods]).T
    tiny, s = 1e-9 * (end - start), mesh.stations[entry]
    on = (s >= (start - tiny)[piece]) & (s <= (end + tiny)[piece])
    return piece[on], entry[on]


def _usual_edges(mesh: GridMesh) -> Floats:
    """(m,) median length of the edges of each rod [m]."""
    order = np.lexsort((mesh.edge_lengths, mesh.edge_rods))
    count = np.bincount(mesh.edge_rods, minlength=len(mesh.grid.rods))
    low, high = (np.cumsum(count) - count + half for half in ((count - 1) // 2, count // 2))
    return np.asarray(0.5 * (mesh.edge_lengths[order[low]] + mesh.edge_lengths[order[high]]))


def edge_counts(lengths: Floats, edge: float) -> Ints:
    """Number of equal edges into which lengths are divided.

    Parameters
    ----------
    lengths : (n,) [m].
    edge : longest edge, which may be exceeded by 1e-6 of it [m].

    Returns
    -------
    (n,) the smallest possible numbers.
    """
    return np.maximum(1, np.ceil(lengths / edge - 1e-6)).astype(np.intp)


def _merge_joints(grid: FlatGrid) -> Ints:
    """Node of each crossing: crossings at one point (of three rods or more) share their node.

    They are neighbours along each of their rods, with no more than round-off between them.
    """
    rods, at = grid.crossings.rods.ravel(), grid.crossings.at.ravel()
    order = np.lexsort((at, rods))
    tiny = 1e-7 * (grid.ends[:, 1] - grid.ends[:, 0]).max(initial=0.0)
    together = (np.diff(rods[order]) == 0) & (np.diff(at[order]) < tiny)
    joint = order // 2
    node = np.arange(len(grid.crossings))
    if not together.any():
        return node
    for a, b in zip(joint[:-1][together], joint[1:][together], strict=True):
        node[node == node[b]] = node[a]
    return np.unique(node, return_inverse=True)[1].astype(np.intp)


@dataclass(frozen=True, eq=False)
class SideBySide:
    """Grids in a row along x, each moved but not rotated.

    Parameters
    ----------
    mesh : all grids: rods, nodes and joints, one grid after the other; rod U01 of grid A is A-U01.
    shifts : for each grid the displacement (2,) [m].
    """

    mesh: GridMesh
    shifts: dict[str, Floats]


def side_by_side(meshes: Mapping[str, GridMesh], gap: float) -> SideBySide:
    """Lay grids out in a row, each centred on the x axis, and the row on the origin.

    Parameters
    ----------
    meshes : the grids by name.
    gap : between two grids [m].
    """
    low = {name: mesh.flat[:, :2].min(axis=0) for name, mesh in meshes.items()}
    high = {name: mesh.flat[:, :2].max(axis=0) for name, mesh in meshes.items()}
    width = sum(float(high[name][0] - low[name][0]) + gap for name in meshes) - gap
    left, shifts = -0.5 * width, dict[str, Floats]()
    for name in meshes:
        shifts[name] = np.array([left - low[name][0], -0.5 * (low[name][1] + high[name][1])])
        left += float(high[name][0] - low[name][0]) + gap
    moved = [_moved(name, mesh, shifts[name]) for name, mesh in meshes.items()]
    return SideBySide(_merged(moved), shifts)


def _moved(name: str, mesh: GridMesh, shift: Floats) -> GridMesh:
    """A mesh displaced in the plane, with `name` before the names of its rods."""
    along = np.array([_along(rod, shift) for rod in mesh.grid.rods])
    rods = tuple(_moved_rod(name, rod, shift) for rod in mesh.grid.rods)
    crossings = Crossings(mesh.grid.crossings.rods, mesh.grid.crossings.at + along[mesh.grid.crossings.rods])
    lengths = np.diff(np.append(mesh.rod_start, len(mesh.rod_nodes)))
    return replace(
        mesh,
        grid=FlatGrid(rods, crossings),
        flat=mesh.flat + np.append(shift, 0.0),
        stations=mesh.stations + np.repeat(along, lengths),
    )


def _along(rod: FlatRod, shift: Floats) -> float:
    """Change of a rod's material coordinates: those of families u and v are measured from the middle of the layout."""
    return 0.0 if rod.family == "free" else float(shift @ np.array(rod.direction))


def _moved_rod(name: str, rod: FlatRod, shift: Floats) -> FlatRod:
    label, by = f"{name}-{rod.name}", _along(rod, shift)
    if rod.family == "free":
        x, y = np.array(rod.origin) + shift
        return replace(rod, name=label, origin=(float(x), float(y)))
    make, across = (FlatRod.u, shift[1]) if rod.family == "u" else (FlatRod.v, shift[0])
    moved = make(label, rod.offset + float(across), rod.start + by, rod.end + by)
    return replace(moved, profile=rod.profile)


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
    )
