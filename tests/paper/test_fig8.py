"""Figure 8 at a coarse size: what is timed is what the table says."""

import json
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import pytest

from gridshell.joints import ExplicitPenalty, SharedDofs
from gridshell.paper import fig8
from gridshell.paper.drapes import Case
from tests.paper.falls import HEMISPHERE

CASE = Case("a", HEMISPHERE, (5, 5), spacing=0.06, edge=0.03)


@cache
def figure() -> fig8.Fig8:
    return fig8.make(lambda *told: None, cases=(CASE,), falling=0.1)


def test_every_scheme_is_timed_and_costs_more_than_its_bare_solves() -> None:
    timings = figure().timings
    assert {one.method for one in timings} == {"explicit", "shared", "implicit", "ours"}
    for one in timings:
        assert one.seconds > 0
        assert (one.in_solves > 1) == (one.method == "explicit")
    steps = {one.step: one for one in timings if one.method == "explicit" and one.edge == CASE.edge}
    assert steps[0.005].factorizations > 1.5 * steps[0.01].factorizations  # half the step, twice the steps


def test_rods_apart_are_banded_and_joined_ones_are_not_timed_as_if_they_were() -> None:
    assert fig8.bare_solves(CASE, ExplicitPenalty(C1=fig8.C1), 0.01) > 0
    assert fig8.bare_solves(CASE, SharedDofs(), 0.01) == 0


def test_the_ratio_is_that_of_the_two_times_in_the_table(tmp_path: Path) -> None:
    figure().save(tmp_path / "fig8")
    result = json.loads((tmp_path / "fig8" / "result.json").read_text())
    ours = next(one for one in result["timings"] if one["method"] == "ours")
    theirs = next(
        one for one in result["timings"]
        if (one["method"], one["step"], one["edge"]) == ("explicit", 0.01, CASE.edge)
    )  # fmt: skip
    assert result["ratios"]["hemisphere"] == pytest.approx(theirs["seconds"] / ours["seconds"])
    root = ElementTree.parse(tmp_path / "fig8" / "fig8.svg").getroot()
    assert len(root.findall(".//{http://www.w3.org/2000/svg}text")) > 2 * len(result["timings"])
