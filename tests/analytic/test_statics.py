"""One rod, or a small grid, against closed forms: elastica, catenary, Hooke, Euler; and how solves end.

A single rod of length 1 lies along x and is kept in the plane y = 0 (in space it could spin about its chord).
"""

from dataclasses import replace
from math import cosh, pi, sinh, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import gridshell as gs
from gridshell.layout import FlatGrid, FlatRod
from gridshell.model import Shell
from gridshell.solve.constraint import Supports
from gridshell.solve.mixed_newton import Problem, find_equilibrium, find_stable
from gridshell.solve.path import follow
from gridshell.solve.report import Status

ROD = gs.Rod(section=gs.Circle(radius=1e-3), material=gs.Material(youngs_modulus=1e9, density=1e3))
EI, EA = ROD.bend_stiffness, ROD.stretch_stiffness
EULER = pi**2 * EI  # buckling load of a pinned rod of length 1 [N]
OUTWARD = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def straight_rod(edges, **options):
    mesh = gs.mesh_grid(FlatGrid.of([FlatRod.u("U01", 0.0, -0.5, 0.5)]), 1.0 / edges)
    return Shell.of(mesh, ROD, **options)


def in_plane(shell, *directions):
    """Nodes free along x and z or along `directions`; the end's direction held if it is clamped."""
    nodes = np.arange(shell.mesh.node_count)
    return shell.freedom().with_directions(nodes, *(directions or (X, Z))).with_directions(shell.ghosts)


def order(sizes, errors):
    """Order of convergence of `errors` in the size of the edges."""
    return np.polyfit(np.log(sizes), np.log(np.abs(errors)), 1)[0]


# Elastica: theta'' = -(P/EI) sin theta, theta being the angle with the line of thrust


class Elastica:
    """Bent from its line of thrust to its crest and back; k = sin(theta_max / 2) fixes all [Love 1927, section 262].

    A pinned rod is half a wave of length 2 K / sqrt(P/EI); a clamped one is a whole wave. Both have the end
    shortening 2 - 2 E(k) / K(k) and the rise k / K(k).
    """

    def __init__(self, modulus, halves):
        whole = ellipk(modulus)
        self.shortening = 2 - 2 * ellipe(modulus) / whole
        self.rise = sqrt(modulus) / whole
        self.thrust = EI * (2 * halves * whole) ** 2
        self.end_moment = 0.0 if halves == 1 else self.thrust * self.rise / 2  # the inflection is at half the rise

    @classmethod
    def shortened(cls, shortening, halves):
        return cls(brentq(lambda m: 2 - 2 * ellipe(m) / ellipk(m) - shortening, 1e-9, 0.99), halves)

    @classmethod
    def loaded(cls, share):
        """A pinned rod under `share` of Euler's load."""
        return cls(brentq(lambda m: 2 * ellipk(m) / pi - sqrt(share), 1e-9, 0.99), 1)


def brought_together(edges, shortening, *, clamped=False, twist=False, inextensible=True):
    """A rod whose ends are moved towards each other from t = 0 on; it starts as a low arch."""
    shell = straight_rod(edges, clamped=clamped, twist=twist)
    first = 0.05
    height, share = 2 / pi * sqrt(first * shortening), shell.mesh.flat[:, 0] + 0.5
    arch = shell.mesh.flat * [1 - first * shortening, 1, 1]
    arch[:, 2] = height * (np.sin(pi * share) ** 2 if clamped else np.sin(pi * share))

    def problem(t):
        ends = (0.5 - 0.5 * t * shortening) * OUTWARD
        goals = np.vstack([ends, ends + OUTWARD / edges]) if clamped else ends
        moved = np.append(shell.ends, shell.ghosts)
        supports = Supports(in_plane(shell).with_directions(shell.ends), moved, goals)
        return Problem(shell.elements, shell.stretch, supports, 1.0, inextensible=inextensible)

    start = shell.state(arch, OUTWARD if clamped else None)
    found = follow(problem, start, np.zeros(edges), first_step=first)
    return shell, found


def rise(shell, found):
    return found.state[shell.mesh.nodes_of(0)[len(shell.mesh.edges) // 2], 2]


@pytest.mark.parametrize(("clamped", "shortening"), [(False, 0.3), (False, 0.8), (True, 0.3)])
def test_rod_with_ends_brought_together_is_eulers_elastica(clamped, shortening):
    """Second order also where clamped: the clamp acts exactly at the end."""
    exact = Elastica.shortened(shortening, 2 if clamped else 1)
    sizes, rises, thrusts, moments = [], [], [], []
    for edges in (20, 40, 80):
        shell, found = brought_together(edges, shortening, clamped=clamped)
        assert found.report.stable
        sizes.append(1 / edges)
        rises.append(rise(shell, found) / exact.rise - 1)
        support = found.gradient[shell.ends] + (found.gradient[shell.ghosts] if clamped else 0)
        thrusts.append(support[0, 0] / exact.thrust - 1)  # the rod pushes its start to -x
        if clamped:
            moments.append(found.gradient[shell.ghosts[0], 2] / edges / exact.end_moment - 1)
    # at 80 edges rise 4e-5 (clamped 2.2e-4), thrust 1.8e-3, moment 1.0e-3; margin 2
    assert abs(rises[-1]) < 5e-4
    assert abs(thrusts[-1]) < 4e-3
    for errors in filter(None, (rises, thrusts, moments)):
        assert order(sizes, errors) == pytest.approx(2.0, abs=0.2)
    assert not moments or abs(moments[-1]) < 3e-3


@pytest.mark.parametrize("clamped", [False, True])
def test_twist_angles_leave_a_plane_elastica_as_it_is(clamped):
    without, with_twist = (brought_together(20, 0.3, clamped=clamped, twist=twist) for twist in (False, True))
    count = without[0].mesh.node_count
    # both end on the same equilibrium; Newton's last step is below 1e-6, its error the square of that
    np.testing.assert_allclose(with_twist[1].state[:count], without[1].state[:count], rtol=0, atol=1e-10)
    np.testing.assert_allclose(with_twist[1].state[count + len(with_twist[0].ghosts) :], 0.0, rtol=0, atol=1e-10)


def test_an_elastic_rod_differs_from_an_inextensible_one_by_its_strain():
    _, stiff = brought_together(40, 0.3)
    shell, soft = brought_together(40, 0.3, inextensible=False)
    strain = Elastica.shortened(0.3, 1).thrust / EA  # 3.4e-6
    assert stiff.report.max_strain < 1e-9
    assert soft.report.max_strain == pytest.approx(strain, rel=0.05)  # least at the crest, most where it is level
    assert 0 < np.abs(soft.state - stiff.state).max() < 2 * strain
    np.testing.assert_allclose(soft.forces, EA * shell.stretch.strains(soft.state), rtol=1e-6)


# Hooke and the catenary


@pytest.mark.parametrize("force", [10.0, -1e-3, 1e-6])
def test_a_pulled_straight_rod_stretches_by_its_force_over_its_stiffness(force):
    shell = straight_rod(7)
    start, end = shell.ends
    load = np.zeros_like(shell.mesh.flat)
    load[end] = force, 0.0, 0.0
    free = in_plane(shell, X).with_directions(np.array([start]))
    problem = Problem(shell.elements, shell.stretch, Supports(free), 1.0, load=load)
    found = find_equilibrium(problem, shell.mesh.flat, np.zeros(7))
    assert found.report.stable
    # exact: the strain is linear in the length; round-off of coordinates of 0.5 against the elongation
    assert found.state[end, 0] - 0.5 == pytest.approx(force / EA, rel=1e-12, abs=1e-15)
    np.testing.assert_allclose(found.forces, force, rtol=1e-12)
    np.testing.assert_allclose(found.gradient[start], [-force, 0, 0], rtol=1e-12)


def test_a_rod_that_hangs_straight_down_stretches_by_half_its_weight():
    """Exact on any mesh: each edge carries what hangs below its middle."""
    shell, weight = straight_rod(9), 5.0
    load = np.zeros_like(shell.mesh.flat)
    load[:, 0] = weight * shell.mesh.tributary_lengths()
    free = in_plane(shell, X).with_directions(shell.ends[:1])
    problem = Problem(shell.elements, shell.stretch, Supports(free), 1.0, load=load)
    found = find_equilibrium(problem, shell.mesh.flat, np.zeros(9))
    assert found.state[shell.ends[1], 0] - 0.5 == pytest.approx(weight / (2 * EA), rel=1e-12, abs=1e-15)
    middles = (np.arange(9) + 0.5) / 9
    np.testing.assert_allclose(found.forces, weight * (1 - middles), rtol=1e-12)


SPAN = 0.7
CATENARY = brentq(lambda a: 2 * a * sinh(SPAN / (2 * a)) - 1.0, 0.05, 10.0)  # horizontal tension over weight


def hanging_chain(edges, bending):
    """Inextensible, pinned at both ends, of unit weight, with EI = `bending`; and its distance to the catenary."""
    shell = straight_rod(edges)
    bend = shell.elements[0]
    soft = replace(bend, stiffness=np.full(len(bend.stiffness), bending * edges))
    s = shell.mesh.flat[:, 0]
    x = CATENARY * np.arcsinh(s / CATENARY)
    exact = np.column_stack([x, 0 * x, CATENARY * (np.cosh(x / CATENARY) - cosh(SPAN / (2 * CATENARY)))])
    sagging = np.column_stack([SPAN * s, 0 * s, s**2 - 0.25])
    load = np.zeros_like(sagging)
    load[:, 2] = -shell.mesh.tributary_lengths()
    supports = Supports(in_plane(shell).with_directions(shell.ends))
    penalty = replace(shell.stretch, stiffness=np.full(edges, 100.0))
    problem = Problem((soft,), penalty, supports, 1.0, inextensible=True, load=load)
    found = find_equilibrium(problem, sagging, np.full(edges, CATENARY))
    assert found.report.stable
    return shell, found, np.abs(found.state - exact).max()


def test_a_chain_of_vanishing_bending_stiffness_hangs_as_a_catenary():
    sizes = np.array([20, 40, 80])
    errors = [hanging_chain(edges, 1e-9)[2] for edges in sizes]
    assert errors[-1] < 5e-5  # of the length; 3.0e-5 measured
    assert order(1 / sizes, errors) == pytest.approx(2.0, abs=0.1)


def test_bending_takes_a_hanging_rod_off_the_catenary_in_proportion():
    """On a mesh so fine that its own error, 1e-6, is seen in the last digit only."""
    stiffness = np.array([1e-3, 1e-4, 1e-5])
    errors = [hanging_chain(400, bending)[2] for bending in stiffness]
    assert order(stiffness, errors) == pytest.approx(1.0, abs=0.15)
    assert errors[-1] < 3e-5


def test_supports_of_a_chain_carry_its_weight_and_its_thrust():
    shell, found, _ = hanging_chain(80, 1e-9)
    reactions = found.gradient[shell.ends]
    np.testing.assert_allclose(reactions[:, 2], 0.5, rtol=1e-9)  # half the weight each, the end nodes' own included
    np.testing.assert_allclose(reactions[:, 0], [-CATENARY, CATENARY], rtol=2e-4)  # second order: 9e-5
    edges = np.diff(found.state[shell.mesh.nodes_of(0)], axis=0)
    level = found.forces * edges[:, 0] / np.linalg.norm(edges, axis=1)
    np.testing.assert_allclose(level, level.mean(), rtol=1e-5)  # bending takes the rest: EI = 1e-9


# Euler's buckling


def column(edges, load_share, solve=find_equilibrium, *, clamped=False, penalty=None):
    """A straight rod under `load_share` of the pinned rod's buckling load, one end free to slide along x."""
    shell = straight_rod(edges, clamped=clamped)
    start, end = shell.ends
    free = in_plane(shell).with_directions(np.array([start])).with_directions(np.array([end]), X)
    if clamped:
        free = free.with_directions(shell.ghosts[1:], X)  # slides with the end: a dead load on it does no harm
    load = np.zeros((len(free.count), 3))
    load[end, 0] = -load_share * EULER
    problem = Problem(shell.elements, shell.stretch, Supports(free), 1.0, load=load)
    found = solve(problem, shell.state(shell.mesh.flat, OUTWARD if clamped else None), np.zeros(edges))
    return shell, found


def first_buckling(edges, low, high, **options):
    """Share of Euler's load at which a straight rod gets its first negative mode."""
    for _ in range(20):
        middle = 0.5 * (low + high)
        _, found = column(edges, middle, **options)
        assert found.report.converged
        low, high = (low, middle) if found.report.negative_modes else (middle, high)
    return high


def test_a_pinned_rod_buckles_at_eulers_load():
    sizes = np.array([20, 40, 80])
    loads = np.array([first_buckling(edges, 0.9, 1.1) for edges in sizes])
    assert loads[-1] == pytest.approx(1.0, abs=2.5e-4)  # 1.3e-4 measured, pi^2/12 h^2 plus the strain 2.5e-6
    assert order(1 / sizes, loads - 1) == pytest.approx(2.0, abs=0.1)


def test_modes_are_counted_one_by_one():
    for share, modes in ((0.99, 0), (1.01, 1), (3.9, 1), (4.1, 2), (8.9, 2), (9.1, 3)):
        assert column(80, share)[1].report.negative_modes == modes


def test_mode_of_a_buckling_rod_is_half_a_sine():
    shell, found = column(80, 1.5)
    assert found.report.negative_modes == 1
    share = shell.mesh.flat[:, 0] + 0.5
    shape = found.mode[:, 2] * np.sign(found.mode[:, 2].sum())
    np.testing.assert_allclose(shape, np.sin(pi * share), rtol=0, atol=1e-3)
    np.testing.assert_allclose(found.mode[:, :2], 0.0, rtol=0, atol=1e-6)
    assert found.mode is None or column(80, 0.9)[1].mode is None
