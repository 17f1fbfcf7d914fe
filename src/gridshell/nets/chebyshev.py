"""The inextensible net of a layout on a target, and the footprint that it cuts out of the flat grid.

Two crossing geodesics through the anchor determine the net (`compass`). It is marched at two steps, cut at
the target's end and extrapolated (Richardson), so that each rod end is known far better than the mesh of any
mechanical model; the difference of the two marches estimates the error. Lines of the lattice that are not
built still shape the net: they are kept as virtual rods.
"""

from dataclasses import dataclass
from math import cos, degrees, sin
from string import ascii_lowercase

import numba as nb
import numpy as np
from numpy.typing import NDArray

from gridshell.errors import InputError, NetLimitError
from gridshell.geometry.curves import on_curve
from gridshell.layout import FlatRod, GridLayout
from gridshell.layout.flatgrid import Family
from gridshell.layout.gridlayout import auto_edge, rod_name
from gridshell.layout.mesh import edge_counts
from gridshell.nets.compass import Net, axes, geodesics, march
from gridshell.nets.cuts import Cut, Lines, cut_lines, extrapolated, inside_nodes
from gridshell.nets.nearby import march_near
from gridshell.targets import Target
from gridshell.units import length_text

Floats = NDArray[np.float64]

MARGIN = 2.3  # spacings marched past the end of the target: a cut is interpolated between nodes on both sides
SMALLEST_ANGLE = 10.0  # degrees; no gridshell can be built beyond
SEARCHES = (2, 4, 8)  # steps to a spacing of the march that finds the lines; more where the net itself goes further
LOOSE = 0.05  # spacings: ends known no better than that are warned of
GRAZING = 0.01  # spacings: a line that comes no further inside runs along the end, and does not count
MOST_NODES = 4_000_000


@dataclass(frozen=True)
class ChebyshevNet:
    """The net of a layout on a target.

    Parameters
    ----------
    rods : rods and virtual rods, each from end to end of the target: the footprint G0.
    lines : (u, v) offsets of all lines of the lattice near the target: `lines[0]` are the u at which lines of
        family v lie, `lines[1]` the v of family u [m].
    net : the finer march, from which positions are taken.
    error_estimate : largest |G0(fine) - G0(coarse)| / 3 over all rod ends [m]: the error before extrapolation.
    min_angle : smallest angle between the families on the target [rad], at the point `min_angle_at` (3,) [m].
    dropped : rods of the layout that are not in `rods`, with the reason.
    warnings : sentences.
    """

    target: Target
    layout: GridLayout
    rods: tuple[FlatRod, ...]
    lines: tuple[Floats, Floats]
    net: Net
    error_estimate: float
    min_angle: float
    min_angle_at: tuple[float, float, float]
    dropped: tuple[tuple[str, str], ...]
    warnings: tuple[str, ...]

    def positions(self, rod: FlatRod, s: Floats) -> Floats:
        """Points (n, 3) of the net at material coordinates `s` (n,) of a rod, by local cubics [m]."""
        if rod.family == "u":
            knots, points = self.net.u, self.net.points[:, int(np.argmin(np.abs(self.net.v - rod.offset)))]
        else:
            knots, points = self.net.v, self.net.points[int(np.argmin(np.abs(self.net.u - rod.offset)))]
        known = np.flatnonzero(np.isfinite(points[:, 0]))
        return on_curve(knots[known], points[known], s)


def chebyshev_net(
    target: Target,
    layout: GridLayout,
    *,
    anchor: tuple[float, float] | None = None,
    near: ChebyshevNet | None = None,
) -> ChebyshevNet:
    """March the net of `layout` over `target` and cut it at the target's end.

    Parameters
    ----------
    anchor : x, y of the point of the target where the two axes cross [m]; default: the target's highest point.
    near : a net that may be similar, from which this one is found sooner; it is the same without.

    Raises
    ------
    NetLimitError : the crossing angle falls to 10 degrees or the march fails inside the target; names the place.
    InputError : the anchor lies outside, the spacing is too large, or a rod is too short to reach the end.
    """
    start, heading = _start(target, layout, anchor)
    if max(layout.spacing) >= 2 * target.size:
        raise InputError(
            f"the spacing {max(layout.spacing):g} m is larger than the target, which is {2 * target.size:g} m wide: "
            "use a smaller spacing"
        )
    for parts in SEARCHES:
        lines, rough = _find_lines(target, layout, start, heading, near.net if near else None, parts)
        _refuse_too_many(target, layout, lines)
        coarse = _march_lines(target, layout, lines, start, heading, 1, rough)
        fine = _march_lines(target, layout, lines, start, heading, 2, coarse, rough)
        inside = inside_nodes(target, fine)
        if not (inside[[0, -1]].any() or inside[:, [0, -1]].any()):
            break
    else:
        raise InputError(
            f"the target bends too sharply for a spacing of {max(layout.spacing):g} m: use a smaller spacing"
        )
    _refuse_holes(fine, inside)
    angle, where = _smallest_angle(target, fine, inside)
    if degrees(angle) < SMALLEST_ANGLE:
        raise _net_limit(where, f"the families meet at only {degrees(angle):.1f} degrees")
    ends, error, loosest = _extrapolate(target, lines, (coarse, fine), inside, GRAZING * min(layout.spacing))
    rods, dropped, warnings = _name_rods(layout, lines, ends)
    if error > LOOSE * min(layout.spacing):
        x, y, z = np.where(np.abs(loosest) < 1e-6 * target.size, 0.0, loosest)
        warnings.append(
            f"rod ends on the line through ({x:.4g}, {y:.4g}, {z:.4g}) m are known within {error:.3g} m only: the "
            "target bends too sharply for the steps of the march, or the line runs along its end; use a smaller "
            "spacing or shorter edges"
        )
    _require_length(layout, rods)
    return ChebyshevNet(
        target, layout, rods, (lines.u, lines.v), fine, error, angle, where, tuple(dropped), tuple(warnings)
    )


def _start(target: Target, layout: GridLayout, anchor: tuple[float, float] | None) -> tuple[Floats, Floats]:
    """The anchor lifted vertically onto the target, and the tangent that points along the heading in plan."""
    x, y = anchor if anchor is not None else target.summit
    other = "leave it out for the highest point, or let a search choose (--anchor auto)"
    try:
        point = target.lift(np.array([[x, y]]))
    except InputError as reason:
        raise InputError(f"the anchor: {reason}, {other}") from None
    if not target.carries(point)[0]:
        raise InputError(f"the anchor ({x:g}, {y:g}) m lies outside the target: choose a point inside its rim, {other}")
    n = target.on_surface(point).normal[0]
    plan = np.array([cos(layout.rotate), sin(layout.rotate)])
    return point[0], np.array([*plan * n[2], -plan @ n[:2]])


@dataclass(frozen=True)
class _Lines:
    """Offsets of all lines of one march: `u` are those of family v (they cross the u axis), `v` those of u."""

    u: Floats
    v: Floats


def _find_lines(
    target: Target, layout: GridLayout, start: Floats, heading: Floats, near: Net | None, parts: int
) -> tuple[_Lines, Net]:
    """All lattice lines that can touch the target, with `MARGIN` spacings to spare; and the march that found them, in
    so many parts of a spacing."""
    step = np.array(layout.spacing[::-1]) / parts  # along u, the lines of family v: their spacing
    spare = MARGIN * parts * np.repeat(step, 2)
    if near is not None:  # towards -u, +u, -v, +v
        reach = np.minimum([-near.u[0], near.u[-1], -near.v[0], near.v[-1]], 4 * target.size)
    else:
        reach = _length_of_axes(target, start, heading) + spare
    for _ in range(12):
        u, v = (
            np.arange(-np.ceil(reach[2 * k] / step[k]), np.ceil(reach[2 * k + 1] / step[k]) + 1) * step[k]
            for k in (0, 1)
        )
        if len(u) * len(v) > MOST_NODES / 10:
            raise InputError(
                f"the net needs more than {len(u) // parts} x {len(v) // parts} lines, "
                f"{length_text(min(layout.spacing))} apart on a target {length_text(2 * target.size)} wide: check its "
                f"unit, or use {_coarser(target)}"
            )
        net = march_near(target, u, v, start, heading, near) if near else march(target, u, v, start, heading)
        inside = inside_nodes(target, net)
        if not inside.any():
            raise InputError("no node of the net lies inside the target: move the anchor away from the rim")
        touched_u, touched_v = np.flatnonzero(inside.any(axis=1)), np.flatnonzero(inside.any(axis=0))
        needed = np.array([-u[touched_u[0]], u[touched_u[-1]], -v[touched_v[0]], v[touched_v[-1]]])
        needed += spare
        if np.all(needed <= reach + 1e-12):
            break
        reach = np.where(needed > reach, np.maximum(needed, 1.5 * reach), reach)
        near = net
    return _Lines(_lattice(layout, "v", needed[0], needed[1]), _lattice(layout, "u", needed[2], needed[3])), net


def _length_of_axes(target: Target, start: Floats, heading: Floats) -> Floats:
    """How far the axes run inside the target, towards -u, +u, -v and +v [m]; at most twice its size, roughly."""
    step = 0.1 * target.size
    arms = geodesics(target, np.tile(start, (4, 1)), axes(target, start, heading), [np.full(20, step)] * 4)
    inside = target.margin(np.concatenate(arms)).reshape(4, -1) > 0
    last = np.where(inside.any(axis=1), inside.shape[1] - np.argmax(inside[:, ::-1], axis=1), 0)
    return step * (1.0 + last[[1, 0, 3, 2]])


def _lattice(layout: GridLayout, family: Family, below: float, above: float) -> Floats:
    """Offsets of the lattice lines of a family between -below and above, with the axis."""
    spacing = layout.spacing[0 if family == "u" else 1]
    offsets = layout.lattice(family, -below, above)
    offsets[np.abs(offsets) < 1e-9 * spacing] = 0.0
    return offsets if (offsets == 0.0).any() else np.sort(np.append(offsets, 0.0))


def _march_lines(
    target: Target, layout: GridLayout, lines: _Lines, start: Floats, heading: Floats, refine: int, *near: Net
) -> Net:
    u, v = (_subdivide(offsets, layout.edge, refine) for offsets in (lines.u, lines.v))
    return march_near(target, u, v, start, heading, *near)


def _refuse_too_many(target: Target, layout: GridLayout, lines: _Lines) -> None:
    """Before the finer march takes memory for nodes that are too many."""
    counts = [len(_subdivide(offsets, layout.edge, 2)) for offsets in (lines.u, lines.v)]
    if counts[0] * counts[1] > MOST_NODES:
        auto = auto_edge(layout.spacing)
        fine = layout.edge < 0.99 * auto
        remedy = f'set layout.edge = "auto" ({length_text(auto)} here)' if fine else f"use {_coarser(target)}"
        raise InputError(
            f"the net would have {counts[0]} x {counts[1]} nodes, with edges of {length_text(layout.edge)} on a target "
            f"{length_text(2 * target.size)} wide: check its unit, or {remedy}"
        )


def _coarser(target: Target) -> str:
    return f"a larger spacing, such as {length_text(target.size / 8)}"


def _subdivide(offsets: Floats, edge: float, refine: int) -> Floats:
    """Three steps or more from line to line, twice as many where `refine` is 2, meeting the nodes of the mesh."""
    edges = edge_counts(np.diff(offsets), edge)
    steps = refine * np.where((edges % 2 == 0) & (edges >= 6), edges // 2, np.maximum(3, edges))
    span = np.repeat(np.arange(len(edges)), steps)
    along = np.arange(len(span)) - np.repeat(np.cumsum(steps) - steps, steps)
    return np.append(offsets[span] + np.diff(offsets)[span] * along / steps[span], offsets[-1])


def _refuse_holes(net: Net, inside: NDArray[np.bool_]) -> None:
    """A node that the march could not find next to one inside the target: the net ends there."""
    lost = ~np.isfinite(net.points[:, :, 0])
    beside = np.zeros_like(inside)
    beside[:-1] |= lost[1:]
    beside[1:] |= lost[:-1]
    beside[:, :-1] |= lost[:, 1:]
    beside[:, 1:] |= lost[:, :-1]
    holes = np.argwhere(beside & inside)
    if len(holes):
        i, j = holes[np.argmin(np.abs(net.u[holes[:, 0]]) + np.abs(net.v[holes[:, 1]]))]
        raise _net_limit(tuple(net.points[i, j].tolist()), "the rods of the two families become parallel")


def _net_limit(where: tuple[float, float, float], what: str) -> NetLimitError:
    x, y, z = where
    return NetLimitError(
        f"no inextensible net covers this target: near ({x:.4g}, {y:.4g}, {z:.4g}) m {what}; "
        "use a smaller part of the target (a higher base, or seams), or another anchor or heading; a larger spacing "
        "does not help"
    )


def _smallest_angle(target: Target, net: Net, inside: NDArray[np.bool_]) -> tuple[float, tuple[float, float, float]]:
    """Smallest angle between the families over the inside nodes [rad], from central differences."""
    i, j = _sharpest(net.points, inside)
    along, across = net.points[i + 1, j] - net.points[i - 1, j], net.points[i, j + 1] - net.points[i, j - 1]
    x, y, z = net.points[i, j].tolist()
    return float(np.arctan2(np.linalg.norm(np.cross(along, across)), abs(along @ across))), (x, y, z)


@nb.njit(cache=True, error_model="numpy")
def _sharpest(points, inside):  # type: ignore[no-untyped-def]
    """Indices of the inside node with the smallest angle, which has the largest cosine."""
    i_found, j_found, largest = 0, 0, -1.0
    for i in range(1, len(inside) - 1):
        for j in range(1, inside.shape[1] - 1):
            if inside[i, j]:
                aa, ab, bb = 0.0, 0.0, 0.0
                for k in range(3):
                    a, b = points[i + 1, j, k] - points[i - 1, j, k], points[i, j + 1, k] - points[i, j - 1, k]
                    aa, ab, bb = aa + a * a, ab + a * b, bb + b * b
                if ab * ab > largest * aa * bb:
                    i_found, j_found, largest = i, j, ab * ab / (aa * bb)
    return i_found, j_found


@dataclass(frozen=True)
class _Ends:
    """Pieces of the lines of both families, extrapolated."""

    u: list[list[Cut]]
    v: list[list[Cut]]


def _extrapolate(
    target: Target, lines: _Lines, nets: tuple[Net, Net], inside_fine: NDArray[np.bool_], depth: float
) -> tuple[_Ends, float, Floats]:
    """The pieces of all lines, the largest error of an end before extrapolation [m], and a point of that line."""
    sets = list[Lines]()
    for net in nets:
        inside = inside_fine if net is nets[1] else inside_nodes(target, net)
        row, column = np.searchsorted(net.u, lines.u - 1e-12), np.searchsorted(net.v, lines.v - 1e-12)
        sets.append(Lines(net.u, net.points[:, column].transpose(1, 0, 2), inside[:, column].T))
        sets.append(Lines(net.v, net.points[row], inside[row]))
    cuts = cut_lines(target, sets, depth=depth)
    step = max(np.diff(nets[0].u).max(), np.diff(nets[0].v).max())
    error, where = 0.0, nets[1].points[nets[1].origin]
    families = list[list[list[Cut]]]()
    for coarse, fine, (_, points, _) in zip(cuts[:2], cuts[2:], sets[2:], strict=True):
        both = [extrapolated(rough, exact, step) for rough, exact in zip(coarse, fine, strict=True)]
        families.append([pieces for pieces, _ in both])
        worst = int(np.argmax([missed for _, missed in both]))
        if both[worst][1] > error:
            error, known = both[worst][1], points[worst][np.isfinite(points[worst][:, 0])]
            where = known[np.argmin(np.abs(target.margin(known)))]
    return _Ends(*families), error, where


def _name_rods(
    layout: GridLayout, lines: _Lines, ends: _Ends
) -> tuple[tuple[FlatRod, ...], list[tuple[str, str]], list[str]]:
    """Rods from the lines: those of the layout get their labels, all other lines are virtual."""
    rods, dropped, broken = list[FlatRod](), list[tuple[str, str]](), list[str]()
    families: tuple[tuple[Family, Floats, list[list[Cut]]], ...] = (("u", lines.v, ends.u), ("v", lines.u, ends.v))
    for family, offsets, cuts in families:
        make = FlatRod.u if family == "u" else FlatRod.v
        touching = {float(c): cut for c, cut in zip(offsets, cuts, strict=True) if cut}
        built = layout.offsets(family)
        if built is None:
            lattice = layout.lattice(family, min(touching, default=0.0), max(touching, default=0.0))
            tiny = 1e-6 * max(layout.spacing)
            built = np.array([c for c in touching if np.abs(lattice - c).min() < tiny])
        for k, c in enumerate(built):
            name = rod_name(family, k, len(built))
            here = min(touching, key=lambda offset: abs(offset - c), default=np.inf)
            if abs(here - c) > 1e-9 * max(layout.spacing):
                dropped.append((name, "it never touches the target"))
                continue
            pieces = touching.pop(here)
            for label, cut in zip(piece_names(name, len(pieces)), pieces, strict=True):
                rods.append(make(label, here, *cut, virtual=label in layout.left_out))
            if len(pieces) > 1:
                broken.append(name)
        for c, pieces in touching.items():
            labels = piece_names(f"virtual {family.upper()} {c:+.4f}", len(pieces))
            rods += [make(label, c, *cut, virtual=True) for label, cut in zip(labels, pieces, strict=True)]
    return tuple(rods), dropped, [_in_pieces(broken)] if broken else []


def _in_pieces(names: list[str]) -> str:
    """That some rods do not go from rim to rim."""
    return (
        f"{len(names)} rods meet the target in several pieces, each with ends of its own: {', '.join(names)}; an "
        "opening needs a ring that carries the reactions of the rods that end there"
    )


def piece_names(rod: str, count: int) -> list[str]:
    """U07, or U07a, U07b, ... where a line meets the target more than once."""
    return [rod] if count == 1 else [f"{rod}{ascii_lowercase[k] if k < 26 else f'.{k + 1}'}" for k in range(count)]


def _require_length(layout: GridLayout, rods: tuple[FlatRod, ...]) -> None:
    """Refuse a layout whose rods end above the end of the target."""

    def needed(rod: FlatRod) -> float:
        middle = layout.middle(rod.family)
        return 2 * max(rod.end - middle, middle - rod.start)

    longest = max((rod for rod in rods if not rod.virtual), key=needed, default=None)
    if longest is not None and layout.length != "auto" and needed(longest) > layout.length:
        raise InputError(
            f"rod {longest.name} is too short to reach the end of the target: it needs {needed(longest):.4g} m, "
            f'the layout gives {layout.length:.4g} m: use a longer length, or "auto"'
        )
