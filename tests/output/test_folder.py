"""A result folder: nothing that rodshell did not write is touched, and a kill leaves the old result or the new one."""

import json
import os
import shutil
import subprocess
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rodshell.errors import InputError, OutputError, OutputWarning
from rodshell.output.files import KINDS, NAMES, export, save
from rodshell.progress import TimeLimit, silent
from rodshell.results import Archive, folder, read
from rodshell.results.archive import ARCHIVE
from rodshell.results.folder import ForeignFileError, open_folder
from rodshell.results.manifest import mark, read_manifest
from tests.output.forms import wished
from tests.output.sample_archive import sample_archive, table_archive


@pytest.fixture
def dome(tmp_path: Path) -> Path:
    """A result with few files, of which the user changed none."""
    return save(sample_archive(), tmp_path / "dome", ["csv", "obj"])


def contents(path: Path) -> dict[str, bytes]:
    return {str(one.relative_to(path)): one.read_bytes() for one in path.rglob("*") if one.is_file()}


def rewrite(path: Path, *, force: bool = False) -> Path:
    """Another result, with other files."""
    return save(table_archive(), path, ["svg"], force=force)


def test_the_manifest_lists_every_file_with_size_and_digest(dome: Path) -> None:
    listed = json.loads((dome / "manifest.json").read_text())
    assert listed["format"] == "rodshell-manifest"
    assert listed["files"].keys() == contents(dome).keys() - {"manifest.json"}
    for name, entry in listed["files"].items():
        sha = subprocess.run(["sha256sum", dome / name], capture_output=True, text=True, check=True).stdout.split()[0]
        assert entry == {"size": (dome / name).stat().st_size, "sha256": sha}


def test_a_second_run_keeps_all_other_files_and_removes_its_own_old_ones(dome: Path) -> None:
    (dome / "photos").mkdir()
    mine = {"notes.md": b"mine", "photos/site.jpg": b"\xff\xd8", "schedule/prices.csv": b"1,2"}
    for name, content in mine.items():
        (dome / name).write_bytes(content)
    rewrite(dome)
    left = contents(dome)
    assert left.keys() == {*mine, "manifest.json", "result.json", "states.npz", "drawings/plan.svg",
                           "drawings/strips.svg", "drawings/supports.svg", "drawings/elevations.svg"}  # fmt: skip
    assert {name: left[name] for name in mine} == mine
    assert read(dome).results.plain()["name"] == "table of rods"
    assert {one.name for one in dome.iterdir() if one.is_dir()} == {"photos", "schedule", "drawings"}


def test_a_changed_file_that_is_not_written_again_stays_and_is_named(dome: Path) -> None:
    (dome / "schedule/rods.csv").write_text("my own prices")
    with open_folder(dome) as place:
        save(table_archive(), place, ["svg"])
    assert place.kept == ("schedule/rods.csv",)
    assert (dome / "schedule/rods.csv").read_text() == "my own prices"
    rewrite(dome)  # it is the user's now
    assert (dome / "schedule/rods.csv").read_text() == "my own prices"


def changed(path: Path) -> None:
    (path / "result.json").write_text((path / "result.json").read_text() + " ")


def added(path: Path) -> None:
    (path / "drawings").mkdir()
    (path / "drawings/plan.svg").write_text("<svg/>")


def linked(path: Path) -> None:
    (path.parent / "elsewhere").mkdir(exist_ok=True)
    (path / "drawings").symlink_to(path.parent / "elsewhere")


def file_for_folder(path: Path) -> None:
    (path / "drawings").write_text("a list of drawings")


def copied(path: Path) -> None:
    result = (path / "result.json").read_bytes()
    shutil.rmtree(path)
    path.mkdir()
    (path / "result.json").write_bytes(result)


def of_an_earlier_version(path: Path) -> None:
    (path / "manifest.json").unlink()


def strange_manifest(path: Path) -> None:
    (path / "manifest.json").write_text('{"name": "a web app"}')


FOREIGN = [changed, added, linked, file_for_folder, copied, of_an_earlier_version, strange_manifest]


@pytest.mark.parametrize("interfere", FOREIGN)
def test_what_rodshell_did_not_write_is_replaced_by_force_only(interfere, dome: Path) -> None:
    interfere(dome)
    before = contents(dome.parent)
    with pytest.raises(ForeignFileError, match="--force"):
        rewrite(dome)
    assert contents(dome.parent) == before
    rewrite(dome, force=True)
    assert read(dome).results.plain()["name"] == "table of rods"
    assert (dome / "drawings/plan.svg").read_bytes() != b"<svg/>"
    assert list((dome.parent / "elsewhere").glob("*")) == []
    rewrite(dome)


def test_a_folder_in_a_files_place_is_never_removed(dome: Path) -> None:
    (dome / "result.json").unlink()
    (dome / "result.json").mkdir()
    (dome / "result.json/mine").write_text("x")
    for force in (False, True):
        with pytest.raises(OutputError, match=r"result.json is in the way"):
            rewrite(dome, force=force)
    assert (dome / "result.json/mine").read_text() == "x"


def test_a_manifest_from_elsewhere_reaches_nothing_outside_its_folder(dome: Path) -> None:
    mine = dome.parent / "mine.txt"
    mine.write_text("mine")
    (dome / "link").symlink_to(dome.parent)
    listed = json.loads((dome / "manifest.json").read_text())
    for name in ("../mine.txt", str(mine), "link/mine.txt"):
        listed["files"][name] = mark(dome.parent, "mine.txt")
    (dome / "manifest.json").write_text(json.dumps(listed))
    rewrite(dome)
    assert mine.read_text() == "mine"


def test_files_that_stand_in_the_way_are_refused_before_the_work(tmp_path: Path) -> None:
    (tmp_path / "mine/model/pop_up").mkdir(parents=True)
    (tmp_path / "mine/model/pop_up/stage_3.vtp").write_text("mine")
    with pytest.raises(ForeignFileError, match=r"stage_3.vtp in .*mine"), \
         open_folder(tmp_path / "mine", reserved=NAMES["vtp"]):  # fmt: skip
        raise AssertionError
    with open_folder(tmp_path / "mine", reserved=NAMES["dxf"]):
        pass
    assert list(contents(tmp_path)) == ["mine/model/pop_up/stage_3.vtp"]


def test_every_name_of_every_kind_is_known_before_the_work(monkeypatch: pytest.MonkeyPatch) -> None:
    costly = (
        "png.drawing_png",
        "pictures.picture",
        "pictures.deployment_picture",
        "pdf.drawings_pdf",
        "drawings.sheet_set",
        "report.report_html",
    )
    for what in (*costly, "dxf.drawing_dxf", "svg.drawing_svg"):
        monkeypatch.setattr(f"rodshell.output.{what}", lambda *_: (b"", b""))
    archive = wished()
    for kind, make in KINDS.items():
        if kind == "3dm":
            pytest.importorskip("rhino3dm")
        for name, _ in make(archive):
            assert any(Path(name).match(pattern) for pattern in NAMES[kind]), name


def test_export_follows_the_same_rules_and_keeps_the_rest_of_the_result(dome: Path) -> None:
    (dome / "notes.md").write_text("mine")
    before = contents(dome)
    export(read(dome), dome, ["svg"])
    assert {name: data for name, data in contents(dome).items() if name in before and name != "manifest.json"} == {
        name: data for name, data in before.items() if name != "manifest.json"
    }
    assert {"drawings/plan.svg", "schedule/rods.csv"} <= read_manifest(dome).keys()
    (dome / "drawings/plan.svg").write_text("mine")
    with pytest.raises(ForeignFileError, match=r"plan\.svg"):
        export(read(dome), dome, ["svg"])
    assert (dome / "drawings/plan.svg").read_text() == "mine"


@pytest.mark.parametrize("error", [OSError(28, "No space left on device"), KeyboardInterrupt()])
def test_a_failure_midway_leaves_the_old_result(
    dome: Path, monkeypatch: pytest.MonkeyPatch, error: BaseException
) -> None:
    before = contents(dome.parent)

    def fail(*args: object, **kwargs: object) -> None:
        raise error

    monkeypatch.setattr(folder, "manifest_text", fail)
    with pytest.raises(OutputError if isinstance(error, OSError) else KeyboardInterrupt):
        rewrite(dome)
    with pytest.raises(OutputError if isinstance(error, OSError) else KeyboardInterrupt):
        rewrite(dome.parent / "new/folder")
    assert contents(dome.parent) == before
    assert os.listdir(dome.parent) == ["dome"]


class Killed(BaseException):
    """Stands for a kill: nothing is cleaned up after it."""


def commit_killed_after(steps: int, archive: Archive, path: Path) -> bool:
    """Write a result, killed before its commit's move or removal of that number; False where there are fewer."""
    left = steps

    def counted(act):
        def step(self: Path, *arguments: object, **options: object) -> object:
            nonlocal left
            if left == 0:
                raise Killed
            left -= 1
            return act(self, *arguments, **options)

        return step

    with pytest.MonkeyPatch.context() as patch:
        for name in ("replace", "unlink", "rmdir"):
            patch.setattr(Path, name, counted(getattr(Path, name)))
        patch.setattr(shutil, "rmtree", lambda *_, **__: None)
        try:
            save(archive, path, ["svg"])
        except Killed:
            return True
    return False


def test_a_kill_at_any_step_of_a_commit_leaves_the_old_result_or_the_new_one_whole(dome: Path, tmp_path: Path) -> None:
    """Whatever was moved before, readers see one result, and the next writer leaves only that."""
    (dome / "notes.md").write_text("mine")
    fresh = contents(rewrite(tmp_path / "new"))
    results = read(dome), read(tmp_path / "new")
    steps, killed = 0, True
    while killed:
        path = shutil.copytree(dome, tmp_path / f"killed-{steps}")
        killed = commit_killed_after(steps, table_archive(), path)
        expected = results[steps > 0]
        seen = read(path)
        assert (seen.results.plain(), seen.case_toml) == (expected.results.plain(), expected.case_toml)
        assert seen.states.keys() == expected.states.keys()
        for state, values in expected.states.items():
            np.testing.assert_array_equal(seen.states[state], values)
        with open_folder(path):
            pass
        assert contents(path) == (contents(dome) if steps == 0 else {**fresh, "notes.md": b"mine"})
        assert {one.name for one in path.iterdir() if one.is_dir()} == (
            {"schedule", "model"} if steps == 0 else {"drawings"}
        )
        steps += 1
    assert steps > len(fresh)


def test_a_file_changed_after_a_kill_stays(dome: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with monkeypatch.context() as patch:
        patch.setattr(folder, "_apply", lambda *_: (_ for _ in ()).throw(Killed))
        with pytest.raises(Killed):
            rewrite(dome)
    for name in ("schedule/rods.csv", "drawings/plan.svg"):  # removed and written by the commit
        (dome / name).parent.mkdir(exist_ok=True)
        (dome / name).write_text("mine")
    with open_folder(dome):
        pass
    assert (dome / "schedule/rods.csv").read_text() == (dome / "drawings/plan.svg").read_text() == "mine"
    assert not (dome / "schedule/joints.csv").exists()
    assert (dome / "drawings/strips.svg").exists()


def test_a_living_process_keeps_its_stage_and_a_dead_one_does_not(dome: Path) -> None:
    left = dome / ".rodshell-stage-dead"
    (left / "new").mkdir(parents=True)
    with open_folder(dome) as first:
        assert not left.exists()
        first.put("result.json", "{}")
        rewrite(dome)
        assert (first.new / "result.json").exists()
    assert not list(dome.glob(".*"))


def test_a_folder_that_cannot_be_moved_is_written_into(dome: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As a mount point: nothing is made beside it, and it is not renamed."""
    dome.parent.chmod(0o555)

    def refuse(self: Path, target: Path) -> Path:
        if dome in (self, target):
            raise OSError(16, "Device or resource busy")
        return Path(os.rename(self, target) or target)

    monkeypatch.setattr(Path, "rename", refuse)
    rewrite(dome)
    dome.parent.chmod(0o755)
    assert os.listdir(dome.parent) == ["dome"]


def test_where_nothing_can_be_written_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")
    for name in ("file/dome", "file/a/b", "file"):
        with pytest.raises(OutputError, match="is a file"):
            rewrite(tmp_path / name)
    with pytest.raises(OutputError, match="in /proc; choose another folder"), open_folder("/proc/dome"):
        pass  # where even root cannot write
    assert os.listdir(tmp_path) == ["file"]


def test_the_working_folder_is_written_into(dome: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(dome)
    rewrite(Path())
    assert read(".").results.plain()["name"] == "table of rods"


def test_a_result_reads_the_same_with_another_file_beside_it(tmp_path: Path) -> None:
    (tmp_path / "full").mkdir()
    (tmp_path / "full/chapter.tex").write_text("mine")
    archive: Archive = replace(sample_archive(), case_toml="# a case")
    out = save(archive, tmp_path / "full", [])
    assert contents(out).keys() == {*ARCHIVE, "manifest.json", "chapter.tex"}
    assert read(out).case_toml == "# a case"


@pytest.mark.parametrize("folder", ["", " "])
def test_an_empty_folder_is_not_the_current_one(folder: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    for write in (save, export):
        with pytest.raises(InputError, match=r'^folder must be the path of a folder, not "": "." is the current one$'):
            write(sample_archive(), folder)
        with pytest.raises(InputError, match=r"^folder must be the path of a folder, not None$"):
            write(sample_archive(), None)  # type: ignore[arg-type]
    assert not list(tmp_path.iterdir())


def test_files_that_a_time_limit_leaves_no_time_for_are_named_and_written_by_export(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    now, made, dome = [0.0], table_archive(), tmp_path / "dome"

    def slow(content: object) -> Iterator[tuple[str, str]]:
        now.append(200.0)
        yield "schedule/joints.csv", "slow"

    monkeypatch.setattr("rodshell.progress.monotonic", lambda: now[-1])
    save(made, dome, "obj, report")
    assert (dome / "report.html").exists()
    monkeypatch.setitem(KINDS, "csv", slow)
    said = r"out of time before the files of obj, report: rodshell export .*dome writes"
    with pytest.warns(OutputWarning, match=said):
        save(made, dome, "csv, obj, report", progress=TimeLimit(silent, 100.0))
    assert (dome / "schedule" / "joints.csv").exists()
    assert not (dome / "report.html").exists()  # that of the earlier result
    assert read(dome).results.plain() == made.results.plain()
    export(read(dome), dome, "report")
    assert (dome / "report.html").exists()
