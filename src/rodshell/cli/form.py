"""`rodshell form`: the main job. Its options are the keys of the case file."""

from dataclasses import replace
from glob import escape
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rodshell.case import BUILT_IN, Case, load_case
from rodshell.cli.options import CaseCommand, case_options, overrides_of
from rodshell.cli.outcome import (
    Kept,
    announce_rod,
    deliver,
    force_option,
    output_folder,
    seconds_of,
    time_limit_option,
    wanted_kinds,
)
from rodshell.cli.progress import Progress, announce_compilation
from rodshell.units import length_text

if TYPE_CHECKING:
    from rodshell.formfinding.progress import Progress as Calls
    from rodshell.formfinding.search import Search
    from rodshell.layout import GridLayout
    from rodshell.results import Archive
    from rodshell.results.folder import ResultFolder
    from rodshell.rods.section import Rod
    from rodshell.targets import Target

SEARCH = "search.svg"


@click.command(
    cls=CaseCommand,
    params=case_options(),
    epilog='Lengths and so on take a unit, "200 mm", "45 deg", "25 GPa"; a plain number is in SI.',
)
@click.argument("name", metavar="NAME|CASE.toml|SURFACE")
@click.option("--out", "-o", metavar="DIR", help="Folder for the results; default out/NAME.")
@click.option("--only", metavar="KINDS", help="Files beside the archive, such as dxf,csv; see rodshell export --help.")
@time_limit_option
@force_option
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON, for programs.")
@click.option("--quiet", "-q", is_flag=True, help="Print errors only.")
def command(
    name: str,
    out: str | None,
    only: str | None,
    time_limit: str | None,
    force: bool,
    as_json: bool,
    quiet: bool,
    **values: str | None,
) -> int:
    """From a target to the flat grid that pops up into it: drape, trim, map back, pop up, compare.

    NAME is a built-in case, {names}; CASE.toml a case file; SURFACE a mesh (OBJ, STL, PLY, OFF,
    glTF), a Rhino file (3dm), or heights (CSV, PNG). Each key of a case is an option too.
    """
    case = load_case(name, overrides_of(values))
    limit = seconds_of(time_limit)
    return run(case, name, out=out, only=only, limit=limit, force=force, as_json=as_json, quiet=quiet)


assert command.help is not None
command.help = command.help.format(names=", ".join(BUILT_IN))


def run(
    case: Case,
    name: str,
    *,
    out: str | None,
    only: str | None,
    limit: float | None,
    force: bool,
    as_json: bool,
    quiet: bool,
) -> int:
    """Find the form of a case and write it; the exit code.

    limit : longest time [s] for all but the files.
    """
    from rodshell.formfinding.progress import limited
    from rodshell.output.files import reserved
    from rodshell.results.archive import ARCHIVE
    from rodshell.results.inputs import kept_case, read_inputs
    from rodshell.solve.time_series import NAMES

    kinds = wanted_kinds(only)
    inputs = read_inputs(case.to_toml())
    copies = kept_case(case.to_toml(), inputs, Path())[1]
    names = [*ARCHIVE, *copies, *reserved(kinds), *([SEARCH] if case.undecided else [])]
    names += [f"{escape(case.drape.frames)}/{name}.npy" for name in NAMES] if case.drape.frames else []
    with output_folder(out, name, names, force=force) as place:
        work = _sew if case.seams.lines else _form
        announce_compilation(quiet=quiet)
        progress = Progress(quiet=quiet)
        with progress:
            archive, searched = work(case, inputs, place, limited(progress, limit), quiet=quiet)
        if searched and not (quiet or as_json):
            click.echo(searched.table())
        kept = Kept(archive, kinds, {SEARCH: _picture(searched)} if searched else {})
        return deliver(kept, kept.save, place, progress=progress, as_json=as_json, quiet=quiet)


def _form(
    case: Case, inputs: dict[str, bytes], place: "ResultFolder", progress: "Calls", *, quiet: bool
) -> "tuple[Archive, Search | None]":
    """The form of a case, and the search for its anchor and heading; frames are staged in `place`."""
    output = case.output_options()
    target, layout, rod, options = case.build()
    _announce_sizes(case, target, layout, quiet=quiet)
    if case.drape.frames:
        options["method"] = replace(options["method"], stream=place.new / case.drape.frames)
    from rodshell.form import find_form

    found = None
    if case.undecided:
        found = _search(case, target, layout, rod, progress)
        layout, options["anchor"] = replace(layout, rotate=found.best.heading), found.best.anchor
        case = case.decided(found.best.anchor, found.best.heading)
        rod = case.rod_on(target, layout, anchor=found.best.anchor)
    announce_rod(case, rod, lambda: case.fit_on(target, layout, anchor=options["anchor"]), quiet=quiet)
    case = case.with_rod(rod)
    form = find_form(target, layout, rod, progress=progress, **options)
    return form.archive(case.to_toml(), options=output, inputs=inputs, progress=progress), found


def _sew(
    case: Case, inputs: dict[str, bytes], place: "ResultFolder", progress: "Calls", *, quiet: bool
) -> "tuple[Archive, None]":
    """The form of a case with seams."""
    output = case.output_options()
    target, layout, rod, options = case.build_sewn()
    _announce_sizes(case, target, layout, quiet=quiet)
    announce_rod(case, rod, lambda: case.fit_on(target, layout), quiet=quiet)
    case = case.with_rod(rod)
    from rodshell.form import sew

    search = case.layout.rotate == "auto"
    form = sew(target, layout=layout, rod=rod, search=search, progress=progress, **options)
    case = case.headed(form.layout.rotate)
    return form.archive(case.to_toml(), options=output, inputs=inputs, progress=progress), None


def _announce_sizes(case: Case, target: "Target", layout: "GridLayout", *, quiet: bool) -> None:
    """Before a job runs, say what it is and which lengths were left to its target's size: a wrong unit shows here."""
    lengths = {
        "spacing": min(layout.spacing) if case.layout.spacing == "auto" else None,
        "edge": layout.edge if case.layout.edge == "auto" else None,
    }
    said = ", ".join(f"{name} {length_text(length)}" for name, length in lengths.items() if length is not None)
    if said and not quiet:
        name = case.drawings.name or target.name
        click.echo(f"rodshell: {name}, {length_text(2 * target.size)} wide; {said}", err=True)


def _search(case: Case, target: "Target", layout: "GridLayout", rod: "Rod", progress: "Calls") -> "Search":
    """Try anchors and headings for those of the two that are "auto"."""
    from rodshell.formfinding.search import search

    anchor, heading = case.drape.anchor, case.layout.rotate
    return search(
        target, layout, rod, objective=case.drape.objective, progress=progress,
        anchors="auto" if anchor == "auto" else [anchor or target.summit],
        headings="auto" if heading == "auto" else [heading],
    )  # fmt: skip


def _picture(found: "Search") -> str:
    from rodshell.output.searchmap import search_svg

    return search_svg(f"{found.title} by anchor and heading", found.trials, found.best)
