"""Curves that are given as points, laid on a target by arc length."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.interpolate import BSpline, make_interp_spline

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError, NetLimitError
from rodshell.geometry.curves import arc_lengths
from rodshell.geometry.frames import dot, unit
from rodshell.nets.surface_curves import STEP, SurfaceCurves
from rodshell.targets import Target
from rodshell.units import point_text

CORNER = np.radians(45.0)  # between two pieces of a line: rods bend, and have none
FINER = 8  # samples a step
HALVINGS = 16  # of the distance from the last sample to the end of the target
CLOSEST = 1 / 32  # steps between samples
DEGREE = 5  # of the splines through samples: their second derivatives are of fourth order
AT_THE_END = 5e-3  # of the size: a line that stops so near the end of the target is taken to reach it
FARTHEST = 0.1  # of the size: points that are further from the target are a mistake


class DrawnCurves(NamedTuple):
    """Lines on a target.

    Args:
        curves: the parts of the lines that lie on it, with s = 0 where each begins.
        line: (m,) of each curve.
        moved: the largest distance by which points in space were moved onto the target [m].
    """

    curves: SurfaceCurves
    line: Ints
    moved: float


class _Samples(NamedTuple):
    """Points on a target along lines, in order.

    Args:
        line: (n,) of each.
        u: (n,) parameters on the lines, from 0 to 1.
        points: (n, 3) [m].
        inside: (n,) whether they lie within the target's end.
        moved: (n,) distances from the line to the target [m], of lines in space.
    """

    line: Ints
    u: Floats
    points: Floats
    inside: Bools
    moved: Floats


def drawn_curves(target: Target, lines: Sequence[Floats], names: Sequence[str]) -> DrawnCurves:
    """Lay lines on a target.

    Args:
        lines: points (n, 2) in plan, or (n, 3) near the target [m].
        names: of the lines, for messages.

    Raises:
        InputError: a line is closed, has a corner, or lies far off the target; names the place. None lies on it.
        NetLimitError: the target cannot be continued past its end where a rod ends.
    """
    step = STEP * target.size
    splines = [_spline(line, name) for line, name in zip(lines, names, strict=True)]
    counts = [int(np.ceil(FINER * arc_lengths(line)[-1] / step)) + DEGREE + 1 for line in lines]
    line = np.repeat(np.arange(len(lines)), counts)
    samples = _sampled(target, splines, line, np.concatenate([np.linspace(0.0, 1.0, count) for count in counts]))
    moved = np.where(samples.inside, samples.moved, 0.0)
    if moved.max(initial=0.0) > FARTHEST * target.size:
        k = int(np.argmax(moved))
        raise InputError(
            f"rod {names[line[k]]} lies {moved[k]:.3g} m off the target near {point_text(samples.points[k])}: draw it "
            "on the target, or give its plan alone"
        )
    samples = _up_to_the_end(target, splines, samples, step)
    change = np.flatnonzero((np.diff(samples.line) != 0) | np.diff(samples.inside)) + 1
    runs = [run for run in np.split(np.arange(len(samples.u)), change) if samples.inside[run[0]]]
    found = [(samples.line[run[0]], _laid(target, samples, run, step)) for run in runs]
    laid = [(of, part) for of, part in found if part is not None]
    if not laid:
        raise InputError("no line of the layout lies on the target: give them in its coordinates")
    begin = np.cumsum([0, *(len(part.points) for _, part in laid)])
    points, tangents = (np.concatenate([part[k] for _, part in laid]) for k in (0, 1))
    limits, before = np.array([part.limits for _, part in laid]), np.ones(len(laid), dtype=np.intp)
    curves = SurfaceCurves(target, step, begin, before, points, tangents, limits)
    return DrawnCurves(curves, np.array([of for of, _ in laid]), float(moved.max(initial=0.0)))


def _spline(line: Floats, name: str) -> BSpline:
    """The smooth curve through the points of a line, from 0 to 1."""
    line = line[np.append(True, (np.diff(line, axis=0) != 0).any(axis=1))]
    if len(line) < 2 or (line[0] == line[-1]).all():
        raise InputError(f"rod {name} is closed, or a point: give two ends")
    along = unit(np.diff(line, axis=0))
    turn = np.einsum("ni,ni->n", along[1:], along[:-1])
    if turn.min(initial=1.0) < np.cos(CORNER):
        k = int(np.argmin(turn))
        raise InputError(
            f"rod {name} has a corner of {np.degrees(np.arccos(turn[k])):.0f} degrees at {point_text(line[k + 1])}: "
            "draw a smooth curve, or two rods"
        )
    u = arc_lengths(line)
    return make_interp_spline(u / u[-1], line, k=min(3, len(line) - 1))


def _sampled(target: Target, splines: Sequence[BSpline], line: Ints, u: Floats) -> _Samples:
    points, moved = np.full((len(u), 3), np.nan), np.zeros(len(u))
    for k in np.unique(line):
        at, given = line == k, splines[k](u[line == k])
        if given.shape[1] == 2:
            points[at] = np.column_stack([given, target.height_at(given)])
        else:
            points[at] = target.retract(given)
            moved[at] = np.linalg.norm(points[at] - given, axis=1)
    inside = np.isfinite(points).all(axis=1)
    inside[inside] = target.covers(points[inside])
    return _Samples(line, u, points, inside, moved)


def _up_to_the_end(target: Target, splines: Sequence[BSpline], samples: _Samples, step: float) -> _Samples:
    """With more samples where they are far apart, and near the end of the target."""
    for _ in range(HALVINGS):
        inside = samples.inside
        apart = np.linalg.norm(np.diff(samples.points, axis=0), axis=1)
        split = np.where(inside[1:] & inside[:-1], apart > 2 * step / FINER, inside[1:] != inside[:-1])
        at = np.flatnonzero(split & (samples.line[1:] == samples.line[:-1]))
        more = _sampled(target, splines, samples.line[at], 0.5 * (samples.u[at] + samples.u[at + 1]))
        samples = _Samples(*(np.insert(old, at + 1, new, axis=0) for old, new in zip(samples, more, strict=True)))
    return samples


class _Laid(NamedTuple):
    """Knots of a curve: points (k, 3) [m] and unit tangents (k, 3), the second at s = 0; and the arc lengths between
    which the line leads [m], infinite where it leads past the end of the target."""

    points: Floats
    tangents: Floats
    limits: tuple[float, float]


def _laid(target: Target, samples: _Samples, run: Ints, step: float) -> _Laid | None:
    """A part of a line inside the target, continued past both of its ends with the curvature there; None: too short."""
    x, stops = samples.points[run], (samples.u[run[0]] == 0.0, samples.u[run[-1]] == 1.0)
    at = np.floor(arc_lengths(x) / (CLOSEST * step))
    kept = (at != at[-1]) & np.append(True, np.diff(at) > 0)
    kept[-1] = True
    x = x[kept]
    if len(x) <= DEGREE:
        return None
    within = make_interp_spline(arc_lengths(x), x, k=DEGREE)
    ahead = step / FINER * np.arange(1, 2 * FINER + 1)[:, None]
    ends = []
    for place, way in ((0.0, -1.0), (within.t[-1], 1.0)):
        start, slope, bend = (within(place, order) for order in range(3))
        t, speed = slope / np.linalg.norm(slope), np.linalg.norm(slope)
        bent = (bend - (bend @ t) * t) / speed**2
        ends.append(target.retract(start + way * ahead * t + 0.5 * ahead**2 * bent))
    longer = np.vstack([ends[0][::-1], x, ends[1]])
    if not np.isfinite(longer).all():
        where = point_text(x[-1])
        raise NetLimitError(f"the target cannot be continued past its end near {where}: let rods end before it")
    chords = arc_lengths(longer)
    curve = make_interp_spline(chords, longer, k=DEGREE)
    nodes, weights = np.polynomial.legendre.leggauss(DEGREE)
    between = chords[:-1, None] + 0.5 * np.diff(chords)[:, None] * (1.0 + nodes)
    speeds = np.linalg.norm(curve(between, 1), axis=-1)
    s = np.append(0.0, np.cumsum(0.5 * np.diff(chords) * (speeds @ weights)))
    s -= s[len(ahead)]
    length = s[-len(ahead) - 1]
    knots = make_interp_spline(s, chords, k=DEGREE)(step * np.arange(-1, int(length / step) + 2))
    points = target.retract(curve(knots))
    normal, slopes = target.on_surface(points).normal, curve(knots, 1)
    short = target.margin(x[[0, -1]]) > AT_THE_END * target.size
    low, high = (stop and off for stop, off in zip(stops, short, strict=True))
    limits = (0.0 if low else -np.inf, length if high else np.inf)
    return _Laid(points, unit(slopes - dot(slopes, normal)[:, None] * normal), limits)
