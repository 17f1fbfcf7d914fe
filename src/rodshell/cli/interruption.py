"""Ctrl-C and SIGTERM: a job ends at once and cleans up after itself."""

import os
import signal
import sys
import threading
from contextlib import suppress
from types import FrameType
from typing import Any, Self

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
PATIENCE = 3  # signals after which the process ends without cleaning up


def end_at_once() -> None:
    """Let signals end the process silently except for one line, as long as there is nothing to clean up."""
    for number in _SIGNALS:
        if signal.getsignal(number) is not signal.SIG_IGN:  # a shell's background jobs ignore Ctrl-C
            signal.signal(number, _end)


def _end(number: int, _: FrameType | None) -> None:
    with suppress(OSError):
        os.write(2, b"rodshell: interrupted\n")
    os._exit(128 + number)


class Interrupted(Exception):
    """A KeyboardInterrupt that click does not see, with what it says was kept."""


class Interruption:
    """While it is entered, the first signal raises KeyboardInterrupt; those after it do not disturb the cleaning up.

    An interrupt can be lost where Python discards exceptions (finalizers, callbacks of C code): `check`, which every
    job calls at its iterations, raises it again.
    """

    current: "Interruption | None" = None

    def __init__(self) -> None:
        self.number: int | None = None
        self._count = 0
        self._before = dict[int, Any]()
        self._hook = sys.unraisablehook

    def __enter__(self) -> Self:
        Interruption.current = self
        if threading.current_thread() is threading.main_thread():
            wanted = [number for number in _SIGNALS if signal.getsignal(number) not in (signal.SIG_IGN, None)]
            self._before = {number: signal.signal(number, self._handle) for number in wanted}
        sys.unraisablehook = self._unraisable
        return self

    def __exit__(self, *error: object) -> None:
        Interruption.current = None
        sys.unraisablehook = self._hook
        for number, handler in self._before.items():
            signal.signal(number, handler)

    @property
    def code(self) -> int:
        """The exit code of a process that was interrupted: 130 after Ctrl-C, 143 after SIGTERM."""
        return 128 + (self.number or signal.SIGINT)

    @staticmethod
    def check() -> None:
        """Raise KeyboardInterrupt if a signal came."""
        if Interruption.current is not None and Interruption.current.number is not None:
            raise KeyboardInterrupt

    def _handle(self, number: int, _: FrameType | None) -> None:
        self._count += 1
        if self._count > PATIENCE:
            os._exit(128 + number)
        if self.number is None:
            self.number = number
            raise KeyboardInterrupt

    def _unraisable(self, lost: Any) -> None:
        if not issubclass(lost.exc_type, KeyboardInterrupt):
            self._hook(lost)
