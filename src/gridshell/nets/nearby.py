"""A net near one that is known: all its nodes are found together.

The march asks the target for a few points at a time, from node to node. Where a net is known nearby, from a coarser
march or from a form found before, the target is asked once for all nodes, and the march is repeated on its local
models there. That is Newton's method for the whole net, whose matrix is triangular in the order of the march: two or
three rounds, whatever the number of nodes. The equations are those of `compass`, and so is the net.
"""

import numba as nb
import numpy as np
from numpy.typing import NDArray

from gridshell.geometry.curves import cubic_windows
from gridshell.nets.compass import NEWTON_STEPS, SMALLEST_SINE, Net, axes, fill_quadrants, lay_axes
from gridshell.targets import Target

Floats = NDArray[np.float64]

ROUNDS = 6
SETTLED = 5e-5  # of the target's size: what a round moves; the error left is its third power
EXACT = 1e-13  # of the step, on a local model
CLEARLY = 1.5  # times the square of the step: what two nets in steps nearer to each other differ by tells little
BEYOND = 0.1  # of the known net's extent that a guess may lie outside it


def march_near(
    target: Target, u: Floats, v: Floats, anchor: Floats, heading: Floats, near: Net, coarser: Net | None = None
) -> Net:
    """As `march`, from a guess taken out of a net `near`; any guess is safe, a bad one is only of no use.

    coarser : the same net as `near` in longer steps: what the two differ by tells by how much this one will.
    """
    net = Net(u, v, interpolated(near, u, v))
    if coarser is not None:
        change = net.points - interpolated(coarser, u, v)
        own, once, twice = (
            float(np.median(np.diff(one.u)) * np.median(np.diff(one.v))) for one in (net, near, coarser)
        )
        if twice > CLEARLY * once:  # errors go with the square of the step
            net.points[:] += np.where(np.isfinite(change), (once - own) / (twice - once) * change, 0.0)
    if not _settle_axes(target, net, anchor, heading):
        lay_axes(target, net, anchor, heading)
    _settle(target, net)
    fill_quadrants(target, net)
    return net


def interpolated(net: Net, u: Floats, v: Floats) -> Floats:
    """(nu, nv, 3) points of a net at other coordinates, by local cubics both ways; NaN where it has none."""
    (rows, along), (columns, across) = (cubic_windows(k, s, BEYOND) for k, s in ((net.u, u), (net.v, v)))
    return np.asarray(_interpolate(net.points, rows, along, columns, across))


@nb.njit(cache=True)
def _interpolate(points, rows, along, columns, across):  # type: ignore[no-untyped-def]
    line, result = np.empty(3 * points.shape[1]), np.empty((len(rows), 3 * len(columns)))
    for i in range(len(rows)):
        line[:] = 0.0
        for k in range(rows.shape[1]):
            share, row = along[i, k], points[rows[i, k]].reshape(-1)
            for m in range(len(line)):
                line[m] += share * row[m]
        for j in range(len(columns)):
            x, y, z = 0.0, 0.0, 0.0
            for k in range(columns.shape[1]):
                share, c = across[j, k], 3 * columns[j, k]
                x, y, z = x + share * line[c], y + share * line[c + 1], z + share * line[c + 2]
            result[i, 3 * j], result[i, 3 * j + 1], result[i, 3 * j + 2] = x, y, z
    return result.reshape(len(rows), len(columns), 3)


def _settle_axes(target: Target, net: Net, anchor: Floats, heading: Floats) -> bool:
    """Move the guess of the axes to the two geodesics through the anchor; whether they were found."""
    i0, j0 = net.origin
    along, back, across, aback = axes(target, anchor, heading)
    normal = np.cross(along, across)
    net.points[i0, j0] = anchor
    arms = (
        (net.points[i0 + 1 :, j0], np.diff(net.u[i0:]), along),
        (net.points[:i0, j0][::-1], np.diff(-net.u[i0::-1]), back),
        (net.points[i0, j0 + 1 :], np.diff(net.v[j0:]), across),
        (net.points[i0, :j0][::-1], np.diff(-net.v[j0::-1]), aback),
    )
    points = np.concatenate([arm for arm, _, _ in arms])
    steps = np.concatenate([step for _, step, _ in arms])
    stops = np.cumsum([0, *(len(arm) for arm, _, _ in arms)])
    moved = np.inf if np.isfinite(points).all() else np.nan
    for _ in range(ROUNDS):
        if not moved >= SETTLED * target.size:
            break
        model = target.implicit(points)
        moved = 0.0
        for k, (_, _, direction) in enumerate(arms):
            here = slice(stops[k], stops[k + 1])
            moved += _geodesic(anchor, direction, normal, steps[here], points[here], *(part[here] for part in model))
    for k, (arm, _, _) in enumerate(arms):
        arm[:] = points[stops[k] : stops[k + 1]]
    return bool(moved < SETTLED * target.size)


@nb.njit(cache=True, error_model="numpy")
def _geodesic(start, direction, normal, steps, points, value, gradient, hessian):  # type: ignore[no-untyped-def]
    """One arm of `compass.geodesics` on second order models at `points`, which move; by how much, or NaN."""
    point, tangent, normal, moved = start.copy(), direction.copy(), normal.copy(), 0.0
    flat, chord, swing, away, slope = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for s in range(len(steps)):
        h = steps[s]
        out = tangent[0] * normal[0] + tangent[1] * normal[1] + tangent[2] * normal[2]
        for k in range(3):
            flat[k] = tangent[k] - out * normal[k]
        flat /= np.sqrt(flat[0] ** 2 + flat[1] ** 2 + flat[2] ** 2)
        turn, change = 0.0, np.inf
        for _ in range(NEWTON_STEPS):
            cos, sin = np.cos(turn), np.sin(turn)
            for k in range(3):
                chord[k] = cos * flat[k] + sin * normal[k]
                swing[k] = cos * normal[k] - sin * flat[k]
                away[k] = point[k] + h * chord[k] - points[s, k]
            level, rate = value[s], 0.0
            for k in range(3):
                bent = hessian[s, k, 0] * away[0] + hessian[s, k, 1] * away[1] + hessian[s, k, 2] * away[2]
                level += (gradient[s, k] + 0.5 * bent) * away[k]
                slope[k] = gradient[s, k] + bent
                rate += slope[k] * swing[k]
            change = level / (h * rate)
            if not abs(change) >= EXACT:
                break
            turn -= change
        if not (abs(turn) < 1.2 and abs(change) < 1e-9):
            return np.nan
        for k in range(3):
            moved = max(moved, abs(away[k]))
            points[s, k] = point[k] = point[k] + h * chord[k]
            tangent[k] = chord[k]
        normal = slope / np.sqrt(slope[0] ** 2 + slope[1] ** 2 + slope[2] ** 2)
    return moved


def _settle(target: Target, net: Net) -> None:
    """Move the guess of all nodes but those of the axes to the net; what does not settle is left NaN.

    A round asks the target only where the last one moved a node: elsewhere its model is still good.
    """
    (i0, j0), shape = net.origin, net.points.shape[:2]
    models, flat = net.points.copy(), net.points.reshape(-1, 3)
    known = np.flatnonzero(np.isfinite(flat[:, 0]))
    row = np.full(len(flat), -1)
    row[known] = np.arange(len(known))
    value, gradient, hessian = target.implicit(flat[known])
    moved, new = np.zeros(shape), np.ones(shape, dtype=bool)
    for _ in range(ROUNDS):
        _sweep(net.points, models, row.reshape(shape), value, gradient, hessian, net.u, net.v, i0, j0, new, moved)
        new = moved >= SETTLED * target.size
        if not new.any():
            return
        models[new], rows = net.points[new], row[new.ravel()]
        value[rows], gradient[rows], hessian[rows] = target.implicit(models[new])
    _forget(net.points, moved >= SETTLED * target.size, i0, j0)


@nb.njit(cache=True, error_model="numpy")
def _sweep(points, models, row, value, gradient, hessian, u, v, i0, j0, new, moved):  # type: ignore[no-untyped-def]
    """One march of the `points` (nu, nv, 3) on second order models at `models` (nu, nv, 3), whose values, gradients and
    Hessians are in the rows `row` (nu, nv), -1 where there is none; from them the points then lie away by `moved`
    (nu, nv). Nodes whose models and neighbours are not `new` (nu, nv) stay.

    As `compass`: the three equations are |p - a| = from_a, |p - b| = from_b and f(p) = 0.
    """
    p, x, y, cross, step = np.empty(3), np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    away, g = np.empty(3), np.empty(3)
    for quadrant in range(4):
        i_side, j_side = 1 - 2 * (quadrant // 2), 1 - 2 * (quadrant % 2)
        i_stop, j_stop = (len(u) if i_side > 0 else -1), (len(v) if j_side > 0 else -1)
        for i in range(i0 + i_side, i_stop, i_side):
            from_b = abs(u[i] - u[i - i_side])
            for j in range(j0 + j_side, j_stop, j_side):
                new[i, j] |= new[i, j - j_side] | new[i - i_side, j] | new[i - i_side, j - j_side]
                if not new[i, j]:
                    continue
                r = row[i, j]
                if r < 0:
                    moved[i, j] = np.nan
                    continue
                from_a = abs(v[j] - v[j - j_side])
                a, b, d = points[i, j - j_side], points[i - i_side, j], points[i - i_side, j - j_side]
                slope, bend, here = gradient[r], hessian[r], models[i, j]
                for k in range(3):  # as far from its model as its neighbours are from theirs
                    p[k] = here[k] + (a[k] - models[i, j - j_side, k]) + (b[k] - models[i - i_side, j, k])
                    p[k] -= d[k] - models[i - i_side, j - j_side, k]
                change, tries = np.inf, 0
                while change > 1e-10 and tries < NEWTON_STEPS:
                    ra, rb, level, volume = -from_a * from_a, -from_b * from_b, value[r], 0.0
                    for k in range(3):
                        away[k], x[k], y[k] = p[k] - here[k], p[k] - a[k], p[k] - b[k]
                        ra += x[k] * x[k]
                        rb += y[k] * y[k]
                    for k in range(3):
                        bent = bend[k, 0] * away[0] + bend[k, 1] * away[1] + bend[k, 2] * away[2]
                        level += (slope[k] + 0.5 * bent) * away[k]
                        g[k] = slope[k] + bent
                    for k in range(3):
                        m, n = (k + 1) % 3, (k + 2) % 3
                        cross[k] = x[m] * y[n] - x[n] * y[m]
                        volume += cross[k] * g[k]
                        step[k] = 0.5 * ra * (y[m] * g[n] - y[n] * g[m]) + 0.5 * rb * (g[m] * x[n] - g[n] * x[m])
                        step[k] += level * cross[k]
                    change = 0.0
                    for k in range(3):
                        p[k] -= step[k] / volume
                        change = max(change, abs(step[k] / volume))
                    change /= min(from_a, from_b)
                    tries += 1
                # (p - b) x (p - a) along the normal, or the net folds
                sine = -volume * i_side * j_side / (np.sqrt(g[0] ** 2 + g[1] ** 2 + g[2] ** 2) * from_a * from_b)
                found = change < 1e-8 and sine > SMALLEST_SINE
                moved[i, j] = np.nan
                for k in range(3):
                    if found:
                        moved[i, j] = max(abs(p[k] - here[k]), moved[i, j] if k else 0.0)
                    points[i, j, k] = p[k] if found else np.nan


def _forget(points: Floats, unsettled: NDArray[np.bool_], i0: int, j0: int) -> None:
    """NaN for every node that has not settled, and for all that hang on it: those beyond it in its quadrant."""
    for rows in (slice(i0, None), slice(i0, None, -1)):
        for columns in (slice(j0, None), slice(j0, None, -1)):
            lost = np.logical_or.accumulate(unsettled[rows, columns], axis=0)
            points[rows, columns][np.logical_or.accumulate(lost, axis=1)] = np.nan
