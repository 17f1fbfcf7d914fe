"""From a triangle mesh to its smooth field: least squares of its samples, continuation past an open rim."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from math import pi, sqrt

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.geometry.frames import cross, dot, unit
from rodshell.kernels import njit
from rodshell.progress import Progress, silent
from rodshell.targets.samples import LONGEST, Samples, fill_openings, mesh_samples
from rodshell.targets.smooth_field import TERMS, CellList, SmoothField
from rodshell.targets.trianglemesh import TriangleMesh
from rodshell.units import length_text

# least squares
FEWEST, MOST = 300, 8000  # cubics on a surface
POINTS_EACH = 3.0  # points per cubic
FIT_RADIUS = 2.4  # spacings: points to which a cubic is fitted; their weight falls to exp(-2.9)
FADE = 1.4  # spacings: radius of that weight
SAME_SIDE = 0.3  # cosine between normals: points of another sheet of the surface are left out
RIDGE = 1e-7  # of the sum of weights: keeps the least squares regular where points are few

# how near
CLOSE = 1e-4  # of the size: where a vertex is further off, more cubics are tried
GAIN = 0.75  # of that distance: more cubics are taken where it becomes less; noise of a mesh leaves more than 0.8
OFF = 0.005  # of the size: where a vertex is further off than that, the field does not follow the mesh
ASKEW = 0.7  # least cosine between the normals of a vertex and of the field there

# past an open rim
PAST = 0.6  # of the size: how far the surface is continued
EASE = 1.5  # [rad] curvature fades as 1 / (1 + turned / EASE), so that the surface does not roll up
DIRECTIONS = 12  # in which the next cubics are placed around a cubic past the rim
STEEP = 5.0  # spacings: a cubic that rises by more over one spacing does not continue the surface
MEANS = 10  # cubics whose mean a new cubic is


def cubic_spacing(area: float, count: int) -> float:
    """Distance between cubics [m] for a surface of `area` [m2] that is known at `count` points."""
    return sqrt(area / min(max(count / POINTS_EACH, FEWEST), MOST))


@dataclass(frozen=True, eq=False)
class FittedField:
    """A smooth field that was fitted to a mesh.

    Args:
        cubics: those of it that are on the surface (or fill an opening), which come first.
        off: (n,) distance of each vertex of the mesh [m]; infinite where the field points elsewhere, or another sheet
            crosses.
    """

    field: SmoothField
    cubics: int
    off: Floats


def fit_mesh(mesh: TriangleMesh, *, size: float, progress: Progress = silent) -> FittedField:
    """Fit a field to a mesh, with as many cubics as its shape needs.

    As many as suit a mesh that is as fine everywhere; where a vertex is further off than `CLOSE`, twice as many each
    time, up to one for each vertex, as long as that helps: not where the mesh is rough, as no smooth surface follows
    noise. A mesh that is still not followed, such as one that is fine only where it curves, gets up to `MOST`.

    Args:
        size: half of its largest extent [m].
        progress: called at each step of each fit.
    """
    area, count = float(mesh.areas.sum()), len(mesh.vertices)
    spacing = cubic_spacing(area, count)
    best = _fit_at(mesh, spacing, size, progress)
    while (largest := float(best.off.max())) > CLOSE * size:
        finest = sqrt(area / (MOST if largest > OFF * size else min(MOST, count)))
        if spacing <= finest:
            break
        spacing = max(spacing / sqrt(2), finest)
        finer = _fit_at(mesh, spacing, size, progress)
        if finer.off.max() < GAIN * largest:
            best = finer
        elif largest <= OFF * size:
            break
    return best


def _fit_at(mesh: TriangleMesh, spacing: float, size: float, progress: Progress) -> FittedField:
    fitting = partial(progress, "preparing", f"fit of the mesh, cubics {length_text(spacing)} apart", 0.0)
    fitting()
    samples = fill_openings(mesh, mesh_samples(mesh, spacing), spacing)
    fitting()
    field, cubics = fit_field(samples, spacing, past=PAST * size, reach=size, each_ring=fitting)
    fitting()
    value, gradient, _ = field.implicit(mesh.vertices, second=False)
    slope = np.linalg.norm(gradient, axis=1)
    follows = (dot(gradient, mesh.normals) > ASKEW * slope) & np.isfinite(value)
    follows[_crossed(mesh, samples, LONGEST * spacing)] = False
    return FittedField(field, cubics, np.where(follows, np.abs(value), np.inf))


def _crossed(mesh: TriangleMesh, samples: Samples, reach: float) -> Ints:
    """Vertices of a mesh where two sheets cross: samples closer than `reach` [m] face elsewhere, some as on a ridge and
    some as in a groove."""
    begin, near, _ = CellList.of(samples.points, reach).within(samples.points, reach)
    here = np.repeat(np.arange(len(samples.points)), np.diff(begin))
    turned = dot(samples.normals[here], samples.normals[near]) < SAME_SIDE
    here, near = here[turned], near[turned]
    bulge = dot(samples.normals[near] - samples.normals[here], samples.points[near] - samples.points[here])
    both = np.intersect1d(here[bulge > 0], here[bulge < 0])
    return CellList.of(mesh.vertices, reach).nearest(samples.points[both])[1][:, 0]


def fit_field(
    samples: Samples, spacing: float, *, past: float, reach: float, each_ring: Callable[[], None] = lambda: None
) -> tuple[SmoothField, int]:
    """A smooth field fitted to samples of a surface, by weighted least squares; and the number of its cubics that are
    on the surface (or fill an opening), which come first.

    Args:
        spacing: distance between cubics [m], see `cubic_spacing`.
        past: how far the field is continued past an open rim [m].
        reach: distance from the cubics up to which the field is defined [m].
        each_ring: called before each ring of cubics past the rim.
    """
    points = CellList.of(samples.points, spacing)
    chosen = points.spread(spacing)
    centres, normals = samples.points[chosen], samples.normals[chosen]
    start, near, _ = points.within(centres, FIT_RADIUS * spacing)
    frames = _frames(normals)
    coefficients = np.empty((len(centres), TERMS))
    _fit(centres, frames, spacing, start, near, samples.points, samples.normals, samples.areas, coefficients)
    field = SmoothField(centres, frames, coefficients, spacing, reach)
    return _continued(field, points, int(np.ceil(past / spacing)), each_ring), len(centres)


def _frames(normals: Floats) -> Floats:
    """(m, 3, 3) two tangents and the normal, as rows."""
    helper = np.where(np.abs(normals[:, :1]) < 0.7, [[1.0, 0.0, 0.0]], [[0.0, 1.0, 0.0]])
    first = unit(cross(helper, normals))
    return np.stack([first, cross(normals, first), normals], axis=1)


@njit("f2 f3 f i1 i1 f2 f2 f1 f2", fastmath={"contract", "reassoc", "arcp"})
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
        _solve(system, right)
        for p in range(TERMS):
            coefficients[m, p] = right[p]


@njit(error_model="numpy")
def _solve(a, b):  # type: ignore[no-untyped-def]
    """Solve a x = b in place, x in b; a is symmetric and positive definite, and is overwritten."""
    for k in range(len(b)):
        for i in range(k + 1, len(b)):
            factor = a[i, k] / a[k, k]
            for j in range(k + 1, len(b)):
                a[i, j] -= factor * a[k, j]
            b[i] -= factor * b[k]
    for k in range(len(b) - 1, -1, -1):
        for j in range(k + 1, len(b)):
            b[k] -= a[k, j] * b[j]
        b[k] /= a[k, k]


@njit()
def _along(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def _continued(field: SmoothField, points: CellList, rings: int, each: Callable[[], None]) -> SmoothField:
    """Continue a field past the rim, ring by ring, with quadrics that keep the curvature of their neighbours.

    The first ring follows the cubics of the rim, so that curvature changes over one more spacing. Each ring is a mean
    over the last one, so that noise dies out.
    """
    front = np.arange(len(field.centres))
    for _ in range(rings):
        each()
        sites = _proposals(field, front, points)
        if len(sites) == 0:
            break
        added = _ring(field, sites)
        first = len(field.centres)
        field = SmoothField(
            np.vstack([field.centres, added.centres]), np.vstack([field.frames, added.frames]),
            np.vstack([field.coefficients, added.coefficients]), field.spacing, field.reach,
        )  # fmt: skip
        front = np.arange(first, len(field.centres))
    return field


def _proposals(field: SmoothField, front: Ints, points: CellList) -> Floats:
    """Points (n, 3) one spacing away from the cubics `front`, where there is neither surface nor cubic yet."""
    angle, s = np.arange(DIRECTIONS) * 2 * pi / DIRECTIONS, field.spacing
    a, b = np.cos(angle), np.sin(angle)
    terms = np.stack([np.ones(DIRECTIONS), a, b, a * a, a * b, b * b, a**3, a * a * b, a * b * b, b**3])
    lift = field.coefficients[front] @ terms
    around = np.stack(np.broadcast_arrays(s * a, s * b, lift), axis=2) @ field.frames[front]
    sites: Floats = (field.centres[front][:, None] + around)[np.abs(lift) < STEEP * s]
    sites = sites[field.cells.nearest(sites, limit=0.8 * s)[0][:, 0] > 0.8 * s]
    sites = sites[points.nearest(sites, limit=0.6 * s)[0][:, 0] > 0.6 * s]
    return sites[CellList.of(sites, s).spread(0.8 * s)] if len(sites) else sites


def _ring(field: SmoothField, sites: Floats) -> SmoothField:
    """New cubics at about the points `sites` (n, 3): means of position, normal and curvature of cubics nearby."""
    distance, index = field.cells.nearest(sites, min(MEANS, len(field.centres)))
    centres, normals = np.empty_like(sites), np.empty_like(sites)
    cubics = field.centres, field.frames, field.coefficients, field.spacing
    _means(sites, distance, index, *cubics, centres, normals)
    frames, coefficients = _frames(unit(normals)), np.zeros((len(sites), TERMS))
    _curvatures(sites, distance, index, *cubics, frames, coefficients)
    return replace(field, centres=centres, frames=frames, coefficients=coefficients)


@njit()
def _weight(distance, index, frames, spacing):  # type: ignore[no-untyped-def]
    """Weights (k,) of the cubics nearby, with sum 1; 0 for those of another sheet than the nearest."""
    weight, total = np.zeros(len(index)), 0.0
    for k in range(len(index)):
        if _along(frames[index[k], 2], frames[index[0], 2]) > SAME_SIDE:
            weight[k] = np.exp(-((distance[k] / (1.2 * spacing)) ** 2))
            total += weight[k]
    return weight / total


@njit()
def _local(site, centre, e, spacing):  # type: ignore[no-untyped-def]
    """Coordinates of a point over the plane of a cubic, those in the plane in spacings."""
    d = site - centre
    return _along(e[0], d) / spacing, _along(e[1], d) / spacing, _along(e[2], d)


@njit("f2 f2 i2 f2 f3 f2 f f2 f2")
def _means(sites, distance, index, centres, frames, coefficients, spacing, mean, normals):  # type: ignore[no-untyped-def]
    """Weighted means (n, 3) of the points above `sites` (n, 3) on the cubics nearby, and of their normals."""
    for n in range(len(sites)):
        weight = _weight(distance[n], index[n], frames, spacing)
        for i in range(3):
            mean[n, i], normals[n, i] = sites[n, i], 0.0
        for k in range(len(weight)):
            e, c = frames[index[n, k]], coefficients[index[n, k]]
            a, b, h = _local(sites[n], centres[index[n, k]], e, spacing)
            height = c[0] + a * (c[1] + a * (c[3] + a * c[6])) + b * (c[2] + b * (c[5] + b * c[9]))
            height += a * b * (c[4] + a * c[7] + b * c[8])
            slope_a = c[1] + a * (2 * c[3] + 3 * a * c[6]) + b * (c[4] + 2 * a * c[7] + b * c[8])
            slope_b = c[2] + b * (2 * c[5] + 3 * b * c[9]) + a * (c[4] + 2 * b * c[8] + a * c[7])
            steep = np.sqrt(1.0 + (slope_a**2 + slope_b**2) / spacing**2)
            for i in range(3):
                mean[n, i] += weight[k] * (height - h) * e[2, i]
                normals[n, i] += weight[k] * (e[2, i] - (slope_a * e[0, i] + slope_b * e[1, i]) / spacing) / steep


@njit("f2 f2 i2 f2 f3 f2 f f3 f2")
def _curvatures(  # type: ignore[no-untyped-def]
    sites, distance, index, centres, frames, coefficients, spacing, turned, quadrics
):
    """Quadrics (n, 10) over `turned` frames (n, 3, 3), with the weighted mean of the curvature of the cubics nearby.

    Each cubic is rotated into the new tangent plane by the smallest angle. The mean is reduced by `EASE`, so that the
    surface does not roll up: over one spacing it turns by its largest principal value.
    """
    for n in range(len(sites)):
        weight = _weight(distance[n], index[n], frames, spacing)
        x, y, z = turned[n]
        aa = ab = bb = 0.0
        for k in range(len(weight)):
            e, c = frames[index[n, k]], coefficients[index[n, k]]
            a, b, _ = _local(sites[n], centres[index[n, k]], e, spacing)
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
