"""Loads decide section, bracing and spacing: what is chosen stands, and where nothing does the cause that is named is
true of the sizes on both sides."""

import re
from functools import cache
from types import SimpleNamespace

import pytest

import rodshell as rs
from rodshell import design
from rodshell.case import Case
from rodshell.case.load_tables import usual_loads
from rodshell.design import CREEP
from rodshell.errors import InputError, OutOfTimeError
from rodshell.figures.findings import Finding
from rodshell.loads.check import Estimate
from rodshell.results.offers import bracing_keys
from rodshell.rods.section import TRADE_SIZES, Section, Tube, size_text

ALL = "section, bracing, spacing"
SNOW = usual_loads("0.5 kN/m2")
DOME = {"target.kind": "paraboloid", "target.radius": 6.0, "target.height": 3.0, "rod.material.preset": "gfrp"}
SMALL = DOME | {"target.radius": 3.0, "target.height": 1.2}
TUBE = {"rod.section.kind": "tube", "rod.section.radius": 0.016, "rod.section.thickness": 0.003}
CABLES = {
    "bracing.kind": "cables", "bracing.pattern": "both", "bracing.prestrain": 5e-4, "bracing.ends_at": "supports",
    "bracing.section.radius": 0.003, "bracing.material.preset": "spring-steel",
    "bracing.material.youngs_modulus": 160e9,
}  # fmt: skip
PINNED = {"pop_up.ends": "pinned", "strength.creep": 0.3}
COARSE = {"checks.stages": 2}


def run(*tables: dict[str, object], open: str = ALL, **how: object) -> rs.Form:
    given = {key: value for table in tables for key, value in table.items()}
    return rs.Job.load({**given, **SNOW, **COARSE, "design.open": open}).run(**how)  # type: ignore[arg-type]


@cache
def small() -> rs.Form:
    return run(SMALL)


def weakest(form: rs.Form) -> float:
    """Times the worst combination that a form carries with imperfections, checked again."""
    loads = form.case.built_loads()
    assert loads is not None
    shells = [shell for by_ends in rs.check_loads(form, loads).shells.values() for shell in by_ends.values()]
    known = [f for s in shells for f in (s.limit_factor, s.imperfect_factor) if f is not None]
    return min(known)


def permanent(form: rs.Form) -> float:
    """What a form with its bracing uses of its permanent strength before loads act, checked again."""
    loads = form.case.built_loads()
    assert loads is not None
    shells = [shell for by_ends in rs.check_loads(form, loads).shells.values() for shell in by_ends.values()]
    return max(shell.utilisations.permanent or 0.0 for shell in shells)


@pytest.mark.slow
def test_a_dome_left_open_comes_to_stand_with_its_reserve_and_is_good() -> None:
    form = small()
    assert form.verdict.level == "good"
    assert weakest(form) >= 1.5
    assert form.design is not None
    assert form.design.found
    codes = [finding.code for finding in form.verdict.findings]
    assert {"designed", "assumed_creep"} <= set(codes)


@pytest.mark.slow
def test_the_case_of_a_design_is_decided_and_gives_the_same_shell_without_a_search() -> None:
    form = small()
    assert form.case.design.open == ()
    assert form.case.left_open == ()
    again = rs.Job.load(form.case.to_toml()).run(until="pop-up")
    assert again.design is None
    assert again.rod == form.rod
    assert weakest(again) == pytest.approx(weakest(form), rel=0.01)  # of two modes alike any mixture is found


@pytest.mark.slow
def test_steps_are_announced_in_a_line_each_and_kept() -> None:
    lines: list[str] = []
    form = run(SMALL, announce=lines.append)
    assert form.design is not None
    said = [line for line in lines if line.startswith("design: ")]
    assert [line.removeprefix("design: ").split(": ")[0] for line in said] == [step.words for step in form.design.steps]
    assert form.design.steps[-1].known_by == "checks"
    assert rs.Results.of(form.archive().results.plain()).design == form.design


@pytest.mark.slow
def test_the_thickest_tube_that_holds_is_taken_as_close_as_it_takes() -> None:
    """Known of tubes 32 x 3 with these cables: .8 m apart the dome falls at .75, .6 m at 1.26, .5 m at 1.55."""
    form = run(DOME, CABLES, PINNED, open="section, spacing")
    assert form.design is not None
    by_spacing = {step.spacing: step for step in form.design.steps}
    assert form.rod.section == Tube(0.016, 0.003)
    assert 0.4 <= form.layout.spacing[0] <= 0.52
    assert weakest(form) >= 1.5
    assert all((step.factor or 0.0) < 1.5 for spacing, step in by_spacing.items() if (spacing or 0.0) > 0.52)


@pytest.mark.slow
def test_where_nothing_stands_the_next_sizes_on_both_sides_fail_for_the_reasons_given() -> None:
    form = run(DOME, CABLES, PINNED, {"layout.spacing": 0.8}, open="section")
    assert form.design is not None
    assert not form.design.found
    assert form.verdict.level == "unbuildable"
    assert form.design.limits in form.verdict.reasons[0]
    assert form.rod.section == Tube(0.016, 0.003)
    assert weakest(form) == pytest.approx(0.75, abs=0.01)
    sizes = TRADE_SIZES["gfrp"]
    k = sizes.index(form.rod.section)
    others = [
        rs.Job.load({**DOME, **CABLES, **PINNED, **SNOW, "layout.spacing": 0.8, **made_of(sizes[j])}).run(
            until="pop-up"
        )
        for j in (k - 1, k + 1)
    ]
    assert weakest(others[0]) < 1.5
    assert permanent(others[1]) > 1
    named = re.search(r"radius of ([\d.]+) m at (-?[\d.]+), (-?[\d.]+) m allows (.+), stability asks for (.+): make it "
                      r"flatter than ([\d.]+) m", form.design.limits)  # fmt: skip
    assert named is not None
    assert named[4] == size_text(form.rod.section)
    bound = next(size for size in sizes if size_text(size) == named[5])
    enough = rs.Job.load({**DOME, **CABLES, **PINNED, **SNOW, "layout.spacing": 0.8, **made_of(bound)})
    thicker = enough.run(until="pop-up")
    assert weakest(thicker) >= 1.3  # by the share that imperfections leave of the linear factor
    assert permanent(thicker) == pytest.approx(float(named[6]) / float(named[1]), rel=0.02)
    sharpest = thicker.checks.bending["pinned"]
    assert float(named[1]) == pytest.approx(1 / sharpest.curvature.max(), rel=0.05)


def made_of(section: Section) -> dict[str, object]:
    return {f"rod.section.{key}": value for key, value in vars(section).items()} | {"rod.section.kind": section.kind}


def test_thin_rods_get_thin_ropes() -> None:
    ropes = [rs.Job.load("pavilion", bracing_keys("cables", depth)).case.bracing for depth in (0.02, 0.032)]
    assert [rope.rod.section.depth for rope in ropes] == pytest.approx([0.004, 0.006])  # type: ignore[union-attr]
    assert all(rope.prestrain == 5e-4 for rope in ropes)  # type: ignore[union-attr]


@pytest.mark.parametrize(
    ("tables", "sentence"),
    [
        ({**SMALL, **SNOW, **TUBE}, "design.open has section, which the case gives (rod.section)"),
        ({**SMALL, **SNOW, **CABLES}, "design.open has bracing, which the case gives (bracing)"),
        ({**SMALL, **SNOW, "layout.spacing": 0.5}, "design.open has spacing, which the case gives (layout.spacing)"),
        (SMALL, "design.open needs loads"),
        ({**SMALL, **SNOW, "rod.material.preset": "rubber"}, "no sizes of this material are known"),
    ],
)
def test_what_cannot_be_designed_is_refused(tables: dict[str, object], sentence: str) -> None:
    with pytest.raises(InputError, match=re.escape(sentence)):
        rs.Job.load({**tables, "design.open": ALL}).run()


def test_out_of_time_before_anything_was_found_is_said() -> None:
    with pytest.raises(OutOfTimeError):
        run(SMALL, time_limit=1e-9)


def test_a_creep_that_is_taken_is_announced_and_one_that_is_given_stays() -> None:
    lines: list[str] = []
    job = rs.Job.load({**SMALL, **SNOW, "design.open": ALL, "strength.creep": 0.4})
    with pytest.raises(KeyboardInterrupt):
        job.run(announce=lines.append, progress=_interrupting)
    assert not lines
    job = rs.Job.load({**SMALL, **SNOW, "design.open": ALL})
    with pytest.raises(KeyboardInterrupt):
        job.run(announce=lines.append, progress=_interrupting)
    assert lines == [f"creep of gfrp taken as {CREEP['gfrp']:g}: ask its maker (strength.creep)"]


def _interrupting(stage: str, detail: str, residual: float) -> None:
    if stage == "pop-up":
        raise KeyboardInterrupt


def test_the_usual_loads_are_those_of_the_code() -> None:
    case = rs.Job.load({**SMALL, **usual_loads("0.5 kN/m2", "0.4 kN/m2")}).case
    loads = case.built_loads()
    assert loads is not None
    assert loads.combinations["permanent"] == {"own": 1.35}
    assert loads.combinations["winter"] == {"own": 1.35, "snow": 1.5}
    storms = {name: factors for name, factors in loads.combinations.items() if name.startswith("storm")}
    assert len(storms) == 4
    wind = next(load for name, load in loads.loads.items() if name.startswith("wind, "))
    assert isinstance(wind, rs.Wind)
    assert wind.coefficient == "dome"


@pytest.mark.parametrize(("shares", "helps"), [((0.5, 0.52), False), ((0.5, 0.7, 0.9), True)])
def test_rods_are_set_closer_only_while_that_helps_a_shell_that_falls_under_its_weight(
    shares: tuple[float, ...], helps: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """By what the estimate says of each spacing in turn; nothing is computed of them."""
    form, left = rs.Job.load({**SMALL, **PINNED, **COARSE}).run(until="pop-up"), [*shares]

    def estimated(stages: object, loads: object, **how: object) -> Estimate:
        bare = left.pop(0) if len(left) > 1 else left[0]
        return Estimate({"winter": 0.01}, bare, 0.9, (0.0, 0.0), 2.0)

    monkeypatch.setattr(design, "estimate", estimated)
    asked = rs.Job.load({**SMALL, **SNOW, "design.open": ALL}).case
    search = design.Search(asked, lambda case, earlier: form, lambda *said: None, lambda sentence: None)
    tried = [each for each in search._grids() if search._stands(*each) is None]
    assert (len({spacing for spacing, _ in tried}) > 2) == helps
    assert "falls under its own weight before it is braced" in search._limits()


@pytest.mark.parametrize(
    ("codes", "thinner"), [(("erection_strength",), True), (("erection_strength", "snaps"), False)]
)
def test_thinner_rods_are_tried_for_strength_while_erected_but_not_where_the_shell_snaps_on_the_way(
    codes: tuple[str, ...], thinner: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What a shell that snaps does to its rods hardly depends on their size, and another way spares them."""
    form = rs.Job.load({**SMALL, **PINNED, **COARSE}).run(until="pop-up")
    findings = [Finding(code=code, level="check", figure=3.0, limit=1.0) for code in codes]
    checked = SimpleNamespace(verdict=SimpleNamespace(findings=findings))
    depths: list[float] = []

    def run(case: Case, earlier: rs.Form | None) -> rs.Form:
        depths.append(case.build().rod.section.depth)
        return form

    known = Estimate({"winter": 5.0}, 5.0, 0.9, (0.0, 0.0), 2.0)
    monkeypatch.setattr(design, "estimate", lambda stages, loads, **how: known)
    monkeypatch.setattr(design.Search, "_followed", lambda search, tried: (2.0, 0.9, 0.0))
    monkeypatch.setattr(rs.Form, "finished", lambda form, progress: checked)
    asked = rs.Job.load({**SMALL, **SNOW, "design.open": ALL}).case
    search = design.Search(asked, run, lambda *said: None, lambda sentence: None)
    found = search._stands(0.8, "none")
    assert (found is None) == thinner
    assert any(depth <= depths[0] / 3 * 1.01 for depth in depths) == thinner
