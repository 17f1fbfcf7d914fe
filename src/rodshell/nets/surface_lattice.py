"""The rods of a lattice of geodesics or asymptotic lines on a target, and their joints."""

from dataclasses import dataclass
from functools import cached_property
from math import cos, sin
from typing import NamedTuple, Self

import numpy as np
from scipy.ndimage import label, maximum_position

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError, NetLimitError
from rodshell.geometry.frames import cross, dot, unit
from rodshell.layout.flatgrid import Crossings
from rodshell.layout.gridlayout import piece_names
from rodshell.layout.lattices import Curves, Geodesic, SurfaceLattice
from rodshell.nets.drawn_curves import drawn_curves
from rodshell.nets.surface_curves import Law, SurfaceCurves, asymptotic, geodesic, trace
from rodshell.targets import Target
from rodshell.units import length_text

FAMILIES = "uvw"
SHORTEST = 3.0  # spacings: a shorter rod in a corner has too few joints not to swing
PLACES = 24  # on an outermost rod at which room next to it is looked for
MOVED = 1e-3  # of the size: lines that lie further off the target are said to be moved


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceNet:
    """Rods along curves of a target, joined where rods of different families cross.

    Args:
        curves: of the rods, from past an end of the target to past another.
        names: of the rods.
        families: of the rods, by their names; "free" of those along lines that are given.
        crossings: of the rods, with the arc lengths of `curves`.
        warnings: sentences.
    """

    lattice: SurfaceLattice
    curves: SurfaceCurves
    names: tuple[str, ...]
    families: tuple[str, ...]
    crossings: Crossings
    warnings: tuple[str, ...] = ()

    def __repr__(self) -> str:
        return f"SurfaceNet({len(self.curves)} rods, {len(self.crossings)} crossings on {self.curves.target})"

    @property
    def curvatures(self) -> tuple[Floats, Floats]:
        """Curvatures by which the rods bend on the target at their knots, (k,) out of it and (k,) within it [1/m]."""
        curve, s = self.curves.knots
        ends = self.curves.ends[curve]
        built = (ends[:, 0] <= s) & (s <= ends[:, 1])  # and across openings
        normal, geodesic = self.bends
        return normal[built], geodesic[built] * (0.0 if self.curved_at_rest else 1.0)

    @property
    def curved_at_rest(self) -> bool:
        """Whether the rods are curved at rest as the lines on the target are."""
        return isinstance(self.lattice, Curves) and self.lattice.rest == "curved"

    @cached_property
    def bends(self) -> tuple[Floats, Floats]:
        """(k,) normal and (k,) geodesic curvatures of the curves at all their knots [1/m]."""
        curves = self.curves
        normal = _normal(curves.target, curves.points)
        return dot(curves.bends, normal), dot(curves.bends, cross(normal, curves.tangents))


def surface_net(target: Target, lattice: SurfaceLattice, *, anchor: tuple[float, float] | None = None) -> SurfaceNet:
    """March the rods of a lattice over a target.

    Args:
        anchor: x, y of the point of the target from which the rods are set out [m]; default: the target's highest
            point.

    Raises:
        NetLimitError: a curve does not reach the end of the target, or there is none where it is not a saddle; names
            the place.
        InputError: the anchor is outside the target.
    """
    if isinstance(lattice, Curves):
        if anchor is not None:
            raise InputError(
                "an anchor is a point from which rods are set out, and these are given by lines: leave it out"
            )
        return _of_lines(target, lattice)
    place = target.lift(np.array([anchor if anchor is not None else target.summit]))
    if not target.covers(place)[0]:
        raise InputError("the anchor is outside the target: choose a point inside its rim")
    law = geodesic if isinstance(lattice, Geodesic) else asymptotic
    headings = _of_geodesics(target, place, lattice) if law is geodesic else _of_asymptotes(target, place, lattice)
    guides = trace(target, law, np.repeat(place, len(headings), axis=0), _across(target, place, headings, law))
    families = list[_Family]()
    for k in range(len(headings)):
        shift = 0.5 if k == 2 else 0.0  # of three families: else three rods nearly meet
        spacing = lattice.spacings[k]
        low, high = guides.ends[k] / spacing
        s = spacing * (np.arange(np.ceil(low - shift), np.floor(high - shift) + 1) + shift)
        x, along = guides.at(np.full(len(s), k), s)
        families.append(_Family(spacing, x, _off(target, x, along, law)))
    curves = _trace_all(target, law, families)
    if _fill_corners(target, law, families, curves):
        curves = _trace_all(target, law, families)
    counts = [len(family.points) for family in families]
    names = [f"{FAMILIES[k].upper()}{number:02d}" for k in range(len(counts)) for number in range(1, counts[k] + 1)]
    return _joined(lattice, curves, names, np.repeat(np.arange(len(counts)), counts))


def _joined(lattice: SurfaceLattice, curves: SurfaceCurves, names: list[str], family: Ints) -> SurfaceNet:
    """The rods with their joints, and a warning where those of one family cross, which no joint holds."""
    every = curves.crossings(np.arange(len(curves)))
    within = family[every.rods[:, 0]] == family[every.rods[:, 1]]
    low, high = curves.ends[every.rods].transpose(2, 0, 1)
    built = [name not in lattice.left_out for name in names]
    met = within & ((low <= every.at) & (every.at <= high)).all(axis=1) & np.array(built)[every.rods].all(axis=1)
    warnings = tuple[str, ...]()
    if met.any():
        first, second = (names[k] for k in every.rods[np.argmax(met)])
        warnings = (
            "rods of one family cross each other without a joint, as the target's curvature makes them converge: "
            f"{np.count_nonzero(met)} times, such as {first} and {second}; leave some of them out (layout.left_out), "
            "or choose a larger spacing, another anchor or heading",
        )
    of = tuple(FAMILIES[k] for k in family)
    return SurfaceNet(lattice, curves, tuple(names), of, every.select(~within), warnings)


class _Family(NamedTuple):
    """Rods of one family in their order across it: their spacing [m], points (n, 3) and their tangents (n, 3) there."""

    spacing: float
    points: Floats
    tangents: Floats

    def with_rod(self, last: bool, point: Floats, tangent: Floats) -> Self:
        """With one more rod, as the last or the first one."""
        place = len(self.points) if last else 0
        return self._replace(
            points=np.insert(self.points, place, point, axis=0),
            tangents=np.insert(self.tangents, place, tangent, axis=0),
        )


def _trace_all(target: Target, law: Law, families: list[_Family]) -> SurfaceCurves:
    return trace(target, law, *(np.concatenate([family[part] for family in families]) for part in (1, 2)))


def _fill_corners(target: Target, law: Law, families: list[_Family], rods: SurfaceCurves) -> bool:
    """Add rods on both sides of families, where the target continues next to the curves that set them out.

    Along each part of an outermost rod that has room next to it, a rod is laid a spacing away, where there is most. One
    that is shorter than three spacings would swing, and is left out.

    Args:
        rods: of the families, one after the other.

    Returns:
        Whether there are any.
    """
    family, last = np.divmod(np.arange(2 * len(families)), 2)
    stop = np.cumsum([len(each.points) for each in families])
    outer = np.column_stack([np.append(0, stop[:-1]), stop - 1]).ravel()
    share, added = (np.arange(PLACES) + 0.5) / PLACES, False
    while len(outer):
        ends = rods.ends[outer]
        x, along = rods.at(np.repeat(outer, PLACES), (ends[:, :1] + np.diff(ends) * share).ravel())
        outward = np.where(last, -1.0, 1.0)[:, None]
        try:
            across = trace(target, law, x, np.repeat(outward, PLACES, axis=0) * _off(target, x, along, law))
        except NetLimitError:  # one of them does not arrive
            break
        spacing = np.array([each.spacing for each in families])[family]
        room = across.ends[:, 1].reshape(-1, PLACES)
        parts, count = label(room > spacing[:, None], structure=[[0, 0, 0], [1, 1, 1], [0, 0, 0]])
        if not count:
            break
        of, place = np.array(maximum_position(room, parts, np.arange(1, count + 1)), dtype=np.intp).T
        x, along = across.at(of * PLACES + place, spacing[of])
        tangents = _off(target, x, -outward[of] * along, law)
        rods = trace(target, law, x, tangents)
        outer = np.flatnonzero(np.diff(rods.ends)[:, 0] > SHORTEST * spacing[of])
        family, last = family[of[outer]], last[of[outer]]
        for k, end, point, tangent in zip(family, last, x[outer], tangents[outer], strict=True):
            families[k], added = families[k].with_rod(bool(end), point, tangent), True
    return added


def _of_lines(target: Target, lattice: Curves) -> SurfaceNet:
    """The rods along the lines that are given, each joined to every other."""
    turn = np.eye(3)
    turn[:2, :2] = [[cos(lattice.rotate), -sin(lattice.rotate)], [sin(lattice.rotate), cos(lattice.rotate)]]
    lines = [np.array(line) @ turn[: len(line[0]), : len(line[0])].T for line in lattice.lines]
    curves, line, moved = drawn_curves(target, lines, lattice.names)
    count = np.bincount(line, minlength=len(lines))
    names = [name for k in range(len(lines)) if count[k] for name in piece_names(lattice.names[k], int(count[k]))]
    warnings = tuple[str, ...]()
    if moved > MOVED * target.size:
        warnings = (f"the lines of the rods lie up to {length_text(moved)} off the target, and were moved onto it",)
    return SurfaceNet(lattice, curves, tuple(names), ("free",) * len(names), curves.crossings(line), warnings)


def _normal(target: Target, x: Floats) -> Floats:
    return target.on_surface(x).normal


def _of_geodesics(target: Target, place: Floats, lattice: SurfaceLattice) -> Floats:
    """(k, 3) unit tangents of the families at the anchor, the first along the heading in plan."""
    normal = _normal(target, place)[0]
    plan = np.array([cos(lattice.rotate), sin(lattice.rotate)])
    first = unit(np.array([*plan * normal[2], -plan @ normal[:2]]))
    angles = np.pi / lattice.family_count * np.arange(lattice.family_count)[:, None]
    return np.asarray(np.cos(angles) * first + np.sin(angles) * np.cross(normal, first))


def _of_asymptotes(target: Target, place: Floats, lattice: SurfaceLattice) -> Floats:
    """(2, 3) unit tangents of both families at the anchor, the first the nearer one to the heading in plan."""
    heading = _of_geodesics(target, place, lattice)[:1]
    first = asymptotic(target, place, heading)[0]
    return np.vstack([first, _other(target, place, first)])


def _across(target: Target, place: Floats, headings: Floats, law: object) -> Floats:
    """(k, 3) directions at the anchor of the curves from which the families are set out."""
    if law is asymptotic:
        return headings[::-1]
    return cross(headings, np.repeat(_normal(target, place), len(headings), axis=0))


def _off(target: Target, x: Floats, along: Floats, law: object) -> Floats:
    """(n, 3) directions of rods at points of the curve from which they are set out, `along` being its tangents."""
    return _other(target, x, along) if law is asymptotic else cross(_normal(target, x), along)


def _other(target: Target, x: Floats, along: Floats) -> Floats:
    """The other asymptotic directions (n, 3) at points where the first ones are `along`, on the left of these."""
    hessian, across = target.implicit(x).hessian, cross(_normal(target, x), along)
    mixed, sideways = (np.einsum("ni,nij,nj->n", a, hessian, across) for a in (along, across))
    other = sideways[:, None] * along - 2 * mixed[:, None] * across
    return unit(other * np.sign(dot(other, across))[:, None])
