"""Limits under loads: their derivatives against shells that are solved again, and what refinement makes of them."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.refining.load_limits import Deflection, LoadFactor
from rodshell.refining.objectives import Gap, Objective
from rodshell.refining.refine import refine
from rodshell.refining.structure import Point
from rodshell.refining.variables import Family
from rodshell.solve.equilibrium import Equilibrium
from rodshell.solve.load_path import load_path
from rodshell.solve.modes import linear_buckling
from tests.refining.test_families import EVERY, solved, start

STEP = 1e-3  # of the scale of the variables
ROUND, LATHS = 1e-5, 3e-3  # stress stiffness of laths is a difference of two Hessians: their factors are known to 1e-3


def snow(positions: np.ndarray) -> np.ndarray:
    """(n, 3) more on one side: without symmetry no two buckling factors are the same [N]."""
    result = np.zeros_like(positions)
    result[:, 2] = -1e-6 * (1.0 + 3.0 * positions[:, 0] + positions[:, 1])
    return result


def errors(family: Family, laths: bool) -> list[float]:
    """Relative errors of the slopes of a deflection and of a load factor along a random direction."""
    variables, here, direction = start(family, laths)
    load = snow(here.structure.popped.positions)
    goals: list[Objective] = [Deflection(load, most=1e-6), LoadFactor(load, least=1e6)]

    def squares(point: Point) -> np.ndarray:
        return np.array([goal.residuals(point) @ goal.residuals(point) for goal in goals])

    def difference(step: float) -> np.ndarray:
        ahead, behind = (squares(solved(variables, here, here.values + s * direction)) for s in (step, -step))
        return np.asarray((ahead - behind) / (2 * step))

    exact = (4 * difference(STEP) - difference(2 * STEP)) / 3
    found = np.array([2.0 * goal.residuals(here) @ goal.slopes(here) @ direction for goal in goals])
    return [float(error) for error in np.abs(found / exact - 1.0)]


@pytest.mark.parametrize(("name", "family"), EVERY, ids=[name for name, _ in EVERY])
def test_deflections_and_load_factors_change_as_their_derivatives_say(name: str, family: Family) -> None:
    assert max(errors(family, False)) < ROUND


@pytest.mark.slow
@pytest.mark.parametrize(("name", "family"), EVERY, ids=[name for name, _ in EVERY])
def test_of_laths_too(name: str, family: Family) -> None:
    deflection, factor = errors(family, True)
    assert deflection < ROUND
    assert factor < LATHS


def refined(goal: Objective) -> tuple[Equilibrium, float]:
    """The shell refined by one taper for a nearer target and one limit; and its gap over that before."""
    found = refine(stages(), "taper", objectives=[Gap(), goal])  # type: ignore[arg-type]
    return found.after.popped["pinned"].equilibrium, found.gap_after.rms / found.gap_before.rms


def stages() -> object:
    rod = rs.Rod(rs.Circle(radius=1e-3), rs.Material(youngs_modulus=1e6, density=1e3))
    layout = rs.GridLayout.orthogonal(rods=(9, 9), spacing=0.04, edge=0.02)
    return rs.find_form(rs.Paraboloid(0.2, 0.12), layout, rod, ends="pinned").stages


def test_a_refined_shell_keeps_its_limits_under_loads() -> None:
    """By linear buckling, and by the path of a hundredth of the load, of the grid that is built."""
    popped = stages().popped["pinned"]  # type: ignore[attr-defined]
    load = snow(popped.positions)
    before = float(linear_buckling(popped.equilibrium, load).factors[0])
    stiffer, gap = refined(LoadFactor(load, least=1.5 * before))
    assert float(linear_buckling(stiffer, load).factors[0]) > 1.4 * before
    assert gap < 0.25
    sunk = deflection(popped.equilibrium, load)
    stiffer, gap = refined(Deflection(load, most=0.7 * sunk))
    assert deflection(stiffer, load) < 0.75 * sunk
    assert gap < 0.25


def deflection(found: Equilibrium, load: np.ndarray) -> float:
    """Largest displacement per unit of the load [m]."""
    last = load_path(found, load, most=0.01, stations=()).last_stable
    assert last is not None
    return float(np.linalg.norm(last.equilibrium.state - found.state, axis=1).max() / last.factor)
