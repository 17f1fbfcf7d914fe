"""What the page shows of a form: while it is being found, made from its stages without the records of a result, so that
an update while somebody drags costs little more than net and drape; once it was checked, with verdict and reasons."""

from collections.abc import Mapping
from functools import partial
from math import degrees
from typing import Any

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints, largest_at
from rodshell.figures.checks import OTHER_SHAPES
from rodshell.form import Form
from rodshell.job import Job
from rodshell.layout import GridMesh
from rodshell.output.colour_scale import Colour, gap_scale
from rodshell.output.grid import CAPTIONS, Shape, supported
from rodshell.output.sections import section_outline
from rodshell.output.viewer.scene import Coloured, Drawn, scene_of
from rodshell.results import Archive, wording
from rodshell.results.facts import facts as facts_of
from rodshell.results.facts import mass_text
from rodshell.results.from_form import rod_type
from rodshell.schema import written
from rodshell.targets import Target
from rodshell.targets.surface_mesh import surface_mesh

Figures = list[tuple[str, str]]
Surface = tuple[NDArray[np.float32], Ints]  # points [m] and triangles


class Preview:
    """Shows forms one after the other; the triangles of a target are kept while shells lie on the same part of it."""

    def __init__(self) -> None:
        self._kept: tuple[Target, Surface] | None = None

    def of(self, form: Form) -> tuple[dict[str, Any], bytes]:
        """Facts and scene of a form on a target, with or without popped-up shells."""
        return facts(form), self._scene(form)

    def _scene(self, form: Form) -> bytes:
        mesh, draped, target = form.footprint.mesh, form.boundary.draped, form.target
        if draped is None:
            return b""
        gaps = target.gap(draped).distance - mesh.heights
        worst = largest_at(np.abs(gaps))
        where, largest = {"draped": draped[worst]}, {"draped": abs(float(gaps[worst]))}
        shapes = [Shape("draped", CAPTIONS["draped"], draped, gaps), Shape("flat", CAPTIONS["flat"], mesh.flat)]
        for ends, shell in form.popped.items():
            name, found = f"popped_{ends}", form.agreement.get(ends)
            shapes.append(
                Shape(name, f"Popped up, {supported(name)}", shell.positions, None if found is None else found.gaps)
            )
            if found is not None:
                where[name], largest[name] = np.array(found.where), found.max
        rounding, top = rounding_of(form), 1e3 * max(largest.values())

        def colours(shape: Shape) -> dict[Colour, Coloured]:
            if shape.gap is None:
                return {}
            words = wording.millimetres(largest[shape.name], rounding=rounding)
            return {"gap": Coloured(gap_scale(shape.gap[mesh.rod_nodes], top), where[shape.name], words)}

        drawn = Drawn(
            form.case.drawings.name or target.name,
            [(rod.name, rod.family) for rod in mesh.grid.rods],
            mesh.rod_nodes,
            mesh.rod_stop - mesh.rod_start,
            *_joints(mesh),
            [(shape, colours(shape)) for shape in shapes],
            partial(section_outline, rod_type(form.rod).section),
            self._surface_of(target, draped),
        )
        return drawn.scene().content()

    def _surface_of(self, target: Target, draped: Floats) -> Surface:
        if self._kept is None or target is not self._kept[0]:
            points, faces = surface_mesh(target, draped)
            self._kept = target, (points.astype(np.float32), faces)
        return self._kept[1]


def facts(form: Form) -> dict[str, Any]:
    """What the page says of a form, checked or not."""
    return {
        "name": form.case.drawings.name or form.target.name,
        "status": form.status,
        "warnings": list(form.warnings),
        "figures": figures(form),
        "plan": plan(form),
        "handles": handles(form),
    }


def figures(form: Form) -> Figures:
    """Figures of a form in words, by their names."""
    found, rounding = [rod.length for rod in form.footprint.rods], rounding_of(form)
    angles = [part.draped.figures.min_angle for part in form.stages.parts]
    rows = [("rods", str(len(found)))]
    if found:
        rows.append(("all rods together", wording.millimetres(sum(found), 4, rounding)))
        rows.append(("longest rod", wording.millimetres(max(found), 5, rounding)))
    rod = rod_type(form.rod)
    rows.append(("section", wording.section_text(rod.section)))
    if rod.preset and rod.preset.name:
        rows.append(("material", rod.preset.name))
    if angles:
        rows.append(("smallest angle between rods", wording.degrees(degrees(min(angles)))))
    for ends, gap in form.agreement.items():
        largest = wording.millimetres(gap.max, rounding=rounding)
        rows.append((f"largest gap, {ends}", f"{largest} ({wording.percent(gap.max_relative)} of the size)"))
    return rows


def rounding_of(form: Form) -> wording.Rounding:
    """How finely lengths of a form are shown."""
    longest = max((rod.length for rod in form.footprint.rods), default=0.0)
    return wording.rounding_to(form.options.drawings.tolerance, longest)


def plan(form: Form) -> list[dict[str, Any]]:
    """The flat grid: rods by name with both ends (x, y) and the cut length [m]; empty if the rods do not lie flat."""
    if (flat := form.flat_state) is not None and not flat.lies_flat:
        return []
    mesh, allowance = form.footprint.mesh, form.options.fabrication.end_allowance
    ends = mesh.flat[mesh.ends.ravel(), :2].reshape(-1, 4).tolist()
    return [
        {"id": rod.name, "family": rod.family, "ends": both, "length": rod.length + 2 * allowance}
        for rod, both in zip(mesh.grid.rods, ends, strict=True)
    ]


def handles(form: Form) -> Mapping[str, Any] | None:
    """Where the handles of anchor, heading and base plane stand; None for a form in patches."""
    if form.seams:
        return None
    anchor = form.case.drape.anchor or form.target.summit
    place = form.target.lift(np.array([anchor], dtype=float))[0]
    found = {"anchor": place.tolist(), "heading": form.layout.rotate, "size": form.target.size}
    if hasattr(form.case.target, "base"):  # its plane can be moved
        ends = form.boundary.points
        found["base"] = ends[int(ends[:, 0].argmax())].tolist()
    return found


def _joints(mesh: GridMesh) -> tuple[list[str], Ints]:
    """Ids of all joints, and the entry of `rod_nodes` (c, 2) of each on either rod; the first rod is named first."""
    rods, entries = mesh.grid.crossings.rods, mesh.at_crossings
    names = [rod.name for rod in mesh.grid.rods]
    second = rods[:, 0] > rods[:, 1]
    rods, entries = (np.where(second[:, None], pairs[:, ::-1], pairs) for pairs in (rods, entries))
    return [f"{names[a]}/{names[b]}" for a, b in rods.tolist()], entries


# With checks and verdict


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
    results = archive.results
    rows = [("mass", mass)] if (mass := mass_text(results)) else []
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
    rows, rounding = [], wording.rounding_of(archive.results)
    for name, ends, found in archive.results.loaded_shells():
        limit = wording.shown_factor(found.limit_factor)
        rows.append((f"{name}, {ends}: stable up to", f"{limit} times the loads ({found.limit_kind})"))
        at = "" if found.at_factor == 1 else f" at {wording.rounded_down(found.at_factor or 0.0)} times"
        rows.append((f"{name}, {ends}: deflection{at}", wording.millimetres(found.max_deflection, rounding=rounding)))
        if found.utilisation is not None:
            rows.append((f"{name}, {ends}: of the strength{at}", wording.percent(found.utilisation)))
    return rows
