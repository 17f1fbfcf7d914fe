"""Bracing: the diagonals of the grid's cells, which hold its shape once it stands."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats


@dataclass(frozen=True)
class Diagonal:
    """One diagonal of a cell: the joints that it ties, and their distance flat and in the final shape [m]."""

    joints: tuple[int, int]
    flat: float
    final: float


def diagonals(rods: ArrayLike, at: ArrayLike, flat: Floats, final: Floats) -> list[Diagonal]:
    """Both diagonals of every cell between four neighbouring joints of four rods.

    Parameters
    ----------
    rods, at : (c, 2) the rods of each joint, and its distance along each [m].
    flat, final : (c, 2 or 3) places of the joints [m].
    """
    pairs = [
        corners
        for cell in _cells(np.asarray(rods).tolist(), np.asarray(at, dtype=float))
        for corners in ((cell[0], cell[2]), (cell[1], cell[3]))
    ]
    return [
        Diagonal((a, b), float(np.linalg.norm(flat[a] - flat[b])), float(np.linalg.norm(final[a] - final[b])))
        for a, b in pairs
    ]


def _cells(rods: Sequence[Sequence[int]], at: Floats) -> list[tuple[int, int, int, int]]:
    """The four joints of each cell, in their order around it."""
    along: dict[int, list[tuple[float, int]]] = {}
    for joint, (pair, places) in enumerate(zip(rods, at.tolist(), strict=True)):
        for rod, place in zip(pair, places, strict=True):
            along.setdefault(rod, []).append((place, joint))
    next_to: dict[tuple[int, int], list[int]] = {}  # the joints next to a joint on a rod
    for rod, on_rod in along.items():
        row = [joint for _, joint in sorted(on_rod)]
        for k, joint in enumerate(row):
            next_to[joint, rod] = row[max(k - 1, 0) : k] + row[k + 1 : k + 2]
    found: dict[frozenset[int], tuple[int, int, int, int]] = {}
    for joint, (p, q) in enumerate(rods):
        for on in next_to[joint, p]:
            for over in next_to[joint, q]:
                corner = _meeting(next_to, rods, on, over, p, q)
                if corner is not None:
                    found.setdefault(frozenset((joint, on, corner, over)), (joint, on, corner, over))
    return list(found.values())


def _meeting(
    next_to: dict[tuple[int, int], list[int]], rods: Sequence[Sequence[int]], on: int, over: int, p: int, q: int
) -> int | None:
    """The joint next to `on` on its other rod and next to `over` on its own, or None."""
    other_of_on = rods[on][1] if rods[on][0] == p else rods[on][0]
    other_of_over = rods[over][1] if rods[over][0] == q else rods[over][0]
    both = set(next_to[on, other_of_on]) & set(next_to[over, other_of_over])
    return min(both) if both else None
