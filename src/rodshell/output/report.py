"""The report: one self-contained page, with a 3D view of the shapes from flat to popped.

Each frame of the view is a shape that was computed, as small as a picture needs it; the view steps from frame to frame
and draws nothing between them.
"""

import base64
from collections.abc import Callable, Iterator, Sequence
from typing import Any

import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from rodshell.figures.checks import OTHER_SHAPES, Clearance, Reactions, SelfWeight
from rodshell.figures.fabrication import Stock
from rodshell.figures.form import Agreement, Drape, Gate, PopUp
from rodshell.figures.records import Ends, Record
from rodshell.output.drawings import drawing_set, drawing_svgs
from rodshell.output.drawings.flat import FlatPlan, flat_plan
from rodshell.output.drawings.sheets import NOT_GIVEN, NOTE, TRUE_SIZE, title_block
from rodshell.output.grid import caption_of, shape_names
from rodshell.output.loads_page import loads_page
from rodshell.output.pictures import picture_svg
from rodshell.output.schedules import SCHEDULES, Table, heading
from rodshell.output.section_profiles import profiles_svg
from rodshell.output.svg import SCALE, inline
from rodshell.output.viewer import scene_of, viewer_script, viewer_style
from rodshell.results import Archive, Results, wording
from rodshell.results.archive import shown_case
from rodshell.results.facts import facts, mass_text
from rodshell.results.judged.deployment import unknown_below
from rodshell.results.judged.stress import by_design_strength
from rodshell.results.laths import laths_text
from rodshell.results.offers import ADVICE, advice_rows
from rodshell.results.states import is_shell, shells_among
from rodshell.results.wording import Rounding, percent, rounding_of, whole_percent
from rodshell.rods.supports import finals_first
from rodshell.units import places_text

IN_PAGE = ("supports", "elevations", "erection")
FOLLOWED = "Every stage of the deployment is an equilibrium of the elastic grid with pinned ends{gaps}."
PARTLY = (
    "Below {share} of the deployment no stage could be found, and the shape is not known. Above it, every stage is an "
    "equilibrium of the elastic grid with pinned ends{gaps}."
)
SNAPS = "; {where} of the deployment the shell snaps forward"
GUIDED = "; between {start} and {stop} of the deployment it has to be guided, and its shape is not known"
NOT_FOLLOWED = "The deployment from flat was not followed: the shapes in between are not known."


def report_html(archive: Archive) -> str:
    """The whole page."""
    environment = Environment(
        loader=PackageLoader("rodshell.output", "templates"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )

    def shown(svg: str) -> Markup:
        return Markup(inline(svg))  # the SVG is ours, its texts are escaped where it is made

    results, plan, drawings, files = archive.results, flat_plan(archive), drawing_set(archive), drawing_svgs(archive)
    shown_as = ("flat", *shells_among(archive.states))
    states = [name for name in shape_names(archive) if name in shown_as and "rod_nodes" in archive.states]
    return environment.get_template("report.html.j2").render(
        name=archive.name,
        note=NOTE,
        size=size_text(archive),
        summary=plan.summary,
        verdict=archive.verdict,
        advice_head=ADVICE,
        advice=advice_rows(results, archive.verdict),
        facts=facts(results),
        dropped=results.dropped,
        view=_view(archive),
        refinement=refinement_table(results),
        profiles=None if (picture := profiles_svg(results.rods)) is None else Markup(picture),
        supports=supports_table(results),
        checks=checks_table(results),
        pictures=[(caption_of(archive, state), shown(picture_svg(archive, state))) for state in states],
        one_scale=sum(map(is_shell, states)) > 1,
        loads=loads_page(archive),
        figures=key_figures(results, plan),
        solved=solved_table(results),
        levels=levels_table(results),
        plan=shown(_on_page(files["plan"])) if "plan" in files else "",
        drawings=[(drawings[name].title, shown(_on_page(files[name]))) for name in IN_PAGE if name in drawings],
        tables=[
            (title, [heading(column) for column in table], zip(*table.values(), strict=True), note)
            for title, table, note in _tables(archive)
        ],
        case=shown_case(archive.case_toml, archive.inputs),
        version=results.version_rodshell or "unknown",
        versions=", ".join(f"{name} {number}" for name, number in (results.versions or {}).items()),
        format_version=results.version,
    )


def size_text(archive: Archive) -> str:
    """The final shell in one line: its plan and rise, what rods and joints weigh, section and supports."""
    known, words = dict(title_block(archive, "").entries), list[str]()
    if archive.final is not None:
        across, along, height = (wording.rounded(size, 3) for size in np.ptp(archive.states[archive.final], axis=0))
        words.append(f"{across} x {along} m in plan, rise {height} m")
    words += [mass] if (mass := mass_text(archive.results)) else []
    words += [known["Section"]] if known["Section"] != NOT_GIVEN else []
    return ", ".join([*words, known["Supports"]])


def _on_page(svg: str) -> str:
    """A drawing's file for a page, which shows it in any size: its titles claim no scale, only its bar is right."""
    return svg.replace(f"{TRUE_SIZE}</text>", "</text>").replace(f", {SCALE}</title>", ", lengths in mm</title>")


def _view(archive: Archive) -> dict[str, Any] | None:
    """The scene, and the viewer's script and style."""
    scene = scene_of(archive)
    if scene is None:
        return None
    return {
        "scene": base64.b64encode(scene.content()).decode(),
        "script": Markup(viewer_script()),
        "style": Markup(viewer_style()),
        "note": _note(archive),
    }


def _note(archive: Archive) -> str:
    """What the stages of the view are."""
    deployment, unknown = archive.results.deployment, unknown_below(archive.results)
    if deployment is None or "history" not in archive.states or unknown >= 1:
        return NOT_FOLLOWED
    gaps = ""
    if deployment.snaps:
        gaps += SNAPS.format(where=places_text([start for start, _ in deployment.snaps]))
    if deployment.guided:
        start, stop = deployment.guided
        gaps += GUIDED.format(start=whole_percent(start), stop=whole_percent(stop))
    return (PARTLY if unknown else FOLLOWED).format(share=whole_percent(unknown), gaps=gaps)


def _tables(archive: Archive) -> Iterator[tuple[str, Table, str]]:
    """Title, table and note of the schedules in the page."""
    fabrication = archive.results.fabrication
    notes = {
        "rods": "Where each joint is on its rods: schedule/rods.csv, joints.csv.",
        "joints": "Named by the rods that meet, a/b. Final: in the popped-up shell.",
        "supports": "With the reactions of the unloaded shell: schedule/supports.csv.",
        "seams": "Forces: the sum of both rods' support forces.",
        "splices": "In the final shape; what loads add is not in it. The type of splice has to be given.",
        "stock": _plan_of(fabrication.stock) if fabrication and fabrication.stock else "",
    }
    for name, note in notes.items():
        table = SCHEDULES[name].brief(archive)
        if any(table.values()):
            yield SCHEDULES[name].title, table, note


def _plan_of(stock: Stock) -> str:
    """How good a cutting list is."""
    return (
        f"{len(stock.bars)} bars, {percent(stock.waste)} waste, saw cuts included; however these pieces are cut, they "
        f"take {stock.fewest} bars at least. Bars with the same pieces are in one row; each piece is marked rod.number."
    )


# Key figures and tables

Row = tuple[str, str]
Entry = tuple[str, str, Callable[[Any], str]]  # what it is called, the field of the record, how it is shown
Columns = list[tuple[str, list[str]]]  # a title, and a value for each column

_AGREEMENT: tuple[Entry, ...] = (
    ("Largest gap to the target", "max", wording.millimetres),
    ("\N{EN DASH} over the target's size", "max_relative", wording.percent),
    ("\N{EN DASH} found at x, y, z", "where", wording.place),
    ("Root mean square of the gap", "rms", wording.millimetres),
    ("\N{EN DASH} over the target's size", "rms_relative", wording.percent),
)
_POP_UP: tuple[Entry, ...] = (
    ("Pop-up", "status", str),
    ("Started from", "start", str),
    ("Stable equilibrium, unloaded", "stable", wording.yes_or_no),
    ("Negative modes", "negative_modes", str),
    ("Largest strain", "max_strain", wording.small),
)
_SOLVED: tuple[Entry, ...] = (
    ("Degrees of freedom", "dofs", str),
    ("Iterations", "iterations", str),
    ("Factorisations", "factorizations", str),
    ("Force residual", "force_residual", wording.newtons),
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
    ("largest gap", "max_gap", wording.millimetres),
    ("largest strain", "max_strain", wording.small),
    ("negative modes", "negative_modes", str),
    ("smallest angle between rods", "min_angle_deg", wording.degrees),
)
_PRESET: tuple[Entry, ...] = (
    ("the preset's grade", "grade", str),
    ("bending strength", "bending_strength", wording.stress),
    ("shear strength", "shear_strength", wording.stress),
    ("these strengths are", "strength_note", str),
    ("source", "source", str),
)
_DESIGN_STRENGTH: tuple[Entry, ...] = (
    ("design strength, permanent", "permanent", wording.stress),
    ("design strength, erection", "erection", wording.stress),
    ("design strengths are of", "source", str),
)
UTILISATION = "Utilisation of the strength"
_BENDING: tuple[Entry, ...] = (
    ("Smallest radius of curvature", "min_radius", wording.millimetres),
    ("\N{EN DASH} largest curvature out of the shell", "normal_curvature", wording.curvature),
    ("\N{EN DASH} largest curvature within the shell", "geodesic_curvature", wording.curvature),
    ("Largest twist of a rod", "twist_rate", wording.twist_rate),
    ("Largest strain, bending and axial", "max_strain", wording.percent),
    ("Largest stress, unloaded: bending, axial and torsion", "max_stress", wording.stress),
    ("\N{EN DASH} of torsion alone", "torsion_stress", wording.stress),
    (UTILISATION, "utilisation", wording.percent),
    ("Sharpest at this share of the deployment", "share", wording.whole_percent),
)
_REACTIONS: tuple[Entry, ...] = (
    ("Largest support force, unloaded", "largest_force", wording.newtons),
    ("Largest support moment, unloaded", "largest_moment", wording.newton_metres),
    ("Sum of all forces over the largest", "force_imbalance", wording.small),
    ("Sum of all moments over the largest", "moment_imbalance", wording.small),
)
_CLEARANCE: tuple[Entry, ...] = (("Clearance of the nearest rods", "clearance", wording.millimetres),)
_DEVIATION: tuple[Entry, ...] = (
    ("smooth surface against the mesh: max", "max", wording.millimetres),
    ("smooth surface against the mesh: rms", "rms", wording.millimetres),
)
_NET_DEVIATION: tuple[Entry, ...] = (
    ("drape against net, rod ends: max", "max", wording.millimetres),
    ("drape against net, rod ends: median", "median", wording.millimetres),
)


def supports_table(results: Results) -> dict[str, Any] | None:
    """Both end conditions side by side: `ends` and `rows` of (title, a value for each of the ends)."""
    ends = finals_first({**results.pop_up, **results.agreement})
    rounding = rounding_of(results)
    gaps = [results.agreement.get(end) or Agreement() for end in ends]
    rows = _side_by_side(_AGREEMENT, gaps, rounding)
    rows += _weight_rows(results, ends, rounding)
    rows += _side_by_side(_POP_UP, [results.pop_up.get(end) or PopUp() for end in ends], rounding)
    return {"ends": ends, "rows": rows} if rows else None


GATE_WORDS: dict[Gate, str] = {
    "flat": "the rods fit together in a plane",
    "from_flat": "pushed up from flat it comes to this shape",
    "remeshed": "meshed again it is as near to the target",
    "tolerance": "built with errors it stays stable and nearly as near",
    "stable": "it is a stable equilibrium",
}


def refinement_table(results: Results) -> dict[str, Any] | None:
    """What the refinement gained: `rows` of (title, before and after), `gates` of (what, yes or no), and `said`."""
    found = results.refinement
    if found is None or found.before is None or found.after is None:
        return None
    both = (found.before, found.after)
    entries = (
        ("Root mean square of the gap, over the target's size", "rms_relative", wording.percent),
        ("Largest gap, over the target's size", "max_relative", wording.percent),
    )
    said = f"Varied: {', '.join(found.vary)}; {found.ends} ends."
    if found.refused:
        said += f" The best design was refused, {found.refused}."
    gates = [(GATE_WORDS[gate], wording.yes_or_no(passed)) for gate, passed in (found.gates or {}).items()]
    return {"rows": _side_by_side(entries, both, rounding_of(results)), "gates": gates, "said": said}


def checks_table(results: Results) -> dict[str, Any] | None:
    """What was checked, by end condition and in the deployment: `columns` and `rows` of (title, values)."""
    shapes = results.bending.shapes() if results.bending else {}
    unknown, rounding = unknown_below(results), rounding_of(results)
    stages = "deployment" if "deployment" in shapes else "pop_up"  # the second with the final shape
    columns = finals_first(shape for shape in shapes if shape not in OTHER_SHAPES)
    columns += [stages] * (stages in shapes and unknown < 1)
    rows = _side_by_side(_BENDING, [shapes[column] for column in columns], rounding)
    rows = [row for title, values in rows for row in _with_strength(results, columns, title, values)]
    met = results.contact
    near = [met.of("deployment" if column == stages else column) for column in columns] if met else []
    rows += _side_by_side(_CLEARANCE, [found or Clearance() for found in near], rounding)
    held = [results.reactions.get(column) or Reactions() for column in columns]
    rows += _side_by_side(_REACTIONS, held, rounding)
    for name in dict.fromkeys(name for each in held for name in each.figures):
        said = [wording.figure(*each.figures.get(name, (None, "")), rounding) for each in held]
        rows.append((name[:1].upper() + name[1:], said))
    deployment = f"deployment above {whole_percent(unknown)}" if unknown else "deployment"
    heads = [deployment if column == stages else column for column in columns]
    return {"columns": heads, "rows": rows} if rows else None


def _with_strength(results: Results, columns: Sequence[str], title: str, values: list[str]) -> Columns:
    """A row of the checks; that of the utilisation with the strengths by which it is counted."""
    bending = results.bending
    if title != UTILISATION or bending is None:
        return [(title, values)]
    design = "design " if by_design_strength(results) else ""
    whose = f"{bending.strength_of}'s {design}strength" if bending.strength_of else f"the given {design}strength"
    strengths = [bending.erection_strength if column in OTHER_SHAPES else bending.strength for column in columns]
    shown = [_shown(wording.stress, strength, rounding_of(results)) for strength in strengths]
    return [(title.replace("the strength", whose), values), ("\N{EN DASH} which is", shown)]


def key_figures(results: Results, plan: FlatPlan) -> list[tuple[str, list[Row]]]:
    """Groups of key figures; what is not known is left out."""
    rod, drape = results.rod, results.drape
    parts: list[Record | None] = [rod.material, rod] if rod else []
    section = [("section", wording.section_text(rod.section))] if rod and rod.section else []
    preset = _listed(rod.preset if rod else None, _PRESET, plan.rounding)
    if by_design_strength(results):
        preset += _listed(results.strength, _DESIGN_STRENGTH, plan.rounding)
    deviation = _listed(drape.net_deviation if drape else None, _NET_DEVIATION, plan.rounding)
    mesh = _listed(results.target.deviation if results.target else None, _DEVIATION, plan.rounding)
    groups = [
        ("Target", wording.case_rows(results.target, plan.rounding) + mesh),
        ("Layout", wording.case_rows(results.layout, plan.rounding)),
        ("Cut list", _cut_list(plan, results)),
        ("Rod", section + [row for part in parts for row in wording.case_rows(part)] + preset),
        ("Net", _listed(results.net, _NET, plan.rounding)),
        ("Drape", _drape_rows(drape, plan.rounding) + deviation),
    ]
    return [(title, rows) for title, rows in groups if rows]


def solved_table(results: Results) -> dict[str, Any] | None:
    """What the equations of the drape and of each pop-up took: `columns` and `rows` of (title, values), and `said`."""
    ends = finals_first(results.pop_up)
    records = [results.drape or Drape(), *(results.pop_up[end] for end in ends)]
    rows, found = _side_by_side(_SOLVED, records, rounding_of(results)), results.refinement
    said = (
        found and f"Refinement: {found.factorizations} factorisations, and {found.gate_factorizations} for the gates."
    )
    columns = ["drape", *(f"pop-up, {end}" for end in ends)]
    return {"columns": columns, "rows": rows, "said": said} if rows else None


def levels_table(results: Results) -> dict[str, Any] | None:
    """The drape's levels: `columns` and `rows` of whatever was recorded."""
    levels = [level.plain() for level in results.drape.levels] if results.drape else []
    columns = list(dict.fromkeys(name for level in levels for name in level))
    rows = [[wording.plain(level.get(name)) for name in columns] for level in levels]
    return {"columns": [column.replace("_", " ") for column in columns], "rows": rows} if levels else None


def _shown(show: Callable[[Any], str], value: Any, rounding: Rounding) -> str:
    """A value in words; a length no finer than the result's rounding."""
    if value is None:
        return wording.UNKNOWN
    if show is wording.millimetres:
        return wording.millimetres(value, rounding=rounding)
    return wording.place(value, rounding) if show is wording.place else show(value)


def _side_by_side(listed: tuple[Entry, ...], records: Sequence[Record], rounding: Rounding) -> Columns:
    """A row for each figure that is known of at least one record."""
    rows = Columns()
    for title, name, show in listed:
        values = [getattr(record, name, None) for record in records]
        if any(value is not None for value in values):
            rows.append((title, [_shown(show, value, rounding) for value in values]))
    return rows


def _weight_rows(results: Results, ends: Sequence[Ends], rounding: Rounding) -> Columns:
    """How much of its own weight the shell carries with each end condition."""
    found = [results.self_weight.get(end) for end in ends]
    if not any(found):
        return []
    shares = [wording.share_of_weight(weight) if weight else wording.UNKNOWN for weight in found]
    whose = "the weakest patch, its seam held," if results.patches else "it"
    deflection = (("Largest deflection under its own weight", "deflection", wording.millimetres),)
    weights = [weight or SelfWeight() for weight in found]
    rows = [(f"Own weight that {whose} carries", shares), *_side_by_side(deflection, weights, rounding)]
    if results.snow:
        snow = [wording.snow_text(results.snow[end]) if end in results.snow else wording.UNKNOWN for end in ends]
        rows.append(("Even snow on the plan that it carries on top, unbraced", snow))
    return rows


def _listed(record: Record | None, listed: tuple[Entry, ...], rounding: Rounding) -> list[Row]:
    """The figures of a record that are known."""
    rows = _side_by_side(listed, [record], rounding) if record else []
    return [(title, value) for title, (value,) in rows]


def _drape_rows(drape: Drape | None, rounding: Rounding) -> list[Row]:
    """Figures of the drape; `max_gap` of a grid that rests on the target is how deep a node lies inside it."""
    rests = drape is not None and drape.method not in (None, "bound")
    words = {"largest gap": "deepest inside the target"} if rests else {}
    return [(words.get(title, title), value) for title, value in _listed(drape, _DRAPE, rounding)]


def _cut_list(plan: FlatPlan, results: Results) -> list[Row]:
    lengths = [rod.length for rod in plan.rods]
    bare = ", without allowances" if plan.allowances else ""
    return [
        ("rods", str(len(plan.rods))),
        ("joints", str(len(plan.joints))),
        (f"all rods together{bare}", f"{sum(lengths):.1f} m"),
        *((("all laths on them together", laths),) if (laths := laths_text(results)) else ()),
        (f"longest rod{bare}", f"{plan.rounding.mm(max(lengths, default=None)) or wording.UNKNOWN} mm"),
        (f"shortest rod{bare}", f"{plan.rounding.mm(min(lengths, default=None)) or wording.UNKNOWN} mm"),
    ]
