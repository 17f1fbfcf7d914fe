"""`rodshell popup`: rods from a table or an earlier result, popped up from flat with pinned ends."""

from math import pi
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rodshell.cli.options import CaseCommand, case_options, overrides_of
from rodshell.cli.outcome import Kept, deliver, force_option, output_folder, wanted_kinds
from rodshell.cli.progress import Progress, announce_compilation
from rodshell.errors import InputError
from rodshell.units import shown

if TYPE_CHECKING:
    from rodshell.cli.rodends import RodEnds
    from rodshell.output.takeaway import Takeaway
    from rodshell.rods.section import Rod

ASIDE = ("checks", "fabrication", "drawings")  # tables of what does not decide the shape
PAPER_ROD_LENGTH = pi * 0.2  # of the hemisphere's middle rod [HQK section 3.1], which the default rod belongs to


@click.command(cls=CaseCommand, params=case_options("rod", *ASIDE))
@click.argument("source", metavar="RODS.csv|DIR")
@click.option("--unit", metavar="UNIT", help="Of the table's coordinates: m, mm, in, ...; a table needs it.")
@click.option("--out", "-o", metavar="DIR", help="Folder for the results; default out/NAME-popup.")
@click.option("--only", metavar="KINDS", help="Files beside the archive, such as dxf,csv; see rodshell export --help.")
@force_option
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON, for programs.")
@click.option("--quiet", "-q", is_flag=True, help="Print errors only.")
def command(
    source: str,
    unit: str | None,
    out: str | None,
    only: str | None,
    force: bool,
    as_json: bool,
    quiet: bool,
    **values: str | None,
) -> int:
    """Pop up rods from flat, their ends pinned: where does the shell go?

    RODS.csv has a row for each rod, with the columns flat_x0, flat_y0, flat_x1, flat_y1, final_x0, final_y0,
    final_z0, final_x1, final_y1, final_z1 and, if you like, id. DIR is an earlier result. The rod is the result's, or
    for a table the paper's, scaled to it; each key of [rod] sets it anew. So do those of [checks], [fabrication] and
    [drawings] what is checked, made and drawn.
    """
    path, kinds = Path(source), wanted_kinds(only)
    ends, rod, takeaway = _rods_and_the_rest(path, unit, overrides_of(values))
    name = f"{path.resolve().stem}-popup"
    if Path(out or Path("out") / name).resolve() == path.resolve():
        raise InputError(f"--out {path.resolve()} is the result that is read: give another folder")
    from rodshell.output.files import reserved

    with output_folder(out, name, ["result.json", "states.npz", *reserved(kinds)], force=force) as place:
        announce_compilation(quiet=quiet)
        from rodshell.form import pop_up_table
        from rodshell.layout import straight_rods

        grid = straight_rods(ends.flat, names=ends.names)
        with Progress(quiet=quiet) as progress:
            popped = pop_up_table(grid, ends.final, rod, progress=progress)
            kept = Kept(popped.archive(takeaway=takeaway, progress=progress), kinds)
        return deliver(kept, kept.save, place, as_json=as_json, quiet=quiet)


def _rods_and_the_rest(path: Path, unit: str | None, given: dict[str, object]) -> "tuple[RodEnds, Rod, Takeaway]":
    """A table takes the default rod at the table's scale; a result keeps its rod, checks, fabrication and drawings.

    given : keys that the user set.
    """
    from rodshell.case import case_keys, load_case
    from rodshell.cli.rodends import read_result, read_table
    from rodshell.output.folder import reading

    if path.is_dir():
        if unit is not None:
            raise InputError(f'--unit = "{unit}": {path} is a result, which is in SI; leave --unit out')
        ends = read_result(path)
        with reading(path) as file:
            if file("case.toml").is_file():
                case = load_case(file("case.toml"), given)
                return ends, case.rod.build(), case.takeaway()
    elif not path.exists():
        raise InputError(f"there is no file named {shown(str(path))}: give a table of rods, or the folder of a result")
    elif unit is None:
        raise InputError("--unit is missing: give the unit of the table's coordinates, such as --unit m")
    else:
        ends = read_table(path, unit)
    radius = 0.001 * ends.longest / PAPER_ROD_LENGTH
    if given.get("rod.section.kind", "circle") in case_keys()["rod.section.radius"].kinds:
        given = {"rod.section.radius": radius, **given}
    case = load_case("hemisphere", given)
    return ends, case.rod.build(), case.takeaway()
