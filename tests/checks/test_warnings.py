"""What the checks warn of: rods that would break, and rods too thick for the theory; circles, whose strain is r / R."""

from dataclasses import replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks import Checks
from rodshell.checks.bending import Bending, bending
from rodshell.checks.check import staged
from rodshell.checks.deployment import Deployment
from rodshell.fabrication.fabricate import fabricate
from rodshell.fabrication.settings import Fabrication
from rodshell.figures.form import PopUp, Rod
from rodshell.loads.strength import Limits
from rodshell.results import Results
from rodshell.results.from_checks import checked_results
from rodshell.results.verdict import verdict
from tests.checks.test_bending import on_circle, rods_of_length

E = 1e9
THICKNESS = 2e-3  # radius of the rod [m]
ROD = rs.Rod(rs.Circle(radius=THICKNESS), rs.Material(youngs_modulus=E, density=1e3))
MESH = rods_of_length(0.3, edge=0.002)
MADE = fabricate(MESH, ROD, Fabrication())
STRENGTH = E * THICKNESS / 0.1  # used up by a circle of 0.1 m


def bent(radius: float) -> Bending:
    positions, clamps = on_circle(MESH, radius)
    return bending(MESH, positions, ROD, clamps=clamps)


def checks(final: dict[str, float], way: list[float]) -> Checks:
    """Of shells whose rods lie on circles: in their final shapes, and at equal stages of the deployment."""
    share = np.linspace(0, 1, len(way))
    stages = tuple(map(bent, way))
    deployment = staged(Deployment(share=share, positions=np.zeros((len(way), MESH.node_count, 3))), stages)
    shells = {ends: bent(radius) for ends, radius in final.items()}
    return Checks(shells, {}, {}, deployment if way else None, stages, {})  # type: ignore[arg-type]


def reasons(found: Checks, strength: float | None = STRENGTH) -> list[str]:
    """What the verdict finds in stress and strain."""
    rods = tuple(Rod(id=rod.name, family=rod.family, start=rod.start, end=rod.end) for rod in MESH.grid.rods)
    shells = {ends: PopUp(status="converged", stable=True) for ends in found.bending}
    found_words = verdict(
        checked_results(Results(rods=rods, pop_up=shells), MESH, found, MADE, limits=Limits(counted=strength))
    ).reasons
    return [words for words in found_words if (" thick" if strength is None else "break") in words]


def test_rods_break_by_their_thickness_over_the_radius() -> None:
    """A quarter of the radius that they bear: four times the strength."""
    words = reasons(checks({"pinned": 0.05, "clamped": 0.025}, [1.0, 0.05, 0.04, 1.0, 0.05]))
    assert [one.split(" in ")[0] for one in words] == [
        "with pinned ends the rods would break: 200 % of their strength",
        "with clamped ends the rods would break: 400 % of their strength",
        "at 50 % of the deployment the rods would break: 250 % of their strength",
    ]


@pytest.mark.parametrize(("final", "way", "says"), [
    ({"pinned": 0.2}, [1.0, 0.04, 0.2], "at 50 % of the deployment the rods would break: 250 % of their"),
    ({"pinned": 0.05}, [1.0, 0.2, 0.05], "with pinned ends the rods would break: 200 % of their strength"),
    ({"pinned": 0.0999}, [], "with pinned ends the rods would break: 101 % of their strength"),  # never 100 %
])  # fmt: skip
def test_the_shape_that_breaks_is_named(final: dict[str, float], way: list[float], says: str) -> None:
    (words,) = reasons(checks(final, way))
    assert words.startswith(says)


@pytest.mark.parametrize("at", [0, 40, -1])
def test_the_place_that_breaks_is_named(at: int) -> None:
    held = checks({"pinned": 0.2}, [1.0, 0.2, 0.2])
    assert held.deployment_bending[1].stress is not None
    stress = held.deployment_bending[1].stress.copy()
    stress[at] = 2 * STRENGTH
    way = (held.deployment_bending[0], replace(held.deployment_bending[1], stress=stress), held.deployment_bending[2])
    (words,) = reasons(replace(held, deployment_bending=way))
    entry = range(len(stress))[at]
    rod = next(k for k in range(len(MESH.grid.rods)) if entry < MESH.rod_stop[k])
    along = 1e3 * (MESH.stations[entry] - MESH.grid.rods[rod].start)
    assert words.startswith("at 50 % of the deployment ")
    assert f" in {MESH.grid.rods[rod].name}, {along:.0f}" in words


def test_rods_that_hold_are_not_warned_of() -> None:
    assert reasons(checks({"pinned": 0.101}, [1.0, 0.101, 0.101])) == []
    assert reasons(checks({"pinned": 0.06}, []), None) == []


@pytest.mark.parametrize(("radius", "percent"), [(1.01 * THICKNESS / 0.05, None), (THICKNESS / 0.08, 8)])
@pytest.mark.parametrize("deployment_bending", [False, True])
def test_rods_too_thick_for_their_bends_are_warned_of(
    radius: float, percent: int | None, deployment_bending: bool
) -> None:
    found = checks(
        {"pinned": 10.0 if deployment_bending else radius}, [10.0, radius, 10.0] if deployment_bending else []
    )
    shape = "at 50 % of the deployment" if deployment_bending else "with pinned ends"
    assert [words.split(":")[0] for words in reasons(found, None)] == (
        [] if percent is None else [f"{shape} bending strains the rods by {percent} %"]
    )


def test_a_stretched_rod_is_not_a_thick_one() -> None:
    shell = bent(10.0)
    assert shell.strain is not None
    axial = np.full_like(shell.axial_strain, -0.2)
    drawn = replace(shell, axial_strain=axial, strain=shell.strain + 0.2)
    assert reasons(Checks({"pinned": drawn}, {}, {}, None, (), {}), None) == []
