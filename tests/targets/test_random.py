"""A sample of the random targets of `make accept-targets`, and that its judge is not blind."""

import numpy as np
import pytest

import rodshell as rs
from tests.acceptance.targets_random import ROD, outcome, random_case, unbalanced
from tests.formfinding.altered import at_positions


@pytest.mark.slow
@pytest.mark.parametrize("seed", [1, 6, 11, 15, 20])
def test_a_random_target_converges_truly_or_says_why_not(seed):
    result = outcome(seed)
    assert not result.wrong, result
    assert result.said


def test_the_judge_sees_a_state_that_is_no_equilibrium():
    _, target, layout, anchor = random_case(6)
    form = rs.find_form(target, layout, ROD, anchor=anchor, ends=("pinned",))
    shell, boundary = form.popped["pinned"], form.trimmed.boundary
    assert unbalanced(shell, boundary) < 1e-4
    moved = shell.positions.copy()
    inner = np.setdiff1d(np.arange(len(moved)), shell.footprint.mesh.ends)
    moved[inner[len(inner) // 2], 2] += 1e-5
    assert unbalanced(at_positions(shell, moved), boundary) > 1e-4
