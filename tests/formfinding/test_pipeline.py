"""The whole job: what it says of itself, what it keeps, and the table of rods that stands for a form."""

import json
import re
from dataclasses import replace
from functools import cache, partial
from math import pi
from types import SimpleNamespace

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.figures.records import json_text
from rodshell.formfinding import bound_drape, form_warnings, pipeline
from rodshell.formfinding.finite_sections import section_rotation
from rodshell.layout.gridlayout import lattice_rod
from rodshell.layout.lattices import EDGES_A_SPAN
from rodshell.results import read
from rodshell.results.verdict import verdict
from rodshell.solve.equilibrium import Status
from tests.formfinding.altered import with_report

SIZE = 0.2
ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
HEMISPHERE = rs.Hemisphere(SIZE)
GAUSSIAN = rs.HeightField(formula="0.3*exp(-(x^2 + y^2)/(2*0.05^2))", domain=rs.Disc(SIZE))


def layout_of(**options):
    return rs.GridLayout.orthogonal(**{"spacing": 0.05, "edge": 0.0125} | options)


@cache
def hemisphere_form():
    return rs.find_form(HEMISPHERE, layout_of(), ROD)


@cache
def turned_form():
    """Of no symmetry: an ellipsoid, turned heading, anchor off the middle, a shifted lattice."""
    layout = layout_of(rotate=0.3, offset=(0.01, 0.02), spacing=(0.05, 0.04), edge=0.01)
    return rs.find_form(rs.Ellipsoid(0.2, 0.15, 0.12), layout, ROD, anchor=(0.02, 0.01))


every_form = pytest.mark.parametrize("form", [hemisphere_form, turned_form], ids=["hemisphere", "turned ellipsoid"])


def altered_pop_up(**changes):
    """pop_up, its report altered."""

    def pop_up(*arguments, **options):
        popped = rs.pop_up(*arguments, **options)
        return with_report(popped, **changes)

    return pop_up


# What it says of itself


def test_supports_beside_the_end_of_the_target_are_told_with_the_edge_that_would_do():
    (warning,) = hemisphere_form().warnings
    assert warning.startswith("44 supports are off the end of the target, by up to 0.0783 mm (of rod ")
    edge = float(warning.rpartition("use a layout.edge of ")[2].removesuffix(" mm")) / 1e3
    assert rs.find_form(HEMISPHERE, layout_of(edge=edge), ROD, ends=()).warnings == ()


def test_a_form_that_was_found_is_converged_and_has_nothing_to_warn_of():
    form = rs.find_form(HEMISPHERE, layout_of(edge=0.05 / 6), ROD)
    assert form.status == "converged"
    assert form.warnings == ()
    assert list(form.popped) == ["pinned", "clamped"]
    assert list(form.agreement) == ["pinned", "clamped"]
    assert form.agreement["clamped"].max_relative < 1e-3  # the proof: 3.3e-4 at this spacing


def test_only_the_end_conditions_asked_for_are_popped_up():
    form = rs.find_form(HEMISPHERE, layout_of(edge=0.025), ROD, ends=("pinned",))
    assert (
        list(form.popped)
        == list(form.results().plain()["pop_up"])
        == list(form.results().plain()["agreement"])
        == ["pinned"]
    )
    assert form.status == "converged"


def test_progress_names_the_stages_in_their_order():
    told = []
    rs.find_form(HEMISPHERE, layout_of(edge=0.025), ROD, progress=lambda stage, *rest: told.append((stage, *rest)))
    assert list(dict.fromkeys(stage for stage, *_ in told)) == ["net", "drape", "pop-up"]
    assert all(isinstance(detail, str) and isinstance(residual, float) for _, detail, residual in told)


def test_a_pop_up_that_stops_early_is_named_and_has_no_agreement(monkeypatch):
    monkeypatch.setattr(pipeline, "pop_up", altered_pop_up(status=Status.STALLED))
    form = rs.find_form(HEMISPHERE, layout_of(edge=0.025), ROD)
    assert form.status == f"pop-up (pinned) {Status.STALLED.sentence}"
    assert form.agreement == {}
    assert form.results().plain()["pop_up"]["pinned"]["status"] == "stalled"
    assert form.results().plain()["pop_up"]["pinned"]["stable"] is None


def test_a_popped_up_saddle_is_told_by_the_verdict(monkeypatch):
    monkeypatch.setattr(pipeline, "pop_up", altered_pop_up(negative_modes=2))
    form = rs.find_form(HEMISPHERE, layout_of(edge=0.025), ROD, ends=("pinned",))
    assert form.status == "converged"
    assert form.results().plain()["pop_up"]["pinned"]["stable"] is False
    judged = verdict(form.results())
    assert judged.level == "unbuildable"
    assert judged.reasons[0].startswith("with pinned ends the shell is unstable (2 buckling modes)")


@pytest.mark.parametrize(("stiffness", "stretched"), [(0.3e6, True), (1e8, False)])
def test_rods_that_stretch_under_their_weight_are_warned_of_with_the_right_remedy(stiffness, stretched):
    """Strain is density g length / E whatever the section: no other advice is given where that is the cause."""
    rod = rs.Rod(rs.Circle(1e-3), rs.Material(youngs_modulus=stiffness, density=1e3))
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, length=0.9, edge=0.03)
    form = rs.find_form(HEMISPHERE, layout, rod, method=rs.Gravity())
    assert form.status == "converged"
    found = [text for text in form.warnings if "under their own weight" in text]
    assert len(found) == stretched
    if stretched:
        assert f"stretch by {100 * form.draped.report.max_strain:.2g} %" in found[0]
        assert "rod.material" in found[0]
        off = [text for text in form.verdict.reasons if "deviates from the target" in text]
        assert len(off) == 1
        assert "dips and ridges" not in off[0]


STANDING, LYING = rs.RectangularSection(width=4e-3, height=1e-3), rs.RectangularSection(width=1e-3, height=4e-3)


@cache
def of_laths(section, joint=None):
    cap = rs.Cap(SIZE, 0.6 * SIZE)
    return rs.find_form(cap, layout_of(spacing=0.04), replace(ROD, section=section), joint=joint, ends=("pinned",))


@pytest.mark.slow
@pytest.mark.parametrize(
    ("section", "joint", "degrees"),
    [(STANDING, None, 90), (LYING, None, 0), (STANDING, rs.Pin(), 0), (LYING, rs.Pin(), 0), (ROD.section, None, 0)],
    ids=["standing", "lying", "standing, pinned", "lying, pinned", "round"],
)
def test_laths_that_lie_down_are_warned_of(section, joint, degrees):
    """With ball joints a lath lies down, however it was laid; with pins it stays."""
    found = [text for text in of_laths(section, joint).warnings if "about their own axes" in text]
    assert [f"up to {degrees} (pinned" in text for text in found] == [True] * (degrees > 0)


@pytest.mark.slow
def test_laid_either_way_a_lath_takes_the_same_shape_where_nothing_holds_it():
    standing, lying = (of_laths(section).popped["pinned"].positions for section in (STANDING, LYING))
    np.testing.assert_allclose(standing, lying, rtol=0, atol=1e-9 * SIZE)


@pytest.mark.parametrize("turn", [0.1, 1.0, 2.0, -2.5])
def test_section_rotation_is_what_the_twist_angles_add(turn):
    """Laths held by pins lie nearly flat; turned by more than a quarter they are nearer to their other side."""
    popped = of_laths(LYING, rs.Pin()).popped["pinned"]
    before = section_rotation(popped.shell, popped.state)
    assert np.degrees(before).max() < 7.0
    state = popped.state.copy()
    state[popped.shell.first_angle :, 0] += turn
    turned = section_rotation(popped.shell, state)
    assert np.all(np.abs(turned - np.arccos(abs(np.cos(turn)))) <= before + 1e-9)
    round_rods = hemisphere_form().popped["pinned"]
    assert section_rotation(round_rods.shell, round_rods.state) is None


@pytest.mark.parametrize(("ending", "tail", "left"), [(6, 0.5, 5), (4, 0.7, 7), (10, None, 0), (11, None, 0)])
def test_a_rod_that_runs_far_past_its_last_joint_is_warned_of(ending, tail, left):
    """One rod of 1.1 m, met every 0.1 m; from `ending` on those that meet it end 10 mm past it."""
    crossing = [lattice_rod(1, f"V{k:02d}", k / 10, -0.2, 0.01 if k >= ending else 0.2) for k in range(1, 11)]
    grid = rs.FlatGrid.of([lattice_rod(0, "U01", 0.0, 0.0, 1.1), *crossing], margin=0.015)
    layout = rs.GridLayout.orthogonal(spacing=0.1)
    trimmed = SimpleNamespace(mesh=SimpleNamespace(grid=grid), draped=SimpleNamespace(layout=layout))
    found = form_warnings._long_tails(trimmed)
    assert len(found) == (tail is not None)
    if tail is not None:
        assert found[0].startswith(
            f"U01 runs {1e3 * (tail + 0.1):.0f} mm past its last joint: no joint is made within 0.15"
        )
        assert f"here at {left} crossings" in found[0]


def test_a_layout_beside_the_target_is_refused():
    with pytest.raises(InputError, match="no rod of the layout touches the target"):
        rs.find_form(
            HEMISPHERE, rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.03, length=1.2, offset=(1.0, 1.0)), ROD
        )


@pytest.mark.parametrize(("method", "status", "times"), [
    (rs.Gravity(), Status.STALLED, 1), (rs.Bound(), Status.STALLED, 0), (rs.Gravity(), Status.LOST_CONTACT, 1)
])  # fmt: skip
def test_a_drape_by_weight_that_fails_is_told_of_the_bound_one_once(method, status, times):
    draped = hemisphere_form().draped
    levels = (replace(draped.report, status=status),)
    lying = replace(hemisphere_form().trimmed, draped=replace(draped, method=method, levels=levels))
    form = replace(hemisphere_form(), stages=replace(hemisphere_form().stages, lying=lying))
    assert form.status.startswith("drape ")
    assert form.status.count("bound") == times


def test_a_wave_that_springs_off_is_advised_seams():
    gap = replace(hemisphere_form().agreement["clamped"], max=0.03 * SIZE)
    form = replace(hemisphere_form(), stages=replace(hemisphere_form().stages, agreement={"clamped": gap}))
    (words,) = [text for text in verdict(form.results()).reasons if "deviates from the target" in text]
    assert words.endswith("dips and ridges need seams, graded stiffness or supports")


def test_families_that_meet_at_a_small_angle_are_warned_of():
    """A hemisphere and some more: on the diagonal of the net the angle closes as f(uv/R^2)."""
    form = rs.find_form(rs.Cap(SIZE, -0.06), layout_of(edge=0.025), ROD, ends=("clamped",))
    angle = form.results().plain()["drape"]["min_angle_deg"]
    assert 10 < angle < 25
    assert any(f"{angle:.1f} degrees" in text for text in form.warnings)


def test_a_drape_that_is_no_minimum_is_warned_of(monkeypatch):
    """Radius of curvature 8 mm under a spacing of 30 mm: without the patch 19 negative modes, 22 factorisations."""

    def find(*arguments, **options):
        found = plain(*arguments, **options)
        return replace(found, report=replace(found.report, negative_modes=19))

    plain = bound_drape.find_equilibrium
    monkeypatch.setattr(bound_drape, "find_equilibrium", find)
    form = rs.find_form(HEMISPHERE, layout_of(edge=0.025), ROD, ends=())
    assert any("19 negative modes" in text for text in form.warnings)


# A drape that does not converge


@pytest.fixture
def hurried(monkeypatch):
    """The bound drape with two iterations: too few for a steep bump."""
    monkeypatch.setattr(bound_drape, "find_equilibrium", partial(bound_drape.find_equilibrium, most_iterations=2))


@pytest.mark.slow
@pytest.mark.usefixtures("hurried")
def test_a_drape_that_does_not_converge_leaves_a_partial_result_that_is_saved(tmp_path):
    form = rs.find_form(GAUSSIAN, layout_of(spacing=0.03, edge=0.01), ROD)
    assert not form.draped.converged
    assert form.status == f"drape {Status.STALLED.sentence}"
    assert form.popped == {}
    assert form.agreement == {}
    # the bump's radius of curvature at its top, s^2 / A = 8.3 mm, is named, against the spacing of 30 mm
    assert any("radius of curvature" in text and "0.03 m" in text for text in form.warnings)
    kept = read(form.save(tmp_path / "bump"))
    assert kept.results.plain()["status"] == form.status
    assert kept.results.plain()["drape"]["status"] == "stalled"
    assert kept.results.plain()["pop_up"] == {}
    assert kept.final == "draped"
    np.testing.assert_array_equal(kept.states["draped"], form.trimmed.positions)
    assert (
        "Not known: the computation did not converge, which says nothing about the shell itself: drape"
        in form.summary(verbose=True)
    )


@pytest.mark.usefixtures("hurried")
def test_a_mild_target_that_does_not_converge_blames_no_curvature():
    form = rs.find_form(HEMISPHERE, layout_of(edge=0.025), ROD)
    assert form.status == f"drape {Status.STALLED.sentence}"
    assert form.warnings == ()


@pytest.mark.slow
def test_a_gravity_drape_that_slides_off_is_kept_too(tmp_path):
    layout = layout_of(rods=(9, 9), length=0.9, edge=0.05)
    form = rs.find_form(HEMISPHERE, layout, ROD, method=rs.Gravity(), anchor=(0.05, 0.02))
    assert form.status == f"drape {Status.LOST_CONTACT.sentence}"
    kept = read(form.save(tmp_path / "slid"))
    assert kept.results.plain()["drape"]["status"] == "lost contact"
    assert len(kept.states["draped"]) == len(kept.states["flat"]) == form.draped.mesh.node_count


# What it keeps


def plain(value):
    """As JSON gives it back."""
    return json.loads(json_text(value))


@pytest.mark.slow
@every_form
def test_save_and_read_give_back_every_number(form, tmp_path):
    form = form()
    kept = read(form.save(tmp_path / "form"))
    whole, own = plain(form.archive().results.plain()), plain(form.results().plain())
    assert kept.results.plain() == whole
    for key in own.keys() - {"rods", "warnings"}:  # these two the checks add to
        assert kept.results.plain()[key] == own[key]
    expected = {
        "flat": form.footprint.mesh.flat,
        "draped": form.trimmed.positions,
        "popped_pinned": form.popped["pinned"].positions,
        "popped_clamped": form.popped["clamped"].positions,
        "rod_nodes": form.footprint.mesh.rod_nodes,
        "rod_start": form.footprint.mesh.rod_start,
        "gap_pinned": form.agreement["pinned"].gaps,
        "gap_clamped": form.agreement["clamped"].gaps,
    }
    for name, value in expected.items():
        np.testing.assert_array_equal(kept.states[name], value)
    assert kept.case_toml == form.archive().case_toml


@pytest.mark.slow
@pytest.mark.parametrize("ends", [("pinned",), ("clamped",), ("pinned", "clamped")])
def test_the_kept_case_asks_for_the_same_ends(ends, tmp_path):
    from rodshell.case import load_case

    target, layout = rs.Hemisphere(SIZE), rs.GridLayout.orthogonal(spacing=0.08, edge=0.04)
    whole, sewn = (
        rs.find_form(target, layout, ROD, ends=ends),
        rs.find_form(target, layout, ROD, seams=[[(-1, 0), (1, 0)]], ends=ends),
    )
    for form in (whole, sewn):
        (tmp_path / "case.toml").write_text(form.archive(options=rs.OutputOptions(stages=0)).case_toml)
        case = load_case(tmp_path / "case.toml")
        assert tuple(support.name for support in case.popped_on) == form.ends == tuple(form.popped) == ends


@pytest.mark.slow
def test_the_kept_case_gives_the_same_form_again(tmp_path):
    from rodshell.case import load_case

    form = turned_form()
    case = load_case(form.save(tmp_path / "form") / "case.toml")
    target, layout, rod = case.target.build(), case.layout.build(), case.rod.build()
    again = rs.find_form(target, layout, rod, anchor=tuple(case.drape.anchor))
    assert (target, layout, rod) == (form.target, form.layout, form.rod)
    np.testing.assert_array_equal(again.popped["clamped"].positions, form.popped["clamped"].positions)


@every_form
def test_result_has_the_keys_and_units_of_the_design(form):
    result = form().results().plain()
    assert [result[key] for key in ("format", "version", "units")] == ["rodshell-result", 2, "SI"]
    assert {
        "status",
        "target",
        "layout",
        "rod",
        "rods",
        "footprint",
        "boundary",
        "agreement",
        "drape",
        "pop_up",
    } <= set(result)
    for rod in result["rods"]:
        assert {"id", "family", "offset", "start", "end", "length", "joints"} <= set(rod)
    for figures in result["agreement"].values():
        assert {"max", "rms", "max_relative", "rms_relative"} <= set(figures)
    drape = {"method", "dofs", "levels", "seconds", "force_residual", "max_strain", "max_gap", "negative_modes"}
    assert drape | {"min_angle_deg"} <= set(result["drape"])
    for level in result["drape"]["levels"]:
        assert {"dofs", "iterations", "factorizations"} <= set(level)
    for popped in result["pop_up"].values():
        assert {"status", "dofs", "iterations", "factorizations", "seconds", "force_residual", "stable"} <= set(popped)
        assert popped["stable"] is True


@every_form
def test_rods_of_the_result_are_those_of_the_states(form):
    """Lengths, joints and families read off the flat state alone: a joint is a node that two rods share."""
    result, archive = form().results().plain(), form().archive()
    flat, nodes = archive.states["flat"], archive.states["rod_nodes"]
    starts = archive.states["rod_start"]
    rods = np.split(nodes, starts[1:])
    assert len(rods) == len(result["rods"]) > 10
    assert not flat[:, 2].any()
    for entry, mine in zip(result["rods"], rods, strict=True):
        along = flat[mine, 0 if entry["family"] == "u" else 1]
        across = flat[mine, 1 if entry["family"] == "u" else 0]
        np.testing.assert_allclose(across, entry["offset"], rtol=0, atol=1e-12)
        assert np.all(np.diff(along) > 0)
        np.testing.assert_allclose([along[0], along[-1]], [entry["start"], entry["end"]], rtol=0, atol=1e-12)
        assert entry["length"] == pytest.approx(entry["end"] - entry["start"])
        met = {}
        for other, others in zip(result["rods"], rods, strict=True):
            shared = np.intersect1d(mine, others)
            if other is not entry and len(shared):
                met[other["id"]] = flat[shared[0], 0 if entry["family"] == "u" else 1] - along[0]
        assert {joint["with"] for joint in entry["joints"]} == set(met)
        assert len(met) >= 3
        for joint in entry["joints"]:
            assert joint["at"] == pytest.approx(met[joint["with"]], abs=1e-12)
        places = [joint["at"] for joint in entry["joints"]]
        assert places == sorted(places)
        assert places[0] > 0
        assert places[-1] < entry["length"]


@every_form
def test_footprint_and_boundary_are_the_rod_ends_in_turn(form):
    """Material coordinates: rods of family u run along x at y = offset, also where the heading is turned."""
    result, archive = form().results().plain(), form().archive()
    for k, rod in enumerate(result["rods"]):
        for end, s in ((0, rod["start"]), (1, rod["end"])):
            expected = [s, rod["offset"]] if rod["family"] == "u" else [rod["offset"], s]
            np.testing.assert_allclose(result["footprint"][2 * k + end], expected, rtol=0, atol=1e-12)
    nodes, first = archive.states["rod_nodes"], archive.states["rod_start"]
    ends = np.column_stack([nodes[first], nodes[np.append(first[1:], len(nodes)) - 1]]).ravel()
    for state in ("draped", "popped_pinned", "popped_clamped"):
        np.testing.assert_array_equal(archive.states[state][ends], result["boundary"])


def test_figures_of_the_result_can_be_had_from_its_states():
    form = hemisphere_form()
    result, states = form.results().plain(), form.archive().states
    for ends in ("pinned", "clamped"):
        gaps = np.linalg.norm(states[f"popped_{ends}"], axis=1) - SIZE
        np.testing.assert_allclose(states[f"gap_{ends}"], gaps, rtol=0, atol=1e-14)
        figures = result["agreement"][ends]
        assert np.abs(gaps).max() <= figures["max"] <= np.abs(gaps).max() + 2e-5 * SIZE  # edge middles count too
        assert figures["max_relative"] == pytest.approx(figures["max"] / SIZE)
        assert figures["rms"] == pytest.approx(np.sqrt(np.mean(gaps**2)), rel=0.05)
    assert result["drape"]["max_gap"] < 1e-12
    middle = [rod for rod in result["rods"] if rod["offset"] == 0.0]
    assert len(middle) == 2
    # half a great circle; the net's march is extrapolated to some 1e-6
    np.testing.assert_allclose([rod["length"] for rod in middle], pi * SIZE, rtol=1e-5)


def test_dropped_rods_are_named_with_their_reason():
    result = hemisphere_form().results().plain()
    assert {entry["id"] for entry in result["dropped"]} == {"U01", "U13", "V01", "V13"}
    assert all("fewer than 3 joints" in entry["reason"] for entry in result["dropped"])
    assert not {entry["id"] for entry in result["dropped"]} & {rod["id"] for rod in result["rods"]}


# Targets from Python


def ripple(x, y):
    return 0.1 * np.cos(6 * np.sqrt(x * x + y * y + 1e-4))


@pytest.mark.slow
def test_a_python_function_is_a_target_like_its_formula(tmp_path):
    formula = "0.1*cos(6*sqrt(x^2 + y^2 + 0.0001))"
    targets = [
        rs.HeightField(function=ripple, domain=rs.Disc(0.15)),
        rs.HeightField(formula=formula, domain=rs.Disc(0.15)),
    ]
    forms = [rs.find_form(target, layout_of(edge=0.025), ROD) for target in targets]
    assert [form.status for form in forms] == ["converged"] * 2
    for ends in ("pinned", "clamped"):
        ours, theirs = (form.popped[ends].positions for form in forms)
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-9 * SIZE)
    kept = read(forms[0].save(tmp_path / "ripple"))
    assert "ripple" in kept.results.plain()["target"]["function"]
    assert "ripple" in kept.case_toml  # says that no case file can give it again


# A table of rods


def table_of(form, **options):
    names = [rod.name for rod in form.footprint.rods]
    grid = rs.straight_rods(form.footprint.points.reshape(-1, 2, 2), names=names)
    return rs.pop_up_table(grid, form.trimmed.boundary.points.reshape(-1, 2, 3), form.rod, **options)


def at_joints(footprint, positions):
    mesh = footprint.mesh
    names = [rod.name for rod in footprint.rods]
    pairs = mesh.grid.crossings.rods.tolist()
    return {
        frozenset((names[a], names[b])): positions[node]
        for (a, b), node in zip(pairs, mesh.joint_nodes.tolist(), strict=True)
    }


@every_form
def test_table_of_a_forms_rods_pops_up_to_the_forms_pinned_shell(form):
    form = form()
    table = table_of(form, edge=form.layout.edge)
    assert table.status == "converged"
    assert table.warnings == ()
    ours = at_joints(table.footprint, table.popped["pinned"].positions)
    theirs = at_joints(form.footprint, form.popped["pinned"].positions)
    assert set(ours) == set(theirs)
    # both meshes have edges of one length, but the form's tails keep the nodes of joints that are not made
    apart = max(float(np.abs(ours[pair] - theirs[pair]).max()) for pair in theirs)
    assert apart < 1e-4 * SIZE  # second order: 5e-5 measured at 12.5 mm


def test_a_table_with_the_forms_joints_bears_as_much_as_the_form():
    """Heavy rigid joints: with massless balls in their place it would bear ten times as much."""
    layout = rs.GridLayout.orthogonal(spacing=0.08, edge=0.04)
    form = rs.find_form(rs.Hemisphere(SIZE), layout, ROD, joint=rs.Rigid(mass=0.005), ends="pinned")
    table = table_of(form, edge=0.04, joint=form.joint)
    ours, theirs = (one.archive().results.plain() for one in (table, form))
    assert ours["joint"] == theirs["joint"]
    assert ours["fabrication"]["total_mass"] == pytest.approx(theirs["fabrication"]["total_mass"], rel=1e-9)
    borne = [one["self_weight"]["pinned"]["load_factor"] for one in (ours, theirs)]
    assert borne[0] == pytest.approx(borne[1], rel=0.01)


def test_a_table_with_eccentric_joints_is_refused():
    with pytest.raises(InputError, match="eccentricity 4 mm would lay the rods in two layers"):
        table_of(hemisphere_form(), joint=rs.Pin(eccentricity=0.004))


@pytest.mark.slow
def test_table_by_default_takes_six_edges_between_joints(tmp_path):
    table = table_of(hemisphere_form())
    lengths = table.footprint.mesh.edge_lengths
    assert lengths.max() == pytest.approx(0.05 / 6, rel=1e-6)
    result = read(table.save(tmp_path / "table")).results.plain()
    assert result["status"] == "converged"
    assert list(result["pop_up"]) == ["pinned"]
    assert result["pop_up"]["pinned"]["stable"] is True
    assert [rod["id"] for rod in result["rods"]] == [rod.name for rod in hemisphere_form().footprint.rods]


@pytest.mark.parametrize("digits", [3, 4, 16])
def test_rods_that_cross_in_threes_are_meshed_by_their_spans_however_they_are_rounded(monkeypatch, digits):
    popped = []

    def pop_up(footprint, *_, **__):
        popped.append(footprint.mesh)
        raise InputError("the mesh is enough")

    monkeypatch.setattr("rodshell.formfinding.pipeline.pop_up", pop_up)
    degrees, offsets = np.radians([0, 60, 120]), np.arange(-2, 3) * 0.5 * np.sqrt(3)
    middles = [offset * np.array([-np.sin(a), np.cos(a)]) for a in degrees for offset in offsets]
    along = np.array([[np.cos(a), np.sin(a)] for a in degrees for _ in offsets])
    flat = np.stack([middles - 2.2 * along, middles + 2.2 * along], axis=1).round(digits)
    finals = np.concatenate([0.9 * flat, np.zeros((15, 2, 1))], axis=2)
    with pytest.raises(InputError, match="enough"):
        rs.pop_up_table(rs.straight_rods(flat), finals, ROD)
    [mesh] = popped
    assert np.count_nonzero(np.bincount(mesh.rod_nodes) == 3) == 19
    spans = 3 * (4 + 2 * 3 + 2 * 2)  # of a family five rods with five, four and three joints
    tails = 3 * 2 * (1 + 2 * 4 + 2 * 7)  # nodes within the ends of 0.2, 0.7 and 1.2 m
    assert mesh.node_count == 19 + len(mesh.ends.ravel()) + spans * (EDGES_A_SPAN - 1) + tails


def test_rods_of_a_table_need_no_order_and_no_right_angles():
    """The same rods, each turned end for end and in reverse order, give the same shell."""
    form = hemisphere_form()
    names = [rod.name for rod in form.footprint.rods][::-1]
    flat = form.footprint.points.reshape(-1, 2, 2)[::-1, ::-1]
    finals = form.trimmed.boundary.points.reshape(-1, 2, 3)[::-1, ::-1]
    turn = np.array([[0.8, 0.6], [-0.6, 0.8]])
    other = rs.pop_up_table(rs.straight_rods(flat @ turn + [3.0, -2.0], names=names), finals, ROD, edge=0.0125)
    straight = table_of(form, edge=0.0125)
    ours, theirs = (at_joints(one.footprint, one.popped["pinned"].positions) for one in (other, straight))
    assert set(ours) == set(theirs)
    assert max(float(np.abs(ours[pair] - theirs[pair]).max()) for pair in ours) < 1e-8 * SIZE


SQUARE = [[[0, 0], [1, 0]], [[0, 1], [1, 1]], [[0.2, -1], [0.2, 2]]]


@pytest.mark.parametrize(
    ("ends", "says"),
    [
        (np.zeros((3, 2)), r"shape \(rods, 2, 2\), not \(3, 2\)"),
        ([[[0, 0], [0, 0]], [[-1, -1], [1, 1]]], "R01 has no length"),
        ([[[0, 0], [1, np.nan]]], "rod 1 has an end that is not finite"),
        (SQUARE[:2], "2 of 2 rods cross no other rod"),
        ([[[0, 0], [1, 0]], [[0.5, 0], [2, 0]]], "R01 and R02 lie on one line and overlap"),
    ],
)
def test_flat_rods_that_make_no_grid_are_refused(ends, says):
    with pytest.raises(InputError, match=says):
        rs.straight_rods(ends)


def test_final_ends_that_do_not_fit_are_refused():
    form = hemisphere_form()
    grid = rs.straight_rods(form.footprint.points.reshape(-1, 2, 2), names=[rod.name for rod in form.footprint.rods])
    finals = form.trimmed.boundary.points.reshape(-1, 2, 3)
    with pytest.raises(InputError, match=r"of the shape \(22, 2, 3\), not \(21, 2, 3\)"):
        rs.pop_up_table(grid, finals[1:], ROD)
    with pytest.raises(InputError, match="finite"):
        rs.pop_up_table(grid, np.where(finals == finals[3, 1, 2], np.nan, finals), ROD)
    with pytest.raises(InputError, match=r"rod U02 is 0\.2744 m long, but its final ends lie 0\.4478 m apart"):
        rs.pop_up_table(grid, 2 * finals, ROD)


def test_a_table_whose_rods_would_all_swing_is_refused():
    grid = rs.straight_rods(SQUARE)
    with pytest.raises(InputError, match="no rod of the table has 3 joints"):
        rs.pop_up_table(grid, np.zeros((3, 2, 3)), ROD)


def test_every_stage_shows_itself_in_one_short_line():
    target, layout = rs.Hemisphere(radius=0.2), rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.06, length=1.0)
    rod = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))
    form = rs.find_form(target, layout, rod, ends="pinned")
    trimmed, footprint, popped = form.trimmed, form.footprint, form.popped["pinned"]
    rods = len(footprint.rods)
    shown = {
        form.draped: rf"<Draped by bound: {rods} rods, largest gap to the target \S+ mm, converged>",
        trimmed: rf"<Trimmed: {rods} rods, 0 left out>",
        form.boundary: f"<Boundary: ends of {rods} rods>",
        footprint: rf"<Footprint: {rods} rods, \d+ nodes>",
        popped: rf"<PopUp: {rods} rods, pinned from draped, stable>",
    }
    for stage, line in shown.items():
        assert re.fullmatch(line, repr(stage)), repr(stage)
    gap = rs.agreement(popped, target)
    assert repr(gap) == f"<Agreement: {gap}>"
    assert re.fullmatch(r"gap to the target: max \S+ mm \(\S+ % of its size\) at .* mm, rms \S+ mm \(\S+ %\)", str(gap))
    assert repr(form.checks) == "<Checks of pinned, 9 stages of deployment>"


@pytest.mark.parametrize("method", [rs.Gravity(), rs.Fall()])
def test_a_crossing_angle_is_refused_where_the_grid_finds_its_angles_itself(method: rs.Gravity | rs.Fall) -> None:
    layout = rs.GridLayout.orthogonal(spacing=0.1, crossing=1.2)
    rod = rs.Rod(rs.Circle(0.001), rs.Material(1e6, 1000.0))
    with pytest.raises(rs.InputError, match=r"layout crossing 68\.75 degrees: a grid that hangs or falls"):
        rs.drape(layout, rod, rs.Hemisphere(0.2), method=method)


def test_a_grid_with_oblique_families_is_draped_and_pops_up() -> None:
    """The families begin at 60 degrees to each other; the drape keeps to the net to some percent of the size."""
    rod = rs.Rod(rs.Circle(0.001), rs.Material(1e6, 1000.0))
    layout = rs.GridLayout.orthogonal(spacing=0.05, crossing=np.pi / 3)
    form = rs.find_form(rs.Paraboloid(0.2, 0.1), layout, rod, ends="clamped")
    assert form.popped["clamped"].report.stable
    assert form.agreement["clamped"].rms_relative < 0.005
    net = form.draped.net
    assert net is not None
    assert np.degrees(net.min_angle) < 60
