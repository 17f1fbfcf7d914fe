"""The compass net: an inextensible net marched over a surface from two crossing geodesics.

A net of inextensible rods is a Chebyshev net; two geodesics through the anchor determine it. Between the two
axes every new node P lies at one step from its neighbours A and B and on the surface: the compass rule,
second order in the step, with an error expansion in even powers when every interval is halved.
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from gridshell.geometry.vectors import cross, dot
from gridshell.targets import Target

Floats = NDArray[np.float64]

SMALLEST_SINE = 0.02  # of a crossing angle: beyond it the two circles of the compass hardly cut (1.1 degrees)
NEWTON_STEPS = 12
TOLERANCE = 1e-13  # of the step; Newton doubles its digits, so one step more than 1e-8 needs


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
    _lay_axes(target, net, anchor, heading)
    _fill_quadrants(target, net)
    return net


def _lay_axes(target: Target, net: Net, anchor: Floats, heading: Floats) -> None:
    """Two discrete geodesics through the anchor: equal chords, straightest at every node."""
    i0, j0 = net.origin
    normal = target.on_surface(anchor[None]).normal[0]
    along = heading - (heading @ normal) * normal
    along /= np.linalg.norm(along)
    across = cross(normal, along)
    net.points[i0, j0] = anchor
    steps = [np.diff(net.u[i0:]), np.diff(-net.u[i0::-1]), np.diff(net.v[j0:]), np.diff(-net.v[j0::-1])]
    arms = geodesics(target, np.tile(anchor, (4, 1)), np.stack([along, -along, across, -across]), steps)
    net.points[i0 + 1 :, j0], net.points[i0 - 1 :: -1, j0] = arms[0], arms[1] if i0 else arms[1][:0]
    net.points[i0, j0 + 1 :], net.points[i0, j0 - 1 :: -1] = arms[2], arms[3] if j0 else arms[3][:0]


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
        normal = target.on_surface(point[going]).normal
        flat = tangent[going] - dot(tangent[going], normal)[:, None] * normal
        flat /= np.linalg.norm(flat, axis=1)[:, None]
        h = chords[step, going]
        turn = np.zeros(len(going))  # angle of the chord out of the tangent plane
        for _ in range(NEWTON_STEPS):
            unit = np.cos(turn)[:, None] * flat + np.sin(turn)[:, None] * normal
            swing = -np.sin(turn)[:, None] * flat + np.cos(turn)[:, None] * normal
            value, gradient, _ = target.implicit(point[going] + h[:, None] * unit)
            change = value / (h * dot(gradient, swing))
            turn = turn - change
            if np.all(np.abs(change) < TOLERANCE):
                break
        unit = np.cos(turn)[:, None] * flat + np.sin(turn)[:, None] * normal
        lost = ~(np.abs(turn) < 1.2) | ~(np.abs(change) < 1e-9)
        point[going] = point[going] + h[:, None] * unit
        point[going[lost]] = np.nan
        tangent[going] = unit
        path[step, going] = point[going]
    return [path[: len(s), k] for k, s in enumerate(steps)]


def _fill_quadrants(target: Target, net: Net) -> None:
    """All four quadrants together, one anti-diagonal at a time: its nodes depend only on earlier ones."""
    nu, nv = len(net.u), len(net.v)
    i0, j0 = net.origin
    for diagonal in range(2, nu + nv):
        i_parts, j_parts = [], []
        for i_side, j_side in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            i_reach = nu - 1 - i0 if i_side > 0 else i0
            j_reach = nv - 1 - j0 if j_side > 0 else j0
            a = np.arange(max(1, diagonal - j_reach), min(i_reach, diagonal - 1) + 1)
            i_parts.append(i0 + i_side * a)
            j_parts.append(j0 + j_side * (diagonal - a))
        i, j = np.concatenate(i_parts), np.concatenate(j_parts)
        if len(i) == 0:
            break
        i_back, j_back = i - np.sign(i - i0), j - np.sign(j - j0)
        earlier = net.points[i, j_back, 0] + net.points[i_back, j, 0] + net.points[i_back, j_back, 0]
        ready = np.flatnonzero(np.isfinite(earlier))
        if len(ready) == 0:
            continue
        i, j, i_back, j_back = i[ready], j[ready], i_back[ready], j_back[ready]
        net.points[i, j] = _compass(
            target,
            a=net.points[i, j_back],
            b=net.points[i_back, j],
            d=net.points[i_back, j_back],
            from_a=np.abs(net.v[j] - net.v[j_back]),
            from_b=np.abs(net.u[i] - net.u[i_back]),
            side=np.sign(i - i0) * np.sign(j - j0),
        )


def _compass(
    target: Target, a: Floats, b: Floats, d: Floats, from_a: Floats, from_b: Floats, side: NDArray[np.intp]
) -> Floats:
    """Points P (n, 3) of the surface with |P - A| = from_a and |P - B| = from_b, across from D.

    NaN where there is none, or where the net folds: (P - B) x (P - A) no longer points along the normal.
    """
    p = a + b - d
    for _ in range(NEWTON_STEPS):
        value, gradient, _ = target.implicit(p)
        pa, pb = p - a, p - b
        ra = 0.5 * (dot(pa, pa) - from_a**2)
        rb = 0.5 * (dot(pb, pb) - from_b**2)
        ab = cross(pa, pb)
        volume = dot(ab, gradient)
        step = ra[:, None] * cross(pb, gradient) + rb[:, None] * cross(gradient, pa) + value[:, None] * ab
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            step /= volume[:, None]
        p = p - step
        size = np.abs(step).max(axis=1) / np.minimum(from_a, from_b)
        if np.all((size < TOLERANCE * 1e3) | ~(size < 1.0)):
            break
    sine = dot(cross(p - b, p - a), gradient) * side
    sine /= np.linalg.norm(gradient, axis=1) * from_a * from_b
    p[~(size < 1e-8) | ~(sine > SMALLEST_SINE)] = np.nan
    return p
