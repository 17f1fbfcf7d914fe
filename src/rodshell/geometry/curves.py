"""Curves given by points: local cubic interpolation, and polylines joined end to end."""

from collections.abc import Iterable

import numpy as np

from rodshell.arrays import Floats
from rodshell.kernels import njit

TOUCH = 1e-6  # of the extent of all polylines: ends this close are joined


@njit("f2 f3 f1")  # type: ignore[untyped-decorator, unused-ignore]
def lagrange(knots: Floats, points: Floats, s: Floats) -> Floats:
    """Values (n, d) of polynomials, one for each of the parameters `s` (n,) [m].

    Args:
        knots: (n, p) parameters at which each polynomial is known [m].
        points: (n, p, d) its values there.
    """
    result = np.empty((points.shape[0], points.shape[2]))
    for n in range(len(s)):
        put_lagrange(knots, points, n, s[n], result, n)
    return result


@njit(error_model="numpy")
def put_lagrange(knots, points, n, at, result, row):  # type: ignore[no-untyped-def]
    """Put the value `at` a parameter of polynomial n of `lagrange` into a row of the result."""
    for d in range(points.shape[2]):
        result[row, d] = 0.0
    for j in range(knots.shape[1]):
        above, below = 1.0, 1.0
        for k in range(knots.shape[1]):
            if j != k:
                above, below = above * (at - knots[n, k]), below * (knots[n, j] - knots[n, k])
        weight = above / below
        for d in range(points.shape[2]):
            result[row, d] += weight * points[n, j, d]


def on_curve(knots: Floats, points: Floats, s: Floats) -> Floats:
    """Points (n, 3) [m] of a curve at the parameters `s` (n,) [m], by local cubics, to fourth order.

    In each interval the cubic goes through the four nearest knots, or through all if there are fewer.

    Args:
        knots: (m,) ascending parameters [m].
        points: (m, 3) points of the curve there [m].
    """
    return np.asarray(_on_curve(knots, np.ascontiguousarray(points), s))


@njit("f1 f2 f1")
def _on_curve(knots, points, s):  # type: ignore[no-untyped-def]
    count, axes = min(4, len(knots)), points.shape[1]
    near, around = np.empty((len(s), count)), np.empty((len(s), count, axes))
    for n in range(len(s)):
        first = min(max(_right_of(knots, s[n]) - count // 2, 0), len(knots) - count)
        for k in range(count):
            near[n, k] = knots[first + k]
            for d in range(axes):
                around[n, k, d] = points[first + k, d]
    return lagrange(near, around, s)


def arc_lengths(x: Floats) -> Floats:
    """Arc lengths (n,) from the first to each point of a polyline (n, d)."""
    return np.append(0.0, np.cumsum(np.linalg.norm(np.diff(x, axis=0), axis=1)))


@njit("f1 f3 i f1 f")  # type: ignore[untyped-decorator, unused-ignore]
def resampled(knots: Floats, points: Floats, origin: int, s: Floats, beyond: float) -> Floats:
    """Interpolate m lines with common knots, as `on_curve` does.

    Args:
        knots: (k,) ascending parameters of all lines [m].
        points: (k, m, 3) points of the lines [m]; NaN where a line is not known. Of each line the run of known points
            around `origin` is used.
        origin: index of the knot around which the lines are known.
        s: (n,) requested parameters [m].
        beyond: the cubics are continued past the known points by this many steps of the knots.

    Returns:
        (m, n, 3) points [m]; NaN further away from the known points.
    """
    count, lines, spare, most = len(knots), points.shape[1], len(s), min(4, len(knots))
    result = np.empty((lines, len(s), 3))
    right, windows = np.empty(len(s), dtype=np.int64), np.empty(len(s), dtype=np.int64)
    shares = np.empty((spare + 1, 4))
    for n in range(len(s)):
        right[n] = _right_of(knots, s[n])
        windows[n] = _nearest_four(knots, s[n], right[n], 0, count - 1, shares, n)
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
            if not low <= s[n] <= high:
                result[m, n, 0] = result[m, n, 1] = result[m, n, 2] = np.nan
                continue
            at = right[n]
            if first <= at <= last and knots[at] == s[n]:  # itself
                for d in range(3):
                    result[m, n, d] = points[at, m, d]
                continue
            row, window, x, y, z = n, windows[n], 0.0, 0.0, 0.0
            if window < first or window + most - 1 > last:
                row, window = spare, _nearest_four(knots, s[n], right[n], first, last, shares, spare)
            for k in range(near):
                x += shares[row, k] * points[window + k, m, 0]
                y += shares[row, k] * points[window + k, m, 1]
                z += shares[row, k] * points[window + k, m, 2]
            result[m, n, 0], result[m, n, 1], result[m, n, 2] = x, y, z
    return result


@njit(error_model="numpy")
def _nearest_four(knots, at, right, first, last, shares, row):  # type: ignore[no-untyped-def]
    """Of the knots from the `first` to the `last`: the first of the four nearest to `at`, with `right` knots before it,
    and their weights in a cubic, put into `shares[row]` (4,)."""
    near = min(4, last - first + 1)
    window = min(max(right - near // 2, first), last + 1 - near)
    if near == 4:  # of a known number, so that the loops become straight code
        _put_shares(knots, at, window, 4, shares, row)
    else:
        _put_shares(knots, at, window, near, shares, row)
    return window


@njit(error_model="numpy", inline="always")
def _put_shares(knots, at, window, near, shares, row):  # type: ignore[no-untyped-def]
    for j in range(near):
        above, below = 1.0, 1.0
        for k in range(near):
            if j != k:
                above, below = above * (at - knots[window + k]), below * (knots[window + j] - knots[window + k])
        shares[row, j] = above / below


@njit()
def _right_of(knots, at):  # type: ignore[no-untyped-def]
    """How many knots are before `at`; all if it is not a number."""
    low, high = 0, len(knots)
    while low < high:
        middle = (low + high) // 2
        if knots[middle] < at or np.isnan(at):
            low = middle + 1
        else:
            high = middle
    return low


def closed_loops(strokes: Iterable[Floats]) -> list[Floats]:
    """Polylines (n, 3), in any order and direction, joined end to end into closed loops (n, 3), the longest first.

    Those that stay open are left out. The first point is not repeated at the end.
    """
    loops = [line[:-1] for line in join_end_to_end(strokes) if len(line) > 3 and np.array_equal(line[0], line[-1])]
    return sorted(loops, key=lambda x: -float(np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1).sum()))


def join_end_to_end(strokes: Iterable[Floats]) -> list[Floats]:
    """Polylines (n, 3), in any order and direction, joined where their ends touch; closed ones end with their first
    point."""
    given = list(strokes)
    if not given:
        return []
    tiny = TOUCH * float(np.ptp(np.vstack(given), axis=0).max())
    ends, free = np.array([(stroke[0], stroke[-1]) for stroke in given]), np.ones(len(given), dtype=bool)
    lines = list[Floats]()
    for last in range(len(given) - 1, -1, -1):
        if not free[last]:
            continue
        free[last], pieces, turned = False, [given[last]], False
        while np.linalg.norm(pieces[-1][-1] - pieces[0][0]) > tiny:
            near = np.argwhere(free[:, None] & (np.linalg.norm(ends - pieces[-1][-1], axis=2) <= tiny))
            if len(near):
                k, flip = near[0].tolist()
                free[k] = False
                pieces.append((given[k][::-1] if flip else given[k])[1:])
            elif turned:
                break
            else:
                pieces, turned = [piece[::-1] for piece in reversed(pieces)], True
        line = np.vstack(pieces)
        closed = np.linalg.norm(line[-1] - line[0]) <= tiny
        lines.append(np.vstack([line[:-1], line[:1]]) if closed else line)
    return lines
