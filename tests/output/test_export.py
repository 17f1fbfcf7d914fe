"""The round trip: every file can be made again from the archive, also from one of the first version."""

import json
import os
import subprocess
import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.cli import main
from rodshell.errors import InputError, OutputError
from rodshell.output.files import DEFAULT, KINDS, export, save, wanted_kinds
from rodshell.results import Results, read
from tests.output.forms import archive, form, wished
from tests.output.sample_archive import sample_archive, table_archive


def contents(folder: Path) -> dict[str, bytes]:
    """Of all files but the manifest."""
    files = [path for path in folder.rglob("*") if path.is_file() and path.name != "manifest.json"]
    return {str(path.relative_to(folder)): path.read_bytes() for path in files}


@pytest.mark.slow
@pytest.mark.parametrize("name", ["wished", "sample", "table"])
def test_files_made_again_from_the_folder_are_the_same_bytes(name: str, tmp_path: Path) -> None:
    made = {"wished": wished, "sample": sample_archive, "table": table_archive}[name]()
    first = save(made, tmp_path / "first", "all")
    names = export(read(first), tmp_path / "again")
    again = contents(tmp_path / "again")
    assert set(names) == set(again)
    kept = {"result.json", "states.npz", "case.toml"}
    assert again == {name: data for name, data in contents(first).items() if name not in kept}


@pytest.mark.slow
def test_an_archive_in_memory_is_what_a_reader_gets(tmp_path: Path) -> None:
    made = wished()
    again = read(save(made, tmp_path / "dome"))
    assert again.results.plain() == made.results.plain()
    for name, values in made.states.items():
        np.testing.assert_array_equal(again.states[name], values)


def test_numbers_of_the_files_come_from_the_archive(tmp_path: Path) -> None:
    """A rod renamed and a length changed in result.json show in table, drawing and model; nothing is computed anew."""
    made = archive("dome")
    content = json.loads(json.dumps(made.results.plain()).replace('"U04"', '"LONG"'))
    rods = content["rods"]
    rods[3] |= {"cut_length": rods[3]["length"] + 0.1, "mass": 0.123456, "min_radius": 0.0777}
    changed = replace(made, results=Results.of(content))
    export(changed, tmp_path, ["csv", "svg", "gltf"])
    row = next(line for line in (tmp_path / "schedule/rods.csv").read_text().splitlines() if line.startswith("LONG,"))
    assert f",{1e3 * rods[3]['length'] + 100:.2f}," in row
    assert ",0.1235," in row
    assert ",77.7," in row
    assert f"LONG: {1e3 * rods[3]['length'] + 100:.2f} mm" in (tmp_path / "drawings/plan.svg").read_text()
    assert b'"name":"LONG"' in (tmp_path / "model/popped_clamped.glb").read_bytes()


@pytest.mark.slow
def test_command_writes_what_is_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    folder = save(sample_archive(), tmp_path / "dome", "dxf, csv")
    before = contents(folder)
    for path in (folder / "drawings/plan.dxf", folder / "schedule/rods.csv"):
        path.unlink()
    assert main(["export", str(folder), "--only", "dxf, csv"]) == 0
    assert contents(folder) == before
    assert str(folder / "schedule/rods.csv") in capsys.readouterr().out
    assert main(["export", str(folder), "--only", "csv", "--out", str(tmp_path / "tables"), "--quiet"]) == 0
    assert capsys.readouterr().out == ""
    assert set(contents(tmp_path / "tables")) == {f"schedule/{name}.csv" for name in ("rods", "joints", "supports")}


@pytest.mark.slow
@pytest.mark.parametrize(
    ("arguments", "reason"),
    [(["--only", "dxf,cvs"], 'unknown kind of file "cvs": use report, csv'), (["--only", ","], "unknown kind of file"),
     (["--out", "{file}"], "it is a file; choose a folder")],
)  # fmt: skip
def test_bad_requests_are_one_sentence(
    arguments: list[str], reason: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    folder = save(sample_archive(), tmp_path / "dome")
    (tmp_path / "file").write_text("mine")
    words = [word.format(file=tmp_path / "file") for word in arguments]
    assert main(["export", str(folder), *words]) == 2
    error = capsys.readouterr().err
    assert reason in error
    assert error.count("\n") == 1
    assert main(["export", str(tmp_path / "nothing")]) == 2
    assert "holds no rodshell result" in capsys.readouterr().err


def test_kinds_are_read_in_any_case_and_checked() -> None:
    assert wanted_kinds(" PDF,csv ") == ["pdf", "csv"]
    assert wanted_kinds(None, "pdf") == [*DEFAULT, "pdf"]
    assert wanted_kinds(["strips", "dxf"]) == wanted_kinds("dxf") == ["strips", "dxf"]  # no file is written twice
    assert {*wanted_kinds("all")} == {*KINDS} - {"3dm", "opensees"}
    with pytest.raises(InputError, match="report"):
        wanted_kinds("html")


@pytest.mark.slow
def test_a_file_that_cannot_be_replaced_leaves_the_old_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    folder = save(sample_archive(), tmp_path / "dome")
    before = contents(folder)

    def full(self: Path, data: bytes) -> int:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OutputError, match="No space left"):
        export(read(folder), folder, ["csv"])
    monkeypatch.undo()
    assert contents(folder) == before


@pytest.mark.slow
def test_a_newer_format_is_refused(tmp_path: Path) -> None:
    folder = save(sample_archive(), tmp_path / "dome")
    result = json.loads((folder / "result.json").read_text())
    (folder / "result.json").write_text(json.dumps({**result, "version": 99}))
    with pytest.raises(OutputError, match="version 99"):
        read(folder)


CASE = """
[target]
kind = "hemisphere"
radius = {radius}
[layout]
spacing = {spacing}
edge = {edge}
[rod]
section = {{ kind = "circle", radius = {rod} }}
material = {{ youngs_modulus = {modulus}, density = {density} }}
[fabrication]
end_allowance = {allowance}
stock_length = {stock}
"""
METRES = {"radius": 0.2, "spacing": 0.05, "edge": 0.0125, "rod": 0.001, "modulus": 1e6, "density": 1000.0,
          "allowance": 0.012, "stock": 0.4}  # fmt: skip
MILLIMETRES = {"radius": '"200 mm"', "spacing": '"50 mm"', "edge": '"12.5 mm"', "rod": '"1 mm"', "modulus": '"1 MPa"',
               "density": '"1 g/cm3"', "allowance": '"12 mm"', "stock": '"40 cm"'}  # fmt: skip


@pytest.mark.slow
def test_millimetres_and_metres_give_the_same_drawings_to_the_byte(tmp_path: Path) -> None:
    made = []
    for k, values in enumerate((METRES, MILLIMETRES)):
        (tmp_path / f"case{k}.toml").write_text(CASE.format(**values))
        assert main(["form", str(tmp_path / f"case{k}.toml"), "--all", "--out", str(tmp_path / f"out{k}"), "-q"]) == 4
        files = contents(tmp_path / f"out{k}")
        made.append({name: data for name, data in files.items() if name.startswith(("drawings", "schedule", "model"))})
    assert len(made[0]) > 25
    assert made[0] == made[1]


@pytest.mark.slow
def test_drawings_are_the_same_whatever_the_hash_seed(tmp_path: Path) -> None:
    """Another process with another order of sets writes the same bytes."""
    first = save(wished(), tmp_path / "first", "all")
    code = "import sys; from rodshell.cli import main; sys.exit(main(sys.argv[1:]))"
    command = [
        sys.executable,
        "-c",
        code,
        "export",
        str(first),
        "--out",
        str(tmp_path / "again"),
        "-q",
        "--only",
        "dxf,pdf,png,csv",
    ]
    subprocess.run(command, check=True, env={**os.environ, "PYTHONHASHSEED": "7"})
    again = contents(tmp_path / "again")
    assert again == {name: data for name, data in contents(first).items() if name in again}


@pytest.mark.slow
def test_a_job_that_stopped_before_the_pop_up_still_gives_its_files(tmp_path: Path) -> None:
    """Nothing was checked, nothing popped up: drawings of the flat grid and the drape are all there is."""
    dome = form("dome")
    stopped = replace(dome, stages=replace(dome.stages, popped={}, agreement={}))
    out = stopped.save(tmp_path / "stopped", kinds="all")
    files = contents(out)
    assert {"drawings/plan.dxf", "drawings/drawings.pdf", "schedule/rods.csv", "model/draped.vtp"} <= set(files)
    assert not any("erection" in name or "pop_up" in name or "stress" in name for name in files)
    result = read(out).results.plain()
    assert result["reactions"] == {}
    assert "deployment" not in result
    assert result["rods"][0]["cut_length"] == result["rods"][0]["length"]
    assert "min_radius" not in result["rods"][0]
    assert "Not known: there is no pop-up in this result" in (out / "report.html").read_text()


@pytest.mark.slow
def test_without_stages_there_is_no_way_up(tmp_path: Path) -> None:
    made = form("dome").archive(options=rs.OutputOptions(stages=0))
    assert "deployment" not in made.results.plain()
    assert "history" not in made.states
    names = export(made, tmp_path)
    assert "schedule/end_paths.csv" not in names
    assert "pictures/popped_clamped-stress.png" in names
    assert not any("stage_" in name or "erection" in name for name in names)


def test_form_writes_only_what_is_asked_for(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    options = ["--rods", "5x5", "--spacing", "80mm", "--edge", "20mm", "--checks.stages", "0", "--quiet"]
    assert main(["form", "hemisphere", *options, "--only", "csv", "--out", str(tmp_path / "few")]) == 4  # it falls
    tables = {f"schedule/{name}.csv" for name in ("rods", "joints", "supports", "bracing")}
    assert set(contents(tmp_path / "few")) == {"case.toml", "result.json", "states.npz", *tables}
    assert main(["form", "hemisphere", "--only", "cvs", "--out", str(tmp_path / "none")]) == 2
    assert 'unknown kind of file "cvs"' in capsys.readouterr().err
    assert not (tmp_path / "none").exists()


@pytest.mark.parametrize(
    ("kinds", "sentence"),
    [("cvs", '^unknown kind of file "cvs": use report, '), (["dxff"], '^unknown kind of file "dxff": use report, '),
     ([3], "^unknown kind of file 3: use report"), (3, "^kinds must be kinds of files, such as report, .*, not 3$")],
)  # fmt: skip
def test_an_unknown_kind_is_refused_in_python_as_by_the_command(kinds: object, sentence: str, tmp_path: Path) -> None:
    for write in (save, export):
        with pytest.raises(InputError, match=sentence):
            write(sample_archive(), tmp_path / "none", kinds)
    with pytest.raises(InputError, match=sentence):
        form("dome").save(tmp_path / "none", kinds=kinds)
    assert not (tmp_path / "none").exists()


def test_one_text_is_one_kind_or_several(tmp_path: Path) -> None:
    tables = set(export(sample_archive(), tmp_path / "one", "csv"))
    assert tables
    assert set(export(sample_archive(), tmp_path / "two", "csv, report")) == tables | {"report.html"}
    save(sample_archive(), tmp_path / "saved", "csv")
    assert set(contents(tmp_path / "saved")) >= tables


def test_a_form_in_place_of_its_archive_is_refused(tmp_path: Path) -> None:
    for write in (save, export):
        with pytest.raises(InputError, match=r"not a Form: a form is written with form.save, or give form.archive\(\)"):
            write(form("dome"), tmp_path / "none")
    assert not (tmp_path / "none").exists()
