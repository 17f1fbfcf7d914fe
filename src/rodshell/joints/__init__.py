"""What a crossing does, and how the rods that meet there share their degrees of freedom."""

from rodshell.joints.ties import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs, Ties
from rodshell.rods.joints import Ball, Joint, Linker, Pin, Rigid, Spring, joint_parameters, require_joint

__all__ = [
    "Ball",
    "Coupling",
    "ExplicitPenalty",
    "ImplicitPenalty",
    "Joint",
    "Linker",
    "Pin",
    "Rigid",
    "SharedDofs",
    "Spring",
    "Ties",
    "joint_parameters",
    "require_joint",
]
