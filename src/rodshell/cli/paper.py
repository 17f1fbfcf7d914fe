"""`rodshell paper`: the paper's figures, made again with their errors."""

from contextlib import ExitStack
from pathlib import Path

import click

from rodshell.cli.options import FORCE, QUIET
from rodshell.cli.reporting import Outcome, Progress, compile_before_first, default_folder, deliver
from rodshell.errors import InputError
from rodshell.paper import FIGURES, figure_maker, reserved
from rodshell.results.folder import open_folder


@click.command(epilog="Figures: " + "; ".join(f"{name}: {what}" for name, what in FIGURES.items()))
@click.argument("figure", metavar="FIGURE|all")
@click.option(
    "--out", "-o", metavar="DIR", help="Folder for the figure; default: out/FIGURE; for all: DIR/FIGURE for each."
)
@FORCE
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON, one line for each figure.")
@QUIET
@click.option("--seed", type=click.IntRange(min=0), help="genetic: start from this seed, or continue its search.")
@click.option("--target", metavar="NAME", help="genetic: only this target.")
@click.option("--jobs", type=click.IntRange(min=1), help="genetic: number of processes of a search; default 1.")
@click.option(
    "--generations", type=click.IntRange(min=1), help="genetic: largest number of generations of a search; default 300."
)
def command(figure: str, out: str | None, force: bool, as_json: bool, quiet: bool, **options: int | str | None) -> int:
    """Compute a figure of the paper again, or all of them: pictures, tables, errors."""
    if figure not in (*FIGURES, "all"):
        raise InputError(f"there is no figure {figure} here: the figures are {', '.join(FIGURES)}; or all")
    given = {name: value for name, value in options.items() if value is not None}
    if given and figure != "genetic":
        raise InputError(f"--{next(iter(given))} is for the figure genetic, not for {figure}: leave it out")
    names = list(FIGURES) if figure == "all" else [figure]
    folders = [Path(out or "out") / name if figure == "all" else out or default_folder(name) for name in names]
    with ExitStack() as stack:
        result_folders = [
            stack.enter_context(open_folder(folder, reserved=reserved(name), force=force))
            for name, folder in zip(names, folders, strict=True)
        ]
        compile_before_first(quiet=quiet)
        codes = []
        for name, place in zip(names, result_folders, strict=True):  # each is written as soon as it is made
            with Progress(quiet=quiet) as progress:
                made = figure_maker(name)(progress, **given)
            outcome = Outcome(made.status, made.summary(), made.result(), made.save)
            codes.append(deliver(outcome, place, progress=progress, as_json=as_json, quiet=quiet))
    return max(codes)
