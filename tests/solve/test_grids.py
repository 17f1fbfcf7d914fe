"""Grids side by side: one shell, whose equilibrium is that of each grid alone."""

from functools import cache
from typing import Any, Literal

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks.deployment import deploy_grids
from rodshell.formfinding.popup import laid_below
from rodshell.formfinding.trim import Boundary, Footprint
from rodshell.layout.mesh import side_by_side
from rodshell.layout.profile import Profile
from rodshell.solve.equilibrium import find_equilibrium

MATERIAL = rs.Material(youngs_modulus=1e9, density=1e3)
RIGID = rs.Rigid(eccentricity=2e-3)
ROD = rs.Rod(rs.Circle(radius=1e-3), MATERIAL)
LATH = rs.Rod(rs.RectangularSection(width=1.5e-3, height=1e-3), MATERIAL)
KINDS = {"round rods": (ROD, rs.Ball()), "laths": (LATH, rs.Pin()), "layers": (ROD, RIGID)}


@cache
def caps(kind: str) -> tuple[rs.Form, ...]:
    """Two caps of different height, heading and edge."""
    rod, joint = KINDS[kind]
    return tuple(
        rs.find_form(
            rs.Ellipsoid(a=0.2, b=0.16, c=height),
            rs.GridLayout.orthogonal(spacing=0.05, edge=edge, rotate=turn),
            rod,
            joint=joint,
            ends="pinned",
        )
        for height, turn, edge in ((0.1, 0.0, 0.0125), (0.14, 0.3, 0.01))
    )


def together(kind: str, **options: Any) -> rs.PopUp:
    rod, joint = KINDS[kind]
    parts = caps(kind)
    meshes = {name: form.footprint.mesh for name, form in zip("AB", parts, strict=True)}
    mesh = side_by_side(meshes, 0.1)
    boundary = Boundary.of_grids([form.boundary for form in parts])
    return rs.pop_up(Footprint(mesh), boundary, rod, ends="pinned", joint=joint, **options)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("start", ["draped", "flat"])
def test_all_grids_pop_up_as_each_does_alone(kind: str, start: Literal["draped", "flat"]) -> None:
    (rod, joint), found = KINDS[kind], together(kind, start=start)
    apart = [
        rs.pop_up(form.footprint, form.boundary, rod, ends="pinned", joint=joint, start=start).positions
        for form in caps(kind)
    ]
    assert found.report.stable
    np.testing.assert_allclose(found.positions, np.concatenate(apart), rtol=0, atol=1e-9 * np.ptp(apart[0]))


@pytest.mark.parametrize("kind", KINDS)
def test_each_grid_alone_is_in_equilibrium_where_all_are(kind: str) -> None:
    found = together(kind)
    assert sum(grid.report.dofs for grid in found.alone) == found.report.dofs
    assert max(grid.report.force_residual for grid in found.alone) == pytest.approx(found.report.force_residual)
    strains = [grid.report.max_strain for grid in found.alone]
    assert strains[0] != strains[1]
    assert max(strains) == pytest.approx(found.report.max_strain, rel=1e-6)
    energy = 0.0
    for grid in found.alone:
        again = find_equilibrium(grid.equilibrium.problem, grid.state, grid.forces)
        assert again.report.stable
        assert again.report.iterations <= 2
        np.testing.assert_allclose(again.state, grid.state, rtol=0, atol=1e-9)
        energy += grid.equilibrium.energy
    assert energy == pytest.approx(found.equilibrium.energy, rel=1e-12)


@pytest.mark.parametrize("kind", KINDS)
def test_grids_that_popped_up_alone_are_in_equilibrium_together(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A first solve of all that is given up at its start: no grid has fewer negative modes than none."""
    monkeypatch.setattr("rodshell.formfinding.popup._Stages.most_modes", property(lambda self: _modes(self)))
    found = together(kind)
    assert found.report.stable
    assert found.report.dofs == sum(grid.report.dofs for grid in found.alone)
    again = find_equilibrium(found.equilibrium.problem, found.state, found.forces)
    assert again.report.stable
    assert again.report.iterations <= 2
    np.testing.assert_allclose(again.state, found.state, rtol=0, atol=1e-9)
    assert again.gradient == pytest.approx(found.equilibrium.gradient, abs=1e-9 * np.abs(found.forces).max())


def test_each_flat_grid_is_laid_below_its_ends() -> None:
    found, height = together("round rods"), -0.01
    laid = laid_below(found.footprint.mesh, found.boundary.points, height)
    parts = [laid_below(form.footprint.mesh, form.boundary.points, height) for form in caps("round rods")]
    np.testing.assert_allclose(laid, np.concatenate(parts), rtol=0, atol=1e-12)


def test_grids_that_an_energy_ties_are_no_longer_in_equilibrium_alone() -> None:
    found = together("round rods")
    tops = [int(np.argmax(form.popped["pinned"].positions[:, 2])) for form in caps("round rods")]
    tie = np.array([[tops[0], found.alone[0].footprint.mesh.node_count + tops[1]]])
    tied = rs.settle(found, rs.LocalEnergy(tie, lambda x: 0.5 * ((x[:, 1] - x[:, 0]) ** 2).sum(axis=1)))
    assert tied.report.stable
    assert np.abs(tied.positions - found.positions).max() > 1e-4
    assert tied.alone == ()
    way = deploy_grids(tied, stages=1)
    np.testing.assert_allclose(way.positions[-1], tied.positions, rtol=0, atol=1e-9)


def test_a_grid_of_other_sections_may_need_frames_that_the_others_share() -> None:
    """Square rods bend without frames, and spin freely; where those of one grid are broad, all have them."""
    square = rs.Rod(rs.RectangularSection(width=2e-3, height=2e-3), MATERIAL)
    first, second = caps("round rods")
    broad = Profile(stations=(0.0, 0.5, 1.0), factors=(1.0, 1.3, 1.0), varies="width")
    meshes = {"A": first.footprint.mesh.with_profiles(broad), "B": second.footprint.mesh}
    boundary = Boundary.of_grids([first.boundary, second.boundary])
    found = rs.pop_up(Footprint(side_by_side(meshes, 0.1)), boundary, square, ends="pinned")
    assert found.report.stable
    for grid, mesh, form in zip(found.alone, meshes.values(), (first, second), strict=True):
        alone = rs.pop_up(Footprint(mesh), form.boundary, square, ends="pinned")
        np.testing.assert_allclose(grid.positions, alone.positions, rtol=0, atol=1e-10)
        again = find_equilibrium(grid.equilibrium.problem, grid.state, grid.forces)
        assert again.report.iterations <= 2
        np.testing.assert_allclose(again.state, grid.state, rtol=0, atol=1e-9)


def _modes(stages: object) -> int | None:
    return -1 if len(stages.footprint.mesh.grids) > 1 else None  # type: ignore[attr-defined]
