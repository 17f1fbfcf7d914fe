"""Refinement as users meet it: as a key of a case, as a command, in Python, and in the files of the result."""

import json
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.case.stage_tables import FAMILIES as WORDS
from rodshell.cli import main
from rodshell.formfinding.pipeline import Stages
from rodshell.output.viewer.scene import scene_of
from rodshell.refining import acceptance
from rodshell.refining.gates import Gates
from rodshell.refining.refine import FAMILIES

COARSE = ("--layout.spacing", "60 mm", "--checks.stages", "0", "--only", "csv", "--quiet")
PINNED = {"layout.spacing": "60 mm", "checks.stages": 0, "pop_up.ends": "pinned"}


@cache
def job(vary: str = "taper", case: str = "hemisphere") -> rs.Job:
    return rs.Job.load(case, layout__spacing="60 mm", checks__stages=0, pop_up__ends="pinned", refine__vary=vary)


@cache
def form() -> rs.Form:
    return job().run(until="pop-up")


def test_words_of_the_case_are_the_families_that_there_are() -> None:
    assert set(WORDS) == set(FAMILIES)


def test_a_case_with_refinement_gives_the_refined_form() -> None:
    refined = form().refined
    assert refined is not None
    assert refined.changed
    assert form().agreement["pinned"] is refined.gap_after
    assert refined.gap_after.rms < refined.gap_before.rms / 5
    assert all(rod.profile is not None for rod in form().footprint.rods)
    assert all(rod.profile is None for rod in refined.before.footprint.rods)


def test_the_result_has_the_figures_before_and_after_and_the_refined_rods() -> None:
    results, refined = form().results(), form().refined
    assert refined is not None
    found = results.plain()["refinement"]
    assert list(found) == [
        "vary", "ends", "before", "after", "factorizations", "gate_factorizations", "gates", "refused",
    ]  # fmt: skip
    assert (found["vary"], found["ends"], found["refused"]) == (["taper"], "pinned", None)
    assert found["before"]["rms_relative"] == refined.gap_before.rms_relative
    assert found["after"]["max_relative"] == refined.gap_after.max_relative
    assert list(found["gates"]) == ["flat", "from_flat", "remeshed", "tolerance", "stable"]
    assert all(found["gates"].values())
    assert all(rod.stiffness is not None and max(rod.stiffness.factors) > 1.0 - 1e-12 for rod in results.rods)
    assert results.agreement["pinned"].rms == refined.gap_after.rms


def test_the_viewer_has_the_widths_of_tapered_rods() -> None:
    """EI of round rods is as the fourth power of their diameter; nodes are as far along as the flat grid says."""
    kept = form().unchecked()
    scene = scene_of(kept)
    plain = scene_of(job("").run(until="pop-up").unchecked())
    assert scene is not None
    assert plain is not None
    assert "widths" not in plain.header
    entry = scene.header["widths"]
    widths = np.frombuffer(scene.data, "<f4", entry["count"], entry["at"]).reshape(-1, 2)
    assert np.array_equal(widths[:, 0], widths[:, 1])
    begin = 0
    for drawn, record in zip(scene.header["rods"], kept.results.rods, strict=True):
        own, begin = widths[begin : begin + drawn["count"], 0], begin + drawn["count"]
        assert record.stiffness is not None
        factors = record.stiffness.factors
        assert own[[0, -1]] ** 4 == pytest.approx([factors[0], factors[-1]], rel=1e-5)
        assert own.max() ** 4 == pytest.approx(max(factors), rel=0.05)  # at the node next to the thickest station
        assert own.min() < 0.8 * own.max()


def test_a_warm_start_takes_the_refinement_over_or_refines_the_same_shell_again() -> None:
    again = job().changed(drawings__author="Ada").run(warm_start=form(), until="pop-up")
    assert "refine" in again.reused
    assert again.refined is form().refined
    other = job().changed(refine__ratio=4).run(warm_start=form(), until="pop-up")
    assert "refine" not in other.reused
    assert "pop-up" in other.reused
    assert other.refined is not None
    assert other.unrefined.popped["pinned"] is form().unrefined.popped["pinned"]
    assert other.refined.gap_after.rms > form().refined.gap_after.rms
    plain = job().changed(refine__vary="").run(warm_start=form(), until="pop-up")
    assert plain.refined is None
    assert plain.popped["pinned"] is form().unrefined.popped["pinned"]


def test_refine_in_python_is_the_job_with_the_key() -> None:
    plain = job().changed(refine__vary="").run(until="pop-up")
    better = rs.refine(plain, "taper")
    assert better.case.refine.vary == ("taper",)
    assert better.agreement["pinned"].rms == pytest.approx(form().agreement["pinned"].rms, rel=1e-6)
    np.testing.assert_allclose(better.popped["pinned"].positions, form().popped["pinned"].positions, atol=1e-9)


def test_a_refined_form_in_patches_is_one_shell_in_the_states_of_all() -> None:
    seam = {"seams.lines": [[["0 mm", "-1 m"], ["0 mm", "1 m"]]]}
    better = rs.refine(rs.Job.load("hemisphere", PINNED | seam).run(until="pop-up"), "double", ends="pinned")
    assert better.refined is not None
    assert better.refined.changed
    popped = better.popped["pinned"]
    assert popped.report.stable
    assert popped.report.iterations <= 3  # it begins where the patches are
    assert popped.footprint is better.footprint
    assert popped.shell.mesh.grid.rods[0].profile is not None
    assert better.agreement["pinned"].rms == better.refined.gap_after.rms < better.refined.gap_before.rms
    for patch, grid in zip(better.patches, popped.alone, strict=True):
        start = replace(patch.boundary, draped=patch.popped["pinned"].positions)
        alone = rs.pop_up(patch.footprint, start, better.rod, ends="pinned")
        assert alone.report.iterations <= 3  # it is there
        np.testing.assert_allclose(grid.positions, alone.positions, rtol=0, atol=1e-12)


def test_refine_pops_up_ends_that_the_form_did_not_have() -> None:
    plain = job().changed(refine__vary="").run(until="pop-up")
    better = rs.refine(plain, "taper", ends="clamped")
    assert better.ends == ("clamped",)
    assert better.refined is not None


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"vary": "tapr"}, "did you mean taper"),
        ({"ends": "loose"}, 'must be "pinned" or "clamped"'),
        ({"ratio": 1.0}, "larger than 1"),
        ({"per": "rods"}, 'did you mean "rod"'),
        ({"varies": "width"}, "a Circle has no width"),
        ({"vary": "clamps"}, 'ends = "clamped"'),
    ],
)
def test_what_cannot_be_refined_is_said_in_a_sentence(arguments: dict[str, object], said: str) -> None:
    with pytest.raises(rs.InputError, match=said):
        rs.refine(form(), **arguments)  # type: ignore[arg-type]


@pytest.mark.slow
def test_the_command_writes_the_refined_form_and_refines_a_result_again(tmp_path: Path) -> None:
    first, second = tmp_path / "first", tmp_path / "second"
    assert (
        main(["refine", "hemisphere", "--vary", "double", "--ends", "pinned", "--out", str(first), *COARSE]) == 4
    )  # rubber
    found = json.loads((first / "result.json").read_text())
    assert found["refinement"]["vary"] == ["double"]
    assert found["rods"][0]["stiffness"]["varies"] == "laths"
    assert (first / "schedule" / "sections.csv").is_file()
    assert main(["refine", str(first), "--vary", "taper", "--out", str(second), "--only", "csv", "--quiet"]) == 4
    again = json.loads((second / "result.json").read_text())
    assert again["refinement"]["before"] == found["refinement"]["before"]
    assert again["refinement"]["after"]["rms_relative"] < found["refinement"]["after"]["rms_relative"]
    popped = rs.Job.of_table(second).run(until="pop-up").archive()
    kept = rs.read(second)
    heights = [np.sort(archive.states["popped_pinned"][:, 2]).max() for archive in (popped, kept)]
    assert heights[0] == pytest.approx(heights[1], rel=1e-4)


@pytest.mark.slow
def test_a_refused_refinement_leaves_the_form_as_it_was_and_names_the_gate(tmp_path: Path) -> None:
    assert main(["refine", "hemisphere", "--vary", "holes", "--out", str(tmp_path / "out"), *COARSE]) == 4
    found = json.loads((tmp_path / "out" / "result.json").read_text())
    refinement = found["refinement"]
    assert refinement["after"] == refinement["before"]
    assert refinement["gates"]["flat"] is False
    assert refinement["refused"].startswith("flat: ")
    assert any("the form is not refined: flat:" in words for words in found["warnings"])
    assert "stiffness" not in found["rods"][0]


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (["hemisphere", "--vary", "tapr"], "did you mean taper"),
        (["hemisphere", "--ends", "both"], '--ends must be "pinned" or "clamped"'),
        (["no_such_case"], "no_such_case"),
        (["."], "holds no result"),
    ],
)
def test_the_command_says_what_is_wrong_in_a_line(
    arguments: list[str], said: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["refine", *arguments]) == 2
    error = capsys.readouterr().err
    assert said in error
    assert error.startswith("rodshell: error: ")
    assert error.count("\n") == 1


def test_a_design_that_passes_all_gates_but_is_not_nearer_than_the_form_is_not_taken(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """From a taper the wrong way, with a gate that whatever is nearer than the form as it is cannot pass."""
    before = rs.Job.load("hemisphere", layout__spacing="60 mm", checks__stages=0, pop_up__ends="pinned").run(
        until="pop-up"
    )
    gap, tried = before.agreement["pinned"].rms, list[float]()

    def gates(form: Stages, **_: object) -> Gates:
        tried.append(form.agreement["pinned"].rms)
        return Gates({"tolerance": tried[-1] > gap}, "" if tried[-1] > gap else "tolerance: refused", 0)

    monkeypatch.setattr(acceptance, "gates", gates)
    monkeypatch.setattr(acceptance, "FIRMER", ())
    found = acceptance.refined(before.stages, [FAMILIES["taper"]], ends="pinned", start=[1.0, 0.0, 0.0, 0.0, 0.0])
    assert max(tried) > gap
    assert not found.changed
    assert found.refused.startswith("tolerance: refused")
