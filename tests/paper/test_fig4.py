"""Figure 4: rod 2 follows rod 1 where the joint carries the moment, and the files say so."""

import csv
import json
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import rodshell as rs
from rodshell.paper import reserved
from rodshell.paper.fig4 import LENGTH, RATE, STEP, make, run_in_time, run_statics
from rodshell.paper.figure import ROD

JOINTS = {"linker": rs.Linker(), "pin": rs.Pin(), "ball": rs.Ball(), "shear spring": rs.Spring(1e-3)}
COUPLINGS = {"shared": rs.SharedDofs(), "implicit": rs.ImplicitPenalty(), "explicit": rs.ExplicitPenalty()}
UNTIL = 1.5  # a quarter of a revolution


@cache
def demonstrated(demonstration, joint, coupling):
    return run_in_time(demonstration, JOINTS[joint], COUPLINGS[coupling], until=UNTIL)


@pytest.mark.slow
@pytest.mark.parametrize("coupling", COUPLINGS)
@pytest.mark.parametrize(
    ("demonstration", "joint"), [("twisting", "linker"), ("bending", "linker"), ("twisting", "pin")]
)
def test_rod_2_turns_as_fast_as_rod_1(demonstration, joint, coupling):
    one = demonstrated(demonstration, joint, coupling)
    assert abs(one.rate_error) < 1e-3
    if coupling != "explicit":  # that one's own, far smaller step damps less: see the next test
        assert np.degrees(one.start_up_lag) < 0.25
        assert np.abs(one.lag[len(one.lag) // 2 :]).max() < 1e-4


@pytest.mark.slow
@pytest.mark.parametrize("demonstration", ["twisting", "bending"])
def test_explicit_ties_start_up_as_implicit_ones_do_with_the_same_step(demonstration):
    explicit = demonstrated(demonstration, "linker", "explicit")
    same = rs.ExplicitPenalty().with_defaults(ROD, LENGTH / 4)
    ties = rs.ImplicitPenalty(C1=same.C1, C2=same.C2)
    implicit = run_in_time(demonstration, rs.Linker(), ties, until=0.1, step=explicit.step)
    every = round(STEP / explicit.step)
    at_its_times = implicit.lag[::every]
    early = explicit.lag[: len(at_its_times)]
    assert np.abs(early - at_its_times).max() < 0.1 * np.abs(early).max()  # frozen ties are late by a step: 5 %


@pytest.mark.parametrize(
    ("demonstration", "joint"),
    [("bending", "pin"), ("bending", "ball"), ("twisting", "ball"), ("twisting", "shear spring")],
)
def test_rod_2_stays_behind_where_the_joint_is_free(demonstration, joint):
    one = demonstrated(demonstration, joint, "shared")
    assert not one.follows
    assert one.start_up_lag == pytest.approx(RATE * UNTIL, rel=0.01)


def test_a_spring_about_the_normal_is_all_that_bending_needs():
    assert demonstrated("bending", "shear spring", "shared").follows


@pytest.mark.parametrize("coupling", [rs.SharedDofs(), rs.ImplicitPenalty()])
@pytest.mark.parametrize("demonstration", ["twisting", "bending"])
def test_in_statics_rod_2_is_where_rod_1_is(demonstration, coupling):
    one = run_statics(demonstration, rs.Linker(), coupling, until=UNTIL)
    assert len(one.times) == 16
    assert one.start_up_lag < 1e-6  # 5e-8 measured: the stepper's tolerance
    assert np.allclose(np.linalg.norm(np.diff(one.nodes, axis=2), axis=-1), LENGTH / 4, rtol=1e-8)


@pytest.mark.slow
def test_figure_is_written_with_its_tables(tmp_path):
    figure = make(lambda *_: None, turns=0.05)
    figure.save(tmp_path / "fig4")
    names = {"fig4.svg", "fig4-animated.svg", "fig4-lag.svg", "table.csv", "table.txt", "angles-a.csv", "angles-b.csv"}
    assert {path.name for path in (tmp_path / "fig4").iterdir()} == names | {"result.json", "manifest.json"}
    assert all(any(Path(name).match(pattern) for pattern in reserved("fig4")) for name in names)
    for name in names:
        if name.endswith(".svg"):
            root = ElementTree.parse(tmp_path / "fig4" / name).getroot()
            assert root.tag.endswith("svg")
    rows = list(csv.DictReader((tmp_path / "fig4" / "table.csv").open(encoding="utf-8")))
    assert len(rows) == len(figure.parts) == 12
    follows = {(row["demonstration"], row["joint"]): row["rod 2 follows"] for row in rows}
    assert follows["(b) bending", "pin"] == "no"
    angles = list(csv.reader((tmp_path / "fig4" / "angles-a.csv").open(encoding="utf-8")))
    assert len(angles) == 1 + 61  # 0.3 s by 5 ms, and the start
    assert float(angles[-1][1]) == pytest.approx(18.0)
    assert json.loads((tmp_path / "fig4" / "result.json").read_text())["figure"] == "fig4"
    figure.save(tmp_path / "fig4")  # a result may be replaced
