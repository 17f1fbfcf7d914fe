"""Loads at which structures of known critical load lose their stability."""

from dataclasses import replace

import numpy as np
import pytest

from rodshell.model import Freedom
from rodshell.rods.elements import Stretch
from rodshell.rods.isotropic import IsotropicBend
from rodshell.solve.critical import CLOSE, first_critical
from rodshell.solve.equilibrium import Equilibrium, SolveReport, Status
from rodshell.solve.problem import Problem, Supports

GREENHILL = 7.8373  # q L^3 / EI of a column under its own weight [Timoshenko and Gere, section 2.12]
EDGES = 40
DISCRETE = 1e-3  # 40 edges leave 4e-4 of Greenhill's load (second order: 1.6e-3 at 20)


def at_rest(problem: Problem, state: np.ndarray, forces: np.ndarray) -> Equilibrium:
    """An equilibrium that is known without a solve."""
    report = SolveReport(Status.CONVERGED, 0, 0, 0, 0.0, 0.0, 0.0, 0)
    return Equilibrium(problem, state, forces, np.zeros_like(state), report)


def column(edges: int = EDGES) -> tuple[Problem, np.ndarray, np.ndarray]:
    """Of unit length and EI, clamped at its foot by a node below it; and its weight at factor 1, Greenhill's."""
    length = 1 / edges
    state = np.zeros((edges + 2, 3))
    state[:, 2] = length * np.arange(-1, edges + 1)
    row = np.arange(edges + 2)
    bends = np.column_stack([row[:-2], row[1:-1], row[2:]])
    stiffness = np.full(edges, 1 / length)
    stiffness[0] *= 2  # the clamp acts at the foot: half a Voronoi length
    pairs = np.column_stack([row[1:-1], row[2:]])
    stretch = Stretch.elastic(pairs, np.full(edges, length), np.full(edges, 1e6))
    free = Freedom.free(edges + 2).with_directions(np.array([0, 1]))
    load = np.zeros_like(state)
    load[2:, 2] = -GREENHILL * length
    load[-1] /= 2
    return Problem((IsotropicBend(bends, stiffness),), stretch, Supports(free), 1.0), state, load


def test_a_column_bears_greenhills_weight():
    problem, state, load = column()
    found = first_critical(at_rest(problem, state, np.zeros(EDGES)), load)
    assert found.limit == "bifurcation"
    assert 1 - CLOSE - DISCRETE < found.factor < 1 + DISCRETE


def test_a_load_that_stays_takes_its_share():
    problem, state, load = column()
    here = replace(problem, load=0.4 * load)
    forces = 0.4 * np.cumsum(load[:1:-1, 2])[::-1]
    squeezed = state.copy()
    squeezed[2:, 2] += np.cumsum(forces / 1e6 / EDGES)
    found = first_critical(at_rest(here, squeezed, forces), load)
    assert 0.6 - CLOSE - DISCRETE < found.factor < 0.6 + DISCRETE


def test_a_column_that_has_buckled_already_bears_nothing():
    problem, state, load = column()
    forces = 1.1 * np.cumsum(load[:1:-1, 2])[::-1]
    squeezed = state.copy()
    squeezed[2:, 2] += np.cumsum(forces / 1e6 / EDGES)
    found = first_critical(at_rest(replace(problem, load=1.1 * load), squeezed, forces), load)
    assert found.factor == 0
    assert found.limit == "unstable unloaded"


def test_a_column_that_hangs_bears_any_weight():
    problem, state, load = column(10)
    found = first_critical(at_rest(problem, state, np.zeros(10)), -load)
    assert found.limit == "none"
    assert found.factor >= 100


@pytest.mark.parametrize("height", [0.1, 0.5])
def test_a_pyramid_of_bars_snaps_through_at_its_limit_point(height):
    state = np.array([[1.0, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0], [0, 0, height]])
    rest = np.hypot(1.0, height)
    pairs = np.column_stack([np.arange(4), np.full(4, 4)])
    stretch = Stretch.elastic(pairs, np.full(4, rest), np.ones(4))
    free = Freedom.free(5).with_directions(np.arange(4))
    load = np.zeros((5, 3))
    load[4, 2] = -1e-3
    found = first_critical(at_rest(Problem((), stretch, Supports(free), 1.0), state, np.zeros(4)), load, most=1e4)
    length = rest ** (1 / 3)  # where P = 4 EA z (1/l - 1/l0) is largest: l^3 = a^2 l0
    exact = 4 * np.sqrt(length**2 - 1) * (1 / length - 1 / rest) / 1e-3
    assert found.limit == "limit point"
    assert (1 - CLOSE) * exact < found.factor <= exact * (1 + 1e-9)
