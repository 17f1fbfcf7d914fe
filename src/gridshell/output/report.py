"""The report: one page that needs nothing else, neither files nor a network."""

from gridshell.output.archive import SHELLS, Archive
from gridshell.output.figures import key_figures, levels_table, rods_table, supports_table
from gridshell.output.pictures import picture_svg
from gridshell.output.plan import NOTE, FlatPlan
from gridshell.output.plansvg import plan_svg
from gridshell.output.svg import inline
from gridshell.output.verdict import verdict

CAPTIONS = {
    "flat": "Flat, as cut and laid out",
    "draped": "Draped on the target",
    "popped_pinned": "Popped up, pinned ends (free to turn)",
    "popped_clamped": "Popped up, clamped ends (directions held)",
}


def report_html(archive: Archive, plan: FlatPlan) -> str:
    """The whole page; `plan` is the archive's."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("gridshell.output", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    result = archive.result
    shown = [state for state in CAPTIONS if state in archive.states]
    return environment.get_template("report.html.j2").render(
        name=archive.name,
        note=NOTE,
        summary=plan.summary,
        warnings=[str(word) for word in result.get("warnings") or []],
        verdict=verdict(archive),
        dropped=result.get("dropped") or [],
        supports=supports_table(result),
        # the SVG is ours, its texts are escaped where it is made
        pictures=[(CAPTIONS[state], Markup(inline(picture_svg(archive, state)))) for state in shown],
        one_scale=sum(state in SHELLS for state in shown) > 1,
        figures=key_figures(result, plan),
        levels=levels_table(result),
        plan=Markup(inline(plan_svg(plan))),
        rods=rods_table(plan),
        case=archive.case_toml,
        version=str(result.get("version_gridshell") or "unknown"),
        format_version=str(result.get("version") or "unknown"),
    )
