"""The plan of a sweep: base, axes, columns and how it is run, read from a TOML file or a mapping."""

import shlex
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from itertools import product
from math import prod
from os import PathLike
from pathlib import Path
from typing import Any, Literal, get_args

from rodshell.case import BUILT_IN
from rodshell.case.load import flattened
from rodshell.errors import InputError
from rodshell.job import Job
from rodshell.sweeps.axes import BASE, Axis, read_axes
from rodshell.sweeps.columns import STANDARD, Column, read_columns
from rodshell.units import parse_quantity, shown
from rodshell.validation import choice, instance

EngineName = Literal["processes", "dask"]
Keep = Literal["none", "best", "all"]
Until = Literal["pop-up", "fabrication"]
Source = str | PathLike[str] | Mapping[str, Any]
TABLES = ("base", "columns", "axes", "sample", "run")
RUN = ("engine", "address", "workers", "keep", "best", "until", "time_limit", "memory_limit")


@dataclass(frozen=True)
class Settings:
    """How jobs are run.

    Parameters
    ----------
    engine : "processes" on this machine, or "dask".
    address : of a dask scheduler, or its scheduler file; None: a local one.
    workers : number of jobs at the same time, on this machine.
    keep : which forms are kept as result folders.
    best : the column whose smallest value is the best form's.
    until : the last stage of a job, see `Job.run`; with "pop-up" there is no verdict.
    time_limit : longest time of one job [s]; memory_limit : largest memory of one job [B]; None: no limit.
    """

    engine: EngineName = "processes"
    address: str | None = None
    workers: int = 1
    keep: Keep = "none"
    best: str = "rms_pinned"
    until: Until = "fabrication"
    time_limit: float | None = None
    memory_limit: float | None = None


@dataclass(frozen=True)
class Design:
    """One point of a sweep.

    Parameters
    ----------
    position : its number in the order of the axes, from 0.
    values : of the axes' keys.
    job : what is computed.
    """

    position: int
    values: tuple[Any, ...]
    job: Job


@dataclass(frozen=True)
class Plan:
    """A whole sweep.

    Parameters
    ----------
    name : of the file, for the default folder.
    text : the file as it was given; "" for a mapping.
    folder : in which its files lie.
    bases : jobs by the name that the column "base" shows.
    axes : the first one changes slowest.
    columns : in addition to those of every sweep.
    settings : how it is run.
    """

    name: str
    text: str
    folder: Path
    bases: Mapping[str, Job]
    axes: tuple[Axis, ...]
    columns: tuple[Column, ...]
    settings: Settings

    @property
    def keys(self) -> tuple[str, ...]:
        """The axes' keys."""
        return tuple(key for axis in self.axes for key in axis.keys)

    @property
    def count(self) -> int:
        """Number of designs."""
        return prod(len(axis.rows) for axis in self.axes)

    def designs(self) -> Iterator[Design]:
        """All designs in the order of the axes, made one by one.

        Raises
        ------
        InputError : a case cannot have these values.
        """
        first = next(iter(self.bases.values()))
        for position, rows in enumerate(product(*(axis.rows for axis in self.axes))):
            values = tuple(value for row in rows for value in row)
            changes = dict(zip(self.keys, values, strict=True))
            base = self.bases[changes.pop(BASE)] if BASE in changes else first
            yield Design(position, values, base.changed(changes) if changes else base)

    def command(self, values: Sequence[Any]) -> str | None:
        """The command that forms a design alone; None for a base that no command can name.

        values : of the axes' keys.
        """
        changes = dict(zip(self.keys, values, strict=True))
        return form_command(changes.pop(BASE, next(iter(self.bases))), self.folder, changes)


def form_command(source: str, folder: Path, changes: Mapping[str, Any]) -> str | None:
    """The command that forms a design alone; None for a base that no command can name.

    Parameters
    ----------
    source : of the base; folder : in which its file lies; changes : values of the case's keys.
    """
    place = folder / source
    if source not in BUILT_IN and not place.is_file():
        return None
    words = ["rodshell", "form", source if source in BUILT_IN else str(place)]
    for key, value in flattened(changes).items():
        words += [f"--{key}", ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)]
    return shlex.join(words)


def read_plan(source: Source) -> Plan:
    """The plan of a sweep.

    Parameters
    ----------
    source : path of a TOML file, or its content as a mapping.

    Raises
    ------
    InputError : it cannot be read or used; in one sentence.
    """
    name, text, folder, given = opened(source)
    known("", given, TABLES)
    bases = read_bases(given, folder)
    first = next(iter(bases.values()))
    axes = read_axes(table(given, "axes"), table(given, "sample") if "sample" in given else None, first, folder)
    if len(bases) > 1:
        axes = (Axis((BASE,), tuple((name,) for name in bases)), *axes)
    if not axes:
        raise InputError('[axes] is missing: give at least one key, such as "layout.spacing" = ["25 mm", "30 mm"]')
    columns = read_columns(given.get("columns", ()), [key for axis in axes for key in axis.keys])
    settings = read_settings(table(given, "run"), [column.name for column in columns], folder)
    return Plan(name, text, folder, bases, axes, columns, settings)


def opened(source: Source) -> tuple[str, str, Path, Mapping[str, Any]]:
    """Name, text, folder and content of a TOML file; of a mapping, which lies in the current folder.

    Parameters
    ----------
    source : as of `read_plan`.

    Raises
    ------
    InputError : there is no such file, or it is not TOML.
    """
    if isinstance(source, Mapping):
        return "sweep", "", Path(), source
    instance("the sweep", source, str | PathLike, "the path of a TOML file, or a mapping")
    path = Path(source).expanduser()
    try:
        text = path.read_text(encoding="utf-8-sig")
        return path.stem, text, path.parent, tomllib.loads(text)
    except FileNotFoundError:
        raise InputError(f"there is no file named {shown(str(path))}: give a sweep file such as sweep.toml") from None
    except OSError as reason:
        raise InputError(f"{path} cannot be read: {reason.strerror}") from None
    except UnicodeDecodeError:
        raise InputError(f"{path} is not text in UTF-8: save it as UTF-8") from None
    except tomllib.TOMLDecodeError as reason:
        raise InputError(f"{path} is not valid TOML: {reason}") from None


def read_bases(given: Mapping[str, Any], folder: Path) -> dict[str, Job]:
    """The jobs of the key `base`, one or several, by their names.

    Parameters
    ----------
    given : the sweep; folder : in which case files lie.

    Raises
    ------
    InputError : it is missing, or a case cannot be read, or is not one that a file can describe.
    """
    if BASE not in given:
        raise InputError(f"base is missing: give a case file, a surface, or one of {', '.join(BUILT_IN)}")
    sources = given[BASE] if isinstance(given[BASE], list | tuple) else [given[BASE]]
    bases = dict[str, Job]()
    for number, source in enumerate(sources, start=1):
        if isinstance(source, Job):
            name, job = source.case.drawings.name or f"{source.case.target.kind} {number}", source
        else:
            inside = isinstance(source, str) and source not in BUILT_IN and (folder / source).exists()
            job = Job.load(folder / source if inside else source)
            name = source if isinstance(source, str) else job.case.drawings.name or f"{job.case.target.kind} {number}"
        if name in bases:
            raise InputError(f"base: {shown(name)} occurs twice: leave one out")
        job.to_toml()  # workers read it
        if job.case.drape.frames is not None:
            raise InputError(f"drape.frames = {shown(job.case.drape.frames)}: a sweep keeps no frames: leave it out")
        bases[name] = job
    if not bases:
        raise InputError("base = []: give at least one case")
    return bases


def read_settings(given: Mapping[str, Any], columns: Sequence[str], folder: Path) -> Settings:
    """The table [run].

    Parameters
    ----------
    given : the table; columns : names of columns in addition to those of every sweep; folder : of the sweep file.

    Raises
    ------
    InputError : an unknown key, or a value that cannot be used.
    """
    known("run", given, RUN)
    engine: EngineName = choice("run.engine", given.get("engine", "processes"), get_args(EngineName))
    address = given.get("address")
    if address is not None:
        instance("run.address", address, str, 'text such as "tcp://10.0.0.1:8786" or "scheduler.json"')
        if engine != "dask":
            raise InputError(f'run.address = {shown(address)}: is for engine = "dask": leave it out, or change engine')
        if address.endswith(".json"):
            address = str(folder / address)
    workers = given.get("workers", 1)
    if type(workers) is not int or not 1 <= workers <= 1024:
        raise InputError(f"run.workers = {shown(workers)}: give a number of processes from 1 to 1024")
    return Settings(
        engine=engine,
        address=address,
        workers=workers,
        keep=choice("run.keep", given.get("keep", "none"), get_args(Keep)),
        best=choice("run.best", given.get("best", "rms_pinned"), (*STANDARD[2:], *columns)),
        until=choice("run.until", given.get("until", "fabrication"), get_args(Until)),
        time_limit=_limit(given, "time_limit", "time"),
        memory_limit=_limit(given, "memory_limit", "memory"),
    )


def _limit(given: Mapping[str, Any], name: str, kind: Literal["time", "memory"]) -> float | None:
    value = given.get(name)
    if value is None:
        return None
    limit = parse_quantity(value, kind, f"run.{name}")
    if limit <= 0:
        raise InputError(f"run.{name} = {shown(value)}: must be larger than zero")
    return limit


def table(given: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """A table of the file; empty where it is missing."""
    found = given.get(name, {})
    if not isinstance(found, Mapping):
        raise InputError(f"{name} = {shown(found)}: must be a table [{name}]")
    return found


def known(name: str, given: Mapping[str, Any], names: Sequence[str]) -> None:
    """InputError for a key that a table does not have.

    Parameters
    ----------
    name : of the table, "" for the whole file; given : the table; names : of the keys that it has.
    """
    for key in given:
        if key not in names:
            near = get_close_matches(str(key), names, n=1)
            where = f"{name}.{key}" if name else str(key)
            hint = (
                f"did you mean {near[0]}?" if near else f"{f'[{name}]' if name else 'the file'} has {', '.join(names)}"
            )
            raise InputError(f"unknown key {where}: {hint}")
