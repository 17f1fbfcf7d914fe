"""Cells of a flat grid, each between four neighbouring joints of four rods, and the diagonals that brace them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.layout.flatgrid import FlatGrid
from rodshell.units import shown
from rodshell.validation import instance


@dataclass(frozen=True)
class Pattern:
    """Which diagonals of the cells are braced.

    Args:
        ways: 2: both diagonals of a cell, 1: one, in all cells the same way.
        every: 1: all cells, n: continuous lines of diagonals through every n-th joint.
    """

    ways: Literal[1, 2] = 2
    every: int = 1

    @staticmethod
    def of(words: str) -> "Pattern":
        """ "both", "one" or "every = n".

        Raises:
            InputError: it is something else.
        """
        instance("the pattern of diagonals", words, str, 'text such as "both"')
        if words in ("both", "one"):
            return Pattern(2 if words == "both" else 1)
        name, _, number = words.replace("=", " ").strip().partition(" ")
        if name == "every" and number.strip().isdecimal() and int(number) >= 1:
            return Pattern(2, int(number))
        raise InputError(f'a pattern of diagonals must be "both", "one" or "every = 2", not {shown(words)}')


def grid_cells(grid: FlatGrid) -> Ints:
    """(k, 4) crossings of each cell, in their order around it."""
    rods, next_to = grid.crossings.rods.tolist(), dict[tuple[int, int], list[int]]()  # joints next to one on a rod
    for rod, row in _rows(grid).items():
        for k, joint in enumerate(row):
            next_to[joint, rod] = row[max(k - 1, 0) : k] + row[k + 1 : k + 2]
    found: dict[frozenset[int], tuple[int, int, int, int]] = {}
    for joint, (p, q) in enumerate(rods):
        for on in next_to[joint, p]:
            for over in next_to[joint, q]:
                both = {*next_to[on, _other(rods, on, p)]} & {*next_to[over, _other(rods, over, q)]}
                if both:
                    corner = min(both)
                    found.setdefault(frozenset((joint, on, corner, over)), (joint, on, corner, over))
    return np.array(list(found.values()), dtype=np.intp).reshape(-1, 4)


def diagonals(grid: FlatGrid, pattern: Pattern = Pattern()) -> Ints:
    """(d, 2) crossings that each diagonal joins; both of a cell follow each other, one for each way of the pattern.

    The first way of a cell goes up in the flat grid, from left to right; for rods of a table its x axis decides.
    """
    cells = grid_cells(grid)
    pairs = np.stack([cells[:, [0, 2]], cells[:, [1, 3]]], axis=1)
    if pattern.ways == 1:
        pairs = pairs[np.arange(len(pairs)), _rising(grid, pairs).argmax(axis=1)][:, None]
    if pattern.every == 1:
        return pairs.reshape(-1, 2)
    index = _lattice(grid)
    a, b = index[pairs[..., 0]], index[pairs[..., 1]]
    rising = (b - a).prod(axis=-1) > 0
    line = np.where(rising, a[..., 0] - a[..., 1], a[..., 0] + a[..., 1])
    return np.asarray(pairs[line % pattern.every == 0])


def rim_diagonals(grid: FlatGrid, pattern: Pattern = Pattern()) -> Ints:
    """(d, 2) crossing and rod end that each diagonal of a field at the rim joins, ends being those of each rod in turn.

    A rod's end is joined to the joints next to its last one on the rod that crosses it there. Between two rods that end
    side by side these are both diagonals of their field; where the rim steps from one rod to the next, both start at
    the joint at the inner corner and divide the field into triangles. A diagonal along a rod is left out.

    Args:
        pattern: of two diagonals of a field one is left out, as in cells; with lines the others of its way are.
    """
    rows, rods = _rows(grid), grid.crossings.rods.tolist()
    found = list[tuple[int, int, int]]()  # joint where it starts, the rod's last joint, and the end
    for rod, row in sorted(rows.items()):
        for end, last in ((2 * rod, row[0]), (2 * rod + 1, row[-1])):
            other = rows[_other(rods, last, rod)]
            k = other.index(last)
            found += [(start, last, end) for start in other[max(k - 1, 0) : k] + other[k + 1 : k + 2]]
    pairs = np.array([(start, end) for start, _, end in found], dtype=np.intp).reshape(-1, 2)
    ends, joints = np.array([rod.point(s) for rod in grid.rods for s in (rod.start, rod.end)]), flat_joints(grid)
    way = ends[pairs[:, 1]] - joints[pairs[:, 0]]
    along = joints[[last for _, last, _ in found]] - joints[pairs[:, 0]]
    across = np.abs(way[:, 0] * along[:, 1] - way[:, 1] * along[:, 0])
    kept = across > _LEAST_ANGLE * np.linalg.norm(way, axis=1) * np.linalg.norm(along, axis=1)
    rising = way.prod(axis=1) > 0
    if pattern.ways == 1:
        between = {(start, last) for (start, last, _), used in zip(found, kept.tolist(), strict=True) if used}
        kept &= rising | np.array([(last, start) not in between for start, last, _ in found], dtype=bool)
    if pattern.every > 1:
        a, b = _lattice(grid)[pairs[:, 0]].T
        kept &= np.where(rising, a - b, a + b) % pattern.every == 0
    return np.asarray(pairs[kept])


_LEAST_ANGLE = 0.2  # sine of that between a diagonal at the rim and the rod that it starts from


def lines(pairs: Ints, points: Floats) -> list[list[int]]:
    """Crossings along each continuous line of diagonals, from its first to its last.

    Args:
        pairs: (d, 2) crossings of each diagonal.
        points: (c, 2) of the crossings in the flat grid [m]: a line continues where its direction changes least.
    """
    at: dict[int, list[tuple[int, int]]] = {}
    for k, (a, b) in enumerate(pairs.tolist()):
        at.setdefault(a, []).append((k, b))
        at.setdefault(b, []).append((k, a))
    left, found = set(range(len(pairs))), list[list[int]]()

    def onwards(before: int, here: int) -> int | None:
        """The crossing after `here` on the line that comes from `before`; its diagonal is then used."""
        way = _direction(points, before, here)
        options = [(float(way @ _direction(points, here, to)), k, to) for k, to in at[here] if k in left]
        straight = max(options, default=None)
        if straight is None or straight[0] < STRAIGHT:
            return None
        left.discard(straight[1])
        return straight[2]

    for k, (a, b) in enumerate(pairs.tolist()):
        if k not in left:
            continue
        left.discard(k)
        row = [a, b]
        while (after := onwards(row[-2], row[-1])) is not None:
            row.append(after)
        while (before := onwards(row[1], row[0])) is not None:
            row.insert(0, before)
        found.append(row)
    return found


STRAIGHT = 0.7  # cosine of the angle by which a line of diagonals may turn at a joint of the flat grid


def _direction(points: Floats, a: int, b: int) -> Floats:
    way = points[b] - points[a]
    return np.asarray(way / np.linalg.norm(way))


def flat_joints(grid: FlatGrid) -> Floats:
    """(c, 2) place of each crossing in the flat grid [m]."""
    first, at = grid.crossings.rods[:, 0].tolist(), grid.crossings.at[:, 0].tolist()
    return np.array([grid.rods[rod].point(s) for rod, s in zip(first, at, strict=True)]).reshape(-1, 2)


def _rows(grid: FlatGrid) -> dict[int, list[int]]:
    """The joints on each rod, in their order along it."""
    along: dict[int, list[tuple[float, int]]] = {}
    for joint, (pair, stations) in enumerate(
        zip(grid.crossings.rods.tolist(), grid.crossings.at.tolist(), strict=True)
    ):
        for rod, place in zip(pair, stations, strict=True):
            along.setdefault(rod, []).append((place, joint))
    return {rod: [joint for _, joint in sorted(on_rod)] for rod, on_rod in along.items()}


def _rising(grid: FlatGrid, pairs: Ints) -> Floats:
    """(k, 2) of both diagonals of each cell: rise times run in the flat grid, positive where it goes up rightwards."""
    points = flat_joints(grid)
    way = points[pairs[..., 1]] - points[pairs[..., 0]]
    return np.asarray(way.prod(axis=-1))


def _lattice(grid: FlatGrid) -> Ints:
    """(c, 2) which line of either family each crossing is on, counted from the axis next to the anchor.

    Raises:
        InputError: the rods are on no lattice of two families of straight lines, such as those of a table.
    """
    families = dict.fromkeys(rod.family for rod in grid.rods)
    if len(families) != 2 or any(rod.offset is None for rod in grid.rods):
        raise InputError("these rods are on no lattice that lines of bracing could be counted on: brace all cells")
    result = np.zeros((len(grid.crossings), 2), dtype=np.intp)
    for column, family in enumerate(families):
        offsets = np.array([rod.offset if rod.family == family else np.nan for rod in grid.rods])
        known = np.unique(offsets[np.isfinite(offsets)].round(9))
        rank = np.searchsorted(known, np.nan_to_num(offsets).round(9)) - int(np.argmin(np.abs(known)))
        for side in range(2):
            of_family = np.isfinite(offsets[grid.crossings.rods[:, side]])
            result[of_family, column] = rank[grid.crossings.rods[of_family, side]]
    return result


def _other(rods: Sequence[Sequence[int]], joint: int, rod: int) -> int:
    """The rod that crosses a rod at a joint."""
    first, second = rods[joint]
    return second if first == rod else first
