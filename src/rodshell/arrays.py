"""Types of arrays: double precision, indices, 64-bit integers, booleans; and what a structure's are."""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Longs = NDArray[np.int64]
Bools = NDArray[np.bool_]
State = Annotated[Floats, "(N, 3) node positions [m] and twist angles [rad]"]
Forces = Annotated[Floats, "(N, 3) on nodes [N] and on twist angles [N m]"]
NodePositions = Annotated[Floats, "(n, 3) of a mesh's nodes [m]"]
MIRRORED = 1e-6  # of the largest value: others so near are mirror images of it, and which is larger is chance


def largest_at(values: Floats) -> int:
    """The entry of the largest of (k,) values, for a place that a user is shown: of mirror images of one another the
    first, so that all machines name the same."""
    most = float(np.nanmax(values))
    return int(np.argmax(values >= most - MIRRORED * abs(most)))
