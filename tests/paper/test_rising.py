"""The pop-up in time against the static one, with each coupling."""

from functools import cache

import numpy as np
import pytest

import rodshell as rs
from rodshell.errors import InputError
from rodshell.formfinding.rising import Rise, Risen, pop_up_in_time
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs
from tests.paper.falls import HEMISPHERE, PAPER_ROD, RADIUS

COUPLINGS: dict[str, Coupling] = {"shared": SharedDofs(), "implicit": ImplicitPenalty(), "explicit": ExplicitPenalty()}


@cache
def form() -> rs.Form:
    layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.05, edge=0.025, length=0.9)
    return rs.find_form(HEMISPHERE, layout, PAPER_ROD, ends=("pinned",))


@cache
def risen(name: str) -> Risen:
    found = form()
    rise = Rise(coupling=COUPLINGS[name])
    return pop_up_in_time(found.footprint, found.trimmed.boundary, PAPER_ROD, rise=rise)


@pytest.mark.slow
@pytest.mark.parametrize("name", list(COUPLINGS))
def test_in_time_and_by_statics_the_shell_pops_up_alike(name: str) -> None:
    result = risen(name)
    assert result.rest.at_rest
    apart = np.linalg.norm(result.positions - form().popped["pinned"].positions, axis=1).max()
    # explicit springs part by the force over their stiffness, and the rods between them move by as much
    assert apart < 1e-3 * RADIUS + 2 * result.rest.joint_gap
    if name != "explicit":
        assert result.rest.joint_gap < 1e-6


def test_a_rise_that_is_cut_short_is_not_at_rest() -> None:
    found = form()
    rise = Rise(moving=0.2, duration=0.25)
    result = pop_up_in_time(found.footprint, found.trimmed.boundary, PAPER_ROD, rise=rise)
    assert not result.rest.at_rest
    # the ends are where they belong all the same
    ends = found.footprint.mesh.ends.ravel()
    np.testing.assert_allclose(result.positions[ends], found.trimmed.boundary.points, atol=1e-9)


def test_a_rise_refuses_what_is_not_positive() -> None:
    with pytest.raises(InputError, match="the rise's moving must be positive, not 0"):
        Rise(moving=0.0)
