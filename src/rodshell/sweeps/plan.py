"""The plan of a sweep: base, axes, columns and how it is run, read from a TOML file or a mapping."""

import shlex
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, fields
from difflib import get_close_matches
from importlib.util import find_spec
from itertools import product
from math import prod
from os import PathLike
from pathlib import Path
from typing import Annotated, Any, Literal

from rodshell.case import BUILT_IN
from rodshell.case.load import flattened
from rodshell.case.tables import toml_of
from rodshell.errors import InputError
from rodshell.figures.findings import CODES
from rodshell.job import Job
from rodshell.quantities import Duration, Memory, Value
from rodshell.schema import Place, read
from rodshell.sweeps.axes import BASE, Axis, read_axes
from rodshell.sweeps.columns import NUMBERS, Column, read_columns
from rodshell.units import shown
from rodshell.untrusted import read_text
from rodshell.validation import choice, choices_of, file_path

Source = str | PathLike[str] | Mapping[str, Any]
GENERATION = "generation"
TABLES = ("base", "columns", "axes", "sample", "run")


def _workers(given: object) -> int:
    if type(given) is not int or not 1 <= given <= 1024:
        raise ValueError("give a number of processes from 1 to 1024")
    return given


@dataclass(frozen=True)
class Settings:
    """How jobs are run: the table [run]."""

    engine: Annotated[Literal["processes", "dask"], "processes of this machine, or a dask cluster"] = "processes"
    workers: Annotated[int, Value(_workers), "number of jobs at the same time, on this machine"] = 1
    keep: Annotated[Literal["none", "best", "all"], "forms that are kept as result folders"] = "none"
    best: Annotated[str, "column whose smallest value is the best form's"] = "rms_pinned"
    without: Annotated[tuple[str, ...], Value(tuple), "codes of findings that the best form has none of"] = ()
    until: Annotated[
        Literal["pop-up", "fabrication"], "last stage of a job, as of `Job.run`; a pop-up has no verdict"
    ] = "fabrication"
    time_limit: Annotated[Duration | None, "longest time of one job"] = None
    memory_limit: Annotated[Memory | None, "largest memory of one job"] = None


@dataclass(frozen=True)
class Origin:
    """What a plan is read from.

    Args:
        name: of the file, for titles and the default folder.
        text: the file as it was given; "" for a mapping.
        folder: in which its files lie.
        bases: its jobs by the name that the column "base" shows, at least one.
    """

    name: str
    text: str
    folder: Path
    tables: Mapping[str, Any]
    bases: Mapping[str, Job]

    @property
    def first(self) -> Job:
        """The first base, by whose case quantities are read."""
        return next(iter(self.bases.values()))

    def source(self, base: str) -> str | None:
        """By what a command names a base; None for a job that was made in Python."""
        file = self.folder / base
        return base if base in BUILT_IN else str(file) if file.is_file() else None

    @property
    def studio_command(self) -> str:
        """The command that starts the studio, with the files of the first base that has any."""
        named = (self.source(name) for name, job in self.bases.items() if job.case.files)
        return shlex.join(["rodshell", "studio", *[source for source in named if source][:1]])


@dataclass(frozen=True)
class Plan:
    """What the plan of a sweep and that of a search have in common.

    Args:
        keys: by whose values a design is known: of the case, or "base", or "generation".
        columns: in addition to those of every table.
    """

    origin: Origin
    keys: tuple[str, ...]
    columns: tuple[Column, ...]
    settings: Settings

    def job(self, values: Sequence[Any]) -> Job:
        """The job of a design, by the values of its keys.

        Raises:
            InputError: no case can have them together.
        """
        base, changes = self._changes(values)
        return self.origin.bases[base].changed(changes) if changes else self.origin.bases[base]

    def command(self, values: Sequence[Any]) -> str | None:
        """The command that forms a design alone, by the values of its keys; None for a base that none can name."""
        base, changes = self._changes(values)
        if (source := self.origin.source(base)) is None:
            return None
        words = ["rodshell", "form", source]
        for key, value in flattened(changes).items():
            words += [f"--{key}", ",".join(map(str, value)) if isinstance(value, list | tuple) else str(value)]
        return shlex.join(words)

    def _changes(self, values: Sequence[Any]) -> tuple[str, dict[str, Any]]:
        """The name of a design's base, and what is changed in its case."""
        changes = dict(zip(self.keys, values, strict=True))
        changes.pop(GENERATION, None)
        return changes.pop(BASE, next(iter(self.origin.bases))), changes


@dataclass(frozen=True)
class SweepPlan(Plan):
    """A whole sweep.

    Args:
        axes: the first one changes slowest.
    """

    axes: tuple[Axis, ...]

    @property
    def count(self) -> int:
        """Number of designs."""
        return prod(len(axis.rows) for axis in self.axes)

    def designs(self) -> Iterator[tuple[tuple[Any, ...], Job]]:
        """Values of the keys, and the job, of each design in the order of the axes, made one by one.

        Raises:
            InputError: a case cannot have these values.
        """
        for rows in product(*(axis.rows for axis in self.axes)):
            values = tuple(value for row in rows for value in row)
            yield values, self.job(values)


def read_plan(source: Source) -> SweepPlan:
    """The plan of a sweep.

    Args:
        source: path of a TOML file, or its content as a mapping.

    Raises:
        InputError: it cannot be read or used; in one sentence.
    """
    origin = read_origin(source, TABLES)
    given = origin.tables
    sample = table(given, "sample") if "sample" in given else None
    axes = read_axes(table(given, "axes"), sample, origin.first, origin.folder)
    if len(origin.bases) > 1:
        axes = (Axis((BASE,), tuple((name,) for name in origin.bases)), *axes)
    if not axes:
        raise InputError('[axes] is missing: give at least one key, such as "layout.spacing" = ["25 mm", "30 mm"]')
    keys = tuple(key for axis in axes for key in axis.keys)
    columns = read_columns(given.get("columns", ()), keys)
    settings = read_settings(table(given, "run"), [column.name for column in columns])
    return SweepPlan(origin, keys, columns, settings, axes)


def read_origin(source: Source, tables: Sequence[str]) -> Origin:
    """What a plan is read from.

    Raises:
        InputError: it cannot be read, has a key that is not one of the `tables`, or its base cannot be used.
    """
    if isinstance(source, Mapping):
        name, text, folder, given = "sweep", "", Path(), source
    else:
        path = file_path("the sweep", source)
        text = read_text(path)
        name, folder, given = path.stem, path.parent, toml_of(str(path), text)
    known("", given, tables)
    return Origin(name, text, folder, given, _read_bases(given, folder))


def _read_bases(given: Mapping[str, Any], folder: Path) -> dict[str, Job]:
    """The jobs of the key `base`, one or several, by their names."""
    if BASE not in given:
        raise InputError(f"base is missing: give a case file, a surface, or one of {', '.join(BUILT_IN)}")
    sources = given[BASE] if isinstance(given[BASE], list | tuple) else [given[BASE]]
    bases = dict[str, Job]()
    for number, source in enumerate(sources, start=1):
        inside = isinstance(source, str) and source not in BUILT_IN and file_path(BASE, folder / source).exists()
        job = source if isinstance(source, Job) else Job.load(folder / source if inside else source)
        called = job.case.drawings.name or f"{job.case.target.kind} {number}"
        name = source if isinstance(source, str) else called
        if name in bases:
            raise InputError(f"base: {shown(name)} occurs twice: leave one out")
        job.to_toml()  # workers read it
        if job.case.drape.frames is not None:
            raise InputError(f"drape.frames = {shown(job.case.drape.frames)}: a sweep keeps no frames: leave it out")
        bases[name] = job
    if not bases:
        raise InputError("base = []: give at least one case")
    return bases


def read_settings(given: Mapping[str, Any], columns: Sequence[str]) -> Settings:
    """The table [run].

    Args:
        columns: names of columns in addition to those of every sweep.

    Raises:
        InputError: an unknown key, or a value that cannot be used.
    """
    if "address" in given:
        raise InputError(
            f"run.address = {shown(given['address'])}: a scheduler can run any program here, so that no file names it: "
            "leave it out, and type --address ADDRESS where you trust what answers there"
        )
    known("run", given, [each.name for each in fields(Settings)])
    without = choices_of("run.without", given.get("without", ()), tuple(CODES))
    settings = read(Settings, {**given, "without": without}, Place("run"))
    choice("run.best", settings.best, (*NUMBERS, *columns))
    if settings.without and settings.until == "pop-up":
        raise InputError('run.without needs the verdict, which run.until = "pop-up" leaves out: leave one out')
    if settings.memory_limit is not None and find_spec("psutil") is None:
        raise InputError('run.memory_limit needs the package psutil: pip install "rodshell[sweep]"')
    return settings


def table(given: Mapping[str, Any], name: str) -> Mapping[str, Any]:
    """A table of the file; empty where it is missing."""
    found = given.get(name, {})
    if not isinstance(found, Mapping):
        raise InputError(f"{name} = {shown(found)}: must be a table [{name}]")
    return found


def known(name: str, given: Mapping[str, Any], names: Sequence[str]) -> None:
    """InputError for a key that a table does not have; its name is "" for the whole file."""
    for key in given:
        if key not in names:
            near = get_close_matches(str(key), names, n=1)
            where = f"{name}.{key}" if name else str(key)
            hint = (
                f"did you mean {near[0]}?" if near else f"{f'[{name}]' if name else 'the file'} has {', '.join(names)}"
            )
            raise InputError(f"unknown key {where}: {hint}")
