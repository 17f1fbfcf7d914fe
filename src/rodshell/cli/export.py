"""`rodshell export`: files of an earlier result, made again from its archive."""

from pathlib import Path

import click

from rodshell.cli.options import FORCE, QUIET, wanted_kinds
from rodshell.cli.reporting import Progress


@click.command()
@click.argument("folder", metavar="DIR")
@click.option("--only", metavar="KINDS", help="Such as dxf,csv; default: all but 3dm.")
@click.option("--out", "-o", metavar="DIR", help="Where to write; default: into the result itself.")
@FORCE
@QUIET
def command(folder: str, only: str | None, out: str | None, force: bool, quiet: bool) -> int:
    """Write drawings, schedules, models or the report of the result in DIR again.

    KINDS are dxf, svg, pdf, csv, obj, gltf, vtp, compas, png, report, and 3dm, which needs the package rhino3dm.
    """
    from rodshell.output import export
    from rodshell.results import read

    where = Path(out or folder).expanduser()
    with Progress(quiet=quiet) as progress:
        names = export(read(folder), where, wanted_kinds(only), force=force, progress=progress)
    if not quiet:
        for name in names:
            click.echo(where / name)
    return 0
