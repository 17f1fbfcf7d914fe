"""What the workshop says: lengths that the shape does not decide."""

from dataclasses import dataclass
from math import isfinite

from rodshell.errors import InputError


@dataclass(frozen=True)
class Fabrication:
    """Lengths that decide the cutting.

    Parameters
    ----------
    end_allowance : added to a rod at each end [m], to be held by the support.
    stock_length : of the bars that rods are cut from [m]; None if every rod comes in one piece.
    kerf : lost at each saw cut of that stock [m].
    """

    end_allowance: float = 0.0
    stock_length: float | None = None
    kerf: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("end allowance", self.end_allowance), ("kerf", self.kerf)):
            if not (isfinite(value) and value >= 0):
                raise InputError(f"the {name} must not be negative, but is {value} m")
        if self.stock_length is None and self.kerf > 0:
            raise InputError(
                f"the kerf of {self.kerf} m is lost where stock is cut: give its stock_length, or leave the kerf out"
            )
        if self.stock_length is not None and not self.stock_length > self.kerf:
            raise InputError(
                f"stock of {self.stock_length} m cannot be cut with a kerf of {self.kerf} m: give longer bars"
            )
