"""How long work says where it is: stage, detail and residual, at every iteration; and how it is ended there.

A progress may raise: KeyboardInterrupt ends the job; OutOfTimeError ends the stage, which hands out what it has.
"""

from collections.abc import Callable
from time import monotonic

from rodshell.errors import InputError, OutOfTimeError

Progress = Callable[[str, str, float], None]


def silent(stage: str, detail: str, residual: float) -> None:
    """Says nothing."""


class TimeLimit:
    """A progress that tells another one, and raises OutOfTimeError from the first call after `seconds` on."""

    def __init__(self, progress: Progress, seconds: float) -> None:
        if not seconds > 0:
            raise InputError(f"the time limit must be positive, not {seconds:g} s")
        self._progress, self._seconds, self._end = progress, seconds, monotonic() + seconds
        self._sentence = ""

    def __call__(self, stage: str, detail: str, residual: float) -> None:
        self._progress(stage, detail, residual)
        if monotonic() > self._end:
            self._sentence = self._sentence or f"out of time after {self._seconds:.4g} s in stage {stage} ({detail})"
            raise OutOfTimeError(self._sentence)


def limited(progress: Progress, seconds: float | None) -> Progress:
    """`progress` with a time limit from now on; None: without."""
    return progress if seconds is None else TimeLimit(progress, seconds)
