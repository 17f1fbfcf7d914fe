"""Gates: what they measure, on grids of which the answer is known; and that the last design that passes is kept."""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import rodshell as rs
from rodshell.formfinding.pipeline import Stages, agreement, popped_again
from rodshell.formfinding.trim import Footprint
from rodshell.layout import FlatGrid, GridMesh, mesh_grid
from rodshell.layout.flatgrid import Crossings
from rodshell.layout.gridlayout import lattice_rod
from rodshell.model.edge_properties import LENGTH
from rodshell.progress import silent
from rodshell.refining import acceptance, refine
from rodshell.refining import gates as gates_module
from rodshell.refining.gates import (
    GATES,
    SPAN_ERROR,
    Gates,
    _errors,
    _from_flat,
    gates,
    misfit,
    span_lengths,
    with_errors,
)
from rodshell.solve.equilibrium import find_equilibrium

ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))


@cache
def stages() -> Stages:
    """A pinned paraboloid of 9 rods each way."""
    layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.04, edge=0.02)
    return rs.find_form(rs.Paraboloid(0.2, 0.12), layout, ROD, ends="pinned").stages


def with_profile(profile: rs.Profile) -> Stages:
    form = stages()
    return popped_again(form, Footprint(form.footprint.mesh.with_profiles(profile)), form.boundary, "pinned")


@cache
def tapered() -> Gates:
    return gates(with_profile(rs.Profile.symmetric((0.4, 0.9, 1.0))))


def test_a_tapered_shell_passes_every_gate() -> None:
    assert tapered().reason == ""
    assert list(tapered().passed) == list(GATES)
    assert all(tapered().passed.values())
    assert tapered().factorizations > 8 * 2  # the samples alone


def grid(shift: float = 0.0) -> GridMesh:
    """Four rods each way; a joint in the middle is drilled `shift` [m] off its place on one of its rods."""
    at = (-0.3, -0.1, 0.1, 0.3)
    rods = [lattice_rod(0, f"U{k}", y, -0.5, 0.5) for k, y in enumerate(at)]
    rods += [lattice_rod(1, f"V{k}", x, -0.5, 0.5) for k, x in enumerate(at)]
    crossed = FlatGrid.of(rods)
    places = crossed.crossings.at.copy()
    middle = int(np.flatnonzero((crossed.crossings.rods == (1, 5)).all(axis=1))[0])
    places[middle, 0] += shift
    return mesh_grid(FlatGrid(crossed.rods, Crossings(crossed.crossings.rods, places)), 0.1)


def test_straight_rods_fit_where_their_holes_are_at_their_crossings() -> None:
    assert misfit(grid()) < 1e-12
    assert misfit(stages().footprint.mesh) < 1e-12


def test_the_misfit_of_a_hole_is_what_turned_and_moved_rods_leave_of_it() -> None:
    small, large = misfit(grid(1e-3)), misfit(grid(2e-3))
    assert 0.3e-3 < small < 1e-3  # a part of it: the two rods move and turn towards each other
    assert large == pytest.approx(2 * small, rel=0.02)


def test_rods_that_only_move_or_turn_fit_again() -> None:
    """A grid sheared by a small angle lies flat: its joints are where the rods cross, though not at right angles."""
    mesh, angle = grid(), 0.02
    crossings = mesh.grid.crossings
    offset = np.array([rod.offset for rod in mesh.grid.rods])
    u, v = crossings.rods.T  # v rods turned by the angle about the origin: (x - y tan)/..., y / cos
    places = crossings.at.copy()
    places[:, 0] = offset[v] / np.cos(angle) - offset[u] * np.tan(angle)
    places[:, 1] = offset[u] / np.cos(angle) - offset[v] * np.tan(angle)
    sheared = mesh_grid(FlatGrid(mesh.grid.rods, Crossings(crossings.rods, places)), 0.1)
    assert misfit(sheared) < 1e-9


def test_errors_are_those_that_are_said_and_the_same_each_time() -> None:
    form = with_profile(rs.Profile.symmetric((0.15, 0.8, 1.0)))
    mesh, tolerance = form.footprint.mesh, SPAN_ERROR * form.target.size
    first, second = list(with_errors(form, 2)), list(with_errors(form, 2))
    changes = []
    for popped, again in zip(first, second, strict=True):
        assert np.array_equal(popped.state, again.state)
        lengths = popped.shell.stretch.rest_lengths
        spans = np.split(lengths - mesh.edge_lengths, np.flatnonzero(np.diff(_span(mesh))) + 1)
        changes += [span.sum() for span in spans]
        softer = popped.shell.elements[0].stiffness / form.popped["pinned"].shell.elements[0].stiffness
        assert np.abs(softer - 1.0).max() < 0.06  # 5 %, and 0.2 % of the spans' lengths
    assert 0.9 * tolerance < np.abs(changes).max() <= tolerance * (1 + 1e-9)
    assert np.std(changes) == pytest.approx(tolerance / np.sqrt(3), rel=0.1)
    assert not np.array_equal(first[0].state, first[1].state)


def _span(mesh: GridMesh) -> np.ndarray:
    """Which rod, and between which of its joints, each edge lies: a second way to number spans."""
    middles = mesh.flat[mesh.edges].mean(axis=1)
    number = np.empty(len(mesh.edges))
    for k, rod in enumerate(mesh.grid.rods):
        on_rod = mesh.edge_rods == k
        s = (middles[on_rod, :2] - np.array(rod.origin)) @ np.array(rod.direction)
        at = np.sort(mesh.grid.crossings.at[mesh.grid.crossings.rods == k])
        number[on_rod] = 1000 * k + np.searchsorted(at, s)
    return number


def test_a_shell_with_errors_is_the_one_of_a_grid_drilled_and_cut_so() -> None:
    """The same lengths and stiffnesses set one by one in a new shell lead to the same shape."""
    form = stages()
    popped = next(iter(with_errors(form, 1)))
    again = rs.pop_up(form.footprint, form.boundary, ROD, ends="pinned")
    bends = replace(again.shell.elements[0], stiffness=popped.shell.elements[0].stiffness)
    problem = replace(again.equilibrium.problem, elements=(bends,), stretch=popped.shell.stretch)
    found = find_equilibrium(problem, again.state, again.forces)
    assert np.abs(found.state - popped.state).max() < 1e-9


def moved_ends(by: float) -> Stages:
    """The form whose first rod is cut shorter at its start, over its old places: its mesh is not what is said."""
    form = stages()
    return replace(form, agreement={"pinned": replace(form.agreement["pinned"], rms=by * form.agreement["pinned"].rms)})


@pytest.mark.parametrize("factor", [0.9, 1.12])
def test_a_gap_that_the_new_mesh_does_not_confirm_is_refused(factor: float) -> None:
    judged = gates(moved_ends(factor), all_of_them=False)
    assert judged.reason.startswith("remeshed: meshed again, its gap is")
    assert list(judged.passed) == ["stable", "flat", "remeshed"]


def test_a_design_that_errors_spoil_is_refused() -> None:
    judged = gates(moved_ends(1e-3))
    assert judged.passed["tolerance"] is False
    assert judged.passed["from_flat"] is True
    assert not judged.open


def test_another_shape_than_from_flat_is_refused() -> None:
    """The mirror image, popped down: stable and as stiff, but not where the grid rises to."""
    form = stages()
    popped = form.popped["pinned"]
    flipped = replace(popped.equilibrium, state=popped.state * (1.0, 1.0, -1.0))
    mirrored = replace(form, popped={"pinned": replace(popped, equilibrium=flipped)})
    reason, made = _from_flat(mirrored, None, silent)
    assert reason.startswith("pushed up from flat, it comes to another shape")
    assert made > 5


def test_a_path_from_flat_that_takes_too_long_is_refused_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(gates_module, "MOST_FROM_FLAT", 5)
    reason, made = _from_flat(stages(), None, silent)
    assert reason == "that it comes to this shape from flat is not shown within 5 factorisations"
    assert 5 <= made < 15  # of the first steps; the whole path takes 25 or more


def test_errors_are_solved_in_few_factorisations_from_the_state_that_is_foreseen(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    form = with_profile(rs.Profile.symmetric((0.4, 0.9, 1.0)))
    at_once = list(with_errors(form, 3))
    assert all(popped.report.factorizations <= 4 for popped in at_once)
    monkeypatch.setattr(gates_module, "MOST_AT_ONCE", -1)
    in_steps = list(with_errors(form, 3))
    assert all(popped.report.factorizations >= 8 for popped in in_steps)
    for popped, other in zip(at_once, in_steps, strict=True):
        assert np.abs(popped.state - other.state).max() < 1e-8


def test_a_shell_that_is_not_stable_is_tried_at_no_other_gate() -> None:
    form = stages()
    popped = form.popped["pinned"]
    report = replace(popped.report, negative_modes=2)
    unstable = replace(form, popped={"pinned": replace(popped, equilibrium=replace(popped.equilibrium, report=report))})
    judged = gates(unstable)
    assert judged.reason == "stable: the shell is not stable, with 2 negative modes"
    assert not any(judged.passed.values())
    assert judged.factorizations == 0


# Acceptance


def refused_after(count: int, monkeypatch: pytest.MonkeyPatch, halvings: int = 0) -> list[Stages]:
    """Gates that refuse so many designs; after the first that passes, so many between two are tried."""
    monkeypatch.setattr(acceptance, "HALVINGS", halvings)
    monkeypatch.setattr(acceptance, "FIRMER", ())
    tried = list[Stages]()

    def some(form: Stages, *, all_of_them: bool = True, span_error: object = None, progress: object = None) -> Gates:
        tried.append(form)
        good = len(tried) > count
        return Gates(dict.fromkeys(GATES, good), "" if good else f"tolerance: number {len(tried)}", 7)

    monkeypatch.setattr(acceptance, "gates", some)
    return tried


def test_the_last_design_that_passes_is_kept(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = refused_after(1, monkeypatch)
    family = refine.FAMILIES["taper"]
    found = acceptance.refined(stages(), (family,), ends="pinned")
    designs = refine.refine(stages(), (family,)).designs
    assert len(designs) > 2
    assert len(tried) == 2
    assert found.refused == "tolerance: number 1"
    assert found.changed
    gap = agreement(tried[1].popped["pinned"], stages().target).rms
    assert found.gap_after.rms == pytest.approx(gap)
    assert found.gap_after.rms == pytest.approx(designs[-2].rms * stages().target.size, rel=0.05)  # EA over EI differs
    assert "a nearer design was refused" in found.words


def test_between_a_design_that_passes_and_a_better_one_that_does_not_better_ones_are_found(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    tried = refused_after(1, monkeypatch, halvings=2)
    found = acceptance.refined(stages(), (refine.FAMILIES["taper"],), ends="pinned")
    gaps = [agreement(form.popped["pinned"], stages().target).rms for form in tried]
    assert gaps[0] < gaps[3] < gaps[2] < gaps[1]
    assert found.gap_after.rms == pytest.approx(gaps[3])


def test_a_search_that_is_out_of_time_keeps_what_it_found() -> None:
    def late(stage: str, detail: str, residual: float) -> None:
        if "design 1" in detail:
            raise rs.OutOfTimeError("out of time after 3 s")

    found = acceptance.refined(stages(), (refine.FAMILIES["taper"],), progress=late)
    assert found.stopped == "out of time after 3 s"
    assert found.changed
    assert len(found.design) > 2


@pytest.mark.parametrize("where", ["gate remeshed", "sample 3", "from flat"])
def test_gates_that_are_out_of_time_are_tried_to_their_end(where: str) -> None:
    def late(stage: str, detail: str, residual: float) -> None:
        if where in detail:
            raise rs.OutOfTimeError("out of time after 3 s")

    found = acceptance.refined(stages(), (refine.FAMILIES["taper"],), progress=late)
    assert found.stopped == "out of time after 3 s"
    assert found.changed
    assert all(found.gates.values())


def test_a_shell_that_falls_under_its_loads_is_refused_and_kept() -> None:
    heavy = np.zeros((stages().footprint.mesh.node_count, 3))
    heavy[:, 2] = -1.0
    found = acceptance.refined(stages(), (refine.FAMILIES["taper"],), dead_loads=heavy)
    assert found.after is stages()
    assert found.refused == "stable: the shell falls under these loads: clamp its ends, or choose stiffer rods"


def test_an_interrupted_search_says_how_to_go_on_and_goes_on_there() -> None:
    def interrupted(stage: str, detail: str, residual: float) -> None:
        if "design 2" in detail:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt, match=r"the gap was down to .* --refine.start=") as stopped:
        acceptance.refined(stages(), (refine.FAMILIES["taper"],), progress=interrupted)
    start = [float(value) for value in str(stopped.value).rpartition("=")[2].split(",")]
    whole = refine.refine(stages(), "taper")
    rest = refine.refine(stages(), "taper", start=start)
    assert rest.designs[0].rms == pytest.approx(whole.designs[2].rms, rel=1e-3)
    assert rest.gap_after.rms == pytest.approx(whole.gap_after.rms, rel=0.02)
    with pytest.raises(rs.InputError, match="has 2 values"):
        refine.refine(stages(), "taper", start=start[:2])


@pytest.mark.parametrize("error", [1e300, 0.021, -1e-3, np.nan])
def test_an_error_of_a_span_is_shorter_than_a_span(error: float) -> None:
    """Spans of 40 mm."""
    with pytest.raises(rs.InputError, match=r"refine.tolerance.*; spans are about 40 mm long: give at most half"):
        acceptance.refined(stages(), (refine.FAMILIES["taper"],), span_error=error)


def test_the_shortest_spans_are_not_turned_round_by_an_error_of_long_ones() -> None:
    lengths = span_lengths(stages().footprint.mesh)
    assert lengths.min() < 0.8 * np.median(lengths)
    errors = np.concatenate([_errors(stages(), 0.02, seed) for seed in range(4)])[:, LENGTH]
    assert 0.45 < np.abs(errors).max() <= 0.5


def test_where_none_passes_the_form_stays_as_it_was(monkeypatch: pytest.MonkeyPatch) -> None:
    tried = refused_after(99, monkeypatch)
    found = acceptance.refined(stages(), (refine.FAMILIES["taper"],))
    assert found.after is stages()
    assert found.refused.startswith("tolerance: number 1; the form as it is then has up to ")
    assert found.refused.endswith("give the largest error as refine.tolerance")
    assert found.gap_after == found.gap_before
    assert not any(found.gates.values())
    assert found.gate_factorizations >= 7 * len(tried)
