"""Isotropic, naturally straight rods: equal stiffness in both directions makes the material frames drop out of bending.

    E = 1/(2l) [EI |kb|^2 + GJ (tau - n)^2],   |kb| = 2 tan(phi/2),   |kb|^2 = 4 (1 - c) / (1 + c),   c = te.tf

`IsotropicBend` is the first term alone [HQK Eq 1b], (2 EI/l) (1 - c) / (1 + c), a function of the turning angle. The
twist of such a rod is zero in equilibrium unless something holds its angles, so that it needs no twist angles.

`IsotropicBendTwist` is both terms [HQK Eq 1b, 1c]. Its bending is not softened by twist, as that of `BendTwist` is,
whose averaged curvature has the length |kb| cos(tau/2) (ERRATA E2). The twist tau = theta_f - theta_e + m_ref needs no
directors either: since the source, m_ref has grown by the angle that a frame turns by when it is transported around
the loop of the tangents and their sources, te -> se -> sf -> tf -> te, which is the solid angle of that loop: of two
triangles, each by

    tan(solid / 2) = a.(b x c) / (1 + a.b + b.c + c.a)   [Van Oosterom and Strackee 1983].
"""

from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np

from rodshell.arrays import Floats, Ints, State
from rodshell.geometry.frames import unit
from rodshell.kernels import njit
from rodshell.rods.bend_twist import BendTwist, spread
from rodshell.rods.elements import NO_HESSIANS, WithoutFrames
from rodshell.validation import brief

AT_ONCE = 64  # bends, whose numbers all stay in the processor's first cache


@dataclass(frozen=True, eq=False)
class IsotropicBend(WithoutFrames):
    """Bends between consecutive edges of rods without twist angles [HQK Eq 1b].

    Args:
        blocks: (b, 3) nodes: previous, middle, next.
        stiffness: (b,) EI over the Voronoi length of the rest state [N m].
    """

    blocks: Ints
    stiffness: Floats

    angle_columns: ClassVar[tuple[int, ...]] = ()
    moduli: ClassVar[tuple[int, ...]] = (0,)
    __repr__ = brief

    @property
    def bend_stiffness(self) -> Floats:
        """(b, 1) EI over the Voronoi length [N m]."""
        return self.stiffness[:, None]

    @property
    def parts(self) -> tuple[Self, ...]:
        """The energies of each stiffness alone: it has one."""
        return (self,)

    def with_stiffness(self, stiffness: Floats) -> Self:
        """See `BendElements.with_stiffness`."""
        return replace(self, stiffness=stiffness[:, 0].copy())

    def relaxed(self, state: State) -> Self:
        """The same: they are naturally straight."""
        return self

    def between(self, held: Self, t: float) -> Self:
        """The same, as of `relaxed`."""
        return self

    def strains(self, state: State) -> Floats:
        """(b, 3) |kappa| = 2 tan(phi/2) at `state` (N, 3), integrated [-]; without frames the other two are zero."""
        x = state[self.blocks]
        before, after = unit(x[:, 1] - x[:, 0]), unit(x[:, 2] - x[:, 1])
        # unit vectors at an angle phi differ by 2 sin(phi/2) and add up to 2 cos(phi/2)
        curvature = 2 * np.linalg.norm(after - before, axis=1) / np.linalg.norm(after + before, axis=1)
        return np.column_stack([curvature, 0 * curvature, 0 * curvature])

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        return float(_isotropic_bend(state, self.blocks, self.stiffness, gradient, hessians))


@dataclass(frozen=True, eq=False)
class IsotropicBendTwist(BendTwist):
    """As `BendTwist`, with EI1 = EI2 = `bend_stiffness[:, 0]` and no natural curvature.

    In buckling, bending keeps its stiffness: it knows no frames, and no strains that could stay while moments change.
    """

    moduli: ClassVar[tuple[int, ...]] = (0, 2)
    __repr__ = brief

    def relaxed(self, state: State) -> Self:
        """The same elements with the twist of `state` as their natural twist: these rods are naturally straight."""
        return replace(self, natural_twist=self.strains(state)[:, 2].copy())

    @property
    def parts(self) -> tuple[Self, ...]:
        """The bending and the twist."""
        bend, twist = self.bend_stiffness, self.twist_stiffness
        return replace(self, twist_stiffness=0.0 * twist), replace(self, bend_stiffness=0.0 * bend)

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        return float(
            _isotropic_bend_twist(
                state,
                self.blocks,
                self.bend_stiffness,
                self.twist_stiffness,
                self.natural_twist,
                self.source_tangents,
                self.source_twist,
                gradient,
                hessians,
            )
        )


@njit("f2 i2 f1 f2 f3", nogil=True)
def _isotropic_bend(x, bends, stiffness, gradient, hessians):  # type: ignore[no-untyped-def]
    """Stencil (x_0, x_1, x_2) [m]; energies [J]. e = x_1 - x_0, f = x_2 - x_1; s, t their unit vectors.

    Bends are taken `AT_ONCE`, with a row for each component, so that the loops along rows are vectorised: ge, gf are
    the derivatives of c = s.t by e and f; first, second those of the energy by c.
    """
    s, t, ge, gf = np.empty((3, AT_ONCE)), np.empty((3, AT_ONCE)), np.empty((3, AT_ONCE)), np.empty((3, AT_ONCE))
    rows, energy = np.empty((6, AT_ONCE)), 0.0
    c, first, second, per_e, per_f, local = rows[0], rows[1], rows[2], rows[3], rows[4], rows[5]
    s0, s1, s2, t0, t1, t2 = s[0], s[1], s[2], t[0], t[1], t[2]
    for start in range(0, len(bends), AT_ONCE):
        size = min(AT_ONCE, len(bends) - start)
        for m in range(size):
            i0, i1, i2 = bends[start + m, 0], bends[start + m, 1], bends[start + m, 2]
            for k in range(3):
                s[k, m], t[k, m] = x[i1, k] - x[i0, k], x[i2, k] - x[i1, k]
            local[m] = 2.0 * stiffness[start + m]
        _to_units(s0, s1, s2, per_e, size)
        _to_units(t0, t1, t2, per_f, size)
        for m in range(size):
            c[m] = s0[m] * t0[m] + s1[m] * t1[m] + s2[m] * t2[m]
            apart = (s0[m] - t0[m]) ** 2 + (s1[m] - t1[m]) ** 2 + (s2[m] - t2[m]) ** 2  # 2 (1 - c), no cancellation
            plus, scale = 1.0 + c[m], local[m]
            local[m] = scale * 0.5 * apart / plus
            first[m], second[m] = -2.0 * scale / (plus * plus), 4.0 * scale / (plus * plus * plus)
        for k in range(len(s)):
            sk, tk, ek, fk = s[k], t[k], ge[k], gf[k]
            for m in range(size):
                ek[m], fk[m] = (tk[m] - c[m] * sk[m]) * per_e[m], (sk[m] - c[m] * tk[m]) * per_f[m]
        for m in range(size):
            i0, i1, i2 = bends[start + m, 0], bends[start + m, 1], bends[start + m, 2]
            energy += local[m]
            for k in range(3):
                gradient[i0, k] -= first[m] * ge[k, m]
                gradient[i1, k] += first[m] * (ge[k, m] - gf[k, m])
                gradient[i2, k] += first[m] * gf[k, m]
        if hessians.shape[0] > 0:
            _bend_hessians(s, t, ge, gf, c, first, second, per_e, per_f, start, size, hessians)
    return energy


@njit(error_model="numpy")
def _to_units(x, y, z, per_length, size):  # type: ignore[no-untyped-def]
    """Scale the `size` first vectors to length 1; one over their lengths."""
    for m in range(size):
        length = np.sqrt(x[m] * x[m] + y[m] * y[m] + z[m] * z[m])
        x[m], y[m], z[m], per_length[m] = x[m] / length, y[m] / length, z[m] / length, 1.0 / length


@njit(error_model="numpy", inline="always")
def _bend_hessians(s, t, ge, gf, c, first, second, per_e, per_f, start, size, hessians):  # type: ignore[no-untyped-def]
    """Of the bends from `start` on; arguments as in `_isotropic_bend`."""
    hee, hef, hff = np.empty((3, 3, AT_ONCE)), np.empty((3, 3, AT_ONCE)), np.empty((3, 3, AT_ONCE))
    for i in range(len(s)):  # a length that is not known when it is compiled, else nine loops are
        for j in range(len(s)):
            si, ti, ei, fi, sj, tj, ej, fj = s[i], t[i], ge[i], gf[i], s[j], t[j], ge[j], gf[j]
            ee, ef, ff, delta = hee[i, j], hef[i, j], hff[i, j], 1.0 if i == j else 0.0
            for m in range(size):
                cee = -(ti[m] * sj[m] + si[m] * tj[m] + c[m] * delta - 3.0 * c[m] * si[m] * sj[m])
                cff = -(si[m] * tj[m] + ti[m] * sj[m] + c[m] * delta - 3.0 * c[m] * ti[m] * tj[m])
                cef = delta - si[m] * sj[m] - ti[m] * tj[m] + c[m] * si[m] * tj[m]
                ee[m] = first[m] * (cee * (per_e[m] * per_e[m])) + second[m] * ei[m] * ej[m]
                ff[m] = first[m] * (cff * (per_f[m] * per_f[m])) + second[m] * fi[m] * fj[m]
                ef[m] = first[m] * (cef * (per_e[m] * per_f[m])) + second[m] * ei[m] * fj[m]
    for m in range(size):
        hessian = hessians[start + m]
        for i in range(3):
            for j in range(3):
                ee, ef, fe, ff = hee[i, j, m], hef[i, j, m], hef[j, i, m], hff[i, j, m]
                hessian[i, j], hessian[i, j + 3], hessian[i, j + 6] = ee, ef - ee, -ef
                hessian[i + 3, j], hessian[i + 3, j + 3], hessian[i + 3, j + 6] = fe - ee, ee - ef - fe + ff, ef - ff
                hessian[i + 6, j], hessian[i + 6, j + 3], hessian[i + 6, j + 6] = -fe, fe - ff, ff


@njit("f2 i2 f2 f1 f1 f3 f1 f2 f3", nogil=True, fastmath={"contract"})
def _isotropic_bend_twist(x, stencils, bend, twist, natural_twist, sources, source_twist, gradient, hessians):  # type: ignore[no-untyped-def]
    """Stencil (x_0, theta_e, x_1, theta_f, x_2) [m, rad]; energies [J].

    Derivatives by the edges e and f: of c, of tau, and of E; `spin` is w of `bend_twist`, times |e|.
    """
    wanted = hessians.shape[0] > 0
    te, tf, mid, binormal = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    spin_e, spin_f, half_e, half_f = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    ce, cf, ue, uf = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    we, wf, be, bf, turned = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty((3, 3))
    hee, hef, hff = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    energy = 0.0
    for b in range(stencils.shape[0]):
        i0, ie, i1, jf, i2 = stencils[b, 0], stencils[b, 1], stencils[b, 2], stencils[b, 3], stencils[b, 4]
        le, lf = 0.0, 0.0
        for k in range(3):
            te[k], tf[k] = x[i1, k] - x[i0, k], x[i2, k] - x[i1, k]
            le += te[k] * te[k]
            lf += tf[k] * tf[k]
        le, lf = 1.0 / np.sqrt(le), 1.0 / np.sqrt(lf)  # from here on 1 / length
        c, apart, both_e, both_f, across, between = 0.0, 0.0, 1.0, 1.0, 0.0, 0.0
        for k in range(3):
            te[k] *= le
            tf[k] *= lf
            c += te[k] * tf[k]
            both_e += sources[b, 0, k] * te[k]
            both_f += sources[b, 1, k] * tf[k]
            across += te[k] * sources[b, 1, k]
            between += sources[b, 0, k] * sources[b, 1, k]
            apart += (te[k] - tf[k]) ** 2  # 2 (1 - c) without cancellation
        plus = 1.0 + c
        per_plus, per_e, per_f = 1.0 / plus, 1.0 / both_e, 1.0 / both_f
        volume_s, volume_t = 0.0, 0.0  # te.(se x sf) and te.(sf x tf)
        for k in range(3):
            k1, k2 = (k + 1) % 3, (k + 2) % 3
            se1, se2, sf1, sf2 = sources[b, 0, k1], sources[b, 0, k2], sources[b, 1, k1], sources[b, 1, k2]
            volume_s += te[k] * (se1 * sf2 - se2 * sf1)
            volume_t += te[k] * (sf1 * tf[k2] - sf2 * tf[k1])
            spin_e[k] = (se1 * te[k2] - se2 * te[k1]) * per_e
            spin_f[k] = (sf1 * tf[k2] - sf2 * tf[k1]) * per_f
            binormal[k] = (te[k1] * tf[k2] - te[k2] * tf[k1]) * per_plus  # kb/2
        sum_s, sum_t = both_e + between + across, both_f + c + across
        solid = 2.0 * np.arctan2(volume_s * sum_t + volume_t * sum_s, sum_s * sum_t - volume_s * volume_t)
        solid -= 2.0 * np.pi * np.floor(solid / (2.0 * np.pi) + 0.5)
        off = source_twist[b] + solid + x[jf, 0] - x[ie, 0] - natural_twist[b]
        torque = twist[b] * off
        scale = 2.0 * bend[b, 0]
        first = -2.0 * scale * per_plus * per_plus  # dE/dc
        energy += 0.5 * (scale * apart * per_plus + torque * off)
        for k in range(3):
            ce[k], cf[k] = (tf[k] - c * te[k]) * le, (te[k] - c * tf[k]) * lf
            ue[k], uf[k] = (binormal[k] + spin_e[k]) * le, (binormal[k] - spin_f[k]) * lf
            ge, gf = first * ce[k] + torque * ue[k], first * cf[k] + torque * uf[k]
            gradient[i0, k] -= ge
            gradient[i1, k] += ge - gf
            gradient[i2, k] += gf
        gradient[ie, 0] -= torque
        gradient[jf, 0] += torque
        if not wanted:
            continue

        # d2E = E'' dc dc + E' d2c + GJ/l dtau dtau + torque d2tau
        second, g = -2.0 * first * per_plus, twist[b]
        pull, push = 0.5 * torque * le * le, 0.5 * torque * lf * lf
        for k in range(3):
            mid[k] = (te[k] + tf[k]) * per_plus
            half_e[k] = te[k] + (sources[b, 0, k] + te[k]) * per_e
            half_f[k] = tf[k] + (sources[b, 1, k] + tf[k]) * per_f
            we[k], wf[k] = te[k] + mid[k], tf[k] + mid[k]
            turned[k, k] = 0.0
        fe, ff, ef = first * le * le, first * lf * lf, first * le * lf
        cross = torque * le * lf * per_plus
        for k in range(3):
            k1, k2 = (k + 1) % 3, (k + 2) % 3
            turned[k, k1], turned[k1, k] = -cross * te[k2], cross * te[k2]
        bend_ef = torque * le * lf
        for i in range(3):
            for j in range(i + 1):
                diagonal = c if i == j else 0.0
                value = fe * (3.0 * c * te[i] * te[j] - tf[i] * te[j] - te[i] * tf[j] - diagonal)
                value += second * ce[i] * ce[j] + g * ue[i] * ue[j]
                value -= pull * (
                    binormal[i] * we[j] + we[i] * binormal[j] + spin_e[i] * half_e[j] + half_e[i] * spin_e[j]
                )
                hee[i, j] = hee[j, i] = value
                value = ff * (3.0 * c * tf[i] * tf[j] - tf[i] * te[j] - te[i] * tf[j] - diagonal)
                value += second * cf[i] * cf[j] + g * uf[i] * uf[j]
                value -= push * (
                    binormal[i] * wf[j] + wf[i] * binormal[j] - spin_f[i] * half_f[j] - half_f[i] * spin_f[j]
                )
                hff[i, j] = hff[j, i] = value
            for j in range(3):
                delta = 1.0 if i == j else 0.0
                value = ef * (delta - te[i] * te[j] - tf[i] * tf[j] + c * te[i] * tf[j])
                value += second * ce[i] * cf[j] + g * ue[i] * uf[j] + turned[i, j]
                hef[i, j] = value - bend_ef * binormal[i] * mid[j]
        for k in range(3):
            be[k], bf[k] = g * ue[k], g * uf[k]
            ce[k], cf[k] = -be[k], -bf[k]
        spread(hee, hef, hff, ce, be, cf, bf, g, -g, g, hessians[b])
    return energy
