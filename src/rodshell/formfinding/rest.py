"""Whether a motion has come to rest, how stable it is there, and what would bring it to rest otherwise."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from rodshell.arrays import Floats, Forces, State
from rodshell.contact.modified_mass import Touching
from rodshell.geometry.frames import dot
from rodshell.model import Freedom, Shell
from rodshell.solve.implicit_euler import Motion
from rodshell.solve.linear_stability import slowest_modes
from rodshell.targets import Target

MODES = 4
LONGEST = 5.0  # usual durations: a longer fall is not proposed
CALM = 0.5  # of the usual duration, in which the proposed drag brings the grid to rest
SPARE = 1.5  # of the duration that the observed decay predicts: the slowest oscillation decays last

Energies = Sequence[tuple[float, float]]  # times [s] and kinetic energies [J]


@dataclass(frozen=True)
class Rest:
    """How a motion ended.

    Args:
        at_rest: whether kinetic energy and out-of-balance force are below their limits.
        time: simulated [s].
        kinetic_energy: [J].
        force_residual: largest out-of-balance force on a node, along its free directions [N].
        joint_gap: largest distance between two rods at a joint, where a penalty lets them separate [m].
        growth: (k,) lowest s of K x = s M x [1/s2] with the touching nodes free in their tangent planes: a negative one
            grows as exp(sqrt(-s) t) without friction. Empty where the motion is not at rest.
        steps, refused_steps: number of time steps taken, and of those that failed and were repeated with a shorter
            step.
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
        """Rate of the fastest unstable mode [1/s]; 0 where there is none."""
        return float(np.sqrt(max(0.0, -min(self.growth, default=0.0))))


def out_of_balance(motion: Motion, state: State, load: Forces) -> Floats:
    """(N, 3) gradient of all energies less the load [N]: what supports and contact must carry."""
    return motion.energies.gradient(state) - load


def unbalanced_force(motion: Motion, state: State, load: Forces, touching: Touching) -> float:
    """Largest force on a node that neither its supports nor contact nor friction balance [N].

    Args:
        touching: the nodes in contact with the target.
    """
    gradient = out_of_balance(motion, state, load)
    free = touching.freedom(state)
    along = np.einsum("ncx,nx->nc", free.directions, gradient)
    along[np.arange(3) >= free.count[:, None]] = 0.0
    return float(np.sqrt(dot(along, along).max(initial=0.0)))


def lowest_modes(motion: Motion, state: State, load: Forces, touching: Touching, target: Target) -> tuple[float, ...]:
    """The lowest s of K x = s M x [1/s2] with the touching nodes sliding on the target, without friction.

    Args:
        touching: the nodes in contact with the target.
    """
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
    """Largest distance between two rods at a joint [m], of a state (N, 3)."""
    apart = state[shell.node_blocks] - shell.positions(state)[shell.mesh.rod_nodes]
    return 2.0 * float(np.sqrt(dot(apart, apart).max()))


def rest_advice(energies: Energies, still: float, force: float, usual: float, drag: float) -> str:
    """A drag and a duration that would bring a fall to rest, as a part of a sentence.

    A drag c makes velocities decay as exp(-c t / 2) where it is far from critical, and energies as exp(-c t).

    Args:
        energies: times [s] and kinetic energies [J] of the fall that was too short.
        still: kinetic energy that counts as rest [J].
        force: out-of-balance force over that which counts as rest [-]; energies are proportional to its square.
        usual: duration of a fall on such a target [s].
        drag: of that fall [1/s].
    """
    words = []
    most = max((energy for _, energy in energies), default=0.0)
    enough = float(np.log(max(most / still, 1.0))) / (CALM * usual)
    if enough > drag:
        words.append(f"a drag of {enough:.1g} 1/s (drape.drag)")
    rate, peak = energy_decay(energies)
    ended = energies[-1][0] if energies else 0.0
    more = np.log(max(peak / still, force**2, 1.0)) / rate if rate > 0 else np.inf
    duration = usual if ended < 0.5 * usual else ended + SPARE * more
    if duration < LONGEST * usual:
        words.append(f"some {np.ceil(duration):.0f} s (drape.duration)")
    return ", or ".join(words) or "friction (drape.friction)"


def energy_decay(energies: Energies) -> tuple[float, float]:
    """Rate at which the kinetic energy decayed over the last half of the time [1/s], and its last peak [J].

    Peaks are compared, since the energy oscillates; the rate is 0 where too few energies are given.

    Args:
        energies: times [s] and kinetic energies [J], in ascending order of time.
    """
    times, values = np.array(energies, dtype=float).reshape(-1, 2).T
    end = times[-1] if len(times) else 0.0
    before, last = (times > 0.5 * end) & (times <= 0.75 * end), times > 0.75 * end
    if not (before.any() and last.any() and values[last].any()):
        return 0.0, 0.0
    peak = float(values[last].max())
    return float(np.log(values[before].max() / peak)) / (0.25 * end), peak
