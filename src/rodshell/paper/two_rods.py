"""Two rods that cross at one joint, of which the first is twisted or turned at a constant rate [HQK 2.3, Fig 4].

Rods of 5 nodes and 4 edges, the paper's section and material. Rod 1 runs from (L/2, 0, 0) to (-L/2, 0, 0), so that
its first node starts where Eq 7 puts it; rod 2 along y.

    twisting (a)   theta_11 = w t. ERRATA E11: the paper leaves rod 1 free in space; its frame then moves, and theta_11
                   counts from it. Its first edge, x_11 and x_12, is held here: its frame is fixed.
    bending (b)    x_11 = L/2 (cos w t, sin w t, 0), x_13 is held. theta_11 is held at 0 as well: nothing else keeps
                   the two rods from turning about rod 1, and a motion in the plane does not feel it.
"""

from collections.abc import Callable
from dataclasses import dataclass
from math import pi
from typing import Literal

import numpy as np

from rodshell.arrays import Floats
from rodshell.geometry.frames import cross, dot
from rodshell.joints import Coupling, ExplicitPenalty, Joint
from rodshell.layout import mesh_grid, straight_rods
from rodshell.model import Shell
from rodshell.paper.cases import ROD
from rodshell.solve.implicit_euler import Motion
from rodshell.solve.linear_stability import step_limit
from rodshell.solve.problem import Supports
from rodshell.solve.simulate import simulate

Demonstration = Literal["twisting", "bending"]

EDGE, LENGTH = 5e-3, 20e-3
RATE = 10 * 2 * pi / 60  # 10 rpm
STEP = 5e-3
NODES = 5
SAFE = 0.6  # of the step limit of explicit ties
SLOW = 1e6  # times slower: inertia is negligible, each step is an equilibrium
STATIC_STEPS = 60  # of such a revolution


@dataclass(frozen=True)
class Run:
    """A demonstration.

    Parameters
    ----------
    demonstration : which one.
    joint, coupling : their names.
    step : of the time stepping [s]; None for statics.
    times : (k,) [s]; of statics those at which the motion reaches each equilibrium.
    angles : (k,) by which rod 2 has turned about the axis of the motion [rad].
    nodes : (k, 2, 5, 3) of rod 1 and rod 2 [m].
    twists : (k, 4) twist angles of rod 1 [rad].
    """

    demonstration: Demonstration
    joint: str
    coupling: str
    step: float | None
    times: Floats
    angles: Floats
    nodes: Floats
    twists: Floats

    @property
    def name(self) -> str:
        """Joint and coupling, and whether it is statics."""
        return f"{self.joint}, {self.coupling}" + (", statics" if self.step is None else "")

    @property
    def prescribed(self) -> Floats:
        """(k,) angle of the first rod [rad]."""
        return RATE * self.times

    @property
    def lag(self) -> Floats:
        """(k,) angle by which rod 2 is behind [rad]."""
        return np.asarray(self.prescribed - self.angles)

    @property
    def start_up_lag(self) -> float:
        """Largest lag at the times recorded [rad]."""
        return float(np.abs(self.lag).max())

    @property
    def rate_error(self) -> float:
        """Of the rotation rate in the second half, by least squares, relative to that prescribed."""
        half = len(self.times) // 2
        return float(np.polyfit(self.prescribed[half:], self.angles[half:], 1)[0] - 1.0)

    @property
    def steady_lag(self) -> float:
        """Mean lag in the second half [rad]."""
        return float(self.lag[len(self.times) // 2 :].mean())

    @property
    def follows(self) -> bool:
        """Whether rod 2 turns with rod 1."""
        return abs(self.rate_error) < 1e-3


def run_in_time(
    demonstration: Demonstration,
    joint: Joint,
    coupling: Coupling,
    *,
    until: float = 2 * pi / RATE,
    step: float = STEP,
) -> Run:
    """The motion from rest.

    Parameters
    ----------
    demonstration, joint, coupling : what is run.
    until : end of the motion [s].
    step : of the record [s]; with explicit ties the time step divides it until it is stable.
    """
    shell = _shell(joint, coupling)
    motion = Motion.of(shell, constraint=_support(shell, demonstration, RATE))
    start = shell.state(shell.mesh.flat)
    every = 1
    if isinstance(coupling, ExplicitPenalty):
        every = int(np.ceil(step / (SAFE * step_limit(motion, start))))
    series = simulate(motion, start, until=until, step=step / every, every=every)
    return _record(shell, demonstration, joint, coupling, step / every, series.times, series.states)


def run_statics(demonstration: Demonstration, joint: Joint, coupling: Coupling, *, until: float = 2 * pi / RATE) -> Run:
    """The equilibria along the motion, which is so slow that each step is one; the joint must hold both rods.

    Parameters
    ----------
    demonstration, joint, coupling : what is run.
    until : end of the motion [s].
    """
    shell = _shell(joint, coupling)
    motion = Motion.of(shell, constraint=_support(shell, demonstration, RATE / SLOW))
    step = SLOW * 2 * pi / RATE / STATIC_STEPS
    series = simulate(motion, shell.state(shell.mesh.flat), until=SLOW * until, step=step)
    return _record(shell, demonstration, joint, coupling, None, series.times / SLOW, series.states)


def _shell(joint: Joint, coupling: Coupling) -> Shell:
    half = LENGTH / 2
    grid = straight_rods([[[half, 0], [-half, 0]], [[0, -half], [0, half]]])
    return Shell.of(mesh_grid(grid, EDGE), ROD, joint=joint, coupling=coupling, twist=True)


def _support(shell: Shell, demonstration: Demonstration, rate: float) -> Callable[[float], Supports]:
    flat, rod, angle = shell.state(shell.mesh.flat), shell.node_blocks[:NODES], shell.first_angle
    moved = np.array([rod[0], rod[1] if demonstration == "twisting" else rod[2], angle])
    free = shell.freedom().with_directions(moved)

    def at(time: float) -> Supports:
        goals = flat[moved]
        if demonstration == "twisting":
            goals[2, 0] = rate * time
        else:
            goals[0] = 0.5 * LENGTH * np.array([np.cos(rate * time), np.sin(rate * time), 0.0])
        return Supports(free, moved, goals)

    return at


def _record(
    shell: Shell,
    demonstration: Demonstration,
    joint: Joint,
    coupling: Coupling,
    step: float | None,
    times: Floats,
    states: Floats,
) -> Run:
    nodes = states[:, shell.node_blocks].reshape(len(times), 2, NODES, 3)
    twists = states[:, shell.first_angle : shell.first_angle + NODES - 1, 0]
    second = nodes[:, 1, -1] - nodes[:, 1, 0]
    axis = np.array([-1.0, 0.0, 0.0] if demonstration == "twisting" else [0.0, 0.0, 1.0])  # rod 1, or the normal
    angles = np.unwrap(np.arctan2(dot(axis, cross(second[0], second)), dot(second[0], second)))
    return Run(demonstration, joint.name, coupling.name, step, times, angles, nodes, twists)
