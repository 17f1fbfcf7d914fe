"""A job is a value: the same however it is written; run again from an earlier form, only what changed is run."""

import pickle
import re
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.case import BUILT_IN
from rodshell.cli import main
from rodshell.errors import InputError, OutOfTimeError
from rodshell.run import STAGES
from tests.acceptance.targets_broken import as_obj
from tests.targets.meshes import sheet

SIZE = 0.2
ROD = rs.Rod(rs.Circle(1e-3), rs.Material(1e6, 1e3))
COARSE = {"layout.rods": "auto", "layout.length": "auto", "layout.spacing": "60 mm", "layout.edge": "20 mm"}
COARSE |= {"checks.stages": 2}
ALL = tuple(stage for stage in STAGES if stage != "refine")[:-1]  # files are written when they are asked for
SAME = 1e-9 * SIZE  # Newton's last step is shorter than 1e-6 of the size, the error left its square


def dome(**changes: object) -> rs.Job:
    return rs.Job.load("hemisphere", COARSE, **changes)


@pytest.fixture(scope="module")
def earlier() -> rs.Form:
    return dome().run()


def test_a_form_that_was_saved_and_shown_is_pickled(earlier: rs.Form, tmp_path: Path) -> None:
    earlier.save(tmp_path / "dome")
    page = earlier._repr_html_()
    same = pickle.loads(pickle.dumps(earlier))
    assert same.archive() == earlier.archive()
    assert same._repr_html_() == page
    assert pickle.loads(pickle.dumps(earlier.archive())) == earlier.archive()


# A value


@pytest.mark.parametrize("name", [name for name in BUILT_IN if name != "heightfield"])
def test_a_job_its_text_its_pickle_and_its_copy_are_equal(name: str) -> None:
    job = rs.Job.load(name)
    for same in (rs.Job.load(name), rs.Job.load(job.to_toml()), pickle.loads(pickle.dumps(job)), job.changed()):
        assert same == job
        assert hash(same) == hash(job)
        assert same.to_toml() == job.to_toml()
    assert job.changed(drawings__author="Ada") != job
    assert job != name


def test_options_a_file_and_python_make_the_same_job(tmp_path: Path) -> None:
    (tmp_path / "roof.toml").write_text(
        '[layout]\nspacing = "50 mm"\nrotate = "10 deg"\n[rod.material]\npreset = "gfrp"'
    )
    loaded = rs.Job.load(tmp_path / "roof.toml", pop_up__ends="pinned")
    tables = {"layout": {"spacing": 0.05, "rotate": "10 deg"}, "rod.material.preset": "gfrp", "pop_up.ends": "pinned"}
    assert loaded == rs.Job.load(tables)
    assert loaded == rs.Job.load("layout = {spacing = 0.05}\nrod.material.preset = 'gfrp'", {"layout.rotate": "10 deg"},
                                 pop_up__ends="pinned")  # fmt: skip
    changes = {"layout": {"rotate": "10 deg"}, "pop_up.ends": "pinned"}
    assert rs.Job.load("layout.spacing = 0.05\nrod.material.preset = 'gfrp'").changed(changes) == loaded


def test_a_job_of_objects_is_the_job_of_their_case() -> None:
    layout = rs.GridLayout.orthogonal(rods=(17, 17), spacing=0.03, length=1.2, edge=0.005)
    job = rs.Job(rs.Hemisphere(SIZE), layout, ROD)
    assert job == rs.Job.load("hemisphere")
    other = rs.Job(
        rs.Hemisphere(SIZE), layout, ROD,
        method=rs.Gravity(acceleration=1.6), anchor=(0.1, 0.0), ends="pinned", joint=rs.Pin(mass=0.1),
        options=rs.OutputOptions(strength=3e7, stages=2),
    )  # fmt: skip
    asked = {"drape.method": "gravity", "drape.gravity": 1.6, "drape.anchor": "0.1, 0", "pop_up.ends": "pinned"}
    asked |= {"joint.kind": "pin", "joint.mass": "100 g", "checks.strength": "30 MPa", "checks.stages": 2}
    assert other == job.changed(asked)
    assert other.case.build().method == rs.Gravity(acceleration=1.6)
    seams = rs.Job(rs.Hemisphere(SIZE), rs.GridLayout.orthogonal(spacing=0.03, edge=0.005), ROD, rotate="auto",
                   seams=[[(-1, 0), (1, 0)]], patches={"B": rs.PatchLayout(spacing=(0.02, 0.02))})  # fmt: skip
    again = rs.Job.load(seams.to_toml())
    assert again == seams
    assert again.case.layout.rotate == "auto"
    assert again.case.seams.patch_layouts() == {"B": rs.PatchLayout(spacing=(0.02, 0.02))}


def bowl(x, y):
    return 0.1 - x * x - y * y


def mesh() -> rs.Target:
    x = np.linspace(-1, 1, 9)
    points = np.array([(a, b, 0.5 * np.cos(a) * np.cos(b)) for a in x for b in x])
    corner = (np.arange(8)[:, None] * 9 + np.arange(8)).ravel()
    faces = np.column_stack([corner, corner + 9, corner + 10, corner, corner + 10, corner + 1])
    return rs.Freeform.of(points, faces.reshape(-1, 3))


LAYOUT = rs.GridLayout.orthogonal(spacing=0.06, edge=0.02)
FUNCTION = rs.HeightField(function=bowl, domain=rs.Disc(SIZE))
HELD = {
    "a Python function": (lambda: rs.Job(FUNCTION, LAYOUT, ROD), "the Python function .*bowl"),
    "a mesh made in Python": (lambda: rs.Job(mesh(), LAYOUT, ROD), "a mesh of 81 vertices made in Python"),
    "linkers of their own rod": (
        lambda: rs.Job(rs.Hemisphere(SIZE), LAYOUT, ROD, joint=rs.Linker(rod=ROD)),
        "joints with linkers of another rod",
    ),
    "unequal spacing": (
        lambda: rs.Job(rs.Hemisphere(SIZE), replace(LAYOUT, lines=((-0.05, 0.0, 0.06), ())), ROD),
        "a layout with lines at unequal spacing",
    ),
}


@pytest.mark.parametrize("name", HELD)
def test_what_no_case_can_describe_is_kept_as_it_is(name: str) -> None:
    make, words = HELD[name]
    job = make()
    assert job == pickle.loads(pickle.dumps(job)) or name.startswith("a ")  # another object is another target
    assert job.changed(pop_up__ends="pinned").changed(pop_up__ends="both") == job
    with pytest.raises(InputError, match=f"no case file can describe {words}"):
        job.to_toml()
    assert "\n" not in repr(job)


def test_rods_are_left_out_by_name() -> None:
    job = rs.Job(rs.Hemisphere(SIZE), replace(LAYOUT, left_out=("U02", "V03")), ROD, ends="pinned")
    assert rs.Job.load(job.to_toml()) == job
    assert job.changed(layout__left_out="").changed(layout__left_out="U02, V03, U02") == job
    whole, rest = (each.run(until="drape") for each in (job.changed(layout__left_out=[]), job))
    names = [rod.name for rod in whole.footprint.rods]
    assert [rod.name for rod in rest.footprint.rods] == [name for name in names if name not in ("U02", "V03")]
    with pytest.raises(
        InputError, match=r'layout.left_out: there is no rod "U99": the rods are U01 to U11 and V01 to V11$'
    ):
        job.changed(layout__left_out="U02, U99").run(until="drape")
    with pytest.raises(InputError, match=r"layout.left_out = 3: give names"):
        job.changed(layout__left_out=3)


def test_a_form_without_pop_ups_saves_the_next_run_its_drape() -> None:
    job = rs.Job(rs.Hemisphere(SIZE), LAYOUT, ROD)
    grid = job.run(until="drape")
    assert not grid.popped
    assert grid.draped.report.converged
    form = job.run(warm_start=grid, until="pop-up")
    assert form.draped is grid.draped
    assert form == job.run(until="pop-up")  # bit for bit


def test_equality_of_targets_from_python_is_by_the_object() -> None:
    target = mesh()
    assert rs.Job(target, LAYOUT, ROD) == rs.Job(target, LAYOUT, ROD)
    assert rs.Job(target, LAYOUT, ROD) != rs.Job(mesh(), LAYOUT, ROD)
    assert len({rs.Job(target, LAYOUT, ROD), rs.Job(target, LAYOUT, ROD)}) == 1
    with pytest.raises(InputError, match=r"target.radius cannot be changed: it is a mesh .*: make a new job"):
        rs.Job(target, LAYOUT, ROD).changed(target__radius=1)


@pytest.mark.parametrize("rotate", [0.1, "auto"])
def test_a_heading_in_place_of_that_of_a_layout_that_no_key_describes_counts(rotate: float | str) -> None:
    layout = replace(LAYOUT, lines=((-0.05, 0.0, 0.06), ()), rotate=0.3)
    form = rs.Job(rs.Ellipsoid(0.2, 0.15, 0.12), layout, ROD, rotate=rotate, ends="pinned").run(until="pop-up")
    decided = form.case.layout.rotate
    assert decided == (rotate if form.search is None else form.search.best.heading)
    assert form.layout == form.case.build().layout == replace(layout, rotate=decided)


@pytest.mark.parametrize(
    ("name", "changes"),
    [
        ("hemisphere", {"rod.material.shear": "1 MPa"}),
        ("pavilion", {"rod.material.poisson_ratio": 0.3}),
        ("pavilion", {"rod.material.shear": "1 GPa"}),
    ],
)
def test_shear_modulus_and_poisson_ratio_replace_each_other(name: str, changes: dict[str, object]) -> None:
    job = rs.Job.load(name).changed(changes)
    assert job == rs.Job.load(name, changes)
    material = job.case.rod.material
    assert (material.shear is None) == ("rod.material.poisson_ratio" in changes)
    both = {"rod.material.shear": "1 MPa", "rod.material.poisson_ratio": 0.3}
    with pytest.raises(InputError, match="leave one of them out"):
        job.changed(both)


def test_a_job_of_python_objects_runs_with_them(tmp_path: Path) -> None:
    form = rs.Job(FUNCTION, LAYOUT, ROD, ends="clamped", options=rs.OutputOptions(stages=0)).run()
    assert form.target is FUNCTION
    assert form.status == "converged"
    assert "no case file can give the Python function" in form.archive().case_toml
    frames = rs.Fall(stream=tmp_path / "frames", duration=0.01, every=2, time_step=0.005)
    job = rs.Job(rs.Hemisphere(SIZE), LAYOUT, ROD, method=frames)
    assert rs.Job.load(job.to_toml()).case.build().method == replace(frames, stream=None, every=1)
    assert job.case.build().method == frames


def test_the_case_kept_with_the_form_of_a_python_function_is_not_run_with_another_target(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    form = rs.Job(FUNCTION, LAYOUT, ROD, ends="clamped", options=rs.OutputOptions(stages=0)).run(until="pop-up")
    saved = str(form.save(tmp_path / "bowl"))
    assert rs.read(saved).case_toml == form.archive().case_toml
    for case in (f"{saved}/case.toml", form.archive().case_toml):
        with pytest.raises(InputError, match=r"be run again: no case file can describe the Python function .*bowl"):
            rs.Job.load(case)
    (tmp_path / "loads.toml").write_text('[[loads]]\nname = "own"\nkind = "self_weight"\n')
    loads, case = ("--loads", str(tmp_path / "loads.toml")), f"{saved}/case.toml"
    for arguments in (["check", saved, *loads], ["check", case, *loads], ["refine", saved], ["refine", case],
                      ["form", case]):  # fmt: skip
        assert main([*arguments, "--out", str(tmp_path / "again")]) == 2
        said = capsys.readouterr().err
        assert said.startswith("rodshell: error: this case cannot be run again: no case file can describe the Python")
        assert said.count("\n") == 1
    assert main(["export", saved, "--only", "csv"]) == 0
    assert main(["popup", saved, "--out", str(tmp_path / "popped"), "--only", "csv"]) in (0, 4)


@pytest.mark.parametrize(
    ("comment", "what"),
    [
        ("# the target was the Python function bowl: no case file can give it again\n", "the Python function bowl:"),
        (
            "# no case file can give the Python function bowl as a target again\n",
            "the Python function bowl as a target:",
        ),
        ("# no case file can give joints with linkers of another rod again\n", "joints with linkers of another rod:"),
    ],
)
def test_the_comments_that_earlier_versions_kept_in_place_of_a_case_are_refused_too(
    comment: str, what: str, tmp_path: Path
) -> None:
    """As they were written from c6f8537 and from 0177034 on; a comment of one's own still is an empty case."""
    (tmp_path / "case.toml").write_text(comment)
    for case in (tmp_path / "case.toml", comment):
        with pytest.raises(InputError, match=f"cannot be run again: no case file can describe {what}"):
            rs.Job.load(case)
    assert rs.Job.load("# no case file can give this\n") == rs.Job.load("# empty\n")


def test_a_job_is_read_only_and_says_what_it_is_in_one_line() -> None:
    job = dome(seams__lines="-1,0; 1,0")
    with pytest.raises(AttributeError, match=r"use job.changed\(...\)"):
        job.case = None  # type: ignore[misc]
    assert repr(job) == (
        "<rodshell.Job: hemisphere, spacing 60 mm x 60 mm, 1 seam, bound drape, ball joints, ends pinned and clamped>"
    )


def test_bad_changes_are_one_sentence() -> None:
    with pytest.raises(InputError, match=r"unknown key layout.spaceing: did you mean layout.spacing\?"):
        dome(layout__spaceing=1)
    with pytest.raises(InputError, match=r"unknown key layout.rotatee: did you mean layout.rotate\?"):
        dome().changed(layout__rotatee="10 deg")
    with pytest.raises(InputError, match="until must be"):
        dome().run(until="checks")


def test_a_file_of_a_target_may_be_named_from_anywhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "roof.obj").write_text("")
    monkeypatch.chdir(tmp_path)
    assert (
        rs.Job.load("roof.obj") == rs.Job.load(tmp_path / "roof.obj") == rs.Job.load(rs.Job.load("roof.obj").to_toml())
    )


# Run again: only what changed

CHANGES = {
    "drawings": ({"drawings.author": "Ada", "drawings.paper": "A1"}, ALL),
    "fabrication": ({"fabrication.end_allowance": "10 mm"}, ALL[:5]),
    "a strength": ({"checks.strength": "30 MPa"}, ALL[:4]),
    "stages of the checks": ({"checks.stages": 1}, ALL[:4]),
    "ends": ({"pop_up.ends": "clamped"}, ALL[:3]),
    "heading": ({"layout.rotate": "10 deg"}, ALL[:1]),
    "rod": ({"rod.section.radius": "1.2 mm"}, ALL[:1]),
    "joint": ({"joint.kind": "pin"}, ALL[:1]),
    "anchor": ({"drape.anchor": "20 mm, 0"}, ALL[:1]),
    "target": ({"target.radius": "210 mm"}, ()),
    "drawings and ends": ({"drawings.author": "Ada", "pop_up.ends": "pinned"}, ALL[:3]),
}


@pytest.mark.slow
@pytest.mark.parametrize("change", CHANGES)
def test_only_stages_from_the_first_changed_one_run_again_and_give_the_cold_result(
    change: str, earlier: rs.Form
) -> None:
    changes, reused = CHANGES[change]
    told = set[str]()
    job = earlier_job().changed(changes)
    warm = job.run(warm_start=earlier, progress=lambda stage, *_: told.add(stage))
    cold = job.run()
    assert warm.reused == reused
    assert cold.reused == ()
    runs = {"net": "drape", "drape": "drape", "pop-up": "pop-up", "self-weight": "checks", "deployment": "checks"}
    assert not {stage for stage in told if runs.get(stage, "checks") in reused}
    ours, theirs = warm.archive(), cold.archive()
    assert list(ours.states) == list(theirs.states)
    for name in ("flat", "draped", "popped_pinned", "popped_clamped"):
        if name in theirs.states:
            np.testing.assert_allclose(ours.states[name], theirs.states[name], rtol=0, atol=SAME)
    assert ours.case_toml == theirs.case_toml == job.to_toml()
    for key in ("drawings", "warnings", "status", "dropped"):
        assert getattr(ours.results, key) == getattr(theirs.results, key)
    assert ours.verdict.reasons == theirs.verdict.reasons  # with figures as they are shown
    assert [one.code for one in ours.verdict.findings] == [one.code for one in theirs.verdict.findings]
    made, wanted = warm.fabrication, cold.fabrication
    for name in ("end_allowance", "stock_length", "kerf"):
        assert getattr(made, name) == getattr(wanted, name)
    np.testing.assert_allclose(made.cut_length, wanted.cut_length, rtol=0, atol=SAME)


def earlier_job() -> rs.Job:
    return dome()


def test_ends_that_were_popped_up_before_are_taken_over(earlier: rs.Form) -> None:
    both, one = dome(), dome(pop_up__ends="clamped")
    first = one.run(until="pop-up")
    assert first.ends == ("clamped",)
    second = both.run(warm_start=first, until="pop-up")
    assert second.popped["clamped"] is first.popped["clamped"]
    assert list(second.popped) == ["pinned", "clamped"]
    assert second.reused == ALL[:3]
    assert one.run(warm_start=second).popped["clamped"] is first.popped["clamped"]


def test_an_unchanged_job_gives_an_equal_form_at_once(earlier: rs.Form) -> None:
    def none(stage: str, detail: str, residual: float) -> None:
        raise AssertionError(stage)

    again = dome().run(warm_start=earlier, progress=none)
    assert again == earlier
    assert hash(again) == hash(earlier)
    assert again.reused == ALL
    assert again.checks is earlier.checks
    assert earlier != dome(layout__rotate="1 deg").run(until="pop-up")
    assert earlier != "a form"


def test_checks_that_were_not_made_are_not_reused() -> None:
    first = dome().run(until="pop-up")
    assert first.known_checks is None
    again = dome().run(warm_start=first)
    assert again.reused == ALL[:4]
    assert again.known_checks is not None
    assert first.checks.bending.keys() == again.checks.bending.keys()


def test_checks_of_other_options_are_not_taken_for_those_of_the_case(earlier: rs.Form) -> None:
    other = replace(earlier.options, stages=1, fabrication=rs.Fabrication(end_allowance=0.05))
    form = earlier.with_options(other)
    assert form.case == earlier_job().changed({"checks.stages": 1, "fabrication.end_allowance": "50 mm"}).case
    assert form != earlier
    assert len(form.checks.deployment.share) < len(earlier.checks.deployment.share)
    assert form.fabrication.cut_length[0] > earlier.fabrication.cut_length[0]
    again = earlier_job().run(warm_start=form)
    assert again.reused == ALL[:4]
    np.testing.assert_array_equal(again.checks.deployment.share, earlier.checks.deployment.share)
    np.testing.assert_array_equal(again.fabrication.cut_length, earlier.fabrication.cut_length)
    assert earlier.with_options(earlier.options) == earlier


def write_roof(file: Path, height: float) -> None:
    x = np.linspace(-SIZE, SIZE, 21)
    rows = [",".join(f"{height * (1 - a * a / SIZE**2) * (1 - b * b / SIZE**2):.6f}" for a in x) for b in x]
    file.write_text("\n".join(rows))


def test_a_target_object_whose_file_changes_stays_with_what_the_file_held(tmp_path: Path) -> None:
    file = tmp_path / "roof.csv"
    write_roof(file, 0.1)
    before = file.read_bytes()
    target = rs.heights_from(file, size=(0.4, 0.4), height=1.0)
    job = rs.Job(target, LAYOUT, ROD, ends="pinned", options=rs.OutputOptions(stages=0))
    write_roof(file, 0.08)
    form = job.changed(drawings__author="Ada").run(until="pop-up")
    assert list(form.inputs.values()) == [before]
    other = rs.Job.load(job.to_toml()).run(warm_start=form, until="pop-up")
    assert other.reused == ()
    assert np.ptp(other.popped["pinned"].positions[:, 2]) < np.ptp(form.popped["pinned"].positions[:, 2]) - 0.01


def test_a_file_that_changed_is_read_again(tmp_path: Path) -> None:
    def write(height: float) -> None:
        write_roof(tmp_path / "roof.csv", height)

    write(0.1)
    tables = {"target": {"kind": "heights", "file": str(tmp_path / "roof.csv"), "size": "0.4, 0.4", "height": "1 m"}}
    job = rs.Job.load({**tables, "layout": {"spacing": 0.06}, "rod.section.radius": "1 mm", "pop_up.ends": "pinned"},
                      {"rod.material.youngs_modulus": 1e6, "checks.stages": 0})  # fmt: skip
    first = job.run(until="pop-up")
    same = job.run(warm_start=first, until="pop-up")
    assert same.reused == ALL[:4]
    assert same.target is first.target
    write(0.08)
    other = job.run(warm_start=first, until="pop-up")
    assert other.reused == ()
    assert np.ptp(other.popped["pinned"].positions[:, 2]) < np.ptp(first.popped["pinned"].positions[:, 2]) - 0.01


@pytest.mark.slow
def test_what_the_time_limit_cut_short_is_run_again(monkeypatch: pytest.MonkeyPatch) -> None:
    clock = iter(np.arange(0.0, 1e6))
    monkeypatch.setattr("rodshell.progress.monotonic", lambda: next(clock))
    job, whole = dome(), dome().run()
    limit, seen = 0.5, set[tuple[str, ...]]()
    while True:
        limit += 1 if limit < 30 else 9
        try:
            part = job.run(time_limit=limit)
        except OutOfTimeError:
            continue
        if part.archive().results.plain()["status"] == "converged":
            break
        again = job.run(warm_start=part)
        seen.add(again.reused)
        for ends, shell in whole.popped.items():
            np.testing.assert_allclose(again.popped[ends].positions, shell.positions, rtol=0, atol=SAME)
        assert again.archive().results.plain()["status"] == "converged"
    assert {ALL[:1], ALL[:3], ALL[:4]} <= seen


def test_a_search_is_not_repeated_and_decides_the_same() -> None:
    job = rs.Job.load("ellipsoid", COARSE, layout__rotate="auto", pop_up__ends="clamped")
    first = job.run(until="pop-up")
    assert first.search is not None
    assert first.case.layout.rotate == first.search.best.heading
    told = set[str]()
    again = job.changed(drawings__author="Ada").run(warm_start=first, progress=lambda stage, *_: told.add(stage))
    assert "search" not in told
    assert again.search is first.search
    assert again.reused == ALL[:4]


@pytest.mark.slow
def test_patches_are_taken_over_too() -> None:
    job = dome(seams__lines="-1,-1; 1,1", checks__stages=0)
    first = job.run()
    assert [patch.name for patch in first.patches] == ["A", "B"]
    assert job.run(warm_start=first).reused == ALL
    pinned = job.changed(pop_up__ends="pinned").run(warm_start=first)
    assert pinned.reused == ALL[:3]
    assert pinned.popped["pinned"] is first.popped["pinned"]
    assert np.array_equal(pinned.patches[1].popped["pinned"].state, first.patches[1].popped["pinned"].state)
    turned = job.changed(layout__rotate="5 deg")
    warm, cold = turned.run(warm_start=first, until="pop-up"), turned.run(until="pop-up")
    assert warm.reused == ALL[:1]
    np.testing.assert_allclose(warm.popped["clamped"].positions, cold.popped["clamped"].positions, rtol=0, atol=SAME)


@pytest.mark.slow
def test_a_table_of_rods_is_a_job_too(earlier: rs.Form, tmp_path: Path) -> None:
    folder = earlier.save(tmp_path / "dome", kinds=["csv"])
    job = rs.Job.of_table(folder / "schedule" / "rods.csv", rod__section__radius="1 mm", checks__stages=1)
    assert job == rs.Job.of_table(folder / "schedule" / "rods.csv", rod__section__radius="1 mm", checks__stages=1)
    assert job != rs.Job.of_table(folder, rod__section__radius="1 mm", checks__stages=1)
    form = job.run()
    assert form.from_table
    assert form.agreement == {}
    assert form.archive().case_toml == ""
    assert form.archive().name == "rods"
    assert job.run(warm_start=form).reused == ("target", "pop-up", "checks", "fabrication", "loads")
    thicker = job.changed(rod__section__radius="1.1 mm").run(warm_start=form)
    assert thicker.reused == ("target",)
    assert thicker.rod.section.radius == 1.1e-3
    assert dome().run(warm_start=form, until="pop-up").reused == ()
    for read in (lambda: form.target, lambda: form.layout, lambda: form.draped):
        with pytest.raises(InputError, match="a table of rods has no target"):
            read()
    with pytest.raises(InputError, match="no case file can describe a table of"):
        job.to_toml()


@pytest.mark.parametrize("changes", [{"pop_up.ends": "clamped"}, {"layout.rotate": 1}, {"drape.method": "gravity"}])
def test_keys_that_a_table_of_rods_does_not_have_are_refused(
    changes: dict[str, object], earlier: rs.Form, tmp_path: Path
) -> None:
    table = earlier.save(tmp_path / "dome", kinds=["csv"]) / "schedule" / "rods.csv"
    job = rs.Job.of_table(table)
    for make in (lambda: rs.Job.of_table(table, changes), lambda: job.changed(changes)):
        with pytest.raises(InputError, match=f"{next(iter(changes))} = .*a table of rods does not use this key"):
            make()


def test_the_command_line_runs_the_job(tmp_path: Path) -> None:
    options = [word for key, value in COARSE.items() for word in (f"--{key}", str(value))]
    assert (
        main(["form", "hemisphere", *options, "--only", "csv", "--out", str(tmp_path / "out"), "-q"]) == 4
    )  # it falls under its own weight
    saved, made = rs.read(tmp_path / "out"), dome().run().archive()
    assert saved.case_toml == made.case_toml
    for name, state in made.states.items():
        np.testing.assert_array_equal(saved.states[name], state)
    ours, theirs = made.results.plain(), saved.results.plain()
    assert {key for key in ours if ours[key] != theirs[key]} <= {"drape", "pop_up"}  # seconds


# The form


@pytest.mark.slow
def test_a_form_of_patches_means_the_same_by_the_same_names() -> None:
    one, two = dome(pop_up__ends="pinned").run(), dome(pop_up__ends="pinned", seams__lines="-1,-1; 1,1").run()
    for form, count in ((one, 1), (two, 2)):
        assert len(form.patches) == count
        nodes = form.footprint.mesh.node_count
        assert form.popped["pinned"].positions.shape == (nodes, 3)
        assert len(form.agreement["pinned"].gaps) == nodes
        assert len(form.checks["pinned"].bending.curvature) == len(form.footprint.mesh.rod_nodes)
        assert len(form.boundary.points) == 2 * len(form.footprint.rods)
        assert form.checks["pinned"].reactions.forces.shape == (2 * len(form.footprint.rods), 3)
        assert len(form.fabrication.cut_length) == len(form.footprint.rods)
        assert form.verdict.level in ("good", "check", "unbuildable")
        assert "\n" not in repr(form)
        assert len(repr(form)) < 200
    assert one.draped is one.patches[0].draped
    assert two.meetings
    with pytest.raises(InputError, match=r"this form has 2 patches: take patches\[k\].draped"):
        two.draped  # noqa: B018
    with pytest.raises(KeyError, match=r"no shell with clamped ends was checked: .*; checked: pinned"):
        one.checks["clamped"]


def test_a_notebook_shows_the_shell_and_its_verdict(earlier: rs.Form) -> None:
    shown = earlier._repr_html_()
    assert "<iframe" in shown
    assert f"<b>{earlier.verdict.level}</b>" in shown
    assert "&lt;rodshell.Form of hemisphere" in shown


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda job: job.changed(layout=3), r"layout = 3: must be a table; \[layout\] has kind, rods"),
        (lambda job: job.changed({3: 4}), "words such as target.radius, not 3"),
        (lambda job: job.run(time_limit="60 s"), 'time_limit must be a number in s, not "60 s"'),
        (lambda _: rs.Job.load(""), "the name of the case is empty"),
        (lambda _: rs.Job.load(3), "the case must be the name of a built-in case"),
        (lambda _: rs.Job.of_case("pavilion"), "case must be the case of a form"),
        (lambda _: rs.Job.of_table(3), "source must be the path of a file, not 3"),
    ],
)
def test_arguments_of_a_wrong_kind_are_one_sentence(call: Callable[[rs.Job], object], message: str) -> None:
    with pytest.raises(InputError, match=message):
        call(dome())


def test_a_form_refuses_options_of_a_wrong_kind(earlier: rs.Form) -> None:
    with pytest.raises(InputError, match="options must be a rodshell OutputOptions, not 3"):
        earlier.archive(options=3)  # type: ignore[arg-type]


def test_a_form_is_shown_by_the_name_of_its_case(earlier: rs.Form) -> None:
    assert repr(rs.Job.of_case(earlier.case).changed(drawings__name="my dome").run(warm_start=earlier)).startswith(
        "<rodshell.Form of my dome: "
    )


def test_the_ready_progress_says_the_stages(capsys: pytest.CaptureFixture[str]) -> None:
    dome(pop_up__ends="pinned").run(progress=rs.bar, until="pop-up")
    assert capsys.readouterr().err.splitlines() == [f"rodshell: {stage}" for stage in ("net", "drape", "pop-up")]


def test_a_progress_that_cannot_be_called_is_refused_before_any_work(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("rodshell.job.Run", None)
    for progress in (None, 1.0, "bar", [], int, lambda: None, np.zeros(3)):
        with pytest.raises(InputError, match="progress must be a function of stage, detail and residual"):
            rs.Job.load("hemisphere").run(progress=progress)  # type: ignore[arg-type]


def test_a_job_without_memory_ends_in_a_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    def too_large(run: object) -> None:
        np.empty(2**55)

    monkeypatch.setattr("rodshell.run.Run.form", too_large)
    with pytest.raises(rs.RodshellError, match=r"out of memory .Unable to allocate.*: give fewer rods"):
        rs.Job.load("hemisphere").run()


def test_the_time_limit_holds_before_the_rod_is_sized_and_within_the_net(monkeypatch: pytest.MonkeyPatch) -> None:
    now, calls = [0.0], list[tuple[str, str]]()
    monkeypatch.setattr("rodshell.progress.monotonic", lambda: now[-1])

    def told(stage: str, detail: str, residual: float) -> None:
        calls.append((stage, detail))
        now.append(now[-1] + 1.0)

    roof = rs.Job.load("heightfield", target__formula="1 - x^2/9 - y^2/9", target__radius="2 m")
    where = ("preparing (net for the size of the rods)", "net (marching)", "net (marching in long steps)")
    for k, stage in enumerate(where):
        now.append(0.0)
        with pytest.raises(OutOfTimeError, match=rf"out of time after .* s in stage {re.escape(stage)}"):
            roof.run(progress=told, time_limit=k + 0.5)
    assert [detail for _, detail in calls].count("net for the size of the rods") == 3


def test_the_time_limit_holds_at_each_step_of_reading_and_fitting_a_mesh(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With as many fits as the mesh needs, each with its rings past the edge, and those of pieces between creases."""
    x, faces = sheet(lambda x, y: 2.5 - 0.05 * (x**2 + y**2) + np.exp(-((x - 1.3) ** 2) / 0.5), 5.0, 33)
    (tmp_path / "bump.obj").write_bytes(as_obj(x, faces))
    x, faces = sheet(lambda x, y: 3 - 0.6 * np.abs(x) - 0.03 * y**2, 5.0, 21)
    (tmp_path / "roof.obj").write_bytes(as_obj(x, faces))

    class PreparedError(Exception):
        pass

    def told(stage: str, detail: str, residual: float) -> None:
        if stage != "preparing":
            raise PreparedError
        calls.append(detail)

    for name, seams in (("bump", {}), ("roof", {"seams.lines": "0,-6; 0,6"})):
        job, calls = rs.Job.load(tmp_path / f"{name}.obj", {"target.unit": "m"} | seams), list[str]()
        with pytest.raises(PreparedError):
            job.run(progress=told)
        steps = calls.copy()
        fits = [step for step in steps if step.startswith("fit of the mesh, cubics ")]
        assert steps[0] == f'reading "{name}.obj"'
        assert steps[1].startswith("mesh of ")
        assert len(set(fits)) >= (2 if name == "bump" else 1)  # pieces of one size have cubics of one spacing
        assert len(fits) >= 2 * 6  # of each fit: three, and rings
        for k in (*range(4), *range(4, len(steps), 5)):
            clock = iter(range(1000))
            monkeypatch.setattr("rodshell.progress.monotonic", lambda clock=clock: float(next(clock)))
            where = re.escape(f"in stage preparing ({steps[k]})")
            with pytest.raises(OutOfTimeError, match=f"out of time after {k + 0.5} s {where}"):
                job.run(time_limit=k + 0.5)


def test_out_of_time_in_the_fit_of_a_mesh_is_said_with_exit_code_3(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    clock = iter(range(1000))
    monkeypatch.setattr("rodshell.progress.monotonic", lambda: float(next(clock)))
    (tmp_path / "dome.obj").write_bytes(as_obj(*sheet(lambda x, y: 2.5 - 0.05 * (x**2 + y**2), 5.0, 17)))
    asked = ["form", str(tmp_path / "dome.obj"), "--unit", "m", "--out", str(tmp_path / "dome"), "-q"]
    assert main([*asked, "--time-limit", "2.5 s"]) == 3
    said = capsys.readouterr().err
    assert "out of time after 2.5 s in stage preparing (fit of the mesh, cubics " in said
    assert "nothing was found yet that could be written" in said
    assert not (tmp_path / "dome").exists()


FINE = {"layout.spacing": "20 um", "layout.edge": "auto", "rod.section.radius": "3 um"}


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"layout.rods": "4000x4000"}, "a grid of 8000 rods; at most 5000 are joined: .*, or set RODSHELL_LIMITS=2"),
        (FINE, "the net needs more than 3\\d+ x 3\\d+ lines, .*, or set"),
        ({"layout.edge": "1 um"}, "the net would have 7\\d+ x 7\\d+ nodes, .*, or set RODSHELL_LIMITS="),
    ],
)
def test_what_would_fill_the_memory_is_counted_before_it_is_made(keys: dict[str, object], said: str) -> None:
    whole = {"layout.rods": "auto", "layout.length": "auto"}
    with pytest.raises(InputError, match=said):
        rs.Job.load("hemisphere", whole | keys).run(until="drape")
