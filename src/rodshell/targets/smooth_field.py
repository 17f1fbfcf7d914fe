"""A smooth implicit field through points of a surface: small cubics, blended.

Around evenly spread centres c_i the surface is a cubic over its tangent plane, fitted to the points nearby by
weighted least squares: Q_i(x) = zeta - q_i(xi, eta). Gaussian weights of |x - c_i| blend them,

    F(x) = sum_i w_i Q_i / sum_i w_i,   w_i = exp(-|x - c_i|^2 / width^2),

a partition of unity [Ohtake et al. 2003, Multi-level partition of unity implicits] with weights that never vanish:
since |x - c_i|^2 - |x - c_j|^2 is linear in x, the blend is as smooth far from the surface as on it. F is smooth,
and its gradient and Hessian are exact, as Newton's method needs; the facets of a mesh have neither.

Neighbours of points are found in a list of cells, searched by compiled loops: points of a surface lie evenly, so that
cells of one size are faster than a tree.
"""

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.kernels import njit
from rodshell.targets.target import Implicit

MOST_CELLS = 64  # of a cell list, for each of its points
WIDTH = 0.5  # of the spacing of centres: weights of the blend
NEGLIGIBLE = 16.0  # weights below exp(-16) of the largest change F by some 1e-10 of the spacing
TERMS = 10  # of a cubic in two variables


@dataclass(frozen=True, eq=False)
class CellList:
    """Points sorted into cells; make one with `CellList.of`.

    Args:
        points: (n, 3) [m].
        low: (3,) lower corner of the first cell [m].
        shape: (3,) number of cells along each axis.
        cell: width of a cell [m].
        start: (cells + 1,) where the points of each cell begin in `order`; cells are counted with z fastest.
        order: (n,) indices of the points, cell by cell.
    """

    points: Floats
    low: Floats
    shape: Ints
    cell: float
    start: Ints
    order: Ints

    @staticmethod
    def of(points: Floats, cell: float) -> "CellList":
        """Sort points (n, 3) [m] into cells of the width `cell` [m], wider where there would be too many."""
        if not np.isfinite(points).all():  # compiled loops use an index as it is
            raise InputError("a surface is so rough or folded that no smooth one follows it: smooth it")
        low, shape, cell = _lattice_over(points, cell)
        return CellList(points, low, shape, cell, *_sorted(points, low, shape, cell))

    @property
    def _lattice(self) -> tuple[Floats, Floats, Ints, float, Ints, Ints]:
        return self.points, self.low, self.shape, self.cell, self.start, self.order

    def nearest(self, x: Floats, count: int = 1, limit: float = np.inf) -> tuple[Floats, Ints]:
        """Distances (n, count) [m] and indices (n, count) of the points nearest to `x` (n, 3), nearest first.

        Those further away than the `limit` [m] need not be found; their distance is then infinite.
        """
        distance, index = np.full(len(x) * count, np.inf), np.zeros(len(x) * count, dtype=np.intp)
        _nearest(x, *self._lattice, count, limit, distance, index)
        return np.sqrt(distance).reshape(-1, count), index.reshape(-1, count)

    def within(self, x: Floats, radius: float, *, ordered: bool = False) -> tuple[Ints, Ints, Floats]:
        """All points within a radius [m] of each of `x` (m, 3), if `ordered` the nearest first: where the list of each
        begins (m + 1,), the lists one after the other (k,), and the distances (k,) [m]."""
        most = _most_within(x, *self._lattice, radius)
        begin, near, away = np.zeros(len(x) + 1, dtype=np.intp), np.empty(most, dtype=np.intp), np.empty(most)
        _within(x, *self._lattice, radius, ordered, begin, near, away)
        return begin, near[: begin[-1]], away[: begin[-1]]

    def spread(self, distance: float) -> Ints:
        """Indices of points at least `distance` [m] apart, such that every other point is closer to one of them."""
        free = np.ones(len(self.points), dtype=bool)
        _thin(*self._lattice, distance, free)
        return np.flatnonzero(free)


@njit("f2 f")
def _lattice_over(points, cell):  # type: ignore[no-untyped-def]
    """Corner, number of cells each way, and their width, for a lattice that holds all points."""
    low, high = points[0].copy(), points[0].copy()
    for n in range(len(points)):
        for k in range(3):
            low[k], high[k] = min(low[k], points[n, k]), max(high[k], points[n, k])
    while True:
        shape = np.floor((high - low) / cell) + 1.0
        if shape[0] * shape[1] * shape[2] <= MOST_CELLS * len(points):
            return low, shape.astype(np.intp), cell
        cell *= 1.3


@njit("f2 f1 i1 f")
def _sorted(points, low, shape, cell):  # type: ignore[no-untyped-def]
    """Sort points into their cells, by counting."""
    cells = np.zeros(len(points), dtype=np.intp)
    start = np.zeros(shape[0] * shape[1] * shape[2] + 1, dtype=np.intp)
    for n in range(len(points)):
        for k in range(3):
            cells[n] = cells[n] * shape[k] + int(np.floor((points[n, k] - low[k]) / cell))
        start[cells[n] + 1] += 1
    for k in range(1, len(start)):
        start[k] += start[k - 1]
    filled, order = start[:-1].copy(), np.empty(len(points), dtype=np.intp)
    for n in range(len(points)):
        order[filled[cells[n]]] = n
        filled[cells[n]] += 1
    return start, order


@njit()
def _box(x, n, low, shape, cell, reach):  # type: ignore[no-untyped-def]
    """First and last cell plus one along x, y and z, of those up to `reach` cells from that of the n-th point."""
    i, j, k = (
        int(np.floor((x[n, 0] - low[0]) / cell)), int(np.floor((x[n, 1] - low[1]) / cell)),
        int(np.floor((x[n, 2] - low[2]) / cell)),
    )  # fmt: skip
    k_from, k_stop = max(k - reach, 0), max(min(k + reach + 1, shape[2]), 0)
    i_from = max(i - reach, 0) if k_from < k_stop else shape[0]
    return i_from, min(i + reach + 1, shape[0]), max(j - reach, 0), min(j + reach + 1, shape[1]), k_from, k_stop


@njit()
def _square(x, n, points, c):  # type: ignore[no-untyped-def]
    """Square of the distance between the n-th and the c-th point."""
    return (x[n, 0] - points[c, 0]) ** 2 + (x[n, 1] - points[c, 1]) ** 2 + (x[n, 2] - points[c, 2]) ** 2


@njit()
def _keep(distance, index, first, last, d, c):  # type: ignore[no-untyped-def]
    """Insert c at the distance d into the entries `first` to `last`, which are in order; the last one is dropped."""
    k = last
    while k > first and distance[k - 1] > d:
        distance[k], index[k] = distance[k - 1], index[k - 1]
        k -= 1
    distance[k], index[k] = d, c


@njit("f2 f2 f1 i1 f i1 i1 i f f1 i1")
def _nearest(x, points, low, shape, cell, start, order, count, limit, distance, index):  # type: ignore[no-untyped-def]
    """Squares of distances. A neighbour is final once it is nearer than the cells that were not searched."""
    for n in range(len(x)):
        if not np.isfinite(x[n, 0] + x[n, 1] + x[n, 2]):
            continue
        first, last = n * count, (n + 1) * count - 1
        reach, found = 1, False
        while not found and (2 * reach + 1) ** 2 < len(points):  # searching more rows of cells would be slower
            distance[first : last + 1] = np.inf
            i_from, i_stop, j_from, j_stop, k_from, k_stop = _box(x, n, low, shape, cell, reach)
            for i in range(i_from, i_stop):
                for j in range(j_from, j_stop):
                    row = (i * shape[1] + j) * shape[2]
                    for q in range(start[row + k_from], start[row + k_stop]):
                        d = _square(x, n, points, order[q])
                        if d < distance[last]:
                            _keep(distance, index, first, last, d, order[q])
            found = reach * cell >= min(limit, np.sqrt(distance[last]))
            reach *= 2
        if not found:
            distance[first : last + 1] = np.inf
            for c in range(len(points)):
                d = _square(x, n, points, c)
                if d < distance[last]:
                    _keep(distance, index, first, last, d, c)


@njit("f2 f2 f1 i1 f i1 i1 f")
def _most_within(x, points, low, shape, cell, start, order, radius):  # type: ignore[no-untyped-def]
    """An upper bound of the entries of all lists together."""
    count, reach = 0, int(np.ceil(radius / cell))
    for n in range(len(x)):
        i_from, i_stop, j_from, j_stop, k_from, k_stop = _box(x, n, low, shape, cell, reach)
        for i in range(i_from, i_stop):
            for j in range(j_from, j_stop):
                row = (i * shape[1] + j) * shape[2]
                count += start[row + k_stop] - start[row + k_from]
    return count


@njit("f2 f2 f1 i1 f i1 i1 f b i1 i1 f1")
def _within(x, points, low, shape, cell, start, order, radius, ordered, begin, near, away):  # type: ignore[no-untyped-def]
    """List the neighbours one after the other; each list begins at `begin` (n + 1,)."""
    reach = int(np.ceil(radius / cell))
    for n in range(len(x)):
        last = begin[n]
        i_from, i_stop, j_from, j_stop, k_from, k_stop = _box(x, n, low, shape, cell, reach)
        for i in range(i_from, i_stop):
            for j in range(j_from, j_stop):
                row = (i * shape[1] + j) * shape[2]
                for q in range(start[row + k_from], start[row + k_stop]):
                    d = _square(x, n, points, order[q])
                    if d <= radius * radius:
                        _keep(away, near, begin[n] if ordered else last, last, np.sqrt(d), order[q])
                        last += 1
        begin[n + 1] = last


@njit("f2 f1 i1 f i1 i1 f b1")
def _thin(points, low, shape, cell, start, order, distance, free):  # type: ignore[no-untyped-def]
    """Each point that is still free removes the later ones that are too close to it."""
    reach = int(np.ceil(distance / cell))
    for n in range(len(points)):
        if not free[n]:
            continue
        i_from, i_stop, j_from, j_stop, k_from, k_stop = _box(points, n, low, shape, cell, reach)
        for i in range(i_from, i_stop):
            for j in range(j_from, j_stop):
                row = (i * shape[1] + j) * shape[2]
                for q in range(start[row + k_from], start[row + k_stop]):
                    if order[q] > n and _square(points, n, points, order[q]) <= distance * distance:
                        free[order[q]] = False


@dataclass(frozen=True, eq=False)
class SmoothField:
    """A smooth implicit function F, blended from cubics over tangent planes.

    Args:
        centres: (m, 3) points of the surface, about `spacing` apart [m].
        frames: (m, 3, 3) whose rows are two tangents and the outward normal.
        coefficients: (m, 10) of 1, a, b, a^2, ab, b^2, a^3, a^2 b, a b^2, b^3 in a = xi / spacing, b = eta / spacing
            [m].
        spacing: between centres [m].
        reach: F is NaN further than this from every centre [m].
    """

    centres: Floats
    frames: Floats
    coefficients: Floats
    spacing: float
    reach: float

    @cached_property
    def cells(self) -> CellList:
        """The centres, sorted for searches of the nearest."""
        return CellList.of(self.centres, self.spacing)

    @property
    def _radius(self) -> float:
        """Distance from a centre within which others contribute to F where it is the nearest [m]."""
        return float(self.spacing * (1.2 + WIDTH * NEGLIGIBLE**0.5))

    @cached_property
    def _near(self) -> tuple[Ints, Ints, Floats]:
        """For each centre, the centres that contribute where it is the nearest, nearest first: where each list begins,
        the lists in a row, and the distances [m]."""
        return CellList.of(self.centres, 0.5 * self._radius).within(self.centres, self._radius, ordered=True)

    @cached_property
    def _packed(self) -> Floats:
        """(m, 22) all numbers of each cubic: centre, tangents over the spacing, normal, coefficients."""
        tangents = self.frames[:, :2] / self.spacing
        return np.hstack([self.centres, tangents.reshape(-1, 6), self.frames[:, 2], self.coefficients])

    def nearest(self, x: Floats) -> tuple[Floats, Ints]:
        """Distance (n,) [m] of the points `x` (n, 3) to the nearest centre, and its index (n,)."""
        distance, index = self.cells.nearest(x)
        return distance[:, 0], index[:, 0]

    def implicit(self, x: Floats, *, second: bool = True) -> Implicit:
        """F and its derivatives at points `x` (n, 3) [m]; without the `second` ones the Hessian is empty."""
        distance, nearest = self.nearest(x)
        value, gradient, hessian = np.empty(len(x)), np.empty((len(x), 3)), np.empty((len(x) if second else 0, 3, 3))
        width2 = (WIDTH * self.spacing) ** 2
        lists = self._radius, *self._near, self._packed
        _blend(x, distance, nearest, *lists, width2, second, value, gradient, hessian)
        value[~(distance <= self.reach)] = np.nan
        return Implicit(value, gradient, hessian)


# Offsets of the quantities of four points in one array: so the compiler computes four sums at once.
LANES = 4
_X, _Y, _Z, _LEAST, _MOST, _D, _F, _GX, _GY, _GZ, _AX, _AY, _AZ = range(0, 13 * LANES, LANES)
_DXX, _DXY, _DXZ, _DYY, _DYZ, _DZZ, _HXX, _HXY, _HXZ, _HYY, _HYZ, _HZZ = range(13 * LANES, 25 * LANES, LANES)
_ALL = 25 * LANES


@njit("f2 f1 i1 f i1 i1 f1 f2 f b f1 f2 f3", fastmath={"contract", "reassoc", "arcp", "nsz"})
def _blend(  # type: ignore[no-untyped-def]
    x, distance, nearest, radius, start, near, away, packed, width2, second, value, gradient, hessian
):
    """F, its gradient and, if `second`, its Hessian, for up to four points at a time that share a list of cubics.

    The weights' common factor cancels, so that log w_j = t_j . x + const with t_j = 2 (c_j - c_i) / width^2:
    F = N / D, N = sum w Q, D = sum w, grad N = sum w (grad Q + Q t), grad D = sum w t = A,
    hess N = sum w (hess Q + 2 sym(grad Q, t) + Q t t), hess D = sum w t t.
    """
    work, first = np.zeros(_ALL), 0
    while first < len(x):
        i = nearest[first]
        count, furthest = _take(x, distance, first, packed[i], radius, width2, work)
        for k in range(start[i], start[i + 1]):
            if away[k] > furthest:
                break
            _add(packed[near[k]], packed[i], width2, second, work)
        for m in range(count):
            n, d, f = first + m, work[_D + m], work[_F + m] / work[_D + m]
            ax, ay, az = work[_AX + m], work[_AY + m], work[_AZ + m]
            gx, gy, gz = (work[_GX + m] - f * ax) / d, (work[_GY + m] - f * ay) / d, (work[_GZ + m] - f * az) / d
            value[n] = f
            gradient[n, 0], gradient[n, 1], gradient[n, 2] = gx, gy, gz
            if not second:
                continue
            hessian[n, 0, 0] = (work[_HXX + m] - f * work[_DXX + m] - 2 * gx * ax) / d
            hessian[n, 1, 1] = (work[_HYY + m] - f * work[_DYY + m] - 2 * gy * ay) / d
            hessian[n, 2, 2] = (work[_HZZ + m] - f * work[_DZZ + m] - 2 * gz * az) / d
            hessian[n, 0, 1] = hessian[n, 1, 0] = (work[_HXY + m] - f * work[_DXY + m] - gx * ay - gy * ax) / d
            hessian[n, 0, 2] = hessian[n, 2, 0] = (work[_HXZ + m] - f * work[_DXZ + m] - gx * az - gz * ax) / d
            hessian[n, 1, 2] = hessian[n, 2, 1] = (work[_HYZ + m] - f * work[_DYZ + m] - gy * az - gz * ay) / d
        first += count


@njit(error_model="numpy", forceinline=True)
def _take(x, distance, first, centre, radius, width2, work):  # type: ignore[no-untyped-def]
    """Start the sums of the point `first` and of those after it that can use its list. Returns their number, and the
    distance from its nearest centre up to which centres contribute to any of them, by the triangle inequality."""
    work[:] = 0.0
    count, furthest = 0, 0.0
    for m in range(LANES):
        n = min(first + m, len(x) - 1)
        least = (x[n, 0] - centre[0]) ** 2 + (x[n, 1] - centre[1]) ** 2 + (x[n, 2] - centre[2]) ** 2
        most = distance[n] ** 2 + NEGLIGIBLE * width2
        reach = np.sqrt(least) + np.sqrt(most)
        if m == count and first + m < len(x) and (m == 0 or reach <= radius):
            count, furthest = m + 1, max(furthest, reach)
        else:  # an unused lane
            n = first
        work[_X + m], work[_Y + m], work[_Z + m] = x[n, 0], x[n, 1], x[n, 2]
        work[_LEAST + m], work[_MOST + m] = least, (most - least) / width2
    return count, furthest


@njit(error_model="numpy", fastmath={"contract", "reassoc", "arcp", "nsz"}, forceinline=True)
def _add(p, centre, width2, second, work):  # type: ignore[no-untyped-def]
    """Add one cubic to the sums of four points; see `SmoothField._packed` for its numbers."""
    x, y, z = p[0], p[1], p[2]
    tx, ty, tz = (x - centre[0]) * 2 / width2, (y - centre[1]) * 2 / width2, (z - centre[2]) * 2 / width2
    e0, e1, e2, e3, e4, e5, n0, n1, n2 = p[3], p[4], p[5], p[6], p[7], p[8], p[9], p[10], p[11]
    c0, c1, c2, c3, c4, c5, c6, c7, c8, c9 = p[12], p[13], p[14], p[15], p[16], p[17], p[18], p[19], p[20], p[21]
    for m in range(LANES):
        dx, dy, dz = work[_X + m] - x, work[_Y + m] - y, work[_Z + m] - z
        fade = (dx * dx + dy * dy + dz * dz - work[_LEAST + m]) / width2
        w = _exponential(fade) if fade < work[_MOST + m] else 0.0
        a, b = e0 * dx + e1 * dy + e2 * dz, e3 * dx + e4 * dy + e5 * dz
        q = c0 + a * (c1 + a * (c3 + a * c6)) + b * (c2 + b * (c5 + b * c9)) + a * b * (c4 + a * c7 + b * c8)
        q = w * (n0 * dx + n1 * dy + n2 * dz - q)
        qa = w * (c1 + a * (2 * c3 + 3 * a * c6) + b * (c4 + 2 * a * c7 + b * c8))
        qb = w * (c2 + b * (2 * c5 + 3 * b * c9) + a * (c4 + 2 * b * c8 + a * c7))
        ux, uy, uz = w * n0 - qa * e0 - qb * e3, w * n1 - qa * e1 - qb * e4, w * n2 - qa * e2 - qb * e5
        work[_D + m] += w
        work[_F + m] += q
        work[_GX + m] += ux + q * tx
        work[_GY + m] += uy + q * ty
        work[_GZ + m] += uz + q * tz
        work[_AX + m] += w * tx
        work[_AY + m] += w * ty
        work[_AZ + m] += w * tz
        if second:
            qaa, qbb = w * (2 * c3 + 6 * a * c6 + 2 * b * c7), w * (2 * c5 + 6 * b * c9 + 2 * a * c8)
            qab = w * (c4 + 2 * a * c7 + 2 * b * c8)
            mx, my, mz = 2 * ux + q * tx, 2 * uy + q * ty, 2 * uz + q * tz
            vx, vy, vz = qaa * e0 + qab * e3, qaa * e1 + qab * e4, qaa * e2 + qab * e5
            sx, sy, sz = qab * e0 + qbb * e3, qab * e1 + qbb * e4, qab * e2 + qbb * e5
            work[_DXX + m] += w * tx * tx
            work[_DXY + m] += w * tx * ty
            work[_DXZ + m] += w * tx * tz
            work[_DYY + m] += w * ty * ty
            work[_DYZ + m] += w * ty * tz
            work[_DZZ + m] += w * tz * tz
            work[_HXX + m] += mx * tx - vx * e0 - sx * e3
            work[_HYY + m] += my * ty - vy * e1 - sy * e4
            work[_HZZ + m] += mz * tz - vz * e2 - sz * e5
            work[_HXY + m] += 0.5 * (mx * ty + my * tx) - vx * e1 - sx * e4
            work[_HXZ + m] += 0.5 * (mx * tz + mz * tx) - vx * e2 - sx * e5
            work[_HYZ + m] += 0.5 * (my * tz + mz * ty) - vy * e2 - sy * e5


@njit(error_model="numpy", fastmath={"contract", "reassoc", "arcp", "nsz"}, forceinline=True)
def _exponential(fade):  # type: ignore[no-untyped-def]
    """exp(-fade) by arithmetic alone, to 1e-9 up to a fade of 16: the series of its 64th root, squared six times."""
    y = fade / -64.0
    root = 1.0 + y * (1.0 + y / 2 * (1.0 + y / 3 * (1.0 + y / 4 * (1.0 + y / 5 * (1.0 + y / 6 * (1.0 + y / 7))))))
    root *= root
    root *= root
    root *= root
    root *= root
    root *= root
    return root * root
