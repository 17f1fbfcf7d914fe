"""Points of the smooth surface that a triangle mesh stands for, dense enough to fit patches to."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.geometry.vectors import dot, unit
from rodshell.targets.fitting import Samples
from rodshell.targets.trianglemesh import TriangleMesh, unique_rows

DENSITY = 0.9  # spacings: longest edge that is not divided
FINEST = 48  # divisions of an edge
APART = 0.2  # spacings: samples closer to each other are one


def mesh_samples(mesh: TriangleMesh, spacing: float) -> Samples:
    """The vertices, and points on triangles that are large against `spacing` [m] or long and thin.

    Vertices of the rim come first: patches are to lie there, as beyond it there is nothing to fit to.
    Between its vertices the surface is taken as a cubic that meets their normals [Vlachos et al. 2001, Curved PN
    triangles]: a long triangle of a vault lies below the arch that it spans.
    """
    corners = mesh.vertices[mesh.faces]
    longest = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2).max(axis=1)
    divisions = np.clip(np.ceil(longest / (DENSITY * spacing)), 1, FINEST).astype(int)
    areas = np.bincount(mesh.faces.ravel(), np.repeat(mesh.areas * (divisions == 1) / 3, 3), len(mesh.vertices))
    rim_first = np.argsort(~np.isin(np.arange(len(mesh.vertices)), np.concatenate([[-1], *mesh.loops])), kind="stable")
    points, normals, weights = [mesh.vertices[rim_first]], [mesh.normals[rim_first]], [areas[rim_first]]
    for n in np.unique(divisions[divisions > 1]):
        chosen = np.flatnonzero(divisions == n)
        i, j = np.array([(i, j) for i in range(n + 1) for j in range(n + 1 - i)]).T
        share = np.stack([i, j, n - i - j]) / n
        x, normal = _curved(corners[chosen], mesh.normals[mesh.faces[chosen]], share)
        points.append(x.reshape(-1, 3))
        normals.append(normal.reshape(-1, 3))
        weights.append(np.repeat(mesh.areas[chosen] / share.shape[1], share.shape[1]))
    return _thinned(np.vstack(points), np.vstack(normals), np.concatenate(weights), APART * spacing)


def _curved(x: Floats, n: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Points and normals (m, k, 3) of curved triangles with corners x, normals n (m, 3, 3) at `share` (3, k)."""
    cubic = np.einsum("ck,mcd->mkd", share**3, x)
    middle = np.zeros_like(x[:, 0])
    for a in range(3):
        for b in range(3):
            if a != b:
                control = (2 * x[:, a] + x[:, b] - dot(x[:, b] - x[:, a], n[:, a])[:, None] * n[:, a]) / 3
                cubic += 3 * (share[a] ** 2 * share[b])[None, :, None] * control[:, None]
                middle += control / 4
    middle -= x.sum(axis=1) / 6
    cubic += 6 * np.prod(share, axis=0)[None, :, None] * middle[:, None]
    mixed = np.einsum("ck,mcd->mkd", share, n)
    return cubic, mixed / np.maximum(np.linalg.norm(mixed, axis=2), 1e-300)[..., None]


def _thinned(points: Floats, normals: Floats, areas: Floats, apart: float) -> Samples:
    """One sample for each cell of a lattice, standing for the area of all in it; vertices go first."""
    sound = np.isfinite(points).all(axis=1) & (dot(normals, normals) > 0.5)
    points, normals, areas = points[sound], normals[sound], areas[sound]
    cell = np.floor((points - points.min(axis=0)) / apart).astype(np.int64)
    facing = (normals @ [0.577, 0.578, 0.579] > 0).astype(np.int64)  # two sheets in one cell stay two
    first, place = unique_rows(np.column_stack([cell, facing]))
    order = np.argsort(first)
    weight = np.bincount(place, areas)
    return Samples(points[first][order], unit(normals[first][order]), np.maximum(weight, 1e-3 * weight.mean())[order])
