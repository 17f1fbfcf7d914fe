"""What every target offers: an implicit surface, continued smoothly past the place where the shell ends."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from gridshell.errors import InputError

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

    def carries(self, x: Floats) -> NDArray[np.bool_]:
        """(n,) whether a net may start at the points (n, 3) of the surface: inside the end, or in an opening."""
        return self.margin(x) > 0

    def retract(self, x: Floats, steps: int = 4) -> Floats:
        """Points (n, 3) moved onto the surface along its gradient (near the closest point for small gaps)."""
        for _ in range(steps):
            value, gradient = self.level(x)
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
        return Gap(distance, n, offset_shape(shape, distance))

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


def offset_shape(shape: Floats, distance: Floats) -> Floats:
    """Hessian of the distance at a point `distance` away: S (I + d S)^-1."""
    return np.asarray(shape @ np.linalg.inv(np.eye(3) + distance[:, None, None] * shape))


def _solve(systems: Floats, right: Floats) -> Floats:
    """Solve many small systems; a singular one (a centre of curvature) takes its least-squares solution."""
    try:
        return np.asarray(np.linalg.solve(systems, right[:, :, None])[:, :, 0])
    except np.linalg.LinAlgError:
        return np.asarray(np.einsum("nij,nj->ni", np.linalg.pinv(systems), right))
