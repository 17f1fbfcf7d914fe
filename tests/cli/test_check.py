"""`rodshell check`: from a case and from a result; exit codes; what result.json and the schedules then hold."""

import csv
import json
import re
import shlex
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.cli import main
from rodshell.errors import ConvergenceError
from rodshell.results import read

ROOF = """
[target]
kind = "paraboloid"
radius = "6 m"
height = "3 m"
[layout]
spacing = "2 m"
edge = "1 m"
[rod]
section = { kind = "tube", radius = "21 mm", thickness = "3.5 mm" }
material = { preset = "gfrp" }
[checks]
strength = "900 MPa"  # so that stability alone decides
stages = 0
"""
LOADS = """
[[loads]]
name = "own"
kind = "self_weight"
[[loads]]
name = "snow"
kind = "snow"
value = "%s kN/m2"
[[combinations]]
name = "winter"
factors = { own = 1.35, snow = 1.5 }
[bracing]
kind = "cables"
prestrain = 0.001
section = { kind = "circle", radius = "3 mm" }
material = { youngs_modulus = "160 GPa", density = "7850 kg/m3" }
"""


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.chdir(tmp_path)
    Path("roof.toml").write_text(ROOF)
    Path("light.toml").write_text(LOADS % "0.02")
    Path("heavy.toml").write_text(LOADS % "20")
    return tmp_path


@pytest.mark.slow
def test_the_command_that_a_verdict_gives_leads_to_a_shell_with_the_reserve(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Pasted as it is printed, with the folder's name quoted: from 1.05 times its own weight to good, in one step."""
    coarse = ["--layout.spacing", "1.2 m", "--layout.edge", "400 mm", "--checks.stages", "2", "--only", "csv"]
    thin = ["--rod.section.radius", "7.6 mm", "--rod.section.thickness", "1.42 mm"]
    assert main(["form", "pavilion", *thin, *coarse, "--out", "a thin one"]) == 0
    first, *_ = capsys.readouterr().out.splitlines()
    assert first.startswith(
        "pavilion: Check, unloaded: the shell carries only 1.05 times its own weight with pinned ends"
    )
    (offer,) = re.findall(r"\((rodshell form [^()]*)\)", first)
    command = shlex.split(offer)
    assert command[:3] == ["rodshell", "form", str(folder / "a thin one" / "case.toml")]
    assert main([*command[1:], "--only", "csv", "--out", "next"]) == 0
    assert capsys.readouterr().out.startswith("pavilion: Good, unloaded: with pinned and clamped ends")


@pytest.mark.slow
def test_a_case_and_then_its_result_are_checked_under_loads(folder: Path) -> None:
    """Keys as documented; sums balance; forces of every brace and support are in the schedules; too much snow is 4."""
    assert main(["check", "roof.toml", "--loads", "light.toml", "--only", "csv", "-q"]) == 0
    result = json.loads(Path("out/roof/result.json").read_text())
    loaded = result["loads"]["winter"]["pinned"]
    wanted = {"at_factor", "load_sum", "reaction_sum", "max_deflection", "linear_factor", "limit_factor", "limit_kind"}
    assert wanted | {"imperfect_factor", "utilisation", "governs"} <= loaded.keys()
    assert loaded["at_factor"] == 1
    np.testing.assert_allclose(loaded["reaction_sum"], -np.array(loaded["load_sum"]), atol=1e-5)
    assert loaded["governs"]["rod"] in {rod["id"] for rod in result["rods"]}
    assert len(loaded["bracing"]) == len(result["fabrication"]["bracing"])
    rows = list(csv.DictReader(Path("out/roof/schedule/bracing.csv").read_text().splitlines()))
    assert float(rows[0]["cut_mm"]) == pytest.approx(float(rows[0]["final_mm"]) / 1.001, abs=1)
    for row, brace in zip(rows, result["fabrication"]["bracing"], strict=True):  # shortened by 1 to 2 mm
        assert float(row["cut_mm"]) == pytest.approx(1e3 * brace["cut"], abs=0.05 + 1e-9)
    stressed = [float(row["stress_to_N_pinned"]) for row in rows]
    assert stressed == pytest.approx(loaded["bracing_unloaded"], rel=1e-5)
    alone = 1e-3 * 160e9 * np.pi * 0.003**2  # of a cable between points that do not give way [N]
    assert 0.1 * alone < max(stressed) < alone
    assert [float(row["force_N_pinned_winter"]) for row in rows] == pytest.approx(loaded["bracing"], rel=1e-5)
    supports = list(csv.DictReader(Path("out/roof/schedule/foundations.csv").read_text().splitlines()))
    assert len(supports) == 2 * len(result["rods"])
    assert read("out/roof").results.plain() == result  # a folder with loads is read again as it is
    assert main(["check", "out/roof", "--loads", "heavy.toml", "--only", "csv", "-q"]) == 4
    verdict = json.loads(Path("out/roof/result.json").read_text())["verdict"]
    assert verdict["level"] == "unbuildable"
    assert "falls under winter" in verdict["reasons"][0]


@pytest.mark.slow
def test_an_earlier_result_is_checked_under_the_usual_loads(folder: Path) -> None:
    assert main(["form", "roof.toml", "--only", "csv", "-q", "--pop_up.ends", "pinned"]) == 0
    assert main(["check", "out/roof", "--snow", "0.01 kN/m2", "--wind", "0.01 kN/m2", "--only", "csv", "-q"]) == 0
    result = read("out/roof").results
    names = {name.partition(",")[0] for name in result.loads}
    assert names == {"permanent", "winter", "storm"}
    assert len(result.loads) == 6
    assert result.design is None  # what was formed is checked as it is


@pytest.mark.slow
def test_snow_leaves_what_is_given_and_chooses_the_rest(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    small = [
        "--target.radius",
        "3 m",
        "--target.height",
        "1.2 m",
        "--layout.edge",
        "auto",
        "--rod.section.kind",
        "auto",
    ]
    given = ["--bracing.kind", "laths", "--layout.spacing", "300 mm", "--checks.strength", "240 MPa"]
    assert main(["form", "roof.toml", "--snow", "0.5 kN/m2", *small, *given, "--only", "csv", "--json", "-q"]) in (0, 4)
    result = json.loads(capsys.readouterr().out)
    assert result["design"]["open"] == ["section"]
    assert {step["spacing"] for step in result["design"]["steps"]} == {0.3}
    assert {step["bracing"] for step in result["design"]["steps"]} == {"laths"}


@pytest.mark.slow
def test_a_form_checks_its_loads_and_keeps_them_in_its_case(folder: Path) -> None:
    job = rs.Job.load("roof.toml", loads="light.toml", pop_up__ends="pinned")
    form = job.run()
    assert form.loaded is not None
    assert rs.Job.load(job.to_toml()) == job
    again = job.changed(fabrication__end_allowance="10 mm").run(warm_start=form)
    assert "checks" in again.reused
    other = job.changed(stability__modes=2).run(warm_start=form)
    assert "fabrication" in other.reused
    assert "loads" not in other.reused
    assert rs.Job.of_case(job.case).run(warm_start=form).loaded is form.loaded


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["roof.toml"], 'has no loads: give --snow "0.5 kN/m2", --wind "0.5 kN/m2" or --own, --loads FILE'),
        (["roof.toml", "--own", "--loads", "light.toml"], "--loads FILE has loads of its own"),
        (["roof.toml", "--snow", "5 parrots"], "parrots"),
        (["."], "has no case.toml"),
        (["roof.toml", "--loads", "none.toml"], "there is no such file"),
        (["roof.toml", "--loads", "roof.toml"], 'has "target", which no file of loads has'),
        (["nothing"], "there is no case and no file"),
    ],
)
def test_bad_input_is_one_sentence_and_exit_code_2(
    arguments: list[str], message: str, folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["check", *arguments, "-q"]) == 2
    said = capsys.readouterr().err.strip()
    assert message in said
    assert "\n" not in said


def test_a_form_that_its_bracing_pulls_over_is_kept(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The reason is the status, a warning and, with exit code 2, what is said; an older result is not touched."""
    Path("roof.toml").write_text(ROOF + '[pop_up]\nends = "pinned"\n')
    Path("tight.toml").write_text((LOADS % "0.02").replace("prestrain = 0.001", "prestrain = 0.5"))
    check = ["check", "--loads", "tight.toml", "--only", "csv", "-q"]
    assert main([*check, "roof.toml"]) == 2
    said = capsys.readouterr().err.strip()
    assert "pulls the shell out of its shape" in said
    assert said.endswith("roof, without its loads")
    kept = read("out/roof").results
    assert kept.status.startswith("the loads were not checked: the bracing pulls the shell")
    assert kept.status in kept.warnings
    assert kept.verdict is not None
    assert kept.verdict.level != "good"
    assert set(kept.pop_up) == {"pinned"}
    before = {path: path.read_bytes() for path in Path("out/roof").rglob("*") if path.is_file()}
    assert main(["check", "--loads", "tight.toml", "-q", "out/roof"]) == 2
    assert "pulls the shell out of its shape" in capsys.readouterr().err
    assert {path: path.read_bytes() for path in Path("out/roof").rglob("*") if path.is_file()} == before


def test_a_form_whose_check_fails_is_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As one that ran out of time: partial results, exit code 3."""

    def failing(*_: object, **__: object) -> None:
        raise ConvergenceError("the patches take another shape together")

    monkeypatch.setattr("rodshell.form.check_loads", failing)
    assert main(["check", "roof.toml", "--loads", "light.toml", "--only", "csv", "-q"]) == 3
    kept = read("out/roof").results
    assert kept.status == "the patches take another shape together"
    assert f"{kept.status}; not checked: winter" in kept.warnings
    assert set(kept.pop_up) == {"pinned", "clamped"}
