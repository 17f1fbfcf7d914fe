"""Arguments as callers give them: of the right kind, sign, shape and spelling, or one sentence that says what is wrong.

Every function raises InputError, which calls the argument by its `name`.
"""

from collections.abc import Sequence
from difflib import get_close_matches
from math import isfinite
from numbers import Real
from reprlib import repr as short
from types import UnionType
from typing import TYPE_CHECKING, Any, TypeVar

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.units import shown

if TYPE_CHECKING:
    from numpy.typing import ArrayLike

    Floats = Floats
Choice = TypeVar("Choice", bound=str)


def instance(name: str, value: object, kind: type | UnionType, wanted: str = "") -> None:
    """Refuse a `value` that is no `kind`; `wanted` says in words what it must be, by default a rodshell `kind`."""
    if not isinstance(value, kind):
        what = wanted or f"a rodshell {getattr(kind, '__name__', kind)}"
        raise InputError(f"{name} must be {what}, not {_described(value)}")


def choice(name: str, value: object, choices: Sequence[Choice]) -> Choice:
    """`value`, if it is one of the words in `choices`."""
    for word in choices:
        if value == word:
            return word
    raise InputError(not_a_choice(name, value, choices))


def not_a_choice(name: str, value: object, choices: Sequence[str]) -> str:
    """The sentence on a `value` that is none of the words in `choices`; the same for arguments, keys and options."""
    near = get_close_matches(value, choices, n=1) if isinstance(value, str) else []
    hint = f": did you mean {shown(near[0])}?" if near else ""
    return f"{name} must be {either(choices)}, not {_described(value)}{hint}"


def either(words: Sequence[str]) -> str:
    """ "a", "b" or "c"."""
    *rest, last = map(shown, words)
    return f"{', '.join(rest)} or {last}" if rest else last


def choices_of(name: str, value: Any, choices: Sequence[Choice]) -> tuple[Choice, ...]:
    """`value` as a tuple of different words out of `choices`, or of none; one may come without a sequence around it."""
    words = [value] if isinstance(value, str) else list(value) if isinstance(value, Sequence) else None
    if words is None:
        raise InputError(f"{name} must be one or several of {', '.join(map(shown, choices))}, not {_described(value)}")
    return tuple(dict.fromkeys(choice(name, word, choices) for word in words))


def number(name: str, value: object, unit: str) -> None:
    """Refuse what is not a finite number of this `unit`."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError(f"{name} must be a number in {unit}, not {_described(value)}")
    if not isfinite(value):
        raise InputError(f"{name} must be finite, not {value} {unit}")


def positive(name: str, value: object, unit: str) -> None:
    """Refuse what is not a finite number above 0, of this `unit`."""
    if isinstance(value, bool) or not isinstance(value, Real):
        raise InputError(f"{name} must be a number in {unit}, not {_described(value)}")
    if not (isfinite(value) and float(value) > 0):
        raise InputError(f"{name} must be positive, not {value} {unit}")


def point(name: str, value: object) -> None:
    """Refuse what is not a pair of finite numbers [m]."""
    pair: Any = value if hasattr(value, "__len__") and not isinstance(value, str | dict) else ()
    if len(pair) != 2 or not all(isinstance(one, Real) and isfinite(one) for one in pair):
        raise InputError(f"{name} must be two finite numbers x, y in m, not {value!r}")


def finite(name: str, given: "ArrayLike", *shape: int) -> "Floats":
    """`given` as an array of the `shape`, to which it may be broadcast."""
    import numpy as np  # here, so that the command line's help need not wait for it

    try:
        array = np.broadcast_to(np.asarray(given, dtype=float), shape)
    except (TypeError, ValueError):
        wanted = "one number" if not shape else f"numbers of the shape {shape}"
        raise InputError(f"{name} must be {wanted}, not {short(given)}") from None
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, not {short(given)}")
    return array


def vector(name: str, given: "ArrayLike") -> "Floats":
    """(3,) finite numbers."""
    import numpy as np

    if np.shape(given) != (3,):
        raise InputError(f"{name} must be three numbers (x, y, z), not {short(given)}")
    return finite(name, given, 3)


def direction(name: str, given: "ArrayLike") -> "Floats":
    """(3,) unit vector along `given`."""
    array = vector(name, given)
    length = float((array @ array) ** 0.5)
    if length == 0:
        raise InputError(f"{name} must not be zero: it has no direction")
    unit: Floats = array / length
    return unit


def _described(value: object) -> str:
    """A plain value as it is, anything else by its kind."""
    made = type(value).__name__
    return shown(value) if isinstance(value, str | int | float) else f"a{'n' * (made[0] in 'AEIOU')} {made}"
