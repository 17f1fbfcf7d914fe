"""Is a target too flat for its rods to bend?"""

from math import sqrt

import numpy as np

from rodshell.arrays import Floats
from rodshell.rods.section import Rod
from rodshell.units import length_text

PLANE = 1e-6  # of the extent: what files of single precision leave of a plane


def rise(x: Floats) -> float:
    """The extent of the points (n, 3) across the plane that fits them best [m]."""
    centred = x - x.mean(axis=0)
    _, axes = np.linalg.eigh(centred.T @ centred)
    return float(np.ptp(centred @ axes[:, 0]))


def least_rise(rod: Rod) -> float:
    """The rise up to which rods are pressed together instead of being bent [m]: twice their radius of gyration.

    The ends of a rod that lies on n half waves of the rise s over the length L come together by (pi n s / 2 L)^2 of L;
    a straight rod, held at its ends and at the nodes of these waves, buckles when that exceeds (pi n i / L)^2, with
    i^2 = EI / EA [Euler]: at s = 2 i, whatever n and L are.
    """
    return 2 * sqrt(min(rod.bend_stiffnesses) / rod.stretch_stiffness)


def is_flat(x: Floats, rod: Rod) -> bool:
    """Whether nothing pops up of a shell with these nodes (n, 3) [m]."""
    return rise(x) <= least_rise(rod)


def flat_warning(x: Floats, rod: Rod) -> tuple[str, ...]:
    """One sentence where that is so."""
    if not is_flat(x, rod):
        return ()
    risen, least = rise(x), length_text(least_rise(rod))
    what = f"rises by {length_text(risen)} only" if risen > PLANE * float(np.ptp(x, axis=0).max()) else "is a plane"
    return (
        f"the target is flat, nothing pops up: it {what}, and up to a rise of {least}, twice their radius of gyration, "
        "the rods are pressed together and do not bend",
    )
