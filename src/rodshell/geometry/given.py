"""Numbers and directions as callers give them: the right shape, finite, or one sentence that says what is wrong."""

from reprlib import repr as short

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rodshell.errors import InputError

Floats = NDArray[np.float64]


def finite(name: str, given: ArrayLike, *shape: int) -> Floats:
    """`given` as an array of the `shape`, to which it may be broadcast; raises InputError, which calls it `name`."""
    try:
        array = np.broadcast_to(np.asarray(given, dtype=float), shape)
    except (TypeError, ValueError):
        wanted = "one number" if not shape else f"numbers of the shape {shape}"
        raise InputError(f"{name} must be {wanted}, not {short(given)}") from None
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, not {short(given)}")
    return array


def vector(name: str, given: ArrayLike) -> Floats:
    """(3,) finite numbers; raises InputError, which calls it `name`."""
    if np.shape(given) != (3,):
        raise InputError(f"{name} must be three numbers (x, y, z), not {short(given)}")
    return finite(name, given, 3)


def direction(name: str, given: ArrayLike) -> Floats:
    """(3,) unit vector along `given`; raises InputError, which calls it `name`."""
    array = vector(name, given)
    length = float(np.linalg.norm(array))
    if length == 0:
        raise InputError(f"{name} must not be zero: it has no direction")
    return np.asarray(array / length)
