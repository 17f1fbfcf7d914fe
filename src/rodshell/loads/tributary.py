"""Tributary areas: the part of the target's surface whose loads each node of the rods takes.

The surface is divided into small triangles over its plan, up to its edge: triangles across the edge are cut where it
is, which is found by bisection. Each corner of a triangle hands a third of its area to the nearest node, in equal
parts where several are as near. So the areas add up to those of the surface and of its plan, to second order in the
triangles' size, and those of a symmetric shell are symmetric: the triangles are laid along its rods from its anchor.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from math import cos, sin

import numpy as np
from scipy.spatial import cKDTree

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import cross, dot
from rodshell.targets import Target
from rodshell.targets.freeform import Freeform
from rodshell.units import length_text
from rodshell.validation import brief

ACROSS = 240  # triangles' sides across the surface's larger width, at least
_A_SPACING = 24.0  # sides on the distance of two rods, at least
_MOST_ACROSS = 900
_BISECTIONS = 40
_ON_THE_EDGE = 1e-6  # of the size: a vertex of a mesh so near to its end is inside
STEEP, MOST_HALVINGS = 2.5, 8  # of the step: where the surface is steep longer sides are halved, so many times
_NEEDLE = 4.0  # a triangle's longest side over its height: longer ones are cut across first
_NEIGHBOURS, _AS_NEAR = 4, 1e-6  # nodes that may share a corner, and by what share of the size their distances differ

REACH = 1.0  # distances of two rods: a point load farther from every rod is refused


@dataclass(frozen=True, eq=False)
class Tributary:
    """What each of the n nodes of a mesh takes of a surface.

    Args:
        area: (n,) of the surface [m2].
        plan: (n,) of its plan [m2].
        vectors: (n, 3) areas times the unit normals that point up [m2].
        plan_positions: (n, 2) middle of each node's part of the plan [m]; of a node without one its own place.
    """

    area: Floats
    plan: Floats
    vectors: Floats
    plan_positions: Floats

    __repr__ = brief


@dataclass(frozen=True, eq=False)
class LoadedNodes:
    """The nodes of a shell that loads act on.

    Args:
        positions: (n, 3) of the unloaded shell [m].
        mass: (n,) of rods and joints, lumped [kg].
        tributary: areas of the target that each node takes.
        spacing: distance of two neighbouring rods [m].
    """

    positions: Floats
    mass: Floats
    tributary: Tributary
    spacing: float

    __repr__ = brief

    def along(self, direction: float) -> Floats:
        """(n, 2) middles of the nodes' plan areas in axes along a `direction` [rad] and across it, from the middle of
        the plan's extent in each of them [m]."""
        x, y = self.tributary.plan_positions.T
        axes = np.array([cos(direction) * x + sin(direction) * y, cos(direction) * y - sin(direction) * x])
        return np.asarray((axes - 0.5 * (axes.min(axis=1) + axes.max(axis=1))[:, None]).T)

    def nearest(self, at: Sequence[float], what: str) -> int:
        """The node that is nearest to a point of the plan [m].

        Raises:
            InputError: `what` acts there, and no rod is near.
        """
        away = np.linalg.norm(self.positions[:, :2] - np.asarray(at), axis=1)
        nearest = int(np.argmin(away))
        if away[nearest] > REACH * self.spacing:
            raise InputError(
                f"{what} acts at ({at[0]:g}, {at[1]:g}) m, {length_text(float(away[nearest]))} away from the nearest "
                "rod: move it onto the shell"
            )
        return nearest

    def downwards(self, size: Floats) -> Floats:
        """(n, 3) forces of this size (n,) on each node, straight down."""
        result = np.zeros((len(size), 3))
        result[:, 2] = -size
        return result


def tributary_areas(
    target: Target, positions: Floats, *, anchor: tuple[float, float], rotate: float, spacing: float
) -> Tributary:
    """The areas of a surface that the nodes on it take.

    Args:
        target: the surface, up to its end; where parts lie one above the other, the uppermost.
        positions: (n, 3) of the nodes, on the surface or next to it [m].
        anchor: point of the plan from which the triangles are laid [m].
        rotate: angle of their sides [rad].
        spacing: smallest distance of two neighbouring rods [m].
    """
    step = _step(target, spacing)
    if isinstance(target, Freeform):
        corners, faces = mesh_triangles(target, step=step)
    else:
        corners, faces = surface_triangles(target, anchor=anchor, rotate=rotate, step=step)
    a, b, c = (corners.take(faces[:, k], axis=0) for k in range(3))
    vector = 0.5 * cross(b - a, c - a)
    shares = np.column_stack([np.sqrt(dot(vector, vector)), vector]) / 3.0
    at_corners = _sums(faces.T, [shares] * 3, len(corners))
    wanted = range(1, 1 + min(_NEIGHBOURS, len(positions)))
    distance, nearest = map(np.asarray, cKDTree(positions).query(corners, k=list(wanted)))
    as_near = distance <= distance[:, :1] + _AS_NEAR * target.size
    weight = as_near / as_near.sum(axis=1, keepdims=True)
    parts = [weight[:, k, None] * at_corners for k in range(nearest.shape[1])]
    result = _sums(nearest.T, parts, len(positions))
    moments = _sums(nearest.T, [part[:, 3:] * corners[:, :2] for part in parts], len(positions))
    plan = result[:, 3]
    middle = np.where(plan[:, None] > 0, moments / np.maximum(plan, 1e-300)[:, None], positions[:, :2])
    return Tributary(result[:, 0], plan, result[:, 1:], middle)


def _sums(indices: Ints, parts: Sequence[Floats], count: int) -> Floats:
    """(count, j) sums of the rows of each of the `parts` (k, n, j) by their `indices` (k, n)."""
    columns = range(parts[0].shape[1])
    each = [[np.bincount(at, part[:, j], count) for j in columns] for at, part in zip(indices, parts, strict=True)]
    return np.asarray(np.sum(each, axis=0).T)


def surface_triangles(
    target: Target, *, anchor: tuple[float, float], rotate: float, step: float
) -> tuple[Floats, Ints]:
    """A surface up to its end in triangles: corners (k, 3) [m], and faces (m, 3), upwards.

    Args:
        anchor: point of the plan that is a corner, where it lies inside [m].
        rotate: angle of the sides [rad].
        step: their length in plan [m].
    """
    reach = 2.5 * target.size + float(np.hypot(*(np.array(anchor) - target.summit)))
    count = int(np.ceil(reach / step))
    ticks = step * np.arange(-count, count + 1)
    along, across = (side.ravel() for side in np.meshgrid(ticks, ticks, indexing="ij"))
    cos, sin = np.cos(rotate), np.sin(rotate)
    plan = np.column_stack([cos * along - sin * across, sin * along + cos * across]) + anchor
    points, inside = _lifted(target, plan)
    index = np.arange(len(plan)).reshape(len(ticks), len(ticks))
    sw, se, nw, ne = index[:-1, :-1], index[1:, :-1], index[:-1, 1:], index[1:, 1:]
    used = (inside[sw] | inside[se] | inside[nw] | inside[ne]).ravel()
    sw, se, nw, ne = (part.ravel()[used] for part in (sw, se, nw, ne))
    # four triangles a square, about its middle: no direction is preferred
    middle = len(plan) + np.arange(len(sw))
    middles, within = _lifted(target, 0.25 * (plan[sw] + plan[se] + plan[nw] + plan[ne]))
    points, inside = np.vstack([points, middles]), np.append(inside, within)
    rim = [(sw, se), (se, ne), (ne, nw), (nw, sw)]
    faces = np.concatenate([np.column_stack([p, q, middle]) for p, q in rim])
    cut = _cut(target, points, inside, faces, partial(_lifted, target))
    return _halved(target, *cut, longest=STEEP * step)


def mesh_triangles(target: Freeform, *, step: float) -> tuple[Floats, Ints]:
    """As `surface_triangles` of a surface that is given in triangles: these, made smaller and cut at its end; `step` is
    the longest side [m]."""
    points, faces = _divided(target, target.surface.vertices, target.surface.faces, longest=step)
    inside = target.margin(points) >= -_ON_THE_EDGE * target.size

    def on_surface(points: Floats) -> tuple[Floats, Bools]:
        there = target.retract(points)
        return there, target.margin(there) >= 0

    points, faces = _cut(target, points, inside, faces, on_surface)
    a, b, c = (points[faces[:, k]] for k in range(3))
    upwards = np.cross(b - a, c - a)[:, 2].sum() >= 0
    return points, faces if upwards else faces[:, ::-1]


def _step(target: Target, spacing: float) -> float:
    finest = 2.0 * target.size / _MOST_ACROSS
    return max(finest, min(2.0 * target.size / ACROSS, spacing / _A_SPACING))


def _lifted(target: Target, points: Floats) -> tuple[Floats, Bools]:
    """The points (k, 3) of the surface over points (k, 2 or more) of the plan, and whether they lie inside its end."""
    plan = points[:, :2]
    z = target.height_at(plan)
    inside = np.isfinite(z)
    lifted = np.column_stack([plan, np.where(inside, z, 0.0)])
    inside[inside] = target.margin(lifted[inside]) >= 0
    return lifted, inside


def _cut(
    target: Target, points: Floats, inside: Bools, faces: Ints, placed: Callable[[Floats], tuple[Floats, Bools]]
) -> tuple[Floats, Ints]:
    """The faces inside the end, those across it cut; corners are counted again. `placed` gives points on the surface,
    and whether they lie inside: with it the sides that lead out are cut by bisection."""
    single, double, sides = _across(inside, faces)
    low, high = points[sides[:, 0]], points[sides[:, 1]]
    for _ in range(_BISECTIONS):
        between, there = placed(0.5 * (low + high))
        low, high = np.where(there[:, None], between, low), np.where(there[:, None], high, between)
    a, b, c, d = np.split(len(points) + np.arange(len(low)), np.cumsum([len(single), len(single), len(double)]))
    p, q = double[:, 1:].T
    points = np.vstack([points, low])
    middle = len(points) + np.arange(len(double))  # of what is left of a face with two corners inside
    points = np.vstack([points, target.retract(0.25 * (points[p] + points[q] + points[c] + points[d]))])
    around = [np.column_stack([*side, middle]) for side in ((p, q), (q, d), (d, c), (c, p))]
    faces = np.concatenate([faces[inside[faces].all(axis=1)], np.column_stack([single[:, 0], a, b]), *around])
    used = np.zeros(len(points), dtype=bool)
    used[faces] = True
    return points[used], (np.cumsum(used) - 1)[faces]


def _across(inside: Bools, faces: Ints) -> tuple[Ints, Ints, Ints]:
    """Faces with one corner inside, which is put first; with two, the one outside put first; and the sides of these
    that lead out, of the first kind along both sides, then of the second."""
    count = inside[faces].sum(axis=1)
    single, double = (faces[count == k] for k in (1, 2))
    single = np.take_along_axis(single, (inside[single].argmax(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    double = np.take_along_axis(double, ((~inside[double]).argmax(axis=1)[:, None] + np.arange(3)) % 3, axis=1)
    return single, double, np.concatenate([single[:, [0, 1]], single[:, [0, 2]], double[:, [1, 0]], double[:, [2, 0]]])


def _divided(target: Target, points: Floats, faces: Ints, *, longest: float) -> tuple[Floats, Ints]:
    """The triangles, the sides of each divided into as many parts as leave none longer than `longest` [m], and lifted
    onto the surface; each with corners of its own."""
    corners = _without_needles(points[faces], longest)
    parts = np.maximum(np.ceil(_sides(corners).max(axis=1) / longest), 1).astype(np.intp)
    placed, divided, count = list[Floats](), list[Ints](), 0
    for n in np.unique(parts).tolist():
        shares, small = _lattice(n)
        inside = np.einsum("pk,mkd->mpd", shares, corners[parts == n])
        begin = count + len(shares) * np.arange(len(inside))
        placed.append(inside.reshape(-1, 3))
        divided.append((begin[:, None, None] + small).reshape(-1, 3))
        count += len(placed[-1])
    return target.retract(np.concatenate(placed)), np.concatenate(divided)


def _without_needles(corners: Floats, longest: float) -> Floats:
    """Triangles (m, 3, 3), of which those much longer than wide are cut across: else most of what they are divided into
    would be needlessly small."""
    sides, (a, b, c) = _sides(corners), corners.transpose(1, 0, 2)
    length, double_area = sides.max(axis=1), np.linalg.norm(np.cross(b - a, c - a), axis=1)
    needle = (length**2 > _NEEDLE * double_area) & (length > longest)
    turned = (sides[needle].argmax(axis=1)[:, None] + np.arange(3)) % 3  # the longest side comes first
    a, b, c = np.take_along_axis(corners[needle], turned[:, :, None], axis=1).transpose(1, 0, 2)
    foot = a + (dot(c - a, b - a) / dot(b - a, b - a))[:, None] * (b - a)  # of the height on the longest side
    tip, left, right = np.concatenate([a, b]), np.concatenate([foot, c]), np.concatenate([c, foot])
    width, reach = np.linalg.norm(right - left, axis=1), np.linalg.norm(np.tile(foot, (2, 1)) - tip, axis=1)
    parts = np.maximum(np.ceil(reach / np.maximum(width, longest)), 1).astype(np.intp)
    done = [corners[~needle]]
    for n in np.unique(parts).tolist():
        shares = np.linspace(0.0, 1.0, n + 1)[:, None]
        p, q = (tip[parts == n, None] + shares * (end - tip)[parts == n, None] for end in (left, right))
        done.append(np.stack([p[:, :-1], p[:, 1:], q[:, 1:]], axis=2).reshape(-1, 3, 3))
        done.append(np.stack([p[:, 1:-1], q[:, 2:], q[:, 1:-1]], axis=2).reshape(-1, 3, 3))
    return np.concatenate(done)


def _sides(corners: Floats) -> Floats:
    """(m, 3) lengths of the sides of triangles (m, 3, 3), from each corner to the next."""
    return np.asarray(np.linalg.norm(corners[:, [1, 2, 0]] - corners, axis=2))


def _lattice(parts: int) -> tuple[Floats, Ints]:
    """A triangle with sides in `parts`: barycentric coordinates (p, 3) of the points, and triangles (f, 3) of them."""
    row, column = (side.ravel() for side in np.indices((parts + 1, parts + 1)))
    kept = row + column <= parts
    index = np.full((parts + 1, parts + 1), -1)
    index[row[kept], column[kept]] = np.arange(kept.sum())
    shares = np.column_stack([parts - row - column, row, column])[kept] / parts
    upright = np.column_stack([index[:-1, :-1].ravel(), index[1:, :-1].ravel(), index[:-1, 1:].ravel()])
    turned = np.column_stack([index[1:, 1:].ravel(), index[:-1, 1:].ravel(), index[1:, :-1].ravel()])
    triangles = np.concatenate([upright, turned])
    return shares, triangles[(triangles >= 0).all(axis=1)]


def _halved(target: Target, points: Floats, faces: Ints, *, longest: float) -> tuple[Floats, Ints]:
    """The triangles, their sides halved until these are at most `longest` [m]: lifted onto a surface that ends steeply,
    as a hemisphere does, long triangles lie across it."""
    for _ in range(MOST_HALVINGS):
        p, q, r = (points.take(faces[:, k], axis=0) for k in range(3))
        long = np.max([dot(side, side) for side in (q - p, r - q, p - r)], axis=0) > longest**2
        if not long.any():
            break
        a, b, c = faces[long].T
        pairs = np.concatenate([np.column_stack(pair) for pair in ((a, b), (b, c), (c, a))])
        key, back = np.unique(pairs.min(axis=1) * len(points) + pairs.max(axis=1), return_inverse=True)
        ab, bc, ca = np.split(len(points) + back, 3)
        halves = target.retract(0.5 * (points[key // len(points)] + points[key % len(points)]))
        points = np.vstack([points, halves])
        quarters = [np.column_stack(corners) for corners in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
        faces = np.concatenate([faces[~long], *quarters])
    return points, faces
