"""The studies: what is changed is changed, and laws of similarity hold between the runs."""

import json
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from rodshell.paper import studies
from rodshell.paper.studies import Line, Studies
from tests.formfinding.falls import coarse_layout

pytestmark = pytest.mark.slow


def silent(*told: object) -> None:
    pass


@cache
def statics() -> dict[tuple[str, float], Line]:
    return {(one.changed, round(one.factor, 9)): one for one in studies.of_statics(silent, layout=coarse_layout())}


@pytest.mark.slow
def test_the_base_case_changes_nothing() -> None:
    for changed in ("E", "r", "g", "EA alone", "EI alone"):
        assert statics()[changed, 1.0].change_max < 1e-9
        assert statics()[changed, 1.0].on == "7x7, statics"


@pytest.mark.slow
@pytest.mark.parametrize("factor", [0.1, 10.0, 100.0])
def test_modulus_and_gravity_count_by_their_ratio_alone(factor: float) -> None:
    """Weight over stiffness is all that statics knows: E times f is g over f."""
    stiffer, lighter = statics()["E", factor], statics()["g", 1 / factor]
    assert stiffer.change_max == pytest.approx(lighter.change_max, rel=1e-6)
    assert stiffer.strain == pytest.approx(lighter.strain, rel=1e-6)


def test_the_root_mean_square_is_less_than_the_largest_change() -> None:
    covered = [one for one in statics().values() if one.rests != "does not cover the target"]  # rods may be too stiff
    assert len(covered) > 0.8 * len(statics())
    for one in covered:
        assert one.change_rms < one.change_max or one.change_max < 1e-9


def test_strain_is_weight_over_stretch_stiffness() -> None:
    strains = [statics()["EA alone", factor].strain for factor in (10.0, 100.0, 1000.0)]
    np.testing.assert_allclose(np.diff(np.log10(strains)), -1.0, atol=0.01)
    # a thinner rod weighs less by as much as it is softer
    assert statics()["r", 0.1].strain == pytest.approx(statics()["r", 1.0].strain, rel=0.01)


def test_stretch_is_what_keeps_g0_from_the_net() -> None:
    soft, base, firm = (statics()["EA alone", factor].off_net for factor in (0.1, 1.0, 100.0))
    # at this spacing spans that are straighter than the net are 2 mm of it; the rest goes with the strain
    assert firm < 0.7 * base < 0.15 * soft
    assert statics()["EI alone", 0.01].change_rms < 0.1 * statics()["EA alone", 100.0].change_rms


@pytest.mark.slow
def test_the_height_of_the_fall_does_not_matter() -> None:
    for one in studies.of_height(silent, factors=(10.0,)):
        assert one.rests == "converged"
        assert one.change_max < 1e-6  # 1e-7 measured: how still "at rest" is


def test_the_files_hold_every_line(tmp_path: Path) -> None:
    nan = float("nan")
    more = Line("C1 explicit", "1e6 EI", 1.0, "7x7, in time", 4e-3, 6e-3, 8e-3, 7e-3, "converged")
    none = Line("C1 explicit", "1e5 EI", 0.1, "7x7, in time", nan, nan, nan, nan, "does not cover the target")
    lines = (*statics().values(), more, none)
    Studies(lines).save(tmp_path / "studies")
    result = json.loads((tmp_path / "studies" / "result.json").read_text())
    assert len(result["lines"]) == len(lines)
    assert result["lines"][-1]["off_net"] is None
    assert "does not cover the target" in (tmp_path / "studies" / "table.txt").read_text()
    root = ElementTree.parse(tmp_path / "studies" / "studies.svg").getroot()
    words = [one.text for one in root.findall(".//{http://www.w3.org/2000/svg}text")]
    drawn = sum(1e3 * one.change_rms > 1e-5 for one in lines)
    assert sum(word in "\N{BLACK CIRCLE}\N{LARGE CIRCLE}\N{WHITE SQUARE}" for word in words if word) == drawn
