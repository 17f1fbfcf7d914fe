"""Where the lines of a net end on a target: runs of inside nodes, and the cuts between nodes."""

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.curves import lagrange, put_lagrange
from rodshell.kernels import njit
from rodshell.nets.compass import Net
from rodshell.targets import Target

SQUARE = 5  # nodes each way
MOST_STEPS = 100  # of false position; 10 are usual


class Cuts(NamedTuple):
    """The parts of lines that are on the target, line by line and along each.

    Args:
        line: (k,) index of the line of each part, ascending.
        ends: (k, 2) material coordinates of its ends [m].
    """

    line: Ints
    ends: Floats


def inside_nodes(target: Target, net: Net) -> Bools:
    """Nodes (nu, nv) inside the target's end that are connected with the anchor through inside nodes.

    If the anchor is in an opening, they are connected with the first inside nodes along the axes.
    """
    region = _region(target, net)
    runs, reached = _runs(region), np.zeros_like(region)
    _connect(region, runs, *net.origin, np.zeros(len(runs), dtype=bool), reached)
    return reached


@njit("b2 i2 i i b1 b2")
def _connect(region, runs, i0, j0, found, reached):  # type: ignore[no-untyped-def]
    """The nodes `reached` (nu, nv) of the `region` (nu, nv) that are connected with node (i0, j0), or with the first
    along the axes. A run of nodes, see `_runs`, is found from any of them, or from a run next to it."""
    changed, (nu, nv) = True, region.shape
    for axis in range(4):
        side, i, j = 1 - 2 * (axis % 2), i0, j0
        while 0 <= i < nu and 0 <= j < nv and not region[i, j]:
            i, j = (i + side, j) if axis < 2 else (i, j + side)
        for r in range(len(runs)):
            found[r] |= runs[r, 0] == i and runs[r, 1] <= j <= runs[r, 2]
    while changed:
        changed, first = False, 0
        for r in range(len(runs)):
            before = runs[r, 0] - 1
            while runs[first, 0] < before or (runs[first, 0] == before and runs[first, 2] < runs[r, 1]):
                first += 1
            s = first
            while runs[s, 0] == before and runs[s, 1] <= runs[r, 2]:
                if found[r] != found[s]:
                    found[r] = found[s] = changed = True
                s += 1
    for r in range(len(runs)):
        if found[r]:
            for j in range(runs[r, 1], runs[r, 2] + 1):
                reached[runs[r, 0], j] = True


def _region(target: Target, net: Net) -> Bools:
    """(nu, nv) nodes inside the target's end.

    A square of nodes whose corners are closer to its middle than the end is needs only one evaluation.
    """
    half, known = SQUARE // 2, np.isfinite(net.points[..., 0])
    count = known.shape[0] // SQUARE, known.shape[1] // SQUARE
    in_squares = known[: count[0] * SQUARE, : count[1] * SQUARE].reshape(count[0], SQUARE, count[1], SQUARE)
    squares = np.nonzero(in_squares.all(axis=(1, 3)))
    i, j = (SQUARE * row + half for row in squares)
    reach = [np.maximum(s[k + half] - s[k], s[k] - s[k - half]) for s, k in ((net.u, i), (net.v, j))]
    margin, signs, side = target.margin(net.points[i, j]), np.zeros(count), np.zeros(known.shape)
    signs[squares] = np.sign(margin) * (np.abs(margin) > reach[0] + reach[1])
    side[: count[0] * SQUARE, : count[1] * SQUARE] = signs.repeat(SQUARE, axis=0).repeat(SQUARE, axis=1)
    asked, inside = known & (side == 0), side > 0
    inside[asked] = target.margin(net.points[asked]) > 0
    return inside


class Lines(NamedTuple):
    """Lines of one family of a net.

    Args:
        s: (n,) material coordinates of the nodes along them [m].
        points: (m, n, 3) nodes of each line [m]; NaN where there is none.
        inside: (m, n) which nodes are inside the target's end.
    """

    s: Floats
    points: Floats
    inside: Bools


def cut_lines(target: Target, sets: Sequence[Lines], *, depth: float = 0.0) -> list[Cuts]:
    """For each set the pieces of its lines inside the target's end, which cuts them to fourth order between nodes; none
    of a line without inside nodes.

    Args:
        sets: lines of one family of one net each.
        depth: pieces that are nowhere further inside than this only graze the end and are ignored [m].
    """
    runs = _deep(target, sets, [_runs(lines.inside) for lines in sets], depth)
    around = [_around_ends(lines, run) for lines, run in zip(sets, runs, strict=True)]
    ends = _roots(target, *(np.concatenate(parts) for parts in zip(*around, strict=True))).reshape(-1, 2)
    pieces = np.split(ends, np.cumsum([len(run) for run in runs])[:-1])
    return [Cuts(run[:, 0].copy(), piece) for run, piece in zip(runs, pieces, strict=True)]


def _runs(inside: Bools) -> Ints:
    """(k, 3) the line, the first and the last node of each run of nodes of `inside` (m, n)."""
    begins, ends = inside.copy(), inside.copy()
    begins[:, 1:] &= ~inside[:, :-1]
    ends[:, :-1] &= ~inside[:, 1:]
    return np.column_stack([*np.nonzero(begins), np.nonzero(ends)[1]])


def _deep(target: Target, sets: Sequence[Lines], runs: list[Ints], depth: float) -> list[Ints]:
    """Of the runs (k, 3) of each set those that are `depth` [m] inside somewhere."""
    middles = [lines.points[run[:, 0], (run[:, 1] + run[:, 2]) // 2] for lines, run in zip(sets, runs, strict=True)]
    deep = target.margin(np.concatenate(middles)) > depth
    if deep.all():
        return runs
    kept, done = list[Ints](), 0
    for lines, run in zip(sets, runs, strict=True):
        here = deep[done : done + len(run)]
        for k in np.flatnonzero(~here).tolist():  # not in the middle, but elsewhere?
            row, first, last = run[k].tolist()
            here[k] = (target.margin(lines.points[row, first : last + 1]) > depth).any()
        kept.append(run[here])
        done += len(run)
    return kept


def _around_ends(lines: Lines, runs: Ints) -> tuple[Floats, Floats, Floats, Floats]:
    """Four nodes around both ends of each of the `runs` (k, 3): their places (2k, 4) and points (2k, 4, 3); and the
    places (2k,) of the nodes outside and inside, between which the end is."""
    s, most, line = lines.s, len(lines.s) - 4, runs[:, :1].repeat(2, axis=0)
    last = np.tile([0, 1], len(runs))
    i = runs[:, 1:].ravel() + last - 1  # the cut is between nodes i and i + 1
    window = np.clip(i - 1, 0, most)
    for shift in (-1, 1):  # near the net's limit, four nodes further inside
        lost = ~np.isfinite(lines.points[line, window[:, None] + np.arange(4), 0]).all(axis=1)
        window = np.where(lost, np.clip(i - 1 + shift, 0, most), window)
    four = window[:, None] + np.arange(4)
    return s[four], lines.points[line, four], s[i + last], s[i + 1 - last]


def _roots(target: Target, knots: Floats, points: Floats, outer: Floats, inner: Floats) -> Floats:
    """Where cubics through four nodes each (n, 4, 3) at `knots` (n, 4) [m] cross the target's end, to round-off,
    between the places `outer` and `inner` (n,) outside and inside of it.

    By false position (Illinois): an end of the bracket that does not move twice is weighted by half in the next step. A
    root that was found is not evaluated again.
    """
    below = np.minimum(target.margin(lagrange(knots, points, outer)), 0.0)
    above = target.margin(lagrange(knots, points, inner))
    found, index, there = inner.copy(), np.arange(len(inner)), np.empty((len(inner), 3))
    bracket = np.array([outer, inner, below, above, np.zeros(len(inner)), 1e-15 * (np.abs(outer) + np.abs(inner))])
    left = _narrow(above, knots, points, found, index, bracket, there, True)
    for _ in range(MOST_STEPS):
        if left == 0:
            break
        left = _narrow(target.margin(there[:left]), knots, points, found, index, bracket, there, False)
    return found


@njit("f1 f2 f3 f1 i1 f2 f2 b")
def _narrow(value, knots, points, found, index, bracket, there, first):  # type: ignore[no-untyped-def]
    """One step of `_roots`: the brackets of the roots that are left are narrowed by the `value` (n,) at their last
    guess, except the `first` time. Returns how many roots are left: these are moved to the front.

    found : (m,) the last guess of every root.
    index, there : (m,), (m, 3) of those that are left: the root, and the point at its next guess.
    bracket : (6, m) of those: outer and inner end, the values there, the end that moved last (1 for the inner, -1 for
        the outer), and the smallest step.
    """
    left = 0
    for k in range(len(value)):
        outer, inner, below, above = bracket[0, k], bracket[1, k], bracket[2, k], bracket[3, k]
        side, tiny, before = bracket[4, k], bracket[5, k], found[index[k]]
        if not first:
            if value[k] > 0.0:
                below, above, inner = (0.5 if side > 0.0 else 1.0) * below, value[k], before
                side = 1.0
            else:
                below, above, outer = value[k], (0.5 if side < 0.0 else 1.0) * above, before
                side = -1.0
            if value[k] == 0.0 or not abs(outer - inner) > tiny:
                continue
        share = above / (above - below)
        guess = inner + (share if np.isfinite(share) else 0.5) * (outer - inner)
        found[index[k]] = guess
        if not first and not abs(guess - before) > tiny:
            continue
        index[left] = index[k]
        put_lagrange(knots, points, index[k], guess, there, left)
        bracket[0, left], bracket[1, left], bracket[2, left] = outer, inner, below
        bracket[3, left], bracket[4, left], bracket[5, left] = above, side, tiny
        left += 1
    return left


def extrapolated(coarse: Cuts, fine: Cuts, lines: int, step: float) -> tuple[Cuts, Floats]:
    """The cuts of lines, extrapolated from two marches (Richardson); and for each line a bound (lines,) of the finer
    march's error [m].

    Each end is matched with the nearest of its kind in the coarse march: where a line grazes the end of the target, the
    marches may find different pieces. An end that only the finer march finds is kept; its error is at most about half
    the gap or piece that the other march does not find, or the distance to its nearest end.

    Args:
        step: distance within which ends are matched [m].
    """
    ends, errors = fine.ends.copy(), np.zeros(lines)
    _extrapolate(coarse.line, coarse.ends, fine.line, fine.ends, step, ends, errors)
    return Cuts(fine.line, ends), errors


@njit("i1 f2 i1 f2 f f2 f1")
def _extrapolate(coarse_line, coarse, line, fine, step, ends, errors):  # type: ignore[no-untyped-def]
    begin, matching = 0, 0
    while begin < len(line):
        on, stop, error = line[begin], begin + 1, 0.0
        while stop < len(line) and line[stop] == on:
            stop += 1
        while matching < len(coarse_line) and coarse_line[matching] < on:
            matching += 1
        for k in range(begin, stop):
            for side in range(2):
                change, c = np.inf, matching
                while c < len(coarse_line) and coarse_line[c] == on:
                    if abs(fine[k, side] - coarse[c, side]) < abs(change):
                        change = fine[k, side] - coarse[c, side]
                    c += 1
                if abs(change) <= step:
                    ends[k, side] = fine[k, side] + change / 3
                    error = max(error, abs(change) / 3)
                else:
                    apart = fine[k, 1] - fine[k, 0]
                    if side == 0 and k > begin:
                        apart = min(apart, fine[k, 0] - fine[k - 1, 1])
                    if side == 1 and k + 1 < stop:
                        apart = min(apart, fine[k + 1, 0] - fine[k, 1])
                    error = max(error, min(abs(change), 0.5 * apart))
        ascending = True
        for k in range(begin, stop):
            ascending &= ends[k, 0] < ends[k, 1] and (k == begin or ends[k - 1, 1] < ends[k, 0])
        if not ascending:
            error = max(error, step)
            for k in range(begin, stop):
                ends[k, 0], ends[k, 1] = fine[k, 0], fine[k, 1]
        errors[on] = error
        begin = stop
