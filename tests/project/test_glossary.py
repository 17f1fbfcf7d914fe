"""Every code name of the glossary exists, and every term stands there once."""

import re
from functools import reduce
from importlib import import_module
from pathlib import Path

import pytest

PAGE = (Path(__file__).parents[2] / "docs" / "glossary.md").read_text(encoding="utf-8")
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in PAGE.splitlines() if line.startswith("| ")]
TERMS = [row for row in ROWS if row[0] != "term"]
NAMED = re.compile(r"`([\w/]+\.py): ([\w.]+)`")


@pytest.mark.parametrize("row", TERMS, ids=[row[0] for row in TERMS])
def test_a_term_has_a_sentence_and_names_code_that_exists(row: list[str]) -> None:
    _, unit, meaning, code = row
    assert unit
    assert meaning.endswith(".")
    (named,) = NAMED.findall(code)
    module = import_module("rodshell." + named[0].removesuffix(".py").replace("/", "."))
    owner, _, last = named[1].rpartition(".")
    found = reduce(getattr, owner.split("."), module) if owner else module
    assert hasattr(found, last) or last in getattr(found, "__annotations__", {})


def test_every_term_stands_once() -> None:
    terms = [term.strip() for row in TERMS for term in row[0].split(",")]
    assert len(set(terms)) == len(terms)
    assert len(terms) > 60
