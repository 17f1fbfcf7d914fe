"""Where a job's result goes, and what is said when it is there."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import click

if TYPE_CHECKING:
    from rodshell.output import Archive

FOUND, NOT_CONVERGED, UNBUILDABLE = 0, 3, 4


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


@dataclass(frozen=True)
class Kept:
    """An archive as a result; `kinds` of files are written with it (None: all)."""

    archive: "Archive"
    kinds: list[str] | None = None

    @property
    def status(self) -> str:
        return str(self.archive.result["status"])

    def summary(self) -> str:
        return self.archive.summary()

    def result(self) -> dict[str, Any]:
        return self.archive.result

    def save(self, folder: Path) -> Path:
        return self.archive.save(folder, self.kinds)


def output_folder(out: str | None, name: str) -> Path:
    """The folder for a result, by default out/NAME; asked for before the job starts.

    Raises
    ------
    OutputError : it cannot be written, or holds other things than a result.
    """
    from rodshell.output.folder import check_folder

    return check_folder(out or Path("out") / Path(name).stem)


def wanted_kinds(only: str | None) -> list[str] | None:
    """The kinds of files that --only names.

    Raises
    ------
    InputError : there is no such kind.
    """
    from rodshell.output.files import read_kinds

    return None if only is None else read_kinds(only)


def deliver(result: Result, save: Callable[[Path], object], folder: Path, *, as_json: bool, quiet: bool) -> int:
    """Save a result, print its summary, and return the exit code; not converged wins over not buildable."""
    save(folder)
    if as_json:
        click.echo(json.dumps({"out": str(folder), **result.result()}))
    elif not quiet:
        click.echo(result.summary())
        click.echo(f"written to {folder}")
    if result.status != "converged":
        click.echo(f"rodshell: NOT CONVERGED: {result.status}; partial results are in {folder}", err=True)
        return NOT_CONVERGED
    verdict = result.result().get("verdict")
    if verdict and verdict["level"] == "unbuildable":
        click.echo(f"rodshell: NOT BUILDABLE: {verdict['reasons'][0]}; results are in {folder}", err=True)
        return UNBUILDABLE
    return FOUND
