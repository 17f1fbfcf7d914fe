"""The version, as the standard library knows it, and where else it stands."""

import re
import tomllib
from importlib.metadata import version
from pathlib import Path

import pytest

import rodshell

ROOT, CITE = Path(__file__).parents[2], "docs/project/cite.md"


def test_it_is_what_the_standard_library_says() -> None:
    assert rodshell.__version__ == version("rodshell")


@pytest.mark.parametrize(
    ("file", "line"),
    [
        ("CITATION.cff", "version: {}"), ("docs/project/cite.md", "version = {{{}}}"),
        ("docs/studio.md", '{{"rodshell": "{}"}}'), ("CHANGELOG.md", "## [{}]"),
        ("client/src/rodshell_client/__init__.py", '__version__ = "{}"'),
    ],
)  # fmt: skip
def test_files_that_name_the_version_name_this_one(file: str, line: str) -> None:
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    assert line.format(project["version"]) in (ROOT / file).read_text(encoding="utf-8")


def test_the_paper_is_cited_alike_for_people_and_for_programs() -> None:
    for_programs, for_people = ((ROOT / file).read_text(encoding="utf-8") for file in ("CITATION.cff", CITE))
    doi = re.search(r"doi: (\S+)", for_programs)
    assert doi is not None
    for words in (doi[1], "Numerical Method for Direct Solution to Form-Finding Problem in Convex Gridshell"):
        assert words in for_programs
        assert words in for_people
