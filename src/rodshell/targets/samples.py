"""Samples of the smooth surface that a triangle mesh represents; openings in it are filled by caps."""

from dataclasses import dataclass
from itertools import product

import numpy as np
from scipy.interpolate import RBFInterpolator
from scipy.spatial import ConvexHull, QhullError

from rodshell.arrays import Bools, Floats
from rodshell.geometry.frames import cross, dot, unit
from rodshell.targets.trianglemesh import TriangleMesh, turned, unique_rows

LONGEST = 0.9  # spacings: longest edge that is not divided
FINEST = 48  # divisions of an edge
APART = 0.2  # spacings: samples closer to each other are merged
AT_ONCE = 1_000_000  # samples that are held before they are merged

# openings
STEEPEST = 0.35  # cosine between an opening's axis and the normals around it: beyond it no cap fits, as on a tube
BAND = 0.6  # of the opening's radius: width of the band around it to which a cap is fitted
_CAP_POINTS = 1500  # most points to which a cap is fitted
DEEP, WIDEST = 0.3, 0.5  # a door: least depth over its width, and largest width over the surface's extent
PITCH = 0.5  # spacings between the samples of a cap


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of a surface.

    Args:
        points: (n, 3) [m].
        normals: (n, 3) outward unit normals.
        areas: (n,) area that each point represents [m2].
    """

    points: Floats
    normals: Floats
    areas: Floats


_Parts = tuple[Floats, Floats, Floats]  # points, normals and areas


def mesh_samples(mesh: TriangleMesh, spacing: float) -> Samples:
    """Sample the smooth surface that a mesh represents, densely enough to fit cubics to that are a `spacing` [m] apart.

    The samples are the vertices, and points on triangles that are large against the spacing or long and thin; where one
    is narrower than samples are apart, those along its longest edge. Between its vertices the surface is taken as a
    cubic that meets their normals [Vlachos et al. 2001, Curved PN triangles]: a long triangle of a vault lies below the
    arch that it spans. Vertices of the rim come first, so that cubics are placed there: beyond the rim there is nothing
    to fit to.
    """
    faces, corners = mesh.faces, mesh.vertices[mesh.faces]
    edges = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    longest = edges.max(axis=1)
    divisions = np.clip(np.ceil(longest / (LONGEST * spacing)), 1, FINEST).astype(int)
    narrow = 2 * mesh.areas < APART * spacing * longest
    first = np.where(narrow, edges.argmax(axis=1), 0)
    faces = turned(faces, first)
    areas = np.bincount(mesh.faces.ravel(), np.repeat(mesh.areas * (divisions == 1) / 3, 3), len(mesh.vertices))
    rim_first = np.argsort(~np.isin(np.arange(len(mesh.vertices)), np.concatenate([[-1], *mesh.loops])), kind="stable")
    found: list[_Parts] = [(mesh.vertices[rim_first], mesh.normals[rim_first], np.asarray(areas[rim_first], float))]
    for n, is_narrow in product(np.unique(divisions[divisions > 1]).tolist(), (False, True)):
        share = np.array([(i, j, n - i - j) for i in range(n + 1) for j in range(n + 1 - i)]).T / n
        if is_narrow:
            share = share[:, share[2] == 0]
        chosen = np.flatnonzero((divisions == n) & (narrow == is_narrow))
        for part in np.array_split(chosen, -(-len(chosen) * share.shape[1] // AT_ONCE) or 1):
            x, normal = _curved(mesh.vertices[faces[part]], mesh.normals[faces[part]], share)
            weight = np.repeat(mesh.areas[part] / share.shape[1], share.shape[1])
            found.append((x.reshape(-1, 3), normal.reshape(-1, 3), weight))
            if sum(len(points) for points, _, _ in found) > 2 * AT_ONCE:
                found = [_thinned(found, APART * spacing)]
    return Samples(*_thinned(found, APART * spacing))


def _curved(x: Floats, n: Floats, share: Floats) -> tuple[Floats, Floats]:
    """Points and normals (m, k, 3) of curved triangles with corners x, normals n (m, 3, 3) at `share` (3, k)."""
    cubic = np.einsum("ck,mcd->mkd", share**3, x)
    middle = np.zeros_like(x[:, 0])
    for a in range(3):
        for b in range(3):
            if a != b:
                control = (2 * x[:, a] + x[:, b] - dot(x[:, b] - x[:, a], n[:, a])[:, None] * n[:, a]) / 3
                cubic += 3 * (share[a] ** 2 * share[b])[None, :, None] * control[:, None]
                middle += control / 4
    middle -= x.sum(axis=1) / 6
    cubic += 6 * np.prod(share, axis=0)[None, :, None] * middle[:, None]
    mixed = np.einsum("ck,mcd->mkd", share, n)
    return cubic, mixed / np.maximum(np.linalg.norm(mixed, axis=2), 1e-300)[..., None]


def _thinned(found: list[_Parts], apart: float) -> _Parts:
    """One sample for each cell of a lattice, with the area of all samples in it; the first is preferred."""
    points, normals, areas = (np.concatenate(parts) for parts in zip(*found, strict=True))
    sound = np.isfinite(points).all(axis=1) & (dot(normals, normals) > 0.5)
    points, normals, areas = points[sound], normals[sound], areas[sound]
    cell = np.floor((points - points.min(axis=0)) / apart).astype(np.int64)
    facing = (normals @ [0.577, 0.578, 0.579] > 0).astype(np.int64)  # two sheets in one cell stay two
    first, cell_of = unique_rows(np.column_stack([cell, facing]))
    order = np.argsort(first)
    weight = np.bincount(cell_of, areas)
    return points[first][order], unit(normals[first][order]), np.maximum(weight, 1e-3 * weight.mean())[order]


def fill_openings(mesh: TriangleMesh, samples: Samples, spacing: float) -> Samples:
    """Add samples across every opening, and every door in the outer edge, where a smooth cap fits.

    The net continues there, although rods do not. Without a cap the surface would be continued into a door from three
    sides, and would meet itself there in a crease. A cap is the interpolant of |r|^3 through the surface around the
    opening: its bending energy is the smallest [Duchon 1977].
    """
    points, normals = [samples.points], [samples.normals]
    outer, *openings = [mesh.vertices[loop] for loop in mesh.loops] or [np.empty((0, 3))]
    for rim in (*openings, *_doors(outer, spacing)):
        cap = _cap(rim, samples, spacing)
        if cap is not None:
            points.append(cap[0])
            normals.append(cap[1])
    added = sum(map(len, points[1:]))
    areas = np.append(samples.areas, np.full(added, (PITCH * spacing) ** 2))
    return Samples(np.vstack(points), np.vstack(normals), areas)


def _doors(rim: Floats, spacing: float) -> list[Floats]:
    """Deep bays of a closed polyline (n, 3): parts of it inside its convex hull, in the plane that fits it best."""
    if len(rim) < 4:
        return []
    centred = rim - rim.mean(axis=0)
    plane = np.linalg.svd(centred, full_matrices=False)[2][:2]
    try:
        corners = np.sort(ConvexHull(centred @ plane.T).vertices)
    except QhullError:  # a line
        return []
    extent, doors = float(np.ptp(rim, axis=0).max()), list[Floats]()
    stops = np.append(corners[1:], corners[0] + len(rim))
    for first, stop in np.column_stack([corners, stops])[stops - corners > 1].tolist():
        x = rim[np.arange(first, stop + 1) % len(rim)]
        along = unit(x[-1:] - x[:1])
        off = np.linalg.norm(cross(x - x[:1], np.broadcast_to(along, x.shape)), axis=1)
        inside = np.flatnonzero(np.diff(np.concatenate([[False], off > spacing, [False]]).astype(int)))
        for begin, end in inside.reshape(-1, 2):
            door = x[max(begin - 1, 0) : end + 1]
            wide, deep = float(np.linalg.norm(door[-1] - door[0])), float(off[begin:end].max())
            if deep > max(DEEP * wide, 2 * spacing) and wide < WIDEST * extent:
                doors.append(door)
    return doors


def _cap(rim: Floats, samples: Samples, spacing: float) -> tuple[Floats, Floats] | None:
    """Points and normals (n, 3) on a lattice over the plane of a rim (k, 3); None where no smooth cap fits."""
    centre = rim.mean(axis=0)
    axis = cross(np.roll(rim, -1, axis=0) - centre, rim - centre).sum(axis=0)  # the hole is on the right of its loop
    axis /= max(float(np.linalg.norm(axis)), 1e-300)
    radius = float(np.linalg.norm(rim - centre, axis=1).max())
    near = np.linalg.norm(samples.points - centre, axis=1) < (1 + BAND) * radius + 2 * spacing
    around, facing = samples.points[near], samples.normals[near]
    if len(around) < 12 or dot(facing, axis).min() < STEEPEST:
        return None
    chosen = np.unique(np.linspace(0, len(around) - 1, _CAP_POINTS).astype(int))
    first = unit(cross(axis, np.array([0.0, 1.0, 0.0]) if abs(axis[0]) > 0.7 else np.array([1.0, 0.0, 0.0])))
    plane = np.stack([first, cross(axis, first)])
    height = RBFInterpolator((around[chosen] - centre) @ plane.T, (around[chosen] - centre) @ axis, kernel="cubic")
    reach = int(radius / (PITCH * spacing))
    steps = np.arange(-reach, reach + 1) * PITCH * spacing
    lattice = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    flat = lattice[_enclosed(lattice, (rim - centre) @ plane.T)]
    if len(flat) == 0:
        return None
    h = 0.1 * spacing
    slope = [(height(flat + h * way) - height(flat - h * way)) / (2 * h) for way in np.eye(2)]
    normals = unit(axis - slope[0][:, None] * plane[0] - slope[1][:, None] * plane[1])
    return centre + flat @ plane + height(flat)[:, None] * axis, normals


def _enclosed(points: Floats, loop: Floats) -> Bools:
    """(n,) plane points inside a closed polygon, by crossings of a ray along x."""
    a, b = loop, np.roll(loop, -1, axis=0)
    inside = np.zeros(len(points), dtype=bool)
    for p, q in zip(a, b, strict=True):
        across = (p[1] > points[:, 1]) != (q[1] > points[:, 1])
        at = p[0] + (points[:, 1] - p[1]) / (q[1] - p[1] if q[1] != p[1] else 1.0) * (q[0] - p[0])
        inside ^= across & (points[:, 0] < at)
    return inside
