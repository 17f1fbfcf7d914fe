"""Pop-ups with every kind of joint, and what their joints carry, by free bodies."""

from dataclasses import replace
from functools import cache
from math import inf

import numpy as np
import pytest
from numpy.linalg import norm

import rodshell as rs
from rodshell.checks.reactions import joint_loads, reactions
from rodshell.joints.crossings import RodNodes
from rodshell.rods.elements import Stretch
from rodshell.solve.equilibrium import find_equilibrium
from rodshell.solve.problem import Problem, Supports

ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
SPACING = 0.05
SPAN = ROD.bend_stiffness / SPACING  # N m/rad
THIN = rs.Rod(section=rs.Circle(radius=4e-4), material=rs.Material(youngs_modulus=1e6, density=1e3))
JOINTS = {
    "ball": rs.Ball(),
    "pin": rs.Pin(),
    "spring": rs.Spring(0.1 * SPAN, 3 * SPAN, SPAN),
    "rigid": rs.Rigid(),
    "two linkers": rs.Linker(rod=THIN),
    "four linkers": rs.Linker(rod=THIN, corners=4),
    "eccentric pin": rs.Pin(eccentricity=2e-4),
    "eccentric spring": rs.Spring(0.0, SPAN, SPAN, eccentricity=2e-4),
}
every_joint = pytest.mark.parametrize("name", JOINTS)


@cache
def trimmed():
    """An ellipsoid turned under the grid: no symmetry."""
    layout = rs.GridLayout.orthogonal(rods="auto", spacing=SPACING, length="auto", edge=0.0126, rotate=0.3)
    return rs.trim(rs.drape(layout, ROD, rs.Ellipsoid(a=0.2, b=0.16, c=0.13)))


@cache
def popped(name, ends="clamped", start="draped"):
    cut = trimmed()
    return rs.pop_up(rs.map_back(cut), cut.boundary, ROD, ends=ends, start=start, joint=JOINTS[name])


def settled(shell, state, forces):
    """One Newton step further, for forces to round-off."""
    supports = Supports(shell.held_ends())
    return find_equilibrium(
        Problem(shell.elements, shell.stretch, supports, 0.2, flat_coordinates=shell.flat_coordinates), state, forces
    )


@every_joint
def test_every_joint_pops_up_to_a_stable_shell(name):
    report = popped(name).report
    assert report.converged
    assert report.stable


@pytest.mark.slow
@every_joint
@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_each_rod_is_in_balance_under_its_supports_and_its_joints(name, ends):
    """Forces and moments on every rod as a free body: reactions and joint loads are found in different ways."""
    shell = popped(name, ends).shell
    found = settled(shell, popped(name, ends).state, popped(name, ends).forces)
    shell = shell.with_elements(found.elements)
    loads, held = joint_loads(shell, found.state), reactions(shell, found)
    crossings, positions = shell.mesh.grid.crossings, found.state[shell.node_blocks]
    places = RodNodes(shell.mesh, shell.node_blocks, shell.first_angle).at_crossings
    for rod in range(len(shell.mesh.grid.rods)):
        force, moment = np.zeros(3), np.zeros(3)
        for end in (2 * rod, 2 * rod + 1):
            force += held.forces[end]
            moment += held.moments[end] + np.cross(held.points[end], held.forces[end])
        for joint, side in np.argwhere(crossings.rods == rod):
            force += loads.forces[joint, side]
            # the moment is about the second rod's node, and opposite on the first
            on_second = loads.moments[joint] + np.cross(positions[places[joint, 1]], loads.forces[joint, 1])
            moment += on_second if side else -on_second
        largest = norm(loads.forces, axis=2).max()
        assert norm(force) < 1e-8 * largest
        assert norm(moment) < 1e-8 * largest * 0.2


def test_a_spring_carries_its_stiffness_times_its_angle():
    """About the normal; half an edge of each rod gives way in series: 1/k + 2 l/(4 EI)."""
    shell = popped("spring").shell
    found = settled(shell, popped("spring").state, popped("spring").forces)
    loads = joint_loads(shell.with_elements(found.elements), found.state)
    turned = loads.angles - loads.flat_angles
    assert np.abs(turned).max() > 0.5
    series = 1 / (1 / (0.1 * SPAN) + 2 * 0.0125 / (4 * ROD.bend_stiffness))
    wide = np.abs(turned) > 0.1
    # 3 % measured: the angle is that of chords over two edges of 12.5 mm, and edges in tails are shorter
    assert -loads.shear_moments[wide] / turned[wide] == pytest.approx(series, rel=0.05)


def test_a_pin_carries_no_moment_about_its_normal_and_a_ball_none_at_all():
    for name in ("pin", "ball"):
        shell = popped(name, "pinned").shell
        found = settled(shell, popped(name, "pinned").state, popped(name, "pinned").forces)
        loads = joint_loads(shell.with_elements(found.elements), found.state)
        if name == "ball":
            assert not loads.moments.any()
        else:
            assert loads.out_of_plane_moments.max() > 1e-3 * SPAN
            # the normals of the tangents and of the material frames differ by the bend of half an edge
            assert np.abs(loads.shear_moments).max() < 0.02 * loads.out_of_plane_moments.max()


def test_pins_from_flat_reach_the_state_that_the_drape_releases_to():
    flat, draped = popped("pin", "clamped", "flat"), popped("pin")
    assert flat.report.stable
    assert norm(flat.positions - draped.positions, axis=1).max() < 1e-6 * 0.2


def test_soft_joints_pop_up_like_balls_and_stiff_ones_like_welds():
    soft = rs.Spring(1e-6 * SPAN, 1e-6 * SPAN, 1e-6 * SPAN)
    cut = trimmed()
    for joint, like in ((soft, "ball"), (rs.Spring(1e4 * SPAN, inf, inf), "rigid")):
        other = rs.pop_up(rs.map_back(cut), cut.boundary, ROD, joint=joint)
        assert norm(other.positions - popped(like).positions, axis=1).max() < 2e-4 * 0.2
    assert norm(popped("ball").positions - popped("rigid").positions, axis=1).max() > 0.01 * 0.2


def test_joints_may_differ_from_place_to_place():
    cut = trimmed()
    count = len(cut.mesh.grid.crossings)
    mixed = [rs.Rigid() if k % 2 else rs.Ball() for k in range(count)]
    between = rs.pop_up(rs.map_back(cut), cut.boundary, ROD, joint=mixed)
    assert between.report.stable
    apart = [norm(between.positions - popped(name).positions) for name in ("ball", "rigid")]
    assert min(apart) > 0.1 * norm(popped("ball").positions - popped("rigid").positions)
    with pytest.raises(rs.InputError, match=f"{count} crossings: give one value for all, or one for each, not 3"):
        rs.pop_up(rs.map_back(cut), cut.boundary, ROD, joint=mixed[:3])


def test_a_gravity_drape_with_pins_ends_where_one_with_balls_does():
    """Pins turn freely about the normal, and the rods hardly twist (docs/theory/drape.md, The gravity drape)."""
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=SPACING, length=0.9, edge=0.0126)
    lengths = []
    for joint in (rs.Ball(), rs.Pin()):
        fallen = rs.drape(layout, ROD, rs.Hemisphere(radius=0.2), method=rs.Gravity(), joint=joint)
        assert fallen.converged
        lengths.append([rod.length for rod in rs.trim(fallen).mesh.grid.rods])
    assert np.abs(np.subtract(*lengths)).max() < 2e-3 * 0.2


def test_three_rods_at_one_node_have_one_kind_of_joint():
    grid = rs.straight_rods([[[-1, 0], [1, 0]], [[0, -1], [0, 1]], [[-1, -1], [1, 1]]])
    mesh = rs.mesh_grid(grid, 0.25)
    for other in (rs.Linker(), rs.Ball(), rs.Rigid()):
        with pytest.raises(rs.InputError, match="give all of them the same kind"):
            rs.Shell.of(mesh, ROD, joint=[rs.Pin(), rs.Pin(), other])


def test_eccentric_joints_refuse_rods_that_need_three_layers():
    grid = rs.straight_rods([[[-1, 0], [1, 0]], [[0.3, -1], [0.3, 1]], [[-1, -0.8], [1, 1.0]]])
    with pytest.raises(rs.InputError, match="two layers of rods, but R03 crosses rods of both"):
        rs.Shell.of(rs.mesh_grid(grid, 0.25), ROD, joint=rs.Pin(eccentricity=1e-3))


def test_an_energy_between_rods_that_cannot_tell_its_moments_is_refused() -> None:
    """Springs from rod to rod beside a joint turn them, which would be reported as 0 N m."""
    done = popped("ball", "pinned")
    shell, mesh = done.shell, done.shell.mesh
    beside = shell.node_blocks[mesh.at_crossings[:3] + 1]
    springs = Stretch.elastic(beside, np.full(3, 0.5 * SPACING), np.ones(3))
    with pytest.raises(rs.InputError, match="the energy Stretch between rods acts on nodes alone"):
        joint_loads(replace(shell, between=(*shell.between, springs)), done.state)
