"""Curves given by points: local cubic interpolation, and polylines joined end to end."""

from collections.abc import Iterable

import numpy as np

from rodshell.arrays import Floats
from rodshell.kernels import njit

TOUCH = 1e-6  # of the extent of all polylines: ends this close are joined


@njit(error_model="numpy")  # type: ignore[untyped-decorator, unused-ignore]
def lagrange(knots: Floats, points: Floats, s: Floats) -> Floats:
    """Interpolate with polynomials, one for each requested point.

    Parameters
    ----------
    knots : (n, p), parameters at which each polynomial is known [m].
    points : (n, p, d), its values there.
    s : (n,) requested parameters [m].

    Returns
    -------
    (n, d) values at `s`.
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
        weight = 1.0
        for k in range(knots.shape[1]):
            if j != k:
                weight *= (at - knots[n, k]) / (knots[n, j] - knots[n, k])
        for d in range(points.shape[2]):
            result[row, d] += weight * points[n, j, d]


def on_curve(knots: Floats, points: Floats, s: Floats) -> Floats:
    """Interpolate a curve by local cubics, to fourth order.

    In each interval the cubic goes through the four nearest knots, or through all if there are fewer.

    Parameters
    ----------
    knots : (m,) ascending parameters [m].
    points : (m, 3) points of the curve there [m].
    s : (n,) requested parameters [m].

    Returns
    -------
    (n, 3) points of the curve at `s` [m].
    """
    return np.asarray(_on_curve(knots, np.ascontiguousarray(points), s))


@njit()
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


@njit()  # type: ignore[untyped-decorator, unused-ignore]
def resampled(
    u_knots: Floats, v_knots: Floats, points: Floats, i0: int, j0: int, u: Floats, v: Floats, beyond: float
) -> Floats:
    """Interpolate a net as `on_curve` does, along u and then along v.

    Parameters
    ----------
    u_knots, v_knots : (ku,), (kv,) ascending parameters of the lines [m].
    points : (ku, 3 kv) points of the net, row by row [m]; NaN where it is not known. Of each line the run of known
        points around the origin is used.
    i0, j0 : indices of the knots of the origin.
    u, v : (nu,), (nv,) requested parameters [m].
    beyond : the cubics are continued past the known points by this many steps of the knots.

    Returns
    -------
    (nu, nv, 3) points [m]; NaN further away from the known points.
    """
    ku, kv, nu, nv = len(u_knots), len(v_knots), len(u), len(v)
    between, result = np.empty((nu, 3 * kv)), np.empty((nu, nv, 3))
    most, (shares, windows) = min(4, ku), _windows(u_knots, u)
    for i in range(nu):
        k0 = windows[i]
        k1, k2, k3 = min(k0 + 1, ku - 1), min(k0 + 2, ku - 1), min(k0 + 3, ku - 1)  # of fewer knots the shares are 0
        s0, s1, s2, s3 = shares[i, 0], shares[i, 1], shares[i, 2], shares[i, 3]
        for c in range(3 * kv):
            between[i, c] = s0 * points[k0, c] + s1 * points[k1, c] + s2 * points[k2, c] + s3 * points[k3, c]
    for m in range(0, 3 * kv, 3):
        first, last = i0, i0
        while first > 0 and not np.isnan(points[first - 1, m]):
            first -= 1
        while last < ku - 1 and not np.isnan(points[last + 1, m]):
            last += 1
        near, (low, high), begin, end = min(4, last - first + 1), _reach(u_knots, first, last, beyond), 0, nu
        while begin < nu and (windows[begin] < first or u[begin] < low):
            begin += 1
        while end > begin and (windows[end - 1] + most - 1 > last or u[end - 1] > high):
            end -= 1
        for i in range(nu):
            if begin <= i < end:
                continue
            between[i, m] = between[i, m + 1] = between[i, m + 2] = np.nan
            if low <= u[i] <= high:
                window = min(max(windows[i], first), last + 1 - near)
                _weigh(u_knots, u[i], window, near, shares, nu)
                for c in range(m, m + 3):
                    between[i, c] = 0.0
                    for k in range(near):
                        between[i, c] += shares[nu, k] * points[window + k, c]
    most, (shares, windows) = min(4, kv), _windows(v_knots, v)
    for i in range(nu):
        first, last = j0, j0
        while first > 0 and not np.isnan(between[i, 3 * first - 3]):
            first -= 1
        while last < kv - 1 and not np.isnan(between[i, 3 * last + 3]):
            last += 1
        near, (low, high) = min(4, last - first + 1), _reach(v_knots, first, last, beyond)
        for j in range(nv):
            row, window, x, y, z = j, windows[j], 0.0, 0.0, 0.0
            if not low <= v[j] <= high:
                x = y = z = np.nan
            else:
                if window < first or window + most - 1 > last:
                    row, window = nv, min(max(window, first), last + 1 - near)
                    _weigh(v_knots, v[j], window, near, shares, nv)
                for k in range(near):
                    c = 3 * (window + k)
                    x += shares[row, k] * between[i, c]
                    y += shares[row, k] * between[i, c + 1]
                    z += shares[row, k] * between[i, c + 2]
            result[i, j, 0], result[i, j, 1], result[i, j, 2] = x, y, z
    return result


@njit()
def _windows(knots, s):  # type: ignore[no-untyped-def]
    """For each of `s` (n,) the first of the four nearest knots, and their weights (n + 1, 4); the last row is spare."""
    near, shares, windows = min(4, len(knots)), np.zeros((len(s) + 1, 4)), np.empty(len(s), dtype=np.int64)
    for n in range(len(s)):
        windows[n] = min(max(_right_of(knots, s[n]) - near // 2, 0), len(knots) - near)
        _weigh(knots, s[n], windows[n], near, shares, n)
    return shares, windows


@njit(error_model="numpy")
def _weigh(knots, at, window, near, shares, row):  # type: ignore[no-untyped-def]
    """The weights of `near` knots from the `window` on, for the cubic at `at`, in `shares[row]`."""
    for j in range(near):
        shares[row, j] = 1.0
        for k in range(near):
            if j != k:
                shares[row, j] *= (at - knots[window + k]) / (knots[window + j] - knots[window + k])


@njit()
def _reach(knots, first, last, beyond):  # type: ignore[no-untyped-def]
    """The range that ends `beyond` steps before the `first` and after the `last` knot."""
    return (
        knots[first] - beyond * (knots[min(first + 1, last)] - knots[first]),
        knots[last] + beyond * (knots[last] - knots[max(first, last - 1)]),
    )


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
    """Join polylines end to end into closed loops; those that stay open are left out.

    Parameters
    ----------
    strokes : polylines (n, 3) in any order and direction [m].

    Returns
    -------
    Loops (n, 3), the longest first; the first point is not repeated at the end.
    """
    loops = [line[:-1] for line in join_end_to_end(strokes) if len(line) > 3 and np.array_equal(line[0], line[-1])]
    return sorted(loops, key=lambda x: -float(np.linalg.norm(np.roll(x, -1, axis=0) - x, axis=1).sum()))


def join_end_to_end(strokes: Iterable[Floats]) -> list[Floats]:
    """Join polylines whose ends touch.

    Parameters
    ----------
    strokes : polylines (n, 3) in any order and direction [m].

    Returns
    -------
    Polylines (n, 3); a closed polyline ends with its first point.
    """
    left = list(strokes)
    if not left:
        return []
    tiny = TOUCH * float(np.ptp(np.vstack(left), axis=0).max())
    lines = list[Floats]()
    while left:
        chain, turned = left.pop(), 0
        while np.linalg.norm(chain[-1] - chain[0]) > tiny:
            near = [(k, flip) for k, s in enumerate(left) for flip in (False, True)
                    if np.linalg.norm((s[-1] if flip else s[0]) - chain[-1]) <= tiny]  # fmt: skip
            if near:
                k, flip = near[0]
                stroke = left.pop(k)
                chain = np.vstack([chain, (stroke[::-1] if flip else stroke)[1:]])
            elif turned:
                break
            else:
                chain, turned = chain[::-1], 1
        lines.append(np.vstack([chain[:-1], chain[:1]]) if np.linalg.norm(chain[-1] - chain[0]) <= tiny else chain)
    return lines
