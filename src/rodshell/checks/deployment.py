"""Deployment: the equilibria through which a pinned shell comes from the flat grid to its final shape.

The path is first followed backwards, from the popped-up shell, whose ends move in straight lines to where they lie in
the flat grid. So it ends in this very shell, needs no guess of the side to which the flat grid buckles, and every
stage of it is an equilibrium of the elastic grid: nothing is interpolated between shapes. A path without a gap is the
same in both directions. Where it has a gap, because a branch of stable equilibria ends, the directions differ, and
the forward one happens on site: the grid is lifted a little towards its final shape, its ends are driven, and where a
branch ends the shell snaps to the next one down its energy. Whether that leads to the final shape is the answer to
whether it is reached from flat. A clamped shape is reached from the pinned one: on site the ends are turned into their
clamps after the deployment.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, takewhile
from math import prod

import numpy as np
from pydantic import Field

from rodshell.arrays import Floats
from rodshell.figures import checks as figures
from rodshell.figures.findings import Said, said
from rodshell.figures.records import Found, key
from rodshell.formfinding import PopUp
from rodshell.formfinding.popup import end_directions, laid_below, turned
from rodshell.model import Shell
from rodshell.model.shell import last_edges
from rodshell.rods.elements import Elements
from rodshell.rods.supports import PINNED
from rodshell.solve.equilibrium import Equilibrium, find_equilibrium, find_stable
from rodshell.solve.grids import side_by_side
from rodshell.solve.load import Load
from rodshell.solve.load_path import Limit, load_path
from rodshell.solve.path import EASY, SAME, Snap, Trace, follow, relax, trace, unaccounted
from rodshell.solve.problem import Problem, Supports, half_width
from rodshell.units import FEW, length_text, percent_text, places_text

Progress = Callable[[float], None]
Stage = tuple[float, Equilibrium]  # share of the deployment, and the shell there

DEGREE = 3  # at most, of the polynomials by which the next shape is guessed
LOWEST = 1 / 64  # share of the deployment at which the grid has left its plane: by about an eighth of its final height
SHORTEST = 0.001  # share of the deployment: a snap is located to this
MOST = 8000  # factorisations of a path forwards; those that arrive take 30 to 4000, of which one snap may take 900
SHORTEST_TURN = 0.02  # share of the clamps' angles: a snap is located to this
MOST_TURNING = 400  # factorisations of turning the clamps; the paths that arrive take 3 to 33
AT_ONCE = 40  # iterations from the lifted grid to an equilibrium, before the energy is followed down


class OtherShape(figures.OtherShape):
    """Another stable shape on the same supports than the final one; with its nodes."""

    positions: Found[Floats] = Field(description="(n, 3) of the mesh's nodes [m]")

    @property
    def words(self) -> str:
        return f"{percent_text(self.distance or 0.0)} of half its width away, at {self.energy:.3g} times the energy"


@dataclass(frozen=True)
class LostPart:
    """Where a deployment was lost, seen from flat and from the final shape.

    Args:
        reached: share up to which the path forwards was followed, on whichever branch; 0: none was found from flat.
        left: share down to which the path backwards is stable, where it ends as `limit` says (see `LoadPath`).
    """

    reached: float
    left: float
    limit: Limit

    @property
    def words(self) -> str:
        from_flat = f"up to {percent_text(self.reached)}" if self.reached else "not at all"
        ends = f", where the path ends in a {self.limit}" if self.limit in ("limit point", "bifurcation") else ""
        return f"from flat {from_flat}, and from the final shape back down to {percent_text(self.left)}{ends}"


class Deployment(figures.Deployment):
    """Stages of a deployment, in the order of the building site, with their shapes and the models of the shell.

    The shell is lifted a little towards its final shape, and its ends are driven on straight lines. At a snap it snaps
    forward by itself.
    """

    share: Found[Floats] = Field(description="(s,) of the deployment, ascending; 0 is the flat grid")
    positions: Found[Floats] = Field(description="(s, n, 3) of the mesh's nodes [m]")
    shells: Found[tuple[tuple[Shell, Floats], ...]] = Field(
        default=(),
        description="at each stage but the flat grid, with its state (N, 3), whose twist angles belong to that shell's "
        "source frames",
    )
    gap: Found[LostPart | None] = key("where it was lost")
    elsewhere: OtherShape | None = key("the shape in which it ends instead")

    @property
    def warnings(self) -> tuple[Said, ...]:
        """Sentences that a user should read."""
        found = list[Said]()
        if self.snaps:
            where = places_text([start for start, _ in self.snaps])
            most = max(moved or 0.0 for moved in self.snapped_by)
            continues = ", and continues to its final shape" if self.reached_from_flat else ""
            other = "; a small difference can make it snap elsewhere" if len(self.snaps) > FEW else ""
            by = length_text(most)
            found.append(said("snaps", self.ends, most, unit="m", where=where, by=by, continues=continues, other=other))
        if self.reached_from_flat is False:
            where = "" if self.elsewhere is None else f", {self.elsewhere.words}"
            found.append(said("guided", self.ends, where=where))
        if self.gap is not None:
            found.append(said("lost", self.ends, self.lost_at, 0, how=self.gap.words))
        return tuple(found)


def deploy(
    shell: Shell, found: Equilibrium, *, stages: int, ends: str = PINNED.name, progress: Progress = lambda share: None
) -> Deployment:
    """Follow a popped-up shell back to the flat grid, and forwards from there where that path has a gap.

    Args:
        shell: its ends being free to turn, its source frames being at the equilibrium.
        stages: number of equilibria above the flat grid. They crowd near it, where the rise is proportional to the root
            of the way.
        progress: called with each share of the deployment that is looked for.

    Returns:
        The stages reached. Those below the last one that was reached are missing.
    """
    path = _Path(shell, found, progress)
    shares = ((np.arange(stages, 0, -1) / stages) ** 2).tolist()
    every = shares if shares[-1] <= LOWEST else [*shares, LOWEST]
    upper = path.backwards(found, every)
    lower, lost, gap, elsewhere, guided = _Forwards([], (), True), None, None, None, None
    down_to, final = upper[-1][0], upper[0][1]
    if len(upper) < len(every):
        lower = path.forwards(upper, path.lifted(upper[-1], every[-1]), every[::-1])
        if not lower.arrived and (low := path.low(upper[-1], every[-1])):  # it may leave its plane otherwise
            other = path.forwards(upper, low, every[::-1])
            lower = other if other.arrived or lower.arrived is None else lower
    if lower.arrived is None:
        gap = LostPart(lower.reached, *path.end(upper[-1], every[-1]))
        lower, lost = _Forwards([], (), None), down_to
    elif lower.arrived and lower.stages:
        down_to = lower.stages[-1][0]  # where it meets the path backwards
    elif not lower.arrived:
        end = lower.stages[-1][1]
        elsewhere = OtherShape(
            distance=path.apart(end, final), energy=end.energy / final.energy, positions=shell.positions(end.state)
        )
        guided = max((share for share, _ in lower.stages if share < down_to), default=0.0), down_to
    whole = [*(stage for stage in lower.stages if stage[0] < down_to), *(s for s in upper[::-1] if s[0] >= down_to)]
    wanted = [(share, there) for share, there in whole if share in shares]
    snaps = [snap for snap in lower.snaps if guided is None or snap.stop <= guided[0]]
    return Deployment(
        ends=ends,
        share=np.array([0.0, *(share for share, _ in wanted)]),
        positions=np.array([path.flat, *(shell.positions(there.state) for _, there in wanted)]),
        shells=tuple((shell.with_elements(there.elements), there.state) for _, there in wanted),
        snaps=tuple((snap.start, snap.stop) for snap in snaps),
        snapped_by=tuple(snap.moved for snap in snaps),
        lost_at=lost,
        gap=gap,
        reached_from_flat=lower.arrived,
        elsewhere=elsewhere,
        guided=guided,
        factorizations=path.factorizations,
    )


def deploy_grids(popped: PopUp, *, stages: int, progress: Progress = lambda share: None) -> Deployment:
    """As `deploy`, of grids that lie side by side each on its own way: a snap of one then costs no steps of the others.
    The stages are those that all of them reached.

    Args:
        popped: with pinned ends.
    """
    grids = popped.alone or (popped,)
    ways = [deploy(grid.shell, grid.equilibrium, stages=stages, ends=popped.ends, progress=progress) for grid in grids]
    if len(ways) == 1:
        return ways[0]
    shares = [share for share in ways[0].share.tolist() if all(share in way.share for way in ways)]
    rows = np.array([[way.share.tolist().index(share) for share in shares] for way in ways])
    each = [[way.shells[row - 1] for way, row in zip(ways, of_stage, strict=True)] for of_stage in rows.T[1:].tolist()]
    lost = [way.lost_at for way in ways if way.lost_at is not None]
    elsewhere = [way.elsewhere for way in ways if way.elsewhere is not None]
    snaps = sorted({snap for way in ways for snap in zip(way.snaps, way.snapped_by, strict=True)})
    return Deployment(
        ends=popped.ends,
        share=np.array(shares),
        positions=np.concatenate([way.positions[row] for way, row in zip(ways, rows, strict=True)], axis=1),
        shells=tuple(side_by_side(popped.shell, parts) for parts in each),
        snaps=tuple(snap for snap, _ in snaps),
        snapped_by=tuple(moved for _, moved in snaps),
        lost_at=max(lost, default=None),
        gap=max((way.gap for way in ways if way.gap is not None), key=lambda gap: gap.left, default=None),
        reached_from_flat=_all_true([way.reached_from_flat for way in ways]),
        elsewhere=max(elsewhere, key=lambda shape: shape.distance or 0.0, default=None),
        guided=max((way.guided for way in ways if way.guided is not None), default=None),
        factorizations=sum(way.factorizations or 0 for way in ways),
    )


def _all_true(answers: Sequence[bool | None]) -> bool | None:
    """Whether all are true; None where that is not known."""
    return False if False in answers else None if None in answers else True


@dataclass(frozen=True)
class _Forwards:
    """Stages and snaps of a path forwards; whether it arrived at a stage of the path backwards, None if it was lost;
    and the share that was reached."""

    stages: list[Stage]
    snaps: tuple[Snap, ...]
    arrived: bool | None
    reached: float = 0.0


class _Path:
    """A pinned shell whose ends lie somewhere between the flat grid (share 0) and the final places (share 1)."""

    def __init__(self, shell: Shell, final: Equilibrium, progress: Progress) -> None:
        self.shell, self._pattern, self._progress, self._smooth = shell, final.problem.pattern, progress, True
        last, self._positions = final.state, shell.positions(final.state)
        ends = self._positions[shell.mesh.ends.ravel()]
        self.flat = laid_below(shell.mesh, ends, float(ends[:, 2].min()))
        self._nodes = np.flatnonzero(shell.like < shell.mesh.node_count)  # blocks that are nodes, not angles
        self._flat_nodes = self.flat[shell.like[self._nodes]]
        lying = last.copy()
        lying[self._nodes] = self._flat_nodes
        self._first, self._last = lying[shell.ends], last[shell.ends]
        self._length = half_width(self._positions)
        self.factorizations = 0

    def backwards(self, start: Equilibrium, shares: Sequence[float]) -> list[Stage]:
        """Stages at descending shares, from the final shape at the first of them down to where the path has a gap."""
        self._progress(shares[0])
        problem = self._problem(shares[0])
        final = self._counted(find_equilibrium(problem, start.state, start.forces))
        self._pattern, found = final.problem.pattern, [(shares[0], final)]
        if not final.report.stable:
            return found
        for before, share in pairwise(shares):
            self._progress(share)
            there = self._ahead(found, share) or self._down(found[-1][1], before, share)
            if there is None:
                break
            found.append((share, there))
        return found

    def forwards(self, upper: Sequence[Stage], here: Equilibrium, shares: Sequence[float]) -> _Forwards:
        """Stages at ascending shares, from an equilibrium at the first of them up to a stage of the path backwards."""
        known, found, snaps, left = dict(upper), [(shares[0], here)], list[Snap](), MOST
        if not here.report.stable:
            return _Forwards([], (), None)
        for before, share in pairwise(shares):
            self._progress(share)
            way = self._trace(here, before, share, snap=True, most=left)
            here, left = way.found, left - way.factorizations
            snaps.extend(way.snaps)
            if way.t < share:
                return _Forwards(found, tuple(snaps), None, way.t)
            found.append((share, here))
            if share in known and self.apart(here, known[share]) <= SAME:
                return _Forwards(found, tuple(snaps), True)
        return _Forwards(found, tuple(snaps), False)

    def low(self, last: Stage, share: float) -> Equilibrium | None:
        """The equilibrium at a small share to which Newton's method leads backwards, over gaps; None if it fails."""
        start, here = last
        if not here.report.stable:
            return None
        found = follow(
            lambda t: self._problem((1 - t) * start + t * share), here.state, here.forces, first_step=1.0
        ).whole
        self._counted(found)
        return found if found.report.stable else None

    def end(self, last: Stage, share: float) -> tuple[float, Limit]:
        """Where the stable path backwards from a stage ends, above a small share, and in what kind of point.

        By its arc length, which converges right up to a limit point, whereas steps of the share fail before it.
        """
        (start, here), motions = last, np.zeros_like(last[1].state)
        if not here.report.stable:
            return start, "unstable unloaded"
        motions[self.shell.ends] = start * (self._first - self._last)
        at_rest = replace(here, problem=replace(here.problem, constraint=Supports(self.shell.held_ends())))
        way = load_path(
            at_rest, Load(motions=motions), most=1 - share / start, stations=(),
            progress=lambda count, factor: self._progress(start * (1 - factor)),
        )  # fmt: skip
        self.factorizations += way.factorizations
        return start * (1 - way.factor), way.limit

    def apart(self, here: Equilibrium, there: Equilibrium) -> float:
        """Distance of two shapes over half the shell's width."""
        return float(np.linalg.norm(self.shell.positions(here.state - there.state), axis=1).max()) / self._length

    def lifted(self, like: Stage, share: float) -> Equilibrium:
        """The equilibrium at a small share that is next to the flat grid lifted towards the shape of a stage, whose
        height is proportional to the root of the share."""
        part, state = share / like[0], like[1].state.copy()
        way = state[self._nodes] - self._flat_nodes
        state[self._nodes] = self._flat_nodes + way * np.array([part, part, np.sqrt(part)])
        problem = self._problem(share, tuple(element.refreshed(state) for element in like[1].elements))
        found = self._counted(
            find_stable(problem, state, part * like[1].forces, limit_steps=True, most_iterations=AT_ONCE)
        )
        if found.report.stable:
            return found
        return self._counted(relax(problem, state))

    def _down(self, here: Equilibrium, start: float, stop: float) -> Equilibrium | None:
        """From one share to a lower one on the same branch; None where that ends."""
        way = self._trace(here, start, stop, snap=False, most=MOST)
        return way.found if way.t == stop else None

    def _trace(self, here: Equilibrium, start: float, stop: float, *, snap: bool, most: int) -> Trace:
        way = trace(
            self._problem, here, start, stop, shortest=SHORTEST, snap=snap, most_factorizations=most,
            progress=lambda share, _: self._progress(share),
        )  # fmt: skip
        self.factorizations += way.factorizations
        return way

    def _counted(self, found: Equilibrium) -> Equilibrium:
        self.factorizations += found.report.factorizations
        return found

    def _ahead(self, found: Sequence[Stage], share: float) -> Equilibrium | None:
        """The stage after those `found`, from where they lead; None where that does not lead straight there.

        Shapes on a smooth path are nearly polynomials in the root of the share: Newton's method then needs about half
        of the steps that it takes from the last shape.
        """
        last = list(takewhile(lambda stage: stage[1].report.iterations <= EASY, reversed(found[-DEGREE - 1 :])))
        if len(last) < 2 or not self._smooth:
            return None
        roots, root = [np.sqrt(stage[0]) for stage in last], np.sqrt(share)
        weights = [prod((root - b) / (a - b) for b in roots if b != a) for a in roots]  # Lagrange's
        state = np.sum([weight * there.state for weight, (_, there) in zip(weights, last, strict=True)], axis=0)
        forces = np.sum([weight * there.forces for weight, (_, there) in zip(weights, last, strict=True)], axis=0)
        before, problem = last[0][1], self._problem(share, last[0][1].elements)
        there = self._counted(find_equilibrium(problem, state, forces, most_iterations=EASY))
        self._smooth = there.report.stable  # where one guess leads astray, the next ones do, too
        return there if self._smooth and not unaccounted(before, there) else None

    def _problem(self, share: float, elements: tuple[Elements, ...] | None = None) -> Problem:
        """At a share of the deployment; with the elements' source frames of another shape than the final one, if so."""
        goals, elements = (1 - share) * self._first + share * self._last, elements or self.shell.elements
        return Problem.of_shell(self.shell, self._last, goals=goals, elements=elements, pattern=self._pattern)


def reached_by_turning(pinned: PopUp, clamped: PopUp) -> bool | None:
    """Whether the pinned shell comes to the clamped shape when its ends, held in place, are turned into their clamps.

    Args:
        pinned, clamped: stable shells of one footprint and boundary.

    Returns:
        None where that could not be followed. The path continues after a snap. Of grids side by side whether all do.
    """
    if pinned.alone:
        return _all_true([reached_by_turning(*grid) for grid in zip(pinned.alone, clamped.alone, strict=True)])
    shell, mesh = clamped.shell, clamped.footprint.mesh
    now, outward = end_directions(mesh, pinned.positions), clamped.boundary.tangents
    start = clamped.state.copy()
    start[: shell.node_count] = pinned.state[: shell.node_count]
    ends, reach = start[shell.ends], last_edges(mesh)[:, None]
    start[shell.ghosts] = ends + reach * now
    elements = tuple(element.refreshed(start) for element in shell.elements)
    pattern = clamped.equilibrium.problem.pattern

    def problem_at(t: float) -> Problem:
        goals = np.vstack([ends, ends + reach * turned(now, outward, t)])
        return Problem.of_shell(shell, ends, goals=goals, elements=elements, pattern=pattern)

    first = find_equilibrium(problem_at(0.0), start, pinned.forces)
    if not first.report.stable:
        return None
    path = trace(problem_at, first, 0.0, 1.0, shortest=SHORTEST_TURN, snap=True, most_factorizations=MOST_TURNING)
    if path.t < 1.0:
        return None
    apart = np.linalg.norm(shell.positions(path.found.state) - clamped.positions, axis=1).max()
    return bool(apart <= SAME * half_width(pinned.positions))
