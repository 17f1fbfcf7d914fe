"""The drawing set: each drawing at 1:1 for DXF and SVG, and all of them on sheets of paper for the PDF."""

from functools import cache

from rodshell.output.drawing import TEXT, Drawing
from rodshell.output.drawings.flat import FlatPlan, flat_drawing, per_sheet, strips_drawing
from rodshell.output.drawings.sheets import (
    SCALES,
    Compose,
    Sheet,
    bound,
    fitted,
    parts,
    room,
    table,
    title_block,
    with_title,
)
from rodshell.output.drawings.shell import bracing_drawing, elevations_drawing, erection_drawing, supports_drawing
from rodshell.output.options import PAPERS
from rodshell.output.schedules import (
    bracing_table,
    joints_table,
    rods_table,
    seams_table,
    sections_table,
    stock_table,
    supports_table,
)
from rodshell.results import Archive

__all__ = ["drawing_set", "sheet_set"]


FINER = {"bracing": 0.45}  # texts of a drawing at 1:1 over those of the plan, where more of them find room


def drawing_set(archive: Archive, plan: FlatPlan) -> dict[str, Drawing]:
    """Every drawing that the archive has content for, at 1:1 with a title block, by name.

    Parameters
    ----------
    plan : the flat plan of the archive.
    """
    block = title_block(archive, plan.summary)
    makers: dict[str, Compose] = {
        "plan": lambda text: flat_drawing(plan, text),
        "strips": lambda text: strips_drawing(plan, text),
        **_of_the_shell(archive, plan),
    }
    return {name: with_title(make(FINER.get(name, 1.0) * plan.text), block) for name, make in makers.items()}


def sheet_set(archive: Archive, plan: FlatPlan) -> tuple[list[Drawing], tuple[float, float]]:
    """All sheets in mm of paper, and the paper's size.

    Parameters
    ----------
    plan : the flat plan of the archive.
    """
    results = archive.results
    paper = PAPERS[results.drawings.paper if results.drawings else "A3"]

    @cache  # the same text sizes are tried for one sheet and for its parts
    def flat(text: float) -> Drawing:
        return flat_drawing(plan, text)

    whole = fitted(flat, paper)
    sheets = [whole, *parts(flat, paper, whole, true_size=True)]
    sheets += _strips(plan, paper)
    for name, compose in _of_the_shell(archive, plan).items():
        make = cache(compose)
        whole = fitted(make, paper)
        sheets += [whole, *parts(make, paper, whole)]
        if name == "supports":
            sheets += table("Supports", supports_table(archive, brief=True), paper)
        elif name == "bracing":
            sheets += table("Bracing", bracing_table(archive), paper)
    sheets += table("Rods", rods_table(archive, brief=True), paper)
    sheets += table("Joints", joints_table(archive, brief=True), paper)
    if any(rod.stiffness for rod in results.rods):
        sheets += table("Sections along the rods", sections_table(archive), paper)
    if results.seams:
        sheets += table("Seams", seams_table(archive), paper)
    if results.fabrication and results.fabrication.stock:
        sheets += table("Stock", stock_table(archive), paper)
    return bound(sheets, title_block(archive, plan.summary), paper), paper


def _of_the_shell(archive: Archive, plan: FlatPlan) -> dict[str, Compose]:
    """Drawings that need a shape in space."""
    makers: dict[str, Compose] = {}
    if archive.final is None or "rod_nodes" not in archive.states:
        return makers
    makers["supports"] = lambda text: supports_drawing(archive, plan, text)
    makers["elevations"] = lambda text: elevations_drawing(archive, text)
    if archive.results.fabrication and archive.results.fabrication.bracing:
        makers["bracing"] = lambda text: bracing_drawing(archive, text)
    if "history" in archive.states and archive.results.deployment:
        makers["erection"] = lambda text: erection_drawing(archive, text)
    return makers


def _strips(plan: FlatPlan, paper: tuple[float, float]) -> list[Sheet]:
    """The strips at the largest scale at which the longest rod fits, as many to a sheet as there is room for."""
    low, high = room(paper)
    width, height = high - low
    longest = max((1e3 * rod.cut_length for rod in plan.rods), default=1.0)
    scale = next((scale for scale in SCALES if (longest + 12 * scale * TEXT) / scale <= width), SCALES[-1])
    count = per_sheet(height, TEXT)
    groups = [plan.rods[k : k + count] for k in range(0, len(plan.rods), count)]
    sheets = []
    for k, rods in enumerate(groups):
        drawing = strips_drawing(plan, scale * TEXT, rods)
        top = drawing.box()[1][1]
        placed = drawing.placed(1 / scale, low + (4.0, height - top / scale))
        many = f", {k + 1} of {len(groups)}" if len(groups) > 1 else ""
        sheets.append(Sheet(drawing.title + many, placed, scale))
    return sheets
