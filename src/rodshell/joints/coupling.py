"""Couplings: where rods that are tied have their unknowns, and where the tie's energy goes [HQK 2.2].

SharedDofs        tied nodes are one node, tied angles one angle; there is no tie energy (the paper's *mapping*)
ImplicitPenalty   every rod and linker has its own; ties are springs in residual and Hessian
ExplicitPenalty   the same springs, their forces frozen at the start of each time step (the paper's default)
"""

from dataclasses import dataclass, replace
from math import isfinite
from typing import Self

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.rods.elements import NO_HESSIANS
from rodshell.rods.section import Rod


@dataclass(frozen=True)
class SharedDofs:
    """Tied unknowns are one."""

    name = "shared"


@dataclass(frozen=True)
class _Penalty:
    """Ties are springs.

    ERRATA to HQK Eqs 5, 6: C is a penalty stiffness, not a multiplier, and "C1 = C2 = 1e6 EI" mixes N/m and N m/rad.

    Parameters
    ----------
    C1 : of positions [N/m]; C2 : of twist angles, which linkers tie [N m/rad]. None: derived from the rods.
    """

    C1: float | None = None
    C2: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("C1", "N/m"), ("C2", "N m/rad")):
            value = getattr(self, name)
            if value is not None and not (isfinite(value) and value > 0):
                raise InputError(f"the penalty stiffness {name} must be positive and finite, not {value} {unit}")


@dataclass(frozen=True)
class ImplicitPenalty(_Penalty):
    """Ties in the residual and the Hessian. By default 1e4 times as stiff as an edge in stretch and in twist."""

    name = "implicit"

    def of(self, rod: Rod, edge: float) -> Self:
        """With the defaults for a rod and its edge length [m] filled in."""
        return replace(
            self,
            C1=self.C1 or 1e4 * rod.stretch_stiffness / edge,
            C2=self.C2 or 1e4 * rod.twist_stiffness / edge,
        )


@dataclass(frozen=True)
class ExplicitPenalty(_Penalty):
    """Ties by forces from the start of the time step: one banded solve for every rod and linker, and a step limit.

    By default C1 = (1.5/edge)^3 EI and C2 = GJ/edge, which allows steps of about 10 ms and 1 ms for the paper's rod at
    15 mm edges. (The paper's C2 = 1e6 EI would allow microseconds.)
    """

    name = "explicit"

    def of(self, rod: Rod, edge: float) -> Self:
        """With the defaults for a rod and its edge length [m] filled in."""
        return replace(
            self,
            C1=self.C1 or (1.5 / edge) ** 3 * min(rod.bend_stiffnesses),
            C2=self.C2 or rod.twist_stiffness / edge,
        )


Coupling = SharedDofs | ImplicitPenalty | ExplicitPenalty


@dataclass(frozen=True)
class Ties:
    """Springs between pairs of blocks [HQK Eqs 5, 6]: E = C/2 |a - b|^2 of nodes and of twist angles.

    Parameters
    ----------
    blocks : (t, 2); of twist angles both belong to edges that coincide, with one reference frame (ERRATA to Eq 6).
    stiffness : (t,) [N/m] or [N m/rad].
    """

    blocks: Ints
    stiffness: Floats

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
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
        return self
