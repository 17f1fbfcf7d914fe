"""`rodshell popup`: rods from a table or an earlier result, popped up from flat with pinned ends."""

from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rodshell.cli.options import CaseCommand, case_options, overrides_of
from rodshell.cli.outcome import (
    Kept,
    announce_rod,
    deliver,
    force_option,
    output_folder,
    seconds_of,
    time_limit_option,
    wanted_kinds,
)
from rodshell.cli.progress import Progress, announce_compilation
from rodshell.errors import InputError
from rodshell.units import shown

if TYPE_CHECKING:
    from rodshell.case import Case
    from rodshell.cli.rodends import RodEnds

ASIDE = ("checks", "fabrication", "drawings")  # tables of what does not decide the shape


@click.command(cls=CaseCommand, params=case_options("rod", *ASIDE))
@click.argument("source", metavar="RODS.csv|DIR")
@click.option(
    "--unit", metavar="UNIT", help="Of the table's coordinates: m, mm, in, ...; columns that end in _mm need none."
)
@click.option("--out", "-o", metavar="DIR", help="Folder for the results; default out/NAME-popup.")
@click.option("--only", metavar="KINDS", help="Files beside the archive, such as dxf,csv; see rodshell export --help.")
@time_limit_option
@force_option
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON, for programs.")
@click.option("--quiet", "-q", is_flag=True, help="Print errors only.")
def command(
    source: str,
    unit: str | None,
    out: str | None,
    only: str | None,
    time_limit: str | None,
    force: bool,
    as_json: bool,
    quiet: bool,
    **values: str | None,
) -> int:
    """Pop up rods from flat, their ends pinned: where does the shell go?

    RODS.csv has a row for each rod, with the columns flat_x0, flat_y0, flat_x1, flat_y1, final_x0, final_y0,
    final_z0, final_x1, final_y1, final_z1 and, if you like, id; or with all coordinates in mm and _mm after each name,
    as schedule/rods.csv has them. DIR is an earlier result, whose joints are kept; those of a table are balls. The rod
    is the result's, or for a table one that is chosen to fit; each key of [rod] sets it anew. So do those of [checks],
    [fabrication] and [drawings] what is checked, made and drawn.
    """
    path, kinds, seconds = Path(source), wanted_kinds(only), seconds_of(time_limit)
    ends, case = _ends_and_case(path, unit, overrides_of(values))
    name = f"{path.resolve().stem}-popup"
    if Path(out or Path("out") / name).resolve() == path.resolve():
        raise InputError(f"--out {path.resolve()} is the result that is read: give another folder")
    from rodshell.output.files import reserved

    with output_folder(out, name, ["result.json", "states.npz", *reserved(kinds)], force=force) as place:
        announce_compilation(quiet=quiet)
        from rodshell.checks.sizing import Fit
        from rodshell.form import pop_up_table
        from rodshell.formfinding.progress import limited
        from rodshell.layout import straight_rods

        grid = straight_rods(ends.flat, names=ends.names)
        fit = partial(Fit.between, ends.lengths, ends.final, grid.joint_counts())
        rod = case.rod.build(fit, strength=case.checks.strength)
        announce_rod(case, rod, fit, quiet=quiet)
        output = case.output_options()
        with Progress(quiet=quiet) as shown:
            progress = limited(shown, seconds)
            popped = pop_up_table(grid, ends.final, rod, joint=case.joint.build(), edge=ends.edge, progress=progress)
            kept = Kept(popped.archive(options=output, progress=progress), kinds)
        return deliver(kept, kept.save, place, progress=shown, as_json=as_json, quiet=quiet)


def _ends_and_case(path: Path, unit: str | None, given: dict[str, object]) -> "tuple[RodEnds, Case]":
    """The rods of a table or a result; and the result's case, or an empty one, with what is `given`."""
    from rodshell.case import load_case
    from rodshell.cli.rodends import read_result, read_table
    from rodshell.results.folder import reading

    if path.is_dir():
        if unit is not None:
            raise InputError(f'--unit = "{unit}": {path} is a result, which is in SI; leave --unit out')
        ends = read_result(path)
        with reading(path) as file:
            case = file("case.toml") if file("case.toml").is_file() else None
            joint = {f"joint.{key}": value for key, value in ends.joint.items()}
            return ends, load_case(case, joint | given, otherwise={"rod": ends.rod})
    if not path.exists():
        raise InputError(f"there is no file named {shown(str(path))}: give a table of rods, or the folder of a result")
    return read_table(path, unit), load_case(None, given)
