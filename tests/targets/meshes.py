"""Meshes that the tests make."""

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Mesh = tuple[Floats, Ints]


def lattice(x: Floats, y: Floats, z: Floats) -> Mesh:
    """Triangles between the points (n, m) of a lattice, in counter-clockwise order seen against x, y."""
    rows, columns = x.shape
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = corner, corner + columns, corner + columns + 1, corner + 1
    points = np.column_stack([x.ravel(), y.ravel(), z.ravel()])
    return points, np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])])


def sheet(height: Callable[[Floats, Floats], Floats], half: float, count: int) -> Mesh:
    """A square of a height field."""
    x, y = np.meshgrid(np.linspace(-half, half, count), np.linspace(-half, half, count), indexing="ij")
    return lattice(x, y, height(x, y) + 0 * x)


def strewn(
    height: Callable[[Floats, Floats], Floats], half: float, count: int, *, seed: int = 0, crowd: float = 1.0
) -> Mesh:
    """The same with vertices strewn at random, but for the edge, and faces in no order.

    With `crowd` > 1 most lie near the middle: their distance grows towards the edge.
    """
    from scipy.spatial import Delaunay

    rng = np.random.default_rng(seed)
    t = np.linspace(-1, 1, int(2 * np.sqrt(count)), endpoint=False)
    one = np.ones_like(t)
    inner = rng.uniform(-1.0, 1.0, (count, 2))
    plan = np.vstack(
        [
            0.98 * np.sign(inner) * np.abs(inner) ** crowd,
            *(np.column_stack(p) for p in ((t, -one), (one, t), (-t, one), (-one, -t))),
        ]
    )
    faces = rng.permutation(Delaunay(plan).simplices)
    p = plan[faces]
    turn = np.sum((p[:, 1] - p[:, 0]) * (p[:, 2] - p[:, 0])[:, ::-1] * [1, -1], axis=1)
    faces = np.where(turn[:, None] > 0, faces, faces[:, ::-1])[np.abs(turn) > 1e-9]
    plan = half * plan
    return np.column_stack([plan, height(*plan.T)]), faces


def capped_sphere(rows: int, opening: float) -> Mesh:
    """The part of the unit sphere within the polar angle `opening`; rings of six points more than the last."""
    points, faces = [[0.0, 0.0, 1.0]], list[list[int]]()
    rings = [[0]]
    for i in range(1, rows + 1):
        polar, count = opening * i / rows, 6 * i
        ring = list(range(len(points), len(points) + count))
        for angle in 2 * np.pi * np.arange(count) / count:
            points.append([np.sin(polar) * np.cos(angle), np.sin(polar) * np.sin(angle), np.cos(polar)])
        for side in range(6):
            for j in range(i):
                inner = rings[-1][(side * (i - 1) + j) % len(rings[-1])]
                first, second = ring[side * i + j], ring[(side * i + j + 1) % count]
                faces.append([inner, first, second])
                if j < i - 1:
                    faces.append([inner, second, rings[-1][(side * (i - 1) + j + 1) % len(rings[-1])]])
        rings.append(ring)
    return np.array(points), np.array(faces)


def disc(height: Callable[[Floats, Floats], Floats], radius: float, rows: int) -> Mesh:
    """A round piece of a height field."""
    x, faces = capped_sphere(rows, np.pi / 2)
    polar, angle = np.arccos(np.clip(x[:, 2], -1, 1)), np.arctan2(x[:, 1], x[:, 0])
    plan = radius * polar / (np.pi / 2) * np.stack([np.cos(angle), np.sin(angle)])
    return np.column_stack([*plan, height(*plan)]), faces


def torus_piece() -> Mesh:
    """Outer half of a ring's tube, a third of the ring round: curvature of both signs, and no height field."""
    a, t = np.meshgrid(np.linspace(-1, 1, 60), np.linspace(-1.9, 1.9, 40), indexing="ij")
    r = 1.0 + 0.4 * np.sin(t)
    return lattice(r * np.sin(a), r * np.cos(a), 0.4 * np.cos(t))


PARTS: dict[str, Callable[[], Mesh]] = {
    "saddle": lambda: sheet(lambda x, y: (x**2 - y**2) / 0.8, 0.2, 40),
    "bowl": lambda: sheet(lambda x, y: 0.1 - x**2 - 0.5 * y**2 + 0.2 * x * y, 0.2, 40),
    "ball": lambda: capped_sphere(20, 2.0),
    "torus": torus_piece,
}


def equilateral(height: Callable[[Floats, Floats], Floats], half: float, count: int) -> Mesh:
    """A square of a height field over rows of equilateral triangles."""
    side, rows = 2 * half / (count - 1), int(count / 0.75**0.5)
    i, j = np.meshgrid(np.arange(count), np.arange(rows), indexing="ij")
    x, y = side * (i + 0.5 * (j % 2) - 0.5 * count), side * 0.75**0.5 * (j - 0.5 * rows)
    points, halves = lattice(x, y, height(x, y))
    (a, b, c), d = halves[: len(halves) // 2].T, halves[len(halves) // 2 :, 2]
    even = (a % rows % 2 == 0)[:, None]  # rows are shifted in turn, and their diagonals lean so
    first = np.where(even, np.column_stack([a, b, d]), np.column_stack([a, b, c]))
    return points, np.vstack([first, np.where(even, np.column_stack([b, c, d]), np.column_stack([a, c, d]))])


def left_out(mesh: Mesh, gone: Callable[[Floats], NDArray[np.bool_]]) -> Mesh:
    """The mesh without the faces whose centres (m, 3) are `gone`: where no edge of it runs, it ends in a staircase."""
    points, faces = mesh
    used, faces = np.unique(faces[~gone(points[faces].mean(axis=1))], return_inverse=True)
    return points[used], faces.reshape(-1, 3)


CREASED: dict[str, Callable[[Floats, Floats], Floats]] = {  # half width 5
    "ridge": lambda x, y: 3.2 - 0.45 * np.abs(x) - 0.02 * x**2 - 0.03 * y**2,
    "groin": lambda x, y: np.sqrt(36 - np.minimum(np.abs(x), np.abs(y)) ** 2),
    "valley": lambda x, y: 3 - 0.03 * (x**2 + y**2) + 0.3 * np.abs(x - bend(y)),
    "ring": lambda x, y: 3 - 0.04 * (x**2 + y**2) - 0.4 * np.maximum(np.hypot(x, y) - 2.5, 0),
}


def creased_quads(name: str, count: int = 30) -> tuple[Floats, Ints]:
    """One of `CREASED` over a square lattice: points, and the corners (m, 4) of its cells."""
    x, y = np.meshgrid(*2 * [np.linspace(-5, 5, count + 1)], indexing="ij")
    points, faces = lattice(x, y, CREASED[name](x, y))
    return points, np.column_stack([faces[: len(faces) // 2], faces[len(faces) // 2 :, 2]])


def bend(y: Floats) -> Floats:
    """x of the crease of the "valley"."""
    return np.asarray(0.8 - 0.06 * y**2)


def creased(name: str, count: int = 30) -> Mesh:
    """One of `CREASED`, with edges along its creases."""
    height = CREASED[name]
    if name == "ring":
        return disc(height, 5.0, count)
    s, y = np.meshgrid(np.linspace(-1, 1, count + 1), np.linspace(-5, 5, count + 1), indexing="ij")
    x = bend(y) + np.where(s > 0, 5 - bend(y), 5 + bend(y)) * s if name == "valley" else 5 * s
    points, faces = lattice(x, y, height(x, y))
    a, b, c, d = np.hstack([faces[: len(faces) // 2], faces[len(faces) // 2 :]]).T[[0, 1, 2, 5]]
    across = np.prod(points[a, :2] + points[c, :2], axis=1) < 0  # halved the other way, along the creases of the groin
    one = np.where(across[:, None], np.column_stack([a, b, d]), np.column_stack([a, b, c]))
    other = np.where(across[:, None], np.column_stack([b, c, d]), np.column_stack([a, c, d]))
    return points, np.vstack([one, other])
