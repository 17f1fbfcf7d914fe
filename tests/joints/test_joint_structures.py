"""Structures with joints against beam theory: portal, grillage, T, L and stars of rods, Michell's ring, lattices.

The problems, with their exact answers, stand in `joint_problems.py`.
"""

from math import cos, pi, radians, sin

import numpy as np
import pytest

import rodshell as rs
from rodshell.solve.equilibrium import find_equilibrium
from rodshell.solve.problem import Problem, Supports
from tests.joints.joint_problems import (
    EI,
    JOINTS,
    MESHES,
    STARS,
    STRIP,
    Star,
    X,
    Z,
    asymmetry,
    bending_stiffness,
    flat_state,
    folding_energy,
    lattice,
    linker_energy,
    michell_twist,
    portal_sway,
    response,
    sheared,
    tangent_stiffness,
)
from tests.solve.rod_problems import order

SECOND = pytest.approx(2.0, abs=0.05)


# Small displacements against beam theory


@pytest.mark.parametrize("joint", [rs.Rigid(), rs.Spring(5.0), rs.Spring(0.3)], ids=["rigid", "firm", "soft"])
def test_portal_frame_sways_as_beam_theory_says(joint):
    errors = [portal_sway(edge, joint) - 1 for edge in MESHES]
    assert order(MESHES, errors) == SECOND
    assert abs(errors[-1]) < 1e-3  # 7.8e-4 measured, rigid


@pytest.mark.parametrize("joint", JOINTS)
@pytest.mark.parametrize("star", STARS)
def test_rods_that_meet_give_way_as_beams_with_springs_between_them(star, joint):
    """Bending in and out of the grid's plane, torsion of one rod by the bending of the other, and every joint."""
    problem = Star(STARS[star], JOINTS[joint])
    errors = [problem.error(edge) for edge in MESHES]
    assert order(MESHES, errors) == SECOND
    assert abs(errors[-1]) < 5e-3  # 3.8e-3 measured; clamps and rods themselves make most of it


def test_joints_carry_torsion_where_they_are_said_to():
    """The stars tell joints apart by more than their meshes are off."""
    exact = {name: Star(STARS["T"], joint).exact() for name, joint in JOINTS.items()}
    assert exact["rigid"] < 0.98 * exact["pin"]
    assert exact["pin"] < 0.98 * exact["ball"]


@pytest.mark.parametrize("turned", [radians(50), radians(-35)])
@pytest.mark.parametrize(("star", "joint"), [("two crossing rods", "pin"), ("T", "pin"), ("L", "pin")])
def test_a_pin_that_scissored_is_as_stiff_as_one_built_so(star, joint, turned):
    problem = Star(STARS[star], JOINTS[joint])
    # what is left: 1e8 for rigid, and differences of the node's place by the solver's round-off
    assert problem.compliance(0.1, turned=turned) == pytest.approx(problem.compliance(0.1), rel=1e-6)


@pytest.mark.parametrize("star", ["two crossing rods", "T", "L"])
@pytest.mark.parametrize("kind", [rs.Rigid, lambda rest_angle: rs.Spring(3.0, 4.0, 0.5, rest_angle)])
def test_a_joint_with_a_rest_angle_is_as_stiff_there_as_one_built_so(star, kind):
    (first, *_), (second, *_) = STARS[star]
    problem = Star(STARS[star], kind(rest_angle=second - first))
    assert problem.compliance(0.1, turned=radians(50)) == pytest.approx(problem.compliance(0.1), rel=1e-6)


def test_the_order_of_the_rods_does_not_matter():
    """Rod 2 of a joint is not rod 1's servant: exchange them under a mirrored force."""
    rods, force = ((0.0, 0.8, 1.2), (pi / 2, 0.8, 1.2)), np.array([0.3, 0.8, 1.0])
    for joint in JOINTS.values():
        one = Star(rods, joint, tuple(force)).compliance(0.1)
        other = Star(((pi / 2, 0.8, 1.2), (0.0, 0.8, 1.2)), joint, tuple(force[[1, 0, 2]])).compliance(0.1)
        assert one == pytest.approx(other, rel=1e-9)


def test_equilibrium_under_a_small_load_is_the_small_response():
    """Newton's method with large rotations finds the same as the tangent stiffness of the flat state."""
    grid = rs.straight_rods([[[0, 0], [1, 0]], [[0.5, -0.4], [0.5, 0.6]]])
    shell = rs.Shell.of(rs.mesh_grid(grid, 0.1), STRIP, joint=rs.Spring(2.0, 1.0, 1.0))
    free = shell.freedom().with_directions(shell.ends[:3]).with_directions(shell.ends[3:], X, Z)
    load = np.zeros((len(shell.like), 3))
    load[shell.ends[3]] = 1e-5 * (X + 2 * Z)
    start = flat_state(shell)
    problem = Problem(shell.elements, shell.stretch, Supports(free), 1.0, load=load)
    found = find_equilibrium(problem, start, np.zeros(len(shell.stretch.blocks)))
    assert found.report.converged
    moved, small = (found.state - start)[: shell.node_count], response(shell, free, load)[: shell.node_count]
    assert np.abs(moved - small).max() < 1e-4 * np.abs(small).max()  # of the order of the rotations, 1e-5


# A ring of several rods


@pytest.mark.slow
@pytest.mark.parametrize("rods", [3, 4, 8])
def test_ring_of_several_rods_leaves_its_plane_at_michells_twist(rods):
    errors = [michell_twist(edges, rods) - 1 for edges in (96, 192)]
    assert abs(errors[-1]) < 2e-3  # 1.1e-3 measured
    assert abs(errors[-1]) < 0.4 * abs(errors[0])  # second order: a quarter


def test_ring_with_ball_joints_needs_no_twist_to_leave_its_plane():
    """The ring's check has teeth: without the joints' moments the polygon is a mechanism."""
    with pytest.raises(AssertionError):
        michell_twist(96, 4, rs.Spring(0.1, 0.1, 0.1, rest_angle=0.0))


# Lattices


@pytest.mark.parametrize("angle", [-60, -25, 60])
def test_lattice_with_pins_folds_freely(angle):
    energy, force = folding_energy(rs.Pin(), radians(angle))
    stiff, _ = folding_energy(rs.Rigid(), radians(angle))
    assert energy < 1e-6 * stiff
    assert force < 1e-6  # it is an equilibrium all the way


def test_springs_alone_resist_the_folding_of_a_lattice():
    """By their energy: nine joints, each k s^2 / 2 in series with the half edges at it."""
    k, angle = 1e-3, radians(40)
    energy, _ = folding_energy(rs.Spring(k), angle)
    assert energy == pytest.approx(9 * 0.5 * k * angle**2, rel=1e-4)  # half edges: k l / 2 EI = 2e-5


def test_bending_a_lattice_along_its_rods_takes_no_part_of_its_joints():
    stiffness = {joint: bending_stiffness(joint) for joint in (rs.Pin(), rs.Rigid(), rs.Spring(1.0, 2.0, 0.3))}
    # three rods of the length 1.2 between the middles of their end edges of 0.1
    assert list(stiffness.values()) == pytest.approx([3 * EI / 1.1] * 3, rel=1e-8)


# Symmetry


@pytest.mark.parametrize(
    "joint",
    [rs.Ball(), rs.Pin(), rs.Rigid(), rs.Spring(0.002, 0.01, 0.01), rs.Linker(corners=4)],
    ids=["ball", "pin", "rigid", "spring", "four linkers"],
)
def test_a_symmetric_shell_stays_symmetric(joint):
    assert max(asymmetry(joint)) < 1e-9


def test_the_papers_two_linkers_are_chiral():
    """ERRATA to HQK 2.2: one pair of opposite corners resists opening and closing differently."""
    assert asymmetry(rs.Linker())[0] > 1e-3
    closing, opening = (linker_energy(radians(angle), 2) for angle in (37.6, 142.4))
    assert (closing, opening) == pytest.approx((2.7e-4, 2.4e-3), rel=0.02)
    four = [linker_energy(radians(angle), 4) for angle in (37.6, 142.4)]
    assert four[0] == pytest.approx(four[1], rel=1e-12)
    assert four[0] == pytest.approx(closing + opening, rel=1e-12)


def test_linkers_stiffen_the_rods_along_themselves():
    """ERRATA to HQK 2.2: they bend where a rod bends through its joint, the more the coarser the mesh."""
    added = [bending_stiffness(rs.Linker()) / bending_stiffness(rs.Pin()) - 1]
    assert added[0] == pytest.approx(0.081, abs=0.001)


def test_stiffness_of_linkers_about_the_normal_depends_on_the_mesh():
    """8 EI over the edge, of two linkers, near a right angle (docs/equations.md, E10); a `Spring` does not change."""
    rod, turn = rs.Rod(rs.Circle(1e-3), rs.Material(1e6, 1e3)), 1e-3
    for edge in (2.5e-3, 5e-3):
        shear = 2 * linker_energy(pi / 2 + turn, 2, edge=edge) / turn**2
        assert shear == pytest.approx(8 * rod.bend_stiffness / edge, rel=1e-2)


def test_three_rods_at_one_joint_are_tied_by_one_kind():
    grid = rs.straight_rods([[[-cos(a), -sin(a)], [cos(a), sin(a)]] for a in (0.0, 1.0, 2.0)])
    with pytest.raises(rs.InputError, match="some tied by ball and some by rigid joints"):
        rs.Shell.of(rs.mesh_grid(grid, 0.5), STRIP, joint=[rs.Ball(), rs.Rigid(), rs.Rigid()])


@pytest.mark.parametrize("joint", [rs.Spring(1e-2), rs.Spring(1e-2, 1.0, 1.0), rs.Pin()])
def test_no_rod_spins_about_itself_for_nothing(joint):
    """A spring in shear alone holds no normal: one angle of each rod is held, as with ball joints."""
    rod = rs.Rod(rs.GivenSection(EA=1e3, EI1=1, EI2=1, GJ=0.7))
    shell = lattice(joint, rod=rod)
    free = shell.freedom().with_directions(shell.ends)
    for angle in (0.0, 0.5):
        stiffness = tangent_stiffness(shell, sheared(shell, angle), free).toarray()
        assert np.linalg.eigvalsh(stiffness)[0] > 1e-3
