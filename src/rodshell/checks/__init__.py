"""Is it safe to build: bending and stress, reactions and their balance, the way up from flat."""

from rodshell.checks.bending import Bending, bending, bending_of, curvatures, fibre_distance, fibre_strain
from rodshell.checks.check import Checks, check, settled_shell
from rodshell.checks.deployment import Deployment, Elsewhere, deploy
from rodshell.checks.joint_loads import JointLoads, joint_loads
from rodshell.checks.other_shapes import OtherShape, OtherShapes, other_shapes
from rodshell.checks.reactions import Reactions, reactions

__all__ = [
    "Bending",
    "Checks",
    "Deployment",
    "Elsewhere",
    "JointLoads",
    "OtherShape",
    "OtherShapes",
    "Reactions",
    "bending",
    "bending_of",
    "check",
    "curvatures",
    "deploy",
    "fibre_distance",
    "fibre_strain",
    "joint_loads",
    "other_shapes",
    "reactions",
    "settled_shell",
]
