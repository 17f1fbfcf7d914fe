"""Triangles of a target, to be looked at: a mesh over its plan, cut where the surface ends."""

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.bounds import bounds
from rodshell.targets.nurbs import grid_triangles
from rodshell.targets.target import Target
from rodshell.targets.trianglemesh import turned

CELLS = 52  # along the longer side of the plan
GROWTHS = 6  # of the box in which the surface is looked for, by its half to all sides; none is shown outside
HALVINGS = 14  # of a mesh edge that crosses the end


def surface_mesh(target: Target, around: Floats) -> tuple[Floats, Ints]:
    """Points (n, 3) [m] and triangles (t, 3) of the uppermost part of a target, all of it that is seen from above.

    It is made for pictures: the surface is sampled on a square mesh, whose triangles are cut at the end of the surface.
    What lies under an overhang is left out.

    Args:
        around: (k, 3) points of a shell on the target [m], from which the rest of it is found.
    """
    low, high = bounds(around[:, :2])
    for _ in range(GROWTHS):
        plan, _, _, step = _sampled(low - 0.5 * (high - low), high + 0.5 * (high - low))
        there = plan[_lifted(target, plan)[1]]
        found = bounds(np.concatenate([there, around[:, :2]]))
        grown = np.any((found[0] < low - step) | (found[1] > high + step))
        low, high = found
        if not grown:
            break
    plan, x, y, _ = _sampled(low - step, high + step)
    points, inside = _lifted(target, plan)
    faces = grid_triangles(len(x), len(y))
    count = inside[faces].sum(axis=1)
    cut, crossings = _cut(faces[(count == 1) | (count == 2)], inside, len(points))
    if len(crossings):
        points = np.concatenate([points, _at_the_end(target, plan, crossings)])
    faces = np.concatenate([faces[count == 3], cut])
    used = np.unique(faces)
    return points[used], np.searchsorted(used, faces)


def _sampled(low: Floats, high: Floats) -> tuple[Floats, Floats, Floats, float]:
    """Points (n, 2) of a square mesh over a rectangle of the plan, its lines of x and of y, and its step."""
    step = float((high - low).max()) / CELLS
    x, y = (low[k] + step * np.arange(int(np.ceil((high[k] - low[k]) / step)) + 1) for k in range(2))
    return np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2), x, y, step


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
