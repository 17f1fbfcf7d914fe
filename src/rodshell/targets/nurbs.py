"""NURBS surfaces: their points, and triangles between them."""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats, Ints

GRID = 64  # quads each way: the field through them is right to 4e-5 of the size on a whole sphere
PER_SPAN = 4  # of a NURBS with many knots
FINEST = 400


@dataclass(frozen=True, eq=False)
class Nurbs:
    """A surface made of rational B-splines.

    Parameters
    ----------
    degrees : along u and along v.
    knots : (m + degree + 1,) and (n + degree + 1,), ascending.
    controls : (m, n, 4) control points: weight times x, y and z, and the weight.
    """

    degrees: tuple[int, int]
    knots: tuple[Floats, Floats]
    controls: Floats

    def points(self, u: Floats, v: Floats) -> Floats:
        """Points (k, l, 3) at the parameters (k,) and (l,)."""
        along, across = (splines(k, p, t) for k, p, t in zip(self.knots, self.degrees, (u, v), strict=True))
        x = np.einsum("ki,ijd,lj->kld", along, self.controls, across, optimize=True)
        return np.asarray(x[..., :3] / x[..., 3:])

    def triangles(self) -> tuple[Floats, Ints]:
        """The whole surface in triangles: vertices (k, 3) and faces."""
        sides = []
        for knots, degree in zip(self.knots, self.degrees, strict=True):
            within = knots[degree : len(knots) - degree]
            count = min(max(GRID, PER_SPAN * (len(np.unique(within)) - 1)), FINEST)
            sides.append(np.linspace(within[0], within[-1], count + 1))
        return self.points(*sides).reshape(-1, 3), grid_triangles(len(sides[0]), len(sides[1]))


def splines(knots: Floats, degree: int, t: Floats) -> Floats:
    """All B-splines (k, m) of a degree at parameters (k,), by Cox's and de Boor's recursion."""
    last = np.flatnonzero(knots < knots[-degree - 1])[-1]  # the span to which the end belongs
    span = np.clip(np.searchsorted(knots, t, side="right") - 1, degree, last)
    values = (np.arange(len(knots) - 1) == span[:, None]).astype(float)
    for p in range(1, degree + 1):
        low, high = knots[: -p - 1], knots[p + 1 :]
        rising, falling = knots[p:-1] - low, high - knots[1:-p]
        up = (t[:, None] - low) / np.where(rising > 0, rising, 1.0)
        down = (high - t[:, None]) / np.where(falling > 0, falling, 1.0)
        values = up * values[:, :-1] + down * values[:, 1:]
    return values


def grid_triangles(rows: int, columns: int) -> Ints:
    """Triangles (m, 3) between the points of a lattice, row by row."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = corner, corner + columns, corner + columns + 1, corner + 1
    return np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.intp)
