"""`rodshell form`: the main job. Its options are the keys of the case file."""

from typing import Any

import click

from rodshell.case import BUILT_IN, load_case
from rodshell.cli.options import UNITS, CaseCommand, RunOptions, case_options, output_options, overrides_of
from rodshell.cli.reporting import run_and_deliver


@click.command(cls=CaseCommand, params=case_options(), epilog=UNITS)
@click.argument("name", metavar="NAME|CASE.toml|SURFACE")
@output_options("Folder for the results; default out/NAME.")
def command(name: str, output: RunOptions, **values: Any) -> int:
    """Find the flat grid that pops up into a target: drape, trim, map back, pop up, compare.

    NAME is a built-in case: {names}. CASE.toml is a case file. SURFACE is a mesh (OBJ, STL, PLY, OFF,
    glTF), a surface from Rhino (3dm) or from STEP, or heights (CSV, PNG). Each key of a case file is also an option.
    """
    return run_and_deliver(load_case(name, overrides_of(values)), name, output)


assert command.help is not None
command.help = command.help.format(names=", ".join(BUILT_IN))
