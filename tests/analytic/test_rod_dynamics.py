"""One rod in motion against closed forms: frequencies, momenta, free fall, damping; and how steps are controlled.

Unless said, a rod of length 1 m lies along x; its waves and swings take some tenths of a second.
"""

from math import pi, sqrt

import numpy as np
import pytest
from scipy.linalg import eigh

import gridshell as gs
from gridshell.model.elastic_rod import ElasticRod
from gridshell.solve.constraint import Supports
from gridshell.solve.implicit_euler import ImplicitEuler, Refused
from gridshell.solve.simulate import _Grid
from gridshell.solve.time_series import End

CANTILEVER = (1.8751040687, 4.6940911330, 7.8547574382)  # roots of cos b cosh b = -1
G = (0.0, 0.0, -9.81)


def kind(youngs_modulus=1e9, radius=1e-3):
    return gs.Rod(section=gs.Circle(radius=radius), material=gs.Material(youngs_modulus=youngs_modulus, density=1e3))


def straight(nodes, rod=None, **options):
    rest = np.zeros((nodes, 3))
    rest[:, 0] = np.linspace(0.0, 1.0, nodes)
    return ElasticRod.of(rest, rod or kind(), **options)


def thrown(rod, speed=1.0, seed=0):
    """Random velocities of the nodes, smooth along the rod."""
    rng = np.random.default_rng(seed)
    share = np.linspace(0, 1, rod.node_count)[:, None]
    velocity = np.zeros_like(rod.mass)
    velocity[rod.nodes] = speed * sum(np.cos(k * pi * share) * rng.normal(size=3) for k in range(4))
    return velocity


def order(steps, errors):
    return np.polyfit(np.log(steps), np.log(np.abs(errors)), 1)[0]


# Small vibrations


def exact_frequencies(rod):
    """Of a cantilever of length 1 [Hz], Euler and Bernoulli."""
    return np.square(CANTILEVER) * sqrt(rod.bend_stiffness / rod.mass_per_length) / (2 * pi)


def modes(rod):
    """Frequencies [Hz] and mode shapes (N, 3) of the assembled stiffness and mass, softest first."""
    free = rod.freedom()
    mass = free.reduce(rod.mass)  # the free directions are the axes
    squares, shapes = eigh(rod.hessian(rod.state()).toarray(), np.diag(mass))
    return np.sqrt(squares) / (2 * pi), [free.expand(shape) for shape in shapes.T]


def measured_frequency(rod, shape, frequency, *, steps_per_period):
    """From the zeros of the motion in one mode, started with a small velocity: half a period apart [Hz]."""
    step = 1 / (frequency * steps_per_period)
    series = gs.simulate(gs.Motion.of(rod), rod.state(), 1e-3 * shape, until=2.2 / frequency, step=step)
    amount = np.einsum("tij,ij->t", series.states - rod.state(), rod.mass * shape)
    after = np.flatnonzero(amount[1:-1] * amount[2:] < 0) + 1
    zeros = series.times[after] + step * amount[after] / (amount[after] - amount[after + 1])
    return (len(zeros) - 1) / (2 * (zeros[-1] - zeros[0]))


@pytest.mark.parametrize("twist", [False, True])
def test_first_three_frequencies_of_a_cantilever_are_the_roots_of_the_assembled_problem(twist):
    exact = exact_frequencies(kind())
    errors = []
    for nodes in (31, 61):
        found = modes(straight(nodes, clamped=("start",), twist=twist))[0][[0, 2, 4]]  # each twice: along y and z
        errors.append(np.abs(found / exact - 1))
    assert errors[1].max() < 5e-3
    # Second order in the edge: a quarter of the error, within 10 %
    np.testing.assert_allclose(errors[0] / errors[1], 4.0, rtol=0.1)


@pytest.mark.parametrize("mode", [0, 1, 2])
def test_first_three_frequencies_of_a_cantilever_in_time(mode):
    rod = straight(61, clamped=("start",), twist=False)
    frequencies, shapes = modes(rod)
    coarse, fine = (
        measured_frequency(rod, shapes[2 * mode], frequencies[2 * mode], steps_per_period=n) for n in (200, 400)
    )
    # An oscillation of implicit Euler has the frequency atan(w h) / h: second order in the step
    limit = (4 * fine - coarse) / 3
    assert limit == pytest.approx(exact_frequencies(kind())[mode], rel=5e-3)
    assert limit == pytest.approx(frequencies[2 * mode], rel=2e-4)  # zeros between steps by straight lines


def test_twisted_rod_swings_back_at_its_torsional_frequency():
    rod = straight(41, clamped=("start",))
    one = kind()
    exact = sqrt(one.twist_stiffness / (1e3 * 2 * one.section.second_moment)) / 4  # clamped and free: a quarter wave
    angles = np.zeros_like(rod.mass)
    angles[rod.angles, 0] = np.sin(pi / 2 * (np.arange(40) + 0.5) / 40)
    found = [measured_frequency(rod, angles, exact, steps_per_period=n) for n in (200, 400)]
    assert (4 * found[1] - found[0]) / 3 == pytest.approx(exact, rel=5e-3)


# Order, energy, momenta


@pytest.mark.parametrize("twist", [False, True])
def test_swing_is_of_first_order_in_the_step(twist):
    """A heavy cantilever let go; the exact motion is taken from the two finest steps."""
    rod = straight(21, kind(1e8), clamped=("start",), twist=twist)
    motion = gs.Motion.of(rod, forces=(gs.Gravity(rod.nodes, G),))
    counts = np.array([160, 320, 640, 1280, 2560])
    tips = [gs.simulate(motion, rod.state(), until=0.2, step=0.2 / n).states[-1][20] for n in counts]
    apart = np.linalg.norm(np.diff(tips, axis=0), axis=1)
    assert order(1 / counts[:-1], apart) == pytest.approx(1.0, abs=0.1)


@pytest.mark.parametrize("stiffness", [1e6, 1e8, 5e10])
@pytest.mark.parametrize("twist", [False, True])
def test_energy_never_grows_without_load(stiffness, twist):
    for speed in (0.1, 3.0):
        rod = straight(15, kind(stiffness), twist=twist)
        start = rod.state()
        start[rod.nodes, 1] = 0.2 * start[rod.nodes, 0] ** 2
        if twist:
            start[rod.angles, 0] = np.linspace(0, 3, rod.edge_count)
        motion = gs.Motion.of(rod).refreshed(start)
        energies = gs.simulate(motion, start, thrown(rod, speed), until=0.3, step=3e-3).energies.sum(axis=1)
        # Round-off: 1e-12 of the energy at the start
        assert np.diff(energies).max() <= 1e-12 * energies[0]
        assert energies[-1] < energies[0]


def linear_momentum(rod, velocities):
    return np.einsum("ij,tij->tj", rod.mass[rod.nodes], velocities[:, rod.nodes])


def angular_momentum(rod, states, velocities):
    return np.cross(states[:, rod.nodes], rod.mass[rod.nodes] * velocities[:, rod.nodes]).sum(axis=1)


@pytest.mark.parametrize("twist", [False, True])
def test_linear_momentum_of_a_free_rod_is_conserved(twist):
    rod = straight(31, twist=twist)
    series = gs.simulate(gs.Motion.of(rod), rod.state(), thrown(rod), until=0.5, step=2e-3)
    momentum = linear_momentum(rod, series.velocities)
    assert np.abs(momentum - momentum[0]).max() < 1e-10 * np.abs(momentum[0]).max()


def test_angular_momentum_of_a_free_rod_is_conserved_to_first_order_in_the_step():
    """Implicit Euler loses h^2 v x F a step."""
    rod = straight(21, kind(1e8), twist=False)
    counts, lost = np.array([200, 400, 800, 1600]), []
    for n in counts:
        series = gs.simulate(gs.Motion.of(rod), rod.state(), thrown(rod), until=0.1, step=0.1 / n)
        momentum = angular_momentum(rod, series.states, series.velocities)
        lost.append(np.linalg.norm(momentum[-1] - momentum[0]) / np.linalg.norm(momentum[0]))
    assert order(1 / counts, lost) == pytest.approx(1.0, abs=0.1)
    assert lost[-1] < 0.05


def test_free_fall_is_exact():
    """As implicit Euler falls: v = g k h, and the sum of it; no strain, no spin."""
    rod = straight(21, kind(5e10))
    series = gs.simulate(
        gs.Motion.of(rod, forces=(gs.Gravity(rod.nodes, (1.0, 2.0, -9.81)),)), rod.state(), until=1.0, step=0.01
    )
    k = np.arange(101)[:, None]
    g = np.array([1.0, 2.0, -9.81])
    # Round-off of 100 steps over a fall of 5 m
    np.testing.assert_allclose(series.velocities[:, 7], 0.01 * k * g, atol=1e-11)
    np.testing.assert_allclose(series.states[:, 7] - rod.state()[7], 1e-4 * k * (k + 1) / 2 * g, atol=1e-11)
    assert np.abs(series.states[-1][rod.angles]).max() < 1e-11
    assert series.energies[-1, 0] < 1e-12 * series.energies[-1, 1]


# Forces


def test_damping_decays_at_the_stated_rate():
    rod = straight(11)
    velocity = np.zeros_like(rod.mass)
    velocity[rod.nodes] = (1.0, -2.0, 0.5)
    velocity[rod.angles, 0] = 3.0
    left = []
    for step in (0.02, 0.01, 0.005):
        motion = gs.Motion.of(rod, forces=(gs.Damping(rate=2.0),))
        last = gs.simulate(motion, rod.state(), velocity, until=1.0, step=step).velocities[-1]
        share = (1 + 2.0 * step) ** (-1.0 / step)
        np.testing.assert_allclose(last, share * velocity, atol=1e-9)
        left.append(share)
    assert 2 * left[2] - left[1] == pytest.approx(np.exp(-2.0), rel=1e-3)


def test_damping_by_node_and_implicit_and_explicit_forces_agree():
    rod = straight(11)
    coefficients = np.zeros_like(rod.mass)
    coefficients[rod.nodes] = 0.01 * np.linspace(1, 2, 11)[:, None]
    blocks = np.arange(11)[:, None]
    by_velocity = -coefficients[rod.nodes, :, None] * np.eye(3)

    def implicit(time, state, velocity):
        return -coefficients * velocity, None, by_velocity

    def explicit(time, state, velocity):
        return -coefficients * velocity

    def last(force, step):
        motion = gs.Motion.of(rod, forces=(force,))
        return gs.simulate(motion, rod.state(), thrown(rod), until=0.1, step=step).states[-1]

    own = last(gs.Damping(coefficients=coefficients), 1e-3)
    np.testing.assert_allclose(last(gs.ImplicitForce(implicit, blocks), 1e-3), own, atol=1e-8)
    apart = [
        np.abs(last(gs.ExplicitForce(explicit), h) - last(gs.Damping(coefficients=coefficients), h)).max()
        for h in (1e-3, 5e-4)
    ]
    assert apart[0] > 1e-6  # held over a step they differ, and converge
    assert apart[1] == pytest.approx(apart[0] / 2, rel=0.1)


def test_implicit_spring_has_its_frequency_where_an_explicit_one_blows_up():
    """All nodes tied to their places by springs of 100 1/s, at a step of twice the explicit limit."""
    rod, w, step = straight(5), 100.0, 0.04
    stiffness = w**2 * rod.mass[rod.nodes]
    home = rod.state()

    def spring(time, state, velocity):
        force = np.zeros_like(state)
        force[rod.nodes] = -stiffness * (state - home)[rod.nodes]
        return force, -stiffness[:, :, None] * np.eye(3), None

    velocity = np.zeros_like(rod.mass)
    velocity[rod.nodes, 2] = 1.0

    def go(force):
        return gs.simulate(gs.Motion.of(rod, forces=(force,)), home, velocity, until=0.4, step=step)

    series = go(gs.ImplicitForce(spring, np.arange(5)[:, None]))
    found = series.states[:, 2, 2]
    x, v, exact = 0.0, 1.0, [0.0]
    for _ in range(10):
        v = (v - step * w**2 * x) / (1 + (step * w) ** 2)
        x += step * v
        exact.append(x)
    np.testing.assert_allclose(found, exact, atol=1e-10)
    assert series.report.factorizations == series.report.steps == 10  # linear: its gradient is in the matrix
    blown = go(gs.ExplicitForce(lambda *at: spring(*at)[0])).states[:, 2, 2]
    assert np.abs(blown).max() > 1e3


def test_point_loads_and_moments_move_a_free_rod_as_a_whole():
    rod = straight(11)
    loads = gs.PointLoads.on(5, 0.0, 0.0, 0.02), gs.PointLoads.on(rod.angles.start + 4, 1e-7)
    series = gs.simulate(gs.Motion.of(rod, forces=loads), rod.state(), until=0.2, step=1e-3)
    assert linear_momentum(rod, series.velocities)[-1] == pytest.approx([0, 0, 0.02 * 0.2], abs=1e-12)


def test_prescribed_motion_is_followed_and_carries_the_rod():
    rod = straight(11)
    free = rod.freedom().with_directions(np.array([0]))
    place = rod.state()[0]

    def support(time):
        return Supports(free, np.array([0]), (place + [0, 0, 0.1 * np.sin(5 * time)])[None])

    series = gs.simulate(gs.Motion.of(rod, constraint=support), rod.state(), until=1.0, step=5e-3)
    np.testing.assert_allclose(series.states[:, 0, 2], 0.1 * np.sin(5 * series.times), atol=1e-14)
    assert np.abs(series.states[-1, 10, 2]) > 1e-3


def test_supports_carry_the_weight_of_a_hanging_rod():
    rest = np.zeros((11, 3))
    rest[:, 2] = np.linspace(0, -1, 11)
    rod = ElasticRod.of(rest, kind())
    motion = gs.Motion.of(
        rod,
        constraint=rod.freedom().with_directions(np.array([0, rod.angles.start])),
        forces=(gs.Gravity(rod.nodes), gs.Damping(rate=20.0)),
    )
    series = gs.simulate(motion, rod.state(), until=3.0, step=0.02)
    taken = ImplicitEuler().take(series.last.motion, series.last.state, series.last.velocity, time=3.0, step=0.02)
    weight = 9.81 * rod.mass[rod.nodes, 0].sum()
    assert taken.reactions[0] == pytest.approx([0, 0, weight], rel=1e-6, abs=1e-9 * weight)


# Control of the step, and the record


def test_steps_halve_on_a_violent_start_and_grow_back():
    rod = straight(21, kind(1e8))
    motion = gs.Motion.of(rod, forces=(gs.Damping(rate=30.0),))
    series = gs.simulate(motion, rod.state(), thrown(rod, 30.0), until=1.0, step=0.02)
    report = series.report
    assert report.refused_steps > 0
    assert report.smallest_step < 0.02
    np.testing.assert_allclose(series.times, np.linspace(0, 1, 51), atol=1e-12)
    # Had steps not grown back, the rest of the second would have been taken at the smallest
    assert report.steps < 0.5 / report.smallest_step


def test_grid_of_halved_steps_meets_the_even_times_again():
    grid, times = _Grid(0.0, 1.0).halved().halved(), []
    assert grid.step == 0.25
    while grid.number < 3:
        grid = grid.next(grow=True)
        times.append(grid.time)
    assert times == [0.25, 0.5, 1.0, 2.0, 3.0]
    stiff = _Grid(0.0, 1.0).halved().next(grow=False)
    assert (stiff.time, stiff.step) == (0.5, 0.5)


def test_negative_pivots_are_refused_and_smaller_steps_pass():
    """A column under twice Euler's load, straight: unstable, at a rate that long steps cannot follow."""
    rod = straight(21, twist=False)
    start = rod.state()
    start[rod.nodes, 0] *= 1 - 2 * pi**2 * rod.elements[0].stiffness[0] * 0.05 / rod.stretch.stiffness[0]
    ends = rod.freedom().with_directions(np.array([0, 20]))
    motion = gs.Motion.of(rod, constraint=ends)
    long = ImplicitEuler().take(motion, start, 0 * start, time=0.0, step=1.0)
    assert isinstance(long, Refused)
    assert "negative" in long.reason
    assert not isinstance(ImplicitEuler().take(motion, start, 0 * start, time=0.0, step=1e-3), Refused)


def test_motion_that_cannot_go_on_raises_with_its_record():
    rod = straight(5)

    def push(time, state, velocity):
        """The wrong sign of the gradient: no Newton iteration of any step converges, once it is pushed."""
        return np.where(rod.mass > 0, 1e3 * np.sin(1e12 * state + 1e6 * time), 0.0), None, None

    motion = gs.Motion.of(rod, forces=(gs.ImplicitForce(push, np.arange(5)[:, None]),))
    with pytest.raises(gs.ConvergenceError, match=r"smallest step.*stopped at t = 0 s") as caught:
        gs.simulate(motion, rod.state(), until=1.0, step=0.1, halvings=3)
    assert caught.value.report.report.end is End.STALLED
    assert len(caught.value.report.times) == 1


def swing(**options):
    rod = straight(11, kind(1e8), clamped=("start",))
    motion = gs.Motion.of(rod, forces=(gs.Gravity(rod.nodes),))
    return gs.simulate(motion, rod.state(), step=0.01, **{"until": 0.5, **options})


def test_streamed_series_is_the_one_in_memory(tmp_path):
    kept = swing(every=3)
    streamed = swing(every=3, stream=tmp_path / "swing")
    loaded = gs.TimeSeries.load(tmp_path / "swing")
    assert len(kept.times) == 17
    for series in (streamed, loaded):
        for name in ("times", "states", "velocities", "energies"):
            np.testing.assert_array_equal(getattr(series, name), getattr(kept, name))
    assert isinstance(loaded.states.base, np.memmap) or isinstance(loaded.states, np.memmap)


@pytest.mark.parametrize("streamed", [False, True])
def test_interrupted_motion_keeps_what_was_finished(tmp_path, streamed):
    def stop(moment):
        if moment.time > 0.195:
            raise KeyboardInterrupt

    stream = tmp_path / "swing" if streamed else None
    series = swing(progress=stop, stream=stream)
    whole = swing()
    assert series.report.end is End.INTERRUPTED
    assert series.times[-1] == pytest.approx(0.2)
    np.testing.assert_array_equal(series.states, whole.states[:21])
    if streamed:
        np.testing.assert_array_equal(gs.TimeSeries.load(stream).states, whole.states[:21])


def test_motion_goes_on_from_its_last_moment():
    half, whole = swing(until=0.25), swing()
    last = half.last
    rest = gs.simulate(last.motion, last.state, last.velocity, start=0.25, until=0.5, step=0.01)
    np.testing.assert_allclose(rest.states[-1], whole.states[-1], atol=1e-10)


def test_what_is_not_finite_is_refused_loudly():
    rod = straight(5)
    bad = rod.state()
    bad[2, 1] = np.nan
    with pytest.raises(gs.InputError, match=r"state is nan at \[2, 1\]"):
        gs.simulate(gs.Motion.of(rod), bad, until=1.0, step=0.1)

    def wind(time, state, velocity):
        return np.where(time > 0.45, np.nan, 0.0) * state

    with pytest.raises(gs.InputError, match=r"wind gave nan .* at t = 0.5 s"):
        gs.simulate(gs.Motion.of(rod, forces=(gs.ExplicitForce(wind),)), rod.state(), until=1.0, step=0.1)
    for options, said in (({"step": 0.0}, "step must be positive"), ({"until": -1.0}, "must end after it starts")):
        with pytest.raises(gs.InputError, match=said):
            gs.simulate(gs.Motion.of(rod), rod.state(), **{"until": 1.0, "step": 0.1, **options})


def test_element_sets_in_parts_give_the_same_motion():
    rod = straight(21)
    motion, velocity = gs.Motion.of(rod), thrown(rod)
    whole, parts = (
        ImplicitEuler().take(one, rod.state(), velocity, time=0.0, step=1e-4) for one in (motion, motion.in_parts(4))
    )
    assert len(motion.in_parts(4).elements) == 5 * len(motion.elements)
    np.testing.assert_allclose(parts.state, whole.state, atol=1e-13)
