"""Creases of a mesh: where they are, the seams along them, and the pieces into which these cut it.

A crease is a row of edges at which a mesh turns by more than its curvature on both sides explains. Where it becomes
weaker than that, as at the crown of a groined vault, it is bridged.
"""

from collections.abc import Sequence
from functools import cached_property
from itertools import combinations, pairwise, product
from math import radians

import numpy as np
from scipy.spatial import cKDTree

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.curves import on_curve
from rodshell.geometry.frames import dot, unit
from rodshell.targets.patch import Seam, nearest
from rodshell.targets.rim import CORNER
from rodshell.targets.trianglemesh import Neighbours, TriangleMesh, chains

KINK = radians(3.0)  # an edge that turns by less belongs to no crease
RISE = 2.0  # times what the curvature on both sides explains: an edge that turns by more belongs to one
SHARE = 0.25  # of the turn from side to side, at the edge itself: another edge nearby has the rest
ROW = 1.5  # edge lengths: steps in which the curvature on both sides is taken
STEEP = 0.2  # upward part of a normal: a seam, which cuts straight down, cannot run along the foot of a wall
ALONG = 0.8  # least cosine in plan between an edge and the seam that runs along it
LINKED = 0.8  # of a row of edges: of a rougher crease most edges lie across it, and faces bridge it
GROUP = 12  # vertices around such a crease, whose middle is roughly on it
FINER = 8  # points on a curved crease from vertex to vertex

# of half the extent
NEAR = 0.05  # a crease this close to a seam is the one that is meant
SHORT = 0.1  # shorter rows of edges do not count
LONG = 0.5  # a shorter crease is not worth a seam
BRIDGED = 1.0  # longest gap between two parts of one crease
ROUGH = 0.01  # how far a crease is from the line that is named, or from the middle of the vertices around it
FINE = 1e-5  # how far it is from the seam
ON_SEAM = 1e-4  # vertices closer to a seam are on it


class Creases:
    """The creases of a mesh that are seen from above. All faces of the mesh are oriented alike."""

    def __init__(self, mesh: TriangleMesh, name: str) -> None:
        self.mesh, self.neighbours = mesh, Neighbours.of(mesh, name)
        self.extent = 0.5 * float(np.ptp(mesh.vertices, axis=0).max())

    @cached_property
    def edges(self) -> Ints:
        """(e, 2) vertices of the edges at which the mesh is creased."""
        mesh, (i, j), edges = self.mesh, self.neighbours.faces.T, self.neighbours.edges
        normals, centres = unit(mesh.doubled), mesh.vertices[mesh.faces].mean(axis=1)
        bent = np.flatnonzero(_angle(normals[i], normals[j]) > KINK)
        i, j, edges = i[bent], j[bent], edges[bent]
        if not len(edges):
            return edges
        ends = mesh.vertices[edges]
        middle, along = ends.mean(axis=1), unit(ends[:, 1] - ends[:, 0])
        step = ROW * np.sqrt(mesh.areas[i] + mesh.areas[j])[:, None]
        tree, rows = cKDTree(centres), list[Floats]()
        for face in (i, j):
            away = centres[face] - middle
            away = unit(away - dot(away, along)[:, None] * along)
            for steps in (1, 2):
                far, near = tree.query(middle + steps * step * away, k=range(1, 1 + min(3, len(centres))))
                weight = 1 / np.maximum(far, 1e-12 * self.extent)
                rows.append(unit(np.einsum("nk,nki->ni", weight, normals[near])))
        left, left_far, right, right_far = rows
        turn, explained = _angle(left, right), 2 * np.maximum(_angle(left, left_far), _angle(right, right_far))
        creased = (turn > np.maximum(KINK, RISE * explained)) & (_angle(normals[i], normals[j]) > SHARE * turn)
        return np.asarray(edges[creased & (np.minimum(left[:, 2], right[:, 2]) > STEEP)])

    def along(self, seam: Seam) -> Seam | None:
        """The seam moved onto the crease near it, roughly where faces bridge the crease; None without one."""
        ends = self.mesh.vertices[self.edges, :2]
        edge, direction = ends[:, 1] - ends[:, 0], seam.along(ends.mean(axis=1))[1]
        length = np.linalg.norm(edge, axis=1)
        kept = np.abs(np.einsum("ni,ni->n", edge, direction)) > ALONG * length
        kept &= (np.abs(seam.distance(ends.reshape(-1, 2))).reshape(-1, 2) < NEAR * self.extent).all(axis=1)
        if not length[kept].sum() > SHORT * self.extent:
            return None
        on, linked = np.unique(self.edges[kept]), set(map(frozenset, self.edges.tolist()))
        s, _ = seam.along(self.mesh.vertices[on])
        on, s = on[np.argsort(s)], np.sort(s)
        if seam.closed:
            on, s = np.append(on, on[0]), np.append(s, np.inf)
        gaps = [k for k, pair in enumerate(pairwise(on.tolist()), start=1) if frozenset(pair) not in linked]
        if len(gaps) > (1 - LINKED) * len(on):
            middles = [x.mean(axis=0) for x in np.array_split(self.mesh.vertices[on, :2], max(len(on) // GROUP, 2))]
            return Seam.of(middles + middles[:1] * seam.closed)
        crests = [_smoothed(self.mesh.vertices[run]) for run in np.split(on, gaps)]
        line, rim = list[Floats](), np.concatenate([[-1], *self.mesh.loops])
        at, low = seam.along(seam.points)[0], s[0] if on[0] in rim or seam.closed else -np.inf
        for crest, first, last in zip(crests, [0, *gaps], [*gaps, len(on)], strict=True):
            line += [self._drawn(seam, at, low, s[first]), _simplified(crest[:, :2], FINE * self.extent)]
            low = s[last - 1]
        line += [self._drawn(seam, at, low, s[-1] if on[-1] in rim else np.inf)]
        return Seam(np.vstack(line), tuple(crest for crest in crests if len(crest) > 1))

    def _drawn(self, seam: Seam, at: Floats, low: float, high: float) -> Floats:
        """The points of a seam, of arc lengths `at` (n,) [m], between two parts of a crease, or past its end."""
        return seam.points[(at > low) & (at < high) & (high > low + BRIDGED * self.extent)]

    def pieces(self, seams: Sequence[Seam], bridged: Sequence[bool]) -> dict[tuple[int, ...], TriangleMesh]:
        """The parts of the mesh by the sides of the seams on which they are; see `Patch`.

        A face that a seam crosses is in both parts where the mesh is smooth; in neither where it bridges a crease, as
        along the `bridged` seams.
        """
        within = dict[tuple[int, int], Bools]()
        for k, (seam, bridge) in enumerate(zip(seams, bridged, strict=True)):
            apart = seam.distance(self.mesh.vertices)[self.mesh.faces] / self.extent
            left, right = (apart > ON_SEAM).any(axis=1), (apart < -ON_SEAM).any(axis=1)
            near = (np.abs(apart) < ROUGH).any(axis=1)  # of which it is not sure on what side they are
            within[k, 1] = np.asarray(left & ~((right | near) & bridge))
            within[k, -1] = np.asarray(right & ~((left | near) & bridge))
        found = dict[tuple[int, ...], TriangleMesh]()
        for sides in product((1, -1), repeat=len(seams)):
            inside = np.logical_and.reduce([within[k, side] for k, side in enumerate(sides)])
            if inside.any():
                found[sides] = _without_pinches(self.mesh.only(inside))
        return found

    def lines(self, apart_from: Sequence[Seam] = ()) -> list[Floats]:
        """Polylines (n, 2) in plan, without detail, along the creases that are not near these seams [m]."""
        edges = self.edges
        for seam in apart_from:
            edges = edges[np.abs(seam.distance(self.mesh.vertices[edges].mean(axis=1))) > NEAR * self.extent]
        rows = [self.mesh.vertices[chain, :2] for chain in chains(edges)]
        rows = _joined([x for x in rows if _length(x) > SHORT * self.extent], BRIDGED * self.extent)
        lines = [_simplified(x, ROUGH * self.extent) for x in rows]
        least = [max(LINKED * _length(x), LONG * self.extent) for x in rows]
        lines = [line for line, length in zip(lines, least, strict=True) if _length(line) > length]
        found = list[Floats]()
        for line in sorted(lines, key=_length, reverse=True):
            off = [np.linalg.norm(nearest(other, line)[2], axis=1).max() for other in found]
            if off and min(off) < NEAR * self.extent:  # both sides of a row of faces that bridge a crease
                k = int(np.argmin(off))
                found[k] = found[k] - 0.5 * nearest(line, found[k])[2]
            else:
                found.append(line)
        return [np.round(line / (FINE * self.extent)) * (FINE * self.extent) + 0.0 for line in found]


def _without_pinches(mesh: TriangleMesh) -> TriangleMesh:
    """The mesh without the faces at vertices in which two parts of it touch, as where a seam cuts faces off."""
    while True:
        outer = mesh.sides.start[mesh.sides.shared == 1]
        pinched: Bools = np.bincount(outer, minlength=len(mesh.vertices)) > 1
        if not pinched.any():
            return mesh
        mesh = mesh.only(np.asarray(~pinched[mesh.faces].any(axis=1)))


def _angle(a: Floats, b: Floats) -> Floats:
    """Angles (n,) between unit vectors (n, 3) [rad]."""
    return np.asarray(np.arccos(np.clip(dot(a, b), -1.0, 1.0)))


def _length(line: Floats) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def _joined(lines: list[Floats], reach: float) -> list[Floats]:
    """Polylines joined across gaps of at most `reach` [m] where one continues another straight."""
    while True:
        least, best = reach, None
        for k, m in combinations(range(len(lines)), 2):
            for p, q in product((lines[k], lines[k][::-1]), (lines[m], lines[m][::-1])):  # the end of p, the start of q
                gap = q[0] - p[-1]
                out, onward = p[-1] - p[-1 - len(p) // 3], q[len(q) // 3] - q[0]
                straight = min(_cosine(out, onward), _cosine(out, gap), _cosine(gap, onward))
                if straight > np.cos(CORNER) and np.linalg.norm(gap) < least:
                    least, best = float(np.linalg.norm(gap)), (k, m, np.vstack([p, q]))
        if best is None:
            return lines
        lines = [*(x for n, x in enumerate(lines) if n not in best[:2]), best[2]]


def _cosine(a: Floats, b: Floats) -> float:
    """Of the angle between vectors; 1 where one has no length."""
    length = float(np.linalg.norm(a) * np.linalg.norm(b))
    return float(a @ b) / length if length > 0 else 1.0


def _smoothed(line: Floats) -> Floats:
    """A polyline (n, 3) with cubics between its corners, `FINER` times as fine; a ring is round throughout."""
    if len(line) < 3:
        return line
    ring = bool((line[0] == line[-1]).all())
    line = np.vstack([line[-4:-1], line, line[1:4]]) if ring else line
    ahead = np.diff(line, axis=0)
    length = np.linalg.norm(ahead, axis=1)
    corner = dot(ahead[1:], ahead[:-1]) < np.cos(CORNER) * length[1:] * length[:-1]
    s, parts = np.append(0.0, np.cumsum(length)), [line[:1]]
    for first, last in pairwise([0, *(np.flatnonzero(corner) + 1).tolist(), len(line) - 1]):
        dense = (s[first:last, None] + np.arange(1, FINER + 1) / FINER * length[first:last, None]).ravel()
        parts.append(on_curve(s[first : last + 1], line[first : last + 1], dense))
    return np.vstack(parts)[3 * FINER : -3 * FINER] if ring else np.vstack(parts)


def _simplified(line: Floats, off: float) -> Floats:
    """The points of a polyline (n, 2) that are needed to stay within `off` [m] [Douglas and Peucker 1973]."""
    if len(line) < 3:
        return line
    chord, x = line[-1] - line[0], line - line[0]
    share = np.clip(x @ chord / max(float(chord @ chord), 1e-300), 0.0, 1.0)
    apart = np.linalg.norm(x - share[:, None] * chord, axis=1)
    k = int(np.argmax(apart))
    if apart[k] <= off:
        return np.asarray(line[[0, -1]])
    return np.vstack([_simplified(line[: k + 1], off)[:-1], _simplified(line[k:], off)])
