"""Tributary areas, against polygons in the developed plane, rays along curved surfaces, and closed forms."""

import sys
from collections.abc import Callable, Iterator
from math import hypot, pi

import numpy as np
from scipy.spatial import Delaunay

import rodshell as rs
from rodshell.arrays import Floats
from rodshell.targets.tributary import Tributary, tributary_areas
from tests.acceptance.rows import Row, print_table
from tests.targets.cells_of_nodes import areas_by_rays, areas_in_plane

EXACT, CURVED = 1e-6, 0.2  # of the mean cell, or of the sum; % of each cell
LOW, HIGH = np.array([-6.0, -2.0]), np.array([6.0, 2.0])
DOMAIN = rs.Rectangle((12.0, 4.0))
SPACING = 0.9


def nodes_of_rods(low: Floats, high: Floats, spacing: float, turned: float, *, between: int) -> Floats:
    """Nodes (n, 2) of two families of straight rods in a rectangle, `between` edges from rod to rod."""
    count = int(np.linalg.norm(high - low) / spacing) + 1
    across = spacing * (np.arange(-count, count + 1) + 0.31)
    along = spacing / between * np.arange(-count * between, count * between + 1) + 0.31 * spacing
    s, t = (side.ravel() for side in np.meshgrid(along, across))
    lines = np.unique(np.vstack([np.column_stack([s, t]), np.column_stack([t, s])]).round(9), axis=0)
    cos, sin = np.cos(turned), np.sin(turned)
    points = lines @ np.array([[cos, sin], [-sin, cos]]) + 0.5 * (low + high)
    return points[((points > low) & (points < high)).all(axis=1)]


def rectangle(low: Floats, high: Floats) -> Floats:
    return np.array([[low[0], low[1]], [high[0], low[1]], [high[0], high[1]], [low[0], high[1]]])


def off(found: Floats, expected: Floats) -> float:
    """Largest error of an area, over the mean."""
    return float(np.abs(found - expected).max() / expected.mean())


def cells(target: rs.Target, points: Floats, spacing: float) -> Tributary:
    return tributary_areas(target, points, anchor=(0.11, 0.07), rotate=0.4, spacing=spacing)


def tilted(xy: Floats) -> Floats:
    """The plane z = 3 + .3 x - .2 y in axes of its own."""
    along = np.array([1, 0, 0.3]) / hypot(1.0, 0.3)
    across = np.cross([-0.3, 0.2, 1.0], along)
    points = np.column_stack([xy, 0.3 * xy[:, 0] - 0.2 * xy[:, 1]])
    return np.column_stack([points @ along, points @ across / np.linalg.norm(across)])


def parabolic(xy: Floats) -> Floats:
    """The barrel z = 3 - .1 y^2 unrolled: arc lengths of a parabola."""
    u = 0.2 * xy[:, 1]
    return np.column_stack([xy[:, 0], (u * np.sqrt(1 + u * u) + np.arcsinh(u)) / 0.4])


def circular(xy: Floats) -> Floats:
    """The vault z^2 = 9 - y^2 unrolled."""
    return np.column_stack([xy[:, 0], 3 * np.arcsin(xy[:, 1] / 3)])


DEVELOPED: dict[str, tuple[str, Callable[[Floats], Floats]]] = {
    "tilted plane": ("3 + 0.3*x - 0.2*y", tilted),
    "barrel z = 3 - .1 y^2": ("3 - 0.1*y^2", parabolic),
    "vault of a cylinder, R 3 m": ("sqrt(9 - y^2)", circular),
}


def developable_rows() -> Iterator[Row]:
    """Cells of rods, and of nodes at random, on what can be unrolled."""
    nodes = {
        "rods": nodes_of_rods(LOW, HIGH, SPACING, 0.5, between=6),
        "at random": np.random.default_rng(3).uniform(LOW, HIGH, (400, 2)),
    }
    for name, (formula, unrolled) in DEVELOPED.items():
        target = rs.HeightField(formula=formula, domain=DOMAIN)
        for words, plan in nodes.items():
            found = cells(target, target.lift(plan), SPACING)
            expected = areas_in_plane(unrolled(plan), [unrolled(rectangle(LOW, HIGH))])
            yield Row(name, f"cells of nodes, {words}", off(found.area, expected), EXACT)
    yield from mesh_rows()


def mesh_rows() -> Iterator[Row]:
    """A mesh of a plane that is an L, with a square opening: ends with corners, re-entrant ones too."""
    ticks = np.linspace(0.0, 6.0, 25)
    xy = np.stack(np.meshgrid(ticks, ticks), axis=-1).reshape(-1, 2)
    faces = Delaunay(xy).simplices
    x, y = xy[faces].mean(axis=1).T
    faces = faces[~((x > 3) & (y > 3)) & ~((abs(x - 1.5) < 0.5) & (abs(y - 1.5) < 0.5))]
    used = np.unique(faces)
    mesh = rs.Freeform.of(np.column_stack([xy, 0.3 * xy[:, 0] - 0.2 * xy[:, 1]])[used], np.searchsorted(used, faces))
    corners = [(0, 0, 1, 3), (2, 0, 6, 3), (1, 0, 2, 1), (1, 2, 2, 3), (0, 3, 3, 6)]
    regions = [tilted(rectangle(np.array(each[:2]), np.array(each[2:]))) for each in corners]
    plan = nodes_of_rods(np.zeros(2), np.full(2, 6.0), SPACING, 0.5, between=3)
    points = np.column_stack([plan, 0.3 * plan[:, 0] - 0.2 * plan[:, 1]])
    points = points[mesh.margin(points) > 0]
    found, expected = cells(mesh, points, SPACING), areas_in_plane(tilted(points[:, :2]), regions)
    yield Row("mesh of an L with an opening", "cells of nodes", off(found.area, expected), EXACT)


def curved_rows(count: int = 720, each: int = 24) -> Iterator[Row]:
    """Single cells of curved surfaces; of the hemisphere those away from its vertical edge, which rays do not see."""
    yield from curved("hemisphere", rs.Hemisphere(6.0), 0.7, count, each, inside=3.5)
    yield from curved("paraboloid, 12 m, rise 3 m", rs.Paraboloid(6.0, 3.0), 0.7, count, each)
    saddle = rs.HeightField(formula="2 + 0.06*(x^2 - y^2)", domain=rs.Rectangle((9.0, 9.0)))
    yield from curved("saddle", saddle, 0.8, count, each)


def curved(
    name: str, target: rs.Target, spacing: float, count: int, each: int, *, inside: float = 0.0
) -> Iterator[Row]:
    half = np.full(2, target.size)
    points = target.lift(_inside(target, nodes_of_rods(-half, half, spacing, 0.3, between=3)))
    found = cells(target, points, spacing)

    def surface(xy: Floats) -> tuple[Floats, Floats]:
        x = np.column_stack([xy, target.height_at(xy)])
        there = np.isfinite(x[:, 2])
        there[there] = target.margin(x[there]) > 0
        ratio, slope = np.zeros(len(x)), target.level(x[there])[1]
        ratio[there] = np.linalg.norm(slope, axis=1) / slope[:, 2]
        return np.where(there[:, None], x, 0.0), ratio

    inner = np.flatnonzero(target.margin(points) > inside)
    some = np.random.default_rng(4).choice(inner, min(each, len(inner)), replace=False)
    area, plan = areas_by_rays(points, surface, some.tolist(), reach=1.1 * spacing, count=count)
    yield Row(name, "single cells, worst", 100 * float(np.abs(found.area[some] / area - 1).max()), CURVED, "%")
    yield Row(name, "their plan, worst", 100 * float(np.abs(found.plan[some] / plan - 1).max()), CURVED, "%")


def _inside(target: rs.Target, xy: Floats) -> Floats:
    z = target.height_at(xy)
    xy, z = xy[np.isfinite(z)], z[np.isfinite(z)]
    return xy[target.margin(np.column_stack([xy, z])) > 0]


def sum_rows() -> Iterator[Row]:
    """Sums against closed forms: vertical and inclined ends, round and with corners."""
    paraboloid = pi * 8 / (6 * 4**2) * ((8**2 + 4 * 4**2) ** 1.5 - 8**3)
    barrel = 24.0 * float(parabolic(np.array([[0.0, 2.0]]))[0, 1])
    for name, target, surface, plan in (
        ("hemisphere", rs.Hemisphere(0.2), 2 * pi * 0.04, pi * 0.04),
        ("cap", rs.Cap(10.0, 4.0), 120 * pi, 84 * pi),
        ("paraboloid", rs.Paraboloid(8.0, 4.0), paraboloid, 64 * pi),
        ("barrel", rs.HeightField(formula="3 - 0.1*y^2", domain=DOMAIN), barrel, 48.0),
        ("disc", rs.HeightField(formula="3 + 0.2*x", domain=rs.Disc(4.0)), 16 * pi * hypot(1, 0.2), 16 * pi),
    ):
        half = np.full(2, target.size)
        xy = _inside(target, nodes_of_rods(-half, half, target.size / 6, 0.3, between=2))
        found = cells(target, target.lift(xy), target.size / 6)
        yield Row(name, "sum of areas", abs(found.area.sum() / surface - 1), EXACT)
        yield Row(name, "sum of the plan", abs(found.plan.sum() / plan - 1), EXACT)


if __name__ == "__main__":
    sys.exit(print_table("signed_areas", (*developable_rows(), *sum_rows(), *curved_rows())))
