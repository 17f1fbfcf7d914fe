"""Rods in two layers, from the drape to the archive; and what rods' width and thickness are warned of."""

from functools import cache

import numpy as np
import pytest
from numpy.linalg import norm

import rodshell as rs
from rodshell.case.rod_ends import read_result
from rodshell.checks.bending import bending_of
from rodshell.formfinding.finite_sections import strong_bending
from rodshell.formfinding.trim import end_tangents
from rodshell.geometry.frames import unit
from rodshell.output.grid import joint_places
from rodshell.solve.equilibrium import Status, find_equilibrium
from rodshell.solve.problem import Problem, Supports
from tests.nets.sphere_net import crossing_angle

R, APART = 0.2, 4e-3
ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
PIN = rs.Pin(eccentricity=APART)
TARGETS = {"hemisphere": rs.Hemisphere(R), "ellipsoid": rs.Ellipsoid(a=0.2, b=0.15, c=0.12)}
every_target = pytest.mark.parametrize("name", TARGETS)


def layout(spacing=0.04):
    return rs.GridLayout.orthogonal(spacing=spacing)


@cache
def form(name, eccentricity=APART):
    return rs.find_form(TARGETS[name], layout(), ROD, joint=rs.Pin(eccentricity=eccentricity))


def lath(height, width=2e-3):
    """EI2/EI1 is the square of height over width."""
    return rs.Rod(rs.RectangularSection(width=width, height=height), rs.Material(10e9, 600.0))


@every_target
def test_each_rod_lies_on_its_own_parallel_surface_with_its_own_lengths(name):
    trimmed = form(name).trimmed
    mesh, x = trimmed.mesh, trimmed.positions
    assert set(np.abs(mesh.heights)) == {0.5 * APART}
    assert [rod.family for rod in mesh.grid.rods] == ["u" if mesh.flat[n, 2] < 0 else "v" for n in mesh.ends[:, 0]]
    assert np.abs(TARGETS[name].distance(x) - mesh.heights).max() < 1e-9 * R
    chords = norm(x[mesh.edges[:, 1]] - x[mesh.edges[:, 0]], axis=1)
    assert np.abs(chords / mesh.edge_lengths - 1).max() < 1e-6  # 2e-7 measured after the second turn, 4e-5 after one
    below, above = x[mesh.joint_pairs[:, 0]], x[mesh.joint_pairs[:, 1]]
    assert norm(above - below, axis=1) == pytest.approx(np.full(len(above), APART), rel=1e-12)


@every_target
def test_rods_end_along_the_normal_over_the_targets_end(name):
    boundary, mesh = form(name).trimmed.boundary, form(name).trimmed.mesh
    feet, off = TARGETS[name].closest(boundary.points), np.abs(form(name).draped.figures.net_deviation).max()
    assert np.abs(feet[:, 2]).max() <= 1.001 * off < 4e-4 * TARGETS[name].size  # of straight edges
    away = boundary.points - feet
    normals = TARGETS[name].on_surface(feet).normal
    np.testing.assert_allclose(away, mesh.heights[mesh.ends.ravel(), None] * normals, atol=1e-9 * R)
    np.testing.assert_array_equal(boundary.points, form(name).trimmed.positions[mesh.ends.ravel()])


def test_clamps_have_the_directions_of_the_layers_own_curves():
    """(1 + h S) t, where the curve between the layers has t: up to 1.4 degrees off on the ellipsoid."""
    target = TARGETS["ellipsoid"]
    trimmed = form("ellipsoid").trimmed
    ends, x = trimmed.mesh.ends.ravel(), trimmed.positions
    normals = trimmed.boundary.normals
    middle = x - trimmed.mesh.heights[:, None] * normals
    t = end_tangents(trimmed.mesh, middle)
    surface = target.on_surface(middle[ends])
    own = unit(t + trimmed.mesh.heights[ends, None] * np.einsum("nij,nj->ni", surface.hessian, t))
    turned = norm(own - t, axis=1).max()
    assert turned > 5e-3
    assert norm(trimmed.boundary.tangents - own, axis=1).max() < 0.02 * turned


@every_target
@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_two_layers_pop_up_as_easily_as_one_and_come_as_near(name, ends):
    one, two = form(name, 0.0), form(name)
    assert two.popped[ends].report.stable
    assert two.popped[ends].report.factorizations <= 3 * one.popped[ends].report.factorizations
    assert two.agreement[ends].max_relative <= 1.5 * one.agreement[ends].max_relative + 5e-4


def test_stresses_of_two_layers_are_those_of_rods_along_their_own_lines():
    """A line through the joints' middles and the layers' nodes would be a zigzag, bent four times as sharply."""
    stress = [
        bending_of(shell.shell, shell.state, ROD).stress.max()
        for shell in (form("hemisphere", eccentricity).popped["pinned"] for eccentricity in (0.0, APART))
    ]
    assert stress[1] == pytest.approx(stress[0], rel=0.1)


@pytest.mark.slow
def test_two_layers_rise_from_flat_to_the_state_that_the_drape_releases_to():
    found = form("hemisphere")
    for ends in ("pinned", "clamped"):
        risen = rs.pop_up(found.footprint, found.trimmed.boundary, ROD, ends=ends, start="flat", joint=PIN)
        assert risen.report.stable
        assert norm(risen.positions - found.popped[ends].positions, axis=1).max() < 1e-6 * R


@pytest.mark.slow
def test_a_grid_draped_as_one_surface_is_laid_in_layers_for_its_joints():
    """Its lengths are wrong by h/R, 0.1 %: it stands, but far worse than one that was draped in layers."""
    cut = rs.trim(rs.drape(layout(), ROD, TARGETS["hemisphere"]))
    shell = rs.pop_up(rs.map_back(cut), cut.boundary, ROD, joint=rs.Pin(eccentricity=4e-4))
    assert shell.report.stable
    assert shell.footprint.mesh.layered
    assert rs.agreement(shell, TARGETS["hemisphere"]).max < 0.03 * R
    assert form("hemisphere", 4e-4).agreement["clamped"].max < 0.1 * rs.agreement(shell, TARGETS["hemisphere"]).max


def test_joints_that_do_not_fit_the_layers_are_refused():
    found = form("hemisphere")
    for joint, there in ((rs.Ball(), "0 mm"), (rs.Pin(eccentricity=2e-3), "2 mm")):
        with pytest.raises(rs.InputError, match=f"two layers 4 mm apart, and its joints hold them {there} apart"):
            rs.pop_up(found.footprint, found.trimmed.boundary, ROD, joint=joint)


def test_an_eccentric_spring_that_lets_rods_roll_is_refused():
    with pytest.raises(rs.InputError, match="roll over each other"):
        rs.Spring(0.1, eccentricity=1e-3)
    for stiffness in ((1.0, 0.0), (0.0, 1.0)):  # where rods cross the mean of both acts in every direction
        assert rs.Spring(0.1, *stiffness, eccentricity=1e-3).holds_normals


@pytest.mark.slow
def test_the_archive_shows_both_layers_and_joints_between_them():
    archive = form("ellipsoid").archive()
    mesh = form("ellipsoid").footprint.mesh
    assert np.ptp(archive.states["flat"][:, 2]) == pytest.approx(APART)
    assert np.abs(archive.states["gap_draped"]).max() < 1e-6 * R
    draped = archive.states["draped"]
    places = joint_places(archive, draped)
    assert len(places) == len(mesh.grid.crossings)
    assert np.abs(TARGETS["ellipsoid"].distance(np.array(list(places.values())))).max() < 1e-6 * R


def test_seams_join_points_between_the_layers():
    seam = np.array([[0.02, -0.5], [0.05, 0.5]])
    target = rs.Ellipsoid(a=0.3, b=0.2, c=0.12)
    sewn = rs.find_form(target, layout(0.06), ROD, seams=[seam], joint=PIN, ends=("clamped",))
    assert sewn.status == "converged"
    assert max(sewn.stages.seams.moved.values()) < 1e-3 * R  # nets of one surface would miss each other by h/R
    for meeting in sewn.meetings:
        for end in meeting.ends:
            part = sewn.stages.patches[end.patch].trimmed
            k = [rod.name for rod in part.mesh.grid.rods].index(end.rod)
            own = part.positions[part.mesh.ends[k, end.side]]
            assert norm(own - meeting.point) == pytest.approx(0.5 * APART, rel=1e-6)


def test_a_grid_that_falls_in_two_layers_comes_to_rest_as_in_one():
    """The lower layer lies on the target; lengths differ by the layers' h/R, 1 mm here."""
    falling = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.07, length=0.8, edge=0.035)
    lengths = []
    for eccentricity in (0.0, 1e-3):
        joint = rs.Pin(eccentricity=eccentricity)
        fallen = rs.drape(falling, ROD, TARGETS["hemisphere"], method=rs.Gravity(), joint=joint)
        assert fallen.converged
        lengths.append([rod.length for rod in rs.trim(fallen).mesh.grid.rods])
    assert np.abs(np.subtract(*lengths)).max() < 0.01 * R


def test_thick_rods_without_eccentricity_are_told_by_how_much_the_layers_lengths_differ():
    """On the sphere by D/2 times the angle of a whole great circle's half, pi."""
    thick = rs.Rod(rs.Circle(radius=0.01), ROD.material)
    (words,) = rs.drape(layout(0.06), thick, TARGETS["hemisphere"]).warnings
    assert f"up to {1e3 * np.pi * 0.01:.1f} mm shorter" in words
    assert "up to 5 %" in words
    assert not rs.drape(layout(0.06), thick, TARGETS["hemisphere"], joint=rs.Pin(eccentricity=0.02)).warnings
    assert not rs.drape(layout(0.06), ROD, TARGETS["hemisphere"]).warnings


def test_sideways_bending_of_a_lath_is_the_geodesic_curvature_of_the_spheres_net():
    """Exactly v/R^2 times the derivative of the crossing angle; largest at the ends of the outer rods."""
    target, flat = TARGETS["hemisphere"], lath(4e-3)
    cut = rs.trim(rs.drape(rs.GridLayout.orthogonal(spacing=0.03, edge=0.0025), flat, target, joint=rs.Pin()))
    inner = np.abs(cut.mesh.stations[1:-1]).max() > 0  # all bends
    bent = strong_bending(target, cut.mesh, cut.positions, np.full(cut.mesh.node_count, inner), flat)
    exact = max(abs(rod.offset / R**2 * crossing_angle(rod.offset * rod.end / R**2)[1]) for rod in cut.mesh.grid.rods)
    assert bent.curvature == pytest.approx(exact, rel=0.1)  # rods straighten at their ends
    ratio, spacing = bent.ratio, 0.03
    weak, strong = flat.bend_stiffnesses
    assert ratio == pytest.approx(4.0)
    critical = np.pi / spacing * np.sqrt(weak * flat.twist_stiffness)
    assert bent.moment == pytest.approx(strong * bent.curvature / critical)


@pytest.mark.parametrize(("height", "buckles"), [(8e-3, False), (14e-3, True), (40e-3, True)])
def test_laths_buckle_between_pins_where_they_are_said_to(height, buckles):
    """The moment of a strip in pure bending tells before what the inertia of the released shell tells then."""
    target = rs.Cap(radius=2.0, base=1.0)
    rod = lath(height)
    draped = rs.drape(layout(0.3), rod, target, joint=rs.Pin())
    assert (draped.figures.strong_bending.moment > 1) == buckles
    assert bool(draped.warnings) == buckles
    cut = rs.trim(draped)
    released = rs.Shell.of(cut.mesh, rod, joint=rs.Pin())
    state = released.state(cut.positions, normals=target.on_surface(cut.positions).normal)
    problem = Problem(
        released.elements,
        released.stretch,
        Supports(released.held_ends()),
        2.0,
        flat_coordinates=released.flat_coordinates,
    )
    counted = find_equilibrium(problem, state, np.zeros(len(cut.mesh.edges)), most_modes=0)
    assert (counted.report.status is Status.BUCKLED) == buckles


def test_laths_on_edge_buckle_by_the_curvature_of_the_surface():
    """The moment EI1/R about their strong axis, on the sphere."""
    draped = rs.drape(layout(0.06), lath(1e-3, width=2e-3), TARGETS["hemisphere"], joint=rs.Pin())
    bent, (strong, weak) = draped.figures.strong_bending, lath(1e-3, width=2e-3).bend_stiffnesses
    assert not bent.flat
    assert bent.ratio == pytest.approx(4.0)
    assert bent.curvature == pytest.approx(1 / R, rel=1e-2)  # chords of three nodes
    critical = np.pi / 0.06 * np.sqrt(weak * lath(1e-3, width=2e-3).twist_stiffness)
    assert bent.moment == pytest.approx(strong * bent.curvature / critical)


def test_laths_that_buckle_everywhere_are_given_up_at_once_with_the_cause():
    target = rs.Cap(radius=2.0, base=1.0)
    found = rs.find_form(target, layout(0.3), lath(40e-3), joint=rs.Pin())
    assert found.popped["pinned"].report.status is Status.BUCKLED
    assert sum(shell.report.factorizations for shell in found.popped.values()) < 100
    assert "buckle between their joints" in found.status
    (words,) = found.warnings
    assert "400 times as stiff" in words
    assert "dips" not in words


@pytest.mark.slow
def test_popup_of_a_result_in_two_layers_is_refused(tmp_path):
    folder = form("ellipsoid").save(tmp_path / "oval", kinds=())
    with pytest.raises(rs.InputError, match="two layers 4 mm apart, and popup joins its rods at one point"):
        read_result(folder)
