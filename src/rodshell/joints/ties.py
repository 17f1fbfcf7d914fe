"""Ties: whether tied rods share their unknowns (the coupling), and how the ties' energy enters a step [HQK 2.2].

SharedDofs        tied nodes are one node, tied angles one angle; there is no tie energy (the paper's *mapping*)
ImplicitPenalty   each rod and linker has its own unknowns; ties are springs in residual and Hessian
ExplicitPenalty   the same springs, their forces frozen at the start of each time step (the paper's default)

An eccentric joint ties two rods one above the other, their centre lines a distance d apart along their common normal:

    E = C/2 |g|^2,   g = x_B - x_A - d (N_A + N_B)/2,   N the normals of the rods' sections (`crossings`)

A tie with a lever arm cannot be shared unknowns, so it is a stiff spring with every coupling. d is negative where rod
A lies above rod B.
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from rodshell.arrays import Floats, Ints, State
from rodshell.joints.crossings import UP, OfSections, RodNodes, by_edge, frame, of_edge, spread, stencils
from rodshell.kernels import njit
from rodshell.layout.flatgrid import sides
from rodshell.rods.elements import NO_HESSIANS, WithoutFrames
from rodshell.rods.section import Rod
from rodshell.validation import brief, keep, positive


@dataclass(frozen=True)
class SharedDofs:
    """Tied nodes are one node, tied twist angles one angle (the paper's *mapping*)."""

    name = "shared"


@dataclass(frozen=True)
class _Penalty:
    """Ties are springs.

    ERRATA E7 to HQK Eqs 5, 6: C is a penalty stiffness, not a multiplier; "C1 = C2 = 1e6 EI" mixes N/m and N m/rad.

    Args:
        C1: stiffness of ties of nodes [N/m]; None: derived from the rods.
        C2: stiffness of ties of twist angles, which linkers have [N m/rad]; None: derived from the rods.

    Raises:
        InputError: a stiffness is not a positive number.
    """

    C1: float | None = None
    C2: float | None = None

    def __post_init__(self) -> None:
        keep(self, positive, "N/m", "C1", what="the penalty stiffness {}")
        keep(self, positive, "N m/rad", "C2", what="the penalty stiffness {}")

    def with_defaults(self, rod: Rod, edge: float) -> Self:
        """The same with the defaults for rods with edges of the length `edge` [m] filled in."""
        nodes, angles = self._defaults(rod, edge)
        return replace(self, C1=self.C1 or nodes, C2=self.C2 or angles)

    def _defaults(self, rod: Rod, edge: float) -> tuple[float, float]:
        """C1 [N/m] and C2 [N m/rad] for rods with edges of the length `edge` [m]."""
        raise NotImplementedError


@dataclass(frozen=True)
class ImplicitPenalty(_Penalty):
    """Ties in the residual and the Hessian. By default 1e4 times as stiff as an edge in stretch and in twist.

    Parameters and errors as of the paper's penalties: C1 [N/m] of nodes, C2 [N m/rad] of twist angles.
    """

    name = "implicit"

    __repr__ = brief

    def _defaults(self, rod: Rod, edge: float) -> tuple[float, float]:
        return 1e4 * rod.stretch_stiffness / edge, 1e4 * rod.twist_stiffness / edge


@dataclass(frozen=True)
class ExplicitPenalty(_Penalty):
    """Ties by forces from the start of the time step: a banded solve for each rod and linker, and a step limit.

    Parameters and errors as of the paper's penalties: C1 [N/m] of nodes, C2 [N m/rad] of twist angles.
    By default C1 = (1.5/edge)^3 EI and C2 = GJ/edge, which allows steps of about 10 ms and 1 ms for the paper's rod at
    15 mm edges. (The paper's C2 = 1e6 EI would allow microseconds.)
    """

    name = "explicit"

    __repr__ = brief

    def _defaults(self, rod: Rod, edge: float) -> tuple[float, float]:
        return (1.5 / edge) ** 3 * min(rod.bend_stiffnesses), rod.twist_stiffness / edge


Coupling = SharedDofs | ImplicitPenalty | ExplicitPenalty


@dataclass(frozen=True, eq=False)
class Ties(WithoutFrames):
    """Springs between pairs of blocks [HQK Eqs 5, 6]: E = C/2 |a - b|^2 of nodes and of twist angles.

    Args:
        blocks: (t, 2) the two nodes, or the two twist angles, whose edges must coincide and have the same reference
            frame (ERRATA E8 to Eq 6).
        stiffness: (t,) C1 [N/m] of nodes, C2 [N m/rad] of twist angles.
    """

    blocks: Ints
    stiffness: Floats

    __repr__ = brief

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        apart = state[self.blocks[:, 0]] - state[self.blocks[:, 1]]
        force = self.stiffness[:, None] * apart
        np.add.at(gradient, self.blocks[:, 0], force)
        np.subtract.at(gradient, self.blocks[:, 1], force)
        if len(hessians):
            hessians[:] = 0.0
            for k in range(3):
                hessians[:, k, k] = hessians[:, k + 3, k + 3] = self.stiffness
                hessians[:, k, k + 3] = hessians[:, k + 3, k] = -self.stiffness
        return 0.5 * float(np.vdot(force, apart))


@dataclass(frozen=True, eq=False)
class OffsetTie(OfSections):
    """Springs between two rods' nodes.

    Args:
        middles: (2,) columns of `blocks` of the joint's node on A and on B.
        stiffness: (m,) C [N/m].
        offsets: (m,) d [m].
    """

    middles: Ints
    stiffness: Floats
    offsets: Floats

    __repr__ = brief

    def evaluate(self, state: State, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        return float(
            _offset_tie(
                state, self.blocks, self.legs, self.middles, self.weights, self.stiffness, self.offsets,
                self.source_tangents, self.source_directors, gradient, hessians,
            )
        )  # fmt: skip


def offset_ties(rod_nodes: RodNodes, eccentricity: Floats, stiffness: Floats, size: int) -> list[OffsetTie]:
    """Ties of the eccentric crossings of rods that lie in layers.

    Args:
        eccentricity: (c,) of each crossing of the grid [m]; those with 0 have no such tie.
        stiffness: (c,) C [N/m].
        size: number of blocks of the state.
    """
    eccentric = np.flatnonzero(eccentricity)
    if len(eccentric) == 0:
        return []
    pairs, flat = rod_nodes.at_crossings[eccentric], rod_nodes.flat_state(size)
    layer = sides(rod_nodes.mesh.grid)[rod_nodes.rods[pairs]]
    offsets = 0.5 * eccentricity[eccentric] * (layer[:, 1] - layer[:, 0])
    return [
        OffsetTie.starting_at(
            blocks, legs, flat, UP,
            weights=weights, middles=middles, stiffness=stiffness[eccentric][members], offsets=offsets[members],
        )
        for members, blocks, legs, middles, weights in stencils(rod_nodes, pairs)
    ]  # fmt: skip


@njit("f2 i2 i2 i1 f2 f1 f1 f3 f3 f2 f3")
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


@njit(error_model="numpy")
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
