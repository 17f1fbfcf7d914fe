"""Couplings: penalties tend to shared DOFs, explicit ties to implicit ones; masses; the limit of explicit steps.

What is measured stands in `coupling_problems.py`.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

import rodshell as rs
from rodshell.solve.linear_stability import step_limit
from tests.joints.coupling_problems import (
    DECADES,
    KINDS,
    bent,
    closed_form_limits,
    element,
    explicit_errors,
    growth,
    masses,
    static_errors,
    step_errors,
    systems,
)
from tests.joints.joint_problems import STRIP, flat_state, tangent_stiffness
from tests.solve.rod_problems import order

STEPS = np.array([400, 800])
every_kind = pytest.mark.parametrize("kind", KINDS)


@pytest.mark.slow
@every_kind
@pytest.mark.parametrize("errors", [static_errors, step_errors], ids=["at rest", "in one step"])
def test_implicit_ties_tend_to_shared_dofs_as_one_over_their_stiffness(kind, errors):
    found = errors(KINDS[kind])
    assert order(DECADES, found) == pytest.approx(-1, abs=0.05)
    # no stiffness is counted twice or left out: what is left over vanishes with 1/C. 1.2e-6 measured
    assert found[-1] < 2e-6


@pytest.mark.slow
@every_kind
def test_explicit_ties_tend_to_implicit_ones_as_the_step(kind):
    assert order(1 / STEPS, explicit_errors(KINDS[kind], STEPS)) == pytest.approx(1, abs=0.1)


@every_kind
@pytest.mark.parametrize("coupling", [rs.SharedDofs(), rs.ImplicitPenalty(), rs.ExplicitPenalty()])
def test_no_mass_is_counted_twice(kind, coupling):
    """Four rods of 0.9 m."""
    mass, inertia = masses(bent(KINDS[kind], coupling))
    assert mass == pytest.approx(4 * 0.9 * 1.0, rel=1e-14)
    assert inertia == pytest.approx(4 * 0.9 * 0.02, rel=1e-14)


def test_each_copy_has_its_share_of_the_mass():
    """A quarter each at a joint with two linkers, as the paper says, and half each at the four neighbours and edges."""
    shell = element(rs.Linker())
    shared = element(rs.Linker(), rs.SharedDofs())
    shares = shell.mass[:, 0] / shared.mass[shell.like, 0]
    joint = shell.mesh.joint_nodes[0]
    assert np.allclose(shares[shell.like == joint], 1 / 4)
    assert np.allclose(shares[shell.like != joint], 1 / 2)


@pytest.mark.slow
@every_kind
def test_steps_below_the_limit_are_stable_and_above_it_are_not(kind):
    assert growth(KINDS[kind], 0.95, 10_000) < 3  # 1.7 measured
    assert growth(KINDS[kind], 1.05, 10_000) == np.inf


@every_kind
def test_limit_is_where_the_matrix_of_the_step_has_an_eigenvalue_on_the_unit_circle(kind):
    """A second method: all eigenvalues z of M (z - 2 + 1/z) + h2 Ki z + h2 Ke = 0, by its companion matrix."""
    shell = element(KINDS[kind])
    state = flat_state(shell)
    motion = rs.Motion.of(shell)
    free = motion.constraint_at(0.0).freedom(state)
    ties = replace(shell, within=(), stretch=replace(shell.stretch, stiffness=0 * shell.stretch.stiffness))
    explicit = tangent_stiffness(ties, state, free).toarray()
    implicit = tangent_stiffness(shell, state, free).toarray() - explicit
    mass = np.diag(free.reduce_diagonal(motion.mass))

    def radius(h):
        inverse = np.linalg.inv(mass + h**2 * implicit)
        top = np.hstack([inverse @ (2 * mass - h**2 * explicit), -inverse @ mass])
        return np.abs(np.linalg.eigvals(np.vstack([top, np.eye(*top.shape)]))).max()

    limit = step_limit(motion, state)
    assert radius(0.999 * limit) < 1 + 1e-6  # rigid motions stay on the circle: a double root, round-off's root
    assert radius(1.001 * limit) > 1 + 1e-3
    bare = 2 / np.sqrt(eigh(explicit, mass, eigvals_only=True)[-1])
    assert limit > (1 - 1e-9) * bare  # the rods' own stiffness, being implicit, never hurts


def test_limits_of_ties_alone_have_closed_forms():
    """sqrt(2m/C1) for the ball joint, sqrt(m/2C1) with two linkers, sqrt(I/C2) for twist; m and I of one rod's own."""
    for name, ratio in closed_form_limits().items():
        assert ratio == pytest.approx(1, rel=1e-6), name


def test_a_step_beyond_the_limit_is_refused_with_the_limit():
    shell = element(rs.Ball())
    motion, state = rs.Motion.of(shell), flat_state(shell)
    limit = step_limit(motion, state)
    with pytest.raises(rs.StabilityError, match=rf"time step of .* s \(limit {limit:.4g} s\): .*SharedDofs"):
        rs.simulate(motion, state, until=2.1 * limit, step=1.05 * limit)
    series = rs.simulate(motion, state, until=2.0 * limit, step=0.95 * limit)
    assert series.report.refused_steps == 0


def clamped_strips(rod):
    grid = rs.straight_rods([[[-0.4, 0], [0.4, 0]], [[0, -0.4], [0, 0.4]]])
    mesh = rs.mesh_grid(grid, 0.1)
    return rs.Shell.of(mesh, rod, clamped=True, joint=rs.Pin(), coupling=rs.ExplicitPenalty())


def test_what_has_no_mass_follows_at_the_limit():
    """Clamps of strips have twist angles without inertia; the limit is that with next to none."""
    shell = clamped_strips(STRIP)
    state, motion = flat_state(shell), rs.Motion.of(shell)
    free = motion.constraint_at(0.0).freedom(state)
    massless = (free.count > 0) & (shell.mass[:, 0] == 0)
    assert np.count_nonzero(massless) == 4
    mass = shell.mass.copy()
    mass[massless, 0] = 1e-9 * shell.mass[shell.first_angle, 0]
    nearly = step_limit(replace(motion, mass=mass), state)
    assert step_limit(motion, state) == pytest.approx(nearly, rel=1e-6)


def test_explicit_ties_on_what_has_no_mass_are_refused():
    shell = clamped_strips(rs.Rod(rs.GivenSection(EA=1e3, EI1=1, EI2=1, GJ=0.7, mass=1.0)))
    with pytest.raises(rs.InputError, match="twist angles without mass: give the rods mass and rotary inertia"):
        rs.simulate(rs.Motion.of(shell), flat_state(shell), until=1e-3, step=1e-4)


def test_shared_and_implicit_ties_have_no_step_limit():
    for coupling in (rs.SharedDofs(), rs.ImplicitPenalty()):
        shell = element(rs.Linker(), coupling)
        assert step_limit(rs.Motion.of(shell), flat_state(shell)) == np.inf


@every_kind
def test_explicit_ties_leave_one_banded_system_for_every_rod_and_linker(kind):
    shell = bent(KINDS[kind], rs.ExplicitPenalty())
    width, count = systems(shell)
    linkers = 2 * len(shell.mesh.grid.crossings) if kind == "two linkers" else 0
    assert width == 10  # x, theta, x, theta, x: a single rod's
    assert count == len(shell.mesh.grid.rods) + linkers
    assert systems(bent(KINDS[kind], rs.SharedDofs()))[1] == 1


def test_defaults_of_penalties_have_the_units_of_their_ties() -> None:
    """C1 [N/m] is of the order EA over an edge, or EI over its cube; C2 [N m/rad] of the order GJ over an edge."""
    rod, edge = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3)), 0.015
    area, inertia = np.pi * 1e-6, np.pi / 4 * 1e-12
    twist = 1e6 / 3 * 2 * inertia  # GJ, incompressible
    implicit, explicit = rs.ImplicitPenalty().with_defaults(rod, edge), rs.ExplicitPenalty().with_defaults(rod, edge)
    assert pytest.approx((1e4 * 1e6 * area / edge, 1e4 * twist / edge)) == (implicit.C1, implicit.C2)
    assert pytest.approx(((1.5 / edge) ** 3 * 1e6 * inertia, twist / edge)) == (explicit.C1, explicit.C2)
    given = rs.ImplicitPenalty(C1=5.0).with_defaults(rod, edge)
    assert (given.C1, given.C2) == (5.0, implicit.C2)
