"""What every target offers: an implicit surface, continued smoothly past the place where the shell ends."""

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import NamedTuple

import numba as nb
import numpy as np
from numpy.typing import NDArray

from gridshell.errors import InputError

Floats = NDArray[np.float64]

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

    def carries(self, x: Floats) -> NDArray[np.bool_]:
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
        return Gap(np.zeros(len(x)), *_normal_and_shape(gradient, hessian))

    def closest(self, x: Floats) -> Floats:
        """Closest points (n, 3) of the continued surface [m]; a local minimum beyond a centre of curvature."""
        with np.errstate(all="ignore"):  # NaN, far out where the surface has no continuation
            y = self.retract(x)
            left = np.arange(len(x))
            for _ in range(12):
                step, convex = self._newton_to_closest(x[left], y[left], 0.0)
                length = np.linalg.norm(step, axis=1)
                y[left] += step * np.minimum(1.0, 0.3 * self.size / np.maximum(length, 1e-300))[:, None]
                left = left[~(convex & (length <= NEARLY * self.size))]
                if len(left) == 0:
                    return y
            y[left] = self._descend_to_closest(x[left])
            return y

    def _newton_to_closest(self, x: Floats, y: Floats, damping: float | Floats) -> tuple[Floats, NDArray[np.bool_]]:
        """One step (n, 3) of Newton on y + F'(y) t = x, F(y) = 0; and whether the distance is convex at y."""
        value, gradient, hessian = self.implicit(y)
        damped = np.broadcast_to(damping, len(x))
        return _closest_step(x, y, value, gradient, hessian, damped)

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


@nb.njit(cache=True, error_model="numpy")
def _normal_and_shape(gradient, hessian):  # type: ignore[no-untyped-def]
    """Unit normals n (m, 3), and (m, 3, 3) P H P / |grad F| with P = 1 - n n'."""
    normal, shape = np.empty_like(gradient), np.empty_like(hessian)
    for m in range(len(gradient)):
        g, n, h, s = gradient[m], normal[m], hessian[m], shape[m]
        length = np.sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2])
        across = 0.0
        for i in range(3):
            n[i] = g[i] / length
        for i in range(3):
            for j in range(3):
                across += n[i] * h[i, j] * n[j]
        for i in range(3):
            hn_i = h[i, 0] * n[0] + h[i, 1] * n[1] + h[i, 2] * n[2]
            for j in range(3):
                hn_j = h[j, 0] * n[0] + h[j, 1] * n[1] + h[j, 2] * n[2]
                s[i, j] = (h[i, j] - hn_i * n[j] - n[i] * hn_j + across * n[i] * n[j]) / length
    return normal, shape


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


@nb.njit(cache=True, error_model="numpy")
def _closest_step(x, y, value, gradient, hessian, damping):  # type: ignore[no-untyped-def]
    """See `Target._newton_to_closest`. A singular system (a centre of curvature) takes its least-squares solution."""
    step, convex = np.empty_like(x), np.empty(len(x), dtype=np.bool_)
    system, right = np.zeros((4, 4)), np.empty(4)
    for m in range(len(x)):
        g = gradient[m]
        square, t = 0.0, 0.0
        for i in range(3):
            square += g[i] * g[i]
            t += (x[m, i] - y[m, i]) * g[i]
        t /= square
        trace, normal = 0.0, 0.0
        for i in range(3):
            right[i] = x[m, i] - y[m, i] - t * g[i]
            system[i, 3] = system[3, i] = g[i]
            for j in range(3):
                system[i, j] = t * hessian[m, i, j] + (1.0 + damping[m] if i == j else 0.0)
                normal += g[i] * system[i, j] * g[j]
            trace += system[i, i]
        right[3] = -value[m]
        both = trace - normal / square  # sum of the two tangential eigenvalues; the determinant's sign their product's
        solution, determinant = _solve(system, right)
        convex[m] = determinant < 0.0 and both > 0.0
        step[m] = solution[:3] if determinant != 0.0 else (np.linalg.pinv(system) @ right)[:3]
    return step, convex


@nb.njit(cache=True, error_model="numpy")
def _solve(system, right):  # type: ignore[no-untyped-def]
    """Elimination with pivoting; also the determinant."""
    a, b, determinant = system.copy(), right.copy(), 1.0
    n = len(b)
    for k in range(n):
        p = k
        for i in range(k + 1, n):
            if abs(a[i, k]) > abs(a[p, k]):
                p = i
        if p != k:
            determinant = -determinant
            b[k], b[p] = b[p], b[k]
            for j in range(n):
                a[k, j], a[p, j] = a[p, j], a[k, j]
        determinant *= a[k, k]
        for i in range(k + 1, n):
            factor = a[i, k] / a[k, k]
            for j in range(k, n):
                a[i, j] -= factor * a[k, j]
            b[i] -= factor * b[k]
    for k in range(n - 1, -1, -1):
        for j in range(k + 1, n):
            b[k] -= a[k, j] * b[j]
        b[k] /= a[k, k]
    return b, determinant
