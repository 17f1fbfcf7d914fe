"""The sum of a shell's energies: each derivative by differences of the one before."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.model import Freedom, Potential, Shell

RANDOM = np.random.default_rng(7)
ROD = rs.Rod(rs.RectangularSection(width=1e-3, height=2e-3), rs.Material(youngs_modulus=1e6, density=1e3))
STEP = 1e-6  # m, rad: central differences, of second order: 1e-8 of the largest entry and round-off measured


def bent() -> tuple[Shell, np.ndarray]:
    layout = rs.GridLayout.orthogonal(rods=(3, 3), spacing=0.03, edge=0.01, length=0.12)
    shell = Shell.of(rs.mesh_grid(layout.flat_grid((3, 3), 0.12), 0.01), ROD, joint=rs.Pin())
    state = shell.state(shell.mesh.flat + 1e-3 * RANDOM.standard_normal(shell.mesh.flat.shape))
    state[shell.first_angle :, 0] = 0.1 * RANDOM.standard_normal(len(state) - shell.first_angle)
    return shell, state


def motion_of(shell: Shell, state: np.ndarray) -> np.ndarray:
    motion = RANDOM.standard_normal(state.shape)
    motion[shell.first_angle :, 1:] = 0.0
    return motion


def test_the_gradient_is_the_derivative_of_the_energy_and_the_product_that_of_the_gradient() -> None:
    shell, state = bent()
    energies, motion = shell.energies.refreshed(state), motion_of(shell, state)
    ahead, behind = state + STEP * motion, state - STEP * motion
    slope = (energies.energy(ahead) - energies.energy(behind)) / (2 * STEP)
    assert slope == pytest.approx(float(np.sum(energies.gradient(state) * motion)), rel=1e-5)
    change = (energies.gradient(ahead) - energies.gradient(behind)) / (2 * STEP)
    found = energies.product(state, motion)
    np.testing.assert_allclose(found, change, rtol=0, atol=1e-5 * np.abs(found).max())
    assert energies.curvature(state, motion) == pytest.approx(float(np.sum(motion * change)), rel=1e-5)


def test_the_matrix_in_the_free_directions_is_that_of_the_product() -> None:
    shell, state = bent()
    energies, free = shell.energies, shell.held_ends()
    matrix, q = energies.matrix(state, free), RANDOM.standard_normal(free.size)
    np.testing.assert_allclose(matrix @ q, free.reduce(energies.product(state, free.expand(q))), rtol=1e-9, atol=1e-9)
    assert abs(matrix - matrix.T).max() == 0


def test_a_sum_of_no_energies_is_zero() -> None:
    state, nothing = np.zeros((3, 3)), Potential(())
    assert nothing.energy(state) == 0
    assert not nothing.gradient(state).any()
    assert nothing.matrix(state, Freedom.free(3)).shape == (9, 9)
