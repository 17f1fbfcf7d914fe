"""Cables: derivatives, rigid motions, and nothing when slack."""

import numpy as np
import pytest

from rodshell.rods.cable import CableStretch


def some_cables(seed: int = 0) -> tuple[CableStretch, np.ndarray]:
    """Twenty cables between twelve nodes, about half of them slack, none near the switch."""
    rng = np.random.default_rng(seed)
    state = rng.normal(size=(12, 3))
    blocks = np.array([rng.choice(12, 2, replace=False) for _ in range(20)])
    lengths = np.linalg.norm(state[blocks[:, 1]] - state[blocks[:, 0]], axis=1)
    rest = lengths * np.where(rng.random(20) < 0.5, 0.8, 1.1)
    return CableStretch(blocks, rest, rng.uniform(1.0, 9.0, 20)), state


def gradient_of(cables: CableStretch, state: np.ndarray) -> np.ndarray:
    gradient = np.zeros_like(state)
    cables.evaluate(state, gradient)
    return gradient


def test_gradient_and_hessian_match_central_differences() -> None:
    cables, state = some_cables()
    hessians, gradient = np.zeros((20, 6, 6)), np.zeros_like(state)
    cables.evaluate(state, gradient, hessians)
    whole = np.zeros((36, 36))
    for element, blocks in zip(hessians, cables.blocks, strict=True):
        rows = (3 * blocks[:, None] + np.arange(3)).ravel()
        whole[np.ix_(rows, rows)] += element
    step = 1e-6
    for k in range(36):
        shift = np.zeros(36)
        shift[k] = step
        up, down = state + shift.reshape(12, 3), state - shift.reshape(12, 3)
        energy = [cables.evaluate(at, np.zeros_like(state)) for at in (up, down)]
        assert (energy[0] - energy[1]) / (2 * step) == pytest.approx(gradient.flat[k], abs=1e-7)
        change = (gradient_of(cables, up) - gradient_of(cables, down)).ravel() / (2 * step)
        np.testing.assert_allclose(change, whole[k], atol=1e-6)


def test_a_slack_cable_has_exactly_no_energy_force_or_stiffness() -> None:
    state = np.array([[0.0, 0, 0], [0.3, 0.4, 0.0]])
    for rest in (0.5, 0.6):  # just taut without strain, and slack
        cable = CableStretch(np.array([[0, 1]]), np.array([rest]), np.array([1e9]))
        gradient, hessians = np.zeros((2, 3)), np.ones((1, 6, 6))
        assert cable.evaluate(state, gradient, hessians) == 0.0
        assert not gradient.any()
        assert not hessians.any()
        assert cable.forces(state).tolist() == [0.0]


def test_energy_is_that_of_a_spring_and_does_not_see_rigid_motions() -> None:
    cables, state = some_cables(1)
    apart = np.linalg.norm(state[cables.blocks[:, 1]] - state[cables.blocks[:, 0]], axis=1)
    drawn = np.maximum(apart - cables.rest_lengths, 0.0)
    energy = cables.evaluate(state, np.zeros_like(state))
    assert energy == pytest.approx(float(np.sum(cables.stiffness / cables.rest_lengths * drawn**2 / 2)), rel=1e-12)
    turn, _ = np.linalg.qr(np.random.default_rng(2).normal(size=(3, 3)))
    moved = state @ turn + [1.0, -2.0, 0.5]
    assert cables.evaluate(moved, np.zeros_like(state)) == pytest.approx(energy, rel=1e-12)
    np.testing.assert_allclose(gradient_of(cables, moved), gradient_of(cables, state) @ turn, atol=1e-12)
    assert np.abs(gradient_of(cables, state).sum(axis=0)).max() < 1e-12


def test_stress_stiffness_is_the_hessian_of_the_added_tension_at_frozen_geometry() -> None:
    """A cable with the tension dN and no stiffness along itself has the Hessian dN/l (1 - tt')."""
    cables, state = some_cables(3)
    motion = np.random.default_rng(4).normal(size=state.shape)
    found = np.zeros((20, 6, 6))
    cables.stress_stiffness(state, motion, found)
    step = 1e-6
    tension = (cables.forces(state + step * motion) - cables.forces(state - step * motion)) / (2 * step)
    for k, (a, b) in enumerate(cables.blocks):
        apart = state[b] - state[a]
        length = np.linalg.norm(apart)
        across = np.eye(3) - np.outer(apart, apart) / length**2
        np.testing.assert_allclose(found[k], np.kron([[1, -1], [-1, 1]], tension[k] / length * across), atol=1e-6)
