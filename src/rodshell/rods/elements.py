"""The contract of elastic energies, with exact gradients and Hessians on small stencils, and the stretch of edges.

The state of a shell is an (N, 3) array of *blocks*. A node is a block of three coordinates [m]; the twist
angle of an edge is a block of which only the first component is used [rad]. An element set names, for each
of its m elements, the k blocks that it touches: 2 for stretch, 3 for isotropic bending, 5 for bending and
twist (x, theta, x, theta, x). A solver sees only the sum of such sets [HQK Eq 1, 2, 4].

Stretch of an edge [HQK Eq 1a]: E = (N0 eps + EA/2 eps^2) |e0|, eps = |e|/|e0| - 1.

N0 = 0 is the paper's elastic edge. With a multiplier N0 it is the augmented Lagrangian of an inextensible
edge: at the solution the strain vanishes and N0 is the axial force.
"""

from dataclasses import dataclass, replace
from typing import Protocol, Self, runtime_checkable

import numba as nb
import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.validation import brief

NO_HESSIANS = np.empty((0, 0, 0))


class Elements(Protocol):
    """A sum of local energies.

    Attributes
    ----------
    blocks : (m, k) blocks of each element.
    """

    @property
    def blocks(self) -> Ints: ...

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], with its gradient and, where wanted, its Hessians.

        Parameters
        ----------
        state : (N, 3) node positions [m] and twist angles [rad].
        gradient : (N, 3), to which the energy's gradient is added [N, for angles N m].
        hessians : (m, 3k, 3k), filled with the element Hessians unless empty; rows and columns of the unused
            components of a twist angle are zero.
        """
        ...

    def refreshed(self, state: Floats) -> Self:
        """The same energy with its source frames moved to `state`; called at each accepted iterate."""
        ...


@runtime_checkable
class Stressed(Elements, Protocol):
    """Energies of strains whose internal forces stiffen or soften a structure: those that buckling looks at."""

    def stress_stiffness(self, state: Floats, motion: Floats, hessians: Floats) -> None:
        """How the Hessians change with the internal forces alone, the geometry being frozen: the sum over the strains e
        of (ds/de de/dx . motion) d2e/dx2, with s the internal force. The rest of the Hessian's derivative turns the
        stiffness of the material with the motion, and is wrong by far without its terms of second order.

        Parameters
        ----------
        state : (N, 3) node positions [m] and twist angles [rad], the source frames being at, or near, it.
        motion : (N, 3) along which the internal forces change, to first order [m, rad].
        hessians : (m, 3k, 3k), which are filled.
        """
        ...


@dataclass(frozen=True, eq=False)
class Stretch:
    """Elastic edges [HQK Eq 1a].

    Parameters
    ----------
    blocks : (e, 2) nodes of each edge.
    rest_lengths : (e,) [m].
    stiffness : (e,) EA [N].
    multipliers : (e,) N0 [N].
    forces : (e,) axial forces [N] of the geometric stiffness in the Hessian; None takes N0 + EA eps, which
        makes the Hessian exact. A solver that has the forces among its unknowns passes them here.
    """

    blocks: Ints
    rest_lengths: Floats
    stiffness: Floats
    multipliers: Floats
    forces: Floats | None = None

    __repr__ = brief

    @staticmethod
    def elastic(blocks: Ints, rest_lengths: Floats, stiffness: Floats) -> "Stretch":
        """The paper's elastic edges: no multipliers. Parameters as of the class.

        Parameters
        ----------
        blocks : (e, 2) nodes of each edge.
        rest_lengths : (e,) [m].
        stiffness : (e,) EA [N].
        """
        return Stretch(blocks, rest_lengths, stiffness, np.zeros(len(blocks)))

    def with_forces(self, forces: Floats | None, *, multipliers: Floats | None = None) -> "Stretch":
        """The same edges with other axial `forces` (e,) [N] and, if given, other `multipliers` (e,) [N].

        Parameters
        ----------
        forces : (e,) axial forces of the geometric stiffness [N]; None: those of the strains.
        multipliers : (e,) N0 [N]; None: unchanged.
        """
        return replace(self, forces=forces, multipliers=self.multipliers if multipliers is None else multipliers)

    def strains(self, state: Floats) -> Floats:
        """(e,) axial strains [-] at `state` (N, 3)."""
        return np.asarray(_strains(state, self.blocks, self.rest_lengths))

    def elongation(self, state: Floats, motion: Floats) -> Floats:
        """(e,) change of the strains [-] to first order for displacements `motion` (N, 3) [m] from `state`.

        Parameters
        ----------
        state : (N, 3) node positions [m] and twist angles [rad].
        motion : (N, 3) displacements [m].
        """
        return np.asarray(_elongation(state, motion, self.blocks, self.rest_lengths))

    def add_axial(self, state: Floats, forces: Floats, gradient: Floats) -> None:
        """Add to `gradient` (N, 3) that of edges with the axial `forces` (e,) [N].

        Parameters
        ----------
        state : (N, 3) node positions [m] and twist angles [rad].
        forces : (e,) axial forces [N].
        gradient : (N, 3), to which theirs is added [N].
        """
        _add_axial(state, self.blocks, forces, gradient)

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        """Energy [J], gradient and Hessians: see `Elements.evaluate`."""
        exact = self.forces is None
        forces = self.rest_lengths if self.forces is None else self.forces
        return float(
            _stretch(
                state,
                self.blocks,
                self.rest_lengths,
                self.stiffness,
                self.multipliers,
                forces,
                exact,
                gradient,
                hessians,
            )
        )

    def stress_stiffness(self, state: Floats, motion: Floats, hessians: Floats) -> None:
        """Of the change of the axial forces: see `Stressed.stress_stiffness`."""
        self.axial_stiffness(state, self.stiffness * self.elongation(state, motion), hessians)

    def axial_stiffness(self, state: Floats, forces: Floats, hessians: Floats) -> None:
        """Geometric stiffness of axial forces alone.

        Parameters
        ----------
        state : (N, 3) node positions [m] and twist angles [rad].
        forces : (e,) axial forces [N].
        hessians : (e, 6, 6), which are filled [N/m].
        """
        limp = replace(self, stiffness=np.zeros_like(self.stiffness), forces=forces)
        limp.evaluate(state, np.zeros_like(state), hessians)

    def refreshed(self, state: Floats) -> Self:
        """The same: there are no source frames."""
        return self


@nb.njit(cache=True, error_model="numpy")
def _stretch(x, edges, rest, stiffness, multipliers, forces, exact, gradient, hessians):  # type: ignore[no-untyped-def]
    """Stencil (x_a, x_b) [m]; energies [J], from HQK Eq 1a."""
    wanted = hessians.shape[0] > 0
    energy = 0.0
    for e in range(edges.shape[0]):
        a, b = edges[e, 0], edges[e, 1]
        d0, d1, d2 = x[b, 0] - x[a, 0], x[b, 1] - x[a, 1], x[b, 2] - x[a, 2]
        length = np.sqrt(d0 * d0 + d1 * d1 + d2 * d2)
        strain = length / rest[e] - 1.0
        energy += (multipliers[e] + 0.5 * stiffness[e] * strain) * strain * rest[e]
        force = multipliers[e] + stiffness[e] * strain
        t0, t1, t2 = d0 / length, d1 / length, d2 / length
        gradient[a, 0] -= force * t0
        gradient[a, 1] -= force * t1
        gradient[a, 2] -= force * t2
        gradient[b, 0] += force * t0
        gradient[b, 1] += force * t1
        gradient[b, 2] += force * t2
        if wanted:
            across = (force if exact else forces[e]) / length  # geometric stiffness
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


@nb.njit(cache=True, error_model="numpy")
def _strains(x, edges, rest):  # type: ignore[no-untyped-def]
    result = np.empty(len(edges))
    for e in range(len(edges)):
        square = 0.0
        for k in range(3):
            square += (x[edges[e, 1], k] - x[edges[e, 0], k]) ** 2
        result[e] = np.sqrt(square) / rest[e] - 1.0
    return result


@nb.njit(cache=True, error_model="numpy")
def _elongation(x, motion, edges, rest):  # type: ignore[no-untyped-def]
    result = np.empty(len(edges))
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        square, along = 0.0, 0.0
        for k in range(3):
            d = x[b, k] - x[a, k]
            square += d * d
            along += d * (motion[b, k] - motion[a, k])
        result[e] = along / (np.sqrt(square) * rest[e])
    return result


@nb.njit(cache=True, error_model="numpy")
def _add_axial(x, edges, forces, gradient):  # type: ignore[no-untyped-def]
    for e in range(len(edges)):
        a, b = edges[e, 0], edges[e, 1]
        square = 0.0
        for k in range(3):
            square += (x[b, k] - x[a, k]) ** 2
        share = forces[e] / np.sqrt(square)
        for k in range(3):
            pull = share * (x[b, k] - x[a, k])
            gradient[b, k] += pull
            gradient[a, k] -= pull
