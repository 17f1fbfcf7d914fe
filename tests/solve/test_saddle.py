"""Saddles: a flat linkage just past its bifurcation, whose valley leaves the plane."""

from math import radians

import numpy as np
import pytest

from rodshell.solve.equilibrium import beside, find_equilibrium, find_stable
from rodshell.solve.newton_step import upwards
from tests.solve.fans import fans


@pytest.mark.parametrize("opened", [8.86, 8.9, 9.0, 9.5, 10.0])
def test_a_saddle_just_past_a_flat_bifurcation_is_left_in_a_few_factorizations(opened):
    """It begins at 8.83 degrees; 500 factorizations, and the saddle returned, without a search along the valley."""
    problem, flat = fans(1.0, radians(opened))
    unused = np.zeros(len(problem.stretch.blocks))
    saddle = find_equilibrium(problem, flat, unused, limit_steps=True)
    assert saddle.report.negative_modes == 1
    found = find_stable(problem, flat, unused, limit_steps=True)
    assert found.report.stable
    assert found.tangent.negative_modes == 0
    assert found.energy < saddle.energy
    assert found.report.factorizations <= saddle.report.factorizations + 12 <= 40


def test_the_valley_leads_nearly_to_the_equilibrium_below_and_to_the_same_height_on_both_sides():
    """0.73 of the way down in energy: the next terms of the valley are left out."""
    problem, flat = fans(1.0, radians(9.0))
    saddle = find_equilibrium(problem, flat, np.zeros(len(problem.stretch.blocks)), limit_steps=True)
    below = find_stable(problem, flat, np.zeros(len(problem.stretch.blocks)), limit_steps=True)
    states = [beside(saddle, side * saddle.mode)[0] for side in (1.0, -1.0)]
    up, down = (saddle.problem.potential(state) for state in states)
    assert up == pytest.approx(down, rel=1e-12)
    assert 0.6 < (saddle.energy - up) / (saddle.energy - below.energy) <= 1.0
    assert states[0][:, 2].sum() > 0 > states[1][:, 2].sum()


def test_the_same_side_at_every_size():
    states = []
    for size in (1.0, 2.0**-20, 2.0**10):
        problem, flat = fans(size, radians(9.0))
        found = find_stable(problem, flat, np.zeros(len(problem.stretch.blocks)), limit_steps=True)
        assert found.report.stable
        states.append(found.state / np.where(problem.unit(len(flat)) == problem.length, size, 1.0))
    np.testing.assert_array_equal(states[1], states[0])
    np.testing.assert_array_equal(states[2], states[0])


def test_a_mode_is_given_with_one_sign_whichever_it_was_found_with():
    up = np.array([[0.0, 0.0, 1.0], [0.0, 0.0, 0.5], [0.3, 0.0, -0.2]])
    as_much = np.array([[0.0, 0.0, 0.1], [0.0, 0.0, -1.0], [0.0, 0.0, 0.9]])  # down first, of those that go far
    along_y = np.array([[0.0, 1.0, 0.0], [0.2, -0.1, 0.0]])
    for mode, sign in ((up, 1.0), (as_much, -1.0), (along_y, 1.0)):
        for given in (mode, -mode):
            np.testing.assert_array_equal(upwards(given), sign * mode)
