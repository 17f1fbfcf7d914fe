"""Slow truths of tributary areas: polygons in a developed plane, and lattices of points on a curved surface."""

from collections.abc import Callable, Sequence

import numpy as np
from scipy.spatial import cKDTree

from rodshell.arrays import Floats


def polygon_area(polygon: Floats) -> float:
    x, y = polygon.T
    return 0.5 * float(np.sum(x * np.roll(y, -1) - y * np.roll(x, -1)))


def clipped(polygon: Floats, normal: Floats, offset: float) -> Floats:
    """The part of a convex polygon (k, 2), counter-clockwise, where normal . x <= offset."""
    level = polygon @ normal - offset
    kept = list[Floats]()
    for a, b, p, q in zip(level, np.roll(level, -1), polygon, np.roll(polygon, -1, axis=0), strict=True):
        if a <= 0:
            kept.append(p)
        if a * b < 0:
            kept.append(p + a / (a - b) * (q - p))
    return np.array(kept).reshape(-1, 2)


def cells_in_plane(nodes: Floats, regions: Sequence[Floats]) -> list[list[Floats]]:
    """The cell of each of the nodes (n, 2) in each of the convex regions that together make up a part of the plane."""
    found = []
    for node in nodes:
        parts, away = list(regions), np.linalg.norm(nodes - node, axis=1)
        for other in nodes[np.argsort(away)[1:]]:
            farthest = max((np.linalg.norm(part - node, axis=1).max() for part in parts if len(part)), default=0.0)
            if np.linalg.norm(other - node) > 2 * farthest:
                break
            way = other - node
            parts = [clipped(part, way, float(way @ (node + other) / 2)) if len(part) else part for part in parts]
        found.append([part for part in parts if len(part) > 2])
    return found


def areas_in_plane(nodes: Floats, regions: Sequence[Floats]) -> Floats:
    """(n,) areas of these cells."""
    return np.array([sum(map(polygon_area, parts)) for parts in cells_in_plane(nodes, regions)])


def areas_by_rays(
    nodes: Floats, surface: Callable[[Floats], tuple[Floats, Floats]], some: Sequence[int], *, reach: float, count: int
) -> tuple[Floats, Floats]:
    """Areas of the surface and of its plan that some of the nodes (n, 3) take: what is nearest in space. Along rays of
    the plan from the node the cell's end is bisected; areas are Richardson's extrapolation of two numbers of rays.

    Args:
        surface: of points (m, 2) of the plan the points (m, 3), and area over plan area there, 0 outside.
        reach: length of the rays, beyond the cell's end [m].
        count: of the more rays.
    """
    tree, found = cKDTree(nodes), []
    gauss, weight = np.polynomial.legendre.leggauss(5)
    for k in some:
        each = []
        for rays in (count // 2, count):
            turn = 2 * np.pi * (np.arange(rays) + 0.37) / rays
            way, low, high = np.column_stack([np.cos(turn), np.sin(turn)]), np.zeros(rays), np.full(rays, reach)
            for _ in range(36):
                at = 0.5 * (low + high)
                x, ratio = surface(nodes[k, :2] + at[:, None] * way)
                mine = (ratio > 0) & (tree.query(x)[1] == k)
                low, high = np.where(mine, at, low), np.where(mine, high, at)
            radius = 0.5 * low[:, None] * (1 + gauss)
            ratio = surface((nodes[k, :2] + radius[..., None] * way[:, None]).reshape(-1, 2))[1].reshape(rays, -1)
            rings = np.pi / rays * low[:, None] * weight * radius
            each.append((float((rings * ratio).sum()), float(rings.sum())))
        found.append((4 * np.array(each[1]) - each[0]) / 3)
    area, plan = np.array(found).T
    return area, plan
