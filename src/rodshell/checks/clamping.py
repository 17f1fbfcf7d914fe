"""From the pinned shape to the clamped one: on site the ends are turned into their clamps after the deployment."""

import numpy as np

from rodshell.checks.deployment import SAME
from rodshell.formfinding import Popped
from rodshell.formfinding.popup import end_directions, turned
from rodshell.model.shell import last_edges
from rodshell.solve.constraint import Supports
from rodshell.solve.mixed_newton import find_equilibrium
from rodshell.solve.path import trace
from rodshell.solve.problem import Problem

SHORTEST = 0.02  # share of the angles: a snap is located to this
MOST = 400  # factorisations; the paths that arrive take 3 to 33


def reached_by_turning(pinned: Popped, clamped: Popped) -> bool | None:
    """Whether the pinned shell comes to the clamped shape when its ends, held in place, are turned into their clamps.

    Parameters
    ----------
    pinned, clamped : stable shells of one footprint and boundary.

    Returns
    -------
    None where that could not be followed. Snaps on the way are gone through.
    """
    shell, mesh = clamped.shell, clamped.footprint.mesh
    now, outward = end_directions(mesh, pinned.positions), clamped.boundary.tangents
    start = clamped.state.copy()
    start[: shell.node_count] = pinned.state[: shell.node_count]
    places, reach = start[shell.ends], last_edges(mesh)[:, None]
    start[shell.ghosts] = places + reach * now
    elements = tuple(one.refreshed(start) for one in shell.elements)
    length = 0.5 * float(np.ptp(pinned.positions, axis=0).max())

    def problem_at(t: float) -> Problem:
        goals = np.vstack([places, places + reach * turned(now, outward, t)])
        supports = Supports(shell.held_ends(), np.append(shell.ends, shell.ghosts), goals)
        return Problem(elements, shell.stretch, supports, length, places=shell.flat_coordinates)

    first = find_equilibrium(problem_at(0.0), start, pinned.forces)
    if not first.report.stable:
        return None
    way = trace(problem_at, first, 0.0, 1.0, shortest=SHORTEST, snap=True, most_factorizations=MOST)
    if way.t < 1.0:
        return None
    apart = np.linalg.norm(shell.positions(way.found.state) - clamped.positions, axis=1).max()
    return bool(apart <= SAME * length)
