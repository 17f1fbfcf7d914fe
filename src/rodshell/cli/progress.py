"""What is said on stderr while a job runs."""

import os
import sys
import threading
from pathlib import Path
from time import monotonic
from types import TracebackType
from typing import TYPE_CHECKING, Self

import click

from rodshell.cli.interruption import Interruption
from rodshell.uncached import kernels_are_kept

if TYPE_CHECKING:
    from rich.status import Status

UNKEPT = "no folder to keep them in can be written; NUMBA_CACHE_DIR may name one"
SILENCE = 10.0  # s: the longest without a word, away from a terminal
TICK = 0.5  # s, on a terminal


class Progress:
    """Says where a job is: stage, iteration, share, residual, elapsed time.

    On a terminal that is one live line; else one short line for each stage, and a long one after each `SILENCE`.
    Called as progress(stage, detail, residual) at each iteration; use it in a `with`, or in several in turn.

    Raises
    ------
    KeyboardInterrupt : the job was interrupted, and the interrupt was lost.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet
        self._begun = self._spoken = monotonic()
        self._stage, self._where = "", "preparing"
        self._live: Status | None = None
        self._over = threading.Event()
        self._voice: threading.Thread | None = None

    def __enter__(self) -> Self:
        if self._quiet:
            return self
        if sys.stderr.isatty():
            from rich.console import Console

            self._live = Console(stderr=True).status(self._where)
            self._live.start()
        self._over.clear()
        self._voice = threading.Thread(target=self._speak, args=(TICK if self._live else SILENCE / 10,), daemon=True)
        self._voice.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self._over.set()
        if self._voice is not None:
            self._voice.join()
            self._voice = None
        if self._live is not None:
            self._live.stop()
            self._live = None

    def __call__(self, stage: str, detail: str, residual: float) -> None:
        Interruption.check()
        reached = f", residual {residual:.1e}" if residual else ""
        self._where = f"{stage}: {detail}{reached}"
        if stage != self._stage and not self._quiet and self._live is None:
            self._say(stage)
        self._stage = stage

    def _speak(self, every: float) -> None:
        """Say where the job is, however long it has not called."""
        while not self._over.wait(every):
            where = f"{self._where}, {monotonic() - self._begun:.0f} s"
            if self._live is not None:
                from rich.text import Text

                self._live.update(Text(where))
            elif monotonic() - self._spoken >= SILENCE:
                self._say(where)

    def _say(self, words: str) -> None:
        self._spoken = monotonic()
        click.echo(f"rodshell: {words}", err=True)


def announce_compilation(*, quiet: bool = False) -> None:
    """Before the first run, say what it will wait for; and before each one, where nothing can be kept."""
    if quiet:
        return
    if not kernels_are_kept():
        click.echo(f"rodshell: compiling kernels anew, about 20 s: {UNKEPT}", err=True)
    elif not compiled_before():
        click.echo("rodshell: compiling kernels, once, about 20 s (rodshell warmup compiles all ahead)", err=True)


def compiled_before() -> bool:
    """Whether an earlier run of this Python left kernels where Numba keeps them."""
    import numba
    from numba.misc.appdirs import user_cache_dir

    import rodshell

    if numba.config.DISABLE_JIT:
        return True
    index = f"*.py{sys.version_info.major}{sys.version_info.minor}.nbi"
    own = os.environ.get("NUMBA_CACHE_DIR")
    places = [own] if own else [Path(rodshell.__file__).parent, user_cache_dir("numba", appauthor=False)]
    return any(next(Path(place).rglob(index), None) for place in places)
