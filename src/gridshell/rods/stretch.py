"""Stretch of an edge [HQK Eq 1a]: E = EA/2 eps^2 |e0|, eps = |e|/|e0| - 1."""

from dataclasses import dataclass
from typing import Self

import numba as nb
import numpy as np

from gridshell.rods.elements import NO_HESSIANS, Floats, Ints


@dataclass(frozen=True)
class Stretch:
    """Elastic edges.

    Parameters
    ----------
    blocks : (e, 2) nodes of each edge.
    rest_lengths : (e,) [m].
    stiffness : (e,) EA [N].
    forces : (e,) axial forces [N] of the geometric stiffness in the Hessian; None takes EA eps, which makes
        the Hessian exact. A solver that carries the forces as unknowns gives its own.
    """

    blocks: Ints
    rest_lengths: Floats
    stiffness: Floats
    forces: Floats | None = None

    def strains(self, state: Floats) -> Floats:
        """(e,) axial strains [-]."""
        edge = state[self.blocks[:, 1]] - state[self.blocks[:, 0]]
        return np.sqrt(np.einsum("ij,ij->i", edge, edge)) / self.rest_lengths - 1.0

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        own = self.forces is None
        forces = self.rest_lengths if self.forces is None else self.forces
        return float(
            _stretch(state, self.blocks, self.rest_lengths, self.stiffness, forces, own, gradient, hessians)
        )

    def refreshed(self, state: Floats) -> Self:
        return self


@nb.njit(cache=True, error_model="numpy")
def _stretch(x, edges, rest, stiffness, forces, own, gradient, hessians):  # type: ignore[no-untyped-def]
    """Stencil (x_a, x_b) [m]; energies [J], from HQK Eq 1a."""
    wanted = hessians.shape[0] > 0
    energy = 0.0
    for e in range(edges.shape[0]):
        a, b = edges[e, 0], edges[e, 1]
        d0, d1, d2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        strain = length / rest[e] - 1.0
        energy += 0.5 * stiffness[e] * strain * strain * rest[e]
        force = stiffness[e] * strain
        t0, t1, t2 = d0 / length, d1 / length, d2 / length
        gradient[a, 0] -= force * t0
        gradient[a, 1] -= force * t1
        gradient[a, 2] -= force * t2
        gradient[b, 0] += force * t0
        gradient[b, 1] += force * t1
        gradient[b, 2] += force * t2
        if wanted:
            across = (force if own else forces[e]) / length  # geometric stiffness
            along = stiffness[e] / rest[e] - across
            t = (t0, t1, t2)
            for i in range(3):
                for j in range(3):
                    value = along * t[i] * t[j]
                    if i == j:
                        value += across
                    hessians[e, i, j] = value
                    hessians[e, i + 3, j + 3] = value
                    hessians[e, i, j + 3] = -value
                    hessians[e, i + 3, j] = -value
    return energy
