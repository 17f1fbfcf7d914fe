"""The tables of a report: supports side by side, key figures, levels of the drape."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rodshell.output import wording
from rodshell.output.plan import FlatPlan
from rodshell.output.rounding import Rounding, rounding_of
from rodshell.output.verdict import ENDS, entries, unknown_below

Row = tuple[str, str]
Entry = tuple[str, str, Callable[[Any], str]]  # what it is called, its key, how it is shown

_AGREEMENT: tuple[Entry, ...] = (
    ("Largest gap to the target", "max", wording.millimetres),
    ("\N{EN DASH} over the target's size", "max_relative", wording.percent),
    ("\N{EN DASH} found at x, y, z", "where", wording.place),
    ("Root mean square of the gap", "rms", wording.millimetres),
    ("\N{EN DASH} over the target's size", "rms_relative", wording.percent),
    ("Status of the gap", "status", str),
)
_POP_UP: tuple[Entry, ...] = (
    ("Pop-up", "status", str),
    ("Started from", "start", str),
    ("Stable equilibrium, unloaded", "stable", wording.yes_or_no),
    ("Negative modes", "negative_modes", str),
    ("Largest strain", "max_strain", wording.small),
    ("Force residual", "force_residual", wording.newtons),
    ("Degrees of freedom", "dofs", str),
    ("Iterations", "iterations", str),
    ("Factorizations", "factorizations", str),
    ("Time", "seconds", wording.seconds),
)
_NET: tuple[Entry, ...] = (
    ("estimated error of the cuts", "error_estimate", wording.millimetres),
    ("smallest angle between rods", "min_angle_deg", wording.degrees),
    ("found at x, y, z", "min_angle_at", wording.place),
)
_DRAPE: tuple[Entry, ...] = (
    ("method", "method", str),
    ("status", "status", str),
    ("degrees of freedom", "dofs", str),
    ("largest gap", "max_gap", wording.millimetres),
    ("deepest inside the target", "max_depth", wording.millimetres),
    ("largest strain", "max_strain", wording.small),
    ("force residual", "force_residual", wording.newtons),
    ("negative modes", "negative_modes", str),
    ("smallest angle between rods", "min_angle_deg", wording.degrees),
    ("time", "seconds", wording.seconds),
)
_PRESET: tuple[Entry, ...] = (
    ("the preset's grade", "grade", str),
    ("bending strength", "bending_strength", wording.stress),
    ("shear strength", "shear_strength", wording.stress),
    ("these strengths are", "strength_note", str),
    ("source", "source", str),
)
_BENDING: tuple[Entry, ...] = (
    ("Smallest radius of curvature", "min_radius", wording.millimetres),
    ("\N{EN DASH} largest curvature out of the shell", "normal_curvature", wording.curvature),
    ("\N{EN DASH} largest curvature within the shell", "geodesic_curvature", wording.curvature),
    ("Largest twist of a rod", "twist_rate", wording.twist_rate),
    ("Largest strain, bending and axial", "max_strain", wording.percent),
    ("Largest stress, bending, axial and torsion", "max_stress", wording.stress),
    ("\N{EN DASH} of torsion alone", "torsion_stress", wording.stress),
    ("Utilisation of the strength", "utilisation", wording.percent),
    ("Sharpest at this share of the way", "share", wording.stage),
)
_REACTIONS: tuple[Entry, ...] = (
    ("Largest support force", "largest_force", wording.newtons),
    ("Largest support moment", "largest_moment", wording.newton_metres),
    ("Sum of all forces over the largest", "force_imbalance", wording.small),
    ("Sum of all moments over the largest", "moment_imbalance", wording.small),
)
_OWN_ENDS: tuple[Entry, ...] = (
    ("own cuts against the net's, at most", "max", wording.millimetres),
    ("own cuts against the net's, median", "median", wording.millimetres),
)


def _shown(show: Callable[[Any], str], value: Any, rounding: Rounding) -> str:
    """A value in words; a length no finer than the result's rounding."""
    if value is None:
        return wording.UNKNOWN
    if show is wording.millimetres:
        return wording.millimetres(value, rounding=rounding)
    return wording.place(value, rounding) if show is wording.place else show(value)


def supports_table(result: Mapping[str, Any]) -> dict[str, Any] | None:
    """Both kinds of ends side by side: `ends` and `rows` of (title, a value for each of the ends)."""
    tables = {name: entries(result, name) for name in ("agreement", "pop_up")}
    ends = [end for end in ENDS if any(end in table for table in tables.values())]
    rows, rounding = list[tuple[str, list[str]]](), rounding_of(result)
    for name, listed in (("agreement", _AGREEMENT), ("pop_up", _POP_UP)):
        for title, key, show in listed:
            values = [tables[name].get(end, {}).get(key) for end in ends]
            if any(value is not None for value in values):
                rows.append((title, [_shown(show, value, rounding) for value in values]))
        if name == "agreement":
            rows += _weight_rows(result, ends, rounding)
    return {"ends": ends, "rows": rows} if rows else None


def _weight_rows(result: Mapping[str, Any], ends: Sequence[str], rounding: Rounding) -> list[tuple[str, list[str]]]:
    """How much of its own weight the shell bears with each kind of ends."""
    found = [entries(result, "self_weight").get(end) for end in ends]
    if not any(found):
        return []
    shares = [wording.share_of_weight(one) if one else wording.UNKNOWN for one in found]
    sunk = [_shown(wording.millimetres, one.get("deflection") if one else None, rounding) for one in found]
    whose = "the weakest patch, its seam held," if result.get("patches") else "it"
    rows = [(f"Own weight that {whose} bears", shares)]
    return rows if set(sunk) == {wording.UNKNOWN} else [*rows, ("Largest deflection under its own weight", sunk)]


def checks_table(result: Mapping[str, Any]) -> dict[str, Any] | None:
    """What was checked, for each kind of ends and on the way up: `columns` and `rows` of (title, values)."""
    bent, held = result.get("bending") or {}, result.get("reactions") or {}
    unknown = unknown_below(result)
    stages = "deployment" if "deployment" in bent else "pop_up"  # the second with the final shape
    columns = [key for key in (*ENDS, stages) if key in bent and (key in ENDS or unknown < 1)]
    rows, rounding = list[tuple[str, list[str]]](), rounding_of(result)
    of = bent.get("strength_of")
    for title, key, show in _BENDING:
        values = [bent[column].get(key) for column in columns]
        if any(value is not None for value in values):
            title = f"Utilisation of {of}'s strength" if of and key == "utilisation" else title
            rows.append((title, [_shown(show, value, rounding) for value in values]))
    met = result.get("contact") or {}
    near = [(met.get("deployment" if column == stages else column) or {}).get("clearance") for column in columns]
    if any(clear is not None for clear in near):
        shown = [_shown(wording.millimetres, clear, rounding) for clear in near]
        rows.append(("Clearance of the nearest rods", shown))
    for title, key, show in _REACTIONS:
        values = [(held.get(column) or {}).get(key) for column in columns]
        if any(value is not None for value in values):
            rows.append((title, [_shown(show, value, rounding) for value in values]))
    way = f"on the way up above {wording.stage(unknown)}" if unknown else "on the way up"
    heads = [way if column == stages else column for column in columns]
    return {"columns": heads, "rows": rows} if rows else None


def key_figures(result: Mapping[str, Any], plan: FlatPlan) -> list[tuple[str, list[Row]]]:
    """Groups of key figures; what is not known is left out."""
    drape, rod = result.get("drape") or {}, result.get("rod") or {}
    parts = [rod.get("section"), rod.get("material"), rod]
    groups = [
        ("Target", wording.case_rows(result.get("target"), plan.rounding)),
        ("Layout", wording.case_rows(result.get("layout"), plan.rounding)),
        ("Cut list", _cut_list(plan)),
        (
            "Rod",
            [row for part in parts for row in wording.case_rows(part)]
            + _listed(rod.get("preset") or {}, _PRESET, plan.rounding),
        ),
        ("Net", _listed(result.get("net") or {}, _NET, plan.rounding)),
        (
            "Drape",
            _listed(_with_depth(drape), _DRAPE, plan.rounding)
            + _listed(drape.get("own_ends") or {}, _OWN_ENDS, plan.rounding),
        ),
    ]
    return [(title, rows) for title, rows in groups if rows]


def levels_table(result: Mapping[str, Any]) -> dict[str, Any] | None:
    """The drape's levels: `columns` and `rows` of whatever was recorded."""
    levels = (result.get("drape") or {}).get("levels") or []
    columns = list(dict.fromkeys(key for level in levels for key in level))
    rows = [[wording.plain(level.get(key)) for key in columns] for level in levels]
    return {"columns": [column.replace("_", " ") for column in columns], "rows": rows} if levels else None


def _listed(table: Mapping[str, Any], listed: tuple[Entry, ...], rounding: Rounding) -> list[Row]:
    return [(title, _shown(show, table[key], rounding)) for title, key, show in listed if table.get(key) is not None]


def _with_depth(drape: Mapping[str, Any]) -> dict[str, Any]:
    """What is called `max_gap` of a grid that rests on the target is how deep a node lies inside it."""
    if drape.get("method", "bound") == "bound":
        return dict(drape)
    return {**drape, "max_gap": None, "max_depth": drape.get("max_gap")}


def _cut_list(plan: FlatPlan) -> list[Row]:
    lengths = [rod.length for rod in plan.rods]
    bare = ", without allowances" if plan.allowances else ""
    return [
        ("rods", str(len(plan.rods))),
        ("joints", str(len(plan.joints))),
        (f"all rods together{bare}", f"{sum(lengths):.1f} m"),
        (f"longest rod{bare}", f"{plan.rounding.mm(max(lengths, default=None)) or wording.UNKNOWN} mm"),
        (f"shortest rod{bare}", f"{plan.rounding.mm(min(lengths, default=None)) or wording.UNKNOWN} mm"),
    ]
