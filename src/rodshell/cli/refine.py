"""`rodshell refine`: a form that is brought nearer to its target. Its options are those of `rodshell form`."""

from dataclasses import replace
from pathlib import Path
from typing import Any

import click

from rodshell.case import Case, load_case
from rodshell.cli.options import UNITS, CaseCommand, RunOptions, case_options, output_options, overrides_of
from rodshell.cli.reporting import run_and_deliver
from rodshell.errors import InputError
from rodshell.rods.supports import SUPPORTS
from rodshell.validation import choice

LATER = ("pop_up", "refine", "checks", "fabrication", "drawings")  # tables that leave the shell before it as it is
VARY = "taper"  # where neither the command nor the case says


@click.command(cls=CaseCommand, params=case_options(), epilog=UNITS)
@click.argument("name", metavar="NAME|CASE.toml|SURFACE|DIR")
@output_options("Folder for the results; default out/NAME-refined.")
def command(name: str, output: RunOptions, **values: Any) -> int:
    """Bring a form nearer to its target: vary its rods, and accept only what can be built.

    NAME, CASE.toml and SURFACE are those of rodshell form; DIR is an earlier result, whose case is run again. --vary
    names what is varied: taper, the bending stiffness along the rods; double, laths that are double over a share of
    each rod; sections, of stock sizes; tails, cut lengths; clamps; supports; holes, the joints' places on the rods;
    offsets of the rods. A result that was refined by the same keys continues from its design.

    It has the supports of --ends; default: as the case says, or pinned. A design is accepted if it lies flat, pops up
    from flat to the same shape, does not depend on the mesh, and stays stable and near its target when it is built with
    errors; else the form stays as it was.
    """
    overrides = overrides_of(values)
    path = Path(name)
    if path.is_dir():
        if not (path / "case.toml").is_file():
            raise InputError(f"{path} holds no result with a case.toml: give a case, or the folder of a form")
        name, stem = str(path / "case.toml"), path.resolve().name
    else:
        stem = path.stem
    if ends := overrides.get("pop_up.ends"):
        choice("--ends", ends, tuple(SUPPORTS))
    case = load_case(name, overrides)
    if path.is_dir() and case.refine.start is None and all(key.partition(".")[0] in LATER for key in overrides):
        overrides |= _design(path, case)
    only = ends or case.refine.ends or (case.ends or tuple(SUPPORTS))[0]
    vary = case.refine.vary or VARY
    return run_and_deliver(
        load_case(name, overrides | {"refine.vary": vary, "refine.ends": only, "pop_up.ends": only}),
        f"{stem}-refined", output,
    )  # fmt: skip


def _design(folder: Path, case: Case) -> dict[str, object]:
    """The design of an earlier result that was refined by the same keys, to continue from; else nothing."""
    from rodshell.results.archive import read

    kept = read(folder)
    same = replace(load_case(str(folder / "case.toml")).refine, start=None)
    if "design" not in kept.states or same != replace(case.refine, start=None):
        return {}
    return {"refine.start": kept.states["design"].tolist()}
