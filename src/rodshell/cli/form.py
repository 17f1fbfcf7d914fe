"""`rodshell form`: the main job. Its options are the keys of the case file."""

from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from rodshell.case import BUILT_IN, Case, load_case
from rodshell.cli.options import CaseCommand, case_options, overrides_of
from rodshell.cli.outcome import Kept, deliver, output_folder, wanted_kinds
from rodshell.cli.progress import Progress, announce_compilation
from rodshell.units import length_text

if TYPE_CHECKING:
    from rodshell.formfinding.search import Search
    from rodshell.layout import GridLayout
    from rodshell.rods.section import Rod
    from rodshell.targets import Target


@click.command(
    cls=CaseCommand,
    params=case_options(),
    epilog='Lengths and so on take a unit, "200 mm", "45 deg", "25 GPa"; a plain number is in SI.',
)
@click.argument("name", metavar="NAME|CASE.toml|SURFACE")
@click.option("--out", "-o", metavar="DIR", help="Folder for the results; default out/NAME.")
@click.option("--only", metavar="KINDS", help="Files beside the archive, such as dxf,csv; see rodshell export --help.")
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON, for programs.")
@click.option("--quiet", "-q", is_flag=True, help="Print errors only.")
def command(name: str, out: str | None, only: str | None, as_json: bool, quiet: bool, **values: str | None) -> int:
    """From a target to the flat grid that pops up into it: drape, trim, map back, pop up, compare.

    NAME is a built-in case, {names}; CASE.toml a case file; SURFACE a mesh (OBJ, STL, PLY, OFF,
    glTF), a Rhino file (3dm), or heights (CSV, PNG). Each key of a case is an option too.
    """
    case = load_case(name, overrides_of(values))
    return run(case, name, out=out, only=only, as_json=as_json, quiet=quiet)


assert command.help is not None
command.help = command.help.format(names=", ".join(BUILT_IN))


def run(case: Case, name: str, *, out: str | None, only: str | None, as_json: bool, quiet: bool) -> int:
    """Find the form of a case and write it; the exit code."""
    folder = output_folder(out, name)
    if case.seams.lines:
        return _sew(case, folder, only=only, as_json=as_json, quiet=quiet)
    from rodshell.output.inputs import read_inputs

    target, layout, rod, options = case.build()
    asked, case, inputs = case, case.sized(target), read_inputs(case.to_toml())
    takeaway, kinds = case.takeaway(), wanted_kinds(only)
    announce_compilation(quiet=quiet)
    _announce_sizes(asked, target, layout, rod, quiet=quiet)
    from rodshell.form import find_form

    with Progress(quiet=quiet) as progress:
        found = None
        if case.undecided:
            found = _search(case, target, layout, rod, progress)
            layout, options["anchor"] = replace(layout, rotate=found.best.heading), found.best.anchor
            case = case.decided(found.best.anchor, found.best.heading)
        form = find_form(target, layout, rod, progress=progress, **options)
        kept = Kept(form.archive(case.to_toml(), takeaway=takeaway, inputs=inputs, progress=progress), kinds)
    if found and not (quiet or as_json):
        click.echo(found.table())
    code = deliver(kept, kept.save, folder, as_json=as_json, quiet=quiet)
    if found:
        (folder / "search.svg").write_text(_picture(found), encoding="utf-8")
    return code


def _sew(case: Case, folder: Path, *, only: str | None, as_json: bool, quiet: bool) -> int:
    """Find the form of a case with seams and write it; the exit code."""
    from rodshell.output.inputs import read_inputs

    target, layout, rod, options = case.build_sewn()
    asked, case, inputs = case, case.sized(target), read_inputs(case.to_toml())
    takeaway, kinds = case.takeaway(), wanted_kinds(only)
    announce_compilation(quiet=quiet)
    _announce_sizes(asked, target, layout, rod, quiet=quiet)
    from rodshell.form import sew

    with Progress(quiet=quiet) as progress:
        search = case.layout.rotate == "auto"
        form = sew(target, layout=layout, rod=rod, search=search, progress=progress, **options)
        case = case.headed(form.layout.rotate)
        kept = Kept(form.archive(case.to_toml(), takeaway=takeaway, inputs=inputs, progress=progress), kinds)
    return deliver(kept, kept.save, folder, as_json=as_json, quiet=quiet)


def _announce_sizes(case: Case, target: "Target", layout: "GridLayout", rod: "Rod", *, quiet: bool) -> None:
    """Before a job runs, say what it is and which lengths were left to its target's size: a wrong unit shows here."""
    section = case.rod.section
    lengths = {
        "spacing": min(layout.spacing) if case.layout.spacing == "auto" else None,
        "edge": layout.edge if case.layout.edge == "auto" else None,
        "rod radius": getattr(rod.section, "radius", None) if getattr(section, "radius", None) == "auto" else None,
    }
    said = ", ".join(f"{name} {length_text(length)}" for name, length in lengths.items() if length is not None)
    if said and not quiet:
        click.echo(f"rodshell: {target.name}, {length_text(2 * target.size)} wide; {said}", err=True)


def _search(case: Case, target: "Target", layout: "GridLayout", rod: "Rod", progress: Progress) -> "Search":
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
