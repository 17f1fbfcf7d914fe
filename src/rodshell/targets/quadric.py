"""The paper's targets [HQK Eqs 13a-c] and the spherical cap: quadrics over a base plane."""

from abc import abstractmethod
from dataclasses import dataclass, fields
from functools import cached_property
from math import sqrt

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.kernels import njit
from rodshell.targets.rim import Disc, Domain, EllipseDomain
from rodshell.targets.target import Implicit
from rodshell.targets.wall_below_rim import WalledTarget
from rodshell.validation import keep, number, positive


@dataclass(frozen=True, eq=False)
class _Quadric(WalledTarget):
    """F = scale (sum_k w_k x_k^2 + slope z - 1), centred on the origin, cut at the base plane."""

    @property
    @abstractmethod
    def terms(self) -> tuple[tuple[float, float, float], float, float]:
        """The three w_k [1/m2], the slope [1/m], and the scale [m], with which the gradient at the top has length 1."""

    @property
    def base(self) -> float:
        return 0.0

    @property
    def summit(self) -> tuple[float, float]:
        return 0.0, 0.0

    def parameters(self) -> dict[str, object]:
        return {"kind": self.name, **{field.name: getattr(self, field.name) for field in fields(self)}}

    def implicit(self, x: Floats) -> Implicit:
        return Implicit(*_implicit(x, *self._form))

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        value, gradient = _level(x, *self._form)
        return value, gradient

    @cached_property
    def _form(self) -> tuple[Floats, float, float]:
        """Weights and slope times the scale, and the scale; kept, as the march evaluates them thousands of times."""
        weights, slope, scale = self.terms
        return scale * np.array(weights), scale * slope, scale

    def height_at(self, xy: Floats) -> Floats:
        w, slope, _ = self.terms
        rest = 1.0 - w[0] * xy[:, 0] ** 2 - w[1] * xy[:, 1] ** 2
        if w[2] == 0.0:
            return rest / slope
        return np.sqrt(np.where(rest >= 0.0, rest, np.nan) / w[2])


@njit("f2 f1 f f")
def _level(x, weights, slope, scale):  # type: ignore[no-untyped-def]
    value, gradient = np.empty(len(x)), np.empty((len(x), 3))
    for n in range(len(x)):
        total = slope * x[n, 2] - scale
        for k in range(3):
            total += weights[k] * x[n, k] * x[n, k]
            gradient[n, k] = 2.0 * weights[k] * x[n, k]
        gradient[n, 2] += slope
        value[n] = total
    return value, gradient


@njit("f2 f1 f f")
def _implicit(x, weights, slope, scale):  # type: ignore[no-untyped-def]
    value, gradient = _level(x, weights, slope, scale)
    hessian = np.zeros((len(x), 3, 3))
    for n in range(len(x)):
        for k in range(3):
            hessian[n, k, k] = 2.0 * weights[k]
    return value, gradient, hessian


@dataclass(frozen=True)
class Hemisphere(_Quadric):
    """x^2 + y^2 + z^2 = radius^2, z >= 0 [HQK Eq 13a].

    Args:
        radius: [m].

    Raises:
        InputError: the radius is not a positive number.
    """

    name = "hemisphere"
    radius: float

    def __post_init__(self) -> None:
        keep(self, positive, "m", "radius", what="target {}")

    @property
    def plan(self) -> Domain:
        return Disc(self.radius)

    @property
    def terms(self) -> tuple[tuple[float, float, float], float, float]:
        w = 1.0 / self.radius**2
        return (w, w, w), 0.0, self.radius / 2


@dataclass(frozen=True)
class Cap(Hemisphere):
    """The part of a sphere around the origin that lies above a base plane.

    Args:
        radius: of the sphere [m].
        base: z of the base plane [m]; default 0, which makes a hemisphere.

    Raises:
        InputError: the radius is not a positive number, or the base plane does not cut the sphere.
    """

    name = "cap"
    base: float = 0.0

    def __post_init__(self) -> None:
        super().__post_init__()
        keep(self, number, "m", "base", what="target {}")
        if not abs(self.base) < self.radius:
            raise InputError(
                f"the cap's base plane z = {self.base} m must cut the sphere of radius {self.radius} m: "
                f"give a base between {-self.radius} and {self.radius} m"
            )

    @property
    def plan(self) -> Domain:
        return Disc(sqrt(self.radius**2 - self.base**2))

    @property
    def size(self) -> float:
        """Half the width of the shell in plan [m]; that of the equator, where the cap reaches below it."""
        return self.radius if self.base < 0 else max(self.plan.half_extent)


@dataclass(frozen=True)
class Paraboloid(_Quadric):
    """(x^2 + y^2) / radius^2 + z / height = 1, z >= 0 [HQK Eq 13b].

    Args:
        radius: of the rim [m].
        height: of the top above the rim [m].

    Raises:
        InputError: radius or height is not a positive number.
    """

    name = "paraboloid"
    radius: float
    height: float

    def __post_init__(self) -> None:
        keep(self, positive, "m", "radius", "height", what="target {}")

    @property
    def plan(self) -> Domain:
        return Disc(self.radius)

    @property
    def terms(self) -> tuple[tuple[float, float, float], float, float]:
        w = 1.0 / self.radius**2
        return (w, w, 0.0), 1.0 / self.height, self.height


@dataclass(frozen=True)
class Ellipsoid(_Quadric):
    """(x/a)^2 + (y/b)^2 + (z/c)^2 = 1, z >= 0 [HQK Eq 13c].

    Args:
        a, b, c: half-axes along x, y and z [m].

    Raises:
        InputError: a half-axis is not a positive number.
    """

    name = "ellipsoid"
    a: float
    b: float
    c: float

    def __post_init__(self) -> None:
        keep(self, positive, "m", *"abc", what="target {}")

    @property
    def plan(self) -> Domain:
        return EllipseDomain(self.a, self.b)

    @property
    def terms(self) -> tuple[tuple[float, float, float], float, float]:
        return (1.0 / self.a**2, 1.0 / self.b**2, 1.0 / self.c**2), 0.0, self.c / 2
