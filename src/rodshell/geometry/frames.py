"""Adapted frames of a rod: a unit tangent t and a director d1 across it; d2 = t x d1 completes the frame."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.geometry.vectors import cross, dot, unit

_ALONG = 1e-6  # a director within this angle [rad] of its tangent says nothing about the plane across


def parallel_transport(vectors: Floats, start: Floats, end: Floats) -> Floats:
    """Turn `vectors` (..., 3) by the smallest rotation that takes the unit tangents `start` to `end`.

    Two reflections, which need neither an angle nor an axis. Opposite tangents have no smallest rotation: the
    result is then not finite.
    """
    middle = start + end
    share = dot(middle, vectors) / (1.0 + dot(start, end))
    return np.asarray(vectors - share[..., None] * middle + 2.0 * dot(start, vectors)[..., None] * end)


def adapted(directors: Floats, tangents: Floats) -> Floats:
    """`directors` (..., 3) made perpendicular to the unit `tangents` (..., 3) and scaled to length 1."""
    across = directors - dot(directors, tangents)[..., None] * tangents
    flat = np.linalg.norm(across, axis=-1) <= _ALONG * np.linalg.norm(directors, axis=-1)
    if np.any(flat):
        row = np.argwhere(flat)[0].tolist()
        which = f"director {row}" if row else "the director"
        raise InputError(f"{which} lies along its edge or is zero: give one across the rod")
    return unit(across)


def directors_along(tangents: Floats, first: Floats) -> Floats:
    """Directors (n, 3) of a frame without twist along a rod: `first` (3,) carried from edge to edge.

    tangents : (n, 3) unit tangents of the rod's edges, in a row.
    first : director of the first edge; its part across the edge is used.
    """
    with np.errstate(divide="ignore"):
        weights = 1.0 / (1.0 + dot(tangents[:-1], tangents[1:]))
    x, y, z = adapted(first, tangents[0]).tolist()
    directors, edges = [(x, y, z)], tangents.tolist()
    for (p, q, r), (a, b, c), weight in zip(edges, edges[1:], weights.tolist(), strict=False):
        share = weight * (a * x + b * y + c * z)  # as `parallel_transport`, but by scalars: ten times as fast
        x, y, z = x - share * (p + a), y - share * (q + b), z - share * (r + c)
        directors.append((x, y, z))
    return np.array(directors)


def signed_angle(start: Floats, end: Floats, axis: Floats) -> Floats:
    """Angles in (-pi, pi] [rad] from the vectors `start` to `end`, both perpendicular to the unit `axis`."""
    return np.asarray(np.arctan2(dot(axis, cross(start, end)), dot(start, end)))
