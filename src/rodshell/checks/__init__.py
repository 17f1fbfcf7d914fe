"""Is it safe to build: bending and stress, contact, reactions, deployment, own weight, other shapes."""

from rodshell.checks.bending import Bending, bending, bending_of
from rodshell.checks.check import Checks, check
from rodshell.checks.contact import contact_of
from rodshell.checks.deployment import Deployment, OtherShape, deploy
from rodshell.checks.other_shapes import OtherShapes, other_shapes
from rodshell.checks.reactions import JointLoads, Reactions, joint_loads, reactions
from rodshell.checks.self_weight import self_weight
from rodshell.figures.checks import Clearance, SelfWeight

__all__ = [
    "Bending",
    "Checks",
    "Clearance",
    "Deployment",
    "JointLoads",
    "OtherShape",
    "OtherShapes",
    "Reactions",
    "SelfWeight",
    "bending",
    "bending_of",
    "check",
    "contact_of",
    "deploy",
    "joint_loads",
    "other_shapes",
    "reactions",
    "self_weight",
]
