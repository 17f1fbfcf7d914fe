"""The report: one page that needs nothing else, neither files nor a network."""

from collections.abc import Mapping
from importlib.resources import files
from typing import Any

from rodshell.output.archive import SHELLS, Archive
from rodshell.output.drawing import Drawing
from rodshell.output.drawings.titleblock import on_a_page
from rodshell.output.figures import checks_table, key_figures, levels_table, supports_table
from rodshell.output.inputs import shown_case
from rodshell.output.pictures import picture_svg
from rodshell.output.plan import NOTE, FlatPlan
from rodshell.output.schedules import Table, heading, rods_table, seams_table, stock_table
from rodshell.output.schedules import joints_table as joints
from rodshell.output.schedules import supports_table as supports
from rodshell.output.shapes import CAPTIONS
from rodshell.output.svg import drawing_svg, inline
from rodshell.output.verdict import facts, unknown_below
from rodshell.output.viewer import viewer_data, viewer_json
from rodshell.output.wording import percent, stage

IN_PAGE = ("supports", "elevations", "erection")
FOLLOWED = "Every stage is an equilibrium of the elastic grid with pinned ends{gaps}."
PARTLY = (
    "Below {share} of the deployment no stage could be found: nothing is known there. Above, every one is an "
    "equilibrium of the elastic grid with pinned ends{gaps}."
)
SNAPS = "; at {places} of the deployment the shell snaps forward"
GUIDED = "; between {start} and {stop} of the deployment it has to be guided, and nothing is known there"
NOT_FOLLOWED = "The deployment from flat was not followed: nothing is known between these shapes."


def report_html(archive: Archive, plan: FlatPlan, drawings: Mapping[str, Drawing]) -> str:
    """The whole page; `plan` and `drawings` are the archive's."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("rodshell.output", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

    def shown(svg: str) -> Markup:
        return Markup(inline(svg))  # the SVG is ours, its texts are escaped where it is made

    result, tables = archive.result, _tables(archive)
    states = [state for state in CAPTIONS if state in archive.states and "rod_nodes" in archive.states]
    return environment.get_template("report.html.j2").render(
        name=archive.name,
        note=NOTE,
        summary=plan.summary,
        verdict=archive.verdict,
        facts=facts(result),
        dropped=result.get("dropped") or [],
        view=_view(archive),
        supports=supports_table(result),
        checks=checks_table(result),
        pictures=[(CAPTIONS[state], shown(picture_svg(archive, state))) for state in states],
        one_scale=sum(state in SHELLS for state in states) > 1,
        figures=key_figures(result, plan),
        levels=levels_table(result),
        plan=shown(_on_page(drawings["plan"])),
        drawings=[(drawings[name].title, shown(_on_page(drawings[name]))) for name in IN_PAGE if name in drawings],
        tables=[
            (title, ([heading(column) for column in columns], rows), note) for title, (columns, rows), note in tables
        ],
        case=shown_case(archive.case_toml, archive.inputs),
        version=str(result.get("version_rodshell") or "unknown"),
        versions=", ".join(f"{name} {number}" for name, number in (result.get("versions") or {}).items()),
        format_version=str(result.get("version") or "unknown"),
    )


def _on_page(drawing: Drawing) -> str:
    return drawing_svg(on_a_page(drawing), scale="lengths in mm")


def _view(archive: Archive) -> dict[str, Any] | None:
    """The 3D view's data and script."""
    from markupsafe import Markup

    data = viewer_data(archive)
    if data is None:
        return None
    script = files("rodshell.output").joinpath("templates/view.js").read_text(encoding="utf-8")
    return {
        "data": Markup(viewer_json(data)),
        "script": Markup(script),
        "frames": len(data["frames"]),
        "colours": sorted(data["names"].items(), reverse=True),  # stress first
        "note": _note(archive),
    }


def _note(archive: Archive) -> str:
    """What the stages of the view are."""
    unknown = unknown_below(archive.result)
    if "history" not in archive.states or unknown >= 1:
        return NOT_FOLLOWED
    way, gaps = archive.result.get("deployment") or {}, ""
    if snaps := way.get("snaps"):
        gaps += SNAPS.format(places=", ".join(stage(start) for start, _ in snaps))
    if guided := way.get("guided"):
        gaps += GUIDED.format(start=stage(guided[0]), stop=stage(guided[1]))
    return (PARTLY if unknown else FOLLOWED).format(share=stage(unknown), gaps=gaps)


def _tables(archive: Archive) -> list[tuple[str, Table, str]]:
    """Title, table and note of the schedules in the page."""
    tables = [
        ("Rods", rods_table(archive, brief=True), "Where each joint is on its rods: schedule/rods.csv, joints.csv."),
        ("Joints", joints(archive, brief=True), "Named by the rods that meet, a/b. Final: in the popped-up shell."),
    ]
    if archive.result.get("boundary"):
        tables.append(("Supports", supports(archive, brief=True), "With reactions: schedule/supports.csv."))
    if archive.result.get("seams"):
        tables.append(("Seams", seams_table(archive), "Forces: what a seam carries there, both rods together."))
    if stock := (archive.result.get("fabrication") or {}).get("stock"):
        tables.append(("Stock", stock_table(archive), _plan_of(stock)))
    return tables


def _plan_of(stock: Mapping[str, Any]) -> str:
    """How good a cutting plan is."""
    return (
        f"First fit decreasing: {len(stock['bars'])} bars, {percent(stock['waste'])} waste. By the pieces' total "
        f"length alone it takes {stock['fewest']} bars; that is a bound, which no plan need reach."
    )
