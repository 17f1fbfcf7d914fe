"""Rows of the table of verdicts: whether shells come up from flat, and which other shapes they have."""

from collections.abc import Iterator

import numpy as np

import rodshell as rs
from rodshell.checks import check
from rodshell.checks.deployment import Deployment, deploy
from rodshell.checks.other_shapes import OtherShapes, other_shapes
from rodshell.solve.equilibrium import find_stable
from rodshell.solve.path import relax
from rodshell.solve.problem import Problem, Supports
from tests.acceptance.cases import AUTO
from tests.acceptance.rows import Row, form_of
from tests.acceptance.targets_random import REASONS, ROD, random_case
from tests.formfinding.elastic_twins import ElasticTwin

TARGETS = 60
FINE = 200  # steps of the path forwards that nothing of the deployment's own is used for
NEAR, AKIN = 0.6, 1.5  # of the size and of the energy: other shapes that the verdict is about


def random_form(seed: int) -> rs.Form | None:
    """One of the random targets, pinned; None where there is no net or no stable shell."""
    _, target, layout, anchor = random_case(seed)
    try:
        form = rs.find_form(target, layout, ROD, anchor=anchor, ends=("pinned",))
    except REASONS:
        return None
    popped = form.popped.get("pinned")
    return form if popped is not None and popped.report.stable else None


def square_cap() -> rs.Form:
    """A shallow paraboloid over a square, its rods along the diagonals: its rim is made of four arches."""
    layout = rs.GridLayout.orthogonal(spacing=0.08, edge=0.02, rotate=np.pi / 4)
    target = rs.HeightField(formula="0.05 - 0.3*(x^2 + y^2)", domain=rs.Rectangle((0.4, 0.4)))
    return rs.find_form(target, layout, ROD, ends=("pinned",))


def walked(form: rs.Form, way: Deployment) -> float:
    """From the first stage in many small steps of equal length: how far from the final shape that ends, over the size.

    Each step ends in what Newton's method finds from the last, or where the energy leads down to.
    """
    shell, state = way.shells[0]
    elements, stretch, places = shell.elements, shell.stretch, shell.flat_coordinates
    forces, final = stretch.stiffness * stretch.strains(state), form.popped["pinned"]
    first, begin, pattern = state[shell.ends].copy(), float(way.share[1]), None
    for share in np.linspace(begin, 1.0, FINE + 1)[1:]:
        goals = first + (share - begin) / (1 - begin) * (final.state[shell.ends] - first)
        supports = Supports(shell.held_ends(), shell.ends, goals)
        problem = Problem(elements, stretch, supports, 0.2, flat_coordinates=places, pattern=pattern)
        found = find_stable(problem, state, forces)
        if not found.report.stable:  # a limit point, at which too little energy is released to be called a snap
            start = state.copy()
            start[shell.ends] = goals
            found = relax(problem, start)
        if not found.report.stable:
            return np.inf
        state, forces, elements, pattern = found.state, found.forces, found.elements, found.problem.pattern
    return _apart(shell.positions(state), final.positions, form)


def deployment_rows() -> Iterator[Row]:
    """Each of the random targets from flat, and other paths forwards that might refute what is said."""
    known = {True: 0, False: 0, None: 0}
    refuted, elsewhere, smooth, snapping, unguided = 0, 0, 0, 0, 0
    for seed in range(TARGETS):
        form = random_form(seed)
        if form is None:
            continue
        popped = form.popped["pinned"]
        way = deploy(popped.shell, popped.equilibrium, stages=8)
        known[way.reached_from_flat] += 1
        guided = any("has to be guided" in word for word in way.warnings)
        assert guided == (way.reached_from_flat is False)
        if way.reached_from_flat:
            smooth, snapping = smooth + (not way.snaps), snapping + bool(way.snaps)
            elsewhere += not way.snaps and walked(form, way) > 1e-3
        elif guided:
            unguided += walked(form, way) < 1e-3
            risen = rs.pop_up(form.footprint, form.trimmed.boundary, ROD, ends="pinned", start="flat")
            refuted += risen.report.stable and _apart(risen.positions, popped.positions, form) < 1e-3
    shells = sum(known.values())
    case = f"{TARGETS} random targets"
    note = f"{shells} stable shells: {known[True]} reached ({snapping} through snaps), {known[False]} not"
    yield Row(case, "neither reached from flat nor said not to be", known[None], 0, note=note)
    yield Row(case, "said to have to be guided, but not", unguided, 0, note=f"in {FINE} equal steps")
    yield Row(case, "said not to be reached, but it is", refuted, 0, note="from flat by arches")
    yield Row(case, "said to be reached without a snap, but not", elsewhere, 0, note=f"{smooth} in {FINE} equal steps")


def shape_rows(name: str, form: rs.Form, most_factorizations: int) -> Iterator[Row]:
    """The nearest other shape, judged by the tests' own energy."""
    popped = form.popped["pinned"]
    shell, at = popped.shell, popped.equilibrium
    searched = other_shapes(shell, at, most_factorizations=most_factorizations)
    yield Row(name, "no other shape found", float(not searched.found), 0, note=searched.searched)
    if not searched.found:
        return
    other = min(searched.found, key=lambda one: one.distance)
    mesh = popped.footprint.mesh
    twin, free = ElasticTwin(mesh, ROD), np.setdiff1d(np.arange(mesh.node_count), mesh.ends)
    unknowns = (3 * free[:, None] + np.arange(3)).ravel()
    scale = np.abs(twin.bend_gradient(other.positions)).max()
    unbalanced = float(np.abs(twin.gradient(other.positions)[free]).max() / scale)
    lowest = float(np.linalg.eigvalsh(twin.hessian(other.positions)[np.ix_(unknowns, unknowns)])[0])
    energies = [
        float(twin.bend_energies(x[twin.bends]).sum() + twin.stretch_energies(x[twin.edges]).sum())
        for x in (popped.positions, other.positions)
    ]
    note = f"{other.distance:.3f} of the size away, {other.energy:.3f} times the energy"
    yield Row(name, "the other shape: unbalanced", unbalanced, 1e-6, note=note)
    yield Row(name, "the other shape: not a minimum", float(lowest <= 0), 0, note=f"lowest eigenvalue {lowest:.2g} N/m")
    yield Row(name, "its energy ratio off the tests' own", abs(other.energy * energies[0] / energies[1] - 1), 1e-6)
    if name != CAP:
        yield Row(name, "distance over the size", other.distance, NEAR)
        yield Row(name, "energy ratio", other.energy, AKIN)


CAP = "cap on a square, rods diagonal"


def work_rows() -> Iterator[Row]:
    """The search beside the work before it, in factorisations."""
    forms = {case.name: form_of(case) for case in AUTO[:3]}
    for name, form in forms.items():
        checks = check(form.popped, ROD, stages=8)
        assert checks.deployment is not None
        before = sum(shell.report.factorizations for shell in form.popped.values()) + checks.deployment.factorizations
        before += sum(one.factorizations for one in checks.self_weight.values())
        done: list[OtherShapes] = list(checks.other_shapes.values())
        share = sum(one.factorizations for one in done) / before
        images = sum(shape.mirror for one in done for shape in one.found)
        others = sum(not shape.mirror for one in done for shape in one.found)
        note = f"{sum(one.tried for one in done)} starts; {images} mirror image, {others} other shapes"
        yield Row(name, "search over the work before it", share, 0.5, note=note)


def rows() -> Iterator[Row]:
    yield from shape_rows(CAP, square_cap(), 300)
    for seed in (1, 7):
        form = random_form(seed)
        assert form is not None
        yield from shape_rows(f"random target {seed}", form, 600)
    yield from work_rows()
    yield from deployment_rows()


def _apart(one: np.ndarray, two: np.ndarray, form: rs.Form) -> float:
    return float(np.linalg.norm(one - two, axis=1).max()) / form.target.size
