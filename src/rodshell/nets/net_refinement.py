"""A net from one that is similar: Newton's method for all nodes at once.

The march evaluates the target at a few points at a time, from node to node. Where a similar net is known, from a
coarser march or from an earlier form, the target is evaluated once at all nodes, and the march is repeated on its local
models there. That is Newton's method for the whole net, whose matrix is triangular in the order of the march: two or
three rounds, whatever the number of nodes. The equations, and so the net, are those of `compass`.
"""

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.geometry.curves import resampled
from rodshell.geometry.frames import unit
from rodshell.kernels import njit
from rodshell.nets.compass import (
    NEWTON_STEPS,
    ON_SURFACE,
    SMALLEST_SINE,
    Axes,
    Heights,
    Net,
    NetLayer,
    arms,
    dot,
    fill_quadrants,
    inverse_of,
    lay_axes,
    layered_step,
    less,
    past,
    sine_of,
    solution,
)
from rodshell.targets import Implicit, Target

ROUNDS = 6
CONVERGED = 2e-5  # of the size, and of a step on local models: the last motion, of which the third power is left
EXACT = 1e-13  # of the step, on a local model
_CLEARLY = 1.5  # ratio of the squares of the steps of two nets, above which their difference can be extrapolated
BEYOND = 2.5  # steps of the known net by which a guess may be outside it


def march_near(
    target: Target,
    u: Floats,
    v: Floats,
    start: Axes,
    near: Net,
    *,
    coarser: Net | None = None,
    wanted: Bools | None = None,
    heights: Heights = ON_SURFACE,
    converged: float = CONVERGED,
) -> Net:
    """March a net from its two axes, starting from a similar net; a bad guess costs time, not accuracy.

    Args:
        u, v, heights: see `Net`.
        coarser: the same net as `near` in longer steps, from which the start is extrapolated.
        wanted: (nu, nv) nodes to find in addition to the axes, with all between them and the axes; others stay NaN.
        converged: the last motion of nodes, relative to the target's size; the error that is left is its third power.
    """
    guess = near if coarser is None else _extrapolated(near, coarser, u, v)
    net = Net(u, v, interpolated(guess, u, v), heights=heights)
    tolerance = converged**1.5  # of Newton's method, which leaves its square
    if not _refine_axes(target, net, start, converged):
        lay_axes(target, net, start, tolerance=tolerance)
    if not _refine(target, net, np.ones(net.points.shape[:2], dtype=bool) if wanted is None else wanted, converged):
        fill_quadrants(target, net, wanted, tolerance=tolerance)
    return net


def _extrapolated(near: Net, coarser: Net, u: Floats, v: Floats) -> Net:
    """Extrapolate the nodes of `near` to the steps of the lines u and v: errors are of second order in the step."""
    requested, fine, coarse = (  # squares of the steps
        (along[-1] - along[0]) * (across[-1] - across[0]) / ((len(along) - 1) * (len(across) - 1))
        for along, across in ((u, v), (near.u, near.v), (coarser.u, coarser.v))
    )
    if coarse <= _CLEARLY * fine:
        return near
    points = interpolated(coarser, near.u, near.v)
    share = (fine - requested) / (coarse - fine)
    return Net(near.u, near.v, near.points + share * np.nan_to_num(near.points - points))


def interpolated(net: Net, u: Floats, v: Floats) -> Floats:
    """Points (nu, nv, 3) [m] of a net at the material coordinates `u` (nu,), `v` (nv,) [m], by local cubics both ways,
    which also extrapolate a little past its last nodes; NaN further away."""
    i0, j0 = net.origin
    return np.asarray(resampled(net.v, resampled(net.u, net.points, i0, u, BEYOND), j0, v, BEYOND))


def _refine_axes(target: Target, net: Net, start: Axes, converged: float) -> bool:
    """Move the guess of the axes to the two geodesics through the anchor; return whether this converged."""
    starts = np.repeat(start.anchor[None], 4, axis=0)
    net.points[net.origin] = start.anchor
    rows, columns, steps, stops = arms(net)
    points = net.points[rows, columns]
    if not np.isfinite(points).all():
        return False
    layers = list[tuple[NetLayer, slice]]()
    if net.heights != ON_SURFACE:  # each axis on its own
        parts = slice(0, stops[2]), slice(stops[2], stops[4])
        layers = [(NetLayer(target, height), part) for height, part in zip(net.heights, parts, strict=True)]
        starts = np.concatenate([np.repeat(layer.of(start.anchor[None]), 2, axis=0) for layer, _ in layers])
        points = np.concatenate([layer.of(points[part]) for layer, part in layers])
    moved, limit = np.inf, converged * target.size
    for _ in range(ROUNDS):
        if layers:
            models = [layer.implicit(points[part]) for layer, part in layers]
            model = Implicit(*(np.concatenate(values) for values in zip(*models, strict=True)))
        else:
            model = target.implicit(points)
        moved = _straighten(starts, start.tangents, steps, stops, points, *model)
        if not moved >= limit:
            break
    if not moved < limit:
        return False
    if layers:
        points = np.concatenate([layer.below(points[part]) for layer, part in layers])
    net.points[rows, columns] = points
    return True


@njit("f2 f2 f1 i1 f2 f1 f2 f3")
def _straighten(starts, directions, steps, stops, points, value, gradient, hessian):  # type: ignore[no-untyped-def]
    """Move the `points` (n, 3) of the arms to the geodesics that begin at `starts` (4, 3) in `directions` (4, 3), see
    `compass.geodesics`, on second order models at the points; return by how much, or NaN."""
    moved = 0.0
    point, tangent, normal, slope = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    flat, chord, swing, away = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for arm in range(4):
        for k in range(3):
            m, p = (k + 1) % 3, (k + 2) % 3
            point[k], tangent[k] = starts[arm, k], directions[arm, k]
            normal[k] = directions[0, m] * directions[2, p] - directions[0, p] * directions[2, m]
        turn = 0.0  # of the last chord out of the tangent plane, the first guess of the next one's
        for s in range(stops[arm], stops[arm + 1]):
            h, square = steps[s], 0.0
            out = tangent[0] * normal[0] + tangent[1] * normal[1] + tangent[2] * normal[2]
            for k in range(3):
                flat[k] = tangent[k] - out * normal[k]
                square += flat[k] * flat[k]
            for k in range(3):
                flat[k] /= np.sqrt(square)
            change = np.inf
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
            steep = np.sqrt(slope[0] ** 2 + slope[1] ** 2 + slope[2] ** 2)
            for k in range(3):
                moved = max(moved, abs(away[k]))
                points[s, k] = point[k] = point[k] + h * chord[k]
                tangent[k], normal[k] = chord[k], slope[k] / steep
    return moved


def _refine(target: Target, net: Net, wanted: Bools, converged: float) -> bool:
    """Move the guess of all `wanted` (nu, nv) nodes but those of the axes to the net; NaN for nodes that do not
    converge. Return whether all did.

    A round evaluates the target only where the last one moved a node: elsewhere its model is still good.
    """
    i0, j0 = net.origin
    row, moved, new = np.full(wanted.shape, -1), np.zeros(wanted.shape), np.ones(wanted.shape, dtype=bool)
    asked = wanted.copy()
    asked[i0], asked[:, j0] = True, True
    known = asked & np.isfinite(net.points[..., 0])
    models, whole = net.points[known], bool(known.sum() == asked.sum())
    row[known], net.points[~known] = np.arange(len(models)), np.nan
    value, gradient, hessian = target.implicit(models)
    layered, limit = net.heights != ON_SURFACE, converged * target.size
    tolerance = converged**1.5 if layered else converged
    normals = np.zeros_like(net.points) if layered else np.empty((0, 0, 3))
    if layered:
        normals[row >= 0] = unit(gradient[row[row >= 0]])  # exact on the axes, which stay; others follow in order
    for _ in range(ROUNDS):
        furthest, found = _sweep(
            net.points, models, row, value, gradient, hessian, net.u, net.v, i0, j0, net.heights, normals, new, moved,
            tolerance,
        )  # fmt: skip
        whole &= found
        if furthest < limit:
            return bool(whole)
        new[:] = moved >= limit
        rows = row[new]
        models[rows] = net.points[new]
        now = target.implicit(models[rows])
        if not layered and np.abs(now.value).max() <= converged**3 * target.size:
            return bool(whole)  # models with F = 0 there were exact, as those of quadrics are
        value[rows], gradient[rows], hessian[rows] = now
    _forget(net.points, moved >= limit, i0, j0)
    return False


@njit("f3 f2 i2 f1 f2 f3 f1 f1 i i ff f3 b2 f2 f")
def _sweep(  # type: ignore[no-untyped-def]
    points, models, row, value, gradient, hessian, u, v, i0, j0, heights, normals, new, moved, tolerance
):
    """March the `points` (nu, nv, 3) on second order models at `models` (n, 3); `row` (nu, nv) is the model of each, -1
    where there is none, and `moved` (nu, nv) returns the distance from it. Nodes whose models and neighbours are not
    `new` (nu, nv) do not move. `tolerance` : of the last change of a node, relative to its step. Returns the largest
    distance, and whether no node was lost.

    `normals` (nu, nv, 3) of the surface at the points are updated if rods are at `heights` above it; empty otherwise.
    """
    layered, furthest, whole = len(normals) > 0, 0.0, True
    for i_side in (1, -1):
        for i in range(i0 + i_side, len(u) if i_side > 0 else -1, i_side):
            p = i - i_side
            for k in range(2 * max(j0, len(v) - 1 - j0)):
                j_side = 1 - 2 * (k % 2)
                j = j0 + j_side * (k // 2 + 1)
                if not 0 <= j < len(v):
                    continue
                q = j - j_side
                new[i, j] |= new[i, q] | new[p, j] | new[p, q]
                if not new[i, j]:
                    continue
                moved[i, j], r = np.nan, row[i, j]
                if r < 0:
                    continue
                if min(row[i, q], row[p, j], row[p, q]) < 0:
                    whole = False
                    points[i, j, 0] = points[i, j, 1] = points[i, j, 2] = np.nan
                    continue
                a, b, d = _at(points, i, q), _at(points, p, j), _at(points, p, q)
                here = _of(models, r)
                away = less(d, _of(models, row[p, q]))  # guess: as far from its model as its neighbours are from theirs
                away = less(_plus(less(a, _of(models, row[i, q])), less(b, _of(models, row[p, j]))), away)
                from_a, from_b = abs(v[j] - v[q]), abs(u[i] - u[p])
                if layered:
                    a, b = _raised(a, heights[1], normals, i, q), _raised(b, heights[0], normals, p, j)
                step_size, change, volume, tries = min(from_a, from_b), np.inf, 0.0, 0
                slope = (0.0, 0.0, 0.0)
                while change > tolerance * step_size and tries < NEWTON_STEPS:
                    now = _plus(here, away)
                    level, slope = _model(r, away, value, gradient, hessian)
                    if layered:
                        step, volume = layered_step(now, a, b, slope, hessian[r], heights, from_a, from_b, level)
                    else:
                        step, volume = _quadratic_step(
                            less(now, a), less(now, b), slope, r, hessian, from_a, from_b, level
                        )
                    away = less(away, step)
                    change = max(abs(step[0]), abs(step[1]), abs(step[2]))
                    tries += 1
                sine = i_side * j_side * sine_of(volume, slope, from_a, from_b)
                if change <= tolerance * step_size and sine > SMALLEST_SINE:
                    moved[i, j] = max(abs(away[0]), abs(away[1]), abs(away[2]))
                    furthest = max(furthest, moved[i, j])
                    points[i, j, 0], points[i, j, 1], points[i, j, 2] = _plus(here, away)
                    if layered:
                        _, g = _model(r, away, value, gradient, hessian)
                        steep = np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
                        for k in range(3):
                            normals[i, j, k] = g[k] / steep
                else:
                    whole = False
                    points[i, j, 0] = points[i, j, 1] = points[i, j, 2] = np.nan
    return furthest, whole


@njit(error_model="numpy", inline="always")
def _quadratic_step(x, y, slope, r, hessian, from_a, from_b, level):  # type: ignore[no-untyped-def]
    """As `compass_step`, of third order (Chebyshev's method): on a second order model all three equations are
    quadratic, so that what a step leaves of them is known: half its square, twice, and half its product with F''."""
    inverse = inverse_of(x, y, slope)
    step = solution(inverse, past(x, from_a), past(y, from_b), level)
    square = 0.5 * dot(step, step)
    more = solution(inverse, square, square, 0.5 * dot(step, _bent(r, step, hessian)))
    return _plus(step, more), inverse[3]


@njit()
def _bent(r, away, hessian):  # type: ignore[no-untyped-def]
    """The product of the Hessian r with the vector `away`."""
    x, y, z = away
    return (
        hessian[r, 0, 0] * x + hessian[r, 0, 1] * y + hessian[r, 0, 2] * z,
        hessian[r, 1, 0] * x + hessian[r, 1, 1] * y + hessian[r, 1, 2] * z,
        hessian[r, 2, 0] * x + hessian[r, 2, 1] * y + hessian[r, 2, 2] * z,
    )


@njit()
def _model(r, away, value, gradient, hessian):  # type: ignore[no-untyped-def]
    """Value and gradient of the second order model r, at a distance `away` from its point."""
    x, y, z = away
    bx, by, bz = _bent(r, away, hessian)
    gx, gy, gz = gradient[r, 0], gradient[r, 1], gradient[r, 2]
    level = value[r] + (gx + 0.5 * bx) * x + (gy + 0.5 * by) * y + (gz + 0.5 * bz) * z
    return level, (gx + bx, gy + by, gz + bz)


@njit()
def _raised(point, height, normals, i, j):  # type: ignore[no-untyped-def]
    return (
        point[0] + height * normals[i, j, 0],
        point[1] + height * normals[i, j, 1],
        point[2] + height * normals[i, j, 2],
    )


@njit()
def _at(points, i, j):  # type: ignore[no-untyped-def]
    return points[i, j, 0], points[i, j, 1], points[i, j, 2]


@njit()
def _of(models, row):  # type: ignore[no-untyped-def]
    return models[row, 0], models[row, 1], models[row, 2]


@njit()
def _plus(a, b):  # type: ignore[no-untyped-def]
    return a[0] + b[0], a[1] + b[1], a[2] + b[2]


def _forget(points: Floats, unconverged: Bools, i0: int, j0: int) -> None:
    """NaN for every node that did not converge, and for all that depend on it: those beyond it in its quadrant."""
    for rows in (slice(i0, None), slice(i0, None, -1)):
        for columns in (slice(j0, None), slice(j0, None, -1)):
            lost = np.logical_or.accumulate(unconverged[rows, columns], axis=0)
            points[rows, columns][np.logical_or.accumulate(lost, axis=1)] = np.nan
