"""How the section of a rod changes along it: a factor on its bending stiffness between its two ends.

A profile belongs to a rod of the flat grid (`FlatRod.profile`), so that whatever has the grid has the profile. What
follows from it for the other stiffnesses, the mass and the stress is in `rods.varied`.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import Literal, get_args

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.validation import choice, listed, number, positive

Varies = Literal["size", "width", "height", "a", "b", "laths"]
DOUBLE = (0.05, 0.95)  # least and most share of a rod's length that is made double, where the share is chosen
# Gauss and Legendre's five points of a piece, and weights: 1e-5 of the mean of 1/f where f grows eightfold over it
_NEAR, _FAR = (sqrt(5 + sign * 2 * sqrt(10 / 7)) / 3 for sign in (-1, 1))
_LIGHT, _HEAVY = ((322 + sign * 13 * sqrt(70)) / 900 for sign in (-1, 1))
_GAUSS_POINTS = np.array([-_FAR, -_NEAR, 0.0, _NEAR, _FAR])
_GAUSS_WEIGHTS = np.array([_LIGHT, _HEAVY, 128 / 225, _HEAVY, _LIGHT])


@dataclass(frozen=True)
class Profile:
    """Factors on EI, the bending stiffness out of the grid, at stations along a rod; linear between them.

    Args:
        stations: shares of the rod's length, ascending from 0 at its start to 1 at its end; where one is given twice,
            the factor steps from the first value to the second.
        factors: on the EI of the rod's section, as many [-].
        varies: what is changed to reach them: "size", all lengths of the section alike; one length of the section by
            its name, "width" or "height" of a rectangle, "a" or "b" of an ellipse; or "laths", the number of equal
            laths that lie on each other and slip.

    Raises:
        InputError: stations do not ascend from 0 to 1; a factor is not a positive number; not as many of both.
    """

    stations: tuple[float, ...]
    factors: tuple[float, ...]
    varies: Varies = "size"

    def __post_init__(self) -> None:
        choice("varies", self.varies, get_args(Varies))
        for name, checked in (("stations", number), ("factors", positive)):
            given = listed(f"the {name} of a profile", getattr(self, name), "a sequence of numbers")
            object.__setattr__(self, name, tuple(checked(f"each of the {name} of a profile", value) for value in given))
        if len(self.stations) != len(self.factors) or len(self.stations) < 2:
            raise InputError(
                f"a profile needs a factor at each of two stations or more, not {len(self.factors)} factors at "
                f"{len(self.stations)} stations"
            )
        steps = np.diff(self.stations)
        inside = self.stations[0] == 0.0 and self.stations[-1] == 1.0
        if not (inside and (steps >= 0).all()) or ((steps[1:] == 0) & (steps[:-1] == 0)).any():
            raise InputError(
                "the stations of a profile are shares of the rod's length that ascend from 0 to 1, none more than "
                f"twice, not {self.stations}"
            )

    @staticmethod
    def symmetric(factors: Sequence[float], *, varies: Varies = "size") -> "Profile":
        """A profile that is the same from both ends, with equal distances between its stations.

        Args:
            factors: from an end to the middle [-].
            varies: as of the class.
        """
        half = listed("the factors of a profile", factors, "a sequence of numbers")
        whole = (*half, *half[-2::-1])
        return Profile(tuple(np.linspace(0.0, 1.0, len(whole))), whole, varies)

    @staticmethod
    def double(share: float) -> "Profile":
        """Two laths on each other over the middle of a rod, one elsewhere.

        Args:
            share: of the rod's length that is double, between 0 and 1.

        Raises:
            InputError: the share is not between 0 and 1.
        """
        if not 0.0 < number("the share of a rod's length that is double", share) < 1.0:
            raise InputError(f"the share of a rod's length that is double must lie between 0 and 1, not {share}")
        first, last = 0.5 * (1.0 - share), 0.5 * (1.0 + share)
        return Profile((0.0, first, first, last, last, 1.0), (1.0, 1.0, 2.0, 2.0, 1.0, 1.0), "laths")

    @property
    def uniform(self) -> bool:
        """Whether the factor is 1 everywhere."""
        return all(factor == 1.0 for factor in self.factors)

    @property
    def steps(self) -> tuple[float, ...]:
        """Shares of the length where the factor steps: where laths begin or end."""
        pairs = zip(self.stations, self.stations[1:], strict=False)
        return tuple(first for first, second in pairs if first == second)

    def laths(self, length: float, allowance: float = 0.0) -> tuple[tuple[float, float], ...]:
        """Where each lath beyond the first begins and ends, from the rod's start [m]; none where no laths vary.

        Args:
            length: of the rod [m].
            allowance: by which every lath that reaches an end of the rod is cut longer there [m].
        """
        found = list[tuple[float, float]]()
        parts = list(zip(self.stations, self.stations[1:], self.factors, self.factors[1:], strict=False))
        parts = [part for part in parts if part[0] < part[1]]
        for count in range(2, int(max(self.factors)) + 1 if self.varies == "laths" else 0):
            runs = list[list[float]]()
            for low, high, *factors in parts:
                if min(factors) < count:
                    continue
                if runs and runs[-1][1] == low:
                    runs[-1][1] = high
                else:
                    runs.append([low, high])
            found += [
                (low * length - (allowance if low == 0.0 else 0.0), high * length + (allowance if high == 1.0 else 0.0))
                for low, high in runs
            ]
        return tuple(found)

    def at(self, shares: Floats) -> Floats:
        """Factors (n,) at `shares` (n,) of the length; at a step the mean of both sides."""
        return np.asarray(0.5 * (self._beside(shares, "left") + self._beside(shares, "right")))

    def mean(self, function: Callable[[Floats], Floats], low: Floats, high: Floats) -> Floats:
        """(n, q) means of functions of the factor over parts of the rod.

        Args:
            function: of factors (p,), with values (p, q).
            low, high: (n,) where each part begins and ends, shares of the length.
        """
        breaks = np.unique(np.concatenate([self.stations, low, high]))
        width = np.diff(breaks)
        middle = 0.5 * (breaks[1:] + breaks[:-1])
        at = middle[:, None] + 0.5 * width[:, None] * _GAUSS_POINTS
        values = function(self.at(at.ravel())).reshape(*at.shape, -1)
        pieces = 0.5 * width[:, None] * np.einsum("pgq,g->pq", values, _GAUSS_WEIGHTS)
        total = np.concatenate([np.zeros((1, pieces.shape[1])), np.cumsum(pieces, axis=0)])
        first, last = np.searchsorted(breaks, low), np.searchsorted(breaks, high)
        return np.asarray((total[last] - total[first]) / (high - low)[:, None])

    def _beside(self, shares: Floats, side: Literal["left", "right"]) -> Floats:
        """The factor next to `shares`, towards the start or the end of the rod."""
        s, factors = np.array(self.stations), np.array(self.factors)
        after = np.clip(np.searchsorted(s, shares, side=side), 1, len(s) - 1)
        span = s[after] - s[after - 1]
        part = np.where(span > 0, (shares - s[after - 1]) / np.where(span > 0, span, 1.0), 0.5)
        return np.asarray(factors[after - 1] + np.clip(part, 0.0, 1.0) * (factors[after] - factors[after - 1]))
