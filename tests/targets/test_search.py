"""The search for anchor and heading: its objectives, its table, and the case that it leaves."""

from math import degrees, pi
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.case import load_case
from rodshell.cli import main
from rodshell.formfinding.search import HEADINGS, largest_curvature, search
from tests.acceptance.cases import ROD

ELLIPSOID = rs.Ellipsoid(a=0.2, b=0.15, c=0.12)
GRID = rs.GridLayout.orthogonal(spacing=0.03, edge=0.005)


def test_shear_is_that_of_the_net_and_the_best_heading_lies_along_the_axes():
    """By its two planes of symmetry: a heading and its mirror image have the same value, and 0 is the best."""
    found = search(ELLIPSOID, GRID, ROD, anchors=[(0.0, 0.0)])
    value = {round(degrees(trial.heading)): trial.value for trial in found.trials}
    assert list(value) == [0, 15, 30, 45, 60, 75]
    assert value[15] == pytest.approx(value[75], rel=1e-9)
    assert value[30] == pytest.approx(value[60], rel=1e-9)
    assert found.best.heading == 0.0
    coarse = rs.GridLayout.orthogonal(spacing=0.05, edge=0.05 / 3)
    net = rs.chebyshev_net(ELLIPSOID, coarse, anchor=(0.0, 0.0))
    assert value[0] == pytest.approx(90 - degrees(net.min_angle), rel=1e-12)


def test_what_is_as_good_as_the_default_loses_to_it():
    """Any heading is as good as any other on a ball."""
    found = search(rs.Hemisphere(0.2), GRID, ROD, objective="curvature", anchors=[(0.0, 0.0)])
    assert np.ptp([trial.value for trial in found.trials]) < 0.01 * found.trials[0].value
    assert found.best is found.trials[0]


def test_largest_curvature_of_rods_on_a_cylinder():
    """Rods along 0 run round and straight: 1/R; at 45 degrees helices: 1/2R."""
    vault = rs.HeightField(formula="sqrt(0.25 - x^2)", domain=rs.Rectangle((0.5, 0.5)))
    for turn, exact in ((0.0, 2.0), (pi / 4, 1.0)):
        layout = rs.GridLayout.orthogonal(spacing=0.08, edge=0.01, rotate=turn)
        assert largest_curvature(rs.chebyshev_net(vault, layout)) == pytest.approx(exact, rel=2e-3)


def test_what_has_no_net_is_shown_as_none_and_never_chosen():
    cap = rs.Cap(radius=0.2, base=-0.1)
    found = search(cap, GRID, ROD, anchors=[(0.1, 0.0), (0.0, 0.0)], headings=[0.0])
    assert np.isinf(found.trials[0].value)
    assert "no inextensible net" in found.trials[0].reason
    assert found.best.anchor == (0.0, 0.0)
    lines = found.table().splitlines()
    assert "none" in lines[2]
    assert lines[3].endswith("*")
    with pytest.raises(rs.InputError, match="none of 1 anchors and headings works"):
        search(cap, GRID, ROD, anchors=[(0.1, 0.0)], headings=[0.0])
    with pytest.raises(rs.InputError, match='objective must be "shear", "curvature" or "gap", not "size"'):
        search(cap, GRID, ROD, objective="size")  # type: ignore[arg-type]


def test_gap_is_that_of_the_clamped_pop_up():
    found = search(ELLIPSOID, GRID, ROD, objective="gap", anchors=[(0.0, 0.0)], headings=HEADINGS[:1])
    coarse = rs.GridLayout.orthogonal(spacing=0.05, edge=0.05 / 3)
    form = rs.find_form(ELLIPSOID, coarse, ROD, anchor=(0.0, 0.0), ends=("clamped",))
    assert found.best.value == pytest.approx(form.agreement["clamped"].rms_relative, rel=1e-9)


@pytest.mark.slow
def test_the_command_line_searches_shows_the_table_and_keeps_numbers(tmp_path: Path, capsys) -> None:
    out = tmp_path / "out"
    arguments = ["form", "ellipsoid", "--rotate", "auto", "--spacing", "50mm", "--rods", "auto", "--length", "auto"]
    assert main([*arguments, "--verbose", "--out", str(out)]) == 4  # rubber rods
    assert "largest shear [deg] by anchor" in capsys.readouterr().out
    case = load_case(out / "case.toml")
    assert case.layout.rotate == 0.0
    assert case.drape.anchor == (0.0, 0.0)
    assert "<svg" in (out / "search.svg").read_text()
