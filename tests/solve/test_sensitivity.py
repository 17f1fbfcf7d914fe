"""Derivatives of equilibria against solving again: by every property of the edges, and by where ends are held.

Central differences with two steps, extrapolated, of equilibria that are solved to 1e-13: they agree to 1e-6.
"""

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
from scipy.sparse import csc_array

import rodshell as rs
from rodshell.formfinding.popup import Ends
from rodshell.model.edge_properties import EA, EI1, EI2, GJ, LENGTH, PROPERTIES, EdgeProperties
from rodshell.solve.equilibrium import Equilibrium, find_equilibrium
from rodshell.solve.sensitivity import Parameters, Sensitivity

ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))
LATH = rs.Rod(rs.RectangularSection(width=1e-3, height=2e-3), ROD.material)
KINDS = {"EA": EA, "EI1": EI1, "EI2": EI2, "GJ": GJ, "length": LENGTH}
SIZE = {"EA": 8.0, "EI1": 0.4, "EI2": 0.5, "GJ": 1.0, "length": 0.005, "ends": 0.0015}  # of a parameter's effect
STEP = 4e-3

SHELLS: list[tuple[rs.Rod, rs.Pin | None, Ends]] = [
    (ROD, None, "pinned"), (ROD, None, "clamped"), (LATH, rs.Pin(), "pinned"), (LATH, rs.Pin(), "clamped"),
]  # fmt: skip
NAMES = ["round pinned", "round clamped", "laths pinned", "laths clamped"]


@cache
def sensitivity(number: int) -> tuple[rs.PopUp, Sensitivity]:
    """A shell without symmetry, so that its modes are apart."""
    rod, joint, ends = SHELLS[number]
    layout = rs.GridLayout.orthogonal(rods=(6, 5), spacing=0.06, edge=0.02, rotate=0.3)
    popped = rs.find_form(rs.Ellipsoid(0.22, 0.17, 0.12), layout, rod, ends=(ends,), joint=joint).popped[ends]
    mesh = popped.shell.mesh
    of_rod = [rod.stretch_stiffness, *rod.bend_stiffnesses, rod.twist_stiffness]
    table = np.column_stack([np.tile(of_rod, (len(mesh.edges), 1)), mesh.edge_lengths])
    return popped, Sensitivity(popped.equilibrium, EdgeProperties.of(popped.shell, joint or rs.Ball(), table))


@cache
def parameters(number: int) -> tuple[list[str], Parameters]:
    """One for each property, at random on all edges, and one that moves all ends, or clamps, at random."""
    popped, here = sensitivity(number)
    random, edges = np.random.default_rng(number), here.edges.table.shape[0]
    names = [name for name in KINDS if name not in ("EI2", "GJ") or number >= 2]
    columns = np.zeros((edges, PROPERTIES, len(names) + 1))
    for k, name in enumerate(names):
        columns[:, KINDS[name], k] = SIZE[name] * random.standard_normal(edges)
    moved, shell = np.zeros((len(names) + 1, *popped.state.shape)), popped.shell
    held = shell.ghosts if len(shell.ghosts) else shell.ends
    moved[-1, held] = SIZE["ends"] * random.standard_normal((len(held), 3))
    return [*names, "ends"], Parameters(csc_array(columns.reshape(-1, len(names) + 1)), moved)


def mass_of_nodes(popped: rs.PopUp) -> np.ndarray:
    """Without rotary inertia: a twist angle is counted from frames that move with the state."""
    mass = popped.shell.mass.copy()
    mass[popped.shell.first_angle :] = 0.0
    return mass


def solved(number: int, k: int, step: float) -> Equilibrium:
    """The equilibrium with one parameter changed by a step, from the first-order guess."""
    popped, here = sensitivity(number)
    changed, response = parameters(number)[1], here.response(parameters(number)[1])
    column = changed.by_properties[:, [k]].toarray().reshape(-1, PROPERTIES)
    varied = here.edges.varied(here.edges.table * np.exp(step * column))
    problem = replace(popped.equilibrium.problem, elements=varied.shell.elements, stretch=varied.shell.stretch)
    state = popped.state + step * response.motions[k]
    found = find_equilibrium(problem, state, popped.forces + step * response.forces[k])
    assert found.report.converged
    return found


def slopes(number: int, k: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of node positions, axial forces and the three lowest modes, by central differences."""
    popped = sensitivity(number)[0]
    nodes, mass = popped.shell.first_angle, mass_of_nodes(popped)

    def difference(step: float) -> list[np.ndarray]:
        both = [solved(number, k, sign * step) for sign in (1.0, -1.0)]
        values = [(e.state[:nodes], e.forces, e.tangent.lowest_modes(3, mass=mass).values) for e in both]
        return [(ahead - behind) / (2 * step) for ahead, behind in zip(*values, strict=True)]

    return tuple((4 * fine - coarse) / 3 for fine, coarse in zip(difference(STEP / 2), difference(STEP), strict=True))  # type: ignore[return-value]


CASES = [
    pytest.param(n, k, id=f"{NAMES[n]} {name}")
    for n in range(4)
    for k, name in enumerate(["EA", "EI1", *(["EI2", "GJ"] if n >= 2 else []), "length", "ends"])
]


@pytest.mark.parametrize(("number", "k"), CASES)
def test_derivatives_are_those_of_solving_again(number: int, k: int) -> None:
    popped, here = sensitivity(number)
    changed = parameters(number)[1]
    response, mass = here.response(changed), mass_of_nodes(popped)
    positions, forces, values = slopes(number, k)
    nodes = popped.shell.first_angle
    assert np.abs(response.motions[k, :nodes] - positions).max() < 1e-6 * np.abs(positions).max()
    assert np.abs(response.forces[k] - forces).max() < 1e-6 * np.abs(forces).max()
    modes = here.lowest_modes(3, mass=mass)
    found = here.mode_slopes(modes, changed)[:, k]
    # eigenvalues are known to 1e-12, and so their differences over 8e-3 to 1e-9 of them
    assert np.abs(found - values).max() < 1e-6 * np.abs(values).max() + 1e-8 * modes.values.max()


@pytest.mark.parametrize("number", range(4), ids=NAMES)
def test_the_adjoint_gives_the_same_as_the_direct_derivatives_and_costs_one_solve(number: int) -> None:
    popped, here = sensitivity(number)
    changed = parameters(number)[1]
    goals = np.random.default_rng(9).standard_normal((2, *popped.state.shape))
    direct = np.einsum("knx,pnx->kp", goals, here.response(changed).motions)
    factors, solves = here.tangent.factors, list[int]()

    class Counted:
        negative = 0

        def solve(self, right: np.ndarray) -> np.ndarray:
            solves.extend([1] * len(np.atleast_2d(right)))
            return factors.solve(right)

    counted = Sensitivity(replace(popped.equilibrium), here.edges)
    counted.tangent = replace(here.tangent, factors=Counted())
    np.testing.assert_allclose(counted.by_adjoint(goals, changed), direct, atol=1e-11 * np.abs(direct).max())
    assert len(solves) == len(goals)


def test_unvaried_properties_are_those_of_the_shell_itself() -> None:
    for number in range(4):
        popped, here = sensitivity(number)
        again = here.edges.varied(here.edges.table).shell
        gradient, same = np.zeros_like(popped.state), np.zeros_like(popped.state)
        for element in popped.equilibrium.elements:
            element.evaluate(popped.state, gradient)
        for element in again.elements:
            element.evaluate(popped.state, same)
        np.testing.assert_allclose(same, gradient, atol=1e-13 * np.abs(gradient).max())
