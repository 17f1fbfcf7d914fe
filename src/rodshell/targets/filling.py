"""The smoothest surface across an opening or a door: the net goes on there, although no rod will."""

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.geometry.vectors import cross, dot, unit
from rodshell.targets.fitting import Samples
from rodshell.targets.trianglemesh import TriangleMesh

STEEPEST = 0.35  # cosine between the opening's axis and the normals around it: past that no cap fits, as on a tube
BAND = 0.6  # of the opening's radius: width of the surface around it that decides
MOST = 1500  # points that decide
DEEP, WIDEST = 0.3, 0.5  # a door is so deep at least, in its widths, and so wide at most, in the surface's extents
PITCH = 0.5  # spacings between the points that fill


def fill_openings(mesh: TriangleMesh, samples: Samples, spacing: float) -> Samples:
    """The samples, with more across every opening and every door in the outer edge, where a smooth cap fits.

    Without them the surface would go on into a door from three sides, and meet itself there in a crease.

    A cap is the interpolant of |r|^3 through the surface around the opening: it bends least [Duchon 1977].
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
    """Deep bays of a closed polyline (n, 3): what lies inside its convex hull, seen against the plane that fits it."""
    from scipy.spatial import ConvexHull, QhullError

    if len(rim) < 4:
        return []
    centred = rim - rim.mean(axis=0)
    plane = np.linalg.svd(centred, full_matrices=False)[2][:2]
    try:
        corners = np.sort(ConvexHull(centred @ plane.T).vertices)
    except QhullError:  # a line
        return []
    extent, doors = float(np.ptp(rim, axis=0).max()), list[Floats]()
    for first, stop in zip(corners, np.append(corners[1:], corners[0] + len(rim)), strict=True):
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
    """Points and normals (n, 3) on a lattice over the plane of a rim (k, 3); None where there is no such cap."""
    from scipy.interpolate import RBFInterpolator

    centre = rim.mean(axis=0)
    axis = cross(np.roll(rim, -1, axis=0) - centre, rim - centre).sum(axis=0)  # the hole lies on a loop's right
    axis /= max(float(np.linalg.norm(axis)), 1e-300)
    radius = float(np.linalg.norm(rim - centre, axis=1).max())
    near = np.linalg.norm(samples.points - centre, axis=1) < (1 + BAND) * radius + 2 * spacing
    around, facing = samples.points[near], samples.normals[near]
    if len(around) < 12 or dot(facing, axis).min() < STEEPEST:
        return None
    chosen = np.unique(np.linspace(0, len(around) - 1, MOST).astype(int))
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
