"""Joint kinds: how the rods at a crossing can turn relative to each other.

One concept covers them all: three stiffnesses [N m/rad] against the turning of the rods' sections relative to each
other, about the joint's normal (the shear of the grid), out of a corner's plane, and about a corner's bisector (its
twist). A ball joint has none, a pin (the scissor joint of X-shells) is free about the normal and rigid in the other
two, a rigid joint is rigid in all. The paper's linker rods are the exception: bends from edge to edge (`Linker`).
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from math import inf, pi
from typing import Literal, Protocol

from rodshell.errors import InputError
from rodshell.rods.section import Rod
from rodshell.validation import brief, described, instance, not_negative, number


class Joint(Protocol):
    """What holds two rods together where they cross.

    Attributes
    ----------
    name : the kind, as in a case file.
    eccentricity : distance of the two centre lines along the normal [m]; 0 where they meet.
    mass : of its bolt, coupler or clamp, at the node [kg].
    """

    @property
    def name(self) -> str: ...
    @property
    def eccentricity(self) -> float: ...
    @property
    def mass(self) -> float: ...
    @property
    def turns_frames(self) -> bool:
        """Whether it transmits moments between the frames of its rods, so that their twist matters."""
        ...

    @property
    def holds_normals(self) -> bool:
        """Whether it prevents its rods from spinning about themselves; a spring in shear alone does not."""
        ...


@dataclass(frozen=True)
class Ball:
    """Holds the rods' centre lines together and leaves every rotation free [Baek et al., cited in HQK section 1].

    It has no eccentricity: rods a distance apart would roll over each other.

    Parameters
    ----------
    mass : of its bolt or coupler [kg].
    """

    mass: float = 0.0
    name = "ball"
    shear = out_of_plane = twist = eccentricity = 0.0
    rest_angle = None
    turns_frames = holds_normals = False

    __repr__ = brief

    def __post_init__(self) -> None:
        _check_mass(self.mass)


@dataclass(frozen=True, kw_only=True)
class Pin:
    """An axis along the normal of both rods: they scissor freely, and share their normal [Panetta et al. 2019].

    Parameters
    ----------
    eccentricity : distance of the two centre lines along the normal [m].
    mass : of its bolt [kg].
    """

    eccentricity: float = 0.0
    mass: float = 0.0
    name = "pin"
    shear, out_of_plane, twist = 0.0, inf, inf
    rest_angle = None
    turns_frames = holds_normals = True

    __repr__ = brief

    def __post_init__(self) -> None:
        _check_eccentricity(self.eccentricity)
        _check_mass(self.mass)


@dataclass(frozen=True, kw_only=True)
class Rigid:
    """Welded or clamped: the rods keep the angle at which they were joined.

    Parameters
    ----------
    rest_angle : angle from the first rod's direction to the second's about the normal [rad]; None: as in the flat grid.
    eccentricity : distance of the two centre lines along the normal [m].
    mass : of its clamp or weld [kg].
    """

    rest_angle: float | None = None
    eccentricity: float = 0.0
    mass: float = 0.0
    name = "rigid"
    shear = out_of_plane = twist = inf
    turns_frames = holds_normals = True

    __repr__ = brief

    def __post_init__(self) -> None:
        _check_rest_angle(self.rest_angle)
        _check_eccentricity(self.eccentricity)
        _check_mass(self.mass)


@dataclass(frozen=True)
class Spring:
    """Elastic in all three rotations. The stiffnesses are those of the joint and do not depend on the mesh.

    Parameters
    ----------
    shear : about the normal [N m/rad]; `inf` is rigid.
    out_of_plane, twist : of a corner, about the axis in the plane across the corner's bisector, and about it
        [N m/rad]. Where rods cross, the twist of one corner is the out-of-plane turn of the next: the four corners
        together have the mean of both in every direction. They differ only where two rods end in one corner. The
        bisector is that of the directions of a path around the corner, in along one rod and out along the other.
    rest_angle : angle from the first rod's direction to the second's about the normal at rest [rad]; None: as in the
        flat grid.
    eccentricity : distance of the two centre lines along the normal [m].
    mass : of the joint [kg].

    Raises
    ------
    InputError : a value is negative; an eccentric spring without out-of-plane and twist stiffness.
    """

    shear: float = 0.0
    out_of_plane: float = 0.0
    twist: float = 0.0
    rest_angle: float | None = None
    eccentricity: float = 0.0
    mass: float = 0.0
    name = "spring"

    __repr__ = brief

    def __post_init__(self) -> None:
        for name in ("shear", "out_of_plane", "twist"):
            not_negative(f"the joint's {name} stiffness", getattr(self, name), "N m/rad", infinite=True)
        _check_rest_angle(self.rest_angle)
        _check_eccentricity(self.eccentricity)
        if self.eccentricity and not self.out_of_plane + self.twist > 0:
            raise InputError(
                "an eccentric spring without out-of-plane and twist stiffness lets its rods roll over each other: give "
                'it one of them, or use a pin (kind = "pin"), which is rigid in both'
            )
        _check_mass(self.mass)

    @property
    def turns_frames(self) -> bool:
        """Whether it transmits moments between the frames of its rods: any stiffness does."""
        return self.shear > 0 or self.holds_normals

    @property
    def holds_normals(self) -> bool:
        """Whether it prevents its rods from spinning about themselves: stiffness in shear alone does not."""
        return self.out_of_plane + self.twist > 0 or self.eccentricity != 0.0


@dataclass(frozen=True, kw_only=True)
class Linker:
    """The paper's joint: 3-node linker rods from an edge of one rod to an edge of the other [HQK 2.2, Eq 6].

    A linker bends and twists, has no stretch energy and no mass, and is at rest on the flat grid.
    ERRATA E10: with the paper's two linkers, in opposite corners, the joint is chiral, and its stiffness depends on
    the mesh: about the normal 8 EI over the edge length at a right angle.

    Parameters
    ----------
    rod : section and material of the linkers; None: those of the rods.
    corners : 2 as in the paper, or 4, which is symmetric.
    mass : of the joint [kg].
    """

    rod: Rod | None = None
    corners: Literal[2, 4] = 2
    mass: float = 0.0
    name = "linker"
    eccentricity = 0.0
    turns_frames = holds_normals = True

    __repr__ = brief

    def __post_init__(self) -> None:
        _check_mass(self.mass)
        if self.rod is not None:
            instance("the rod of a linker", self.rod, Rod)
        if self.corners not in (2, 4):
            raise InputError(f"a joint has linkers in 2 or 4 of its corners, not in {self.corners!r}")


def require_joint(joint: object) -> None:
    """Refuse a value that is neither a joint, nor a sequence of joints, nor None.

    Parameters
    ----------
    joint : what a caller has passed.

    Raises
    ------
    InputError : it is something else, such as the name of a kind, or the class itself.
    """
    several = isinstance(joint, Sequence) and not isinstance(joint, str)
    for value in joint if several else (joint,):  # type: ignore[attr-defined]
        if value is not None and (isinstance(value, type) or not hasattr(value, "turns_frames")):
            raise InputError(f"joint must be a rodshell joint such as rodshell.Pin(), not {described(value)}")


def joint_parameters(joint: Joint) -> dict[str, object]:
    """The joint's kind and values in SI, as they stand in a case file."""
    values = {"kind": joint.name, **asdict(joint)}  # type: ignore[call-overload]
    linker = values.pop("rod", None)
    if linker is not None:
        values["rod"] = joint.rod.parameters()  # type: ignore[attr-defined]
    return {name: "rigid" if value == inf else value for name, value in values.items() if value is not None}


Elastic = Ball | Pin | Rigid | Spring


def _check_eccentricity(value: float) -> None:
    not_negative("the joint's eccentricity", value, "m")


def _check_mass(value: float) -> None:
    not_negative("the joint's mass", value, "kg")


def _check_rest_angle(value: float | None) -> None:
    if value is not None:
        number("the joint's rest angle", value, "rad")
        if not -pi <= value <= pi:
            raise InputError(f"the joint's rest angle must lie between -pi and pi, not {value} rad")
