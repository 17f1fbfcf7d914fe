"""`rodshell popup`: rods from a table or an earlier result, popped up from flat with pinned ends."""

from pathlib import Path
from typing import Any

import click

from rodshell.case.load import TABLES_OF_RODS
from rodshell.cli.options import CaseCommand, RunOptions, case_options, output_options, overrides_of
from rodshell.cli.reporting import run_and_deliver
from rodshell.errors import InputError


@click.command(cls=CaseCommand, params=case_options(*TABLES_OF_RODS))
@click.argument("source", metavar="RODS.csv|DIR")
@click.option(
    "--unit", metavar="UNIT", help="Unit of the table's coordinates: m, mm, in, ...; columns that end in _mm need none."
)
@output_options("Folder for the results; default out/NAME-popup.")
def command(source: str, unit: str | None, output: RunOptions, **values: Any) -> int:
    """Find the shape of given rods, popped up from flat with pinned ends.

    RODS.csv has a row for each rod, with the columns flat_x0, flat_y0, flat_x1, flat_y1, final_x0, final_y0,
    final_z0, final_x1, final_y1, final_z1 and, optionally, id; or with all coordinates in mm and _mm after each name,
    as in schedule/rods.csv. A table has ball joints and a rod that is chosen to fit; DIR, an earlier result, keeps its
    own. Each key of [rod], [joint], [checks], [fabrication] and [drawings] is an option that replaces what is kept.
    """
    from rodshell.job import Job

    job = Job.of_table(source, overrides_of(values), unit=unit)
    path = Path(source)
    name = f"{path.resolve().stem}-popup"
    if Path(output.out or Path("out") / name).resolve() == path.resolve():
        raise InputError(f"--out {path.resolve()} is the result that is read: give another folder")
    return run_and_deliver(job.case, name, output)
