"""Sliding down to a stable equilibrium from far away, where Newton's method and paths of loads fail.

The state follows the steepest descent of its energy, x' = -D^-1 grad E, by implicit Euler with steps that grow while
they succeed: each minimises E + D |x - x0|^2 / 2h^2 by `ImplicitEuler`, which refuses a step whose matrix is not
positive definite, so that the energy never grows. At first the matrix is nearly D, at last nearly the Hessian:
Levenberg and Marquardt's method, with a step length in place of their factor. D is the diagonal of the Hessian of
the elements where the descent starts, so that metres, radians and soft and stiff places all move at their own pace.
"""

import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import OutOfTimeError
from rodshell.solve.equilibrium import Equilibrium, find_stable
from rodshell.solve.implicit_euler import ImplicitEuler, Motion, Refused
from rodshell.solve.newton_matrix import SparseSum
from rodshell.solve.problem import Problem, linear_solver

FIRST = 6.0  # the first step leaves 1/36 of D in the matrix
GROWTH, SHRINKAGE = 3.0, 0.25
LONG, SHORT = 1e4, 1e-3  # steps that are long enough to have arrived; too short to be going anywhere
STILL = 1e-5  # of the length: a long step that moves by less has arrived near enough for Newton's method
MOST_STEPS = 400


def relax(problem: Problem, state: Floats, *, progress: Callable[[int, float], None] | None = None) -> Equilibrium:
    """The stable equilibrium that lies below a state; the last steps are those of `find_stable`.

    Parameters
    ----------
    problem : with elastic edges.
    state : (N, 3) to begin with [m, at twist angles rad].
    progress : called with the number and the length of each step; an OutOfTimeError that it raises ends the descent.

    Returns
    -------
    Its report counts the descent's work too.
    """
    begin = time.perf_counter()
    edges = problem.stretch.with_forces(None)
    motion = Motion((*problem.elements, edges), _pace(problem, state), problem.constraint, ())
    if problem.load is not None:
        motion = replace(motion, forces=(_Dead(problem.load),))
    stepper = ImplicitEuler(
        lambda blocks, free: SparseSum(
            blocks, free, lambda indptr, indices: linear_solver(indptr, indices, free, problem.flat_coordinates)
        )
    )
    still, length, factorizations, number = np.zeros_like(state), FIRST, 0, 0
    for number in range(1, MOST_STEPS + 1):
        taken = stepper.take(motion, state, still, time=0.0, step=length)
        factorizations += taken.factorizations
        if isinstance(taken, Refused):
            length *= SHRINKAGE
            if length < SHORT:
                break
            continue
        moved = float(np.abs(taken.state - state).max())
        state = taken.state
        motion = motion.refreshed(state)
        try:
            if progress is not None:
                progress(number, moved / problem.length)
        except OutOfTimeError:
            break  # the solve that follows ends at its first iteration, and says so
        if length > LONG and moved < STILL * problem.length:
            break
        length = min(GROWTH * length, GROWTH * LONG)
    forces = problem.stretch.stiffness * problem.stretch.strains(state)
    found = find_stable(replace(problem, elements=motion.elements[:-1]), state, forces, progress=progress)
    work = replace(found.report, iterations=number, factorizations=factorizations, seconds=time.perf_counter() - begin)
    return replace(found, report=found.report.after(replace(work, seconds=work.seconds - found.report.seconds)))


class _Dead:
    """A load that does not change."""

    def __init__(self, load: Floats) -> None:
        self._load = load

    def held(self, time: float, state: Floats, velocity: Floats, mass: Floats) -> Floats:
        return self._load


def _pace(problem: Problem, state: Floats) -> Floats:
    """(N, 3) D: the diagonal of the elements' Hessian, one value for each block."""
    diagonal = np.zeros(len(state))
    for element in problem.elements:
        count, width = element.blocks.shape
        hessians = np.zeros((count, 3 * width, 3 * width))
        element.evaluate(state, np.zeros_like(state), hessians)
        own = np.abs(np.einsum("mii->mi", hessians)).reshape(count, width, 3).max(axis=2)
        np.add.at(diagonal, element.blocks, own)
    least = 1e-6 * float(diagonal.max())
    return np.repeat(np.maximum(diagonal, least)[:, None], 3, axis=1)
