"""Paths of equilibria that end, against a closed form: an arch that is turned inside out by one of its clamps.

A strip of length 1 whose ends are `SHORT` nearer to each other is buckled upwards; its left end is held horizontal,
its right end is turned by an angle a. The shape depends on mu = a / sqrt(SHORT) alone, and the arch snaps downwards
at mu = 1.7818 [Gomez, Moulton and Vella, Nature Physics 13 (2017) 142].
"""

from functools import cache
from math import cos, pi, sin, sqrt

import numpy as np
import pytest

import rodshell as rs
from rodshell.layout import FlatGrid
from rodshell.layout.gridlayout import lattice_rod
from rodshell.model import Shell
from rodshell.solve import path as module
from rodshell.solve.equilibrium import find_stable
from rodshell.solve.path import trace
from rodshell.solve.problem import Problem, Supports

ROD = rs.Rod(section=rs.Circle(radius=5e-4), material=rs.Material(youngs_modulus=1e9, density=1e3))
SHORT, EDGES, SHORTEST = 0.005, 80, 0.005


@cache
def snapping():
    """The largest mu of the upper branch, and how far the strip's nodes go from there to the lower branch at most.

    w = A (sin tx - tx) + B (cos tx - 1), w(1) = 0, w'(1) = mu, the integral of w'^2 / 2 being 1.
    """
    x = np.linspace(0, 1, 2001)

    def turned(t):
        columns = np.array([[sin(t) - t, cos(t) - 1], [t * (cos(t) - 1), -t * sin(t)]])
        a, b = np.linalg.solve(columns, [0.0, 1.0])
        slope = t * (a * (np.cos(t * x) - 1) - b * np.sin(t * x))
        mu = 1 / sqrt(0.5 * np.trapezoid(slope**2, x))
        return mu, mu * (a * (np.sin(t * x) - t * x) + b * (np.cos(t * x) - 1))

    branches = [turned(t) for t in np.linspace(1.0, 8.9, 4000) if abs(t - 2 * pi) > 1e-3]
    mu, upper = max((one for one in branches if one[1].mean() > 0), key=lambda one: one[0])
    _, lower = min((one for one in branches if one[1].mean() < 0), key=lambda one: abs(one[0] - mu))
    return mu, sqrt(SHORT) * np.abs(upper - lower).max()


def turned_to(most, *, snap, shortest=SHORTEST):
    """The right clamp of the buckled strip turned from mu = 0 to `most`; the shell and the path."""
    mesh = rs.mesh_grid(FlatGrid.of([lattice_rod(0, "U01", 0.0, -0.5, 0.5)]), 1.0 / EDGES)
    shell = Shell.of(mesh, ROD, clamped=True)
    plane = shell.freedom().with_directions(np.arange(mesh.node_count), (1.0, 0.0, 0.0), (0.0, 0.0, 1.0))
    held = plane.with_directions(shell.ghosts).with_directions(shell.ends)
    moved = np.append(shell.ends, shell.ghosts)
    ends = (0.5 - 0.5 * SHORT) * np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])

    def problem(t):
        angle = t * most * sqrt(SHORT)
        outward = np.array([[-1.0, 0.0, 0.0], [cos(angle), 0.0, sin(angle)]])
        supports = Supports(held, moved, np.vstack([ends, ends + outward / EDGES]))
        return Problem(shell.elements, shell.stretch, supports, 1.0)

    share = mesh.flat[:, 0] + 0.5
    arch = mesh.flat * [1 - SHORT, 1, 1]
    arch[:, 2] = 2 / pi * sqrt(SHORT) * np.sin(pi * share) ** 2
    start = find_stable(problem(0.0), shell.state(arch, np.array([[-1.0, 0, 0], [1.0, 0, 0]])), np.zeros(EDGES))
    assert start.report.stable
    return shell, trace(problem, start, 0.0, 1.0, shortest=shortest, snap=snap, most_factorizations=500)


def test_the_closed_form_is_the_published_one():
    assert snapping()[0] == pytest.approx(1.7818, abs=1e-4)


def test_a_branch_is_traced_to_its_limit_point():
    """To the shortest step; and the strip is 1/100 longer than a linear one by its slopes and shorter by its thrust."""
    _, path = turned_to(2.5, snap=False)
    assert 2.5 * path.t == pytest.approx(snapping()[0], rel=0.01)
    assert path.found.report.stable
    assert path.snaps == ()


def test_at_a_limit_point_it_snaps_to_the_other_side_and_goes_on():
    shell, path = turned_to(2.5, snap=True)
    middle = shell.mesh.nodes_of(0)[EDGES // 2]
    assert path.t == 1.0
    assert path.found.report.stable
    assert path.found.state[middle, 2] < 0
    (snap,) = path.snaps
    assert 2.5 * snap.start <= snapping()[0] * 1.01
    assert 2.5 * snap.stop >= snapping()[0] * 0.99
    assert snap.moved == pytest.approx(snapping()[1], rel=0.05)  # 2 % measured


def test_below_its_limit_point_it_does_not_snap_either_way():
    shell, path = turned_to(1.7, snap=True)
    assert path.t == 1.0
    assert path.snaps == ()
    assert path.found.state[shell.mesh.nodes_of(0)[EDGES // 2], 2] > 0


def test_a_branch_that_goes_on_is_no_snap_where_it_cannot_be_followed(monkeypatch):
    """Every step ahead is taken for one that leaves the branch, so that the energy is followed down at each."""
    fallen, calls = module._fallen, list[object]()

    def noted(*given, **options):
        calls.append(given)
        return fallen(*given, **options)

    def ahead(here, there):
        return bool(there.problem.constraint.goals[-1, 2] > here.problem.constraint.goals[-1, 2])

    monkeypatch.setattr(module, "_fallen", noted)
    monkeypatch.setattr(module, "unaccounted", ahead)
    _, path = turned_to(1.7, snap=True, shortest=0.2)
    assert path.t == 1.0
    assert len(calls) >= 2
    assert path.snaps == ()
