"""`rodshell advise`: what the findings of a result offer, tried one after the other."""

from dataclasses import replace
from pathlib import Path
from shlex import quote, split
from typing import TYPE_CHECKING

import click

from rodshell.case import Case
from rodshell.cli import form
from rodshell.cli.app import app
from rodshell.cli.options import FORCE, QUIET
from rodshell.cli.reporting import FOUND, NOT_CONVERGED, UNBUILDABLE, Progress, compile_before_first, free_name
from rodshell.errors import InputError, RodshellError
from rodshell.progress import Progress as ProgressFunction
from rodshell.units import shown

if TYPE_CHECKING:
    from rodshell.figures.findings import Finding, Tried
    from rodshell.results import Verdict

Trial = tuple["Tried", "Verdict"]
CODES = {"unbuildable": UNBUILDABLE, "unknown": NOT_CONVERGED}


@click.command()
@click.argument("folder", metavar="DIR")
@click.option("--most", type=int, default=10, metavar="N", help="How many offers are tried at most; default 10.")
@FORCE
@QUIET
def command(folder: str, most: int, force: bool, quiet: bool) -> int:
    """Try what the findings of an earlier result offer, and say what helps.

    DIR is a result of rodshell form, refine or check. Its offers are formed one by one, those of its gravest finding
    first, and not written. An offer helps if it betters the figure of its finding and the findings as a whole: the
    verdict's level, then how far figures are from their limits, the farthest first. So no two offers that help lead
    in a circle. What was tried is kept in DIR/result.json, also if this is interrupted; the command for the best is
    printed last.
    """
    from rodshell.results import read
    from rodshell.results.folder import open_folder
    from rodshell.results.offers import ADVICE, advice_rows, offered, standing
    from rodshell.results.wording import FORM_AGAIN

    path = Path(folder)
    if most < 1:
        raise InputError(f"--most is {most}: give at least 1")
    archive = read(path)
    verdict = archive.verdict
    offers, again = offered(verdict), f"rodshell form {quote(str(path.resolve() / 'case.toml'))}"
    if not quiet:
        click.echo(f"{archive.name}: {verdict.headline.replace(FORM_AGAIN, again)}")
    if not offers:
        click.echo("there is nothing to mend" if verdict.level == "good" else "no option mends what was found")
        return CODES.get(verdict.level, FOUND)
    if not (path / "case.toml").is_file():
        raise InputError(f"{folder} has no case.toml that could be run again: give a result of rodshell form")
    trials, tries = list[Trial](), [*offers.items()][:most]
    with open_folder(path, reserved=["result.json"], force=force) as place:
        compile_before_first(quiet=quiet)
        try:
            with Progress(quiet=quiet) as progress:
                for k, (offer, finding) in enumerate(tries, 1):
                    stage = f"{k} of {len(tries)}: {_options(offer)}"
                    trials.append(_trial(path, verdict, finding, offer, _within(stage, progress)))
        except KeyboardInterrupt:
            kept = f"what was tried is kept in {path}: {len(trials)} of {len(tries)}"
            raise KeyboardInterrupt(kept) from None
        finally:
            helpful = sorted((trial for trial in trials if trial[0].helps), key=lambda trial: standing(trial[1]))
            tried = [*helpful, *(trial for trial in trials if not trial[0].helps)]
            results = archive.results.changed(advice=tuple(each for each, _ in tried))
            if trials:
                place.put("result.json", results.text())
                place.commit(keep_others=True)
    if not quiet:
        rows = [ADVICE, *(row for row in advice_rows(results, verdict) if row[0])]
        widths = [max(map(len, column)) for column in zip(*rows, strict=True)]
        lines = ("  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in rows)
        click.echo("\n".join(line.rstrip() for line in lines))
    if len(offers) > most:
        click.echo(f"not tried: {len(offers) - most} more offers (--most {len(offers)})")
    if not helpful:
        click.echo("none of them helps")
        return CODES.get(verdict.level, FOUND)
    best = results.advice[0]
    click.echo(f"{again} {_options(best.offer)} --out {quote(str(free_name(path.resolve())))}")
    return CODES.get(best.level or "", FOUND)


def _within(stage: str, progress: Progress) -> ProgressFunction:
    """A progress of which all stages are parts of one."""
    return lambda part, detail, residual: progress(stage, f"{part} {detail}", residual)


def _trial(folder: Path, before: "Verdict", finding: "Finding", offer: str, progress: ProgressFunction) -> "Trial":
    """What an offer comes to, formed as it is when it is pasted, and the verdict with it."""
    from rodshell.figures.findings import Tried
    from rodshell.job import Job
    from rodshell.results.offers import figure_of, helps

    tried = Tried(offer=offer, code=finding.code, before=finding.figure, helps=False)
    try:
        found = Job.of_case(case_of(folder / "case.toml", offer)).run(progress=progress)
        if found.known_loaded and found.known_loaded.refused:
            raise InputError(found.known_loaded.refused)
        results = found.archive().results
    except (RodshellError, click.UsageError) as reason:
        return tried.changed(said=str(reason)), before
    now = results.verdict or before
    return tried.changed(
        after=figure_of(results, finding), level=now.level, helps=helps(before, finding, results), said=now.headline
    ), now  # fmt: skip


def case_of(case: Path, offer: str) -> Case:
    """The case that the command line of an offer gives, without the frames of a fall, which are files."""
    try:
        words = split(_options(offer))
    except ValueError as reason:
        raise InputError(f"the offer {shown(offer)} cannot be read: {reason}") from None
    with form.command.make_context("form", [str(case), *words], **app.context_settings) as context:
        found = form.asked(**context.params)
    return replace(found, drape=replace(found.drape, frames=None))


def _options(offer: str) -> str:
    """What an offer adds to the case."""
    return offer.partition("case.toml ")[2]
