"""Pop up: the rod ends go from the footprint to the boundary, and the free grid finds its shape.

No target, no load and no contact: only rods, joints and the ends. Pinned ends hold positions; clamped ends
hold the direction of the draped rods as well. The end condition decides the shape (numerics.md, section 4a).
"""

from dataclasses import dataclass, replace
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from gridshell.errors import InputError
from gridshell.formfinding.progress import Progress, silent
from gridshell.formfinding.trim import Boundary, Footprint
from gridshell.geometry.vectors import dot, unit
from gridshell.model import Shell
from gridshell.rods.section import Rod
from gridshell.solve.constraint import Supports
from gridshell.solve.mixed_newton import Equilibrium, Problem, find_stable
from gridshell.solve.path import follow
from gridshell.solve.report import SolveReport

Floats = NDArray[np.float64]
Ends = Literal["pinned", "clamped"]
Start = Literal["draped", "flat"]

FIRST_RISE = 0.05  # share of the way that the ends go in the step that leaves the plane
CLAMP_STEP = 0.25
RELEASE_STEP = 0.1


@dataclass(frozen=True)
class Popped:
    """The popped-up shell: `positions` (n, 3) [m] of the footprint's nodes, how it was reached, and figures."""

    ends: Ends
    start: Start
    footprint: Footprint
    positions: Floats
    report: SolveReport


def pop_up(
    footprint: Footprint,
    boundary: Boundary,
    rod: Rod,
    *,
    ends: Ends = "clamped",
    start: Start = "draped",
    progress: Progress = silent,
) -> Popped:
    """Move the rod ends of `footprint` to `boundary` and find the equilibrium of the free grid.

    Parameters
    ----------
    ends : "pinned" holds the ends' positions, "clamped" their directions too (a rod may spin in its clamp).
    start : "draped" releases the boundary's draped state; "flat" follows the ends on straight paths from the
        flat grid, which leaves its plane to the side that the boundary's directions point away from (without
        directions to that of +z), then turns the clamps.

    Raises
    ------
    InputError : `start` is "draped" and the boundary has no draped state.
    """
    span = 0.5 * float(np.ptp(boundary.points, axis=0).max())
    if start == "draped":
        if boundary.draped is None:
            raise InputError('this boundary has no draped state to start from: use start="flat"')
        found = _release(footprint, boundary, rod, ends, span, progress)
    else:
        found = _rise(footprint, boundary, rod, span, progress)
        if ends == "clamped" and found.report.converged:
            found = _turn_clamps(footprint, boundary, rod, found, span, progress)
    return Popped(ends, start, footprint, found.state[: footprint.mesh.node_count], found.report)


def _problem(shell: Shell, length: float, goals: Floats | None = None) -> Problem:
    """Ends (and ghosts) held, or on their way to `goals`."""
    free = shell.held_ends()
    moved = np.append(shell.ends, shell.ghosts)
    supports = Supports(free) if goals is None else Supports(free, moved, goals)
    return Problem(shell.elements, shell.stretch, supports, length, places=shell.places)


def _release(
    footprint: Footprint, boundary: Boundary, rod: Rod, ends: Ends, length: float, progress: Progress
) -> Equilibrium:
    """Let go of the draped state: the target's forces vanish, the ends stay. At once, or slowly if that fails."""
    assert boundary.draped is not None
    shell = Shell.of(footprint.mesh, rod, clamped=ends == "clamped")
    state, forces = shell.state(boundary.draped, boundary.tangents), np.zeros(len(footprint.mesh.edges))
    at_once = find_stable(
        _problem(shell, length),
        state,
        forces,
        progress=lambda k, step: progress("pop-up", f"{ends}, iteration {k}", step),
    )
    if at_once.report.converged:
        return at_once
    holding = np.zeros_like(state)
    for element in (*shell.elements, shell.stretch):
        element.evaluate(state, holding)
    slowly = follow(
        lambda t: replace(_problem(shell, length), load=(1 - t) * holding),
        state,
        forces,
        first_step=RELEASE_STEP,
        progress=lambda t, k, step: progress("pop-up", f"{ends}, {100 * t:.0f} % released, iteration {k}", step),
    )
    return replace(slowly, report=slowly.report.after(at_once.report))


def _rise(footprint: Footprint, boundary: Boundary, rod: Rod, length: float, progress: Progress) -> Equilibrium:
    """Pinned, from the flat grid: the ends go straight to the boundary while the grid rises."""
    mesh = footprint.mesh
    shell = Shell.of(mesh, rod)
    flat = _aligned(mesh.flat, mesh.flat[shell.ends], boundary.points)
    first = flat[shell.ends]

    return follow(
        lambda t: _problem(shell, length, (1 - t) * first + t * boundary.points),
        shell.state(_arched(footprint, flat, first, boundary)),
        np.zeros(len(mesh.edges)),
        first_step=FIRST_RISE,
        progress=lambda t, k, step: progress("pop-up", f"from flat, {100 * t:.0f} %, iteration {k}", step),
    )


def _aligned(flat: Floats, ends: Floats, points: Floats) -> Floats:
    """The flat grid (n, 3) turned and moved in its plane, and lifted, to lie best over the boundary."""
    centre, there = ends.mean(axis=0), points.mean(axis=0)
    a, b = (ends - centre)[:, :2], (points - there)[:, :2]
    angle = np.arctan2(np.sum(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]), np.sum(a * b))
    turn = np.array([[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]])
    result = np.empty_like(flat)
    result[:, :2] = (flat - centre)[:, :2] @ turn.T + there[:2]
    result[:, 2] = there[2]
    return result


def _arched(footprint: Footprint, flat: Floats, first: Floats, boundary: Boundary) -> Floats:
    """The flat grid raised to arches of about the rods' lengths over their ends at the first step.

    A flat grid under compression is in equilibrium, only not a stable one: the arch chooses the side. A rod
    whose ends are to rise outwards sags; without directions all rods rise.
    """
    mesh = footprint.mesh
    ends = (1 - FIRST_RISE) * first + FIRST_RISE * boundary.points
    side = np.where(boundary.tangents[::2, 2] + boundary.tangents[1::2, 2] > 0, -1.0, 1.0)
    raised, weight = np.zeros_like(flat), np.zeros(len(flat))
    for k, rod in enumerate(mesh.grid.rods):
        nodes, s = mesh.nodes_of(k), mesh.stations[mesh.rod_slice(k)]
        share = ((s - s[0]) / rod.length)[:, None]
        chord = (1 - share) * ends[2 * k] + share * ends[2 * k + 1]
        short = max(rod.length**2 - float(np.sum((ends[2 * k + 1] - ends[2 * k]) ** 2)), 0.0)
        height = side[k] * 2 / np.pi * np.sqrt(short)  # a sine arch of this height has about the rod's length
        chord[:, 2] += height * np.sin(np.pi * share[:, 0])
        raised[nodes] += chord
        weight[nodes] += 1
    return raised / weight[:, None]


def _turn_clamps(
    footprint: Footprint, boundary: Boundary, rod: Rod, pinned: Equilibrium, length: float, progress: Progress
) -> Equilibrium:
    """From the pinned state, turn the end directions to those of the boundary."""
    shell = Shell.of(footprint.mesh, rod, clamped=True)
    positions = pinned.state[: footprint.mesh.node_count]
    inner = shell.elements[0].blocks[-len(shell.ghosts) :, 0]
    now = unit(positions[shell.ends] - positions[inner])
    angle = np.arccos(np.clip(dot(now, boundary.tangents), -1, 1))[:, None]
    sine = np.maximum(np.sin(angle), 1e-12)

    def goals(t: float) -> Floats:
        turned = np.where(
            angle > 1e-9, (np.sin((1 - t) * angle) * now + np.sin(t * angle) * boundary.tangents) / sine, now
        )
        return np.vstack([boundary.points, shell.state(positions, unit(turned))[shell.ghosts]])

    found = follow(
        lambda t: _problem(shell, length, goals(t)),
        shell.state(positions, now),
        pinned.forces,
        first_step=CLAMP_STEP,
        progress=lambda t, k, step: progress("pop-up", f"turning clamps, {100 * t:.0f} %, iteration {k}", step),
    )
    return replace(found, report=found.report.after(pinned.report))
