"""What the finite sections of rods mean on a target: two layers, strong axes, and targets too flat to bend them.

A net has no thickness. Rods laid one above the other lie on parallel surfaces, along which lengths differ by the
surfaces' distance times the curvature [do Carmo, Differential Geometry of Curves and Surfaces, 3-5].

A lath whose joints keep it from rolling also bends about its strong axis: lying flat by the geodesic curvature of its
line, on edge by the surface's. Like any strip it then buckles sideways between two joints where that moment exceeds
pi/a sqrt(EI GJ), EI being the smaller stiffness and a the joints' distance [Timoshenko and Gere, Theory of Elastic
Stability, chapter 6, pure bending of a strip]. Where joints let it roll, it turns to its weak axis when it is released.
"""

from dataclasses import dataclass
from math import pi, sqrt

import numpy as np

from rodshell.arrays import Bools, Floats, NodePositions
from rodshell.geometry.frames import cross, dot, unit
from rodshell.layout import GridMesh
from rodshell.model import Shell
from rodshell.rods.section import GivenSection, Rod
from rodshell.targets import Target
from rodshell.units import length_text

THICK = 0.015  # relative difference of the layers' lengths above which a warning is given
CLOSE = 0.1  # thickness over the spacing above which a warning is given
PLANE = 1e-6  # of the extent: what files of single precision leave of a plane
BEYOND = 0.1  # share of the rods' length beyond their buckling moment; with less, shells settle near their targets


def joint_tangents(mesh: GridMesh, positions: Floats) -> Floats:
    """(c, 2, 3) tangents of both rods at each joint, from the neighbours on either side; not normalised [m].

    Args:
        mesh: of n nodes and c joints.
        positions: (n, 3) of the nodes [m].
    """
    before, after = np.moveaxis(positions[mesh.rod_nodes[mesh.beside_crossings]], 2, 0)
    return np.asarray(after - before)


def joint_angles(mesh: GridMesh, positions: NodePositions) -> Floats:
    """(c,) angles between both rods at each joint, 0 to pi/2 [rad]."""
    first, second = joint_tangents(mesh, positions).transpose(1, 0, 2)
    return np.asarray(np.arctan2(np.linalg.norm(cross(first, second), axis=1), np.abs(dot(first, second))))


def joint_normals(mesh: GridMesh, positions: NodePositions) -> Floats:
    """(c, 3) unit normals at the joints, across both rods, on the side that is up in the flat grid."""
    tangents, flat = joint_tangents(mesh, positions), joint_tangents(mesh, mesh.flat)
    up = np.sign(cross(flat[:, 0], flat[:, 1])[:, 2:])
    return unit(up * cross(tangents[:, 0], tangents[:, 1]))


def node_normals(mesh: GridMesh, positions: NodePositions) -> Floats:
    """(n, 3) unit normals at all nodes, those of the joints interpolated linearly along the rods."""
    (crossings, share), at_joints = mesh.between_crossings, joint_normals(mesh, positions)
    first, last = at_joints[crossings].transpose(1, 0, 2)
    total = np.zeros((mesh.node_count, 3))
    np.add.at(total, mesh.rod_nodes, first + share[:, None] * (last - first))
    return unit(total)


def place_in_layers(
    mesh: GridMesh, positions: Floats, normals: Floats, eccentricity: float
) -> tuple[GridMesh, Floats, Floats]:
    """The mesh in two layers, with the positions (k, 3) of its nodes [m] and the normals (k, 3) there.

    Args:
        mesh: of n nodes, whose rods meet in shared nodes.
        positions, normals: (n, 3) of the surface between the layers [m], [-].
        eccentricity: distance of the layers [m].
    """
    layered = mesh.in_layers(eccentricity)
    rod_normals = normals[mesh.rod_nodes]
    return layered, positions[mesh.rod_nodes] + layered.heights[:, None] * rod_normals, rod_normals


def middle_surface(mesh: GridMesh, layered: GridMesh, positions: Floats) -> Floats:
    """(n, 3) positions of the nodes of `mesh`, on the surface between two layers of rods [m].

    Args:
        mesh: of n nodes, whose rods meet in shared nodes.
        layered: the same mesh in layers, of k nodes; or `mesh` itself.
        positions: (k, 3) of the nodes of `layered` [m].
    """
    if not layered.layered:
        return positions
    middle = positions - layered.heights[:, None] * node_normals(layered, positions)
    total = np.zeros((mesh.node_count, 3))
    np.add.at(total, mesh.rod_nodes, middle)
    return total / np.bincount(mesh.rod_nodes, minlength=mesh.node_count)[:, None]


def _rod_thickness(rod: Rod) -> float:
    """Size of a rod's section along the shell's normal [m]; 0 where the shape of its section is not known."""
    return 0.0 if isinstance(rod.section, GivenSection) else 2 * rod.section.half_widths[0]


def rod_breadth(rod: Rod) -> float:
    """Size of a rod's section within the shell [m]; 0 where the shape of its section is not known."""
    return 2 * rod.section.half_widths[1] if rod.section.half_widths else 0.0


def thickness_warnings(
    normal: Floats, mesh: GridMesh, positions: Floats, touching: Bools, rod: Rod, spacing: float
) -> tuple[str, ...]:
    """A warning where thick rods, laid one above the other, would differ in length from lines on one surface.

    Args:
        normal: (n, 3) of the target at the mesh's nodes.
        positions: (n, 3) of the mesh's nodes, on the target [m].
        touching: (n,) which of them lie on the target itself, not on its continuation.
        spacing: of the rods [m].
    """
    thick, (a, b) = _rod_thickness(rod), mesh.edges.T
    turn, chord = normal[b] - normal[a], positions[b] - positions[a]
    bent = thick * (touching[a] & touching[b]) * dot(turn, chord) / dot(chord, chord)
    if not (np.abs(bent).max(initial=0.0) > THICK or thick > CLOSE * spacing):
        return ()
    change = 0.5 * np.bincount(mesh.edge_rods, weights=bent * mesh.edge_lengths)
    share = 50 * np.abs(bent).max(initial=0.0)
    return (
        f"the rods are {length_text(thick)} thick and their joints hold their centre lines together: laid one above "
        f"the other, rods would be up to {length_text(float(np.abs(change).max(initial=0.0)))} shorter in one layer "
        f"and longer in the other, and joint distances up to {share:.2g} %; give the distance of their centre lines "
        "(joint.eccentricity), unless they are notched at the joints",
    )


def rise(points: Floats) -> float:
    """Extent of the points (n, 3) across the plane that fits them best [m]."""
    centred = points - points.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    return float(np.ptp(centred @ axes[:, 0]))


def least_rise(rod: Rod) -> float:
    """The rise up to which rods are pressed together instead of being bent [m]: twice their radius of gyration.

    The ends of a rod that lies on n half waves of the rise s over the length L come together by (pi n s / 2 L)^2 of L;
    a straight rod, held at its ends and at the nodes of these waves, buckles when that exceeds (pi n i / L)^2, with
    i^2 = EI / EA [Euler]: at s = 2 i, whatever n and L are.
    """
    return 2 * sqrt(min(rod.bend_stiffnesses) / rod.stretch_stiffness)


def is_flat(points: Floats, rod: Rod) -> bool:
    """Whether a shell with these nodes (n, 3) [m] is too flat to bend its rods, so that nothing pops up."""
    return rise(points) <= least_rise(rod)


def flat_warnings(points: Floats, rod: Rod) -> tuple[str, ...]:
    """A warning where a shell with these nodes (n, 3) [m] is too flat to bend its rods."""
    if not is_flat(points, rod):
        return ()
    height, least = rise(points), length_text(least_rise(rod))
    plane = height <= PLANE * float(np.ptp(points, axis=0).max())
    what = "is a plane" if plane else f"rises by {length_text(height)} only"
    return (
        f"the target is flat, nothing pops up: it {what}, and up to a rise of {least}, twice their radius of gyration, "
        "the rods are pressed together and do not bend",
    )


@dataclass(frozen=True)
class StrongBending:
    """How the rods of a net bend about their strong axis.

    Args:
        ratio: of the larger bending stiffness to the smaller [-].
        flat: whether they lie flat, the strong axis being the surface's normal; else they stand on edge.
        curvature: about the strong axis, where the moment is largest [1/m].
        moment: the largest moment over that at which a rod buckles sideways between its joints [-].
        beyond: share of the rods' length where the moment is beyond that [-].
    """

    ratio: float
    flat: bool
    curvature: float
    moment: float
    beyond: float

    @property
    def warnings(self) -> tuple[str, ...]:
        """A warning where rods would buckle on a large part of their length."""
        if self.beyond <= BEYOND:
            return ()
        directions, stiffnesses = ["within the surface", "out of it"], ["EI2", "EI1"]
        if not self.flat:
            directions, stiffnesses = ["out of the surface", "within it"], ["EI1", "EI2"]
        return (
            f"the rods are {self.ratio:.3g} times as stiff {directions[0]} as {directions[1]} "
            f"({'/'.join(stiffnesses)}), and the target bends them that way down to a radius of "
            f"{length_text(1.0 / self.curvature)}: up to {self.moment:.3g} times the moment at which they buckle "
            f"sideways between joints, and beyond it on {100 * self.beyond:.0f} % of their length; use rods with a "
            "less pronounced strong axis (rod.section), a smaller spacing or a flatter target",
        )


def strong_bending(
    target: Target, mesh: GridMesh, positions: Floats, touching: Bools, rod: Rod
) -> StrongBending | None:
    """How rods that cannot roll at their joints bend about their strong axis; None where both axes are alike.

    Args:
        positions: (n, 3) of the mesh's nodes, on the target [m].
        touching: (n,) which of them lie on the target itself, not on its continuation.
    """
    stiffnesses = rod.bend_stiffnesses
    weak, strong = sorted(stiffnesses)
    if weak == strong:
        return None
    bends = np.asarray(touching[mesh.bends].all(axis=1))
    if not bends.any():
        return None
    flat = stiffnesses[1] == strong
    before, here, after = (positions[mesh.bends[bends, k]] for k in range(3))
    towards = target.on_surface(here).normal
    if flat:
        towards = unit(cross(towards, after - before))
    length = mesh.voronoi_lengths[bends]
    curvature = np.abs(dot(unit(after - here) - unit(here - before), towards)) / length
    critical = pi * sqrt(weak * rod.twist_stiffness)  # times 1 / a: the moment at which a strip buckles
    moment = strong * curvature * _joint_distances(mesh)[mesh.bend_rods[bends]] / critical
    worst = int(np.argmax(moment))
    beyond = float(length[moment > 1.0].sum() / length.sum())
    return StrongBending(strong / weak, flat, float(curvature[worst]), float(moment[worst]), beyond)


def section_rotation(shell: Shell, state: Floats) -> Floats | None:
    """(b,) angle by which each bend's section is turned about the rod's axis out of the shell's normal [rad].

    From 0 to pi/2, between the rod's first material director and the normal, both projected along the rod; None where
    rods have no directors, because they bend alike in all directions.

    Args:
        state: (N, 3) of the shell, with the source frames there.
    """
    mesh = shell.mesh
    frames = shell.frames
    if frames is None or not shell.angles:
        return None
    bends = slice(len(mesh.bends))
    tangents, m1 = frames.source_tangents[bends, 0], frames.material_directors(state)[bends, 0]
    normals = node_normals(mesh, shell.positions(state))[mesh.bends[:, 1]]
    projected = unit(normals - dot(normals, tangents)[:, None] * tangents)
    return np.asarray(np.arccos(np.clip(np.abs(dot(m1, projected)), 0.0, 1.0)))


def _joint_distances(mesh: GridMesh) -> Floats:
    """(m,) median distance of neighbouring joints of each rod [m]; 0 for a rod with a single joint."""
    crossings, result = mesh.grid.crossings, np.zeros(len(mesh.grid.rods))
    for rod in range(len(result)):
        gaps = np.diff(np.sort(crossings.at[crossings.rods == rod]))
        if len(gaps):
            result[rod] = np.median(gaps)
    return result
