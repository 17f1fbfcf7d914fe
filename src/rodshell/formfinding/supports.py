"""Shells with energies of one's own, on supports that let their rods' ends slide."""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeGuard

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.formfinding.finite_sections import node_normals
from rodshell.model import Shell
from rodshell.model.edge_beam import FittedBeam
from rodshell.model.shell import Direction
from rodshell.rods.elements import Elements
from rodshell.rods.supports import BeamAlong, Support
from rodshell.solve.equilibrium import MOST_ITERATIONS, Equilibrium, find_stable
from rodshell.solve.problem import Supports
from rodshell.units import shown
from rodshell.validation import described, direction, listed, mapping, number, some, whole

_ENERGY = "an energy, such as rodshell.LocalEnergy, or a list of them"
_Counting = Callable[[str, int], Callable[[int, float], None]]


def let_go(
    shell: Shell, held: Equilibrium, support: Support, points: Floats, counting: _Counting
) -> tuple[Shell, Equilibrium]:
    """A shell on its support.

    Args:
        held: the equilibrium with the rods' ends held at `points` (2m, 3).
        counting: makes a progress of what is done, and of how many iterations it takes at most.
    """
    support = support.named(shell.mesh.grid.support_names)
    turning = support.turning(points)
    slides = slides_of(support, support.free(points), turning)
    springs = energies_of(support.energies(shell.ends, points), shell.node_count)
    beams = support.beams(points)
    clamped = support.holds_directions and not np.isinf(turning).all()
    if not (slides or springs or beams or clamped):
        return shell, held
    there = replace(shell, slides=slides, springs=springs)
    if clamped:
        there = there.with_turning(turning)
    if beams:
        there, held = _fitted(there, held, beams)
    shell, found = at_rest(there, held, counting(f"{support}, let go, iteration", MOST_ITERATIONS))
    return shell, replace(found, report=found.report.after(held.report))


def _fitted(shell: Shell, held: Equilibrium, beams: Sequence[BeamAlong]) -> tuple[Shell, Equilibrium]:
    """A shell with beams along its edge, free of stress in its equilibrium `held`.

    Raises:
        InputError: rods lie in layers, so that their ends do not lie along one curve; two of them are in one place.
    """
    if shell.mesh.layered:
        raise InputError("a beam along the edge joins rods in one layer: set joint.eccentricity to 0, or leave it out")
    normals = node_normals(shell.mesh, shell.positions(held.state))[shell.mesh.ends.ravel()]
    done, first = list[FittedBeam](), len(held.state)
    for along in beams:
        nodes = shell.ends[along.ends]
        if not np.isin(shell.ends[along.twins], nodes).all():
            raise InputError(f"two rod ends of the beam {along.name} are in one place: shift the grid a little")
        done.append(FittedBeam.fitted(along, nodes=nodes, state=held.state, normals=normals[along.ends], first=first))
        first += len(done[-1].angles)
    there = shell.with_beams(done)
    state, gradient = (np.vstack([each, np.zeros((first - len(each), 3))]) for each in (held.state, held.gradient))
    problem = replace(held.problem, flat_coordinates=there.flat_coordinates, pattern=None)
    return there, replace(held, problem=problem, state=state, gradient=gradient)


def at_rest(shell: Shell, near: Equilibrium, progress: Callable[[int, float], None]) -> tuple[Shell, Equilibrium]:
    """A shell in equilibrium with all its energies, its ends being free to slide where they can.

    Args:
        near: the equilibrium of the same shell with other energies, or with its ends held.
    """
    problem = replace(near.problem, elements=shell.elements, constraint=Supports(shell.held_ends()))
    found = find_stable(problem, near.state, near.forces, limit_steps=True, progress=progress)
    return shell.with_elements(found.elements), found


def energies_of(given: object, nodes: int) -> tuple[Elements, ...]:
    """One or several energies of a shell with so many nodes.

    Raises:
        InputError: one is not an energy, or acts on a node that the shell has not.
    """
    added = (given,) if _is_energy(given) else tuple(listed("energies", given, _ENERGY))
    for energy in added:
        if not _is_energy(energy):
            raise InputError(f"energies must be {_ENERGY}, not {described(energy)}")
        if (energy.blocks >= nodes).any():
            raise InputError(f"an energy acts on node {energy.blocks.max()}: the shell has {nodes}, from 0")
    return added


def _is_energy(given: object) -> TypeGuard[Elements]:
    return all(hasattr(given, name) for name in ("blocks", "evaluate", "refreshed"))


def figures_of(support: Support, moved: Floats, forces: Floats) -> dict[str, tuple[float, str]]:
    """What a support says of itself, see `Support.figures`.

    Raises:
        InputError: it is not value and unit by text.
    """
    wanted = f"the figures of {support} must be a mapping such as {{'largest moment of a post': (2.5, 'N m')}}"
    found = dict[str, tuple[float, str]]()
    for name, each in mapping(f"figures of {support}", support.figures(moved, forces), wanted).items():
        if not (isinstance(name, str) and isinstance(each, tuple) and len(each) == 2 and isinstance(each[1], str)):
            raise InputError(f"{wanted}, not {{{described(name)}: {described(each)}}}")
        found[name] = (number(f"the figure {shown(name)} of {support}", each[0]), each[1])
    return found


def slides_of(support: Support, free: object, turning: Floats) -> dict[int, tuple[Direction, ...]]:
    """Directions along which some rod ends may move, by the number of the end.

    Args:
        turning: (2m,) as of `Support.turning`.

    Raises:
        InputError: there is no such end; its directions are not at right angles; the support holds directions.
    """
    slides = dict[int, tuple[Direction, ...]]()
    for end, directions in mapping("free", free, "directions by the number of the rod end").items():
        whole("a rod end in free", end, 0, len(turning) - 1)
        if turning[end]:
            raise InputError(f"a {support} rod end cannot be set free: pop the shell up with pinned ends")
        name = f"a direction of rod end {end}"
        given = np.array([direction(name, each) for each in some(f"free of rod end {end}", directions, "directions")])
        across: Floats = given @ given.T - np.eye(len(given))
        if len(given) > 3 or np.abs(across).max(initial=0.0) > 1e-9:
            raise InputError(f"the directions along which rod end {end} may move are not at right angles to each other")
        slides[end] = tuple((x, y, z) for x, y, z in given.tolist())
    return slides
