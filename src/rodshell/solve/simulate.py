"""Moving a body in time: implicit Euler on a grid of times, with steps that halve on failure and grow back."""

import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from math import ceil, isfinite
from pathlib import Path
from typing import Protocol

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import ConvergenceError, InputError
from rodshell.solve.implicit_euler import ImplicitEuler, MakeMatrix, Motion, Refused, Step
from rodshell.solve.step_limit import refuse_unstable
from rodshell.solve.summed import narrow_or_sparse
from rodshell.solve.time_series import End, Moment, MotionReport, Recorder, TimeSeries

EASY = 5  # Newton iterations after which a step that was halved may grow back
HALVINGS = 20


class Stepper(Protocol):
    """Takes single steps."""

    def take(self, motion: Motion, state: Floats, velocity: Floats, *, time: float, step: float) -> Step | Refused: ...


def simulate(
    motion: Motion,
    state: Floats,
    velocity: Floats | None = None,
    *,
    until: float,
    step: float,
    start: float = 0.0,
    every: int = 1,
    halvings: int = HALVINGS,
    stream: str | Path | None = None,
    progress: Callable[[Moment], None] | None = None,
    matrix: MakeMatrix = narrow_or_sparse,
    stepper: Stepper | None = None,
    stop: Callable[[Moment], bool] | None = None,
    interruptible: bool = False,
) -> TimeSeries:
    """Move from `state` (N, 3) and `velocity` (N, 3; at rest without) at the time `start` to `until` [s].

    Implicit Euler is of first order and damps: an oscillation of angular frequency w loses about a share w h / 2 of
    its amplitude per radian. Choose the step by the fastest motion that matters.

    Parameters
    ----------
    step : longest step [s]; the longest that divides the time evenly and is not longer is taken. A step that
        fails is taken in halves, these again in halves, and so on; steps grow back where that goes easily, and
        always meet the even grid again.
    every : record each so many steps of the grid; the start is always recorded.
    halvings : how often a step may be halved.
    stream : folder for the record, instead of memory; read it with `TimeSeries.load`. No file is replaced there.
    progress : told of every moment that is recorded.
    stepper : takes the steps; `ImplicitEuler` with `matrix` without.
    stop : asked at every moment of the grid of times whether to end there.
    interruptible : whether a KeyboardInterrupt ends the motion and what was finished is returned, `report.end` saying
        so; else it is raised, as everywhere.

    Raises
    ------
    ConvergenceError : a step fails at its smallest; the record up to there is the error's `report`.
    StabilityError : the step is beyond the limit of the motion's explicit ties.
    OutputError : `stream` cannot be written, or holds a record.
    InputError : a value that is not finite comes in, from the caller or from a force.
    """
    velocity = np.zeros_like(state) if velocity is None else velocity
    _check(motion, state, velocity, until - start, step, every, halvings)
    count = max(1, ceil((until - start) / step - 1e-9))
    refuse_unstable(motion, state, (until - start) / count)
    begun = clock.perf_counter()
    grid = _Grid(start, (until - start) / count)
    stepper = stepper or ImplicitEuler(matrix)
    recorder = Recorder(1 + count // every, state.shape, stream)
    moment = Moment(start, state.copy(), velocity.copy(), motion.in_parts())
    tally = _Tally()
    end = End.FINISHED

    def record() -> None:
        recorder.add(moment)
        if progress is not None:
            progress(moment)

    try:
        record()
        while grid.number < count:
            taken = stepper.take(
                moment.motion, moment.state, moment.velocity, time=moment.time, step=grid.step
            )  # fmt: skip
            tally.factorizations += taken.factorizations
            if isinstance(taken, Refused):
                tally.refused += 1
                tally.reason = taken.reason
                if grid.level == halvings:
                    end = End.STALLED
                    break
                grid = grid.halved()
                continue
            tally.steps += 1
            tally.iterations += taken.iterations
            tally.smallest = min(tally.smallest, grid.step)
            ahead = grid.next(grow=taken.iterations <= EASY)
            moment = Moment(ahead.time, taken.state, taken.velocity, moment.motion.refreshed(taken.state))
            even, grid = ahead.number > grid.number, ahead
            if even and grid.number % every == 0:
                record()
            if even and stop is not None and stop(moment):
                end = End.STOPPED
                break
    except KeyboardInterrupt:
        if not interruptible:
            raise
        end = End.INTERRUPTED
    report = MotionReport(
        end, tally.steps, tally.refused, tally.iterations, tally.factorizations, tally.smallest,
        clock.perf_counter() - begun, tally.reason,
    )  # fmt: skip
    series = recorder.series(moment, report)
    if end is End.STALLED:
        raise ConvergenceError(
            f"the motion {end.sentence}: stopped at t = {moment.time:.6g} s with a step of {grid.step:.3g} s "
            f"({tally.reason})",
            series,
        )
    return series


@dataclass(frozen=True)
class _Grid:
    """A place among the times start + number * length, and between them in parts of 2^-level."""

    start: float
    length: float
    number: int = 0
    level: int = 0
    part: int = 0

    @property
    def step(self) -> float:
        return self.length / 2**self.level

    @property
    def time(self) -> float:
        return self.start + (self.number + self.part / 2**self.level) * self.length

    def halved(self) -> "_Grid":
        return _Grid(self.start, self.length, self.number, self.level + 1, 2 * self.part)

    def next(self, *, grow: bool) -> "_Grid":
        """The end of this step; from there steps are twice as long, if they may be and the place allows it."""
        number, part, level = self.number, self.part + 1, self.level
        if part == 2**level:
            number, part = number + 1, 0
        if grow and level > 0 and part % 2 == 0:
            part, level = part // 2, level - 1
        return _Grid(self.start, self.length, number, level, part)


@dataclass
class _Tally:
    steps: int = 0
    refused: int = 0
    iterations: int = 0
    factorizations: int = 0
    smallest: float = float("inf")
    reason: str = ""


def _check(
    motion: Motion, state: Floats, velocity: Floats, duration: float, step: float, every: int, halvings: int
) -> None:
    shape = motion.mass.shape
    for name, array in (("state", state), ("velocity", velocity), ("mass", motion.mass)):
        if array.shape != shape:
            raise InputError(f"the {name} has the shape {array.shape}: give one of the mass's, {shape}")
        if not np.isfinite(array).all():
            where = np.argwhere(~np.isfinite(array))[0].tolist()
            raise InputError(f"the {name} is {array[tuple(where)]} at {where}: give finite numbers")
    if not (motion.mass >= 0).all():
        where = np.argwhere(motion.mass < 0)[0].tolist()
        raise InputError(f"the mass is {motion.mass[tuple(where)]} at {where}: masses must not be negative")
    if not motion.mass.any():
        raise InputError("nothing here has mass: give the section a mass per length, or a material")
    if not (isfinite(step) and step > 0):
        raise InputError(f"the step must be positive, not {step} s")
    if not (isfinite(duration) and duration > 0):
        raise InputError(f"the motion must end after it starts, not {duration} s later")
    if halvings < 0:
        raise InputError(f"a step may be halved 0, 1, ... times, not {halvings}")
    if every < 1:
        raise InputError(f"record every 1, 2, ... steps, not every {every}")
