"""Motions of one rod and what is measured on them; for the tests of `test_rod_dynamics.py` and the acceptance table.

A rod of length 1 m lies along x; its waves and swings take some tenths of a second.
"""

from math import pi, sqrt

import numpy as np
from scipy.linalg import eigh

import rodshell as rs
from tests.solve.rod_problems import order

CANTILEVER = (1.8751040687, 4.6940911330, 7.8547574382)  # roots of cos b cosh b = -1
G = (0.0, 0.0, -9.81)


def kind(youngs_modulus=1e9, radius=1e-3):
    return rs.Rod(section=rs.Circle(radius=radius), material=rs.Material(youngs_modulus=youngs_modulus, density=1e3))


def straight(nodes, rod=None, **options):
    rest = np.zeros((nodes, 3))
    rest[:, 0] = np.linspace(0.0, 1.0, nodes)
    return rs.ElasticRod.of(rest, rod or kind(), **options)


def thrown(rod, speed=1.0, seed=0):
    """Random velocities of the nodes, smooth along the rod (of a ring: around it)."""
    rng = np.random.default_rng(seed)
    share = np.linspace(0, 1, rod.node_count, endpoint=not rod.closed)[:, None] * (2 if rod.closed else 1)
    velocity = np.zeros_like(rod.mass)
    velocity[rod.nodes] = speed * sum(np.cos(k * pi * share) * rng.normal(size=3) for k in range(4))
    return velocity


# Small vibrations


def exact_frequencies(rod):
    """Of a cantilever of length 1 [Hz], Euler and Bernoulli."""
    return np.square(CANTILEVER) * sqrt(rod.bend_stiffness / rod.mass_per_length) / (2 * pi)


def modes(rod, state=None):
    """Frequencies [Hz] and mode shapes (N, 3) of the assembled stiffness and mass, softest first."""
    free = rod.freedom()
    squares, shapes = eigh(
        rod.hessian(rod.state() if state is None else state).toarray(), np.diag(free.reduce(rod.mass))
    )  # the free directions are the axes
    return np.sqrt(np.maximum(squares, 0)) / (2 * pi), [free.expand(shape) for shape in shapes.T]


def measured_frequency(rod, shape, frequency, *, steps_per_period):
    """From the zeros of the motion in one mode, started with a small velocity: half a period apart [Hz]."""
    step = 1 / (frequency * steps_per_period)
    series = rs.simulate(rs.Motion.of(rod), rod.state(), 1e-3 * shape, until=2.2 / frequency, step=step)
    amount = np.einsum("tij,ij->t", series.states - rod.state(), rod.mass * shape)
    after = np.flatnonzero(amount[1:-1] * amount[2:] < 0) + 1
    zeros = series.times[after] + step * amount[after] / (amount[after] - amount[after + 1])
    return (len(zeros) - 1) / (2 * (zeros[-1] - zeros[0]))


def frequency_limit(rod, shape, frequency):
    """In the limit of small steps [Hz]. Implicit Euler swings at atan(w h) / h: second order in the step."""
    coarse, fine = (measured_frequency(rod, shape, frequency, steps_per_period=n) for n in (200, 400))
    return (4 * fine - coarse) / 3


# Order, energy, momenta


def swing_order(twist):
    """Order in the step of a heavy cantilever's tip, let go for 0.2 s, by the distances between successive halves."""
    rod = straight(21, kind(1e8), clamped=("start",), twist=twist)
    motion = rs.Motion.of(rod, forces=(rs.GravityForce(rod.nodes, G),))
    counts = np.array([160, 320, 640, 1280, 2560])
    tips = [rs.simulate(motion, rod.state(), until=0.2, step=0.2 / n).states[-1][20] for n in counts]
    return order(1 / counts[:-1], np.linalg.norm(np.diff(tips, axis=0), axis=1))


def energy_growth(rod, start=None, *, speed, until=0.3, step=3e-3):
    """Largest growth of the energy in a step without load, and the loss of all, both over the energy at the start."""
    state = rod.state() if start is None else start
    motion = rs.Motion.of(rod).refreshed(state)
    energies = rs.simulate(motion, state, thrown(rod, speed), until=until, step=step).energies.sum(axis=1)
    return np.diff(energies).max() / energies[0], 1 - energies[-1] / energies[0]


def linear_momentum(rod, velocities):
    return np.einsum("ij,tij->tj", rod.mass[rod.nodes], velocities[:, rod.nodes])


def linear_drift(rod):
    """Largest change of the linear momentum of a free rod in 0.5 s, over the momentum."""
    series = rs.simulate(rs.Motion.of(rod), rod.state(), thrown(rod), until=0.5, step=2e-3)
    momentum = linear_momentum(rod, series.velocities)
    return np.abs(momentum - momentum[0]).max() / np.abs(momentum[0]).max()


def angular_momentum(rod, states, velocities):
    return np.cross(states[:, rod.nodes], rod.mass[rod.nodes] * velocities[:, rod.nodes]).sum(axis=1)


def angular_losses(rod, counts, until=0.1):
    """Share of the angular momentum that a free rod loses by `until`, in so many steps."""
    lost = []
    for n in counts:
        series = rs.simulate(rs.Motion.of(rod), rod.state(), thrown(rod), until=until, step=until / n)
        momentum = angular_momentum(rod, series.states, series.velocities)
        lost.append(np.linalg.norm(momentum[-1] - momentum[0]) / np.linalg.norm(momentum[0]))
    return lost
