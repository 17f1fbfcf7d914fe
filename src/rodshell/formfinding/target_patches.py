"""From seams to patches: which parts a target falls into, and where the middle of each is."""

from dataclasses import replace
from string import ascii_uppercase

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.vectors import cross
from rodshell.nets import geodesics
from rodshell.targets import Target
from rodshell.targets.patch import Patch, Seam

RAYS, STEPS = 240, 90  # of the look around a target, from its summit
FAR = 3.0  # sizes that a ray runs
BESIDE = 0.09  # of the size: points closer than this are neighbours
AGAIN = 0.3  # of the size: points that one ray has this much further to than another has been there before
LEAST = 0.01  # of the target: what is smaller is no patch
DEEP = 0.05  # of the size: a middle closer to the patch's end is none


def patches_of(target: Target, seams: tuple[Seam, ...]) -> dict[str, Patch]:
    """The patches by their names A, B, ..., from left to right.

    Raises
    ------
    InputError : the seams cut off nothing, or there are more patches than letters.
    """
    points, areas = _look_around(target)
    sides = np.array([seam.distance(points) > 0 for seam in seams])  # (seams, n)
    found = list[Patch]()
    for part in _connected(points, sides, BESIDE * target.size):
        if areas[part].sum() > LEAST * areas.sum():
            signs = tuple(1 if left else -1 for left in sides[:, part[0]])
            patch = Patch(whole=target, seams=seams, sides=signs, middle=(0.0, 0.0))
            found.append(replace(patch, middle=_middle(patch, points[part], areas[part])))
    if len(found) < 2:
        raise InputError("the seams leave the target in one piece: draw lines that run across it in plan")
    if len(found) > len(ascii_uppercase):
        raise InputError(f"the seams cut the target into {len(found)} patches: at most {len(ascii_uppercase)} will do")
    coarse = 0.05 * target.size  # of middles that are equally far left, the lower one comes first
    found.sort(key=lambda patch: (round(patch.middle[0] / coarse), patch.middle[1]))
    return dict(zip(ascii_uppercase, found, strict=False))


def transported_heading(target: Target, anchor: tuple[float, float], rotate: float) -> float:
    """Angle against x, seen from above [rad], of the summit's heading `rotate` where it is carried to an anchor.

    By the turn that takes one normal into the other: of patches that mirror each other, so do the headings.
    """
    points = target.lift(np.array([target.summit, anchor]))
    n, m = target.on_surface(points).normal
    along = np.array([np.cos(rotate) * n[2], np.sin(rotate) * n[2], -np.cos(rotate) * n[0] - np.sin(rotate) * n[1]])
    axis = np.cross(n, m)
    turned = along + np.cross(axis, along) + np.cross(axis, np.cross(axis, along)) / (1.0 + n @ m)
    return float(np.arctan2(turned[1], turned[0]))


def _look_around(target: Target) -> tuple[Floats, Floats]:
    """Points (n, 3) of a target, each standing for an area (n,) [m2].

    They lie on geodesic rays from the summit, which also see what overhangs. A ray that comes back from below to where
    others have been before counts no more.
    """
    x, y = target.summit
    top = target.lift(np.array([[x, y]]))
    normal = target.on_surface(top).normal
    along = np.array([[normal[0, 2], 0.0, -normal[0, 0]]])
    along /= np.linalg.norm(along)
    angle = 2 * np.pi * (np.arange(RAYS)[:, None] + 0.5) / RAYS  # no ray along an axis: a seam may lie there
    directions = np.cos(angle) * along + np.sin(angle) * cross(normal, along)
    step = FAR * target.size / STEPS
    with np.errstate(all="ignore"):
        rays = np.stack(geodesics(target, np.repeat(top, RAYS, axis=0), directions, [np.full(STEPS, step)] * RAYS))
    areas = step * np.linalg.norm(np.roll(rays, -1, axis=0) - np.roll(rays, 1, axis=0), axis=2) / 2
    far = np.broadcast_to(step * np.arange(1, STEPS + 1), areas.shape)
    known = np.isfinite(rays[..., 0]) & np.isfinite(areas)
    known[known] = target.margin(rays[known]) > 0
    points, areas, far = rays[known], areas[known], far[known]
    first, second = _neighbours(points, BESIDE * target.size).T
    again = np.zeros(len(points), dtype=bool)
    again[first] |= far[first] > far[second] + AGAIN * target.size
    again[second] |= far[second] > far[first] + AGAIN * target.size
    return points[~again], areas[~again]


def _neighbours(points: Floats, reach: float) -> Ints:
    """(m, 2) pairs of points (n, 3) no further apart than `reach` [m]."""
    from scipy.spatial import cKDTree

    return np.asarray(cKDTree(points).query_pairs(reach, output_type="ndarray"), dtype=np.intp).reshape(-1, 2)


def _connected(points: Floats, sides: Bools, reach: float) -> list[Ints]:
    """Points (k,) of each part: those within `reach` [m] on the same sides of all seams belong together."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    pairs = _neighbours(points, reach)
    kept = pairs[(sides[:, pairs[:, 0]] == sides[:, pairs[:, 1]]).all(axis=0)]
    graph = coo_array((np.ones(len(kept)), (kept[:, 0], kept[:, 1])), shape=(len(points), len(points)))
    parts, label = connected_components(graph, directed=False)
    return [np.flatnonzero(label == k) for k in range(parts)]


def _middle(patch: Patch, points: Floats, areas: Floats) -> tuple[float, float]:
    """x, y of the patch's centre of area, put on the target; of its deepest point where that is not on the target.

    The centre of a patch that goes around another lies in that one: a net may start there.
    """
    centre = patch.closest(np.average(points, axis=0, weights=areas)[None])
    if not (patch.whole.margin(centre)[0] > DEEP * patch.size and _from_above(patch, centre)[0]):
        seen = points[_from_above(patch, points)]
        centre = seen[[np.argmax(patch.margin(seen))]]
    x, y = centre[0, :2].tolist()
    return x, y


def _from_above(patch: Patch, points: Floats) -> Bools:
    """Whether these points (n, 3) are the ones that an anchor's x, y stands for."""
    z = patch.height_at(points[:, :2])
    return np.asarray(np.abs(z - points[:, 2]) < 1e-6 * patch.size)
