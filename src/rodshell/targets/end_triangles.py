"""A surface in triangles that reach its end: what areas are measured on.

The triangles of a formula are laid over its plan and lifted, those of a mesh are its own. Those across the end are cut
there, and long sides are halved, each half on the surface. Sides along the end are halved on it until what lies between
them and the end is the segment of a parabola, whose area is 4/3 times that of the triangle in it [Archimedes].
"""

from collections.abc import Callable

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.frames import cross, dot, unit
from rodshell.targets.freeform import Freeform
from rodshell.targets.target import Target
from rodshell.targets.trianglemesh import turned

_BISECTIONS = 40
_ON_THE_END = 1e-6  # of the size: a vertex of a mesh so near to its end is inside
_OTHER = 2e-9  # of the size squared: a side along the end, times how far off a parabola the end is there
_MOST_HALVINGS = 40
_STEEP = 2.0  # times the step: where the surface is steep longer sides are halved
_PARABOLA = 4 / 3  # its segment, over the triangle in it
_STEPS, _CLOSE, _FOUND = 12, 1e-12, 1e-9  # of the secant method to the end; of the size: it stops; it has found the end
_LEAST_SLOPE = 0.05  # of the margin, across the end: less is that of no end


def end_triangles(
    target: Target, *, anchor: tuple[float, float], rotate: float, step: float
) -> tuple[Floats, Floats, Ints, Floats]:
    """A surface up to its end; where parts of a formula's lie one above the other, the uppermost.

    Args:
        anchor: point of the plan that is a corner of a formula's triangles, where it lies inside [m].
        rotate: angle of their sides [rad].
        step: longest side, of a formula's in plan [m].

    Returns:
        Corners (k, 3) on the surface [m], unit normals (k, 3) there, and faces (m, 3), counter-clockwise seen from the
        side that most of the normals point to; and by what factor (m,) the area of each counts. Next to the end some
        may be turned over, where others reach beyond it: their areas are negative.
    """
    if isinstance(target, Freeform):
        points, faces = _of_mesh(target, step)
    else:
        points, faces = _over_plan(target, anchor, rotate, step)
    a, b, c = (points[faces[:, k]] for k in range(3))
    if dot(cross(b - a, c - a), _normals(target, points)[faces[:, 0]]).sum() < 0:
        faces = faces[:, ::-1]
    points, faces = _halved(target, _rim_moved_to_the_end(target, points, faces), faces, longest=_STEEP * step)
    points, faces, factors = _to_the_end(target, points, faces)
    return points, _normals(target, points), faces, factors


def _normals(target: Target, points: Floats) -> Floats:
    return unit(target.level(points)[1])


def _over_plan(target: Target, anchor: tuple[float, float], rotate: float, step: float) -> tuple[Floats, Ints]:
    """Squares of the plan, each in four triangles about its middle: no direction is preferred."""
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
    middle = len(plan) + np.arange(len(sw))
    middles, within = _lifted(target, 0.25 * (plan[sw] + plan[se] + plan[nw] + plan[ne]))
    rim = [(sw, se), (se, ne), (ne, nw), (nw, sw)]
    faces = np.concatenate([np.column_stack([p, q, middle]) for p, q in rim])
    return _cut(
        target, np.vstack([points, middles]), np.append(inside, within), faces, lambda points: _lifted(target, points)
    )


def _lifted(target: Target, points: Floats) -> tuple[Floats, Bools]:
    """The points (k, 3) of the surface over points (k, 2 or more) of the plan, and whether they lie inside its end."""
    plan = points[:, :2]
    z = target.height_at(plan)
    inside = np.isfinite(z)
    lifted = np.column_stack([plan, np.where(inside, z, 0.0)])
    inside[inside] = target.margin(lifted[inside]) >= 0
    return lifted, inside


def _of_mesh(target: Freeform, step: float) -> tuple[Floats, Ints]:
    """The triangles of a mesh, halved until no side is longer than `step`."""
    surface = target.surface
    points, faces = _halved(target, target.retract(surface.vertices), surface.faces, longest=step)

    def settled(points: Floats) -> tuple[Floats, Bools]:
        there = target.retract(points)
        return there, target.margin(there) >= 0

    return _cut(target, points, target.margin(points) >= -_ON_THE_END * target.size, faces, settled)


def _cut(
    target: Target, points: Floats, inside: Bools, faces: Ints, placed: Callable[[Floats], tuple[Floats, Bools]]
) -> tuple[Floats, Ints]:
    """The faces inside the end, those across it cut; corners are counted again. `placed` gives points on the surface,
    and whether they lie inside: with it the sides that lead out are cut by bisection."""
    count = inside[faces].sum(axis=1)
    single, double = (faces[count == k] for k in (1, 2))
    single = turned(single, inside[single].argmax(axis=1))  # the odd corner first
    double = turned(double, inside[double].argmin(axis=1))
    out = np.concatenate([single[:, [0, 1]], single[:, [0, 2]], double[:, [1, 0]], double[:, [2, 0]]])
    sides, back = np.unique(out, axis=0, return_inverse=True)
    low, high = points[sides[:, 0]], points[sides[:, 1]]
    for _ in range(_BISECTIONS):
        between, there = placed(0.5 * (low + high))
        low, high = np.where(there[:, None], between, low), np.where(there[:, None], high, between)
    ends = np.split(len(points) + back.reshape(-1), np.cumsum([len(single), len(single), len(double)]))
    a, b, c, d = ends
    p, q = double[:, 1:].T
    points, quarters = _about_middles(np.vstack([points, low]), np.column_stack([p, q, d, c]), target.retract)
    faces = np.concatenate([faces[count == 3], np.column_stack([single[:, 0], a, b]), quarters])
    used = np.zeros(len(points), dtype=bool)
    used[faces] = True
    return points[used], (np.cumsum(used) - 1)[faces]


def _about_middles(points: Floats, quads: Ints, retract: Callable[[Floats], Floats]) -> tuple[Floats, Ints]:
    """The points with the middles of quadrangles (k, 4), each in four triangles about it: no direction is preferred."""
    middle = len(points) + np.arange(len(quads))
    sides = zip(quads.T, np.roll(quads, -1, axis=1).T, strict=True)
    faces = np.concatenate([np.column_stack([p, q, middle]) for p, q in sides])
    return np.vstack([points, retract(points[quads].mean(axis=1))]), faces


def _sides(*faces: Ints) -> tuple[Ints, list[Ints], Bools]:
    """The sides (s, 2) of faces (m, 3) or (m, 4), directed as in the first face of each; which side leads from each
    corner to the next; and which are sides of one face only."""
    directed = np.concatenate([np.stack([each, np.roll(each, -1, axis=1)], axis=-1).reshape(-1, 2) for each in faces])
    key = directed.min(axis=1) * (1 + directed.max()) + directed.max(axis=1)
    _, first, back, count = np.unique(key, return_index=True, return_inverse=True, return_counts=True)
    of_faces = np.split(back.reshape(-1), np.cumsum([each.size for each in faces[:-1]]))
    return directed[first], [at.reshape(each.shape) for at, each in zip(of_faces, faces, strict=True)], count == 1


def _halved(target: Target, points: Floats, faces: Ints, *, longest: float) -> tuple[Floats, Ints]:
    """The triangles, their sides halved on the surface until none is longer than this; neighbours stay neighbours.

    What is left of a triangle of which two sides are halved stays a quadrangle while both are long: else those that are
    much longer than wide would be divided into ever narrower ones.
    """
    quads = np.empty((0, 4), dtype=np.intp)
    for _ in range(_MOST_HALVINGS):
        sides, (of_faces, of_quads), _ = _sides(faces, quads)
        p, q = points[sides[:, 0]], points[sides[:, 1]]
        marked = dot(q - p, q - p) > longest**2
        loose = (marked[of_quads] != [True, False, True, False]).any(axis=1)
        if loose.any():
            points, more = _about_middles(points, quads[loose], target.retract)
            faces, quads = np.concatenate([faces, more]), quads[~loose]
        elif marked.any():
            middle = len(points) + np.cumsum(marked) - 1
            points = np.vstack([points, target.retract(0.5 * (p + q)[marked])])
            faces, more = _halves(faces, marked[of_faces], middle[of_faces])
            (a, b, c, d), (ab, _, cd, _) = quads.T, middle[of_quads].T
            quads = np.concatenate([np.column_stack([a, ab, cd, d]), np.column_stack([ab, b, c, cd]), more])
        else:
            break
    return points, faces


def _halves(faces: Ints, halved: Bools, middle: Ints) -> tuple[Ints, Ints]:
    """Triangles (m, 3) with some of their sides halved at their middles: triangles, and quadrangles that are left."""
    count = halved.sum(axis=1)
    found, quads = [faces[count == 0]], np.empty((0, 4), dtype=np.intp)
    for n, odd in ((1, halved), (2, ~halved), (3, halved)):  # the odd side first: the one halved, or the one not
        first = odd[count == n].argmax(axis=1)
        (a, b, c), (ab, bc, ca) = (turned(of[count == n], first).T for of in (faces, middle))
        if n == 2:
            quads = np.column_stack([b, bc, ca, a])
        halves, tip = [(a, ab, c), (ab, b, c)], [(ca, bc, c)]
        pieces = (halves, tip, [(a, ab, ca), (ab, b, bc), *tip, (ab, bc, ca)])[n - 1]
        found += [np.column_stack(piece) for piece in pieces]
    return np.concatenate(found), quads


def _to_the_end(target: Target, points: Floats, faces: Ints) -> tuple[Floats, Ints, Floats]:
    """The triangles, with those between each side of the rim and the middle of the end beyond it, between the sides of
    these and the end, and so on, until segments of parabolas are left, whose areas are 4/3 of their triangles'; and
    these factors (m,). Where the end lies inside the rim such a triangle is turned over."""
    sides, _, single = _sides(faces)
    rim, beyond, factors = sides[single], [faces], [np.ones(len(faces))]
    for _ in range(_MOST_HALVINGS):
        way = points[rim[:, 1]] - points[rim[:, 0]]
        straight = [target.retract(points[rim[:, 0]] + share * way) for share in (0.25, 0.5, 0.75)]
        moved = [_moved_to_the_end(target, x, cross(way, _normals(target, x))) for x in straight]
        before, off, after = (there - x for there, x in zip(moved, straight, strict=True))
        other = np.maximum(*(np.linalg.norm(each - 0.75 * off, axis=1) for each in (before, after)))
        marked = np.linalg.norm(way, axis=1) * other > _OTHER * target.size**2
        beyond.append(np.column_stack([rim[:, 0], len(points) + np.arange(len(rim)), rim[:, 1]]))
        factors.append(np.where(marked, 1.0, _PARABOLA))
        points = np.vstack([points, moved[1]])
        p, m, q = beyond[-1][marked].T
        rim = np.concatenate([np.column_stack([p, m]), np.column_stack([m, q])])
        if not len(rim):
            break
    return points, np.concatenate(beyond), np.concatenate(factors)


def _rim_moved_to_the_end(target: Target, points: Floats, faces: Ints) -> Floats:
    """The points, those of the rim on the end of the surface: that of a mesh is smooth where the mesh is jagged."""
    sides, _, single = _sides(faces)
    rim = sides[single]
    along = np.zeros_like(points)
    for k in range(2):
        np.add.at(along, rim[:, k], points[rim[:, 1]] - points[rim[:, 0]])
    moved, at = points.copy(), np.unique(rim)
    moved[at] = _moved_to_the_end(target, points[at], cross(along[at], _normals(target, points[at])))
    return moved


def _moved_to_the_end(target: Target, points: Floats, across: Floats) -> Floats:
    """Points (k, 3) near the end moved along the surface `across` it, outwards or back, onto the end; where that is not
    found within the length of `across`, they stay."""
    length, close = np.linalg.norm(across, axis=1), _CLOSE * target.size
    way = across / np.maximum(length, 1e-300)[:, None]
    there, moved, slope = target.retract(points), np.zeros(len(points)), -np.ones(len(points))
    margin = target.margin(there)
    for _ in range(_STEPS):
        left = np.flatnonzero((np.abs(margin) > close) & (length > 0.0))
        if not len(left):
            break
        step = np.clip(-margin[left] / slope[left], -0.5 * length[left], 0.5 * length[left])
        moved[left] += step
        there[left] = target.retract(points[left] + moved[left, None] * way[left])
        after = target.margin(there[left])
        slope[left] = np.clip((after - margin[left]) / step, -1.0 / _LEAST_SLOPE, -_LEAST_SLOPE)
        margin[left] = after
    found = (np.abs(margin) <= _FOUND * target.size) & (np.abs(moved) <= length)
    return np.where(found[:, None], there, points)
