"""The net's slow twin: the same footprint from the Goursat problem of the net, without compass and chords.

On F = 0 rods without stretch that meet in joints turn about the tangent plane only: X_uv is normal to the
surface, and F_uv = 0 gives it its length,

    X_uv = -(X_u . F'' X_v) / |F'|^2  F',      X(u, 0) and X(0, v) geodesics: X_ss = -(X_s . F'' X_s) / |F'|^2 F'.

Nothing here measures a chord or puts a point on the surface. What it asks of a target: implicit, margin, lift.
"""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import BarycentricInterpolator
from scipy.optimize import brentq

from rodshell.targets import Target

Floats = NDArray[np.float64]

QUADRANTS = ((1, 1), (1, -1), (-1, 1), (-1, -1))
REFINE = (1, 2, 3)
WINDOW = 8  # nodes of the polynomial in which an end is found


class TwinEnds(NamedTuple):
    """Starts and ends (m, 2) of the rods of both families [m], and by how much the last extrapolation moved them."""

    u: Floats
    v: Floats
    doubt: float


def goursat_ends(
    target: Target,
    u_offsets: Floats,
    v_offsets: Floats,
    *,
    step: float,
    reach: float,
    anchor: tuple[float, float] = (0.0, 0.0),
    rotate: float = 0.0,
) -> TwinEnds:
    """Ends of the rods of family u at `u_offsets` and of family v at `v_offsets`, all multiples of `step` [m].

    Marched at `step` / 1, 2 and 3 up to `reach` [m] from the anchor; the errors of second and fourth order are
    taken out.
    """
    count = round(reach / step)
    axes = [_geodesic(target, *start, count * step) for start in _axes(target, anchor, rotate)]
    marches = []
    for refine in REFINE:
        h = step / refine
        arms = np.stack([axis(h * np.arange(refine * count + 1)) for axis in axes])
        margins = _margins(target, _march(target, arms, h))
        lines = [*margins.T[_rows(u_offsets, h, refine * count)], *margins[_rows(v_offsets, h, refine * count)]]
        marches.append(np.array([_ends(line, h) for line in lines]))
    rough = _extrapolate(marches[1:], REFINE[1:])
    best = _extrapolate(marches, REFINE)
    return TwinEnds(best[: len(u_offsets)], best[len(u_offsets) :], float(np.abs(best - rough).max()))


def _axes(target: Target, anchor: tuple[float, float], rotate: float) -> list[tuple[Floats, Floats]]:
    """Start and direction of the four arms +u, -u, +v, -v: seen from above, u points along the heading."""
    start = target.lift(np.array([anchor]))[0]
    gradient = target.implicit(start[None]).gradient[0]
    heading = np.array([np.cos(rotate), np.sin(rotate)])
    along = np.array([*heading, -(gradient[:2] @ heading) / gradient[2]])
    across = np.cross(gradient, along)
    along, across = along / np.linalg.norm(along), across / np.linalg.norm(across)
    return [(start, along), (start, -along), (start, across), (start, -across)]


def _geodesic(target: Target, start: Floats, direction: Floats, length: float):
    def turn(_: float, y: Floats) -> Floats:
        _, gradient, hessian = (a[0] for a in target.implicit(y[None, :3]))
        return np.concatenate([y[3:], -(y[3:] @ hessian @ y[3:]) / (gradient @ gradient) * gradient])

    path = solve_ivp(
        turn, (0.0, length), np.concatenate([start, direction]), method="DOP853", rtol=1e-11, atol=1e-13,
        dense_output=True,
    )  # fmt: skip
    assert path.success
    return lambda s: path.sol(s)[:3].T


def _march(target: Target, arms: Floats, h: float) -> Floats:
    """Points (4, n, n, 3) of the four quadrants; `arms` (4, n, 3). Each counts u and v away from the anchor."""
    n = arms.shape[1]
    x = np.empty((4, n, n, 3))
    for q, (u, v) in enumerate(QUADRANTS):
        x[q, :, 0] = arms[0 if u > 0 else 1]
        x[q, 0, :] = arms[2 if v > 0 else 3]
    for diagonal in range(2, 2 * n - 1):
        i = np.arange(max(1, diagonal - n + 1), min(n, diagonal))
        j = diagonal - i
        corner, a, b = x[:, i - 1, j - 1], x[:, i, j - 1], x[:, i - 1, j]
        gradient, hessian = (f.reshape(4, len(i), *f.shape[1:]) for f in _derivatives(target, 0.5 * (a + b)))
        # at the cell's middle X_u = (a - corner) / h + h X_uv / 2; X_uv = -k F' is found by iteration
        k = np.zeros((4, len(i), 1))
        square = np.einsum("qni,qni->qn", gradient, gradient)
        for _ in range(6):  # each time better by h over the radius of curvature, and of second order at once
            xu, xv = (a - corner) / h - 0.5 * h * k * gradient, (b - corner) / h - 0.5 * h * k * gradient
            k = (np.einsum("qni,qnij,qnj->qn", xu, hessian, xv) / square)[..., None]
        x[:, i, j] = a + b - corner - h**2 * k * gradient
    return x


def _derivatives(target: Target, x: Floats) -> tuple[Floats, Floats]:
    _, gradient, hessian = target.implicit(x.reshape(-1, 3))
    return gradient, hessian


def _margins(target: Target, x: Floats) -> Floats:
    """The target's margin over the whole plane (2n - 1, 2n - 1), the anchor in its middle."""
    n = x.shape[1]
    inside = target.margin(x.reshape(-1, 3)).reshape(4, n, n)
    whole = np.empty((2 * n - 1, 2 * n - 1))
    for q, (u, v) in enumerate(QUADRANTS):
        whole[n - 1 :: u, n - 1 :: v] = inside[q]
    return whole


def _rows(offsets: Floats, h: float, middle: int) -> NDArray[np.intp]:
    rows = np.rint(offsets / h)
    np.testing.assert_allclose(rows * h, offsets, atol=1e-9 * h, err_msg="offsets must be multiples of the step")
    return middle + rows.astype(np.intp)


def _ends(margin: Floats, h: float) -> tuple[float, float]:
    """Where the longest run of positive margins along a line begins and ends."""
    sign = np.concatenate([[False], margin > 0, [False]])
    first, last = np.flatnonzero(sign[1:] > sign[:-1]), np.flatnonzero(sign[1:] < sign[:-1]) - 1
    longest = int(np.argmax(last - first))
    assert first[longest] > 0
    assert last[longest] < len(margin) - 1
    middle = (len(margin) - 1) / 2
    return tuple(h * (_zero(margin, k) - middle) for k in (first[longest] - 1, last[longest]))


def _zero(margin: Floats, before: int) -> float:
    """The zero between two nodes of the polynomial through the nearest, in steps."""
    first = int(np.clip(before + 1 - WINDOW // 2, 0, len(margin) - WINDOW))
    nodes = np.arange(first, first + WINDOW)
    polynomial = BarycentricInterpolator(nodes - before, margin[nodes])
    return before + brentq(lambda t: float(polynomial(t)), 0.0, 1.0, xtol=1e-14)


def _extrapolate(values: list[Floats], refine: tuple[int, ...]) -> Floats:
    """The value at step 0 of the polynomial in h^2 through the values at h = 1 / refine."""
    h = np.array([1.0 / r**2 for r in refine])
    weights = [np.prod([other / (other - mine) for other in h if other != mine]) for mine in h]
    return sum(weight * value for weight, value in zip(weights, values, strict=True))
