"""Straight rods in a plane, their crossings, and the layers in which they lie."""

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from math import copysign
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.kernels import njit
from rodshell.layout.profile import Profile
from rodshell.layout.rest_curve import RestCurve
from rodshell.untrusted import limit, raised
from rodshell.validation import LARGEST, finite, instance, listed, number, short, texts

MOST_RODS = 5000  # of a grid, of which all pairs are looked at; they take 0.4 GB
_PARALLEL = 1e-9  # sine of the angle between lines that do not cross
TOGETHER = 0.01  # of the usual span: crossings of three rods or more that are nearer to each other are one joint


class FlatRod(NamedTuple):
    """A straight rod in the flat state: the points `origin + s * direction` for `start <= s <= end`.

    Args:
        name: label such as "U09".
        family: name of the rods that it is one of and that do not cross each other, such as "u"; "free": of none.
        offset: of the rod's line in a lattice of straight lines, along `across` from the lattice's middle, from which s
            is measured too; None: it is on no such line [m].
        start, end: material coordinates of the ends [m].
        origin: point of the rod's line at which s is 0 [m].
        direction: unit vector along the rod.
        virtual: whether the line only shapes the net and is not built.
        profile: how its section changes along it; None: not at all.
        curve: the curvature that it has at rest; None: it is straight.
    """

    name: str
    family: str
    offset: float | None
    start: float
    end: float
    origin: tuple[float, float]
    direction: tuple[float, float]
    virtual: bool = False
    profile: Profile | None = None
    curve: RestCurve | None = None

    @property
    def length(self) -> float:
        """From end to end [m]."""
        return self.end - self.start

    def point(self, s: ArrayLike) -> Floats:
        """Flat positions (..., 2) [m] at the material coordinates `s` (...) [m]."""
        return np.asarray(np.asarray(self.origin) + np.asarray(s, dtype=float)[..., None] * np.asarray(self.direction))

    @property
    def across(self) -> tuple[float, float]:
        """Unit vector at right angles to the rod, towards y; of a rod along y, towards x."""
        dx, dy = self.direction
        side = copysign(1.0, dx or -dy)
        return -side * dy, side * dx

    def cut(self, start: float, end: float, across: float = 0.0) -> "FlatRod":
        """The same rod with other ends.

        Args:
            start, end: material coordinates of the new ends [m].
            across: by which its line is moved along `across` [m].
        """
        offset, origin = self.offset, self.origin
        if across:
            (x, y), (nx, ny) = origin, self.across
            offset, origin = None if offset is None else offset + across, (x + across * nx, y + across * ny)
        return self._replace(start=start, end=end, offset=offset, origin=origin)


def whole_rods(rods: Sequence[FlatRod], pieces: Sequence[FlatRod]) -> Ints:
    """Find the rods that pieces of rods belong to.

    Args:
        pieces: rods, each of which is one of the whole rods or a piece of one.

    Returns:
        (m,) the index of the whole rod of each piece.

    Raises:
        ValueError: a piece belongs to no rod.
    """
    on_line: dict[tuple[object, object], list[tuple[int, FlatRod]]] = {}
    for k, rod in enumerate(rods):
        on_line.setdefault((rod.origin, rod.direction), []).append((k, rod))
    found = list[int]()
    for piece in pieces:
        for k, rod in on_line.get((piece.origin, piece.direction), ()):
            tiny = 1e-9 * (rod.end - rod.start)
            if rod.start - tiny <= piece.start and piece.end <= rod.end + tiny:
                found.append(k)
                break
        else:
            raise ValueError(f"{piece.name} is not a piece of any rod")
    return np.array(found, dtype=np.intp)


@dataclass(frozen=True, eq=False)
class Crossings:
    """Where rods cross. Two of these are equal if their content is.

    Args:
        rods: (c, 2) indices of the two rods.
        at: (c, 2) material coordinates on each of the two [m].
    """

    rods: Ints
    at: Floats

    def __len__(self) -> int:
        return len(self.rods)

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Crossings):
            return NotImplemented
        return np.array_equal(self.rods, other.rods) and np.array_equal(self.at, other.at)

    def __hash__(self) -> int:
        return hash(tuple(self.rods.ravel().tolist()))

    def __repr__(self) -> str:
        return f"Crossings({len(self)})"

    def and_those(self, others: "Crossings") -> "Crossings":
        """These and others of the same rods."""
        return Crossings(np.concatenate([self.rods, others.rods]), np.concatenate([self.at, others.at]))

    def between(self, kept: Bools) -> "Crossings":
        """Those of the rods marked in `kept` (m,) among each other, numbered as if there were only these rods."""
        index, pairs = np.cumsum(kept) - 1, self.select(np.asarray(kept[self.rods].all(axis=1)))
        return Crossings(index[pairs.rods], pairs.at)

    def select(self, keep: Bools) -> "Crossings":
        """The crossings marked in `keep` (c,)."""
        return Crossings(self.rods.compress(keep, axis=0), self.at.compress(keep, axis=0))


@dataclass(frozen=True)
class FlatGrid:
    """Straight rods and the crossings at which they are joined. Grids with the same content are equal.

    Args:
        rods: straight rods: in the plane, or, where `passed` is given, each for itself.
        crossings: of these rods; not all places where rods cross need be joined.
        passed: where rods cross without a joint, or would if they were longer; None: where their lines do.
    """

    rods: tuple[FlatRod, ...]
    crossings: Crossings
    passed: Crossings | None = None

    @cached_property
    def ends(self) -> Floats:
        """(m, 2) material coordinates of start and end of each rod [m]."""
        return np.array([(rod.start, rod.end) for rod in self.rods]).reshape(-1, 2)

    @staticmethod
    def of(rods: Sequence[FlatRod], *, margin: float = 0.0) -> "FlatGrid":
        """Join rods wherever they cross.

        Args:
            margin: crossings closer to an end of either rod are not joined [m].

        Raises:
            InputError: something else is given; a rod's numbers are not finite, it has no direction, or does not end
                behind its start.
        """
        rods = listed("rods", rods, "a list of rodshell.FlatRod")
        refuse_too_many(len(rods))
        for rod in rods:
            instance("each of the rods", rod, FlatRod)
        margin = number("margin", margin, "m")
        lines = finite(
            "origin x and y, direction x and y, start and end of the rods",
            [(*rod.origin, *rod.direction, rod.start, rod.end) for rod in rods] or np.empty((0, 6)),
            len(rods), 6,
        )  # fmt: skip
        wrong = (lines[:, 5] <= lines[:, 4]) | ~lines[:, 2:4].any(axis=1)
        if wrong.any():
            rod = rods[int(np.argmax(wrong))]
            raise InputError(
                f"rod {rod.name} must have a direction and end behind its start, not direction {rod.direction}, start "
                f"{rod.start:g} m and end {rod.end:g} m"
            )
        return FlatGrid(rods, Crossings(*_crossings(lines, margin)))

    def meetings(self, beyond: float = 0.0) -> Crossings:
        """Where rods cross, joined or not, or would if each were longer by `beyond` at both ends [m]."""
        if self.passed is None:
            return FlatGrid.of(self.rods, margin=-beyond).crossings
        every = self.crossings.and_those(self.passed)
        first, last = self.ends[every.rods].transpose(2, 0, 1)
        near = (first - beyond <= every.at) & (every.at <= last + beyond)
        return every.select(np.asarray(near.all(axis=1)))

    def cut(self, pieces: Sequence[FlatRod], *, margin: float = 0.0) -> tuple["FlatGrid", Ints]:
        """The grid of pieces of its rods, joined where these are; and which crossing (c,) of this grid each of its
        crossings is.

        Args:
            pieces: each a rod of the grid, or a piece of it.
            margin: crossings closer to an end of either piece are left out [m].

        Raises:
            ValueError: a piece belongs to no rod.
        """
        whole, ends = whole_rods(self.rods, pieces), np.array([(piece.start, piece.end) for piece in pieces])
        slack = margin - 1e-9 * np.diff(ends).ravel()  # a crossing exactly at an end is a joint at that end
        low, high = ends[:, 0] + slack, ends[:, 1] - slack
        every = self.crossings if self.passed is None else self.crossings.and_those(self.passed)
        order = np.argsort(whole, kind="stable")
        first = np.searchsorted(whole[order], np.arange(len(self.rods) + 1))
        piece_of, inside = np.full(every.rods.shape, -1), np.zeros(every.rods.shape, dtype=bool)
        for k in range(int(np.diff(first).max(initial=0))):  # the k-th piece of every rod
            place = first[every.rods] + k
            piece = order[np.minimum(place, len(order) - 1)]
            known = place < first[every.rods + 1]
            within = known & (low[piece] <= every.at) & (every.at <= high[piece])
            piece_of = np.where(within | (known & ~inside), piece, piece_of)
            inside |= within
        joined = inside.all(axis=1) & (np.arange(len(every)) < len(self.crossings))
        kept, left = np.flatnonzero(joined), ~joined & (piece_of >= 0).all(axis=1)
        rods = piece_of[kept]
        at = np.clip(every.at[kept], ends[rods, 0], ends[rods, 1])
        turned = rods[:, 0] > rods[:, 1]
        rods[turned], at[turned] = rods[turned, ::-1], at[turned, ::-1]
        rows = np.lexsort((at[:, 0], rods[:, 1], rods[:, 0]))
        passed = None if self.passed is None else Crossings(piece_of[left], every.at[left])
        return FlatGrid(tuple(pieces), Crossings(rods[rows], at[rows]), passed), kept[rows]

    def __repr__(self) -> str:
        return f"FlatGrid({len(self.rods)} rods, {len(self.crossings)} crossings)"

    def joint_counts(self) -> Ints:
        """(m,) number of joints on each rod."""
        return np.bincount(self.crossings.rods.ravel(), minlength=len(self.rods))

    @cached_property
    def joint_names(self) -> list[str]:
        """Ids of the joints, the two rods' ids with a slash, in the order of the crossings."""
        return ["/".join(self.rods[k].name for k in sorted(pair)) for pair in self.crossings.rods.tolist()]

    @cached_property
    def support_names(self) -> list[str]:
        """Names of the rod ends, as "U03.1": start (0) and end (1) of each rod in turn."""
        return [f"{rod.name}.{end}" for rod in self.rods for end in (0, 1)]

    @cached_property
    def span(self) -> float:
        """The usual distance between neighbouring joints [m]: a quarter of the rods' length is in spans up to it, which
        does not depend on how many crossings nearly coincide."""
        gaps = np.sort(self._gaps[0])
        total = np.cumsum(gaps)
        if not len(gaps) or total[-1] <= 0:
            return min(rod.length for rod in self.rods)
        return float(gaps[np.searchsorted(total, 0.25 * total[-1])])

    @property
    def _gaps(self) -> tuple[Floats, Ints]:
        """(k,) distances between neighbouring crossings of a rod [m], and (k, 2) the crossings."""
        rods, at = self.crossings.rods.ravel(), self.crossings.at.ravel()
        order = np.lexsort((at, rods))
        along = np.diff(rods[order]) == 0
        return np.diff(at[order])[along], np.column_stack([order[:-1], order[1:]])[along] // 2

    def with_common_joints(self) -> "FlatGrid":
        """The same rods; where three or more cross within a hundredth of the span, as in tables of rounded numbers, the
        mean is the only crossing point of each."""
        rods, at, count = self.crossings.rods, self.crossings.at, len(self.crossings)
        gaps, beside = self._gaps
        first, second = beside[gaps < TOGETHER * self.span].T
        label = connected_components(coo_array((np.ones(len(first)), (first, second)), shape=(count, count)))[1]
        point, index = np.unique(label[:, None] * len(self.rods) + rods, return_inverse=True)
        met = np.bincount(point // len(self.rods))  # rods at each place: one joint where all pairs of them cross
        every = np.bincount(label) == met * (met - 1) // 2
        mean = (np.bincount(index.ravel(), at.ravel()) / np.bincount(index.ravel()))[index.reshape(at.shape)]
        return FlatGrid(self.rods, Crossings(rods, np.where(every[label][:, None], mean, at)))

    def with_profiles(self, profiles: Profile | Sequence[Profile | None] | None) -> "FlatGrid":
        """The same rods, whose sections change along them.

        Args:
            profiles: the same for all rods, or one for each; None: the section does not change.

        Raises:
            InputError: not as many profiles as rods.
        """
        each = profiles if isinstance(profiles, Sequence) else (profiles,) * len(self.rods)
        if len(each) != len(self.rods):
            raise InputError(
                f"the grid has {len(self.rods)} rods: give one profile for all, or one for each, not {len(each)}"
            )
        for profile in each:
            if profile is not None:
                instance("each of the profiles", profile, Profile)
        rods = tuple(rod._replace(profile=profile) for rod, profile in zip(self.rods, each, strict=True))
        return replace(self, rods=rods)

    def without(self, leave_out: Callable[["FlatGrid"], Bools]) -> tuple["FlatGrid", list[str]]:
        """Remove rods repeatedly, until `leave_out` marks none.

        Args:
            leave_out: marks the rods (m,) of a grid that are to be removed.

        Returns:
            The grid, and the names of the rods that were removed.
        """
        grid, names = self, list[str]()
        while (out := leave_out(grid)).any():
            names += [rod.name for rod, gone in zip(grid.rods, out, strict=True) if gone]
            rods = tuple(rod for rod, gone in zip(grid.rods, out, strict=True) if not gone)
            passed = None if grid.passed is None else grid.passed.between(~out)
            grid = FlatGrid(rods, grid.crossings.between(~out), passed)
            if not rods:
                break
        return grid, names


def straight_rods(ends: ArrayLike, *, names: Sequence[str] | None = None) -> FlatGrid:
    """Make a flat grid of straight rods, joined wherever they cross.

    Args:
        ends: (m, 2, 2) the two end points of each rod in the plane [m].
        names: m different labels; default "R01", "R02", ...

    Raises:
        InputError: the ends are not finite numbers of that shape; a rod has no length or crosses no other; two overlap.
    """
    try:
        points = np.asarray(ends, dtype=float)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"rod ends must be numbers of the shape (rods, 2, 2), not {short(ends)}") from None
    if points.ndim != 3 or points.shape[1:] != (2, 2) or len(points) == 0:
        raise InputError(f"rod ends must have the shape (rods, 2, 2), not {points.shape}")
    if not (near := np.abs(points) < LARGEST).all():
        raise InputError(f"rod {int(np.argwhere(~near)[0, 0]) + 1} has an end that is not finite, or too far away")
    refuse_too_many(len(points))
    digits = len(str(len(points)))
    labels = [f"R{k + 1:0{max(digits, 2)}d}" for k in range(len(points))]
    if names is not None:
        labels = [*texts("names", names, "a list of different names")]
    if not len(labels) == len(set(labels)) == len(points):
        raise InputError(f"{len(points)} rods need as many different names, not {len(set(labels))}")
    apart = points[:, 1] - points[:, 0]
    length = np.linalg.norm(apart, axis=1)
    if not (length > 0).all():
        raise InputError(f"rod {labels[int(np.argmin(length))]} has no length: its two ends coincide")
    rods = [
        FlatRod(label, "free", None, 0.0, float(size), (float(p[0]), float(p[1])), (float(d[0]), float(d[1])))
        for label, p, d, size in zip(labels, points[:, 0], apart / length[:, None], length, strict=True)
    ]
    _refuse_overlaps(rods)
    grid = FlatGrid.of(rods)
    isolated = [rod.name for rod, count in zip(rods, grid.joint_counts(), strict=True) if count == 0]
    if isolated:
        raise InputError(
            f"{len(isolated)} of {len(rods)} rods cross no other rod (the first: {isolated[0]}): "
            "give rods that cross between their ends, or remove them"
        )
    return grid


def refuse_too_many(rods: int) -> None:
    """Refuse more rods than there should be pairs of them in memory."""
    if rods > limit(MOST_RODS):
        raise InputError(
            f"a grid of {rods} rods; at most {limit(MOST_RODS):.0f} are joined: check its unit, use a larger spacing, "
            f"{raised(MOST_RODS, rods)}"
        )


def _refuse_overlaps(rods: Sequence[FlatRod]) -> None:
    """Refuse rods that share a part of one line: their crossing would not be a point."""
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


@njit("f2 f")
def _crossings(lines, margin):  # type: ignore[no-untyped-def]
    """Pairs of rods (c, 2) that cross, and where on both (c, 2) [m]; closer to an end than `margin` [m] they do not.

    Each row of `lines` (m, 6) has origin, direction, start and end of a rod.
    """
    count = 0
    for a in range(len(lines)):
        for b in range(a + 1, len(lines)):
            count += abs(lines[a, 2] * lines[b, 3] - lines[a, 3] * lines[b, 2]) > _PARALLEL
    rods, at, count = np.empty((count, 2), dtype=np.int64), np.empty((count, 2)), 0
    for a in range(len(lines)):
        for b in range(a + 1, len(lines)):
            sine = lines[a, 2] * lines[b, 3] - lines[a, 3] * lines[b, 2]
            if abs(sine) > _PARALLEL:
                x, y, met = lines[b, 0] - lines[a, 0], lines[b, 1] - lines[a, 1], True
                rods[count, 0], rods[count, 1] = a, b
                for side in range(2):
                    rod, other = rods[count, side], rods[count, 1 - side]
                    s, start, end = (x * lines[other, 3] - y * lines[other, 2]) / sine, lines[rod, 4], lines[rod, 5]
                    slack = margin - 1e-9 * (end - start)  # a crossing exactly at an end is a joint at that end
                    met = met and s >= start + slack and s <= end - slack
                    at[count, side] = min(max(s, start), end)
                count += met
    return rods[:count], at[:count]


def layers(rods: int, crossings: Iterable[tuple[int, int]]) -> Ints:
    """Assign rods to layers such that rods of one layer do not cross.

    From the first rod of each connected part outwards, each rod gets the lowest layer in which it crosses no rod. Two
    families of rods get two layers; that of the first rod is the lower one.

    Args:
        crossings: pairs of indices of rods that cross.

    Returns:
        (rods,) layer of each rod, 1 the lowest.
    """
    crossed: list[list[int]] = [[] for _ in range(rods)]
    for a, b in crossings:
        crossed[a].append(b)
        crossed[b].append(a)
    layer = np.zeros(rods, dtype=np.intp)
    for first in range(rods):
        waiting = [first] if not layer[first] else []
        for rod in waiting:
            if layer[rod]:
                continue
            taken = {int(layer[other]) for other in crossed[rod]}
            layer[rod] = next(k for k in range(1, len(taken) + 2) if k not in taken)
            waiting += [other for other in crossed[rod] if not layer[other]]
    return layer


def sides(grid: FlatGrid) -> Floats:
    """Side of each rod (m,) of a grid in two layers: -1 for the lower layer, 1 for the upper.

    Raises:
        InputError: the rods need more than two layers, such as three that cross each other.
    """
    layer = layers(len(grid.rods), grid.crossings.rods.tolist())
    if layer.max(initial=0) > 2:
        rod = grid.rods[int(np.argmax(layer))].name
        raise InputError(
            f"eccentric joints need two layers of rods, but {rod} crosses rods of both: set the eccentricity to 0"
        )
    return np.where(layer == 1, -1.0, 1.0)
