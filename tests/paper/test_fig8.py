"""Figure 8 at a coarse size: what is timed is what the table says."""

import json
import re
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest

from rodshell.joints import ExplicitPenalty
from rodshell.paper import fig8
from rodshell.paper.fig8 import BareSolves
from rodshell.paper.figure import CASES, Case
from tests.formfinding.falls import HEMISPHERE

CASE = Case("a", HEMISPHERE, (5, 5), spacing=0.06, edge=0.03)


@cache
def figure() -> fig8.Fig8:
    return fig8.make(lambda *told: None, cases=(CASE,), falling=0.3)


@pytest.mark.slow
def test_every_scheme_is_timed_and_that_of_the_paper_is_counted_in_bare_solves() -> None:
    timings = figure().parts
    assert {one.method for one in timings} == {"explicit", "shared", "implicit", "ours"}
    for one in timings:
        assert one.seconds > 0
        assert (one.in_lapack > 0) == (one.in_own > 0) == (one.method == "explicit" and one.edge == CASE.edge)
        # a step has a factorisation or more, so that it costs no less than one with all that belongs to it
        assert one.step_in_lapack >= one.in_lapack
    steps = {one.step: one for one in timings if one.method == "explicit" and one.edge == CASE.edge}
    assert steps[0.005].steps > 1.5 * steps[0.01].steps  # half the step, twice the steps, but where it lands
    assert {one.step for one in timings if one.method == "shared"} == set(fig8.STEPS["shared"])


@pytest.mark.slow
def test_six_sizes_span_the_papers_range_and_more_unknowns_take_longer() -> None:
    for method in ("explicit", "ours"):
        sizes = sorted((one.dofs, one.seconds) for one in fig8.of_sizes(figure().parts, method))
        assert len(sizes) == len(fig8.SIZES) == 6
        assert sizes[-1][0] > 15 * sizes[0][0]
    assert figure().slopes()["explicit"]["hemisphere"] > 0.3
    nodes = [sum(size.rods) * (round(1.2 / size.edge) + 1) for size in fig8.sizes_of(CASES[0])]
    assert min(nodes) < 400
    assert max(nodes) > 10_000


def test_all_documents_have_the_ratio_of_the_figure() -> None:
    """One ratio of speed, measured one way: that of docs/paper/fig8/result.json."""
    docs = Path(__file__).parents[2] / "docs"
    ratios = json.loads((docs / "paper" / "fig8" / "result.json").read_text())["ratios"]
    method, benchmarks = (docs / "method.md").read_text(), (docs / "performance.md").read_text()
    assert f"takes {ratios['hemisphere']:.0f} times the processor time" in method
    said = dict(re.findall(r"the paper's fall of 2 s over ours, (\w+) \| (\d+) times", benchmarks))
    assert said == {name: f"{ratio:.0f}" for name, ratio in ratios.items()}
    assert min(ratios.values()) > 50


@pytest.mark.slow
def test_bare_solves_take_as_long_as_there_are_rods() -> None:
    """Twice the rods, twice the time, by LAPACK and by our own band: the fixed cost of a call is small."""
    cases = (Case("a", HEMISPHERE, (n, n), spacing=0.01, edge=0.005) for n in (16, 32))
    few, many = (BareSolves(one, ExplicitPenalty(C1=fig8.C1), 0.01) for one in cases)
    for _ in range(40):  # in turns, so that what else the machine does slows both alike
        few.once()
        many.once()
    for less, more in zip(few.times, many.times, strict=True):
        assert 1.4 < more / less < 3.0
        assert few.spent > 40 * less


@pytest.mark.slow
def test_the_ratio_is_that_of_the_two_times_in_the_table(tmp_path: Path) -> None:
    figure().save(tmp_path / "fig8")
    result = json.loads((tmp_path / "fig8" / "result.json").read_text())
    ours = next(one for one in result["timings"] if (one["method"], one["edge"]) == ("ours", CASE.edge))
    theirs = next(
        one for one in result["timings"]
        if (one["method"], one["step"], one["edge"]) == ("explicit", fig8.USUAL_STEP, CASE.edge)
    )  # fmt: skip
    assert result["ratios"]["hemisphere"] == pytest.approx(theirs["seconds"] / ours["seconds"])
    root = ElementTree.parse(tmp_path / "fig8" / "fig8.svg").getroot()
    assert len(root.findall(".//{http://www.w3.org/2000/svg}text")) > 2 * len(result["timings"])
