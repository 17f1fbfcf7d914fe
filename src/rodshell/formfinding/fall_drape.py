"""The fall drape, the paper's method: the grid falls on the target in time and comes to rest there [HQK section 3].

Implicit Euler, the rods tied by the coupling, contact by modified masses (`contact.modified_mass`). Nothing is
anchored: without friction the draped state is unstable sideways, and it is reached because the fall is symmetric, or
because touching nodes that are stopped at each step creep. How fast it would slide away is part of the result.
"""

from collections.abc import Callable
from dataclasses import replace
from functools import partial
from time import process_time

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.contact.modified_mass import ModifiedMass, Touching
from rodshell.errors import ConvergenceError, OutOfTimeError, StabilityError
from rodshell.formfinding.finite_sections import middle_surface
from rodshell.formfinding.gravity_drape import anchor_point, initial_grid, lost_contact, middle_marks, placed_over
from rodshell.formfinding.methods import Draped, DrapeFigures, Fall, smallest_joint_angle
from rodshell.formfinding.rest import (
    LONGEST,
    Rest,
    energy_decay,
    joint_gap,
    lowest_modes,
    out_of_balance,
    rest_advice,
    unbalanced_force,
)
from rodshell.geometry.frames import dot
from rodshell.joints import ImplicitPenalty, Joint
from rodshell.layout import GridLayout, mesh_grid
from rodshell.model import Shell
from rodshell.progress import Progress, silent
from rodshell.rods.section import Rod
from rodshell.solve.equilibrium import SolveReport, Status
from rodshell.solve.implicit_euler import ContactEuler, Motion
from rodshell.solve.linear_stability import NO_NODES, REMEDY, ExplicitTies, step_limit
from rodshell.solve.newton_matrix import narrow_or_sparse
from rodshell.solve.problem import Damping, GravityForce
from rodshell.solve.simulate import End, Sample, TimeSeries, simulate
from rodshell.targets import Target

STILL = 1e-7  # of weight times size: kinetic energy
BALANCED = 1e-3  # of the weight of the heaviest node: out-of-balance force on a node
USUAL_STEP = 0.01  # [s] on a target of 0.2 m; times are proportional to the square root of lengths
USUAL_DURATION = 6.0
USUAL_DRAG = 12.0  # [1/s]: near critical for the tails, which swing longest and else for more than 6 s
USUAL_SIZE = 0.2  # [m]
OF_LIMIT = 0.9  # share of the stability limit of explicit ties, whichever nodes touch, that is taken as time step
UNSTABLE = -1e-3  # [1/s2]: the free turn about the vertical has 0 up to round-off
CHECKS = 10  # steps between two checks whether it is at rest
CREEPS = (
    "its kinetic energy no longer falls, it creeps sideways, where nothing holds it; friction may hold it "
    '(drape.friction), or use method = "bound"'
)
SLOW = 20.0  # s of processor time, after which the fall says what makes it slow
LIMITS = 4  # checks for rest between two checks of the step limit


def fall_drape(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    fall: Fall,
    *,
    anchor: tuple[float, float] | None = None,
    joint: Joint | None = None,
    progress: Progress = silent,
) -> Draped:
    """Let a layout fall on a target in time; see `drape`.

    Args:
        fall: height, time stepping, coupling, impacts, friction and drag.
        anchor: x, y of the point of the target under the layout's middle [m]; default: the target's highest point.

    Raises:
        InputError: the anchor lies outside the target.
        StabilityError: the time step is beyond the stability limit of explicit ties, at the start or after landing.
        ConvergenceError: the first step fails, however small. Where a later step fails, the fall ends, not at rest.
    """
    top = anchor_point(target, anchor)
    grid = initial_grid(target, layout, anchor)
    mesh = mesh_grid(grid, layout.edge, marks=middle_marks(grid))
    shell = Shell.of(mesh, rod, joint=joint, coupling=fall.coupling)
    simulation = _FallSimulation(target, shell, fall, progress)
    series = simulation.run(placed_over(shell.mesh, layout, top + [0.0, 0.0, fall.height]))
    rest, report = simulation.outcome(series)
    assert series.last is not None
    positions = middle_surface(mesh, shell.mesh, shell.positions(series.last.state))
    if report.status is not Status.OUT_OF_TIME and lost_contact(mesh, positions, layout, top, target):
        report = replace(report, status=Status.LOST_CONTACT, reason="")
    angle, where = smallest_joint_angle(mesh, positions, target.margin(positions) > 0)
    figures = DrapeFigures(
        max_gap=float(max(0.0, -target.contact(positions).distance.min())),
        contact_pulls=simulation.contact_pulls(series.last),
        min_angle=angle,
        min_angle_at=where,
    )
    return Draped(
        method=fall,
        target=target,
        layout=layout,
        rod=rod,
        anchor=anchor,
        eccentricity=joint.eccentricity if joint else 0.0,
        mesh=mesh,
        positions=positions,
        rods=grid.rods,
        levels=(report,),
        figures=figures,
        rest=rest,
        warnings=_warnings(rest, report, simulation),
    )


class _FallSimulation:
    """A fall, with the checks that are made during it and at its end."""

    def __init__(self, target: Target, shell: Shell, fall: Fall, progress: Progress) -> None:
        massive = np.flatnonzero(shell.like < shell.mesh.node_count)  # also the linkers' nodes, which fall and land
        all_massive = len(massive) == len(shell.like)  # then a slice, which is faster
        pull = GravityForce(slice(None) if all_massive else massive, (0.0, 0.0, -fall.acceleration))
        self._slowness = float(np.sqrt(target.size / USUAL_SIZE))
        self.drag = USUAL_DRAG / self._slowness if fall.drag is None else fall.drag
        self.motion = Motion.of(shell, forces=(pull, Damping(rate=self.drag)))
        self.target, self.shell, self.fall, self._progress = target, shell, fall, progress
        self.load = pull.held(0.0, np.zeros_like(shell.mass), np.zeros_like(shell.mass), shell.mass)
        self._still = STILL * float(-self.load[:, 2].sum()) * target.size
        self._balanced = BALANCED * float(-self.load[:, 2].min())
        self._law = ModifiedMass(target, massive, fall.stopped, fall.friction)
        self.stepper = ContactEuler(self._law, partial(narrow_or_sparse, coordinates=shell.flat_coordinates))
        self._ties: ExplicitTies | None = None
        self._out_of_time = ""
        self._energies = list[tuple[float, float]]()  # times [s] and kinetic energies [J]

    def run(self, positions: Floats) -> TimeSeries:
        """The fall from these positions (n, 3) of the shell's nodes [m]."""
        fall = self.fall
        normals = np.tile([0.0, 0.0, 1.0], (len(positions), 1)) if self.shell.angles else None
        state = self.shell.state(positions, normals=normals)
        step = fall.time_step or min(USUAL_STEP * self._slowness, self._safe_step(state))
        duration = fall.duration or USUAL_DURATION * self._slowness
        self._step, self._duration, self._begun = step, duration, process_time()
        never = int(np.ceil(duration / step)) + 1
        try:
            return simulate(
                self.motion,
                state,
                until=duration,
                step=step,
                every=fall.every if fall.stream else never,
                stream=fall.stream,
                stepper=self.stepper,
                stop=self._stop_check(),
            )
        except ConvergenceError as error:
            if self.stepper.last is None:  # not one step was taken
                raise
            return error.report  # type: ignore[return-value]

    def _safe_step(self, state: Floats) -> float:
        """A step [s] below the stability limit of explicit ties, whichever nodes touch: no rods, all nodes stopped.

        Rods under compression, whose stiffness is negative, can lower the limit temporarily: the margin allows for it.
        """
        alone = replace(self.motion, elements=())
        return OF_LIMIT * step_limit(alone, state, stopped=self._stopped(np.arange(len(state))))

    def _stopped(self, touching: Ints) -> Ints:
        """The touching nodes that lose their whole velocity at each step."""
        return touching if self._law.stops_all else NO_NODES

    def _refuse_unstable(self, sample: Sample) -> None:
        """Raise StabilityError where the step is beyond the limit of explicit ties with the nodes that touch now."""
        free = self.touching.freedom(sample.state)
        if self._ties is None:
            self._ties = ExplicitTies(sample.motion, free)
        self._ties.look(sample.motion, sample.state, free, self._stopped(self.touching.nodes))
        if self._ties.grows(self._step):
            raise StabilityError(
                f"explicit ties are unstable at a time step of {self._step:.4g} s once the grid has landed: at t = "
                f"{sample.time:.3g} s, {len(self.touching.nodes)} nodes touching, the limit is "
                f"{self._ties.limit():.4g} s: {REMEDY}"
            )

    def _stop_check(self) -> Callable[[Sample], bool]:
        """Called after each step: reports progress, and every ten steps checks whether the grid is at rest."""
        count = 0

        def stop(sample: Sample) -> bool:
            nonlocal count
            count += 1
            if count % CHECKS:
                return False
            if self.fall.time_step and sample.motion.explicit and count % (LIMITS * CHECKS) == 0:
                self._refuse_unstable(sample)
            energy, force = self.activity(sample)
            self._energies.append((sample.time, energy))
            try:
                self._progress("drape", self._where(sample.time, count, energy, force), force)
            except OutOfTimeError as error:
                self._out_of_time = str(error)
                return True
            return self.fall.settle and self.rests(energy, force)

        return stop

    def _where(self, time: float, steps: int, energy: float, force: float) -> str:
        """How far the fall is from rest; and what makes it slow, once it takes long."""
        said = (
            f"falling, t = {time:.2f} s of at most {self._duration:.3g} s, {len(self.touching.nodes)} nodes touch; "
            f"energy {energy / self._still:.1g} and force {force / self._balanced:.1g} times those of rest"
        )
        spent = process_time() - self._begun
        if spent < SLOW:
            return said
        tied = isinstance(self.fall.coupling, ImplicitPenalty)
        fewer = 'drape.coupling "shared" has fewer, and the same rest' if tied else "a longer layout.edge has fewer"
        unknowns = self.shell.freedom().size
        creeps = f"; {CREEPS}" if self.creeps(time) else ""
        return f"{said}; {spent / steps:.1g} s of processor time a step, for {unknowns} unknowns: {fewer}{creeps}"

    @property
    def touching(self) -> Touching:
        assert self.stepper.last is not None
        return self.stepper.last

    def activity(self, sample: Sample) -> tuple[float, float]:
        """Kinetic energy [J] and largest out-of-balance force [N]."""
        energy = sample.motion.kinetic_energy(sample.velocity)
        return energy, unbalanced_force(sample.motion, sample.state, self.load, self.touching)

    def rests(self, energy: float, force: float) -> bool:
        """Whether this kinetic energy [J] and out-of-balance force [N] count as rest."""
        return energy < self._still and force < self._balanced

    def creeps(self, time: float) -> bool:
        """Whether the kinetic energy no longer falls: nothing holds the grid sideways, and it slides on."""
        usual = USUAL_DURATION * self._slowness
        return time >= 0.5 * usual and energy_decay(self._energies)[0] * LONGEST * usual < 1.0

    def advice(self, rest: Rest) -> str:
        """A drag and a duration that would bring the grid to rest, from the kinetic energy and its decay."""
        force = rest.force_residual / self._balanced
        return rest_advice(self._energies, self._still, force, USUAL_DURATION * self._slowness, self.drag)

    def contact_pulls(self, last: Sample) -> int:
        """Number of touching nodes that the target would have to pull."""
        push = out_of_balance(last.motion, last.state, self.load)[self.touching.nodes]
        return int(np.count_nonzero(dot(push, self.touching.normals) < 0))

    def outcome(self, series: TimeSeries) -> tuple[Rest, SolveReport]:
        """How the fall ended."""
        last, done = series.last, series.report
        assert last is not None
        assert done is not None
        energy, force = self.activity(last)
        resting = self.rests(energy, force)
        growth = lowest_modes(last.motion, last.state, self.load, self.touching, self.target) if resting else ()
        gap = joint_gap(self.shell, last.state)
        rest = Rest(resting, last.time, energy, force, gap, growth, done.steps, done.refused_steps)
        strain = float(np.abs(self.shell.stretch.strains(last.state)).max())
        status = Status.OUT_OF_TIME if self._out_of_time else Status.MOVING
        reason = self._out_of_time
        if done.end is End.STALLED:
            reason = (
                f"the fall ended at t = {rest.time:.4g} s, where no time step converged, however small "
                f"({done.reason}); use a shorter edge, or softer or shared joints"
            )
        elif not reason and self.creeps(last.time):
            reason = f"the grid is NOT AT REST after {rest.time:.3g} s: {CREEPS}"
        report = SolveReport(
            Status.CONVERGED if resting else status,
            self.shell.freedom().size,
            done.iterations,
            done.factorizations,
            done.seconds,
            force,
            strain,
            sum(s < UNSTABLE for s in growth),
            "" if resting else reason,
        )
        return rest, report


def _warnings(rest: Rest, report: SolveReport, simulation: _FallSimulation) -> tuple[str, ...]:
    if report.status is Status.MOVING and report.reason:
        return (report.reason,)
    if not rest.at_rest:
        return (
            f"the grid is NOT AT REST after {rest.time:.3g} s: kinetic energy {rest.kinetic_energy:.1e} J, "
            f"out-of-balance force {rest.force_residual:.1e} N; give it {simulation.advice(rest)}",
        )
    if rest.fastest_growth:
        count = sum(s < UNSTABLE for s in rest.growth)
        return (
            f"at rest, but without friction unstable sideways: {count} modes or more grow, the fastest as "
            f"exp({rest.fastest_growth:.2g} t / s); it was reached by symmetry, or because touching nodes are stopped",
        )
    return ()
