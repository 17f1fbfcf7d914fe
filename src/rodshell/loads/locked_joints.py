"""Joints that are tightened once the shell is erected and braced: pins that turn no more about their normal.

A pin is free to scissor while the grid is erected. Tightened, it resists: a spring about the joint's normal, at rest at
the angle at which the rods then cross. So locking changes neither the shape nor any force of the erected shell; loads
find a shell that is stiff in shear. The spring acts in series with the half edges of both rods, as every joint does
(`joints.joint`), and in parallel with the pin's other two rotations, which are rigid before and after.
"""

from dataclasses import replace

import numpy as np

from rodshell.arrays import Ints
from rodshell.joints import Spring
from rodshell.joints.crossings import RodNodes, stencils
from rodshell.joints.joint import elastic_joints
from rodshell.joints.relative_rotation import is_elastic
from rodshell.loads.settings import LockedJoints
from rodshell.loads.structure import Structure
from rodshell.model.rod_sections import RodSections


def locked(joints: LockedJoints, structure: Structure) -> Structure:
    """The structure, erected, braced and with pins, with its joints locked as it stands, in the same equilibrium."""
    shell, before = structure.shell, structure.equilibrium
    mesh = shell.mesh
    rod_nodes = RodNodes(mesh, shell.node_blocks, shell.first_angle)
    crossings = np.arange(len(mesh.grid.crossings))
    sections = RodSections.of(mesh, [structure.rod] * len(mesh.grid.rods)).nodes
    wanted = [Spring(shear=joints.shear)] * len(crossings)
    springs = elastic_joints(rod_nodes, crossings, wanted, sections, len(shell.like))
    pins = filter(is_elastic, shell.between)
    locks = tuple(
        replace(
            pin,  # with its source frames, in which the twist angles are
            stiffness=spring.stiffness,
            rest_angle=pin.rest_angle + pin.strains(before.state)[:, 0],
        )
        for pin, spring in zip(pins, springs, strict=True)
    )
    count = len(shell.within) + len(shell.between)
    elements = (*before.elements[:count], *locks, *before.elements[count:])
    problem = replace(before.problem, elements=elements)
    return replace(
        structure,
        shell=replace(shell, between=(*shell.between, *locks)),
        equilibrium=replace(before, problem=problem),
        locked=_groups(rod_nodes),
    )


def _groups(rod_nodes: RodNodes) -> tuple[Ints, ...]:
    """The crossings of each set of joints that are alike, in the order of their elements."""
    return tuple(np.flatnonzero(group.members) for group in stencils(rod_nodes, rod_nodes.at_crossings))
