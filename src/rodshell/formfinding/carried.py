"""What a form found before tells of the next one: fields carried from its rods to the rods of another mesh.

Rods correspond by family and by their place in the lattice, points on them by the share of the rod's length. What is
carried is only a guess, from which a solve starts.
"""

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.curves import on_curve
from rodshell.layout import GridMesh

SAME_LINE = 0.25  # spacings


def carried_nodes(values: Floats, mesh: GridMesh, to: GridMesh) -> Floats:
    """(n, d) values at the nodes of the mesh `to`, from those (m, d) at the nodes of `mesh`; zero on new rods.

    Where two rods meet, what comes along them differs a little: they take the mean, without a kink of either.
    """
    total, count = np.zeros((to.node_count, values.shape[1])), np.zeros((to.node_count, 1))
    own = list[tuple[Ints, Floats, Floats]]()
    for rod, old in corresponding(mesh, to):
        nodes, shares = to.nodes_of(rod), _shares(to, rod)
        own.append((nodes, shares, _along(shares, _shares(mesh, old), values[mesh.nodes_of(old)])))
        total[nodes] += own[-1][2]
        count[nodes] += 1
    result = total / np.maximum(count, 1)
    for nodes, shares, alone in own:
        at = np.flatnonzero((count[nodes, 0] > 1) | (np.arange(len(nodes)) % (len(nodes) - 1) == 0))
        result[nodes] = alone + _along(shares, shares[at], (result[nodes] - alone)[at])
    return result


def carried_edges(values: Floats, mesh: GridMesh, to: GridMesh) -> Floats:
    """(e,) values at the edges of `to`, from those at the edges of `mesh`; zero on new rods."""
    result = np.zeros(len(to.edges))
    for rod, old in corresponding(mesh, to):
        now, before = _middles(_shares(to, rod)), _middles(_shares(mesh, old))
        result[to.edge_rods == rod] = np.interp(now, before, values[mesh.edge_rods == old])
    return result


def corresponding(mesh: GridMesh, to: GridMesh) -> list[tuple[int, int]]:
    """Each rod of `to` that has a counterpart in `mesh`, with that: of its line, the piece that lies nearest."""
    before, now = _places(mesh), _places(to)
    pairs = list[tuple[int, int]]()
    for k, rod in enumerate(to.grid.rods):
        apart = np.abs(before - now[k])
        same = [j for j, old in enumerate(mesh.grid.rods) if old.family == rod.family and apart[j, 0] < SAME_LINE]
        if same and rod.family != "free":
            pairs.append((k, min(same, key=lambda j: apart[j, 1])))
    return pairs


def _places(mesh: GridMesh) -> Floats:
    """(m, 2) where each rod's line lies in the lattice, in spacings from the anchor, and its middle along it [m]."""
    rods = mesh.grid.rods
    offset = np.array([rod.offset for rod in rods])
    for family in ("u", "v"):
        mine = np.array([rod.family == family for rod in rods])
        steps = np.diff(np.unique(offset[mine]))
        if len(steps):
            offset[mine] /= np.median(steps)
    return np.column_stack([offset, [0.5 * (rod.start + rod.end) for rod in rods]])


def _shares(mesh: GridMesh, rod: int) -> Floats:
    """Where the nodes of a rod lie along it, from 0 to 1."""
    line = mesh.grid.rods[rod]
    return np.asarray((mesh.stations[mesh.rod_slice(rod)] - line.start) / line.length)


def _middles(shares: Floats) -> Floats:
    return np.asarray(0.5 * (shares[1:] + shares[:-1]))


def _along(now: Floats, before: Floats, values: Floats) -> Floats:
    """By local cubics: between the nodes of straight pieces a rod would have kinks."""
    return on_curve(before, values, np.clip(now, before[0], before[-1]))
