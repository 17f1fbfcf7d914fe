"""What the gates of refinement let pass: over-fitted designs, those of the genetic algorithm, and shells of every kind.

Accepted designs are held to the gates once more by other code: the deployment of the checks, and a mesh and errors made
here.
"""

import sys
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from unittest.mock import patch

import numpy as np

import rodshell as rs
from rodshell.checks.deployment import Deployment, deploy
from rodshell.formfinding import Stages, agreement, pop_up
from rodshell.formfinding.popup import Ends
from rodshell.formfinding.trim import Footprint
from rodshell.layout import GridMesh, mesh_grid
from rodshell.model import Shell
from rodshell.paper.genetic_records import stored
from rodshell.paper.genetic_search import Design
from rodshell.refining import gauss_newton, variables
from rodshell.refining.acceptance import Refined, refined
from rodshell.refining.gates import gates
from rodshell.refining.objectives import Gap
from rodshell.refining.refine import FAMILIES, refine
from rodshell.refining.stiffness_families import Taper
from rodshell.refining.variables import Family
from rodshell.rods.section import GivenSection
from rodshell.solve.equilibrium import find_stable
from rodshell.solve.problem import Problem
from tests.acceptance.refine_designs import stages_of
from tests.acceptance.rows import Row

sys.path.append(str(Path(__file__).parents[2] / "examples"))
import gallery

SAMPLES = 3
LEFT_OUT = ("freeform, 3dm", "ridge")  # the same surface as another, and one of the bumpy kind


def rows() -> Iterator[Row]:
    yield from over_fitted()
    yield from with_all_gates()
    for shell in ("hemisphere", "paraboloid", "ellipsoid"):
        yield from against_genetic(shell)
    for name, piece in gallery.gallery().items():
        if name not in LEFT_OUT:
            form = piece.form()
            yield from rows_of(f"gallery: {name}", form.stages)
    for name, changes in OTHERS.items():
        form = rs.Job.load("hemisphere", {"pop_up.ends": "pinned", "layout.edge": 0.01, **changes}).run(until="pop-up")
        yield from rows_of(name, form.stages)


OTHERS: dict[str, dict[str, object]] = {
    "laths with pins": {
        "joint.kind": "pin", "rod.section.kind": "rectangle", "rod.section.width": 0.002, "rod.section.height": 0.004,
    },
    "two layers": {"joint.kind": "pin", "joint.eccentricity": 0.002},
    "two patches": {"seams.lines": "-1,0.05; 1,0.05"},
}  # fmt: skip


def over_fitted() -> Iterator[Row]:
    """Designs that are near their targets because their rods are compressed, or cannot be laid flat."""
    stages = stages_of("hemisphere", "pinned", 0.015)
    with patch.object(variables, "symmetries", lambda *_: ()), patch.object(gauss_newton, "ENOUGH", 1e-3):
        tails = refine(stages, "tails", objectives=[Gap()], least_eigenvalue=0.0, most_evaluations=150)
    judged = gates(tails.after)
    gap = f"gap {100 * tails.gap_after.rms_relative:.3f} %; {judged.reason}"
    yield Row("hemisphere: tails, no penalty or symmetry", "accepted", float(judged.open), 0, note=gap)
    holes = refined(stages, [FAMILIES["holes"]])
    yield Row("hemisphere: holes alone", "accepted", float(holes.changed), 0, note=holes.refused)


def with_all_gates() -> Iterator[Row]:
    """Two designs of many variables, whose figures without gates are in `refine_designs`: what of them can be built.

    Errors of 0.05 % of the size in every span spoil a shallow shell whatever its rods, so that the gate of tolerance
    keeps the second one from its figure. Built five times as exactly it reaches it.
    """
    cases: tuple[tuple[str, Ends, list[Family], float, float | None], ...] = (
        ("two bumps", "clamped", [FAMILIES["clamps"], Taper(per="rod", stations=3)], 0.06, None),
        ("freeform.obj", "pinned", [Taper(ratio=4.0, per="rod")], 0.016, None),
        ("freeform.obj", "pinned", [Taper(ratio=4.0, per="rod")], 0.016, 1e-4),
    )
    for shell, ends, vary, most, error in cases:
        stages = stages_of(shell, ends, 0.015)
        found = refined(stages, vary, ends=ends, span_error=None if error is None else error * stages.target.size)
        name = f"{shell}, {ends}: taper a rod, all gates{'' if error is None else f', spans to {100 * error:g} %'}"
        before, gap = (100 * agreement.rms_relative for agreement in (found.gap_before, found.gap_after))
        note = f"without gates {most} % is asked; {found.words}"
        yield Row(name, "gap rms over the size", gap, before if error is None else most, "%", note)
        yield Row(name, "neither nearer nor told why", float(gap >= before and not found.refused), 0)


def against_genetic(shell: str) -> Iterator[Row]:
    """The best design of thousands of pop-ups, through the gates; and refinement with the same variables."""
    stages, history = stages_of(shell, "pinned", 0.005), stored(shell)[0]
    design = Design.of(stages)
    popped = design.pop_up(history.variables)
    assert popped is not None
    best = agreement(popped, stages.target)
    form = replace(
        stages, footprint=popped.footprint, boundary=design.boundary, popped={"pinned": popped},
        agreement={"pinned": best}, ends=("pinned",),
    )  # fmt: skip
    judged = gates(form)
    name, passes = f"{shell}: tails, genetic", ", ".join(gate for gate, passed in judged.passed.items() if passed)
    note = f"gap {100 * best.rms_relative:.3f} %; passes {passes}; {judged.reason}"
    yield Row(name, "gates refuse it", 1.0 - judged.open, 1, note=note)
    found = refined(stages, [FAMILIES["tails"]])
    note = f"{100 * found.gap_after.rms_relative:.3f} % for {100 * best.rms_relative:.3f} %; {found.words}"
    if shell != "ellipsoid":
        most = 1.15 if shell == "hemisphere" else 1.0
        yield Row(f"{shell}: tails, refined", "gap over genetic", found.gap_after.rms / best.rms, most, note=note)
    yield Row(f"{shell}: tails, refined", "not accepted", float(not found.changed), 0)
    share = (found.factorizations + found.gate_factorizations) / 3 / history.runs  # at least 3 each pop-up
    yield Row(f"{shell}: tails, refined", "pop-ups over genetic", share, 0.01, note=f"{history.runs} pop-ups")


def rows_of(name: str, stages: Stages) -> Iterator[Row]:
    """A taper for all rods: the shell is nearer, or it is said why not; what is accepted passes other checks, too."""
    found = refined(stages, [FAMILIES["taper"]], ends="pinned")
    before, after = found.gap_before.rms_relative, found.gap_after.rms_relative
    told = after < before or bool(found.refused)
    yield Row(f"{name}: taper", "neither nearer nor told why not", float(not told), 0, note=found.words)
    for piece, form in refined_pieces(found):
        way = deployment(form)
        faults = missed(form, way)
        note = "; ".join(faults) or "none"
        if way.reached_from_flat is None:
            note += f"; not followed below {way.lost_at:.0%} of the deployment: from flat is shown by the gate alone"
        yield Row(f"{name}{piece}: taper", "gates missed by other code", float(len(faults)), 0, note=note)


def refined_pieces(found: Refined) -> Iterator[tuple[str, Stages]]:
    """The form, or those of its patches that were changed."""
    if not found.changed:
        return
    for piece in found.after.parts:
        if any(rod.profile is not None for rod in piece.footprint.rods):
            yield f", patch {piece.name}" if piece.name else "", piece


def deployment(form: Stages) -> Deployment:
    """Followed backwards from the popped-up shell, as the checks do."""
    popped = form.popped["pinned"]
    return deploy(popped.shell, popped.equilibrium, stages=3)


def missed(form: Stages, way: Deployment) -> list[str]:
    """Gates that a design fails when they are tried in another way."""
    size = form.target.size
    gap, faults = form.agreement["pinned"].rms_relative, list[str]()
    if misfit(form.footprint.mesh) > 5e-4 * size:
        faults.append("flat")
    if way.reached_from_flat is False:
        faults.append("from flat")
    mesh = form.footprint.mesh
    if not mesh.layered and form.boundary.draped is not None:
        new = mesh_grid(mesh.grid, form.layout.edge)
        boundary = replace(form.boundary, draped=mesh.prolong(form.boundary.draped, new))
        again = pop_up(Footprint(new), boundary, form.rod, ends="pinned", joint=form.joint)
        change = abs(agreement(again, form.target).rms_relative - gap)
        if change > max(0.05 * gap, 2e-5):
            faults.append(f"meshed again, by {100 * change:.4f} %")
    worst = max(with_errors(form, seed) for seed in range(100, 100 + SAMPLES))
    if worst > 1.5 * gap + 0.0015:
        faults.append(f"with errors {100 * worst:.3f} %")
    return faults


def misfit(mesh: GridMesh) -> float:
    """Largest distance between the two holes of a joint where the rods lie as the flat grid says [m]."""
    crossings, rods = mesh.grid.crossings, mesh.grid.rods
    places = [[rods[k].point(s) for k, s in zip(pair, at, strict=True)]
              for pair, at in zip(crossings.rods.tolist(), crossings.at.tolist(), strict=True)]  # fmt: skip
    return max(float(np.linalg.norm(a - b)) for a, b in places)


def with_errors(form: Stages, seed: int) -> float:
    """Relative rms gap of a grid that is drilled and cut with errors, of rods as stiff as they come; or infinity."""
    random, mesh, popped = np.random.default_rng(seed), form.footprint.mesh, form.popped["pinned"]
    joints, stations = set(mesh.joint_pairs.ravel().tolist()), mesh.stations.copy()
    for rod in range(len(mesh.grid.rods)):
        here = mesh.rod_slice(rod)
        nodes, s = mesh.rod_nodes[here], mesh.stations[here]
        stops = [0, *(k for k in range(1, len(s) - 1) if int(nodes[k]) in joints), len(s) - 1]
        moved = np.cumsum([0.0, *random.uniform(-5e-4, 5e-4, len(stops) - 1) * form.target.size])
        stations[here] = s + np.interp(s, s[stops], moved)
    factor = 1 + random.uniform(-0.05, 0.05, len(mesh.grid.rods))
    ei, ea, gj = form.rod.bend_stiffnesses, form.rod.stretch_stiffness, form.rod.twist_stiffness
    plain = [rod.profile for rod in mesh.grid.rods]
    lines = tuple(
        rod.cut(float(stations[mesh.rod_slice(k)][0]), float(stations[mesh.rod_slice(k)][-1]))
        for k, rod in enumerate(mesh.grid.rods)
    )
    wrong = replace(mesh, stations=stations, grid=replace(mesh.grid, rods=lines).with_profiles(plain))
    if any(profile is not None and profile.varies != "size" for profile in plain):
        raise ValueError("only tapers by size are tried here")
    # sections given by their stiffnesses vary as round rods do
    rods = [rs.Rod(GivenSection(ea, ei[0] * f, ei[1] * f, gj * f)) for f in factor.tolist()]
    shell = Shell.of(wrong, rods, joint=form.joint)
    shell = shell.with_elements(tuple(
        replace(new, **{key: value for key, value in vars(old).items() if key.startswith("source_")})
        for new, old in zip(shell.elements, popped.equilibrium.elements, strict=True)
    ))  # fmt: skip
    problem = Problem.of_shell(shell, form.boundary.points)
    there = find_stable(problem, popped.state, popped.forces)
    if not there.report.stable:
        return float("inf")
    moved_shell = replace(popped, shell=shell.with_elements(there.elements), equilibrium=there)
    return agreement(moved_shell, form.target).rms_relative
