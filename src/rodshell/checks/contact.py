"""Contact: rods that touch or run into each other where they should not, and how near the others come.

Each edge of a rod is a prism of the rod's section; edges much shorter than the rod is thick are taken together. Pairs
of edges that can be near are found by a tree of their middles. Two prisms are apart by the widest gap between them,
seen along any of a few directions: from one axis to the other where these are nearest, along both axes and across both,
and along the sides of both sections. A gap along any direction keeps them apart, so that no contact is missed; it is
the distance of round rods that run side by side, and otherwise a lower bound of it.

Rods whose lines cross in the flat grid meet there by design, at a joint, or over one another next to a rod's end.
About such a place nothing is checked as far along both rods as two straight rods of their breadths overlap,
(w_u + w_v) / (2 sin angle), by the smaller of the angles there and between the two edges, a breadth being that of the
section at its widest. The same holds where rods of two patches end together, no farther apart than a breadth. A rod can
touch itself only farther along its line than half around its section. Sections that are not round stand as the rods'
material frames say, and without these upright on the shell.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.spatial import cKDTree

from rodshell.arrays import Bools, Floats, Ints, State
from rodshell.checks.bending import edge_directors, shell_normals
from rodshell.figures.checks import Clearance
from rodshell.geometry.frames import adapted, cross, dot, unit
from rodshell.joints.crossings import UP
from rodshell.layout import GridMesh
from rodshell.layout.flatgrid import Crossings
from rodshell.model import Shell
from rodshell.model.rod_sections import varied_at_nodes
from rodshell.rods.section import Rod

FLATTEST = 0.17  # sine of the smallest angle at which rods are taken to cross: a net stops at 10 degrees
SHORT = 0.5  # of a section's reach: edges are taken together up to this length, which leaves 0.2 % of it as sag
SLACK = 0.05  # of the rods' breadth: crossing rods that bend together overlap for longer than straight ones
ACROSS = 0.1  # cosine to a rod's axis up to which a direction is across it


APART = Clearance(clearance=None, pairs=0, rods=None, where=None)
"""No two rods come nearer than a rod's breadth, or the section's outline is not known."""


def contact_of(shell: Shell, state: State, rod: Rod, *, each_grid: bool = False) -> Clearance:
    """Contact of a shell of equal rods in a `state` (N, 3); see `contact`."""
    frames = shell.frames
    directors = None if frames is None else edge_directors(shell, frames, state)
    return contact(shell.mesh, state[shell.node_blocks], rod, directors=directors, each_grid=each_grid)


def contact(
    mesh: GridMesh, positions: Floats, rod: Rod, *, directors: Floats | None = None, each_grid: bool = False
) -> Clearance:
    """Contact of the rods of `mesh`.

    Args:
        positions: (k, 3) of each entry of `rod_nodes` [m].
        directors: (e, 3) first material director of each edge; without, the normal of the shell.
        each_grid: of grids side by side rods of two of them are not looked at, as where each is still on its own way.
    """
    outline = _Outline.of(rod, mesh)
    if outline is None:
        return APART
    edges = _Edges(mesh, positions, outline, directors, _by_design(mesh, positions, outline), each_grid)
    first, second, p, q, limit = edges.near()
    gap = edges.gaps(first, second, q - p)
    counted = gap <= limit
    if not counted.any():
        return APART
    rods = np.sort(np.column_stack([edges.rods[first], edges.rods[second]]), axis=1)
    worst = int(np.argmin(np.where(counted, gap, np.inf)))
    a, b = (mesh.grid.rods[k].name for k in rods[worst])
    x, y, z = (0.5 * (p + q)[worst]).tolist()
    touching = len(np.unique(rods[counted & (gap <= 0)], axis=0))
    return Clearance(clearance=float(gap[worst]), pairs=touching, rods=(a, b), where=(x, y, z))


@dataclass(frozen=True, eq=False)
class _Outline:
    """A section's outline where it is widest: half its width along m1 and along m2 [m], whether it is a box or an
    ellipse, and by what these widths are multiplied at each entry (k, 2) of `rod_nodes`; None: 1 everywhere."""

    x: float
    y: float
    box: bool
    along: Floats | None = None

    @staticmethod
    def of(rod: Rod, mesh: GridMesh) -> "_Outline | None":
        if (half := rod.section.half_widths) is None:
            return None
        unchanged = _Outline(*half, rod.section.boxed)
        if (local := varied_at_nodes(mesh, rod)) is None:
            return unchanged
        depths = np.column_stack([local.depth1, local.depth2])
        widest = depths.max(axis=0)
        boxed = unchanged.box or bool((local.depth1 != local.depth2).any())  # round rods on each other: their box
        return _Outline(unchanged.x * widest[0], unchanged.y * widest[1], boxed, depths / widest)

    @property
    def round(self) -> bool:
        return not self.box and self.x == self.y

    @property
    def reach(self) -> float:
        """Farthest point from the axis [m]."""
        return float(np.hypot(self.x, self.y)) if self.box else max(self.x, self.y)

    @property
    def near(self) -> float:
        """Clearance up to which rods are near to each other: a rod's breadth [m]."""
        return 2 * self.reach

    def half_width(self, along_m1: Floats, along_m2: Floats, share: Floats | None) -> Floats:
        """Of sections with this `share` (n, 2) of the widths, seen along directions with these components."""
        parts = np.abs(self.x * along_m1), np.abs(self.y * along_m2)
        if share is not None:
            parts = share[:, 0] * parts[0], share[:, 1] * parts[1]
        return parts[0] + parts[1] if self.box else np.hypot(*parts)


def _by_design(mesh: GridMesh, positions: Floats, outline: _Outline) -> Crossings:
    """Where rods meet by design: where their lines cross in a flat grid, and where those of two grids end together."""
    beyond = 4 * outline.reach / FLATTEST
    grids = [grid.grid.meetings(beyond) for grid in mesh.grids]
    if len(grids) == 1:
        return grids[0]
    firsts = np.cumsum([0, *(len(grid.grid.rods) for grid in mesh.grids)])
    ends = positions[mesh.end_entries]
    together = cKDTree(ends).query_pairs(outline.near, output_type="ndarray")
    of_ends = np.repeat(mesh.grid_of_rods, 2)
    together = together[of_ends[together[:, 0]] != of_ends[together[:, 1]]]
    return Crossings(
        np.concatenate([*(found.rods + by for found, by in zip(grids, firsts, strict=False)), together // 2]),
        np.concatenate([*(found.at for found in grids), mesh.grid.ends.ravel()[together]]),
    )


class _Edges:
    """All edges of a shape as prisms."""

    def __init__(
        self, mesh: GridMesh, positions: Floats, outline: _Outline, directors: Floats | None, crossings: Crossings,
        each_grid: bool = False,
    ) -> None:  # fmt: skip
        self.mesh, self.outline, self._each_grid = mesh, outline, each_grid
        rods = np.sort(crossings.rods, axis=1)
        swapped = (rods != crossings.rods)[:, :1]
        self.crossings = Crossings(rods, np.where(swapped, crossings.at[:, ::-1], crossings.at))
        rod_of = mesh.rod_of
        together = max(1, int(SHORT * outline.reach / mesh.edge_lengths.max()))
        kept = (np.arange(len(rod_of)) - mesh.rod_start[rod_of]) % together == 0
        kept[mesh.rod_stop - 1] = True
        entries = np.flatnonzero(kept)
        same_rod = rod_of[entries[1:]] == rod_of[entries[:-1]]
        begins, ends = entries[:-1][same_rod], entries[1:][same_rod]
        self.rods, self.start, self.stop = rod_of[begins], positions[begins], positions[ends]
        self.station = 0.5 * (mesh.stations[begins] + mesh.stations[ends])  # of the middles
        self.lengths = mesh.stations[ends] - mesh.stations[begins]
        self.tangent = unit(self.stop - self.start)
        self._directors = None if directors is None else directors[begins - self.rods]
        self._positions, self._begins = positions, begins
        along = outline.along
        self._share = None if along is None else np.maximum(along[begins], along[ends])

    @cached_property
    def across(self) -> tuple[Floats, Floats]:
        """(e, 3) directors m1 and m2 of each edge."""
        if self._directors is not None:
            m1 = adapted(self._directors, self.tangent)
        else:
            nodes = np.zeros((self.mesh.node_count, 3))
            nodes[self.mesh.rod_nodes] = self._positions
            normals = shell_normals(self.mesh, nodes)
            upright = np.broadcast_to(UP, self.start.shape)
            m1 = adapted(upright if normals is None else normals[self._begins], self.tangent)
        return m1, cross(self.tangent, m1)

    def candidates(self) -> tuple[Ints, Ints, Floats]:
        """Pairs of edges that may be near, except those that meet by design: first, second, and the gap from which
        they count as near [m]; crossing rods, and parts of one rod, only when they touch away from there."""
        reach = self.outline.reach
        radius = np.linalg.norm(self.stop - self.start, axis=1).max() + 2 * reach + self.outline.near
        found = cKDTree(0.5 * (self.start + self.stop)).query_pairs(radius, output_type="ndarray")
        first, second = found[:, 0], found[:, 1]  # the first comes first in the order of the rods
        rods = self.rods[first], self.rods[second]
        same_rod = rods[0] == rods[1]
        cut = np.zeros(len(same_rod), dtype=bool)
        apart = np.abs(self.station[first] - self.station[second])[same_rod]
        between = 0.5 * (self.lengths[first] + self.lengths[second])[same_rod]
        cut[same_rod] = apart - between <= np.pi * reach
        meeting = np.zeros(len(same_rod), dtype=bool)
        for pairs, crossings in self._met(*rods):
            meeting[pairs] = True
            cut[pairs] |= self._overlap(first[pairs], second[pairs], crossings)
        if self._each_grid:
            cut |= self.mesh.grid_of_rods[rods[0]] != self.mesh.grid_of_rods[rods[1]]
        kept = ~cut
        limit = np.where(meeting, -2 * SLACK * reach, np.where(same_rod, 0.0, self.outline.near))
        return first[kept], second[kept], limit[kept]

    def _met(self, low: Ints, high: Ints) -> Iterator[tuple[Ints, Ints]]:
        """Which pairs of rods meet at which crossings, over and over: patches' rods may meet at both their ends."""
        count = len(self.mesh.grid.rods)
        known = self.crossings.rods @ [count, 1]
        order, wanted = np.argsort(known, kind="stable"), low * count + high
        first, last = (np.searchsorted(known[order], wanted, side=side) for side in ("left", "right"))
        while (here := np.flatnonzero(first < last)).size:
            yield here, order[first[here]]
            first += 1

    def _overlap(self, first: Ints, second: Ints, crossings: Ints) -> Bools:
        """Whether both edges lie so near to the crossing of their rods that they overlap there by design."""
        tangents = self.tangent[first], self.tangent[second]
        sine = np.minimum(np.linalg.norm(cross(*tangents), axis=1), self._sines[crossings])
        result = np.ones(len(first), dtype=bool)
        for side, edge in enumerate((first, second)):
            away = np.abs(self.station[edge] - self.crossings.at[crossings, side]) - 0.5 * self.lengths[edge]
            result &= away <= 2 * self.outline.reach / np.maximum(sine, FLATTEST)
        return result

    def near(self) -> tuple[Ints, Ints, Floats, Floats, Floats]:
        """Of the candidates those that are near by their axes: first, second, nearest points on each, and limit."""
        first, second, limit = self.candidates()
        p, q = nearest_points(self.start[first], self.stop[first], self.start[second], self.stop[second])
        kept = np.linalg.norm(q - p, axis=1) <= 2 * self.outline.reach + limit
        return first[kept], second[kept], p[kept], q[kept], limit[kept]

    def gaps(self, first: Ints, second: Ints, between: Floats) -> Floats:
        """(p,) widest gap between the prisms of each pair [m], negative where they overlap.

        between : (p, 3) from the first axis to the second where they are nearest [m].
        """
        ta, tb = self.tangent[first], self.tangent[second]
        directions = [between, ta, tb, cross(ta, tb)]
        if not self.outline.round:
            directions += [director[edges] for edges in (first, second) for director in self.across]
        widest = np.full(len(first), -2 * self.outline.reach)  # where axes lie in each other
        for number, direction in enumerate(directions):
            size = np.linalg.norm(direction, axis=1)
            seen = size > 1e-9 * self.outline.reach
            n = direction[seen] / size[seen, None]
            ends = [[dot(n, end[edges[seen]]) for end in (self.start, self.stop)] for edges in (first, second)]
            (low_a, high_a), (low_b, high_b) = ((np.minimum(*pair), np.maximum(*pair)) for pair in ends)
            apart = np.maximum(low_b - high_a, low_a - high_b)
            apart -= self._half_width(first[seen], n) + self._half_width(second[seen], n)
            # prisms that overlap are not pulled apart along their axes: rods continue past their edges
            along = np.maximum(np.abs(dot(n, ta[seen])), np.abs(dot(n, tb[seen])))
            counts = (apart > 0) | (along < ACROSS) | (number == 0)
            widest[seen] = np.maximum(widest[seen], np.where(counts, apart, -np.inf))
        return widest

    def _half_width(self, edges: Ints, n: Floats) -> Floats:
        share = None if self._share is None else self._share[edges]
        if self.outline.round:
            radius = self.outline.x if share is None else self.outline.x * share[:, 0]
            return np.asarray(radius * np.sqrt(np.maximum(1.0 - dot(n, self.tangent[edges]) ** 2, 0.0)))
        m1, m2 = self.across
        return self.outline.half_width(dot(n, m1[edges]), dot(n, m2[edges]), share)

    @cached_property
    def _sines(self) -> Floats:
        """(c,) sine of the angle between the rods at each crossing."""
        tangents = [self.tangent[self._edge_at(self.crossings.rods[:, k], self.crossings.at[:, k])] for k in (0, 1)]
        return np.asarray(np.linalg.norm(cross(*tangents), axis=1))

    def _edge_at(self, rods: Ints, at: Floats) -> Ints:
        """Edge of each rod at a material coordinate."""
        low, span = self.station.min(), np.ptp(self.mesh.stations) + 1.0
        keys = self.rods * span + (self.station + 0.5 * self.lengths - low)
        after = np.searchsorted(keys, rods * span + (at - low))
        first, stop = (np.searchsorted(self.rods, rods, side=side) for side in ("left", "right"))
        return np.asarray(np.clip(after, first, stop - 1))


def nearest_points(a: Floats, a_end: Floats, b: Floats, b_end: Floats) -> tuple[Floats, Floats]:
    """(p, 3) nearest points of segments a and b, pair by pair [Ericson, Real-Time Collision Detection, section 5.1.9].

    Where segments are parallel over a stretch, one pair of points of that stretch.

    Args:
        a, a_end: (p, 3) ends of the first segment of each pair.
        b, b_end: (p, 3) ends of the second segment of each pair, in the same unit.
    """
    u, v, w = a_end - a, b_end - b, a - b
    uu, vv, uv, uw, vw = dot(u, u), dot(v, v), dot(u, v), dot(u, w), dot(v, w)
    skew = uu * vv - uv**2
    parallel = skew <= 1e-14 * uu * vv
    s = np.where(parallel, 0.0, np.clip((uv * vw - uw * vv) / np.where(parallel, 1.0, skew), 0.0, 1.0))
    t = np.clip((uv * s + vw) / vv, 0.0, 1.0)
    s = np.clip((uv * t - uw) / uu, 0.0, 1.0)
    return a + s[:, None] * u, b + t[:, None] * v
