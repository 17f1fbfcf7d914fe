"""Where a job's result goes, and what is said when it is there."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, Protocol

import click

CONVERGED, NOT_CONVERGED = 0, 3


class Result(Protocol):
    """What every job returns. `status` is "converged" or says why not."""

    @property
    def status(self) -> str: ...
    def summary(self) -> str:
        """One screen of text."""
        ...

    def result(self) -> dict[str, Any]:
        """What result.json holds."""
        ...


def output_folder(out: str | None, name: str) -> Path:
    """The folder for a result, by default out/NAME; asked for before the job starts.

    Raises
    ------
    OutputError : it cannot be written, or holds other things than a result.
    """
    from gridshell.output.folder import check_folder

    return check_folder(out or Path("out") / Path(name).stem)


def deliver(result: Result, save: Callable[[Path], object], folder: Path, *, as_json: bool, quiet: bool) -> int:
    """Save a result, print its summary, and return the exit code."""
    save(folder)
    if as_json:
        click.echo(json.dumps({"out": str(folder), **result.result()}))
    elif not quiet:
        click.echo(result.summary())
        click.echo(f"written to {folder}")
    if result.status == "converged":
        return CONVERGED
    click.echo(f"gridshell: NOT CONVERGED: {result.status}; partial results are in {folder}", err=True)
    return NOT_CONVERGED
