"""Symmetries of a flat grid that its draped shape shares, and designs that keep them.

An operation is one of the eight of the square, about the middle of the flat grid. It counts where it maps the nodes of
the flat grid onto nodes, and the draped shape onto itself by a rotation or a reflection in space. Variables that
operations map onto each other get one common value; where a chain of them maps a variable onto its own negative it is
zero.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.sparse import coo_array, csc_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from rodshell.arrays import Bools, Floats, Ints
from rodshell.layout import GridMesh

_SAME_FLAT, SAME_SHAPE = 1e-6, 1e-4  # of the size: rods are cut to 1e-6, and drapes converge to 1e-5


@dataclass(frozen=True, eq=False)
class Operation:
    """A symmetry of a mesh.

    Args:
        nodes: (n,) the node that each node is mapped to.
        rods: (m,) the rod that each rod is mapped to.
        reversed: (m,) whether it is mapped end to start.
        turn: (2, 2) rotation or reflection of the plane.
    """

    nodes: Ints
    rods: Ints
    reversed: Bools
    turn: Floats

    @property
    def handed(self) -> float:
        """1 for a rotation, -1 for a reflection."""
        return float(np.sign(np.linalg.det(self.turn)))

    @property
    def ends(self) -> Ints:
        """(2m,) the rod end that the start and the end of each rod in turn are mapped to."""
        flipped = self.reversed.astype(np.intp)
        return np.column_stack([2 * self.rods + flipped, 2 * self.rods + 1 - flipped]).ravel()


@dataclass(frozen=True, eq=False)
class Image:
    """Where an operation maps variables.

    Args:
        index: (n,) the variable that each is mapped to.
        sign: (n,) 1, or -1 where it is mapped to the negative.
    """

    index: Ints
    sign: Floats


def symmetries(mesh: GridMesh, shape: Floats) -> tuple[Operation, ...]:
    """The symmetries of a flat grid that a shape shares; the identity is left out.

    Args:
        shape: (n, 3) its popped-up nodes [m]; (n, 6) if the draped ones must have the symmetries, too.
    """
    centre = 0.5 * (mesh.flat.min(axis=0) + mesh.flat.max(axis=0)) * [1.0, 1.0, 0.0]
    flat, found = mesh.flat - centre, list[Operation]()
    size = float(np.abs(flat).max())
    quarter, mirror = np.array([[0.0, -1.0], [1.0, 0.0]]), np.diag([1.0, -1.0])
    for turns in range(4):
        for turn in (np.linalg.matrix_power(quarter, turns) @ part for part in (np.eye(2), mirror)):
            there = flat.copy()
            there[:, :2] = flat[:, :2] @ turn.T
            rods = _rods_there(mesh, there, flat, _SAME_FLAT * size)
            if rods is None or np.array_equal(turn, np.eye(2)):
                continue
            nodes = _nodes_there(mesh, *rods)
            if nodes is None or np.abs(there - flat[nodes]).max() > _SAME_FLAT * size:
                continue
            if all(
                _congruent(part, part[nodes]) < SAME_SHAPE * size for part in np.split(shape, shape.shape[1] // 3, 1)
            ):
                found.append(Operation(nodes, *rods, turn))
    return tuple(found)


def _rods_there(mesh: GridMesh, there: Floats, flat: Floats, near: float) -> tuple[Ints, Bools] | None:
    """The rod that lies where each rod is moved, and whether it runs the other way; None if one has no such rod."""
    goals, moved = flat[mesh.ends].reshape(-1, 6), there[mesh.ends]
    tree = cKDTree(goals)
    same, rods = tree.query(moved.reshape(-1, 6))
    other, reversed_rods = tree.query(moved[:, ::-1].reshape(-1, 6))
    if np.minimum(same, other).max() > near:
        return None
    backwards = np.asarray(other < same)
    return np.asarray(np.where(backwards, reversed_rods, rods)), backwards


def _nodes_there(mesh: GridMesh, rods: Ints, backwards: Bools) -> Ints | None:
    """The node that each node is mapped to, with its rods; None if they do not match."""
    nodes = np.full(mesh.node_count, -1)
    for k, (rod, backward) in enumerate(zip(rods, backwards, strict=True)):
        here, there = mesh.nodes_of(k), mesh.nodes_of(rod)
        there = there[::-1] if backward else there
        known = nodes[here] >= 0
        if len(here) != len(there) or (nodes[here][known] != there[known]).any():
            return None
        nodes[here] = there
    return nodes


def ties(count: int, images: Sequence[Image]) -> csc_array:
    """(n, q) how each of n variables follows from q common values: see `variables.Tied`.

    Args:
        images: where each symmetry maps them.
    """
    every = np.arange(count)
    rows, columns = [every], [every]
    for image in images:
        opposite = image.sign < 0
        for side in (False, True):
            rows.append(every + count * side)
            columns.append(image.index + count * (opposite ^ side))
    links = np.concatenate(rows), np.concatenate(columns)
    graph = coo_array((np.ones(len(links[0])), links), shape=(2 * count, 2 * count))
    label = connected_components(graph, directed=False)[1]
    plus, minus = label[:count], label[count:]
    free = plus != minus
    pair = np.minimum(plus, minus)
    _, first, column = np.unique(pair[free], return_index=True, return_inverse=True)
    sign = np.where(plus[free] == plus[free][first][column], 1.0, -1.0)
    return csc_array((sign, (np.flatnonzero(free), column)), shape=(count, len(first)))


def _congruent(shape: Floats, image: Floats) -> float:
    """Largest distance that is left when a shape is moved onto another by the best rotation or reflection [m]
    [Schönemann 1966]."""
    a, b = shape - shape.mean(axis=0), image - image.mean(axis=0)
    u, _, v = np.linalg.svd(a.T @ b)
    return float(np.linalg.norm(a @ (u @ v) - b, axis=1).max())
