"""Bending check: curvature and stress along each rod, sigma = E y kappa + |N| / A.

The curvature is the one whose moment EI kappa is in equilibrium: kappa = 2 tan(phi/2) over the Voronoi length
[HQK Eq 1b]. A pinned end has none; a clamped end has that between its last edge and its clamp.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from rodshell.errors import InputError
from rodshell.geometry.vectors import cross, dot, unit
from rodshell.layout import GridMesh
from rodshell.model import Shell
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.section import Circle, Ellipse, GivenSection, RectangularSection, Rod, Tube

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Bending:
    """Curvature and stress at every node of every rod: arrays (k,) in the order of the mesh's `rod_nodes`.

    Parameters
    ----------
    curvature : [1/m].
    axial_strain : [-], mean of the edges on both sides.
    stress : of the outermost fibre, bending and axial [Pa]; None where the section's fibres are not known.
    """

    curvature: Floats
    axial_strain: Floats
    stress: Floats | None
    strain: Floats | None


def bending_of(shell: Shell, state: Floats, rod: Rod) -> Bending:
    """Bending of a shell of equal rods in a `state` (N, 3); laths are judged by how they bend about either axis."""
    clamps = unit(state[shell.ghosts] - state[shell.ends]) if len(shell.ghosts) else None
    return bending(
        shell.mesh, shell.positions(state), rod, clamps=clamps, components=curvature_components(shell, state)
    )


def bending(
    mesh: GridMesh, positions: Floats, rod: Rod, *, clamps: Floats | None = None, components: Floats | None = None
) -> Bending:
    """Bending of the rods of `mesh` with nodes at `positions` (n, 3) [m].

    Parameters
    ----------
    clamps : (2m, 3) outward unit tangents that hold both ends of each rod in turn, or None (pinned).
    components : (k, 2) curvatures towards m1 and m2 [1/m]; without, the stress of a section that is not round is an
        upper bound, as if it bent towards its farthest point.
    """
    curvature = curvatures(mesh, positions, clamps=clamps)
    axial = axial_strains(mesh, positions)
    fibre = fibre_distance(rod)
    if fibre is None or rod.material is None:
        return Bending(curvature, axial, None, None)
    bent = fibre * curvature if components is None else fibre_strain(rod, components[:, 0], components[:, 1])
    strain = bent + np.abs(axial)
    return Bending(curvature, axial, rod.material.youngs_modulus * strain, strain)


def curvature_components(shell: Shell, state: Floats) -> Floats | None:
    """(k, 2) curvatures towards m1 and m2 [1/m] at each entry of `rod_nodes`; None where rods bend alike all ways."""
    frames = next((one for one in shell.within if isinstance(one, BendTwist)), None)
    mesh = shell.mesh
    if frames is None or len(frames.blocks) != len(mesh.bends) + len(shell.ghosts):
        return None
    result = np.zeros((len(mesh.rod_nodes), 2))
    strains, inner = frames.strains(state)[:, :2], _inner(mesh)
    result[inner] = strains[: len(mesh.bends)] / mesh.voronoi_lengths[:, None]
    if len(shell.ghosts):
        s, first, last = mesh.stations, mesh.rod_start, mesh.rod_stop - 1
        half = 0.5 * np.column_stack([s[first + 1] - s[first], s[last] - s[last - 1]]).ravel()
        result[np.column_stack([first, last]).ravel()] = strains[len(mesh.bends) :] / half[:, None]
    return result


def curvatures(mesh: GridMesh, positions: Floats, *, clamps: Floats | None = None) -> Floats:
    """(k,) curvature [1/m] at each entry of `rod_nodes`."""
    result = np.zeros(len(mesh.rod_nodes))
    first, last = mesh.rod_start, mesh.rod_stop - 1
    before, here, after = (positions[mesh.bends[:, k]] for k in range(3))
    result[_inner(mesh)] = _turn(unit(here - before), unit(after - here)) / mesh.voronoi_lengths
    if clamps is not None:
        for side, (end, neighbour) in enumerate(((first, first + 1), (last, last - 1))):
            outward = unit(positions[mesh.rod_nodes[end]] - positions[mesh.rod_nodes[neighbour]])
            half = 0.5 * np.abs(mesh.stations[end] - mesh.stations[neighbour])
            result[end] = _turn(outward, clamps[side::2]) / half
    return result


def axial_strains(mesh: GridMesh, positions: Floats) -> Floats:
    """(k,) axial strain at each entry of `rod_nodes`: the mean over its edges, which at an end is one."""
    lengths = np.linalg.norm(positions[mesh.edges[:, 1]] - positions[mesh.edges[:, 0]], axis=1)
    strain = lengths / mesh.edge_lengths - 1.0
    begins = np.ones(len(mesh.rod_nodes), dtype=bool)
    begins[mesh.rod_stop - 1] = False  # entries that an edge begins at
    total, count = np.zeros(len(begins)), np.zeros(len(begins))
    for entries in (np.flatnonzero(begins), np.flatnonzero(begins) + 1):
        total[entries] += strain
        count[entries] += 1
    return total / count


def fibre_distance(rod: Rod) -> float | None:
    """Distance [m] of the outermost fibre from the axis about which a rod bends, whichever that is.

    Of a section that is not round this is its farthest point: the stress is then an upper bound. None for a
    given section, whose shape is not known.
    """
    section = rod.section
    if isinstance(section, GivenSection):
        return None
    if isinstance(section, Circle | Tube):
        return section.outer_radius
    if isinstance(section, Ellipse):
        return max(section.a, section.b)
    if isinstance(section, RectangularSection):
        return 0.5 * float(np.hypot(section.width, section.height))
    raise InputError(f"the fibres of a section of kind {type(section).__name__} are not known")


def fibre_strain(rod: Rod, kappa1: Floats, kappa2: Floats) -> Floats:
    """Largest bending strain over the section for curvatures towards m1 and m2 [1/m]: exact for each shape.

    Raises
    ------
    InputError : a given section has stiffnesses and no shape.
    """
    section = rod.section
    if isinstance(section, RectangularSection):  # at a corner
        return np.asarray(0.5 * (section.width * np.abs(kappa1) + section.height * np.abs(kappa2)))
    if isinstance(section, Ellipse):
        return np.hypot(section.a * kappa1, section.b * kappa2)
    fibre = fibre_distance(rod)
    if fibre is None:
        raise InputError("a given section has no fibres: its stress is not known; give a shape and a material")
    return np.asarray(fibre * np.hypot(kappa1, kappa2))


def _inner(mesh: GridMesh) -> NDArray[np.bool_]:
    """(k,) which entries of `rod_nodes` are not ends."""
    inner = np.ones(len(mesh.rod_nodes), dtype=bool)
    inner[mesh.rod_start] = inner[mesh.rod_stop - 1] = False
    return inner


def _turn(before: Floats, after: Floats) -> Floats:
    """(b,) integrated curvature 2 tan(phi/2) between unit tangents; exact also for small angles."""
    binormal = cross(before, after)
    return np.asarray(2.0 * np.sqrt(dot(binormal, binormal)) / (1.0 + dot(before, after)))
