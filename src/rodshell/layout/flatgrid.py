"""Straight rods lying in a plane, where they cross, and which lies over which."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError

Family = Literal["u", "v", "free"]


@dataclass(frozen=True)
class FlatRod:
    """A straight rod in the flat state: the points `origin + s * direction` for `start <= s <= end`.

    Rods of family `u` run along the layout's x axis at y = `offset`, rods of family `v` along y at
    x = `offset`, and s is measured from the middle of the layout. A rod of family `free` is given by its
    two ends, and s is measured from the first.

    Parameters
    ----------
    name : label such as "U09".
    offset, start, end : [m].
    origin, direction : (2,) floats [m], [-]; the direction is a unit vector.
    virtual : a line that shapes the net but is not built (numerics: "lines left out").
    """

    name: str
    family: Family
    offset: float
    start: float
    end: float
    origin: tuple[float, float]
    direction: tuple[float, float]
    virtual: bool = False

    @staticmethod
    def u(name: str, offset: float, start: float, end: float, *, virtual: bool = False) -> "FlatRod":
        return FlatRod(name, "u", offset, start, end, (0.0, offset), (1.0, 0.0), virtual)

    @staticmethod
    def v(name: str, offset: float, start: float, end: float, *, virtual: bool = False) -> "FlatRod":
        return FlatRod(name, "v", offset, start, end, (offset, 0.0), (0.0, 1.0), virtual)

    @property
    def length(self) -> float:
        return self.end - self.start

    def point(self, s: ArrayLike) -> Floats:
        """Flat positions (..., 2) [m] at the material coordinates `s` [m]."""
        return np.asarray(self.origin) + np.asarray(s, dtype=float)[..., None] * np.asarray(self.direction)

    @property
    def line(self) -> tuple[object, ...]:
        """The line on which it lies, whatever its ends."""
        return self.family, self.offset, self.origin, self.direction

    def contains(self, piece: "FlatRod") -> bool:
        """Whether another rod is this one or a piece of it."""
        tiny = 1e-9 * self.length
        return self.line == piece.line and self.start - tiny <= piece.start and piece.end <= self.end + tiny

    def cut(self, start: float, end: float) -> "FlatRod":
        return FlatRod(
            self.name, self.family, self.offset, start, end, self.origin, self.direction, self.virtual
        )  # fmt: skip


def whole_rods(rods: Sequence[FlatRod], pieces: Sequence[FlatRod]) -> list[int]:
    """For each piece the index of the rod that it is, or is a piece of.

    Raises
    ------
    ValueError : a piece lies on no rod.
    """
    on_line: dict[tuple[object, ...], list[int]] = {}
    for k, rod in enumerate(rods):
        on_line.setdefault(rod.line, []).append(k)
    found = []
    for piece in pieces:
        whole = [k for k in on_line.get(piece.line, []) if rods[k].contains(piece)]
        if not whole:
            raise ValueError(f"{piece.name} is no piece of any rod")
        found.append(whole[0])
    return found


@dataclass(frozen=True)
class Crossings:
    """Where rods cross: `rods` (c, 2) indices, `at` (c, 2) material coordinates on each of the two [m]."""

    rods: Ints
    at: Floats

    def __len__(self) -> int:
        return len(self.rods)

    def select(self, keep: Bools) -> "Crossings":
        return Crossings(self.rods[keep], self.at[keep])


@dataclass(frozen=True)
class FlatGrid:
    """Straight rods and the crossings at which they are joined."""

    rods: tuple[FlatRod, ...]
    crossings: Crossings

    @staticmethod
    def of(rods: Sequence[FlatRod], *, margin: float = 0.0) -> "FlatGrid":
        """Join the rods wherever they cross, `margin` [m] or more away from the ends of both."""
        rods = tuple(rods)
        origin = np.array([rod.origin for rod in rods])
        direction = np.array([rod.direction for rod in rods])
        start = np.array([rod.start for rod in rods])
        end = np.array([rod.end for rod in rods])
        a, b = np.triu_indices(len(rods), k=1)
        sine = _cross(direction[a], direction[b])
        crossing = np.abs(sine) > 1e-9
        a, b, sine = a[crossing], b[crossing], sine[crossing]
        apart = origin[b] - origin[a]
        at = np.column_stack([_cross(apart, direction[b]) / sine, _cross(apart, direction[a]) / sine])
        slack = margin - 1e-9 * (end - start)  # a crossing exactly at an end is a joint at that end
        met = np.ones(len(a), dtype=bool)
        for side, rod in enumerate((a, b)):
            met &= (at[:, side] >= start[rod] + slack[rod]) & (at[:, side] <= end[rod] - slack[rod])
            at[:, side] = np.clip(at[:, side], start[rod], end[rod])
        return FlatGrid(rods, Crossings(np.column_stack([a, b])[met], at[met]))

    def joint_counts(self) -> Ints:
        """(m,) number of joints on each rod."""
        return np.bincount(self.crossings.rods.ravel(), minlength=len(self.rods))

    def without(self, leave_out: Callable[["FlatGrid"], Bools]) -> tuple["FlatGrid", list[str]]:
        """Leave out the rods that `leave_out` marks, again and again until it marks none; and their names."""
        grid, names = self, list[str]()
        while (out := leave_out(grid)).any():
            names += [rod.name for rod, gone in zip(grid.rods, out, strict=True) if gone]
            index = np.cumsum(~out) - 1
            kept = grid.crossings.select(np.logical_not(out[grid.crossings.rods].any(axis=1)))
            rods = tuple(rod for rod, gone in zip(grid.rods, out, strict=True) if not gone)
            grid = FlatGrid(rods, Crossings(index[kept.rods], kept.at))
            if not rods:
                break
        return grid, names


def straight_rods(ends: ArrayLike, *, names: Sequence[str] | None = None) -> FlatGrid:
    """A flat grid of straight rods given by their end points, joined wherever they cross.

    Parameters
    ----------
    ends : (m, 2, 2), two end points of each rod in the plane [m].
    names : m labels; default "R01", "R02", ...

    Raises
    ------
    InputError : a rod has no length or a coordinate is not finite; a rod crosses no other; two rods overlap.
    """
    points = np.asarray(ends, dtype=float)
    if points.ndim != 3 or points.shape[1:] != (2, 2) or len(points) == 0:
        raise InputError(f"rod ends must have the shape (rods, 2, 2), not {points.shape}")
    if not np.isfinite(points).all():
        raise InputError(f"rod {int(np.argwhere(~np.isfinite(points))[0, 0]) + 1} has an end that is not finite")
    digits = len(str(len(points)))
    labels = list(names) if names is not None else [f"R{k + 1:0{max(digits, 2)}d}" for k in range(len(points))]
    if len(set(labels)) != len(points):
        raise InputError(f"{len(points)} rods need as many different names, not {len(set(labels))}")
    apart = points[:, 1] - points[:, 0]
    length = np.linalg.norm(apart, axis=1)
    if not (length > 0).all():
        raise InputError(f"rod {labels[int(np.argmin(length))]} has no length: its two ends coincide")
    rods = [
        FlatRod(label, "free", 0.0, 0.0, float(size), (float(p[0]), float(p[1])), (float(d[0]), float(d[1])))
        for label, p, d, size in zip(labels, points[:, 0], apart / length[:, None], length, strict=True)
    ]
    _refuse_overlaps(rods)
    grid = FlatGrid.of(rods)
    lonely = [rod.name for rod, count in zip(rods, grid.joint_counts(), strict=True) if count == 0]
    if lonely:
        raise InputError(
            f"{len(lonely)} of {len(rods)} rods cross no other rod (the first: {lonely[0]}): "
            "give rods whose lines cross between their ends, or leave it out"
        )
    return grid


def _refuse_overlaps(rods: Sequence[FlatRod]) -> None:
    """Two rods along one line must not share a stretch of it: no crossing point would be defined."""
    origin = np.array([rod.origin for rod in rods])
    direction = np.array([rod.direction for rod in rods])
    length = np.array([rod.length for rod in rods])
    a, b = np.triu_indices(len(rods), k=1)
    scale = length.max()
    apart = origin[b] - origin[a]
    same_line = (np.abs(_cross(direction[a], direction[b])) < 1e-9) & (
        np.abs(_cross(apart, direction[a])) < 1e-9 * scale
    )
    along = np.einsum("ij,ij->i", apart, direction[a])
    other = along + length[b] * np.einsum("ij,ij->i", direction[a], direction[b])
    shared = np.minimum(length[a], np.maximum(along, other)) - np.maximum(0.0, np.minimum(along, other))
    bad = np.flatnonzero(same_line & (shared > 1e-9 * scale))
    if len(bad):
        first, second = rods[a[bad[0]]].name, rods[b[bad[0]]].name
        raise InputError(f"rods {first} and {second} lie on one line and overlap: keep one of them")


def _cross(a: Floats, b: Floats) -> Floats:
    return np.asarray(a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0])


def layers(rods: int, crossings: Iterable[tuple[int, int]]) -> Ints:
    """(rods,) layer of each rod, 1 the lowest, for `crossings` given as pairs of rods.

    Rod by rod, outwards from the first of each connected part, each takes the lowest layer that it crosses no rod of.
    Two families of rods get two layers, the first rod's family the lower one.
    """
    met: list[list[int]] = [[] for _ in range(rods)]
    for a, b in crossings:
        met[a].append(b)
        met[b].append(a)
    layer = np.zeros(rods, dtype=np.intp)
    for first in range(rods):
        waiting = [first] if not layer[first] else []
        for rod in waiting:
            if layer[rod]:
                continue
            taken = {int(layer[other]) for other in met[rod]}
            layer[rod] = next(k for k in range(1, len(taken) + 2) if k not in taken)
            waiting += [other for other in met[rod] if not layer[other]]
    return layer


def sides(grid: FlatGrid) -> Floats:
    """(m,) -1 for rods of the lower layer and 1 for those of the upper.

    Raises
    ------
    InputError : rods cannot be laid in two layers, such as three that cross each other.
    """
    layer = layers(len(grid.rods), grid.crossings.rods.tolist())
    if layer.max(initial=0) > 2:
        rod = grid.rods[int(np.argmax(layer))].name
        raise InputError(
            f"eccentric joints need two layers of rods, but {rod} crosses rods of both: set the eccentricity to 0"
        )
    return np.where(layer == 1, -1.0, 1.0)
