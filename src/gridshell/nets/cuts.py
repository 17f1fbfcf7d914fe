"""Where the lines of a net leave a target: runs of inside nodes, and cuts between nodes."""

from collections.abc import Callable, Sequence
from itertools import pairwise
from math import inf
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gridshell.geometry.curves import lagrange
from gridshell.nets.compass import Net
from gridshell.targets import Target

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Mask = NDArray[np.bool_]


SQUARE = 5  # nodes each way


class Cut(NamedTuple):
    """A part of one line that lies on the target: material coordinates of its two ends [m]."""

    start: float
    end: float


def inside_nodes(target: Target, net: Net) -> Mask:
    """(nu, nv) nodes inside the target's end and connected with the anchor through inside nodes.

    Where the anchor lies in an opening, with the first inside nodes along the axes.
    """
    region = _region(target, net)
    reached = np.zeros_like(region)
    i, j = net.origin
    reached[i, j] = region[i, j]
    if not region[i, j]:
        for axis, seeds in ((region[i:, j], reached[i:, j]), (region[i::-1, j], reached[i::-1, j]),
                            (region[i, j:], reached[i, j:]), (region[i, j::-1], reached[i, j::-1])):  # fmt: skip
            seeds[np.argmax(axis)] = axis.any()
    while True:  # whole runs at a time, along rows and columns in turn: a few sweeps suffice
        grown = _fill_runs(region.T, _fill_runs(region, reached).T).T
        if np.array_equal(grown, reached):
            return grown
        reached = grown


def _region(target: Target, net: Net) -> Mask:
    """(nu, nv) nodes inside the target's end.

    A square of nodes in whose middle the end is further away than the way to its corners is asked about but once.
    """
    known = np.isfinite(net.points[:, :, 0])
    inside, asked = np.zeros(known.shape, dtype=bool), known.copy()
    nu, nv = (count // SQUARE * SQUARE for count in known.shape)
    squares = (nu // SQUARE, SQUARE, nv // SQUARE, SQUARE)
    middle = slice(SQUARE // 2, None, SQUARE)
    whole = known[:nu, :nv].reshape(squares).all(axis=(1, 3))
    margin = np.zeros(whole.shape)
    margin[whole] = target.margin(net.points[:nu, :nv][middle, middle][whole])
    way = [np.abs(s[:n].reshape(-1, SQUARE) - s[:n][middle, None]).max(axis=1) for s, n in ((net.u, nu), (net.v, nv))]
    clear = np.abs(margin) > way[0][:, None] + way[1]
    asked[:nu, :nv] &= ~np.repeat(np.repeat(clear, SQUARE, axis=0), SQUARE, axis=1)
    inside[:nu, :nv] = np.repeat(np.repeat(clear & (margin > 0), SQUARE, axis=0), SQUARE, axis=1)
    inside[asked] = target.margin(net.points[asked]) > 0
    return inside


def _fill_runs(region: Mask, seeds: Mask) -> Mask:
    """Extend seeds to the whole run of `region` along each row in which they lie."""
    fenced = np.zeros((region.shape[0], region.shape[1] + 1), dtype=bool)
    fenced[:, :-1] = region
    run = np.cumsum(~fenced.ravel())
    seeded = np.zeros(run[-1] + 1, dtype=bool)
    padded = np.zeros_like(fenced)
    padded[:, :-1] = seeds & region
    seeded[run[padded.ravel()]] = True
    return np.asarray((seeded[run].reshape(fenced.shape) & fenced)[:, :-1])


class Lines(NamedTuple):
    """Lines of a net: material coordinates `s` (n,) along them [m], `points` (m, n, 3) of each, NaN where there are
    none, and which are `inside` (m, n)."""

    s: Floats
    points: Floats
    inside: Mask


def cut_lines(target: Target, sets: Sequence[Lines], *, depth: float = 0.0) -> list[list[list[Cut]]]:
    """Cut lines of nets at the target's end, to fourth order between nodes.

    Parameters
    ----------
    sets : lines of one family of one net each.
    depth : pieces that lie nowhere further inside than this [m] only graze the end and do not count.

    Returns
    -------
    For each set and each of its lines the pieces, in its direction; none for a line without inside nodes.
    """
    runs = [_runs(target, lines, depth) for lines in sets]
    ends = _roots(target, sets, runs).reshape(-1, 2).tolist()
    result, done = list[list[list[Cut]]](), 0
    for lines, (row, _, _) in zip(sets, runs, strict=True):
        cuts: list[list[Cut]] = [[] for _ in lines.points]
        for k, (start, end) in zip(row.tolist(), ends[done : done + len(row)], strict=True):
            cuts[k].append(Cut(start, end))
        result.append(cuts)
        done += len(row)
    return result


def _runs(target: Target, lines: Lines, depth: float) -> tuple[Ints, Ints, Ints]:
    """The line, and the first and the last node, of each run of inside nodes that is `depth` [m] inside somewhere."""
    change = np.diff(lines.inside.astype(np.int8), axis=1, prepend=0, append=0)
    (row, first), last = np.nonzero(change == 1), np.nonzero(change == -1)[1] - 1
    margin = np.append(np.full(lines.inside.shape, -np.inf), -np.inf)  # of a run that ends with the last line
    margin[:-1][lines.inside.ravel()] = target.margin(lines.points[lines.inside])
    begin = row * len(lines.s)
    bounds = np.column_stack([begin + first, begin + last + 1]).ravel()
    deep = np.maximum.reduceat(margin, bounds)[::2] > depth if len(row) else np.empty(0, dtype=bool)
    return row[deep], first[deep], last[deep]


def extrapolated(coarse: list[Cut], fine: list[Cut], step: float) -> tuple[list[Cut], float]:
    """The cuts of one line from two marches, by Richardson; and a bound of the finer one's error [m].

    Each end is matched with the nearest of its kind in the coarse march, within a `step` [m]: where a line grazes
    the end, the marches may find different pieces. An end that only one of them finds stays where it is; its
    error is at most about half the gap or piece that the other march does not see, or the way to its nearest end.
    """
    ends, error = [end for cut in fine for end in cut], 0.0
    better = list[float]()
    for k, end in enumerate(ends):
        change = min((end - cut[k % 2] for cut in coarse), key=abs, default=inf)
        if abs(change) <= step:
            better.append(end + change / 3)
            error = max(error, abs(change) / 3)
        else:
            better.append(end)
            error = max(error, min(abs(change), 0.5 * min(abs(other - end) for other in ends[:k] + ends[k + 1 :])))
    if any(after <= before for before, after in pairwise(better)):
        return fine, max(error, step)
    return [Cut(start, end) for start, end in zip(better[::2], better[1::2], strict=True)], error


def _roots(target: Target, sets: Sequence[Lines], runs: Sequence[tuple[Ints, Ints, Ints]]) -> Floats:
    """Where each run's line crosses the end before and after it, by a cubic through four nodes."""
    gathered = list[tuple[Floats, Floats, Floats, Floats]]()
    for (s, points, _), (line, first, last) in zip(sets, runs, strict=True):
        row = np.repeat(line, 2)
        i = np.column_stack([first - 1, last]).ravel()  # the cut is between nodes i and i + 1
        side = np.tile([-1, 1], len(line))
        window = np.clip(i - 1, 0, len(s) - 4)
        for shift in (-1, 1):  # next to the net's limit, four nodes further in
            lost = ~np.isfinite(points[row[:, None], window[:, None] + np.arange(4), 0]).all(axis=1)
            window = np.where(lost, np.clip(i - 1 + shift, 0, len(s) - 4), window)
        nodes = window[:, None] + np.arange(4)
        gathered.append((s[nodes], points[row[:, None], nodes], s[i + (side > 0)], s[i + (side < 0)]))
    knots, points, outer, inner = (np.concatenate(part) for part in zip(*gathered, strict=True))
    return _bracketed(lambda at, which: target.margin(lagrange(knots[which], points[which], at)), outer, inner)


def _bracketed(margin: Callable[[Floats, Ints], Floats], outer: Floats, inner: Floats) -> Floats:
    """Roots (n,) of functions that are positive at `inner` (n,) and not at `outer`, to their rounding.

    `margin(at, which)` takes places (k,) and whose functions they are asked of. By false position (Illinois): an end
    that stays twice counts half at the next step. Each root is left alone once it is found.
    """
    which = np.arange(len(inner))
    below, above = np.minimum(margin(outer, which), 0.0), margin(inner, which)
    tiny = 1e-15 * (np.abs(outer) + np.abs(inner))
    side = np.zeros(len(inner))  # which end moved last: 1 the inner, -1 the outer one
    found, at = inner.copy(), inner
    for _ in range(100):
        share = above / (above - below)
        before, at = at, inner + np.where(np.isfinite(share), share, 0.5) * (outer - inner)
        value = margin(at, which)
        found[which] = at
        inside = value > 0
        below = np.where(inside, np.where(side > 0, 0.5, 1.0) * below, value)
        above = np.where(inside, value, np.where(side < 0, 0.5, 1.0) * above)
        outer, inner, side = np.where(inside, outer, at), np.where(inside, at, inner), np.where(inside, 1.0, -1.0)
        left = (np.abs(at - before) > tiny) & (np.abs(outer - inner) > tiny) & (value != 0.0)
        if not left.any():
            break
        which, at, outer, inner, below, above, side, tiny = (
            array[left] for array in (which, at, outer, inner, below, above, side, tiny)
        )
    return found
