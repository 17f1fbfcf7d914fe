"""Reactions balance, and are the work that the supports do when they move."""

from dataclasses import replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks.reactions import Reactions, joint_loads, reactions
from rodshell.figures.records import Ends
from rodshell.formfinding.popup import PopUp
from rodshell.formfinding.trim import Boundary
from tests.checks.shells import ROD, dome


def popped(ends: Ends, boundary: Boundary) -> PopUp:
    form = dome()
    return rs.pop_up(form.footprint, boundary, ROD, ends=ends)


def energy(shell: PopUp) -> float:
    unused = np.zeros_like(shell.state)
    return sum(one.evaluate(shell.state, unused) for one in (*shell.shell.elements, shell.shell.stretch))


def reactions_of(shell: PopUp) -> Reactions:
    return reactions(shell.shell, shell.equilibrium)


@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_forces_and_moments_of_all_supports_vanish_together(ends: Ends) -> None:
    held = reactions_of(dome().popped[ends])
    assert held.force_imbalance < 1e-8
    assert held.moment_imbalance < 1e-8
    largest = np.linalg.norm(held.forces, axis=1).max()
    assert largest > 1e-6  # N: there is something to balance
    assert np.any(held.moments != 0) == (ends == "clamped")


@pytest.mark.parametrize("ends", ["pinned", "clamped"])
def test_a_reaction_is_the_energy_gained_where_its_support_moves(ends: Ends) -> None:
    boundary, step = dome().trimmed.boundary, 2e-5  # m: the central difference's error is of 1e-4 of the force
    held = reactions_of(popped(ends, boundary))
    for end, direction in ((0, np.array([1.0, 0, 0])), (9, np.array([0, 0.6, 0.8]))):
        energies = []
        for side in (1, -1):
            points = boundary.points.copy()
            points[end] += side * step * direction
            energies.append(energy(popped(ends, replace(boundary, points=points, draped=moved(boundary, points)))))
        work = (energies[0] - energies[1]) / (2 * step)
        assert work == pytest.approx(float(held.forces[end] @ direction), rel=2e-3, abs=1e-9)


def moved(boundary: Boundary, points: np.ndarray) -> np.ndarray:
    """The draped state with its ends at `points`: where the pop-up starts, and its supports are."""
    assert boundary.draped is not None
    draped = boundary.draped.copy()
    draped[dome().footprint.mesh.ends.ravel()] = points
    return draped


def test_a_clamp_moment_is_the_energy_gained_where_it_turns() -> None:
    boundary, step, end = dome().trimmed.boundary, 1e-3, 5
    held = reactions_of(popped("clamped", boundary))
    tangent = boundary.tangents[end]
    axis = np.cross(tangent, [0.3, -0.5, 0.8])
    axis /= np.linalg.norm(axis)
    energies = []
    for side in (1, -1):
        tangents = boundary.tangents.copy()
        tangents[end] = np.cos(step) * tangent + side * np.sin(step) * np.cross(axis, tangent)
        energies.append(energy(popped("clamped", replace(boundary, tangents=tangents))))
    work = (energies[0] - energies[1]) / (2 * step)
    assert abs(work) > 1e-8
    assert work == pytest.approx(float(held.moments[end] @ axis), rel=2e-3)


def test_out_of_equilibrium_nothing_balances() -> None:
    """The sums test the state: a shell that is not in equilibrium does not pass."""
    from rodshell.checks.reactions import reactions
    from rodshell.solve.equilibrium import Problem, find_equilibrium
    from rodshell.solve.problem import Supports

    shell = dome().popped["pinned"]
    bumped = shell.state.copy()
    free = np.setdiff1d(np.arange(len(bumped)), shell.shell.ends)
    bumped[free, 2] += 1e-5 * np.sin(np.arange(len(free)))
    problem = Problem(shell.shell.elements, shell.shell.stretch, Supports(shell.shell.held_ends()), 0.2)
    stopped = find_equilibrium(problem, bumped, shell.forces, most_iterations=0)
    assert reactions(shell.shell, stopped).force_imbalance > 1e-3


def test_the_moment_of_an_energy_of_nodes_alone_is_refused_and_not_said_to_be_zero() -> None:
    """A spring of 750 N m/rad between two rods that have turned by 0.1 rad: 75 N m about the joint, by its forces."""
    grid = rs.straight_rods([[[-1.0, 0.0], [1.0, 0.0]], [[0.0, -1.0], [0.0, 1.0]]])
    shell = rs.Shell.of(rs.mesh_grid(grid, edge=0.5), ROD)
    around = shell.mesh.rod_nodes[shell.mesh.beside_crossings].reshape(-1, 4)

    def law(x: np.ndarray) -> np.ndarray:
        first, second = x[:, 1] - x[:, 0], x[:, 3] - x[:, 2]
        lengths = np.sqrt((first * first).sum(axis=1) * (second * second).sum(axis=1))
        return 375.0 * (np.arccos((first * second).sum(axis=1) / lengths) - np.pi / 2) ** 2

    spring, state, turn = rs.LocalEnergy(around, law), shell.state(shell.mesh.flat), 0.1
    second = shell.mesh.rod_nodes[shell.mesh.rod_start[1] :]
    state[second, :2] = state[second, :2] @ [[np.cos(turn), np.sin(turn)], [-np.sin(turn), np.cos(turn)]]
    pulls = np.zeros_like(state)
    spring.evaluate(state, pulls)
    moment = np.cross(state[second], pulls[second]).sum(axis=0)
    np.testing.assert_allclose(moment, [0.0, 0.0, 75.0], atol=1e-6)
    with pytest.raises(rs.InputError, match="LocalEnergy between rods acts on nodes alone, so that the moments"):
        joint_loads(replace(shell, between=(*shell.between, spring)), state)
    np.testing.assert_allclose(joint_loads(shell, state).moments, 0.0)
