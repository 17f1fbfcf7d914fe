"""Following an equilibrium along a path of loads or supports, from t = 0 to t = 1."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from rodshell.solve.mixed_newton import Equilibrium, find_stable
from rodshell.solve.problem import Problem
from rodshell.solve.report import SolveReport, Status

Floats = NDArray[np.float64]

EASY = 5  # a step that needs no more iterations may be followed by a longer one
MOST = 25
SMALLEST_STEP = 1e-3
MOST_OF_ALL = 400  # iterations of the whole path; the paths that arrive take 30 to 100


def follow(
    problem_at: Callable[[float], Problem],
    state: Floats,
    forces: Floats,
    *,
    first_step: float,
    progress: Callable[[float, int, float], None] | None = None,
) -> Equilibrium:
    """Move from t = 0 to t = 1 by steps that halve on failure and grow back.

    Parameters
    ----------
    problem_at : the problem at t, its constraint saying where the prescribed blocks are then; its energies are the
        same at all t, and their source frames are carried along the path. The first
        iteration of each step carries them there with the tangent stiffness: it is the tangent predictor.
    state, forces : equilibrium, or a guess of it, at t = 0.

    Returns
    -------
    The equilibrium at t = 1, or at the last t reached, with the status STALLED. Iterations,
    factorizations and seconds of the report are those of the whole path, failed steps included.
    """
    t, step = 0.0, first_step
    reports = list[SolveReport]()
    last: Equilibrium | None = None
    while t < 1.0:
        there = min(1.0, t + step)

        def told(iteration: int, residual: float, there: float = there) -> None:
            if progress is not None:
                progress(there, iteration, residual)

        problem = problem_at(there)
        if last is not None:
            problem = replace(problem, elements=last.elements, pattern=last.pattern)
        found = find_stable(problem, state, forces, most_iterations=MOST, progress=told)
        reports.append(found.report)
        if found.report.converged:
            t, state, forces, last = there, found.state, found.forces, found
            if found.report.iterations <= EASY:
                step *= 1.6
        else:
            step = 0.4 * min(step, there - t)
        if found.report.status is Status.OUT_OF_TIME:
            break
        if t < 1.0 and (step < SMALLEST_STEP or sum(one.iterations for one in reports) > MOST_OF_ALL):
            break
    ended = last or found
    report = ended.report.after(*(one for one in reports if one is not ended.report))
    if t >= 1.0:
        return replace(ended, report=report)
    late = found.report.status is Status.OUT_OF_TIME
    status = Status.OUT_OF_TIME if late else Status.STALLED
    return replace(ended, report=replace(report, status=status, reason=found.report.reason))
