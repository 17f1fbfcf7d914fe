"""`rodshell advise`: what the findings of a result offer, tried one after the other."""

from pathlib import Path
from shlex import quote, split
from typing import TYPE_CHECKING

import click

from rodshell.cli import form
from rodshell.cli.options import QUIET
from rodshell.cli.reporting import FOUND, NOT_CONVERGED, UNBUILDABLE, Progress, compile_before_first, free_name
from rodshell.errors import InputError, RodshellError
from rodshell.progress import Progress as ProgressFunction

if TYPE_CHECKING:
    from rodshell.figures.findings import Finding, Tried
    from rodshell.results import Verdict

Trial = tuple["Tried", "Verdict"]
CODES = {"unbuildable": UNBUILDABLE, "unknown": NOT_CONVERGED}


@click.command()
@click.argument("folder", metavar="DIR")
@click.option("--most", type=int, default=10, metavar="N", help="How many offers are tried at most; default 10.")
@QUIET
def command(folder: str, most: int, quiet: bool) -> int:
    """Try what the findings of an earlier result offer, and say what helps.

    DIR is a result of rodshell form, refine or check. Its offers are formed one by one, those of its gravest finding
    first, and not written. An offer helps if it betters the figure of its finding and the findings as a whole: the
    verdict's level, then how far figures are from their limits, the farthest first. So no two offers that help lead
    in a circle. What was tried is kept in DIR/result.json, also if this is interrupted; the command for the best is
    printed last.
    """
    from rodshell.results import read
    from rodshell.results.folder import open_folder
    from rodshell.results.offers import offered, standing
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
    with open_folder(path, reserved=["result.json"]) as place:
        compile_before_first(quiet=quiet)
        try:
            with Progress(quiet=quiet) as progress:
                for k, (offer, finding) in enumerate(tries, 1):
                    stage = f"{k} of {len(tries)}: {_options(offer)}"
                    trials.append(_trial(path, verdict, finding, offer, _within(stage, progress)))
        except KeyboardInterrupt:
            raise KeyboardInterrupt(f"the {len(trials)} offers that were tried are kept in {path}") from None
        finally:
            if trials:
                kept = archive.results.changed(advice=tuple(tried for tried, _ in trials))
                place.put("result.json", kept.text())
                place.commit(keep_others=True)
    trials.sort(key=lambda trial: (not trial[0].helps, standing(trial[1]) if trial[0].helps else (0, [])))
    best, _ = trials[0]
    if not quiet:
        click.echo("\n".join(_table([tried for tried, _ in trials], offers)))
    if len(offers) > most:
        click.echo(f"not tried: {len(offers) - most} more offers (--most {len(offers)})")
    if not best.helps:
        click.echo("none of them helps")
        return CODES.get(verdict.level, FOUND)
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
        with form.command.make_context("form", [str(folder / "case.toml"), *split(_options(offer))]) as context:
            case = form.asked(**context.params)
        found = Job.of_case(case).run(progress=progress)
        if found.known_loaded and found.known_loaded.refused:
            raise InputError(found.known_loaded.refused)
        results = found.archive().results
    except (RodshellError, click.UsageError) as reason:
        return tried.changed(said=str(reason)), before
    now = results.verdict or before
    return tried.changed(
        after=figure_of(results, finding), level=now.level, helps=helps(before, finding, results), said=now.headline
    ), now  # fmt: skip


def _options(offer: str) -> str:
    """What an offer adds to the case."""
    return offer.partition("case.toml ")[2]


def _table(trials: list["Tried"], findings: dict[str, "Finding"]) -> list[str]:
    """What was tried, in columns; commands at the end of their lines, as they are long."""
    from rodshell.results.offers import shown
    from rodshell.results.results import LEVELS

    rows: list[tuple[str, ...]] = [("", "finding", "before", "after", "limit", "verdict", "option")]
    for each in trials:
        finding = findings[each.offer]
        numbers = [shown(value, finding) for value in (each.before, each.after, finding.limit)]
        level = LEVELS.get(each.level, "no form") if each.level else "no form"  # type: ignore[call-overload]
        of = " ".join(filter(None, (each.code, finding.support, finding.place)))
        rows.append(("tried, helps" if each.helps else "no help", of, *numbers, level, _options(each.offer)))
    widths = [max(map(len, column)) for column in zip(*rows, strict=True)][:-1]
    return [
        "  ".join([*(cell.ljust(width) for cell, width in zip(row, widths, strict=False)), row[-1]]) for row in rows
    ]
