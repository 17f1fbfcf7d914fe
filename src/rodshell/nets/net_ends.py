"""Where the lines of a net end on a target: runs of inside nodes, cuts between nodes, and the apron past them.

A rod that ends at the rim is free from its last joint on: there it would follow a geodesic, not the net, and its end
would be up to millimetres off. So the net that is bound to a target is continued by an apron, two more rings of joints
past every end, on the surface's smooth continuation, with all the lines that meet there; the apron is cut off
afterwards. Across an opening the net simply continues: the drape ignores it.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf
from typing import NamedTuple

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.geometry.curves import lagrange
from rodshell.kernels import njit
from rodshell.layout import FlatGrid, FlatRod
from rodshell.nets.compass import Net
from rodshell.targets import Target

SQUARE = 5  # nodes each way
RINGS = 2  # of joints: on a 0.2 m hemisphere at 40 mm spacing the ends are 0.1 mm off the net; 0.5 mm with 1 ring


class Cut(NamedTuple):
    """A part of one line that is on the target.

    Parameters
    ----------
    start, end : material coordinates of its ends [m].
    """

    start: float
    end: float


def inside_nodes(target: Target, net: Net) -> Bools:
    """Nodes inside the target's end that are connected with the anchor through inside nodes.

    If the anchor is in an opening, they are connected with the first inside nodes along the axes.

    Parameters
    ----------
    target : the surface.
    net : on it.

    Returns
    -------
    (nu, nv) booleans.
    """
    region = _region(target, net)
    reached = np.zeros_like(region)
    i, j = net.origin
    reached[i, j] = region[i, j]
    if not region[i, j]:
        for axis, seeds in ((region[i:, j], reached[i:, j]), (region[i::-1, j], reached[i::-1, j]),
                            (region[i, j:], reached[i, j:]), (region[i, j::-1], reached[i, j::-1])):  # fmt: skip
            seeds[np.argmax(axis)] = axis.any()
    _connect(region, reached)
    return reached


@njit()
def _connect(region, reached):  # type: ignore[no-untyped-def]
    """Extend the nodes `reached` (nu, nv) to all nodes of the `region` (nu, nv) that are connected with them."""
    nu, nv = region.shape
    stack, top = np.empty((region.size, 2), dtype=np.intp), 0
    for i in range(nu):
        for j in range(nv):
            if reached[i, j]:
                stack[top, 0], stack[top, 1] = i, j
                top += 1
    while top > 0:
        top -= 1
        i, j = stack[top, 0], stack[top, 1]
        for p, q in ((i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)):
            if 0 <= p < nu and 0 <= q < nv and region[p, q] and not reached[p, q]:
                reached[p, q] = True
                stack[top, 0], stack[top, 1] = p, q
                top += 1


def _region(target: Target, net: Net) -> Bools:
    """(nu, nv) nodes inside the target's end.

    A square of nodes whose corners are closer to its middle than the end is needs only one evaluation.
    """
    middles, way = _squares(net.points, net.u, net.v)
    margin = target.margin(net.points[middles[:, 0], middles[:, 1]])
    inside, asked = _by_squares(net.points, middles, np.where(np.abs(margin) > way, margin, 0.0))
    inside[asked[:, 0], asked[:, 1]] = target.margin(net.points[asked[:, 0], asked[:, 1]]) > 0
    return np.asarray(inside)


@njit()
def _squares(points, u, v):  # type: ignore[no-untyped-def]
    """Indices (n, 2) of the middle of each square of nodes that are all known, and path lengths (n,) to its corners."""
    half, count = SQUARE // 2, 0
    middles = np.empty(((len(u) // SQUARE) * (len(v) // SQUARE), 2), dtype=np.intp)
    way = np.empty(len(middles))
    for i in range(half, len(u) - half, SQUARE):
        for j in range(half, len(v) - half, SQUARE):
            if not np.isnan(points[i - half : i + half + 1, j - half : j + half + 1, 0]).any():
                middles[count, 0], middles[count, 1] = i, j
                way[count] = max(u[i + half] - u[i], u[i] - u[i - half]) + max(v[j + half] - v[j], v[j] - v[j - half])
                count += 1
    return middles[:count], way[:count]


@njit()
def _by_squares(points, middles, margin):  # type: ignore[no-untyped-def]
    """Which nodes (nu, nv) are in squares with a positive `margin` (n,), and indices (m, 2) of the known nodes that
    are in no square with a margin other than 0."""
    nu, nv = points.shape[:2]
    half, count = SQUARE // 2, 0
    inside, asked = np.zeros((nu, nv), dtype=np.bool_), np.empty((nu * nv, 2), dtype=np.intp)
    clear = np.zeros((nu, nv), dtype=np.bool_)
    for n in range(len(middles)):
        i, j = middles[n]
        clear[i - half : i + half + 1, j - half : j + half + 1] = margin[n] != 0.0
        inside[i - half : i + half + 1, j - half : j + half + 1] = margin[n] > 0.0
    for i in range(nu):
        for j in range(nv):
            if not clear[i, j] and not np.isnan(points[i, j, 0]):
                asked[count, 0], asked[count, 1] = i, j
                count += 1
    return inside, asked[:count]


class Lines(NamedTuple):
    """Lines of one family of a net.

    Parameters
    ----------
    s : (n,) material coordinates of the nodes along them [m].
    points : (m, n, 3) nodes of each line [m]; NaN where there is none.
    inside : (m, n) which nodes are inside the target's end.
    """

    s: Floats
    points: Floats
    inside: Bools


def cut_lines(target: Target, sets: Sequence[Lines], *, depth: float = 0.0) -> list[list[list[Cut]]]:
    """Cut lines of nets at the target's end, to fourth order between nodes.

    Parameters
    ----------
    target : the surface.
    sets : lines of one family of one net each.
    depth : pieces that are nowhere further inside than this only graze the end and are ignored [m].

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
    """The line, the first and the last node of each run of inside nodes that is `depth` [m] inside somewhere."""
    change = np.diff(lines.inside.astype(np.int8), axis=1, prepend=0, append=0)
    (row, first), last = np.nonzero(change == 1), np.nonzero(change == -1)[1] - 1
    deep = target.margin(lines.points[row, (first + last) // 2]) > depth
    for k in np.flatnonzero(~deep):  # not in the middle, but elsewhere?
        deep[k] = (target.margin(lines.points[row[k], first[k] : last[k] + 1]) > depth).any()
    return row[deep], first[deep], last[deep]


def extrapolated(coarse: list[Cut], fine: list[Cut], step: float) -> tuple[list[Cut], float]:
    """Extrapolate the cuts of one line from two marches (Richardson).

    Each end is matched with the nearest of its kind in the coarse march: where a line grazes the end of the target, the
    marches may find different pieces. An end that only the finer march finds is kept; its error is at most about half
    the gap or piece that the other march does not find, or the distance to its nearest end.

    Parameters
    ----------
    coarse, fine : cuts of the line from the two marches.
    step : distance within which ends are matched [m].

    Returns
    -------
    The cuts, and a bound of the finer march's error [m].
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
        for shift in (-1, 1):  # near the net's limit, four nodes further inside
            lost = ~np.isfinite(points[row[:, None], window[:, None] + np.arange(4), 0]).all(axis=1)
            window = np.where(lost, np.clip(i - 1 + shift, 0, len(s) - 4), window)
        nodes = window[:, None] + np.arange(4)
        gathered.append((s[nodes], points[row[:, None], nodes], s[i + (side > 0)], s[i + (side < 0)]))
    knots, points, outer, inner = (np.concatenate(part) for part in zip(*gathered, strict=True))
    return _bracketed(lambda at, index: target.margin(lagrange(knots[index], points[index], at)), outer, inner)


def _bracketed(margin: Callable[[Floats, Ints], Floats], outer: Floats, inner: Floats) -> Floats:
    """Roots (n,) of functions that are positive at `inner` (n,) and not at `outer` (n,), to round-off.

    `margin(at, index)` evaluates the functions `index` (k,) at `at` (k,). By false position (Illinois): an end that
    does not move twice is weighted by half in the next step. A root that was found is not evaluated again.
    """
    index = np.arange(len(inner))
    below, above = np.minimum(margin(outer, index), 0.0), margin(inner, index)
    tiny = 1e-15 * (np.abs(outer) + np.abs(inner))
    side = np.zeros(len(inner))  # the end that moved last: 1 for the inner, -1 for the outer
    found, at = inner.copy(), inner
    for _ in range(100):
        share = above / (above - below)
        before, at = at, inner + np.where(np.isfinite(share), share, 0.5) * (outer - inner)
        value = margin(at, index)
        found[index] = at
        inside = value > 0
        below = np.where(inside, np.where(side > 0, 0.5, 1.0) * below, value)
        above = np.where(inside, value, np.where(side < 0, 0.5, 1.0) * above)
        outer, inner, side = np.where(inside, outer, at), np.where(inside, at, inner), np.where(inside, 1.0, -1.0)
        left = (np.abs(at - before) > tiny) & (np.abs(outer - inner) > tiny) & (value != 0.0)
        if not left.any():
            break
        index, at, outer, inner, below, above, side, tiny = (
            array[left] for array in (index, at, outer, inner, below, above, side, tiny)
        )
    return found


def with_apron(rods: Sequence[FlatRod], net: Net, lines: tuple[Floats, Floats], clearance: float) -> FlatGrid:
    """The flat grid of rods, each prolonged past both ends.

    Pieces of a line become one rod where the net continues between them. Lines that are crossed only there become
    virtual rods. A rod keeps its end where the net ends.

    Parameters
    ----------
    rods : each from end to end of the target.
    net : in which they lie.
    lines : offsets of the lines of the lattice, see `ChebyshevNet` [m].
    clearance : distance of the first joint past an end from that end, at least [m].
    """
    u, v = lines
    alive = np.isfinite(net.points[np.searchsorted(net.u, u - 1e-12)][:, np.searchsorted(net.v, v - 1e-12), 0])
    families = {"u": _Lines.of(u, v, alive.T), "v": _Lines.of(v, u, alive)}
    spans: dict[tuple[str, int, int], FlatRod] = {}
    for rod in rods:
        key = (rod.family, *families[rod.family].stretch_of(rod))
        known = spans.get(key, rod)
        spans[key] = known.cut(min(known.start, rod.start), max(known.end, rod.end))
    joints = {family: np.zeros(family_lines.live.shape, dtype=bool) for family, family_lines in families.items()}
    for (family, line, _), rod in spans.items():
        stations, live = families[family].stations, families[family].live[line]
        first = int(np.searchsorted(stations, rod.start - clearance, side="right")) - RINGS
        last = int(np.searchsorted(stations, rod.end + clearance, side="left")) + RINGS - 1
        span = np.arange(max(first, 0), min(last, len(stations) - 1) + 1)
        joints[family][line, span[live[span]]] = True
    spanned: dict[tuple[str, int], set[int]] = {}
    for family, line, stretch in spans:
        spanned.setdefault((family, line), set()).add(stretch)
    points = joints["u"] | joints["v"].T
    prolonged = list[FlatRod]()
    for family, table in (("u", points), ("v", points.T)):
        family_lines = families[family]
        for line, offset in enumerate(family_lines.offsets.tolist()):
            stations = family_lines.stations[table[line]]
            stretches = family_lines.stretches[line][table[line]]
            for stretch in sorted(spanned.get((family, line), set()).union(stretches.tolist())):
                prolonged += _prolonged(
                    spans.get((family, line, stretch)), family, offset, stations[stretches == stretch]
                )
    return FlatGrid.of(prolonged)


@dataclass(frozen=True, eq=False)
class _Lines:
    """Lines of one family.

    Parameters
    ----------
    stations : (n,) where they are crossed [m].
    offsets : (m,) [m].
    live : (m, n) where the net has nodes.
    stretches : (m, n) number of the stretch of each node on its line; a stretch ends where the net has no node.
    """

    stations: Floats
    offsets: Floats
    live: Bools
    stretches: Ints

    @staticmethod
    def of(stations: Floats, offsets: Floats, live: Bools) -> "_Lines":
        return _Lines(stations, offsets, live, np.cumsum(~live, axis=1))

    def stretch_of(self, rod: FlatRod) -> tuple[int, int]:
        """The line and the stretch of it on which a rod lies."""
        line = int(np.argmin(np.abs(self.offsets - rod.offset)))
        away = np.where(self.live[line], np.abs(self.stations - 0.5 * (rod.start + rod.end)), np.inf)
        return line, int(self.stretches[line, np.argmin(away)])


def _prolonged(rod: FlatRod | None, family: str, offset: float, joints: Floats) -> list[FlatRod]:
    """A rod from the first to the last joint on its line, including its own ends."""
    if rod is not None:
        return [rod.cut(min(rod.start, *joints), max(rod.end, *joints)) if len(joints) else rod]
    if len(joints) < 2:
        return []
    make = FlatRod.u if family == "u" else FlatRod.v
    return [make(f"apron {family.upper()} {offset:+.4f}", offset, float(joints[0]), float(joints[-1]), virtual=True)]
