"""Faces with any number of corners, split into triangles of the best shape, but along creases."""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import cross, dot
from rodshell.targets.diagonals import along_creases
from rodshell.targets.trianglemesh import require_indices
from rodshell.untrusted import limit, raised

WORK = 1e9  # cubes of the numbers of corners in sum: some 10 s; a thousand faces of 100 corners
AT_ONCE = 1_000_000  # pairs of corners that are held at once
FLAT = 1e-9  # of the squares of its sides: the area of a triangle without any
NEVER = 1e30  # the cost of a triangle that lies outside its face, or has no area


@dataclass(frozen=True, eq=False)
class Polygons:
    """Faces with any number of corners.

    Args:
        points: (n, 3).
        corners: (k,) indices of the points around each face, one face after the other.
        sizes: (m,) number of corners of each face.
    """

    points: Floats
    corners: Ints
    sizes: Ints

    def only(self, faces: Bools) -> "Polygons":
        """Those that are marked in `faces` (m,)."""
        return Polygons(self.points, self.corners[np.repeat(faces, self.sizes)], self.sizes[faces])

    def triangles(self, name: str) -> Ints:
        """The faces as triangles (t, 3), in their order; those with fewer than three corners are left out.

        A crease that crosses faces from corner to corner runs along their diagonals, not across them.

        Raises:
            InputError: a face has a corner that is not there; faces have so many corners that to split them takes
                minutes.
        """
        require_indices(self.points, self.corners, name)
        work = float((self.sizes.astype(float) ** 3)[self.sizes > 4].sum())
        if work > limit(WORK):
            raise InputError(
                f"{name} has faces of up to {self.sizes.max()} corners, which take long to split: export it in "
                f"triangles or quads, {raised(WORK, work)}"
            )
        first = np.cumsum(self.sizes) - self.sizes
        parts, of = [np.empty((0, 3), dtype=np.intp)], [np.empty(0, dtype=np.intp)]
        for count in np.unique(self.sizes[self.sizes > 2]).tolist():
            faces = np.flatnonzero(self.sizes == count)
            for some in np.array_split(faces, -(-len(faces) * count**2 // AT_ONCE)):
                around = self.corners[first[some][:, None] + np.arange(count)]
                parts.append(_split(self.points, around).reshape(-1, 3))
                of.append(np.repeat(some, count - 2))
        order = np.argsort(np.concatenate(of), kind="stable")
        return along_creases(self.points, np.vstack(parts)[order], np.concatenate(of)[order])


@np.errstate(all="ignore")  # points that are not finite are refused later, with their place
def _split(points: Floats, around: Ints) -> Ints:
    """Triangles (m, n - 2, 3) of faces with n corners `around` (m, n), by diagonals.

    The sum of the cotangents of all angles is least, which makes it a Delaunay triangulation [Rippa 1990]; since no
    triangle is turned over against its face, it covers faces that are not convex too. Parts between the corners i and
    j are split best in order of their size [Klincsek 1980].
    """
    count, n = around.shape
    if n == 3:
        return around[:, None]
    x = points[around]
    normal = cross(x - x[:, :1], np.roll(x, -1, axis=1) - x[:, :1]).sum(axis=1)[:, None, None]
    cost, middle = np.zeros((count, n, n)), np.zeros((count, n, n), dtype=np.intp)
    normal = normal / np.maximum(np.linalg.norm(normal, axis=3, keepdims=True), 1e-300)
    for span in range(2, n):
        i = np.arange(n - span)[:, None]
        j, k = i + span, i + 1 + np.arange(span - 1)
        a, b, c = x[:, i], x[:, k], x[:, j]
        area = dot(cross(b - a, c - a), normal)
        squares = dot(b - a, b - a) + dot(c - b, c - b) + dot(a - c, a - c)
        total = np.where(area > FLAT * squares, squares / area, NEVER) + cost[:, i, k] + cost[:, k, j]
        best = total.argmin(axis=2)[..., None]
        cost[:, i[:, 0], j[:, 0]] = np.take_along_axis(total, best, axis=2)[..., 0]
        middle[:, i[:, 0], j[:, 0]] = best[..., 0] + 1 + i[:, 0]
    rows, found = np.arange(count), np.empty((count, n - 2, 3), dtype=np.intp)
    parts, known = np.empty((count, n - 2, 2), dtype=np.intp), np.ones(count, dtype=np.intp)
    parts[:, 0] = 0, n - 1
    for t in range(n - 2):
        i, j = parts[:, t].T
        k = middle[rows, i, j]
        found[:, t] = around[rows[:, None], np.column_stack([i, k, j])]
        for first, last in ((i, k), (k, j)):
            more = last - first > 1
            parts[rows[more], known[more]] = np.column_stack([first, last])[more]
            known += more
    return found
