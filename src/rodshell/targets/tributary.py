"""Tributary areas: the part of a target's surface whose loads each node of the rods takes.

A node takes what is nearer to it than to any other, along the surface, up to its end. The surface is divided into
triangles, and each of these exactly into the cells of the nodes: the differences of squared distances to two nodes,
which are 0 between their cells, are linear in a plane that is developed, and are taken as linear in each triangle.
Lengths along the surface follow from chords and normals at both ends (`_squared`), and with them a triangle's area
[Gauss, Disquisitiones generales circa superficies curvas, 1827]. So areas of what can be developed are exact, and
others of fourth order in the size of triangles.
"""

from dataclasses import dataclass
from itertools import chain

import numpy as np
from scipy.spatial import cKDTree

from rodshell.arrays import Floats
from rodshell.geometry.frames import cross, dot, unit
from rodshell.kernels import njit
from rodshell.targets.end_triangles import end_triangles
from rodshell.targets.target import Target
from rodshell.validation import brief

_A_SPACING, _A_SIZE, _MOST = 3.0, 8.0, 300.0  # triangles' sides on the distance of two rods; on the size, between these
_LONGER = 1.05  # than its chord: a way along the surface across a triangle, or from it to the nearest node
_AT_ONCE = 20_000  # triangles
NEEDLE = 0.0003  # of the square of its longest side: a triangle's area


@dataclass(frozen=True, eq=False)
class Tributary:
    """What each of the n nodes of a mesh takes of a surface.

    Args:
        area: (n,) of the surface [m2].
        plan: (n,) of its plan [m2].
        vectors: (n, 3) areas times the unit normals that point up [m2].
        plan_positions: (n, 2) middle of each node's part of the plan [m]; of a node without one its own place.
    """

    area: Floats
    plan: Floats
    vectors: Floats
    plan_positions: Floats

    __repr__ = brief


def tributary_areas(
    target: Target, positions: Floats, *, anchor: tuple[float, float], rotate: float, spacing: float
) -> Tributary:
    """The areas of a surface that the nodes on it take; nodes in the same place share theirs in equal parts.

    Args:
        target: the surface, up to its end; where parts lie one above the other, the uppermost.
        positions: (n, 3) of the nodes, on the surface or next to it [m].
        anchor: point of the plan from which the triangles are laid [m].
        rotate: angle of their sides [rad].
        spacing: smallest distance of two neighbouring rods [m].
    """
    step = max(min(spacing / _A_SPACING, target.size / _A_SIZE), target.size / _MOST)
    points, normals, faces, factors = end_triangles(target, anchor=anchor, rotate=rotate, step=step)
    sites, of_site, together = np.unique(positions, axis=0, return_inverse=True, return_counts=True)
    upright, tree = unit(target.level(sites)[1]), cKDTree(sites)
    area, vectors, moments = np.zeros(len(sites)), np.zeros((len(sites), 3)), np.zeros((len(sites), 2))
    for first in range(0, len(faces), _AT_ONCE):
        some = faces[first : first + _AT_ONCE]
        corners = points[some]
        middle = corners.mean(axis=1)
        reach = np.sqrt(dot(corners - middle[:, None], corners - middle[:, None]).max(axis=1))
        near = _LONGER * (tree.query(middle)[0] + 2 * reach)
        lists = tree.query_ball_point(middle, near)
        count = np.array([len(each) for each in lists])
        nodes = np.fromiter(chain.from_iterable(lists), dtype=np.intp, count=count.sum())
        sizes, parts = np.empty(len(some)), np.zeros((len(nodes), 3))
        divide(points, normals, some, np.append(0, np.cumsum(count)), nodes, sites, upright, sizes, parts)
        flat = 0.5 * cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        taken = np.flatnonzero(parts.any(axis=1))
        of, nodes = np.repeat(np.arange(len(some)), count)[taken], nodes[taken]
        parts = parts[taken] * factors[first + of, None]
        share = parts.sum(axis=1)
        # normals turn across a triangle, whose whole is flat's: its end alone decides that
        turned = np.einsum("lk,lki->li", parts - share[:, None] / 3, normals[some][of])
        vector = share[:, None] * flat[of] + sizes[of, None] * turned
        within = np.einsum("lk,lki->li", parts, corners[of, :, :2]) / share[:, None]
        area += np.bincount(nodes, share * sizes[of], len(sites))
        for k in range(3):
            vectors[:, k] += np.bincount(nodes, vector[:, k], len(sites))
        for k in range(2):
            moments[:, k] += np.bincount(nodes, vector[:, 2] * within[:, k], len(sites))
    plan = vectors[:, 2:]
    middle = np.where(plan > 0, moments / np.where(plan > 0, plan, 1.0), sites[:, :2])
    each = 1.0 / together
    return Tributary(
        (each * area)[of_site], (each * plan[:, 0])[of_site], (each[:, None] * vectors)[of_site], middle[of_site]
    )


@njit()
def _squared(x, m, y, n):  # type: ignore[no-untyped-def]
    """Square of the distance along a surface from x to y, unit normals m and n there: s = c + (c.t)^2 f, c the chord, t
    the difference of normals. Of planes, spheres and circular cylinders it is exact, elsewhere of fourth order."""
    chord, turned, along = 0.0, 0.0, 0.0
    for k in range(3):
        c, t = y[k] - x[k], n[k] - m[k]
        chord += c * c
        turned += t * t
        along += c * t
    q = min(0.25 * turned, 1.0)  # squared sine of half the angle between the normals
    if q < 1e-4:
        factor = 1.0 / 12.0 + q * (2.0 / 45.0 + q / 35.0)
    else:
        factor = 0.25 * (np.arcsin(np.sqrt(q)) ** 2 / q - 1.0) / q
    return chord + along * along * factor


@njit("f2 f2 i2 i1 i1 f2 f2 f1 f2")
def divide(points, normals, faces, start, nodes, sites, upright, sizes, parts):  # type: ignore[no-untyped-def]
    """Divide triangles among the nodes that are nearest.

    Args:
        points, normals: (k, 3) corners on the surface [m], and unit normals there.
        faces: (m, 3) corners of each triangle.
        start, nodes: (m + 1,), (l,) where the nodes near each triangle begin in `nodes`, and these.
        sites, upright: (n, 3) of all nodes [m], and unit normals of the surface there.
        sizes: (m,) output, areas of the triangles [m2], negative where one is turned over.
        parts: (l, 3) output, integrals of the triangle's three barycentric coordinates over each node's part of it,
            over the triangle's area: their sum is the part's share of it.
    """
    most = 0
    for m in range(len(faces)):
        most = max(most, start[m + 1] - start[m])
    away, cell, before = np.empty((most, 3)), np.empty((most + 3, 3)), np.empty((most + 3, 3))
    level, rivals = np.empty(most + 3), np.empty(most, dtype=np.int64)
    for m in range(len(faces)):
        sizes[m] = _area(points, normals, faces[m])
        first, count = start[m], start[m + 1] - start[m]
        nearest, least = 0, np.inf
        for i in range(count):
            node, total = nodes[first + i], 0.0
            for k in range(3):
                away[i, k] = _squared(points[faces[m, k]], normals[faces[m, k]], sites[node], upright[node])
                total += away[i, k]
            if total < least:
                nearest, least = i, total
        # those that are farther than the nearest everywhere have no part
        ahead = 0
        for i in range(count):
            p, q, r = away[i, 0] - away[nearest, 0], away[i, 1] - away[nearest, 1], away[i, 2] - away[nearest, 2]
            if i == nearest or min(p, q, r) < 0.0:
                rivals[ahead] = i
                ahead += 1
        for rank in range(ahead):
            i, corners = rivals[rank], 3
            for k in range(3):
                for axis in range(3):
                    cell[k, axis] = 1.0 if k == axis else 0.0
            for other in range(ahead):
                j = rivals[other]
                p, q, r = away[i, 0] - away[j, 0], away[i, 1] - away[j, 1], away[i, 2] - away[j, 2]
                if max(p, q, r) > 0.0:
                    corners = _clip(cell, corners, p, q, r, before, level)
            for k in range(1, corners - 1):
                piece = (cell[k, 0] - cell[0, 0]) * (cell[k + 1, 1] - cell[0, 1])
                piece -= (cell[k, 1] - cell[0, 1]) * (cell[k + 1, 0] - cell[0, 0])
                for axis in range(3):
                    parts[first + i, axis] += piece * (cell[0, axis] + cell[k, axis] + cell[k + 1, axis]) / 3.0


@njit()
def _clip(cell, corners, p, q, r, before, level):  # type: ignore[no-untyped-def]
    """Keep of a cell (corners, 3) in barycentric coordinates a, b, c what has p a + q b + r c <= 0; its number of
    corners is returned. `before` and `level` are buffers."""
    for k in range(corners):
        for axis in range(3):
            before[k, axis] = cell[k, axis]
        level[k] = p * cell[k, 0] + q * cell[k, 1] + r * cell[k, 2]
    kept = 0
    for k in range(corners):
        after = k + 1 if k + 1 < corners else 0
        if level[k] <= 0.0:
            for axis in range(3):
                cell[kept, axis] = before[k, axis]
            kept += 1
        if min(level[k], level[after]) < 0.0 < max(level[k], level[after]):
            share = level[k] / (level[k] - level[after])
            for axis in range(3):
                cell[kept, axis] = before[k, axis] + share * (before[after, axis] - before[k, axis])
            kept += 1
    return kept


@njit()
def _chord(x, y):  # type: ignore[no-untyped-def]
    return (y[0] - x[0]) ** 2 + (y[1] - x[1]) ** 2 + (y[2] - x[2]) ** 2


@njit()
def _area(points, normals, face):  # type: ignore[no-untyped-def]
    """Area of a triangle of geodesics [m2], negative where its corners run clockwise about their normals: Heron's of
    its sides, times 1 + K (a^2 + b^2 + c^2) / 24; Gauss's curvature K is how much larger the normals' triangle is. Of a
    needle that amplifies errors of its sides: it has that of its projection, longer as its longest side is."""
    p, q, r = points[face[0]], points[face[1]], points[face[2]]
    t, m, n = normals[face[0]], normals[face[1]], normals[face[2]]
    chords, turns, steep = 0.0, 0.0, 0.0
    for k in range(3):
        i, j = (k + 1) % 3, (k + 2) % 3
        up = t[k] + m[k] + n[k]
        steep += up * up
        chords += up * ((q[i] - p[i]) * (r[j] - p[j]) - (q[j] - p[j]) * (r[i] - p[i]))
        turns += up * ((m[i] - t[i]) * (n[j] - t[j]) - (m[j] - t[j]) * (n[i] - t[i]))
    a, b, c = _squared(q, m, r, n), _squared(r, n, p, t), _squared(p, t, q, m)
    flat, longest = 0.5 * chords / np.sqrt(steep), max(a, b, c)
    if abs(flat) <= NEEDLE * longest:
        straight = max(_chord(q, r), _chord(r, p), _chord(p, q))
        return flat * np.sqrt(longest / straight) if straight > 0.0 else 0.0
    heron = 0.25 * np.sqrt(max(4.0 * a * b - (a + b - c) ** 2, 0.0))
    return np.copysign(heron, chords) * (1.0 + turns / chords * (a + b + c) / 24.0)
