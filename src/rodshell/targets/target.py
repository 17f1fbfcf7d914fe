"""What every target offers: an implicit surface, continued smoothly past the end of the shell."""

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from typing import Any, NamedTuple

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import dot
from rodshell.kernels import njit
from rodshell.validation import array

OF_PLAN = {"height_at", "lift"}  # methods of points of the plan, and of points in space
OF_SPACE = {"implicit", "level", "margin", "covers", "retract", "on_surface", "outside", "contact"}
OF_SPACE |= {"closest", "distance", "gap"}
NO_FORCES = np.empty((0, 3))
_NEARLY = 1e-8  # of the size: a step of Newton leaves the square of the error before it, here less than round-off


class Implicit(NamedTuple):
    """An implicit function F at n points; F > 0 outside, and |grad F| is of order 1.

    Args:
        value: (n,) F [m].
        gradient: (n, 3) [-].
        hessian: (n, 3, 3) [1/m].
    """

    value: Floats
    gradient: Floats
    hessian: Floats


class Gap(NamedTuple):
    """Signed distance of n points to a surface.

    Args:
        distance: (n,) positive outside [m].
        normal: (n, 3) its gradient, the outward unit normal.
        hessian: (n, 3, 3) [1/m]; on the surface the shape operator: 1/R in every tangent direction of a sphere.
    """

    distance: Floats
    normal: Floats
    hessian: Floats


class Deviation(NamedTuple):
    """Distance of a surface from the vertices of the mesh that it was fitted to [m]: the largest, and the root of the
    mean square."""

    max: float
    rms: float


def _checking_points(method: Callable[..., Any], name: str, columns: int) -> Callable[..., Any]:
    """The method, which converts points to an array (n, columns), or refuses them: a kernel would read what
    lies in memory after too short a row."""

    @wraps(method)
    def checked(self: "Target", *given: Any, **named: Any) -> Any:
        if not given:
            named |= {name: array(name, named[name], np.float64, None, columns)} if name in named else {}
        elif not (type(x := given[0]) is np.ndarray and x.dtype.char == "d" and x.ndim == 2 and x.shape[1] == columns):
            given = array(name, x, np.float64, None, columns), *given[1:]
        return method(self, *given, **named)

    return checked


@dataclass(frozen=True, eq=False)
class Target(ABC):
    """A surface F(x) = 0 that ends at a base plane, a rim or the edge of its plan.

    The surface is continued smoothly past that end: the net is marched there, and rods are cut where they cross the
    end. Lengths are in m, z is up. Points may be given as nested sequences of numbers, too; each method of points
    raises InputError for what has another shape.
    """

    def __init_subclass__(cls) -> None:
        super().__init_subclass__()
        cls._check_points()

    @classmethod
    def _check_points(cls) -> None:
        """Let the methods of points that this class defines check their points."""
        for name, method in tuple(vars(cls).items()):
            if name in OF_PLAN | OF_SPACE and not getattr(method, "__isabstractmethod__", False):
                points, columns = ("xy", 2) if name in OF_PLAN else ("x", 3)
                setattr(cls, name, _checking_points(method, points, columns))

    @property
    @abstractmethod
    def name(self) -> str:
        """Kind of the target, or the name of its file."""

    @property
    @abstractmethod
    def size(self) -> float:
        """Half the largest width of the shell [m], the length to which gaps are related."""

    @property
    def base(self) -> float | None:
        """z of the base plane [m]; None for a target that does not end at one."""
        return None

    @property
    def warnings(self) -> tuple[str, ...]:
        """What the user should know about the target itself, in sentences."""
        return ()

    @property
    def deviation(self) -> Deviation | None:
        """How far the surface is from the mesh that it replaces; None for a target that replaces none."""
        return None

    @abstractmethod
    def implicit(self, x: Floats) -> Implicit:
        """Evaluate the implicit function at points `x` (n, 3) [m], also past the end."""

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        """F (n,) [m] and its gradient (n, 3) at the points `x` (n, 3) [m], without second derivatives."""
        value, gradient, _ = self.implicit(x)
        return value, gradient

    @abstractmethod
    def height_at(self, xy: Floats) -> Floats:
        """z (n,) [m] of the uppermost surface over the points `xy` (n, 2) of the plan [m]; NaN where there is none."""

    @property
    @abstractmethod
    def summit(self) -> tuple[float, float]:
        """x, y of the highest point inside the end [m], the default of the anchor."""

    @abstractmethod
    def parameters(self) -> dict[str, object]:
        """The target's kind and numbers in SI, as they are written in a case file."""

    @abstractmethod
    def margin(self, x: Floats) -> Floats:
        """Distance (n,) [m] of points `x` (n, 3) on or near the surface to the end, positive inside; 0 where the shell
        is cut."""

    def covers(self, x: Floats) -> Bools:
        """Whether a net can start at the points `x` (n, 3) of the surface: inside the end, or in a filled opening."""
        return self.margin(x) > 0

    def retract(self, x: Floats, steps: int = 4) -> Floats:
        """Move points `x` (n, 3) [m] onto the surface along its gradient, by at most as many steps of Newton's method;
        for small gaps this leads near the closest points."""
        x = np.ascontiguousarray(x)
        for _ in range(steps):
            x, furthest = _along_gradient(x, *self.level(x))
            if furthest <= _NEARLY * self.size:
                break
        return x

    def on_surface(self, x: Floats) -> Gap:
        """Normal and shape operator at points `x` (n, 3) [m] that lie on the surface; the distance is taken as 0."""
        _, gradient, hessian = self.implicit(x)
        normal, shape = np.empty_like(gradient), np.empty_like(hessian)
        shape_operators(gradient, hessian, NO_FORCES, normal, shape)
        return Gap(np.zeros(len(x)), normal, shape)

    def closest(self, x: Floats) -> Floats:
        """Closest points (n, 3) [m] of the continued surface to `x` (n, 3) [m].

        For points beyond a centre of curvature it is a local minimum of the distance.
        """
        return self._closest(x)[0]

    def _closest(self, x: Floats) -> tuple[Floats, Floats]:
        """Closest points (n, 3), and the gradient there, as accurate as they were before the last step."""
        with np.errstate(all="ignore"):  # NaN far away, where the surface has no continuation
            y, gradient, left = self.retract(x, 1), np.empty_like(x), np.arange(len(x))
            for _ in range(12):
                length = self._newton_to_closest(x, y, gradient, left, longest=0.3 * self.size)
                left = left[~(length <= _NEARLY * self.size)]
                if len(left) == 0:
                    return y, gradient
            y[left] = self._descend_to_closest(x[left])
            gradient[left] = self.level(y[left])[1]
            return y, gradient

    def _newton_to_closest(
        self, x: Floats, y: Floats, gradient: Floats, rows: Ints, damping: Floats | None = None, longest: float = np.inf
    ) -> Floats:
        """One step of Newton from the points y[rows] towards those closest to x[rows]: see `newton_to_closest`."""
        length = np.empty(len(rows))
        damping = np.zeros(len(rows)) if damping is None else damping
        newton_to_closest(x, y, rows, *self.implicit(y.take(rows, axis=0)), damping, longest, gradient, length)
        return length

    def _descend_to_closest(self, x: Floats) -> Floats:
        """Closest points by damped steps that only decrease the distance: for points beyond a centre of curvature."""
        y, gradient, every = self.retract(x, 20), np.empty_like(x), np.arange(len(x))
        damping = np.ones(len(x))
        for _ in range(60):
            trial = y.copy()
            length = self._newton_to_closest(x, trial, gradient, every, damping)
            trial = self.retract(trial)
            nearer = np.isfinite(length) & (np.linalg.norm(x - trial, axis=1) < np.linalg.norm(x - y, axis=1))
            y[nearer] = trial[nearer]
            damping = np.where(nearer, 0.1 * damping, 4.0 * damping + 0.1)
            if np.all(~nearer & (damping > 1e3)):
                break
        for _ in range(2):  # a comparison of distances finds a minimum only to half the digits
            trial = y.copy()
            near = self._newton_to_closest(x, trial, gradient, every) < 1e-3 * self.size
            y[near] = trial[near]
        return y

    def distance(self, x: Floats) -> Floats:
        """Signed distance (n,) [m] of the points `x` (n, 3) [m] to the continued surface, positive outside."""
        y, gradient = self._closest(x)
        away = x - y
        return np.copysign(np.sqrt(dot(away, away)), dot(away, gradient))

    def gap(self, x: Floats) -> Gap:
        """Signed distance of the points `x` (n, 3) [m] to the continued surface, with gradient and Hessian."""
        y = self.closest(x)
        _, n, shape = self.on_surface(y)
        distance = np.einsum("ij,ij->i", x - y, n)
        return Gap(distance, n, offset_shape(shape, distance))

    def outside(self, x: Floats) -> Bools:
        """(n,) whether signs alone show that the points `x` (n, 3) [m] are outside the body of `contact`.

        A quick test: other points may be outside too.
        """
        return np.zeros(len(x), dtype=bool)

    def contact(self, x: Floats) -> Gap:
        """Signed distance of points `x` (n, 3) [m] to the body on which a grid falls: the surface and a wall below its
        rim.

        Raises:
            InputError: this target has no such body.
        """
        raise InputError(f'a grid cannot fall on a target of kind "{self.name}": use drape method "bound"')

    def lift(self, xy: Floats) -> Floats:
        """Points (n, 3) [m] of the surface over the points `xy` (n, 2) of the plan [m].

        Raises:
            InputError: there is no surface over a point.
        """
        z = self.height_at(xy)
        if not np.isfinite(z).all():
            x, y = xy[int(np.argmin(np.isfinite(z)))]
            raise InputError(f"the target has no point over ({x:g}, {y:g}) m: choose one inside its rim")
        return np.column_stack([xy, z])


Target._check_points()


@njit("f3 f1")  # type: ignore[untyped-decorator, unused-ignore]
def offset_shape(shape: Floats, distance: Floats) -> Floats:
    """Hessians (n, 3, 3) [1/m] of the distance at points away from a surface, S (I + d S)^-1, from the shape operators
    S (n, 3, 3) at the closest points [1/m] and the signed distances d (n,) [m]."""
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


@njit("f2 f2 i1 f1 f2 f3 f1 f f2 f1")
def newton_to_closest(x, y, rows, value, gradient, hessian, damping, longest, slope, length):  # type: ignore[no-untyped-def]
    """One step of Newton towards the closest points: y + t F'(y) = x, F(y) = 0.

    Across the tangent plane the step leads to F = 0; within it, it solves B step = x - y, B = (1 + damping) + t F''.
    At a centre of curvature B is singular within the plane, and the step has no part there.

    Args:
        x, y: (n, 3) points, and estimates of the points closest to them, which are moved [m].
        rows: (m,) of the points that are moved.
        value, gradient, hessian: (m,), (m, 3), (m, 3, 3) F there, see `Implicit`.
        damping: (m,) 0 for Newton's step, larger for shorter steps.
        longest: longer steps are shortened [m].
        slope: (n, 3) output in these rows, F' before the step.
        length: (m,) output, of Newton's step [m]; infinite where the distance is not convex.
    """
    for m in range(len(rows)):
        row, gx, gy, gz = rows[m], gradient[m, 0], gradient[m, 1], gradient[m, 2]
        slope[row, 0], slope[row, 1], slope[row, 2] = gx, gy, gz
        scale = 1.0 / np.sqrt(gx * gx + gy * gy + gz * gz)
        nx, ny, nz = scale * gx, scale * gy, scale * gz
        dx, dy, dz = x[row, 0] - y[row, 0], x[row, 1] - y[row, 1], x[row, 2] - y[row, 2]
        t = scale * (dx * nx + dy * ny + dz * nz)
        # two tangents [Duff et al. 2017, Building an orthonormal basis, revisited]
        sign = 1.0 if nz >= 0.0 else -1.0
        a = -1.0 / (sign + nz)
        b = nx * ny * a
        px, py, pz = 1.0 + sign * nx * nx * a, sign * b, -sign * nx
        qx, qy, qz = b, sign + ny * ny * a, -ny
        h = hessian[m]
        hpx, hpy, hpz = _times(h, px, py, pz)
        hqx, hqy, hqz = _times(h, qx, qy, qz)
        stiff = 1.0 + damping[m]
        pp = stiff + t * (px * hpx + py * hpy + pz * hpz)
        pq = t * (px * hqx + py * hqy + pz * hqz)
        qq = stiff + t * (qx * hqx + qy * hqy + qz * hqz)
        out = -scale * value[m]
        right_p = px * dx + py * dy + pz * dz - out * t * (nx * hpx + ny * hpy + nz * hpz)
        right_q = qx * dx + qy * dy + qz * dz - out * t * (nx * hqx + ny * hqy + nz * hqz)
        det = pp * qq - pq * pq
        along_p, along_q = (qq * right_p - pq * right_q) / det, (pp * right_q - pq * right_p) / det
        if det == 0.0:
            along_p = along_q = 0.0
        size = np.sqrt(out * out + along_p * along_p + along_q * along_q)
        length[m] = size if det > 0.0 and pp + qq > 0.0 else np.inf
        shortened = longest / size if size > longest else 1.0
        y[row, 0] += shortened * (out * nx + along_p * px + along_q * qx)
        y[row, 1] += shortened * (out * ny + along_p * py + along_q * qy)
        y[row, 2] += shortened * (out * nz + along_p * pz + along_q * qz)


@njit("f2 f1 f2")
def _along_gradient(x, value, gradient):  # type: ignore[no-untyped-def]
    """One step of Newton from points x (n, 3) [m] to F = 0 along the gradient, and the largest |F| before it."""
    result, furthest = np.empty((len(x), 3)), 0.0
    for m in range(len(x)):
        gx, gy, gz = gradient[m, 0], gradient[m, 1], gradient[m, 2]
        step = value[m] / (gx * gx + gy * gy + gz * gz)
        result[m, 0], result[m, 1], result[m, 2] = x[m, 0] - step * gx, x[m, 1] - step * gy, x[m, 2] - step * gz
        furthest = max(furthest, abs(value[m]))
    return result, furthest


@njit()
def _times(h, x, y, z):  # type: ignore[no-untyped-def]
    return (
        h[0, 0] * x + h[0, 1] * y + h[0, 2] * z,
        h[1, 0] * x + h[1, 1] * y + h[1, 2] * z,
        h[2, 0] * x + h[2, 1] * y + h[2, 2] * z,
    )


@njit("f2 f3 f2 f2 f3")
def shape_operators(gradient, hessian, forces, normal, shape):  # type: ignore[no-untyped-def]
    """Unit normals n, and shape operators P F'' P / |F'| with P = 1 - n n.

    Args:
        gradient, hessian: (m, 3), (m, 3, 3) of F at points of the surface.
        forces: (m, 3) by whose normal components the operators are multiplied [N]; empty: they are not.
        normal, shape: (m, 3), (m, 3, 3) output.
    """
    for m in range(len(gradient)):
        gx, gy, gz = gradient[m]
        scale = 1.0 / np.sqrt(gx * gx + gy * gy + gz * gz)
        n, h = (scale * gx, scale * gy, scale * gz), hessian[m]
        normal[m, 0], normal[m, 1], normal[m, 2] = n
        hx, hy, hz = _times(h, n[0], n[1], n[2])
        twice = n[0] * hx + n[1] * hy + n[2] * hz
        hn = hx - 0.5 * twice * n[0], hy - 0.5 * twice * n[1], hz - 0.5 * twice * n[2]
        if len(forces) > 0:
            scale *= n[0] * forces[m, 0] + n[1] * forces[m, 1] + n[2] * forces[m, 2]
        for i in range(3):
            for j in range(3):
                shape[m, i, j] = scale * (h[i, j] - hn[i] * n[j] - n[i] * hn[j])
