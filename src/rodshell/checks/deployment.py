"""Deployment: the equilibria through which a pinned shell comes from the flat grid to its final shape.

The path is first followed backwards, from the popped-up shell, whose ends go on straight lines to where they lie in
the flat grid. So it ends in this very shell, needs no guess of the side to which the flat grid buckles, and every
stage of it is an equilibrium of the elastic grid: nothing is interpolated between shapes. A path without a gap is the
same in both directions. Where it has a gap, because a branch of stable equilibria ends, the directions differ, and
the forward one happens on site: the grid is lifted a little towards its final shape, its ends are driven, and where a
branch ends the shell snaps to the next one down its energy. Whether that leads to the final shape is the answer to
whether it is reached from flat.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise, takewhile
from math import prod

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.vectors import cross
from rodshell.model import Shell
from rodshell.rods.elements import Elements
from rodshell.solve.constraint import Supports
from rodshell.solve.mixed_newton import Equilibrium, find_equilibrium, find_stable
from rodshell.solve.path import EASY, Snap, Trace, follow, potential, trace, unaccounted
from rodshell.solve.problem import Pattern, Problem
from rodshell.units import length_text

Told = Callable[[float], None]
Stage = tuple[float, Equilibrium]  # share of the way that the ends have gone, and the shell there

DEGREE = 3  # at most, of the polynomials by which the next shape is guessed
SAME = 1e-3  # of the shell's size: shapes further apart are different ones
LOWEST = 1 / 64  # share of the way at which the grid has left its plane: by about an eighth of its final height
SHORTEST = 0.01  # share of the way: a snap is located to this
MOST = 1000  # factorisations of a path forwards; those that arrive take 30 to 750
AT_ONCE = 40  # iterations from the lifted grid to an equilibrium, before the energy is followed down


@dataclass(frozen=True)
class Elsewhere:
    """Another shape than the final one, in which a shell comes to rest from flat.

    Parameters
    ----------
    distance : of the farthest node from its final place, over half the shell's width.
    energy : over that of the final shape.
    positions : (n, 3) of the mesh's nodes [m].
    """

    distance: float
    energy: float
    positions: Floats

    @property
    def words(self) -> str:
        return f"{_percent(self.distance)} of half its width away, at {self.energy:.3g} times the energy"


@dataclass(frozen=True)
class Deployment:
    """Stages of a deployment, in the order of the building site.

    Parameters
    ----------
    share : (s,) of the way that the ends have gone, ascending; 0 is the flat grid.
    positions : (s, n, 3) of the mesh's nodes [m].
    shells : at each stage but the flat grid, with its state (N, 3), whose twist angles belong to that shell's source
        frames; none where ways of several shells were joined.
    snaps : between stages, each in shares of the way: there the shell snaps forward by itself.
    lost_at : share below which no equilibrium was found, or None; only the flat grid then stands before it.
    reached_from_flat : whether the shell comes to its final shape when it is lifted a little towards it and its ends
        are driven on straight lines; None where that could not be followed.
    elsewhere : where it comes to rest instead.
    guided : the shares between which it has to be guided off the path that leads elsewhere.
    factorizations : that it took.
    """

    share: Floats
    positions: Floats
    shells: tuple[tuple[Shell, Floats], ...]
    snaps: tuple[Snap, ...] = ()
    lost_at: float | None = None
    reached_from_flat: bool | None = None
    elsewhere: Elsewhere | None = None
    guided: tuple[float, float] | None = None
    factorizations: int = 0

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that a user should read."""
        words = list[str]()
        if self.snaps:
            places = ", ".join(_percent(snap.start) for snap in self.snaps)
            goes_on = ", and goes on to its final shape" if self.reached_from_flat else ""
            words.append(
                f"on its way from flat the shell snaps forward by itself, at {places} of the way, by up to "
                f"{length_text(max(snap.moved for snap in self.snaps))}{goes_on}"
            )
        if self.reached_from_flat is False:
            where = "" if self.elsewhere is None else f", {self.elsewhere.words}"
            words.append(
                f"lifted from flat and driven by its ends alone, the shell comes to rest in another shape{where}: "
                "it has to be guided into its final shape"
            )
        if self.lost_at is not None:
            below = (
                "at all" if len(self.shells) <= 1 else f"below {_percent(self.lost_at)} of the way: stages are missing"
            )
            words.append(
                f"the deployment from flat could not be followed {below}, and whether the shell reaches its final "
                "shape from flat is not known"
            )
        return tuple(words)


def _percent(share: float) -> str:
    return f"{100 * share:.0f} %" if share >= 0.095 else f"{100 * share:.2g} %"


def deploy(
    shell: Shell, state: Floats, forces: Floats, *, stages: int, pattern: Pattern | None = None,
    told: Told = lambda share: None,
) -> Deployment:  # fmt: skip
    """Follow a popped-up shell back to the flat grid, and forwards from there where that path has a gap.

    Parameters
    ----------
    state, forces : (N, 3) an equilibrium with pinned ends [m], and the axial forces (e,) of its edges [N].
    stages : number of equilibria above the flat grid. They crowd near it, where the rise goes with the root of the
        way.
    pattern : of an earlier solve of this shell.

    Returns
    -------
    The stages reached. Those below the last one that was reached are missing.
    """
    path = _Path(shell, state, pattern, told)
    shares = ((np.arange(stages, 0, -1) / stages) ** 2).tolist()
    every = shares if shares[-1] <= LOWEST else [*shares, LOWEST]
    upper = path.backwards(state, forces, every)
    lower, lost, elsewhere, guided = _Forwards([], (), True), None, None, None
    down_to, final = upper[-1][0], upper[0][1]
    if len(upper) < len(every):
        lower = path.forwards(upper, path.lifted(upper[-1], every[-1]), every[::-1])
        if not lower.arrived and (low := path.low(upper[-1], every[-1])):  # it may leave its plane otherwise
            other = path.forwards(upper, low, every[::-1])
            lower = other if other.arrived or lower.arrived is None else lower
    if lower.arrived is None:
        lower, lost = _Forwards([], (), None), down_to
    elif lower.arrived and lower.stages:
        down_to = lower.stages[-1][0]  # where it meets the path backwards
    elif not lower.arrived:
        end = lower.stages[-1][1]
        ratio = path.energy(end) / path.energy(final)
        elsewhere = Elsewhere(path.apart(end, final), ratio, shell.positions(end.state))
        guided = max((share for share, _ in lower.stages if share < down_to), default=0.0), down_to
    whole = [*(one for one in lower.stages if one[0] < down_to), *(one for one in upper[::-1] if one[0] >= down_to)]
    found = [one for share, one in whole if share in shares]
    return Deployment(
        np.array([0.0, *(share for share, _ in whole if share in shares)]),
        np.array([path.flat, *(shell.positions(one.state) for one in found)]),
        tuple((shell.with_elements(one.elements), one.state) for one in found),
        tuple(snap for snap in lower.snaps if guided is None or snap.stop <= guided[0]),
        lost, lower.arrived, elsewhere, guided, path.factorizations,
    )  # fmt: skip


@dataclass(frozen=True)
class _Forwards:
    """Stages and snaps of a path forwards; whether it arrived at a stage of the path backwards, None if it was lost."""

    stages: list[Stage]
    snaps: tuple[Snap, ...]
    arrived: bool | None


class _Path:
    """A pinned shell whose ends lie somewhere between the flat grid (share 0) and the final places (share 1)."""

    def __init__(self, shell: Shell, last: Floats, pattern: Pattern | None, told: Told) -> None:
        self.shell, self._pattern, self._told, self._smooth = shell, pattern, told, True
        positions = shell.positions(last)
        self.flat = laid_out(shell.mesh.flat, shell.mesh.ends.ravel(), positions)
        self._nodes = np.flatnonzero(shell.like < shell.mesh.node_count)  # blocks that are nodes, not angles
        self._flat_nodes = self.flat[shell.like[self._nodes]]
        lying = last.copy()
        lying[self._nodes] = self._flat_nodes
        self._first, self._last = lying[shell.ends], last[shell.ends]
        self._length = 0.5 * float(np.ptp(positions, axis=0).max())
        self.factorizations = 0

    def backwards(self, state: Floats, forces: Floats, shares: Sequence[float]) -> list[Stage]:
        """Stages at descending shares, from the final shape at the first of them down to where the path has a gap."""
        self._told(shares[0])
        final = self._counted(find_equilibrium(self._problem(shares[0], self.shell.elements), state, forces))
        self._pattern, found = final.pattern, [(shares[0], final)]
        if not final.report.stable:
            return found
        for before, share in pairwise(shares):
            self._told(share)
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
            self._told(share)
            way = self._trace(here, before, share, snap=True, most=left)
            here, left = way.found, left - way.factorizations
            snaps.extend(way.snaps)
            if way.t < share:
                return _Forwards(found, tuple(snaps), None)
            found.append((share, here))
            if share in known and self.apart(here, known[share]) <= SAME:
                return _Forwards(found, tuple(snaps), True)
        return _Forwards(found, tuple(snaps), False)

    def low(self, last: Stage, share: float) -> Equilibrium | None:
        """The equilibrium at a small share to which Newton's method leads backwards, over gaps; None if it fails."""
        (start, here), elements = last, self.shell.elements
        if not here.report.stable:
            return None
        found = follow(
            lambda t: self._problem((1 - t) * start + t * share, elements), here.state, here.forces, first_step=1.0
        )
        self._counted(found)
        return found if found.report.stable else None

    def energy(self, at: Equilibrium) -> float:
        """Elastic energy [J]."""
        return potential(self._problem(1.0, at.elements), at)

    def apart(self, one: Equilibrium, two: Equilibrium) -> float:
        """Distance of two shapes over half the shell's width."""
        return float(np.linalg.norm(self.shell.positions(one.state - two.state), axis=1).max()) / self._length

    def lifted(self, like: Stage, share: float) -> Equilibrium:
        """The equilibrium at a small share that is next to the flat grid lifted towards the shape of a stage, whose
        height goes with the root of the way."""
        part, state = share / like[0], like[1].state.copy()
        way = state[self._nodes] - self._flat_nodes
        state[self._nodes] = self._flat_nodes + way * np.array([part, part, np.sqrt(part)])
        problem = self._problem(share, tuple(one.refreshed(state) for one in like[1].elements))
        found = self._counted(find_stable(problem, state, part * like[1].forces, cut=True, most_iterations=AT_ONCE))
        if found.report.stable:
            return found
        from rodshell.solve.relax import relax  # rarely wanted: imported with the dynamics only then

        return self._counted(relax(problem, state))

    def _down(self, here: Equilibrium, start: float, stop: float) -> Equilibrium | None:
        """From one share to a lower one on the same branch; None where that ends."""
        way = self._trace(here, start, stop, snap=False, most=MOST)
        return way.found if way.t == stop else None

    def _trace(self, here: Equilibrium, start: float, stop: float, *, snap: bool, most: int) -> Trace:
        def problem_at(share: float) -> Problem:
            return self._problem(share, self.shell.elements)

        way = trace(
            problem_at, here, start, stop, shortest=SHORTEST, snap=snap, most_factorizations=most, told=self._told
        )
        self.factorizations += way.factorizations
        return way

    def _counted(self, found: Equilibrium) -> Equilibrium:
        self.factorizations += found.report.factorizations
        return found

    def _ahead(self, found: Sequence[Stage], share: float) -> Equilibrium | None:
        """The stage after those `found`, from where they lead; None where that does not lead straight there.

        Shapes on a smooth path are nearly polynomials in the root of the way: Newton's method then needs about half
        of the steps that it takes from the last shape.
        """
        last = list(takewhile(lambda one: one[1].report.iterations <= EASY, reversed(found[-DEGREE - 1 :])))
        if len(last) < 2 or not self._smooth:
            return None
        roots, root = [np.sqrt(one[0]) for one in last], np.sqrt(share)
        weights = [prod((root - b) / (a - b) for b in roots if b != a) for a in roots]  # Lagrange's
        state = np.sum([weight * one.state for weight, (_, one) in zip(weights, last, strict=True)], axis=0)
        forces = np.sum([weight * one.forces for weight, (_, one) in zip(weights, last, strict=True)], axis=0)
        before, problem = last[0][1], self._problem(share, last[0][1].elements)
        there = self._counted(find_equilibrium(problem, state, forces, most_iterations=EASY))
        self._smooth = there.report.stable  # where one guess leads astray, the next ones do, too
        return there if self._smooth and not unaccounted(problem, before, there) else None

    def _problem(self, share: float, elements: tuple[Elements, ...]) -> Problem:
        supports = Supports(self.shell.held_ends(), self.shell.ends, (1 - share) * self._first + share * self._last)
        stretch, places = self.shell.stretch, self.shell.flat_coordinates
        return Problem(elements, stretch, supports, self._length, places=places, pattern=self._pattern)


def laid_out(flat: Floats, ends: Ints, popped: Floats) -> Floats:
    """The flat grid (n, 3) turned and moved in its plane to lie under the popped-up shell, at its lowest end [m].

    The rods' ends then have the shortest ways to go, in the least-squares sense (Procrustes in the plane).
    """
    here, there = flat[ends], popped[ends]
    a, b = here - here.mean(axis=0), there - there.mean(axis=0)
    a[:, 2] = b[:, 2] = 0.0
    angle = np.arctan2(cross(a, b)[:, 2].sum(), np.sum(a * b))
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    result = np.empty_like(flat)
    result[:, :2] = (flat - here.mean(axis=0))[:, :2] @ turn + there.mean(axis=0)[:2]
    result[:, 2] = there[:, 2].min() + flat[:, 2]
    return result
