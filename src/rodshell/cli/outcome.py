"""Where a job's result goes, and what is said when it is there."""

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import click

if TYPE_CHECKING:
    from rodshell.case import Case
    from rodshell.output import Archive
    from rodshell.rods.section import Rod

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


def announce_rod(case: "Case", rod: "Rod", *, quiet: bool) -> None:
    """Name a rod of which the case left something open, before the job runs."""
    if case.rod.left_open and not quiet:
        from rodshell.output.result import rod_table
        from rodshell.output.summary import chosen, rod_text

        strength = case.checks.strength or (rod.material.bending_strength if rod.material else None)
        click.echo(f"rodshell: rod: {rod_text(rod_table(rod))}; {chosen(case.rod.left_open, strength)}", err=True)


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
    click.echo(f"rodshell: NOT CONVERGED: {result.status}; partial results are in {folder}", err=True)
    return NOT_CONVERGED
