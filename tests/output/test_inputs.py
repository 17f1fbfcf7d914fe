"""What a case names is kept with its result, which can then be moved."""

import json
import tomllib
from dataclasses import replace
from pathlib import Path

import pytest

from rodshell.output.drawings.sheets import title_block
from rodshell.output.files import save
from rodshell.results import archive as archive_module
from rodshell.results import read
from rodshell.results.archive import read_inputs
from tests.output.sample_archive import sample_archive


def case_of(*files: Path) -> str:
    keys = zip(("file", "boundary"), files, strict=False)
    return (
        "[target]\n"
        + "".join(f"{key} = {json.dumps(str(file))}\n" for key, file in keys)
        + '\n[drawings]\nname = "x"\n'
    )


def saved(case: str, folder: Path) -> Path:
    return save(replace(sample_archive(3, 2), case_toml=case, inputs=read_inputs(case)), folder, [])


def named(folder: Path) -> list[str]:
    return list(tomllib.loads((folder / "case.toml").read_text(encoding="utf-8"))["target"].values())


@pytest.fixture
def files(tmp_path: Path) -> tuple[Path, Path]:
    """Two files of one name."""
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        (tmp_path / name / 'ro=of "1".obj').write_text(name)
    return tmp_path / "a" / 'ro=of "1".obj', tmp_path / "b" / 'ro=of "1".obj'


def test_small_files_are_copied_each_under_a_name_of_its_own(files: tuple[Path, Path], tmp_path: Path) -> None:
    out = saved(case_of(*files), tmp_path / "out")
    assert [(out / name).read_text() for name in named(out)] == ["a", "b"]
    assert all(name.startswith("inputs/") for name in named(out))


def test_a_copy_is_what_the_file_held_when_it_was_read(files: tuple[Path, Path], tmp_path: Path) -> None:
    case = case_of(files[0])
    inputs = read_inputs(case)
    files[0].write_text("changed since")
    out = save(replace(sample_archive(3, 2), case_toml=case, inputs=inputs), tmp_path / "out", [])
    assert (out / named(out)[0]).read_text() == "a"


def test_what_was_read_is_written_again_elsewhere(files: tuple[Path, Path], tmp_path: Path) -> None:
    first = saved(case_of(*files), tmp_path / "out")
    moved = first.rename(tmp_path / "moved")
    again = save(read(moved), tmp_path / "deep/er/again", [])
    assert (again / "case.toml").read_bytes() == (moved / "case.toml").read_bytes()
    assert [(again / name).read_text() for name in named(again)] == ["a", "b"]


def test_a_large_file_stays_and_is_named_from_the_folder(
    files: tuple[Path, Path], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(archive_module, "LARGEST", 0)
    out = saved(case_of(files[0]), tmp_path / "out")
    assert named(out) == ['../a/ro=of "1".obj']
    again = save(read(out), tmp_path / "deep/er/again", [])
    assert (again / named(again)[0]).resolve() == files[0]
    assert not (out / "inputs").exists()


def test_a_file_in_parts_stays_with_its_parts(tmp_path: Path) -> None:
    (tmp_path / "roof.gltf").write_text("{}")
    assert named(saved(case_of(tmp_path / "roof.gltf"), tmp_path / "out")) == ["../roof.gltf"]


def test_the_hash_of_the_input_is_of_its_content_wherever_it_lies(files: tuple[Path, Path], tmp_path: Path) -> None:
    def shown(folder: Path) -> str:
        return dict(title_block(read(folder), "").entries)["Input"]

    first = saved(case_of(files[0]), tmp_path / "out")
    same = first.rename(tmp_path / "moved")
    hashes = shown(same), shown(save(read(same), tmp_path / "again", []))
    assert (
        hashes[0]
        == hashes[1]
        == dict(
            title_block(
                replace(sample_archive(3, 2), case_toml=case_of(files[0]), inputs=read_inputs(case_of(files[0]))), ""
            ).entries
        )["Input"]
    )
    files[0].write_text("another shape")
    assert shown(saved(case_of(files[0]), tmp_path / "other")) != hashes[0]
