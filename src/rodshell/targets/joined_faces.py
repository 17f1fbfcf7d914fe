"""NURBS faces that share whole edges, as one mesh of triangles."""

from itertools import combinations

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.curves import arc_lengths
from rodshell.geometry.frames import dot, unit
from rodshell.targets.nurbs import GRID, Nurbs, grid_triangles

FEWEST = 16  # quads each way of a face, at least
FINER = 16  # points of an edge for each quad, by which its length is found
SAME = 1e-4  # of the extent: edges that are closer are the same
CLOSE = 1e-3  # of the extent: parts of edges that are closer meet there
PART = 0.1  # of an edge: as much of it may be close to others, as at a corner


def joined(faces: list[Nurbs], name: str) -> tuple[Floats, Ints, float]:
    """Vertices (k, 3) and triangles (m, 3) of faces that are joined along their shared edges; and the largest angle at
    which two of them meet [rad].

    All have equally many quads each way, whose corners lie at equal distances along the edges and so meet. Where faces
    meet at an angle, the mesh is creased.

    Raises:
        InputError: a face shares a part of an edge only.
    """
    count = max(int(np.ceil(GRID * np.sqrt(2 / len(faces)))), FEWEST, *(n for face in faces for n in face.quads))
    grids = np.array([_evenly(face, count) for face in faces])
    number = np.arange(len(faces) * (count + 1) ** 2).reshape(len(faces), count + 1, count + 1)
    rows = [row for k in number for row in (k[0], k[-1], k[:, 0], k[:, -1])]
    points, bend = grids.reshape(-1, 3), 0.0
    inwards = [inward for grid in grids for inward in _inwards(grid)]
    extent, sides = float(np.ptp(points, axis=0).max()), points[np.array(rows)]
    long = np.ptp(sides, axis=1).max(axis=1) > CLOSE * extent  # unlike the pole of a sphere
    equal, free = [np.column_stack([rows[0], rows[0]])], set(np.flatnonzero(long).tolist())
    for i, j in combinations(range(len(rows)), 2):
        for step in (1, -1):
            if np.linalg.norm(sides[i] - sides[j][::step], axis=1).max() < SAME * extent:
                equal.append(np.column_stack([rows[i], rows[j][::step]]))
                free -= {i, j}
                cosine = -dot(inwards[i], inwards[j][::step])
                bend = max(bend, float(np.arccos(np.clip(cosine, -1.0, 1.0)).max()) if long[i] else 0.0)
    _require_whole_edges(sides, free, extent, name)
    a, b = np.vstack(equal).T
    _, kind = connected_components(coo_matrix((np.ones(len(a)), (a, b)), (number.size,) * 2), directed=False)
    _, first = np.unique(kind, return_index=True)
    corners = grid_triangles(count + 1, count + 1)
    return points[first], kind[np.vstack([k.ravel()[corners] for k in number])].astype(np.intp), bend


def _evenly(face: Nurbs, count: int) -> Floats:
    """Points (n, n, 3) of a face that are at equal distances along its edges, whatever its parameters."""
    u, v = face.lattice((FINER * count, FINER * count))
    share = np.linspace(0.0, 1.0, count + 1)
    across, along = face.at(u[[0, -1], None], v), face.at(u, v[[0, -1], None])
    v0, v1, u0, u1 = (_even(t, x, share) for t, x in ((v, across[0]), (v, across[1]), (u, along[0]), (u, along[1])))
    at_u = u0[:, None] + (u1 - u0)[:, None] * share
    at_v = v0 + (v1 - v0) * share[:, None]
    return face.at(at_u, at_v)


def _inwards(grid: Floats) -> list[Floats]:
    """Unit vectors (n - 2, 3) at the inner points of each of the four edges, along the face and across the edge."""
    found = []
    for x in (grid, grid[::-1], grid.transpose(1, 0, 2), grid[:, ::-1].transpose(1, 0, 2)):
        along = x[0, 2:] - x[0, :-2]  # no length at a pole
        into = (4 * x[1] - 3 * x[0] - x[2])[1:-1]
        square = np.maximum(dot(along, along), 1e-300)[:, None]
        found.append(unit(into - dot(into, along)[:, None] / square * along))
    return found


def _even(t: Floats, x: Floats, share: Floats) -> Floats:
    """The parameters at these shares of the length of a curve through `x` (n, 3), of parameters `t` (n,)."""
    s = arc_lengths(x)
    return np.asarray(np.interp(share * s[-1], s, t) if s[-1] > 0 else t[0] + share * (t[-1] - t[0]))


def _require_whole_edges(sides: Floats, free: set[int], extent: float, name: str) -> None:
    """Refuse faces that meet along a part of an edge, where the mesh would have a crack. `sides` (4 m, n, 3) are the
    points of the edges of m faces; those that are `free` have a length and are not the edge of another face."""
    share = np.linspace(0.0, 1.0, FINER + 1)[:, None, None]
    dense = {i: (sides[i][:-1] + share * np.diff(sides[i], axis=0)).reshape(-1, 3) for i in free}
    for i in free:
        others = [dense[j] for j in free if j // 4 != i // 4]
        if others and np.mean(cKDTree(np.vstack(others)).query(sides[i])[0] < CLOSE * extent) > PART:
            raise InputError(
                f"{name}: face {i // 4 + 1} of {len(sides) // 4} shares a part of an edge: split its neighbour there, "
                "or export a mesh"
            )
