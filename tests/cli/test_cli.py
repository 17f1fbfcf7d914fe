"""The command line, in front of a form finder that only remembers what it was asked."""

import csv
import json
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import pytest

import rodshell as rs
import rodshell.run  # before JIT is switched off
from rodshell.case import Case, case_keys, load_case
from rodshell.case.rod_ends import COLUMNS
from rodshell.cli import main
from rodshell.cli.options import ALIASES
from rodshell.errors import NetLimitError
from rodshell.formfinding.search import Search
from rodshell.output.files import export
from rodshell.output.options import OutputOptions
from rodshell.results import Results, read
from rodshell.results import folder as folder_module
from rodshell.results.folder import ResultFolder
from rodshell.schema import written

CROSS = [
    [-0.1, 0.0, 0.1, 0.0, -0.08, 0.0, 0.0, 0.08, 0.0, 0.0],
    [0.0, -0.1, 0.0, 0.1, 0.0, -0.08, 0.0, 0.0, 0.08, 0.0],
]
"""Two rods that cross, in metres."""


class FakeArchive:
    def __init__(self, status: str, case_toml: str, level: str = "good") -> None:
        verdict = {"level": level, "reasons": ["the rods touch"]}
        popped = {"pop_up": {"pinned": {"status": status}}} if level == "unknown" else {}
        self.results = Results.model_validate(
            {"format": "rodshell-result", "status": status, "verdict": verdict, **popped}
        )
        self.verdict = self.results.verdict
        self.case_toml = case_toml

    def save(self, folder: ResultFolder, kinds: list[str] | None = None, **options: Any) -> None:
        self.kinds = kinds
        folder.put("case.toml", self.case_toml)
        folder.commit()

    def summary(self, *, verbose: bool) -> str:
        return "agreement 0.01 mm" + ", in full" * verbose


@dataclass
class FakeForm:
    case: Case
    asked: Case
    stages: tuple[str, str]
    options: OutputOptions
    inputs: dict[str, bytes]
    search: Search | None
    refined: None

    told: ClassVar = list[OutputOptions]()
    known_loaded: ClassVar = None

    def finished(self, progress: Callable[[str, str, float], None]) -> "FakeForm":
        return self

    def archive(self) -> FakeArchive:
        self.told.append(self.options)
        return FakeArchive(self.stages[0], self.case.text(), self.stages[1])


class FakeFinder:
    """Stands in for form finding: remembers its calls, and ends as it is told."""

    def __init__(self) -> None:
        self.calls = list[tuple[tuple[Any, ...], dict[str, Any]]]()
        self.status, self.level = "converged", "good"
        self.fault: BaseException | None = None

    def find_stages(self, *args: Any, progress: Callable[[str, str, float], None], **options: Any) -> tuple[str, str]:
        """The status and the level that its form will have."""
        self.calls.append((args, options))
        for stage, iteration in (("net", 1), ("drape", 1), ("drape", 2), ("pop up", 1)):
            progress(stage, f"iteration {iteration}", 1e-3)
        if self.fault:
            raise self.fault
        return self.status, self.level

    def stand_in(self, monkeypatch: pytest.MonkeyPatch) -> None:
        for name in ("find_stages", "pop_up_stages"):
            monkeypatch.setattr(rodshell.run, name, lambda *args, **options: self.find_stages(*args, **options))
        unsized = "_sized", lambda run, rod, estimate, stages_of: (rod, estimate, stages_of(rod))  # nothing bends here
        monkeypatch.setattr(rodshell.run.Run, *unsized)
        monkeypatch.setattr(rodshell.run, "Form", FakeForm)
        monkeypatch.setattr("rodshell.output.files.save", lambda archive, *args, **more: archive.save(*args, **more))


@pytest.fixture(autouse=True)
def _elsewhere(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("NUMBA_DISABLE_JIT", "1")


@pytest.fixture
def finder(monkeypatch: pytest.MonkeyPatch) -> FakeFinder:
    fake = FakeFinder()
    fake.stand_in(monkeypatch)
    return fake


def write_table(path: Path, rows: list[list[Any]], columns: tuple[str, ...] = COLUMNS) -> str:
    with path.open("w", newline="") as file:
        csv.writer(file).writerows([columns, *rows])
    return str(path)


def refused(capsys: pytest.CaptureFixture[str], *arguments: str, code: int = 2) -> str:
    """The one line that the command ends with."""
    assert main(arguments) == code
    said = capsys.readouterr()
    assert said.out == ""
    assert said.err.startswith("rodshell: error: ")
    assert said.err.count("\n") == 1
    return said.err


def test_form_asks_for_the_case_and_saves_its_full_input(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["--radius", "250mm", "--rods", "13x11", "--rod.material.youngs_modulus", "25 GPa"]
    options += ["--anchor", "-0.1,0", "--target.radius", "0.26"]
    assert main(["form", "hemisphere", "--out", "dome", *options]) == 0
    overrides = {"target.radius": 0.26, "layout.rods": [13, 11], "drape.anchor": [-0.1, 0]}
    case = load_case("hemisphere", {**overrides, "rod.material.youngs_modulus": 25e9})
    built = case.build()._asdict()
    target, layout, rod = (built.pop(name) for name in ("target", "layout", "rod"))
    built |= {"joint": case.joint, "ends": case.popped_on, "warm_start": None, "same_drape": False}
    assert finder.calls == [((target, layout, rod), built)]
    assert load_case("dome/case.toml") == case
    assert "agreement 0.01 mm" in capsys.readouterr().out


def test_a_case_file_is_run_into_out_and_its_name(finder: FakeFinder) -> None:
    Path("shell.toml").write_text("target.radius = '1 m'\nrod.section.radius = '5 mm'\nrod.material.preset = 'gfrp'")
    assert main(["form", "shell.toml"]) == 0
    asked = load_case("shell.toml")
    assert load_case("out/shell/case.toml") == asked.with_rod(asked.build().rod)


def test_every_key_is_an_option_and_every_alias_is_one_of_a_key(
    capsys: pytest.CaptureFixture[str],
) -> None:
    assert main(["form", "--help"]) == 0
    shown = capsys.readouterr().out
    for key in case_keys():
        assert f"--{key}" in shown
        assert key.partition(".")[0] + "]" in shown
    assert "(hemisphere, cap, paraboloid, heightfield)" in " ".join(shown.split())
    for key, alias in ALIASES.items():
        assert key in case_keys()
        assert f"--{key}, {alias} " in shown


DRAWN = ("layers.", "project", "revision", "name", "author")
ANY_WORDS = (*(f"drawings.{key}" for key in DRAWN), "drape.frames")
WORDS = [key for key in case_keys() if key.startswith(ANY_WORDS)]


@pytest.mark.parametrize("key", [key for key in case_keys() if key not in WORDS])
def test_each_option_reaches_its_key(key: str, finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    said = refused(capsys, "form", "hemisphere", f"--{key}", "no such value")
    assert f"{key} = " in said or f"{key} must be " in said


@pytest.mark.parametrize("key", WORDS)
def test_any_words_reach_their_key(key: str, finder: FakeFinder) -> None:
    assert main(["form", "hemisphere", f"--{key}", "some words", "--method", "paper", "--out", "dome"]) == 0
    value: Any = written(load_case("dome/case.toml"))
    for name in key.split("."):
        value = value[name]
    assert value == "some words"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--radius", "-3 mm"], 'target.radius = "-3 mm": must be larger than zero'),
        (["--radius", ""], 'target.radius = "": not a finite number'),
        (["--spacing", "0"], 'layout.spacing = "0": must be larger than zero'),
        (["--radius", "3 parsec"], 'unknown unit "parsec"'),
        (["--rotate", "3 mm"], "mm is a unit of length; give an angle"),
        (["--edge", "31 mm"], "use a shorter edge"),
        (["--formula", "x*y"], 'kind "hemisphere" has no formula'),
        (["--radios", "3"], "unknown option --radios: did you mean --radius?"),
        (["--target.radus", "3"], "did you mean --target.radius?"),
        (["--bogus", "3"], "unknown option --bogus: see rodshell form --help"),
        (["--radius"], "'--radius' requires an argument: see rodshell form --help"),
        (["--drape.anchor", "--out", "C/y"], "--drape.anchor needs a value, but --out follows"),
        (["-o", "--quiet"], "-o needs a value, but --quiet follows"),
        (["--rotate", "30"], 'write "30 deg"'),
        (["--target.kind", "mesh", "--target.file", "no.obj"], 'there is no file named "no.obj": check the path'),
        (["twice"], "unexpected extra argument"),
        (["--target.kind", "mesh"], "target.file is missing"),
    ],
)
def test_bad_options_of_form_are_one_sentence_before_any_solve(
    arguments: list[str], message: str, finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in refused(capsys, "form", "hemisphere", *arguments)
    assert finder.calls == []
    assert not Path("out").exists()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["fom"], "unknown command fom: did you mean form?"),
        (["form"], "Missing argument"),
        (["form", "dome.toml"], 'no file named "dome.toml"'),
        (["--versoin"], "unknown option --versoin: did you mean --version?"),
    ],
)
def test_a_wrong_command_is_one_sentence(
    arguments: list[str], message: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert message in refused(capsys, *arguments)


def test_an_output_folder_that_cannot_be_written_is_refused_before_the_solve(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    Path("file").write_text("")
    assert "file is a file" in refused(capsys, "form", "hemisphere", "--out", "file/dome")
    assert "file: it is a file" in refused(capsys, "form", "hemisphere", "--out", "file")
    Path("thesis").mkdir()
    Path("thesis/report.html").write_text("")
    assert "will not replace report.html" in refused(capsys, "form", "hemisphere", "--out", "thesis")
    assert "will not replace report.html" in refused(
        capsys, "popup", write_table(Path("rods.csv"), CROSS), "--unit", "m", "--out", "thesis"
    )
    assert "in /proc; choose another folder" in refused(capsys, "form", "hemisphere", "--out", "/proc/dome")
    assert finder.calls == []


def test_the_output_folder_is_left_alone_by_the_check(finder: FakeFinder) -> None:
    finder.fault = NetLimitError("no net")
    assert main(["form", "hemisphere", "--out", "a/b"]) == 2
    assert list(Path.cwd().iterdir()) == []


def test_an_earlier_result_is_replaced_and_a_copied_one_by_force(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["form", "hemisphere", "--out", "dome", "-q"]) == 0
    assert main(["form", "hemisphere", "--out", "dome", "-q"]) == 0
    Path("dome/result.json").write_text('{"format": "rodshell-result", "version": 1}')
    assert "will not replace result.json" in refused(capsys, "form", "hemisphere", "--out", "dome")
    assert len(finder.calls) == 2
    assert main(["form", "hemisphere", "--out", "dome", "--force", "-q"]) == 0


def test_a_file_that_comes_into_the_way_while_the_job_runs_sends_the_result_elsewhere(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    save = FakeArchive.save

    def late(self: FakeArchive, folder: ResultFolder, *arguments: Any, **options: Any) -> None:
        (folder.path / "case.toml").write_text("mine")
        save(self, folder, *arguments, **options)

    monkeypatch.setattr(FakeArchive, "save", late)
    assert main(["form", "hemisphere", "--out", "dome", "-q"]) == 0
    assert "dome-2 instead: will not replace case.toml" in capsys.readouterr().err
    assert Path("dome/case.toml").read_text() == "mine"
    assert load_case("dome-2/case.toml") == load_case("hemisphere")


@pytest.mark.parametrize(
    ("status", "level", "code"),
    [("converged", "good", 0), ("converged", "check", 0), ("converged", "unbuildable", 4), ("stalled", "check", 3),
     ("stalled", "unbuildable", 3), ("converged", "unknown", 3)],
)  # fmt: skip
def test_the_exit_code_is_the_verdict_s_and_not_converged_wins(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str], status: str, level: str, code: int
) -> None:
    finder.status, finder.level = status, level
    assert main(["form", "hemisphere", "--quiet"]) == code
    not_known = "NOT CONVERGED: stalled" if status == "stalled" else "NOT KNOWN: the rods touch"
    said = {0: "", 3: f"rodshell: {not_known}", 4: "rodshell: NOT BUILDABLE: the rods touch"}[code]
    err = capsys.readouterr().err
    assert err.startswith(said)
    assert (err == "") == (code == 0)


def test_not_converged_saves_says_so_and_ends_with_3(finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    finder.status = "stopped after 8 factorisations"
    assert main(["form", "hemisphere"]) == 3
    assert Path("out/hemisphere/case.toml").exists()
    last = capsys.readouterr().err.splitlines()[-1]
    assert last == (
        "rodshell: NOT CONVERGED: stopped after 8 factorisations; partial results are in "
        f"{Path('out/hemisphere').resolve()}"
    )


@pytest.mark.parametrize(
    ("fault", "sentence"),
    [
        (MemoryError("Unable to allocate 596 GiB"), "out of memory (Unable to allocate 596 GiB): give fewer rods"),
        (MemoryError(), "out of memory: give fewer rods"),
        (OSError(28, "No space left on device", "/tmp/x"), "/tmp/x: No space left on device"),
        (OSError(24, "Too many open files"), "the system: Too many open files"),
    ],
)
def test_what_the_system_refuses_is_one_line(
    fault: Exception, sentence: str, finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    finder.fault = fault
    assert f"rodshell: error: {sentence}" in refused(capsys, "form", "hemisphere", "--quiet")


def test_an_error_of_the_library_is_one_line(finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    finder.fault = NetLimitError("no net beyond\n(0.1, 0.2) m")
    assert "no net beyond (0.1, 0.2) m" in refused(capsys, "form", "hemisphere", "--quiet")


def test_an_interrupt_while_files_are_moved_says_that_the_result_is_complete(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    apply = folder_module._apply

    def interrupted(*arguments: Any) -> None:
        os.kill(os.getpid(), signal.SIGTERM)
        apply(*arguments)

    monkeypatch.setattr(folder_module, "_apply", interrupted)
    assert main(["form", "hemisphere", "--out", "dome", "-q"]) == 143
    assert capsys.readouterr().err == f"rodshell: interrupted: the new result in {Path('dome').resolve()} is complete\n"
    assert sorted(os.listdir("dome")) == ["case.toml", "manifest.json"]


def test_a_bug_shows_its_traceback(finder: FakeFinder) -> None:
    finder.fault = ZeroDivisionError("a bug")
    with pytest.raises(ZeroDivisionError):
        main(["form", "hemisphere"])


def test_json_is_the_result_and_nothing_else_on_stdout(finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["form", "hemisphere", "--json"]) == 0
    assert json.loads(capsys.readouterr().out) == {
        "out": str(Path("out/hemisphere").resolve()),
        "format": "rodshell-result",
        "status": "converged",
        "verdict": {"level": "good", "reasons": ["the rods touch"]},
    }


def test_progress_away_from_a_terminal_is_a_line_for_each_stage(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["form", "hemisphere"]) == 0
    *stages, last = capsys.readouterr().err.splitlines()
    assert stages == ["rodshell: net", "rodshell: drape", "rodshell: pop up"]
    assert last.startswith("rodshell: written to ")


def test_a_long_silence_is_broken_by_a_line_that_says_everything(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("rodshell.cli.reporting.SILENCE", 0.05)
    search = finder.find_stages

    def slow(*args: Any, progress: Callable[[str, str, float], None], **options: Any) -> tuple[str, str]:
        progress("drape", "bound, iteration 3 of at most 60", 1e-3)
        time.sleep(0.5)
        return search(*args, progress=progress, **options)

    finder.find_stages = slow  # type: ignore[method-assign]
    assert main(["form", "hemisphere"]) == 0
    said = capsys.readouterr().err.splitlines()
    assert said[0] == "rodshell: drape"
    assert re.fullmatch(r"rodshell: drape: bound, iteration 3 of at most 60, residual 1.0e-03, \d s", said[1])
    assert main(["form", "hemisphere", "--quiet"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("given", ["0", "-3 s", "soon", "3 mm"])
def test_a_time_limit_that_is_none_is_refused(
    given: str, finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "--time-limit = " in refused(capsys, "form", "hemisphere", f"--time-limit={given}")
    assert finder.calls == []


def test_out_of_time_before_anything_was_found_keeps_the_old_result(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["form", "hemisphere", "--out", "dome", "-q"]) == 0
    before = Path("dome/case.toml").read_bytes()
    said = refused(
        capsys, "form", "hemisphere", "--radius", "0.3", "--out", "dome", "--time-limit", "1e-6 s", "-q", code=3
    )
    assert "out of time after 1e-06 s in stage net (iteration 1); nothing was found yet" in said
    assert Path("dome/case.toml").read_bytes() == before


def test_out_of_time_is_said_as_such(finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    finder.status = "out of time after 60 s in stage drape (bound, iteration 3)"
    assert main(["form", "hemisphere", "-q"]) == 3
    assert (
        capsys.readouterr().err
        == f"rodshell: {finder.status}; partial results are in {Path('out/hemisphere').resolve()}\n"
    )


def test_quiet_says_nothing(finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["form", "hemisphere", "--quiet"]) == 0
    assert capsys.readouterr() == ("", "")


def test_popup_reads_a_table_in_its_unit(finder: FakeFinder) -> None:
    rows = [["A", *(1000 * x for x in CROSS[0])], [], ["B", *(1000 * x for x in CROSS[1])]]
    table = write_table(Path("rods.csv"), rows, ("id", *COLUMNS))
    assert main(["popup", table, "--unit", "mm"]) == 0
    (grid, final, rod), _ = finder.calls[0]
    flat = np.array([line.point([line.start, line.end]) for line in grid.rods])
    assert [rod.name for rod in grid.rods] == ["A", "B"]
    np.testing.assert_allclose(flat, [[[-0.1, 0], [0.1, 0]], [[0, -0.1], [0, 0.1]]], rtol=1e-15)
    np.testing.assert_allclose(final[:, 1], [[0.08, 0, 0], [0, 0.08, 0]], rtol=1e-15)
    assert rod.material == rs.Material.preset("petg")
    assert 0 < rod.section.radius <= 0.08 / 200  # half the width over 200
    assert Path("out/rods-popup").is_dir()


def test_popup_reads_the_schedule_of_a_result(
    finder: FakeFinder, dome: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["popup", str(dome), "--out", "first"]) == 0
    schedule = str(dome / export(read(dome), dome, ["csv"])[0])
    assert schedule.endswith("rods.csv")
    assert main(["popup", schedule]) == main(["popup", schedule, "--unit", "mm", "--out", "again"]) == 0
    (grid, final, _), (own, its, _) = finder.calls[0][0], finder.calls[1][0]
    assert [rod.name for rod in own.rods] == [rod.name for rod in grid.rods]
    np.testing.assert_allclose(its, final, atol=1e-6)  # the schedule's rounding
    np.testing.assert_allclose(finder.calls[2][0][1], its)
    capsys.readouterr()
    assert "are in mm: leave it out" in refused(capsys, "popup", schedule, "--unit", "m")


def test_a_table_may_be_separated_by_semicolons(finder: FakeFinder) -> None:
    table = write_table(Path("rods.csv"), CROSS)
    Path(table).write_text(Path(table).read_text().replace(",", ";"))
    assert main(["popup", table, "--unit", "m"]) == 0
    assert finder.calls[0][0][1].shape == (2, 2, 3)


def test_a_table_by_semicolons_may_have_decimal_commas(finder: FakeFinder) -> None:
    table = write_table(Path("rods.csv"), [["a,b", *CROSS[0]], ["c", *CROSS[1]]], ("id", *COLUMNS))
    assert main(["popup", table, "--unit", "m"]) == 0
    Path(table).write_text(Path(table).read_text().replace(",", ";").replace(".", ",").replace('"a;b"', "a,b"))
    assert main(["popup", table, "--unit", "m", "--out", "again"]) == 0
    (first, final, _), (second, same, _) = (call[0] for call in finder.calls)
    assert [rod.name for rod in second.rods] == ["a,b", "c"]
    assert first.rods == second.rods
    np.testing.assert_array_equal(final, same)


def test_a_table_takes_the_rod_that_is_asked_for(finder: FakeFinder) -> None:
    from rodshell.rods.section import Circle, Material, RectangularSection, Tube

    table = write_table(Path("rods.csv"), CROSS)

    def rod(*options: str) -> Any:
        out = f"out{len(finder.calls)}"
        assert main(["popup", table, "--unit", "m", "--out", out, *options]) == 0
        return finder.calls[-1][0][2]

    usual = rod()
    assert rod("--rod.section.radius", "2 mm").section == Circle(0.002)
    assert usual.material == Material.preset("petg")
    assert rod("--rod.material.youngs_modulus", "11 GPa").material == Material(11e9, 1e3, 0.5)
    lath = ["--rod.section.kind", "rectangle", "--rod.section.width", "1 mm", "--rod.section.height", "3 mm"]
    assert rod(*lath).section == RectangularSection(width=0.001, height=0.003)
    tube = rod("--rod.section.kind", "tube", "--rod.section.thickness", "0.1 mm").section
    assert isinstance(tube, Tube)
    assert tube.thickness == 0.0001


def test_popup_takes_the_joints_that_are_asked_for(finder: FakeFinder, dome: Path) -> None:
    table = write_table(Path("rods.csv"), CROSS)
    for source in ([table, "--unit", "m"], ["dome"]):
        for kind, joint in (("ball", rs.Ball(mass=0.02)), ("rigid", rs.Rigid(mass=0.02))):
            assert main(["popup", *source, "--joint.kind", kind, "--joint.mass", "20 g"]) == 0
            assert finder.calls[-1][1]["joint"] == joint


def test_popup_is_told_what_to_check_to_make_and_to_draw(finder: FakeFinder, dome: Path) -> None:
    wishes = {"checks.stages": "3", "checks.strength": "30 MPa", "fabrication.kerf": "2 mm", "drawings.author": "Ada"}
    wishes |= {"fabrication.stock_length": "6 m", "drawings.date": "2026-11-22", "drawings.tolerance": "2 mm"}
    options = [word for key, value in wishes.items() for word in (f"--{key}", value)]
    table = write_table(Path("rods.csv"), CROSS)
    for name, source in (("dome", ["dome"]), ("rods", [table, "--unit", "m"])):
        assert main(["popup", *source, *options]) == 0
        told = FakeForm.told[-1]
        asked = load_case("hemisphere", {**wishes, "drawings.name": name}).output_options()
        assert replace(told, rod_chosen=()) == asked


def test_popup_writes_only_the_kinds_that_are_asked_for(
    finder: FakeFinder, dome: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    kinds = list[object]()
    save = FakeArchive.save
    monkeypatch.setattr(FakeArchive, "save", lambda self, to, only, **more: (kinds.append(only), save(self, to)))
    assert main(["popup", "dome", "--only", "csv, pdf"]) == 0
    assert kinds == [["csv", "pdf"]]
    capsys.readouterr()
    assert 'unknown kind of file "docx"' in refused(capsys, "popup", "dome", "--only", "docx", "--out", "x")


def test_a_result_takes_the_rod_that_is_asked_for_in_place_of_its_own(finder: FakeFinder, dome: Path) -> None:
    assert main(["popup", "dome", "--rod.material.density", "470 kg/m3"]) == 0
    rod = finder.calls[0][0][2]
    assert (rod.section.radius, rod.material.density) == (0.007, 470.0)


def test_a_bad_rod_of_a_table_is_one_sentence(finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    table = write_table(Path("rods.csv"), CROSS)
    said = refused(capsys, "popup", table, "--unit", "m", "--rod.section.thickness", "1 mm")
    assert 'kind "circle" has no thickness' in said
    assert "unknown option --layout.edge" in refused(capsys, "popup", table, "--unit", "m", "--layout.edge", "1 mm")


def test_lengths_left_to_the_targets_size_are_said_before_the_job(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    """So that a wrong unit, or a file without a target, shows."""
    Path("empty.toml").write_text("rod.material.preset = 'rubber'")
    assert main(["form", "empty.toml"]) == 0
    sizes, *others = capsys.readouterr().err.splitlines()
    (rod,) = (line for line in others if line.startswith("rodshell: rod: "))
    assert sizes == "rodshell: hemisphere, 400 mm wide; spacing 20 mm"
    assert rod.startswith("rodshell: rod: rod 2 mm; E = 1 MPa")
    assert rod.endswith(
        "; section was not given: chosen to fit, as slender as the paper's rods, since no strength is known"
    )
    Path("big.toml").write_text("target = { radius = 200 }\nlayout.spacing = 25\nrod.material.preset = 'rubber'")
    assert main(["form", "big.toml"]) == 0
    sizes, *others = capsys.readouterr().err.splitlines()
    (rod,) = (line for line in others if line.startswith("rodshell: rod: "))
    assert sizes == "rodshell: hemisphere, 400 m wide"
    assert rod.startswith("rodshell: rod: rod 2000 mm; ")
    assert main(["form", "empty.toml", "--drawings.name", "bandstand", "--out", "named"]) == 0
    assert capsys.readouterr().err.startswith("rodshell: bandstand, 400 mm wide; ")
    assert main(["form", "empty.toml", "--quiet", "--out", "quiet"]) == 0
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("column", COLUMNS)
def test_a_missing_column_is_named(column: str, finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    left = tuple("oops" if name == column else name for name in COLUMNS)
    table = write_table(Path("rods.csv"), CROSS, left)
    assert f"rods.csv: the column {column} is missing" in refused(capsys, "popup", table, "--unit", "m")


@pytest.mark.parametrize(
    ("row", "message"),
    [
        ([*CROSS[1][:9], "high"], 'rods.csv line 3, final_z1 = "high": not a finite number'),
        ([*CROSS[1][:9], "nan"], 'rods.csv line 3, final_z1 = "nan": not a finite number'),
        ([*CROSS[1][:9], "1e999"], 'rods.csv line 3, final_z1 = "1e999": not finite'),
        ([*CROSS[1][:9], "3 mm"], "mm is a unit of length"),
        ([*CROSS[1][:9], ""], 'rods.csv line 3, final_z1 = "": not a finite number'),
        (CROSS[1][:9], "rods.csv line 3 has 9 cells, the header 10"),
        ([1, 1, 1, 1, 0, 0, 0, 0, 0, 0], "has no length"),
        ([5, 5, 6, 6, 5, 5, 0, 6, 6, 0], "cross no other rod"),
    ],
)
def test_a_bad_row_is_named_with_its_line(
    row: list[Any], message: str, finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    table = write_table(Path("rods.csv"), [CROSS[0], row])
    assert message in refused(capsys, "popup", table, "--unit", "m")
    assert finder.calls == []


@pytest.mark.parametrize(("ids", "message"), [(["A", "A"], 'the id "A" occurs twice'), (["A", ""], "rod 2 has no id")])
def test_ids_must_tell_rods_apart(
    ids: list[str], message: str, finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    rows = [[name, *row] for name, row in zip(ids, CROSS, strict=True)]
    table = write_table(Path("rods.csv"), rows, ("id", *COLUMNS))
    assert message in refused(capsys, "popup", table, "--unit", "m")


def test_a_table_that_is_not_there_is_missed_before_its_unit(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    assert 'there is no file named "no.csv": give a table of rods' in refused(capsys, "popup", "no.csv")


def test_a_table_needs_rods_and_a_known_unit(finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    table = write_table(Path("rods.csv"), [])
    assert "rods.csv has no rods" in refused(capsys, "popup", table, "--unit", "m")
    assert "unit is missing" in refused(capsys, "popup", table)
    assert 'unknown unit "parsec"' in refused(capsys, "popup", table, "--unit", "parsec")
    assert "deg is a unit of angle" in refused(capsys, "popup", table, "--unit", "deg")
    Path("empty.csv").write_text("")
    assert "column flat_x0 is missing" in refused(capsys, "popup", "empty.csv", "--unit", "m")


def test_a_table_in_another_unit_than_its_own_is_refused(
    finder: FakeFinder, capsys: pytest.CaptureFixture[str]
) -> None:
    in_mm = [[3e4 * x for x in row] for row in CROSS]  # of 6 m
    table = write_table(Path("rods.csv"), in_mm)
    said = refused(capsys, "popup", table, "--unit", "m")
    assert (
        "rods.csv is 6e+03 m wide in this unit (6000 x 6000 units): give another unit, such as mm, for 1e-06 to 1000 m"
        in said
    )
    in_m = write_table(Path("small.csv"), [[1e-4 * x for x in row] for row in CROSS])
    assert "small.csv is 2e-08 m wide" in refused(capsys, "popup", in_m, "--unit", "mm")
    named = write_table(Path("named.csv"), [[1e7 * x for x in row] for row in CROSS], tuple(f"{c}_mm" for c in COLUMNS))
    assert "check its columns, which are in mm, for 1e-06 to 1000 m" in refused(capsys, "popup", named)
    assert finder.calls == []


@pytest.fixture
def dome() -> Path:
    """A result of two rods of three nodes that share the middle one."""
    folder = Path("dome")
    folder.mkdir()
    rods = [
        {"id": "U01", "family": "u", "offset": 0.0, "start": -0.1, "end": 0.1},
        {"id": "V01", "family": "v", "offset": 0.0, "start": -0.1, "end": 0.1},
    ]
    result = {"format": "rodshell-result", "version": 1, "units": "SI", "rods": rods}
    (folder / "result.json").write_text(json.dumps(result))
    (folder / "case.toml").write_text(load_case("hemisphere", {"rod.section.radius": 0.007}).to_toml())
    flat = np.array([[-0.1, 0, 0], [0, 0, 0], [0.1, 0, 0], [0, -0.1, 0], [0, 0.1, 0]])
    draped = flat * 0.8 + [0, 0, 0.05]
    np.savez(folder / "states.npz", flat=flat, draped=draped, rod_nodes=[0, 1, 2, 3, 1, 4], rod_start=[0, 3])
    return folder


def test_popup_keeps_rod_and_joints_of_a_result_without_a_case(finder: FakeFinder, dome: Path) -> None:
    """As of a target that was a Python function, or of a table of rods."""
    from rodshell.results.from_form import rod_type

    result = json.loads((dome / "result.json").read_text())
    (dome / "case.toml").write_text('not_described = "the Python function bowl as a target"\n')
    for rod in (
        rs.Rod(rs.Tube(radius=0.02, thickness=0.003), rs.Material.preset("gfrp")),
        rs.Rod(rs.GivenSection(EA=1e5, EI1=1.0, EI2=2.0, GJ=0.5, mass=0.3)),
    ):
        told = result | {"rod": rod_type(rod).plain(), "joint": rs.joints.joint_parameters(rs.Pin(mass=0.1))}
        (dome / "result.json").write_text(json.dumps(told))
        assert main(["popup", str(dome), "--force", "-q"]) == 0
        (_, _, same), options = finder.calls[-1]
        assert (same, options["joint"]) == (rod, rs.Pin(mass=0.1))


def test_popup_keeps_the_joints_and_the_mesh_of_a_result(
    finder: FakeFinder, dome: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    result = json.loads((dome / "result.json").read_text())

    def kept(joint: rs.joints.Joint) -> dict[str, Any]:
        told = result | {"joint": rs.joints.joint_parameters(joint), "layout": {"edge": 0.004}}
        (dome / "result.json").write_text(json.dumps(told))
        assert main(["popup", str(dome), "--force", "-q"]) == 0
        return finder.calls[-1][1]

    for joint in (rs.Rigid(mass=0.005, rest_angle=1.5), rs.Spring(shear=2.0, twist=float("inf")), rs.Linker(corners=4)):
        assert kept(joint) == {"joint": joint, "edge": 0.004}
    (dome / "result.json").write_text(json.dumps(result | {"joint": {"kind": "linker", "rod": {}}}))
    assert "linkers of another rod" in refused(capsys, "popup", str(dome), "--out", "x")


def test_popup_reads_an_earlier_result(finder: FakeFinder, dome: Path) -> None:
    assert main(["popup", str(dome)]) == 0
    (grid, final, rod), _ = finder.calls[0]
    flat = np.array([line.point([line.start, line.end]) for line in grid.rods])
    assert [rod.name for rod in grid.rods] == ["U01", "V01"]
    np.testing.assert_allclose(flat, [[[-0.1, 0], [0.1, 0]], [[0, -0.1], [0, 0.1]]], atol=1e-16)
    np.testing.assert_allclose(final[1], [[0, -0.08, 0.05], [0, 0.08, 0.05]], rtol=1e-15)
    assert rod == load_case("hemisphere", {"rod.section.radius": 0.007}).build().rod
    assert Path("out/dome-popup").is_dir()


def test_an_earlier_result_that_cannot_be_read_is_refused(
    finder: FakeFinder, dome: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert "which is in SI: leave it out" in refused(capsys, "popup", "dome", "--unit", "m")
    assert "give another folder" in refused(capsys, "popup", "dome", "--out", "dome")
    np.savez(dome / "states.npz", flat=np.zeros((5, 3)), rod_nodes=[0, 1, 2, 3, 1, 4], rod_start=[0, 3])
    assert "dome lacks its rods or its states" in refused(capsys, "popup", "dome")
    np.savez(dome / "states.npz", draped=np.zeros((5, 3)))
    assert "dome lacks its rods or its states" in refused(capsys, "popup", "dome")
    result = {"format": "rodshell-result", "version": 1, "rods": []}
    (dome / "result.json").write_text(json.dumps(result))
    assert "there are no rods in result.json" in refused(capsys, "popup", "dome")
    (dome / "result.json").write_text(json.dumps({**result, "rods": [{"id": "U01"}]}))
    assert "dome/result.json: rods[0].family is missing" in refused(capsys, "popup", "dome")
    (dome / "result.json").unlink()
    assert "no rodshell result" in refused(capsys, "popup", "dome")


def test_ctrl_c_ends_with_one_line_and_130(finder: FakeFinder, capsys: pytest.CaptureFixture[str]) -> None:
    finder.fault = KeyboardInterrupt()
    assert main(["form", "hemisphere"]) == 130
    assert capsys.readouterr().err.splitlines()[-1] == "rodshell: interrupted"
    assert not Path("out").exists()


WAITING = """
import sys, time
import rodshell.run
def find_stages(*args, progress, **options):
    progress("drape", "level 1 of 1, iteration 3", 1e-4)
    time.sleep(60)
rodshell.run.find_stages = find_stages
from rodshell.cli import main
sys.exit(main(["form", "hemisphere"]))
"""


@pytest.mark.slow
def test_on_a_terminal_the_live_line_names_stage_and_residual_and_ctrl_c_ends_it() -> None:
    pty = pytest.importorskip("pty", reason="no terminals: run on Linux or macOS")
    ours, theirs = pty.openpty()
    job = subprocess.Popen(
        [sys.executable, "-c", WAITING],
        stderr=theirs,
        env={**os.environ, "TERM": "xterm"},
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),  # a shell's background jobs ignore it
    )
    os.close(theirs)
    said, deadline = b"", time.monotonic() + 20
    while b"residual 1.0e-04" not in said and time.monotonic() < deadline:
        said += os.read(ours, 4096)
    job.send_signal(signal.SIGINT)
    assert job.wait(timeout=20) == 130
    while b"interrupted" not in said and time.monotonic() < deadline:
        said += os.read(ours, 4096)
    os.close(ours)
    assert b"drape: level 1 of 1, iteration 3, residual 1.0e-04" in said
    assert b"Traceback" not in said


@pytest.mark.parametrize(
    ("argument", "heavy"),
    [
        ("'--help'", {"numpy", "scipy", "numba", "pydantic"}),
        ("'--version'", {"numpy", "scipy", "numba", "pydantic"}),
        ("'form', '--help'", {"scipy", "numba", "ezdxf", "reportlab", "trimesh"}),
    ],
)
def test_help_and_version_import_nothing_heavy(argument: str, heavy: set[str]) -> None:
    code = f"import sys; from rodshell.cli import main; main([{argument}]); print(*sys.modules)"
    ended = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert "rodshell" in ended.stdout
    assert heavy.isdisjoint(ended.stdout.split())


LEFT = """
import os, sys
from rodshell.cli import entry
ended, sys.argv = os._exit, ["rodshell", "--version"]

def end(code):
    import numpy
    from threadpoolctl import threadpool_info
    print(*(pool["num_threads"] for pool in threadpool_info()), flush=True)
    ended(code)

os._exit = end
entry()
"""


@pytest.mark.parametrize(("asked", "threads"), [({}, "1"), ({"OPENBLAS_NUM_THREADS": "2"}, "2")])
def test_the_blas_has_one_thread_or_as_many_as_are_asked_for(asked: dict[str, str], threads: str) -> None:
    if (os.cpu_count() or 1) < 2:
        pytest.skip("one processor: the BLAS has one thread in any case")
    environment = {name: value for name, value in os.environ.items() if not name.endswith("_NUM_THREADS")}
    ended = subprocess.run(
        [sys.executable, "-c", LEFT], capture_output=True, text=True, check=True, env=environment | asked
    )
    assert ended.stdout.split()[-1] == threads


def test_the_package_is_run_as_the_command_is() -> None:
    ended = subprocess.run(
        [sys.executable, "-m", "rodshell", "form", "nowhere"], capture_output=True, text=True, check=False
    )
    assert ended.returncode == 2
    assert ended.stderr.startswith("rodshell: error: ")


@pytest.mark.parametrize(
    ("option", "values"),
    [("--rod.section.radius", "VALUE|auto"), ("--spacing", "VALUE|auto"), ("--joint.shear", "VALUE|rigid"),
     ("--radius", "VALUE"), ("--method", "bound|gravity|paper"), ("--joint.kind", "ball|pin|spring|linker|rigid")],
)  # fmt: skip
def test_help_tells_words_that_may_stand_for_a_value_from_the_only_choices(
    option: str, values: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["form", "--help"]) == 0
    assert re.search(rf"{re.escape(option)} {re.escape(values)}\s", capsys.readouterr().out)


def test_h_is_help_too(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["form", "-h"]) == 0
    assert "[target]" in capsys.readouterr().out


def test_help_comes_without_arguments(capsys: pytest.CaptureFixture[str]) -> None:
    assert main([]) == 0
    assert "form" in capsys.readouterr().out
