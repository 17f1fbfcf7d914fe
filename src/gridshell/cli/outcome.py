"""Where a job's result goes: the check before it runs, and what is written and said after it."""

import json
from collections.abc import Callable
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any, Protocol

import click

from gridshell.errors import OutputError

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
    """The folder for a result, by default out/NAME, which can be written now, before the job starts.

    Raises
    ------
    OutputError : it is a file, holds other things than a result, or cannot be written.
    """
    folder = Path(out) if out else Path("out") / Path(name).stem
    whole = folder.absolute()
    above = next(path for path in whole.parents if path.exists())
    if not above.is_dir():
        raise OutputError(f"the output folder {folder} cannot be made, {above} is a file: give another")
    try:
        with TemporaryDirectory(dir=above, prefix=".gridshell-"):  # a result is written beside it and renamed
            free = not whole.exists() or _may_be_replaced(whole)
    except OSError as reason:
        raise OutputError(
            f"the output folder {folder} cannot be written ({reason.strerror}: {above}): give another"
        ) from None
    if not free:
        raise OutputError(
            f"the output folder {folder} holds other things, which a result would replace: give a new one"
        )
    return folder


def _may_be_replaced(folder: Path) -> bool:
    """An earlier result may, and so may an empty folder."""
    return folder.is_dir() and ((folder / "result.json").is_file() or not any(folder.iterdir()))


def deliver(
    result: Result, save: Callable[[Path], object], folder: Path, *, as_json: bool, quiet: bool
) -> int:
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
