"""Progress of long work: a function that is called with stage, detail and residual at every iteration.

It may raise: KeyboardInterrupt ends the job; OutOfTimeError ends the stage, which returns its partial result.
"""

import sys
from collections.abc import Callable
from time import monotonic
from typing import Self

from rodshell.errors import InputError, OutOfTimeError
from rodshell.printed import Printed, say
from rodshell.validation import function_of

Progress = Callable[[str, str, float], None]


def require_progress(progress: object) -> None:
    """InputError for what cannot be called with stage, detail and residual; asked before any work begins."""
    function_of("progress", progress, "a function of stage, detail and residual such as rodshell.bar", "", "", 0.0)


def silent(stage: str, detail: str, residual: float) -> None:
    """Report nothing."""


def where(stage: str, detail: str, residual: float) -> str:
    """An iteration in words."""
    return f"{stage}: {detail}" + (f", residual {residual:.1e}" if residual else "")


class Bar:
    """Progress for scripts and notebooks: one live line on a terminal, elsewhere a line for each stage.

    `Job.run` and `find_form` enter and leave it as a context manager; without that it prints the stages.
    """

    def __init__(self) -> None:
        self._stage = ""
        self._live: Printed | None = None

    def __enter__(self) -> Self:
        stream = Printed.of(sys.stderr)
        self._live = stream if stream.isatty() else None
        return self

    def __exit__(self, *error: object) -> None:
        self._stage = ""
        if self._live is not None:
            self._live.live("")
            self._live = None

    def __call__(self, stage: str, detail: str, residual: float) -> None:
        if self._live is not None:
            self._live.live(where(stage, detail, residual))
        elif stage != self._stage:
            say(stage)
        self._stage = stage


bar = Bar()


class TimeLimit:
    """Progress that calls another, and raises OutOfTimeError at every call later than `seconds` [s] from now."""

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
    """`progress` with a time limit of `seconds` [s] from now; None: no limit.

    Raises:
        InputError: it cannot be called.
    """
    require_progress(progress)
    return progress if seconds is None else TimeLimit(progress, seconds)
