"""Faces from STEP files; the files are written by hand."""

from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.targets import apart, nurbs_files
from tests.targets.meshes import Floats
from tests.targets.stepfile import StepFile


def written(path: Path, file: StepFile) -> Path:
    path.write_bytes(file.text())
    return path


def saddle(name: str = "") -> StepFile:
    """(x^2 - y^2) / 0.8 over a square of half width 0.2 m: a Bezier surface of degree two, exactly."""
    i, j = np.meshgrid(np.arange(3), np.arange(3), indexing="ij")
    controls = np.stack([0.2 * (i - 1), 0.2 * (j - 1), 0.04 * ((-1.0) ** i - (-1.0) ** j) / 0.8], axis=2)
    file = StepFile("m")
    file.patch(controls, 2, [0.0, 1.0], name)
    return file


def plan(reach: float) -> Floats:
    return np.random.default_rng(0).uniform(-reach, reach, (200, 2))


@pytest.mark.slow
def test_a_face_is_its_surface(tmp_path):
    pytest.importorskip("OCP", reason="no OpenCASCADE: pip install cadquery-ocp-novtk")
    target = rs.surface_from(written(tmp_path / "saddle.step", saddle()))
    xy = plan(0.18)
    assert target.height_at(xy) == pytest.approx((xy[:, 0] ** 2 - xy[:, 1] ** 2) / 0.8, abs=2e-7)
    assert target.size == pytest.approx(0.2, rel=1e-5)
    edge = np.array([[0.19, 0.0, 0.19**2 / 0.8], [0.0, -0.15, -(0.15**2) / 0.8]])
    # to x = 0.2 and y = -0.2 along the surface, whose slope there is a half
    exact = np.array([0.01 + 0.5 * 0.004875, 0.05 + 0.5 * 0.021875]) / 1.25**0.5
    assert target.margin(edge) == pytest.approx(exact, rel=1e-5)


@pytest.mark.slow
def test_splines_with_inner_knots_are_met(tmp_path):
    """A plane as a cubic of two spans each way, raised at the control point in the middle."""
    pytest.importorskip("OCP", reason="no OpenCASCADE: pip install cadquery-ocp-novtk")
    knots, at = [0.0, 1.0, 2.0], np.array([0.0, 1 / 3, 1.0, 5 / 3, 2.0])  # Greville points reproduce the plane
    x, y = np.meshgrid(at - 1, at - 1, indexing="ij")
    controls = np.stack([x, y, 0 * x], axis=2)
    controls[2, 2, 2] = 0.8
    file = StepFile("m")
    file.patch(controls, 3, knots)
    target = rs.surface_from(written(tmp_path / "bent.stp", file))
    assert target.height_at(np.zeros((1, 2))) == pytest.approx(0.8 * 0.5**2, abs=1e-4)  # the middle spline is 1/2 there


@pytest.mark.slow
def test_a_face_ends_where_its_edge_is(tmp_path):
    """On a sphere at the circle that bounds it, on a plane at the trim; the file is in millimetres."""
    pytest.importorskip("OCP", reason="no OpenCASCADE: pip install cadquery-ocp-novtk")
    file = StepFile("mm")
    file.cap(200.0, 50.0, "cap")
    file.disc(150.0, "disc")
    path = written(tmp_path / "two.step", file)
    cap, disc = (rs.surface_from(path, name=name) for name in ("cap", "disc"))
    angle = np.linspace(0, 6, 40)
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    rim = np.arccos(0.25)
    for polar in (rim - 0.1, rim + 0.1):
        points = 0.2 * (np.sin(polar) * ring + [0, 0, np.cos(polar)])
        assert np.abs(cap.implicit(points).value).max() < 1e-4  # past the rim it is carried on
        assert cap.margin(points) == pytest.approx(0.2 * (rim - polar), rel=0.01)
    for radius in (0.1, 0.17):
        assert disc.margin(radius * ring) == pytest.approx(0.15 - radius, rel=1e-3)


@pytest.mark.slow
def test_of_several_faces_one_is_chosen_by_name_or_number(tmp_path):
    pytest.importorskip("OCP", reason="no OpenCASCADE: pip install cadquery-ocp-novtk")
    file = saddle(name="roof")
    file.cap(0.2, 0.05, "cap")
    path = written(tmp_path / "house.step", file)
    there = r'\(available: 1, "roof"; 2, "cap"\)'
    with pytest.raises(rs.InputError, match=f"has 2 faces: choose one by its name or number {there}"):
        rs.surface_from(path)
    with pytest.raises(rs.InputError, match=f'has 0 faces named "wall": .* {there}'):
        rs.surface_from(path, name="wall")
    for name, top in (("cap", 0.2), ("1", 0.0)):
        target = rs.surface_from(path, name=name)
        assert target.height_at(np.zeros((1, 2))) == pytest.approx(top, abs=1e-6)
        assert target.parameters() == {"kind": "nurbs", "object": name, "file": str(path)}  # as in a case file


def test_a_unit_beside_that_of_the_file_is_refused(tmp_path):
    with pytest.raises(rs.InputError, match="state their unit: leave it out, or scale the target"):
        rs.surface_from(written(tmp_path / "saddle.step", saddle()), unit=1e-3)


def test_without_opencascade_the_sentence_says_how_to_get_it(tmp_path, monkeypatch):
    monkeypatch.setattr(nurbs_files, "find_spec", lambda name: None)
    with pytest.raises(rs.InputError, match=r'pip install "rodshell\[step\]"'):
        rs.surface_from(written(tmp_path / "saddle.step", saddle()))


@pytest.mark.parametrize(
    ("does", "said"),
    [
        ("import os; os.kill(os.getpid(), 11)", "cannot be read as STEP: it is damaged"),
        ("raise RuntimeError", "cannot be read as STEP: it is damaged"),
        ("import time; time.sleep(60)", "cannot be read within 1 s"),
    ],
)
def test_a_reader_that_falls_or_hangs_is_told_of_in_one_sentence(does, said, tmp_path, monkeypatch):
    (tmp_path / "opencascade.py").write_text(does)
    monkeypatch.setattr(nurbs_files, "READERS", tmp_path)
    monkeypatch.setattr(apart, "LONGEST", 1.0)
    monkeypatch.setattr(nurbs_files, "find_spec", lambda name: True)
    with pytest.raises(rs.InputError, match=said):
        rs.surface_from(written(tmp_path / "saddle.step", saddle()))
