"""Bending and twist of a rod of any section, with natural curvature and twist [HQK Eq 1b and 1c].

    E = 1/(2l) [EI1 (k1 - n1)^2 + EI2 (k2 - n2)^2 + GJ (tau - n3)^2],   l the Voronoi length of the rest state

The strains are those of Bergou et al. 2010, whom HQK cite. With t the unit tangents of the edges e and f on
either side of a node, (m1, m2) their material frames and kb = 2 te x tf / (1 + te.tf), |kb| = 2 tan(phi/2),

    k1 = kb.(m2e + m2f)/2,   k2 = -kb.(m1e + m1f)/2,   which is   ki = (tf.mie - te.mif) / (1 + te.tf),
    tau = theta_f - theta_e + m_ref.

So ki is the turn of the tangent towards mi, and EIi resists it. Averaged over two frames that differ by the
twist, the curvature (k1, k2) has the length |kb| cos(tau/2): twist softens a sharp bend (ERRATA E2).

Reference frames. The twist angle theta turns the material frame from the reference frame (t, d1, d2). Each
element keeps a *source* for its two edges: a tangent and a director d1. The reference frame at a state is the
source turned by the smallest rotation that takes its tangent to the present one; m_ref is the angle between
the two frames of a node, on the branch next to the source's. The energy is thus a function of the state,
given the source, and what is usually left out follows: while its tangent moves by dt, the frame, which still
starts from the source s, spins about t by minus the solid angle of the triangle (s, t, t + dt),

    d psi = -w.de,   w = (s x t) / ((1 + s.t) |e|),

and a spin acts like a change of theta. So grad_e is the usual gradient, that of frames which do not spin,
minus w dE/dtheta. As for the Hessian, the derivative of the usual gradient has an antisymmetric part,
dE/dtheta [t]x / (2 |e|^2) at e, which the derivative of w takes away. Gradient and Hessian are exact at every
state; where state and source agree, w = 0. Refresh at each accepted iterate, and compare energies from one
source. An edge that turns by half a revolution from its source has no frame: the energy is then not finite.
The branch of m_ref holds while m_ref changes by less than pi, which a node that is nearly folded may exceed.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Self

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats, Ints, State
from rodshell.geometry.frames import adapted, cross, dot, parallel_transport, signed_angle, unit
from rodshell.kernels import njit
from rodshell.rods.elements import NO_HESSIANS, Elements
from rodshell.validation import brief


@dataclass(frozen=True, eq=False)
class BendTwist:
    """Bends and twists between consecutive edges of rods or linkers [HQK Eq 1b, 1c]. Build it with `starting_at`.

    Args:
        blocks: (b, 5) node, twist angle of edge e, node, twist angle of edge f, node; e and f go from node to
            node in this order. Elements that share an edge agree on its direction and its reference frame.
        bend_stiffness: (b, 2) EI1 and EI2 over the Voronoi length of the rest state [N m]; EI1 resists bends
            towards m1 (and so about m2), EI2 bends towards m2.
        twist_stiffness: (b,) GJ over the same length [N m].
        natural_curvature: (b, 2) curvatures (k1, k2) at rest [-].
        natural_twist: (b,) twist at rest [rad].
        source_tangents, source_directors: (b, 2, 3) t and d1 of e and f in their source frames.
        source_twist: (b,) reference twist m_ref of the source frames [rad].
    """

    blocks: Ints
    bend_stiffness: Floats
    twist_stiffness: Floats
    natural_curvature: Floats
    natural_twist: Floats
    source_tangents: Floats
    source_directors: Floats
    source_twist: Floats

    angle_columns: ClassVar[tuple[int, ...]] = (1, 3)
    moduli: ClassVar[tuple[int, ...]] = (0, 1, 2)
    __repr__ = brief

    @classmethod
    def starting_at(
        cls,
        blocks: Ints,
        state: State,
        directors: ArrayLike,
        *,
        bend_stiffness: ArrayLike,
        twist_stiffness: ArrayLike,
        natural_curvature: ArrayLike = 0.0,
        natural_twist: ArrayLike = 0.0,
    ) -> Self:
        """Elements whose source frames are those of `state`.

        Args:
            blocks: (b, 5), see the class.
            directors: (N, 3), in the row of each twist angle the first director of its edge; or (3,), the same for
                all, such as z on a flat grid. Only their part perpendicular to the edge is used.
            bend_stiffness, twist_stiffness, natural_curvature, natural_twist: see the class; broadcast over the
                elements.
        """
        count = len(blocks)
        tangents = _tangents(state, blocks)
        wanted = np.broadcast_to(np.asarray(directors, dtype=float), state.shape)[blocks[:, 1:4:2]]
        first_directors = adapted(wanted, tangents)
        return cls(
            np.ascontiguousarray(blocks),
            np.broadcast_to(np.asarray(bend_stiffness, dtype=float), (count, 2)).copy(),
            np.broadcast_to(np.asarray(twist_stiffness, dtype=float), (count,)).copy(),
            np.broadcast_to(np.asarray(natural_curvature, dtype=float), (count, 2)).copy(),
            np.broadcast_to(np.asarray(natural_twist, dtype=float), (count,)).copy(),
            tangents,
            first_directors,
            _reference_twist(tangents, first_directors),
        )

    def relaxed(self, state: State) -> Self:
        """The same elements with `state` (N, 3) as their stress-free state, as linkers have the flat grid."""
        strains = self.strains(state)
        return replace(self, natural_curvature=strains[:, :2].copy(), natural_twist=strains[:, 2].copy())

    def between(self, held: Self, t: float) -> Self:
        """See `BendElements.between`."""
        if t >= 1 or held is self:
            return self
        return replace(
            self,
            natural_curvature=(1 - t) * held.natural_curvature + t * self.natural_curvature,
            natural_twist=(1 - t) * held.natural_twist + t * self.natural_twist,
        )

    def with_stiffness(self, stiffness: Floats) -> Self:
        """See `BendElements.with_stiffness`; without bending they stay so."""
        bend = stiffness[:, :2].copy() if self.bend_stiffness.any() else 0.0 * self.bend_stiffness
        return replace(self, bend_stiffness=bend, twist_stiffness=stiffness[:, 2].copy())

    @property
    def parts(self) -> tuple[Self, ...]:
        """The energies of each stiffness alone, EI1, EI2 and GJ, of which this one is the sum."""
        bend, no_bend, no_twist = self.bend_stiffness, 0.0 * self.bend_stiffness, 0.0 * self.twist_stiffness
        return (
            replace(self, bend_stiffness=bend * [1.0, 0.0], twist_stiffness=no_twist),
            replace(self, bend_stiffness=bend * [0.0, 1.0], twist_stiffness=no_twist),
            replace(self, bend_stiffness=no_bend),
        )

    def strains(self, state: State) -> Floats:
        """(b, 3) curvatures k1, k2 (integrated, [-]) and twist tau [rad] at `state` (N, 3)."""
        moved = self.refreshed(state)
        theta, m1 = state[self.blocks[:, 1:4:2], 0], moved.material_directors(state)
        te, tf = moved.source_tangents[:, 0], moved.source_tangents[:, 1]
        both = 1.0 + dot(te, tf)
        m2 = cross(moved.source_tangents, m1)
        k1, k2 = ((dot(tf, m[:, 0]) - dot(te, m[:, 1])) / both for m in (m1, m2))
        return np.column_stack([k1, k2, theta[:, 1] - theta[:, 0] + moved.source_twist])

    def material_directors(self, state: State) -> Floats:
        """(b, 2, 3) directors m1 of e and f; `state` is that of the source frames, see `refreshed`."""
        theta = state[self.blocks[:, 1:4:2], 0, None]
        d1 = self.source_directors
        return np.asarray(np.cos(theta) * d1 + np.sin(theta) * cross(self.source_tangents, d1))

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        return float(
            _bend_twist(
                state,
                self.blocks,
                self.bend_stiffness,
                self.twist_stiffness,
                self.natural_curvature,
                self.natural_twist,
                self.source_tangents,
                self.source_directors,
                self.source_twist,
                gradient,
                hessians,
            )
        )

    def stress_stiffness(self, state: State, motion: Floats, hessians: Floats) -> None:
        """Of the change of the moments: see `Stressed.stress_stiffness`.

        The energy is quadratic in the strains, so that natural strains less by their change add just these moments.
        """
        strains = _strain_rates(self, state, motion)
        less = replace(
            self,
            natural_curvature=self.natural_curvature - strains[:, :2],
            natural_twist=self.natural_twist - strains[:, 2],
        )
        scrap, before = np.zeros_like(state), np.zeros_like(hessians)
        self.evaluate(state, scrap, before)
        less.evaluate(state, scrap, hessians)
        hessians -= before

    def refreshed(self, state: State) -> Self:
        """The same elements with their source frames at `state` (N, 3): strains and angles do not change."""
        source = self.source_tangents, self.source_directors, self.source_twist
        tangents, directors, twist = (np.empty_like(part) for part in source)
        _transported(state, self.blocks, *source, tangents, directors, twist)
        same = self.blocks, self.bend_stiffness, self.twist_stiffness, self.natural_curvature, self.natural_twist
        return type(self)(*same, tangents, directors, twist)  # not `replace`, which is slow at each step of a motion


PROBE = 1e-5  # of the shortest edge, or rad: motion over which the change of strains is taken; good to 1e-9


def frames_among(sets: Sequence[Elements]) -> BendTwist | None:
    """The first of these energies that carries frames of rods."""
    return next((elements for elements in sets if isinstance(elements, BendTwist)), None)


def _strain_rates(elements: BendTwist, state: State, motion: Floats) -> Floats:
    """(b, 3) derivative of the strains along a motion, by central differences.

    Args:
        elements: their source frames being at, or near, the state.
        state, motion: (N, 3) [m, rad].
    """
    apart, moved = state[elements.blocks[:, 2:5:2]] - state[elements.blocks[:, 0:3:2]], np.abs(motion[elements.blocks])
    moved[:, ::2] /= np.linalg.norm(apart, axis=2).min(initial=np.inf)
    largest = float(moved.max(initial=0.0))
    if largest == 0:
        return np.zeros((len(elements.blocks), 3))
    step = PROBE / largest
    ahead, behind = (elements.strains(state + side * step * motion) for side in (1.0, -1.0))
    return np.asarray((ahead - behind) / (2 * step))


def _tangents(state: State, blocks: Ints) -> Floats:
    """(b, 2, 3) unit tangents of the edges e and f."""
    return unit(state[blocks[:, 2:5:2]] - state[blocks[:, 0:3:2]])


def _reference_twist(tangents: Floats, directors: Floats) -> Floats:
    """(b,) angles from the frame of e, transported along the rod to f, to the frame of f, in (-pi, pi] [rad]."""
    te, tf = tangents[:, 0], tangents[:, 1]
    return signed_angle(parallel_transport(directors[:, 0], te, tf), directors[:, 1], tf)


@njit(error_model="numpy", fastmath={"contract"})
def _shares_edge(stencils, b):  # type: ignore[no-untyped-def]
    """Whether the edge e of element b is the edge f of the delta before it, as along a rod; both have one frame."""
    if b == 0:
        return False
    before, here = stencils[b - 1], stencils[b]
    return here[1] == before[3] and here[0] == before[2] and here[2] == before[4]


@njit("f2 i2 f3 f3 f1 f3 f3 f1", fastmath={"contract"})
def _transported(x, stencils, sources, source_directors, source_twist, tangents, directors, twist):  # type: ignore[no-untyped-def]
    """Frames and reference twists transported from the sources to the state x; fills the last three arguments."""
    for b in range(stencils.shape[0]):
        for s in range(2):
            t, d = tangents[b, s], directors[b, s]
            if s == 0 and _shares_edge(stencils, b):
                for k in range(3):
                    t[k], d[k] = tangents[b - 1, 1, k], directors[b - 1, 1, k]
                continue
            i0, i1 = stencils[b, 2 * s], stencils[b, 2 * s + 2]
            square, along, both = 0.0, 0.0, 1.0
            for k in range(3):
                t[k] = x[i1, k] - x[i0, k]
                square += t[k] * t[k]
            shorten = 1.0 / np.sqrt(square)
            for k in range(3):
                t[k] *= shorten
                both += sources[b, s, k] * t[k]
                along += source_directors[b, s, k] * t[k]
            off, square, share = 0.0, 0.0, along / both
            for k in range(3):
                d[k] = source_directors[b, s, k] - share * (sources[b, s, k] + t[k])
                off += d[k] * t[k]
                square += d[k] * d[k]
            for k in range(3):  # to first order; keeps round-off from building up over many refreshes
                d[k] = (1.5 - 0.5 * square) * d[k] - off * t[k]
        te, tf, de, df = tangents[b, 0], tangents[b, 1], directors[b, 0], directors[b, 1]
        plus, ahead, ahead2, behind, same, turned = 1.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(3):
            k1, k2 = (k + 1) % 3, (k + 2) % 3
            second = te[k1] * de[k2] - te[k2] * de[k1]
            plus += te[k] * tf[k]
            ahead += tf[k] * de[k]
            ahead2 += tf[k] * second
            behind += te[k] * df[k]
            same += de[k] * df[k]
            turned += second * df[k]
        behind /= plus
        angle = np.arctan2(turned - ahead2 * behind, same - ahead * behind)
        twist[b] = angle + 2.0 * np.pi * np.floor((source_twist[b] - angle) / (2.0 * np.pi) + 0.5)


@njit("f2 i2 f2 f1 f2 f1 f3 f3 f1 f2 f3", nogil=True, fastmath={"contract"})
def _bend_twist(  # type: ignore[no-untyped-def]
    x, stencils, bend, twist, natural, natural_twist, tangents, directors, source_twist, gradient, hessians
):
    """Stencil (x_0, theta_e, x_1, theta_f, x_2) [m, rad]; energies [J], from HQK Eq 1b, 1c and Bergou 2010.

    Derivatives are taken by (e, theta_e, f, theta_f), 8 components, and then spread over the stencil.
    First index 0 is e and 1 is f; "across" means perpendicular to the edge's own tangent.
    """
    wanted = hessians.shape[0] > 0
    t, m1, m2 = np.empty((2, 3)), np.empty((2, 3)), np.empty((2, 3))
    w, half = np.empty((2, 3)), np.empty((2, 3))  # spin; (source + present tangent) / (1 + their product)
    d1, d2, short = np.empty(3), np.empty(3), np.empty(2)  # short: 1 / length
    mid, binormal = np.empty(3), np.empty(3)  # (te + tf) / (1 + te.tf) and kb/2
    p, q = np.empty((2, 3)), np.empty((2, 3))  # derivatives of k1 and k2 by te and by tf
    strain, stiffness, force = np.empty((3, 8)), np.empty(3), np.empty(3)  # of k1, k2, tau
    m, other, turned = np.empty((2, 3)), np.empty((2, 3)), np.empty((3, 3))  # m: force-weighted directors
    sp, sq, ye, yf, se, sf = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    he3, he7, hf3, hf7, ue, uf = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    g, hee, hef, hff = np.empty(8), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    energy = 0.0
    for b in range(stencils.shape[0]):
        for s in range(2):  # frames of both edges
            if s == 0 and _shares_edge(stencils, b):
                for k in range(3):
                    t[0, k], m1[0, k], m2[0, k], w[0, k], half[0, k] = t[1, k], m1[1, k], m2[1, k], w[1, k], half[1, k]
                short[0] = short[1]
                continue
            i0, i1 = stencils[b, 2 * s], stencils[b, 2 * s + 2]
            square = 0.0
            for k in range(3):
                t[s, k] = x[i1, k] - x[i0, k]
                square += t[s, k] * t[s, k]
            short[s] = 1.0 / np.sqrt(square)
            both, along = 1.0, 0.0
            for k in range(3):
                t[s, k] *= short[s]
                both += tangents[b, s, k] * t[s, k]
                along += directors[b, s, k] * t[s, k]
            shorten = 1.0 / both
            for k in range(3):
                half[s, k] = (tangents[b, s, k] + t[s, k]) * shorten
                d1[k] = directors[b, s, k] - along * half[s, k]
            for k in range(3):
                k1, k2 = (k + 1) % 3, (k + 2) % 3
                d2[k] = t[s, k1] * d1[k2] - t[s, k2] * d1[k1]
                w[s, k] = (tangents[b, s, k1] * t[s, k2] - tangents[b, s, k2] * t[s, k1]) * shorten * short[s]
            theta = x[stencils[b, 2 * s + 1], 0]
            cos, sin = np.cos(theta), np.sin(theta)
            for k in range(3):
                m1[s, k] = cos * d1[k] + sin * d2[k]
                m2[s, k] = cos * d2[k] - sin * d1[k]

        c, a1, a2, b1, b2, m11, m21 = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
        for k in range(3):
            c += t[0, k] * t[1, k]
            a1 += t[1, k] * m1[0, k]
            a2 += t[1, k] * m2[0, k]
            b1 += t[0, k] * m1[1, k]
            b2 += t[0, k] * m2[1, k]
            m11 += m1[0, k] * m1[1, k]
            m21 += m2[0, k] * m1[1, k]
        less = 1.0 / (1.0 + c)
        kappa1, kappa2 = (a1 - b1) * less, (a2 - b2) * less
        # angle from m1e, transported along the rod, to m1f; then the branch next to the source's
        tau = np.arctan2(m21 - a2 * b1 * less, m11 - a1 * b1 * less)
        near = source_twist[b] + x[stencils[b, 3], 0] - x[stencils[b, 1], 0]
        tau += 2.0 * np.pi * np.floor((near - tau) / (2.0 * np.pi) + 0.5)
        stiffness[0], stiffness[1], stiffness[2] = bend[b, 0], bend[b, 1], twist[b]
        off1, off2, off3 = kappa1 - natural[b, 0], kappa2 - natural[b, 1], tau - natural_twist[b]
        force[0], force[1], force[2] = bend[b, 0] * off1, bend[b, 1] * off2, twist[b] * off3
        energy += 0.5 * (force[0] * off1 + force[1] * off2 + force[2] * off3)

        for k in range(3):
            k1, k2 = (k + 1) % 3, (k + 2) % 3
            te, tf = t[0, k], t[1, k]
            mid[k] = (te + tf) * less
            binormal[k] = (t[0, k1] * t[1, k2] - t[0, k2] * t[1, k1]) * less
            p[0, k] = (a1 * te - c * m1[0, k] - m1[1, k]) * less - kappa1 * mid[k]
            p[1, k] = (a2 * te - c * m2[0, k] - m2[1, k]) * less - kappa2 * mid[k]
            q[0, k] = (m1[0, k] + c * m1[1, k] - b1 * tf) * less - kappa1 * mid[k]
            q[1, k] = (m2[0, k] + c * m2[1, k] - b2 * tf) * less - kappa2 * mid[k]
        strain[0, 3], strain[1, 3], strain[2, 3] = a2 * less, -a1 * less, -1.0
        strain[0, 7], strain[1, 7], strain[2, 7] = -b2 * less, b1 * less, 1.0
        for k in range(3):
            for r in range(2):
                strain[r, k] = p[r, k] * short[0] - w[0, k] * strain[r, 3]
                strain[r, 4 + k] = q[r, k] * short[1] - w[1, k] * strain[r, 7]
            strain[2, k] = binormal[k] * short[0] - w[0, k] * strain[2, 3]
            strain[2, 4 + k] = binormal[k] * short[1] - w[1, k] * strain[2, 7]
        for r in range(8):
            g[r] = force[0] * strain[0, r] + force[1] * strain[1, r] + force[2] * strain[2, r]
        for k in range(3):
            gradient[stencils[b, 0], k] -= g[k]
            gradient[stencils[b, 2], k] += g[k] - g[4 + k]
            gradient[stencils[b, 4], k] += g[4 + k]
        gradient[stencils[b, 1], 0] += g[3]
        gradient[stencils[b, 3], 0] += g[7]
        if not wanted:
            continue

        # Sum of forces times second derivatives of the strains: first for frames that do not spin,
        # dm = -(m.dt) t, less the antisymmetric part at e and at f ...
        ahead, ahead_turned = force[0] * a1 + force[1] * a2, force[0] * a2 - force[1] * a1
        behind, behind_turned = force[0] * b1 + force[1] * b2, force[0] * b2 - force[1] * b1
        kappa, torque = (ahead - behind) * less, force[2]
        h33, h77 = -ahead * less, behind * less
        # ahead = tf.M_e, behind = te.M_f, with M = dE/dk1 m1 + dE/dk2 m2 and its derivative by theta
        for k in range(3):
            for s in range(2):
                m[s, k] = force[0] * m1[s, k] + force[1] * m2[s, k]
                other[s, k] = t[1 - s, k] - c * t[s, k]  # the other tangent, its part across
            turned_e, turned_f = force[0] * m2[0, k] - force[1] * m1[0, k], force[0] * m2[1, k] - force[1] * m1[1, k]
            sp[k] = force[0] * p[0, k] + force[1] * p[1, k]
            sq[k] = force[0] * q[0, k] + force[1] * q[1, k]
            ye[k] = (sp[k] + 0.5 * m[0, k]) * less
            yf[k] = (sq[k] - 0.5 * m[1, k]) * less
            he3[k] = (ahead_turned * (t[0, k] - mid[k]) - c * turned_e) * less * short[0]
            he7[k] = (behind_turned * mid[k] - turned_f) * less * short[0]
            hf3[k] = (turned_e - ahead_turned * mid[k]) * less * short[1]
            hf7[k] = (c * turned_f - behind_turned * (t[1, k] - mid[k])) * less * short[1]
            # ... then the spin, dtheta -> dtheta - w.de, and the symmetric part of the derivative of w: with the
            # columns of the angles, these make one dyad with w
            se[k] = he3[k] - 0.5 * h33 * w[0, k] - 0.5 * g[3] * short[0] * (t[0, k] + half[0, k])
            sf[k] = hf7[k] - 0.5 * h77 * w[1, k] - 0.5 * g[7] * short[1] * (t[1, k] + half[1, k])
            ue[k], uf[k] = 0.5 * torque * (t[0, k] + mid[k]), 0.5 * torque * (t[1, k] + mid[k])
            turned[k, k] = 0.0
        for k in range(3):
            k1, k2 = (k + 1) % 3, (k + 2) % 3
            turned[k, k1], turned[k1, k] = -torque * t[0, k2], torque * t[0, k2]
        ee, ff, ef = short[0] * short[0], short[1] * short[1], short[0] * short[1]
        around_e, around_f = (ahead - kappa) * less, -(behind + kappa) * less
        for i in range(3):
            s1e, s2e, s3e = bend[b, 0] * strain[0, i], bend[b, 1] * strain[1, i], twist[b] * strain[2, i]
            s1f, s2f, s3f = bend[b, 0] * strain[0, 4 + i], bend[b, 1] * strain[1, 4 + i], twist[b] * strain[2, 4 + i]
            for j in range(i + 1):
                delta = 1.0 if i == j else 0.0
                value = around_e * (delta - t[0, i] * t[0, j])
                value -= ye[i] * other[0, j] + other[0, i] * ye[j] + sp[i] * t[0, j] + t[0, i] * sp[j]
                value = (value - binormal[i] * ue[j] - ue[i] * binormal[j]) * ee
                value -= w[0, i] * se[j] + se[i] * w[0, j]
                hee[i, j] = hee[j, i] = value + s1e * strain[0, j] + s2e * strain[1, j] + s3e * strain[2, j]
                value = around_f * (delta - t[1, i] * t[1, j])
                value -= yf[i] * other[1, j] + other[1, i] * yf[j] + sq[i] * t[1, j] + t[1, i] * sq[j]
                value = (value - binormal[i] * uf[j] - uf[i] * binormal[j]) * ff
                value -= w[1, i] * sf[j] + sf[i] * w[1, j]
                hff[i, j] = hff[j, i] = value + s1f * strain[0, 4 + j] + s2f * strain[1, 4 + j] + s3f * strain[2, 4 + j]
            for j in range(3):
                delta = 1.0 if i == j else 0.0
                value = other[0, i] * (m[1, j] - sq[j]) - (m[0, i] + sp[i]) * other[1, j] + turned[i, j]
                value -= kappa * (delta - t[0, i] * t[0, j] - t[1, i] * t[1, j] + c * t[0, i] * t[1, j])
                value = (value * less - torque * binormal[i] * mid[j]) * ef
                value -= w[0, i] * hf3[j] + he7[i] * w[1, j]
                hef[i, j] = value + s1e * strain[0, 4 + j] + s2e * strain[1, 4 + j] + s3e * strain[2, 4 + j]
        for k in range(3):
            he3[k] -= h33 * w[0, k]
            hf7[k] -= h77 * w[1, k]
            for r in range(3):
                by_e, by_f = stiffness[r] * strain[r, 3], stiffness[r] * strain[r, 7]
                he3[k] += by_e * strain[r, k]
                he7[k] += by_f * strain[r, k]
                hf3[k] += by_e * strain[r, 4 + k]
                hf7[k] += by_f * strain[r, 4 + k]
        h37 = 0.0
        for r in range(3):
            h33 += stiffness[r] * strain[r, 3] * strain[r, 3]
            h37 += stiffness[r] * strain[r, 3] * strain[r, 7]
            h77 += stiffness[r] * strain[r, 7] * strain[r, 7]
        spread(hee, hef, hff, he3, he7, hf3, hf7, h33, h37, h77, hessians[b])
    return energy


@njit(error_model="numpy", fastmath={"contract"}, inline="always")
def spread(hee, hef, hff, he3, he7, hf3, hf7, h33, h37, h77, h):  # type: ignore[no-untyped-def]
    """Fill the element Hessian h (15, 15), by x_0, theta_e, x_1, theta_f, x_2, from that by e, theta_e, f, theta_f.

    Args:
        hee, hef, hff: (3, 3) second derivatives by the edge vectors e and e, e and f, f and f.
        he3, he7: (3,) by e and theta_e, and by e and theta_f.
        hf3, hf7: (3,) by f and theta_e, and by f and theta_f.
        h33, h37, h77: by theta_e twice, by both angles, and by theta_f twice.
        h: (15, 15), filled; rows and columns of the unused components of the angles get zeros.
    """
    for i in range(15):
        for j in (4, 5, 10, 11):
            h[i, j] = h[j, i] = 0.0
    for i in range(3):
        for j in range(3):
            ee, ef, fe, ff = hee[i, j], hef[i, j], hef[j, i], hff[i, j]
            h[i, j] = ee
            h[i, 6 + j] = ef - ee
            h[i, 12 + j] = -ef
            h[6 + i, j] = fe - ee
            h[6 + i, 6 + j] = ee - ef - fe + ff
            h[6 + i, 12 + j] = ef - ff
            h[12 + i, j] = -fe
            h[12 + i, 6 + j] = fe - ff
            h[12 + i, 12 + j] = ff
        h[i, 3] = h[3, i] = -he3[i]
        h[i, 9] = h[9, i] = -he7[i]
        h[6 + i, 3] = h[3, 6 + i] = he3[i] - hf3[i]
        h[6 + i, 9] = h[9, 6 + i] = he7[i] - hf7[i]
        h[12 + i, 3] = h[3, 12 + i] = hf3[i]
        h[12 + i, 9] = h[9, 12 + i] = hf7[i]
    h[3, 3], h[9, 9] = h33, h77
    h[3, 9] = h[9, 3] = h37
