"""Shells after years of creep, against shells whose rods are that soft, which no code of creep has seen."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import rodshell as rs
from tests.loads.shells import ROPE, TUBE, grid, one, shell

CREEP = 0.8
STABILITY = rs.Stability(modes=1)
CLADDING = rs.SelfWeight(cladding=0.1)
CABLES = rs.Cables(rod=ROPE, prestrain=2e-3)
CLOSE = 3e-3  # of a factor: both are found as near as 2e-3 below the loss
KNOWN = rs.Strength(permanent=1e9, creep=CREEP)


def soft(scale: float = 1.0 + CREEP) -> rs.Rod:
    material = TUBE.material
    assert material is not None
    return rs.Rod(TUBE.section, replace(material, youngs_modulus=material.youngs_modulus / scale))


def soft_shell() -> rs.Form:
    return rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), soft(), ends="pinned")


def with_settlement() -> rs.Loads:
    """A support that goes down by 5 mm, which creep does not multiply."""
    down = rs.Settlement(("U01.1",), (0.0, 0.0, -0.005))
    return rs.Loads(
        loads={"it": CLADDING, "down": down}, combinations={"all": {"it": 1.0, "down": 1.0}}, stability=STABILITY,
        strength=KNOWN,
    )  # fmt: skip


STEEL_ARCH = rs.Arch(at="y > 6 m", rod=rs.Rod(rs.Tube(0.04, 0.004), rs.Material.preset("steel")))


@pytest.mark.slow
def test_supports_that_yield_do_not_creep() -> None:
    """Springs, clamps, beams, and an energy of one's own: the shell of softer rods on them is the crept one."""
    ends = (rs.SprungEnds(stiffness=20e3),), (rs.ClampedEnds(at="y < 0 m", turning=1e3),), (STEEL_ARCH,)
    for support in (*(rs.SupportGroups(groups=groups) for groups in ends), Posts("posts")):
        form, other = (
            rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), rod, ends=support) for rod in (TUBE, soft())
        )  # fmt: skip
        loads = one(CLADDING, stability=rs.Stability(imperfection=0, modes=1), strength=KNOWN)
        loads = replace(loads, combinations={"all": {"it": 0.5}})
        found = rs.check_loads(form, loads).shells["all"][support.name]
        twin = rs.check_loads(other, loads).shells["all"][support.name]
        assert found.after_years is not None
        assert found.after_years.limit_factor == pytest.approx(twin.limit_factor, rel=CLOSE)
        before = rs.check_loads(form, replace(loads, combinations={"all": {"it": 1e-9}})).shells["all"][support.name]
        moved = np.linalg.norm(twin.positions - before.positions, axis=1).max()
        assert found.after_years.max_deflection == pytest.approx(moved, rel=1e-4)


def test_a_beam_that_creeps_as_the_rods_do_leaves_the_path_as_it_is() -> None:
    """Its factors are those as erected, over 1 + creep; one of an unknown material is not followed."""
    loads = one(CLADDING, stability=rs.Stability(imperfection=0, modes=1), strength=KNOWN)
    for arch in (replace(STEEL_ARCH, creep=CREEP), replace(STEEL_ARCH, rod=TUBE)):
        form = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=rs.SupportGroups(groups=(arch,)))
        found = rs.check_loads(form, loads).shells["all"]["given"]
        if arch.creep is None:
            assert found.after_years is None
        else:
            assert found.limit_factor is not None
            assert found.after_years is not None
            assert found.after_years.limit_factor == pytest.approx(found.limit_factor / (1 + CREEP), rel=1e-6)


def test_nothing_is_known_after_years_on_a_support_whose_energy_cannot_be_scaled() -> None:
    form = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=Unscaled("unscaled"))
    loads = one(CLADDING, stability=rs.Stability(imperfection=0, modes=1), strength=KNOWN)
    assert rs.check_loads(form, loads).shells["all"]["unscaled"].after_years is None


class Plain:
    """An energy of one's own that says no more than it has to."""

    def __init__(self, energy: rs.LocalEnergy) -> None:
        self.blocks, self.evaluate = energy.blocks, energy.evaluate

    def refreshed(self, state: np.ndarray) -> "Plain":
        return self


@dataclass(frozen=True)
class Posts(rs.Support):
    def free(self, points: np.ndarray) -> dict[int, np.ndarray]:
        return dict.fromkeys(range(len(points)), np.eye(3))

    def energies(self, ends: np.ndarray, points: np.ndarray) -> list[rs.LocalEnergy]:
        return [rs.LocalEnergy(ends[:, None], lambda x: 1e4 * ((x[:, 0] - points) ** 2).sum(axis=1))]


class Unscaled(Posts):
    def energies(self, ends: np.ndarray, points: np.ndarray) -> list[Plain]:
        return [Plain(energy) for energy in super().energies(ends, points)]


@pytest.mark.parametrize(
    "loads",
    [
        one(CLADDING, stability=STABILITY, strength=KNOWN),
        pytest.param(one(CLADDING, stability=STABILITY, strength=KNOWN, bracing=CABLES), marks=pytest.mark.slow),
        pytest.param(with_settlement(), marks=pytest.mark.slow),
    ],
    ids=["bare", "cables", "settlement"],
)
def test_a_crept_shell_is_one_of_softer_rods(loads: rs.Loads) -> None:
    """Its cables as stiff as before, its deflection counted from the unloaded shell as erected."""
    form, other = shell("tubes"), soft_shell()
    years = rs.check_loads(form, loads).shells["all"]["pinned"].after_years
    alone = replace(loads, strength=rs.Strength(permanent=1e9))
    twin = rs.check_loads(other, alone).shells["all"]["pinned"]
    assert years is not None
    assert twin.after_years is None  # creep is not known
    assert years.creep == CREEP
    assert years.limit_factor == pytest.approx(twin.limit_factor, rel=CLOSE)
    assert years.limit_kind == twin.limit_kind
    assert years.imperfect_factor == pytest.approx(twin.imperfect_factor, rel=CLOSE)
    assert years.imperfect_kind == twin.imperfect_kind
    assert twin.at_factor == 1.0
    before = rs.check_loads(form, replace(loads, combinations={"all": {"it": 1e-9}})).shells["all"]["pinned"].positions
    moved = twin.positions - before
    assert years.max_deflection == pytest.approx(np.linalg.norm(moved, axis=1).max(), rel=1e-5)


def test_cables_do_not_creep() -> None:
    """Braced, a shell falls after years at more, or less, than its factor as erected divided by 1 + creep."""
    bare = one(CLADDING, stability=STABILITY, strength=KNOWN)
    for loads, divided in ((bare, True), (replace(bare, bracing=CABLES), False)):
        found = rs.check_loads(shell("tubes"), loads).shells["all"]["pinned"]
        assert found.after_years is not None
        assert found.limit_factor is not None
        share = (1.0 + CREEP) * found.after_years.limit_factor / found.limit_factor
        assert abs(share - 1.0) < 1e-12 if divided else abs(share - 1.0) > CLOSE


def test_small_deflections_grow_by_creep() -> None:
    loads = rs.Loads(
        loads={"it": CLADDING},
        combinations={"all": {"it": 1e-4}},
        stability=rs.Stability(imperfection=0),
        strength=KNOWN,
    )
    found = rs.check_loads(shell("tubes"), loads).shells["all"]["pinned"]
    assert found.after_years is not None
    assert found.imperfect_kind is None
    assert found.after_years.max_deflection == pytest.approx((1.0 + CREEP) * found.max_deflection, rel=5e-3)


@pytest.mark.parametrize(
    ("load", "bracing", "strength", "known"),
    [
        (CLADDING, None, KNOWN, True),
        (rs.Snow(100.0), None, KNOWN, False),
        (CLADDING, None, rs.Strength(permanent=1e9), False),
        (CLADDING, rs.Laths(), KNOWN, True),
        (CLADDING, rs.Laths(rod=soft()), KNOWN, False),
    ],
    ids=["permanent", "snow", "creep not known", "laths", "laths that creep otherwise"],
)
def test_years_count_for_permanent_loads_where_creep_is_known(
    load: object, bracing: rs.Laths | None, strength: rs.Strength, known: bool
) -> None:
    stability = rs.Stability(imperfection=0, modes=1)
    loads = one(load, stability=stability, strength=strength, bracing=bracing)
    found = rs.check_loads(shell("tubes"), loads).shells["all"]["pinned"]
    assert (found.after_years is not None) == known
