"""Values at nodes and edges of one mesh carried over to another, along rods that correspond.

Such as a shell's displacements and forces, as the first guess for a grid whose spacing or heading differs a little.
"""

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.curves import on_curve
from rodshell.layout.mesh import GridMesh

SAME_LINE = 0.25  # spacings


def transferred_nodes(values: Floats, mesh: GridMesh, to: GridMesh) -> Floats:
    """(n, d) values at the nodes of the mesh `to`; zero on rods that have no counterpart.

    Where two rods meet, the values transferred along them differ slightly: the mean is taken, without a kink in either.

    Args:
        values: (m, d) at the m nodes of `mesh`, of any unit.
    """
    total, count = np.zeros((to.node_count, values.shape[1])), np.zeros((to.node_count, 1))
    along_rods = list[tuple[Ints, Floats, Floats]]()
    for rod, old in corresponding_rods(mesh, to):
        nodes, shares = to.nodes_of(rod), _shares(to, rod)
        along_rod = _interpolated(shares, _shares(mesh, old), values[mesh.nodes_of(old)])
        along_rods.append((nodes, shares, along_rod))
        total[nodes] += along_rod
        count[nodes] += 1
    result = total / np.maximum(count, 1)
    for nodes, shares, along_rod in along_rods:
        at = np.flatnonzero((count[nodes, 0] > 1) | (np.arange(len(nodes)) % (len(nodes) - 1) == 0))
        result[nodes] = along_rod + _interpolated(shares, shares[at], (result[nodes] - along_rod)[at])
    return result


def transferred_edges(values: Floats, mesh: GridMesh, to: GridMesh) -> Floats:
    """(e,) values at the edges of the mesh `to`; zero on rods that have no counterpart.

    Args:
        values: (f,) at the f edges of `mesh`, of any unit.
    """
    result = np.zeros(len(to.edges))
    for rod, old in corresponding_rods(mesh, to):
        now, before = _middles(_shares(to, rod)), _middles(_shares(mesh, old))
        result[to.edge_rods == rod] = np.interp(now, before, values[mesh.edge_rods == old])
    return result


def corresponding_rods(mesh: GridMesh, to: GridMesh) -> list[tuple[int, int]]:
    """Indices of each rod of `to` that has a counterpart in `mesh`, and of that: the nearest piece of its line.

    Rods correspond by family and by their position in the lattice, points on them by their share of the rod's length.
    """
    if len(mesh.grids) == len(to.grids) > 1:
        pairs, shifts = list[tuple[int, int]](), (0, 0)
        for old, new in zip(mesh.grids, to.grids, strict=True):
            pairs += [(k + shifts[0], j + shifts[1]) for k, j in corresponding_rods(old, new)]
            shifts = shifts[0] + len(new.grid.rods), shifts[1] + len(old.grid.rods)
        return pairs
    before, now = _lattice_coordinates(mesh), _lattice_coordinates(to)
    pairs = []
    for k, rod in enumerate(to.grid.rods):
        apart = np.abs(before - now[k])
        same = [j for j, old in enumerate(mesh.grid.rods) if old.family == rod.family and apart[j, 0] < SAME_LINE]
        if same:
            pairs.append((k, min(same, key=lambda j: apart[j, 1])))
    return pairs


def _lattice_coordinates(mesh: GridMesh) -> Floats:
    """(m, 2) of each rod its line's offset from the anchor, in spacings, and its middle along the line [m]; NaN where
    it is on no line of a lattice."""
    rods = mesh.grid.rods
    offset, of = np.array([rod.offset for rod in rods], dtype=float), np.array([rod.family for rod in rods])
    for family in np.unique(of):
        in_family = of == family
        steps = np.diff(np.unique(offset[in_family]))
        if len(steps):
            offset[in_family] /= np.median(steps)
    return np.column_stack([offset, [0.5 * (rod.start + rod.end) for rod in rods]])


def _shares(mesh: GridMesh, rod: int) -> Floats:
    """(n,) positions of a rod's nodes along it, from 0 to 1."""
    line = mesh.grid.rods[rod]
    return np.asarray((mesh.stations[mesh.rod_slice(rod)] - line.start) / line.length)


def _middles(shares: Floats) -> Floats:
    """(n - 1,) middles of the edges between nodes at `shares` (n,)."""
    return np.asarray(0.5 * (shares[1:] + shares[:-1]))


def _interpolated(now: Floats, before: Floats, values: Floats) -> Floats:
    """(n, d) values at `now` (n,) by local cubics from those (m, d) at `before` (m,): linear interpolation would
    give rods kinks."""
    return on_curve(before, values, np.clip(now, before[0], before[-1]))
