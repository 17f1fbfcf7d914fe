"""Rods that meet at a seam: lay a patch's rods such that they end where rods of its neighbours do.

The net of a patch says which two lines run through every point of its surface. Through each point where a
neighbour's rod ends, one of the two becomes a rod: that point's coordinate in the net is the rod's offset. Which of the
two is a matter of spacing, see `choose_families`. Then the net is marched with these lines and their offsets are
corrected, until the rods end at their points.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.layout import FlatRod, GridLayout
from rodshell.layout.flatgrid import Family
from rodshell.nets import ChebyshevNet, chebyshev_net
from rodshell.nets.cuts import inside_nodes
from rodshell.nets.nearby import interpolated
from rodshell.targets import Target

Point = tuple[float, float]
OnHeld = Callable[[Floats], Bools]  # whether points (n, 3) of the end lie on a seam whose rods are given

FAMILIES: tuple[Family, Family] = ("u", "v")
ROUNDS = 4  # three settle
SETTLED = 1e-7  # of the size: what a round moves a rod
SAME = 0.03  # spacings between the offsets of two points: one rod may join them, and misses both by half
CLOSE = 0.03  # spacings: an axis of the net is moved onto a rod that is closer
ROOM = 0.7  # spacings: an axis of the net that no rod comes closer to is a rod itself
NEAR = 0.5  # spacings between a rod's end and its point before offsets are corrected, at most
THERE = 0.05  # spacings between them in the end, at most
UNLIKE = 0.6  # what it costs where a rod is at right angles to the mirror image of the one that it meets
LEAVE_OUT = 1.5  # what it costs to leave a rod out: as much as rods at 0.3 spacings, or at 3.4
APART = 4.0  # spacings along the seam that count as one between rods: past them, rods do not crowd
KEPT = 200  # ways of choosing that are followed at a time


@dataclass(frozen=True)
class Wanted:
    """Ends that rods should have.

    Parameters
    ----------
    points : (n, 3) on seams of the target [m].
    like : (n, 3) unit tangents that the rods should have there, as far as spacing allows.
    rows : indices of the points along each seam, in their order there.
    held : whether points (n, 3) of the target's end lie on one of these seams.
    """

    points: Floats
    like: Floats
    rows: Sequence[Ints]
    held: OnHeld


@dataclass(frozen=True)
class Met:
    """A rod end (side 0 start, 1 end) of a net that lies at the wanted point of this index, `off` it [m]."""

    point: int
    rod: str
    side: int
    off: float


@dataclass(frozen=True)
class Matched:
    """A layout and its net, with the rod ends that lie at wanted points."""

    layout: GridLayout
    anchor: Point
    net: ChebyshevNet
    met: tuple[Met, ...]


@dataclass
class _Line:
    """A line of family u (0) or v (1), at an offset [m], that is to end at some of the points."""

    family: int
    offset: float
    points: list[int]


def match_net(
    target: Target, layout: GridLayout, anchor: Point, wanted: Wanted, *, eccentricity: float = 0.0
) -> Matched:
    """Choose the lines of a layout such that its rods end at the points wanted, one at each; some may stay alone."""
    net = chebyshev_net(target, layout, anchor=anchor, eccentricity=eccentricity)
    place, inside = _coordinates(net, wanted.points), inside_nodes(target, net.net)
    family = np.full(len(place), -1)
    for row in wanted.rows:
        known = row[np.isfinite(place[row, 0])]
        price = np.array([[_price(net, inside, place, k, which, wanted) for which in (0, 1)] for k in known])
        family[known] = choose_families(place[known], wanted.points[known], price.reshape(-1, 2), layout.spacing)
    lines = _through(place, family, layout.spacing)
    met = list[Met]()
    for _ in range(ROUNDS):
        shift = _onto_lines(lines, layout.spacing)
        if np.any(shift):
            x, y, _ = interpolated(net.net, shift[:1], shift[1:])[0, 0].tolist()
            anchor = (x, y)
        laid = replace(layout, lines=(_filled(lines, 0, layout.spacing), _filled(lines, 1, layout.spacing)))
        net = chebyshev_net(target, laid, anchor=anchor, near=net, eccentricity=eccentricity)
        met, moved = _corrected(net, lines, wanted.points)
        if moved < SETTLED * target.size:
            break
    return Matched(laid, anchor, net, tuple(one for one in met if one.off < THERE * min(layout.spacing)))


def _coordinates(net: ChebyshevNet, points: Floats) -> Floats:
    """(n, 2) u, v of points (n, 3) of the surface in a net, to second order between its nodes; NaN far from it."""
    from scipy.spatial import cKDTree

    flat = net.net.points.reshape(-1, 3)
    known = np.flatnonzero(np.isfinite(flat[:, 0]))
    away, nearest = cKDTree(flat[known]).query(points)
    nodes = np.column_stack(np.unravel_index(known[nearest], net.net.points.shape[:2]))
    result = np.column_stack([net.net.u[nodes[:, 0]], net.net.v[nodes[:, 1]]])
    result += _steps(net, nodes, points - flat[known[nearest]])
    result[away > min(net.layout.spacing)] = np.nan
    return result


def _steps(net: ChebyshevNet, nodes: Ints, by: Floats) -> Floats:
    """(n, 2) steps of u, v that move a net's nodes (n, 2) by `by` (n, 3) [m], within the surface."""
    grid = net.net
    along = np.empty((len(nodes), 3, 2))
    for axis, knots in enumerate((grid.u, grid.v)):
        ends = []
        for way in (-1, 1):
            there = nodes.copy()
            there[:, axis] = np.clip(nodes[:, axis] + way, 0, len(knots) - 1)
            lost = ~np.isfinite(grid.points[there[:, 0], there[:, 1], 0])
            there[lost] = nodes[lost]
            ends.append(there)
        low, high = ends
        run = knots[high[:, axis]] - knots[low[:, axis]]
        chord = grid.points[high[:, 0], high[:, 1]] - grid.points[low[:, 0], low[:, 1]]
        along[:, :, axis] = chord / np.maximum(run, 1e-300)[:, None]
    square = np.einsum("nik,nil->nkl", along, along)
    return np.asarray(np.linalg.solve(square, np.einsum("nik,ni->nk", along, by)[..., None])[..., 0])


def _price(net: ChebyshevNet, inside: Bools, place: Floats, k: int, family: int, wanted: Wanted) -> float:
    """What the rod of a family through point k costs: little where it is the mirror image of the one that it meets, for
    then both are short or both are long; infinitely much where it would end on a held seam again, at no other point.
    """
    at, offset, across = place[k, family], place[k, 1 - family], 1 - family
    knots, lines = (net.net.u, net.net.v) if family == 0 else (net.net.v, net.net.u)
    line = int(np.argmin(np.abs(lines - offset)))
    mask, points = (inside[:, line], net.net.points[:, line]) if family == 0 else (inside[line], net.net.points[line])
    edges = np.diff(np.concatenate([[0], mask.astype(np.int8), [0]]))
    runs = np.column_stack([np.flatnonzero(edges == 1), np.flatnonzero(edges == -1) - 1])
    away = np.abs(knots[runs] - at)
    if not len(runs) or away.min() > NEAR * net.layout.spacing[across]:
        return np.inf
    run, side = np.unravel_index(np.argmin(away), away.shape)
    other = int(runs[run, 1 - side])
    if wanted.held(points[[other]])[0]:
        partners = np.abs(place[:, across] - offset) < SAME * net.layout.spacing[family]
        partners &= np.abs(place[:, family] - knots[other]) < NEAR * net.layout.spacing[across]
        if not np.any(partners & (np.arange(len(place)) != k)):
            return np.inf
    step = np.eye(2)[family] * net.layout.edge / 2
    low, high = (interpolated(net.net, uv[:1], uv[1:])[0, 0] for uv in (place[k] - step, place[k] + step))
    cosine = (high - low) @ wanted.like[k] / np.linalg.norm(high - low)
    return float(UNLIKE * (1.0 - cosine**2))


def _through(place: Floats, family: Ints, spacing: tuple[float, float]) -> list[_Line]:
    """The lines of the chosen families through the points; nearly equal offsets are one line."""
    lines = list[_Line]()
    for which in (0, 1):
        mine = np.flatnonzero(family == which)
        ordered = mine[np.argsort(place[mine, 1 - which])]
        offsets = place[ordered, 1 - which]
        for group in np.split(np.arange(len(mine)), np.flatnonzero(np.diff(offsets) > SAME * spacing[which]) + 1):
            if len(group):
                lines.append(_Line(which, float(offsets[group].mean()), ordered[group].tolist()))
    return lines


def _onto_lines(lines: list[_Line], spacing: tuple[float, float]) -> Floats:
    """(2,) by which the anchor moves in u, v so that axes that all but lie on lines do; the lines' offsets follow."""
    shift = np.zeros(2)
    for family in (0, 1):
        nearest = min((line.offset for line in lines if line.family == family), key=abs, default=np.inf)
        if abs(nearest) < CLOSE * spacing[family]:
            shift[1 - family] = nearest
    for line in lines:
        line.offset -= float(shift[1 - line.family])
    return shift


def _filled(lines: list[_Line], family: int, spacing: tuple[float, float]) -> tuple[float, ...]:
    """Ascending offsets of the lines of a family, with evenly spread ones between where they lie too far apart."""
    offsets = sorted({line.offset for line in lines if line.family == family})
    if not offsets:
        return ()
    if min(map(abs, offsets)) > ROOM * spacing[family]:
        offsets = sorted([*offsets, 0.0])
    result = offsets[:1]
    for low, high in pairwise(offsets):
        result += np.linspace(low, high, max(1, round((high - low) / spacing[family])) + 1)[1:].tolist()
    return tuple(result)


def _corrected(net: ChebyshevNet, lines: list[_Line], points: Floats) -> tuple[list[Met], float]:
    """The rod ends at the points, and by how much at most the lines were moved then, to end there [m]."""
    met, most = list[Met](), 0.0
    for line in lines:
        family = FAMILIES[line.family]
        rods = [rod for rod in net.rods if rod.family == family and abs(rod.offset - line.offset) < 1e-12]
        ends, places = rod_ends(net, rods), [place for rod in rods for place in (rod.start, rod.end)]
        steps = list[float]()
        for k in line.points if rods else ():
            away = np.linalg.norm(ends - points[k], axis=1)
            end = int(np.argmin(away))
            if away[end] < NEAR * min(net.layout.spacing):
                met.append(Met(k, rods[end // 2].name, end % 2, float(away[end])))
                place = (places[end], line.offset) if line.family == 0 else (line.offset, places[end])
                node = [np.argmin(np.abs(knots - at)) for knots, at in zip((net.net.u, net.net.v), place, strict=True)]
                steps.append(float(_steps(net, np.array([node]), points[[k]] - ends[end])[0, 1 - line.family]))
        if steps:
            line.offset += float(np.mean(steps))
            most = max(most, abs(float(np.mean(steps))))
    return met, most


def rod_ends(net: ChebyshevNet, rods: Sequence[FlatRod]) -> Floats:
    """(2m, 3) start and end of each rod in turn on a net [m]."""
    ends = [net.positions(rod, np.array([rod.start, rod.end])) for rod in rods]
    return np.concatenate([np.empty((0, 3)), *ends])


def choose_families(place: Floats, points: Floats, price: Floats, spacing: tuple[float, float]) -> Ints:
    """(n,) family of the rod at each of the points (n, 3) along a seam: 0 u, 1 v, -1 none.

    Rods of one family should lie neither crowded nor far apart, so the sum of the squared logarithms of the distances
    between neighbours over the spacing is made smallest, together with the prices (n, 2) of u and v at each point: from
    point to point, by the last rod of either family.

    place : (n, 2) u, v of the points [m]. The offset of a rod of family u is its v.
    """
    offset = place[:, ::-1] / np.array(spacing)
    winding = _running(np.abs(np.diff(offset, axis=0)))
    run = _running(np.linalg.norm(np.diff(points, axis=0), axis=1)[:, None])[:, 0] / (APART * max(spacing))
    best: dict[tuple[int, int], tuple[float, tuple[int, ...]]] = {(-1, -1): (0.0, ())}
    for k in range(len(place)):
        ahead: dict[tuple[int, int], tuple[float, tuple[int, ...]]] = {}
        for last, (cost, chosen) in best.items():
            for family in (0, 1, -1):
                state, more = last, LEAVE_OUT
                if family >= 0:
                    state = (k, last[1]) if family == 0 else (last[0], k)
                    more = float(price[k, family])
                    before = last[family]
                    if before >= 0:
                        apart = max(winding[k, family] - winding[before, family], run[k] - run[before], 1e-9)
                        more += float(np.log(apart) ** 2)
                if cost + more < ahead.get(state, (np.inf,))[0]:
                    ahead[state] = (cost + more, (*chosen, family))
        best = dict(sorted(ahead.items(), key=lambda one: one[1][0])[:KEPT])
    return np.array(min(best.values())[1], dtype=np.intp)


def _running(steps: Floats) -> Floats:
    """Sums (n + 1, k) of the steps (n, k) so far."""
    return np.vstack([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
