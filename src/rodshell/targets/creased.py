"""A target that is cut along its creases: smooth pieces, each with a field of its own, that meet at seams."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from types import MappingProxyType

import numpy as np

from rodshell.arrays import Bools, Floats
from rodshell.errors import InputError
from rodshell.geometry.curves import arc_lengths
from rodshell.progress import Progress, silent
from rodshell.targets.creases import KINK, NEAR
from rodshell.targets.field_fitting import FittedField
from rodshell.targets.freeform import TIE, Freeform
from rodshell.targets.patch import Seam
from rodshell.targets.target import Deviation, Implicit, Target
from rodshell.targets.trianglemesh import Neighbours, smooth_piece

STEP = 0.02  # of the half extent: distance of the points at which continued pieces are followed to where they meet
ROUNDS = 2  # in which seams along creases that faces bridge are moved to where the pieces meet
CLEAR = 0.25  # of the largest turn along a crease: where it fades to less, where it runs is not clear
FOLLOWED = 5e-4  # of the size: a mesh that one field follows as closely is not cut
DENSE = 0.04  # of the size: distance of the points by which the patches are found


@dataclass(frozen=True, kw_only=True, eq=False)
class Creased(Freeform):
    """A mesh whose creases lie on seams; make one with `cut_at`.

    Args:
        uncut: the target of the same mesh.
        drawn, seams: the lines as they are given, and where they cut: along creases that are near.
        pieces: by the sides of the seams on which they are, see `Patch`.
    """

    uncut: Freeform
    drawn: tuple[Seam, ...]
    seams: tuple[Seam, ...]
    pieces: Mapping[tuple[int, ...], Freeform]

    def piece(self, sides: tuple[int, ...]) -> Freeform:
        """The piece on these sides of the seams; where there is none, the one that differs in the fewest."""
        return self.pieces[min(self.pieces, key=lambda known: sum(np.not_equal(known, sides).tolist()))]

    def _by_piece(self, x: Floats, held: Mapping[int, int] = MappingProxyType({})) -> list[tuple[Freeform, Bools]]:
        """The pieces, and which of the points (n, 2 or 3) are on their sides of the seams; of the seams that are `held`
        all points are on the given side."""
        sides = np.array([np.where(seam.distance(x) > 0, 1, -1) for seam in self.seams])
        for seam, side in held.items():
            sides[seam] = side
        kinds, kind = np.unique(sides, axis=1, return_inverse=True)
        return [(self.piece(tuple(signs)), kind.reshape(-1) == k) for k, signs in enumerate(kinds.T.tolist())]

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
    def _fitted(self) -> FittedField:
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

    def where_pieces_meet(self, k: int) -> Seam:
        """The k-th seam, roughly along a crease that faces bridge, moved to where the continued pieces meet."""
        points, extent = self.seams[k].points, self._extent
        if not self.seams[k].closed:
            out = points[[0, -1]] - points[[1, -2]]
            ends = points[[0, -1]] + 2 * extent * out / np.linalg.norm(out, axis=1)[:, None]
            points = np.vstack([ends[:1], points, ends[1:]])
        edge, s = np.diff(points, axis=0), arc_lengths(points)
        length = np.linalg.norm(edge, axis=1)
        at = np.arange(0.0, s[-1], STEP * extent)
        on = np.searchsorted(s, at, side="right") - 1
        across = np.column_stack([-edge[:, 1], edge[:, 0]])[on] / length[on, None]
        x = np.column_stack([np.interp(at, s, points[:, axis]) for axis in range(2)])
        z = self._heights_of_facets(x)
        x, across, z = x[np.isfinite(z)], across[np.isfinite(z)], z[np.isfinite(z)]
        moved = np.zeros(len(x))
        for _ in range(6):
            (top, slope), (other, other_slope) = (self._continued(x, z, k, side) for side in (1, -1))
            turn = np.einsum("ni,ni->n", slope - other_slope, across)
            sharp = np.abs(turn) > max(KINK, CLEAR * float(np.nanmax(np.abs(turn), initial=0.0)))
            known = np.isfinite(top - other) & sharp
            step = np.where(known, (other - top) / np.where(known, turn, 1.0), 0.0)
            step = np.clip(step, -STEP * extent, STEP * extent)
            x, moved = x + step[:, None] * across, moved + step
        known &= np.abs(moved) < NEAR * extent
        if known.sum() < 2:
            return self.seams[k]
        crest = np.column_stack([x, 0.5 * (top + other)])
        runs = np.split(np.flatnonzero(known), np.flatnonzero(np.diff(np.flatnonzero(known)) > 1) + 1)
        line = x[known]
        line = np.vstack([line, line[:1]]) if self.seams[k].closed else line
        return Seam(line, tuple(crest[run] for run in runs if len(run) > 1))

    def _continued(self, x: Floats, z: Floats, k: int, side: int) -> tuple[Floats, Floats]:
        """Heights (n,) near z (n,), and slopes (n, 2), of the piece on a side of the k-th seam over points (n, 2)."""
        height, slope = np.empty(len(x)), np.empty((len(x), 2))
        for piece, here in self._by_piece(x, {k: side}):
            height[here] = piece._straight_up(np.column_stack([x, z])[here])
            gradient = piece.level(np.column_stack([x, height])[here])[1]
            slope[here] = -gradient[:, :2] / gradient[:, 2:]
        return height, slope

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


def cut_at(target: Target, seams: Sequence[Seam], progress: Progress = silent) -> Target:
    """A target as seams cut it: where a mesh is creased along them, in smooth pieces that meet there.

    A target that was cut before is cut again. Creases near the seams are taken.

    Raises:
        InputError: the mesh is creased where there is no seam, or a piece between them is not smooth; names lines that
            do.
    """
    drawn = tuple(seams)
    if isinstance(target, Creased):
        if target.drawn == drawn:
            return target
        target = target.uncut
    if not isinstance(target, Freeform):
        return target
    if not drawn or (not target.creased and target.deviation.max < FOLLOWED * target.size):
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
    bridged = [line is not None and not line.crests for line in lines]
    made = _in_pieces(target, drawn, cut, bridged, progress)
    for _ in range(ROUNDS * any(bridged)):
        cut = tuple(made.where_pieces_meet(k) if bridge else cut[k] for k, bridge in enumerate(bridged))
        made = _in_pieces(target, drawn, cut, bridged, progress)
    return made


def _in_pieces(
    target: Freeform, drawn: tuple[Seam, ...], seams: tuple[Seam, ...], bridged: Sequence[bool], progress: Progress
) -> Creased:
    whole, pieces = target.creases.mesh, dict[tuple[int, ...], Freeform]()
    for sides, mesh in target.creases.pieces(seams, bridged).items():
        found = smooth_piece(mesh, Neighbours.of(mesh, target.name), f"{target.name}, between its seams,")
        if not found.smooth:
            raise InputError(found.creased + target.along_creases)
        pieces[sides] = Freeform(surface=found.surface)
        pieces[sides].fit(progress)
        pieces[sides].require_a_good_fit(target.name)
    given = {key: getattr(target, key) for key in ("base", "curves", "source", "repairs")}
    return Creased(surface=whole, whole=whole, uncut=target, drawn=drawn, seams=seams, pieces=pieces, **given)
