"""The table of equations: it is complete, what it names exists, and two equations that are checked nowhere else."""

import re
from functools import reduce
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.paper.fig4 import LENGTH, RATE, run_in_time

ROOT = Path(__file__).parents[2]
PAGE = (ROOT / "docs" / "equations.md").read_text(encoding="utf-8")
TABLE, _, MATHEMATICS = PAGE.partition("## In mathematics")
LINES = [line for line in TABLE.splitlines() if line.startswith("| ")]
ROWS = [[cell.strip() for cell in line.strip("|").split("|")] for line in LINES][1:]
NUMBERED = ["1a", "1b", "1c", "2", "3a-c", "4", "5", "6", "7a-c", "8", "9", "10", "11", "12", "13a-c", "Algorithm 1"]
NAMED = re.compile(r"`([\w/]+\.py): ([\w.]+)`")


def test_every_numbered_equation_has_its_row_in_the_papers_order() -> None:
    assert [row[0] for row in ROWS][: len(NUMBERED)] == NUMBERED
    assert all(len(row) == 6 for row in ROWS)


@pytest.mark.parametrize("row", ROWS, ids=[f"{row[0]} {row[1][:30]}" for row in ROWS])
def test_the_code_and_the_tests_that_a_row_names_exist(row: list[str]) -> None:
    code, tests = (NAMED.findall(cell) for cell in row[2:4])
    assert len(code) == row[2].count("`") // 2 > 0
    assert len(tests) == row[3].count("`") // 2 > 0
    for path, symbol in code:
        module = import_module("rodshell." + path.removesuffix(".py").replace("/", "."))
        found = reduce(getattr, symbol.split("."), module)
        assert found is not None
    for path, name in tests:
        text = (ROOT / "tests" / path).read_text(encoding="utf-8")
        assert re.search(rf"^def {name}\(", text, re.MULTILINE), f"{path} has no {name}"


def test_every_erratum_is_numbered_once_and_the_table_names_none_that_is_not_there() -> None:
    written = re.findall(r"^- \*\*(E\d+)\*\*", PAGE, re.MULTILINE)
    assert sorted(written, key=lambda name: int(name[1:])) == [f"E{k}" for k in range(1, len(written) + 1)]
    named = {name for row in ROWS for name in re.findall(r"E\d+", row[4])}
    assert named <= set(written)
    assert not re.search(r"^- (?!\*\*E)", PAGE, re.MULTILINE)  # no erratum without a number


@pytest.mark.parametrize("number", range(1, 24))
def test_every_erratum_names_its_check(number: int) -> None:
    found = re.search(rf"\*\*E{number}\*\*.*?\n  Check: (.*?)\.\n", PAGE, re.DOTALL)
    assert found
    checks = NAMED.findall(found[1])
    assert checks
    assert "**E" not in found[0][5:]  # its own
    for path, name in checks:
        assert re.search(rf"^def {name}\(", (ROOT / "tests" / path).read_text(encoding="utf-8"), re.MULTILINE)


def test_every_numbered_equation_is_written_out() -> None:
    headed = re.findall(r"^\*\*(?:Eqs? )?([^*]+)\*\*", MATHEMATICS.partition("## Errata")[0], re.MULTILINE)
    written = [number for head in headed for number in re.findall(r"\d+|Algorithm", head)]
    assert {"1", "2", "3", "4", "5", "6", "7", "8", "10", "11", "12", "13", "Algorithm"} <= set(written)
    assert MATHEMATICS.count("$$") % 2 == 0


def test_targets_are_those_of_equation_13() -> None:
    """Heights and rims written out from the paper, with its numbers."""
    xy = np.array([[0.0, 0.0], [0.1, 0.05], [-0.03, 0.12], [0.02, -0.14]])
    x, y = xy.T
    found = [
        target.height_at(xy) for target in (rs.Hemisphere(0.2), rs.Paraboloid(0.2, 0.12), rs.Ellipsoid(0.2, 0.15, 0.12))
    ]
    wanted = [
        np.sqrt(0.2**2 - x**2 - y**2),
        0.12 * (1 - (x**2 + y**2) / 0.2**2),
        0.12 * np.sqrt(1 - x**2 / 0.2**2 - y**2 / 0.15**2),
    ]
    np.testing.assert_allclose(found, wanted, rtol=1e-12)
    assert np.isnan(rs.Hemisphere(0.2).height_at(np.array([[0.2, 0.01]]))).all()


def test_rod_1_is_led_as_equation_7_says() -> None:
    """x_11 = L/2 (cos wt, sin wt, 0) at 10 rpm, and the joint stays; twisted, the first angle is w t."""
    turned = run_in_time("bending", rs.Linker(), rs.SharedDofs(), until=0.5)
    rate = 10 * 2 * np.pi / 60
    way = 0.5 * LENGTH * np.column_stack([np.cos(rate * turned.times), np.sin(rate * turned.times), 0 * turned.times])
    np.testing.assert_allclose(turned.nodes[:, 0, 0], way, atol=1e-12)
    np.testing.assert_allclose(turned.nodes[:, 0, 2], 0.0, atol=1e-12)
    assert pytest.approx(rate) == RATE
    twisted = run_in_time("twisting", rs.Linker(), rs.SharedDofs(), until=0.5)
    np.testing.assert_allclose(twisted.twists[:, 0], rate * twisted.times, atol=1e-12)
