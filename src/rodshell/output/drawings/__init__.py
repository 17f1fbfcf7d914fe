"""The drawing set: each drawing laid out once, at 1:1 for DXF and SVG, all of them on sheets for the PDF."""

import tomllib
from collections.abc import Iterator
from functools import partial

import numpy as np

from rodshell.arrays import Floats
from rodshell.figures.checks import OTHER_SHAPES
from rodshell.output.drawing import TEXT, Drawing
from rodshell.output.drawings import flat, sheets, shell
from rodshell.output.drawings.flat import FlatPlan, flat_plan
from rodshell.output.drawings.sheets import Compose, Layout, Paper, Sheet
from rodshell.output.grid import lies_flat, supported
from rodshell.output.schedules import SCHEDULES
from rodshell.output.settings import PAPERS
from rodshell.output.svg import drawing_svg
from rodshell.results import Archive, Results
from rodshell.results.archive import made_once
from rodshell.results.states import DRAPED, POPPED
from rodshell.rods.supports import clamped_among, finals_first

__all__ = ["drawing_set", "drawing_svgs", "sheet_set"]


FINER = {"bracing": 0.5}  # smallest texts of a drawing at 1:1 over those of the plan, where more of them find room


@made_once
def drawing_set(archive: Archive) -> dict[str, Drawing]:
    """Every drawing that the archive has content for, at 1:1 with a title block, by name."""
    plan = flat_plan(archive)
    block = sheets.title_block(archive, plan.summary)
    drawings = {name: layout.detail for name, layout in _layouts(archive).items()}
    first = {"plan": drawings.pop("plan")} if "plan" in drawings else {}
    first["strips"] = flat.strips_drawing(plan, plan.text)
    return {name: sheets.with_title(drawing, block) for name, drawing in (first | drawings).items()}


@made_once
def drawing_svgs(archive: Archive) -> dict[str, str]:
    """The same as SVG files."""
    return {name: drawing_svg(drawing) for name, drawing in drawing_set(archive).items()}


def sheet_set(archive: Archive) -> tuple[list[Drawing], Paper]:
    """All sheets in mm of paper, and the paper's size."""
    plan, paper, layouts = flat_plan(archive), _paper(archive), dict(_layouts(archive))
    if not _braced(archive):
        layouts.pop("bracing", None)
    checked = _checked(archive.results)
    about = {"supports": _held(archive), "bracing": checked, "rods": checked, "splices": checked}

    def listed(name: str) -> Iterator[Sheet]:
        schedule = SCHEDULES[name]
        return sheets.table(schedule.title + about.get(name, ""), schedule.brief(archive), paper)

    first = layouts.pop("plan").sheets(paper) if "plan" in layouts else ()
    found = [*first, *_strips(plan, paper)]
    for name, layout in layouts.items():
        found += layout.sheets(paper)
        if name in SCHEDULES:
            found += listed(name)
    for name in ("rods", "joints", "splices", "sections", "seams", "stock"):
        if SCHEDULES[name].known(archive):
            found += listed(name)
    return sheets.bound(found, sheets.title_block(archive, plan.summary), paper), paper


def _braced(archive: Archive) -> bool:
    """Whether the shell has bracing; the diagonals of every shell are in the files at 1:1 and in the schedule."""
    results = archive.results
    asked = tomllib.loads(archive.case_toml).get("bracing", {}).get("kind", "none") != "none"
    loaded = any(shell.bracing for _, _, shell in results.loaded_shells())
    return asked or loaded or any(brace.cut is not None for brace in results.bracing)


def _held(archive: Archive) -> str:
    """With which ends the final shape is; directions in the table of supports are those of the draped shell."""
    final = archive.final or DRAPED
    if final == DRAPED:
        return ""
    turns = archive.results.end_tangents and not clamped_among([final.removeprefix(POPPED)])
    return f", {supported(final, *(['directions as on the target'] if turns else []))}"


def _checked(results: Results) -> str:
    """With which ends the final shape is that the bending of rods and the lengths of the bracing are of."""
    shapes = results.bending.shapes() if results.bending else {}
    return next((f", final shape with {ends} ends" for ends in finals_first(shapes) if ends not in OTHER_SHAPES), "")


@made_once
def _layouts(archive: Archive) -> dict[str, Layout]:
    """Every drawing but the strips, which are cut into sheets between two rods."""
    plan, paper = flat_plan(archive), _paper(archive)
    templates = paper == PAPERS["A4"]  # which is printed at a desk, for models
    extent = np.ptp(np.concatenate([plan.cuts.reshape(-1, 2), *plan.footprint]), axis=0)
    layouts = dict[str, Layout]()
    if lies_flat(archive):
        layouts["plan"] = sheets.laid_out(
            partial(flat.flat_drawing, plan), extent, paper, plan.text, true_size=templates
        )
    for name, (compose, extent) in _of_the_shell(archive).items():
        text, true_size = FINER.get(name, 1.0) * plan.text, templates and name == "supports"
        layouts[name] = sheets.laid_out(compose, extent, paper, text, true_size=true_size)
    return layouts


def _paper(archive: Archive) -> Paper:
    style = archive.results.drawings
    return PAPERS[style.paper if style else "A3"]


def _of_the_shell(archive: Archive) -> dict[str, tuple[Compose, Floats]]:
    """Drawings that need a shape in space, and what each takes at least without its texts (2,) [mm]."""
    if archive.final is None or "rod_nodes" not in archive.states:
        return {}
    width, depth, height = np.ptp(np.concatenate(shell.final_curves(archive)), axis=0)
    above, both_sides = np.array([width, depth]), np.array([max(width, depth), 2 * height])
    makers: dict[str, tuple[Compose, Floats]] = {
        "supports": (partial(shell.supports_drawing, archive), above),
        "elevations": (partial(shell.elevations_drawing, archive), both_sides),
    }
    if archive.results.bracing:
        makers["bracing"] = (partial(shell.bracing_drawing, archive), above)
    if "history" in archive.states and archive.results.deployment:
        makers["erection"] = (partial(shell.erection_drawing, archive), above)
    return makers


def _strips(plan: FlatPlan, paper: Paper) -> list[Sheet]:
    """The strips at the largest scale at which the longest rod fits, as many to a sheet as there is room for."""
    low, high = sheets.room(paper)
    width, height = high - low

    def fits(scale: float) -> bool:
        sizes = [flat.strip_size(plan, rod, scale * TEXT) for rod in plan.rods]
        longest = max((long for long, _ in sizes), default=1.0)
        broadest = max((across for _, across in sizes), default=0.0)
        fitting = (longest + 12 * scale * TEXT) / scale <= width and broadest / scale + (flat.TALL + 3) * TEXT <= height
        return bool(fitting)

    scale = next((scale for scale in sheets.SCALES if fits(scale)), sheets.SCALES[-1])
    groups = flat.sheets_of_strips(plan, scale * height, scale * TEXT)
    found = []
    for k, rods in enumerate(groups):
        drawing = flat.strips_drawing(plan, scale * TEXT, rods)
        top = drawing.box()[1][1]
        placed = drawing.placed(1 / scale, low + (4.0, height - top / scale))
        many = f", {k + 1} of {len(groups)}" if len(groups) > 1 else ""
        found.append(Sheet(drawing.title + many, placed, scale))
    return found
