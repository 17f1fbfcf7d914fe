"""From points of a surface to its field of patches, and on past an open rim."""

from dataclasses import dataclass, replace
from math import pi, sqrt

import numpy as np
from numba import njit

from rodshell.arrays import Floats, Ints
from rodshell.geometry.vectors import cross, unit
from rodshell.targets.buckets import Buckets
from rodshell.targets.patches import TERMS, PatchField

FEWEST, MOST = 300, 8000  # patches on a surface
POINTS_EACH = 3.0  # points for each patch
FIT_RADIUS = 2.4  # spacings: points that a cubic is fitted to; their weight falls to exp(-2.9)
FADE = 1.4  # spacings: radius of that weight
SAME_SIDE = 0.3  # cosine between normals: points of another sheet of the surface are left out
RIDGE = 1e-7  # of the sum of weights: keeps the least squares regular where points are few
EASE = 1.5  # [rad] past the rim, curvature fades as 1 / (1 + turned / EASE), so that nothing rolls up
DIRECTIONS = 12  # in which a patch past the rim looks for the next
MET = 10  # patches that a new one is made of


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
    points = Buckets.of(samples.points, spacing)
    chosen = points.spread(spacing)
    centres, normals = samples.points[chosen], samples.normals[chosen]
    start, near, _ = points.within(centres, FIT_RADIUS * spacing)
    frames = _frames(normals)
    coefficients = np.empty((len(centres), TERMS))
    _fit(centres, frames, spacing, start, near, samples.points, samples.normals, samples.areas, coefficients)
    field = PatchField(centres, frames, coefficients, spacing, reach)
    return _continued(field, points, int(np.ceil(past / spacing))), len(centres)


def _frames(normals: Floats) -> Floats:
    """(m, 3, 3) two tangents and the normal, as rows."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = unit(cross(helper, normals))
    return np.stack([first, cross(normals, first), normals], axis=1)


@njit(cache=True, error_model="numpy", fastmath={"contract", "reassoc", "arcp"})
def _fit(centres, frames, spacing, start, near, points, normals, areas, coefficients):  # type: ignore[no-untyped-def]
    """Weighted least squares of cubics over the tangent planes, (m, 10) in units of the spacing."""
    system, right, row = np.empty((TERMS, TERMS)), np.empty(TERMS), np.empty(TERMS)
    for m in range(len(centres)):
        system[:], right[:], weights, count = 0.0, 0.0, 0.0, 0
        e = frames[m]
        for k in range(start[m], start[m + 1]):
            j = near[k]
            if _along(e[2], normals[j]) < SAME_SIDE:
                continue
            d = points[j] - centres[m]
            a, b, c = _along(e[0], d) / spacing, _along(e[1], d) / spacing, _along(e[2], d)
            w = areas[j] * np.exp(-_along(d, d) / (FADE * spacing) ** 2)
            row[0], row[1], row[2], row[3], row[4] = 1.0, a, b, a * a, a * b
            row[5], row[6], row[7], row[8], row[9] = b * b, a * a * a, a * a * b, a * b * b, b * b * b
            for p in range(TERMS):
                right[p] += w * row[p] * c
                for q in range(p + 1):
                    system[p, q] += w * row[p] * row[q]
            weights += w
            count += 1
        stiff = 1.0 if count >= 2 * TERMS else 1e9  # too few points for a cubic: a quadric
        for p in range(TERMS):
            for q in range(p):
                system[q, p] = system[p, q]
            system[p, p] += RIDGE * weights * (stiff if p >= 6 else 1.0 if p >= 3 else 1e-6)
        coefficients[m] = np.linalg.solve(system, right)


@njit(cache=True)
def _along(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _continued(field: PatchField, points: Buckets, rings: int) -> PatchField:
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


def _proposals(field: PatchField, front: Ints, points: Buckets) -> Floats:
    """Places one spacing away from the patches `front`, where there is no surface and no patch yet."""
    angle, s = np.arange(DIRECTIONS) * 2 * pi / DIRECTIONS, field.spacing
    a, b = np.cos(angle), np.sin(angle)
    terms = np.stack([np.ones(DIRECTIONS), a, b, a * a, a * b, b * b, a**3, a * a * b, a * b * b, b**3])
    lift = field.coefficients[front] @ terms
    around = np.stack(np.broadcast_arrays(s * a, s * b, lift), axis=2) @ field.frames[front]
    places = (field.centres[front][:, None] + around).reshape(-1, 3)
    places = places[field.buckets.nearest(places, limit=0.8 * s)[0][:, 0] > 0.8 * s]
    places = places[points.nearest(places, limit=0.6 * s)[0][:, 0] > 0.6 * s]
    return places[Buckets.of(places, s).spread(0.8 * s)] if len(places) else places


def _ring(field: PatchField, places: Floats) -> PatchField:
    """New patches at about `places`: mean position, normal and curvature of what the patches nearby say there."""
    distance, index = field.buckets.nearest(places, min(MET, len(field.centres)))
    centres, normals = np.empty_like(places), np.empty_like(places)
    patches = field.centres, field.frames, field.coefficients, field.spacing
    _means(places, distance, index, *patches, centres, normals)
    frames, coefficients = _frames(unit(normals)), np.zeros((len(places), TERMS))
    _curvatures(places, distance, index, *patches, frames, coefficients)
    return replace(field, centres=centres, frames=frames, coefficients=coefficients)


@njit(cache=True)
def _weight(distance, index, frames, spacing):  # type: ignore[no-untyped-def]
    """(k,) of the patches met, those of another sheet than the nearest's left out; their sum is 1."""
    weight, total = np.zeros(len(index)), 0.0
    for k in range(len(index)):
        if _along(frames[index[k], 2], frames[index[0], 2]) > SAME_SIDE:
            weight[k] = np.exp(-((distance[k] / (1.2 * spacing)) ** 2))
            total += weight[k]
    return weight / total


@njit(cache=True)
def _local(place, centre, e, spacing):  # type: ignore[no-untyped-def]
    """Coordinates of a place over a patch, those in its plane in spacings."""
    d = place - centre
    return _along(e[0], d) / spacing, _along(e[1], d) / spacing, _along(e[2], d)


@njit(cache=True, error_model="numpy")
def _means(places, distance, index, centres, frames, coefficients, spacing, mean, normals):  # type: ignore[no-untyped-def]
    """Weighted means (n, 3) of the points above `places` (n, 3) on the patches met there, and of their normals."""
    for n in range(len(places)):
        weight = _weight(distance[n], index[n], frames, spacing)
        mean[n], normals[n] = places[n], 0.0
        for k in range(len(weight)):
            e, c = frames[index[n, k]], coefficients[index[n, k]]
            a, b, h = _local(places[n], centres[index[n, k]], e, spacing)
            height = c[0] + a * (c[1] + a * (c[3] + a * c[6])) + b * (c[2] + b * (c[5] + b * c[9]))
            height += a * b * (c[4] + a * c[7] + b * c[8])
            slope_a = c[1] + a * (2 * c[3] + 3 * a * c[6]) + b * (c[4] + 2 * a * c[7] + b * c[8])
            slope_b = c[2] + b * (2 * c[5] + 3 * b * c[9]) + a * (c[4] + 2 * b * c[8] + a * c[7])
            steep = np.sqrt(1.0 + (slope_a**2 + slope_b**2) / spacing**2)
            for i in range(3):
                mean[n, i] += weight[k] * (height - h) * e[2, i]
                normals[n, i] += weight[k] * (e[2, i] - (slope_a * e[0, i] + slope_b * e[1, i]) / spacing) / steep


@njit(cache=True, error_model="numpy")
def _curvatures(  # type: ignore[no-untyped-def]
    places, distance, index, centres, frames, coefficients, spacing, turned, quadrics
):
    """Quadrics (n, 10) over `turned` frames (n, 3, 3), with the weighted mean of the bending of the patches met there.

    Each patch is turned into the new tangent plane the shortest way. The mean is eased, so that nothing rolls up:
    one spacing turns by its largest principal value.
    """
    for n in range(len(places)):
        weight = _weight(distance[n], index[n], frames, spacing)
        x, y, z = turned[n]
        aa = ab = bb = 0.0
        for k in range(len(weight)):
            e, c = frames[index[n, k]], coefficients[index[n, k]]
            a, b, _ = _local(places[n], centres[index[n, k]], e, spacing)
            bend_a, bend_b = 2 * c[3] + 6 * a * c[6] + 2 * b * c[7], 2 * c[5] + 6 * b * c[9] + 2 * a * c[8]
            twist = c[4] + 2 * a * c[7] + 2 * b * c[8]
            # v turns by v - (v.z) (e2 + z) / (1 + e2.z) for v across e2
            share = 1.0 / (1.0 + max(_along(e[2], z), -0.9))
            p, q = _along(x, e[0]), _along(x, e[1])
            r, s = _along(y, e[0]), _along(y, e[1])
            over_a, over_b = share * _along(z, e[0]), share * _along(z, e[1])
            out_x, out_y = _along(x, e[2]), _along(y, e[2])
            p, q, r, s = p - over_a * out_x, q - over_b * out_x, r - over_a * out_y, s - over_b * out_y
            aa += weight[k] * (p * p * bend_a + 2 * p * q * twist + q * q * bend_b)
            ab += weight[k] * (p * r * bend_a + (p * s + q * r) * twist + q * s * bend_b)
            bb += weight[k] * (r * r * bend_a + 2 * r * s * twist + s * s * bend_b)
        largest = (0.5 * abs(aa + bb) + np.sqrt(0.25 * (aa - bb) ** 2 + ab**2)) / spacing
        eased = 1.0 + largest / EASE
        quadrics[n, 3], quadrics[n, 4], quadrics[n, 5] = 0.5 * aa / eased, ab / eased, 0.5 * bb / eased
