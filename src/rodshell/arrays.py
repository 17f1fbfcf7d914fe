"""Types of arrays: double precision, indices, 64-bit integers, booleans; and what all need of them."""

from typing import TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.intp]
Longs = NDArray[np.int64]
Bools = NDArray[np.bool_]
Scalar = TypeVar("Scalar", bound=np.generic)

# glibc returns freed memory at the top of its heap to the system, and the system clears each page that is asked for
# again: milliseconds a solve. By what it has seen a program free at once it raises the size that it keeps (mallopt(3),
# M_TRIM_THRESHOLD), and how arrays happen to lie decides when. So it is shown a block that no page is ever asked for.
_SHOWN = 31 << 20  # bytes: a little less than the most that it heeds, 32 MB; twice as much is kept
np.empty(_SHOWN, dtype=np.uint8)


def median(values: ArrayLike) -> float:
    """The median of one or more finite values, as `np.median` finds it, in half of the time.

    Parameters
    ----------
    values : of any shape.
    """
    flat = np.asarray(values, dtype=float).ravel()
    half = len(flat) // 2
    parted = np.partition(flat, (~half, half))
    return 0.5 * float(parted[~half] + parted[half])


def distinct(values: NDArray[Scalar]) -> NDArray[Scalar]:
    """The distinct values in ascending order, as `np.unique` finds them, which first imports NumPy's masked arrays.

    Parameters
    ----------
    values : of any shape, none of them NaN.
    """
    ascending = np.sort(values, axis=None)
    is_new = np.ones(len(ascending), dtype=bool)
    is_new[1:] = ascending[1:] > ascending[:-1]
    return ascending[is_new]
