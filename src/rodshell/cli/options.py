"""Options of the commands: keys of the case file, and those that several commands have."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cache, wraps
from itertools import pairwise
from typing import Any

import click

from rodshell.case import Case, CaseKey, case_keys, load_case
from rodshell.case.keys import BY_KIND, keys_of_kinds
from rodshell.case.load_tables import usual_loads
from rodshell.errors import InputError
from rodshell.quantities import Duration
from rodshell.schema import value_of, written

ALIASES = {path: f"--{path.partition('.')[2]}" for path in (
    "target.radius", "target.formula", "target.unit", "target.up", "target.base", "target.boundary",
    "layout.rods", "layout.spacing", "layout.length", "layout.edge", "layout.rotate",
    "drape.anchor", "drape.method", "drape.objective", "refine.vary",
)} | {"rod.section": "--rod", "pop_up.ends": "--ends"}  # fmt: skip


def _parameter(path: str) -> str:
    """A key's name as a Python identifier."""
    return path.replace(".", "__")


class CaseOption(click.Option):
    """The option of one key of the case file; its value is read by the case."""

    def __init__(self, key: CaseKey) -> None:
        self.key = key
        names = [f"--{key.path}", *filter(None, [ALIASES.get(key.path)]), _parameter(key.path)]
        text = key.help + (f" ({', '.join(key.kinds)})" if key.kinds and key.any_value else "")
        values = ("VALUE",) if key.any_value else ()
        super().__init__(names, metavar="|".join(map(str, (*values, *key.choices))), help=text)


class CaseCommand(click.Command):
    """A command with options for keys, shown table by table."""

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """As click does, but no option takes the next option as its value."""
        options = {name: option for option in self.params if isinstance(option, click.Option) for name in option.opts}
        for name, value in pairwise(args):
            if name in options and not options[name].is_flag and value in options:
                raise click.UsageError(f"{name} needs a value, but {value} follows", ctx)
        given = tuple(args)  # which click consumes
        try:
            return super().parse_args(ctx, args)
        except click.NoSuchOption as error:
            known = [name for name, option in options.items() if _exists(option, given)]
            near = get_close_matches(error.option_name.lstrip("-"), [name.lstrip("-") for name in known], n=1)
            proposed = [name for name in known if name.lstrip("-") in near]
            raise click.NoSuchOption(error.option_name, possibilities=proposed, ctx=ctx) from None

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections = dict[str, list[tuple[str, str]]]()
        for option in self.get_params(ctx):
            if isinstance(option, click.Option) and (record := option.get_help_record(ctx)):
                table = f"[{option.key.path.partition('.')[0]}]" if isinstance(option, CaseOption) else "Output"
                sections.setdefault(table, []).append(record)
        for title, records in sections.items():
            with formatter.section(title):
                formatter.write_dl(records, col_max=40)


def _exists(option: click.Option, arguments: tuple[str, ...]) -> bool:
    """Whether the case that a command line names has the key of an option, so that it may be proposed."""
    if not isinstance(option, CaseOption) or not option.key.kinds:
        return True
    known = _keys_with(arguments)
    return known is None or option.key.path in known


@cache
def _keys_with(arguments: tuple[str, ...]) -> Mapping[str, CaseKey] | None:
    """The keys that the case has which a command line names; None where there is none."""
    given = dict(pairwise(arguments))
    overrides = {f"{table}.kind": kind for table in BY_KIND if (kind := given.get(f"--{table}.kind"))}
    try:
        return keys_of_kinds(written(load_case(arguments[0], overrides)))
    except InputError:
        return None


def case_options(*tables: str) -> list[click.Parameter]:
    """An option for each key, or for each inside some tables such as "rod"."""
    return [CaseOption(key) for key in case_keys().values() if not tables or key.path.split(".")[0] in tables]


def overrides_of(values: Mapping[str, str | None]) -> dict[str, object]:
    """What was given to such options, by dotted key."""
    return {path: value for path in case_keys() if (value := values.get(_parameter(path))) is not None}


@dataclass(frozen=True)
class RunOptions:
    """Options of the commands that run a job, of their output.

    Args:
        only: kinds of files in addition to the archive; None: the usual ones, and those that the case asks for.
        limit: longest time for all but the files [s].
    """

    out: str | None
    only: str | None
    limit: float | None
    force: bool
    as_json: bool
    quiet: bool
    verbose: bool


_REPLACE = "Also replace files that rodshell did not write, or that were changed since."
FORCE = click.option("--force", is_flag=True, help=_REPLACE)
ADDRESS = click.option(
    "--address",
    metavar="ADDRESS",
    help="Compute on a dask cluster: tcp://HOST:PORT or tls://HOST:PORT of its scheduler, or its scheduler file. What "
    "answers there can run any program here.",
)
UNITS = 'Values may have a unit: "200 mm", "45 deg", "25 GPa". A plain number is in SI units.'
QUIET = click.option("--quiet", "-q", is_flag=True, help="Print errors only.")
_ONLY = "Kinds of files in addition to the archive, such as dxf,csv; see rodshell export --help."
_ALL = "Write drawings, PDF, models and pictures too, as rodshell export DIR does later."
_LIMIT = 'Time limit, such as "60 s": what was found by then is written, and kinds of files that are not are named.'


def output_options(out: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """The options of `RunOptions`, with the help of --out; a command gets them as `output`.

    It raises an InputError where the time limit is not a time, or not a positive one.
    """

    def decorate(command: Callable[..., Any]) -> Callable[..., Any]:
        def with_output(*, out, only, time_limit, force, as_json, quiet, verbose, **values):  # type: ignore[no-untyped-def]
            output = RunOptions(out, only, seconds_of(time_limit), force, as_json, quiet, verbose)
            return command(output=output, **values)

        found: Callable[..., Any] = wraps(command)(with_output)
        options = (
            click.option("--out", "-o", metavar="DIR", help=out),
            click.option("--only", metavar="KINDS", help=_ONLY),
            click.option("--all", "only", flag_value="all", help=_ALL),
            click.option("--time-limit", metavar="TIME", help=_LIMIT),
            FORCE,
            click.option("--json", "as_json", is_flag=True, help="Print the results as JSON, for programs."),
            QUIET,
            click.option("--verbose", "-v", is_flag=True, help="Print all that was found, not the six lines alone."),
        )
        for option in reversed(options):
            found = option(found)
        return found

    return decorate


_SNOW = 'Snow on the plan, such as "0.5 kN/m2": with 1.35 times the own weight and 1.5 times the snow.'
_WIND = "Velocity pressure of the wind, from four sides: with the own weight and 1.5 times the wind."
LOADS = (
    click.option("--snow", metavar="LOAD", help=_SNOW),
    click.option("--wind", metavar="LOAD", help=_WIND),
    click.option("--own", "own_weight", is_flag=True, help="1.35 times the own weight; --snow and --wind have it too."),
)
"""Options of the usual loads, which stand in place of a case's own."""


def usual_loads_options(command: Callable[..., Any]) -> Callable[..., Any]:
    """Give a command the options of `LOADS`, as `snow`, `wind` and `own_weight`."""
    for option in reversed(LOADS):
        command = option(command)
    return command


def under_usual_loads(
    name: str, overrides: Mapping[str, object], snow: str | None, wind: str | None, own_weight: bool
) -> Case:
    """A case with the usual loads of these options in place of its own; with its own where none is given.

    Raises:
        InputError: a file of loads is given too.
    """
    if snow is None and wind is None and not own_weight:
        return load_case(name, overrides)
    if "loads" in overrides:
        raise InputError("--loads FILE has loads of its own: leave it out, or --snow, --wind and --own")
    return load_case(name, {**overrides, **usual_loads(snow, wind)})


def seconds_of(given: str | None) -> float | None:
    """What --time-limit gives [s]; InputError unless it is a positive time."""
    return None if given is None else float(value_of(Duration, "--time-limit", given))
