"""Figures 6 and 7 at a coarse size: the table tells the distance to the exact net, and the files hold it."""

import csv
import json
from dataclasses import replace
from functools import cache
from pathlib import Path
from types import SimpleNamespace
from xml.etree import ElementTree

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from rodshell.formfinding.methods import Fall
from rodshell.output.pictures import TOWARDS
from rodshell.paper import drapes
from rodshell.paper.drapes import METHODS, DrapeFigure, DrapeRun, drape_all
from rodshell.paper.figure import Case, standing
from tests.formfinding.falls import HEMISPHERE
from tests.nets.sphere_net import sphere_net_end

pytestmark = pytest.mark.slow

CASE = Case("a", HEMISPHERE, (7, 7), spacing=0.06, edge=0.03)


@cache
def figure() -> DrapeFigure:
    return DrapeFigure("fig6", "a title", drape_all([CASE], lambda *told: None, fall=Fall(drag=5.0)))


def by(method: str) -> DrapeRun:
    return next(one for one in figure().parts if one.method == method)


@pytest.mark.slow
def test_the_net_that_g0_is_held_against_is_the_spheres_exact_one() -> None:
    for rod, net in zip(by("paper").trimmed.mesh.grid.rods, by("paper").net, strict=True):
        np.testing.assert_allclose(np.abs(net), sphere_net_end(0.2, abs(rod.offset)), atol=2e-5)


@pytest.mark.slow
def test_of_the_bound_drape_its_own_ends_are_shown_which_tend_to_the_nets_as_the_spacing() -> None:
    """It starts from the net; where its own lines cross the target's end is found again from its positions."""
    fine = drape_all([replace(CASE, rods=(13, 13), spacing=0.03, edge=0.015)], lambda *told: None, methods=["bound"])
    for one in (by("bound"), *fine):
        mesh, at = one.draped.mesh, {rod.name: k for k, rod in enumerate(one.draped.mesh.grid.rods)}
        for rod, ends in zip(one.trimmed.mesh.grid.rods, one.ends, strict=True):
            s, nodes = mesh.stations[mesh.rod_slice(at[rod.name])], mesh.nodes_of(at[rod.name])
            place = CubicSpline(s, one.draped.positions[nodes])(ends)
            assert np.abs(one.case.target.margin(place)).max() < 1e-2 * np.abs(one.errors).max()
    assert 1e-5 < np.abs(fine[0].errors).max() < 0.4 * np.abs(by("bound").errors).max() < 5e-4


def test_the_falls_come_out_short_of_the_net_alike() -> None:
    assert np.abs(by("paper").errors - by("gravity").errors).max() < 1e-4
    # at this spacing spans between joints are straighter than the net, by 1 to 2 mm, besides the stretch
    assert np.all(by("paper").errors < 0)


def test_the_table_says_what_was_measured() -> None:
    for row, method in zip(figure().rows(), METHODS, strict=True):
        error = 1e3 * np.abs(by(method).errors)
        assert float(row[5]) == pytest.approx(error.max(), abs=0.006)
        assert float(row[6]) == pytest.approx(np.sqrt(np.mean(error**2)), abs=0.006)
    assert "unstable sideways" in figure().rows()[0][-1]


def test_the_files_hold_tables_and_one_picture_a_method(tmp_path: Path) -> None:
    figure().save(tmp_path / "fig6")
    result = json.loads((tmp_path / "fig6" / "result.json").read_text())
    assert [one["method"] for one in result["drapes"]] == list(METHODS)
    assert result["status"] == "converged"
    assert result["drapes"][0]["error_max"] == pytest.approx(np.abs(by("paper").errors).max())
    with (tmp_path / "fig6" / "table.csv").open() as file:
        assert len(list(csv.reader(file))) == 1 + len(METHODS)
    rods = len(CASE.layout.flat_grid((7, 7), 1.2).rods)
    for name in ("fig6", "fig6-gravity", "fig6-bound"):
        root = ElementTree.parse(tmp_path / "fig6" / f"{name}.svg").getroot()
        lines = root.findall(".//{http://www.w3.org/2000/svg}polyline")
        assert len(lines) >= 4 * (rods - 2)  # four panels; lines that miss the target are dropped when trimmed


def test_the_differences_show_every_rod_end_by_every_method(monkeypatch: pytest.MonkeyPatch) -> None:
    """Dots at the heights of the errors: their spread is that of the table's rows, in one scale."""
    monkeypatch.setattr(drapes, "stored", lambda name: ())
    root = ElementTree.fromstring(figure().pictures()["fig6-differences"])
    heights = [float(dot.get("cy", "nan")) for dot in root.findall(".//{http://www.w3.org/2000/svg}circle")]
    errors = np.concatenate([by(method).errors for method in METHODS])
    assert len(heights) == len(errors)
    fit = np.polyfit(errors, heights, 1)
    assert fit[0] < 0  # y runs downwards
    np.testing.assert_allclose(heights, np.polyval(fit, errors), atol=0.02)


@pytest.mark.slow
def test_a_fall_that_does_not_rest_is_the_status_of_the_figure() -> None:
    moving = DrapeFigure("fig6", "a title", drape_all([CASE], lambda *told: None, fall=Fall(duration=0.8)))
    assert moving.status.startswith("(a) by method paper was not at rest")
    assert "NOT AT REST after 0.8 s" in moving.summary()


def test_a_footprint_that_was_sought_is_drawn_where_its_rods_are_those_of_the_case(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    def curves(found: np.ndarray | None) -> int:
        kept = () if found is None else (SimpleNamespace(footprint=found),)
        monkeypatch.setattr(drapes, "stored", lambda name: kept)
        return drapes.rows_svg([by("bound")]).count("<polygon")

    around = np.column_stack([np.cos(np.arange(28)), np.sin(np.arange(28))])
    assert curves(around) == curves(None) + 1
    assert curves(around[:-2]) == curves(None)


def test_what_lies_behind_the_target_is_pale_and_the_flat_grid_is_not() -> None:
    one = by("bound")
    flat = standing(CASE.target, one.trimmed.mesh, one.trimmed.mesh.flat + [0.0, 0.0, 0.3], hides=False)
    draped = standing(CASE.target, one.trimmed.mesh, one.trimmed.positions)
    assert not any("stroke-opacity" in mark for mark in flat)
    # a node of a sphere about the origin is behind where it lies on the far side of the plane through the origin
    near = one.trimmed.positions @ TOWARDS >= 0
    hidden = np.count_nonzero(~near[one.trimmed.mesh.edges].all(axis=1))
    pale = [mark.count(",") - 1 for mark in draped if "stroke-opacity" in mark]
    assert 0 < hidden == sum(pale)
