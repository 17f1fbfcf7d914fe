"""Scale, turn and move what is in a file to where it is to stand."""

from dataclasses import dataclass
from math import isfinite

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Placement:
    """x -> scale turn(x) + move.

    Parameters
    ----------
    scale : factor, about the origin.
    turn : angles about x, y and z, in that order [rad].
    move : [m].
    """

    scale: float = 1.0
    turn: tuple[float, float, float] = (0.0, 0.0, 0.0)
    move: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def __post_init__(self) -> None:
        if not (isfinite(self.scale) and self.scale > 0):
            raise InputError(f"target scale must be positive, not {self.scale}: turn the target to mirror what is up")
        if not all(map(isfinite, (*self.turn, *self.move))):
            raise InputError(f"target turn and move must be finite, not {self.turn} and {self.move}")

    def __call__(self, x: Floats) -> Floats:
        """Points (n, 3) where they are to stand [m]."""
        for axis, angle in enumerate(self.turn):
            c, s = np.cos(angle), np.sin(angle)
            i, j = (axis + 1) % 3, (axis + 2) % 3
            turned = x.copy()
            turned[:, i], turned[:, j] = c * x[:, i] - s * x[:, j], s * x[:, i] + c * x[:, j]
            x = turned
        return self.scale * x + np.array(self.move)

    def parameters(self) -> dict[str, object]:
        """What differs from no placement, as it stands in a case file."""
        own: dict[str, object] = {"scale": self.scale, "turn": list(self.turn), "move": list(self.move)}
        still = {"scale": 1.0, "turn": [0.0, 0.0, 0.0], "move": [0.0, 0.0, 0.0]}
        return {key: value for key, value in own.items() if value != still[key]}
