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

k and K at rest, from `elastic`, make a joint second order in the edge length and independent of the mesh. K holds the
compliance of half an edge of either rod, which is not the same along the rod (twist) and across it (bend) and turns
with its rod; DA and DB are the deviators of both at rest, complex as they turn by double angles. A joint of A and B is
thus one of B and A, and as stiff when it is sheared as if it had been built so.

Why not elements from edge to edge, as the paper's linkers are: those also stiffen each rod along itself at the joint,
by an amount that depends on the mesh. Frames, spin and sources are those of `rods.bend_twist`.
"""

from dataclasses import dataclass
from math import pi
from typing import Self

import numba as nb
import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.geometry.frames import adapted
from rodshell.geometry.vectors import cross, dot
from rodshell.joints.section_strains import curvatures, respond, strains_by
from rodshell.joints.sections import by_edge, carried, edge_tangents, frame, of_edge, spread
from rodshell.rods.elements import NO_HESSIANS


@dataclass(frozen=True)
class RelativeRotation:
    """Joints between two rods, all with the same number of edges. Build them with `starting_at`.

    Parameters
    ----------
    blocks : (m, k) the nodes and twist angles that a joint touches, each once.
    legs : (l, 4) for each edge of a joint the columns of `blocks` of its first node, its second node and its twist
        angle, and its rod: 0 for A, 1 for B. Edges run as they do in their rod.
    weights : (m, l) share of each edge in its rod's section; those of a rod add up to 1.
    stiffness : (m, 3, 3) of shear and the two tilts at rest, the shear apart from the tilts [N m].
    deviators : (m, 2) complex, D_A and D_B by the axes of the tilts at rest [1/N m].
    rest_angle : (m,) angle from TA to TB at rest [rad].
    source_tangents, source_directors : (m, l, 3) t and d1 of each edge in its source frame.
    """

    blocks: Ints
    legs: Ints
    weights: Floats
    stiffness: Floats
    deviators: NDArray[np.complex128]
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
        deviators: NDArray[np.complex128],
        rest_angle: Floats,
    ) -> Self:
        """Joints whose source frames are those of `state`.

        directors : (N, 3), in the row of each twist angle the first director of its edge; or (3,), one for all.
        """
        tangents = edge_tangents(state, blocks, legs)
        given = np.broadcast_to(np.asarray(directors, dtype=float), state.shape)[blocks[:, legs[:, 2]]]
        directors = adapted(given, tangents)
        rows = np.ascontiguousarray(blocks)
        return cls(rows, legs, weights, stiffness, deviators, rest_angle, tangents, directors)

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        return float(
            _relative_rotation(
                state, self.blocks, self.legs, self.weights, self.stiffness, self.deviators, self.rest_angle,
                self.source_tangents, self.source_directors, gradient, hessians,
            )
        )  # fmt: skip

    def refreshed(self, state: Floats) -> Self:
        return carried(self, state)

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
        """(m, 3) shear, and tilt about minus A's tangent and across it [rad]."""
        full = self._strains(state)
        of_a, of_b = full[:, 1] + 1j * full[:, 2], full[:, 3] + 1j * full[:, 4]
        tilt = 0.5 * (of_a + of_b * np.exp(-1j * (full[:, 0] + self.rest_angle)))
        return np.column_stack([full[:, 0], tilt.real, tilt.imag])

    def moments(self, state: Floats) -> Floats:
        """(m, 3) moments that the joint carries, conjugate to the strains [N m]: about its normal, and two in plane."""
        forces, scrap = self._strains(state), np.empty((5, 5))
        parts = (forces, self.rest_angle, self.stiffness, self.deviators)
        for strain, rest_angle, stiffness, deviators in zip(*parts, strict=True):
            respond(strain.copy(), rest_angle, stiffness, deviators, strain, scrap)
        return forces[:, :3] * [1.0, 2.0, 2.0]  # B's half of the tilt moment is the same, by B's axes

    def _strains(self, state: Floats) -> Floats:
        """(m, 5) shear, and the tilts eA and eB [rad]."""
        (ta, na), (tb, nb_) = self.sections(state).transpose(1, 2, 0, 3)
        normal = na + nb_
        shear = np.arctan2(dot(normal, cross(ta, tb)), np.linalg.norm(normal, axis=1) * dot(ta, tb)) - self.rest_angle
        shear -= 2 * pi * np.round(shear / (2 * pi))
        lean = cross(nb_, na)
        return np.column_stack([shear, dot(lean, ta), dot(nb_, ta), dot(lean, tb), -dot(na, tb)])


@nb.njit(cache=True, error_model="numpy")
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
        strains_by(y, rest_angle[m], strain, slope, by_up, by_flat)
        energy += respond(strain, rest_angle[m], stiffness[m], deviators[m], force, tangent)
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
        curvatures(y, force, tangent, slope, by_up, by_flat, curve)
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
