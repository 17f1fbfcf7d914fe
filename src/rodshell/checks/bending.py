"""Bending check: how each rod is bent and twisted along its length, and the stress of it all.

The curvature is the one whose moment EI kappa is in equilibrium: kappa = 2 tan(phi/2) over the Voronoi length
[HQK Eq 1b]. A pinned end has none; a clamped end has that between its last edge and its clamp. Its two parts are the
normal curvature, out of the shell, and the geodesic curvature, within it. Of rods with unlike stiffnesses, laths, they
are taken by the section's own axes m1 and m2, which are the shell's normal and a line within it where joints hold the
rods upright; of others by the shell's normal, that of the rods that cross there.
"""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.formfinding.layers import node_normals
from rodshell.geometry.frames import cross, dot, unit
from rodshell.layout import GridMesh
from rodshell.model import Shell
from rodshell.model.shell import last_edges
from rodshell.rods.bend_twist import BendTwist
from rodshell.rods.section import Circle, Rod, Tube
from rodshell.rods.section_stress import (
    VON_MISES,
    fibre_distance,
    fibre_modulus,
    fibre_strain,
    largest_stress,
    stress_is_known,
    torsion_stress,
)


@dataclass(frozen=True)
class Bending:
    """Bending, twist and stress at every node of every rod: arrays (k,) in the order of the mesh's `rod_nodes`.

    Parameters
    ----------
    curvature : [1/m].
    axial_strain : [-], mean of the edges on both sides.
    stress : the largest over the section of bending, stretch and torsion together [Pa], see
        `rods.section_stress`; None where the section's fibres are not known.
    strain : of the outermost fibre, bending and axial; None as the stress.
    normal_curvature, geodesic_curvature : parts of the curvature out of the shell and within it [1/m]; None where
        no rods cross.
    twist_rate : twist per length [rad/m]; zero where nothing twists the rods.
    torsion_stress : largest shear stress of torsion over the section [Pa]; None as the stress.
    """

    curvature: Floats
    axial_strain: Floats
    stress: Floats | None
    strain: Floats | None
    normal_curvature: Floats | None
    geodesic_curvature: Floats | None
    twist_rate: Floats
    torsion_stress: Floats | None

    @property
    def bending_strain(self) -> Floats | None:
        """(k,) of the outermost fibre, without the axial strain."""
        return None if self.strain is None else np.asarray(self.strain - np.abs(self.axial_strain))


def bending_of(shell: Shell, state: Floats, rod: Rod, *, shear_weight: float = VON_MISES) -> Bending:
    """Bending of a shell of equal rods in a `state` (N, 3); laths are judged by how they bend about either axis."""
    mesh, positions = shell.mesh, shell.positions(state)
    normals = shell_normals(mesh, positions)
    if shell.node_count != mesh.node_count:  # rods a distance apart at their joints: each has its own line
        mesh, positions = mesh.apart, state[: shell.node_count]
    clamps = unit(state[shell.ghosts] - state[shell.ends]) if len(shell.ghosts) else None
    components, twist = None, None
    if frames := rod_frames(shell):
        strains = _on_entries(shell, frames.strains(state))
        twist = strains[:, 2]
        if len(set(rod.bend_stiffnesses)) > 1:
            components = strains[:, :2]
        elif not isinstance(rod.section, Circle | Tube):
            directors = _mean_of_edges(mesh, edge_directors(shell, frames, state))
            components = np.column_stack(_parts(*_turns(mesh, positions, clamps), directors))
    return bending(
        mesh, positions, rod,
        clamps=clamps, components=components, twist_rate=twist, normals=normals, shear_weight=shear_weight,
    )  # fmt: skip


def bending(
    mesh: GridMesh, positions: Floats, rod: Rod, *, clamps: Floats | None = None, components: Floats | None = None,
    twist_rate: Floats | None = None, normals: Floats | None = None, shear_weight: float = VON_MISES,
) -> Bending:  # fmt: skip
    """Bending of the rods of `mesh` with nodes at `positions` (n, 3) [m].

    Parameters
    ----------
    clamps : (2m, 3) outward unit tangents that hold both ends of each rod in turn, or None (pinned).
    components : (k, 2) curvatures towards m1 and m2 [1/m]; without, the stress of a section that is not round is an
        upper bound, as if it bent towards its farthest point.
    twist_rate : (k,) twist per length [rad/m]; without, none.
    normals : (k, 3) of the shell at each entry of `rod_nodes`, by which the curvature is parted without `components`.
    shear_weight : of the shear stress against the normal stress, see `rods.section_stress`.
    """
    turns, tangents = _turns(mesh, positions, clamps)
    curvature, axial = np.linalg.norm(turns, axis=1), axial_strains(mesh, positions)
    twist = np.zeros(len(curvature)) if twist_rate is None else twist_rate
    stress = strain = sheared = normal = geodesic = None
    if components is not None:
        normal, geodesic = components.T
    elif normals is not None:
        normal, geodesic = _parts(turns, tangents, normals)
    fibre, known = fibre_distance(rod), stress_is_known(rod, twisted=bool(twist.any()))
    if fibre is not None:
        bent = fibre * curvature if components is None else fibre_strain(rod, components[:, 0], components[:, 1])
        strain = bent + np.abs(axial)
    if known and strain is not None:
        sheared = torsion_stress(rod, twist) if twist.any() else np.zeros(len(twist))
        if components is None:
            stress = np.hypot(fibre_modulus(rod) * strain, shear_weight * sheared)
        else:
            stress = largest_stress(rod, components[:, 0], components[:, 1], axial, twist, weight=shear_weight)
    return Bending(curvature, axial, stress, strain, normal, geodesic, twist, sheared)


def rod_frames(shell: Shell) -> BendTwist | None:
    """The elements that carry the rods' material frames; None where no twist angles are carried."""
    return next((element for element in shell.within if isinstance(element, BendTwist)), None)


def edge_directors(shell: Shell, frames: BendTwist, state: Floats) -> Floats:
    """(e, 3) first material director m1 of each edge in a `state` (N, 3)."""
    m1 = frames.refreshed(state).material_directors(state)
    result = np.zeros((len(shell.mesh.edges) + len(shell.ghosts), 3))  # of ghost edges, too
    for side in range(2):
        result[frames.blocks[:, 1 + 2 * side] - shell.first_angle] = m1[:, side]
    return result[: len(shell.mesh.edges)]


def shell_normals(mesh: GridMesh, positions: Floats) -> Floats | None:
    """(k, 3) normal of the shell at each entry of `rod_nodes`; None where some rod crosses no other."""
    if (mesh.grid.joint_counts() == 0).any():
        return None
    return node_normals(mesh, positions)[mesh.rod_nodes]


def curvatures(mesh: GridMesh, positions: Floats, *, clamps: Floats | None = None) -> Floats:
    """(k,) curvature [1/m] at each entry of `rod_nodes`."""
    return np.asarray(np.linalg.norm(_turns(mesh, positions, clamps)[0], axis=1))


def axial_strains(mesh: GridMesh, positions: Floats) -> Floats:
    """(k,) axial strain at each entry of `rod_nodes`: the mean over its edges, which at an end is one."""
    lengths = np.linalg.norm(positions[mesh.edges[:, 1]] - positions[mesh.edges[:, 0]], axis=1)
    return _mean_of_edges(mesh, lengths / mesh.edge_lengths - 1.0)


def _mean_of_edges(mesh: GridMesh, values: Floats) -> Floats:
    """(k, ...) of each entry of `rod_nodes`: the mean of the `values` (e, ...) of its edges, which at an end is one."""
    begins = np.ones(len(mesh.rod_nodes), dtype=bool)
    begins[mesh.rod_stop - 1] = False  # entries that an edge begins at
    total, count = np.zeros((len(begins), *values.shape[1:])), np.zeros(len(begins))
    for entries in (np.flatnonzero(begins), np.flatnonzero(begins) + 1):
        total[entries] += values
        count[entries] += 1
    return np.asarray(total / count.reshape(-1, *[1] * (values.ndim - 1)))


def _on_entries(shell: Shell, strains: Floats) -> Floats:
    """(k, 3) strains of the bends, and of clamps if among them, over their length at each entry of `rod_nodes`."""
    mesh = shell.mesh
    result = np.zeros((len(mesh.rod_nodes), 3))
    result[_inner(mesh)] = strains[: len(mesh.bends)] / mesh.voronoi_lengths[:, None]
    if len(strains) > len(mesh.bends):
        ends = np.column_stack([mesh.rod_start, mesh.rod_stop - 1]).ravel()
        result[ends] = strains[len(mesh.bends) :] / (0.5 * last_edges(mesh)[:, None])
    return result


def _inner(mesh: GridMesh) -> Bools:
    """(k,) which entries of `rod_nodes` are not ends."""
    inner = np.ones(len(mesh.rod_nodes), dtype=bool)
    inner[mesh.rod_start] = inner[mesh.rod_stop - 1] = False
    return inner


def _turns(mesh: GridMesh, positions: Floats, clamps: Floats | None) -> tuple[Floats, Floats]:
    """At each entry of `rod_nodes` the curvature binormal (k, 3) [1/m] and the rod's direction (k, 3)."""
    turns, tangents = np.zeros((2, len(mesh.rod_nodes), 3))
    edges = unit(positions[mesh.edges[:, 1]] - positions[mesh.edges[:, 0]])
    tangents[:] = _mean_of_edges(mesh, edges)
    before, here, after = (positions[mesh.bends[:, k]] for k in range(3))
    turns[_inner(mesh)] = _turn(unit(here - before), unit(after - here)) / mesh.voronoi_lengths[:, None]
    if clamps is not None:
        half = 0.5 * last_edges(mesh)[:, None]
        first, last = mesh.rod_start, mesh.rod_stop - 1
        turns[first] = _turn(-clamps[::2], tangents[first]) / half[::2]
        turns[last] = _turn(tangents[last], clamps[1::2]) / half[1::2]
        tangents[first] -= clamps[::2]
        tangents[last] += clamps[1::2]
    return turns, unit(tangents)


def _turn(before: Floats, after: Floats) -> Floats:
    """(b, 3) integrated curvature binormal between unit tangents, 2 tan(phi/2) long; exact also for small angles."""
    return np.asarray(2.0 * cross(before, after) / (1.0 + dot(before, after))[:, None])


def _parts(turns: Floats, tangents: Floats, axes: Floats) -> tuple[Floats, Floats]:
    """(k,) parts of the curvature towards `axes` (k, 3), and towards what lies across them and the rod [1/m]."""
    across = unit(axes - dot(axes, tangents)[:, None] * tangents)
    return dot(turns, cross(tangents, across)), dot(turns, across)
