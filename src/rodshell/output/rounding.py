"""How finely lengths are shown: one rule for drawings, schedules, tables, summary and report."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import floor, isfinite, log10
from typing import Any

FINEST, COARSEST = 1e-3, 1.0  # mm
OF_ROD = 1e-4  # share of the longest rod to which lengths are shown where no tolerance is given


@dataclass(frozen=True)
class Rounding:
    """Lengths to the next `step` [mm], a power of ten; each from its exact value, never from rounded ones."""

    step: float

    @property
    def digits(self) -> int:
        """Decimals of a length in mm."""
        return max(round(-log10(self.step)), 0)

    def mm(self, metres: float | None) -> str:
        """A length [m] in mm, without its unit and without a minus before a zero; "" where it is not known."""
        if metres is None or not isfinite(metres):
            return ""
        return f"{round(1e3 * metres, self.digits) + 0.0:.{self.digits}f}"

    @property
    def words(self) -> str:
        return f"{self.step:g} mm"


def rounding_of(result: Mapping[str, Any]) -> Rounding:
    """The rule for a result: the power of ten not above half of the tolerance, so that rounding takes a quarter of it.

    Where no tolerance is given, the power of ten not above a ten-thousandth of the longest rod.
    """
    tolerance = (result.get("drawings") or {}).get("tolerance")
    if tolerance is None:
        longest = max((float(rod.get("length") or 0.0) for rod in result.get("rods") or []), default=0.0)
        asked = 1e3 * OF_ROD * longest
    else:
        asked = 0.5 * 1e3 * float(tolerance)
    power = 10.0 ** floor(log10(max(asked, FINEST)) + 1e-9)
    return Rounding(min(max(power, FINEST), COARSEST))
