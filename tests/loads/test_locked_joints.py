"""Pins that are tightened after erection: against closed forms of frames, and shells built with springs."""

from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.loads.check import mechanism
from rodshell.loads.locked_joints import locked as lock
from rodshell.loads.strength import Limits, utilisation
from rodshell.loads.structure import Structure
from rodshell.model import Shell
from rodshell.solve.equilibrium import Equilibrium, SolveReport, Status, find_equilibrium
from rodshell.solve.load_path import load_path
from rodshell.solve.modes import linear_buckling
from rodshell.solve.problem import Problem, Supports
from tests.loads.shells import TUBE, one, shell

SIDE, STUB = 1.0, 0.25
LAID = Status.CONVERGED


def frame(rod: rs.Rod, turned: float, edge: float = SIDE / 8) -> tuple[Structure, np.ndarray]:
    """A square of four rods with pins where they cross, the lower two held, the upright rods turned by an angle; and
    a unit load along the upper rod, half of it at each of its joints."""
    a, b = -STUB, SIDE + STUB
    grid = rs.straight_rods([[[a, 0], [b, 0]], [[a, SIDE], [b, SIDE]], [[0, a], [0, b]], [[SIDE, a], [SIDE, b]]])
    mesh = rs.mesh_grid(grid, edge)
    model = Shell.of(mesh, rod, joint=rs.Pin())
    flat = mesh.flat.copy()
    height = flat[:, 1].copy()  # rods parallel to the lower one shift, upright ones turn about it
    flat[:, 0] += np.sin(turned) * height
    flat[:, 1] = np.cos(turned) * height
    state = model.state(flat, normals=np.broadcast_to([0.0, 0.0, 1.0], flat.shape))
    free = model.freedom().with_directions(np.arange(model.node_count), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
    joints = np.unique(mesh.joint_nodes)
    lower, upper = joints[height[joints] < 0.5 * SIDE], joints[height[joints] > 0.5 * SIDE]
    free = free.with_directions(lower)
    problem = replace(Problem.of_shell(model, flat), constraint=Supports(free)).refreshed(state)
    report = SolveReport(LAID, free.size, 0, 0, 0.0, 0.0, 0.0, 0)
    found = Equilibrium(problem, state, np.zeros(len(mesh.edges)), np.zeros_like(state), report)
    load = np.zeros_like(state)
    load[upper, 0] = 0.5
    return Structure(model.with_elements(problem.elements), found, rod), load


def given(stiffness: float, axial: float) -> rs.Rod:
    return rs.Rod(rs.GivenSection(EA=axial * stiffness, EI1=stiffness, EI2=stiffness, GJ=stiffness))


@pytest.mark.parametrize("turned", [0.0, 0.4])
def test_a_square_of_rods_with_locked_corners_resists_shear_by_four_times_k_theta(turned: float) -> None:
    """Rods 1e5 times as stiff as the joints: F L cos(a) = 4 k theta, at any angle a at which they were locked."""
    k, force = 30.0, 0.02
    bare, load = frame(given(1e5 * k, 1e4), turned)
    locked = lock(rs.LockedJoints(shear=k), bare)
    assert np.abs(locked.locked_moments(locked.equilibrium)).max() < 1e-9 * k
    moved = locked.equilibrium.tangent.solve(force * load)
    theta = np.linalg.norm(moved[:, :2], axis=1).max() / (SIDE + STUB)  # of the upright rods' free ends
    assert theta == pytest.approx(force * SIDE * np.cos(turned) / (4 * k), rel=2e-5)  # rods that bend: 1e-5 / 3
    end = load_path(locked.equilibrium, force * load, most=1.0).at(1.0)
    assert end is not None
    np.testing.assert_allclose(np.abs(locked.locked_moments(end)), k * theta, rtol=1e-3)  # of first order in theta


def column_end(b: float, k: float) -> float:
    """Rotation of a column's ends for a chord that turns by 1, with b = EI / L [N m].

    The moments of a column's ends are 6 b (1 - column), those of a beam's 6 b beam, both k (column - beam).
    """
    return float(np.linalg.solve([[6 * b + k, -k], [-k, 6 * b + k]], [6 * b, 0])[0])


def test_locked_corners_of_rods_that_bend_follow_slope_deflection_to_second_order() -> None:
    """A square frame on two hinges with springs k in all corners: rotations of columns and beams, antisymmetric."""
    stiffness, k = 40.0, 60.0
    b = stiffness / SIDE
    exact = 2 * 2 * 6 * b * (1 - column_end(b, k)) / SIDE**2  # force for a sway of 1, of two columns
    off = []
    for edges in (4, 8, 16):
        bare, load = frame(given(stiffness, 1e7), 0.0, SIDE / edges)
        locked = lock(rs.LockedJoints(shear=k), bare)
        moved = locked.equilibrium.tangent.solve(load)
        off.append(float(np.sum(load * moved)) * exact - 1)
    assert off[-1] < 3e-3
    for coarse, fine in pairwise(off):
        assert coarse / fine == pytest.approx(4.0, rel=1e-3)


def test_a_square_of_rods_on_pins_is_a_mechanism_until_they_are_locked() -> None:
    bare, _ = frame(given(10.0, 1e4), 0.2)
    said = mechanism(bare)
    assert said is not None
    assert "largest near" in said
    assert mechanism(lock(rs.LockedJoints(shear=1.0), bare)) is None


def test_locking_changes_no_force_of_the_erected_shell() -> None:
    form = shell("laths")
    bare = Structure.erected(form.popped["pinned"], form.rod)
    locked = lock(rs.LockedJoints(shear=1e4), bare)
    again = find_equilibrium(locked.equilibrium.problem, locked.equilibrium.state, locked.equilibrium.forces)
    assert np.abs(again.state - bare.equilibrium.state).max() < 1e-9
    assert np.abs(locked.locked_moments(again)).max() < 1e-6
    forces = locked.support_forces(again).forces - bare.support_forces(bare.equilibrium).forces
    assert np.abs(forces).max() < 1e-6


def test_a_locked_shell_is_one_built_with_springs_at_the_angles_at_which_it_was_locked() -> None:
    """A second way: the model assembled again with a spring at each crossing, its rest angle the present one."""
    form, k = shell("laths"), 5e3
    bare = Structure.erected(form.popped["pinned"], form.rod)
    locked = lock(rs.LockedJoints(shear=k), bare)
    pins, state = bare.shell, bare.equilibrium.state
    angle = np.zeros(len(pins.mesh.grid.crossings))
    for crossings, element in zip(locked.locked, pins.elements[-len(locked.locked) :], strict=True):
        angle[crossings] = element.rest_angle + element.strains(state)[:, 0]
    angle = (angle + np.pi) % (2 * np.pi) - np.pi
    springs = [rs.Spring(shear=k, out_of_plane=np.inf, twist=np.inf, rest_angle=value) for value in angle.tolist()]
    model = Shell.of(pins.mesh, form.rod, joint=springs)
    frames = [
        replace(new, source_tangents=old.source_tangents, source_directors=old.source_directors)
        for new, old in zip(model.between, pins.between, strict=True)
    ]
    built = model.with_elements((*pins.within, *frames))
    found = find_equilibrium(replace(bare.equilibrium.problem, elements=built.elements), state, bare.equilibrium.forces)
    assert found.report.stable
    assert np.abs(found.state - state).max() < 1e-3  # it stands where it was locked, but for the stiffness across
    load = np.zeros_like(state)
    load[: pins.node_count, 2] = -1000.0 / pins.node_count
    ours, theirs = (linear_buckling(each, load).factors[0] for each in (locked.equilibrium, found))
    free = linear_buckling(bare.equilibrium, load).factors[0]
    assert ours == pytest.approx(theirs, rel=5e-3)
    assert ours > 1.15 * free
    ours, theirs = (load_path(each, load).factor for each in (locked.equilibrium, found))
    assert ours == pytest.approx(theirs, rel=5e-3)


def test_the_stress_at_a_locked_joint_is_that_of_the_whole_moment_of_the_corner() -> None:
    """The node at a joint has the mean of both sides, of a corner half the moment; the joint's moment has the rest."""
    section, k, strength = TUBE.section, 5e3, 1e8
    assert isinstance(section, rs.Tube)
    bare, load = frame(TUBE, 0.0, SIDE / 16)
    locked = lock(rs.LockedJoints(shear=k), bare)
    end = load_path(locked.equilibrium, load, most=1.0).at(1.0)
    assert end is not None
    found = utilisation(
        locked.shell_at(end), end.state, TUBE, forces=end.forces, limits=Limits(short=strength),
        asked=rs.Strength(), duration="short", moments=locked.locked_moments(end), slip_moment=0.2,
    )  # fmt: skip
    moment = SIDE / 4  # of the unit force, at each of four corners
    axial = 0.5 / (np.pi * (section.outer_radius**2 - section.inner_radius**2))
    exact = moment * section.outer_radius / section.second_moments[0]
    assert strength * found.uses["bending"].max() == pytest.approx(exact, abs=1.5 * axial)
    assert found.largest["slip"] == pytest.approx(moment / 0.2, rel=1e-3)
    slipping = np.flatnonzero(found.uses["slip"] > 1)
    assert np.isin(locked.mesh.rod_nodes[slipping], locked.mesh.joint_nodes).all()
    assert len(slipping) == 8  # both rods of four joints


def test_force_and_moment_make_a_joint_slip_together() -> None:
    form = shell("laths")
    asked = one(rs.Snow(20.0), locked_joints=rs.LockedJoints(shear=5e3, slip=40.0), strength=rs.Strength(slip=300.0))
    both = rs.check_loads(form, asked).shells["all"]["pinned"]
    force = rs.check_loads(form, replace(asked, locked_joints=rs.LockedJoints(shear=5e3))).shells["all"]["pinned"]
    moment = rs.check_loads(form, replace(asked, strength=rs.Strength())).shells["all"]["pinned"]
    squares = [each.used.uses["slip"] ** 2 for each in (both, force, moment)]
    np.testing.assert_allclose(squares[0], squares[1] + squares[2], atol=1e-12)
    assert squares[1].max() > 0.01 * squares[0].max()
    assert squares[2].max() == pytest.approx((np.abs(moment.joint_moments).max() / 40.0) ** 2)
    assert np.abs(both.reaction_sum + both.load_sum).max() < 1e-9 * np.linalg.norm(both.load_sum)


def test_joints_of_other_kinds_cannot_be_locked() -> None:
    with pytest.raises(InputError, match="ball joints cannot be locked"):
        rs.check_loads(shell("tubes"), one(rs.Snow(1.0), locked_joints=rs.LockedJoints(shear=1e3)))
    case = {
        "joint": {"kind": "rigid"}, "locked_joints": {"shear": "1 kN m/rad"},
        "loads": [{"name": "snow", "kind": "snow", "value": 1.0}],
        "combinations": [{"name": "all", "factors": {"snow": 1}}],
    }  # fmt: skip
    with pytest.raises(InputError, match="rigid joints cannot be locked"):
        rs.Job.load(case).case.build()  # before anything is formed
    with pytest.raises(InputError, match=r"locked_joints\.shear is missing"):
        rs.Job.load(case | {"joint": {"kind": "pin"}, "locked_joints": {"slip": "5 N m"}}).case.build()
    for wrong in ({"shear": 0.0}, {"shear": -1.0}, {"shear": 1.0, "slip": 0.0}):
        with pytest.raises(InputError):
            rs.LockedJoints(**wrong)


def test_a_case_with_locked_joints_says_where_they_slip(tmp_path: Path) -> None:
    case = {
        "target": {"kind": "cap", "radius": 10.0, "base": 4.0}, "layout": {"spacing": 3.0, "edge": 1.5},
        "rod": {"section": {"kind": "tube", "radius": 0.021, "thickness": 0.0035}, "material": {"preset": "gfrp"}},
        "joint": {"kind": "pin"}, "pop_up": {"ends": "pinned"}, "checks": {"stages": 0},
        "locked_joints": {"shear": "5 kN m/rad", "slip": "5 N m"},
        "loads": [{"name": "snow", "kind": "snow", "value": "0.04 kN/m2"}],
        "combinations": [{"name": "winter", "factors": {"snow": 1.0}}],
    }  # fmt: skip
    form = rs.Job.load(case).run()
    found = form.archive().results.loads["winter"]["pinned"]
    assert form.loaded is not None
    moments = np.abs(form.loaded.shells["winter"]["pinned"].joint_moments)
    assert len(found.joint_moments) == len(moments) == len(form.footprint.mesh.grid.crossings)
    assert 0 < len(found.slipping) == (moments > 5.0).sum()
    assert found.joint_moment_at in found.slipping
    report = form.save(tmp_path / "out", kinds="report") / "report.html"
    assert "<h3>Locked joints</h3>" in report.read_text(encoding="utf-8")
    again = rs.Job.load(str(tmp_path / "out" / "case.toml"))
    loads = again.case.built_loads()
    assert loads is not None
    assert loads.locked_joints == rs.LockedJoints(shear=5000.0, slip=5.0)
