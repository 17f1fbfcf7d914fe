"""What a motion leaves behind: its states at chosen times, in memory or on disk."""

from dataclasses import dataclass
from enum import Enum
from pathlib import Path

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import OutputError
from rodshell.solve.implicit_euler import Motion


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
    End.STOPPED: "was told to stop",
    End.INTERRUPTED: "was interrupted; go on from `series.last`",
    End.STALLED: "could not go on with the smallest step allowed; look at the loads there, or allow a smaller step",
}


@dataclass(frozen=True)
class MotionReport:
    """Figures of a motion.

    Parameters
    ----------
    steps, refused_steps : taken, and tried in vain.
    smallest_step : of those taken [s].
    reason : why the last refused step was refused, or "".
    """

    end: End
    steps: int
    refused_steps: int
    iterations: int
    factorizations: int
    smallest_step: float
    seconds: float
    reason: str = ""


@dataclass(frozen=True)
class Moment:
    """A time of a motion; its `motion` has its source frames there, so that it can be continued.

    Parameters
    ----------
    time : [s]; state, velocity : (N, 3); energies : elastic and kinetic [J].
    """

    time: float
    state: Floats
    velocity: Floats
    motion: Motion

    @property
    def energies(self) -> tuple[float, float]:
        return self.motion.elastic_energy(self.state), self.motion.kinetic_energy(self.velocity)


@dataclass(frozen=True)
class TimeSeries:
    """A motion at k times.

    Parameters
    ----------
    times : (k,) [s]; states, velocities : (k, N, 3); energies : (k, 2) elastic and kinetic [J].
    last : the end reached, recorded or not; None for a series that was loaded.
    """

    times: Floats
    states: Floats
    velocities: Floats
    energies: Floats
    last: Moment | None = None
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


NAMES = ("times", "states", "velocities", "energies")


class Recorder:
    """Room for `rows` moments, in memory or as one .npy file each in the folder `stream`, which holds none yet.

    A row counts from the moment its time is written, which is last: a kill leaves whole rows only.
    """

    def __init__(self, rows: int, shape: tuple[int, ...], stream: str | Path | None) -> None:
        shapes = ((rows,), (rows, *shape), (rows, *shape), (rows, 2))
        self._arrays: list[Floats]
        if stream is None:
            self._arrays = [np.zeros(size) for size in shapes]
        else:
            folder = Path(stream)
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

    def add(self, moment: Moment) -> None:
        times, states, velocities, energies = self._arrays
        row = self._next
        states[row], velocities[row], energies[row] = moment.state, moment.velocity, moment.energies
        times[row] = moment.time
        self._next += 1

    def series(self, last: Moment, report: MotionReport) -> TimeSeries:
        for array in self._arrays:
            if isinstance(array, np.memmap):
                array.flush()
        count = _written(self._arrays[0])
        times, states, velocities, energies = (array[:count] for array in self._arrays)
        return TimeSeries(np.array(times), states, velocities, np.array(energies), last, report)


def _written(times: Floats) -> int:
    return int(np.count_nonzero(~np.isnan(times)))
