"""PopUp-up shells, unloaded and under their weight, against `LoadedTwin`, which shares none of our mechanics."""

from functools import cache

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks.reactions import reactions
from rodshell.checks.self_weight import self_weight
from rodshell.loads.check import tributary_of
from rodshell.solve.load_path import CLOSE
from tests.checks.loaded_twin import LoadedTwin
from tests.checks.shells import ROD, dome

BALANCED = 1e-6  # of the largest reaction: 6e-9 measured
COARSE = 4e-3  # of the factor: how finely the twin looks for the end of the stable path
ENDS = ("pinned", "clamped")

STIFFER = rs.Rod(ROD.section, rs.Material(50e6, 1e3))
STEEL = rs.Rod(rs.Circle(radius=1e-3), rs.Material(210e9, 7850, 0.3))
TUBE = rs.Rod(rs.Tube(radius=0.0417 / 2, thickness=0.0035), rs.Material(25e9, 1900, 0.3))
LARCH = rs.Rod(rs.RectangularSection(width=0.035, height=0.05), rs.Material(12e9, 590, shear=0.7e9))


def grid(spacing: float, edge: float, **more) -> rs.GridLayout:
    return rs.GridLayout.orthogonal(spacing=spacing, edge=edge, **more)


@cache
def shell(name: str) -> rs.Form:
    """Domes and roofs of few nodes; the "oval" has no symmetry."""
    if name == "dome":
        return dome()
    if name == "steel":
        return rs.find_form(rs.Hemisphere(0.2), grid(0.06, 0.02), STEEL)
    if name == "tubes":
        return rs.find_form(rs.Cap(radius=10.0, base=4.0), grid(3.0, 1.5), TUBE)
    if name == "laths":
        return rs.find_form(rs.Paraboloid(radius=8.0, height=4.0), grid(3.0, 1.5), LARCH)
    return rs.find_form(
        rs.Ellipsoid(a=0.2, b=0.15, c=0.12), grid(0.05, 0.025, rotate=0.4, offset=(0.01, 0.02)), STIFFER
    )


SHELLS = ("dome", "steel", "tubes", "laths", "oval")


@cache
def twin(name: str, ends: str) -> LoadedTwin:
    form = shell(name)
    return LoadedTwin(form.popped[ends], form.rod)


@pytest.mark.slow
@pytest.mark.parametrize("ends", ENDS)
@pytest.mark.parametrize("name", SHELLS)
def test_equilibrium_inertia_and_reactions_agree(name, ends):
    popped, other = shell(name).popped[ends], twin(name, ends)
    held = reactions(popped.shell, popped.equilibrium)
    largest = np.abs(held.forces).max()
    forces, moments = other.reactions(other.state)
    residual = other.residual(other.state)[: len(other.free) - len(other.angles)]
    assert np.abs(residual).max() < BALANCED * largest
    assert np.abs(forces - held.forces).max() < BALANCED * largest
    assert np.abs(moments - held.moments).max() <= BALANCED * max(np.abs(held.moments).max(), 1e-30)
    assert other.factored(other.state)[1] == popped.report.negative_modes


@pytest.mark.slow
@pytest.mark.parametrize("name", SHELLS)
def test_the_share_of_its_own_weight_that_a_shell_bears_agrees(name):
    popped = shell(name).popped["pinned"]
    found, _ = self_weight(popped.shell, popped.equilibrium, most=2e3)
    other = twin(name, "pinned")
    factor, at_one = other.load_factor(COARSE)
    assert (1 - COARSE) * factor < found.load_factor / (1 - CLOSE)  # never less than stable,
    assert found.load_factor < (1 + 2 * COARSE) * factor  # nor more than the truth
    if factor < 1:
        assert found.deflection is None
    else:
        moved = (at_one - other.state)[: 3 * other.nodes].reshape(-1, 3)
        assert found.deflection == pytest.approx(np.linalg.norm(moved, axis=1).max(), rel=1e-6)


@pytest.mark.parametrize(("name", "ends"), [("tubes", "pinned"), ("laths", "clamped")])
def test_snow_on_top_of_the_weight_is_all_that_the_shell_carries(name, ends):
    """By the twin, under weight and snow that grow together: it reaches the same loads on another way."""
    form = shell(name)
    plan = tributary_of(form.stages).plan
    snow = rs.check({ends: form.popped[ends]}, form.rod, stages=0, plan=plan).snow[ends]
    other = LoadedTwin(form.popped[ends], form.rod)
    other.load = other.load.copy()
    other.load[2 : 3 * other.nodes : 3] -= snow * plan
    factor, _ = other.load_factor(COARSE)
    assert (1 - COARSE) * factor < 1 / (1 - CLOSE)
    assert (1 + 2 * COARSE) * factor > 1


def test_a_shell_that_falls_under_its_weight_carries_no_snow_and_without_a_target_none_is_known():
    form = shell("dome")
    checks = rs.check(form.popped, form.rod, stages=0, plan=tributary_of(form.stages).plan)
    assert checks.snow == {"pinned": 0.0, "clamped": 0.0}
    assert all(weight.load_factor < 1 for weight in checks.self_weight.values())
    assert rs.check(form.popped, form.rod, stages=0).snow == {}


def test_more_snow_than_is_looked_for_is_none():
    stiff = rs.find_form(rs.Hemisphere(0.2), grid(0.06, 0.02), STEEL, ends="clamped")
    assert stiff.archive().results.plain()["snow"] == {"clamped": None}
