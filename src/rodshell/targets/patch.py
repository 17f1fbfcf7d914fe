"""Patches: the parts into which seams cut a target, each itself a target that ends at them."""

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.geometry.frames import unit
from rodshell.targets.target import Implicit, Target
from rodshell.validation import LARGEST, short

ON_CREST = 1e-4  # of its length: points this close to a crease in plan are on it
BEYOND = 1e3  # lengths of an open seam by which its two ends are prolonged


@dataclass(frozen=True, eq=False)
class Seam:
    """A polyline in the plan along which a target is cut vertically; make one with `Seam.of`.

    An open seam is prolonged straight past both ends. Seams with the same points are equal.

    Args:
        points: (n, 2) [m].
        crests: fine polylines (k, 3) on the parts of it that are creases [m].
    """

    points: Floats
    crests: tuple[Floats, ...] = ()

    @staticmethod
    def of(points: ArrayLike) -> "Seam":
        """Make a seam of points (n, 2), or (n, 3), whose z is ignored [m].

        Raises:
            InputError: fewer than two different points, or one that is not finite.
        """
        try:
            given = np.asarray(points, dtype=float)
        except (TypeError, ValueError, OverflowError):
            raise InputError(f"a seam must be a list of points (x, y) in m, not {short(points)}") from None
        if given.ndim != 2 or given.shape[1] not in (2, 3) or not (np.abs(given) < LARGEST).all():
            raise InputError(f"a seam must be a list of finite points (x, y) in m, not of the shape {given.shape}")
        plan = given[:, :2]
        plan = plan[np.append(True, np.linalg.norm(np.diff(plan, axis=0), axis=1) > 0)]
        if len(plan) < 2:
            raise InputError("a seam needs at least two different points: it is a line across the plan")
        return Seam(plan)

    def __eq__(self, other: object) -> bool:
        return np.array_equal(self.points, other.points) if isinstance(other, Seam) else NotImplemented

    def __hash__(self) -> int:
        return hash(tuple(map(tuple, self.points.tolist())))

    def __repr__(self) -> str:
        ends = " to ".join(f"({x:g}, {y:g})" for x, y in self.points[[0, -1]].tolist())
        return f"Seam({len(self.points)} points, {'closed' if self.closed else ends + ' m'})"

    @property
    def closed(self) -> bool:
        """Whether the last point is the first again."""
        return len(self.points) > 3 and bool(np.all(self.points[0] == self.points[-1]))

    @cached_property
    def _corners(self) -> Floats:
        """The points; of an open seam the first and the last are moved far out."""
        x = self.points.copy()
        if not self.closed:
            far = BEYOND * float(np.linalg.norm(np.ptp(x, axis=0)))
            first, last = x[0] - x[1], x[-1] - x[-2]
            x[0] += far * first / np.linalg.norm(first)
            x[-1] += far * last / np.linalg.norm(last)
        return x

    def distance(self, x: Floats) -> Floats:
        """Signed distance (n,) [m] of points `x` (n, 2 or 3) in plan, positive to the left of the seam's direction."""
        k, share, off = self._nearest(x)
        edge = np.diff(self._corners, axis=0)
        left = np.column_stack([-edge[:, 1], edge[:, 0]]) / np.linalg.norm(edge, axis=1)[:, None]
        before = np.where((share <= 0.0) & ((k > 0) | self.closed), k - 1, k)
        after = np.where((share >= 1.0) & ((k < len(edge) - 1) | self.closed), (k + 1) % len(edge), k)
        side = left[before] + left[after]  # at a corner the mean of both sides decides
        return np.asarray(np.copysign(np.linalg.norm(off, axis=1), np.einsum("ni,ni->n", off, side)))

    def along(self, x: Floats) -> tuple[Floats, Floats]:
        """Arc length (n,) [m] of the seam's points closest to points `x` (n, 2 or 3), and unit tangents (n, 2) there.

        It is counted from the seam's second point, or from the first of a closed one.
        """
        edge = np.diff(self._corners, axis=0)
        length = np.linalg.norm(edge, axis=1)
        begin = np.cumsum(length) - length - (0.0 if self.closed else length[0])
        k, share, _ = self._nearest(x)
        return np.asarray(begin[k] + share * length[k]), np.asarray(edge[k] / length[k, None])

    def height(self, x: Floats) -> Floats:
        """z (n,) [m] of the crease over points `x` (n, 2 or 3) of the seam; NaN where it runs along none."""
        z = np.full(len(x), np.nan)
        for crest in self.crests:
            k, share, off = nearest(crest[:, :2], x)
            here = np.linalg.norm(off, axis=1) < ON_CREST * np.linalg.norm(np.ptp(crest, axis=0))
            z[here] = (crest[k, 2] + share * (crest[k + 1, 2] - crest[k, 2]))[here]
        return z

    def _nearest(self, x: Floats) -> tuple[Ints, Floats, Floats]:
        return nearest(self._corners, x)


def nearest(line: Floats, x: Floats) -> tuple[Ints, Floats, Floats]:
    """Of each point (n, 2 or 3): nearest edge of a polyline (m, 2), its fraction before the closest point, the vector
    (n, 2) from there."""
    start, edge = line[:-1], np.diff(line, axis=0)
    off = x[:, None, :2] - start
    share = np.clip(np.einsum("nki,ki->nk", off, edge) / np.einsum("ki,ki->k", edge, edge), 0.0, 1.0)
    off = off - share[..., None] * edge
    k = np.argmin(np.einsum("nki,nki->nk", off, off), axis=1)
    row = np.arange(len(x))
    return k, share[row, k], off[row, k]


@dataclass(frozen=True, kw_only=True, repr=False)
class Patch(Target):
    """A part of a target: the points on given sides of its seams.

    Args:
        surface: the target that has the patch's surface, and continues it past a seam: the whole; or where that is
            creased along a seam, the smooth piece of it on this side.
        sides: for each seam 1 if the patch is on its left, -1 if it is on its right.
        middle: x, y of a point well inside [m], the default of the anchor.
    """

    whole: Target
    surface: Target
    seams: tuple[Seam, ...]
    sides: tuple[int, ...]
    middle: tuple[float, float]

    @property
    def name(self) -> str:
        return self.whole.name

    @property
    def size(self) -> float:
        """The size of the whole target [m], so that the gaps of all patches are related to one length."""
        return self.whole.size

    @property
    def base(self) -> float | None:
        return self.whole.base

    @property
    def summit(self) -> tuple[float, float]:
        return self.middle

    def parameters(self) -> dict[str, object]:
        return self.whole.parameters()

    def __repr__(self) -> str:
        x, y = self.middle
        return f"Patch(around ({x:.3g}, {y:.3g}) m, {len(self.seams)} seam{'s' * (len(self.seams) != 1)}, {self.whole})"

    def margin(self, x: Floats) -> Floats:
        """Distance (n,) [m] of the points `x` (n, 3) to the whole target's end and the seams, positive inside."""
        apart = [side * seam.distance(x) for seam, side in zip(self.seams, self.sides, strict=True)]
        return np.asarray(np.min([self.whole.margin(x), *apart], axis=0))

    def on_seam(self, x: Floats, seam: int) -> Floats:
        """The common point (3,) [m] of the surface and a seam that is closest to `x` (3,), a point near both; where the
        seam runs along a crease the crease's."""
        for _ in range(12):
            value, gradient = self.level(x[None])
            rows = np.vstack([gradient, self._aside(x, seam)])
            apart = self.seams[seam].distance(x[None])
            step = np.linalg.lstsq(rows, -np.append(value, apart), rcond=None)[0]
            x = x + step
            if np.linalg.norm(step) <= 1e-15 * self.size:
                break
        z = self.seams[seam].height(x[None])[0]
        return np.append(x[:2], z) if np.isfinite(z) else x

    def across(self, x: Floats, seam: int) -> Floats:
        """Unit tangent (3,) of the surface at right angles to a seam, at a point `x` (3,) of both."""
        normal = unit(self.level(x[None])[1])[0]
        return unit(self._aside(x, seam) - (self._aside(x, seam) @ normal) * normal)

    def _aside(self, x: Floats, seam: int) -> Floats:
        """Gradient (3,) of the distance from a seam, by differences: the seam's pieces are straight."""
        h, apart = 1e-6 * self.size, self.seams[seam].distance
        return np.asarray((apart(x + h * np.eye(3)) - apart(x - h * np.eye(3))) / (2 * h))

    def covers(self, x: Floats) -> Bools:
        return self.whole.covers(x)

    def implicit(self, x: Floats) -> Implicit:
        return self.surface.implicit(x)

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        return self.surface.level(x)

    def height_at(self, xy: Floats) -> Floats:
        return self.surface.height_at(xy)
