"""The elastic joint: what two rods' sections at a joint do against turning relative to each other.

A joint acts on the section of each rod at the joint's node, which lies between two edges: its tangent T and its
normal N (the mean of the material directors m1) are the means of the edges', weighted so that the nearer edge counts
more. Of rod A and rod B the three strains are angles for small tilts and any shear,

    shear  s = angle from TA to TB about NA + NB, less the rest angle,
    tilts  a = NB.(NA x TA)  and  b = NB.TA,   how far B's normal leans from A's, about A's tangent and across it,

and E = 1/2 (s, a, b).K (s, a, b) with a stiffness K [N m]. `stiffness_between` says which K makes a joint of given
stiffnesses second order in the edge length and independent of the mesh.

Why not elements from edge to edge, as the paper's linkers are: those also stiffen each rod along itself at the joint,
by an amount that depends on the mesh. Frames, spin and sources are those of `rods.bend_twist`.
"""

from dataclasses import dataclass, replace
from math import pi
from typing import Self

import numba as nb
import numpy as np

from gridshell.geometry.frames import adapted, parallel_transport
from gridshell.geometry.vectors import cross, dot
from gridshell.joints.sections import by_edge, edge_tangents, frame, of_edge, spread
from gridshell.rods.elements import NO_HESSIANS, Floats, Ints


@dataclass(frozen=True)
class RelativeRotation:
    """Joints between two rods, all with the same number of edges. Build them with `starting_at`.

    Parameters
    ----------
    blocks : (m, k) the nodes and twist angles that a joint touches, each once.
    legs : (l, 4) for each edge of a joint the columns of `blocks` of its first node, its second node and its twist
        angle, and its rod: 0 for A, 1 for B. Edges run as they do in their rod.
    weights : (m, l) share of each edge in its rod's section; those of a rod add up to 1.
    stiffness : (m, 3, 3) of shear and the two tilts [N m].
    rest_angle : (m,) angle from TA to TB at rest [rad].
    source_tangents, source_directors : (m, l, 3) t and d1 of each edge in its source frame.
    """

    blocks: Ints
    legs: Ints
    weights: Floats
    stiffness: Floats
    rest_angle: Floats
    source_tangents: Floats
    source_directors: Floats

    @classmethod
    def starting_at(
        cls,
        blocks: Ints,
        legs: Ints,
        state: Floats,
        directors: Floats,
        *,
        weights: Floats,
        stiffness: Floats,
        rest_angle: Floats,
    ) -> Self:
        """Joints whose source frames are those of `state`.

        directors : (N, 3), in the row of each twist angle the first director of its edge; or (3,), one for all.
        """
        tangents = edge_tangents(state, blocks, legs)
        given = np.broadcast_to(np.asarray(directors, dtype=float), state.shape)[blocks[:, legs[:, 2]]]
        return cls(
            np.ascontiguousarray(blocks), legs, weights, stiffness, rest_angle, tangents, adapted(given, tangents)
        )

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        return float(
            _relative_rotation(
                state, self.blocks, self.legs, self.weights, self.stiffness, self.rest_angle,
                self.source_tangents, self.source_directors, gradient, hessians,
            )
        )  # fmt: skip

    def refreshed(self, state: Floats) -> Self:
        tangents = edge_tangents(state, self.blocks, self.legs)
        carried = parallel_transport(self.source_directors, self.source_tangents, tangents)
        return replace(self, source_tangents=tangents, source_directors=adapted(carried, tangents))

    def sections(self, state: Floats) -> Floats:
        """(m, 2, 2, 3) tangent T and normal N of the sections of A and of B."""
        moved = self.refreshed(state)
        t, d1 = moved.source_tangents, moved.source_directors
        theta = state[self.blocks[:, self.legs[:, 2]], 0][..., None]
        m1 = np.cos(theta) * d1 + np.sin(theta) * cross(t, d1)
        weights = self.weights[..., None]
        result = np.zeros((len(self.blocks), 2, 2, 3))
        for side in range(2):
            mine = self.legs[:, 3] == side
            result[:, side, 0] = (weights * t)[:, mine].sum(axis=1)
            result[:, side, 1] = (weights * m1)[:, mine].sum(axis=1)
        return result

    def strains(self, state: Floats) -> Floats:
        """(m, 3) shear and tilts [rad]."""
        (ta, na), (tb, nb_) = self.sections(state).transpose(1, 2, 0, 3)
        normal = na + nb_
        shear = np.arctan2(dot(normal, cross(ta, tb)), np.linalg.norm(normal, axis=1) * dot(ta, tb)) - self.rest_angle
        shear -= 2 * pi * np.round(shear / (2 * pi))
        return np.column_stack([shear, dot(nb_, cross(na, ta)), dot(nb_, ta)])

    def moments(self, state: Floats) -> Floats:
        """(m, 3) moments that the joint carries, conjugate to the strains [N m]: about its normal, and two in plane."""
        return np.asarray(np.einsum("mij,mj->mi", self.stiffness, self.strains(state)))


@nb.njit(cache=True, error_model="numpy")
def _relative_rotation(  # type: ignore[no-untyped-def]
    x, blocks, legs, weights, stiffness, rest_angle, tangents, directors, gradient, hessians
):
    """Energies [J]. y = (TA, NA, TB, NB), 12 components, are sums over the edges; an edge's unknowns are (e, theta)."""
    wanted = hessians.shape[0] > 0
    count = legs.shape[0]
    y, strain, force, slope = np.empty(12), np.empty(3), np.empty(3), np.empty((3, 12))
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
        for i in range(3):
            force[i] = 0.0
            for j in range(3):
                force[i] += stiffness[m, i, j] * strain[j]
            energy += 0.5 * force[i] * strain[i]
        for r in range(12):
            by_y[r] = force[0] * slope[0, r] + force[1] * slope[1, r] + force[2] * slope[2, r]
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
        _curvatures(y, force, stiffness[m], slope, by_up, by_flat, curve)
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


@nb.njit(cache=True, error_model="numpy")
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


@nb.njit(cache=True, error_model="numpy")
def _strains(y, rest_angle, strain, slope, by_up, by_flat):  # type: ignore[no-untyped-def]
    """The three strains and their derivatives (3, 12) by y."""
    up, along, size, _ = _shear_parts(y, by_up, by_flat)
    flat = size * along
    square = up * up + flat * flat
    shear = np.arctan2(up, flat) - rest_angle
    strain[0] = shear - 2.0 * np.pi * np.floor(shear / (2.0 * np.pi) + 0.5)
    for k in range(12):
        slope[0, k] = (flat * by_up[k] - up * by_flat[k]) / square
    strain[1] = strain[2] = 0.0
    for k in range(3):
        k1, k2 = (k + 1) % 3, (k + 2) % 3
        slope[1, k] = y[9 + k1] * y[3 + k2] - y[9 + k2] * y[3 + k1]
        slope[1, 3 + k] = y[k1] * y[9 + k2] - y[k2] * y[9 + k1]
        slope[1, 9 + k] = y[3 + k1] * y[k2] - y[3 + k2] * y[k1]
        slope[2, k], slope[2, 9 + k] = y[9 + k], y[k]
        slope[1, 6 + k] = slope[2, 3 + k] = slope[2, 6 + k] = 0.0
        strain[1] += y[9 + k] * slope[1, 9 + k]
        strain[2] += y[9 + k] * y[k]


@nb.njit(cache=True, error_model="numpy")
def _curvatures(y, force, stiffness, slope, by_up, by_flat, curve):  # type: ignore[no-untyped-def]
    """(12, 12) second derivatives of the energy by y."""
    up, along, size, normal = _shear_parts(y, by_up, by_flat)
    flat = size * along
    square = up * up + flat * flat
    twice, mixed = 2.0 * force[0] * up * flat / square**2, force[0] * (up * up - flat * flat) / square**2
    for i in range(12):
        for j in range(12):
            curve[i, j] = twice * (by_flat[i] * by_flat[j] - by_up[i] * by_up[j])
            curve[i, j] += mixed * (by_up[i] * by_flat[j] + by_flat[i] * by_up[j])
            for r in range(3):
                for s in range(3):
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
            one = 1.0 if i == j else 0.0
            direct = of_flat * along * (one - normal[i] * normal[j] / (size * size)) / size
            for n in (3, 9):
                for t, other in ((0, 6), (6, 0)):
                    curve[t + i, n + j] += of_flat * y[other + i] * normal[j] / size
                    curve[n + j, t + i] += of_flat * y[other + i] * normal[j] / size
                curve[n + i, 3 + j] += direct
                curve[n + i, 9 + j] += direct
    _add_triple(force[1], 9, 3, y[0:3], curve)
    _add_triple(force[1], 3, 0, y[9:12], curve)
    _add_triple(force[1], 0, 9, y[3:6], curve)
    for i in range(3):
        curve[i, 9 + i] += force[2]
        curve[9 + i, i] += force[2]


@nb.njit(cache=True, error_model="numpy")
def _add_triple(factor, a, b, c, curve):  # type: ignore[no-untyped-def]
    """Add factor times the second derivatives of the triple product a.(b x c) by its arguments at a and b of y."""
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        curve[a + i, b + i1] += factor * c[i2]
        curve[b + i1, a + i] += factor * c[i2]
        curve[a + i, b + i2] -= factor * c[i1]
        curve[b + i2, a + i] -= factor * c[i1]
