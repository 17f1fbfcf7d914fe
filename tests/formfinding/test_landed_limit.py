"""The step limit of explicit ties where touching nodes are stopped at each step: recursions by hand, and falls."""

from dataclasses import replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.contact.modified_mass import ModifiedMass
from rodshell.errors import StabilityError
from rodshell.formfinding.methods import Fall
from rodshell.joints import ExplicitPenalty, Ties
from rodshell.layout import mesh_grid
from rodshell.model import Freedom, Shell
from rodshell.solve.implicit_euler import ContactEuler, Motion, Step
from rodshell.solve.linear_stability import step_limit
from rodshell.solve.problem import GravityForce, Supports
from tests.formfinding.falls import HEMISPHERE, MASS, PAPER_ROD, coarse_layout, slope

C = 3.0  # N/m
BOTH = np.arange(2)
APART = 1e-4  # m


def tied(free: Freedom, weighing: np.ndarray) -> Motion:
    """Two nodes on a table, tied explicitly; those that weigh rest on it at every step."""
    ties = Ties(np.array([[0, 1]]), np.array([C]))
    return Motion((), np.full((2, 3), MASS), Supports(free), (GravityForce(weighing),), (ties,))


def swing(motion: Motion, step: float, steps: int = 50) -> np.ndarray:
    """(steps,) distance between the nodes along x [m], from the start at APART on."""
    state, velocity = np.array([[0.0, 0.0, 0.3], [APART, 0.0, 0.3]]), np.zeros((2, 3))
    stepper = ContactEuler(ModifiedMass(slope(0.0), BOTH))
    found = []
    for _ in range(steps):
        taken = stepper.take(motion, state, velocity, time=0.0, step=step)
        assert isinstance(taken, Step)
        state, velocity = taken.state, taken.velocity
        found.append(state[1, 0] - state[0, 0])
    return np.array(found)


def test_two_nodes_stopped_at_each_step_bear_root_two_less_than_free_ones() -> None:
    """m (x+ - x) + 2 h^2 C x = 0 for their distance x: it is multiplied by 1 - 2 h^2 C / m at each step."""
    free = Freedom.free(2)
    motion, state = tied(free, BOTH), np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.3]])
    limit = step_limit(motion, state, stopped=BOTH)
    assert limit == pytest.approx(np.sqrt(MASS / C), rel=1e-9)
    assert step_limit(motion, state) == pytest.approx(np.sqrt(2 * MASS / C), rel=1e-9)
    for share in (0.97, 1.03):
        factor = 1 - 2 * (share * limit) ** 2 * C / MASS
        np.testing.assert_allclose(swing(motion, share * limit), APART * factor ** np.arange(1, 51), rtol=1e-6)


def test_a_stopped_node_tied_to_a_free_one() -> None:
    """m (a+ - a) + h^2 C (a - b) = 0 and m (b+ - 2b + b-) + h^2 C (b - a) = 0: all roots of that recursion."""
    on_a_rail = Freedom.free(2).with_directions(np.array([1]), (1.0, 0.0, 0.0))
    motion, state = tied(on_a_rail, np.array([0])), np.array([[0.0, 0.0, 0.3], [0.0, 0.0, 0.3]])

    def radius(step: float) -> float:
        k = step**2 * C / MASS
        return float(np.abs(np.linalg.eigvals([[1 - k, k, 0], [k, 2 - k, -1], [0, 1, 0]])).max())

    limit = step_limit(motion, state, stopped=np.array([0]))
    assert radius(0.999 * limit) < 1 + 1e-9 < 1 + 1e-3 < radius(1.001 * limit)
    assert np.abs(swing(motion, 0.98 * limit)).max() < 3 * APART
    assert np.abs(swing(motion, 1.02 * limit)).max() > 30 * APART


def explicit_shell(rod: rs.Rod = PAPER_ROD, stiffness: float = C) -> Shell:
    layout = coarse_layout()
    ties = ExplicitPenalty(C1=stiffness)
    return Shell.of(mesh_grid(layout.flat_grid((7, 7), 0.9), layout.edge), rod, coupling=ties)


@pytest.mark.slow
def test_a_step_that_the_flat_grid_bears_is_refused_once_it_has_landed() -> None:
    shell = explicit_shell()
    step = 0.97 * step_limit(Motion.of(shell), shell.state(shell.mesh.flat))
    fall = Fall(coupling=ExplicitPenalty(C1=C), time_step=step, duration=0.6)
    with pytest.raises(StabilityError, match=r"once the grid has landed: at t = 0\.\d+ s, \d+ nodes touching"):
        rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=fall)
    # what is stopped along the normal alone keeps its velocity along the surface
    sliding = replace(fall, stopped="normal")
    assert rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=sliding).rest is not None


def test_without_a_time_step_the_fall_takes_one_that_is_borne_whatever_touches() -> None:
    thick, stiffness = rs.Rod(rs.Circle(radius=3e-3), rs.Material(1e6, 1e3)), 30.0
    shell = explicit_shell(thick, stiffness)
    alone = replace(Motion.of(shell), elements=())
    state = shell.state(shell.mesh.flat)
    # every copy of a joint's node has half its mass
    joint = shell.mass[:, 0][np.bincount(shell.like)[shell.like] > 1].min()
    borne = np.sqrt(joint / stiffness)
    assert step_limit(alone, state, stopped=np.arange(len(state))) == pytest.approx(borne, rel=1e-6)
    # the rods help, but not wherever they are and whatever touches
    assert step_limit(Motion.of(shell), state, stopped=np.arange(len(state))) > 1.05 * borne
    fall = Fall(coupling=ExplicitPenalty(C1=stiffness), duration=0.08)  # not landed: no step is taken in halves
    draped = rs.drape(coarse_layout(), thick, HEMISPHERE, method=fall)
    assert draped.rest is not None
    assert draped.rest.steps == np.ceil(0.08 / (0.9 * borne))
