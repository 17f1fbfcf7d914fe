"""Regions of the plan: where a height field is defined, and what a target's rim encloses."""

from dataclasses import dataclass
from typing import Protocol

import numba as nb
import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.validation import numbers, positive


class Domain(Protocol):
    """A region of the plan."""

    @property
    def half_extent(self) -> tuple[float, float]:
        """Half the width along x and along y [m]."""
        ...

    def holds(self, xy: Floats) -> Bools:
        """Whether points of the plan are inside or on the edge.

        Parameters
        ----------
        xy : (n, 2) points [m].

        Returns
        -------
        (n,) booleans.
        """
        ...

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
        """Signed distance to the edge, negative inside.

        Parameters
        ----------
        xy : (n, 2) points [m].

        Returns
        -------
        Distance (n,) [m], its gradient (n, 2) [-] and its Hessian (n, 2, 2) [1/m].
        """
        ...


@dataclass(frozen=True)
class Disc:
    """A disc around the origin of the plan.

    Parameters
    ----------
    radius : [m].

    Raises
    ------
    InputError : the radius is not a positive number.
    """

    radius: float

    def __post_init__(self) -> None:
        object.__setattr__(self, "radius", positive("domain radius", self.radius, "m"))

    @property
    def half_extent(self) -> tuple[float, float]:
        return self.radius, self.radius

    def holds(self, xy: Floats) -> Bools:
        return np.asarray(np.hypot(xy[:, 0], xy[:, 1]) <= self.radius)

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
        r = np.maximum(np.hypot(xy[:, 0], xy[:, 1]), 1e-300)
        n = xy / r[:, None]
        hessian = (np.eye(2) - n[:, :, None] * n[:, None, :]) / r[:, None, None]
        return r - self.radius, n, hessian


@dataclass(frozen=True)
class EllipseDomain:
    """The points with (x/a)^2 + (y/b)^2 <= 1.

    Parameters
    ----------
    a, b : half-axes along x and y [m].

    Raises
    ------
    InputError : a half-axis is not a positive number.
    """

    a: float
    b: float

    def __post_init__(self) -> None:
        for axis in ("a", "b"):
            object.__setattr__(self, axis, positive(f"domain {axis}", getattr(self, axis), "m"))

    @property
    def half_extent(self) -> tuple[float, float]:
        return self.a, self.b

    def holds(self, xy: Floats) -> Bools:
        return np.asarray(np.hypot(xy[:, 0] / self.a, xy[:, 1] / self.b) <= 1.0)

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
        axes = np.array([self.a, self.b])
        # closest point: x_k = a_k^2 p_k / (a_k^2 + t) with sum (a_k p_k / (a_k^2 + t))^2 = 1;
        # in s = t + min(a)^2 the root is bracketed and the function convex, so Newton from the left end
        # converges monotonically; a little off the axes: on the long one a closest point has a mirror image
        p = np.maximum(np.abs(xy), 1e-12 * axes)
        low = np.min(axes) ** 2
        shift = axes**2 - low
        t = np.maximum(np.max(axes * p - shift, axis=1), 1e-14 * low)
        _find_roots(axes * p, shift, 1e-14 * low, t)
        foot = np.where(xy < 0, -1.0, 1.0) * axes**2 * p / (t[:, None] + shift)
        normal = foot / axes**2
        normal /= np.maximum(np.linalg.norm(normal, axis=1), 1e-300)[:, None]
        d = np.einsum("ij,ij->i", xy - foot, normal)
        curvature = 1.0 / (self.a**2 * self.b**2 * np.sum((foot / axes**2) ** 2, axis=1) ** 1.5)
        along = np.stack([-normal[:, 1], normal[:, 0]], axis=1)
        bend = curvature / np.maximum(1.0 + d * curvature, 1e-3)
        return d, normal, bend[:, None, None] * along[:, :, None] * along[:, None, :]


@dataclass(frozen=True)
class Rectangle:
    """A rectangle centred on the origin of the plan: |x| <= width/2 and |y| <= depth/2.

    Parameters
    ----------
    size : width along x and depth along y [m].

    Raises
    ------
    InputError : the size is not a pair of positive numbers.
    """

    size: tuple[float, float]

    def __post_init__(self) -> None:
        size = numbers("domain size", self.size, "two lengths in m: width along x, depth along y", 2)
        object.__setattr__(self, "size", tuple(positive("domain size", side, "m") for side in size))

    @property
    def half_extent(self) -> tuple[float, float]:
        return self.size[0] / 2, self.size[1] / 2

    def holds(self, xy: Floats) -> Bools:
        return np.asarray((np.abs(xy) <= self.half_extent).all(axis=1))

    def distance(self, xy: Floats) -> tuple[Floats, Floats, Floats]:
        q = np.abs(xy) - np.array(self.half_extent)
        outside = np.maximum(q, 0.0)
        corner = np.hypot(outside[:, 0], outside[:, 1])
        d = corner + np.minimum(np.max(q, axis=1), 0.0)
        nearest = np.eye(2)[np.argmax(q, axis=1)]
        n = np.where(corner[:, None] > 0, outside / np.maximum(corner, 1e-300)[:, None], nearest)
        bent = (outside > 0).all(axis=1)
        along = np.stack([-n[:, 1], n[:, 0]], axis=1) * np.sign(xy)
        hessian = np.where(bent, 1.0 / np.maximum(corner, 1e-300), 0.0)[:, None, None]
        return d, n * np.where(xy < 0, -1.0, 1.0), hessian * along[:, :, None] * along[:, None, :]


@nb.njit(cache=True, error_model="numpy")
def _find_roots(ap, shift, least, t):  # type: ignore[no-untyped-def]
    """Newton's method on  sum_k (a_k p_k / (t + shift_k))^2 = 1  for each row of ap, in place from below the root."""
    for n in range(len(t)):
        for _ in range(60):
            f, slope = -1.0, 0.0
            for k in range(2):
                part = (ap[n, k] / (t[n] + shift[k])) ** 2
                f += part
                slope -= 2.0 * part / (t[n] + shift[k])
            step = -f / min(slope, -1e-300) if slope < 0 else 0.0
            t[n] = max(t[n] + step, least)
            if abs(step) <= 1e-14 * t[n]:
                break
