"""Figure 1: shells that stand on their targets, between two boundaries whose areas are known."""

import json
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

from rodshell.paper import fig1
from rodshell.paper.figure import Case
from rodshell.targets import Hemisphere
from tests.formfinding.falls import RADIUS

CASE = Case("a", Hemisphere(RADIUS), (9, 9), spacing=0.04, edge=0.01)


@cache
def figure() -> fig1.Fig1:
    return fig1.make(lambda *told: None, cases=(CASE,), edge=0.01)


def test_ends_go_from_g0_to_the_rim() -> None:
    (one,) = figure().result()["shells"]
    flat, final = np.array(one["footprint"]), np.array(one["boundary"])
    # the target's own tolerance, 1e-8 of its size
    np.testing.assert_allclose(np.linalg.norm(final[:, :2], axis=1), RADIUS, rtol=1e-7)
    np.testing.assert_allclose(final[:, 2], 0.0, atol=1e-4)  # rods of chords end at lengths of the smooth net
    # ends move inwards only
    assert np.all(np.linalg.norm(flat, axis=1) > np.linalg.norm(final[:, :2], axis=1))


def test_the_table_holds_lengths_areas_and_gaps() -> None:
    row = dict(zip(fig1.COLUMNS, figure().rows()[0], strict=True))
    (one,) = figure().result()["shells"]
    # the middle rod is a half circle; the outermost, at 0.16 m, is the shortest
    shortest, longest = (float(word) for word in row["rods' lengths [mm]"].split(" to "))
    assert longest == pytest.approx(1e3 * np.pi * RADIUS, abs=0.06)
    flat = np.array(one["footprint"])
    assert shortest == pytest.approx(1e3 * np.linalg.norm(flat[0] - flat[1]), abs=0.06)
    # a polygon of points on a circle lies inside it, by some 2 % here
    assert 0.95 < float(row["of G"]) / (1e4 * np.pi * RADIUS**2) < 1.0
    gaps = fig1.COLUMNS.index("gap pinned, rms [mm]")
    wanted = [1e3 * one["gap"][ends][what] for ends in ("pinned", "clamped") for what in ("rms", "max")]
    found = [float(cell) for cell in figure().rows()[0][gaps : gaps + 4]]
    np.testing.assert_allclose(found, wanted, atol=6e-4)
    assert wanted[2] < 0.2 * wanted[0]  # ends that hold their direction leave far less
    assert row["stable"] == "yes"


def test_the_picture_has_both_rows_with_all_rods(tmp_path: Path) -> None:
    figure().save(tmp_path / "fig1")
    assert json.loads((tmp_path / "fig1" / "result.json").read_text())["status"] == "converged"
    root = ElementTree.parse(tmp_path / "fig1" / "fig1.svg").getroot()
    marks = {
        name: root.findall(f".//{{http://www.w3.org/2000/svg}}{name}") for name in ("polyline", "polygon", "circle")
    }
    rods = 18
    # the shell's rods in parts where they go behind, the flat grid's whole
    assert len(marks["polyline"]) > 2 * rods
    assert len(marks["polygon"]) == 1 + 2  # the body; G0 and G
    assert len(marks["circle"]) == 2 * 2 * rods


def test_what_lies_behind_is_pale() -> None:
    picture = figure().pictures()["fig1"]
    pale = picture.count('stroke-opacity="0.22"')
    assert 0 < pale < picture.count("<polyline")
