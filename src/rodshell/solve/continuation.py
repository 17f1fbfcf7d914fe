"""How far to go along a path: longer after a step that was easy, shorter after one that failed."""

from dataclasses import dataclass
from math import copysign

LONGER, SHORTER = 1.6, 0.4
_ARRIVED = 1e-9  # of the parameter: a step that ends so near ends there


@dataclass
class Continuation:
    """A parameter on its way, up or down, from where it is to its end.

    Args:
        t, stop: the parameter, and where it goes.
        step: the next step, or the longest one that is allowed.
        shortest: of the steps.
    """

    t: float
    stop: float
    step: float
    shortest: float

    @property
    def arrived(self) -> bool:
        return self.t == self.stop

    @property
    def there(self) -> float:
        """The end of the next step."""
        left = self.stop - self.t
        return self.stop if abs(left) - self.step < _ARRIVED else self.t + copysign(self.step, left)

    @property
    def length(self) -> float:
        """Of the next step."""
        return min(self.step, abs(self.stop - self.t))

    @property
    def lost(self) -> bool:
        """Whether the step is too short to be tried."""
        return self.step < self.shortest

    def accept(self, *, easy: bool = False) -> None:
        """The step succeeded."""
        self.t = self.there
        if easy:
            self.step *= LONGER

    def shorten(self) -> None:
        """The step failed."""
        self.step = SHORTER * self.length
