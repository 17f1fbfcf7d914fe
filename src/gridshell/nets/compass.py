"""The compass net: an inextensible net marched over a surface from two crossing geodesics.

A net of inextensible rods is a Chebyshev net; two geodesics through the anchor determine it. Between the two
axes every new node P lies at one step from its neighbours A and B and on the surface: the compass rule,
second order in the step, with an error expansion in even powers when every interval is halved.
"""

from dataclasses import dataclass

import numba as nb
import numpy as np
from numpy.typing import NDArray

from gridshell.geometry.vectors import cross, dot, unit
from gridshell.targets import Target

Floats = NDArray[np.float64]

SMALLEST_SINE = 0.02  # of a crossing angle: beyond it the two circles of the compass hardly cut (1.1 degrees)
NEWTON_STEPS = 12
TOLERANCE = 1e-7  # of the step: Newton doubles its digits, so that the change that is below it leaves 1e-14


@dataclass(frozen=True)
class Net:
    """Nodes of a net on a surface.

    Parameters
    ----------
    u, v : (nu,), (nv,) ascending material coordinates of the net's lines, both containing 0 [m].
    points : (nu, nv, 3) positions [m]; NaN where the march could not go.
    """

    u: Floats
    v: Floats
    points: Floats

    @property
    def origin(self) -> tuple[int, int]:
        """Indices of the anchor, (u, v) = (0, 0)."""
        return int(np.argmin(np.abs(self.u))), int(np.argmin(np.abs(self.v)))


def march(target: Target, u: Floats, v: Floats, anchor: Floats, heading: Floats) -> Net:
    """March the net from its two axes.

    Parameters
    ----------
    u, v : ascending material coordinates of the lines, both containing 0 [m].
    anchor : (3,) point of the surface where the axes cross [m].
    heading : (3,) direction of the u axis there; its part in the tangent plane counts.
    """
    points = np.full((len(u), len(v), 3), np.nan)
    net = Net(u, v, points)
    lay_axes(target, net, anchor, heading)
    fill_quadrants(target, net)
    return net


def lay_axes(target: Target, net: Net, anchor: Floats, heading: Floats) -> None:
    """Two discrete geodesics through the anchor: equal chords, straightest at every node."""
    i0, j0 = net.origin
    net.points[i0, j0] = anchor
    steps = [np.diff(net.u[i0:]), np.diff(-net.u[i0::-1]), np.diff(net.v[j0:]), np.diff(-net.v[j0::-1])]
    arms = geodesics(target, np.tile(anchor, (4, 1)), axes(target, anchor, heading), steps)
    net.points[i0 + 1 :, j0], net.points[i0 - 1 :: -1, j0] = arms[0], arms[1] if i0 else arms[1][:0]
    net.points[i0, j0 + 1 :], net.points[i0, j0 - 1 :: -1] = arms[2], arms[3] if j0 else arms[3][:0]


def axes(target: Target, anchor: Floats, heading: Floats) -> Floats:
    """(4, 3) unit tangents at the anchor towards +u, -u, +v and -v; see `march`."""
    normal = target.on_surface(anchor[None]).normal[0]
    along = unit(heading - (heading @ normal) * normal)
    across = cross(normal, along)
    return np.stack([along, -along, across, -across])


def geodesics(target: Target, start: Floats, direction: Floats, steps: list[Floats]) -> list[Floats]:
    """Discrete geodesics, several at once, by given chord lengths; second order.

    The next chord lies in the plane of the last chord's direction and the surface normal at the node, so that
    the curve turns about nothing but the tangent plane.

    Parameters
    ----------
    start : (k, 3) points of the surface [m]; direction : (k, 3) unit tangents.
    steps : k arrays of chord lengths [m].

    Returns
    -------
    k arrays (len(steps), 3) of points; NaN from where a chord finds no surface.
    """
    count = len(steps)
    longest = max((len(s) for s in steps), default=0)
    chords = np.zeros((longest, count))
    for k, s in enumerate(steps):
        chords[: len(s), k] = s
    path = np.full((longest, count, 3), np.nan)
    point, tangent = start.copy(), direction.copy()
    for step in range(longest):
        going = np.flatnonzero((chords[step] > 0) & np.isfinite(point[:, 0]))
        if len(going) == 0:
            break
        here, h = point[going], chords[step, going]
        normal = unit(target.level(here)[1])
        flat = unit(tangent[going] - dot(tangent[going], normal)[:, None] * normal)
        turn, change = np.zeros(len(going)), np.full(len(going), np.inf)  # angle of the chord out of the tangent plane
        chord, swing = flat.copy(), normal.copy()
        for _ in range(NEWTON_STEPS):
            value, gradient = target.level(here + h[:, None] * chord)
            if not _turned(flat, normal, value, gradient, h, turn, change, chord, swing):
                break
        lost = ~(np.abs(turn) < 1.2) | ~(np.abs(change) < TOLERANCE)
        point[going] = here + h[:, None] * chord
        point[going[lost]] = np.nan
        tangent[going] = chord
        path[step, going] = point[going]
    return [path[: len(s), k] for k, s in enumerate(steps)]


@nb.njit(cache=True, error_model="numpy")
def _turned(flat, normal, value, gradient, h, turn, change, chord, swing):  # type: ignore[no-untyped-def]
    """One Newton step of all chords, in place; `swing` is the derivative of `chord` by `turn`. Whether to go on."""
    going = False
    for m in range(len(turn)):
        slope = 0.0
        for k in range(3):
            slope += gradient[m, k] * swing[m, k]
        change[m] = value[m] / (h[m] * slope)
        turn[m] -= change[m]
        cos, sin = np.cos(turn[m]), np.sin(turn[m])
        for k in range(3):
            chord[m, k] = cos * flat[m, k] + sin * normal[m, k]
            swing[m, k] = cos * normal[m, k] - sin * flat[m, k]
        if not abs(change[m]) < TOLERANCE:
            going = True
    return going


def fill_quadrants(target: Target, net: Net) -> None:
    """What is not known of all four quadrants: first all nodes whose neighbours are known, then what follows from them,
    one anti-diagonal at a time, since a node depends only on those of earlier ones."""
    tried = np.zeros(net.points.shape[:2], dtype=bool)
    found = _next_nodes(net.points, tried, net.u, net.v, *net.origin, 2, len(net.u) + len(net.v))
    diagonal = 2
    while len(found[1]):
        diagonal, i, j, *rest = found
        tried[i, j] = True
        net.points[i, j] = _compass(target, *rest)
        found = _next_nodes(net.points, tried, net.u, net.v, *net.origin, diagonal, 1)


@nb.njit(cache=True)
def _next_nodes(points, tried, u, v, i0, j0, diagonal, some):  # type: ignore[no-untyped-def]
    """Of the first anti-diagonals from `diagonal` on that have any, `some` at a time: the nodes that are unknown, not
    `tried`, and whose neighbours are known. Where to go on; their indices; the neighbours A towards the u axis, B
    towards the v axis, and D across; the two chords; and the side of the net's quadrant."""
    nu, nv = len(u), len(v)
    last, most = nu + nv - 2, nu * nv
    while True:
        stop = min(diagonal + some - 1, last)
        room = min(most, 4 * stop * (stop - diagonal + 1)) if stop >= diagonal else 0
        i, j, side = np.empty(room, dtype=np.intp), np.empty(room, dtype=np.intp), np.empty(room)
        a, b, d = np.empty((room, 3)), np.empty((room, 3)), np.empty((room, 3))
        from_a, from_b = np.empty(room), np.empty(room)
        count = 0
        for quadrant in range(4):
            i_side, j_side = 1 - 2 * (quadrant // 2), 1 - 2 * (quadrant % 2)
            rows, columns = (nu - 1 - i0 if i_side > 0 else i0), (nv - 1 - j0 if j_side > 0 else j0)
            for along in range(max(1, diagonal - columns), min(rows, stop - 1) + 1):
                for across in range(max(1, diagonal - along), min(columns, stop - along) + 1):
                    p, q = i0 + i_side * along, j0 + j_side * across
                    p_back, q_back = p - i_side, q - j_side
                    if tried[p, q] or np.isfinite(points[p, q, 0]):
                        continue
                    if not np.isfinite(points[p, q_back, 0] + points[p_back, q, 0] + points[p_back, q_back, 0]):
                        continue
                    i[count], j[count], side[count] = p, q, i_side * j_side
                    a[count], b[count], d[count] = points[p, q_back], points[p_back, q], points[p_back, q_back]
                    from_a[count], from_b[count] = abs(v[q] - v[q_back]), abs(u[p] - u[p_back])
                    count += 1
        if count or stop >= last:
            break
        diagonal = stop + 1
    return (
        diagonal, i[:count], j[:count], a[:count], b[:count], d[:count], from_a[:count], from_b[:count], side[:count]
    )  # fmt: skip


def _compass(target: Target, a: Floats, b: Floats, d: Floats, from_a: Floats, from_b: Floats, side: Floats) -> Floats:
    """Points P (n, 3) of the surface with |P - A| = from_a and |P - B| = from_b, across from D.

    NaN where there is none, or where the net folds: (P - B) x (P - A) no longer points along the normal.
    """
    p = a + b - d
    change = np.empty(len(p))
    for _ in range(NEWTON_STEPS):
        value, gradient = target.level(p)
        if not _towards(p, a, b, from_a, from_b, value, gradient, change):
            break
    sine = dot(cross(p - b, p - a), gradient) * side
    sine /= np.linalg.norm(gradient, axis=1) * from_a * from_b
    p[~(change < TOLERANCE) | ~(sine > SMALLEST_SINE)] = np.nan
    return p


@nb.njit(cache=True, error_model="numpy")
def _towards(p, a, b, from_a, from_b, value, gradient, change):  # type: ignore[no-untyped-def]
    """One Newton step of all points p (n, 3), in place; `change` (n,) its size over the chords. Whether to go on.

    The three equations |p - a|^2 = from_a^2, |p - b|^2 = from_b^2 and f(p) = 0 have the gradients pa, pb and g, whose
    inverse is made of their cross products. A point that runs away is not waited for.
    """
    going = False
    x, y, g, step = np.empty(3), np.empty(3), np.empty(3), np.empty(3)
    for m in range(len(p)):
        ra, rb = -from_a[m] * from_a[m], -from_b[m] * from_b[m]
        for k in range(3):
            x[k], y[k], g[k] = p[m, k] - a[m, k], p[m, k] - b[m, k], gradient[m, k]
            ra += x[k] * x[k]
            rb += y[k] * y[k]
        volume = 0.0
        for k in range(3):
            i, j = (k + 1) % 3, (k + 2) % 3
            normal = x[i] * y[j] - x[j] * y[i]
            volume += normal * g[k]
            step[k] = (
                0.5 * ra * (y[i] * g[j] - y[j] * g[i]) + 0.5 * rb * (g[i] * x[j] - g[j] * x[i]) + value[m] * normal
            )
        largest = 0.0
        for k in range(3):
            p[m, k] -= step[k] / volume
            largest = max(largest, abs(step[k] / volume)) if volume != 0.0 else np.nan
        change[m] = largest / min(from_a[m], from_b[m])
        if TOLERANCE <= change[m] < 1.0:
            going = True
    return going
