"""A target that is cut along its creases: smooth pieces, each with a field of its own, that meet at seams."""

from collections.abc import Mapping, Sequence
from functools import cached_property

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.dataclass import dataclass
from rodshell.errors import InputError
from rodshell.targets.field_fitting import CLOSE, Fit
from rodshell.targets.freeform import TIE, Freeform
from rodshell.targets.patch import Seam
from rodshell.targets.target import Deviation, Implicit, Target
from rodshell.targets.trianglemesh import Neighbours, smooth_piece

DENSE = 0.04  # of the size: distance of the points by which the patches are found


@dataclass(frozen=True, kw_only=True, eq=False)
class Creased(Freeform):
    """A mesh whose creases lie on seams; make one with `cut_at`.

    Parameters
    ----------
    uncut : the target of the same mesh.
    drawn, seams : the lines as they are given, and where they cut: along creases that are near.
    pieces : by the sides of the seams on which they are, see `Patch`.
    """

    uncut: Freeform
    drawn: tuple[Seam, ...]
    seams: tuple[Seam, ...]
    pieces: Mapping[tuple[int, ...], Freeform]

    def piece(self, sides: tuple[int, ...]) -> Freeform:
        """The piece on these sides of the seams; where there is none, the one that differs in the fewest."""
        return self.pieces[min(self.pieces, key=lambda known: sum(np.not_equal(known, sides).tolist()))]

    def _by_piece(self, x: Floats) -> list[tuple[Freeform, Bools]]:
        """The pieces, and which of the points (n, 3) are on their sides of the seams."""
        side = np.array([np.where(seam.distance(x) > 0, 1, -1) for seam in self.seams]).reshape(-1, len(x)).T
        kinds, kind = np.unique(side, axis=0, return_inverse=True)
        return [(self.piece(tuple(sides)), kind.reshape(-1) == k) for k, sides in enumerate(kinds.tolist())]

    @property
    def deviation(self) -> Deviation:
        found = [piece.deviation for piece in self.pieces.values()]
        weights = [len(piece.surface.vertices) for piece in self.pieces.values()]
        mean = np.average([each.rms**2 for each in found], weights=weights)
        return Deviation(max(each.max for each in found), float(np.sqrt(mean)))

    def implicit(self, x: Floats) -> Implicit:
        result = Implicit(np.empty(len(x)), np.empty((len(x), 3)), np.empty((len(x), 3, 3)))
        for piece, here in self._by_piece(x):
            for into, values in zip(result, piece.implicit(x[here]), strict=True):
                into[here] = values
        return result

    def level(self, x: Floats) -> tuple[Floats, Floats]:
        value, gradient = np.empty(len(x)), np.empty((len(x), 3))
        for piece, here in self._by_piece(x):
            value[here], gradient[here] = piece.level(x[here])
        return value, gradient

    @cached_property
    def _fitted(self) -> Fit:
        raise NotImplementedError("each piece has a field of its own")

    def _filled(self, x: Floats) -> Bools:
        result = np.empty(len(x), dtype=bool)
        for piece, here in self._by_piece(x):
            result[here] = piece._filled(x[here])
        return result

    def _heights_of_fillings(self, xy: Floats) -> Floats:
        return np.asarray(np.fmax.reduce([piece._heights_of_fillings(xy) for piece in self.pieces.values()]))

    @cached_property
    def summit(self) -> tuple[float, float]:
        """x, y of the highest vertex inside the end [m]; of equally high ones the nearest to the middle."""
        x = self.surface.vertices[self.margin(self.surface.vertices) > -1e-6 * self._extent]
        high = x[x[:, 2] >= x[:, 2].max() - TIE * self._extent, :2]
        middle = 0.5 * (x.min(axis=0) + x.max(axis=0))[:2]
        at: list[float] = high[np.argmin(np.linalg.norm(high - middle, axis=1))].tolist()
        return at[0], at[1]

    def survey(self) -> tuple[Floats, Floats]:
        """Points (n, 3) inside the end, each standing for an area (n,) [m2]: the middles of small triangles."""
        x = self.surface.vertices[self.surface.faces]
        while True:
            long = np.linalg.norm(np.roll(x, -1, axis=1) - x, axis=2).max(axis=1) > DENSE * self.size
            if not long.any():
                break
            middles = 0.5 * (x[long] + np.roll(x[long], -1, axis=1))
            corners = [np.stack([x[long, k], middles[:, k], middles[:, k - 1]], axis=1) for k in range(3)]
            x = np.concatenate([x[~long], middles, *corners])
        areas = 0.5 * np.linalg.norm(np.cross(x[:, 1] - x[:, 0], x[:, 2] - x[:, 0]), axis=1)
        points = x.mean(axis=1)
        inside = self.margin(points) > 0
        return points[inside], areas[inside]


def cut_at(target: Target, seams: Sequence[Seam]) -> Target:
    """A target as seams cut it: where a mesh is creased along them, in smooth pieces that meet there.

    Parameters
    ----------
    target : of any kind; one that was cut before is cut again.
    seams : lines in plan; the creases near them are taken.

    Raises
    ------
    InputError : the mesh is creased where there is no seam, or a piece between them is not smooth; names lines that do.
    """
    drawn = tuple(seams)
    if isinstance(target, Creased):
        if target.drawn == drawn:
            return target
        target = target.uncut
    if not isinstance(target, Freeform):
        return target
    if not drawn or (not target.creased and target.deviation.max < CLOSE * target.size):
        target.require_usable()
        return target
    lines = [target.creases.along(seam) for seam in drawn]
    cut = tuple(line or seam for line, seam in zip(lines, drawn, strict=True))
    if (target.creased or any(lines)) and (left := target.creases.lines(apart_from=cut)):
        x, y = left[0][len(left[0]) // 2]
        raise InputError(
            f"{target.name} is creased near ({x:.3g}, {y:.3g}) m, where there is no seam{target.along_creases}"
        )
    if not any(lines):
        target.require_usable()
        return target
    pieces = dict[tuple[int, ...], Freeform]()
    bridged = [line is not None and not line.crests for line in lines]
    for sides, mesh in target.creases.pieces(cut, bridged).items():
        found = smooth_piece(mesh, Neighbours.of(mesh, target.name), f"{target.name}, between its seams,")
        if not found.smooth:
            raise InputError(found.creased + target.along_creases)
        pieces[sides] = Freeform(surface=found.surface)
        pieces[sides].require_a_good_fit(target.name)
    whole = target.creases.mesh
    given = {key: getattr(target, key) for key in ("base", "curves", "source", "repairs")}
    return Creased(surface=whole, whole=whole, uncut=target, drawn=drawn, seams=cut, pieces=pieces, **given)
