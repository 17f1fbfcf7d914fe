"""Joints that are tightened once the shell is erected and braced: pins that turn no more about their normal.

A pin is free to scissor while the grid is erected. Tightened, it resists: a spring about the joint's normal, at rest at
the angle at which the rods then cross. So locking changes neither the shape nor any force of the erected shell; loads
find a shell that is stiff in shear. The spring acts in series with the half edges of both rods, as every joint does
(`joints.joint`), and in parallel with the pin's other two rotations, which are rigid before and after.
"""

from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Ints
from rodshell.errors import InputError
from rodshell.joints import Joint, Pin, Spring
from rodshell.joints.crossings import RodNodes, stencils
from rodshell.joints.joint import elastic_joints
from rodshell.joints.relative_rotation import RelativeRotation
from rodshell.loads.structure import Structure
from rodshell.model.rod_sections import RodSections
from rodshell.validation import brief, keep, not_negative, positive


@dataclass(frozen=True, kw_only=True)
class LockedJoints:
    """Pins that are tightened before loads act.

    Parameters
    ----------
    shear : stiffness of a tightened joint about its normal [N m/rad]; `inf` is rigid.
    slip : moment about the normal that it transfers before it slips [N m]; None: not known. With `Strength.slip` both
        count together.

    Raises
    ------
    InputError : a value is not positive.
    """

    shear: float
    slip: float | None = None

    __repr__ = brief

    def __post_init__(self) -> None:
        keep(self, not_negative, "N m/rad", "shear", what="the {} stiffness of locked joints", infinite=True)
        keep(self, positive, "N m", "slip", what="the moment at which locked joints {}")
        if self.shear == 0:
            raise InputError("locked joints without shear stiffness are free: give one, or leave locked_joints out")

    def require_pins(self, joint: Joint) -> None:
        """Raise InputError where joints of a kind cannot be locked."""
        if not isinstance(joint, Pin):
            raise InputError(
                f"locked_joints: {joint.name} joints cannot be locked: pins are free about their normal until they are "
                'tightened: set joint.kind = "pin", or leave locked_joints out'
            )

    def lock(self, structure: Structure) -> Structure:
        """The structure with its joints locked as it stands, in the same equilibrium.

        Parameters
        ----------
        structure : erected and braced, its joints pins.
        """
        shell, before = structure.shell, structure.equilibrium
        mesh = shell.mesh
        rod_nodes = RodNodes(mesh, shell.node_blocks, shell.first_angle)
        crossings = np.arange(len(mesh.grid.crossings))
        sections = RodSections.of(mesh, [structure.rod] * len(mesh.grid.rods)).nodes
        wanted = [Spring(shear=self.shear)] * len(crossings)
        springs = elastic_joints(rod_nodes, crossings, wanted, sections, len(shell.like))
        pins = [element for element in shell.between if isinstance(element, RelativeRotation)]
        locks = tuple(
            replace(
                pin,  # with its source frames, in which the twist angles are
                stiffness=spring.stiffness,
                rest_angle=pin.rest_angle + pin.strains(before.state)[:, 0],
            )
            for pin, spring in zip(pins, springs, strict=True)
        )
        count = len(shell.elements)
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
