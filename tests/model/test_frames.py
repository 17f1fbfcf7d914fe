"""Source frames of a shell: twist angles mean something only together with them."""

import numpy as np
import pytest

import rodshell as rs
from rodshell.model import Shell


@pytest.mark.parametrize("joint", [{"joint.kind": "pin"}, {"joint.kind": "pin", "joint.eccentricity": "2 mm"}])
def test_a_shell_with_the_frames_of_another_is_in_equilibrium_in_its_state(joint: dict[str, str]) -> None:
    case = {"layout.spacing": "60 mm", "checks.stages": 0, "pop_up.ends": "pinned"}
    stages = rs.Job.load("hemisphere", case | joint).run(until="pop-up").stages
    popped = stages.popped["pinned"]
    made = Shell.of(popped.shell.mesh, stages.rod, clamped=False, joint=stages.joint)

    def out_of_balance(shell: Shell) -> float:
        """Largest difference of its gradient from that of the shell that was popped up, over the largest of this."""
        theirs, ours = np.zeros_like(popped.state), np.zeros_like(popped.state)
        for gradient, elements in ((theirs, popped.shell.elements), (ours, shell.elements)):
            for element in elements:
                element.evaluate(popped.state, gradient)
        return float(np.abs(ours - theirs).max() / np.abs(theirs).max())

    assert out_of_balance(made) > 1e-3
    assert out_of_balance(made.with_frames_of(popped.shell.elements)) < 1e-12
