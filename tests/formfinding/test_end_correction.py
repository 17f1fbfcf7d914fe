"""Natural ends of rods on a net: against natural cubic splines, and against the drape that they are a guess of."""

import importlib

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

import rodshell as rs
from rodshell.formfinding.bound_drape import corrected_ends
from rodshell.geometry.frames import unit
from rodshell.layout import FlatGrid, FlatRod, mesh_grid

BEND = 0.01  # so small that beams are cubic splines
AT = np.array([-2.5, -1.7, -0.9, 0.2, 1.0, 1.9])  # joints, unequally far apart
PLANE = rs.HeightField(function=lambda x, y: 0 * x, domain=rs.Rectangle((20.0, 20.0)))


def upright(points):
    return np.tile([0.0, 0.0, 1.0], (len(points), 1))


@pytest.mark.parametrize("tail", [0.0, 0.35])
def test_a_rod_on_a_plane_becomes_the_natural_spline_through_its_joints(tail):
    """A line y = BEND x^2 of a net, crossed by straight ones. Past its last joints a rod is straight."""
    across = [FlatRod.v(f"V{k}", x, -1.0, 1.0) for k, x in enumerate(AT.tolist())]
    grid = FlatGrid.of([FlatRod.u("U", 0.25, AT[0] - tail, AT[-1] + tail), *across])
    mesh = mesh_grid(grid, 0.1)
    points = mesh.flat.copy()
    points[:, 1] += BEND * points[:, 0] ** 2
    found, on_rod = corrected_ends(PLANE, mesh, points, upright(points)), mesh.nodes_of(0)
    spline = CubicSpline(AT, BEND * AT**2, bc_type="natural")
    x = mesh.flat[on_rod, 0]
    ends = np.clip(x, AT[0], AT[-1])
    natural = 0.25 + spline(ends) + spline(ends, 1) * (x - ends)
    shift = np.abs(natural - points[on_rod, 1]).max()
    # to first order in the slope: its square is (2 BEND 2.85)^2 = 0.003
    assert np.abs(found[on_rod, 1] - natural).max() < 0.006 * shift
    others = np.setdiff1d(np.arange(mesh.node_count), on_rod)
    assert found[others] == pytest.approx(points[others], abs=1e-12)


def test_a_line_that_turns_far_in_its_last_span_is_left_alone():
    mesh = mesh_grid(
        FlatGrid.of([FlatRod.u("U", 0.25, 0.0, 3.0), *(FlatRod.v(f"V{k}", k, -1.0, 1.0) for k in range(4))]), 0.1
    )
    for turn, moves in ((0.45, True), (0.55, False)):
        points = mesh.flat.copy()
        points[:, 1] += 0.5 * turn * points[:, 0] ** 2 * (points[:, 0] < 0.6)  # of one span, from the level start on
        moved = corrected_ends(PLANE, mesh, points, upright(points)) - points
        assert (np.abs(moved).max() > 1e-3) == moves


@pytest.mark.parametrize("target", [rs.Hemisphere(0.2), rs.Paraboloid(0.2, 0.15), rs.Ellipsoid(0.2, 0.15, 0.18)])
def test_the_drape_starts_much_nearer_to_where_it_ends(target, monkeypatch):
    bound, seen = importlib.import_module("rodshell.formfinding.bound_drape"), list[np.ndarray]()

    def listen(target, mesh, points, normal):
        assert normal == pytest.approx(unit(target.level(points)[1]))
        seen.extend([points, corrected_ends(target, mesh, points, normal)])
        return seen[-1]

    monkeypatch.setattr(bound, "corrected_ends", listen)
    rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
    draped = rs.drape(rs.GridLayout.orthogonal(spacing=0.03, edge=0.005), rod, target)
    plain, natural = (np.linalg.norm(draped.positions - start, axis=1).max() for start in seen)
    assert natural < 0.25 * plain  # 0.06 to 0.11 measured
    assert draped.report.factorizations <= 3


def test_it_is_but_a_guess(monkeypatch):
    """The drape is the same from the net itself, the axes too, which it holds."""
    bound, rod = (
        importlib.import_module("rodshell.formfinding.bound_drape"),
        rs.Rod(rs.Circle(1e-3), rs.Material(1e6, 1e3)),
    )
    target = rs.HeightField(formula="0.03*sin(20*x)*cos(17*y)", domain=rs.Disc(0.2))
    layout = rs.GridLayout.orthogonal(spacing=0.05, edge=0.0125, rotate=0.4)
    found = rs.drape(layout, rod, target, anchor=(-0.0269, -0.0448))
    monkeypatch.setattr(bound, "corrected_ends", lambda target, mesh, points, normal: target.retract(points))
    plain = rs.drape(layout, rod, target, anchor=(-0.0269, -0.0448))
    assert np.abs(found.positions - plain.positions).max() < 1e-11
