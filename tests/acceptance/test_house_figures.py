"""Figures of a source tree: each is what stands in a small one."""

from pathlib import Path

import pytest

from tests.acceptance import house_figures
from tests.acceptance.house_figures import Room, Source

FILES = {
    "__init__.py": "",
    "rods/bends.py": '''
"""Bends."""
LIMIT = 1.0
_hidden = 2.0

class Bend:
    """An energy."""
    def evaluate(self): return LIMIT
    def refreshed(self): return self

class RoundBend(Bend): pass

def is_bend(given): return isinstance(given, Bend)
''',
    "checks/stress.py": """
from small.rods.bends import Bend, RoundBend
from small.checks import report

def stress(element, family):
    if isinstance(element, Bend | RoundBend) and family == "u":
        return report.text
    return "u"
""",
    "checks/report.py": """
text = "stress"

def late():
    from small.checks.stress import stress
    return stress
""",
    "nets/net.py": 'def other(family): return "v" if family == "u" else "u"\n' + "\n" * house_figures.LONG,
}


@pytest.fixture
def small(tmp_path: Path) -> Source:
    for name, text in FILES.items():
        path = tmp_path / "small" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    return house_figures.read_tree(tmp_path / "small")


def test_rooms_are_counted_without_docstrings_and_private_names(small: Source) -> None:
    found = house_figures.rooms(small)
    assert found["rods"] == Room(statements=11, lines=13, names=4, files=1)
    assert found["checks"] == Room(statements=6 + 4, lines=8 + 6, names=3, files=2)
    assert found["(files)"] == Room(files=1)


def test_names_that_only_their_own_module_uses_are_found(small: Source) -> None:
    assert house_figures.unused_names(small) == [
        "checks/report.py:late", "nets/net.py:other", "rods/bends.py:LIMIT", "rods/bends.py:is_bend",
    ]  # fmt: skip


def test_circles_within_functions_count_and_those_above_them_do_not(small: Source) -> None:
    assert house_figures.in_circles(small) == ["small.checks.report", "small.checks.stress"]


def test_kinds_may_be_told_apart_in_their_own_room(small: Source) -> None:
    assert house_figures.element_kinds(small) == {"Bend", "RoundBend"}
    assert house_figures.told_apart(small) == ["checks/stress.py:6 isinstance(element, Bend | RoundBend)"]
    assert house_figures.families_told_apart(small) == ["checks/stress.py:6 family == 'u'"]


@pytest.mark.parametrize("what", house_figures.targets({}))
def test_a_target_of_the_house_stays_reached(what: str) -> None:
    assert house_figures.targets(house_figures.read_tree(house_figures.SOURCE))[what] == []


def test_a_long_file_needs_a_reason(small: Source, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(house_figures, "LONG_FILES", {})
    assert house_figures.unexplained(small) == [f"nets/net.py {house_figures.LONG + 1}"]
    monkeypatch.setitem(house_figures.LONG_FILES, "nets/net.py", "the net")
    assert house_figures.unexplained(small) == []
    monkeypatch.setitem(house_figures.LONG_FILES, "checks/report.py", "the report")
    assert house_figures.unexplained(small) == ["checks/report.py is not long"]
