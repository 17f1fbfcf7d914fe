"""Whether something that moved has come to rest, and how firmly it rests there."""

from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Floats
from rodshell.contact.modified_mass import Touching
from rodshell.geometry.vectors import dot
from rodshell.model import Freedom, Shell
from rodshell.solve.implicit_euler import Motion
from rodshell.solve.linear_stability import slowest_modes
from rodshell.targets import Target

MODES = 4


@dataclass(frozen=True)
class Rest:
    """How a motion ended.

    Parameters
    ----------
    time : simulated [s].
    kinetic_energy : [J]; force_residual : largest out-of-balance force on a node, along its free directions [N].
    joint_gap : largest distance between two rods at a joint, where a penalty lets them part [m].
    growth : (k,) lowest s of K x = s M x [1/s2] with the touching nodes free in their planes: a negative one grows as
        exp(sqrt(-s) t) if nothing rubs. Empty where the motion is not at rest.
    steps, refused_steps : taken, and tried in vain.
    """

    at_rest: bool
    time: float
    kinetic_energy: float
    force_residual: float
    joint_gap: float
    growth: tuple[float, ...]
    steps: int
    refused_steps: int

    @property
    def fastest_growth(self) -> float:
        """Of the unstable modes [1/s]; 0 where there is none."""
        return float(np.sqrt(max(0.0, -min(self.growth, default=0.0))))


def out_of_balance(motion: Motion, state: Floats, load: Floats) -> Floats:
    """(N, 3) gradient of all energies less the load [N]: what supports and contact must carry."""
    gradient = -load
    for element in (*motion.elements, *motion.explicit):
        element.evaluate(state, gradient)
    return gradient


def held_back(motion: Motion, state: Floats, load: Floats, touching: Touching) -> float:
    """Largest force [N] on a node that neither its supports nor contact nor friction balance."""
    gradient = out_of_balance(motion, state, load)
    free = touching.freedom(state)
    along = np.einsum("ncx,nx->nc", free.directions, gradient)
    along[np.arange(3) >= free.count[:, None]] = 0.0
    return float(np.sqrt(dot(along, along).max(initial=0.0)))


def lowest_modes(motion: Motion, state: Floats, load: Floats, touching: Touching, target: Target) -> tuple[float, ...]:
    """The lowest s [1/s2] of the state with its touching nodes sliding on the target, without friction."""
    sliding = replace(touching, stuck=np.zeros(len(touching.nodes), dtype=bool))
    free = sliding.freedom(state)
    count = free.count.copy()
    count[touching.nodes] -= 1
    gap = target.contact(state[touching.nodes])
    push = np.maximum(dot(out_of_balance(motion, state, load)[touching.nodes], gap.normal), 0.0)
    curvature = np.zeros((len(state), 3, 3))
    curvature[touching.nodes] = -push[:, None, None] * gap.hessian
    return tuple(slowest_modes(motion, state, Freedom(free.directions, count), curvature, MODES).tolist())


def joint_gap(shell: Shell, state: Floats) -> float:
    """Largest distance between two rods at a joint [m]."""
    apart = state[shell.node_blocks] - shell.positions(state)[shell.mesh.rod_nodes]
    return 2.0 * float(np.sqrt(dot(apart, apart).max()))
