"""The pop-up in time against the static one, with each coupling."""

from functools import cache
from typing import Any

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.formfinding.dynamic_pop_up import DynamicPopUp, DynamicPopUpSettings, dynamic_pop_up
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs
from tests.formfinding.falls import HEMISPHERE, PAPER_ROD, RADIUS

COUPLINGS: dict[str, Coupling] = {"shared": SharedDofs(), "implicit": ImplicitPenalty(), "explicit": ExplicitPenalty()}


@cache
def form() -> rs.Form:
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.05, edge=0.025, length=0.9)
    return rs.find_form(HEMISPHERE, layout, PAPER_ROD, ends=("pinned",))


@cache
def popped_up(name: str) -> DynamicPopUp:
    found = form()
    settings = DynamicPopUpSettings(coupling=COUPLINGS[name])
    return dynamic_pop_up(found.footprint, found.trimmed.boundary, PAPER_ROD, settings=settings)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(COUPLINGS))
def test_in_time_and_by_statics_the_shell_pops_up_alike(name: str) -> None:
    result = popped_up(name)
    assert result.rest.at_rest
    apart = np.linalg.norm(result.positions - form().popped["pinned"].positions, axis=1).max()
    # explicit springs part by the force over their stiffness, and the rods between them move by as much
    assert apart < 1e-3 * RADIUS + 2 * result.rest.joint_gap
    if name != "explicit":
        assert result.rest.joint_gap < 1e-6


def test_a_pop_up_that_is_cut_short_is_not_at_rest() -> None:
    found = form()
    settings = DynamicPopUpSettings(moving_time=0.2, duration=0.25)
    result = dynamic_pop_up(found.footprint, found.trimmed.boundary, PAPER_ROD, settings=settings)
    assert not result.rest.at_rest
    # the ends are where they belong all the same
    ends = found.footprint.mesh.ends.ravel()
    np.testing.assert_allclose(result.positions[ends], found.trimmed.boundary.points, atol=1e-9)


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"moving_time": 0.0}, "the pop-up's moving_time must be positive, not 0.0 s"),
        ({"time_step": "1 ms"}, 'the pop-up\'s time_step must be a number in s, not "1 ms"'),
        ({"drags": 3.0}, "the pop-up's drags must be two numbers in 1/s, not 3.0"),
        ({"drags": (3.0, -1.0)}, "the pop-up's drag must be 0 or more, not -1.0 1/s"),
        ({"coupling": "shared"}, r"the pop-up's coupling must be rodshell.SharedDofs\(\), .*, not \"shared\""),
    ],
)
def test_settings_of_the_wrong_kind_or_sign_are_refused(given: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        DynamicPopUpSettings(**given)
