"""Sliding down the energy: against the elastica, Newton's method, and the definition of a descent."""

import numpy as np
import pytest
from scipy.special import ellipk

import rodshell as rs
from rodshell.formfinding import popup as popup_module
from rodshell.model import Freedom
from rodshell.rods.elements import Stretch
from rodshell.rods.isotropic import IsotropicBend
from rodshell.solve import path
from rodshell.solve.implicit_euler import ImplicitEuler
from rodshell.solve.path import relax
from rodshell.solve.problem import Problem, Supports

PINNED, SLIDING, PLANE = ((), ((1.0, 0.0, 0.0),), ((1.0, 0.0, 0.0), (0.0, 0.0, 1.0)))


def column(edges, load):
    """A pinned column of length 1 and EI = 1 along x in the xz plane, pressed by `load`; its problem and flat state."""
    nodes = np.arange(edges + 1)
    state = np.column_stack([nodes / edges, 0.0 * nodes, 0.0 * nodes])
    pairs = np.column_stack([nodes[:-1], nodes[1:]])
    bends = np.column_stack([nodes[:-2], nodes[1:-1], nodes[2:]])
    free = Freedom.free(edges + 1).with_directions(nodes, *PLANE)
    free = free.with_directions(nodes[:1], *PINNED).with_directions(nodes[-1:], *SLIDING)
    force = np.zeros_like(state)
    force[-1, 0] = -load
    elements = (IsotropicBend(bends, np.full(len(bends), float(edges))),)
    stretch = Stretch.elastic(pairs, np.full(edges, 1.0 / edges), np.full(edges, 1e6))
    return Problem(elements, stretch, Supports(free), 1.0, load=force), state


def energy(problem, state):
    total = sum(e.evaluate(state, np.zeros_like(state)) for e in (*problem.elements, problem.stretch))
    return total - (0.0 if problem.load is None else float((problem.load * state).sum()))


def elastica(load):
    """Rise of a pinned column of length 1, EI = 1 above Euler's load: 2 k / sqrt(P) with K(k) = sqrt(P) / 2."""
    low, high = 0.0, 1.0
    for _ in range(200):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if ellipk(middle**2) < 0.5 * np.sqrt(load) else (low, middle)
    return 2 * low / np.sqrt(load)


@pytest.mark.slow
@pytest.mark.parametrize("over", [1.05, 1.5, 2.0])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_buckled_column_slides_down_to_the_elastica(over, side):
    load, errors = over * np.pi**2, []
    for edges in (20, 40):
        problem, state = column(edges, load)
        state[1:-1, 2] += side * 1e-3 * np.sin(np.pi * state[1:-1, 0])
        found = relax(problem, state)
        assert found.report.stable
        errors.append(abs(side * found.state[edges // 2, 2] - elastica(load)))
    assert errors[1] < 4e-3
    assert errors[1] < 0.3 * errors[0]  # second order in the edges


def test_column_below_eulers_load_comes_back_straight():
    problem, state = column(20, 0.9 * np.pi**2)
    state[1:-1, 2] += 0.05 * np.sin(np.pi * state[1:-1, 0])
    found = relax(problem, state)
    assert found.report.stable
    assert np.abs(found.state[:, 2]).max() < 1e-9


def test_energy_never_grows_and_every_step_is_counted(monkeypatch):
    problem, state = column(30, 2.0 * np.pi**2)
    state[1:-1, 2] += 1e-4 * np.sin(np.pi * state[1:-1, 0])
    seen, factorizations = [energy(problem, state)], 0
    take = ImplicitEuler.take

    def recorded(self, motion, start, *rest, **more):
        nonlocal factorizations
        taken = take(self, motion, start, *rest, **more)
        factorizations += taken.factorizations
        if hasattr(taken, "state"):
            seen.append(energy(problem, taken.state))
        return taken

    monkeypatch.setattr(ImplicitEuler, "take", recorded)
    found = relax(problem, state)
    assert found.report.stable
    assert len(seen) > 5
    assert np.all(np.diff(seen) <= 1e-12 * np.abs(seen[0]))
    assert energy(problem, found.state) <= seen[-1] + 1e-9 * abs(seen[-1])
    assert found.report.factorizations > factorizations > 0


@pytest.mark.slow
def test_shell_that_newtons_method_loses_pops_up_by_sliding(monkeypatch):
    """A steep paraboloid: released at once it takes more than the iterations left to it, sliding down it arrives."""
    monkeypatch.setattr(popup_module, "MOST_AT_ONCE", 10)
    rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
    layout = rs.GridLayout.orthogonal(rods="auto", spacing=0.03, length="auto", edge=0.01)
    trimmed = rs.trim(rs.drape(layout, rod, rs.Paraboloid(radius=0.1, height=0.4)))
    footprint = rs.map_back(trimmed)
    popped = rs.pop_up(footprint, trimmed.boundary, rod, ends="pinned")
    assert popped.report.stable
    monkeypatch.setattr(path, "MOST_STEPS", 0)
    assert not rs.pop_up(footprint, trimmed.boundary, rod, ends="pinned").report.stable
    # the state is an equilibrium: without its ends' forces nothing is left of the gradient
    gradient = np.zeros_like(popped.state)
    shell = popped.shell
    for element in (*shell.elements, shell.stretch):
        element.evaluate(popped.state, gradient)
    assert np.abs(shell.held_ends().reduce(gradient)).max() < 1e-9 * rod.stretch_stiffness
