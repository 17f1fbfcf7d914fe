"""Where the lines of a net leave a target: runs of inside nodes, and cuts between nodes."""

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gridshell.geometry.curves import lagrange
from gridshell.nets.compass import Net
from gridshell.targets import Target

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


class Cut(NamedTuple):
    """The part of one line that lies on the target: material coordinates of its two ends [m]."""

    start: float
    end: float
    pieces: int  # how often the line meets the target; the longest piece is the one given


def inside_nodes(target: Target, net: Net) -> Mask:
    """(nu, nv) nodes inside the target's end and connected with the anchor through inside nodes."""
    flat = net.points.reshape(-1, 3)
    inside = np.zeros(len(flat), dtype=bool)
    known = np.flatnonzero(np.isfinite(flat[:, 0]))
    inside[known] = target.margin(flat[known]) > 0
    region = inside.reshape(net.points.shape[:2])
    reached = np.zeros_like(region)
    reached[net.origin] = region[net.origin]
    while True:  # whole runs at a time, along rows and columns in turn: a few sweeps suffice
        grown = _fill_runs(region.T, _fill_runs(region, reached).T).T
        if np.array_equal(grown, reached):
            return grown
        reached = grown


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


def cut_lines(target: Target, s: Floats, lines: Floats, inside: Mask) -> list[Cut | None]:
    """Cut lines of a net at the target's end, to fourth order between nodes.

    Parameters
    ----------
    s : (n,) material coordinates along the lines [m].
    lines : (m, n, 3) points of each line, NaN where there are none; inside : (m, n).

    Returns
    -------
    m cuts; None for a line without inside nodes.
    """
    found, windows = list[tuple[int, int, int, int]](), list[tuple[int, int, int]]()
    for k, mask in enumerate(inside):
        steps = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
        first, last = np.flatnonzero(steps == 1), np.flatnonzero(steps == -1) - 1
        if len(first) == 0:
            continue
        longest = int(np.argmax(s[last] - s[first]))
        found.append((k, int(first[longest]), int(last[longest]), len(first)))
        windows += [(k, int(first[longest]) - 1, -1), (k, int(last[longest]), 1)]
    ends = _roots(target, s, lines, windows)
    cuts: list[Cut | None] = [None] * len(lines)
    for (k, _, _, pieces), (start, end) in zip(found, ends.reshape(-1, 2), strict=True):
        cuts[k] = Cut(float(start), float(end), pieces)
    return cuts


def _roots(target: Target, s: Floats, lines: Floats, windows: list[tuple[int, int, int]]) -> Floats:
    """Where each line crosses the end, by a cubic through four nodes.

    Each window (line, i, side) lies between nodes i and i + 1, its outer node being i + 1 for side 1, i for side -1.
    """
    if not windows:
        return np.empty(0)
    row, i, side = np.array(windows).T
    first = np.clip(i - 1, 0, len(s) - 4)
    for shift in (-1, 1):  # next to the net's limit, four nodes further in
        lost = ~np.isfinite(lines[row[:, None], first[:, None] + np.arange(4), 0]).all(axis=1)
        first = np.where(lost, np.clip(i - 1 + shift, 0, len(s) - 4), first)
    nodes = first[:, None] + np.arange(4)
    points, knots = lines[row[:, None], nodes], s[nodes]
    outer, inner = s[i + (side > 0)], s[i + (side < 0)]
    for _ in range(52):
        middle = 0.5 * (outer + inner)
        inside = target.margin(lagrange(knots, points, middle)) > 0
        outer, inner = np.where(inside, outer, middle), np.where(inside, middle, inner)
    return np.asarray(0.5 * (outer + inner))
