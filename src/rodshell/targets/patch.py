"""A patch: the part of a target on given sides of its seams, itself a target that ends at them."""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.geometry.vectors import unit
from rodshell.targets.seam import Seam
from rodshell.targets.target import Gap, Implicit, Target


@dataclass(frozen=True, kw_only=True, eq=False)
class Patch(Target):
    """The points of `whole` that lie to the left (side 1) or to the right (side -1) of each seam.

    The surface goes on smoothly past a seam: there it is the rest of the whole.

    Parameters
    ----------
    middle : x, y of a point well inside [m]: where the anchor is by default.
    """

    whole: Target
    seams: tuple[Seam, ...]
    sides: tuple[int, ...]
    middle: tuple[float, float]

    @property
    def name(self) -> str:
        return self.whole.name

    @property
    def size(self) -> float:
        """That of the whole [m], so that the gaps of all patches are made relative alike."""
        return self.whole.size

    @property
    def base(self) -> float | None:
        return self.whole.base

    @property
    def summit(self) -> tuple[float, float]:
        return self.middle

    def parameters(self) -> dict[str, object]:
        return self.whole.parameters()

    def margin(self, x: Floats) -> Floats:
        """(n,) how far inside the whole's end and the seams the points (n, 3) are [m]."""
        apart = [side * seam.distance(x) for seam, side in zip(self.seams, self.sides, strict=True)]
        return np.asarray(np.min([self.whole.margin(x), *apart], axis=0))

    def on_seam(self, x: Floats, seam: int) -> Floats:
        """The point (3,) of the surface and of a seam nearest to a point (3,) near both, by Newton."""
        for _ in range(12):
            value, gradient = self.level(x[None])
            rows = np.vstack([gradient, self._aside(x, seam)])
            apart = self.seams[seam].distance(x[None])
            step = np.linalg.lstsq(rows, -np.append(value, apart), rcond=None)[0]
            x = x + step
            if np.linalg.norm(step) <= 1e-15 * self.size:
                break
        return x

    def across(self, x: Floats, seam: int) -> Floats:
        """(3,) unit tangent of the surface at right angles to a seam, at a point (3,) of both."""
        normal = unit(self.level(x[None])[1])[0]
        return unit(self._aside(x, seam) - (self._aside(x, seam) @ normal) * normal)

    def _aside(self, x: Floats, seam: int) -> Floats:
        """(3,) gradient of the distance from a seam, by differences: the seam's pieces are straight."""
        h, apart = 1e-6 * self.size, self.seams[seam].distance
        return np.asarray((apart(x + h * np.eye(3)) - apart(x - h * np.eye(3))) / (2 * h))

    def carries(self, x: Floats) -> Bools:
        return self.whole.carries(x)

    def implicit(self, x: Floats) -> Implicit:
        return self.whole.implicit(x)

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        return self.whole.level(x)

    def height(self, xy: Floats) -> Floats:
        return self.whole.height(xy)

    def retract(self, x: Floats, steps: int = 4) -> Floats:
        return self.whole.retract(x, steps)

    def on_surface(self, x: Floats) -> Gap:
        return self.whole.on_surface(x)

    def closest(self, x: Floats) -> Floats:
        return self.whole.closest(x)

    def gap(self, x: Floats) -> Gap:
        return self.whole.gap(x)
