"""Types of arrays: double precision, indices, 64-bit integers, booleans; and the state of a structure."""

from typing import Annotated

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Longs = NDArray[np.int64]
Bools = NDArray[np.bool_]
State = Annotated[Floats, "(N, 3) node positions [m] and twist angles [rad]"]
