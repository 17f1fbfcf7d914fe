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
    """The equations of a structure under t times a load, at one state after another.

    Args:
        problem: the structure; a load that it has stays as it is.
        state: (N, 3) any state, for the pattern.

    Attributes:
        problem: what acts at the factor 0.
    """

    def __init__(self, problem: Problem, load: Load, state: Floats) -> None:
        load.require(problem, state)
        self.load, self._structure = load, problem
        self.problem = self.at(problem, state, 0.0)
        self._assembly = TangentAssembly(self.problem, state)

    def at(self, problem: Problem, state: Floats, factor: float) -> Problem:
        """What acts under a factor, with its source frames at a state.

        Args:
            problem: the structure alone, or as this function returned it.
        """
        load, dead = self.load, self._structure.load
        if load.forces is not None:
            dead = factor * load.forces if dead is None else dead + factor * load.forces
        stretch = load.stretch(self._structure.stretch, factor)
        return replace(problem, elements=load.elements(problem.elements, state, factor), stretch=stretch, load=dead)

    def values(self, problem: Problem, state: Floats, forces: Floats) -> Floats:
        """(nnz,) values of K in the order of the pattern, for what acts at the state (see `at`) with axial forces (e,)
        [N]."""
        return self._assembly.values(problem, state, forces)[1]

    def tangent(self, problem: Problem, state: Floats, forces: Floats) -> tuple[Tangent, Floats]:
        """The tangent stiffness, and the rate dx/dt (N, 3) of the state there [m, rad]; parameters as of `values`.

        Raises:
            SingularError: a pivot of the stiffness vanishes.
        """
        load = self.load
        tangent = self._assembly.tangent(problem, state, forces)
        right = np.zeros_like(state) if load.forces is None else load.forces.copy()
        for element in problem.elements:
            if isinstance(element, _Proportional):
                pull = np.zeros_like(state)
                element.potential.evaluate(state, pull)
                right -= pull
        if load.strains is not None:
            problem.stretch.add_axial(state, -self._by_warming(problem, state), right)
        if load.motions is None:
            return tangent, tangent.solve(right)
        right -= self._assembly.product(load.motions)
        return tangent, tangent.solve(right) + load.motions

    def stress_values(self, problem: Problem, state: Floats, rate: Floats) -> Floats:
        """(nnz,) values of the change of K per unit of t at t = 0, by the rate (N, 3) of the state, the geometry being
        frozen: that with the internal forces, and the stiffness of the load's own potentials."""
        return self._assembly.stress_values(problem, state, self.change(problem, state, rate), rate)

    def change(self, problem: Problem, state: State, rate: Floats, per: float = 1.0) -> Floats:
        """(e,) rate of the axial forces [N], by that of the state (N, 3) [m, rad], t changing at the rate `per`."""
        result = problem.stretch.stiffness * problem.stretch.elongation(state, rate)
        return result if self.load.strains is None else result + per * self._by_warming(problem, state)

    def _by_warming(self, problem: Problem, state: Floats) -> Floats:
        """(e,) derivative of the axial forces by t, nothing moving [N]."""
        strains = np.zeros(0) if self.load.strains is None else self.load.strains
        warmed = strains * self._structure.stretch.rest_lengths / problem.stretch.rest_lengths
        return np.asarray(-problem.stretch.stiffness * (1.0 + problem.stretch.strains(state)) * warmed)
