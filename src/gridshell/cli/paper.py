"""`gridshell paper`: the paper's figures, made again with their errors."""

from importlib import import_module

import click

from gridshell.cli.outcome import deliver, output_folder
from gridshell.cli.progress import Progress, announce_compilation
from gridshell.errors import InputError
from gridshell.paper import FIGURES


@click.command(epilog="Figures: " + "; ".join(f"{name}: {what}" for name, what in FIGURES.items()))
@click.argument("figure", metavar="FIGURE")
@click.option("--out", "-o", metavar="DIR", help="Folder for the figure; default out/FIGURE.")
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON, for programs.")
@click.option("--quiet", "-q", is_flag=True, help="Print errors only.")
def command(figure: str, out: str | None, as_json: bool, quiet: bool) -> int:
    """Make a figure of the paper again: pictures, tables, errors."""
    if figure not in FIGURES:
        raise InputError(f"there is no figure {figure} here: the figures are {', '.join(FIGURES)}")
    folder = output_folder(out, figure)
    announce_compilation(quiet=quiet)
    with Progress(quiet=quiet) as progress:
        made = import_module(f"gridshell.paper.{figure}").make(progress)
    return deliver(made, made.save, folder, as_json=as_json, quiet=quiet)
