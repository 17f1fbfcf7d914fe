"""The rods of a lattice of geodesics or asymptotic lines on a target, and their joints."""

from dataclasses import dataclass
from functools import cached_property
from math import cos, sin

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.geometry.frames import cross, dot, unit
from rodshell.layout.flatgrid import Crossings
from rodshell.layout.gridlayout import piece_names
from rodshell.layout.lattices import Curves, Geodesic, SurfaceLattice
from rodshell.nets.drawn_curves import drawn_curves
from rodshell.nets.surface_curves import SurfaceCurves, asymptotic, geodesic, trace
from rodshell.targets import Target
from rodshell.units import length_text

FAMILIES = "uvw"
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
    points, tangents, family = list[Floats](), list[Floats](), list[int]()
    for k in range(len(headings)):
        shift = 0.5 if k == 2 else 0.0  # of three families: else three rods nearly meet
        spacing = lattice.spacings[k]
        low, high = guides.ends[k] / spacing
        s = spacing * (np.arange(np.ceil(low - shift), np.floor(high - shift) + 1) + shift)
        x, along = guides.at(np.full(len(s), k), s)
        points.append(x)
        tangents.append(_off(target, x, along, law))
        family += [k] * len(s)
    curves = trace(target, law, np.concatenate(points), np.concatenate(tangents))
    letters = [FAMILIES[k] for k in family]
    names = [f"{letter.upper()}{k - letters.index(letter) + 1:02d}" for k, letter in enumerate(letters)]
    return SurfaceNet(lattice, curves, tuple(names), tuple(letters), curves.crossings(np.array(family)))


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
