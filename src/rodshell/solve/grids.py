"""Grids that lie side by side are one shell, whose stiffness has a block for each: the equilibrium of all from those of
each alone, and of each from that of all. Nothing is solved here."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.model import Shell
from rodshell.rods.elements import Elements, with_frames
from rodshell.solve.equilibrium import Equilibrium, SolveReport
from rodshell.solve.problem import Problem


def together(
    shell: Shell, problem: Problem, parts: Sequence[tuple[Shell, Equilibrium]], *earlier: SolveReport
) -> Equilibrium:
    """The state of all grids, whose shell and problem these are, each in its own equilibrium.

    Args:
        parts: of each grid its own shell and equilibrium.
        earlier: of solves of all that were given up before; their work is added.
    """
    of_edges, found = _of_edges(shell), [part for _, part in parts]
    joined, state = side_by_side(shell, [(grid.with_elements(part.elements), part.state) for grid, part in parts])
    gradient, mode, forces = np.zeros_like(state), np.zeros_like(state), np.zeros(len(of_edges))
    for k, part in enumerate(found):
        here = shell.grid_of == k
        gradient[here], forces[of_edges == k] = part.gradient, part.forces
        if part.mode is not None:
            mode[here] = part.mode
    whole = replace(problem, elements=joined.elements)
    report = _together([part.report for part in found]).after(*earlier)
    return Equilibrium(whole, state, forces, gradient, report, mode if mode.any() else None)


def side_by_side(shell: Shell, parts: Sequence[tuple[Shell, Floats]]) -> tuple[Shell, Floats]:
    """The shell of all grids, with the source frames and in the states of each.

    Args:
        parts: of each grid its shell and its state, whose twist angles belong to that shell's source frames.
    """
    state, elements = np.zeros((len(shell.grid_of), 3)), list(shell.elements)
    for k, (grid, there) in enumerate(parts):
        state[shell.grid_of == k] = there
        for row, element in zip(_sets_of(shell, k), grid.elements, strict=True):
            elements[row] = with_frames(elements[row], element, at=_rows_of(elements[row], shell, k))
    return shell.with_elements(tuple(elements)), state


def alone(whole: Shell, found: Equilibrium, k: int, shell: Shell, points: Floats) -> tuple[Shell, Equilibrium]:
    """The shell of the k-th grid, in the equilibrium that was found for the whole.

    Args:
        shell: of this grid, in its flat state.
        points: (2m, 3) the ends of its rods [m].
    """
    here, sets = whole.grid_of == k, found.elements
    elements = tuple(
        with_frames(element, sets[row], _rows_of(sets[row], whole, k))
        for element, row in zip(shell.elements, _sets_of(whole, k), strict=True)
    )
    shell, state, gradient = shell.with_elements(elements), found.state[here], found.gradient[here]
    problem = Problem.of_shell(shell, points)
    residual = problem.constraint.freedom(state).reduce(gradient)
    report = replace(
        found.report,
        dofs=len(residual),
        force_residual=float(np.abs(residual).max(initial=0.0)),
        max_strain=float(np.abs(problem.stretch.strains(state)).max()),
    )
    mode = None if found.mode is None else found.mode[here]
    forces = found.forces[_of_edges(whole) == k]
    return shell, Equilibrium(problem, state, forces, gradient, report, mode)


def _of_edges(shell: Shell) -> Ints:
    return shell.mesh.grid_of_rods[shell.mesh.edge_rods]


def _rows_of(element: Elements, shell: Shell, k: int) -> Bools:
    """(m,) which elements are those of a grid."""
    return np.asarray(shell.grid_of[element.blocks[:, 0]] == k)


def _sets_of(shell: Shell, k: int) -> list[int]:
    """Which sets of energies a grid has elements of: those are the sets of its own shell, in the same order."""
    return [row for row, element in enumerate(shell.elements) if _rows_of(element, shell, k).any()]


def _together(reports: Sequence[SolveReport]) -> SolveReport:
    """Of solves that have nothing to do with each other."""
    worst = next((report for report in reports if not report.converged), reports[0])
    total = replace(
        worst,
        dofs=sum(report.dofs for report in reports),
        force_residual=max(report.force_residual for report in reports),
        max_strain=max(report.max_strain for report in reports),
        negative_modes=sum(report.negative_modes for report in reports),
    )
    return total.after(*(report for report in reports if report is not worst))
