"""Rods in two layers: normals of a shell, the layers on either side of it, and the error of a net without layers.

A net has no thickness. Rods laid one above the other lie on parallel surfaces, along which lengths differ by the
surfaces' distance times the curvature [do Carmo, Differential Geometry of Curves and Surfaces, 3-5].
"""

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.geometry.frames import cross, dot, unit
from rodshell.layout import GridMesh
from rodshell.rods.section import Circle, Ellipse, GivenSection, Rod, Tube
from rodshell.targets import Target
from rodshell.units import length_text

THICK = 0.015  # relative difference of the layers' lengths above which a warning is given
CLOSE = 0.1  # thickness over the spacing above which a warning is given


def joint_tangents(mesh: GridMesh, positions: Floats) -> Floats:
    """(c, 2, 3) tangents of both rods at each joint, from the neighbours on either side; not normalised [m].

    Parameters
    ----------
    mesh : of n nodes and c joints.
    positions : (n, 3) of the nodes [m].
    """
    result = np.empty((len(mesh.grid.crossings), 2, 3))
    for side in (0, 1):
        rods, at = mesh.grid.crossings.rods[:, side], mesh.grid.crossings.at[:, side]
        row = np.empty(len(rods), dtype=np.intp)
        for rod in np.unique(rods):
            here = mesh.rod_slice(int(rod))
            on_rod = np.flatnonzero(rods == rod)
            row[on_rod] = here.start + np.abs(mesh.stations[here] - at[on_rod, None]).argmin(axis=1)
        before = np.maximum(row - 1, mesh.rod_start[rods])
        after = np.minimum(row + 1, mesh.rod_stop[rods] - 1)
        result[:, side] = positions[mesh.rod_nodes[after]] - positions[mesh.rod_nodes[before]]
    return result


def joint_normals(mesh: GridMesh, positions: Floats) -> Floats:
    """(c, 3) unit normals at the joints, across both rods, on the side that is up in the flat grid.

    Parameters
    ----------
    positions : (n, 3) of the mesh's nodes [m].
    """
    tangents, flat = joint_tangents(mesh, positions), joint_tangents(mesh, mesh.flat)
    up = np.sign(cross(flat[:, 0], flat[:, 1])[:, 2:])
    return unit(up * cross(tangents[:, 0], tangents[:, 1]))


def node_normals(mesh: GridMesh, positions: Floats) -> Floats:
    """(n, 3) unit normals at all nodes, those of the joints interpolated linearly along the rods.

    Parameters
    ----------
    positions : (n, 3) of the mesh's nodes [m].
    """
    at_joints, total = joint_normals(mesh, positions), np.zeros((mesh.node_count, 3))
    for rod in range(len(mesh.grid.rods)):
        here = mesh.rod_slice(rod)
        joints, side = np.nonzero(mesh.grid.crossings.rods == rod)
        order = np.argsort(mesh.grid.crossings.at[joints, side])
        at, normals = mesh.grid.crossings.at[joints, side][order], at_joints[joints[order]]
        for k in range(3):
            np.add.at(total[:, k], mesh.rod_nodes[here], np.interp(mesh.stations[here], at, normals[:, k]))
    return unit(total)


def place_in_layers(
    mesh: GridMesh, positions: Floats, normals: Floats, eccentricity: float
) -> tuple[GridMesh, Floats, Floats]:
    """The mesh in two layers, with the positions (k, 3) of its nodes [m] and the normals (k, 3) there.

    Parameters
    ----------
    mesh : of n nodes, whose rods meet in shared nodes.
    positions, normals : (n, 3) of the surface between the layers [m], [-].
    eccentricity : distance of the layers [m].
    """
    layered = mesh.in_layers(eccentricity)
    rod_normals = normals[mesh.rod_nodes]
    return layered, positions[mesh.rod_nodes] + layered.heights[:, None] * rod_normals, rod_normals


def middle_surface(mesh: GridMesh, layered: GridMesh, positions: Floats) -> Floats:
    """(n, 3) positions of the nodes of `mesh`, on the surface between two layers of rods [m].

    Parameters
    ----------
    mesh : of n nodes, whose rods meet in shared nodes.
    layered : the same mesh in layers, of k nodes; or `mesh` itself.
    positions : (k, 3) of the nodes of `layered` [m].
    """
    if not layered.layered:
        return positions
    middle = positions - layered.heights[:, None] * node_normals(layered, positions)
    total = np.zeros((mesh.node_count, 3))
    np.add.at(total, mesh.rod_nodes, middle)
    return total / np.bincount(mesh.rod_nodes, minlength=mesh.node_count)[:, None]


def rod_thickness(rod: Rod) -> float:
    """Size of a rod's section along the shell's normal [m]; 0 where the shape of its section is not known."""
    section = rod.section
    if isinstance(section, GivenSection):
        return 0.0
    if isinstance(section, Circle | Tube):
        return 2 * section.outer_radius
    return 2 * section.a if isinstance(section, Ellipse) else section.width


def thickness_warnings(
    target: Target, mesh: GridMesh, positions: Floats, edges: Bools, rod: Rod, spacing: float
) -> tuple[str, ...]:
    """A warning where thick rods, laid one above the other, would differ in length from lines on one surface.

    Parameters
    ----------
    positions : (n, 3) of the mesh's nodes, on the target [m].
    edges : (e,) which edges of the mesh lie on the target.
    spacing : of the rods [m].
    """
    thick = rod_thickness(rod)
    normal, (a, b) = target.on_surface(positions).normal, mesh.edges[edges].T
    chord = positions[b] - positions[a]
    bent = thick * dot(normal[b] - normal[a], chord) / dot(chord, chord)
    if not (np.abs(bent).max(initial=0.0) > THICK or thick > CLOSE * spacing):
        return ()
    change = 0.5 * np.bincount(mesh.edge_rods[edges], weights=bent * mesh.edge_lengths[edges])
    share = 50 * np.abs(bent).max(initial=0.0)
    return (
        f"the rods are {length_text(thick)} thick and their joints hold their centre lines together: laid one above "
        f"the other, rods would be up to {length_text(float(np.abs(change).max(initial=0.0)))} shorter in one layer "
        f"and longer in the other, and joint distances up to {share:.2g} %; give the distance of their centre lines "
        "(joint.eccentricity), unless they are notched at the joints",
    )
