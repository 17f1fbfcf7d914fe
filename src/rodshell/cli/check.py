"""`rodshell check`: a case, or an earlier result, under loads."""

from dataclasses import replace
from pathlib import Path

import click

from rodshell.cli.options import CaseCommand, RunOptions, output_options, under_usual_loads, usual_loads_options
from rodshell.cli.reporting import run_and_deliver
from rodshell.errors import InputError
from rodshell.units import shown


@click.command(cls=CaseCommand)
@click.argument("source", metavar="DIR|CASE")
@click.option("--loads", metavar="FILE", help="File with [[loads]] and [[combinations]], in place of the case's own.")
@usual_loads_options
@output_options("Folder for the results; default DIR, or out/CASE.")
def command(
    source: str, loads: str | None, output: RunOptions, snow: str | None, wind: str | None, own_weight: bool
) -> int:
    """Check a shell under loads: deflections, reactions, stability and utilisation under each combination.

    DIR is an earlier result, whose case is run again. CASE is a case file or the name of a built-in case. The loads are
    those of the case, or those of --snow, --wind and --own, or of FILE, which has tables [[loads]], [[combinations]],
    [bracing], [locked_joints], [stability] and [strength].
    """
    path = Path(source)
    if path.is_dir() and not (path / "case.toml").is_file():
        raise InputError(
            f"{source} has no case.toml that could be run again: give a result of rodshell form, or a case"
        )
    given: dict[str, object] = {} if loads is None else {"loads": loads}
    case = under_usual_loads(str(path / "case.toml") if path.is_dir() else source, given, snow, wind, own_weight)
    if case.of_table:
        raise InputError(f"{shown(source)} comes from a table of rods: without a target no areas for loads are known")
    if case.built_loads() is None:
        raise InputError(
            f'{shown(source)} has no loads: give --snow "0.5 kN/m2", --wind "0.5 kN/m2" or --own, --loads FILE, or '
            "[[loads]] and [[combinations]] in the case"
        )
    if path.is_dir() and output.out is None:
        output = replace(output, out=source)
    return run_and_deliver(case, source, output, formed_before=path.is_dir())
