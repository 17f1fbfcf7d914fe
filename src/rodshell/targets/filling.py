"""The smoothest surface across an opening: the net goes on there, although no rod will."""

import numpy as np
from numpy.typing import NDArray

from rodshell.geometry.vectors import cross, dot, unit
from rodshell.targets.fitting import Samples
from rodshell.targets.trianglemesh import TriangleMesh

Floats = NDArray[np.float64]

STEEPEST = 0.35  # cosine between the opening's axis and the normals around it: past that no cap fits, as on a tube
BAND = 0.6  # of the opening's radius: width of the surface around it that decides
MOST = 1500  # points that decide
PITCH = 0.5  # spacings between the points that fill


def fill_openings(mesh: TriangleMesh, samples: Samples, spacing: float) -> Samples:
    """The samples, with more across every loop but the longest whose surroundings stand over its plane.

    A cap is the interpolant of |r|^3 through the surface around the opening: it bends least [Duchon 1977].
    """
    points, normals = [samples.points], [samples.normals]
    for loop in mesh.loops[1:]:
        cap = _cap(mesh.vertices[loop], samples, spacing)
        if cap is not None:
            points.append(cap[0])
            normals.append(cap[1])
    added = sum(map(len, points[1:]))
    areas = np.append(samples.areas, np.full(added, (PITCH * spacing) ** 2))
    return Samples(np.vstack(points), np.vstack(normals), areas)


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


def _enclosed(points: Floats, loop: Floats) -> NDArray[np.bool_]:
    """(n,) plane points inside a closed polygon, by crossings of a ray along x."""
    a, b = loop, np.roll(loop, -1, axis=0)
    inside = np.zeros(len(points), dtype=bool)
    for p, q in zip(a, b, strict=True):
        across = (p[1] > points[:, 1]) != (q[1] > points[:, 1])
        at = p[0] + (points[:, 1] - p[1]) / (q[1] - p[1] if q[1] != p[1] else 1.0) * (q[0] - p[0])
        inside ^= across & (points[:, 0] < at)
    return inside
