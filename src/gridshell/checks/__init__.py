"""Is it safe to build: bending and stress, reactions and their balance, the way up from flat."""

from gridshell.checks.bending import Bending, bending, bending_of, curvatures, fibre_distance, fibre_strain
from gridshell.checks.check import Checks, check, settled_shell
from gridshell.checks.deployment import Deployment, deploy
from gridshell.checks.joint_loads import JointLoads, joint_loads
from gridshell.checks.reactions import Reactions, reactions

__all__ = [
    "Bending",
    "Checks",
    "Deployment",
    "JointLoads",
    "Reactions",
    "bending",
    "bending_of",
    "check",
    "curvatures",
    "deploy",
    "fibre_distance",
    "fibre_strain",
    "joint_loads",
    "reactions",
    "settled_shell",
]
