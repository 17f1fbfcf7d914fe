"""Reactions and their balance, and forces and moments between crossing rods.

*Reactions.* The gradient of the elastic energy at a held end is the force of its support. A clamp acts on the ghost
node past the end too: its force there is the clamp's moment about the end. No part of this sees the balance, so the
sums check it: they vanish only if every free node is in equilibrium.

*Joint loads.* The force on a rod at a joint is what balances the rod's own stretch, bending and twist there; the moment
about the joint is that of the joint's energy: of the forces on the nodes next to it and of the torques on the edges'
twist angles. Both are resultants, whatever the joint is made of.
"""

from dataclasses import dataclass, replace

import numpy as np
from pydantic import Field

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.figures import checks as figures
from rodshell.figures.records import Found
from rodshell.formfinding.finite_sections import joint_normals, joint_tangents
from rodshell.geometry.frames import cross, dot, unit
from rodshell.layout import FlatGrid
from rodshell.model import Shell
from rodshell.rods.elements import Elements, is_bends
from rodshell.solve.equilibrium import Equilibrium
from rodshell.validation import brief

POINT = 1e-3  # edges: nodes as close as that are one point


class Reactions(figures.Reactions):
    """Forces and moments of the supports on both ends of each rod in turn."""

    points: Found[Floats] = Field(description="(2m, 3) where they act [m]")

    @classmethod
    def at(cls, points: Floats, forces: Floats, moments: Floats) -> "Reactions":
        """Of the forces and moments (2m, 3) at these `points`; all moments are summed about their middle."""
        about_middle = np.cross(points - points.mean(axis=0), forces) + moments
        return cls(
            points=points,
            force_sum=forces.sum(axis=0),
            moment_sum=about_middle.sum(axis=0),
            force_imbalance=_imbalance(forces),
            moment_imbalance=_imbalance(about_middle),
            largest_force=_largest(forces),
            largest_moment=_largest(moments),
            forces=forces,
            moments=moments,
        )


def _largest(parts: Floats) -> float:
    return float(np.linalg.norm(parts, axis=1).max(initial=0.0))


def _imbalance(parts: Floats) -> float:
    """Size of their sum over the largest."""
    largest = _largest(parts)
    return float(np.linalg.norm(parts.sum(axis=0))) / largest if largest > 0 else 0.0


def reactions(shell: Shell, found: Equilibrium) -> Reactions:
    """Reactions of a shell without loads, whose ends are held or pushed by the springs of supports.

    Args:
        found: the equilibrium, at which the shell's source frames are; its gradient at the ends, without that of the
            springs, is what the supports exert.
    """
    state, gradient = found.state, found.gradient
    if shell.springs:  # their forces are the supports'
        pushes = np.zeros_like(gradient)
        for spring in shell.springs:
            spring.evaluate(state, pushes)
        gradient = gradient - pushes
    points = state[shell.ends]
    forces, moments = gradient[shell.ends], np.zeros_like(points)
    if len(shell.ghosts):
        at_ghosts = gradient[shell.ghosts]
        forces = forces + at_ghosts
        moments = np.cross(state[shell.ghosts] - points, at_ghosts)
    return Reactions.at(points, forces, moments)


@dataclass(frozen=True, eq=False)
class JointLoads:
    """Of each of the grid's c crossings, in its order.

    Args:
        normals: (c, 3) unit normals of the two rods, on the side that was up in the flat grid.
        forces: (c, 2, 3) on its first and its second rod [N]. Where two rods meet they are opposite; where more meet,
            each is what all the others do together.
        moments: (c, 3) on the second rod about the joint [N m].
        flat_angles, angles: (c,) from the first rod's direction to the second's about the normal, flat and now [rad].
    """

    normals: Floats
    forces: Floats
    moments: Floats
    flat_angles: Floats
    angles: Floats

    __repr__ = brief

    @property
    def scissor(self) -> Floats:
        """(c,) by how much the angle between the two rods has grown, whichever of them is the first [rad]."""
        return np.asarray(np.abs(self.angles) - np.abs(self.flat_angles))

    @property
    def normal_forces(self) -> Floats:
        """(c,) by which the second rod is pushed along the normal [N]."""
        return np.asarray(dot(self.forces[:, 1], self.normals))

    @property
    def shear_moments(self) -> Floats:
        """(c,) about the normal: against scissoring [N m]."""
        return np.asarray(dot(self.moments, self.normals))

    @property
    def out_of_plane_moments(self) -> Floats:
        """(c,) size of the moment about the axes in the joint's plane [N m]."""
        return np.asarray(np.linalg.norm(self.moments - self.shear_moments[:, None] * self.normals, axis=1))

    def records(self, grid: FlatGrid) -> tuple[figures.JointLoad, ...]:
        """What acts at each joint on its second rod."""
        columns = {
            "force": self.forces[:, 1],
            "normal_force": self.normal_forces,
            "shear_moment": self.shear_moments,
            "out_of_plane_moment": self.out_of_plane_moments,
            "scissor_deg": np.degrees(self.scissor),
        }
        rows = zip(grid.crossings.rods.tolist(), *(column.tolist() for column in columns.values()), strict=True)
        return tuple(
            figures.JointLoad(rods=(grid.rods[a].name, grid.rods[b].name), **dict(zip(columns, values, strict=True)))
            for (a, b), *values in rows
        )


def joint_loads(shell: Shell, state: Floats) -> JointLoads:
    """Of a shell in equilibrium at `state` (N, 3), its source frames being there; with shared DOFs or eccentric.

    Raises:
        InputError: the moments of an energy between rods are not known.
    """
    mesh, positions = shell.mesh, shell.positions(state)
    met = mesh.at_crossings
    normals = joint_normals(mesh, positions)
    between, moments = _between(shell, state, met)
    forces = _on_places(shell, state)[met] + between
    return JointLoads(
        normals, forces, moments, _angles(joint_tangents(mesh, mesh.flat), joint_normals(mesh, mesh.flat)),
        _angles(joint_tangents(mesh, positions), normals),
    )  # fmt: skip


def _angles(tangents: Floats, normals: Floats) -> Floats:
    a, b = unit(tangents[:, 0]), unit(tangents[:, 1])
    return np.arctan2(dot(normals, cross(a, b)), dot(a, b))


def _rows(elements: Elements, state: Floats) -> Floats:
    """(m, k, 3) gradient of each element by its own blocks."""
    m, k = elements.blocks.shape
    alone = replace(elements, blocks=np.arange(m * k).reshape(m, k))  # type: ignore[type-var]
    gradient = np.zeros((m * k, 3))
    alone.evaluate(np.ascontiguousarray(state[elements.blocks].reshape(-1, 3)), gradient)
    return gradient.reshape(m, k, 3)


def _on_places(shell: Shell, state: Floats) -> Floats:
    """(k, 3) gradient of each rod's own energy by each entry of `rod_nodes` [N]."""
    mesh = shell.mesh
    key = mesh.rod_of * len(shell.like) + shell.node_blocks
    order = np.argsort(key)
    result = np.zeros((len(key), 3))
    clamps = np.repeat(np.arange(len(mesh.rod_start)), 2)
    for element in (shell.stretch, *filter(is_bends, shell.within)):
        of_rods = mesh.edge_rods if element is shell.stretch else mesh.bend_rods
        of_rods = np.append(of_rods, clamps[: len(element.blocks) - len(of_rods)])
        rows = _rows(element, state)
        for column in range(element.blocks.shape[1]):
            blocks = element.blocks[:, column]
            nodes = blocks < shell.node_count
            at = order[np.searchsorted(key[order], (of_rods * len(shell.like) + blocks)[nodes])]
            np.add.at(result, at, rows[nodes, column])
    return result


def cut_forces(shell: Shell, state: Floats) -> Floats:
    """(e, 3) force in each edge of the mesh, by which what lies after it pulls at what lies before it [N].

    Its part along the edge is the axial force, the rest the shear force: what balances the rod's own energy up to the
    cut. A moment that a joint transfers acts as a pair of forces on the nodes next to it, so that shear forces are
    those of spans only away from joints. The shell is in equilibrium at `state` (N, 3), its source frames being there.
    """
    mesh, start = shell.mesh, shell.mesh.rod_start
    gradient = _on_places(shell, state)
    if len(shell.ghosts):  # a clamp holds the ghost node before a rod's start, too
        of_rods = np.zeros_like(state)
        for element in shell.within:
            element.evaluate(state, of_rods)
        gradient[start] += of_rods[shell.ghosts[::2]]
    before = np.cumsum(gradient, axis=0)
    before -= np.repeat(before[start] - gradient[start], mesh.rod_stop - start, axis=0)
    return np.asarray(-before[mesh.edge_entries])


def _between(shell: Shell, state: Floats, met: Ints) -> tuple[Floats, Floats]:
    """Of the joints' energies: minus their forces on the nodes next to each joint, by crossing and rod (c, 2, 3) [N],
    and their moment about the joint on the second rod (c, 3) [N m]."""
    mesh, first = shell.mesh, shell.first_angle
    count = len(mesh.grid.rods)
    pair = np.sort(mesh.grid.crossings.rods, axis=1) @ [count, 1]
    order = np.argsort(pair)
    forces, moments = np.zeros((len(pair), 2, 3)), np.zeros((len(pair), 3))
    linkers = (element for element in shell.within if not is_bends(element))
    for element in (*linkers, *shell.between):
        angles = [c for c in range(element.blocks.shape[1]) if (element.blocks[:, c] >= first).all()]
        if len(element.blocks) == 0:
            continue
        if not angles:  # at one point it transfers none, as a tie; else who knows about which
            if np.ptp(state[element.blocks], axis=1).max() > POINT * mesh.edge_lengths.min():
                raise InputError(
                    f"loads of joints: the energy {type(element).__name__} between rods acts on nodes alone, so that "
                    "the moments of joints are not known: let it act on twist angles too, or ask for reactions"
                )
            continue
        rows, edges = _rows(element, state), element.blocks[:, angles] - first
        rods = mesh.edge_rods[edges]
        extreme = np.column_stack([rods.min(axis=1), rods.max(axis=1)])
        crossing = order[np.searchsorted(pair[order], extreme @ [count, 1])]
        for column, edge, rod in zip(angles, edges.T, rods.T, strict=True):
            side = (mesh.grid.crossings.rods[crossing, 1] == rod).astype(np.intp)
            joint = shell.node_blocks[met[crossing, side]]
            ends = shell.stretch.blocks[edge]
            outer = np.where(ends[:, 0] == joint, ends[:, 1], ends[:, 0])
            at = (element.blocks == outer[:, None]).argmax(axis=1)
            pull = rows[np.arange(len(rows)), at]
            tangent = unit(state[ends[:, 1]] - state[ends[:, 0]])
            torque = np.cross(pull, state[outer] - state[joint]) - rows[:, column, :1] * tangent
            np.subtract.at(forces, (crossing, side), pull)
            np.add.at(moments, crossing, np.where(side[:, None] == 1, torque, 0.0))
    return forces, moments
