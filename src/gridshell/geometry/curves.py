"""Curves given by points: local cubic interpolation."""

import numba as nb
import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]


@nb.njit(cache=True, error_model="numpy")
def lagrange(knots: Floats, points: Floats, s: Floats) -> Floats:
    """Points (n, d) at `s` (n,) of the polynomials through `points` (n, p, d) at `knots` (n, p)."""
    result = np.zeros((points.shape[0], points.shape[2]))
    for n in range(len(s)):
        for j in range(knots.shape[1]):
            weight = 1.0
            for k in range(knots.shape[1]):
                if j != k:
                    weight *= (s[n] - knots[n, k]) / (knots[n, j] - knots[n, k])
            for d in range(points.shape[2]):
                result[n, d] += weight * points[n, j, d]
    return result


def on_curve(knots: Floats, points: Floats, s: Floats) -> Floats:
    """Points (n, 3) at `s` (n,) of a curve through `points` (m, 3) at ascending `knots` (m,).

    Fourth order: through each interval goes the cubic of the four nearest knots, or of all if there are fewer.
    """
    return _on_curve(knots, np.ascontiguousarray(points), s)


@nb.njit(cache=True)
def _on_curve(knots, points, s):  # type: ignore[no-untyped-def]
    window = _nearest(knots, s)
    near, around = np.empty(window.shape), np.empty((*window.shape, points.shape[1]))
    for n in range(window.shape[0]):
        for k in range(window.shape[1]):
            near[n, k] = knots[window[n, k]]
            around[n, k] = points[window[n, k]]
    return lagrange(near, around, s)


def cubic_windows(knots: Floats, s: Floats, beyond: float) -> tuple[NDArray[np.intp], Floats]:
    """The four nearest of the ascending `knots` (m,) and their weights, both (n, 4), as `on_curve` takes them.

    NaN weights where `s` (n,) lies further outside the knots than the share `beyond` of their extent.
    """
    window = _nearest(knots, s)
    weight = lagrange(knots[window], np.broadcast_to(np.eye(window.shape[1]), (*window.shape, window.shape[1])), s)
    slack = beyond * (knots[-1] - knots[0])
    weight[(s < knots[0] - slack) | (s > knots[-1] + slack)] = np.nan
    return window, weight


@nb.njit(cache=True)
def _nearest(knots, s):  # type: ignore[no-untyped-def]
    """(n, 4) the knots around each `s` (n,), or all if there are fewer."""
    count = min(4, len(knots))
    window = np.empty((len(s), count), dtype=np.intp)
    right = np.searchsorted(knots, s)
    for n in range(len(s)):
        first = min(max(right[n] - count // 2, 0), len(knots) - count)
        for k in range(count):
            window[n, k] = first + k
    return window
