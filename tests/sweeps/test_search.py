"""Searches: against a closed form, a front against its definition, the same from the same seed, and what is refused."""

import csv
from math import pi
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rodshell as rs
from rodshell.cli import main
from rodshell.sweeps.asktell import AskTell
from rodshell.sweeps.axes import drawn_shares
from rodshell.sweeps.search_plan import FAR, read_search
from tests.sweeps.test_sweep import BASE

BOUNDS = np.zeros(2), np.ones(2)
FIRST = drawn_shares("latin-hypercube", 2, 20, 1)


def plan(**changes: Any) -> dict[str, Any]:
    """Gap against length over spacing and edge, two generations of five."""
    return {
        "base": BASE,
        "variables": {
            "layout.spacing": {"from": "65 mm", "to": "85 mm"},
            "layout.rods, layout.edge": [["5x5", "40 mm"], ["7x5", "30 mm"]],
        },
        "objectives": {"minimise": ["rms_pinned", "total_length"]},
        "search": {"population": 5, "generations": 2, "seed": 3},
        "run": {"until": "pop-up"},
    } | changes


def rows_of(file: Path) -> list[dict[str, str]]:
    with file.open() as stream:
        return [{key: value for key, value in row.items() if key != "seconds"} for row in csv.DictReader(stream)]


def test_a_constrained_minimum_is_found():
    """x^2 + y^2 where x + y is at least 1: its minimum is at (0.5, 0.5)."""
    search = AskTell(*BOUNDS, FIRST, constraints=1, seed=1)
    for _ in range(60):
        points = search.ask()
        search.tell((points**2).sum(axis=1)[:, None], 1 - points.sum(axis=1)[:, None])
    found, values = search.survivors
    np.testing.assert_allclose(found[np.argmin(values[:, 0])], [0.5, 0.5], atol=2e-3)


def test_a_front_is_found_whole():
    """x and (1 - x)^2 + y^2: the front is y = 0 for all x."""
    search = AskTell(*BOUNDS, FIRST, objectives=2, seed=1)
    for _ in range(150):
        x, y = (points := search.ask()).T
        search.tell(np.column_stack([x, (1 - x) ** 2 + y**2]))
        assert len(points) <= 20
    found = search.survivors[0]
    assert np.abs(found[:, 1]).max() < 0.05
    assert np.diff(np.sort(np.concatenate([[0], found[:, 0], [1]]))).max() < 0.15


def test_the_front_is_what_no_design_dominates_and_the_seed_decides_it(tmp_path: Path):
    found = rs.optimise(plan(columns=["rods"]), tmp_path / "one")
    table = rows_of(tmp_path / "one" / "table.csv")
    assert len(table) == found.designs == 10
    values = [(float(row["rms_pinned"]), float(row["total_length"])) for row in table]
    best = {mine for mine in values if not any(all(np.less_equal(v, mine)) and v != mine for v in values)}
    front = rows_of(tmp_path / "one" / "front.csv")
    assert [(float(row["rms_pinned"]), float(row["total_length"])) for row in front] == sorted(best)
    assert list(front[0])[:3] == ["layout.spacing", "layout.rods", "layout.edge"]
    for row, line in zip(front, found.front_text().splitlines()[2:], strict=True):
        (same,) = [each for each in table if all(each[name] == value for name, value in row.items() if name != "job")]
        assert [f"{float(same[name]):.4g}" in line for name in ("layout.spacing", "rms_pinned", "rods")] == [True] * 3
    assert rs.optimise(plan(columns=["rods"]), tmp_path / "one").computed == 0
    longer = plan(columns=["rods"], search={"population": 5, "generations": 3, "seed": 3})
    assert rs.optimise(longer, tmp_path / "one").computed <= 5
    assert rows_of(tmp_path / "one" / "table.csv")[:10] == table


@pytest.mark.slow
def test_the_lightest_rod_that_is_stiff_enough_is_found(tmp_path: Path):
    """A circle with EI of at least B has a radius of at least (4 B / (pi E))^(1/4)."""
    stiffness = 5e-7
    found = rs.optimise(
        plan(
            base=BASE | {"rod": {"section": {"radius": 0.001}, "material": {"youngs_modulus": 1e6, "density": 1e3}}},
            variables={"rod.section.radius": {"from": "0.5 mm", "to": "2 mm"}},
            objectives={"minimise": ["rod.mass_per_length"]},
            constraints={"rod.EI": {"min": stiffness}},
            search={"population": 8, "generations": 7, "seed": 1},
        ),
        tmp_path,
    )
    (best,) = found.front
    assert best["rod.section.radius"] == pytest.approx((4 * stiffness / (pi * 1e6)) ** 0.25, rel=5e-3)
    assert found.feasible < found.designs


def test_no_design_may_keep_the_constraints(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    file = tmp_path / "search.toml"
    (tmp_path / "base.toml").write_text(rs.Job.load(BASE).to_toml())
    file.write_text(
        'base = "base.toml"\n[variables]\n"layout.spacing" = ["1 mm", "80 mm"]\n'
        '[objectives]\nmaximise = ["rms_pinned"]\n'
        "[constraints]\nmin_angle_deg = { min = 91 }\n[search]\npopulation = 4\ngenerations = 1\n"
        '[run]\nuntil = "pop-up"\n'
    )
    assert main(["optimise", str(file), "--out", str(tmp_path / "out"), "--quiet"]) == 3
    assert rows_of(tmp_path / "out" / "front.csv") == []
    assert main(["optimise", str(file), "--out", str(tmp_path / "out")]) == 3
    assert "NO DESIGN keeps all constraints" in capsys.readouterr().out


def test_a_constraint_on_findings_counts_those_that_are_there():
    constraints = {"findings": {"without": ["strength", "contact"]}, "verdict": ["good", "check"]}
    of_findings, of_verdict = read_search(plan(constraints=constraints)).constraints
    cells = ("", "stands no_loads", "strength stands", "contact strength", "strength_under_loads", None)
    assert [of_findings.violation(cell) for cell in cells] == [0, 0, 1, 2, 0, FAR]
    assert of_verdict.violation("check") == 0


def test_the_example_is_valid():
    plan = read_search(Path(__file__).parents[2] / "examples" / "optimise.toml")
    assert plan.keys == ("generation", "layout.spacing", "layout.rods")


@pytest.mark.parametrize(
    ("changes", "sentence"),
    [
        ({"variables": {}}, r"\[variables\] is missing"),
        ({"variables": {"layout.spacin": [1]}}, "did you mean layout.spacing"),
        ({"variables": {"layout.spacing": {"from": 1, "to": 2, "count": 3}}}, "unknown key count"),
        ({"objectives": {}}, r"\[objectives\] is missing"),
        ({"objectives": {"minimise": ["rms"]}}, "no key rms"),
        ({"objectives": {"minimise": ["verdict"]}}, "verdict"),
        ({"objectives": {"minimise": "rms_pinned"}}, "give a list of columns"),
        ({"objectives": {"minimise": ["rms_pinned"], "maximise": ["rms_pinned"]}}, "occurs twice"),
        ({"constraints": {"min_angle_deg": 30}}, "{ min = 30 }"),
        ({"constraints": {5: {"min": 30}}}, "keys are words"),
        ({"constraints": {"min_angle_deg": {"least": 30}}}, "unknown key"),
        ({"constraints": {"min_angle_deg": {"min": "30 deg"}}}, "number in SI"),
        ({"constraints": {"findings": ["strength"]}}, r"give { without = \["),
        ({"constraints": {"findings": {"without": ["strengths"]}}}, 'did you mean "strength"'),
        ({"run": {"without": ["strength"]}}, "a search has constraints"),
        ({"search": {"population": 2}}, "at least 4"),
        ({"search": {"seeds": 2}}, "did you mean seed"),
        ({"run": {"best": "rms_pinned"}}, "leave it out"),
        ({"base": ["hemisphere", "ellipsoid"]}, "a search has one"),
    ],
)
def test_what_cannot_be_searched_is_refused_in_a_sentence(changes: dict[str, Any], sentence: str):
    with pytest.raises(rs.InputError, match=sentence):
        read_search(plan(**changes))


@pytest.mark.slow
def test_where_objectives_need_no_checks_the_best_designs_alone_get_them(tmp_path: Path) -> None:
    searched = plan(run={})
    assert read_search(searched).settings.until == "pop-up"
    found = rs.optimise(searched, tmp_path / "out")
    front = {row["job"]: row["verdict"] for row in rows_of(tmp_path / "out" / "front.csv")}
    assert front
    assert all(front.values())
    assert 0 < len(front) < found.designs
    assert found.computed == found.designs + len(front)
    assert rs.optimise(searched, tmp_path / "out").computed == 0
    before = rs.optimise(plan(), tmp_path / "popped")
    assert [design["rms_pinned"] for design in before.front] == [design["rms_pinned"] for design in found.front]
    judged = [row["verdict"] for row in rows_of(tmp_path / "out" / "table.csv")]
    assert sum(map(bool, judged)) == len(front)


@pytest.mark.parametrize(
    ("changes", "until"),
    [
        ({"constraints": {"verdict": ["good", "check"]}}, "fabrication"),
        ({"objectives": {"minimise": ["bending.pop_up.max_stress"]}}, "fabrication"),
        ({"constraints": {"drape.max_gap": {"max": 1e-3}}}, "pop-up"),
        ({"run": {"until": "fabrication"}}, "fabrication"),
    ],
)
def test_a_search_computes_what_its_objectives_and_constraints_need(changes: dict[str, Any], until: str) -> None:
    found = read_search(plan(**{"run": {}, **changes}))
    assert found.settings.until == until
    assert found.checks_last == (until == "pop-up")
