"""Result folders of a stranger: nothing outside is written, deleted or read, and what is damaged is a sentence."""

import json
import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from rodshell.cli import main
from rodshell.errors import OutputError, OutputWarning
from rodshell.output.files import save
from rodshell.results import read
from rodshell.results.folder import RECORD, open_folder
from rodshell.results.manifest import mark, read_manifest
from tests.output.sample_archive import sample_archive

pytestmark = pytest.mark.attack
STRANGER = 12345  # no user of this machine


@pytest.fixture(scope="module")
def made(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return save(sample_archive(3, 2), tmp_path_factory.mktemp("results") / "dome", ["csv"])


@pytest.fixture
def dome(made: Path, tmp_path: Path) -> Path:
    """A result, with files of its reader next to it."""
    (tmp_path / "victim/empty").mkdir(parents=True)
    (tmp_path / "victim/notes").write_text("mine")
    return shutil.copytree(made, tmp_path / "dome")


def contents(folder: Path) -> dict[str, bytes | None]:
    """Every file, folder and link, hidden ones too, without what is in stages."""
    found = {str(one.relative_to(folder)): one for one in folder.rglob("*")}
    return {
        name: one.read_bytes() if one.is_file() else None
        for name, one in found.items()
        if ".rodshell-stage-" not in name
    }


def stage_of(dome: Path, record: object) -> Path:
    """A stage with a file in it that waits to be moved, and a record."""
    stage = dome / ".rodshell-stage-stranger"
    (stage / "new/drawings").mkdir(parents=True)
    (stage / "new/evil").write_text("evil")
    (stage / RECORD).write_text(record if isinstance(record, str) else json.dumps(record))
    return stage


def export(dome: Path, capsys: pytest.CaptureFixture[str]) -> tuple[int, str]:
    """Exit code and stderr of a writer."""
    capsys.readouterr()
    return main(["export", str(dome), "--only", "csv", "-q"]), capsys.readouterr().err


def record(files: Any = (), removes: Any = (), replaces: Any = None) -> dict[str, Any]:
    return {"files": files, "removes": removes, "replaces": {} if replaces is None else replaces}


def link_new(stage: Path) -> None:
    shutil.rmtree(stage / "new")
    (stage / "new").symlink_to(stage.parents[1] / "victim")


def link_folder(stage: Path) -> None:
    (stage / "new/drawings").rmdir()
    (stage / "new/drawings").symlink_to(stage.parents[1] / "victim")


def link_file(stage: Path) -> None:
    (stage / "new/drawings/notes").symlink_to(stage.parents[1] / "victim/notes")


def link_record(stage: Path) -> None:
    (stage / RECORD).rename(stage.parents[1] / "record")
    (stage / RECORD).symlink_to(stage.parents[1] / "record")


def pipe_record(stage: Path) -> None:
    (stage / RECORD).unlink()
    os.mkfifo(stage / RECORD)


def device_record(stage: Path) -> None:
    (stage / RECORD).unlink()
    (stage / RECORD).symlink_to("/dev/zero")


def folder_record(stage: Path) -> None:
    (stage / RECORD).unlink()
    (stage / RECORD).mkdir()


def large_record(stage: Path) -> None:
    os.truncate(stage / RECORD, 10**12)  # of zeros that take no room


Prepare = Callable[[Path], None]
DAMAGED: dict[str, tuple[object, Prepare | None]] = {
    "a file above": (record(["../evil"]), None),
    "a file far above": (record(["../../.bashrc"]), None),
    "a file by a way around": (record(["drawings/../../victim/notes"]), None),
    "an absolute file": (record(["/tmp/rodshell-evil"]), None),
    "the folder itself": (record(["."]), None),
    "no name": (record([""]), None),
    "another way to write it": (record(["./evil"]), None),
    "a name too long": (record(["e" * 5000]), None),
    "removal of a name too long": (record([], ["e" * 300]), None),
    "NUL": (record(["ev\0il"]), None),
    "half a pair": (record(["ev\ud800il"]), None),
    "escapes of a terminal": (record(["\x1b[31mevil"]), None),
    "removal above": (record([], ["../victim/notes"]), None),
    "absolute removal": (record([], ["/tmp/rodshell-evil"]), None),
    "replacement above": (record(["evil"], [], {"../victim/notes": None}), None),
    "a stage that is elsewhere": (record(["notes"]), link_new),
    "a staged folder that is elsewhere": (record(["drawings/notes"]), link_folder),
    "a staged file that is elsewhere": (record(["drawings/notes"]), link_file),
    "a staged folder": (record(["drawings"]), None),
    "not JSON": ("{", None),
    "nothing": ("", None),
    "another text": ("\ufeff\x00", None),
    "deep": ("[" * 100_000, None),
    "a long number": ('{"files": ' + "9" * 5000 + "}", None),
    "a list": ("[]", None),
    "missing keys": ({"files": []}, None),
    "a word for files": (record("evil"), None),
    "numbers for names": (record([1, None, ["evil"], {}]), None),
    "a list for marks": (record(["evil"], [], [1]), None),
    "another mark": (record(["evil"], [], {"evil": {"behind": "drawings"}}), None),
    "a mark of other types": (record(["evil"], [], {"evil": {"size": "4", "sha256": 4}}), None),
    "a linked record": (record(["evil"]), link_record),
    "a pipe": (record(), pipe_record),
    "a device": (record(), device_record),
    "a folder": (record(), folder_record),
    "a terabyte": (record(), large_record),
}


@pytest.mark.parametrize("damage", DAMAGED)
def test_damaged_stage_is_a_sentence_to_writers_and_a_warning_to_readers(
    damage: str, dome: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    content, prepare = DAMAGED[damage]
    expected = read(dome)
    stage = stage_of(dome, content)
    if prepare is not None:
        prepare(stage)
    before = contents(dome.parent)
    with pytest.warns(OutputWarning, match=r"rodshell-stage-stranger was left by an interrupted write and is damaged"):
        assert read(dome) == expected
    code, said = export(dome, capsys)
    assert code == 2
    assert said.splitlines()[-1].endswith(": remove it")
    assert f"rodshell: error: {stage} was left" in said.splitlines()[-1]
    assert said.replace("\n", "").isprintable()
    assert contents(dome.parent) == before
    shutil.rmtree(stage)
    assert export(dome, capsys) == (0, "")


def test_record_that_removes_through_a_link_removes_nothing(dome: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """Neither files nor empty folders."""
    (dome / "link").symlink_to(dome.parent / "victim")
    victim = mark(dome.parent / "victim", "notes")
    marks = {"link/notes": victim, "link/empty/x": victim}
    stage_of(dome, record(["link/evil"], list(marks), marks))
    (dome / ".rodshell-stage-stranger/new/link").mkdir()
    (dome / ".rodshell-stage-stranger/new/evil").rename(dome / ".rodshell-stage-stranger/new/link/evil")
    assert export(dome, capsys)[0] == 0
    assert contents(dome.parent / "victim") == {"empty": None, "notes": b"mine"}
    assert not list(dome.glob(".rodshell-stage-*"))


def test_manifest_that_lists_files_behind_a_link_reaches_none(dome: Path) -> None:
    (dome / "link").symlink_to(dome.parent / "victim")
    listed = json.loads((dome / "manifest.json").read_text())
    listed["files"] |= {"link/notes": {"behind": "link"}, "link": {"other": True}, "link/empty": {"folder": True}}
    (dome / "manifest.json").write_text(json.dumps(listed))
    save(sample_archive(3, 2), dome, [])
    assert contents(dome.parent / "victim") == {"empty": None, "notes": b"mine"}


def test_manifest_that_lists_a_link_as_it_is_does_not_hide_it(dome: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """The tables were written nowhere, with exit code 0."""
    shutil.rmtree(dome / "schedule")
    (dome / "schedule").symlink_to(dome.parent / "victim")
    listed = json.loads((dome / "manifest.json").read_text())
    listed["files"] |= {f"schedule/{name}.csv": {"behind": "schedule"} for name in ("rods", "joints", "supports")}
    (dome / "manifest.json").write_text(json.dumps(listed))
    code, said = export(dome, capsys)
    assert code == 2
    assert "will not replace schedule" in said


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs root")
def test_stage_of_another_user_is_neither_completed_nor_read(dome: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (dome / "name").write_text("old")
    stage = stage_of(dome, record(["evil", "result.json"], ["name"], {"name": mark(dome, "name")}))
    (stage / "new/result.json").write_text("{}")
    os.chown(stage, STRANGER, STRANGER)
    before = contents(dome)
    assert read(dome).name == "sample dome"
    assert export(dome, capsys) == (0, "")
    assert contents(dome).keys() == before.keys()
    assert "evil" not in contents(dome)
    os.chown(dome, STRANGER, STRANGER)  # whose folder it is now: it is what a reader of that folder has to see
    assert export(dome, capsys)[0] == 2
    with pytest.raises(OutputError, match=r"stranger was left by an interrupted write of another user"), \
         open_folder(dome):  # fmt: skip
        raise AssertionError
    assert (dome / "name").read_text() == "old"


def test_stage_that_is_a_link_is_left_alone(dome: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stage = stage_of(dome, record(["evil"]))
    stage.rename(dome.parent / "elsewhere")
    stage.symlink_to(dome.parent / "elsewhere")
    before = contents(dome.parent / "elsewhere")
    assert export(dome, capsys) == (0, "")
    assert contents(dome.parent / "elsewhere") == before
    assert "evil" not in contents(dome)


def replaced(path: Path, how: str, elsewhere: Path) -> None:
    """Something else where a file of a result has to be."""
    content = path.read_bytes()
    path.unlink()
    if how == "a pipe":
        os.mkfifo(path)
    elif how == "a device":
        path.symlink_to("/dev/zero")
    elif how == "a folder":
        path.mkdir()
    elif how == "a link out":
        (elsewhere / path.name).write_bytes(content)
        path.symlink_to(elsewhere / path.name)
    elif how == "a link to itself":
        path.symlink_to(path.name)
    else:
        path.write_bytes(content)
        os.truncate(path, 10**12)


HOW = ["a pipe", "a device", "a folder", "a link out", "a link to itself", "a terabyte"]


@pytest.mark.parametrize("how", HOW)
@pytest.mark.parametrize("name", ["result.json", "states.npz", "case.toml"])
def test_what_is_no_file_of_the_folder_is_not_read(
    name: str, how: str, dome: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    replaced(dome / name, how, dome.parent)
    code, said = export(dome, capsys)
    assert code == 2
    assert said.count("\n") == 1
    assert name in said


@pytest.mark.parametrize("how", HOW)
def test_manifest_that_is_no_file_of_the_folder_lists_nothing(
    how: str, dome: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    replaced(dome / "manifest.json", how, dome.parent)
    assert read_manifest(dome) == {}
    assert read(dome).name == "sample dome"
    code, said = export(dome, capsys)
    assert code == 2
    assert said.count("\n") == 1


OUTSIDE = ["../victim/notes", "inputs/../../victim/notes", "{victim}", "inputs/link", "inputs/folder/notes"]


@pytest.mark.parametrize("name", OUTSIDE)
def test_file_outside_that_a_case_names_is_not_taken_into_the_archive(
    name: str, dome: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Nor into its report: who sends an archive and gets the report back must not have what its reader can read."""
    victim = dome.parent / "victim"
    (victim / "notes").write_text("a secret")
    (dome / "inputs").mkdir()
    (dome / "inputs/link").symlink_to(victim / "notes")
    (dome / "inputs/folder").symlink_to(victim)
    (dome / "case.toml").write_text(f'[target]\nfile = "{name.format(victim=victim / "notes")}"\n')
    if name.startswith("inputs/") and ".." not in name:
        with pytest.raises(OutputError, match="leads out of the folder of the result"):
            read(dome)
        return
    archive = read(dome)
    assert archive.inputs == {}
    save(archive, dome.parent / "again", ["csv"])
    written = [one for one in (dome.parent / "again").rglob("*") if one.is_file()]
    assert not any(b"a secret" in one.read_bytes() for one in written)


def test_case_that_names_many_files_is_refused(dome: Path) -> None:
    (dome / "inputs").mkdir()
    (dome / "inputs/a").write_bytes(b"")
    (dome / "case.toml").write_text("".join(f'file = "inputs/{k}"\n' for k in range(101)))
    with pytest.raises(OutputError, match=r"names 101 files: give fewer, or set RODSHELL_LIMITS=2"):
        read(dome)


def test_victim_of_the_issue_is_untouched_by_a_process(dome: Path) -> None:
    """As it was first found: a record that deletes a file above by its SHA-256, and one that replaces another."""
    victim = dome.parent / "victim"
    marks = {"../victim/notes": mark(dome.parent, "victim/notes")}
    stage_of(dome, record(["../victim/.bashrc"], list(marks), marks))
    command = [sys.executable, "-m", "rodshell", "export", str(dome), "--only", "csv", "-q"]
    ended = subprocess.run(command, capture_output=True, text=True, check=False, timeout=60)
    assert (ended.returncode, ended.stdout) == (2, "")
    assert contents(victim) == {"empty": None, "notes": b"mine"}
