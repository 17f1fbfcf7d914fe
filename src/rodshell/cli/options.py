"""Keys of the case file as options of a command."""

from collections.abc import Mapping
from itertools import pairwise

import click

from rodshell.case import CaseKey, case_keys

ALIASES = {
    "target.radius": "--radius",
    "target.formula": "--formula",
    "target.unit": "--unit",
    "target.base": "--base",
    "target.boundary": "--boundary",
    "layout.rods": "--rods",
    "layout.spacing": "--spacing",
    "layout.length": "--length",
    "layout.edge": "--edge",
    "layout.rotate": "--rotate",
    "drape.anchor": "--anchor",
    "drape.method": "--method",
    "drape.objective": "--objective",
}


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
        return super().parse_args(ctx, args)

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections = dict[str, list[tuple[str, str]]]()
        for option in self.get_params(ctx):
            if isinstance(option, click.Option) and (record := option.get_help_record(ctx)):
                table = f"[{option.key.path.partition('.')[0]}]" if isinstance(option, CaseOption) else "Output"
                sections.setdefault(table, []).append(record)
        for title, records in sections.items():
            with formatter.section(title):
                formatter.write_dl(records, col_max=40)


def case_options(*tables: str) -> list[click.Parameter]:
    """An option for each key, or for each inside some tables such as "rod"."""
    return [CaseOption(key) for key in case_keys().values() if not tables or key.path.split(".")[0] in tables]


def overrides_of(values: Mapping[str, str | None]) -> dict[str, object]:
    """What was given to such options, by dotted key."""
    return {path: value for path in case_keys() if (value := values.get(_parameter(path))) is not None}
