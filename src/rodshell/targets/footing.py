"""A freeform surface as the body that a grid falls on: the surface, and a wall straight down from its edge."""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.vectors import dot, unit
from rodshell.targets.rim import Rim
from rodshell.targets.standing import Standing
from rodshell.targets.target import Implicit

if TYPE_CHECKING:
    from rodshell.targets.freeform import Freeform


LEVEL = 1e-4  # of the size: an edge this even is a base
FAR = 0.5  # of the field's reach
UPRIGHT = 0.2  # upward part of a normal, on a surface whose edge is not level: what is steeper may lean over past it
CORNER = 0.9  # cosine between edges of the outline: its points are close, and smooth curves turn by far less


@dataclass(frozen=True, eq=False)
class Outline:
    """The region of the plan within a rim of one loop, counter-clockwise seen from above; see `Domain`."""

    rim: Rim

    @cached_property
    def _flat(self) -> Rim:
        return replace(self.rim, points=self.rim.points * [1.0, 1.0, 0.0])

    @cached_property
    def _normals(self) -> tuple[Floats, Floats, Bools]:
        """Outward normals (n, 2) where each edge begins and where it ends, those of its neighbours averaged in; and
        whether it begins at a corner."""
        after = self.rim.after
        along = unit((self.rim.points[after] - self.rim.points)[:, :2])
        own = np.column_stack([along[:, 1], -along[:, 0]])
        ends_sharp = np.einsum("ni,ni->n", along, along[after]) < CORNER
        at_end = np.where(ends_sharp[:, None], own, unit(own + own[after]))
        at_start, begins_sharp = own.copy(), np.zeros_like(ends_sharp)
        at_start[after], begins_sharp[after] = np.where(ends_sharp[:, None], own[after], at_end), ends_sharp
        return at_start, at_end, begins_sharp

    @property
    def half_extent(self) -> tuple[float, float]:
        x, y, _ = 0.5 * np.ptp(self.rim.points, axis=0)
        return float(x), float(y)

    def holds(self, xy: Floats) -> Bools:
        return np.asarray(self.distance(xy)[0] <= 0.0)

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
        """Signed distance (n,) of the points (n, 2) [m], negative inside; its gradient and Hessian."""
        edge, share = self._feet(xy)
        at_start, at_end, sharp = self._normals
        foot = self._flat.at(edge, share)[:, :2]
        n = unit((1 - share)[:, None] * at_start[edge] + share[:, None] * at_end[edge])
        off = xy - foot
        far = np.linalg.norm(off, axis=1)
        length = np.linalg.norm((self._flat.points[self.rim.after] - self._flat.points)[edge], axis=1)
        curvature = (at_start[edge, 0] * at_end[edge, 1] - at_start[edge, 1] * at_end[edge, 0]) / length
        distance = np.einsum("ni,ni->n", off, n)
        bend = curvature / np.maximum(1.0 + distance * curvature, 1e-3)
        corner = ((share <= 0.0) & sharp[edge]) | ((share >= 1.0) & sharp[self.rim.after[edge]])
        corner &= (distance > 0) & (far > 0)
        n[corner], distance[corner], bend[corner] = unit(off[corner]), far[corner], 1.0 / far[corner]
        along = np.column_stack([-n[:, 1], n[:, 0]])
        return distance, n, bend[:, None, None] * along[:, :, None] * along[:, None, :]

    def height(self, xy: Floats) -> Floats:
        """z (n,) of the rim where it is nearest in plan [m]."""
        return self.rim.at(*self._feet(xy))[:, 2]

    def _feet(self, xy: Floats) -> tuple[Ints, Floats]:
        return self._flat.feet(np.column_stack([xy, np.zeros(len(xy))]))


@dataclass(frozen=True, kw_only=True, eq=False)
class Footing(Standing):
    """The body under a freeform surface. Make one with `footing`."""

    surface: "Freeform"
    outline: Outline
    level_edge: float | None

    @property
    def name(self) -> str:
        return self.surface.name

    @property
    def plan(self) -> Outline:
        return self.outline

    @property
    def base(self) -> float | None:
        return self.level_edge

    @property
    def summit(self) -> tuple[float, float]:
        return self.surface.summit

    def parameters(self) -> dict[str, object]:
        return self.surface.parameters()

    def margin(self, x: Floats) -> Floats:
        return self.surface.margin(x)

    def implicit(self, x: Floats) -> Implicit:
        return self.surface.implicit(x)

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        """Far from the surface, where its field says nothing, of the plane of the nearest patch."""
        field = self.surface.field
        apart, patch = field.nearest(x)
        far = apart > FAR * field.reach
        value, gradient = np.empty(len(x)), field.frames[patch, 2]
        value[far] = dot(x[far] - field.centres[patch[far]], gradient[far])
        value[~far], gradient[~far] = self.surface.level(x[~far])
        return value, gradient

    def height(self, xy: Floats) -> Floats:
        """z (n,) of the rim: only its own points are asked for."""
        return self.outline.height(xy)

    def _nearest_of_rim(self, x: Floats, foot: Floats) -> Floats:
        return self.outline.rim.at(*self.outline.rim.feet(x))


def footing(surface: "Freeform") -> Footing:
    """The body under a surface with one edge.

    Raises
    ------
    InputError : it has openings, several ends, or leans over its edge.
    """
    instead = 'use drape method "bound"'
    rims = surface.rims
    if surface.base is not None:
        if any((rim.points[:, 2] > surface.base).any() for rim in rims):
            raise InputError(f"a grid cannot fall on {surface.name}, which ends at its base and elsewhere: {instead}")
        rims = (surface.section(surface.base),)
    if len(rims) != 1 or rims[0].loops != 1:
        raise InputError(f"a grid cannot fall on {surface.name}, which has openings or several edges: {instead}")
    edge, base = rims[0].points[:, 2], surface.base
    if base is None and np.ptp(edge) < LEVEL * surface.size:
        base = float(edge.mean())
    x, up = surface.surface.vertices, surface.surface.normals[:, 2]
    inside = surface.margin(x) > 0
    if base is None and up[inside].min() < UPRIGHT:
        px, py, pz = x[inside][np.argmin(up[inside])]
        raise InputError(
            f"a grid cannot fall on {surface.name}, which is too steep near ({px:.4g}, {py:.4g}, {pz:.4g}) m for an "
            f"edge that is not level: {instead}"
        )
    return Footing(surface=surface, outline=Outline(rims[0]), level_edge=base)
