"""What is said on stderr while a job runs."""

import os
import sys
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Self

import click

from rodshell.cli.interruption import Interruption
from rodshell.uncached import kernels_are_kept

if TYPE_CHECKING:
    from rich.status import Status


UNKEPT = "no folder to keep them in can be written; NUMBA_CACHE_DIR may name one"


class Progress:
    """Says which stage a job is in: one live line on a terminal, else one short line for each stage.

    Called as progress(stage, detail, residual) at each iteration; use it in a `with`.
    """

    def __init__(self, *, quiet: bool = False) -> None:
        self._quiet = quiet
        self._stage: str | None = None
        self._live: Status | None = None

    def __enter__(self) -> Self:
        if not self._quiet and sys.stderr.isatty():
            from rich.console import Console

            self._live = Console(stderr=True).status("starting")
            self._live.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        if self._live is not None:
            self._live.stop()
            self._live = None

    def __call__(self, stage: str, detail: str, residual: float) -> None:
        Interruption.check()
        if self._live is not None:
            from rich.text import Text

            reached = f", residual {residual:.1e}" if residual else ""
            self._live.update(Text(f"{stage}: {detail}{reached}"))
        elif not self._quiet and stage != self._stage:
            click.echo(f"rodshell: {stage}", err=True)
        self._stage = stage


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
