"""External forces of a motion: held over a step, or taken at its end where their gradient is known [HQK Eq 4].

Each step asks a force once for the part that is held over it (`held`); a force may add an implicit part, whose gradient
enters Newton's matrix. Forces on a twist angle are moments [N m] in the first component of its block.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.validation import finite


class Force(Protocol):
    """What every external force offers: the part that is held over a step."""

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> Floats | None:
        """The part of the force that is held over a step.

        Parameters
        ----------
        time : of the step's end [s].
        state, velocity : (N, 3) at its start [m, m/s].
        mass : (N, 3) lumped mass of each component [kg, kg m2].

        Returns
        -------
        (N, 3) forces [N, on twist angles N m], or None.
        """
        ...


@dataclass(frozen=True)
class GravityForce:
    """Weight of the nodes. Twist angles have inertia but no weight.

    Parameters
    ----------
    nodes : blocks that are nodes: `rod.nodes`.
    acceleration : (3,) [m/s2].
    """

    nodes: slice | Ints
    acceleration: tuple[float, float, float] = (0.0, 0.0, -9.81)

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> Floats:
        force = np.zeros_like(mass)
        force[self.nodes] = mass[self.nodes] * self.acceleration
        return force


@dataclass(frozen=True)
class PointLoads:
    """Constant forces (k, 3) [N] on `blocks` (k,), which may repeat."""

    blocks: Ints
    forces: Floats

    @classmethod
    def on(cls, block: int, *force: float) -> "PointLoads":
        """One force (fx, fy, fz) [N] on a node, or one moment [N m] on a twist angle."""
        return cls(np.array([block]), np.array([[*force, 0.0, 0.0][:3]]))

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> Floats:
        force = np.zeros_like(mass)
        _check_blocks(self.blocks, len(mass))
        np.add.at(force, self.blocks, self.forces)
        return force


@dataclass(frozen=True)
class Damping:
    """Viscous damping -(rate M + coefficients) v, implicit: it never overshoots.

    Parameters
    ----------
    rate : of all momenta [1/s]: alone it makes v decay as exp(-rate t), twist rates included.
    coefficients : (N, 3) or broadcast to it: drag of each block [N s/m, N m s/rad].
    """

    rate: float = 0.0
    coefficients: ArrayLike = 0.0

    def __post_init__(self) -> None:
        if not self.rate >= 0:
            raise InputError(f"the damping rate must not be negative, not {self.rate} 1/s: it would feed energy in")
        if not np.all(np.asarray(self.coefficients) >= 0):
            raise InputError("damping coefficients must not be negative: they would feed energy in")

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> None:
        return None

    def drag(self, mass: Floats) -> Floats:
        """(N, 3) force over velocity [N s/m], by the lumped `mass` (N, 3)."""
        return self.rate * mass + finite("the damping coefficients", self.coefficients, *mass.shape)


@dataclass(frozen=True)
class ExplicitForce:
    """A force without a gradient, held over each step.

    Parameters
    ----------
    force : (time, state, velocity) -> (N, 3) [N]; the time is that of the step's end, the rest of its start.
    """

    force: Callable[[float, Floats, Floats], Floats]

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> Floats:
        return _checked(self.force(time, state, velocity), mass.shape, self.force, time)


@dataclass(frozen=True)
class ImplicitForce:
    """A force with its gradient, taken at the end of each step.

    Parameters
    ----------
    force : (time, state, velocity) -> (N, 3) [N] and its derivatives by the state and by the velocity,
        (m, 3k, 3k) each [N/m, N s/m] on the stencils `blocks`; either may be None for zero. Of a derivative that is
        not symmetric (a load that follows the rod) Newton's matrix takes the symmetric part: it then converges
        linearly, to the same step.
    blocks : (m, k).
    """

    force: Callable[[float, Floats, Floats], tuple[Floats, Floats | None, Floats | None]]
    blocks: Ints

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> None:
        _check_blocks(self.blocks, len(mass))

    def at(self, time: float, state: Floats, velocity: Floats, step: float) -> tuple[Floats, Floats]:
        """The force at the end of a step.

        Parameters
        ----------
        time : of the end [s].
        state, velocity : (N, 3) at the end [m, m/s].
        step : length of the step [s].

        Returns
        -------
        (N, 3) forces [N], and (m, 3k, 3k) minus the symmetric part of their derivative by the state at the end.
        """
        force, by_state, by_velocity = self.force(time, state, velocity)
        force = _checked(force, state.shape, self.force, time)
        width = 3 * self.blocks.shape[1]
        hessians = np.zeros((len(self.blocks), width, width))
        for derivative, share in ((by_state, 0.5), (by_velocity, 0.5 / step)):
            if derivative is not None:
                given = _checked(derivative, hessians.shape, self.force, time)
                hessians -= share * (given + given.transpose(0, 2, 1))
        return force, hessians


def _check_blocks(blocks: Ints, count: int) -> None:
    if blocks.size and not (blocks.min() >= 0 and blocks.max() < count):
        raise InputError(f"a force acts on block {blocks.max()}, but they run from 0 to {count - 1}")


def _checked(given: Floats, shape: tuple[int, ...], source: object, time: float) -> Floats:
    array = np.asarray(given, dtype=float)
    name = getattr(source, "__name__", repr(source))
    if array.shape != shape:
        raise InputError(f"{name} gave an array of shape {array.shape} at t = {time:.6g} s: give {shape}")
    if not np.isfinite(array).all():
        where = np.argwhere(~np.isfinite(array))[0].tolist()
        raise InputError(f"{name} gave {array[tuple(where)]} at index {where} at t = {time:.6g} s: give finite numbers")
    return array
