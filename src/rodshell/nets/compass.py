"""The compass net: an inextensible net marched over a surface from two crossing geodesics.

A net of inextensible rods is a Chebyshev net; two geodesics through the anchor determine it. Between the two
axes every new node P lies at one step from its neighbours A and B and on the surface: the compass rule,
second order in the step, with an error expansion in even powers when every interval is halved.

Where joints are eccentric, each family lies on a surface parallel to the target: the rule then holds for the points
P + h n(P), h being the height of the rod's layer and n the target's normal, and the axes are geodesics of their layers.
The net's points P are on the target, between the layers.
"""

from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from typing import NamedTuple

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.frames import cross, unit
from rodshell.kernels import njit
from rodshell.targets import Implicit, Target

Heights = tuple[float, float]

ON_SURFACE: Heights = (0.0, 0.0)
SMALLEST_SINE = 0.02  # of a crossing angle (1.1 degrees): below it the two circles of the compass hardly intersect
NEWTON_STEPS = 12
TOLERANCE = 1e-7  # of the step: Newton doubles the digits, so that a change below it leaves an error of 1e-14


@dataclass(frozen=True, eq=False, repr=False)
class Net:
    """Nodes of a net on a surface.

    Args:
        u, v: (nu,), (nv,) ascending material coordinates of the net's lines, both containing 0 [m].
        points: (nu, nv, 3) positions [m]; NaN where the march found none.
        heights: of the rods of families u and v above the surface, along its normal [m].
    """

    u: Floats
    v: Floats
    points: Floats
    heights: Heights = field(default=ON_SURFACE, kw_only=True)

    def __repr__(self) -> str:
        known = np.count_nonzero(np.isfinite(self.points[..., 0]))
        return f"{type(self).__name__}({len(self.u)} x {len(self.v)} nodes, {known} known)"

    @cached_property
    def origin(self) -> tuple[int, int]:
        """Indices of the anchor, (u, v) = (0, 0)."""
        return int(np.abs(self.u).argmin()), int(np.abs(self.v).argmin())

    def bends(self, among: Bools) -> Iterator[tuple[Floats, Floats]]:
        """Of each family the nodes (k, 3) [m] and its lines' curvatures there (k, 3) [1/m], by second differences, at
        those among (nu, nv) whose neighbours are known."""
        for x, s, marked in ((self.points, self.u, among), (self.points.transpose(1, 0, 2), self.v, among.T)):
            slope = np.diff(x, axis=0) / np.diff(s)[:, None, None]
            bend = np.diff(slope, axis=0) / (0.5 * (s[2:] - s[:-2]))[:, None, None]
            known = marked[1:-1] & np.isfinite(bend[:, :, 0])
            yield x[1:-1][known], bend[known]


class Axes(NamedTuple):
    """Where the axes of a net cross.

    Args:
        anchor: (3,) point of the surface [m].
        tangents: (4, 3) unit tangents there, towards +u, -u, +v and -v.
    """

    anchor: Floats
    tangents: Floats


def arms(net: Net) -> tuple[Ints, Ints, Floats, Ints]:
    """The nodes (n,) of the axes but the anchor by their indices, one arm after the other, outwards as `Axes.tangents`;
    the steps (n,) that lead to them; and where each arm begins, with the end of the last (5,)."""
    i0, j0 = net.origin
    (right, left), (ahead, back) = (
        (np.arange(origin + 1, len(lines)), np.arange(origin - 1, -1, -1))
        for origin, lines in ((i0, net.u), (j0, net.v))
    )
    stops = np.cumsum([0, len(right), len(left), len(ahead), len(back)])
    rows = np.concatenate([right, left, np.full(len(ahead) + len(back), i0)])
    columns = np.concatenate([np.full(len(right) + len(left), j0), ahead, back])
    du, dv = np.diff(net.u), np.diff(net.v)
    return rows, columns, np.concatenate([du[i0:], du[:i0][::-1], dv[j0:], dv[:j0][::-1]]), stops


def lay_axes(target: Target, net: Net, start: Axes, *, tolerance: float = TOLERANCE) -> None:
    """Fill the axes of a net with two discrete geodesics through the anchor, each on its own layer; see `geodesics`."""
    anchor, tangents = start
    net.points[net.origin] = anchor
    rows, columns, chords, stops = arms(net)
    steps = np.split(chords, stops[1:-1])
    if net.heights == ON_SURFACE:
        found = geodesics(target, np.repeat(anchor[None], 4, axis=0), tangents, steps, tolerance=tolerance)
    else:
        found = list[Floats]()
        for height, pair in zip(net.heights, (slice(0, 2), slice(2, 4)), strict=True):
            layer = NetLayer(target, height)
            begin = np.repeat(layer.of(anchor[None]), 2, axis=0)
            on_layer = geodesics(layer, begin, tangents[pair], steps[pair], tolerance=tolerance)
            found += [layer.below(arm) for arm in on_layer]
    net.points[rows, columns] = np.concatenate(found)


def axes(target: Target, anchor: Floats, heading: Floats) -> Axes:
    """The axes through a point of a surface.

    Args:
        anchor: (3,) point of the surface where the axes cross [m].
        heading: (3,) direction of the u axis there, with the v axis across it; or (2, 3) directions of both. Their
            parts in the tangent plane are used.
    """
    normal = target.level(anchor[None])[1][0]
    along = heading - (heading @ normal / (normal @ normal))[..., None] * normal
    both = unit(along if along.ndim == 2 else np.stack([along, cross(normal, along)]))
    return Axes(anchor, np.stack([both, -both], axis=1).reshape(4, 3))


@dataclass(frozen=True)
class NetLayer:
    """The surface parallel to a target, with what a march needs of it.

    Args:
        height: of the layer above it, along its normals [m].
    """

    target: Target
    height: float

    def implicit(self, x: Floats) -> Implicit:
        """Distance (n,) of the points `x` (n, 3) to the layer, its gradient and Hessian: those of the target."""
        gap = self.target.gap(x)
        return Implicit(gap.distance - self.height, gap.normal, gap.hessian)

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        """As `Target.level`."""
        value, gradient, _ = self.implicit(x)
        return value, gradient

    def of(self, x: Floats) -> Floats:
        """Points (n, 3) of the layer over points `x` (n, 3) of the target."""
        return x + self.height * self.target.on_surface(x).normal

    def below(self, x: Floats) -> Floats:
        """Points (n, 3) of the target under points `x` (n, 3) of the layer; NaN stays NaN."""
        result, known = np.full_like(x, np.nan), np.isfinite(x[:, 0])
        result[known] = self.target.closest(x[known])
        return result


def geodesics(
    target: Target | NetLayer, start: Floats, direction: Floats, steps: list[Floats], *, tolerance: float = TOLERANCE
) -> list[Floats]:
    """Discrete geodesics, several at once, by given chord lengths; second order.

    The next chord lies in the plane of the last chord's direction and the surface normal at the node, so that
    the curve has no geodesic curvature.

    Args:
        start: (k, 3) points of the surface [m].
        direction: (k, 3) unit tangents there.
        steps: k arrays of chord lengths [m].
        tolerance: of Newton's last change of a chord, relative to its length; the error that is left is about its
            square.

    Returns:
        k arrays (len(steps), 3) of points; NaN from where a chord finds no surface.
    """
    count = len(steps)
    chords = np.zeros((max((len(s) for s in steps), default=0), count))
    for k, s in enumerate(steps):
        chords[: len(s), k] = s
    path = np.full((*chords.shape, 3), np.nan)
    here, tangent, turn, going = start.copy(), direction.copy(), np.zeros(count), np.arange(count)
    for n, chord in enumerate(chords):
        going = going[(chord[going] > 0.0) & np.isfinite(here[going, 0])]
        if not len(going):
            break
        x, before, step = here[going], tangent[going], chord[going, None]
        normal = unit(target.level(x)[1])
        flat = unit(before - np.einsum("mi,mi->m", before, normal)[:, None] * normal)
        angle = turn[going, None]  # of the last chord out of the tangent plane, the first guess of the next one's
        for _ in range(NEWTON_STEPS):
            value, gradient = target.level(x + step * (np.cos(angle) * flat + np.sin(angle) * normal))
            slope = (gradient * (np.cos(angle) * normal - np.sin(angle) * flat)).sum(axis=1)
            with np.errstate(divide="ignore", invalid="ignore"):
                change = value[:, None] / (step * slope[:, None])
            angle = angle - change
            if (np.abs(change) < tolerance).all():
                break
        ahead = x + step * (np.cos(angle) * flat + np.sin(angle) * normal)
        ahead[~((np.abs(angle) < 1.2) & (np.abs(change) < tolerance))[:, 0]] = np.nan
        tangent[going], turn[going], here[going], path[n, going] = (ahead - x) / step, angle[:, 0], ahead, ahead
    return [path[: len(s), k] for k, s in enumerate(steps)]


def fill_quadrants(target: Target, net: Net, wanted: Bools | None = None, *, tolerance: float = TOLERANCE) -> None:
    """Find the unknown nodes of all four quadrants, in each pass those whose neighbours are known.

    If only the axes are known, these are on one anti-diagonal after the other.

    Args:
        wanted: (nu, nv) nodes to find; default all.
        tolerance: of Newton's last change of a node, relative to the step; the error that is left is about its square.
    """
    tried = np.zeros(net.points.shape[:2], dtype=bool) if wanted is None else ~wanted
    diagonal = 2
    while True:
        diagonal, nodes, known, chords = _next_nodes(net.points, tried, net.u, net.v, *net.origin, diagonal)
        if len(nodes) == 0:
            return
        found, change, sine = _compass(target, net.heights, known, chords, tolerance)
        # none that did not converge, nor where the net folds: (P - B) x (P - A) no longer points along the normal
        good = (change < tolerance) & (sine * chords[2] > SMALLEST_SINE)
        net.points[tuple(nodes.T)], tried[tuple(nodes.T)] = np.where(good[:, None], found, np.nan), True


@njit("f3 b2 f1 f1 i i i")
def _next_nodes(points, tried, u, v, i0, j0, diagonal):  # type: ignore[no-untyped-def]
    """The nodes of all anti-diagonals from `diagonal` on that are unknown, not `tried`, and whose neighbours are known.

    Returns the anti-diagonal to continue from; the indices (n, 2) of the nodes; (3, n, 3) their neighbours A towards
    the u axis and B towards the v axis, and the guess A + B - D with D across; and (3, n) the two chords and the sign
    of the quadrant.
    """
    nodes, count, first = np.empty((tried.size, 2), dtype=np.intp), 0, len(u) + len(v)
    for quadrant in range(4):
        i_side, j_side = 1 - 2 * (quadrant // 2), 1 - 2 * (quadrant % 2)
        rows, columns = (len(u) - 1 - i0 if i_side > 0 else i0), (len(v) - 1 - j0 if j_side > 0 else j0)
        for along in range(1, rows + 1):
            for across in range(max(1, diagonal - along), columns + 1):
                i, j = i0 + i_side * along, j0 + j_side * across
                if tried[i, j] or np.isfinite(points[i, j, 0]):
                    continue
                p, q = i - i_side, j - j_side
                if np.isfinite(points[i, q, 0] + points[p, j, 0] + points[p, q, 0]):
                    nodes[count, 0], nodes[count, 1] = i, j
                    count, first = count + 1, min(first, along + across)
    known, chords = np.empty((3, count, 3)), np.empty((3, count))
    for n in range(count):
        i, j = nodes[n, 0], nodes[n, 1]
        p, q = (i - 1 if i > i0 else i + 1), (j - 1 if j > j0 else j + 1)
        for k in range(3):
            known[0, n, k], known[1, n, k] = points[i, q, k], points[p, j, k]
            known[2, n, k] = points[i, q, k] + points[p, j, k] - points[p, q, k]
        chords[0, n], chords[1, n], chords[2, n] = abs(v[j] - v[q]), abs(u[i] - u[p]), (i - p) * (j - q)
    return first + 1, nodes[:count].copy(), known, chords


def _compass(
    target: Target, heights: Heights, known: Floats, chords: Floats, tolerance: float
) -> tuple[Floats, Floats, Floats]:
    """Points P (n, 3) of the surface at the `chords` from A and from B, see `_next_nodes`; for rods at
    `heights` the distances are those of points of their layers. And their last changes and sines, see `_towards`."""
    a, b, p = known
    layered, none = heights != ON_SURFACE, np.empty((0, 3, 3))
    if layered:  # A and B on the layers of the rods that lead from them to P
        a, b = NetLayer(target, heights[1]).of(a), NetLayer(target, heights[0]).of(b)
    change, sine = np.empty(len(p)), np.empty(len(p))
    for _ in range(NEWTON_STEPS):
        value, gradient, hessian = target.implicit(p) if layered else (*target.level(p), none)
        if not _towards(p, a, b, chords, heights, value, gradient, hessian, tolerance, change, sine):
            break
    return p, change, sine


@njit("f2 f2 f2 f2 ff f1 f2 f3 f f1 f1")
def _towards(p, a, b, chords, heights, value, gradient, hessian, tolerance, change, sine):  # type: ignore[no-untyped-def]
    """One step of `compass_step` of all points p (n, 3), in place; `change` (n,) its size over the chords, `sine` (n,)
    of the crossing angle before it. Returns whether another step is needed.

    hessian : (n, 3, 3) of the surface, for layers at `heights`; otherwise empty.
    """
    going = False
    for m in range(len(p)):
        from_a, from_b = chords[0, m], chords[1, m]
        here = (p[m, 0], p[m, 1], p[m, 2])
        at_a, at_b = (a[m, 0], a[m, 1], a[m, 2]), (b[m, 0], b[m, 1], b[m, 2])
        slope = (gradient[m, 0], gradient[m, 1], gradient[m, 2])
        if len(hessian):
            step, volume = layered_step(here, at_a, at_b, slope, hessian[m], heights, from_a, from_b, value[m])
        else:
            x, y = less(here, at_a), less(here, at_b)
            step, volume = compass_step(x, y, x, y, slope, from_a, from_b, value[m])
        sine[m] = sine_of(volume, slope, from_a, from_b)
        for k in range(3):
            p[m, k] -= step[k]
        change[m] = max(abs(step[0]), abs(step[1]), abs(step[2])) / min(from_a, from_b)
        if change[m] >= tolerance:
            going = True
    return going


@njit(error_model="numpy")
def compass_step(x, y, by_x, by_y, g, from_a, from_b, level):  # type: ignore[no-untyped-def]
    """Newton's step towards |x| = from_a, |y| = from_b and f = 0 from x = P - A, y = P - B and f = level with the
    gradient g, to be subtracted from P; and the volume of the three gradients, see `sine_of`.

    `by_x` and `by_y` are the gradients of x^2/2 and y^2/2 by P: x and y themselves, except for layers.
    """
    inverse = inverse_of(by_x, by_y, g)
    return solution(inverse, past(x, from_a), past(y, from_b), level), inverse[3]


@njit(error_model="numpy")
def inverse_of(by_x, by_y, g):  # type: ignore[no-untyped-def]
    """The inverse of the matrix of three gradients: their cross products, which are to be divided by their volume; and
    this volume."""
    normal = _cross(by_x, by_y)
    return _cross(by_y, g), _cross(g, by_x), normal, dot(normal, g)


@njit(error_model="numpy")
def solution(inverse, a, b, level):  # type: ignore[no-untyped-def]
    along, across, normal, volume = inverse
    scale = 1.0 / volume
    a, b, level = scale * a, scale * b, scale * level
    return (
        a * along[0] + b * across[0] + level * normal[0],
        a * along[1] + b * across[1] + level * normal[1],
        a * along[2] + b * across[2] + level * normal[2],
    )


@njit()
def past(x, length):  # type: ignore[no-untyped-def]
    """x^2/2 less its wanted value."""
    return 0.5 * (dot(x, x) - length * length)


@njit(error_model="numpy")
def sine_of(volume, g, from_a, from_b):  # type: ignore[no-untyped-def]
    """Sine of the crossing angle, y x x along the normal, from the volume of the gradients of x^2/2, y^2/2 and f."""
    return -volume / (np.sqrt(dot(g, g)) * from_a * from_b)


@njit(error_model="numpy")
def layered_step(p, a, b, g, hessian, heights, from_a, from_b, level):  # type: ignore[no-untyped-def]
    """As `compass_step`, for x = P + h_v n - A and y = P + h_u n - B with n = g/|g|, A and B being points of layers.

    Args:
        hessian: (3, 3) second derivatives of f at P.
        heights: (2,) h_u and h_v, of the layers above the surface [m].
    """
    steep = np.sqrt(dot(g, g))
    n = (g[0] / steep, g[1] / steep, g[2] / steep)
    x, y = less(p, a), less(p, b)
    x = (x[0] + heights[1] * n[0], x[1] + heights[1] * n[1], x[2] + heights[1] * n[2])
    y = (y[0] + heights[0] * n[0], y[1] + heights[0] * n[1], y[2] + heights[0] * n[2])
    by_x, by_y = _by_point(x, heights[1] / steep, n, hessian), _by_point(y, heights[0] / steep, n, hessian)
    return compass_step(x, y, by_x, by_y, g, from_a, from_b, level)


@njit()
def _by_point(x, height, n, hessian):  # type: ignore[no-untyped-def]
    """x (1 + h dn/dP) with dn/dP = (1 - n n) F''/|F'|; the height comes divided by |F'|."""
    out = dot(x, n)
    w = (x[0] - out * n[0], x[1] - out * n[1], x[2] - out * n[2])
    return (
        x[0] + height * (hessian[0, 0] * w[0] + hessian[1, 0] * w[1] + hessian[2, 0] * w[2]),
        x[1] + height * (hessian[0, 1] * w[0] + hessian[1, 1] * w[1] + hessian[2, 1] * w[2]),
        x[2] + height * (hessian[0, 2] * w[0] + hessian[1, 2] * w[1] + hessian[2, 2] * w[2]),
    )


@njit()
def less(a, b):  # type: ignore[no-untyped-def]
    """a - b."""
    return a[0] - b[0], a[1] - b[1], a[2] - b[2]


@njit()
def _cross(a, b):  # type: ignore[no-untyped-def]
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


@njit()
def dot(a, b):  # type: ignore[no-untyped-def]
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
