"""A height function with its derivatives at any point of the plan, and whether it is smooth enough for a target."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from itertools import pairwise
from math import isfinite
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.targets.jet import Jet, differences
from rodshell.targets.rim import Disc, Rectangle

_Region = Disc | Rectangle

NUDGE = 1e-5  # of the size: a 0/0 leaves round-off of 1e-16 / (nudge size)^2 in curvature, Taylor hardly less
DIFFERENCE = 2e-3  # of the size: step of the differences; truncation and round-off are both about 1e-10 in curvature

ROWS, COLUMNS = 65, 193  # of the lattice of samples: about 3 mm apart on a target of 0.4 m
STEEPEST = 1e3  # slope that counts as infinite (89.94 degrees)
_SHARPEST = 1e-2  # change of slope at a point that counts as a crease (0.6 degrees)
_SUSPECTS, HALVINGS = 64, 26  # pairs of neighbours searched for a crease, down to 1e-8 of their distance
_TIGHTEST = 1e-4  # of the size: a smaller radius of curvature counts as a crease
BAND = 1.6  # half extents up to which the function is examined, as the net is marched past the edge
_TAME = 4.0  # slope up to which a formula is followed past the edge (76 degrees), or twice the steepest inside
_CLIMBERS = 500  # samples from which peaks are searched


@dataclass(frozen=True)
class Heights:
    """z = function(x, y) and its derivatives.

    Args:
        function: of x and y; takes jets where `exact`, otherwise only plain arrays.
        size: half the larger width of its domain [m].
        exact: whether derivatives are taken from jets; otherwise by differences.
        trusted: where the function is evaluated as it is; None for everywhere. Outside, along every normal of the
            region's edge, it is continued by its Taylor polynomial of second degree in that direction (in both
            directions outside a corner of a rectangle). The continued surface has continuous curvature, and its
            derivatives are exact: those of the polynomial's coefficients are taken from jets of jets.
    """

    function: Callable[[Any, Any], Any]
    size: float
    exact: bool = True
    trusted: _Region | None = None

    def jet(self, x: Floats, y: Floats) -> Jet:
        """z with its first and second derivatives at points `x`, `y` (n,) of the plan [m]; parts that are constant are
        floats."""
        with np.errstate(all="ignore"):
            if self.trusted is None:
                return self._inside(x, y)
            out = np.flatnonzero(relative_radius(self.trusted, x, y) > 1.0)
            if len(out) == 0:
                return self._inside(x, y)
            inside = np.ones(len(x), dtype=bool)
            inside[out] = False
            parts = np.empty((6, len(x)))
            if len(out) < len(x):
                _put(parts, inside, self._inside(x[inside], y[inside]))
            _put(parts, out, self._outside(self.trusted, *Jet.variables(x[out], y[out])))
            return Jet(*parts)

    def _inside(self, x: Floats, y: Floats) -> Jet:
        jet = self._evaluate(x, y)
        total = np.asarray(jet.value + jet.dxx + jet.dyy)
        if isfinite(float(np.add.reduce(total, axis=None))):
            return jet
        # 0/0 at a point of a smooth surface, as in cos(sqrt(x^2 + y^2)): step aside, and back by Taylor
        broken = np.flatnonzero(~np.isfinite(np.broadcast_to(total, x.shape)))
        h, k = NUDGE * self.size, 0.7 * NUDGE * self.size
        near = self._evaluate(x[broken] + h, y[broken] + k)
        bent_x, bent_y = near.dxx * h + near.dxy * k, near.dxy * h + near.dyy * k
        back = near.value - (near.dx - bent_x / 2) * h - (near.dy - bent_y / 2) * k
        parts = np.empty((6, len(x)))
        _put(parts, slice(None), jet)
        _put(parts, broken, Jet(back, near.dx - bent_x, near.dy - bent_y, near.dxx, near.dxy, near.dyy))
        return Jet(*parts)

    def _evaluate(self, x: Floats, y: Floats) -> Jet:
        if not self.exact:
            return differences(self.function, x, y, DIFFERENCE * self.size)
        jet = self.function(*Jet.variables(x, y))
        return jet if isinstance(jet, Jet) else Jet(jet)

    def _outside(self, trusted: _Region, x: Jet, y: Jet) -> Jet:
        a, b = trusted.half_extent
        if isinstance(trusted, Disc):
            inward = a / np.sqrt(x * x + y * y)
            foot_x, foot_y = x * inward, y * inward
            polynomial = _taylor(self.function(Jet(foot_x, dx=x - foot_x), Jet(foot_y, dx=y - foot_y)))
        else:  # one direction after the other; each jet holds the series in one of them
            foot_x, foot_y = _clamped(x, a), _clamped(y, b)
            across = Jet(Jet(foot_x), dx=Jet(x - foot_x))
            up = Jet(Jet(foot_y, dx=y - foot_y))
            polynomial = _taylor(_taylor(self.function(across, up)))
        return polynomial if isinstance(polynomial, Jet) else Jet(polynomial)


def _taylor(series: Any) -> Any:
    """f(1) of the parabola with the value and derivatives of f at 0."""
    return series.value + series.dx + 0.5 * series.dxx if isinstance(series, Jet) else series


def _clamped(coordinate: Jet, limit: float) -> Jet:
    within = (np.abs(coordinate.value) <= limit).astype(float)
    return Jet(np.clip(coordinate.value, -limit, limit), within * coordinate.dx, within * coordinate.dy)


def _put(parts: Floats, where: Any, jet: Jet) -> None:
    for row, part in zip(parts, jet.parts, strict=True):
        row[where] = part


def sample(heights: Heights, domain: _Region) -> Floats:
    """(8, rows, columns) x, y, z, z_x, z_y, z_xx, z_xy, z_yy on a lattice up to the domain's edge.

    The rows of the lattice of a disc are circles, from the centre to the edge.
    """
    a, b = domain.half_extent
    if isinstance(domain, Disc):
        radius, angle = np.linspace(0.0, a, ROWS)[:, None], np.linspace(0.0, 2 * np.pi, COLUMNS)
        x, y = radius * np.cos(angle), radius * np.sin(angle)
    else:
        x, y = np.meshgrid(np.linspace(-a, a, COLUMNS), np.linspace(-b, b, ROWS))
    return _evaluated(heights, np.stack([x.ravel(), y.ravel()])).reshape(8, ROWS, COLUMNS)


def require_smooth(heights: Heights, domain: _Region, samples: Floats, name: str) -> None:
    """Refuse a function without finite height, slope and curvature everywhere in the domain, or with steps or creases.

    Raises:
        InputError: names the place and a remedy.
    """
    _refuse(samples.reshape(8, -1), domain, name)
    if heights.exact:  # differences smooth a crease
        tight = _tighten(heights, domain, samples.reshape(8, -1))
        _refuse(tight, domain, name)
        p, q = _close_in(heights, samples)
        _refuse(p, domain, name)
        _refuse(q, domain, name)
        apart = np.hypot(*(q[:2] - p[:2]))
        room = 1.0 + np.hypot(p[3], p[4]) + np.hypot(q[3], q[4])
        step = np.abs(q[2] - p[2]) > 10 * apart * room
        crease = np.hypot(*(q[3:5] - p[3:5])) > _SHARPEST * room
        tip = _bend(tight) * heights.size > 1 / _TIGHTEST
        for at, bad, what in ((p, step, "a step"), (p, crease, "a crease"), (tight, tip, "a sharp point")):
            if bad.any():
                x, y = _nearest_centre(at[:, bad], domain)
                raise InputError(
                    f"{name} has {what} at ({x:.4g}, {y:.4g}) m, and a target must be smooth: "
                    f"round it off (sqrt(u^2 + 0.01^2) for abs(u)), or use {_smaller(domain, x, y)}"
                )


def trusted_region(heights: Heights, domain: _Region, samples: Floats, name: str) -> _Region | None:
    """The largest region around the domain in which the function can be evaluated as it is; None for 1.6 times the
    domain.

    There it is finite, and not steeper than slope 4 or twice its steepest inside.

    Raises:
        InputError: a function without exact derivatives cannot be continued, and needs to be.
    """
    edge = _edge(domain)
    limit = max(_TAME, 2 * float(np.hypot(samples[3], samples[4]).max()))
    growth = np.linspace(1.0, BAND, 61)
    for before, now in pairwise(growth):
        at = _evaluated(heights, now * edge)
        if not np.all(np.isfinite(at).all(axis=0) & (np.hypot(at[3], at[4]) <= limit)):
            if not heights.exact:
                raise InputError(
                    f"{name} must be smooth up to {BAND} times its domain, and is not at {now:.2f} times: use a "
                    "smaller domain, or numpy functions alone, which can be continued"
                )
            return grown(domain, float(before))
    return None


def climb(heights: Heights, domain: _Region) -> Floats:
    """Local peaks (n, 2) of the domain and its edge [m], climbed to from many samples; the highest is among them."""
    at = sample(heights, domain).reshape(8, -1)
    a, b = domain.half_extent
    pitch = max(a, b) * max(2 * np.pi / COLUMNS, 1 / ROWS)
    # a peak is at most this much higher than the lattice's points next to it
    hidden = 0.5 * np.abs(at[5:]).max() * pitch**2
    high = np.flatnonzero(at[2] >= at[2].max() - hidden)
    xy = at[:2, [np.argmax(at[2]), *high[:: len(high) // _CLIMBERS + 1]]].T
    for _ in range(60):  # Newton; where the peak is flat (x^4) it converges linearly
        _, _, _, zx, zy, zxx, zxy, zyy = _evaluated(heights, xy.T)
        bend, axes = np.linalg.eigh(np.moveaxis(np.array([[zxx, zxy], [zxy, zyy]]), 2, 0))
        along = np.einsum("nij,ni->nj", axes, np.stack([zx, zy], axis=1))
        step = np.einsum("nij,nj->ni", axes, along / np.maximum(np.abs(bend), 1e-9 / max(a, b)))
        length = np.linalg.norm(step, axis=1)
        moved = xy + step * np.minimum(1.0, pitch / np.maximum(length, 1e-300))[:, None]
        moved /= np.maximum(1.0, relative_radius(domain, *moved.T))[:, None]
        converged = np.abs(moved - xy).max() < 1e-14 * max(a, b)
        xy = moved
        if converged:
            break
    return xy


def grown(domain: _Region, factor: float) -> _Region:
    """The domain scaled by a factor."""
    if isinstance(domain, Disc):
        return replace(domain, radius=factor * domain.radius)
    return replace(domain, size=(factor * domain.size[0], factor * domain.size[1]))


def relative_radius(domain: _Region, x: Floats, y: Floats) -> Floats:
    """Relative distance from the centre of the domain: 0 there, 1 on the edge."""
    a, b = domain.half_extent
    if isinstance(domain, Disc):
        return np.asarray(np.hypot(x, y) / a)
    return np.maximum(np.abs(x) / a, np.abs(y) / b)


def _evaluated(heights: Heights, xy: Floats) -> Floats:
    """(8, n) x, y and all parts of the jet at points (2, n)."""
    jet = heights.jet(xy[0], xy[1])
    return np.stack([*xy, *(np.broadcast_to(np.asarray(part, dtype=float), xy[0].shape) for part in jet.parts)])


def _edge(domain: _Region) -> Floats:
    a, b = domain.half_extent
    if isinstance(domain, Disc):
        angle = np.linspace(0.0, 2 * np.pi, 4 * ROWS)
        return np.stack([a * np.cos(angle), a * np.sin(angle)])
    along, full = np.linspace(-1.0, 1.0, ROWS), np.ones(ROWS)
    across, up = (a * along, b * full), (a * full, b * along)
    return np.hstack([across, np.negative(across), up, np.negative(up)])


def _refuse(at: Floats, domain: _Region, name: str) -> None:
    flat = np.isfinite(at[2:5]).all(axis=0)
    slope = np.hypot(at[3], at[4])
    for bad, what in (
        (~np.isfinite(at[2]), "no finite height"),
        (~flat | (slope > STEEPEST), "an infinite slope"),
        (~np.isfinite(at[5:]).all(axis=0), "an infinite curvature"),
    ):
        if bad.any():
            x, y = _nearest_centre(at[:, bad], domain)
            raise InputError(f"{name} has {what} at ({x:.4g}, {y:.4g}) m: use {_smaller(domain, x, y)}")


def _nearest_centre(at: Floats, domain: _Region) -> tuple[float, float]:
    nearest = at[:2, int(np.argmin(relative_radius(domain, at[0], at[1])))]
    x, y = np.where(np.abs(nearest) < 1e-9 * max(domain.half_extent), 0.0, nearest)
    return float(x), float(y)


def _smaller(domain: _Region, x: float, y: float) -> str:
    """Text that proposes a domain that ends before a point."""
    within = 0.95 * float(relative_radius(domain, np.array(x), np.array(y)))
    if within < 0.2:
        return "another formula there"
    smaller = grown(domain, within)
    if isinstance(smaller, Disc):
        return f"a smaller domain, such as radius {smaller.radius:.2g} m"
    return f"a smaller domain, such as size {smaller.size[0]:.2g} m x {smaller.size[1]:.2g} m"


def _close_in(heights: Heights, at: Floats) -> tuple[Floats, Floats]:
    """Pairs of neighbours (8, k) whose heights and slopes fit each other least, with their distances halved repeatedly.

    The worse half is kept each time: the misfit of smooth functions decreases, that of a singularity does not.
    """
    p = np.hstack([at[:, :-1].reshape(8, -1), at[:, :, :-1].reshape(8, -1)])
    q = np.hstack([at[:, 1:].reshape(8, -1), at[:, :, 1:].reshape(8, -1)])
    worst = np.argsort(_misfit(p, q))[-_SUSPECTS:]
    p, q = p[:, worst], q[:, worst]
    for _ in range(HALVINGS):
        middle = _evaluated(heights, 0.5 * (p[:2] + q[:2]))
        first = ~(_misfit(p, middle) < _misfit(middle, q))
        p, q = np.where(first, p, middle), np.where(first, middle, q)
    return p, q


def _tighten(heights: Heights, domain: _Region, at: Floats) -> Floats:
    """Points (8, k) of strongest curvature nearby: at a sharp point between the samples it grows."""
    a, b = domain.half_extent
    at = at[:, np.argsort(_bend(at))[-_SUSPECTS:]]
    step = np.array([[i, j] for i in (0, 1, -1) for j in (0, 1, -1)], dtype=float)
    reach = max(a, b) * max(2 * np.pi / COLUMNS, 1 / ROWS)
    while reach > 1e-6 * max(a, b):  # closer to a smooth 0/0 there is only round-off
        xy = at[:2, None, :] + 0.5 * reach * step.T[:, :, None]
        xy /= np.maximum(1.0, relative_radius(domain, *xy))
        around = _evaluated(heights, xy.reshape(2, -1)).reshape(8, len(step), -1)
        best = np.argmax(_bend(around), axis=0)
        at = np.take_along_axis(around, best[None, None, :], axis=1)[:, 0]
        reach *= 0.6
    return at


def _bend(at: Floats) -> Floats:
    return np.asarray(np.abs(at[5:]).max(axis=0))


def _misfit(p: Floats, q: Floats) -> Floats:
    """By how much z and its slope deviate from the trapezoidal rule between two points, both as slopes."""
    x, y = q[:2] - p[:2]
    apart = np.maximum(np.hypot(x, y), 1e-300)
    mean = 0.5 * (p + q)
    rise = q[2] - p[2] - mean[3] * x - mean[4] * y
    turn_x = q[3] - p[3] - mean[5] * x - mean[6] * y
    turn_y = q[4] - p[4] - mean[6] * x - mean[7] * y
    return np.asarray(np.abs(rise) / apart + np.hypot(turn_x, turn_y))
