"""Shells of rods that are curved at rest: free of stress as they were made, and bent by the difference elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.special import fresnel

import rodshell as rs
from rodshell.layout import FlatGrid, FlatRod, GridMesh, mesh_grid
from rodshell.layout.rest_curve import RestCurve
from rodshell.model.shell import Shell

RADIUS = 0.8
LATH = rs.Rod(rs.RectangularSection(width=0.002, height=0.02), rs.Material.preset("gfrp"))
ROUND = rs.Rod(rs.Circle(radius=0.003), rs.Material.preset("gfrp"))


def arc_mesh(edges: int, radius: float = RADIUS) -> GridMesh:
    """A rod of 1 m that is an arc at rest, turning to the left, laid along the arc of a `radius`."""
    arc = RestCurve((0.0, 1.0), (1 / RADIUS, 1 / RADIUS))
    rod = FlatRod("R01", "free", 0.0, 0.0, 1.0, (0.0, 0.0), (1.0, 0.0), curve=arc)
    mesh = mesh_grid(FlatGrid.of((rod,)), 1.0 / edges)
    step = 1.0 / edges / radius  # angle of an edge
    circle = 0.5 / edges / np.sin(0.5 * step)  # whose chords have the length of the edges
    angle = step * np.arange(edges + 1)[np.argsort(mesh.rod_nodes)]
    return replace(mesh, flat=circle * np.column_stack([np.sin(angle), 1 - np.cos(angle), 0 * angle]))


def state_of(shell: Shell, radius: float) -> np.ndarray:
    """On that arc, its clamps along its tangents."""

    angles = np.array([0.0, 1.0 / radius])
    along = np.column_stack([np.cos(angles), np.sin(angles), 0 * angles])
    return shell.state(shell.mesh.flat, along * [[-1.0], [1.0]])


def energy_of(shell: Shell, radius: float, gradient: np.ndarray | None = None) -> float:
    scrap = np.zeros((len(shell.like), 3)) if gradient is None else gradient
    return float(sum(element.evaluate(state_of(shell, radius), scrap) for element in shell.within))


@pytest.mark.parametrize("clamped", [False, True])
@pytest.mark.parametrize("rod", [LATH, ROUND], ids=["lath", "round"])
def test_a_rod_is_free_of_stress_on_its_own_arc(rod: rs.Rod, clamped: bool) -> None:
    shell = Shell.of(arc_mesh(40), rod, clamped=clamped)
    gradient = np.zeros((len(shell.like), 3))
    straight = 0.5 * rod.bend_stiffnesses[1] / RADIUS**2  # energy of a straight rod of 1 m there
    assert energy_of(shell, RADIUS, gradient) < 1e-20 * straight
    assert np.abs(gradient).max() < 1e-9 * straight


@pytest.mark.parametrize("radius", [-0.8, 2.0, 1e5])
def test_elsewhere_it_bends_by_the_difference(radius: float) -> None:
    """Clamped, so that all of its length bends alike: to second order in the edges."""
    exact = 0.5 * LATH.bend_stiffnesses[1] * (1 / radius - 1 / RADIUS) ** 2
    shells = (Shell.of(arc_mesh(edges, radius), LATH, clamped=True) for edges in (40, 80))
    off = [abs(energy_of(shell, radius) / exact - 1.0) for shell in shells]
    assert off[1] < 0.3 * off[0]
    assert off[1] < 1e-4


def test_the_line_of_a_clothoid_at_rest_is_that_of_fresnel() -> None:
    s = np.linspace(0.0, 1.5, 31)
    points = RestCurve((0.0, 2.0), (0.0, 2.0 * np.pi)).line(s)
    np.testing.assert_allclose(points, np.column_stack(fresnel(s)[::-1]), atol=1e-7)


def test_pieces_of_a_rod_keep_its_curve() -> None:
    mesh = arc_mesh(10)
    (rod,) = mesh.grid.rods
    assert rod.cut(0.2, 0.7).curve == rod.curve
    np.testing.assert_allclose(mesh.rest_curvatures, 1 / RADIUS)
