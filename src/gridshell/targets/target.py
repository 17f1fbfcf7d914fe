"""What every target offers: an implicit surface, continued smoothly past the place where the shell ends."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gridshell.errors import InputError
from gridshell.targets.domain import Domain

Floats = NDArray[np.float64]


class Implicit(NamedTuple):
    """F (n,), its gradient (n, 3) and Hessian (n, 3, 3); F > 0 outside, and |grad F| is of order 1."""

    value: Floats
    gradient: Floats
    hessian: Floats


class Gap(NamedTuple):
    """Signed distance (n,) to a surface [m], its gradient, the outward normal (n, 3), and Hessian (n, 3, 3).

    On the surface the Hessian is the shape operator: 1/R in every tangent direction of a sphere.
    """

    distance: Floats
    normal: Floats
    hessian: Floats


@dataclass(frozen=True)
class Target(ABC):
    """A surface F(x) = 0 that ends at a base plane or at the edge of its domain.

    The surface itself is continued smoothly past that end: the net is marched there, and a rod is cut where
    it crosses. For draping under gravity the body is closed by a wall straight down from its rim.
    """

    @property
    @abstractmethod
    def name(self) -> str: ...

    @property
    @abstractmethod
    def plan(self) -> Domain:
        """The region enclosed by the rim, seen from above."""

    @property
    def base(self) -> float | None:
        """z of the base plane [m]; None where the target ends at the edge of its plan."""
        return None

    @abstractmethod
    def implicit(self, x: Floats) -> Implicit:
        """The implicit function at the points (n, 3) [m], also past the end."""

    @abstractmethod
    def height(self, xy: Floats) -> Floats:
        """z (n,) of the (upper) surface over the plan points (n, 2) [m]; NaN where there is none."""

    @property
    @abstractmethod
    def summit(self) -> tuple[float, float]:
        """x, y of the highest point inside the end [m]: where the anchor is by default."""

    @abstractmethod
    def parameters(self) -> dict[str, object]:
        """The target's kind and numbers in SI, as they stand in a case file."""

    @cached_property
    def size(self) -> float:
        """Half the larger width of the plan [m]: the length by which gaps are made relative."""
        return max(self.plan.half_extent)

    def margin(self, x: Floats) -> Floats:
        """(n,) how far inside the end the points (n, 3) are [m]; the shell is cut where this vanishes."""
        if self.base is not None:
            return x[:, 2] - self.base
        return -self.plan.distance(x[:, :2])[0]

    def retract(self, x: Floats, steps: int = 4) -> Floats:
        """Points (n, 3) moved onto the surface along its gradient (near the closest point for small gaps)."""
        for _ in range(steps):
            value, gradient, _ = self.implicit(x)
            x = x - (value / np.einsum("ij,ij->i", gradient, gradient))[:, None] * gradient
            if np.max(np.abs(value), initial=0.0) <= 1e-15 * self.size:
                break
        return x

    def on_surface(self, x: Floats) -> Gap:
        """Normal and shape operator at points (n, 3) that lie on the surface; the distance is taken as 0."""
        _, gradient, hessian = self.implicit(x)
        steepness = np.linalg.norm(gradient, axis=1)
        n = gradient / steepness[:, None]
        tangential = np.eye(3) - n[:, :, None] * n[:, None, :]
        shape = tangential @ (hessian / steepness[:, None, None]) @ tangential
        return Gap(np.zeros(len(x)), n, shape)

    def closest(self, x: Floats) -> Floats:
        """Closest points (n, 3) of the continued surface [m]; a local minimum beyond a centre of curvature."""
        with np.errstate(all="ignore"):  # NaN, far out where the surface has no continuation
            y = self.retract(x)
            settled = np.zeros(len(x), dtype=bool)
            for _ in range(12):
                step, convex = self._newton_to_closest(x, y, 0.0)
                length = np.linalg.norm(step, axis=1)
                y = y + step * np.minimum(1.0, 0.3 * self.size / np.maximum(length, 1e-300))[:, None]
                settled = convex & (length <= 1e-13 * self.size)
                if settled.all():
                    return y
            left = np.flatnonzero(~settled)
            y[left] = self._descend_to_closest(x[left])
            return y

    def _newton_to_closest(self, x: Floats, y: Floats, damping: float | Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """One step (n, 3) of Newton on y + F'(y) t = x, F(y) = 0; and whether the distance is convex at y."""
        value, gradient, hessian = self.implicit(y)
        square = np.einsum("ij,ij->i", gradient, gradient)
        t = np.einsum("ij,ij->i", x - y, gradient) / square
        bent = np.eye(3) * (1.0 + np.reshape(damping, (-1, 1, 1))) + t[:, None, None] * hessian
        system = np.zeros((len(x), 4, 4))
        system[:, :3, :3] = bent
        system[:, :3, 3] = system[:, 3, :3] = gradient
        right = np.column_stack([x - y - t[:, None] * gradient, -value])
        both = np.einsum("nii->n", bent) - np.einsum("ni,nij,nj->n", gradient, bent, gradient) / square
        convex = (np.linalg.det(system) < 0) & (both > 0)  # product and sum of the two tangential eigenvalues
        return _solve(system, right)[:, :3], convex

    def _descend_to_closest(self, x: Floats) -> Floats:
        """The same with steps that are damped until they lead closer: for points beyond a centre of curvature."""
        y = self.retract(x, 20)
        damping = np.ones(len(x))
        for _ in range(60):
            step, convex = self._newton_to_closest(x, y, damping)
            trial = self.retract(y + step)
            nearer = convex & (np.linalg.norm(x - trial, axis=1) < np.linalg.norm(x - y, axis=1))
            y[nearer] = trial[nearer]
            damping = np.where(nearer, 0.1 * damping, 4.0 * damping + 0.1)
            if np.all(~nearer & (damping > 1e3)):
                break
        for _ in range(2):  # comparing distances finds a minimum to half the digits only
            step, convex = self._newton_to_closest(x, y, 0.0)
            near = convex & (np.linalg.norm(step, axis=1) < 1e-3 * self.size)
            y[near] += step[near]
        return y

    def gap(self, x: Floats) -> Gap:
        """Signed distance of the points (n, 3) to the continued surface, positive outside [m]."""
        y = self.closest(x)
        _, n, shape = self.on_surface(y)
        distance = np.einsum("ij,ij->i", x - y, n)
        return Gap(distance, n, _offset_shape(shape, distance))

    def contact(self, x: Floats) -> Gap:
        """Signed distance (n,) to the body that a falling grid meets: surface, and wall below its rim."""
        y = self.closest(x)
        _, n, shape = self.on_surface(y)
        distance = np.einsum("ij,ij->i", x - y, n)
        hessian = _offset_shape(shape, distance)
        ended = ~(self.margin(y) >= 0)
        # beside the wall, which stands under the base or the rim, the nearer of surface and wall counts
        low = np.flatnonzero(distance < 0 if self.base is None else x[:, 2] < self.base)
        across, from_surface = self.plan.distance(x[low, :2])[0], distance[low]
        ended[low] |= np.where(from_surface < 0, across > from_surface, across < from_surface)
        if ended.any():
            distance[ended], n[ended], hessian[ended] = self._wall(x[ended], ~(distance[ended] <= 0))
        return Gap(distance, n, hessian)

    def _wall(self, x: Floats, over: NDArray[np.bool_]) -> Gap:
        """The wall under the rim, or its upper corner; `over`: above the continued surface."""
        across, normal, bend = self.plan.distance(x[:, :2])
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

    def lift(self, xy: Floats) -> Floats:
        """Points (n, 3) of the surface over the plan points (n, 2).

        Raises
        ------
        InputError : there is no surface over a point.
        """
        z = self.height(xy)
        if not np.isfinite(z).all():
            x, y = xy[int(np.argmin(np.isfinite(z)))]
            raise InputError(f"the target has no point over ({x:g}, {y:g}) m: choose one inside its rim")
        return np.column_stack([xy, z])


def _offset_shape(shape: Floats, distance: Floats) -> Floats:
    """Hessian of the distance at a point `distance` away: S (I + d S)^-1."""
    return np.asarray(shape @ np.linalg.inv(np.eye(3) + distance[:, None, None] * shape))


def _solve(systems: Floats, right: Floats) -> Floats:
    """Solve many small systems; a singular one (a centre of curvature) takes its least-squares solution."""
    try:
        return np.asarray(np.linalg.solve(systems, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        return np.asarray(np.einsum("nij,nj->ni", np.linalg.pinv(systems), right))
