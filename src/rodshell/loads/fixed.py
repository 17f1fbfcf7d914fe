"""A combination as what a refinement takes: a factor on the shell's own weight, and forces that stay as they are."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.figures.records import Ends
from rodshell.formfinding.pipeline import Stages
from rodshell.loads.check import tributary_of
from rodshell.loads.combinations import Loads
from rodshell.loads.kinds import Forces, SelfWeight
from rodshell.loads.nodes import LoadedNodes
from rodshell.units import shown


def fixed_forces(stages: Stages, ends: Ends, loads: Loads, combination: str) -> tuple[float, Floats]:
    """What a shell carries under one combination.

    Args:
        stages: of a form in one piece, popped up with these ends.

    Returns:
        The factor on the weight of rods and joints, which changes with a design, and (n, 3) all other forces on the
        mesh's nodes [N].

    Raises:
        InputError: the form is in patches, braced, or has joints that are locked; a load is not a force; the rods have
            no mass.
    """
    wish = f"refine.under = {shown(combination)}"
    if stages.patches:
        raise InputError(f'{wish}: a form in patches is refined without loads, or under = "weight"')
    if loads.bracing is not None:
        raise InputError(f"{wish}: a shell is refined without its bracing, which is fitted to it later: leave one out")
    if loads.locked_joints is not None:
        raise InputError(f"{wish}: a shell is refined before its joints are locked: leave one out")
    popped = stages.popped[ends]
    mass = popped.shell.mass[: popped.shell.node_count, 2]
    nodes = LoadedNodes(popped.positions, mass, tributary_of(stages), stages.layout.least_spacing)
    weight, forces = 0.0, np.zeros((len(mass), 3))
    for name, factor in loads.combinations[combination].items():
        load = loads.loads[name]
        if not isinstance(load, Forces):
            raise InputError(f"{wish}: its load {shown(name)} is not a force: name a combination without it")
        forces += factor * load.forces(nodes)
        if isinstance(load, SelfWeight):
            weight += factor
            forces -= factor * SelfWeight().forces(nodes)
    return weight, forces
