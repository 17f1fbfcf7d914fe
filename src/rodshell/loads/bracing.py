"""Bracing of an erected shell: cables along the diagonals of its cells, stressed when they are put in."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rodshell.arrays import Ints
from rodshell.errors import InputError
from rodshell.layout import GridMesh
from rodshell.layout.cells import Pattern, diagonals, rim_diagonals
from rodshell.loads.settings import Bracing, Cables
from rodshell.loads.structure import Structure
from rodshell.rods.cable import CableStretch
from rodshell.rods.elements import Elements
from rodshell.solve.equilibrium import Equilibrium, find_equilibrium
from rodshell.targets import Target
from rodshell.units import percent_text

_SHARES = (0.25, 0.5, 0.75)  # of a diagonal, where it is looked whether the shell is under it
STEPS = 8  # in which a prestress is applied that is too much for one


def stressed(cables: Cables, structure: Structure, target: Target) -> Structure:
    """The structure with its cables stressed, in the equilibrium that it then finds.

    Raises:
        InputError: a cable crosses an opening of the target; the shell does not withstand the prestress.
    """
    mesh, before = structure.mesh, structure.equilibrium
    pairs = braced_diagonals(cables, structure, target)
    blocks = np.append(outer_nodes(mesh), structure.shell.ends)[pairs]
    lengths = np.linalg.norm(before.state[blocks[:, 1]] - before.state[blocks[:, 0]], axis=1)
    stiffness = np.full(len(blocks), cables.rod.stretch_stiffness)
    rods = len(structure.shell.elements)
    found = in_steps(
        before,
        lambda elements, share: (
            *elements[:rods], CableStretch(blocks, lengths / (1.0 + cables.prestrain * share), stiffness)
        ),
    )  # fmt: skip
    if found is None:
        raise InputError(
            f"the bracing pulls the shell out of its shape: with a prestrain of {percent_text(cables.prestrain)} no "
            "stable equilibrium was found; stress it less (bracing.prestrain), or use thinner cables"
        )
    mass = np.zeros(structure.shell.node_count)
    for side in range(2):
        np.add.at(mass, blocks[:, side], 0.5 * lengths * cables.rod.mass_per_length)
    shell = structure.shell_at(found)
    ropes = found.elements[-1]
    assert isinstance(ropes, CableStretch)
    return replace(structure, shell=shell, equilibrium=found, braced=pairs, bracing_mass=mass, cables=ropes)


def in_steps(
    before: Equilibrium, change: Callable[[tuple[Elements, ...], float], tuple[Elements, ...]]
) -> Equilibrium | None:
    """The equilibrium of a structure whose energies change, at once or in steps; None: none that is stable was found.

    Args:
        before: with the energies as they were.
        change: of the energies, at their frames, to those at a share, up to 1, of the change.
    """
    for count in (1, STEPS):
        found = before
        for step in range(1, count + 1):
            elements = change(found.elements, step / count)
            problem = replace(before.problem, elements=elements, pattern=found.problem.pattern)
            found = find_equilibrium(problem, found.state, found.forces)
            if not found.report.stable:
                break
        else:
            return found
    return None


def braced_diagonals(bracing: Bracing, structure: Structure, target: Target) -> Ints:
    """(d, 2) crossings that diagonals join; the rod ends, start and end of each in turn, are counted on from them.

    Raises:
        InputError: a diagonal crosses an opening of the target, and that is refused; there is no cell.
    """
    mesh, positions, pattern = structure.mesh, structure.positions(structure.equilibrium), Pattern.of(bracing.pattern)
    pairs = diagonals(mesh.grid, pattern)
    if not len(pairs):
        raise InputError("the grid has no cell of four joints that could be braced: set its rods closer")
    if isinstance(bracing, Cables) and bracing.ends_at == "supports":
        rim = rim_diagonals(mesh.grid, pattern)
        pairs = np.vstack([pairs, rim + [0, len(mesh.joint_pairs)]])
    ends = np.vstack([positions[mesh.joint_pairs].mean(axis=1), positions[mesh.ends.ravel()]])[pairs]
    points = np.concatenate([(1 - share) * ends[:, 0] + share * ends[:, 1] for share in _SHARES])
    outside = (target.margin(target.retract(points)) < 0).reshape(len(_SHARES), -1).any(axis=0)
    if outside.any() and bracing.across_openings == "refuse":
        x, y, _ = ends[np.argmax(outside)].mean(axis=0)
        raise InputError(
            f"{int(outside.sum())} of {len(pairs)} diagonals of the bracing cross an opening of the shell, the first "
            f'near ({x:.4g}, {y:.4g}) m: set bracing.across_openings to "leave out", or move the opening or the rods'
        )
    return np.asarray(pairs[~outside])


def outer_nodes(mesh: GridMesh) -> Ints:
    """(c,) node of each crossing on the outer of its two rods; of rods that share it, the node of both."""
    pairs = mesh.joint_pairs
    return np.asarray(pairs[np.arange(len(pairs)), mesh.heights[pairs].argmax(axis=1)])
