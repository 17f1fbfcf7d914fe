"""`rodshell form`: the main job. Its options are the keys of the case file."""

from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rodshell.case import BUILT_IN, load_case
from rodshell.cli.options import (
    CaseCommand,
    RunOptions,
    case_options,
    output_options,
    overrides_of,
    read_output_options,
)
from rodshell.cli.reporting import run_and_deliver

if TYPE_CHECKING:
    from rodshell.case import Case
    from rodshell.form import Form

SEARCH = "search.svg"


@click.command(
    cls=CaseCommand,
    params=case_options(),
    epilog='Values may have a unit: "200 mm", "45 deg", "25 GPa". A plain number is in SI units.',
)
@click.argument("name", metavar="NAME|CASE.toml|SURFACE")
@output_options("Folder for the results; default out/NAME.")
def command(name: str, **values: Any) -> int:
    """Find the flat grid that pops up into a target: drape, trim, map back, pop up, compare.

    NAME is a built-in case: {names}. CASE.toml is a case file. SURFACE is a mesh (OBJ, STL, PLY, OFF,
    glTF), a surface from Rhino (3dm) or from STEP, or heights (CSV, PNG). Each key of a case file is also an option.
    """
    output = read_output_options(values)
    return run_case(load_case(name, overrides_of(values)), name, output)


def run_case(case: "Case", name: str, output: RunOptions) -> int:
    """Run the job of a case and write its form; the exit code.

    Args:
        output: where and what to write.
    """
    from rodshell.results.archive import kept_case, read_inputs

    copies = kept_case(case.to_toml(), read_inputs(case.to_toml()), Path())[1]
    names = [*copies, *([SEARCH] if case.undecided else []), *_frames(case)]
    return run_and_deliver(case, name, output, ["case.toml", *names], pictures=_pictures)


assert command.help is not None
command.help = command.help.format(names=", ".join(BUILT_IN))


def _frames(case: "Case") -> list[str]:
    """Patterns of the files that a fall streams."""
    if not case.drape.frames:
        return []
    from rodshell.solve.simulate import NAMES

    return [f"{escape(case.drape.frames)}/{name}.npy" for name in NAMES]


def _pictures(form: "Form") -> dict[str, str]:
    """The picture of the search, if there was one."""
    if form.search is None:
        return {}
    from rodshell.output.colour_scale import search_svg

    title = f"{form.search.title} by anchor and heading"
    return {SEARCH: search_svg(title, form.search.trials, form.search.best)}
