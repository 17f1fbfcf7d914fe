"""The genetic search of an inverse design: what is sought, and the run, seeded and in several processes."""

from collections.abc import Iterator
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from itertools import repeat
from math import inf
from multiprocessing import get_context
from pathlib import Path
from time import process_time

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import needs_package
from rodshell.formfinding import Stages, agreement, pop_up
from rodshell.formfinding.popup import PopUp
from rodshell.formfinding.trim import FEWEST_JOINTS, NEAREST_JOINT, Boundary, Footprint
from rodshell.layout import FlatGrid, FlatRod, GridLayout, mesh_grid
from rodshell.layout.gridlayout import FAMILIES, require_chebyshev
from rodshell.layout.mesh import CROWDED
from rodshell.paper.figure import ROD
from rodshell.paper.genetic_records import GAIN, Evaluate, Generation, Judged, StoredValues, gain
from rodshell.progress import Progress
from rodshell.rods.supports import PINNED
from rodshell.sweeps.asktell import AskTell
from rodshell.targets import Target
from rodshell.threads import work_for_parent

PATIENCE = 100  # Newton iterations of a pop-up from flat; smooth footprints mostly need 25 to 60
SAME = 1e-4  # times the size: ends of G are much further apart
MICRON = 6  # decimals of bounds in m
POPULATION = 100
MOST = 300  # generations
NEVER_REACHED = (
    10**6
)  # factorisations: patience ends first, and what Newton's method loses is not followed in short steps
ROUGHNESS = 0.04  # of the first footprints; rougher ones are stable more rarely, and after many more iterations


@dataclass(frozen=True, eq=False)
class Design:
    """The variables, their bounds, and the objective of the inverse design [HQK 1, 3.2, ref 30].

    G is given, from the direct result, and the rod ends are pinned on it. The unknown is G0, one coordinate for each
    rod end along its rod. Nothing else of the direct result enters: neither its G0 nor its draped shape.

    Args:
        lines: the flat grid's rods, whose lines count, not their ends.
        boundary: G, without a draped state.
        orbit: (2m,) index of the variable of each rod end, start and end of each rod in turn: the same for all ends
            that the symmetry of target and grid takes into each other.
        lower, upper: (n,) bounds of the variables, which are distances along the rod from its middle [m]: from a rod
            that is straight in plan to the longest convex arch over its chord that is no higher than the target there,
            since a convex curve is no longer than its chord and twice its height.
    """

    target: Target
    layout: GridLayout
    lines: tuple[FlatRod, ...]
    boundary: Boundary
    orbit: Ints
    lower: Floats
    upper: Floats

    @staticmethod
    def of(direct: Stages) -> "Design":
        """The design with the target, the grid and the boundary of a `direct` result."""
        target, lines, points = direct.target, direct.footprint.rods, direct.trimmed.boundary.points
        orbit = _orbits(target, lines, points)
        taut, high = _reach(target, points), np.repeat(_heights(target, points), 2)
        count = np.bincount(orbit)
        # rounded, so that a search does not depend on the last digits of the direct result
        lower, upper = (np.round(np.bincount(orbit, bound) / count, MICRON) for bound in (taut, taut + high))
        boundary = Boundary(points, direct.trimmed.boundary.tangents)
        return Design(target, require_chebyshev(direct.layout, "searches"), lines, boundary, orbit, lower, upper)

    def footprint(self, variables: Floats) -> Footprint:
        """The flat grid of `variables` (n,), meshed as by the direct method: a node at every line of the lattice."""
        reach = variables[self.orbit].reshape(-1, 2)
        middles = [self.layout.middle(line) for line in self.lines]
        rods = [
            line.cut(middle - before, middle + after)
            for line, middle, (before, after) in zip(self.lines, middles, reach.tolist(), strict=True)
        ]
        grid = FlatGrid.of(rods, margin=NEAREST_JOINT * min(self.layout.spacing))
        return Footprint(mesh_grid(grid, self.layout.edge, marks=[self._lattice(rod) for rod in rods]))

    def _lattice(self, rod: FlatRod) -> list[float]:
        """Positions along a rod at which the lattice's lines cross it, without those too near its ends [m]."""
        across = 1 - FAMILIES.index(rod.family)
        step, first = self.layout.spacing[across], self.layout.phase(across)
        clear = CROWDED * self.layout.edge
        low, high = np.ceil((rod.start + clear - first) / step), np.floor((rod.end - clear - first) / step)
        return [first + step * k for k in range(int(low), int(high) + 1)]

    def pop_up(self, variables: Floats, *, patience: float = inf) -> PopUp | None:
        """The shell of `variables` (n,) popped up from flat, pinned.

        None if a rod has too few joints, or after `patience` iterations. Always from flat: a shell has other stable
        states than the one that it reaches from there.
        """
        footprint = self.footprint(variables)
        if footprint.mesh.grid.joint_counts().min() < FEWEST_JOINTS:
            return None
        left = patience

        def count_iteration(*_: object) -> None:
            nonlocal left
            left -= 1
            if left < 0:
                raise _OutOfPatience

        try:
            return pop_up(
                footprint, self.boundary, ROD, ends=PINNED, start="flat", most_factorizations=NEVER_REACHED,
                progress=count_iteration,
            )  # fmt: skip
        except _OutOfPatience:
            return None

    def error(self, variables: Floats) -> float:
        """The objective of `variables` (n,): rms distance of the popped-up shell to the target [m].

        The distance is that of nodes and of the middles of edges. A shell that is not stable counts as one at the
        distance of the target's size: a rod with fewer than three joints, no stable state with the ends on G, or none
        within `PATIENCE` iterations.
        """
        popped = self.pop_up(variables, patience=PATIENCE)
        if popped is None or not popped.report.stable:
            return self.target.size
        return agreement(popped, self.target).rms

    def random(self, rng: np.random.Generator, count: int, roughness: float) -> Floats:
        """(count, n) random footprints, smooth except for a share `roughness` of the bounds at every end.

        Along each side of each family the share of the bounds is a parabola of Bernstein form with random coefficients.
        """
        sides = np.array([[f"{line.family}-", f"{line.family}+"] for line in self.lines]).ravel()
        offsets = np.repeat([line.offset for line in self.lines], 2)
        first = np.unique(self.orbit, return_index=True)[1]
        t = np.abs(offsets[first]) / np.abs(offsets).max()
        parabolas = np.column_stack([(1 - t) ** 2, 2 * t * (1 - t), t**2])
        side = np.unique(sides[first], return_inverse=True)[1]
        coefficients = rng.random((count, side.max() + 1, 3))
        shares = np.einsum("nk,cnk->cn", parabolas, coefficients[:, side])
        shares += roughness * (rng.random(shares.shape) - 0.5)
        return np.asarray(self.lower + np.clip(shares, 0.0, 1.0) * (self.upper - self.lower))


class _OutOfPatience(Exception):
    """A pop-up takes too many iterations."""


def _reach(target: Target, points: Floats) -> Floats:
    """(2m,) distance of the ends of G from the anchor in plan, along the chord of their rod [m]."""
    ends = (points[:, :2] - target.summit).reshape(-1, 2, 2)
    chords = ends[:, 1] - ends[:, 0]
    along = chords / np.linalg.norm(chords, axis=1)[:, None]
    return np.asarray(np.einsum("mek,mk,e->me", ends, along, [-1.0, 1.0]).ravel())


def _heights(target: Target, points: Floats) -> Floats:
    """(m,) the target's greatest height over the chord of each rod [m]."""
    t = np.linspace(0.02, 0.98, 49)[:, None]
    ends = points.reshape(-1, 2, 3)
    return np.array([np.nanmax(target.height_at((a + t * (b - a))[:, :2])) - min(a[2], b[2]) for a, b in ends])


def _orbits(target: Target, lines: tuple[FlatRod, ...], points: Floats) -> Ints:
    """(2m,) number of the set of ends to which each end of G is taken by the symmetries of the square in plan.

    A symmetry counts that takes G into G and the lines into lines: the net made G, and sees the whole target.
    """
    plan, size = points[:, :2] - target.summit, target.size
    orbit = np.arange(len(points))
    offsets = np.abs(np.repeat([line.offset for line in lines], 2))
    for turn in _SQUARE:
        apart = np.linalg.norm((plan @ turn.T)[:, None] - plan[None], axis=2)
        image = apart.argmin(axis=1)
        kept = apart.min(axis=1).max() < SAME * size and np.abs(offsets[image] - offsets).max() < SAME * size
        if kept:
            orbit = np.minimum(orbit, orbit[image])
    return np.unique(orbit, return_inverse=True)[1].astype(np.intp)


_SQUARE = [
    np.array(turn) for turn in ([[1, 0], [0, 1]], [[-1, 0], [0, 1]], [[1, 0], [0, -1]], [[-1, 0], [0, -1]],
                                [[0, 1], [1, 0]], [[0, -1], [1, 0]], [[0, 1], [-1, 0]], [[0, -1], [-1, 0]])
]  # fmt: skip


# The run


def search(
    design: Design, file: Path, *, seed: int, jobs: int = 1, population: int = POPULATION, most: int = MOST,
    progress: Progress,
) -> tuple[tuple[Generation, ...], Floats]:  # fmt: skip
    """Search from the random footprints of a seed, or continue, until the best gains less than `GAIN` in `WINDOW`
    generations.

    By differential evolution, see `AskTell`.

    Args:
        file: of all values, written after each generation and when interrupted; the search continues from it.
        jobs: number of processes; the result does not depend on it.
        most: generations after which a search that has not converged ends.

    Returns:
        The generations, and the best variables (n,) [m].

    Raises:
        InputError: pymoo is not installed; the file is broken or of a different search.
        OutputError: the file cannot be written.
    """
    algorithm, stored, generations = _algorithm(design, seed, population), StoredValues.read(file), list[Generation]()
    stage = f"{design.target.name}, generation 1"

    def report(k: int) -> None:
        progress(stage, f"then {k} of {population}", 0.0)

    try:
        with _evaluators(design, jobs) as evaluate:
            while len(generations) < most and gain([generation.best for generation in generations]) >= GAIN:
                values = stored.complete(len(generations), algorithm.ask(), evaluate, report)
                algorithm.tell(values[:, None])
                generations.append(
                    _generation(generations, algorithm, values, stored.seconds[len(generations)], design.target.size)
                )
                stage = f"{design.target.name}, generation {len(generations)}: {generations[-1]}"
    except KeyboardInterrupt:
        raise KeyboardInterrupt(f"{file} has the values found so far; the same command continues from there") from None
    progress(stage, "done", 0.0)
    points, errors = algorithm.survivors
    return tuple(generations), points[int(np.argmin(errors[:, 0]))]


def _generation(
    generations: list[Generation], algorithm: AskTell, values: Floats, seconds: float, fallen: float
) -> Generation:
    living = algorithm.survivors[1][:, 0]
    runs, down = (generations[-1].runs, generations[-1].fallen) if generations else (0, 0)
    down += int(np.count_nonzero(values >= fallen))
    return Generation(float(living.min()), float(living.mean()), runs + len(values), down, seconds)


def _algorithm(design: Design, seed: int, population: int) -> AskTell:
    """Ready to be asked."""
    first = design.random(np.random.default_rng(seed), population, ROUGHNESS)
    with needs_package("the genetic algorithm", "pymoo", "paper"):
        return AskTell(design.lower, design.upper, first, seed=seed)


@contextmanager
def _evaluators(design: Design, jobs: int) -> Iterator[Evaluate]:
    """A function that evaluates individuals (k, n), in their order."""
    if jobs == 1:
        yield lambda individuals: (_judge(design, variables) for variables in individuals)
        return
    pool = ProcessPoolExecutor(jobs, get_context("spawn"), initializer=work_for_parent)
    try:
        yield lambda individuals: pool.map(_judge, repeat(design), individuals)
    finally:
        pool.shutdown(cancel_futures=True)


def _judge(design: Design, variables: Floats) -> Judged:
    begun = process_time()
    return design.error(variables), process_time() - begun
