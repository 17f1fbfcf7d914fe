"""Triangles of a target, to be looked at: a mesh over its plan, cut where the surface ends."""

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.targets.nurbs import grid_triangles
from rodshell.targets.target import Target
from rodshell.targets.trianglemesh import turned

CELLS = 56  # along the longer side of the plan
BEYOND = 0.08  # of the plan's width: how far outside the points the surface is shown
HALVINGS = 14  # of a mesh edge that crosses the end


def surface_mesh(target: Target, around: Floats) -> tuple[Floats, Ints]:
    """Points (n, 3) [m] and triangles (t, 3) of the uppermost part of a target, over the plan of some points.

    It is made for pictures: the surface is sampled on a square mesh, whose triangles are cut at the end of the shell.
    What lies under an overhang is left out.

    Args:
        around: (k, 3) points of a shell on the target [m].
    """
    low, high = around[:, :2].min(axis=0), around[:, :2].max(axis=0)
    step = float((high - low).max()) * (1 + 2 * BEYOND) / CELLS
    counts = np.ceil((high - low) * (1 + 2 * BEYOND) / step).astype(int)
    corner = 0.5 * (low + high - counts * step)
    x, y = (corner[k] + step * np.arange(counts[k] + 1) for k in range(2))
    plan = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    points, inside = _lifted(target, plan)
    faces = grid_triangles(len(x), len(y))
    count = inside[faces].sum(axis=1)
    cut, crossings = _cut(faces[(count == 1) | (count == 2)], inside, len(points))
    if len(crossings):
        points = np.concatenate([points, _at_the_end(target, plan, crossings)])
    faces = np.concatenate([faces[count == 3], cut])
    used = np.unique(faces)
    return points[used], np.searchsorted(used, faces)


def _lifted(target: Target, plan: Floats) -> tuple[Floats, np.ndarray]:
    """The points of the surface over points (n, 2), and whether each lies inside the shell's end."""
    z = target.height_at(plan)
    points, inside = np.column_stack([plan, z]), np.isfinite(z)
    inside[inside] = target.margin(points[inside]) > 0
    return points, inside


def _cut(faces: Ints, inside: np.ndarray, first: int) -> tuple[Ints, Ints]:
    """The parts of triangles that lie inside; and the mesh edges (m, 2), from inside to outside, that are cut.

    The crossing of edge k becomes the node `first` + k.
    """
    # turned so that the corner that is alone on its side comes first
    alone = np.where(inside[faces].sum(axis=1) == 1, inside[faces].argmax(axis=1), inside[faces].argmin(axis=1))
    faces = turned(faces, alone)
    within, (tip, p, q) = inside[faces[:, 0]], faces.T
    pairs = np.concatenate([faces[:, [0, 1]], faces[:, [0, 2]]])
    pairs[~inside[pairs[:, 0]]] = pairs[~inside[pairs[:, 0]]][:, ::-1]
    edges, index = np.unique(pairs, axis=0, return_inverse=True)
    left, right = (first + index.reshape(2, -1)).astype(np.intp)
    tips = np.column_stack([tip, left, right])[within]
    quads = [np.column_stack(corners)[~within] for corners in ((left, p, q), (left, q, right))]
    return np.concatenate([tips, *quads]), edges


def _at_the_end(target: Target, plan: Floats, edges: Ints) -> Floats:
    """Points (m, 3) where edges of the mesh, from inside to outside, leave the shell: by halving them in plan."""
    near, far = plan[edges[:, 0]], plan[edges[:, 1]]
    for _ in range(HALVINGS):
        middle = 0.5 * (near + far)
        inside = _lifted(target, middle)[1][:, None]
        near, far = np.where(inside, middle, near), np.where(inside, far, middle)
    return _lifted(target, near)[0]
