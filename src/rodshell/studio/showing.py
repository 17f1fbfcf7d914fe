"""What the page shows of a form: a scene for the viewer, the flat plan, figures, verdict."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np

from rodshell.output.grid import rods_of
from rodshell.output.viewer import scene_of
from rodshell.results import wording
from rodshell.results.verdict import facts as facts_of
from rodshell.results.wording import rounding_of

if TYPE_CHECKING:
    from rodshell.form import Form
    from rodshell.job import Job
    from rodshell.results import Archive


def preview(form: "Form", job: "Job") -> tuple[dict[str, Any], bytes]:
    """Facts and scene of a form before anything was checked.

    Parameters
    ----------
    job : that found it.
    """
    return _shown(form, job, form.unchecked(), checked=False)


def checked_facts(form: "Form", job: "Job") -> tuple[dict[str, Any], bytes]:
    """Facts and scene of a form with its checks and verdict.

    Parameters
    ----------
    job : that found it.
    """
    return _shown(form, job, form.archive(), checked=True)


def _shown(form: "Form", job: "Job", archive: "Archive", *, checked: bool) -> tuple[dict[str, Any], bytes]:
    scene = scene_of(archive, schedules=checked)
    facts: dict[str, Any] = {
        "name": archive.name,
        "status": form.status,
        "warnings": list(form.warnings),
        "figures": _figures(archive),
        "plan": _plan(archive),
        "handles": _handles(form),
    }
    if checked:
        verdict = archive.verdict
        facts["verdict"] = {"level": verdict.level, "headline": verdict.headline, "reasons": list(verdict.reasons)}
        facts["facts"] = facts_of(archive.results)
        facts["case"] = job.to_toml()
        facts["resolved"] = form.case.model_dump(mode="json", exclude_none=True)
    return facts, b"" if scene is None else scene.content()


def _figures(archive: "Archive") -> list[tuple[str, str]]:
    """Figures to compare variants by, in words."""
    results, rounding = archive.results, rounding_of(archive.results)
    lengths = [rod.length for rod in rods_of(archive)]
    rows = [("rods", str(len(lengths))), ("all rods together", f"{sum(lengths):.4g} m")]
    if lengths:
        rows.append(("longest rod", wording.millimetres(max(lengths), 5, rounding)))
    if results.net and results.net.min_angle_deg is not None:
        rows.append(("smallest angle between rods", wording.degrees(results.net.min_angle_deg)))
    for ends, gap in results.agreement.items():
        largest, relative = wording.millimetres(gap.max, rounding=rounding), wording.percent(gap.max_relative)
        rows.append((f"largest gap, {ends}", f"{largest} ({relative} of the size)"))
    for shape, bent in (results.bending.shapes() if results.bending else {}).items():
        if shape in ("pinned", "clamped") and bent.utilisation is not None:
            rows.append((f"utilisation, {shape}, unloaded", wording.percent(bent.utilisation)))
    for ends, weight in results.self_weight.items():
        rows.append((f"carries, {ends}", wording.share_of_weight(weight)))
    return rows + _refinement(archive) + _loads(archive)


def _refinement(archive: "Archive") -> list[tuple[str, str]]:
    """What the refinement gained, and why a design was refused."""
    found = archive.results.refinement
    if found is None or found.before is None or found.after is None:
        return []
    before, after = (wording.percent(gap.rms_relative) for gap in (found.before, found.after))
    gain = f"{before} as before" if found.before == found.after else f"{before} before, {after} after"
    rows = [(f"refined ({', '.join(found.vary)}), gap rms", gain)]
    return rows + ([("refused", found.refused)] if found.refused else [])


def _loads(archive: "Archive") -> list[tuple[str, str]]:
    """What each combination of loads does."""
    rows, rounding = [], rounding_of(archive.results)
    for name, by_ends in archive.results.loads.items():
        for ends, found in by_ends.items():
            limit = "over 100" if found.limit_factor is None else wording.rounded(found.limit_factor)
            rows.append((f"{name}, {ends}: stable up to", f"{limit} times the loads ({found.limit_kind})"))
            at = "" if found.at_factor == 1 else f" at {wording.rounded(found.at_factor or 0.0)} times"
            rows.append(
                (f"{name}, {ends}: deflection{at}", wording.millimetres(found.max_deflection, rounding=rounding))
            )
            if found.utilisation is not None:
                rows.append((f"{name}, {ends}: of the strength{at}", wording.percent(found.utilisation)))
    return rows


def _plan(archive: "Archive") -> list[dict[str, Any]]:
    """The flat grid: rods by name with both ends and the length [m]."""
    return [
        {"id": rod.id, "family": rod.family, "ends": rod.flat.ravel().tolist(), "length": rod.cut_length}
        for rod in rods_of(archive)
    ]


def _handles(form: "Form") -> Mapping[str, Any] | None:
    """Where the handles of anchor and heading stand; None for a form in patches, or of a table."""
    if form.from_table or form.seams:
        return None
    anchor = form.case.drape.anchor or form.target.summit
    place = form.target.lift(np.array([anchor], dtype=float))[0]
    return {"anchor": place.tolist(), "heading": form.layout.rotate, "size": form.target.size}
