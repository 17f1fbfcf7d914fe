"""A triangle mesh as a surface: vertices merged, faces oriented alike, in one smooth piece; others are refused."""

from dataclasses import dataclass
from functools import cached_property
from math import cos, degrees, radians
from typing import NamedTuple

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import breadth_first_order, connected_components

from rodshell.arrays import Bools, Floats, Ints, Longs
from rodshell.errors import InputError
from rodshell.geometry.frames import cross, dot, unit
from rodshell.units import point_text

CREASE = 40.0  # degrees between faces, and between what is on either side: a smooth piece ends there
STRAY = 0.01  # of the area: separate pieces with less in sum are left out
WELD = 1e-6  # of the largest extent: vertices this close are merged; single precision has 1e-7
SPOILT = 0.7  # least cosine between a vertex's normal and the mean of the faces around it
SWEEPS = 8  # by which normals at the rim are corrected, each by half
MOST_FACES = 3_000_000
FARTHEST = 1e9  # m: coordinates that are still known to a micrometre


class Sides(NamedTuple):
    """The sides of triangles, of which the side 3 t + k runs from corner k of triangle t to the next: (3 t,) its ends,
    which edge it is, in the order of the vertices, and how many triangles share that."""

    start: Ints
    end: Ints
    edge: Ints
    shared: Ints

    @staticmethod
    def of(triangles: Ints) -> "Sides":
        start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
        _, edge = unique_rows(np.column_stack([np.minimum(start, end), np.maximum(start, end)]).astype(np.int64))
        return Sides(start, end, edge, np.bincount(edge)[edge])

    @property
    def twins(self) -> Ints:
        """(e, 2) the two sides of each edge between two triangles."""
        order = np.argsort(self.edge, kind="stable")
        return np.asarray(order[self.shared[order] == 2].reshape(-1, 2))


@dataclass(frozen=True, eq=False)
class TriangleMesh:
    """A mesh of triangles; make one with `sound_mesh`.

    Args:
        vertices: (n, 3) [m].
        faces: (m, 3) indices of vertices, in counter-clockwise order seen from outside.
    """

    vertices: Floats
    faces: Ints

    def __repr__(self) -> str:
        return f"TriangleMesh({len(self.vertices)} vertices, {len(self.faces)} faces)"

    @cached_property
    def sides(self) -> Sides:
        return Sides.of(self.faces)

    @cached_property
    def doubled(self) -> Floats:
        """(m, 3) outward normals of the faces, with a length of twice their area [m2]."""
        a, b, c = self.vertices[self.faces.T]
        return cross(b - a, c - a)

    @cached_property
    def areas(self) -> Floats:
        """(m,) areas of the faces [m2]."""
        return np.asarray(0.5 * np.linalg.norm(self.doubled, axis=1))

    @cached_property
    def normals(self) -> Floats:
        """(n, 3) unit normals of the vertices, exact on a sphere [Max 1999, Weights for normals].

        Slivers count most there: where they turn a normal away from the mean of two rows of faces, that is taken.
        """
        result = np.zeros_like(self.vertices)
        for k in range(3):
            here, after, before = (self.faces[:, (k + i) % 3] for i in range(3))
            p, q = self.vertices[after] - self.vertices[here], self.vertices[before] - self.vertices[here]
            scale = np.maximum(dot(p, p) * dot(q, q), 1e-300)
            np.add.at(result, here, self.doubled / scale[:, None])
        mean, wide = np.zeros_like(result), np.zeros_like(result)
        np.add.at(mean, self.faces, self.doubled[:, None])
        np.add.at(wide, self.faces, mean[self.faces].sum(axis=1)[:, None])
        result = np.where((_cosine(result, wide) < SPOILT)[:, None], wide, result)
        result /= np.maximum(np.linalg.norm(result, axis=1), 1e-300)[:, None]
        return self._with_rim_normals(result)

    def _with_rim_normals(self, normals: Floats) -> Floats:
        """Normals (n, 3) of the vertices, those at the rim corrected, as faces on one side only miss them.

        Along each edge of an arc, and of any parabola, the slopes at both ends are opposite against its chord. Where
        slivers turn a normal far away, it stays what it was.
        """
        given, rim = normals.copy(), np.zeros(len(self.vertices), dtype=bool)
        a, b, _, shared = self.sides
        rim[a[shared == 1]] = True
        here, there = np.append(a, b), np.append(b, a)
        here, there = here[rim[here]], there[rim[here]]
        if not len(here):
            return normals
        along = unit(self.vertices[there] - self.vertices[here])
        at = np.flatnonzero(rim)
        spoilt = np.zeros(len(at), dtype=bool)
        for _ in range(SWEEPS):
            flat = along - dot(along, normals[here])[:, None] * normals[here]
            off = 0.5 * dot(normals[here] + normals[there], along)
            square, known = np.zeros((len(normals), 3, 3)), np.zeros_like(normals)
            np.add.at(square, here, flat[:, :, None] * flat[:, None, :])
            np.add.at(known, here, off[:, None] * flat)
            across = normals[at][:, :, None] * normals[at][:, None, :]
            turn = np.linalg.solve(square[at] + across + 1e-3 * np.eye(3), known[at][..., None])[..., 0]
            turned = unit(normals[at] - turn)
            spoilt |= dot(turned, given[at]) < SPOILT
            normals[at] = np.where(spoilt[:, None], given[at], turned)
        return normals

    @cached_property
    def loops(self) -> list[Ints]:
        """The open boundary: vertices of each closed loop, the longest first; the surface is on their left."""
        a, b, _, shared = self.sides
        after = dict(zip(a[shared == 1].tolist(), b[shared == 1].tolist(), strict=True))
        loops = list[Ints]()
        while after:
            first, here = after.popitem()
            loop = [first]
            while here != first:
                loop.append(here)
                here = after.pop(here)
            loops.append(np.array(loop, dtype=np.intp))
        return sorted(loops, key=lambda loop: -self.length(loop))

    def section(self, z: float) -> list[Floats]:
        """Closed polylines (n, 3) [m] in which the plane at height `z` [m] cuts the surface."""
        above = self.vertices[:, 2] > z
        cut = above[self.faces].any(axis=1) & ~above[self.faces].all(axis=1)
        a, b = self.faces[cut], np.roll(self.faces[cut], -1, axis=1)
        crossed = above[a] != above[b]
        ends = np.column_stack([np.minimum(a, b)[crossed], np.maximum(a, b)[crossed]])
        first, kind = unique_rows(ends.astype(np.int64))
        low, high = self.vertices[ends[first].T]
        points = low + ((z - low[:, 2]) / (high[:, 2] - low[:, 2]))[:, None] * (high - low)
        return [points[chain[:-1]] for chain in chains(kind.reshape(-1, 2))]

    def length(self, loop: Ints) -> float:
        """Length of a closed loop of vertices [m]."""
        x = self.vertices[loop]
        return float(np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1).sum())

    def only(self, faces: Bools) -> "TriangleMesh":
        """The part of the mesh that consists of the faces marked in `faces` (m,)."""
        used, renumbered = np.unique(self.faces[faces], return_inverse=True)
        return TriangleMesh(self.vertices[used], renumbered.reshape(-1, 3).astype(np.intp))


class SoundMesh(NamedTuple):
    """A mesh that was checked and repaired.

    Args:
        surface: the smooth piece of it that covers most of the plan, facing up; the whole where there is none.
        repairs: what was changed, in sentences.
        whole: all of it between and beyond its creases, oriented alike.
        creased: what is said of its creases; "" where it has none.
        smooth: whether the surface has no crease within.
    """

    surface: TriangleMesh
    repairs: list[str]
    whole: TriangleMesh
    creased: str
    smooth: bool


def sound_mesh(vertices: Floats, faces: Ints, name: str) -> SoundMesh:
    """Check and repair a mesh: vertices (n, 3) [m] and faces (m, 3).

    Normals may point to either side. Creases end the surface: of a half ball with its floor, or of a shell with a
    thickness, the piece that covers most of the plan is taken.

    Raises:
        InputError: the mesh is empty, not finite, not manifold, one-sided or in several pieces; names the place.
    """
    _require_numbers(vertices, faces, name)
    mesh, repairs = _main_piece(_welded(vertices, faces, name), name)
    neighbours = Neighbours.of(mesh, name)
    turned = neighbours.turned(len(mesh.faces), name, mesh)
    if turned.any() and not turned.all():
        fewer = min(int(turned.sum()), int((~turned).sum()))
        repairs.append(f"{fewer} of {len(turned)} faces were reversed to face the same side as the others")
    mesh = TriangleMesh(mesh.vertices, np.where(turned[:, None], mesh.faces[:, ::-1], mesh.faces))
    if not len(mesh.loops) and _volume(mesh) < 0:
        mesh = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    return smooth_piece(mesh, neighbours, name)._replace(repairs=repairs)


def _require_numbers(vertices: Floats, faces: Ints, name: str) -> None:
    if len(faces) == 0 or len(vertices) == 0:
        raise InputError(f"{name} has no faces: export the surface as a mesh of triangles")
    if len(faces) > MOST_FACES:
        raise InputError(f"{name} has {len(faces)} faces: reduce it to {MOST_FACES} or fewer")
    require_indices(vertices, faces, name)
    bad = ~np.isfinite(vertices[faces]).all(axis=(1, 2))
    if bad.any():
        raise InputError(f"{name} has {int(bad.sum())} faces with coordinates that are not finite: export it again")
    far = float(np.abs(vertices[faces]).max())
    if far > FARTHEST:
        raise InputError(f"{name} has coordinates up to {far:.3g} m: move it near the origin, or export it again")


def require_indices(vertices: Floats, faces: Ints, name: str) -> None:
    """Refuse faces, of any shape, with vertices that are not there."""
    if faces.min(initial=0) < 0 or faces.max(initial=-1) >= len(vertices):
        wrong = int(faces.max() if faces.min() >= 0 else faces.min())
        raise InputError(f"{name} is damaged: a face refers to vertex {wrong} of {len(vertices)}: export it again")


def _welded(vertices: Floats, faces: Ints, name: str) -> TriangleMesh:
    """Merge equal vertices; remove faces without three different vertices, and duplicate faces."""
    used = np.unique(faces)
    extent = float(np.ptp(vertices[used], axis=0).max())
    if not extent > 0:
        raise InputError(f"{name} has no extent, all its vertices coincide: export it again")
    rounded = np.round((vertices[used] - vertices[used].min(axis=0)) / (WELD * extent)).astype(np.int64)
    first, kind = unique_rows(rounded)
    number = np.zeros(len(vertices), dtype=np.intp)
    number[used] = kind
    faces = number[faces]
    a, b, c = faces.T
    faces = faces[(a != b) & (b != c) & (c != a)]
    once, _ = unique_rows(np.sort(faces, axis=1))
    mesh = TriangleMesh(vertices[used][first], faces[np.sort(once)])
    if len(mesh.faces) == 0 or mesh.areas.sum() < 1e-9 * extent**2:
        raise InputError(f"{name} has no area, all its faces are degenerate: export it again")
    return mesh


def _main_piece(mesh: TriangleMesh, name: str) -> tuple[TriangleMesh, list[str]]:
    """The mesh without stray objects: faces that no edge connects to the rest."""
    count, edge = len(mesh.faces), mesh.sides.edge
    nodes = np.arange(len(edge)) // 3, count + edge
    graph = coo_matrix((np.ones(len(edge)), nodes), (count + int(edge.max()) + 1,) * 2)
    pieces = connected_components(graph, directed=False)[1][:count]
    shares = np.bincount(pieces, mesh.areas) / mesh.areas.sum()
    if len(shares) == 1:
        return mesh, []
    if shares.max() < 1 - STRAY:
        largest = 100 * np.sort(shares)[::-1]
        raise InputError(
            f"{name} has {len(shares)} separate pieces (the largest two have {largest[0]:.0f} and {largest[1]:.0f} % "
            "of the area): keep one, or join them"
        )
    others = pieces != np.argmax(shares)
    left_out = f"separate pieces with {100 * (1 - shares.max()):.2g} % of the area were left out ({others.sum()} faces)"
    return mesh.only(~others), [left_out]


def unique_rows(rows: Longs) -> tuple[Ints, Ints]:
    """Of rows (n, k) of integers from 0 on: the index (m,) of the first of each kind, and the kind (n,) of each."""
    key, kinds = np.zeros(len(rows), dtype=np.int64), 1
    for column in rows.T:
        more = int(column.max(initial=0)) + 1
        if kinds * more >= 2**63:
            key = np.unique(key, return_inverse=True)[1].reshape(-1)
            kinds = int(key.max()) + 1
        key, kinds = key * more + column, kinds * more
    _, first, kind = np.unique(key, return_index=True, return_inverse=True)
    return first, kind.reshape(-1)


def turned(faces: Ints, first: Ints) -> Ints:
    """Rows (m, 3), such as the corners of triangles, each turned until its entry `first` (m,) comes first."""
    return np.take_along_axis(faces, (first[:, None] + np.arange(3)) % 3, axis=1)


def chains(edges: Ints) -> list[Ints]:
    """Vertices of the rows into which edges (e, 2) fall at vertices where other than two of them meet; the
    last of a ring is its first."""
    at: dict[int, set[int]] = {}
    for a, b in edges.tolist():
        at.setdefault(a, set()).add(b)
        at.setdefault(b, set()).add(a)
    ends = {k for k in at if len(at[k]) != 2}
    found = list[Ints]()
    for first in [*ends, *at]:  # rings, which have no end, last
        while at[first]:
            chain = [first, at[first].pop()]
            at[chain[1]].remove(first)
            while chain[-1] not in ends and at[chain[-1]]:
                chain.append(at[chain[-1]].pop())
                at[chain[-1]].remove(chain[-2])
            found.append(np.array(chain, dtype=np.intp))
    return found


@dataclass(frozen=True, eq=False)
class Neighbours:
    """Neighbouring faces.

    Args:
        faces: (e, 2) pairs of faces that share an edge.
        edges: (e, 2) vertices of that edge.
        against: (e,) whether both faces run along it in the same direction, and so face opposite sides.
    """

    faces: Ints
    edges: Ints
    against: Bools

    @staticmethod
    def of(mesh: TriangleMesh, name: str) -> "Neighbours":
        a, b, edge, shared = mesh.sides
        if (shared > 2).any():
            where = point_text(mesh.vertices[a[np.argmin(np.where(shared > 2, edge, len(edge)))]])
            raise InputError(f"{name} is not manifold: three faces or more share the edge near {where}: remove one")
        twins, rim = mesh.sides.twins, shared == 1
        ends = np.bincount(np.concatenate([a[rim], b[rim]]), minlength=len(mesh.vertices))
        if (ends > 2).any():
            where = point_text(mesh.vertices[np.argmax(ends)])
            raise InputError(
                f"{name} is not manifold: two parts of it touch in the single point {where}: add or remove a face there"
            )
        first, second = twins.T
        return Neighbours(twins // 3, np.column_stack([a, b])[first], a[first] == a[second])

    def pieces(self, keep: Bools, faces: int) -> Ints:
        """Index (m,) of the piece of each face, where only the edges `keep` (e,) connect faces."""
        i, j = self.faces[keep].T
        return np.asarray(connected_components(coo_matrix((np.ones(len(i)), (i, j)), (faces, faces)), False)[1])

    def turned(self, faces: int, name: str, mesh: TriangleMesh) -> Bools:
        """(m,) which faces are oriented against the first one."""
        i, j = self.faces.T
        if not len(i):  # a single face, and SciPy cannot look up no entries
            return np.zeros(faces, dtype=bool)
        graph = coo_matrix((np.where(self.against, 2.0, 1.0), (i, j)), (faces, faces)).tocsr()
        graph = graph + graph.T
        order, before = breadth_first_order(graph, 0, directed=False)
        later, parents = order[1:], before[order[1:]]
        odd = np.zeros(faces, dtype=bool)
        odd[later] = np.asarray(graph[later, parents]).ravel() == 2.0
        turned = [False] * faces
        for k, parent, flip in zip(later.tolist(), parents.tolist(), odd[later].tolist(), strict=True):
            turned[k] = turned[parent] ^ flip
        result = np.array(turned)
        wrong = (result[i] ^ result[j]) != self.against
        if wrong.any():
            where = point_text(mesh.vertices[self.edges[np.argmax(wrong), 0]])
            raise InputError(f"{name} has only one side, as a Moebius strip has (found near {where}): cut it")
        return result


def _volume(mesh: TriangleMesh) -> float:
    centre = mesh.vertices.mean(axis=0)
    return float(dot(mesh.vertices[mesh.faces[:, 0]] - centre, mesh.doubled).sum())


def _turns_at(mesh: TriangleMesh, neighbours: Neighbours) -> Floats:
    """Cosines (e,) of the angles by which a mesh turns at the edges between two faces, and from what is on one side of
    them to what is on the other: the larger of both."""
    i, j = neighbours.faces.T
    # A sliver's own normal is noise: it is judged with the two rows of faces behind it, by their areas near its edges.
    ends = mesh.vertices[neighbours.edges]
    square, double = np.sum((ends[:, 1] - ends[:, 0]) ** 2, axis=1), 2 * mesh.areas
    share = [square / np.maximum(double[there], square) for there in (j, i)]
    graph = coo_matrix((np.concatenate(share), (np.append(i, j), np.append(j, i))), (len(double),) * 2).tocsr()
    near = mesh.doubled + graph @ mesh.doubled
    wide = mesh.doubled + graph @ near
    sides = wide[i] - share[0][:, None] * near[j], wide[j] - share[1][:, None] * near[i]
    return np.maximum(_cosine(mesh.doubled[i], mesh.doubled[j]), _cosine(*sides))


def smooth_piece(mesh: TriangleMesh, neighbours: Neighbours, name: str) -> SoundMesh:
    """Of a mesh whose faces are oriented alike the piece between creases that covers most of the plan, facing up."""
    i, j = neighbours.faces.T
    cosine = _turns_at(mesh, neighbours)
    smooth = cosine > cos(radians(CREASE))
    closed = not len(mesh.loops)
    pieces = neighbours.pieces(smooth, len(mesh.faces))
    plan = np.bincount(pieces, mesh.doubled[:, 2]) / 2
    chosen = int(np.argmax(plan if closed else np.abs(plan)))
    if not closed and plan[chosen] < 0:
        mesh = TriangleMesh(mesh.vertices, mesh.faces[:, ::-1])
    if smooth.all():
        return SoundMesh(mesh, [], mesh, "", True)
    within = np.flatnonzero(~smooth & (pieces[i] == chosen) & (pieces[j] == chosen))
    share = mesh.areas[pieces == chosen].sum() / mesh.areas.sum()
    if len(within) or share < 0.1:
        worst = within[np.argmin(cosine[within])] if len(within) else int(np.argmin(cosine))
        angle = degrees(np.arccos(np.clip(cosine[worst], -1, 1)))
        where = point_text(mesh.vertices[neighbours.edges[worst, 0]])
        creased = (
            f"{name} is creased: faces meet at {angle:.0f} degrees near {where}, and a target must be smooth: "
            "round it off, or mesh it more finely"
        )
        return SoundMesh(mesh, [], mesh, creased, False)
    creased = (
        f"the surface has creases: the target is the smooth piece of it that covers most of the plan, "
        f"{100 * share:.0f} % of the area"
    )
    surface = mesh.only(pieces == chosen)
    Neighbours.of(surface, name)  # refuses a piece that touches itself in a point
    return SoundMesh(surface, [], mesh, creased, True)


def _cosine(a: Floats, b: Floats) -> Floats:
    """Of the angles between vectors (n, 3); 1 where one has no length."""
    length = np.sqrt(dot(a, a) * dot(b, b))
    return np.asarray(np.where(length > 0, dot(a, b) / np.maximum(length, 1e-300), 1.0))
