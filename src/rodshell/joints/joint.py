"""Joint kinds: how the rods at a crossing can turn relative to each other, and the stiffness against it.

One concept covers them all: three stiffnesses [N m/rad] against the turning of the rods' sections relative to each
other, about the joint's normal (the shear of the grid), out of a corner's plane, and about a corner's bisector (its
twist). A ball joint has none, a pin (the scissor joint of X-shells) is free about the normal and rigid in the other
two, a rigid joint is rigid in all. The paper's linker rods are the exception: bends from edge to edge (`Linker`).

The section of a rod at a joint is not among the unknowns of the discrete rod: half an edge of rod lies between it and
the edges next to it. So the joint acts in series with the half edges, whose stiffnesses are 2 EI/l and 2 GJ/l each, in
parallel where the rod continues on both sides:  K = (1/k + C_A + C_B)^-1  with the compliances C = (2 EI sum 1/l)^-1
of the two rods. It is what remains when a rigid body at the joint, held by the half edges and the joint's springs, is
condensed out. A rigid joint then needs no penalty, and errors are of second order in the edge length (a portal frame,
a grillage). Three rods or more make a star of such springs; condensing its middle gives K_i (sum K)^-1 K_j between
each two. Where a joint is free, its stiffness is exactly zero.
"""

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.joints.crossings import UP, RodNodes, stencils
from rodshell.joints.relative_rotation import RelativeRotation
from rodshell.rods.joints import Joint

FIRM = 1e8  # times the half edges next to it: the stiffness of a rigid direction of a joint


def resists(joint: Joint) -> bool:
    """Whether a `joint` resists some rotation."""
    return joint.shear + joint.out_of_plane + joint.twist > 0


def elastic_joints(
    rod_nodes: RodNodes, crossings: Ints, joints: Sequence[Joint], rod_stiffness: Floats, size: int
) -> tuple[RelativeRotation, ...]:
    """The joints, one at each of some crossings (m,), that resist some rotation, as elements.

    Args:
        rod_stiffness: (k, 3) EI1, EI2 and GJ at each rod node [N m2].
        size: number of blocks of the state.
    """
    stiff = np.array([resists(joint) for joint in joints], dtype=bool)
    crossings, joints = crossings[stiff], [joint for joint, kept in zip(joints, stiff, strict=True) if kept]
    if not joints:
        return ()
    pairs = rod_nodes.at_crossings[crossings]
    rest = _flat_angles(rod_nodes, pairs)
    wanted = np.array([np.nan if joint.rest_angle is None else joint.rest_angle for joint in joints])
    rest = np.where(np.isnan(wanted), rest, wanted)
    directions, nodes = _at_rest(rod_nodes, pairs, rest), rod_nodes.mesh.joint_nodes[crossings]
    stiffness = _between(rod_nodes, pairs, nodes, directions, joints, rod_stiffness)
    deviators = _deviators(rod_nodes, pairs, nodes, directions, rod_stiffness)
    flat = rod_nodes.flat_state(size)
    return tuple(
        RelativeRotation.starting_at(
            blocks,
            legs,
            flat,
            UP,
            weights=weights,
            stiffness=stiffness[members],
            deviators=deviators[members],
            rest_angle=rest[members],
        )
        for members, blocks, legs, _, weights in stencils(rod_nodes, pairs)
    )


def _flat_angles(rod_nodes: RodNodes, pairs: Ints) -> Floats:
    """(m,) angle from the first rod's direction to the second's in the flat grid [rad]."""
    a, b = rod_nodes.directions(pairs[:, 0]), rod_nodes.directions(pairs[:, 1])
    return np.asarray(np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], np.einsum("ij,ij->i", a, b)))


def _at_rest(rod_nodes: RodNodes, pairs: Ints, rest: Floats) -> Floats:
    """(m, 2, 2) unit directions of both rods with the second at the rest angle from the first, in the plane."""
    first = rod_nodes.directions(pairs[:, 0])
    cos, sin = np.cos(rest)[:, None], np.sin(rest)[:, None]
    return np.stack([first, cos * first + sin * np.column_stack([-first[:, 1], first[:, 0]])], axis=1)


def _between(
    rod_nodes: RodNodes, pairs: Ints, nodes: Ints, directions: Floats, joints: Sequence[Joint], rod_stiffness: Floats
) -> Floats:
    """(m, 3, 3) stiffness between the two rods of each joint, by the strains of `RelativeRotation` [N m]."""
    halves = np.stack(
        [_to_middle(rod_nodes, pairs, side, directions, joints, rod_stiffness) for side in range(2)], axis=1
    )
    _, first = np.unique(pairs.ravel(), return_index=True)
    _, node = np.unique(nodes, return_inverse=True)
    total = np.zeros((node.max() + 1, 3, 3))
    np.add.at(total, np.repeat(node, 2)[first], halves.reshape(-1, 3, 3)[first])
    pair = halves[:, 0] @ np.linalg.pinv(total, hermitian=True)[node] @ halves[:, 1]
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


def _deviators(
    rod_nodes: RodNodes, pairs: Ints, nodes: Ints, directions: Floats, rod_stiffness: Floats
) -> NDArray[np.complex128]:
    """(m, 2) of the compliances of either rod's half edges; 0 where three rods or more make a star."""
    result = np.zeros((len(pairs), 2), dtype=complex)
    for side in range(2):
        tensor = _by_strains(_compliance(rod_nodes, pairs[:, side], directions[:, side], rod_stiffness), directions)
        result[:, side] = 0.5 * (tensor[:, 1, 1] - tensor[:, 2, 2]) + 1j * tensor[:, 1, 2]
    _, node, count = np.unique(nodes, return_inverse=True, return_counts=True)
    result[count[node] > 1] = 0.0
    return result


def _to_middle(
    rod_nodes: RodNodes, pairs: Ints, side: int, directions: Floats, joints: Sequence[Joint], rod_stiffness: Floats
) -> Floats:
    """(m, 3, 3) stiffness between the edges of the joint's rod `side` and the joint's middle, in x, y, z [N m]."""
    compliance = _compliance(rod_nodes, pairs[:, side], directions[:, side], rod_stiffness)
    firm = (FIRM / np.linalg.eigvalsh(compliance)[:, 0])[:, None, None]
    p, corner = _bisectors(rod_nodes, pairs, directions)
    root = np.zeros_like(compliance)  # of twice the joint's stiffness, over `firm`: this rod has half of the joint
    for k, joint in enumerate(joints):
        shear, out, twist = (
            min(2.0 * value / firm[k, 0, 0], 1.0) for value in (joint.shear, joint.out_of_plane, joint.twist)
        )
        if not corner[k]:
            out = twist = 0.5 * (out + twist)
        q = np.cross(UP, p[k])
        root[k] = (
            np.sqrt(shear) * np.outer(UP, UP) + np.sqrt(twist) * np.outer(p[k], p[k]) + np.sqrt(out) * np.outer(q, q)
        )
    return np.asarray(firm * (root @ np.linalg.inv(np.eye(3) + root @ (firm * compliance) @ root) @ root))


def _compliance(rod_nodes: RodNodes, here: Ints, along: Floats, rod_stiffness: Floats) -> Floats:
    """(m, 3, 3) compliance of the half edges at `here`, of rods with the directions `along` (m, 2), in x, y, z."""
    half_edges = 2.0 * rod_nodes.inverse_lengths(here)
    rod_axes = np.zeros((len(here), 3, 3))  # rows: tangent, across it in the plane, normal
    rod_axes[:, 0, :2], rod_axes[:, 2, 2] = along, 1.0
    rod_axes[:, 1, 0], rod_axes[:, 1, 1] = -along[:, 1], along[:, 0]
    about = half_edges[:, None] * rod_stiffness[here][:, [2, 0, 1]]
    return np.asarray(rod_axes.transpose(0, 2, 1) @ (rod_axes / about[:, :, None]))


def _bisectors(rod_nodes: RodNodes, pairs: Ints, directions: Floats) -> tuple[Floats, np.ndarray]:
    """(m, 3) unit bisector of the corner, in along one rod and out along the other; (m,) whether both end there."""
    corner = np.ones(len(pairs), dtype=bool)
    path = np.zeros((len(pairs), 2))
    for rod_of, sign in ((0, 1.0), (1, -1.0)):
        here = pairs[:, rod_of]
        before, after = rod_nodes.has_edge(here, 0), rod_nodes.has_edge(here, 1)
        corner &= ~(before & after)
        path += np.where(before, sign, -sign)[:, None] * directions[:, rod_of]
    straight = np.linalg.norm(path, axis=1) < 1e-9  # the second rod goes back along the first
    path[straight] = directions[straight, 0]
    path /= np.linalg.norm(path, axis=1)[:, None]
    return np.column_stack([path, np.zeros(len(pairs))]), corner


def refuse_mixtures(node: Ints, joints: Sequence[Joint]) -> None:
    """Refuse a node at which three rods or more meet with joints of different kinds; `node` and `joints` are those of
    each crossing."""
    first: dict[int, Joint] = {}
    for joint_node, joint in zip(node.tolist(), joints, strict=True):
        if first.setdefault(joint_node, joint) != joint:
            raise InputError(
                f"three rods or more meet at one joint, some tied by {first[joint_node].name} and some by "
                f"{joint.name} joints: give all of them the same kind"
            )
