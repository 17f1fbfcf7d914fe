"""Deployment: the equilibria through which a pinned shell comes from the flat grid to its final shape.

The path is followed backwards, from the popped-up shell, whose ends go on straight lines to where they lie in the
flat grid. So it ends in this very shell, needs no guess of the side to which the flat grid buckles, and every stage
of it is an equilibrium of the elastic grid: nothing is interpolated between shapes. Where the path folds, the shell
snaps, and on the building site it would have to be pushed: such stages are found and named.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import takewhile
from math import comb

import numpy as np
from numpy.typing import NDArray

from rodshell.checks.reactions import Reactions, reactions
from rodshell.geometry.vectors import cross
from rodshell.model import Shell
from rodshell.rods.elements import Elements
from rodshell.solve.constraint import Supports
from rodshell.solve.mixed_newton import Equilibrium, find_equilibrium
from rodshell.solve.path import EASY, SMALLEST_STEP, follow
from rodshell.solve.problem import Pattern, Problem

Floats = NDArray[np.float64]
Told = Callable[[float], None]

SUSPICIOUS = 0.02  # of the energy: more than a smooth path leaves unaccounted for between two stages
DEGREE = 3  # at most, of the polynomials by which the next shape is guessed
SAME = 1e-3  # of the shell's size: shapes further apart are different ones


@dataclass(frozen=True)
class Deployment:
    """Stages of a deployment, in the order of the building site.

    Parameters
    ----------
    share : (s,) of the way that the ends have gone, ascending; 0 is the flat grid.
    positions : (s, n, 3) of the mesh's nodes [m].
    shells : at each stage but the flat grid, with its state (N, 3), whose twist angles belong to that shell's source
        frames; none where ways of several shells were joined.
    snaps : pairs of neighbouring shares between which the path folds: going forward, the shell does not come
        from the first shape to the second by itself.
    lost_at : share below which no equilibrium was found, or None; only the flat grid then stands before it.
    """

    share: Floats
    positions: Floats
    shells: tuple[tuple[Shell, Floats], ...]
    snaps: tuple[tuple[float, float], ...] = ()
    lost_at: float | None = None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that a user should read."""
        words = [
            f"between {100 * a:.0f} % and {100 * b:.0f} % of the way from flat the shell snaps: there it must be pushed"
            for a, b in self.snaps
        ]
        if self.lost_at is not None:
            words.append(
                f"the way from flat could not be followed below {100 * self.lost_at:.0f} %: stages are missing"
            )
        return tuple(words)


def deploy(
    shell: Shell, state: Floats, forces: Floats, *, stages: int, pattern: Pattern | None = None,
    told: Told = lambda share: None,
) -> Deployment:  # fmt: skip
    """Follow a popped-up shell back to the flat grid.

    Parameters
    ----------
    state, forces : (N, 3) an equilibrium with pinned ends [m], and the axial forces (e,) of its edges [N].
    stages : number of equilibria above the flat grid. They crowd near it, where the rise goes with the root of the
        way.
    pattern : of an earlier solve of this shell.

    Returns
    -------
    The stages reached. One that was not reached is missing; the last before it is where the path ended.
    """
    path = _Path(shell, state, pattern)
    shares = (np.arange(stages, -1, -1) / stages) ** 2
    told(1.0)
    here = path.settle(state, forces)
    found, reached, snaps, lost = [here], [1.0], list[tuple[float, float]](), None
    for before, share in zip(shares[:-2].tolist(), shares[1:-1].tolist(), strict=True):
        told(share)
        there = path.ahead(found, share) or path.go(here, before, share)
        if not there.report.converged:
            lost = path.share_of(there)
            if before - lost > SMALLEST_STEP:
                found.append(there)
                reached.append(lost)
            break
        if path.folds(there, share, here, before):
            snaps.append((share, before))
        found.append(there)
        reached.append(share)
        here = there
    shells = tuple((shell.with_elements(one.elements), one.state) for one in reversed(found))
    positions = np.array([path.flat, *(shell.positions(one.state) for one in reversed(found))])
    return Deployment(np.array([0.0, *reversed(reached)]), positions, shells, tuple(reversed(snaps)), lost)


class _Path:
    """A pinned shell whose ends lie somewhere between the flat grid (share 0) and the final places (share 1)."""

    def __init__(self, shell: Shell, last: Floats, pattern: Pattern | None) -> None:
        self.shell, self.pattern, self._smooth = shell, pattern, True
        positions, ends = shell.positions(last), shell.mesh.ends.ravel()
        self.flat = laid_out(shell.mesh.flat, ends, positions)
        self._first = self.flat[ends]
        self._last = last[shell.ends]
        self._length = 0.5 * float(np.ptp(positions, axis=0).max())

    def settle(self, state: Floats, forces: Floats) -> Equilibrium:
        """The equilibrium at share 1, next to `state`."""
        found = follow(lambda _: self._problem(1.0, self.shell.elements), state, forces, first_step=1.0)
        self.pattern = found.pattern
        return found

    def go(self, here: Equilibrium, start: float, stop: float) -> Equilibrium:
        """From one share to another."""

        def problem_at(t: float) -> Problem:
            return self._problem((1 - t) * start + t * stop, here.elements)

        return follow(problem_at, here.state, here.forces, first_step=1.0)

    def ahead(self, found: Sequence[Equilibrium], share: float) -> Equilibrium | None:
        """The stage after those `found`, from where they lead; None where that does not lead straight there.

        Stages are equally spaced in the root of the way, in which shapes on a smooth path are nearly polynomials:
        Newton's method then needs about half of the steps that it takes from the last shape.
        """
        last = list(takewhile(lambda one: one.report.iterations <= EASY, reversed(found[-DEGREE - 1 :])))
        if len(last) < 2 or not self._smooth:
            return None
        weights = [(-1) ** k * comb(len(last), k + 1) for k in range(len(last))]
        state = np.sum([weight * one.state for weight, one in zip(weights, last, strict=True)], axis=0)
        forces = np.sum([weight * one.forces for weight, one in zip(weights, last, strict=True)], axis=0)
        there = find_equilibrium(self._problem(share, last[0].elements), state, forces, most_iterations=EASY)
        self._smooth = there.report.stable  # where one guess leads astray, the next ones do, too
        return there if self._smooth else None

    def share_of(self, at: Equilibrium) -> float:
        """How far on their way the ends are."""
        way = self._last - self._first
        return float(np.sum((at.state[self.shell.ends] - self._first) * way) / np.sum(way * way))

    def folds(self, low: Equilibrium, share: float, high: Equilibrium, before: float) -> bool:
        """Whether the way from `low` up to `high` leads elsewhere.

        Tried only where the supports' work does not account for the change of energy: between shapes on one smooth
        path it does, up to the error of the trapezoidal rule.
        """
        (one, r1), (two, r2) = self._energy(low), self._energy(high)
        work = 0.5 * float(np.sum((r1.forces + r2.forces) * (r2.points - r1.points)))
        if abs(two - one - work) <= SUSPICIOUS * max(one, two):
            return False
        again = self.go(low, share, before)
        apart = np.linalg.norm(self.shell.positions(again.state - high.state), axis=1).max()
        return not again.report.converged or bool(apart > SAME * self._length)

    def _problem(self, share: float, elements: tuple[Elements, ...]) -> Problem:
        supports = Supports(self.shell.held_ends(), self.shell.ends, (1 - share) * self._first + share * self._last)
        stretch, places = self.shell.stretch, self.shell.places
        return Problem(elements, stretch, supports, self._length, places=places, pattern=self.pattern)

    def _energy(self, at: Equilibrium) -> tuple[float, Reactions]:
        unused = np.zeros_like(at.state)
        energy = sum(one.evaluate(at.state, unused) for one in (*at.elements, self.shell.stretch))
        return energy, reactions(self.shell, at)


def laid_out(flat: Floats, ends: NDArray[np.intp], popped: Floats) -> Floats:
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
