"""The elastic joint: what two rods' sections at a joint do against turning relative to each other.

A joint acts on the section of each rod at the joint's node, which lies between two edges: its tangent T and its
normal N (the mean of the material directors m1) are the means of the edges', weighted so that the nearer edge counts
more. Of rod A and rod B the strains are angles, for small tilts and any shear:

    shear  s = angle from TA to TB about NA + NB, less the rest angle r,
    tilt   NA x NB, by A's axes -TA, NA x TA:  eA = NB.(NA x TA) + i NB.TA,
           and by B's axes -TB, NB x TB:       eB = NB.(NA x TB) - i NA.TB.

The tilt that counts is the mean of both, e = (eA exp(is/2) + eB exp(-is/2 - ir))/2, by axes that go half of the shear
with either rod (the axes turn against the complex plane). Its energy with that of the shear is

    E = 1/2 k s^2 + 1/2 e.K(s) e,   K(s) = (1/K + dC)^-1,   dC = DA (exp(is) - 1) + DB (exp(-is) - 1).

k and K at rest, from `joint`, make a joint second order in the edge length and independent of the mesh. K
contains the compliance of half an edge of either rod, which differs between the rod's axis (twist) and the direction
across it (bend) and turns with its rod; DA and DB are the deviators of both at rest, complex numbers since they turn by
double angles. A joint of A and B is thus also one of B and A, and as stiff when sheared as if built at that angle.

Why not elements from edge to edge, as the paper's linkers are: those also stiffen each rod along itself at the joint,
by an amount that depends on the mesh. Frames, spin and sources are those of `rods.bend_twist`.
"""

from dataclasses import dataclass, replace
from math import pi
from typing import Self, TypeGuard

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, State
from rodshell.geometry.frames import cross, dot
from rodshell.joints.crossings import OfSections, by_edge, frame, of_edge, spread
from rodshell.kernels import njit
from rodshell.rods.elements import NO_HESSIANS, Elements
from rodshell.validation import brief


@dataclass(frozen=True, eq=False)
class RelativeRotation(OfSections):
    """Elastic joints between two rods.

    Args:
        stiffness: (m, 3, 3) of shear and the two tilts at rest, the shear apart from the tilts [N m].
        deviators: (m, 2) complex, D_A and D_B by the axes of the tilts at rest [1/N m].
        rest_angle: (m,) angle from TA to TB at rest [rad].
    """

    stiffness: Floats
    deviators: NDArray[np.complex128]
    rest_angle: Floats

    __repr__ = brief

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        return float(
            _relative_rotation(
                state, self.blocks, self.legs, self.weights, self.stiffness, self.deviators, self.rest_angle,
                self.source_tangents, self.source_directors, gradient, hessians,
            )
        )  # fmt: skip

    def with_stiffness_of(self, other: "RelativeRotation") -> Self:
        """The same joints as stiff as others."""
        return replace(self, stiffness=other.stiffness, deviators=other.deviators)

    def sections(self, state: State) -> Floats:
        """(m, 2, 2, 3) tangent T and normal N of the sections of A and of B at `state` (N, 3)."""
        moved = self.refreshed(state)
        t, d1 = moved.source_tangents, moved.source_directors
        theta = state[self.blocks[:, self.legs[:, 2]], 0][..., None]
        m1 = np.cos(theta) * d1 + np.sin(theta) * cross(t, d1)
        weights = self.weights[..., None]
        result = np.zeros((len(self.blocks), 2, 2, 3))
        for side in range(2):
            of_rod = self.legs[:, 3] == side
            result[:, side, 0] = (weights * t)[:, of_rod].sum(axis=1)
            result[:, side, 1] = (weights * m1)[:, of_rod].sum(axis=1)
        return result

    def strains(self, state: State) -> Floats:
        """(m, 3) shear, and tilt about minus A's tangent and across it, at `state` (N, 3) [rad]."""
        full = self._both_tilts(state)
        of_a, of_b = full[:, 1] + 1j * full[:, 2], full[:, 3] + 1j * full[:, 4]
        tilt = 0.5 * (of_a + of_b * np.exp(-1j * (full[:, 0] + self.rest_angle)))
        return np.column_stack([full[:, 0], tilt.real, tilt.imag])

    def moments(self, state: State) -> Floats:
        """(m, 3) moments of the joint, conjugate to the strains [N m]: about its normal, and two in its plane."""
        forces, scrap = self._both_tilts(state), np.empty((5, 5))
        parts = (forces, self.rest_angle, self.stiffness, self.deviators)
        for strain, rest_angle, stiffness, deviators in zip(*parts, strict=True):
            _respond(strain.copy(), rest_angle, stiffness, deviators, strain, scrap)
        return forces[:, :3] * [1.0, 2.0, 2.0]  # B's half of the tilt moment is the same, by B's axes

    def _both_tilts(self, state: State) -> Floats:
        """(m, 5) shear, and the tilts eA and eB [rad]."""
        (ta, na), (tb, nb_) = self.sections(state).transpose(1, 2, 0, 3)
        normal = na + nb_
        shear = np.arctan2(dot(normal, cross(ta, tb)), np.linalg.norm(normal, axis=1) * dot(ta, tb)) - self.rest_angle
        shear -= 2 * pi * np.round(shear / (2 * pi))
        lean = cross(nb_, na)
        return np.column_stack([shear, dot(lean, ta), dot(nb_, ta), dot(lean, tb), -dot(na, tb)])


def is_elastic(element: Elements) -> TypeGuard[RelativeRotation]:
    """Whether an energy is that of elastic joints."""
    return isinstance(element, RelativeRotation)


@njit("f2 i2 i2 f2 f3 c2 f1 f3 f3 f2 f3")
def _relative_rotation(  # type: ignore[no-untyped-def]
    x, blocks, legs, weights, stiffness, deviators, rest_angle, tangents, directors, gradient, hessians
):
    """Energies [J]. y = (TA, NA, TB, NB), 12 components, are sums over the edges; an edge's unknowns are (e, theta)."""
    wanted = hessians.shape[0] > 0
    count = legs.shape[0]
    y, strain, force, slope, tangent = np.empty(12), np.empty(5), np.empty(5), np.empty((5, 12)), np.empty((5, 5))
    by_y, by_up, by_flat, curve = np.empty(12), np.empty(12), np.empty(12), np.empty((12, 12))
    t, m1, m2 = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3))
    w, half, length = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
    jacobian, g = np.empty((count, 6, 4)), np.empty((count, 4))
    product, local = np.empty((6, 4)), np.empty((4, 4))
    energy = 0.0
    for m in range(blocks.shape[0]):
        y[:] = 0.0
        for s in range(count):
            length[s] = frame(x, blocks[m], legs[s], tangents[m, s], directors[m, s], t[s], m1[s], m2[s], w[s], half[s])
            by_edge(weights[m, s], length[s], t[s], m1[s], m2[s], w[s], jacobian[s])
            for k in range(3):
                y[6 * legs[s, 3] + k] += weights[m, s] * t[s, k]
                y[6 * legs[s, 3] + 3 + k] += weights[m, s] * m1[s, k]
        _strains(y, rest_angle[m], strain, slope, by_up, by_flat)
        energy += _respond(strain, rest_angle[m], stiffness[m], deviators[m], force, tangent)
        for r in range(12):
            by_y[r] = 0.0
            for k in range(5):
                by_y[r] += force[k] * slope[k, r]
        for s in range(count):
            first, second, angle = blocks[m, legs[s, 0]], blocks[m, legs[s, 1]], blocks[m, legs[s, 2]]
            for c in range(4):
                g[s, c] = 0.0
                for r in range(6):
                    g[s, c] += by_y[6 * legs[s, 3] + r] * jacobian[s, r, c]
            for k in range(3):
                gradient[first, k] -= g[s, k]
                gradient[second, k] += g[s, k]
            gradient[angle, 0] += g[s, 3]
        if not wanted:
            continue
        hessians[m] = 0.0
        _curvatures(y, force, tangent, slope, by_up, by_flat, curve)
        for s in range(count):
            a = 6 * legs[s, 3]
            for q in range(count):
                b = 6 * legs[q, 3]
                for i in range(6):
                    for d in range(4):
                        product[i, d] = 0.0
                        for j in range(6):
                            product[i, d] += curve[a + i, b + j] * jacobian[q, j, d]
                for c in range(4):
                    for d in range(4):
                        local[c, d] = 0.0
                        for i in range(6):
                            local[c, d] += jacobian[s, i, c] * product[i, d]
                if q == s:
                    of_edge(
                        weights[m, s], by_y[a : a + 3], by_y[a + 3 : a + 6],
                        length[s], t[s], m1[s], m2[s], w[s], half[s], local,
                    )  # fmt: skip
                spread(local, legs[s], legs[q], hessians[m])
    return energy


# Strains between two sections, their derivatives, and the response of a joint: y = (TA, NA, TB, NB), 12 components,
# are tangent and normal of the section of rod A, then those of rod B; the strains are (s, eA, eB), five numbers.


@njit("f1 f f2 c1 f1 f2")
def _respond(strain, rest_angle, stiffness, deviators, force, tangent):  # type: ignore[no-untyped-def]
    """Energy of a joint at the strains (s, eA, eB) (5,); its derivatives by them, `force` (5,) and `tangent` (5, 5).

    A symmetric 2 x 2 matrix is its mean p and its deviator z, e -> p e + z e*. K at rest being (p0, z0) with the
    determinant d, and dC being (0, w), (1/K + dC)^-1 is (p0, z0 - d w) over 1 + 2 Re z0 w* - d |w|^2.
    """
    s = strain[0]
    p0, z0 = (
        0.5 * (stiffness[1, 1] + stiffness[2, 2]),
        complex(0.5 * (stiffness[1, 1] - stiffness[2, 2]), stiffness[1, 2]),
    )
    d = p0 * p0 - abs(z0) ** 2
    ahead = complex(np.cos(s), np.sin(s))
    of_a, of_b = deviators[0] * ahead, deviators[1] * ahead.conjugate()
    w, w1, w2 = of_a + of_b - deviators[0] - deviators[1], 1j * (of_a - of_b), -of_a - of_b
    n = z0 - d * w
    over = 1.0 + 2 * (z0 * w.conjugate()).real - d * abs(w) ** 2
    over1, over2 = 2 * (n * w1.conjugate()).real, 2 * (n * w2.conjugate()).real - 2 * d * abs(w1) ** 2
    u = 1.0 / over
    u1, u2 = -over1 * u**2, 2 * over1**2 * u**3 - over2 * u**2
    p, p1, p2 = p0 * u, p0 * u1, p0 * u2
    z, z1, z2 = n * u, n * u1 - d * w1 * u, n * u2 - 2 * d * w1 * u1 - d * w2 * u

    half = 0.5 * complex(np.cos(0.5 * s), np.sin(0.5 * s))
    other = half.conjugate() * complex(np.cos(rest_angle), -np.sin(rest_angle))
    part_a, part_b = complex(strain[1], strain[2]) * half, complex(strain[3], strain[4]) * other
    e, by_s = part_a + part_b, 0.5j * (part_a - part_b)
    f, f1, turned = p * e + z * e.conjugate(), p1 * e + z1 * e.conjugate(), p * by_s + z * by_s.conjugate()
    by_tilt, more = (half, 1j * half, other, 1j * other), f1 + turned
    force[0] = stiffness[0, 0] * s + 0.5 * (f1.conjugate() * e).real + (f.conjugate() * by_s).real
    tangent[0, 0] = stiffness[0, 0] + 0.5 * (p2 * abs(e) ** 2 + (z2 * (e * e).conjugate()).real)
    tangent[0, 0] += 2 * (f1.conjugate() * by_s).real + (turned.conjugate() * by_s).real
    tangent[0, 0] -= 0.25 * (f.conjugate() * e).real
    for i in range(4):
        v, turn = by_tilt[i], 0.5j if i < 2 else -0.5j
        force[1 + i] = (f.conjugate() * v).real
        tangent[0, 1 + i] = tangent[1 + i, 0] = (more.conjugate() * v).real + (f.conjugate() * turn * v).real
        stiff = (p * v + z * v.conjugate()).conjugate()
        for j in range(4):
            tangent[1 + i, 1 + j] = (stiff * by_tilt[j]).real
    return 0.5 * (stiffness[0, 0] * s * s + (f.conjugate() * e).real)


@njit(error_model="numpy")
def _shear_parts(y, by_up, by_flat):  # type: ignore[no-untyped-def]
    """Of the shear's tangent up / flat, n.(TA x TB) over |n| TA.TB with n = NA + NB: up, TA.TB, |n|, n, and slopes."""
    normal = (y[3] + y[9], y[4] + y[10], y[5] + y[11])
    up, along, square = 0.0, 0.0, 0.0
    for k in range(3):
        along += y[k] * y[6 + k]
        square += normal[k] * normal[k]
    size = np.sqrt(square)
    for k in range(3):
        k1, k2 = (k + 1) % 3, (k + 2) % 3
        by_up[k], by_flat[k] = y[6 + k1] * normal[k2] - y[6 + k2] * normal[k1], size * y[6 + k]
        by_up[6 + k], by_flat[6 + k] = normal[k1] * y[k2] - normal[k2] * y[k1], size * y[k]
        by_up[3 + k] = by_up[9 + k] = y[k1] * y[6 + k2] - y[k2] * y[6 + k1]
        by_flat[3 + k] = by_flat[9 + k] = along * normal[k] / size
        up += y[k] * by_up[k]
    return up, along, size, normal


@njit(error_model="numpy")
def _strains(y, rest_angle, strain, slope, by_up, by_flat):  # type: ignore[no-untyped-def]
    """The strains (s, eA, eB) and their derivatives (5, 12) by y."""
    up, along, size, _ = _shear_parts(y, by_up, by_flat)
    flat = size * along
    square = up * up + flat * flat
    shear = np.arctan2(up, flat) - rest_angle
    strain[0] = shear - 2.0 * np.pi * np.floor(shear / (2.0 * np.pi) + 0.5)
    for k in range(12):
        slope[0, k] = (flat * by_up[k] - up * by_flat[k]) / square
    strain[1:] = 0.0
    slope[1:] = 0.0
    for k in range(3):
        k1, k2 = (k + 1) % 3, (k + 2) % 3
        lean = y[9 + k1] * y[3 + k2] - y[9 + k2] * y[3 + k1]
        for row, t in ((1, 0), (3, 6)):  # NB.(NA x T)
            slope[row, t + k] = lean
            slope[row, 3 + k] = y[t + k1] * y[9 + k2] - y[t + k2] * y[9 + k1]
            slope[row, 9 + k] = y[3 + k1] * y[t + k2] - y[3 + k2] * y[t + k1]
            strain[row] += lean * y[t + k]
        slope[2, k], slope[2, 9 + k] = y[9 + k], y[k]
        slope[4, 6 + k], slope[4, 3 + k] = -y[3 + k], -y[6 + k]
        strain[2] += y[9 + k] * y[k]
        strain[4] -= y[3 + k] * y[6 + k]


@njit(error_model="numpy")
def _curvatures(y, force, stiffness, slope, by_up, by_flat, curve):  # type: ignore[no-untyped-def]
    """(12, 12) second derivatives of the energy by y; `stiffness` (5, 5) are those by the strains."""
    up, along, size, normal = _shear_parts(y, by_up, by_flat)
    flat = size * along
    square = up * up + flat * flat
    twice, mixed = 2.0 * force[0] * up * flat / square**2, force[0] * (up * up - flat * flat) / square**2
    for i in range(12):
        for j in range(12):
            curve[i, j] = twice * (by_flat[i] * by_flat[j] - by_up[i] * by_up[j])
            curve[i, j] += mixed * (by_up[i] * by_flat[j] + by_flat[i] * by_up[j])
            for r in range(5):
                for s in range(5):
                    curve[i, j] += stiffness[r, s] * slope[r, i] * slope[s, j]
    of_up, of_flat = force[0] * flat / square, -force[0] * up / square
    _add_triple(of_up, 0, 6, normal, curve)
    for n in (3, 9):
        _add_triple(of_up, 6, n, y[0:3], curve)
        _add_triple(of_up, n, 0, y[6:9], curve)
    for i in range(3):
        curve[i, 6 + i] += of_flat * size
        curve[6 + i, i] += of_flat * size
        for j in range(3):
            delta = 1.0 if i == j else 0.0
            direct = of_flat * along * (delta - normal[i] * normal[j] / (size * size)) / size
            for n in (3, 9):
                for t, other in ((0, 6), (6, 0)):
                    curve[t + i, n + j] += of_flat * y[other + i] * normal[j] / size
                    curve[n + j, t + i] += of_flat * y[other + i] * normal[j] / size
                curve[n + i, 3 + j] += direct
                curve[n + i, 9 + j] += direct
    for row, t in ((1, 0), (3, 6)):
        _add_triple(force[row], 9, 3, y[t : t + 3], curve)
        _add_triple(force[row], 3, t, y[9:12], curve)
        _add_triple(force[row], t, 9, y[3:6], curve)
    for i in range(3):
        curve[i, 9 + i] += force[2]
        curve[9 + i, i] += force[2]
        curve[3 + i, 6 + i] -= force[4]
        curve[6 + i, 3 + i] -= force[4]


@njit(error_model="numpy")
def _add_triple(factor, a, b, c, curve):  # type: ignore[no-untyped-def]
    """Add factor times the second derivatives of the triple product a.(b x c) by its arguments at a and b of y."""
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        curve[a + i, b + i1] += factor * c[i2]
        curve[b + i1, a + i] += factor * c[i2]
        curve[a + i, b + i2] -= factor * c[i1]
        curve[b + i2, a + i] -= factor * c[i1]
