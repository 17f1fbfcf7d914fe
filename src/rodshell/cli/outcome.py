"""Where a job's result goes, and what is said when it is there."""

import json
import shutil
from collections.abc import Callable, Iterable
from contextlib import AbstractContextManager
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import click

from rodshell.cli.interruption import Interruption
from rodshell.cli.progress import Progress
from rodshell.errors import InputError

if TYPE_CHECKING:
    from rodshell.case import Case
    from rodshell.checks.sizing import Fit
    from rodshell.results import Archive
    from rodshell.results.folder import ResultFolder
    from rodshell.rods.section import Rod

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
    """An archive as a result; `kinds` of files are written with it (None: all), and `more` by name."""

    archive: "Archive"
    kinds: list[str] | None = None
    more: dict[str, str] = field(default_factory=dict)

    @property
    def status(self) -> str:
        return self.archive.results.status

    def summary(self) -> str:
        return self.archive.summary()

    def result(self) -> dict[str, Any]:
        return self.archive.results.plain()

    def save(self, folder: "ResultFolder", progress: Progress) -> Path:
        from rodshell.output.files import save

        return save(self.archive, folder, self.kinds, more=self.more, progress=progress)


def output_folder(
    out: str | None, name: str, names: Iterable[str], *, force: bool
) -> "AbstractContextManager[ResultFolder]":
    """The folder for a result, by default out/NAME; opened before the job starts.

    names : patterns of what will be written there.

    Raises
    ------
    OutputError : it cannot be written, or holds files of these names that rodshell did not write.
    """
    from rodshell.results.folder import open_folder

    return open_folder(out or Path("out") / Path(name).stem, reserved=names, force=force)


def force_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """--force of every command that writes a result folder."""
    text = "Replace files in DIR that rodshell did not write, or that were changed since, where it has to write."
    return click.option("--force", is_flag=True, help=text)(command)


def wanted_kinds(only: str | None) -> list[str] | None:
    """The kinds of files that --only names.

    Raises
    ------
    InputError : there is no such kind.
    """
    from rodshell.output.files import read_kinds

    return None if only is None else read_kinds(only)


def announce_rod(case: "Case", rod: "Rod", fit: "Callable[[], Fit]", *, quiet: bool) -> None:
    """Name a rod of which the case left something open, and what decided its size, before the job runs."""
    if case.rod.left_open and not quiet:
        from rodshell.results.from_form import rod_type
        from rodshell.results.summary import chosen, rod_text
        from rodshell.rods.section import GivenSection

        said = f"rodshell: rod: {rod_text(rod_type(rod))}; {chosen(case.rod.left_open)}"
        if "section" in case.rod.left_open and rod.material and not isinstance(rod.section, GivenSection):
            why = fit().reason(rod.section, rod.material, strength=case.checks.strength, shape=case.rod.shape)
            said += f", {why}"
        click.echo(said, err=True)


def time_limit_option(command: Callable[..., Any]) -> Callable[..., Any]:
    """--time-limit of the commands that search."""
    text = 'Longest time such as "60 s" for all but the files; what was found until then is written.'
    return click.option("--time-limit", metavar="TIME", help=text)(command)


def seconds_of(given: str | None) -> float | None:
    """What --time-limit gives [s].

    Raises
    ------
    InputError : it is not a time, or not a positive one.
    """
    from rodshell.units import parse_quantity

    seconds = None if given is None else parse_quantity(given, "time", "--time-limit")
    if seconds is not None and seconds <= 0:
        raise InputError(f'--time-limit = "{given}": must be larger than zero')
    return seconds


def deliver(
    result: Result,
    save: "Callable[[ResultFolder, Progress], object]",
    place: "ResultFolder",
    *,
    progress: Progress,
    as_json: bool,
    quiet: bool,
) -> int:
    """Save a result, print its summary, and return the exit code; not converged wins over not buildable."""
    Interruption.check()
    with progress:
        folder = _saved(lambda where: save(where, progress), place)
    if as_json:
        click.echo(json.dumps({"out": str(folder), **result.result()}))
    elif not quiet:
        click.echo(result.summary())
        click.echo(f"written to {folder}")
    if result.status != "converged":
        late = result.status.startswith("out of time")
        said = result.status if late else f"NOT CONVERGED: {result.status}"
        click.echo(f"rodshell: {said}; partial results are in {folder}", err=True)
        return NOT_CONVERGED
    verdict = result.result().get("verdict")
    if verdict and verdict["level"] == "unbuildable":
        click.echo(f"rodshell: NOT BUILDABLE: {verdict['reasons'][0]}; results are in {folder}", err=True)
        return UNBUILDABLE
    return FOUND


def _saved(save: "Callable[[ResultFolder], object]", place: "ResultFolder") -> Path:
    """Where a result was saved: beside its place, if somebody put files there while the job ran."""
    from rodshell.results.folder import ForeignFileError, open_folder

    try:
        save(place)
        for name in place.kept:
            click.echo(f"rodshell: kept {place.path / name}: it was changed since an earlier run wrote it", err=True)
        return place.path
    except KeyboardInterrupt:
        if not place.committed:
            raise
        raise KeyboardInterrupt(f"the new result in {place.path} is complete") from None
    except ForeignFileError as error:
        names = (place.path.with_name(f"{place.path.name}-{k}") for k in count(2))
        free = next(path for path in names if not path.exists())
        with open_folder(free) as other:
            shutil.copytree(place.new, other.new, dirs_exist_ok=True)
            other.commit()
        click.echo(f"rodshell: written to {free} instead: {error}", err=True)
        return free
