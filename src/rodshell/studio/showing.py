"""What the page shows of a form that was checked: as of a preview, with verdict, reasons and all figures."""

from typing import Any

from rodshell.figures.checks import OTHER_SHAPES
from rodshell.form import Form
from rodshell.job import Job
from rodshell.output.viewer import scene_of
from rodshell.results import Archive, wording
from rodshell.results.verdict import facts as facts_of
from rodshell.results.wording import rounding_of
from rodshell.schema import written
from rodshell.studio.preview import Figures, facts


def checked(form: Form, job: Job) -> tuple[dict[str, Any], bytes]:
    """Facts and scene of a form with its checks and verdict."""
    archive = form.archive()
    scene, verdict = scene_of(archive), archive.verdict
    found = facts(form)
    found |= {
        "figures": found["figures"] + _checked(archive),
        "verdict": {"level": verdict.level, "headline": verdict.headline, "reasons": list(verdict.reasons)},
        "facts": facts_of(archive.results),
        "case": job.to_toml(),
        "resolved": _resolved(form),
    }
    return found, b"" if scene is None else scene.content()


def _resolved(form: Form) -> dict[str, Any]:
    """The case with the values that were chosen where it says "auto"."""
    tables = written(form.case)
    chosen = form.layout.parameters()
    tables["layout"] = {name: chosen.get(name, now) if now == "auto" else now for name, now in tables["layout"].items()}
    return tables


def _checked(archive: Archive) -> Figures:
    """Figures of checks, refinement and loads, by which variants are compared."""
    results, rows = archive.results, []
    for shape, bent in (results.bending.shapes() if results.bending else {}).items():
        if shape not in OTHER_SHAPES and bent.utilisation is not None:
            rows.append((f"utilisation, {shape}, unloaded", wording.percent(bent.utilisation)))
    for ends, weight in results.self_weight.items():
        rows.append((f"carries, {ends}", wording.share_of_weight(weight)))
    for ends, snow in results.snow.items():
        rows.append((f"even snow on top, {ends}", wording.snow_text(snow)))
    return rows + _refinement(archive) + _loads(archive)


def _refinement(archive: Archive) -> Figures:
    """What the refinement gained, and why a design was refused."""
    found = archive.results.refinement
    if found is None or found.before is None or found.after is None:
        return []
    before, after = (wording.percent(gap.rms_relative) for gap in (found.before, found.after))
    gain = f"{before} as before" if found.before == found.after else f"{before} before, {after} after"
    rows = [(f"refined ({', '.join(found.vary)}), gap rms", gain)]
    return rows + ([("refused", found.refused)] if found.refused else [])


def _loads(archive: Archive) -> Figures:
    """What each combination of loads does."""
    rows, rounding = [], rounding_of(archive.results)
    for name, ends, found in archive.results.loaded_shells():
        limit = wording.shown_factor(found.limit_factor)
        rows.append((f"{name}, {ends}: stable up to", f"{limit} times the loads ({found.limit_kind})"))
        at = "" if found.at_factor == 1 else f" at {wording.rounded_down(found.at_factor or 0.0)} times"
        rows.append((f"{name}, {ends}: deflection{at}", wording.millimetres(found.max_deflection, rounding=rounding)))
        if found.utilisation is not None:
            rows.append((f"{name}, {ends}: of the strength{at}", wording.percent(found.utilisation)))
    return rows
