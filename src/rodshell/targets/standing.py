"""A target that stands over a region of the plan: its end there, and the wall on which a falling grid hangs."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.targets.domain import Domain
from rodshell.targets.target import Gap, Target, offset_shape


@dataclass(frozen=True)
class Standing(Target):
    """A target that ends at a base plane or at the edge of its plan.

    For draping under gravity the body is closed by a wall straight down from its rim.
    """

    @property
    @abstractmethod
    def plan(self) -> Domain:
        """The region enclosed by the rim, seen from above."""

    @cached_property
    def size(self) -> float:
        """Half the larger width of the plan [m]: the length by which gaps are made relative."""
        return max(self.plan.half_extent)

    def margin(self, x: Floats) -> Floats:
        """(n,) how far inside the end the points (n, 3) are [m]; the shell is cut where this vanishes."""
        if self.base is not None:
            return x[:, 2] - self.base
        return -self.plan.distance(x[:, :2])[0]

    def outside(self, x: Floats) -> Bools:
        """(n,) points that are outside the body, as far as signs alone tell."""
        over, beside = self.level(x)[0] > 0, ~self.plan.holds(x[:, :2])
        return over | beside if self.base is None else np.where(x[:, 2] < self.base, beside, over)

    def contact(self, x: Floats) -> Gap:
        """Signed distance (n,) to the body that a falling grid meets: surface, and wall below its rim."""
        y = self.closest(x)
        _, n, shape = self.on_surface(y)
        distance = np.einsum("ij,ij->i", x - y, n)
        hessian = offset_shape(shape, distance)
        ended = ~(self.margin(y) >= 0)
        # beside the wall, which stands under the base or the rim, the nearer of surface and wall counts
        low = distance < 0 if self.base is None else x[:, 2] < self.base
        near = np.flatnonzero(ended | low)
        if len(near):
            edge, from_surface = self.plan.distance(x[near, :2]), distance[near]
            nearer = np.where(from_surface < 0, edge[0] > from_surface, edge[0] < from_surface)
            which = np.flatnonzero(ended[near] | (low[near] & nearer))
            at, beside = near[which], Gap(*(one[which] for one in edge))
            distance[at], n[at], hessian[at] = self._wall(x[at], beside, ~(distance[at] <= 0))
        return Gap(distance, n, hessian)

    def _wall(self, x: Floats, beside: Gap, over: Bools) -> Gap:
        """The wall under the rim, or its upper corner; `beside`: the plan's edge; `over`: above the surface."""
        across, normal, bend = beside
        foot = x[:, :2] - across[:, None] * normal
        rim = np.full(len(x), self.base) if self.base is not None else self.height(foot)
        n = np.column_stack([normal, np.zeros(len(x))])
        hessian = np.zeros((len(x), 3, 3))
        hessian[:, :2, :2] = bend
        above = np.where(across > 0, x[:, 2] > rim, over & (self.base is None))
        if above.any():  # a corner that a node slides over has no curvature
            apart = x[above] - self._nearest_of_rim(x[above], foot[above])
            far = np.linalg.norm(apart, axis=1)
            across[above], n[above], hessian[above] = far, apart / np.maximum(far, 1e-300)[:, None], 0.0
        return Gap(across, n, hessian)

    def _nearest_of_rim(self, x: Floats, foot: Floats) -> Floats:
        """Points (n, 3) of the rim closest to x; `foot` (n, 2) is closest in plan, which a level rim keeps."""
        if self.base is not None:
            return np.column_stack([foot, np.full(len(x), self.base)])
        for _ in range(12):  # Gauss-Newton along the rim: an error shrinks by distance over radius
            normal = self.plan.distance(foot)[1]
            along = np.column_stack([-normal[:, 1], normal[:, 0]])
            on_rim = np.column_stack([foot, self.height(foot)])
            gradient = self.implicit(on_rim).gradient
            rise = -np.einsum("ij,ij->i", gradient[:, :2], along) / gradient[:, 2]
            tangent = np.column_stack([along, rise])
            slide = np.einsum("ij,ij->i", x - on_rim, tangent) / (1.0 + rise**2)
            foot = foot + slide[:, None] * along
            across, normal, _ = self.plan.distance(foot)
            foot = foot - across[:, None] * normal
        return np.column_stack([foot, self.height(foot)])
