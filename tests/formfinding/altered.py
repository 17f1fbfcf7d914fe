"""Pop-ups that are altered, for tests of what looks at them."""

from dataclasses import replace

import numpy as np

import rodshell as rs


def at_positions(popped: rs.PopUp, positions: np.ndarray) -> rs.PopUp:
    """With the nodes of its mesh at `positions` (n, 3), and everything else as it is."""
    like = popped.shell.like
    state, nodes = popped.state.copy(), np.flatnonzero(like < popped.shell.mesh.node_count)
    state[nodes] = positions[like[nodes]]
    return in_state(popped, state)


def in_state(popped: rs.PopUp, state: np.ndarray) -> rs.PopUp:
    """In another state (N, 3)."""
    return replace(popped, equilibrium=replace(popped.equilibrium, state=state))


def with_report(popped: rs.PopUp, **changes: object) -> rs.PopUp:
    """With another report of its solves."""
    report = replace(popped.report, **changes)  # type: ignore[arg-type]
    return replace(popped, equilibrium=replace(popped.equilibrium, report=report))
