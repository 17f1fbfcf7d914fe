"""What acts on a structure: in equilibrium energies, loads and a constraint (`Problem`), in motion forces (`Force`).

The external forces of a motion are held over a step, or taken at its end where their gradient is known [HQK Eq 4]. Each
step asks a force once for the part that is held over it (`held`); a force may add an implicit part, whose gradient
enters Newton's matrix. Forces on a twist angle are moments [N m] in the first component of its block.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Protocol, Self

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.bounds import bounds
from rodshell.model import Assembly, Freedom, Potential, Shell
from rodshell.rods.elements import NO_HESSIANS, Elements, Stretch, evaluate_all, twist_angles
from rodshell.solve.sparse_ldl import Multifrontal
from rodshell.validation import array, finite, function_of, keep, number, vector

NO_CURVATURE = np.empty((0, 3, 3))


class Constraint(Protocol):
    """A manifold on which the state (n, 3) moves [m, at twist angles rad]. The count of free directions of each block
    never changes."""

    def freedom(self, state: Floats) -> Freedom:
        """The free directions at a state on the manifold."""
        ...

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        """Contribution of the constraint forces to the Hessian, by the gradient (n, 3) of energy and load [N, N m].

        Returns:
            (n, 3, 3) -lambda phi'' of each block [N/m]; or an empty array, at every state.
        """
        ...

    def remaining(self, state: Floats) -> Floats | None:
        """(n, 3) prescribed displacement across the free directions that is still to go [m, rad]; None where nothing
        moves."""
        ...

    def retract(self, state: Floats) -> Floats:
        """The state moved back onto the manifold after a step along the free directions."""
        ...


@dataclass(frozen=True, eq=False)
class Supports:
    """Fixed directions that never turn: supports, clamps, ghost nodes.

    Args:
        moved: (k,) blocks that are prescribed, all their directions being fixed; goals : (k, 3) where they go [m].
    """

    free: Freedom
    moved: Ints = field(default_factory=lambda: np.empty(0, dtype=np.intp))
    goals: Floats = field(default_factory=lambda: np.empty((0, 3)))

    def freedom(self, state: Floats) -> Freedom:
        return self.free

    def curvature(self, state: Floats, gradient: Floats) -> Floats:
        return NO_CURVATURE

    def remaining(self, state: Floats) -> Floats | None:
        if len(self.moved) == 0:
            return None
        result = np.zeros_like(state)
        result[self.moved] = self.goals - state[self.moved]
        return result

    def retract(self, state: Floats) -> Floats:
        return state


@dataclass(frozen=True, eq=False)
class MatrixPattern:
    """What follows from the pattern of a problem's matrices alone. It never changes, so that any number of solves and
    tangents share it.

    Args:
        blocks: (m, k) blocks of unknowns that each set of energies couples.
        count: (n,) free directions of each block.
        assembly: the maps from element Hessians to the sparse matrix.
        solver: the order of elimination and the symbolic factorisation.
    """

    blocks: tuple[Ints, ...]
    count: Ints
    assembly: Assembly
    solver: Multifrontal

    def serves(self, blocks: tuple[Ints, ...], count: Ints) -> bool:
        """Whether another problem, with these `blocks` and this `count`, has this pattern."""
        here, there = (*self.blocks, self.count), (*blocks, count)
        return len(here) == len(there) and all(map(np.array_equal, here, there))


@dataclass(frozen=True, eq=False)
class Problem:
    """A structure in equilibrium: elastic elements, edges, loads and a constraint.

    Args:
        elements: every energy but the stretch.
        length: characteristic length of the shape [m], by which motions are measured, see `unit`.
        inextensible: the strain must vanish (the edges' stiffness is a penalty), else edges are elastic.
        load: (n, 3) dead forces [N], or None.
        flat_coordinates: (n, 2) where the blocks lie in the flat grid [m], from which the order of elimination follows,
            or None.
        pattern: of a problem that was solved before; where the matrices of this one have the same pattern, they are not
            analysed again.
    """

    elements: tuple[Elements, ...]
    stretch: Stretch
    constraint: Constraint
    length: float
    inextensible: bool = False
    load: Floats | None = None
    flat_coordinates: Floats | None = None
    pattern: MatrixPattern | None = None

    @classmethod
    def of_shell(
        cls,
        shell: Shell,
        points: Floats,
        *,
        goals: Floats | None = None,
        elements: tuple[Elements, ...] | None = None,
        pattern: MatrixPattern | None = None,
    ) -> Self:
        """A shell without loads whose rod ends are held, or are on their way.

        Args:
            points: (k, 3) the rods' ends [m], whose mean radius is the characteristic length.
            goals: (k, 3) where the ends, and the ghost nodes of clamps after them, go [m]; None: they stay.
            elements: the shell's own energies, with their source frames elsewhere; None: those of the shell.
            pattern: of an earlier solve of this shell.
        """
        free = shell.held_ends()
        supports = Supports(free) if goals is None else Supports(free, np.append(shell.ends, shell.ghosts), goals)
        return cls(
            shell.elements if elements is None else elements,
            shell.stretch,
            supports,
            mean_radius(points),
            flat_coordinates=shell.flat_coordinates,
            pattern=pattern,
        )

    def blocks(self, count: int) -> tuple[Ints, ...]:
        """(m, k) blocks that each set of energies couples, of `count` blocks in all: the elements, the edges, and each
        block with itself, for the curvature of the constraint."""
        return (*(element.blocks for element in self.elements), self.stretch.blocks, np.arange(count)[:, None])

    def unit(self, count: int) -> Floats:
        """(count, 1) what the motion of each block is measured by: the length [m], or a turn of twist angles [rad]. So
        neither the unit of length nor the size of a structure decides how a solve goes. (By 1 rad, twists bound steps
        that nodes do not: two fifths of all pop-ups take more factorisations, up to three times as many.)"""
        return np.where(twist_angles(self.elements, count), 2.0 * np.pi, self.length)[:, None]

    def pattern_at(self, state: Floats) -> MatrixPattern:
        """The pattern of this problem, at any state: the one that comes with it where it serves, or a new one."""
        blocks, free = self.blocks(len(state)), self.constraint.freedom(state)
        if self.pattern is not None and self.pattern.serves(blocks, free.count):
            return self.pattern
        assembly = Assembly.of(blocks, free)
        if self.pattern is not None and assembly.has_pattern_of(self.pattern.assembly):
            solver = self.pattern.solver
        else:
            solver = linear_solver(assembly, free, self.flat_coordinates)
        return MatrixPattern(blocks, free.count, assembly, solver)

    @property
    def energies(self) -> Potential:
        """The sum of all energies."""
        return Potential((*self.elements, self.stretch))

    def refreshed(self, state: Floats) -> Self:
        """The same problem with the source frames of its elements at `state` (n, 3)."""
        return replace(self, elements=tuple(element.refreshed(state) for element in self.elements))

    def without_edges(self, state: Floats, hessians: Sequence[Floats]) -> Floats:
        """(n, 3) gradient of the elements and the load at a state [N, for angles N m]; `hessians`, of each set of
        elements, are filled unless they are empty."""
        gradient = np.zeros_like(state) if self.load is None else -self.load
        evaluate_all(self.elements, state, gradient, hessians)
        return gradient

    def gradient(self, state: Floats, forces: Floats) -> Floats:
        """(n, 3) gradient of energy and load at a state [N, for angles N m], the edges carrying the axial `forces` (e,)
        [N]."""
        gradient = self.without_edges(state, [NO_HESSIANS] * len(self.elements))
        self.stretch.add_axial(state, forces, gradient)
        return gradient

    def potential(self, state: Floats) -> float:
        """Elastic energy at `state` (n, 3) less the work of the load [J]."""
        elastic = self.energies.energy(state)
        return elastic - (0.0 if self.load is None else float(np.sum(self.load * state)))


def linear_solver(assembly: Assembly, free: Freedom, flat_coordinates: Floats | None) -> Multifrontal:
    """The solver for a pattern, ordered by where the blocks lie in the flat grid (n, 2) [m], if that is known; else by
    minimum degree."""
    if flat_coordinates is None:
        return Multifrontal(assembly.indptr, assembly.indices)
    return Multifrontal(
        assembly.indptr, assembly.indices, flat_coordinates.compress(free.count > 0, axis=0), blocks=assembly.rows
    )


def mean_radius(points: Floats) -> float:
    """Root mean square distance of points (k, 3) from their mean [m], whichever way they are turned: the characteristic
    length of a shape with these ends."""
    return float(np.sqrt(np.square(points - points.mean(axis=0)).sum() / len(points)))


def half_width(points: Floats) -> float:
    """Half of the largest extent of points (k, 3) along x, y or z [m]."""
    low, high = bounds(points)
    return 0.5 * float((high - low).max())


class Force(Protocol):
    """What every external force offers: the part that is held over a step."""

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> Floats | None:
        """The part of the force that is held over a step.

        Args:
            time: of the step's end [s].
            state, velocity: (N, 3) at its start [m, m/s].
            mass: (N, 3) lumped mass of each component [kg, kg m2].

        Returns:
            (N, 3) forces [N, on twist angles N m], or None.
        """
        ...


@dataclass(frozen=True, eq=False)
class GravityForce:
    """Weight of the nodes. Twist angles have inertia but no weight.

    Args:
        nodes: blocks that are nodes: `rod.nodes`.
        acceleration: (3,) [m/s2].
    """

    nodes: slice | Ints
    acceleration: tuple[float, float, float] = (0.0, 0.0, -9.81)

    def __post_init__(self) -> None:
        if not isinstance(self.nodes, slice) and getattr(self.nodes, "dtype", None) != np.bool_:  # nor a mask
            array("the nodes that gravity acts on", self.nodes, np.int64, None)
        vector("the acceleration of gravity", self.acceleration)

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> Floats:
        """The weight of the nodes; parameters as of `Force.held`."""
        force = np.zeros_like(mass)
        force[self.nodes] = mass[self.nodes] * self.acceleration
        return force


@dataclass(frozen=True, eq=False)
class PointLoads:
    """Constant forces (k, 3) [N] on `blocks` (k,), which may repeat."""

    blocks: Ints
    forces: Floats

    def __post_init__(self) -> None:
        object.__setattr__(self, "blocks", array("the blocks of point loads", self.blocks, np.int64, None))
        finite("the forces of point loads", self.forces, len(self.blocks), 3)

    @classmethod
    def on(cls, block: int, *force: float) -> "PointLoads":
        """One load on a single block.

        Args:
            block: a node or a twist angle.
            force: (fx, fy, fz) on a node [N], or one moment on a twist angle [N m].
        """
        return cls(np.array([block]), np.array([[*force, 0.0, 0.0][:3]]))

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> Floats:
        """The sum of the loads on each block; parameters as of `Force.held`."""
        force = np.zeros_like(mass)
        _check_blocks(self.blocks, len(mass))
        np.add.at(force, self.blocks, self.forces)
        return force


@dataclass(frozen=True, eq=False)
class Damping:
    """Viscous damping -(rate M + coefficients) v, implicit: it never overshoots.

    Args:
        rate: of all momenta [1/s]: alone it makes v decay as exp(-rate t), twist rates included.
        coefficients: (N, 3) or broadcast to it: drag of each block [N s/m, N m s/rad].
    """

    rate: float = 0.0
    coefficients: ArrayLike = 0.0

    def __post_init__(self) -> None:
        keep(self, number, "1/s", "rate", what="the damping {}")
        if self.rate < 0:
            raise InputError(f"the damping rate must not be negative, not {self.rate} 1/s: it would feed energy in")
        try:
            shape = np.shape(self.coefficients)
        except ValueError:  # rows of several lengths, which `finite` refuses
            shape = ()
        if (finite("the damping coefficients", self.coefficients, *shape) < 0).any():
            raise InputError("damping coefficients must not be negative: they would feed energy in")

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> None:
        return None

    def drag(self, mass: Floats) -> Floats:
        """(N, 3) force over velocity [N s/m], by the lumped `mass` (N, 3)."""
        return self.rate * mass + finite("the damping coefficients", self.coefficients, *mass.shape)


@dataclass(frozen=True)
class ExplicitForce:
    """A force without a gradient, held over each step.

    Args:
        force: (time, state, velocity) -> (N, 3) [N]; the time is that of the step's end, the rest of its start.
    """

    force: Callable[[float, Floats, Floats], Floats]

    def __post_init__(self) -> None:
        function_of("the force", self.force, "a function of time, state and velocity", 0.0, None, None)

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> Floats:
        """The force, evaluated once for the step; parameters as of `Force.held`."""
        return _checked(self.force(time, state, velocity), mass.shape, self.force, time)


@dataclass(frozen=True, eq=False)
class ImplicitForce:
    """A force with its gradient, taken at the end of each step.

    Args:
        force: (time, state, velocity) -> (N, 3) [N] and its derivatives by the state and by the velocity,
            (m, 3k, 3k) each [N/m, N s/m] on the stencils `blocks`; either may be None for zero. Of a derivative that is
            not symmetric (a load that follows the rod) Newton's matrix takes the symmetric part: it then converges
            linearly, to the same step.
        blocks: (m, k).
    """

    force: Callable[[float, Floats, Floats], tuple[Floats, Floats | None, Floats | None]]
    blocks: Ints

    def __post_init__(self) -> None:
        function_of("the force", self.force, "a function of time, state and velocity", 0.0, None, None)
        object.__setattr__(self, "blocks", array("the blocks of a force", self.blocks, np.int64, None, None))

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> None:
        _check_blocks(self.blocks, len(mass))

    def at(self, time: float, state: Floats, velocity: Floats, step: float) -> tuple[Floats, Floats]:
        """The force at the `time` of a step's end, in the `state` and at the `velocity` (N, 3) there.

        Returns:
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
