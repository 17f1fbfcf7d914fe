"""From points of a surface to its field of patches, and on past an open rim."""

from dataclasses import dataclass, replace
from math import pi, sqrt
from typing import TYPE_CHECKING

import numpy as np
from numba import njit
from numpy.typing import NDArray

from gridshell.geometry.vectors import cross, unit
from gridshell.targets.patches import TERMS, PatchField, flat_lists
from gridshell.targets.target import Floats

if TYPE_CHECKING:
    from scipy.spatial import cKDTree

Ints = NDArray[np.intp]

FEWEST, MOST = 300, 8000  # patches on a surface
POINTS_EACH = 3.0  # points for each patch
FIT_RADIUS = 2.4  # spacings: points that a cubic is fitted to; their weight falls to exp(-2.9)
FADE = 1.4  # spacings: radius of that weight
SAME_SIDE = 0.3  # cosine between normals: points of another sheet of the surface are left out
RIDGE = 1e-7  # of the sum of weights: keeps the least squares regular where points are few
EASE = 1.5  # [rad] past the rim, curvature fades as 1 / (1 + turned / EASE), so that nothing rolls up
DIRECTIONS = 12  # in which a patch past the rim looks for the next


@dataclass(frozen=True, eq=False)
class Samples:
    """Points (n, 3) of a surface [m], their outward normals (n, 3), and the area (n,) that each stands for [m2]."""

    points: Floats
    normals: Floats
    areas: Floats


def patch_spacing(area: float, count: int) -> float:
    """Distance between patches [m] for a surface of `area` [m2] known at `count` points."""
    return sqrt(area / min(max(count / POINTS_EACH, FEWEST), MOST))


def fit_field(samples: Samples, spacing: float, *, past: float, reach: float) -> tuple[PatchField, int]:
    """The field through `samples`, continued `past` [m] beyond an open rim; and how many patches lie on the surface."""
    from scipy.spatial import cKDTree

    tree = cKDTree(samples.points)
    chosen = _spread(samples.points, spacing)
    centres, normals = samples.points[chosen], samples.normals[chosen]
    start, near = flat_lists(tree.query_ball_point(centres, FIT_RADIUS * spacing))
    frames = _frames(normals)
    coefficients = np.empty((len(centres), TERMS))
    _fit(centres, frames, spacing, start, near, samples.points, samples.normals, samples.areas, coefficients)
    field = PatchField(centres, frames, coefficients, spacing, reach)
    return _continued(field, tree, int(np.ceil(past / spacing))), len(centres)


def _spread(points: Floats, distance: float) -> Ints:
    """Indices of points no two of which are closer than `distance`, every other point being closer to one."""
    from scipy.spatial import cKDTree

    neighbours = cKDTree(points).query_ball_point(points, distance)
    free = np.ones(len(points), dtype=bool)
    chosen = list[int]()
    for k, near in enumerate(neighbours):
        if free[k]:
            chosen.append(k)
            free[near] = False
    return np.array(chosen, dtype=np.intp)


def _frames(normals: Floats) -> Floats:
    """(m, 3, 3) two tangents and the normal, as rows."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = unit(cross(helper, normals))
    return np.stack([first, cross(normals, first), normals], axis=1)


@njit(cache=True, error_model="numpy")
def _fit(centres, frames, spacing, start, near, points, normals, areas, coefficients):  # type: ignore[no-untyped-def]
    """Weighted least squares of cubics over the tangent planes, (m, 10) in units of the spacing."""
    system, right, row = np.empty((TERMS, TERMS)), np.empty(TERMS), np.empty(TERMS)
    for m in range(len(centres)):
        system[:], right[:], weights, count = 0.0, 0.0, 0.0, 0
        e = frames[m]
        for k in range(start[m], start[m + 1]):
            j = near[k]
            if np.dot(normals[j], e[2]) < SAME_SIDE:
                continue
            d = points[j] - centres[m]
            a, b, c = np.dot(e[0], d) / spacing, np.dot(e[1], d) / spacing, np.dot(e[2], d)
            w = areas[j] * np.exp(-np.dot(d, d) / (FADE * spacing) ** 2)
            row[0], row[1], row[2], row[3], row[4] = 1.0, a, b, a * a, a * b
            row[5], row[6], row[7], row[8], row[9] = b * b, a * a * a, a * a * b, a * b * b, b * b * b
            for p in range(TERMS):
                right[p] += w * row[p] * c
                for q in range(TERMS):
                    system[p, q] += w * row[p] * row[q]
            weights += w
            count += 1
        stiff = 1.0 if count >= 2 * TERMS else 1e9  # too few points for a cubic: a quadric
        for p in range(TERMS):
            system[p, p] += RIDGE * weights * (stiff if p >= 6 else 1.0 if p >= 3 else 1e-6)
        coefficients[m] = np.linalg.solve(system, right)


def _continued(field: PatchField, points: "cKDTree", rings: int) -> PatchField:
    """Patches past the rim, ring by ring: quadrics that carry the curvature of their neighbours on.

    The first ring follows the cubics of the rim, so that curvature goes on changing for one spacing more.

    Each ring averages what the last one proposes, so that noise dies out.
    """
    front = np.arange(len(field.centres))
    for _ in range(rings):
        places = _proposals(field, front, points)
        if len(places) == 0:
            break
        added = _ring(field, places)
        first = len(field.centres)
        field = PatchField(
            np.vstack([field.centres, added.centres]), np.vstack([field.frames, added.frames]),
            np.vstack([field.coefficients, added.coefficients]), field.spacing, field.reach,
        )  # fmt: skip
        front = np.arange(first, len(field.centres))
    return field


def _proposals(field: PatchField, front: Ints, points: "cKDTree") -> Floats:
    """Places one spacing away from the patches `front`, where there is no surface and no patch yet."""
    angle = np.arange(DIRECTIONS) * 2 * pi / DIRECTIONS
    plane = np.stack([np.cos(angle), np.sin(angle)])
    c = field.coefficients[front]
    lift = _cubics(c[:, None], *plane)[0]
    e = field.frames[front]
    places = field.centres[front][:, None] + field.spacing * np.einsum("kd,mki->mdi", plane, e[:, :2])
    places = (places + lift[:, :, None] * e[:, None, 2]).reshape(-1, 3)
    free = (points.query(places)[0] > 0.6 * field.spacing) & (field.tree.query(places)[0] > 0.8 * field.spacing)
    places = places[free]
    return places[_spread(places, 0.8 * field.spacing)] if len(places) else places


def _ring(field: PatchField, places: Floats) -> PatchField:
    """New patches at about `places`: mean position, normal and curvature of what the patches nearby say there."""
    count = min(10, len(field.centres))
    distance, index = field.tree.query(places, k=count)
    weight = np.exp(-((distance / (1.2 * field.spacing)) ** 2))
    e, c = field.frames[index], field.coefficients[index]
    nearest = e[:, :1, 2]
    weight *= np.einsum("nki,nki->nk", e[:, :, 2], np.broadcast_to(nearest, e[:, :, 2].shape)) > SAME_SIDE
    weight /= weight.sum(axis=1, keepdims=True)
    s = field.spacing
    local = np.einsum("nkij,nkj->nki", e, places[:, None] - field.centres[index])
    a, b = local[:, :, 0] / s, local[:, :, 1] / s
    height, slope, bend = _cubics(c, a, b)
    slope = slope / s
    normals = unit(e[:, :, 2] - slope[0][..., None] * e[:, :, 0] - slope[1][..., None] * e[:, :, 1])
    centres = places + np.einsum("nk,nk,nki->ni", weight, height - local[:, :, 2], e[:, :, 2])
    frames = _frames(unit(np.einsum("nk,nki->ni", weight, normals)))
    # the neighbours' bending, turned with their tangent planes into the new one
    turned = _turned(e[:, :, :2], e[:, :, 2], frames[:, None, 2])
    into = np.einsum("nai,nkbi->nkab", frames[:, :2], turned)
    mean = np.einsum("nk,nkab,nkbc,nkdc->nad", weight, into, bend, into) / s
    mean /= (1.0 + np.abs(np.linalg.eigvalsh(mean)).max(axis=1) / EASE)[:, None, None]  # one spacing turns by |mean|
    coefficients = np.zeros((len(places), TERMS))
    coefficients[:, 3], coefficients[:, 4], coefficients[:, 5] = (
        0.5 * s * mean[:, 0, 0], s * mean[:, 0, 1], 0.5 * s * mean[:, 1, 1],
    )  # fmt: skip
    return replace(field, centres=centres, frames=frames, coefficients=coefficients)


def _cubics(c: Floats, a: Floats, b: Floats) -> tuple[Floats, Floats, Floats]:
    """Height (...), slopes (2, ...) and second derivatives (..., 2, 2) of cubics c (..., 10) at (a, b)."""
    c = np.moveaxis(c, -1, 0)
    height = c[0] + a * (c[1] + a * (c[3] + a * c[6])) + b * (c[2] + b * (c[5] + b * c[9]))
    height = height + a * b * (c[4] + a * c[7] + b * c[8])
    slope_a = c[1] + a * (2 * c[3] + 3 * a * c[6]) + b * (c[4] + 2 * a * c[7] + b * c[8])
    slope_b = c[2] + b * (2 * c[5] + 3 * b * c[9]) + a * (c[4] + 2 * b * c[8] + a * c[7])
    bend = np.empty((*np.shape(height), 2, 2))
    bend[..., 0, 0], bend[..., 1, 1] = 2 * c[3] + 6 * a * c[6] + 2 * b * c[7], 2 * c[5] + 6 * b * c[9] + 2 * a * c[8]
    bend[..., 0, 1] = bend[..., 1, 0] = c[4] + 2 * a * c[7] + 2 * b * c[8]
    return height, np.stack([slope_a, slope_b]), bend


def _turned(vectors: Floats, old: Floats, new: Floats) -> Floats:
    """Vectors (..., 2, 3) rotated as the normal `old` (..., 3) turns into `new`, the shortest way."""
    new = np.broadcast_to(new, old.shape)
    axis, cosine = cross(old, new), np.sum(old * new, axis=-1)
    axis, share = axis[..., None, :], (1.0 / (1.0 + np.maximum(cosine, -0.9)))[..., None, None]
    along = np.sum(axis * vectors, axis=-1, keepdims=True)
    sideways = cross(np.broadcast_to(axis, vectors.shape), vectors)
    return np.asarray(vectors * cosine[..., None, None] + sideways + share * along * axis)
