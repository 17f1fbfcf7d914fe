"""A load that grows with a factor t, and what a structure under t times it is: its gradient, its tangent stiffness and
its rate of change.

A load may be dead forces, forces with a potential of their own (a pressure that follows the surface it acts on),
strains that are free of stress (temperature) and motions of supports (settlement). Under the factor t

    g(x, N, t) = 0   in the free directions,   N = EA (|e| / (1 + t e0) l0 - 1),   x = x0 + t u0 in the held ones,

and along a path of equilibria dx/dt = u0 + K^-1 (W - K u0 + B' EA e0), with W the forces at factor 1 and B' the
assembly of axial forces. A load without a potential (a pressure on a surface with a free edge) would make K
unsymmetric and is left out: its inertia would say nothing on stability.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Self

import numpy as np

from rodshell.arrays import Floats, Ints, State
from rodshell.errors import InputError
from rodshell.rods.elements import NO_HESSIANS, Elements, Stretch
from rodshell.solve.problem import Problem
from rodshell.solve.tangent import Tangent, TangentAssembly


@dataclass(frozen=True, eq=False, kw_only=True)
class Load:
    """What acts at the factor 1.

    Args:
        forces: (N, 3) dead forces [N, on twist angles N m]; None: none.
        potentials: energies whose negative gradients are forces that follow the structure; on its blocks.
        strains: (e,) strains of the edges that are free of stress [-], those of a temperature; None: none.
        motions: (N, 3) displacements of what is held [m, rad]; zero in the free directions; None: none.
    """

    forces: Floats | None = None
    potentials: tuple[Elements, ...] = ()
    strains: Floats | None = None
    motions: Floats | None = None

    @classmethod
    def of(cls, load: "Load | Floats") -> "Load":
        """A load, dead forces (N, 3) [N, on twist angles N m] being one."""
        return load if isinstance(load, Load) else cls(forces=load)

    def elements(self, elements: Sequence[Elements], state: State, factor: float) -> tuple[Elements, ...]:
        """The energies of a structure and of this load, with their source frames at a state.

        Args:
            elements: of the structure alone, or of both as this function returned them.
        """
        structure = [element.refreshed(state) for element in elements if not isinstance(element, _Proportional)]
        before = [element.potential for element in elements if isinstance(element, _Proportional)] or self.potentials
        return (*structure, *(_Proportional(potential.refreshed(state), factor) for potential in before))

    def stretch(self, stretch: Stretch, factor: float) -> Stretch:
        """The edges, given as they are at the factor 0, as they are free of stress under the factor."""
        if self.strains is None:
            return stretch
        return replace(stretch, rest_lengths=stretch.rest_lengths * (1.0 + factor * self.strains))

    def require(self, problem: Problem, state: Floats) -> None:
        """Raise InputError where the load does not fit a structure in any of its states, or moves what is free."""
        for name, given, shape in (
            ("forces", self.forces, state.shape),
            ("motions", self.motions, state.shape),
            ("strains", self.strains, problem.stretch.rest_lengths.shape),
        ):
            if given is not None and (given.shape != shape or not np.isfinite(given).all()):
                raise InputError(f"the load's {name} have the shape {given.shape}: give {shape}, all finite")
        free = problem.constraint.freedom(state)
        if self.motions is not None and np.abs(free.reduce(self.motions)).max(initial=0.0) > 0:
            raise InputError("the load's motions move what is free: give motions of supports only")


@dataclass(frozen=True, eq=False)
class _Proportional:
    """A potential times a factor, as an energy."""

    potential: Elements
    factor: float

    @property
    def blocks(self) -> Ints:
        return self.potential.blocks

    def evaluate(self, state: Floats, gradient: Floats, hessians: Floats = NO_HESSIANS) -> float:
        alone = np.zeros_like(gradient)
        energy = self.potential.evaluate(state, alone, hessians)
        gradient += self.factor * alone
        hessians *= self.factor
        return self.factor * energy

    def stress_stiffness(self, state: Floats, motion: Floats, hessians: Floats) -> None:
        """The whole stiffness of the potential: it is proportional to the factor."""
        self.potential.evaluate(state, np.zeros_like(state), hessians)

    def refreshed(self, state: Floats) -> Self:
        return replace(self, potential=self.potential.refreshed(state))


class LoadedAssembly:
    """Assembles the equations of a structure under t times a load, at one state after another.

    Args:
        problem: the structure; a load that it has stays as it is.
        state: (N, 3) any state, for the pattern.
    """

    def __init__(self, problem: Problem, load: Load, state: Floats) -> None:
        load.require(problem, state)
        self.load = load
        self.problem = replace(problem, elements=load.elements(problem.elements, state, 0.0))
        self._assembly = TangentAssembly(self.problem, state)

    def strains(self, state: State, factor: float) -> Floats:
        """(e,) elastic strains of the edges [-]."""
        return self.load.stretch(self.problem.stretch, factor).strains(state)

    def gradient(self, elements: Sequence[Elements], state: Floats, forces: Floats, factor: float) -> Floats:
        """(N, 3) forces out of balance [N, N m], those on the supports among them.

        Args:
            elements: of structure and load at the factor, with their source frames at, or near, the state.
            forces: (e,) axial forces [N].
        """
        result = self._assembly.gradient(elements, state, forces)
        return result if self.load.forces is None else result - factor * self.load.forces

    def values(self, elements: Sequence[Elements], state: Floats, forces: Floats, factor: float) -> Floats:
        """(nnz,) values of K in the order of the pattern; parameters as of `gradient`."""
        return self._assembly.values(elements, state, forces, self.load.stretch(self.problem.stretch, factor))[1]

    def tangent(
        self, elements: Sequence[Elements], state: Floats, forces: Floats, factor: float
    ) -> tuple[Tangent, Floats]:
        """The tangent stiffness, and the rate dx/dt (N, 3) of the state there [m, rad]; parameters as of `gradient`.

        Raises:
            SingularError: a pivot of the stiffness vanishes.
        """
        load, stretch = self.load, self.load.stretch(self.problem.stretch, factor)
        tangent = self._assembly.tangent(elements, state, forces, stretch)
        right = np.zeros_like(state) if load.forces is None else load.forces.copy()
        for element in elements:
            if isinstance(element, _Proportional):
                pull = np.zeros_like(state)
                element.potential.evaluate(state, pull)
                right -= pull
        if load.strains is not None:
            stretch.add_axial(state, -self._by_warming(stretch, state, factor), right)
        if load.motions is None:
            return tangent, tangent.solve(right)
        right -= self._assembly.product(load.motions)
        return tangent, tangent.solve(right) + load.motions

    def stress_values(self, elements: Sequence[Elements], state: Floats, rate: Floats) -> Floats:
        """(nnz,) values of the change of K per unit of t at t = 0, by the rate (N, 3) of the state, the geometry being
        frozen: that with the internal forces, and the stiffness of the load's own potentials."""
        change = self.change(state, rate, 0.0, 1.0)
        return self._assembly.stress_values(elements, state, change, rate)

    def change(self, state: State, rate: Floats, factor: float, per: float = 1.0) -> Floats:
        """(e,) rate of the axial forces [N], by that of the state (N, 3) [m, rad]."""
        stretch = self.load.stretch(self.problem.stretch, factor)
        result = stretch.stiffness * stretch.elongation(state, rate)
        return result if self.load.strains is None else result + per * self._by_warming(stretch, state, factor)

    def _by_warming(self, stretch: Stretch, state: Floats, factor: float) -> Floats:
        """(e,) derivative of the axial forces by t, nothing moving [N]."""
        strains = np.zeros(0) if self.load.strains is None else self.load.strains
        warmed = strains / (1.0 + factor * strains)
        return np.asarray(-stretch.stiffness * (1.0 + stretch.strains(state)) * warmed)
