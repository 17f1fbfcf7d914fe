"""The paper's targets [HQK Eqs 13a-c] and the spherical cap: quadrics over a base plane."""

from abc import abstractmethod
from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numba as nb
import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.targets.domain import Disc, Domain, EllipseDomain
from rodshell.targets.standing import Standing
from rodshell.targets.target import Implicit
from rodshell.validation import number, positive


@dataclass(frozen=True)
class _Quadric(Standing):
    """F = scale (sum_k w_k x_k^2 + slope z - 1), centred on the origin, cut at the base plane."""

    @property
    @abstractmethod
    def weights(self) -> tuple[float, float, float]:
        """w_k [1/m2]"""

    @property
    def slope(self) -> float:
        """[1/m]"""
        return 0.0

    @property
    @abstractmethod
    def scale(self) -> float:
        """[m], chosen so that the gradient at the top has length 1."""

    @property
    def summit(self) -> tuple[float, float]:
        return 0.0, 0.0

    def implicit(self, x: Floats) -> Implicit:
        return Implicit(*_implicit(x, *self._form))

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        value, gradient = _level(x, *self._form)
        return value, gradient

    @cached_property
    def _form(self) -> tuple[Floats, float, float]:
        """Weights and slope times the scale, and the scale: the march asks for them thousands of times."""
        return self.scale * np.array(self.weights), self.scale * self.slope, self.scale

    def height(self, xy: Floats) -> Floats:
        w = self.weights
        rest = 1.0 - w[0] * xy[:, 0] ** 2 - w[1] * xy[:, 1] ** 2
        if w[2] == 0.0:
            return rest / self.slope
        return np.sqrt(np.where(rest >= 0.0, rest, np.nan) / w[2])


@nb.njit(cache=True)
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


@nb.njit(cache=True)
def _implicit(x, weights, slope, scale):  # type: ignore[no-untyped-def]
    value, gradient = _level(x, weights, slope, scale)
    hessian = np.zeros((len(x), 3, 3))
    for n in range(len(x)):
        for k in range(3):
            hessian[n, k, k] = 2.0 * weights[k]
    return value, gradient, hessian


@dataclass(frozen=True)
class Hemisphere(_Quadric):
    """x^2 + y^2 + z^2 = radius^2, z >= 0 [HQK Eq 13a]; `radius` [m]."""

    radius: float

    def __post_init__(self) -> None:
        positive("target radius", self.radius, "m")

    @property
    def name(self) -> str:
        return "hemisphere"

    @property
    def plan(self) -> Domain:
        return Disc(self.radius)

    @property
    def base(self) -> float:
        return 0.0

    @property
    def weights(self) -> tuple[float, float, float]:
        w = 1.0 / self.radius**2
        return w, w, w

    @property
    def scale(self) -> float:
        return self.radius / 2

    def parameters(self) -> dict[str, object]:
        return {"kind": "hemisphere", "radius": self.radius}


@dataclass(frozen=True)
class Cap(Hemisphere):
    """The part of a sphere of the given `radius` [m] above z = `base` [m], its centre being z = 0."""

    base_height: float = 0.0

    def __init__(self, radius: float, base: float) -> None:
        object.__setattr__(self, "radius", radius)
        object.__setattr__(self, "base_height", base)
        positive("target radius", radius, "m")
        number("target base", base, "m")
        if not abs(base) < radius:
            raise InputError(
                f"the cap's base plane z = {base} m must cut the sphere of radius {radius} m: "
                f"give a base between {-radius} and {radius} m"
            )

    @property
    def name(self) -> str:
        return "cap"

    @property
    def plan(self) -> Domain:
        return Disc(sqrt(self.radius**2 - self.base_height**2))

    @property
    def base(self) -> float:
        return self.base_height

    @property
    def size(self) -> float:
        """Half the width of the shell in plan [m]: the equator's, where the cap reaches below it."""
        return self.radius if self.base_height < 0 else max(self.plan.half_extent)

    def parameters(self) -> dict[str, object]:
        return {"kind": "cap", "radius": self.radius, "base": self.base_height}


@dataclass(frozen=True)
class Paraboloid(_Quadric):
    """(x^2 + y^2) / radius^2 + z / height = 1, z >= 0 [HQK Eq 13b]; `radius`, `peak` (its height) [m]."""

    radius: float
    peak: float

    def __init__(self, radius: float, height: float) -> None:
        object.__setattr__(self, "radius", radius)
        object.__setattr__(self, "peak", height)
        positive("target radius", radius, "m")
        positive("target height", height, "m")

    @property
    def name(self) -> str:
        return "paraboloid"

    @property
    def plan(self) -> Domain:
        return Disc(self.radius)

    @property
    def base(self) -> float:
        return 0.0

    @property
    def weights(self) -> tuple[float, float, float]:
        w = 1.0 / self.radius**2
        return w, w, 0.0

    @property
    def slope(self) -> float:
        return 1.0 / self.peak

    @property
    def scale(self) -> float:
        return self.peak

    def parameters(self) -> dict[str, object]:
        return {"kind": "paraboloid", "radius": self.radius, "height": self.peak}


@dataclass(frozen=True)
class Ellipsoid(_Quadric):
    """(x/a)^2 + (y/b)^2 + (z/c)^2 = 1, z >= 0 [HQK Eq 13c]; half-axes `a`, `b`, `c` [m]."""

    a: float
    b: float
    c: float

    def __post_init__(self) -> None:
        for axis in "abc":
            positive(f"target {axis}", getattr(self, axis), "m")

    @property
    def name(self) -> str:
        return "ellipsoid"

    @property
    def plan(self) -> Domain:
        return EllipseDomain(self.a, self.b)

    @property
    def base(self) -> float:
        return 0.0

    @property
    def weights(self) -> tuple[float, float, float]:
        return 1.0 / self.a**2, 1.0 / self.b**2, 1.0 / self.c**2

    @property
    def scale(self) -> float:
        return self.c / 2

    def parameters(self) -> dict[str, object]:
        return {"kind": "ellipsoid", "a": self.a, "b": self.b, "c": self.c}
