"""The inverse design of the genetic algorithm [HQK 1, 3.2, ref 30]: its variables, their bounds and the objective.

G is given, from the direct result, and the rod ends are pinned on it. Sought is G0, one coordinate for each rod end,
along its rod. Nothing else of the direct result enters: neither its G0 nor its draped shape.
"""

from dataclasses import dataclass
from math import inf

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.formfinding import PatchForm, agreement, pop_up
from rodshell.formfinding.popup import PopUp
from rodshell.formfinding.trim import FEWEST_JOINTS, NEAREST_JOINT, Boundary, Footprint
from rodshell.layout import FlatGrid, FlatRod, GridLayout, mesh_grid
from rodshell.layout.flatgrid import Family
from rodshell.layout.mesh import CROWDED
from rodshell.paper.drapes import ROD
from rodshell.targets import Target

PATIENCE = 100  # Newton iterations of a pop-up from flat; smooth footprints mostly take 25 to 60
SAME = 1e-4  # of the size: ends of G are many times further apart
MICRON = 6  # decimals of bounds in m


@dataclass(frozen=True)
class Design:
    """What is sought and how it is judged.

    Parameters
    ----------
    lines : the flat grid's rods, of which only the lines count, not the ends.
    boundary : G, without a draped state.
    orbit : (2m,) which variable each rod end is, start and end of each rod in turn: one for all ends that the
        symmetry of target and grid takes into each other.
    lower, upper : (n,) bounds of the variables, which are distances along the rod from its middle [m]. From a rod
        that is taut in plan to the longest convex arch over its chord that is no higher than the target there, since
        a convex curve is no longer than its chord and twice its height.
    """

    target: Target
    layout: GridLayout
    lines: tuple[FlatRod, ...]
    boundary: Boundary
    orbit: Ints
    lower: Floats
    upper: Floats

    @staticmethod
    def of(direct: PatchForm) -> "Design":
        """The design with the target, the grid and the boundary of a direct result."""
        target, lines, points = direct.target, direct.footprint.rods, direct.trimmed.boundary.points
        orbit = _orbits(target, lines, points)
        taut, high = _reach(target, points), np.repeat(_heights(target, points), 2)
        count = np.bincount(orbit)
        # rounded, so that a search does not depend on the last digits of the direct result
        lower, upper = (np.round(np.bincount(orbit, one) / count, MICRON) for one in (taut, taut + high))
        boundary = Boundary(points, direct.trimmed.boundary.tangents)
        return Design(target, direct.layout, lines, boundary, orbit, lower, upper)

    def footprint(self, variables: Floats) -> Footprint:
        """The flat grid (n,) stands for, meshed as the direct method's: every line of the lattice makes a node."""
        reach = variables[self.orbit].reshape(-1, 2)
        middles = [self.layout.middle(line.family) for line in self.lines]
        rods = [
            line.cut(middle - before, middle + after)
            for line, middle, (before, after) in zip(self.lines, middles, reach.tolist(), strict=True)
        ]
        grid = FlatGrid.of(rods, margin=NEAREST_JOINT * min(self.layout.spacing))
        return Footprint(mesh_grid(grid, self.layout.edge, marks=[self._lattice(rod) for rod in rods]))

    def _lattice(self, rod: FlatRod) -> list[float]:
        """Where the lattice's lines cross a rod, but for those that crowd its ends [m]."""
        across: Family = "v" if rod.family == "u" else "u"
        step, first = self.layout.spacing[0 if across == "u" else 1], self.layout.phase(across)
        clear = CROWDED * self.layout.edge
        low, high = np.ceil((rod.start + clear - first) / step), np.floor((rod.end - clear - first) / step)
        return [first + step * k for k in range(int(low), int(high) + 1)]

    def pop_up(self, variables: Floats, *, patience: float = inf) -> PopUp | None:
        """The whole shell popped up from flat, pinned; None where a rod would swing or `patience` iterations are over.

        Always from flat: a shell has other stable states than the one that it reaches from there.
        """
        footprint = self.footprint(variables)
        if footprint.mesh.grid.joint_counts().min() < FEWEST_JOINTS:
            return None
        left = patience

        def told(*_: object) -> None:
            nonlocal left
            left -= 1
            if left < 0:
                raise _OutOfPatience

        try:
            return pop_up(footprint, self.boundary, ROD, ends="pinned", start="flat", progress=told)
        except _OutOfPatience:
            return None

    def error(self, variables: Floats) -> float:
        """The objective: the popped-up shell's rms distance to the target, over nodes and the middles of edges [m].

        A shell that does not stand counts as one that is off by the target's size: a rod with fewer than three
        joints, no stable state with the ends on G, or none within `PATIENCE` iterations.
        """
        popped = self.pop_up(variables, patience=PATIENCE)
        if popped is None or not popped.report.stable:
            return self.target.size
        return agreement(popped, self.target).rms

    def random(self, rng: np.random.Generator, count: int, roughness: float) -> Floats:
        """(count, n) random footprints, smooth but for a share `roughness` of the bounds at every end.

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
        return self.lower + np.clip(shares, 0.0, 1.0) * (self.upper - self.lower)


class _OutOfPatience(Exception):
    """A pop-up takes too many iterations."""


def _reach(target: Target, points: Floats) -> Floats:
    """(2m,) how far from the anchor the ends of G lie in plan, along the chord of their rod [m]."""
    ends = (points[:, :2] - target.summit).reshape(-1, 2, 2)
    chords = ends[:, 1] - ends[:, 0]
    along = chords / np.linalg.norm(chords, axis=1)[:, None]
    return np.einsum("mek,mk,e->me", ends, along, [-1.0, 1.0]).ravel()


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
    offsets = np.repeat([abs(line.offset) for line in lines], 2)
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
