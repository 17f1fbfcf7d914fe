"""Diagonals of quads and of other faces, exchanged where they cross a crease."""

from typing import NamedTuple

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.frames import dot, unit
from rodshell.targets.trianglemesh import Sides, TriangleMesh

LESS = 0.75  # of the folds: of a crease between flat sides a quarter is left, the curvature of its sides adds to both
MAIN = 0.5  # of the folds that are left: the crease itself
KINK = np.radians(3.0)  # folds that are spared are more: less is noise
SLIVER = 25.0  # the squares of a triangle's sides over twice its area; 3.5 where they are equal
ROUNDS = 50  # a quad needs one, unless the folds of its neighbours change


class _Exchanges(NamedTuple):
    """Pairs of triangles (n, 2), those with the other diagonal (n, 2, 3), and by how much less they fold (n,) [rad]."""

    pairs: Ints
    triangles: Ints
    gain: Floats


@np.errstate(all="ignore")  # triangles without area have no normal, and points may not be finite
def along_creases(points: Floats, triangles: Ints, face: Ints) -> Ints:
    """The triangles in the order of their faces, with diagonals that cross a crease exchanged for those that run along
    it.

    The angles by which two triangles of a face turn at their diagonal and towards their neighbours are summed [Dyn,
    Levin and Rippa 1990]. The other diagonal is taken where it leaves clearly less, and most of that at itself. Finely
    meshed smooth surfaces turn too little to change.

    Args:
        triangles: (t, 3), oriented alike within each face.
        face: (t,) of which each triangle is a part.
    """
    if not (np.diff(np.sort(face)) == 0).any():
        return triangles
    place, triangles = np.unique(points, axis=0, return_inverse=True)[1].reshape(-1), triangles.copy()
    for _ in range(ROUNDS):
        pairs = Sides.of(place[triangles]).twins
        twin = np.full(triangles.size, -1, dtype=np.intp)  # of each side; -1 where no triangle or several are beyond it
        twin[pairs] = pairs[:, ::-1]
        found = _exchanges(points, place, triangles, face, twin)
        rank = np.argsort(np.argsort(found.gain, kind="stable"), kind="stable")
        best = np.full(len(triangles) + 1, -1)  # of the exchanges of a triangle; the last is beyond an open edge
        np.maximum.at(best, found.pairs, rank[:, None])
        near = np.maximum(best[:-1], best[np.where(twin < 0, -1, twin // 3)].reshape(-1, 3).max(axis=1))
        now = (near[found.pairs] <= rank[:, None]).all(axis=1)  # none that touch, as each changes the other's folds
        if not now.any():
            break
        triangles[found.pairs[now]] = found.triangles[now]
    return triangles


def _exchanges(points: Floats, place: Ints, triangles: Ints, face: Ints, twin: Ints) -> _Exchanges:
    """The diagonals that should be exchanged."""
    starts, across = triangles.ravel(), twin
    other = across // 3
    inner = np.flatnonzero((across > np.arange(len(across))) & (np.repeat(face, 3) == face[other]))
    inner = inner[starts[inner] != starts[across[inner]]]
    first, second = inner // 3, other[inner]
    k, m = inner % 3, across[inner] % 3
    a, b, c, d = starts[inner], starts[across[inner]], triangles[first, (k + 2) % 3], triangles[second, (m + 2) % 3]
    normals = unit(TriangleMesh(points, triangles).doubled)
    against = place[starts] == place[starts[across]]  # the neighbour faces the other side
    beyond = np.where(against[:, None], -1.0, 1.0) * normals[other]
    beyond[across < 0] = np.nan
    bc, ca = beyond[3 * first + (k + 1) % 3], beyond[3 * first + (k + 2) % 3]
    ad, db = beyond[3 * second + (m + 1) % 3], beyond[3 * second + (m + 2) % 3]
    cad, dbc = np.column_stack([c, a, d]), np.column_stack([d, b, c])
    p, q, r, s = normals[first], normals[second], *(unit(TriangleMesh(points, those).doubled) for those in (cad, dbc))
    before = _angle(p, q) + _angle(p, bc) + _angle(p, ca) + _angle(q, ad) + _angle(q, db)
    ridge = _angle(r, s)
    after = ridge + _angle(r, ca) + _angle(r, ad) + _angle(s, bc) + _angle(s, db)
    taken = (after < LESS * before) & (before - after > KINK) & (ridge > MAIN * after)
    taken &= _well_shaped(points, cad, p + q) & _well_shaped(points, dbc, p + q)
    return _Exchanges(
        np.column_stack([first, second])[taken], np.stack([cad, dbc], axis=1)[taken], (before - after)[taken]
    )


def _angle(a: Floats, b: Floats) -> Floats:
    """Angles (n,) between unit vectors (n, 3) [rad]; none where one is missing."""
    return np.nan_to_num(np.arccos(np.clip(dot(a, b), -1.0, 1.0)))


def _well_shaped(points: Floats, triangles: Ints, up: Floats) -> Bools:
    """Which triangles (t, 3) are seen from `up` (t, 3) and not slivers."""
    x, doubled = points[triangles], TriangleMesh(points, triangles).doubled
    squares = np.sum((np.roll(x, -1, axis=1) - x) ** 2, axis=(1, 2))
    return np.asarray((dot(doubled, up) > 0) & (squares < SLIVER * np.sqrt(dot(doubled, doubled))))
