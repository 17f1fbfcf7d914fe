"""Families of variables that change lengths along rods: cut lengths, positions of joints, offsets of straight rods.

Each moves points of rods, joints and ends, along them. Nodes between two such points keep their share of the span.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.sparse import csc_array, csr_array

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.layout import FlatGrid, GridMesh
from rodshell.layout.flatgrid import Crossings
from rodshell.refining.change import Change
from rodshell.refining.structure import Structure
from rodshell.refining.symmetry import Image, Operation
from rodshell.refining.variables import Box, Grid, Variables

MOST = 0.35  # of the usual span: how far a point may move along its rod
SQUARE = 1e-6  # largest cosine of what counts as a right angle
FIRST = 0.05  # of the usual span: the change that counts as one


@dataclass(frozen=True, eq=False)
class Stations(Variables):
    """Variables that move points along rods.

    Args:
        shifts: (k, n) displacement of every rod node along its rod by each variable [-].
        box: (n,) [m].
        across: (m, n) growth of the rods' offsets by each variable [-]; None: they stay.
    """

    structure: Structure
    shifts: csr_array
    box: Box
    image: Callable[[Operation], Image]
    across: csr_array | None = None

    def change(self, values: Floats) -> Change:
        mesh = self.structure.mesh
        slopes = csc_array(self.shifts[mesh.edge_entries + 1] - self.shifts[mesh.edge_entries])
        return replace(self.no_change(), lengths=slopes @ values, length_slopes=slopes)

    def applied(self, grid: Grid, values: Floats) -> Grid:
        rods = len(grid.mesh.grid.rods)
        across = np.zeros(rods) if self.across is None else self.across @ values
        return replace(grid, mesh=_restationed(grid.mesh, self.shifts @ values, across))


@dataclass(frozen=True)
class Tails:
    """Cut lengths: how far rods run past their last joints."""

    name = "tails"

    def on(self, structure: Structure) -> Stations:
        """The change of the tail at the start and the end of each rod."""
        mesh = structure.mesh
        points, ends = _moved_points(mesh), mesh.end_entries
        inner = points[np.searchsorted(points, ends) + np.tile([1, -1], len(mesh.rod_start))]
        tails = np.abs(mesh.stations[ends] - mesh.stations[inner])
        span, outward = usual_span(mesh), np.tile([-1.0, 1.0], len(mesh.rod_start))
        moved = csr_array((outward, (ends, np.arange(len(ends)))), shape=(len(mesh.stations), len(ends)))
        box = Box(0 * tails, -np.minimum(MOST * span, 0.5 * tails), 0 * tails + MOST * span, 0 * tails + FIRST * span)
        return Stations(structure, between(mesh) @ moved, box, lambda by: Image(by.ends, np.ones(len(ends))))


@dataclass(frozen=True)
class Offsets:
    """Offsets of the rods' lines, which stay straight and parallel: the joints on the rods that they cross follow."""

    name = "offsets"

    def on(self, structure: Structure) -> Stations:
        """The growth of each rod's offset.

        Raises:
            InputError: rods do not all cross at right angles.
        """
        mesh, rods = structure.mesh, structure.mesh.grid.rods
        across, along = np.array([rod.across for rod in rods]), np.array([rod.direction for rod in rods])
        count, pairs = len(rods), mesh.grid.crossings.rods
        if np.abs(np.einsum("ci,ci->c", *along[pairs].transpose(1, 0, 2))).max(initial=0.0) > SQUARE:
            raise InputError("offsets can only vary in a grid whose rods cross at right angles: vary something else")
        rows, columns = mesh.at_crossings[:, ::-1].ravel(), pairs.ravel()  # a rod moves joints on those that it crosses
        moves = np.einsum("ci,ci->c", across[columns], along[pairs[:, ::-1].ravel()])
        moved = csr_array((moves, (rows, columns)), shape=(len(mesh.stations), count))
        moved.data = np.clip(moved.data, -1.0, 1.0)
        box = Box.about_zero(count, MOST * usual_span(mesh), FIRST * usual_span(mesh))

        def image(by: Operation) -> Image:
            return Image(by.rods, np.round(np.einsum("mi,mi->m", across @ by.turn.T, across[by.rods])))

        return Stations(structure, between(mesh) @ moved, box, image, csr_array(np.eye(count)))


@dataclass(frozen=True)
class Holes:
    """Positions of the joints along each of their two rods, chosen separately."""

    name = "holes"

    def on(self, structure: Structure) -> Stations:
        """The displacement of each joint along its first and along its second rod."""
        mesh = structure.mesh
        holes = np.unique(mesh.at_crossings)
        rod = mesh.rod_of
        columns = np.arange(len(holes))
        moved = csr_array((np.ones(len(holes)), (holes, columns)), shape=(len(mesh.stations), len(holes)))
        box = Box.about_zero(len(holes), MOST * usual_span(mesh), FIRST * usual_span(mesh))
        key = rod[holes] * mesh.node_count + mesh.rod_nodes[holes]
        order = np.argsort(key)

        def image(by: Operation) -> Image:
            wanted = by.rods[rod[holes]] * mesh.node_count + by.nodes[mesh.rod_nodes[holes]]
            index = order[np.searchsorted(key[order], wanted)]
            return Image(index, np.where(by.reversed[rod[holes]], -1.0, 1.0))

        return Stations(structure, between(mesh) @ moved, box, image)


def usual_span(mesh: GridMesh) -> float:
    """Median distance of neighbouring joints along rods [m]."""
    entries = np.unique(mesh.at_crossings)
    same = np.diff(mesh.rod_of[entries]) == 0
    return float(np.median(np.diff(mesh.stations[entries])[same]))


def _moved_points(mesh: GridMesh) -> Ints:
    """Entries of `rod_nodes` that variables move, ascending: joints and ends of rods."""
    return np.unique(np.append(mesh.at_crossings, mesh.end_entries))


def between(mesh: GridMesh) -> csr_array:
    """(k, k) displacements of all rod nodes by those of `_moved_points`, linear between these."""
    every, s, points = np.arange(len(mesh.rod_nodes)), mesh.stations, _moved_points(mesh)
    after = np.searchsorted(points, every)
    low, high = points[np.where(points[after] == every, after, after - 1)], points[after]
    span = s[high] - s[low]
    share = np.where(span > 0, (s - s[low]) / np.where(span > 0, span, 1.0), 0.0)
    rows, columns = np.append(every, every), np.append(low, high)
    return csr_array((np.append(1.0 - share, share), (rows, columns)), shape=(len(every), len(every)))


def _restationed(mesh: GridMesh, along: Floats, across: Floats) -> GridMesh:
    """A mesh whose nodes are moved along their rods, and whose rods are moved across themselves.

    Args:
        along: (k,) displacement of every rod node along its rod [m].
        across: (m,) growth of the rods' offsets [m].
    """
    stations = mesh.stations + along
    ends = stations[mesh.end_entries].reshape(-1, 2)
    rods = tuple(
        rod.cut(float(start), float(end), float(by))
        for rod, (start, end), by in zip(mesh.grid.rods, ends, across, strict=True)
    )
    crossings = Crossings(mesh.grid.crossings.rods, stations[mesh.at_crossings])
    flat, visits, rod_of = np.zeros((mesh.node_count, 2)), np.zeros(mesh.node_count), mesh.rod_of
    origins = np.array([rod.origin for rod in rods])[rod_of]
    directions = np.array([rod.direction for rod in rods])[rod_of]
    np.add.at(flat, mesh.rod_nodes, origins + stations[:, None] * directions)
    np.add.at(visits, mesh.rod_nodes, 1.0)
    placed = np.column_stack([flat / visits[:, None], mesh.heights])
    return replace(mesh, grid=FlatGrid(rods, crossings), flat=placed, stations=stations)
