"""One rod, or a small grid, against closed forms: elastica, catenary, Hooke, Euler; and how solves end.

A single rod of length 1 lies along x and is kept in the plane y = 0 (in space it could spin about its chord).
"""

from dataclasses import replace
from functools import partial
from math import cosh, pi, sinh, sqrt

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import rodshell as rs
from rodshell.layout import FlatGrid
from rodshell.layout.gridlayout import lattice_rod
from rodshell.model import Shell
from rodshell.solve import equilibrium
from rodshell.solve.equilibrium import Status, find_equilibrium, find_stable
from rodshell.solve.newton_step import NewtonStep
from rodshell.solve.path import follow
from rodshell.solve.problem import Problem, Supports

ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e9, density=1e3))
EI, EA = ROD.bend_stiffness, ROD.stretch_stiffness
EULER = pi**2 * EI  # buckling load of a pinned rod of length 1 [N]
OUTWARD = np.array([[-1.0, 0.0, 0.0], [1.0, 0.0, 0.0]])
X, Z = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)


def straight_rod(edges, **options):
    mesh = rs.mesh_grid(FlatGrid.of([lattice_rod(0, "U01", 0.0, -0.5, 0.5)]), 1.0 / edges)
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
    found = follow(problem, start, np.zeros(edges), first_step=first).whole
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
        assert found.report.iterations < 50  # 24; some 300 if a step's first iteration did not predict its end
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


def lengths_at_nodes(mesh):
    """Half of every edge at each node [m]."""
    return np.bincount(mesh.edges.ravel(), np.repeat(0.5 * mesh.edge_lengths, 2))


def test_a_rod_that_hangs_straight_down_stretches_by_half_its_weight():
    """Exact on any mesh: each edge carries what hangs below its middle."""
    shell, weight = straight_rod(9), 5.0
    load = np.zeros_like(shell.mesh.flat)
    load[:, 0] = weight * lengths_at_nodes(shell.mesh)
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
    load[:, 2] = -lengths_at_nodes(shell.mesh)
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


def loaded_column(edges, share, solve=find_equilibrium):
    """A straight pinned rod under `share` of its buckling load, its end free to slide along x."""
    shell = straight_rod(edges)
    start, end = shell.ends
    free = in_plane(shell).with_directions(np.array([start])).with_directions(np.array([end]), X)
    load = np.zeros_like(shell.mesh.flat)
    load[end, 0] = -share * EULER
    problem = Problem(shell.elements, shell.stretch, Supports(free), 1.0, load=load)
    return shell, solve(problem, shell.mesh.flat, np.zeros(edges))


def squeezed_column(edges, share, solve=find_equilibrium, *, clamped=False, stiffness=EA, forces=None):
    """A straight rod whose ends are held so close that it carries `share` of the pinned rod's buckling load.

    The solve starts at the equilibrium: forces and all, unless `forces` says otherwise.
    """
    shell = straight_rod(edges, clamped=clamped)
    stretch = replace(shell.stretch, stiffness=np.full(edges, stiffness))
    short = 1 - share * EULER / stiffness
    state = shell.state(shell.mesh.flat * [short, 1, 1], OUTWARD if clamped else None)
    problem = Problem(shell.elements, stretch, Supports(in_plane(shell).with_directions(shell.ends)), 1.0)
    return shell, solve(problem, state, np.full(edges, -share * EULER if forces is None else forces))


def first_buckling(column, edges, low, high, **options):
    """Share of Euler's load at which a straight rod gets its first negative mode."""
    for _ in range(18):
        middle = 0.5 * (low + high)
        _, found = column(edges, middle, **options)
        assert found.report.converged
        low, high = (low, middle) if found.report.negative_modes else (middle, high)
    return high


@pytest.mark.parametrize("column", [loaded_column, squeezed_column])
def test_a_pinned_rod_buckles_at_eulers_load(column):
    sizes = np.array([20, 40, 80])
    loads = np.array([first_buckling(column, edges, 0.9, 1.1) for edges in sizes])
    assert loads[-1] == pytest.approx(1.0, abs=2.5e-4)  # pi^2/12 h^2 = 1.3e-4, and the strain, 2.5e-6
    assert order(1 / sizes, loads - 1) == pytest.approx(2.0, abs=0.1)


def test_a_clamped_rod_buckles_at_four_times_eulers_load():
    sizes = np.array([20, 40, 80])
    loads = np.array([first_buckling(squeezed_column, edges, 3.0, 5.0, clamped=True) for edges in sizes])
    assert loads[-1] == pytest.approx(4.0, rel=1e-3)  # four times the pinned rod's error: 5e-4
    assert order(1 / sizes, loads - 4) == pytest.approx(2.0, abs=0.1)


def test_modes_are_counted_one_by_one():
    """The pinned rod's loads are those of 1, 2 and 3 half-waves: 1, 4 and 9 times Euler's."""
    for share, modes in ((0.99, 0), (1.01, 1), (3.9, 1), (4.1, 2), (8.8, 2), (9.2, 3)):
        report = loaded_column(80, share)[1].report
        assert report.converged
        assert report.negative_modes == modes
        assert report.stable == (modes == 0)


@pytest.mark.parametrize("edges", [20, 80])
def test_mode_of_a_buckling_rod_is_half_a_sine(edges):
    shell, found = loaded_column(edges, 1.5)
    shape = found.mode[:, 2] * np.sign(found.mode[:, 2].sum())
    wave = np.sin(pi * (shell.mesh.flat[:, 0] + 0.5))
    np.testing.assert_allclose(shape, wave, rtol=0, atol=1e-3)  # exact on any mesh; inverse iteration left 3e-5
    np.testing.assert_allclose(found.mode[:, :2], 0.0, rtol=0, atol=1e-12)


def test_a_stable_rod_has_no_mode():
    assert loaded_column(20, 0.9)[1].mode is None


@pytest.mark.parametrize("edges", [20, 80])
def test_a_loaded_straight_rod_is_left_for_the_elastica(edges):
    exact = Elastica.loaded(1.5)
    shell, found = loaded_column(edges, 1.5, find_stable)
    assert found.report.stable
    assert abs(rise(shell, found)) == pytest.approx(exact.rise, rel=0.02)  # second order: 0.6 % at 20 edges
    start, end = shell.ends
    chord = found.state[end, 0] - found.state[start, 0]
    assert chord == pytest.approx(1 - exact.shortening, abs=0.03)  # 0.022 at 20 edges


@pytest.mark.parametrize("edges", [20, 80])
def test_a_squeezed_straight_rod_is_left_for_the_buckled_one(edges):
    """Buckled, it carries Euler's load; what shortening that leaves, u = pi^2 rise^2 / 4, makes a flat sine."""
    stiffness = 1e4 * EI
    _, straight = squeezed_column(edges, 1.5, stiffness=stiffness)
    assert straight.report.converged
    assert not straight.report.stable
    np.testing.assert_allclose(straight.forces, -1.5 * EULER, rtol=1e-9)
    shell, found = squeezed_column(edges, 1.5, find_stable, stiffness=stiffness)
    assert found.report.stable
    # buckling further raises the load by u/2 of itself, 2.5e-4; 20 edges lower it by 0.2 %
    np.testing.assert_allclose(found.forces, -EULER, rtol=5e-3)
    assert abs(rise(shell, found)) == pytest.approx(2 / pi * sqrt(0.5 * EULER / stiffness), rel=5e-3)


def test_a_solve_that_knows_the_place_but_not_the_forces_tells_that_it_is_unstable():
    _, found = squeezed_column(20, 1.5, forces=0.0)
    assert found.report.converged
    np.testing.assert_allclose(found.forces, -1.5 * EULER, rtol=1e-9)
    assert found.report.negative_modes == 1


@pytest.mark.parametrize("descend", [False, True])
def test_near_a_saddle_newton_finds_it_unless_told_to_descend(descend):
    _, straight = squeezed_column(20, 1.5, stiffness=1e4 * EI)

    def find_from_a_small_wave(problem, state, forces):
        wave = 1e-3 * np.sin(pi * (shell.mesh.flat[:, :1] + 0.5)) * [0, 0, 1]
        return find_equilibrium(problem, state + wave, forces, descend=descend)

    shell = straight_rod(20)
    _, found = squeezed_column(20, 1.5, find_from_a_small_wave, stiffness=1e4 * EI)
    assert found.report.converged
    assert found.report.stable == descend
    if not descend:
        np.testing.assert_allclose(found.state, straight.state, rtol=0, atol=1e-9)


@pytest.mark.parametrize(("steps", "circles"), [
    ([0.1] * 14, True),
    ([0.3, 0.1] * 7, True),
    ([5.0, 4.0] + [0.3, 0.1] * 7, True),
    ([0.1] * 13, False),
    ([0.1] * 13 + [0.09995], True),
    ([0.1] * 13 + [0.09], False),
    ([0.5**k for k in range(20)], False),
    ([0.1 * 0.99**k for k in range(20)], False),
])  # fmt: skip
def test_steps_that_repeat_themselves_are_told_from_slow_ones(steps, circles):
    assert equilibrium._repeats(steps) == circles


def test_a_solve_that_goes_in_circles_is_given_up(monkeypatch):
    """Where every step is as long as the last, sixty are not waited for."""
    taken = []

    def take(self, here):
        taken.append(1)
        return replace(here, iterations=here.iterations + 1, length=0.1, mismatch=1.0)

    monkeypatch.setattr(NewtonStep, "take", take)
    _, found = squeezed_column(8, 0.5)
    assert found.report.status is Status.STALLED
    assert len(taken) == equilibrium.REPEATED + 2


@pytest.mark.parametrize("push", [20, 20.5, 23])
def test_a_bow_pushed_past_its_limit_point_snaps_through(push):
    """Plain Newton steps stay about the limit point, though there is no equilibrium any more.

    What hangs below is a beam-column: EI w'' + P w = -F x/2 from the end to the middle, P and the slopes making up
    the shortening. The bow that it began with gives way at a push of 19.4. 22 to 32 factorizations measured.
    """
    stiffness, share = 1e4 * EI, 3.0
    shell, bow = squeezed_column(40, share, find_stable, stiffness=stiffness)
    short, pushed = share * EULER / stiffness, push * EI * sqrt(share * EULER / stiffness)
    state, load = bow.state * [1, 1, np.sign(rise(shell, bow))], np.zeros_like(bow.state)
    load[np.argmin(np.abs(shell.mesh.flat[:, 0])), 2] = -pushed
    stretch = replace(shell.stretch, stiffness=np.full(40, stiffness))
    supports = Supports(in_plane(shell).with_directions(shell.ends))
    problem = Problem(shell.elements, stretch, supports, 1.0, load=load)
    found = find_stable(problem, state, bow.forces, limit_steps=True)
    assert found.report.stable
    assert found.report.factorizations < 60

    def sag(k, x):
        return pushed / (2 * k**3 * EI) * (np.sin(k * x) / np.cos(0.5 * k) - k * x)

    x = np.linspace(0.0, 0.5, 2001)

    def too_short(k):
        return k**2 * EI / stiffness + np.trapezoid(np.gradient(sag(k, x), x) ** 2, x) - short

    k = brentq(too_short, 0.1 * pi, 0.999 * pi)
    assert rise(shell, found) == pytest.approx(-sag(k, 0.5), rel=2e-3)


def test_the_work_of_all_tries_is_counted():
    _, straight = squeezed_column(20, 1.5, stiffness=1e4 * EI)
    _, found = squeezed_column(20, 1.5, find_stable, stiffness=1e4 * EI)
    assert found.report.iterations > straight.report.iterations
    assert found.report.factorizations > straight.report.factorizations


@pytest.mark.parametrize(("begin", "goal"), [(0.99, 1.005), (0.985, 1.004), (0.999, 1.002), (0.95, 1.01), (1.01, 0.99)])
def test_modes_are_counted_at_the_equilibrium_and_not_where_the_solve_began(begin, goal):
    """A straight column taken past Euler's load, its Hessian factorised first where it was still stable."""
    edges = 40
    chain = (2 * edges / pi * np.sin(pi / 2 / edges)) ** 2  # its own load over Euler's
    shell, start = squeezed_column(edges, begin * chain)
    _, held = squeezed_column(edges, goal * chain)
    supports = Supports(in_plane(shell).with_directions(shell.ends), shell.ends, held.state[shell.ends])
    found = find_equilibrium(Problem(shell.elements, shell.stretch, supports, 1.0), start.state, start.forces)
    assert found.report.converged
    assert found.report.negative_modes == int(goal > 1)


# Reactions of a popped-up grid


@pytest.mark.parametrize("clamped", [False, True])
def test_supports_of_a_popped_up_shell_are_in_balance(clamped):
    layout = rs.GridLayout.orthogonal(spacing=0.06, edge=0.02)
    trimmed = rs.trim(rs.drape(layout, ROD, rs.Ellipsoid(0.2, 0.15, 0.12), anchor=(0.02, 0.01)))
    shell = Shell.of(trimmed.mesh, ROD, clamped=clamped)
    state = shell.state(trimmed.positions, trimmed.boundary.tangents)
    problem = Problem(shell.elements, shell.stretch, Supports(shell.held_ends()), 0.2)
    found = find_stable(problem, state, np.zeros(len(trimmed.mesh.edges)))
    assert found.report.stable
    held = np.append(shell.ends, shell.ghosts)
    free = np.setdiff1d(np.arange(len(state)), held)
    forces, places = found.gradient[held], found.state[held]
    total = np.abs(forces).sum()
    # round-off of a Newton solve that stops at steps of 1e-6 and leaves an error of about the square
    assert np.abs(found.gradient[free]).max() < 1e-9 * total
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, rtol=0, atol=1e-9 * total)
    np.testing.assert_allclose(np.cross(places, forces).sum(axis=0), 0.0, rtol=0, atol=1e-9 * total * 0.2)


# How solves end


def pulled_apart(distance, *, inextensible):
    """An arch whose ends are moved to a given distance; and the shares of the way that were tried."""
    shell, tried = straight_rod(20), []
    arch = shell.mesh.flat * [0.9, 1, 1]
    arch[:, 2] = 0.2 * np.cos(pi * shell.mesh.flat[:, 0])
    supports = in_plane(shell).with_directions(shell.ends)

    def problem(t):
        tried.append(t)
        goals = (0.45 + t * (distance / 2 - 0.45)) * OUTWARD
        moving = Supports(supports, shell.ends, goals)
        return Problem(shell.elements, shell.stretch, moving, 1.0, inextensible=inextensible)

    return shell, follow(problem, arch, np.zeros(20), first_step=0.25).whole, tried


def test_a_path_that_can_be_followed_ends_at_its_goal():
    shell, found, tried = pulled_apart(0.5, inextensible=False)
    assert found.report.stable
    np.testing.assert_allclose(found.state[shell.ends], 0.25 * OUTWARD, rtol=0, atol=1e-15)
    assert tried[-1] == 1.0
    assert tried == sorted(tried)


def test_elastic_ends_may_be_drawn_further_apart_than_the_rod_is_long():
    _, found, _ = pulled_apart(1.1, inextensible=False)
    assert found.report.stable
    np.testing.assert_allclose(found.forces, 0.1 * EA, rtol=1e-9)


def test_ends_further_apart_than_an_inextensible_rod_is_long_are_reported_as_stalled():
    shell, found, tried = pulled_apart(1.1, inextensible=True)
    assert found.report.status is Status.STALLED
    assert not found.report.stable
    assert "stopped" in found.report.status.sentence
    # up to ever smaller steps from the last place that can be reached, 0.5 of the way: taut, whole, and said to be
    apart = np.abs(np.subtract(*found.state[shell.ends, 0]))
    assert 0.99 < apart <= 1.0 + 1e-5
    assert found.report.max_strain < 1e-5
    assert max(tried) > 0.5
    assert min(np.abs(np.diff(tried[-5:]))) < 2e-3
    assert found.report.iterations >= len(tried)


def test_goals_that_are_no_numbers_are_reported_and_nothing_is_raised():
    shell = straight_rod(20)
    supports = Supports(in_plane(shell).with_directions(shell.ends), shell.ends, np.full((2, 3), np.nan))
    problem = Problem(shell.elements, shell.stretch, supports, 1.0)
    report = find_equilibrium(problem, shell.mesh.flat, np.zeros(20)).report
    assert report.status is Status.DIVERGED
    assert not report.stable
    followed = pulled_apart(np.nan, inextensible=False)[1].report
    assert followed.status in (Status.DIVERGED, Status.STALLED)


def test_a_solve_that_needs_more_iterations_is_stalled_and_one_that_needs_no_more_is_not():
    def allowing(iterations):
        return loaded_column(20, 0.5, partial(find_equilibrium, most_iterations=iterations))[1].report

    needed = allowing(60).iterations
    assert needed > 1
    assert allowing(needed).status is Status.CONVERGED
    assert allowing(needed - 1).status is Status.STALLED
    assert allowing(needed - 1).iterations == needed - 1
