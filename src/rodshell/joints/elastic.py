"""Elastic joints of a mesh: which stiffness between two rods' sections makes a joint what it is said to be.

A rod's section at a joint is not one of the discrete rod's unknowns: half an edge of rod lies between it and the
edges next to it. So the joint acts in series with the half edges, which are stiff as 2 EI/l, 2 GJ/l each and side by
side where the rod goes on:  K = (1/k + C_A + C_B)^-1  with the compliances C = (2 EI sum 1/l)^-1 of the two rods. It
is what remains when a rigid body at the joint, held by the half edges and the joint's own springs, is condensed
out. A rigid joint then needs no penalty, and errors are of second order in the edge length (a portal frame, a
grillage). Three rods or more make a star of such springs; condensing its middle gives K_i (sum K)^-1 K_j between each
two. Where a joint gives way freely, its stiffness is exactly zero.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.joints.crossings import Places
from rodshell.joints.joint import Elastic, Joint
from rodshell.joints.relative_rotation import RelativeRotation
from rodshell.joints.sections import stencils

FIRM = 1e8  # of the half edges next to it: what a rigid direction of a joint has
UP = np.array([0.0, 0.0, 1.0])


def elastic_joints(
    places: Places, crossings: Ints, joints: Sequence[Elastic], of_rods: Floats, size: int
) -> tuple[RelativeRotation, ...]:
    """Those joints that resist some rotation, as elements on `size` blocks.

    Parameters
    ----------
    crossings : (m,) which of the grid's; joints : what is there.
    of_rods : (rods, 3) EI1, EI2 and GJ of each rod [N m2].
    """
    stiff = np.array([joint.shear + joint.out_of_plane + joint.twist > 0 for joint in joints], dtype=bool)
    crossings, joints = crossings[stiff], [joint for joint, kept in zip(joints, stiff, strict=True) if kept]
    if not joints:
        return ()
    met = places.of_crossings[crossings]
    rest = _flat_angles(places, met)
    given = np.array([np.nan if joint.rest_angle is None else joint.rest_angle for joint in joints])
    rest = np.where(np.isnan(given), rest, given)
    directions, nodes = _at_rest(places, met, rest), places.mesh.joint_nodes[crossings]
    stiffness = _between(places, met, nodes, directions, joints, of_rods)
    deviators = _deviators(places, met, nodes, directions, of_rods)
    flat = places.flat(size)
    return tuple(
        RelativeRotation.starting_at(
            blocks,
            legs,
            flat,
            UP,
            weights=weights,
            stiffness=stiffness[mine],
            deviators=deviators[mine],
            rest_angle=rest[mine],
        )
        for mine, blocks, legs, _, weights in stencils(places, met)
    )


def _flat_angles(places: Places, met: Ints) -> Floats:
    """(m,) angle from the first rod's direction to the second's in the flat grid [rad]."""
    a, b = places.directions(met[:, 0]), places.directions(met[:, 1])
    return np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], np.einsum("ij,ij->i", a, b))


def _at_rest(places: Places, met: Ints, rest: Floats) -> Floats:
    """(m, 2, 2) unit directions of both rods with the second at the rest angle from the first, in the plane."""
    first = places.directions(met[:, 0])
    cos, sin = np.cos(rest)[:, None], np.sin(rest)[:, None]
    return np.stack([first, cos * first + sin * np.column_stack([-first[:, 1], first[:, 0]])], axis=1)


def _between(
    places: Places, met: Ints, nodes: Ints, directions: Floats, joints: Sequence[Elastic], of_rods: Floats
) -> Floats:
    """(m, 3, 3) stiffness between the two rods of each joint, by the strains of `RelativeRotation` [N m]."""
    held = np.stack([_held(places, met, side, directions, joints, of_rods) for side in range(2)], axis=1)
    _, first = np.unique(met.ravel(), return_index=True)
    _, node = np.unique(nodes, return_inverse=True)
    total = np.zeros((node.max() + 1, 3, 3))
    np.add.at(total, np.repeat(node, 2)[first], held.reshape(-1, 3, 3)[first])
    pair = held[:, 0] @ np.linalg.pinv(total, hermitian=True)[node] @ held[:, 1]
    pair = 0.5 * (pair + pair.transpose(0, 2, 1))
    return _by_strains(pair, directions)


def _by_strains(tensors: Floats, directions: Floats) -> Floats:
    """(m, 3, 3) tensors in x, y, z by the axes of the strains: the normal, minus A's tangent, and across it."""
    along = directions[:, 0]
    axes = np.zeros_like(tensors)
    axes[:, 0, 2] = 1.0
    axes[:, 1, :2] = -along
    axes[:, 2, 0], axes[:, 2, 1] = -along[:, 1], along[:, 0]
    return np.asarray(axes @ tensors @ axes.transpose(0, 2, 1))


def _deviators(places: Places, met: Ints, nodes: Ints, directions: Floats, of_rods: Floats) -> NDArray[np.complex128]:
    """(m, 2) of the compliances of either rod's half edges; 0 where three rods or more make a star."""
    result = np.zeros((len(met), 2), dtype=complex)
    for side in range(2):
        tensor = _by_strains(_compliance(places, met[:, side], directions[:, side], of_rods), directions)
        result[:, side] = 0.5 * (tensor[:, 1, 1] - tensor[:, 2, 2]) + 1j * tensor[:, 1, 2]
    _, node, count = np.unique(nodes, return_inverse=True, return_counts=True)
    result[count[node] > 1] = 0.0
    return result


def _held(
    places: Places, met: Ints, side: int, directions: Floats, joints: Sequence[Elastic], of_rods: Floats
) -> Floats:
    """(m, 3, 3) stiffness between the edges of the joint's rod `side` and the joint's middle, in x, y, z [N m]."""
    compliance = _compliance(places, met[:, side], directions[:, side], of_rods)
    firm = FIRM / np.linalg.eigvalsh(compliance)[:, 0]
    p, corner = _bisectors(places, met, directions)
    root = np.zeros_like(compliance)  # square root of twice the joint's stiffness: half of the joint is this rod's
    for k, joint in enumerate(joints):
        shear, out, twist = (min(2.0 * value, firm[k]) for value in (joint.shear, joint.out_of_plane, joint.twist))
        if not corner[k]:
            out = twist = 0.5 * (out + twist)
        q = np.cross(UP, p[k])
        root[k] = (
            np.sqrt(shear) * np.outer(UP, UP) + np.sqrt(twist) * np.outer(p[k], p[k]) + np.sqrt(out) * np.outer(q, q)
        )
    return np.asarray(root @ np.linalg.inv(np.eye(3) + root @ compliance @ root) @ root)


def _compliance(places: Places, here: Ints, along: Floats, of_rods: Floats) -> Floats:
    """(m, 3, 3) compliance of the half edges at `here`, of rods with the directions `along` (m, 2), in x, y, z."""
    half_edges = 2.0 * places.softness(here)
    rod_axes = np.zeros((len(here), 3, 3))  # rows: tangent, across it in the plane, normal
    rod_axes[:, 0, :2], rod_axes[:, 2, 2] = along, 1.0
    rod_axes[:, 1, 0], rod_axes[:, 1, 1] = -along[:, 1], along[:, 0]
    about = half_edges[:, None] * of_rods[places.rods[here]][:, [2, 0, 1]]
    return np.asarray(rod_axes.transpose(0, 2, 1) @ (rod_axes / about[:, :, None]))


def _bisectors(places: Places, met: Ints, directions: Floats) -> tuple[Floats, np.ndarray]:
    """(m, 3) unit bisector of the corner, where one rod comes and the other leaves; (m,) whether both end there."""
    corner = np.ones(len(met), dtype=bool)
    path = np.zeros((len(met), 2))
    for rod_of, sign in ((0, 1.0), (1, -1.0)):
        here = met[:, rod_of]
        before, after = places.has(here, 0), places.has(here, 1)
        corner &= ~(before & after)
        path += np.where(before, sign, -sign)[:, None] * directions[:, rod_of]
    straight = np.linalg.norm(path, axis=1) < 1e-9  # the second rod leaves where the first came from
    path[straight] = directions[straight, 0]
    path /= np.linalg.norm(path, axis=1)[:, None]
    return np.column_stack([path, np.zeros(len(met))]), corner


def refuse_mixtures(node: Ints, joints: Sequence[Joint]) -> None:
    """Three rods or more that meet at one node (c,) are tied by one kind of joint."""
    first: dict[int, Joint] = {}
    for where, joint in zip(node.tolist(), joints, strict=True):
        if first.setdefault(where, joint) != joint:
            raise InputError(
                f"three rods or more meet at one joint, of which some are tied by {first[where].name} and some by "
                f"{joint.name} joints: give all of them one kind"
            )
