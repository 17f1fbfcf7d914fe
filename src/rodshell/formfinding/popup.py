"""Pop up: the rod ends go from the footprint to the boundary, and the free grid finds its shape.

No target, no load and no contact: only rods, joints and the ends. Pinned ends hold positions; clamped ends
hold the direction of the draped rods as well. The end condition decides the shape (docs/equations.md, erratum E6).

A warm start transfers displacements and forces from an earlier pop-up, as the first guess of the solve.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Literal, get_args

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError, OutOfTimeError
from rodshell.formfinding.finite_sections import node_normals
from rodshell.formfinding.supports import let_go
from rodshell.formfinding.trim import Boundary, Footprint, in_layers
from rodshell.geometry.frames import dot, unit
from rodshell.geometry.planar_motion import PlanarMotion
from rodshell.joints import Ball, Joint, require_joint
from rodshell.joints.crossings import UP
from rodshell.layout import GridMesh
from rodshell.layout.transfer import transferred_edges, transferred_nodes
from rodshell.model import Shell
from rodshell.model.rod_sections import RodSections
from rodshell.progress import Progress, require_progress, silent
from rodshell.rods.section import Rod
from rodshell.rods.supports import CLAMPED, PINNED, Support, support_of
from rodshell.solve.equilibrium import Equilibrium, SolveReport, Status, find_stable
from rodshell.solve.grids import alone, together
from rodshell.solve.path import MOST_STEPS, follow, relax, trace
from rodshell.solve.problem import MatrixPattern, Problem, Supports, mean_radius
from rodshell.units import length_text
from rodshell.validation import Ends, choice, instance, whole

Start = Literal["draped", "flat"]
STARTS: tuple[Start, ...] = get_args(Start)

FIRST_RISE = 0.05  # share of the ends' paths in the step that leaves the plane
SHORTEST_RISE = 0.001  # share of the ends' paths: where no step of this length succeeds, the shell snaps
MODES_PER_ROD = 0.5  # negative modes, where each rod may roll by itself: saddles with more lead to others like them
MOST_TRACED = 8000  # factorisations of a path in short steps
CLAMP_STEP = 0.25  # share of the clamps' rotation in the first step
MOST_AT_ONCE = 120  # iterations: shells that snap far take up to 70; to descend the energy takes longer
MOST_AGAIN = 8  # iterations from an earlier pop-up, before starting from the draped state
MODES_PER_JOINT = 0.5  # negative modes: laths end 2 to 17 % off the target from more, other shells have less than 0.2
NEARBY = 0.1  # of the length: a state further from the guess may be another equilibrium


@dataclass(frozen=True, eq=False)
class PopUp:
    """The popped-up shell, and how it was found.

    Args:
        support, start: what holds the rods' ends, and where the solve started from.
        footprint, boundary: as they were given, in layers where joints are eccentric.
        shell: the mechanical model, its source frames being at the equilibrium.
        equilibrium: with the ends held where they are; its report counts the work of all solves on the way.
        alone: of grids side by side the shell of each; of one grid none.
    """

    support: Support
    start: Start
    footprint: Footprint
    boundary: Boundary
    shell: Shell
    equilibrium: Equilibrium
    alone: tuple["PopUp", ...] = ()

    def __repr__(self) -> str:
        rods, state = len(self.footprint.rods), self.report.status.value
        if self.report.converged:
            state = "stable" if self.report.stable else "unstable"
        return f"<PopUp: {rods} rods, {self.ends} from {self.start}, {state}>"

    @property
    def ends(self) -> Ends:
        """Name of the support."""
        return self.support.name

    @cached_property
    def positions(self) -> Floats:
        """(n, 3) of the footprint's nodes [m]."""
        return self.shell.positions(self.equilibrium.state)

    @property
    def report(self) -> SolveReport:
        """Figures of the solves."""
        return self.equilibrium.report

    @property
    def state(self) -> Floats:
        """(N, 3) state in equilibrium [m, at twist angles rad]."""
        return self.equilibrium.state

    @property
    def forces(self) -> Floats:
        """(e,) axial forces of the edges [N]."""
        return self.equilibrium.forces

    @property
    def followed(self) -> float:
        """Share of the ends' straight paths from flat that was followed; 1 where they arrived, as without paths."""
        if self.start == "draped" or self.report.converged:
            return 1.0
        mesh, goals = self.footprint.mesh, self.boundary.points
        first = flat_below(mesh, goals)[mesh.ends.ravel()]
        moved = self.positions[mesh.ends.ravel()] - first
        return float(np.sum(moved * (goals - first)) / np.sum((goals - first) ** 2))


def pop_up(
    footprint: Footprint,
    boundary: Boundary,
    rod: Rod,
    *,
    ends: Ends | Support = CLAMPED,
    start: Start = "draped",
    warm_start: PopUp | None = None,
    joint: Joint | Sequence[Joint] | None = None,
    like: PopUp | None = None,
    most_factorizations: int | None = None,
    progress: Progress = silent,
) -> PopUp:
    """Move the rod ends of `footprint` to `boundary` and find the equilibrium of the free grid.

    Grids that lie side by side are one shell. From flat, and where all together are not stable, each is popped up
    alone, so that what becomes of one does not depend on the others.

    Args:
        ends: "pinned" holds the ends' positions, "clamped" their directions too (a rod may spin in its clamp); or a
            support of your own, which lets go of the ends once the shell has popped up.
        start: "draped" releases the boundary's draped state; "flat" follows the ends on straight paths from the
            flat grid, which leaves its plane to the side that the boundary's directions point away from (without
            directions to that of +z), then turns the clamps.
        warm_start: a shell popped up before with the same ends, for start="draped": the displacements and axial forces
            that it had on the same rods are the first guess. Where that does not lead to a stable state nearby, the
            draped state is used.
        joint: the connection of rods where they cross: one joint for all crossings, or a sequence with one for each;
            ball joints by default. Eccentric joints place the rods in two layers: each rod starts on its own line, half
            of their distance above or below the draped surface, and the boundary's ends lie there.
        like: a pop-up of the same footprint, such as with other ends. Where its matrices have the same pattern they are
            not analysed again, which saves time and changes nothing else.
        most_factorizations: with start="flat", about how many each path (of the ends, and of the clamps) may take
            before it is given up; None: no such limit, and a path that Newton's method loses is followed in short
            steps.

    Raises:
        InputError: an argument of the wrong kind; `start` is "draped" and the boundary has no draped state;
            `warm_start` has other ends, or comes with start="flat"; the joints do not fit the grid.
    """
    support = support_of(ends)
    choice("start", start, STARTS)
    if warm_start is not None:
        instance("warm_start", warm_start, PopUp, "what an earlier rodshell.pop_up returned")
    if warm_start is not None and start != "draped":
        raise InputError('an earlier pop-up can only be used with start="draped": leave out warm_start, or start')
    if warm_start is not None and warm_start.ends != support.name:
        raise InputError(f"the earlier pop-up has {warm_start.ends} ends, not {support}: give one with the same ends")
    if like is not None:
        instance("like", like, PopUp, "what an earlier rodshell.pop_up returned")
    instance("footprint", footprint, Footprint)
    instance("boundary", boundary, Boundary)
    instance("rod", rod, Rod)
    require_joint(joint)
    require_progress(progress)
    if most_factorizations is not None:
        whole("most_factorizations", most_factorizations, 1)
    joint = joint or Ball()
    joints = joint if isinstance(joint, Sequence) else (joint,)
    apart = max((joint.eccentricity for joint in joints), default=0.0)
    if apart and not footprint.mesh.layered:
        footprint, boundary = in_layers(footprint, boundary, apart)
    elif footprint.mesh.layered and apart != (distance := 2 * float(np.abs(footprint.mesh.heights).max(initial=0.0))):
        raise InputError(
            f"the grid's rods lie in two layers {length_text(distance)} apart, and its joints hold them "
            f"{length_text(apart)} apart: drape it with the same joint"
        )
    known = like.equilibrium.problem.pattern if like is not None else None
    stages = _Stages(footprint, boundary, rod, joint, progress, known, most_factorizations)
    return stages.popped(support, start, warm_start)


@dataclass(frozen=True)
class _Stages:
    """The solves of a pop-up."""

    footprint: Footprint
    boundary: Boundary
    rod: Rod
    joint: Joint | Sequence[Joint]
    progress: Progress
    pattern: MatrixPattern | None = None
    most_factorizations: int | None = None
    isotropic: bool | None = None

    def counting(self, what: str, most: int) -> Callable[[int, float], None]:
        return lambda k, step: self.progress("pop-up", f"{what} {k} of at most {most}", step)

    def shell(self, support: Support) -> Shell:
        mesh = self.footprint.mesh
        clamped = support.holds_directions
        shell = Shell.of(mesh, self.rod, clamped=clamped, joint=self.joint, isotropic=self.isotropic)
        if not shell.angles:
            return shell
        return shell.turned(np.array([motion.turn for motion in _motions(mesh, self.boundary.points)]))

    @property
    def length(self) -> float:
        """Characteristic length: the boundary's mean radius [m]."""
        return mean_radius(self.boundary.points)

    @property
    def most_modes(self) -> int | None:
        """Most negative modes of a draped state from which a good shape is reached.

        With more, rods buckle between their joints nearly everywhere, and hundreds of factorisations lead to crumpled
        states far from the target. None where rods can roll at their joints: laths on edge have as many modes, and
        lie down.
        """
        fewest = min(len(mesh.grid.crossings) for mesh in self.footprint.mesh.grids)
        return None if self.rolls else int(MODES_PER_JOINT * fewest)

    @property
    def most_rolling(self) -> int | None:
        """Most negative modes from which Newton's method arrives from flat, where what it loses is followed in short
        steps; None: as many as there are."""
        short_steps = self.most_factorizations is None
        return int(MODES_PER_ROD * len(self.footprint.rods)) if self.rolls and short_steps else None

    @property
    def rolls(self) -> bool:
        """Whether rods can roll at their joints."""
        joints = self.joint if isinstance(self.joint, Sequence) else (self.joint,)
        return not all(joint.holds_normals for joint in joints)

    def popped(self, support: Support, start: Start, warm_start: PopUp | None) -> PopUp:
        """Of several grids as one shell, or each alone: from flat, and where all together are not stable."""
        grids = self._of_grids()
        if start == "flat" and grids:
            return self._one_by_one(grids, support, start)
        if start == "draped":
            shell, found = (self.again(warm_start, support) if warm_start else None) or self.release(support)
            if grids and not found.report.stable and found.report.status is not Status.OUT_OF_TIME:
                return self._one_by_one(grids, support, start, found.report)
        else:
            shell, found = self.rise()
            if support.holds_directions and found.report.converged:
                shell, found = self.turn_clamps(shell, found, support)
        shell = shell.with_elements(found.elements)
        if start == "flat":  # the ends have arrived
            found = replace(found, problem=replace(found.problem, constraint=Supports(shell.held_ends())))
        if found.report.converged:
            shell, found = let_go(shell, found, support, self.boundary.points, self.counting)
        parts = [alone(shell, found, k, grid.shell(support), grid.boundary.points) for k, grid in enumerate(grids)]
        pairs = zip(grids, parts, strict=True)
        each = tuple(PopUp(support, start, grid.footprint, grid.boundary, *part) for grid, part in pairs)
        return PopUp(support, start, self.footprint, self.boundary, shell, found, each)

    def _one_by_one(self, grids: Sequence["_Stages"], support: Support, start: Start, *earlier: SolveReport) -> PopUp:
        """Each grid popped up alone, after `earlier` solves of all that were not stable."""
        each, shell = tuple(grid.popped(support, start, None) for grid in grids), self.shell(support)
        parts = [(grid.shell, grid.equilibrium) for grid in each]
        found = together(shell, self.problem(shell), parts, *earlier)
        shell = shell.with_elements(found.elements)
        return PopUp(support, start, self.footprint, self.boundary, shell, found, each)

    def _of_grids(self) -> list["_Stages"]:
        """Those of each grid, where several lie side by side."""
        mesh, every = self.footprint.mesh, self.joint
        if not mesh.side_by_side:
            return []
        sections = RodSections.of(mesh, [self.rod] * len(mesh.grid.rods)).nodes
        isotropic = bool((sections[:, 0] == sections[:, 1]).all())  # else each grid needs frames, as the whole does
        stops = np.cumsum([0, *(len(grid.grid.crossings) for grid in mesh.side_by_side)])
        return [
            replace(
                self, footprint=Footprint(grid), boundary=self.boundary.of_grid(mesh, k), pattern=None,
                isotropic=isotropic, joint=every[stops[k] : stops[k + 1]] if isinstance(every, Sequence) else every,
            )
            for k, grid in enumerate(mesh.side_by_side)
        ]  # fmt: skip

    def problem(self, shell: Shell, goals: Floats | None = None) -> Problem:
        """The shell with its ends (and ghost nodes) held at the boundary, or at `goals`."""
        return Problem.of_shell(shell, self.boundary.points, goals=goals, pattern=self.pattern)

    def upright(
        self, shell: Shell, positions: Floats, tangents: Floats | None = None, normals: Floats | None = None
    ) -> Floats:
        """The state at these node positions (n, 3), the rods' first directors along the normals of the surface: those
        (n, 3) given, or those computed at the rods' crossings."""
        if normals is None and shell.angles:
            normals = node_normals(self.footprint.mesh, positions)
        return shell.state(positions, tangents, normals)

    def release(self, support: Support) -> tuple[Shell, Equilibrium]:
        """Release the draped state: the ends stay, the target's forces vanish.

        In one solve, or, where that fails, by descending the energy. Abandoned where the state has more negative modes
        than `most_modes`.
        """
        if self.boundary.draped is None:
            raise InputError('this boundary has no draped state to start from: use start="flat"')
        shell = self.shell(support)
        state = self.upright(shell, self.boundary.draped, self.boundary.tangents, self.boundary.normals)
        forces = np.zeros(len(self.footprint.mesh.edges))
        several = len(self.footprint.mesh.grids) > 1  # then each leaves its own saddle, to its own side
        at_once = find_stable(
            self.problem(shell),
            state,
            forces,
            limit_steps=True,
            most_modes=self.most_modes,
            most_iterations=MOST_AT_ONCE,
            slide=not several,
            progress=self.counting(f"{support}, iteration", MOST_AT_ONCE),
        )
        given_up = at_once.report.status in (Status.BUCKLED, Status.OUT_OF_TIME)
        if at_once.report.stable or given_up or several:
            return shell, at_once
        relaxed = relax(
            self.problem(shell),
            state,
            progress=self.counting(f"{support}, descending, step", MOST_STEPS),
        )
        return shell, replace(relaxed, report=relaxed.report.after(at_once.report))

    def again(self, warm_start: PopUp, support: Support) -> tuple[Shell, Equilibrium] | None:
        """Start from the displacements of an earlier pop-up; None where that does not lead to a stable state nearby.

        Not for rods with twist angles: these are not transferred, and without them the draped state is a better guess.
        """
        here, there = self.boundary.draped, warm_start.boundary.draped
        if here is None or there is None or warm_start.shell.angles:
            return None
        shell, mesh, before = self.shell(support), self.footprint.mesh, warm_start.footprint.mesh
        moved = transferred_nodes(warm_start.positions - there, before, mesh)
        moved[mesh.ends] = 0.0
        state = self.upright(shell, here + moved, self.boundary.tangents)
        stiffer = shell.stretch.stiffness.mean() / warm_start.shell.stretch.stiffness.mean()
        found = find_stable(
            self.problem(shell),
            state,
            stiffer * transferred_edges(warm_start.forces, before, mesh),
            most_iterations=MOST_AGAIN,
            progress=self.counting(f"{support}, again, iteration", MOST_AGAIN),
        )
        strayed = np.abs(shell.positions(found.state) - here - moved).max() > NEARBY * self.length
        return None if strayed or not found.report.stable else (shell, found)

    def rise(self) -> tuple[Shell, Equilibrium]:
        """Pop up pinned, from the flat grid: the ends move straight to the boundary while the grid rises.

        In steps as long as Newton's method allows, or, where these do not lead to a stable shell, in short ones.
        """
        mesh, boundary = self.footprint.mesh, self.boundary
        shell = self.shell(PINNED)
        flat = flat_below(mesh, boundary.points)
        first = flat[mesh.ends.ravel()]
        arch = self.upright(shell, arched(self.footprint, flat, first, boundary))

        def problem_at(t: float) -> Problem:
            return self.problem(shell, (1 - t) * first + t * boundary.points)

        found = follow(
            problem_at,
            arch,
            np.zeros(len(mesh.edges)),
            first_step=FIRST_RISE,
            snap=True,
            most_factorizations=self.most_factorizations,
            most_modes=self.most_rolling,
            progress=lambda t, k, step: self.progress("pop-up", f"from flat, {100 * t:.0f} %, iteration {k}", step),
        ).whole
        late = found.report.status is Status.OUT_OF_TIME
        if found.report.stable or late or self.most_factorizations is not None:
            return shell, found
        return shell, self.traced(problem_at, arch, found)

    def traced(self, problem_at: Callable[[float], Problem], arch: Floats, failed: Equilibrium) -> Equilibrium:
        """The path from flat along branches of stable equilibria: down the energy from the arch, then from one branch
        to the next.

        Newton's method leads from the arch to saddles where rods may roll, such as laths between ball joints, and on
        from saddle to saddle.
        """
        here = relax(
            problem_at(FIRST_RISE),
            arch,
            progress=self.counting("from flat, descending, step", MOST_STEPS),
        )
        if not here.report.stable:
            kept, other = (here, failed) if here.report.status is Status.OUT_OF_TIME else (failed, here)
            return replace(kept, report=kept.report.after(other.report))
        reached = here

        def at_share(t: float, found: Equilibrium) -> None:
            nonlocal reached
            reached = found
            self.progress("pop-up", f"from flat in short steps, {100 * t:.1f} %", 0.0)

        try:
            path = trace(
                problem_at, here, FIRST_RISE, 1.0,
                shortest=SHORTEST_RISE, snap=True, most_factorizations=MOST_TRACED, progress=at_share,
            )  # fmt: skip
        except OutOfTimeError as late:
            work = reached.report.after(failed.report, *(() if reached is here else (here.report,)))
            return replace(reached, report=replace(work, status=Status.OUT_OF_TIME, reason=str(late)))
        solves = (failed.report, here.report, *path.reports)
        work = path.found.report.after(*(report for report in solves if report is not path.found.report))
        if path.t == 1:
            return replace(path.found, report=work)
        if failed.report.converged:  # the ends arrived, and the shell there is unstable
            return replace(failed, report=failed.report.after(here.report, *path.reports))
        return replace(path.found, report=replace(work, status=Status.STALLED))

    def turn_clamps(self, free: Shell, pinned: Equilibrium, support: Support) -> tuple[Shell, Equilibrium]:
        """Turn the end directions of the pinned state to those of the boundary."""
        mesh, outward = self.footprint.mesh, self.boundary.tangents
        shell, positions = self.shell(support), free.positions(pinned.state)
        now = end_directions(mesh, positions)
        start = self.upright(shell, positions, now)

        def goals(t: float) -> Floats:
            there = shell.state(positions, turned(now, outward, t))[shell.ghosts] - positions[mesh.ends.ravel()]
            return np.vstack([start[shell.ends], start[shell.ends] + there])

        found = follow(
            lambda t: self.problem(shell, goals(t)),
            start,
            pinned.forces,
            first_step=CLAMP_STEP,
            most_factorizations=self.most_factorizations,
            progress=lambda t, k, step: self.progress(
                "pop-up", f"turning clamps, {100 * t:.0f} %, iteration {k}", step
            ),
        ).whole
        return shell, replace(found, report=found.report.after(pinned.report))


def end_directions(mesh: GridMesh, positions: Floats) -> Floats:
    """(2m, 3) unit vectors in which the rods' ends point out of the shell at these node positions (n, 3)."""
    inner = np.column_stack([mesh.rod_nodes[mesh.rod_start + 1], mesh.rod_nodes[mesh.rod_stop - 2]]).ravel()
    return unit(positions[mesh.ends.ravel()] - positions[inner])


def turned(now: Floats, goal: Floats, t: float) -> Floats:
    """Unit vectors (k, 3) turned by the share t of the angle from `now` to `goal`, each in its own plane."""
    angle = np.arccos(np.clip(dot(now, goal), -1, 1))[:, None]
    sine = np.maximum(np.sin(angle), 1e-12)
    return unit(np.where(angle > 1e-9, (np.sin((1 - t) * angle) * now + np.sin(t * angle) * goal) / sine, now))


def laid_below(mesh: GridMesh, points: Floats, height: float) -> Floats:
    """Each flat grid turned and moved in its plane so that its rods' ends have the shortest paths.

    Args:
        points: (2m, 3) where both ends of each rod in turn are to go [m].
        height: of the plane [m].

    Returns:
        (n, 3) positions of the mesh's nodes [m]; rods in two layers keep their distance from the plane.
    """
    laid = np.empty_like(mesh.flat)
    for k, motion in enumerate(_motions(mesh, points)):
        nodes = mesh.grid_of_nodes == k
        laid[nodes] = motion.moved(mesh.flat[nodes], height)
    return laid


def _motions(mesh: GridMesh, points: Floats) -> list[PlanarMotion]:
    """Of each flat grid, so that its rods' ends have the shortest paths to the points (2m, 3) [m]."""
    flat, of_ends = mesh.flat[mesh.ends.ravel()], np.repeat(mesh.grid_of_rods, 2)
    return [PlanarMotion.onto(flat[of_ends == k], points[of_ends == k]) for k in range(len(mesh.grids))]


def flat_below(mesh: GridMesh, points: Floats) -> Floats:
    """(n, 3) the flat grid laid out at the mean height of the points (2m, 3) to which its ends go [m]."""
    return laid_below(mesh, points, float(points.mean(axis=0)[2]))


def arched(footprint: Footprint, flat: Floats, first: Floats, boundary: Boundary) -> Floats:
    """The flat grid raised to arches of about the rods' lengths over their ends at the first step.

    A flat grid under compression is in unstable equilibrium: the arch chooses the side. A rod
    whose ends are to rise outwards sags; without directions all rods rise.
    """
    mesh = footprint.mesh
    ends = (1 - FIRST_RISE) * first + FIRST_RISE * boundary.points
    side = np.where(boundary.tangents[::2, 2] + boundary.tangents[1::2, 2] > 0, -1.0, 1.0)
    raised, weight = np.zeros_like(flat), np.zeros(len(flat))
    for k, rod in enumerate(mesh.grid.rods):
        nodes, s = mesh.nodes_of(k), mesh.stations[mesh.rod_slice(k)]
        share = ((s - s[0]) / rod.length)[:, None]
        chord = (1 - share) * ends[2 * k] + share * ends[2 * k + 1]
        short = max(rod.length**2 - float(np.sum((ends[2 * k + 1] - ends[2 * k]) ** 2)), 0.0)
        height = side[k] * 2 / np.pi * np.sqrt(short)  # a sine arch of this height has about the rod's length
        chord[:, 2] += height * np.sin(np.pi * share[:, 0])
        raised[nodes] += chord
        weight[nodes] += 1
    raised /= weight[:, None]
    if mesh.layered:  # rods of a joint meet half-way here, too
        pairs = mesh.joint_pairs
        middle = raised[pairs].mean(axis=1)
        raised[pairs] = middle[:, None] + mesh.heights[pairs][:, :, None] * UP
    return raised
