"""`rodshell export`: files of an earlier result, made again from its archive; and the JSON Schema of result.json."""

import json

import click

from rodshell.cli.options import FORCE, QUIET
from rodshell.cli.reporting import Progress
from rodshell.printed import say
from rodshell.validation import file_path


def _print_schema(context: click.Context, parameter: click.Parameter, wanted: bool) -> None:
    """--schema: print the JSON Schema and exit, as --help does."""
    if wanted:
        from rodshell.results.results import json_schema

        click.echo(json.dumps(json_schema(), indent=1))
        context.exit()


SCHEMA = "Print the JSON Schema of result.json and exit."


@click.command()
@click.argument("folder", metavar="DIR")
@click.option("--only", metavar="KINDS", help="Kinds of files, such as dxf,csv; default: what is not there yet.")
@click.option("--out", "-o", metavar="DIR", help="Folder to write to; default: the result itself.")
@click.option("--schema", is_flag=True, is_eager=True, expose_value=False, callback=_print_schema, help=SCHEMA)
@FORCE
@QUIET
def command(folder: str, only: str | None, out: str | None, force: bool, quiet: bool) -> int:
    """Write drawings, schedules, models, pictures or the report of the result in DIR.

    KINDS are dxf, svg, pdf, csv, obj, gltf, vtp, compas, png, report, strips, which dxf contains, and 3dm, which needs
    the package rhino3dm, and opensees, a model for finite-element programs with a script that replays it from flat.
    By default all but 3dm and opensees are written: into DIR those files that are not there, or all with --force.
    """
    from rodshell.output.files import export
    from rodshell.results import read

    where = file_path("--out", out or folder)
    with Progress(quiet=quiet) as progress:
        keep = only is None and out is None and not force
        kinds = "all" if only is None else only
        names = export(read(folder), where, kinds, keep=keep, force=force, progress=progress)
    if not quiet:
        if not names:
            say(f"all files are in {where} already: --only KINDS writes some again")
        for name in names:
            click.echo(where / name)
    return 0
