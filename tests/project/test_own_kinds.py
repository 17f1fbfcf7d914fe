"""A new kind of anything is one thing: in an example of its own, and within the package at most two source files."""

import ast
from pathlib import Path

import pytest

from tests.acceptance.house import NAMED
from tests.acceptance.house_figures import SOURCE, files_naming, read_tree

EXAMPLES = Path(__file__).parents[2] / "examples"
OWN = ("energy", "format", "goal", "joint", "load", "material", "section", "support")


def test_every_kind_has_an_example_and_no_other() -> None:
    assert sorted(path.stem for path in EXAMPLES.glob("own_*.py")) == [f"own_{kind}" for kind in OWN]


@pytest.mark.parametrize("kind", OWN)
def test_a_kind_of_ones_own_takes_one_short_file_and_no_private_name(kind: str) -> None:
    """It is found without a line of the package changed: neither in its files nor by assignments from without."""
    text = (EXAMPLES / f"own_{kind}.py").read_text()
    assert text.count("\n") < 40
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.ImportFrom | ast.Import):
            names = [getattr(node, "module", "") or "", *(alias.name for alias in node.names)]
            assert not [name for name in names if any(part.startswith("_") for part in name.split("."))]
        elif isinstance(node, ast.Attribute):
            assert isinstance(node.ctx, ast.Load)
            assert not node.attr.startswith("_")
        elif isinstance(node, ast.Name):
            assert node.id not in ("setattr", "object")


def test_a_kind_stands_in_at_most_two_source_files() -> None:
    source = read_tree(SOURCE)
    files = {kind: files_naming(source, name) for kind, name in NAMED.items()}
    assert {*files} == {*OWN}
    assert {kind: found for kind, found in files.items() if len(found) > 2} == {}
    assert all(files.values())
