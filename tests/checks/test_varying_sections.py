"""Stress, contact and mass of rods whose sections change along them."""

import numpy as np
import pytest

from rodshell.checks.bending import bending
from rodshell.checks.contact import contact
from rodshell.fabrication.fabricate import fabricate
from rodshell.fabrication.settings import Fabrication
from rodshell.layout import FlatGrid, Profile, mesh_grid
from rodshell.layout.gridlayout import lattice_rod
from rodshell.rods.materials import Material
from rodshell.rods.section import Circle, RectangularSection, Rod

RADIUS, BEND = 3e-3, 0.5
ROUND = Rod(Circle(RADIUS), Material(20e9, 1800.0))
TAPER = Profile((0.0, 0.5, 1.0), (0.1, 1.0, 0.4))


def arc(profile, length=0.6, edges=60):
    """One rod bent to a circle of the radius BEND [m], without strain of its axis."""
    mesh = mesh_grid(FlatGrid.of([lattice_rod(0, "U", 0.0, 0.0, length)]), length / edges).with_profiles(profile)
    half = 0.5 * length / edges / BEND  # half the angle of an edge; the chord is the edge's rest length
    angle = 2 * half * np.arange(edges + 1)
    radius = 0.5 * length / edges / np.sin(half)
    positions = np.empty((edges + 1, 3))
    positions[mesh.rod_nodes] = np.column_stack([radius * np.sin(angle), 0 * angle, radius * np.cos(angle)])
    return mesh, positions


def along(mesh):
    return mesh.stations / mesh.stations[-1]


def test_stress_of_a_tapered_round_rod_is_that_of_its_radius_there():
    mesh, positions = arc(TAPER)
    found = bending(mesh, positions, ROUND)
    factor = np.interp(along(mesh), TAPER.stations, TAPER.factors)
    expected = 20e9 * RADIUS * factor**0.25 * found.curvature
    assert found.stress == pytest.approx(expected, rel=1e-9, abs=1.0)
    assert found.curvature[1:-1] == pytest.approx(np.full(59, 1 / BEND), rel=1e-4)


@pytest.mark.parametrize(("varies", "power"), [("width", 1 / 3), ("height", 0.0), ("laths", 0.0)])
def test_stress_of_a_lath_bent_out_of_the_grid_follows_its_thickness_only(varies, power):
    lath = Rod(RectangularSection(width=4e-3, height=20e-3), Material(10e9, 600.0))
    profile = Profile((0.0, 0.5, 1.0), (1.0, 2.0, 1.0), varies)
    mesh, positions = arc(profile)
    curvature = bending(mesh, positions, lath).curvature
    components = np.column_stack([curvature, 0 * curvature])
    found = bending(mesh, positions, lath, components=components)
    factor = np.interp(along(mesh), profile.stations, profile.factors)
    assert found.stress == pytest.approx(10e9 * 2e-3 * factor**power * curvature, rel=1e-9, abs=1.0)


def test_clearance_of_rods_side_by_side_is_that_of_their_local_radii():
    apart = 7e-3
    rods = [lattice_rod(0, "A", 0.0, 0.0, 1.0), lattice_rod(0, "B", apart, 0.0, 1.0)]
    mesh = mesh_grid(FlatGrid.of(rods), 0.01).with_profiles(Profile((0.0, 1.0), (1.0, 16.0)))
    found = contact(mesh, mesh.flat[mesh.rod_nodes], ROUND)
    assert found.clearance == pytest.approx(apart - 4 * RADIUS, abs=1e-6)  # both are twice as thick at their ends
    assert found.where[0] == pytest.approx(1.0, abs=0.011)  # an edge
    thin = contact(mesh.with_profiles(Profile((0.0, 1.0), (1.0, 0.0625))), mesh.flat[mesh.rod_nodes], ROUND)
    assert thin.clearance == pytest.approx(apart - 2 * RADIUS, abs=1e-5)


def test_double_laths_are_twice_as_deep_for_what_lies_above_them():
    lath, above = Rod(RectangularSection(width=4e-3, height=20e-3), Material(10e9, 600.0)), 15e-3
    rods = [lattice_rod(0, "A", 0.0, 0.0, 1.0), lattice_rod(0, "B", 0.0, 2.0, 3.0)]
    mesh = mesh_grid(FlatGrid.of(rods), 0.01).with_profiles(Profile.double(0.5))
    positions = mesh.flat[mesh.rod_nodes]
    positions[mesh.rod_slice(1)] += (-2.0, 0.0, above)
    up = np.tile([0.0, 0.0, 1.0], (len(mesh.edges), 1))
    assert contact(mesh, positions, lath, directors=up).clearance == pytest.approx(above - 2 * 4e-3, abs=1e-9)
    single = mesh.with_profiles(None)
    assert contact(single, positions, lath, directors=up).clearance == pytest.approx(above - 4e-3, abs=1e-9)


def test_cut_mass_of_a_tapered_rod_is_that_of_its_solid_with_allowances_of_its_ends():
    mesh, _ = arc(Profile((0.0, 1.0), (1.0, 4.0)))
    # area as the square root of EI: its mean is 2/3 (4^1.5 - 1)/(4 - 1), 1 and 2 at the ends
    expected = ROUND.mass_per_length * (0.6 * 14 / 9 + 0.05 * 3)
    assert fabricate(mesh, ROUND, Fabrication(end_allowance=0.05)).mass[0] == pytest.approx(expected, rel=1e-6)
