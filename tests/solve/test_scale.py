"""Sizes that differ by a power of two, which rounds nothing: every number of a solve is the same but for its power."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.model import Shell
from rodshell.rods.elements import twist_angles
from rodshell.solve.load_path import load_path
from rodshell.solve.newton_step import generic_motion
from rodshell.solve.path import relax
from rodshell.solve.problem import mean_radius
from tests.solve.scaled import LATH, TUBE, Placed, boundary_placed, cap, form, others

HERE = Placed()
JOINTS = "pin", "spring", "rigid", "four linkers", "two layers"
SIZES = [2.0**-20, 2.0**-7, 2.0**10]
CASES = [*((TUBE, joint) for joint in JOINTS), (LATH, "pin"), (LATH, "rigid"), (LATH, "two layers")]


@pytest.mark.parametrize("size", SIZES)
@pytest.mark.parametrize(("kind", "joint"), CASES)
def test_a_form_is_the_same_at_every_size(kind, joint, size):
    """A micrometre to a kilometre. Radians added to metres took up to 480 factorisations and did not converge."""
    here, there = form(kind, joint, HERE), form(kind, joint, Placed(size))
    for ends, shell in here.popped.items():
        other = there.popped[ends]
        assert shell.report.stable
        assert other.report.factorizations == shell.report.factorizations
        np.testing.assert_array_equal(other.positions / size, shell.positions)
        np.testing.assert_array_equal(other.forces / size**2, shell.forces)
        assert other.equilibrium.energy / size**3 == shell.equilibrium.energy


@pytest.mark.parametrize("size", SIZES)
def test_other_shapes_are_the_same_at_every_size(size):
    """A flat cap over a plane edge, which pops through."""
    here, there = (others(cap(one), 60) for one in (1.0, size))
    assert here.found
    assert there.factorizations == here.factorizations
    for one, other in zip(here.found, there.found, strict=True):
        np.testing.assert_array_equal(other.positions / size, one.positions)
        assert (other.distance, other.energy, other.mirror) == (one.distance, one.energy, one.mirror)


@pytest.mark.parametrize("size", SIZES)
def test_load_paths_and_descents_are_the_same_at_every_size(size):
    factors, slid = [], []
    for placed in (HERE, Placed(size)):
        found = form(LATH, "pin", placed).popped["pinned"]
        load = np.zeros_like(found.state)
        load[: found.shell.node_count, 2] = -(placed.size**2)
        path = load_path(found.equilibrium, load, most=1e6)
        factors.append((path.factor, path.limit, path.factorizations, path.last_stable.arc / placed.size))
        kicked = found.state.copy()
        kicked[found.shell.node_count :, 0] += 0.3 * np.sin(np.arange(len(kicked) - found.shell.node_count))
        kicked[found.shell.spinning] = found.state[found.shell.spinning]
        slid.append(relax(found.equilibrium.problem, kicked))
    assert factors[1][1:3] == factors[0][1:3]
    assert factors[1][::3] == pytest.approx(factors[0][::3], rel=1e-11)  # modes are measured by roots of odd powers
    assert slid[0].report.stable
    assert slid[1].report.factorizations == slid[0].report.factorizations
    assert slid[1].energy / size**3 == slid[0].energy


@pytest.mark.parametrize("placed", [Placed(mirrored=True), Placed(turned=0.6), Placed(turned=np.pi / 2)])
@pytest.mark.parametrize(("kind", "joint"), [(TUBE, "four linkers"), (LATH, "rigid")])
def test_a_target_mirrored_or_turned_leads_to_the_shell_mirrored_or_turned(kind, joint, placed):
    """Rods of a mirrored target come in another order: each node is next to one of the others. 3e-13 measured."""
    here, there = form(kind, joint, HERE), form(kind, joint, placed)
    for ends, shell in here.popped.items():
        apart = np.linalg.norm(placed(shell.positions)[:, None] - there.popped[ends].positions, axis=2)
        assert apart.min(axis=1).max() < 1e-9
        assert there.popped[ends].equilibrium.energy == pytest.approx(shell.equilibrium.energy, rel=1e-12)


@pytest.mark.parametrize("start", ["draped", "flat"])
@pytest.mark.parametrize("turned", [1.0, np.pi])
def test_a_boundary_may_be_turned_by_any_angle_against_its_footprint(start, turned):
    """Half a turn: an edge that is turned right round has no frame transported from where it was."""
    here = form(TUBE, "pin", HERE)
    shell = here.popped["pinned"]
    there = rs.pop_up(
        shell.footprint, boundary_placed(shell.boundary, turned, 0.0), here.rod,
        ends="pinned", joint=rs.Pin(), start=start,
    )  # fmt: skip
    assert there.report.stable
    if start == "draped":
        assert there.report.factorizations == shell.report.factorizations
    np.testing.assert_allclose(there.positions, Placed(turned=turned)(shell.positions), rtol=0, atol=1e-9)


@pytest.mark.parametrize("turned", [1.0, np.pi / 2, np.pi])
def test_a_generic_motion_turns_with_the_structure(turned):
    """And has a part along each axis, also of a rod that stands upright."""
    state, twists = np.random.default_rng(1).normal(size=(12, 3)), np.arange(12) > 8
    placed = np.where(twists[:, None], state, Placed(turned=turned)(state))
    motion, there = generic_motion(state, twists), generic_motion(placed, twists)
    np.testing.assert_allclose(there[:9], Placed(turned=turned)(motion[:9]), atol=1e-12)
    np.testing.assert_array_equal(there[9:], motion[9:])
    assert (np.abs(generic_motion(np.outer(np.arange(9.0), [0, 0, 1]), twists[:9])).max(axis=0) > 0.1).all()


@pytest.mark.parametrize("joint", ["spring", "two layers"])
def test_the_mode_along_which_a_saddle_is_left_turns_with_the_structure(joint):
    """A draped lath whose ends are released is a saddle with several nearly equal modes."""
    here = form(LATH, joint, HERE)
    shell = here.popped["pinned"]
    assert shell.report.factorizations > 10
    for turned in (np.pi / 2, 2.0, np.pi):
        boundary = boundary_placed(shell.boundary, turned, 0.0)
        there = rs.pop_up(shell.footprint, boundary, here.rod, ends="pinned", joint=HERE.joint(joint))
        assert there.report.factorizations == shell.report.factorizations
        np.testing.assert_allclose(there.positions, Placed(turned=turned)(shell.positions), rtol=0, atol=1e-12)


@pytest.mark.parametrize(("kind", "joint"), CASES)
def test_three_kilometres_away_a_shell_is_the_same(kind, joint):
    """Positions have 4.5e-13 m there; 2e-12 of the energy measured."""
    here = form(kind, joint, HERE)
    for ends, shell in here.popped.items():
        away = boundary_placed(shell.boundary, 0.0, 3000.0)
        there = rs.pop_up(shell.footprint, away, here.rod, ends=ends, joint=HERE.joint(joint))
        assert there.report.factorizations == shell.report.factorizations
        assert there.equilibrium.energy == pytest.approx(shell.equilibrium.energy, rel=1e-8)
        np.testing.assert_allclose(there.positions - (3000.0, 0, 0), shell.positions, rtol=0, atol=1e-8)


def test_twist_angles_are_measured_by_turns_and_all_else_by_the_length():
    """Also where a penalty gives linkers nodes and angles of their own, and clamps have ghosts."""
    mesh = form(LATH, "pin", HERE).footprint.mesh
    for coupling in (rs.SharedDofs(), rs.ImplicitPenalty()):
        shell = Shell.of(mesh, form(LATH, "pin", HERE).rod, clamped=True, joint=rs.Linker(), coupling=coupling)
        angles = shell.like >= mesh.node_count + len(shell.ghosts)
        np.testing.assert_array_equal(twist_angles(shell.elements, len(shell.like)), angles)
    problem = form(LATH, "pin", HERE).popped["pinned"].equilibrium.problem
    unit = problem.unit(len(problem.constraint.free.count))
    assert set(unit.ravel()) == {problem.length, 2 * np.pi}


def test_the_length_is_that_of_a_round_edges_radius_whichever_way_it_lies():
    angle = np.arange(12) * 2 * np.pi / 12
    ring = 3.0 * np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    turn = np.linalg.qr(np.random.default_rng(0).standard_normal((3, 3)))[0]
    for points in (ring, ring @ turn + (5.0, -7.0, 9.0)):
        assert mean_radius(points) == pytest.approx(3.0, rel=1e-14)
