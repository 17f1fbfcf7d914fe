"""A height function with its derivatives at any plan point, continued past where it can be trusted."""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Any

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.targets.domain import Disc, Rectangle
from rodshell.targets.jet import Jet, differences

NUDGE = 1e-5  # of the size: a 0/0 leaves round-off of 1e-16 / (nudge size)^2 in curvature, Taylor hardly less
DIFFERENCE = 2e-3  # of the size: step of the differences; truncation and round-off both some 1e-10 in curvature


@dataclass(frozen=True)
class Heights:
    """z = function(x, y) and its derivatives.

    Parameters
    ----------
    function : of x and y; takes jets where `exact`, plain arrays alone where not.
    size : half the larger width of its domain [m].
    exact : derivatives by jets; otherwise by differences.
    trusted : where the function is taken as it is; None for everywhere. Beyond, every normal of the region's
        edge carries the function's Taylor polynomial of second degree in that direction (beyond a corner of a
        rectangle, in both). The continued surface has continuous curvature, and its derivatives are exact:
        those of the polynomial's coefficients come from jets of jets.
    """

    function: Callable[[Any, Any], Any]
    size: float
    exact: bool = True
    trusted: Disc | Rectangle | None = None

    def jet(self, x: Floats, y: Floats) -> Jet:
        """z with its first and second derivatives at the points (n,); parts may be single floats."""
        with np.errstate(all="ignore"):
            if self.trusted is None:
                return self._inside(x, y)
            out = np.flatnonzero(self._beyond(self.trusted, x, y))
            if len(out) == 0:
                return self._inside(x, y)
            inside = np.ones(len(x), dtype=bool)
            inside[out] = False
            parts = np.empty((6, len(x)))
            if len(out) < len(x):
                _put(parts, inside, self._inside(x[inside], y[inside]))
            _put(parts, out, self._outside(self.trusted, *Jet.variables(x[out], y[out])))
            return Jet(*parts)

    def _inside(self, x: Floats, y: Floats) -> Jet:
        jet = self._evaluate(x, y)
        total = np.asarray(jet.value + jet.dxx + jet.dyy)
        if isfinite(float(np.add.reduce(total, axis=None))):
            return jet
        # 0/0 at a point of a smooth surface, as cos(sqrt(x^2 + y^2)) has: step aside, and back by Taylor
        broken = np.flatnonzero(~np.isfinite(np.broadcast_to(total, x.shape)))
        h, k = NUDGE * self.size, 0.7 * NUDGE * self.size
        near = self._evaluate(x[broken] + h, y[broken] + k)
        bent_x, bent_y = near.dxx * h + near.dxy * k, near.dxy * h + near.dyy * k
        back = near.value - (near.dx - bent_x / 2) * h - (near.dy - bent_y / 2) * k
        parts = np.empty((6, len(x)))
        _put(parts, slice(None), jet)
        _put(parts, broken, Jet(back, near.dx - bent_x, near.dy - bent_y, near.dxx, near.dxy, near.dyy))
        return Jet(*parts)

    def _evaluate(self, x: Floats, y: Floats) -> Jet:
        if not self.exact:
            return differences(self.function, x, y, DIFFERENCE * self.size)
        jet = self.function(*Jet.variables(x, y))
        return jet if isinstance(jet, Jet) else Jet(jet)

    @staticmethod
    def _beyond(trusted: Disc | Rectangle, x: Floats, y: Floats) -> Bools:
        a, b = trusted.half_extent
        if isinstance(trusted, Disc):
            return x * x + y * y > a * a
        return (np.abs(x) > a) | (np.abs(y) > b)

    def _outside(self, trusted: Disc | Rectangle, x: Jet, y: Jet) -> Jet:
        a, b = trusted.half_extent
        if isinstance(trusted, Disc):
            inward = a / np.sqrt(x * x + y * y)
            foot_x, foot_y = x * inward, y * inward
            polynomial = _taylor(self.function(Jet(foot_x, dx=x - foot_x), Jet(foot_y, dx=y - foot_y)))
        else:  # one direction after the other; each jet holds the series in one of them
            foot_x, foot_y = _clamped(x, a), _clamped(y, b)
            across = Jet(Jet(foot_x), dx=Jet(x - foot_x))
            up = Jet(Jet(foot_y, dx=y - foot_y))
            polynomial = _taylor(_taylor(self.function(across, up)))
        return polynomial if isinstance(polynomial, Jet) else Jet(polynomial)


def _taylor(series: Any) -> Any:
    """f(1) of the parabola with the value and derivatives of f at 0."""
    return series.value + series.dx + 0.5 * series.dxx if isinstance(series, Jet) else series


def _clamped(coordinate: Jet, limit: float) -> Jet:
    within = (np.abs(coordinate.value) <= limit).astype(float)
    return Jet(np.clip(coordinate.value, -limit, limit), within * coordinate.dx, within * coordinate.dy)


def _put(parts: Floats, where: Any, jet: Jet) -> None:
    for row, part in zip(parts, (jet.value, jet.dx, jet.dy, jet.dxx, jet.dxy, jet.dyy), strict=True):
        row[where] = part
