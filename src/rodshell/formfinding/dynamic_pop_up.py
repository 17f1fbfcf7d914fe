"""The paper's pop-up: the rod ends move from G0 to G in time, and the grid comes to rest [HQK 2.2, 3.2].

Implicit Euler with the chosen coupling, with drag, without load. Pinned ends only: the paper moves nodes.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.formfinding.methods import require_coupling
from rodshell.formfinding.popup import FIRST_RISE, arched, flat_below
from rodshell.formfinding.rest import Rest, joint_gap, out_of_balance
from rodshell.formfinding.trim import Boundary, Footprint, in_layers
from rodshell.geometry.frames import dot
from rodshell.joints import Coupling, Joint, SharedDofs, require_joint
from rodshell.model import Shell
from rodshell.progress import Progress, require_progress, silent
from rodshell.rods.section import Rod
from rodshell.solve.implicit_euler import ImplicitEuler, Motion
from rodshell.solve.linear_stability import step_limit
from rodshell.solve.newton_matrix import narrow_or_sparse
from rodshell.solve.problem import Damping, Supports
from rodshell.solve.simulate import Sample, simulate
from rodshell.validation import instance, keep, not_negative, numbers, positive

BALANCED = 1e-3  # of EI over the square of the shell's half-width: out-of-balance force on a node
STILL = 1e-6  # of the elastic energy: kinetic energy
OF_LIMIT = 0.9  # share of the stability limit of explicit ties that is taken as time step
CHECKS = 10  # steps between two checks whether it is at rest


@dataclass(frozen=True, kw_only=True)
class DynamicPopUpSettings:
    """How the rod ends move from the footprint to the boundary.

    Args:
        coupling: of rods at their joints: shared DOFs, implicit or explicit penalty [HQK 2.2].
        time_step: [s]; with explicit ties at most nine tenths of their stability limit.
        moving_time: time in which the ends reach the boundary, on straight paths, starting and stopping smoothly [s].
        duration: longest simulated time [s]; the motion ends earlier when the grid is at rest.
        drags: rates at which velocities decay [1/s], while the ends move and afterwards. With less drag at first a grid
            can swing through its plane and pop up to the other side.

    Raises:
        InputError: a value is of the wrong kind or sign.
    """

    coupling: Coupling = field(default_factory=SharedDofs)
    time_step: float = 0.01
    moving_time: float = 1.0
    duration: float = 10.0
    drags: tuple[float, float] = (20.0, 3.0)

    def __post_init__(self) -> None:
        keep(self, positive, "s", "time_step", "moving_time", "duration", what="the pop-up's {}")
        require_coupling("the pop-up's coupling", self.coupling)
        given = numbers("the pop-up's drags", self.drags, "two numbers in 1/s", 2)
        drags = tuple(not_negative("the pop-up's drag", drag, "1/s") for drag in given)
        object.__setattr__(self, "drags", drags)


@dataclass(frozen=True, eq=False)
class DynamicPopUp:
    """A shell that popped up in time.

    Args:
        positions: (n, 3) of the footprint's nodes [m].
    """

    positions: Floats
    rest: Rest


def dynamic_pop_up(
    footprint: Footprint,
    boundary: Boundary,
    rod: Rod,
    *,
    joint: Joint | None = None,
    settings: DynamicPopUpSettings = DynamicPopUpSettings(),
    progress: Progress = silent,
) -> DynamicPopUp:
    """Move the rod ends from the footprint to the boundary in time, pinned, from (nearly) flat.

    A flat grid stays flat, in unstable equilibrium: as in `pop_up`, the motion starts from a low arch, with the ends
    moved by a twentieth of their path.

    Args:
        footprint, boundary: where the m rods' ends are and where they go.
        joint: the connection of rods where they cross; ball joints by default.
        settings: coupling, time stepping and drag.
        progress: called as progress(stage, detail, residual) every ten steps.

    Raises:
        StabilityError: explicit ties are too stiff for any step.
        ConvergenceError: a step fails.
    """
    instance("footprint", footprint, Footprint)
    instance("boundary", boundary, Boundary)
    instance("rod", rod, Rod)
    require_joint(joint)
    if isinstance(joint, Sequence):
        raise InputError("joint must be one rodshell joint for all crossings, not a sequence of joints")
    instance("settings", settings, DynamicPopUpSettings)
    require_progress(progress)
    if joint and joint.eccentricity and not footprint.mesh.layered:
        footprint, boundary = in_layers(footprint, boundary, joint.eccentricity)
    mesh = footprint.mesh
    shell = Shell.of(mesh, rod, joint=joint, coupling=settings.coupling)
    ends = mesh.ends.ravel()
    flat = flat_below(mesh, boundary.points)
    state = shell.state(arched(footprint, flat, flat[ends], boundary))

    def supports(time: float) -> Supports:
        elapsed = min(1.0, time / settings.moving_time)
        share = FIRST_RISE + (1 - FIRST_RISE) * elapsed * elapsed * (3 - 2 * elapsed)
        return Supports(shell.held_ends(), shell.ends, (1 - share) * flat[ends] + share * boundary.points)

    motion = Motion.of(shell, constraint=supports)
    step = min(settings.time_step, OF_LIMIT * step_limit(motion, state))
    unit_force = rod.bend_stiffness / (0.5 * float(np.ptp(boundary.points, axis=0).max())) ** 2
    stop = _stop_check(shell, settings.moving_time, BALANCED * unit_force, progress)
    matrix, steps, refused = partial(narrow_or_sparse, coordinates=shell.flat_coordinates), 0, 0
    last = Sample(0.0, state, np.zeros_like(state), motion)
    for rate, until in zip(settings.drags, (settings.moving_time, settings.duration), strict=True):
        if until <= last.time:
            break
        series = simulate(
            replace(last.motion, forces=(Damping(rate=rate),)), last.state, last.velocity,
            start=last.time, until=until, step=step, every=int(until / step) + 2, stop=stop,
            stepper=ImplicitEuler(matrix),
        )  # fmt: skip
        assert series.last is not None
        assert series.report is not None
        last = series.last
        steps, refused = steps + series.report.steps, refused + series.report.refused_steps
    energy, force = _activity(shell, last)
    resting = last.time >= settings.moving_time and _rests(last, energy, force, BALANCED * unit_force)
    gap = joint_gap(shell, last.state)
    rest = Rest(resting, last.time, energy, force, gap, (), steps, refused)
    return DynamicPopUp(shell.positions(last.state), rest)


def _activity(shell: Shell, sample: Sample) -> tuple[float, float]:
    """Kinetic energy [J] and largest out-of-balance force on a free node [N]."""
    force = out_of_balance(sample.motion, sample.state, np.zeros_like(sample.state))
    free = np.delete(np.arange(shell.node_count), shell.ends)
    return sample.motion.kinetic_energy(sample.velocity), float(np.sqrt(dot(force[free], force[free]).max()))


def _rests(sample: Sample, energy: float, force: float, least: float) -> bool:
    return force < least and energy < STILL * sample.motion.elastic_energy(sample.state)


def _stop_check(shell: Shell, moving_time: float, least: float, progress: Progress) -> Callable[[Sample], bool]:
    """Called after each step: reports progress, and every ten steps checks whether the grid is at rest."""
    count = 0

    def stop(sample: Sample) -> bool:
        nonlocal count
        count += 1
        if count % CHECKS:
            return False
        energy, force = _activity(shell, sample)
        progress("pop-up", f"rising, t = {sample.time:.3f} s, kinetic energy {energy:.1e} J", force)
        return sample.time >= moving_time and _rests(sample, energy, force, least)

    return stop
