"""Which rod lies over which: layers such that rods of one layer never cross."""

from collections.abc import Iterable

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.layout.flatgrid import FlatGrid


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
