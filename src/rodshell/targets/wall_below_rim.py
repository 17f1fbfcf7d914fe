"""A target as a contact body: the surface, and a wall straight down from its rim.

A grid that falls under gravity meets this body. The rim of analytic targets and height fields is known in closed form
(`WalledTarget`); that of a mesh is a polyline (`WalledSurface`).
"""

from abc import abstractmethod
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import dot, unit
from rodshell.targets.rim import CORNER, UPRIGHT, Domain, Rim
from rodshell.targets.target import Gap, Implicit, Target, offset_shape
from rodshell.units import point_text

if TYPE_CHECKING:
    from rodshell.targets.smooth_field import SmoothField
    from rodshell.targets.trianglemesh import TriangleMesh

LEVEL = 1e-4  # of the size: an edge this even counts as a base
FAR = 0.5  # of the field's reach
ROUND = np.cos(CORNER)  # between edges of the rim: a curve turns by less


@dataclass(frozen=True, eq=False)
class WalledTarget(Target):
    """A target that ends at a base plane or at the edge of its plan.

    As a contact body it is closed by a wall straight down from its rim.
    """

    @property
    @abstractmethod
    def plan(self) -> Domain:
        """The region that the rim encloses, seen from above."""

    @cached_property
    def size(self) -> float:
        """Half the larger width of the plan [m], the length to which gaps are related."""
        return max(self.plan.half_extent)

    def margin(self, x: Floats) -> Floats:
        if self.base is not None:
            return x[:, 2] - self.base
        return -self.plan.distance(x[:, :2])[0]

    def outside(self, x: Floats) -> Bools:
        over, past_rim = self.level(x)[0] > 0, ~self.plan.holds(x[:, :2])
        return over | past_rim if self.base is None else np.where(x[:, 2] < self.base, past_rim, over)

    def contact(self, x: Floats) -> Gap:
        y = self.closest(x)
        _, n, shape = self.on_surface(y)
        distance = np.einsum("ij,ij->i", x - y, n)
        hessian = offset_shape(shape, distance)
        ended = ~(self.margin(y) >= 0)
        # next to the wall, which is below the base or the rim, the nearer of surface and wall counts
        low = distance < 0 if self.base is None else x[:, 2] < self.base
        near = np.flatnonzero(ended | low)
        if len(near):
            edge, from_surface = self.plan.distance(x[near, :2]), distance[near]
            nearer = np.where(from_surface < 0, edge[0] > from_surface, edge[0] < from_surface)
            walled = np.flatnonzero(ended[near] | (low[near] & nearer))
            at, from_edge = near[walled], Gap(*(part[walled] for part in edge))
            distance[at], n[at], hessian[at] = self._wall(x[at], from_edge, ~(distance[at] <= 0))
        return Gap(distance, n, hessian)

    def _wall(self, x: Floats, from_edge: Gap, over: Bools) -> Gap:
        """Distance to the wall below the rim, or to its upper edge. `from_edge`: that to the edge of the plan; `over`:
        points above the surface."""
        across, normal, bend = from_edge
        foot = x[:, :2] - across[:, None] * normal
        rim = np.full(len(x), self.base) if self.base is not None else self.height_at(foot)
        n = np.column_stack([normal, np.zeros(len(x))])
        hessian = np.zeros((len(x), 3, 3))
        hessian[:, :2, :2] = bend
        above = np.where(across > 0, x[:, 2] > rim, over & (self.base is None))
        if above.any():  # an edge that a node slides over has no curvature
            apart = x[above] - self._nearest_of_rim(x[above], foot[above])
            far = np.linalg.norm(apart, axis=1)
            across[above], n[above], hessian[above] = far, apart / np.maximum(far, 1e-300)[:, None], 0.0
        return Gap(across, n, hessian)

    def _nearest_of_rim(self, x: Floats, foot: Floats) -> Floats:
        """Points (n, 3) of the rim closest to x; `foot` (n, 2) is closest in plan, which suffices for a level rim."""
        if self.base is not None:
            return np.column_stack([foot, np.full(len(x), self.base)])
        for _ in range(12):  # Gauss-Newton along the rim: an error shrinks by distance over radius
            normal = self.plan.distance(foot)[1]
            along = np.column_stack([-normal[:, 1], normal[:, 0]])
            on_rim = np.column_stack([foot, self.height_at(foot)])
            gradient = self.implicit(on_rim).gradient
            rise = -np.einsum("ij,ij->i", gradient[:, :2], along) / gradient[:, 2]
            tangent = np.column_stack([along, rise])
            slide = np.einsum("ij,ij->i", x - on_rim, tangent) / (1.0 + rise**2)
            foot = foot + slide[:, None] * along
            across, normal, _ = self.plan.distance(foot)
            foot = foot - across[:, None] * normal
        return np.column_stack([foot, self.height_at(foot)])


@dataclass(frozen=True, eq=False)
class RimPlan:
    """The region of the plan within a rim of one loop, which is counter-clockwise seen from above; a `Domain`."""

    rim: Rim

    @cached_property
    def _flat(self) -> Rim:
        return replace(self.rim, points=self.rim.points * [1.0, 1.0, 0.0])

    @cached_property
    def _normals(self) -> tuple[Floats, Floats, Bools]:
        """Outward normals (n, 2) at the start and at the end of each edge, averages with its neighbours; and whether it
        starts at a corner."""
        after = self.rim.after
        along = unit((self.rim.points[after] - self.rim.points)[:, :2])
        across = np.column_stack([along[:, 1], -along[:, 0]])
        ends_sharp = np.einsum("ni,ni->n", along, along[after]) < ROUND
        at_end = np.where(ends_sharp[:, None], across, unit(across + across[after]))
        at_start, begins_sharp = across.copy(), np.zeros_like(ends_sharp)
        at_start[after], begins_sharp[after] = np.where(ends_sharp[:, None], across[after], at_end), ends_sharp
        return at_start, at_end, begins_sharp

    @property
    def half_extent(self) -> tuple[float, float]:
        x, y, _ = 0.5 * np.ptp(self.rim.points, axis=0)
        return float(x), float(y)

    def holds(self, xy: Floats) -> Bools:
        return np.asarray(self.distance(xy)[0] <= 0.0)

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
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

    def height_at(self, xy: Floats) -> Floats:
        """z (n,) [m] of the rim where it is nearest in plan to the points `xy` (n, 2) [m]."""
        return self.rim.at(*self._feet(xy))[:, 2]

    def _feet(self, xy: Floats) -> tuple[Ints, Floats]:
        return self._flat.feet(np.column_stack([xy, np.zeros(len(xy))]))


@dataclass(frozen=True, kw_only=True, eq=False)
class WalledSurface(WalledTarget):
    """A mesh's smooth surface as a contact body; make one with `walled_surface`.

    Args:
        rim_plan: the region of the plan within its rim.
        level_edge: z of the rim where it is level [m], or None.
    """

    surface: Target
    field: "SmoothField"
    rim_plan: RimPlan
    level_edge: float | None

    @property
    def name(self) -> str:
        return self.surface.name

    @property
    def plan(self) -> RimPlan:
        return self.rim_plan

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
        """As `Target.level`; far from the surface, where its field is not defined, of the nearest tangent plane."""
        apart, nearest = self.field.nearest(x)
        far = apart > FAR * self.field.reach
        value, gradient = np.empty(len(x)), self.field.frames[nearest, 2]
        value[far] = dot(x[far] - self.field.centres[nearest[far]], gradient[far])
        value[~far], gradient[~far] = self.surface.level(x[~far])
        return value, gradient

    def height_at(self, xy: Floats) -> Floats:
        """z (n,) [m] of the rim; other heights are not needed."""
        return self.rim_plan.height_at(xy)

    def _nearest_of_rim(self, x: Floats, foot: Floats) -> Floats:
        return self.rim_plan.rim.at(*self.rim_plan.rim.feet(x))


def walled_surface(
    surface: Target, mesh: "TriangleMesh", field: "SmoothField", rims: Sequence[Rim], section: Callable[[float], Rim]
) -> WalledSurface:
    """The contact body of a mesh's surface that has one edge.

    Args:
        rims: the open boundary and the boundary curves, if there are any.
        section: the rim that a plane at a height z [m] cuts out of the surface.

    Raises:
        InputError: it has openings or several edges, or overhangs its edge.
    """
    instead = 'use drape method "bound"'
    if surface.base is not None:
        if any((rim.points[:, 2] > surface.base).any() for rim in rims):
            raise InputError(f"a grid cannot fall on {surface.name}, which ends at its base and elsewhere: {instead}")
        rims = (section(surface.base),)
    if len(rims) != 1 or rims[0].loops != 1:
        raise InputError(f"a grid cannot fall on {surface.name}, which has openings or several edges: {instead}")
    edge, base = rims[0].points[:, 2], surface.base
    if base is None and np.ptp(edge) < LEVEL * surface.size:
        base = float(edge.mean())
    x, up = mesh.vertices, mesh.normals[:, 2]
    inside = surface.margin(x) > 0
    if base is None and up[inside].min() < UPRIGHT:
        where = point_text(x[inside][np.argmin(up[inside])])
        raise InputError(
            f"a grid cannot fall on {surface.name}, which is too steep near {where} for an edge that is not level: "
            f"{instead}"
        )
    return WalledSurface(surface=surface, field=field, rim_plan=RimPlan(rims[0]), level_edge=base)
