"""Versions as the package index and the standard library know them."""

from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import pytest

import rodshell
from rodshell.version import version_of


@pytest.mark.parametrize("package", ["rodshell", "scipy", "numpy", "ezdxf", "pydantic"])
def test_it_is_what_the_standard_library_says(package: str) -> None:
    assert version_of(package) == version(package)
    assert rodshell.__version__ == version("rodshell")


def test_metadata_in_other_files_and_a_version_in_the_description(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "old.egg-info").mkdir()
    (tmp_path / "old.egg-info" / "PKG-INFO").write_text("Metadata-Version: 2.1\nName: old\nVersion: 0.3\n")
    (tmp_path / "new-2.0.dist-info").mkdir()
    (tmp_path / "new-2.0.dist-info" / "METADATA").write_text(
        "Metadata-Version: 2.4\nName: new\nVersion: 2.0\nSummary: Version: 5\n\nVersion: 7\n"
    )
    monkeypatch.syspath_prepend(tmp_path)
    assert (version_of("old"), version_of("new")) == ("0.3", "2.0")
    with pytest.raises(PackageNotFoundError):
        version_of("neither")
