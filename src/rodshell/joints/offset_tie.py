"""Eccentric joints: two rods one above the other, their centre lines a distance d apart along their common normal.

    E = C/2 |g|^2,   g = x_B - x_A - d (N_A + N_B)/2,   N the normals of the rods' sections (`sections`)

A tie with a lever arm cannot be an equal index, so it is a stiff spring with every coupling. d is negative where
rod A lies above rod B.
"""

from dataclasses import dataclass
from typing import Self

import numba as nb
import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.frames import adapted
from rodshell.joints.crossings import Places
from rodshell.joints.sections import by_edge, carried, edge_tangents, frame, of_edge, spread, stencils
from rodshell.layout.flatgrid import sides
from rodshell.rods.elements import NO_HESSIANS

UP = np.array([0.0, 0.0, 1.0])


@dataclass(frozen=True)
class OffsetTie:
    """Springs between two rods' nodes. See `RelativeRotation` for blocks, legs, weights and sources.

    Parameters
    ----------
    middles : (2,) columns of `blocks` of the joint's node on A and on B.
    stiffness : (m,) C [N/m].
    offsets : (m,) d [m].
    """

    blocks: Ints
    legs: Ints
    middles: Ints
    weights: Floats
    stiffness: Floats
    offsets: Floats
    source_tangents: Floats
    source_directors: Floats

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        return float(
            _offset_tie(
                state, self.blocks, self.legs, self.middles, self.weights, self.stiffness, self.offsets,
                self.source_tangents, self.source_directors, gradient, hessians,
            )
        )  # fmt: skip

    def refreshed(self, state: Floats) -> Self:
        return carried(self, state)


def offset_ties(places: Places, eccentricity: Floats, stiffness: float, size: int) -> list[OffsetTie]:
    """Ties of the crossings whose `eccentricity` (c,) [m] is not zero, as elements on `size` blocks."""
    which = np.flatnonzero(eccentricity)
    if len(which) == 0:
        return []
    met, flat = places.of_crossings[which], places.flat(size)
    layer = sides(places.mesh.grid)[places.rods[met]]
    offsets = 0.5 * eccentricity[which] * (layer[:, 1] - layer[:, 0])
    sets = []
    for mine, blocks, legs, middles, weights in stencils(places, met):
        tangents = edge_tangents(flat, blocks, legs)
        firm = np.full(len(blocks), stiffness)
        directors = adapted(np.broadcast_to(UP, tangents.shape), tangents)
        sets.append(OffsetTie(blocks, legs, middles, weights, firm, offsets[mine], tangents, directors))
    return sets


@nb.njit(cache=True, error_model="numpy")
def _offset_tie(  # type: ignore[no-untyped-def]
    x, blocks, legs, middles, weights, stiffness, offsets, tangents, directors, gradient, hessians
):
    """Energies [J]. An edge's unknowns are (e, theta)."""
    wanted = hessians.shape[0] > 0
    count = legs.shape[0]
    gap, by_n, none = np.empty(3), np.empty(3), np.zeros(3)
    t, m1, m2 = np.empty((count, 3)), np.empty((count, 3)), np.empty((count, 3))
    w, half, length = np.empty((count, 3)), np.empty((count, 3)), np.empty(count)
    jacobian, local = np.empty((count, 6, 4)), np.empty((4, 4))
    energy = 0.0
    for m in range(blocks.shape[0]):
        c, d = stiffness[m], offsets[m]
        a, b = blocks[m, middles[0]], blocks[m, middles[1]]
        for k in range(3):
            gap[k] = x[b, k] - x[a, k]
        for s in range(count):
            length[s] = frame(x, blocks[m], legs[s], tangents[m, s], directors[m, s], t[s], m1[s], m2[s], w[s], half[s])
            by_edge(weights[m, s], length[s], t[s], m1[s], m2[s], w[s], jacobian[s])
            for k in range(3):
                gap[k] -= 0.5 * d * weights[m, s] * m1[s, k]
        for k in range(3):
            energy += 0.5 * c * gap[k] * gap[k]
            gradient[b, k] += c * gap[k]
            gradient[a, k] -= c * gap[k]
            by_n[k] = -0.5 * d * c * gap[k]
        for s in range(count):
            for r in range(4):
                g = 0.0
                for k in range(3):
                    g += by_n[k] * jacobian[s, 3 + k, r]
                if r < 3:
                    gradient[blocks[m, legs[s, 0]], r] -= g
                    gradient[blocks[m, legs[s, 1]], r] += g
                else:
                    gradient[blocks[m, legs[s, 2]], 0] += g
        if not wanted:
            continue
        hessians[m] = 0.0
        for k in range(3):
            for p in range(2):
                for q in range(2):
                    hessians[m, 3 * middles[p] + k, 3 * middles[q] + k] += c if p == q else -c
        for s in range(count):
            _with_nodes(-0.5 * d * c, jacobian[s], legs[s], middles, hessians[m])
            for q in range(count):
                for r in range(4):
                    for v in range(4):
                        local[r, v] = 0.0
                        for k in range(3):
                            local[r, v] += 0.25 * d * d * c * jacobian[s, 3 + k, r] * jacobian[q, 3 + k, v]
                if q == s:
                    of_edge(weights[m, s], none, by_n, length[s], t[s], m1[s], m2[s], w[s], half[s], local)
                spread(local, legs[s], legs[q], hessians[m])
    return energy


@nb.njit(cache=True, error_model="numpy")
def _with_nodes(factor, jacobian, leg, middles, hessian):  # type: ignore[no-untyped-def]
    """Add factor * dN/d(e, theta) between an edge and the joint's nodes: + with that on B, - with that on A."""
    for k in range(3):
        for side in range(2):
            node = 3 * middles[side] + k
            signed = factor if side else -factor
            for r in range(4):
                value = signed * jacobian[3 + k, r]
                if r < 3:
                    for end in range(2):
                        row = 3 * leg[end] + r
                        signed_value = value if end else -value
                        hessian[row, node] += signed_value
                        hessian[node, row] += signed_value
                else:
                    hessian[3 * leg[2], node] += value
                    hessian[node, 3 * leg[2]] += value
