"""`rodshell optimise`: the values of some keys for which objectives are smallest."""

from pathlib import Path
from typing import Any

import click

from rodshell.cli.options import ADDRESS, QUIET
from rodshell.cli.reporting import FOUND, NOT_CONVERGED, Progress, compile_before_first


@click.command(epilog="A search file is described in docs/sweeps.md; examples/optimise.toml is one.")
@click.argument("file", metavar="SEARCH.toml")
@click.option("--out", "-o", metavar="DIR", help="Folder of the search; default out/NAME. A search continues there.")
@click.option("--report", is_flag=True, help="Also write report.html: charts of all designs, shapes of the front.")
@click.option("--retry", is_flag=True, help="Run jobs again that a limit stopped, or whose process died.")
@ADDRESS
@QUIET
def command(file: str, out: str | None, quiet: bool, **how: Any) -> int:
    """Search for the values of some keys for which objectives are smallest and constraints hold.

    All designs are in DIR/table.csv, the best ones in DIR/front.csv. What is finished stays, whatever is interrupted:
    the same command continues.
    """
    from rodshell.sweeps.search import optimise
    from rodshell.sweeps.search_plan import read_search

    plan = read_search(file)
    folder = Path(out) if out else Path("out") / plan.origin.name
    compile_before_first(quiet=quiet)
    with Progress(quiet=quiet) as progress:
        found = optimise(plan, folder, progress=progress, **how)
    if not quiet:
        click.echo(found.summary())
        if found.front:
            click.echo(found.front_text())
        click.echo(f"written to {folder.absolute()}")
    return FOUND if found.front else NOT_CONVERGED
