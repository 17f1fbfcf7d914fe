"""The inextensible net of a layout on a target, and the footprint that it cuts out of the flat grid.

Two crossing geodesics through the anchor determine the net (`compass`). It is marched with two step sizes, cut at the
target's end and extrapolated (Richardson), so that each rod end is far more accurate than the mesh of any mechanical
model; the difference of the two marches estimates the error. Lines of the lattice that are not built still shape the
net: they are kept as virtual rods.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import groupby
from math import cos, degrees, pi, sin

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError, NetLimitError
from rodshell.geometry.curves import on_curve
from rodshell.kernels import njit
from rodshell.layout import FlatRod, GridLayout, GridMesh
from rodshell.layout.gridlayout import FAMILIES, lattice_rod, piece_names, rod_names
from rodshell.nets.compass import ON_SURFACE, Axes, axes
from rodshell.nets.net_ends import Cuts, Lines, cut_lines, extrapolated
from rodshell.nets.net_extent import Covering, LatticeLines, find_lines, march_lines
from rodshell.progress import Progress, require_progress, silent
from rodshell.targets import Target
from rodshell.units import length_text, point_text, shown
from rodshell.validation import instance, number, point

_SMALLEST_ANGLE = 10.0  # degrees: no gridshell can be built with a smaller one
SEARCHES = (2, 4, 8)  # steps per spacing of the march that finds the lines; more where the net extends further
LOOSE = 0.05  # spacings: a larger error of a rod end gives a warning
_GRAZING = 0.01  # spacings: a line that is nowhere further inside than this runs along the end, and is ignored
SHORTEST = 2.0  # spacings: a rod that is no longer has fewer than three joints, and is not built
_AT_JOINT = 1e-5  # edges: a rod that ends this near a joint ends at it, since round-off bends the edge between them


@dataclass(frozen=True, eq=False, repr=False)
class ChebyshevNet:
    """The net of a layout on a target.

    Args:
        rods: rods and virtual rods, each from end to end of the target: the footprint G0.
        lines: offsets of all lines of the lattice near the target [m]: `lines[0]` (nu,) are the u of the lines of
            family v, `lines[1]` (nv,) the v of those of family u.
        net: the finer march, from which positions are taken.
        error_estimate: largest |G0(fine) - G0(coarse)| / 3 over all ends of rods that are longer than two spacings: the
            error before extrapolation [m].
        min_angle: smallest angle between the families on the target [rad].
        min_angle_at: x, y, z of the point where it is [m].
        dropped: rods of the layout that are not in `rods`, with the reason.
        pieces: of each rod of the layout that is on the target in several pieces, the names of those in `rods`.
    """

    target: Target
    layout: GridLayout
    rods: tuple[FlatRod, ...]
    lines: tuple[Floats, Floats]
    net: Covering
    error_estimate: float
    min_angle: float
    min_angle_at: tuple[float, float, float]
    dropped: tuple[tuple[str, str], ...]
    pieces: dict[str, tuple[str, ...]]
    warnings: tuple[str, ...]

    def positions(self, rod: FlatRod, s: Floats) -> Floats:
        """Points (n, 3) [m] at the material coordinates `s` (n,) [m] of one of `rods`, or of a piece of one, by local
        cubics."""
        return self._along((rod,), np.zeros(1, dtype=np.intp), s, np.arange(len(s)), len(s))

    def node_positions(self, mesh: GridMesh) -> Floats:
        """As `positions`, of the nodes (n, 3) of a mesh of such rods [m]; at a joint by the last of its rods."""
        return self._along(mesh.grid.rods, mesh.rod_start, mesh.stations, mesh.rod_nodes, mesh.node_count)

    def _along(self, rods: Sequence[FlatRod], start: Ints, s: Floats, nodes: Ints, count: int) -> Floats:
        """Points (count, 3) [m] of the `nodes` (k,) at the material coordinates `s` (k,) [m] of rods one after the
        other, which begin at `start` (m,) in `s`."""
        result, start = np.empty((count, 3)), np.append(start, len(s))
        for k, rod in enumerate(rods):
            first, here = rod.family == FAMILIES[0], slice(start[k], start[k + 1])
            knots, others = (self.net.u, self.net.v) if first else (self.net.v, self.net.u)
            line = int(_nearest(others, np.array([rod.offset]))[0])
            points = self.net.points[:, line] if first else self.net.points[line]
            known = np.isfinite(points[:, 0])
            result[nodes[here]] = on_curve(knots[known], points[known], s[here])
        return result

    def __repr__(self) -> str:
        built = sum(not rod.virtual for rod in self.rods)
        return f"ChebyshevNet({built} rods on {self.target}, smallest angle {degrees(self.min_angle):.3g} deg)"


def chebyshev_net(
    target: Target,
    layout: GridLayout,
    *,
    anchor: tuple[float, float] | None = None,
    warm_start: ChebyshevNet | None = None,
    eccentricity: float = 0.0,
    progress: Progress = silent,
) -> ChebyshevNet:
    """March the net of `layout` over `target` and cut it at the target's end.

    Args:
        anchor: x, y of the point of the target where the two axes cross [m]; default: the target's highest point.
        warm_start: a similar net, from which this one is computed faster; the result is the same to round-off.
        eccentricity: distance of the rods' centre lines at their joints [m]. Rods of family u are half of it below the
            target and those of family v half of it above, each on the parallel surface there: a rod's material length
            is that of its own line, so that the flat grid is the layout's straight lattice, and its ends are over the
            target's end, along the normal.

    Raises:
        NetLimitError: the crossing angle falls below 10 degrees or the march fails inside the target; names the place.
        InputError: the anchor is outside the target, the spacing is too large, or a rod is too short to reach the end.
    """
    instance("target", target, Target)
    instance("layout", layout, GridLayout)
    if warm_start is not None:
        instance("warm_start", warm_start, ChebyshevNet, "a net that rodshell.chebyshev_net returned")
    if anchor is not None:
        point("anchor", anchor)
    number("eccentricity", eccentricity, "m")
    require_progress(progress)
    start = _start(target, layout, anchor)
    if max(layout.spacing) >= 2 * target.size:
        raise InputError(
            f"the spacing {max(layout.spacing):g} m is larger than the target, which is {2 * target.size:g} m wide: "
            "use a smaller spacing"
        )
    if eccentricity > min(layout.spacing):
        raise InputError(
            f"the joints' eccentricity {length_text(eccentricity)} is larger than the spacing "
            f"{length_text(min(layout.spacing))}: check its unit"
        )
    heights = (-0.5 * eccentricity, 0.5 * eccentricity) if eccentricity else ON_SURFACE
    similar = warm_start.net if warm_start else None
    for parts in SEARCHES:
        progress("net", "marching", 0.0)
        lines, rough = find_lines(target, layout, start, similar, parts, heights)
        progress("net", "marching in long steps", 0.0)
        coarse = march_lines(target, layout, lines, start, 2, rough, heights=heights)
        progress("net", "marching in short steps", 0.0)
        fine = march_lines(target, layout, lines, start, 1, coarse, rough, heights=heights)
        if not (fine.inside[[0, -1]].any() or fine.inside[:, [0, -1]].any()):
            break
    else:
        raise InputError(
            f"the target bends too sharply for a spacing of {max(layout.spacing):g} m: use a smaller spacing"
        )
    if eccentricity:
        _require_room(target, fine, 0.5 * eccentricity)
    angle, where = _smallest_angle(fine)
    if degrees(angle) < _SMALLEST_ANGLE:
        raise _net_limit(where, f"the families meet at only {degrees(angle):.1f} degrees")
    cuts, error, loosest = _extrapolate(target, lines, (coarse, fine), min(layout.spacing))
    ends = _at_joints(cuts[0], lines.u, layout), _at_joints(cuts[1], lines.v, layout)
    rods, dropped, pieces = _name_rods(layout, lines, ends)
    _require_names(layout, [*(rod.name for rod in rods), *(name for name, _ in dropped)])
    if all(rod.virtual for rod in rods):
        raise InputError("no rod of the layout touches the target: move the layout (offset, anchor), or give more rods")
    warnings = list[str]()
    if error > LOOSE * min(layout.spacing):
        there = point_text(np.where(np.abs(loosest) < 1e-6 * target.size, 0.0, loosest))
        warnings.append(
            f"rod ends on the line through {there} have an error of up to {error:.3g} m: the "
            "target bends too sharply for the steps of the march, or the line runs along its end; use a smaller "
            "spacing or shorter edges"
        )
    _require_length(layout, rods)
    return ChebyshevNet(
        target, layout, rods, (lines.u, lines.v), fine, error, angle, where, tuple(dropped), pieces, tuple(warnings)
    )


def _start(target: Target, layout: GridLayout, anchor: tuple[float, float] | None) -> Axes:
    """The axes through the anchor, lifted vertically onto the target, the first along the heading in plan."""
    x, y = anchor if anchor is not None else target.summit
    remedy = "leave it out for the highest point, or let a search choose (--anchor auto)"
    try:
        lifted = target.lift(np.array([[x, y]]))
    except InputError as reason:
        raise InputError(f"the anchor: {reason}, {remedy}") from None
    if not target.covers(lifted)[0]:
        raise InputError(f"the anchor ({x:g}, {y:g}) m is outside the target: choose a point inside its rim, {remedy}")
    n = target.on_surface(lifted).normal[0]
    plan = np.array([cos(layout.rotate), sin(layout.rotate)])
    along = np.array([*plan * n[2], -plan @ n[:2]])
    if layout.crossing == pi / 2:
        return axes(target, lifted[0], along)
    both = cos(layout.crossing) * along + sin(layout.crossing) * np.cross(n, along)
    return axes(target, lifted[0], np.stack([along, both]))


def _require_room(target: Target, net: Covering, height: float) -> None:
    """Refuse layers that reach a centre of curvature of the target."""
    points = net.points[net.inside]
    curvature = np.abs(np.linalg.eigvalsh(target.on_surface(points).hessian)).max(axis=1)
    k = int(np.argmax(curvature))
    if height * curvature[k] >= 1.0:
        there = point_text(np.where(np.abs(points[k]) < 1e-6 * target.size, 0.0, points[k]))
        raise InputError(
            f"near {there} the target's radius of curvature is {length_text(1 / curvature[k])}, "
            f"and half of the joints' eccentricity {length_text(height)}: use a smaller eccentricity or a larger target"
        )


def _hole(net: Covering) -> NetLimitError:
    """The error for a net with inside nodes next to nodes that the march did not find; it names the first of them."""
    lost = np.pad(np.isnan(net.points[:, :, 0]), 1)
    next_to_lost = lost[:-2, 1:-1] | lost[2:, 1:-1] | lost[1:-1, :-2] | lost[1:-1, 2:]
    holes = np.argwhere(next_to_lost & net.inside)
    i, j = holes[np.argmin(np.abs(net.u[holes[:, 0]]) + np.abs(net.v[holes[:, 1]]))]
    return _net_limit(tuple(net.points[i, j].tolist()), "the rods of the two families become parallel")


def _net_limit(where: tuple[float, float, float], what: str) -> NetLimitError:
    return NetLimitError(
        f"no inextensible net covers this target: near {point_text(where)} {what}; "
        "use a smaller part of the target (a higher base, or seams), or another anchor or heading; a larger spacing "
        "does not help"
    )


def _smallest_angle(net: Covering) -> tuple[float, tuple[float, float, float]]:
    """Smallest angle between the families over the inside nodes [rad], from central differences, and its place.

    Raises:
        NetLimitError: a node next to an inside one is missing.
    """
    i, j, angle, whole = _sharpest(net.points, net.inside)
    if not whole:
        raise _hole(net)
    x, y, z = net.points[i, j].tolist()
    return angle, (x, y, z)


@njit("f3 b2")
def _sharpest(points, inside):  # type: ignore[no-untyped-def]
    """Indices of the inside node with the smallest angle, which has the largest cosine; that angle [rad]; and whether
    the net has all nodes next to the inside ones."""
    i_found, j_found, angle, largest, whole = 0, 0, 0.5 * np.pi, -1.0, True
    for i in range(1, len(inside) - 1):
        for j in range(1, inside.shape[1] - 1):
            if inside[i, j]:
                aa, ab, bb = 0.0, 0.0, 0.0
                for k in range(3):
                    a, b = points[i + 1, j, k] - points[i - 1, j, k], points[i, j + 1, k] - points[i, j - 1, k]
                    aa, ab, bb = aa + a * a, ab + a * b, bb + b * b
                whole &= not np.isnan(aa + bb)
                if ab * ab > largest * aa * bb:
                    i_found, j_found, largest = i, j, ab * ab / (aa * bb)
    i, j, square, inner = i_found, j_found, 0.0, 0.0
    if largest >= 0.0:
        for k in range(3):
            m, n = (k + 1) % 3, (k + 2) % 3
            a, b = points[i + 1, j, m] - points[i - 1, j, m], points[i, j + 1, n] - points[i, j - 1, n]
            c, d = points[i + 1, j, n] - points[i - 1, j, n], points[i, j + 1, m] - points[i, j - 1, m]
            square, inner = square + (a * b - c * d) ** 2, inner + a * d
        angle = np.arctan2(np.sqrt(square), abs(inner))
    return i, j, angle, whole


def _nearest(ascending: Floats, values: Floats) -> Ints:
    """Indices (k,) of the nearest of `ascending` numbers to each of the `values` (k,)."""
    return np.asarray(np.searchsorted(0.5 * (ascending[1:] + ascending[:-1]), values))


def _extrapolate(
    target: Target, lines: LatticeLines, nets: tuple[Covering, Covering], spacing: float
) -> tuple[tuple[Cuts, Cuts], float, Floats]:
    """The cuts of the lines of families u and v, the largest error of an end before extrapolation [m], and a point of
    that line; of no line that is too short for a rod that is built, such as in a corner."""
    sets = list[Lines]()
    for net in nets:
        row, column = np.searchsorted(net.u, lines.u - 1e-12), np.searchsorted(net.v, lines.v - 1e-12)
        points, inside = net.points[:, column].swapaxes(0, 1), net.inside[:, column].T
        sets.append(Lines(net.u, np.ascontiguousarray(points), np.ascontiguousarray(inside)))
        sets.append(Lines(net.v, net.points.take(row, axis=0), net.inside.take(row, axis=0)))
    cuts = cut_lines(target, sets, depth=_GRAZING * spacing)
    step = max(np.diff(nets[0].u).max(), np.diff(nets[0].v).max())
    in_u, errors_u = extrapolated(cuts[0], cuts[2], len(lines.v), step)
    in_v, errors_v = extrapolated(cuts[1], cuts[3], len(lines.u), step)
    for found, errors in ((in_u, errors_u), (in_v, errors_v)):
        long = found.line[np.ptp(found.ends, axis=1) > SHORTEST * spacing]
        errors[np.setdiff1d(np.arange(len(errors)), long)] = 0.0
    errors = np.concatenate([errors_u, errors_v])
    worst = int(np.argmax(errors))
    if errors[worst] == 0.0:
        return (in_u, in_v), 0.0, nets[1].points[nets[1].origin]
    points = sets[2].points[worst] if worst < len(errors_u) else sets[3].points[worst - len(errors_u)]
    known = points[np.isfinite(points[:, 0])]
    return (in_u, in_v), float(errors[worst]), known[np.argmin(np.abs(target.margin(known)))]


def _at_joints(cuts: Cuts, stations: Floats, layout: GridLayout) -> Cuts:
    """The cuts of one family's lines, those next to one of the `stations` (n,) where they are crossed moved to it."""
    joints = stations[_nearest(stations, cuts.ends)]
    return Cuts(cuts.line, np.where(np.abs(cuts.ends - joints) < _AT_JOINT * layout.edge, joints, cuts.ends))


def _name_rods(
    layout: GridLayout, lines: LatticeLines, ends: tuple[Cuts, Cuts]
) -> tuple[tuple[FlatRod, ...], list[tuple[str, str]], dict[str, tuple[str, ...]]]:
    """Rods from the lines: those of the layout get their names, all other lines are virtual; those that are dropped;
    and the names of the pieces of rods that have several."""
    rods, dropped, broken = list[FlatRod](), list[tuple[str, str]](), dict[str, tuple[str, ...]]()
    spacing = max(layout.spacing)
    for family, (every, cuts) in enumerate(zip((lines.v, lines.u), ends, strict=True)):
        pieces: dict[float, list[list[float]]] = {}  # of each line that touches the target, by its offset
        for offset, piece in zip(every[cuts.line].tolist(), cuts.ends.tolist(), strict=True):
            pieces.setdefault(offset, []).append(piece)
        offsets, built = np.array(list(pieces)), layout.offsets(family)
        if built is None:
            lattice = layout.lattice(family, offsets.min(initial=0.0), offsets.max(initial=0.0))
            built = offsets[np.abs(lattice[_nearest(lattice, offsets)] - offsets) < 1e-6 * spacing]
        lines_there = offsets[_nearest(offsets, built)] if pieces else np.full(len(built), np.inf)
        apart = np.abs(lines_there - built)
        for name, offset, away in zip(rod_names(family, len(built)), lines_there.tolist(), apart.tolist(), strict=True):
            if away > 1e-9 * spacing:
                dropped.append((name, "it never touches the target"))
                continue
            parts = pieces.pop(offset)
            names = piece_names(name, len(parts))
            for label, (start, end) in zip(names, parts, strict=True):
                rods.append(lattice_rod(family, label, offset, start, end, virtual=label in layout.left_out))
            if len(parts) > 1:
                broken[name] = tuple(names)
        for offset, parts in pieces.items():
            labels = piece_names(f"virtual {FAMILIES[family].upper()} {offset:+.4f}", len(parts))
            rods += [
                lattice_rod(family, label, offset, *part, virtual=True)
                for label, part in zip(labels, parts, strict=True)
            ]
    return tuple(rods), dropped, broken


def _require_names(layout: GridLayout, names: list[str]) -> None:
    """Refuse to leave out rods that are not there."""
    for name in layout.left_out:
        if name not in names:
            families = (list(family) for _, family in groupby(names, key=lambda known: known[0]))
            known = " and ".join(f"{family[0]} to {family[-1]}" for family in families)
            raise InputError(f"layout.left_out: there is no rod {shown(name)}: the rods are {known}")


def _require_length(layout: GridLayout, rods: tuple[FlatRod, ...]) -> None:
    """Refuse a layout whose rods are too short to reach the end of the target."""
    if layout.length == "auto":
        return

    def needed(rod: FlatRod) -> float:
        middle = layout.middle(rod)
        return 2 * max(rod.end - middle, middle - rod.start)

    longest = max((rod for rod in rods if not rod.virtual), key=needed, default=None)
    if longest is not None and needed(longest) > layout.length:
        raise InputError(
            f"rod {longest.name} is too short to reach the end of the target: it needs {needed(longest):.4g} m, "
            f'the layout gives {layout.length:.4g} m: use a longer length, or "auto"'
        )
