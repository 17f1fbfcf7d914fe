"""`gridshell form`: the main job. Its options are the keys of the case file."""

import click

from gridshell.case import BUILT_IN, Case, CaseKey, case_keys, load_case
from gridshell.cli.outcome import deliver, output_folder
from gridshell.cli.progress import Progress, announce_compilation

ALIASES = {
    "target.radius": "--radius",
    "target.formula": "--formula",
    "layout.rods": "--rods",
    "layout.spacing": "--spacing",
    "layout.length": "--length",
    "layout.edge": "--edge",
    "layout.rotate": "--rotate",
    "drape.anchor": "--anchor",
    "drape.method": "--method",
}


def _parameter(path: str) -> str:
    """A key's name as a Python identifier."""
    return path.replace(".", "__")


class CaseOption(click.Option):
    """The option of one key of the case file; its value is read by the case."""

    def __init__(self, key: CaseKey) -> None:
        self.key = key
        names = [f"--{key.path}", *filter(None, [ALIASES.get(key.path)]), _parameter(key.path)]
        text = key.help + (f" ({', '.join(key.kinds)})" if key.kinds and not key.choices else "")
        super().__init__(names, metavar="|".join(key.choices) or "VALUE", help=text)


class CaseCommand(click.Command):
    """A command with an option for every key, shown table by table."""

    def format_options(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        sections = dict[str, list[tuple[str, str]]]()
        for option in self.get_params(ctx):
            if isinstance(option, click.Option) and (record := option.get_help_record(ctx)):
                table = f"[{option.key.path.partition('.')[0]}]" if isinstance(option, CaseOption) else "Output"
                sections.setdefault(table, []).append(record)
        for title, records in sections.items():
            with formatter.section(title):
                formatter.write_dl(records, col_max=40)


@click.command(
    cls=CaseCommand,
    params=[CaseOption(key) for key in case_keys().values()],
    epilog='Lengths and so on take a unit, "200 mm", "45 deg", "25 GPa"; a plain number is in SI.',
)
@click.argument("name", metavar="NAME|CASE.toml")
@click.option("--out", "-o", metavar="DIR", help="Folder for the results; default out/NAME.")
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON, for programs.")
@click.option("--quiet", "-q", is_flag=True, help="Print errors only.")
def command(name: str, out: str | None, as_json: bool, quiet: bool, **values: str | None) -> int:
    """From a target to the flat grid that pops up into it: drape, trim, map back, pop up, compare.

    NAME is a built-in case, {names}; CASE.toml a case file. Each of its keys is an option too.
    """
    overrides = {path: value for path in case_keys() if (value := values[_parameter(path)]) is not None}
    case = load_case(name, overrides)
    return run(case, name, out=out, as_json=as_json, quiet=quiet)


assert command.help is not None
command.help = command.help.format(names=", ".join(BUILT_IN))


def run(case: Case, name: str, *, out: str | None, as_json: bool, quiet: bool) -> int:
    """Find the form of a case and write it; the exit code."""
    folder = output_folder(out, name)
    target, layout, rod, options = case.build()
    announce_compilation(quiet=quiet)
    from gridshell.form import find_form

    with Progress(quiet=quiet) as progress:
        form = find_form(target, layout, rod, progress=progress, **options)
    return deliver(form, lambda where: form.save(where, case_toml=case.to_toml()), folder, as_json=as_json, quiet=quiet)
