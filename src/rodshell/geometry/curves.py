"""Curves given by points: local cubic interpolation."""

import numba as nb
import numpy as np

from rodshell.arrays import Floats


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


@nb.njit(cache=True)
def resampled(knots: Floats, points: Floats, origin: int, s: Floats, beyond: float) -> Floats:
    """Points (m, n, 3) at `s` (n,) of m lines through `points` (k, m, 3) at `knots` (k,), as `on_curve` takes them.

    Of each line the nodes around the one at `origin` count that are known without a gap: those between two that are
    NaN. So many of their steps `beyond` them the cubics go on; further away the line has no points, but NaN.
    """
    count, lines, spare, most = len(knots), points.shape[1], len(s), min(4, len(knots))
    result = np.empty((lines, len(s), 3))
    right, windows, shares = np.searchsorted(knots, s), np.empty(len(s), dtype=np.intp), np.empty((spare + 1, 4))
    for n in range(len(s)):
        windows[n] = _window(knots, s[n], right[n], 0, count - 1, shares, n)
    for m in range(lines):
        first, last = origin, origin
        while first > 0 and not np.isnan(points[first - 1, m, 0]):
            first -= 1
        while last < count - 1 and not np.isnan(points[last + 1, m, 0]):
            last += 1
        near = min(4, last - first + 1)
        low = knots[first] - beyond * (knots[min(first + 1, last)] - knots[first])
        high = knots[last] + beyond * (knots[last] - knots[max(first, last - 1)])
        for n in range(len(s)):
            own, window, x, y, z = n, windows[n], 0.0, 0.0, 0.0
            if window < first or window + most - 1 > last:
                own, window = spare, _window(knots, s[n], right[n], first, last, shares, spare)
            if not low <= s[n] <= high:
                x = y = z = np.nan
            for k in range(near):
                x += shares[own, k] * points[window + k, m, 0]
                y += shares[own, k] * points[window + k, m, 1]
                z += shares[own, k] * points[window + k, m, 2]
            result[m, n, 0], result[m, n, 1], result[m, n, 2] = x, y, z
    return result


@nb.njit(cache=True, error_model="numpy")
def _window(knots, at, right, first, last, shares, own):  # type: ignore[no-untyped-def]
    """Of the knots from the `first` to the `last`: the first of the four nearest to `at`, and their `shares` (:, 4) in
    the row `own`."""
    near = min(4, last - first + 1)
    window = min(max(right - near // 2, first), last + 1 - near)
    for j in range(near):
        shares[own, j] = 1.0
        for k in range(near):
            if j != k:
                shares[own, j] *= (at - knots[window + k]) / (knots[window + j] - knots[window + k])
    return window


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
