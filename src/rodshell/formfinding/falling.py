"""The paper's drape: the grid falls on the target in time and comes to rest there [HQK section 3].

Implicit Euler, the rods tied as the coupling says, contact by modified masses (`contact.modified_mass`). Nothing is
anchored: without friction the draped state is unstable sideways, and it is reached because the fall is symmetric, or
because touching nodes that are stopped at each step creep. How fast it would slide off is part of the result.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.contact.modified_mass import ModifiedMass, Touching
from rodshell.errors import ConvergenceError, OutOfTimeError, StabilityError
from rodshell.formfinding.calming import calming
from rodshell.formfinding.draped import Draped, DrapeFigures, middle_surface, smallest_joint_angle
from rodshell.formfinding.methods import Fall
from rodshell.formfinding.overhead import falling_grid, middle_marks, over, slid_off, standing_point
from rodshell.formfinding.progress import Progress, silent
from rodshell.formfinding.rest import Rest, held_back, joint_gap, lowest_modes, out_of_balance
from rodshell.geometry.vectors import dot
from rodshell.joints import Joint
from rodshell.layout import GridLayout, mesh_grid
from rodshell.model import Shell
from rodshell.rods.section import Rod
from rodshell.solve.contact_euler import ContactEuler
from rodshell.solve.forces import Damping, GravityForce
from rodshell.solve.implicit_euler import Motion
from rodshell.solve.report import SolveReport, Status
from rodshell.solve.simulate import simulate
from rodshell.solve.step_limit import NO_NODES, REMEDY, ExplicitTies, step_limit
from rodshell.solve.summed import narrow_or_dissected
from rodshell.solve.time_series import End, Moment, TimeSeries
from rodshell.targets import Target

STILL = 1e-7  # kinetic energy, of weight times size
BALANCED = 1e-3  # out-of-balance force on a node, of the weight of the heaviest
USUAL_STEP = 0.01  # [s] on a target of 0.2 m; times go with the square root of lengths
USUAL_DURATION = 6.0
USUAL_SIZE = 0.2  # [m]
OF_LIMIT = 0.9  # share of the step that is taken of what explicit ties bear whatever touches
UNSTABLE = -1e-3  # [1/s2]: the free turn about the vertical has 0 up to round-off
CHECKS = 10  # moments between two looks at the rest
LIMITS = 4  # looks at the rest between two at the step limit


def falling_drape(
    target: Target,
    layout: GridLayout,
    rod: Rod,
    fall: Fall,
    *,
    anchor: tuple[float, float] | None = None,
    joint: Joint | None = None,
    progress: Progress = silent,
) -> Draped:
    """Let `layout` fall on `target` in time; see `drape`.

    Raises
    ------
    StabilityError : the time step is beyond the limit of explicit ties, at the start or where the grid has landed.
    ConvergenceError : the first step fails however small. A later one ends the fall, which is then not at rest.
    """
    top = standing_point(target, anchor)
    grid = falling_grid(target, layout, anchor)
    mesh = mesh_grid(grid, layout.edge, marks=middle_marks(grid, layout))
    shell = Shell.of(mesh, rod, joint=joint, coupling=fall.coupling)
    falling = _Falling(target, shell, fall, progress)
    series = falling.run(over(shell.mesh, layout, top + [0.0, 0.0, fall.height]))
    rest, report = falling.outcome(series)
    assert series.last is not None
    positions = middle_surface(mesh, shell.mesh, shell.positions(series.last.state))
    if not report.reason and slid_off(mesh, positions, layout, top, target):
        report = replace(report, status=Status.SLID_OFF)
    angle, where = smallest_joint_angle(mesh, positions, target.margin(positions) > 0)
    figures = DrapeFigures(
        max_gap=float(max(0.0, -target.contact(positions).distance.min())),
        contact_pulls=falling.pulls(series.last),
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
        warnings=_warnings(rest, series, falling),
    )


class _Falling:
    """The motion, and what is asked of it on the way and at its end."""

    def __init__(self, target: Target, shell: Shell, fall: Fall, progress: Progress) -> None:
        massive = np.flatnonzero(shell.like < shell.mesh.node_count)  # linkers' own nodes, too: they fall and land
        every = len(massive) == len(shell.like)  # a slice is faster
        pull = GravityForce(slice(None) if every else massive, (0.0, 0.0, -fall.acceleration))
        self.motion = Motion.of(shell, forces=(pull, Damping(rate=fall.drag)))
        self.target, self.shell, self.fall, self._progress = target, shell, fall, progress
        self.load = pull.held(0.0, np.zeros_like(shell.mass), np.zeros_like(shell.mass), shell.mass)
        self._heaviest = float(-self.load[:, 2].min())
        self._weight = float(-self.load[:, 2].sum())
        self._law = ModifiedMass(target, massive, fall.stopped, fall.friction)
        self.stepper = ContactEuler(self._law, narrow_or_dissected(shell.places))
        self._ties: ExplicitTies | None = None
        self._slowness = float(np.sqrt(target.size / USUAL_SIZE))
        self._late = ""
        self._seen = list[tuple[float, float]]()  # times [s] and kinetic energies [J]

    def run(self, positions: Floats) -> TimeSeries:
        fall = self.fall
        normals = np.tile([0.0, 0.0, 1.0], (len(positions), 1)) if self.shell.angles else None
        state = self.shell.state(positions, normals=normals)
        step = fall.time_step or min(USUAL_STEP * self._slowness, self._safe_step(state))
        duration = fall.duration or USUAL_DURATION * self._slowness
        self._step, self._duration = step, duration
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
                stop=self._looking(),
            )
        except ConvergenceError as error:
            if self.stepper.last is None:  # not one step was taken
                raise
            return error.report  # type: ignore[return-value]

    def _safe_step(self, state: Floats) -> float:
        """A step [s] that explicit ties bear whatever touches: without help of the rods, all nodes stopped.

        Rods under compression, whose stiffness is negative, can lower it for a moment; the share leaves room for that.
        """
        alone = replace(self.motion, elements=())
        return OF_LIMIT * step_limit(alone, state, stopped=self._stopped(np.arange(len(state))))

    def _stopped(self, touching: Ints) -> Ints:
        """Of nodes that touch, those that lose their whole velocity at each step."""
        return touching if self._law.stops_wholly else NO_NODES

    def _refuse_unstable(self, moment: Moment) -> None:
        """Raise StabilityError where the explicit ties do not bear the step with what touches now."""
        free = self.touching.freedom(moment.state)
        if self._ties is None:
            self._ties = ExplicitTies(moment.motion, free)
        self._ties.look(moment.motion, moment.state, free, self._stopped(self.touching.nodes))
        if self._ties.grows(self._step):
            raise StabilityError(
                f"explicit ties are unstable at a time step of {self._step:.4g} s once the grid has landed: at t = "
                f"{moment.time:.3g} s, {len(self.touching.nodes)} nodes touching, the limit is "
                f"{self._ties.limit():.4g} s: {REMEDY}"
            )

    def _looking(self) -> Callable[[Moment], bool]:
        """Asked at each step: tells where it is, and from time to time whether it rests."""
        count = 0

        def look(moment: Moment) -> bool:
            nonlocal count
            count += 1
            if count % CHECKS:
                return False
            if self.fall.time_step and moment.motion.explicit and count % (LIMITS * CHECKS) == 0:
                self._refuse_unstable(moment)
            energy, force = self.activity(moment)
            self._seen.append((moment.time, energy))
            where = f"falling, {100 * moment.time / self._duration:.0f} % of {self._duration:.3g} s"
            try:
                self._progress("drape", f"{where}, kinetic energy {energy:.1e} J", force)
            except OutOfTimeError as late:
                self._late = str(late)
                return True
            return self.fall.settle and self.rests(energy, force)

        return look

    @property
    def touching(self) -> Touching:
        assert self.stepper.last is not None
        return self.stepper.last  # type: ignore[return-value]

    def activity(self, moment: Moment) -> tuple[float, float]:
        """Kinetic energy [J] and largest out-of-balance force [N]."""
        energy = moment.motion.kinetic_energy(moment.velocity)
        return energy, held_back(moment.motion, moment.state, self.load, self.touching)

    def rests(self, energy: float, force: float) -> bool:
        return energy < STILL * self._weight * self.target.size and force < BALANCED * self._heaviest

    def remedy(self, rest: Rest) -> str:
        """A drag and a duration that would do, from the energy that there was and from its decay."""
        usual, still = USUAL_DURATION * self._slowness, STILL * self._weight * self.target.size
        return calming(self._seen, still, rest.force_residual / (BALANCED * self._heaviest), usual, self.fall.drag)

    def pulls(self, last: Moment) -> int:
        """Nodes in contact that the target would have to pull."""
        push = out_of_balance(last.motion, last.state, self.load)[self.touching.nodes]
        return int(np.count_nonzero(dot(push, self.touching.normals) < 0))

    def outcome(self, series: TimeSeries) -> tuple[Rest, SolveReport]:
        last, done = series.last, series.report
        assert last is not None
        assert done is not None
        energy, force = self.activity(last)
        resting = self.rests(energy, force)
        growth = lowest_modes(last.motion, last.state, self.load, self.touching, self.target) if resting else ()
        gap = joint_gap(self.shell, last.state)
        rest = Rest(resting, last.time, energy, force, gap, growth, done.steps, done.refused_steps)
        strain = float(np.abs(self.shell.stretch.strains(last.state)).max())
        status = Status.OUT_OF_TIME if self._late else Status.MOVING
        report = SolveReport(
            Status.CONVERGED if resting else status,
            self.shell.freedom().size,
            done.iterations,
            done.factorizations,
            done.seconds,
            force,
            strain,
            sum(s < UNSTABLE for s in growth),
            "" if resting else self._late,
        )
        return rest, report


def _warnings(rest: Rest, series: TimeSeries, falling: _Falling) -> tuple[str, ...]:
    if series.report is not None and series.report.end is End.STALLED:
        return (
            f"the fall could not go on at t = {rest.time:.4g} s however small its steps ({series.report.reason}); "
            "use a shorter edge, or softer or shared joints",
        )
    if not rest.at_rest:
        return (
            f"the grid is NOT AT REST after {rest.time:.3g} s: kinetic energy {rest.kinetic_energy:.1e} J, "
            f"out-of-balance force {rest.force_residual:.1e} N; give it {falling.remedy(rest)}",
        )
    if rest.fastest_growth:
        count = sum(s < UNSTABLE for s in rest.growth)
        return (
            f"at rest, but without friction unstable sideways: {count} modes or more grow, the fastest as "
            f"exp({rest.fastest_growth:.2g} t / s); it was reached by symmetry, or by the stopping of touching nodes",
        )
    return ()
