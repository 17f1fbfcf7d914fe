"""Surfaces of rational B-splines, and the triangles between points of them."""

from dataclasses import dataclass

import numpy as np
from scipy.interpolate import NdBSpline

from rodshell.arrays import Floats, Ints

GRID = 64  # quads each way: the field through them is accurate to 4e-5 of the size on a whole sphere
PER_SPAN = 4  # quads per span of a NURBS with many knots
FINEST = 400  # quads each way, at most
MOST = 1e15  # of a control point, in the unit of its file
HIGHEST = 25  # degree: of splines beyond it, no digit of a point is known


@dataclass(frozen=True, eq=False)
class Nurbs:
    """A surface of rational B-splines.

    Args:
        degrees: along u and along v.
        knots: (m + degree + 1,) and (n + degree + 1,), ascending.
        controls: (m, n, 4) control points: weight times x, y and z, and the weight, which is positive.
    """

    degrees: tuple[int, int]
    knots: tuple[Floats, Floats]
    controls: Floats

    @property
    def fault(self) -> str:
        """Why there is no such surface; empty for one that is sound."""
        for degree, knots, count in zip(self.degrees, self.knots, self.controls.shape, strict=False):
            if not 1 <= degree <= HIGHEST:
                return f"its degree is {degree}, and {HIGHEST} at most is read"
            if len(knots) != count + degree + 1 or count <= degree:
                return f"it has {len(knots)} knots for {count} control points of degree {degree}"
            if not (np.isfinite(knots).all() and (np.diff(knots) >= 0).all() and knots[degree] < knots[-degree - 1]):
                return "its knots do not ascend"
        if not np.isfinite(self.controls).all() or np.abs(self.controls).max() > MOST:
            return f"its control points are not finite, or beyond {MOST:g}"
        return "" if (self.controls[..., 3] > 0).all() else "a control point has no positive weight"

    def at(self, u: Floats, v: Floats) -> Floats:
        """Points (..., 3) of the surface at parameters `u` and `v` (...)."""
        x = NdBSpline(self.knots, self.controls, self.degrees)(np.stack(np.broadcast_arrays(u, v), axis=-1))
        return np.asarray(x[..., :3] / x[..., 3:])

    @property
    def quads(self) -> tuple[int, int]:
        """How many its spans need along u and along v."""
        spans = (len(np.unique(k[p : len(k) - p])) - 1 for k, p in zip(self.knots, self.degrees, strict=True))
        along, across = (min(PER_SPAN * count, FINEST) for count in spans)
        return along, across

    def lattice(self, counts: tuple[int, int]) -> tuple[Floats, Floats]:
        """Parameters u and v in as many equal steps."""
        u, v = (
            np.linspace(k[p], k[len(k) - p - 1], count + 1)
            for k, p, count in zip(self.knots, self.degrees, counts, strict=True)
        )
        return u, v

    def triangles(self) -> tuple[Floats, Ints]:
        """The whole surface in triangles: vertices (k, 3) and faces (m, 3)."""
        along, across = (max(GRID, count) for count in self.quads)
        u, v = self.lattice((along, across))
        x = self.at(u[:, None], v)
        return x.reshape(-1, 3), grid_triangles(along + 1, across + 1)


def grid_triangles(rows: int, columns: int) -> Ints:
    """Triangles (m, 3) between the points of a lattice, row by row."""
    corner = (np.arange(rows - 1)[:, None] * columns + np.arange(columns - 1)).ravel()
    a, b, c, d = corner, corner + columns, corner + columns + 1, corner + 1
    return np.vstack([np.column_stack([a, b, c]), np.column_stack([a, c, d])]).astype(np.intp)
