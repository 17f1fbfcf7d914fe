"""Bending of an isotropic, naturally straight rod [HQK Eq 1b]: E = (EI / 2l) |kappa|^2, |kappa| = 2 tan(phi/2).

With equal stiffness in both directions the material frames drop out, and the energy depends on the cosine
c = t_e . t_f of the turning angle alone: E = (2 EI / l) (1 - c) / (1 + c). The twist of such a rod is zero
in equilibrium unless something holds its angles, so that no twist angles are needed.
"""

from dataclasses import dataclass
from typing import Self

import numba as nb
import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.vectors import unit
from rodshell.rods.elements import NO_HESSIANS


@dataclass(frozen=True)
class IsotropicBend:
    """Bends between consecutive edges.

    Parameters
    ----------
    blocks : (b, 3) nodes: previous, middle, next.
    stiffness : (b,) EI over the Voronoi length of the rest state [N m].
    """

    blocks: Ints
    stiffness: Floats

    def curvatures(self, state: Floats) -> Floats:
        """(b,) |kappa| [-], integrated: the edges' unit vectors differ by 2 sin(phi/2), and add up to 2 cos(phi/2)."""
        x = state[self.blocks]
        before, after = unit(x[:, 1] - x[:, 0]), unit(x[:, 2] - x[:, 1])
        return np.asarray(2 * np.linalg.norm(after - before, axis=1) / np.linalg.norm(after + before, axis=1))

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        return float(_isotropic_bend(state, self.blocks, self.stiffness, gradient, hessians))

    def refreshed(self, state: Floats) -> Self:
        return self


@nb.njit(cache=True, error_model="numpy")
def _isotropic_bend(x, bends, stiffness, gradient, hessians):  # type: ignore[no-untyped-def]
    """Stencil (x_0, x_1, x_2) [m]; energies [J]. e = x_1 - x_0, f = x_2 - x_1; s, t their unit vectors."""
    wanted = hessians.shape[0] > 0
    hee, hef, hff = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    ge, gf, s, t = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    energy = 0.0
    for m in range(bends.shape[0]):
        i0, i1, i2 = bends[m, 0], bends[m, 1], bends[m, 2]
        le2, lf2 = 0.0, 0.0
        for k in range(3):
            s[k] = x[i1, k] - x[i0, k]
            t[k] = x[i2, k] - x[i1, k]
            le2 += s[k] * s[k]
            lf2 += t[k] * t[k]
        le, lf = np.sqrt(le2), np.sqrt(lf2)
        per_e, per_f = 1.0 / le, 1.0 / lf
        c, apart = 0.0, 0.0
        for k in range(3):
            s[k] /= le
            t[k] /= lf
            c += s[k] * t[k]
        for k in range(3):
            apart += (s[k] - t[k]) ** 2  # 2 (1 - c) without cancellation
        plus = 1.0 + c
        scale = 2.0 * stiffness[m]
        energy += scale * 0.5 * apart / plus
        first = -2.0 * scale / (plus * plus)  # dE/dc
        second = 4.0 * scale / (plus * plus * plus)  # d2E/dc2
        for k in range(3):
            ge[k] = (t[k] - c * s[k]) * per_e
            gf[k] = (s[k] - c * t[k]) * per_f
            gradient[i0, k] -= first * ge[k]
            gradient[i1, k] += first * (ge[k] - gf[k])
            gradient[i2, k] += first * gf[k]
        if wanted:
            per_e2, per_f2, per_ef = per_e * per_e, per_f * per_f, per_e * per_f
            for i in range(3):
                for j in range(3):
                    one = 1.0 if i == j else 0.0
                    cee = -(t[i] * s[j] + s[i] * t[j] + c * one - 3.0 * c * s[i] * s[j]) * per_e2
                    cff = -(s[i] * t[j] + t[i] * s[j] + c * one - 3.0 * c * t[i] * t[j]) * per_f2
                    cef = (one - s[i] * s[j] - t[i] * t[j] + c * s[i] * t[j]) * per_ef
                    hee[i, j] = first * cee + second * ge[i] * ge[j]
                    hff[i, j] = first * cff + second * gf[i] * gf[j]
                    hef[i, j] = first * cef + second * ge[i] * gf[j]
            for i in range(3):
                for j in range(3):
                    hessians[m, i, j] = hee[i, j]
                    hessians[m, i, j + 3] = hef[i, j] - hee[i, j]
                    hessians[m, i, j + 6] = -hef[i, j]
                    hessians[m, i + 3, j] = hef[j, i] - hee[i, j]
                    hessians[m, i + 3, j + 3] = hee[i, j] - hef[i, j] - hef[j, i] + hff[i, j]
                    hessians[m, i + 3, j + 6] = hef[i, j] - hff[i, j]
                    hessians[m, i + 6, j] = -hef[j, i]
                    hessians[m, i + 6, j + 3] = hef[j, i] - hff[i, j]
                    hessians[m, i + 6, j + 6] = hff[i, j]
    return energy
