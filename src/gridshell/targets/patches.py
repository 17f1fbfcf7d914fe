"""A smooth implicit field through points of a surface: small cubics, blended.

Around evenly spread centres c_i the surface is a cubic over its tangent plane, fitted to the points nearby by
weighted least squares: Q_i(x) = zeta - q_i(xi, eta). Gaussian weights of |x - c_i| blend them,

    F(x) = sum_i w_i Q_i / sum_i w_i,   w_i = exp(-|x - c_i|^2 / width^2),

a partition of unity [Ohtake et al. 2003, Multi-level partition of unity implicits] with weights that never vanish:
since |x - c_i|^2 - |x - c_j|^2 is linear in x, the blend is as smooth far off the surface as on it. F is smooth,
and its gradient and Hessian are exact, which is what Newton needs; a mesh's own facets have neither.
"""

from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gridshell.targets.target import Floats, Implicit

if TYPE_CHECKING:  # scipy.spatial costs a quarter of a second, and analytic targets do not need it
    from scipy.spatial import cKDTree

Ints = NDArray[np.intp]

WIDTH = 0.7  # of the spacing of centres: weights of the blend
NEGLIGIBLE = 20.0  # weights below exp(-20) of the largest change F by less than round-off changes a Newton step
TERMS = 10  # of a cubic in two variables


@dataclass(frozen=True, eq=False)
class PatchField:
    """Cubics over the tangent planes at `centres`.

    Parameters
    ----------
    centres : (m, 3) [m], about `spacing` [m] apart.
    frames : (m, 3, 3), rows: two tangents and the outward normal.
    coefficients : (m, 10) of 1, a, b, a^2, ab, b^2, a^3, a^2 b, a b^2, b^3 in a = xi / spacing, b = eta / spacing [m].
    spacing : [m].
    reach : F is NaN further than this from every centre [m].
    """

    centres: Floats
    frames: Floats
    coefficients: Floats
    spacing: float
    reach: float

    @cached_property
    def tree(self) -> "cKDTree":
        from scipy.spatial import cKDTree

        return cKDTree(self.centres)

    @cached_property
    def _near(self) -> tuple[Ints, Ints, Floats]:
        """Centres that can matter where a given one is nearest, nearest first: where each list begins, the lists in
        a row, and how far each centre is from the one whose list it is in [m]."""
        radius = self.spacing * (1.2 + WIDTH * NEGLIGIBLE**0.5)
        start, near = flat_lists(self.tree.query_ball_point(self.centres, radius))
        owner = np.repeat(np.arange(len(self.centres)), np.diff(start))
        away = np.linalg.norm(self.centres[near] - self.centres[owner], axis=1)
        order = np.lexsort((away, owner))
        return start, near[order], away[order]

    def nearest(self, x: Floats) -> tuple[Floats, Ints]:
        """Distance (n,) [m] of the points (n, 3) to the nearest centre, and which it is."""
        distance, index = self.tree.query(x)
        return np.asarray(distance), np.asarray(index)

    def implicit(self, x: Floats, *, second: bool = True) -> Implicit:
        """F, gradient and, unless they are not needed, second derivatives at the points (n, 3)."""
        known = np.asarray(np.isfinite(x).all(axis=1))
        distance, nearest = self.nearest(np.where(known[:, None], x, 0.0))
        value, gradient, hessian = np.empty(len(x)), np.empty((len(x), 3)), np.empty((len(x) if second else 0, 3, 3))
        start, near, away = self._near
        _blend(
            x, nearest, start, near, away, self.centres, self.frames, self.coefficients, self.spacing,
            np.empty((2, int(np.diff(start).max()))), second, value, gradient, hessian,
        )  # fmt: skip
        value[~known | (distance > self.reach)] = np.nan
        return Implicit(value, gradient, hessian)


def flat_lists(lists: Any) -> tuple[Ints, Ints]:
    """Lists in a row: where each begins (n + 1,), and their entries."""
    start = np.zeros(len(lists) + 1, dtype=np.intp)
    start[1:] = np.cumsum([len(entries) for entries in lists])
    return start, np.concatenate([np.asarray(entries, dtype=np.intp) for entries in lists])


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "arcp"})
def _blend(  # type: ignore[no-untyped-def]
    x, nearest, start, near, away, centres, frames, coefficients,
    spacing, room, second, value, gradient, hessian,
):  # fmt: skip
    """F, its gradient and Hessian. `room` (2, k): weight and Q of the patches that count.

    The weights' common factor cancels, so that log w_j = a_j . x + const with a_j = 2 (c_j - c_i) / width^2:
    grad F = sum w (grad Q + (Q - F) a) / W,
    hess F = sum w (hess Q + sym(grad Q, a) + (Q - F) a a) / W - sym(grad F, sum w a / W).
    """
    width2 = (WIDTH * spacing) ** 2
    for n in range(len(x)):
        i = nearest[n]
        px, py, pz = x[n, 0], x[n, 1], x[n, 2]
        least = (px - centres[i, 0]) ** 2 + (py - centres[i, 1]) ** 2 + (pz - centres[i, 2]) ** 2
        total, f = 0.0, 0.0
        furthest = np.sqrt(least) + np.sqrt(least + NEGLIGIBLE * width2)  # by the triangle's inequality
        stop = start[i]
        for k in range(start[i], start[i + 1]):
            if away[k] > furthest:
                break
            stop = k + 1
            j = near[k]
            dx, dy, dz = px - centres[j, 0], py - centres[j, 1], pz - centres[j, 2]
            fade = (dx * dx + dy * dy + dz * dz - least) / width2
            room[0, k - start[i]] = 0.0
            if fade < NEGLIGIBLE:
                e = frames[j]
                a = (e[0, 0] * dx + e[0, 1] * dy + e[0, 2] * dz) / spacing
                b = (e[1, 0] * dx + e[1, 1] * dy + e[1, 2] * dz) / spacing
                c = coefficients[j]
                q = c[0] + a * (c[1] + a * (c[3] + a * c[6])) + b * (c[2] + b * (c[5] + b * c[9]))
                q += a * b * (c[4] + a * c[7] + b * c[8])
                w = np.exp(-fade)
                room[0, k - start[i]] = w
                room[1, k - start[i]] = e[2, 0] * dx + e[2, 1] * dy + e[2, 2] * dz - q
                total += w
                f += w * room[1, k - start[i]]
        f /= total
        gx = gy = gz = ax = ay = az = 0.0
        hxx = hxy = hxz = hyy = hyz = hzz = 0.0
        for k in range(start[i], stop):
            w = room[0, k - start[i]] / total
            if w > 0.0:
                j = near[k]
                dx, dy, dz = px - centres[j, 0], py - centres[j, 1], pz - centres[j, 2]
                e = frames[j]
                a = (e[0, 0] * dx + e[0, 1] * dy + e[0, 2] * dz) / spacing
                b = (e[1, 0] * dx + e[1, 1] * dy + e[1, 2] * dz) / spacing
                c = coefficients[j]
                qa = -(c[1] + a * (2 * c[3] + 3 * a * c[6]) + b * (c[4] + 2 * a * c[7] + b * c[8])) / spacing
                qb = -(c[2] + b * (2 * c[5] + 3 * b * c[9]) + a * (c[4] + 2 * b * c[8] + a * c[7])) / spacing
                ux = qa * e[0, 0] + qb * e[1, 0] + e[2, 0]
                uy = qa * e[0, 1] + qb * e[1, 1] + e[2, 1]
                uz = qa * e[0, 2] + qb * e[1, 2] + e[2, 2]
                tx = 2 * (centres[j, 0] - centres[i, 0]) / width2
                ty = 2 * (centres[j, 1] - centres[i, 1]) / width2
                tz = 2 * (centres[j, 2] - centres[i, 2]) / width2
                off = room[1, k - start[i]] - f
                gx += w * (ux + off * tx)
                gy += w * (uy + off * ty)
                gz += w * (uz + off * tz)
                if not second:
                    continue
                qaa = -w * (2 * c[3] + 6 * a * c[6] + 2 * b * c[7]) / spacing**2
                qab = -w * (c[4] + 2 * a * c[7] + 2 * b * c[8]) / spacing**2
                qbb = -w * (2 * c[5] + 6 * b * c[9] + 2 * a * c[8]) / spacing**2
                ax += w * tx
                ay += w * ty
                az += w * tz
                mx, my, mz = w * (2 * ux + off * tx), w * (2 * uy + off * ty), w * (2 * uz + off * tz)
                vx, vy, vz = qaa * e[0, 0] + qab * e[1, 0], qaa * e[0, 1] + qab * e[1, 1], qaa * e[0, 2] + qab * e[1, 2]
                sx, sy, sz = qab * e[0, 0] + qbb * e[1, 0], qab * e[0, 1] + qbb * e[1, 1], qab * e[0, 2] + qbb * e[1, 2]
                hxx += vx * e[0, 0] + sx * e[1, 0] + mx * tx
                hyy += vy * e[0, 1] + sy * e[1, 1] + my * ty
                hzz += vz * e[0, 2] + sz * e[1, 2] + mz * tz
                hxy += vx * e[0, 1] + sx * e[1, 1] + 0.5 * (mx * ty + my * tx)
                hxz += vx * e[0, 2] + sx * e[1, 2] + 0.5 * (mx * tz + mz * tx)
                hyz += vy * e[0, 2] + sy * e[1, 2] + 0.5 * (my * tz + mz * ty)
        value[n] = f
        gradient[n, 0], gradient[n, 1], gradient[n, 2] = gx, gy, gz
        if not second:
            continue
        hessian[n, 0, 0], hessian[n, 1, 1], hessian[n, 2, 2] = hxx - 2 * gx * ax, hyy - 2 * gy * ay, hzz - 2 * gz * az
        hessian[n, 0, 1] = hessian[n, 1, 0] = hxy - gx * ay - gy * ax
        hessian[n, 0, 2] = hessian[n, 2, 0] = hxz - gx * az - gz * ax
        hessian[n, 1, 2] = hessian[n, 2, 1] = hyz - gy * az - gz * ay
