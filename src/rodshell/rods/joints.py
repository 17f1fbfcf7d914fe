"""Kinds of joints between rods, as data; what they do is in `rodshell.joints`.

A new kind is a class here and a member of `JointKind`.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from math import inf, pi
from typing import Annotated, ClassVar

from rodshell.errors import InputError
from rodshell.quantities import Angle, Corners, Distance, Mass, Stiffness
from rodshell.rods.section import Rod
from rodshell.schema import NoKey, checked, written
from rodshell.validation import brief, described, instance

JointMass = Annotated[Mass, "mass of one joint: its bolt, coupler or clamp"]
Eccentricity = Annotated[Distance, "distance between the two rods' centre lines at a joint"]
RestAngle = Annotated[Angle | None, "angle between the rods at rest; default: as in the flat grid"]


class Joint:
    """What holds two rods together where they cross; a kind gives what it has in place of these values.

    Attributes:
        name: the kind, as in a case file.
        mass: of its bolt, coupler or clamp, at the node [kg].
        eccentricity: distance of the two centre lines along the normal [m]; 0 where they meet.
        shear, out_of_plane, twist, rest_angle: as of `Spring`.
        corners, rod: number of corners of a crossing that have a linker, and of what it is; see `Linker`.
        locks: whether it can be tightened once the shell is erected.
    """

    name: ClassVar[str]
    kind: ClassVar[str]
    mass = eccentricity = shear = out_of_plane = twist = 0.0
    rest_angle: float | None = None
    rod: Rod | None = None
    corners: int = 0
    locks = False
    __repr__ = brief

    def __post_init__(self) -> None:
        stiffnesses = dict.fromkeys(("shear", "out_of_plane", "twist"), "the joint's {} stiffness")
        others = {"mass": "the joint's {}", "eccentricity": "the joint's {}", "rest_angle": "the joint's rest angle"}
        checked(self, stiffnesses | others)
        if not -pi <= (self.rest_angle or 0.0) <= pi:
            raise InputError(f"the joint's rest angle must lie between -pi and pi, not {self.rest_angle} rad")

    @property
    def turns_frames(self) -> bool:
        """Whether it transmits moments between the frames of its rods, so that their twist matters."""
        return self.resists_shear or self.holds_normals

    @property
    def holds_normals(self) -> bool:
        """Whether it prevents its rods from spinning about themselves; a spring in shear alone does not."""
        return self.out_of_plane + self.twist > 0 or self.eccentricity != 0.0

    @property
    def resists_shear(self) -> bool:
        """Whether it transmits moments about its normal, which bend its rods within the shell."""
        return self.shear > 0


@dataclass(frozen=True, repr=False)
class Ball(Joint):
    """Holds the rods' centre lines together and leaves every rotation free [Baek et al., cited in HQK section 1].

    It has no eccentricity: rods a distance apart would roll over each other.
    """

    mass: JointMass = 0.0
    kind: ClassVar = "ball"
    name = "ball"


@dataclass(frozen=True, kw_only=True, repr=False)
class Pin(Joint):
    """An axis along the normal of both rods: they scissor freely, and share their normal [Panetta et al. 2019]."""

    eccentricity: Eccentricity = 0.0
    mass: JointMass = 0.0
    kind: ClassVar = "pin"
    name = "pin"
    out_of_plane = twist = inf
    locks = True


@dataclass(frozen=True, kw_only=True, repr=False)
class Rigid(Joint):
    """Welded or clamped: the rods keep the angle at which they were joined.

    Args:
        rest_angle: angle from the first rod's direction to the second's about the normal [rad]; None: as in the flat
            grid.
    """

    rest_angle: RestAngle = None
    eccentricity: Eccentricity = 0.0
    mass: JointMass = 0.0
    kind: ClassVar = "rigid"
    name = "rigid"
    shear = out_of_plane = twist = inf


@dataclass(frozen=True, repr=False)
class Spring(Joint):
    """Elastic in all three rotations. The stiffnesses are those of the joint and do not depend on the mesh.

    Args:
        shear: about the normal [N m/rad]; `inf` is rigid.
        out_of_plane, twist: of a corner, about the axis in the plane across the corner's bisector, and about it
            [N m/rad]. Where rods cross, the twist of one corner is the out-of-plane turn of the next: the four corners
            together have the mean of both in every direction. They differ only where two rods end in one corner. The
            bisector is that of the directions of a path around the corner, in along one rod and out along the other.
        rest_angle: angle from the first rod's direction to the second's about the normal at rest [rad]; None: as in the
            flat grid.

    Raises:
        InputError: a value is negative; an eccentric spring without out-of-plane and twist stiffness.
    """

    shear: Annotated[Stiffness, "stiffness of the joint about its normal"] = 0.0
    out_of_plane: Annotated[Stiffness, "stiffness of a corner across its bisector"] = 0.0
    twist: Annotated[Stiffness, "stiffness of a corner about its bisector"] = 0.0
    rest_angle: RestAngle = None
    eccentricity: Eccentricity = 0.0
    mass: JointMass = 0.0
    kind: ClassVar = "spring"
    name = "spring"

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.eccentricity and not self.out_of_plane + self.twist > 0:
            raise InputError(
                "an eccentric spring without out-of-plane and twist stiffness lets its rods roll over each other: give "
                'it one of them, or use a pin (kind = "pin"), which is rigid in both'
            )


@dataclass(frozen=True, kw_only=True, repr=False)
class Linker(Joint):
    """The paper's joint: 3-node linker rods from an edge of one rod to an edge of the other [HQK 2.2, Eq 6].

    A linker bends and twists, has no stretch energy and no mass, and is at rest on the flat grid.
    ERRATA E10: with the paper's two linkers, in opposite corners, the joint is chiral, and its stiffness depends on
    the mesh: about the normal 8 EI over the edge length at a right angle.

    Args:
        rod: section and material of the linkers; None: those of the rods.
        corners: 2 as in the paper, or 4, which is symmetric.
    """

    rod: Annotated[Rod | None, NoKey("joints with linkers of another rod")] = None
    corners: Annotated[Corners, "corners of a crossing that have a linker: 2 as in the paper, or 4"] = 2
    mass: JointMass = 0.0
    kind: ClassVar = "linker"
    name = "linker"
    turns_frames = holds_normals = resists_shear = True

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.rod is not None:
            instance("the rod of a linker", self.rod, Rod)


def require_joint(joint: object) -> None:
    """Refuse a value that is neither a joint, nor a sequence of joints, nor None, such as a kind's name or class."""
    several = isinstance(joint, Sequence) and not isinstance(joint, str)  # and no array or generator
    for value in joint if several else (joint,):  # type: ignore[attr-defined]
        if value is not None and (isinstance(value, type) or not hasattr(value, "turns_frames")):
            raise InputError(f"joint must be a rodshell joint such as rodshell.Pin(), not {described(value)}")


def joint_parameters(joint: Joint) -> dict[str, object]:
    """The joint's kind and values in SI, as they stand in a case file."""
    return written(joint) | ({} if joint.rod is None else {"rod": joint.rod.parameters()})


JointKind = Ball | Pin | Spring | Linker | Rigid
