"""Types of arrays: double precision, indices, 64-bit integers, booleans."""

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Longs = NDArray[np.int64]
Bools = NDArray[np.bool_]
