"""End matching: choose the rods of a patch such that they end where the rods of its neighbours do, at a seam.

The net of a patch says which two lines run through every point of its surface. Through each point where a
neighbour's rod ends, one of the two becomes a rod: that point's coordinate in the net is the rod's offset. Which of the
two depends on the spacing, see `choose_families`. Then the net is marched with these lines and their offsets are
corrected, until the rods end at their points.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from scipy.spatial import cKDTree

from rodshell.arrays import Bools, Floats, Ints
from rodshell.layout import FlatRod, GridLayout
from rodshell.layout.gridlayout import FAMILIES
from rodshell.nets import ChebyshevNet, chebyshev_net
from rodshell.nets.net_ends import inside_nodes
from rodshell.nets.net_refinement import interpolated
from rodshell.targets import Target

Point = tuple[float, float]
_OnSeam = Callable[[Floats], Bools]  # whether points (k, 3) of the end lie on a seam whose rods are given

ROUNDS = 4  # of corrections; three are enough
SETTLED = 1e-7  # of the size: largest move of a rod in the last round
SAME = 0.03  # spacings between the offsets of two points: a single rod may join them, and misses both by half
CLOSE = 0.03  # spacings: an axis of the net is moved onto a rod that is closer
ROOM = 0.7  # spacings: an axis of the net that no rod comes closer to is a rod itself
NEAR = 0.5  # spacings: largest distance between a rod's end and its point before offsets are corrected
THERE = 0.05  # spacings: largest distance between them in the end
UNLIKE = 0.6  # cost where a rod is at right angles to the mirror image of the one that it meets
LEAVE_OUT = 1.5  # cost of leaving a rod out: that of rods 0.3 spacings apart, or 3.4
APART = 4.0  # spacings along the seam that are equivalent to one spacing across rods: further apart, none crowd
KEPT = 200  # partial choices that are kept from point to point


@dataclass(frozen=True, eq=False)
class EndGoals:
    """Points where rods should end.

    Args:
        points: (n, 3) on seams of the target [m].
        tangents: (n, 3) unit tangents that the rods should have there, as far as spacing allows.
        rows: indices of the points along each seam, in their order there.
        on_seam: whether points (k, 3) of the target's end lie on one of these seams, as a mask (k,).
    """

    points: Floats
    tangents: Floats
    rows: Sequence[Ints]
    on_seam: _OnSeam


@dataclass(frozen=True)
class MatchedEnd:
    """A rod end of a net that lies at one of the points where rods should end.

    Args:
        side: 0 at its start, 1 at its end.
        distance: from the point [m].
    """

    point: int
    rod: str
    side: int
    distance: float


@dataclass
class _Line:
    """A line of family u (0) or v (1), at an offset [m], that is to end at some of the points."""

    family: int
    offset: float
    points: list[int]


def match_net(
    target: Target, layout: GridLayout, anchor: Point, goals: EndGoals, *, eccentricity: float = 0.0
) -> tuple[GridLayout, Point, ChebyshevNet, tuple[MatchedEnd, ...]]:
    """Choose the lines of a layout such that its rods end at the goals, one at each; goals may remain without a rod.

    Args:
        anchor: x, y of the point of the target under the layout's middle [m].
        eccentricity: distance of the layers of families u and v [m].

    Returns:
        The layout, its anchor and its net, and the rod ends that lie at goals.

    Raises:
        NetLimitError: no net covers the target from this anchor and heading.
    """
    net = chebyshev_net(target, layout, anchor=anchor, eccentricity=eccentricity)
    uv, inside = _coordinates(net, goals.points), inside_nodes(target, net.net)
    family = np.full(len(uv), -1)
    for row in goals.rows:
        known = row[np.isfinite(uv[row, 0])]
        price = np.array([[_price(net, inside, uv, k, axis, goals) for axis in (0, 1)] for k in known])
        family[known] = choose_families(uv[known], goals.points[known], price.reshape(-1, 2), layout.spacing)
    lines = _lines_through(uv, family, layout.spacing)
    matched = list[MatchedEnd]()
    for _ in range(ROUNDS):
        shift = _shift_onto_lines(lines, layout.spacing)
        if np.any(shift):
            x, y, _ = interpolated(net.net, shift[:1], shift[1:])[0, 0].tolist()
            anchor = (x, y)
        laid = replace(layout, lines=(_filled(lines, 0, layout.spacing), _filled(lines, 1, layout.spacing)))
        net = chebyshev_net(target, laid, anchor=anchor, warm_start=net, eccentricity=eccentricity)
        matched, moved = _corrected(net, lines, goals.points)
        if moved < SETTLED * target.size:
            break
    close = tuple(end for end in matched if end.distance < THERE * min(layout.spacing))
    return laid, anchor, net, close


def _coordinates(net: ChebyshevNet, points: Floats) -> Floats:
    """(n, 2) u, v of points (n, 3) of the surface in a net, to second order between its nodes; NaN far from it."""
    flat = net.net.points.reshape(-1, 3)
    known = np.flatnonzero(np.isfinite(flat[:, 0]))
    away, nearest = cKDTree(flat[known]).query(points)
    nodes = np.column_stack(np.unravel_index(known[nearest], net.net.points.shape[:2]))
    result = np.column_stack([net.net.u[nodes[:, 0]], net.net.v[nodes[:, 1]]])
    result += _steps(net, nodes, points - flat[known[nearest]])
    result[away > min(net.layout.spacing)] = np.nan
    return result


def _steps(net: ChebyshevNet, nodes: Ints, displacement: Floats) -> Floats:
    """(n, 2) steps of u, v that move a net's nodes (n, 2) by a displacement (n, 3) [m], within the surface."""
    grid = net.net
    along = np.empty((len(nodes), 3, 2))
    for axis, knots in enumerate((grid.u, grid.v)):
        ends = []
        for step in (-1, 1):
            there = nodes.copy()
            there[:, axis] = np.clip(nodes[:, axis] + step, 0, len(knots) - 1)
            lost = ~np.isfinite(grid.points[there[:, 0], there[:, 1], 0])
            there[lost] = nodes[lost]
            ends.append(there)
        low, high = ends
        run = knots[high[:, axis]] - knots[low[:, axis]]
        chord = grid.points[high[:, 0], high[:, 1]] - grid.points[low[:, 0], low[:, 1]]
        along[:, :, axis] = chord / np.maximum(run, 1e-300)[:, None]
    square = np.einsum("nik,nil->nkl", along, along)
    return np.asarray(np.linalg.solve(square, np.einsum("nik,ni->nk", along, displacement)[..., None])[..., 0])


def _price(net: ChebyshevNet, inside: Bools, uv: Floats, k: int, family: int, goals: EndGoals) -> float:
    """Cost of the rod of a family through point k: small where it is the mirror image of the one that it meets, since
    then both are short or both are long; infinite where it would end on such a seam again, at no other point.
    """
    at, offset, across = uv[k, family], uv[k, 1 - family], 1 - family
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
    if goals.on_seam(points[[other]])[0]:
        partners = np.abs(uv[:, across] - offset) < SAME * net.layout.spacing[family]
        partners &= np.abs(uv[:, family] - knots[other]) < NEAR * net.layout.spacing[across]
        if not np.any(partners & (np.arange(len(uv)) != k)):
            return np.inf
    step = np.eye(2)[family] * net.layout.edge / 2
    low, high = (interpolated(net.net, there[:1], there[1:])[0, 0] for there in (uv[k] - step, uv[k] + step))
    cosine = (high - low) @ goals.tangents[k] / np.linalg.norm(high - low)
    return float(UNLIKE * (1.0 - cosine**2))


def _lines_through(uv: Floats, family: Ints, spacing: tuple[float, float]) -> list[_Line]:
    """The lines of the chosen families through the points; nearly equal offsets are one line."""
    lines = list[_Line]()
    for axis in (0, 1):
        chosen = np.flatnonzero(family == axis)
        ordered = chosen[np.argsort(uv[chosen, 1 - axis])]
        offsets = uv[ordered, 1 - axis]
        for group in np.split(np.arange(len(chosen)), np.flatnonzero(np.diff(offsets) > SAME * spacing[axis]) + 1):
            if len(group):
                lines.append(_Line(axis, float(offsets[group].mean()), ordered[group].tolist()))
    return lines


def _shift_onto_lines(lines: list[_Line], spacing: tuple[float, float]) -> Floats:
    """(2,) step of the anchor in u, v [m] by which axes that nearly lie on lines come to lie on them.

    The lines' offsets are changed with it.
    """
    shift = np.zeros(2)
    for family in (0, 1):
        nearest = min((line.offset for line in lines if line.family == family), key=abs, default=np.inf)
        if abs(nearest) < CLOSE * spacing[family]:
            shift[1 - family] = nearest
    for line in lines:
        line.offset -= float(shift[1 - line.family])
    return shift


def _filled(lines: list[_Line], family: int, spacing: tuple[float, float]) -> tuple[float, ...]:
    """Ascending offsets of the lines of a family [m], with evenly spread offsets in gaps that are too wide."""
    offsets = sorted({line.offset for line in lines if line.family == family})
    if not offsets:
        return ()
    if min(map(abs, offsets)) > ROOM * spacing[family]:
        offsets = sorted([*offsets, 0.0])
    result = offsets[:1]
    for low, high in pairwise(offsets):
        result += np.linspace(low, high, max(1, round((high - low) / spacing[family])) + 1)[1:].tolist()
    return tuple(result)


def _corrected(net: ChebyshevNet, lines: list[_Line], points: Floats) -> tuple[list[MatchedEnd], float]:
    """Move the lines such that they end at the points; return the rod ends before that, and the largest move [m]."""
    matched, most = list[MatchedEnd](), 0.0
    for line in lines:
        rods = [
            rod
            for rod in net.rods
            if rod.family == FAMILIES[line.family] and rod.offset is not None and abs(rod.offset - line.offset) < 1e-12
        ]
        ends, stations = rod_ends(net, rods), [s for rod in rods for s in (rod.start, rod.end)]
        steps = list[float]()
        for k in line.points if rods else ():
            away = np.linalg.norm(ends - points[k], axis=1)
            end = int(np.argmin(away))
            if away[end] < NEAR * min(net.layout.spacing):
                matched.append(MatchedEnd(k, rods[end // 2].name, end % 2, float(away[end])))
                uv = (stations[end], line.offset) if line.family == 0 else (line.offset, stations[end])
                node = [np.argmin(np.abs(knots - at)) for knots, at in zip((net.net.u, net.net.v), uv, strict=True)]
                steps.append(float(_steps(net, np.array([node]), points[[k]] - ends[end])[0, 1 - line.family]))
        if steps:
            line.offset += float(np.mean(steps))
            most = max(most, abs(float(np.mean(steps))))
    return matched, most


def rod_ends(net: ChebyshevNet, rods: Sequence[FlatRod]) -> Floats:
    """(2m, 3) start and end of each rod in turn on a net [m]."""
    ends = [net.positions(rod, np.array([rod.start, rod.end])) for rod in rods]
    return np.concatenate([np.empty((0, 3)), *ends])


def choose_families(coordinates: Floats, points: Floats, price: Floats, spacing: tuple[float, float]) -> Ints:
    """(n,) family of the rod at each of the points (n, 3) along a seam: 0 u, 1 v, -1 none.

    Rods of one family should lie neither crowded nor far apart, so the sum of the squared logarithms of the distances
    between neighbours over the spacing is minimised, plus the price of the choice at each point: by dynamic programming
    along the seam, whose state is the last rod of either family.

    Args:
        coordinates: (n, 2) u, v of the points in the net [m]; the offset of a rod of family u is its v.
        points: (n, 3) along the seam [m].
        price: (n, 2) cost of family u and of family v at each point [-].
        spacing: of families u and v [m].
    """
    offset = coordinates[:, ::-1] / np.array(spacing)
    winding = _running(np.abs(np.diff(offset, axis=0)))
    run = _running(np.linalg.norm(np.diff(points, axis=0), axis=1)[:, None])[:, 0] / (APART * max(spacing))
    best: dict[tuple[int, int], tuple[float, tuple[int, ...]]] = {(-1, -1): (0.0, ())}
    for k in range(len(coordinates)):
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
        best = dict(sorted(ahead.items(), key=lambda state: state[1][0])[:KEPT])
    return np.array(min(best.values())[1], dtype=np.intp)


def _running(steps: Floats) -> Floats:
    """Sums (n + 1, k) of the steps (n, k) so far."""
    return np.vstack([np.zeros((1, steps.shape[1])), np.cumsum(steps, axis=0)])
