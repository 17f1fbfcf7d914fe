"""The report: one page that needs nothing else, neither files nor a network."""

from collections.abc import Iterable
from math import pi
from typing import Any

from gridshell.output.archive import SHELLS, Archive
from gridshell.output.pictures import picture_svg
from gridshell.output.plan import NOTE, FlatPlan, flat_plan
from gridshell.output.plansvg import plan_svg
from gridshell.output.svg import inline
from gridshell.output.verdict import ENDS, entries, millimetres, percent, verdict

CAPTIONS = {
    "flat": "Flat, as cut and laid out",
    "draped": "Draped on the target",
    "popped_pinned": "Popped up, pinned ends (free to turn)",
    "popped_clamped": "Popped up, clamped ends (directions held)",
}
Row = tuple[str, str]


def report_html(archive: Archive) -> str:
    """The whole page."""
    from jinja2 import Environment, PackageLoader, StrictUndefined
    from markupsafe import Markup

    environment = Environment(
        loader=PackageLoader("gridshell.output", "templates"),
        autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    plan, result = flat_plan(archive), archive.result
    pictures = [
        (CAPTIONS[state], Markup(inline(picture_svg(archive, state))))  # our own SVG, escaped where it is made
        for state in CAPTIONS if state in archive.states
    ]  # fmt: skip
    return environment.get_template("report.html.j2").render(
        name=archive.name, note=NOTE, summary=plan.summary, verdict=verdict(archive),
        warnings=[str(word) for word in result.get("warnings") or []], dropped=result.get("dropped") or [],
        pictures=pictures, one_scale=sum(state in archive.states for state in SHELLS) > 1,
        supports=_supports(result), figures=_figures(result, plan), levels=_levels(result),
        rods=_rods(plan), plan=Markup(inline(plan_svg(plan))), case=archive.case_toml, versions=_versions(result),
    )  # fmt: skip


def _supports(result: dict[str, Any]) -> dict[str, Any] | None:
    """Both end conditions side by side: a heading and one column each, for what is known of either."""
    tables = {name: entries(result, name) for name in ("agreement", "pop_up")}
    ends = [end for end in ENDS if any(end in table for table in tables.values())]
    if not ends:
        return None
    rows: list[tuple[str, list[str]]] = []
    for title, table, key, show in (
        ("Largest gap to the target", "agreement", "max", millimetres),
        ("\N{EN DASH} over the target's size", "agreement", "max_relative", percent),
        ("Gap, root mean square", "agreement", "rms", millimetres),
        ("\N{EN DASH} over the target's size", "agreement", "rms_relative", percent),
        ("Largest gap at x, y, z", "agreement", "where", _point),
        ("Status of the gap", "agreement", "status", str),
        ("Pop-up", "pop_up", "status", str),
        ("Stable equilibrium", "pop_up", "stable", _yes),
        ("Negative modes", "pop_up", "negative_modes", str),
        ("Force residual", "pop_up", "force_residual", _newton),
        ("Degrees of freedom", "pop_up", "dofs", str),
        ("Iterations", "pop_up", "iterations", str),
        ("Factorizations", "pop_up", "factorizations", str),
        ("Time", "pop_up", "seconds", _seconds),
    ):
        values = [tables[table].get(end, {}).get(key) for end in ends]
        if any(value is not None for value in values):
            rows.append((title, ["\N{EN DASH}" if value is None else show(value) for value in values]))
    return {"ends": ends, "rows": rows}


def _figures(result: dict[str, Any], plan: FlatPlan) -> list[tuple[str, list[Row]]]:
    """Groups of key figures; a figure that is not known is left out."""
    lengths = [rod.length for rod in plan.rods]
    net, drape = result.get("net") or {}, result.get("drape") or {}
    own = drape.get("own_ends") or {}
    groups: list[tuple[str, Iterable[tuple[str, Any]]]] = [
        ("Target", _plain(result.get("target"))),
        ("Layout", _plain(result.get("layout"))),
        ("Rod", [*_plain((result.get("rod") or {}).get("section")), *_plain((result.get("rod") or {}).get("material"))]),
        ("Cut list", [
            ("rods", len(plan.rods)), ("joints", len(plan.joints)), ("all rods together", f"{sum(lengths):.2f} m"),
            ("longest rod", millimetres(max(lengths, default=None), 6)),
            ("shortest rod", millimetres(min(lengths, default=None), 6)),
        ]),
        ("Net", [
            ("estimated error of the cut", net.get("error_estimate") and millimetres(net["error_estimate"])),
            ("smallest angle between rods", _degrees(net.get("min_angle_deg"))),
            ("found at x, y, z", net.get("min_angle_at") and _point(net["min_angle_at"])),
        ]),
        ("Drape", [
            ("method", drape.get("method")), ("degrees of freedom", drape.get("dofs")),
            ("largest gap", None if drape.get("max_gap") is None else millimetres(drape["max_gap"])),
            ("largest strain", None if drape.get("max_strain") is None else f"{drape['max_strain']:.1e}"),
            ("force residual", None if drape.get("force_residual") is None else _newton(drape["force_residual"])),
            ("negative modes", drape.get("negative_modes")),
            ("smallest angle", _degrees(drape.get("min_angle_deg"))),
            ("the drape's own ends differ by", None if own.get("max") is None else
             f"{millimetres(own['max'])} at most, {millimetres(own.get('median'))} in the median"),
            ("time", None if drape.get("seconds") is None else _seconds(drape["seconds"])),
        ]),
    ]  # fmt: skip
    shown = [(title, [(key, str(value)) for key, value in rows if value is not None]) for title, rows in groups]
    return [(title, rows) for title, rows in shown if rows]


def _levels(result: dict[str, Any]) -> dict[str, Any] | None:
    """The drape's levels as a table of whatever was recorded."""
    levels = (result.get("drape") or {}).get("levels") or []
    columns = list(dict.fromkeys(key for level in levels for key in level))
    rows = [[_number(level.get(key)) for key in columns] for level in levels]
    return {"columns": [column.replace("_", " ") for column in columns], "rows": rows} if levels else None


def _rods(plan: FlatPlan) -> list[dict[str, Any]]:
    return [
        {"id": rod.id, "family": rod.family, "joints": len(rod.joints),
         "mm": [None if value is None else f"{1e3 * value + 0.0:.2f}" for value in (rod.offset, rod.start, rod.end, rod.length)]}
        for rod in plan.rods
    ]  # fmt: skip


def _plain(table: Any) -> list[tuple[str, Any]]:
    """The entries of a table of the case, lengths in mm by their names."""
    if not isinstance(table, dict):
        return []
    return [(key.replace("_", " "), _value(key, value)) for key, value in table.items() if value is not None]


UNITS = {  # factor and unit of a number of the case, by its key
    **dict.fromkeys(("radius", "height", "base", "size", "a", "b", "c", "spacing", "length", "edge", "offset",
                     "thickness", "width"), (1e3, "mm")),
    **dict.fromkeys(("EI1", "EI2", "GJ"), (1.0, "N m\N{SUPERSCRIPT TWO}")),
    "youngs_modulus": (1e-9, "GPa"), "density": (1.0, "kg/m\N{SUPERSCRIPT THREE}"), "EA": (1.0, "N"),
    "mass": (1.0, "kg/m"), "rotate": (180 / pi, "\N{DEGREE SIGN}"),
}  # fmt: skip


def _value(key: str, value: Any) -> str:
    if isinstance(value, list | tuple):
        return (", " if key == "offset" else " \N{MULTIPLICATION SIGN} ").join(_value(key, item) for item in value)
    if isinstance(value, bool) or not isinstance(value, int | float):
        return str(value)
    factor, unit = UNITS.get(key, (1.0, ""))
    if key == "youngs_modulus" and value < 1e8:
        factor, unit = 1e-6, "MPa"
    return f"{factor * value:.6g} {unit}".strip()


def _point(point: Any) -> str:
    return ", ".join(f"{1e3 * x + 0.0:.1f}".replace("-", "\N{MINUS SIGN}") for x in point) + " mm"


def _yes(value: Any) -> str:
    return "yes" if value else "no"


def _newton(value: float) -> str:
    return f"{value:.1e} N"


def _seconds(value: float) -> str:
    return f"{value:.2f} s"


def _degrees(value: float | None) -> str | None:
    return None if value is None else f"{value:.1f}\N{DEGREE SIGN}"


def _number(value: Any) -> str:
    return "\N{EN DASH}" if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def _versions(result: dict[str, Any]) -> list[Row]:
    rows = [("gridshell", result.get("version_gridshell")), ("format of the result", result.get("version"))]
    return [(key, str(value)) for key, value in rows if value is not None]
