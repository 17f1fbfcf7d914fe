"""Stand-offs: derivatives, rigid motions, and the distance that they hold."""

import numpy as np
import pytest

from rodshell.joints.standoff import Standoffs


def some(seed: int = 0) -> tuple[Standoffs, np.ndarray]:
    """Three stand-offs on nine nodes, one of them where both rods end."""
    state = np.random.default_rng(seed).normal(size=(9, 3))
    blocks = np.array([[0, 1, 2, 3, 4, 5], [6, 2, 7, 8, 1, 3], [8, 5, 4, 6, 5, 5]])
    return Standoffs(blocks, np.array([0.3, -0.2, 0.5]), np.array([2.0, 3.0, 0.7])), state


def test_gradient_and_hessian_match_central_differences() -> None:
    ties, state = some()
    hessians, gradient = np.zeros((3, 18, 18)), np.zeros_like(state)
    ties.evaluate(state, gradient, hessians)
    whole = np.zeros((27, 27))
    for element, blocks in zip(hessians, ties.blocks, strict=True):
        rows = (3 * blocks[:, None] + np.arange(3)).ravel()
        np.add.at(whole, np.ix_(rows, rows), element)
    np.testing.assert_allclose(whole, whole.T, atol=1e-12)
    for k in range(27):
        shift = np.zeros(27)
        shift[k] = 1e-6
        gradients, energies = [], []
        for sign in (1, -1):
            slope = np.zeros_like(state)
            energies.append(ties.evaluate(state + sign * shift.reshape(9, 3), slope))
            gradients.append(slope.ravel())
        assert (energies[0] - energies[1]) / 2e-6 == pytest.approx(gradient.flat[k], abs=1e-7)
        np.testing.assert_allclose((gradients[0] - gradients[1]) / 2e-6, whole[k], atol=1e-6)


def test_rigid_motions_cost_nothing_and_forces_and_moments_balance() -> None:
    ties, state = some(1)
    gradient = np.zeros_like(state)
    energy = ties.evaluate(state, gradient)
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    turn *= np.sign(np.linalg.det(turn))  # no reflection: the normal is a pseudovector
    assert ties.evaluate(state @ turn + [1, 2, 3], np.zeros_like(state)) == pytest.approx(energy, rel=1e-12)
    assert np.abs(gradient.sum(axis=0)).max() < 1e-12
    assert np.abs(np.cross(state, gradient).sum(axis=0)).max() < 1e-12


def test_a_node_at_its_distance_above_the_crossing_is_free_of_force() -> None:
    flat = np.array([[0, 0, 0.2], [0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 0, 0], [0, -1, 0]], dtype=float)
    tie = Standoffs(np.arange(6)[None], np.array([0.2]), np.array([5.0]))
    gradient = np.zeros_like(flat)
    assert tie.evaluate(flat, gradient) == pytest.approx(0.0, abs=1e-15)
    assert np.abs(gradient).max() < 1e-15
    flat[0, 2] = 0.3
    assert tie.evaluate(flat, gradient) == pytest.approx(0.5 * 5.0 * 0.1**2)
