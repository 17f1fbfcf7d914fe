"""A combination as forces that a refinement takes, and shells that are refined under it."""

from functools import cache

import numpy as np
import pytest

import rodshell as rs
from rodshell.loads.fixed import fixed_forces

LOADS = rs.Loads(
    loads={"own": rs.SelfWeight(cladding=0.2), "snow": rs.Snow(10.0, "half"), "warm": rs.Temperature(30.0, 1e-5)},
    combinations={"winter": {"own": 1.35, "snow": 1.5}, "own": {"own": 1.0}, "summer": {"own": 1.0, "warm": 1.0}},
)
CASE = {
    "target": {"kind": "paraboloid", "radius": 8.0, "height": 4.0}, "layout": {"spacing": 1.6, "edge": 0.8},
    "rod": {
        "section": {"kind": "tube", "radius": 0.02, "thickness": 0.003},
        "material": {"youngs_modulus": 25e9, "density": 1750.0},
    },
    "pop_up": {"ends": "pinned"},
    "loads": [
        {"name": "own", "kind": "self_weight", "cladding": 0.2},
        {"name": "snow", "kind": "snow", "value": 10.0, "distribution": "half"},
        {"name": "warm", "kind": "temperature", "change": 30.0, "expansion": 1e-5},
    ],
    "combinations": [
        {"name": "winter", "factors": {"own": 1.35, "snow": 1.5}},
        {"name": "summer", "factors": {"own": 1.0, "warm": 1.0}},
    ],
}  # fmt: skip


@cache
def form() -> rs.Form:
    return rs.Job.load(CASE).run(until="pop-up")


def test_forces_and_weight_are_the_loads_that_are_checked() -> None:
    weight, forces = fixed_forces(form().stages, "pinned", LOADS, "winter")
    assert weight == 1.35
    checked = rs.check_loads(form(), LOADS).shells["winter"]["pinned"]
    mass = form().popped["pinned"].shell.mass[: len(forces), 2].sum()
    np.testing.assert_allclose(forces.sum(axis=0) - (0.0, 0.0, 1.35 * 9.81 * mass), checked.load_sum, rtol=1e-12)


def test_a_shell_refined_under_a_combination_is_on_its_target_when_that_is_checked() -> None:
    """The check follows the path of the loads from the unloaded shell, which the refinement does not."""
    found, unloaded = (rs.refine(form(), "taper", ends="pinned", under=under) for under in ("winter", "nothing"))
    assert found.refined is not None
    assert found.refined.changed
    after = found.refined.gap_after.rms_relative
    assert after < 0.1 * found.refined.gap_before.rms_relative
    assert gap_under(found) == pytest.approx(after, rel=0.1)  # without the middles of edges
    assert gap_under(unloaded) > 1.3 * after


def gap_under(found: rs.Form) -> float:
    """Relative rms gap of the nodes under "winter", as it is checked."""
    shell = rs.check_loads(found, LOADS).shells["winter"]["pinned"]
    target = found.stages.target
    return float(np.sqrt(np.mean(target.gap(shell.positions).distance ** 2)) / target.size)


def test_what_is_not_a_force_is_refused() -> None:
    with pytest.raises(rs.InputError, match='its load "warm" is not a force'):
        rs.refine(form(), "taper", under="summer")
    with pytest.raises(
        rs.InputError, match='"spring": not a combination of loads: give one of nothing, weight, winter'
    ):
        rs.refine(form(), "taper", under="spring")
    job = rs.Job.of_case(form().case).changed(
        {
            "bracing": {
                "kind": "cables",
                "section": {"kind": "circle", "radius": 0.003},
                "material": {"youngs_modulus": 160e9},
            }
        }
    )
    with pytest.raises(rs.InputError, match="refined without its bracing"):
        job.changed({"refine.vary": "taper", "refine.under": "winter"}).run(until="pop-up")
