"""A shell in equilibrium, as a problem to solve: energies, edges, loads, a constraint; and its matrices' pattern."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.model import Assembly, Freedom
from rodshell.rods.elements import Elements
from rodshell.rods.stretch import Stretch
from rodshell.solve.constraint import Constraint
from rodshell.solve.linear import LinearSolver, Qdldl
from rodshell.solve.multifrontal import Multifrontal


@dataclass(frozen=True)
class Pattern:
    """Which blocks (m, k) of unknowns the energies couple, each block with `count` (n,) free directions; and what
    follows from that alone: the assembly's maps, and a solver with its order of elimination."""

    blocks: tuple[Ints, ...]
    count: Ints
    assembly: Assembly
    solver: LinearSolver

    def serves(self, blocks: tuple[Ints, ...], count: Ints) -> bool:
        """Whether another problem has this pattern."""
        here, there = (*self.blocks, self.count), (*blocks, count)
        return len(here) == len(there) and all(map(np.array_equal, here, there))


@dataclass(frozen=True)
class Problem:
    """A shell in equilibrium: elastic elements, edges, loads and a constraint.

    Parameters
    ----------
    elements : every energy but the stretch.
    stretch : the edges.
    inextensible : the strain must vanish (the edges' stiffness is a penalty), else edges are elastic.
    constraint : supports or a surface.
    length : characteristic length of the shape [m]: steps are measured by it.
    load : (n, 3) dead forces [N], or None.
    places : (n, 2) where the blocks lie in the flat grid, from which the order of elimination follows, or None.
    pattern : of a problem that was solved before; where this one has the same, it need not be analysed again.
    """

    elements: tuple[Elements, ...]
    stretch: Stretch
    constraint: Constraint
    length: float
    inextensible: bool = False
    load: Floats | None = None
    places: Floats | None = None
    pattern: Pattern | None = None


def linear_solver(
    indptr: NDArray[np.int64], indices: NDArray[np.int64], free: Freedom, places: Floats | None
) -> LinearSolver:
    """The solver for a pattern: ordered by the `places` (n, 2) of the blocks in the flat grid, if they are known."""
    if places is None:
        return Qdldl(indptr, indices)
    return Multifrontal(indptr, indices, np.repeat(places, free.count, axis=0))


def pattern_of(problem: Problem, blocks: tuple[Ints, ...], free: Freedom) -> Pattern:
    """The pattern of a problem: the one that comes with it, or a new one."""
    if problem.pattern is not None and problem.pattern.serves(blocks, free.count):
        return problem.pattern
    assembly = Assembly.of(blocks, free)
    solver = linear_solver(assembly.indptr, assembly.indices, free, problem.places)
    return Pattern(blocks, free.count, assembly, solver)
