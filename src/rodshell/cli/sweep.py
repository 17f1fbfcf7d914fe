"""`rodshell sweep`: many designs of one job."""

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from rodshell.cli.options import ADDRESS, QUIET
from rodshell.cli.reporting import FOUND, NOT_CONVERGED, Progress, compile_before_first

if TYPE_CHECKING:
    from rodshell.sweeps.plan import SweepPlan


@click.command(epilog="A sweep file is described in docs/sweeps.md; examples/sweep.toml is one.")
@click.argument("file", metavar="SWEEP.toml")
@click.option("--out", "-o", metavar="DIR", help="Folder of the sweep; default out/NAME. A sweep continues there.")
@click.option("--dry-run", is_flag=True, help="Check all designs and print how many there are; compute nothing.")
@click.option("--report", is_flag=True, help="Also write report.html: charts of all designs, shapes of the best.")
@click.option("--retry", is_flag=True, help="Run jobs again that a limit stopped, or whose process died.")
@ADDRESS
@QUIET
def command(file: str, out: str | None, dry_run: bool, quiet: bool, **how: Any) -> int:
    """Compute many designs: all combinations of the values of some keys, or samples of them.

    What is finished stays, whatever is interrupted: the same command continues, and a changed sweep computes only what
    is new. The table is DIR/table.csv.
    """
    from rodshell.sweeps.plan import read_plan
    from rodshell.sweeps.run import sweep

    plan = read_plan(file)
    folder = Path(out) if out else Path("out") / plan.origin.name
    if dry_run:
        return _dry_run(plan, folder)
    compile_before_first(quiet=quiet)
    with Progress(quiet=quiet) as progress:
        found = sweep(plan, folder, progress=progress, **how)
    if not quiet:
        click.echo(found.summary())
        click.echo(f"written to {folder.absolute()}")
    return FOUND if len(found.failures) == 0 or found.finished > sum(n for _, n in found.failures) else NOT_CONVERGED


def _dry_run(plan: "SweepPlan", folder: Path) -> int:
    from rodshell.sweeps.run import planned

    jobs, finished = planned(plan, folder)
    for axis in plan.axes:
        click.echo(f"{len(axis.rows):6d} values of {', '.join(axis.keys)}")
    twice = f", {plan.count - jobs} of them the same as another" if jobs < plan.count else ""
    click.echo(f"{plan.count} designs{twice}; {finished} jobs are finished in {folder}, {jobs - finished} to compute")
    return FOUND
