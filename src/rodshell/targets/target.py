"""What every target offers: an implicit surface, continued smoothly past the place where the shell ends."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numba as nb
import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.errors import InputError
from rodshell.targets.closest import newton_to_closest, shape_operators

NEARLY = 1e-8  # of the size: Newton's step leaves the square of what was missing, which is then less than round-off


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
    """A surface F(x) = 0 that ends somewhere.

    The surface itself is continued smoothly past that end: the net is marched there, and a rod is cut where
    it crosses.
    """

    @property
    @abstractmethod
    def name(self) -> str: ...

    @property
    @abstractmethod
    def size(self) -> float:
        """Half the largest width of the shell [m]: the length by which gaps are made relative."""

    @property
    def base(self) -> float | None:
        """z of the base plane [m]; None where the target ends elsewhere."""
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """Sentences that a user should read about the target itself."""
        return ()

    @abstractmethod
    def implicit(self, x: Floats) -> Implicit:
        """The implicit function at the points (n, 3) [m], also past the end."""

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        """F (n,) and its gradient (n, 3) alone, where second derivatives would cost more."""
        value, gradient, _ = self.implicit(x)
        return value, gradient

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

    @abstractmethod
    def margin(self, x: Floats) -> Floats:
        """(n,) how far inside the end the points (n, 3) are [m]; the shell is cut where this vanishes."""

    def carries(self, x: Floats) -> Bools:
        """(n,) whether a net may start at the points (n, 3) of the surface: inside the end, or in an opening."""
        return self.margin(x) > 0

    def retract(self, x: Floats, steps: int = 4) -> Floats:
        """Points (n, 3) moved onto the surface along its gradient (near the closest point for small gaps)."""
        for _ in range(steps):
            value, gradient = self.level(x)
            x = x - (value / np.einsum("ij,ij->i", gradient, gradient))[:, None] * gradient
            if np.max(np.abs(value), initial=0.0) <= NEARLY * self.size:
                break
        return x

    def on_surface(self, x: Floats) -> Gap:
        """Normal and shape operator at points (n, 3) that lie on the surface; the distance is taken as 0."""
        _, gradient, hessian = self.implicit(x)
        normal, shape = np.empty_like(gradient), np.empty_like(hessian)
        shape_operators(gradient, hessian, normal, shape)
        return Gap(np.zeros(len(x)), normal, shape)

    def closest(self, x: Floats) -> Floats:
        """Closest points (n, 3) of the continued surface [m]; a local minimum beyond a centre of curvature."""
        return self._closest(x)[0]

    def _closest(self, x: Floats) -> tuple[Floats, Floats]:
        """Closest points (n, 3), and the gradient there but for an error like theirs before the last step."""
        with np.errstate(all="ignore"):  # NaN, far out where the surface has no continuation
            y, gradient = self.retract(x, 1), np.empty_like(x)
            left = np.arange(len(x))
            for _ in range(12):
                step, convex, gradient[left] = self._newton_to_closest(x[left], y[left])
                length = np.linalg.norm(step, axis=1)
                y[left] += step * np.minimum(1.0, 0.3 * self.size / np.maximum(length, 1e-300))[:, None]
                left = left[~(convex & (length <= NEARLY * self.size))]
                if len(left) == 0:
                    return y, gradient
            y[left] = self._descend_to_closest(x[left])
            gradient[left] = self.level(y[left])[1]
            return y, gradient

    def _newton_to_closest(self, x: Floats, y: Floats, damping: Floats | None = None) -> tuple[Floats, Bools, Floats]:
        """One step (n, 3) of Newton from y towards the points closest to x, whether the distance is convex at y, and
        the gradient there."""
        step, convex = np.empty_like(x), np.empty(len(x), dtype=bool)
        at = self.implicit(y)
        newton_to_closest(x, y, *at, np.zeros(len(x)) if damping is None else damping, step, convex)
        return step, convex, at.gradient

    def _descend_to_closest(self, x: Floats) -> Floats:
        """The same with steps that are damped until they lead closer: for points beyond a centre of curvature."""
        y = self.retract(x, 20)
        damping = np.ones(len(x))
        for _ in range(60):
            step, convex, _ = self._newton_to_closest(x, y, damping)
            trial = self.retract(y + step)
            nearer = convex & (np.linalg.norm(x - trial, axis=1) < np.linalg.norm(x - y, axis=1))
            y[nearer] = trial[nearer]
            damping = np.where(nearer, 0.1 * damping, 4.0 * damping + 0.1)
            if np.all(~nearer & (damping > 1e3)):
                break
        for _ in range(2):  # comparing distances finds a minimum to half the digits only
            step, convex, _ = self._newton_to_closest(x, y)
            near = convex & (np.linalg.norm(step, axis=1) < 1e-3 * self.size)
            y[near] += step[near]
        return y

    def distance(self, x: Floats) -> Floats:
        """Signed distance (n,) of the points (n, 3) to the continued surface, positive outside [m]."""
        y, gradient = self._closest(x)
        away = x - y
        return np.copysign(np.linalg.norm(away, axis=1), np.einsum("ij,ij->i", away, gradient))

    def gap(self, x: Floats) -> Gap:
        """As `distance`, with its gradient and Hessian."""
        y = self.closest(x)
        _, n, shape = self.on_surface(y)
        distance = np.einsum("ij,ij->i", x - y, n)
        return Gap(distance, n, offset_shape(shape, distance))

    def outside(self, x: Floats) -> Bools:
        """(n,) points that are outside the body of `contact` as far as signs alone tell; of others it knows."""
        return np.zeros(len(x), dtype=bool)

    def contact(self, x: Floats) -> Gap:
        """Signed distance (n,) to the body that a falling grid meets.

        Raises
        ------
        InputError : the target is no such body.
        """
        raise InputError(f'a grid cannot fall on a target of kind "{self.name}": use drape method "bound"')

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


@nb.njit(cache=True, error_model="numpy")
def offset_shape(shape: Floats, distance: Floats) -> Floats:
    """Hessians (n, 3, 3) of the distance at points `distance` (n,) away from a surface: S (I + d S)^-1."""
    result, a, adjugate = np.empty_like(shape), np.empty((3, 3)), np.empty((3, 3))
    for m in range(len(shape)):
        for i in range(3):
            for j in range(3):
                a[i, j] = distance[m] * shape[m, i, j] + (1.0 if i == j else 0.0)
        for i in range(3):
            for j in range(3):
                i1, i2, j1, j2 = (i + 1) % 3, (i + 2) % 3, (j + 1) % 3, (j + 2) % 3
                adjugate[j, i] = a[i1, j1] * a[i2, j2] - a[i1, j2] * a[i2, j1]
        volume = a[0, 0] * adjugate[0, 0] + a[0, 1] * adjugate[1, 0] + a[0, 2] * adjugate[2, 0]
        for i in range(3):
            for j in range(3):
                total = 0.0
                for k in range(3):
                    total += shape[m, i, k] * adjugate[k, j]
                result[m, i, j] = total / volume
    return result
