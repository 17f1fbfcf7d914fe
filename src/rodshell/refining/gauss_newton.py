"""Gauss and Newton's method on a sum of squares within bounds, with a trust radius.

Each step solves the linear least-squares problem in the box of the bounds and the radius, where bounds that are reached
are kept until the problem leaves them (an active set) [Nocedal and Wright 2006, 10.3]. A design without a stable
equilibrium next to the predicted one shrinks the radius, and so does one that a limit refuses.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from rodshell.arrays import Floats
from rodshell.errors import OutOfTimeError
from rodshell.refining.objectives import LowestEigenvalue, Objective, residuals, slopes
from rodshell.refining.structure import Point
from rodshell.refining.variables import Design

ENOUGH = 0.01  # relative decrease of the root of the sum of squares below which a foreseen step is not worth taking
_NEAR_ENOUGH = 1e-5  # relative gap, of which the mesh knows no more
_POOR, GOOD = 0.25, 0.75  # actual over foreseen decrease
FIRM, _LEAST_RADIUS = 0.1, 1e-3  # radius that must not bound a step which says that there is no more to gain; the least


@dataclass(frozen=True)
class Step:
    """One evaluation: for progress and records.

    Args:
        rms: relative gap, or None where no equilibrium was found.
        lowest: lowest eigenvalue over that before, or None.
        accepted: whether the design became the new one.
        values: (n,) of the variables.
    """

    number: int
    rms: float | None
    lowest: float | None
    radius: float
    accepted: bool
    values: tuple[float, ...] = ()


@dataclass(frozen=True, eq=False)
class Found:
    """Where the search ended.

    Args:
        accepted: the designs that were accepted, the best last.
        converged: whether no step is foreseen to gain more.
        stopped: when and where the search was out of time, or "".
    """

    accepted: tuple[Point, ...]
    converged: bool
    factorizations: int
    steps: tuple[Step, ...]
    stopped: str = ""


def gauss_newton(
    variables: Design,
    first: Point,
    objectives: Sequence[Objective],
    floor: LowestEigenvalue,
    *,
    most: int,
    progress: Callable[[Step], None],
) -> Found:
    """Make a sum of squares small.

    Args:
        first: the design to start from.
        floor: one of the objectives, whose limit a design must keep to be accepted.
        most: designs that are tried.
        progress: called after each evaluation; an OutOfTimeError that it raises ends the search with what was found.
    """
    box, radius = variables.box, 1.0
    here, accepted, steps, factorizations = first, [first], list[Step](), 1
    converged, fresh, stopped = False, True, ""
    while len(steps) < most and radius >= _LEAST_RADIUS:
        if here.rms < _NEAR_ENOUGH:
            converged = True
            break
        if fresh:
            r, jacobian = residuals(objectives, here), slopes(objectives, here) * box.scale
            q, reduced = np.linalg.qr(jacobian)  # a square problem with the same minima
            right = -q.T @ r
            cost, fresh = float(r @ r), False
        low = np.maximum((box.lower - here.values) / box.scale, -radius)
        high = np.minimum((box.upper - here.values) / box.scale, radius)
        step = _least_squares(reduced, right, low, high)
        foreseen = float(np.sum((r + jacobian @ step) ** 2))
        reached = float(np.abs(step).max()) > 0.99 * radius
        if np.sqrt(foreseen) > (1.0 - ENOUGH) * np.sqrt(cost) and not (reached and radius < FIRM):
            converged = True
            break
        values = np.clip(here.values + box.scale * step, box.lower, box.upper)
        there, made = here.tried(values, variables.change(values))
        factorizations += made
        gain, lowest = -np.inf, None
        if there is not None:
            now = residuals(objectives, there)
            gain = (cost - float(now @ now)) / (cost - foreseen)
        good = there is not None and gain > 1e-2
        if there is not None and good:
            factorizations += 1
            lowest = float(there.modes.values[0]) / floor.before
            good = floor.allows(there)
        rms = None if there is None else there.rms
        steps.append(Step(len(steps) + 1, rms, lowest, radius, good, tuple(values.tolist())))
        if not good or gain < _POOR:
            radius *= 0.3 if there is None else 0.5
        elif gain > GOOD and reached:
            radius *= 2.0
        if good and there is not None:
            here, fresh = there, True
            accepted.append(here)
        try:
            progress(steps[-1])
        except OutOfTimeError as late:
            stopped = str(late)
            break
    return Found(tuple(accepted), converged, factorizations, tuple(steps), stopped)


def _least_squares(matrix: Floats, right: Floats, low: Floats, high: Floats) -> Floats:
    """(n,) least squares in a box; of directions without effect none is taken."""
    n, size = matrix.shape[1], float(np.linalg.norm(right))  # of the order of one: the method's tolerances are absolute
    matrix, right = matrix / size, right / size
    tiny = 1e-6 * float(np.linalg.norm(matrix)) * np.eye(n)
    matrix, right = np.vstack([matrix, tiny]), np.append(right, np.zeros(n))
    free = np.asarray(np.linalg.lstsq(matrix, right)[0])
    if n == 1 or bool(((low <= free) & (free <= high)).all()):
        return np.clip(free, low, high)
    tight = high - low < 1e-12
    low, high = np.where(tight, low - 1e-12, low), np.where(tight, high + 1e-12, high)
    return np.asarray(lsq_linear(matrix, right, (low, high), method="bvls").x)
