"""Couplings: whether tied rods share their unknowns, and how the energy of the ties enters a step [HQK 2.2].

SharedDofs        tied nodes are one node, tied angles one angle; there is no tie energy (the paper's *mapping*)
ImplicitPenalty   each rod and linker has its own unknowns; ties are springs in residual and Hessian
ExplicitPenalty   the same springs, their forces frozen at the start of each time step (the paper's default)
"""

from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.rods.elements import NO_HESSIANS
from rodshell.rods.section import Rod
from rodshell.validation import brief, positive


@dataclass(frozen=True)
class SharedDofs:
    """Tied nodes are one node, tied twist angles one angle (the paper's *mapping*)."""

    name = "shared"


@dataclass(frozen=True)
class _Penalty:
    """Ties are springs.

    ERRATA E7 to HQK Eqs 5, 6: C is a penalty stiffness, not a multiplier; "C1 = C2 = 1e6 EI" mixes N/m and N m/rad.

    Parameters
    ----------
    C1 : stiffness of ties of nodes [N/m]; None: derived from the rods.
    C2 : stiffness of ties of twist angles, which linkers have [N m/rad]; None: derived from the rods.

    Raises
    ------
    InputError : a stiffness is not a positive number.
    """

    C1: float | None = None
    C2: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("C1", "N/m"), ("C2", "N m/rad")):
            if getattr(self, name) is not None:
                positive(f"the penalty stiffness {name}", getattr(self, name), unit)


@dataclass(frozen=True)
class ImplicitPenalty(_Penalty):
    """Ties in the residual and the Hessian. By default 1e4 times as stiff as an edge in stretch and in twist.

    Parameters and errors as of the paper's penalties: C1 [N/m] of nodes, C2 [N m/rad] of twist angles.
    """

    name = "implicit"

    __repr__ = brief

    def with_defaults(self, rod: Rod, edge: float) -> Self:
        """The same with the defaults for a `rod` with edges of the length `edge` [m] filled in.

        Parameters
        ----------
        rod : section and material of the rods.
        edge : length of their edges [m].
        """
        return replace(
            self,
            C1=self.C1 or 1e4 * rod.stretch_stiffness / edge,
            C2=self.C2 or 1e4 * rod.twist_stiffness / edge,
        )


@dataclass(frozen=True)
class ExplicitPenalty(_Penalty):
    """Ties by forces from the start of the time step: a banded solve for each rod and linker, and a step limit.

    Parameters and errors as of the paper's penalties: C1 [N/m] of nodes, C2 [N m/rad] of twist angles.
    By default C1 = (1.5/edge)^3 EI and C2 = GJ/edge, which allows steps of about 10 ms and 1 ms for the paper's rod at
    15 mm edges. (The paper's C2 = 1e6 EI would allow microseconds.)
    """

    name = "explicit"

    __repr__ = brief

    def with_defaults(self, rod: Rod, edge: float) -> Self:
        """The same with the defaults for a `rod` with edges of the length `edge` [m] filled in.

        Parameters
        ----------
        rod : section and material of the rods.
        edge : length of their edges [m].
        """
        return replace(
            self,
            C1=self.C1 or (1.5 / edge) ** 3 * min(rod.bend_stiffnesses),
            C2=self.C2 or rod.twist_stiffness / edge,
        )


Coupling = SharedDofs | ImplicitPenalty | ExplicitPenalty


@dataclass(frozen=True, eq=False)
class Ties:
    """Springs between pairs of blocks [HQK Eqs 5, 6]: E = C/2 |a - b|^2 of nodes and of twist angles.

    Parameters
    ----------
    blocks : (t, 2) the two nodes, or the two twist angles, whose edges must coincide and have the same reference
        frame (ERRATA E8 to Eq 6).
    stiffness : (t,) C1 [N/m] of nodes, C2 [N m/rad] of twist angles.
    """

    blocks: Ints
    stiffness: Floats

    __repr__ = brief

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
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

    def refreshed(self, state: Floats) -> Self:
        """The same: there are no source frames."""
        return self
