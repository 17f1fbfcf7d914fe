"""Moving a body in time: implicit Euler on a grid of times, with steps that halve on failure and grow back.

What a motion leaves behind is a `TimeSeries`: its states at chosen times, in memory or on disk.
"""

import time as clock
from collections.abc import Callable
from dataclasses import dataclass
from enum import Enum
from math import ceil
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats
from rodshell.errors import ConvergenceError, InputError, OutputError
from rodshell.solve.implicit_euler import ImplicitEuler, Motion, Refused, Step
from rodshell.solve.linear_stability import refuse_unstable
from rodshell.untrusted import limit, raised
from rodshell.validation import array, file_path, finite, flag, function_of, instance, number, positive, whole

EASY = 5  # Newton iterations after which a step that was halved may grow back
HALVINGS = 20
MOST_HALVINGS = 50  # a step of 1e-15 of the longest
RECORD = 2e9  # bytes of the samples of a motion
NAMES = ("times", "states", "velocities", "energies")  # of the files of a time series


class End(Enum):
    """How a motion ended; `sentence` says what to do."""

    FINISHED = "finished"
    INTERRUPTED = "interrupted"
    STOPPED = "stopped"
    STALLED = "stalled"

    @property
    def sentence(self) -> str:
        return _SENTENCES[self]


_SENTENCES = {
    End.FINISHED: "reached its end",
    End.STOPPED: "was stopped",
    End.INTERRUPTED: "was interrupted; continue from `series.last`",
    End.STALLED: "could not continue with the smallest step allowed; look at the loads there, or allow a smaller step",
}


@dataclass(frozen=True)
class MotionReport:
    """Figures of a motion.

    Args:
        steps, refused_steps: taken, and tried in vain.
        smallest_step: of those taken [s].
        reason: why the last refused step was refused, or "".
    """

    end: End
    steps: int
    refused_steps: int
    iterations: int
    factorizations: int
    smallest_step: float
    seconds: float
    reason: str = ""


@dataclass(frozen=True, eq=False)
class Sample:
    """A time of a motion; its `motion` has its source frames there, so that it can be continued.

    Args:
        time: [s]; state, velocity : (N, 3); energies : elastic and kinetic [J].
    """

    time: float
    state: Floats
    velocity: Floats
    motion: Motion

    @property
    def energies(self) -> tuple[float, float]:
        return self.motion.elastic_energy(self.state), self.motion.kinetic_energy(self.velocity)


@dataclass(frozen=True, eq=False)
class TimeSeries:
    """A motion at k times.

    Args:
        times: (k,) [s]; states, velocities : (k, N, 3); energies : (k, 2) elastic and kinetic [J].
        last: the end reached, recorded or not; None for a series that was loaded.
    """

    times: Floats
    states: Floats
    velocities: Floats
    energies: Floats
    last: Sample | None = None
    report: MotionReport | None = None

    @classmethod
    def load(cls, folder: str | Path) -> "TimeSeries":
        """The series streamed to `folder`, as far as it got; the states stay on disk until they are used."""
        try:
            times, *rest = (np.load(Path(folder) / f"{name}.npy", mmap_mode="r") for name in NAMES)
        except (OSError, ValueError) as error:
            raise OutputError(f"no time series in {folder}: {error}") from error
        count = _written(times)
        return cls(np.array(times[:count]), rest[0][:count], rest[1][:count], np.array(rest[2][:count]))


class _Recorder:
    """Room for `rows` samples, in memory or as one .npy file each in a folder, which holds none yet.

    A row counts once its time is written, which is last: a kill leaves complete rows only.
    """

    def __init__(self, rows: int, shape: tuple[int, ...], folder: Path | None) -> None:
        shapes = ((rows,), (rows, *shape), (rows, *shape), (rows, 2))
        self._arrays: list[Floats]
        if folder is None:
            self._arrays = [np.zeros(size) for size in shapes]
        else:
            there = [folder / f"{name}.npy" for name in NAMES if (folder / f"{name}.npy").exists()]
            if there:
                raise OutputError(f"will not replace {there[0]}: give a folder that holds no time series, or move that")
            try:
                folder.mkdir(parents=True, exist_ok=True)
                self._arrays = [
                    np.lib.format.open_memmap(folder / f"{name}.npy", mode="w+", dtype=np.float64, shape=size)
                    for name, size in zip(NAMES, shapes, strict=True)
                ]
            except OSError as error:
                raise OutputError(f"cannot write a time series to {folder}: {error}") from error
        self._arrays[0][:] = np.nan
        self._next = 0

    def add(self, sample: Sample) -> None:
        times, states, velocities, energies = self._arrays
        row = self._next
        states[row], velocities[row], energies[row] = sample.state, sample.velocity, sample.energies
        times[row] = sample.time
        self._next += 1

    def series(self, last: Sample, report: MotionReport) -> TimeSeries:
        for part in self._arrays:
            if isinstance(part, np.memmap):
                part.flush()
        count = _written(self._arrays[0])
        times, states, velocities, energies = (array[:count] for array in self._arrays)
        return TimeSeries(np.array(times), states, velocities, np.array(energies), last, report)


def _written(times: Floats) -> int:
    return int(np.count_nonzero(~np.isnan(times)))


class Stepper(Protocol):
    """Takes single steps, as `ImplicitEuler` does."""

    def take(self, motion: Motion, state: Floats, velocity: Floats, *, time: float, step: float) -> Step | Refused:
        """One step, or why it was refused; parameters as of `ImplicitEuler.take`."""
        ...


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
    progress: Callable[[Sample], None] | None = None,
    stepper: Stepper | None = None,
    stop: Callable[[Sample], bool] | None = None,
    interruptible: bool = False,
) -> TimeSeries:
    """Move from `state` (N, 3) and `velocity` (N, 3; at rest without) at the time `start` to `until` [s].

    Implicit Euler is of first order and damps: an oscillation of angular frequency w loses about a share w h / 2 of
    its amplitude per radian. Choose the step by the fastest motion that matters.

    Args:
        until, start: times at which the motion ends and starts [s].
        step: longest step [s]; the longest that divides the time evenly and is not longer is taken. A step that
            fails is taken in halves, these again in halves, and so on; steps grow back where that goes easily, and
            always meet the even grid again.
        every: record each so many steps of the grid; the start is always recorded.
        halvings: how often a step may be halved.
        stream: folder for the record, instead of memory; read it with `TimeSeries.load`. No file is replaced there.
        progress: called with every sample that is recorded.
        stepper: takes the steps; None: `ImplicitEuler()`.
        stop: called with the sample at every time of the grid; the motion ends where it returns True.
        interruptible: whether a KeyboardInterrupt ends the motion and what was finished is returned, `report.end`
            saying so; else it is raised, as everywhere.

    Raises:
        ConvergenceError: a step fails at its smallest; the record up to there is the error's `report`.
        StabilityError: the step is beyond the limit of the motion's explicit ties.
        OutputError: `stream` cannot be written, or holds a record.
        InputError: a value that is not finite comes in, from the caller or from a force.
    """
    instance("motion", motion, Motion)
    state = _of_motion("the state", state, motion)
    velocity = np.zeros_like(state) if velocity is None else _of_motion("the velocity", velocity, motion)
    if not motion.mass.any():
        raise InputError("nothing here has mass: give the section a mass per length, or a material")
    step, until, start = positive("the step", step, "s"), number("until", until, "s"), number("start", start, "s")
    every, halvings = whole("every", every, 1), whole("halvings", halvings, 0, MOST_HALVINGS)
    for name, given in (("progress", progress), ("stop", stop)):
        if given is not None:
            function_of(name, given, "a function of a sample", None)
    if stepper is not None:
        take = getattr(stepper, "take", None)
        wanted = "a function of motion, state, velocity, time and step"
        function_of("stepper.take", take, wanted, motion, state, velocity, time=start, step=step)
    folder = None if stream is None else file_path("stream", stream)
    interruptible = flag("interruptible", interruptible)
    if not until > start:
        raise InputError(f"the motion must end after it starts, not {until - start} s later")
    positive("the duration of the motion", until - start, "s")
    count = max(1, ceil((until - start) / step - 1e-9))
    samples = 1 + count // every
    if (size := samples * 2 * state.nbytes) > limit(RECORD):
        raise InputError(
            f"{samples} samples of this motion take {size / 1e9:.4g} GB: use a larger step, record every 10th one, "
            f"{raised(RECORD, size)}"
        )
    refuse_unstable(motion, state, (until - start) / count)
    begun, end = clock.perf_counter(), End.FINISHED
    grid, first = _Grid(start, (until - start) / count), Sample(start, state.copy(), velocity.copy(), motion.in_parts())
    march = _March(ImplicitEuler() if stepper is None else stepper, grid, first, halvings)
    recorder = _Recorder(samples, state.shape, folder)

    def record() -> None:
        recorder.add(march.sample)
        if progress is not None:
            progress(march.sample)

    try:
        record()
        while march.grid.number < count:
            on_grid = march.advance()
            if on_grid and march.grid.number % every == 0:
                record()
            if on_grid and stop is not None and stop(march.sample):
                end = End.STOPPED
                break
    except _StalledError:
        end = End.STALLED
    except KeyboardInterrupt:
        if not interruptible:
            raise
        end = End.INTERRUPTED
    series = recorder.series(march.sample, march.report(end, clock.perf_counter() - begun))
    if end is End.STALLED:
        raise ConvergenceError(
            f"the motion {end.sentence}: stopped at t = {march.sample.time:.6g} s with a step of "
            f"{march.grid.step:.3g} s ({march.reason})",
            series,
        )
    return series


class _StalledError(Exception):
    """A step failed that may not be halved any more."""


@dataclass
class _March:
    """A motion on its way: where it is, and what it took."""

    stepper: Stepper
    grid: "_Grid"
    sample: Sample
    halvings: int
    steps: int = 0
    refused: int = 0
    iterations: int = 0
    factorizations: int = 0
    smallest: float = float("inf")
    reason: str = ""

    def advance(self) -> bool:
        """Take the next step, or halve it; whether that has led to a time of the even grid."""
        here, grid = self.sample, self.grid
        taken = self.stepper.take(here.motion, here.state, here.velocity, time=here.time, step=grid.step)
        self.factorizations += taken.factorizations
        if isinstance(taken, Refused):
            self.refused += 1
            self.reason = taken.reason
            if grid.level == self.halvings:
                raise _StalledError
            self.grid = grid.halved()
            return False
        self.steps += 1
        self.iterations += taken.iterations
        self.smallest = min(self.smallest, grid.step)
        self.grid = grid.next(grow=taken.iterations <= EASY)
        self.sample = Sample(self.grid.time, taken.state, taken.velocity, here.motion.refreshed(taken.state))
        return self.grid.number > grid.number

    def report(self, end: End, seconds: float) -> MotionReport:
        return MotionReport(
            end, self.steps, self.refused, self.iterations, self.factorizations, self.smallest, seconds, self.reason
        )


@dataclass(frozen=True)
class _Grid:
    """One of the times start + number * length, or between them in parts of 2^-level."""

    start: float
    length: float
    number: int = 0
    level: int = 0
    part: int = 0

    @property
    def step(self) -> float:
        return self.length / float(2**self.level)

    @property
    def time(self) -> float:
        return self.start + (self.number + self.part / float(2**self.level)) * self.length

    def halved(self) -> "_Grid":
        return _Grid(self.start, self.length, self.number, self.level + 1, 2 * self.part)

    def next(self, *, grow: bool) -> "_Grid":
        """The end of this step; from there steps are twice as long, if they may be and the time allows it."""
        number, part, level = self.number, self.part + 1, self.level
        if part == 2**level:
            number, part = number + 1, 0
        if grow and level > 0 and part % 2 == 0:
            part, level = part // 2, level - 1
        return _Grid(self.start, self.length, number, level, part)


def _of_motion(name: str, given: ArrayLike, motion: Motion) -> Floats:
    """An array (N, 3) as the motion has blocks."""
    return finite(name, array(name, given, np.float64, *motion.mass.shape), *motion.mass.shape)
