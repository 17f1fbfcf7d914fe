"""What a job writes, what is written when it is wanted, and that nobody is sent to a file that is not there."""

import re
from pathlib import Path

import pytest

import rodshell as rs
from rodshell.cli import main
from rodshell.output.files import export, save
from rodshell.output.report import report_html
from rodshell.results import read
from tests.output.forms import archive, form
from tests.output.test_export import contents

SMALL = ["hemisphere", "--rods", "5x5", "--spacing", "80mm", "--edge", "20mm", "--checks.stages", "0"]
ARCHIVE = {"case.toml", "result.json", "states.npz"}
SCHEDULES = {f"schedule/{name}.csv" for name in ("rods", "joints", "supports", "bracing")}
FIRST = ARCHIVE | SCHEDULES | {"report.html", "drawings/strips.dxf"}
LATER = ["drawings/plan.dxf", "drawings/plan.svg", "drawings/strips.svg", "drawings/drawings.pdf", "model/draped.obj",
         "model/popped_clamped.glb", "model/draped.vtp", "model/popped_clamped.json", "pictures/flat.png"]  # fmt: skip


def last_line(capsys: pytest.CaptureFixture[str]) -> str:
    return capsys.readouterr().err.splitlines()[-1]


def test_a_job_writes_what_a_workshop_begins_with_and_export_the_rest(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    assert main(["form", *SMALL, "--out", "out/dome"]) == 4  # it falls
    said = capsys.readouterr().err
    (line,) = re.findall(r"written to .*", said)
    command = "rodshell export out/dome writes drawings, PDF, models, pictures"
    assert line == f"written to {tmp_path.resolve()}/out/dome: report, schedules, strips; {command}"
    first = contents(tmp_path / "out/dome")
    assert {*first} == FIRST
    assert main(["export", "out/dome"]) == 0
    full = contents(tmp_path / "out/dome")
    assert {*LATER} <= {*full}
    assert {*capsys.readouterr().out.split()} == {f"out/dome/{name}" for name in {*full} - FIRST}
    assert {name: full[name] for name in first} == first
    assert main(["form", *SMALL, "--all", "--out", "out/all"]) == 4
    (line,) = re.findall(r"written to .*", capsys.readouterr().err)
    assert line.endswith("out/all: report, schedules, strips, drawings, PDF, models, pictures")
    assert {*contents(tmp_path / "out/all")} == {*full}
    assert main(["form", *SMALL, "--out", "out/dome"]) == 4  # drawings and models of an earlier run go
    assert {*contents(tmp_path / "out/dome")} == FIRST


def test_export_leaves_what_is_there_unless_it_is_told_to_write_it(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    out = save(archive("dome"), tmp_path / "dome")
    (out / "report.html").write_text("mine")
    (out / "schedule/rods.csv").unlink()
    assert main(["export", str(out), "-q"]) == 0
    full = contents(out)
    assert full["report.html"] == b"mine"
    assert {"schedule/rods.csv", *LATER} <= {*full}
    assert main(["export", str(out)]) == 0
    assert last_line(capsys) == f"rodshell: all files are in {out} already: --only KINDS writes some again"
    assert contents(out) == full
    assert main(["export", str(out), "--only", "report"]) == 2
    assert "will not replace report.html" in capsys.readouterr().err
    (tmp_path / "other").mkdir()
    (tmp_path / "other/report.html").write_text("of another form")
    assert main(["export", str(out), "--out", str(tmp_path / "other")]) == 2  # no mixture of two results
    assert main(["export", str(out), "--force", "-q"]) == 0
    assert contents(out) == {**full, "report.html": report_html(archive("dome")).encode()}


@pytest.mark.parametrize(("asked", "others"), [("pdf", {"drawings/drawings.pdf"}), ("", set())])
def test_a_case_asks_for_more_files(asked: str, others: set[str], tmp_path: Path) -> None:
    (tmp_path / "case.toml").write_text(f'[drawings]\nfiles = "{asked}"\n')
    given = [str(tmp_path / "case.toml"), *SMALL[1:], "--quiet"]
    assert main(["form", *given, "--out", str(tmp_path / "out")]) == 0
    assert {*contents(tmp_path / "out")} == FIRST | others
    assert main(["form", *given, "--only", "svg", "--out", str(tmp_path / "few")]) == 0  # only is only
    assert {name.partition("/")[0] for name in contents(tmp_path / "few")} == ARCHIVE | {"drawings"}
    assert "drawings/drawings.pdf" not in contents(tmp_path / "few")


def test_a_form_in_python_is_saved_as_by_the_command(tmp_path: Path) -> None:
    dome = form("dome")
    usual = {*contents(dome.save(tmp_path / "usual"))}
    assert not {*LATER} & usual
    assert {"report.html", "drawings/strips.dxf", "schedule/rods.csv"} <= usual
    options = rs.OutputOptions(drawings=rs.DrawingStyle(files="obj"))
    more = {*contents(dome.save(tmp_path / "more", options=options))} - usual
    assert more == {f"model/{state}.obj" for state in ("draped", "popped_clamped", "popped_pinned")}
    assert {*LATER} <= {*contents(dome.save(tmp_path / "all", kinds="all"))}


def test_an_unknown_kind_in_a_case_is_refused_before_the_work(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    sentence = 'drawings.files = "pdf, docx": unknown kind of file "docx": use report, csv'
    assert main(["form", *SMALL, "--drawings.files", "pdf, docx", "--out", str(tmp_path / "none")]) == 2
    assert sentence in capsys.readouterr().err
    assert not (tmp_path / "none").exists()
    with pytest.raises(rs.InputError, match=re.escape(sentence)):
        rs.OutputOptions(drawings=rs.DrawingStyle(files="pdf, docx"))


@pytest.mark.parametrize("name", ["dome", "ridge"])
def test_report_links_to_no_file_and_says_how_those_that_it_names_are_got(name: str, tmp_path: Path) -> None:
    """Every file that the page names is there, or the same line says that export writes it; and export does."""
    out = save(archive(name), tmp_path / "dome")
    page = (out / "report.html").read_text()
    assert not re.findall(r'(?:href|src)="(?!#|data:)([^"]*)"', page)
    absent = list[str]()
    for line in page.splitlines():
        for file in re.findall(r"<code>((?:drawings|schedule|model|pictures)/[\w.]+)</code>", line):
            if not (out / file).exists():
                assert "which <code>rodshell export DIR</code> writes" in line, file
                absent.append(file)
    assert {"drawings/plan.dxf", "drawings/plan.svg", "drawings/drawings.pdf"} == {*absent}
    export(read(out), out, keep=True)
    assert all((out / file).exists() for file in absent)
