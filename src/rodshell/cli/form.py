"""`rodshell form`: the main job. Its options are the keys of the case file."""

from dataclasses import replace
from typing import Any

import click

from rodshell.case import BUILT_IN, Case
from rodshell.case.stage_tables import DesignTable
from rodshell.cli.options import (
    UNITS,
    CaseCommand,
    RunOptions,
    case_options,
    output_options,
    overrides_of,
    under_usual_loads,
    usual_loads_options,
)
from rodshell.cli.reporting import run_and_deliver


@click.command(cls=CaseCommand, params=case_options(), epilog=UNITS)
@click.argument("name", metavar="NAME|CASE.toml|SURFACE")
@usual_loads_options
@output_options("Folder for the results; default out/NAME.")
def command(name: str, output: RunOptions, **values: Any) -> int:
    """Find the flat grid that pops up into a target: drape, trim, map back, pop up, compare.

    NAME is a built-in case: {names}. CASE.toml is a case file. SURFACE is a mesh (OBJ, STL, PLY, OFF,
    glTF), a surface from Rhino (3dm) or from STEP, or heights (CSV, PNG). Each key of a case file is also an option.

    With --snow, --wind or --own the sizes of the rods, the bracing and the spacing, as far as they are not given, are
    chosen so that the shell carries these loads, or what limits the shell is said.
    """
    return run_and_deliver(asked(name, **values), name, output)


def asked(name: str, *, snow: str | None, wind: str | None, own_weight: bool, **values: Any) -> Case:
    """The case that a command line gives."""
    overrides = overrides_of(values)
    case = under_usual_loads(name, overrides, snow, wind, own_weight)
    if (snow or wind or own_weight) and "design.open" not in overrides:
        given = {"bracing"} if "bracing.kind" in overrides else set[str]()
        case = replace(case, design=DesignTable(open=tuple(part for part in case.left_open if part not in given)))
    return case


assert command.help is not None
command.help = command.help.format(names=", ".join(BUILT_IN))
