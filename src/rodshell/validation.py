"""Checks of arguments: kind, sign, shape and spelling; and the texts that show values in messages and records.

Every check raises InputError with one sentence, which calls the argument by its `name`.
"""

import os
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import MISSING, fields
from difflib import get_close_matches
from math import inf, isfinite
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from reprlib import repr as short
from types import UnionType
from typing import TYPE_CHECKING, Any, TypeVar

from rodshell.errors import InputError
from rodshell.units import NUMBER, as_float, shown

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import ArrayLike, NDArray

    from rodshell.arrays import Floats

Choice = TypeVar("Choice", bound=str)
_Scalar = TypeVar("_Scalar", bound="np.generic")


def instance(name: str, value: object, kind: type | UnionType, wanted: str = "") -> None:
    """Refuse a `value` that is not of a `kind`.

    Parameters
    ----------
    name : of the argument.
    value : of the argument.
    kind : class or union of classes.
    wanted : what the value must be, in words; default "a rodshell KIND".
    """
    if not isinstance(value, kind):
        what = wanted or f"a rodshell {getattr(kind, '__name__', kind)}"
        raise InputError(f"{name} must be {what}, not {described(value)}")


def choice(name: str, value: object, choices: Sequence[Choice]) -> Choice:
    """Return `value` if it is one of the words in `choices`; the message suggests the closest of them."""
    for word in choices:
        if value == word:
            return word
    raise InputError(not_a_choice(name, value, choices))


def not_a_choice(name: str, value: object, choices: Sequence[str]) -> str:
    """The sentence on a `value` that is not one of the words in `choices`; the same for arguments, keys and options."""
    near = get_close_matches(value, choices, n=1) if isinstance(value, str) else []
    hint = f": did you mean {shown(near[0])}?" if near else ""
    return f"{name} must be {either(choices)}, not {described(value)}{hint}"


def either(words: Sequence[str]) -> str:
    """ "a", "b" or "c"."""
    *rest, last = map(shown, words)
    return f"{', '.join(rest)} or {last}" if rest else last


def choices_of(name: str, value: Any, choices: Sequence[Choice]) -> tuple[Choice, ...]:
    """Return `value` as a tuple of different words out of `choices`.

    Parameters
    ----------
    name : of the argument.
    value : one word, or a sequence of words, which may be empty.
    choices : the words that are allowed.
    """
    words = [value] if isinstance(value, str) else list(value) if isinstance(value, Sequence) else None
    if words is None:
        raise InputError(f"{name} must be one or several of {', '.join(map(shown, choices))}, not {described(value)}")
    return tuple(dict.fromkeys(choice(name, word, choices) for word in words))


def number(name: str, value: object, unit: str = "") -> float:
    """Return `value`, a finite number, as a float; `unit` is named in the message ("" for a plain number)."""
    real = _real(name, value, unit)
    if not isfinite(real):
        raise InputError(f"{name} must be finite, not {described(value)}{unit and ' ' + unit}")
    return real


def positive(name: str, value: object, unit: str = "", *, infinite: bool = False) -> float:
    """Return `value`, a number above 0, as a float; infinity only where it is allowed; see `number`."""
    real = _real(name, value, unit)
    if not 0 < real <= inf or (real == inf and not infinite):
        raise InputError(f"{name} must be positive, not {described(value)}{unit and ' ' + unit}")
    return real


def not_negative(name: str, value: object, unit: str = "", *, infinite: bool = False) -> float:
    """Return `value`, a number of 0 or more, as a float; infinity only where it is allowed; see `number`."""
    real = _real(name, value, unit)
    if not 0 <= real <= inf or (real == inf and not infinite):
        raise InputError(f"{name} must be 0 or more, not {described(value)}{unit and ' ' + unit}")
    return real


def whole(name: str, value: object, least: int, most: int | None = None) -> int:
    """Return `value`, a whole number from `least` to `most` (None: no limit), as an int."""
    if isinstance(value, Integral) and not isinstance(value, bool):
        given = int(value)
        if least <= given and (most is None or given <= most):
            return given
    wanted = f"of {least} or more" if most is None else f"{least} to {most}"
    separator = " " if most is None else ", "
    raise InputError(f"{name} must be a whole number{separator}{wanted}, not {described(value)}")


def flag(name: str, value: object) -> bool:
    """Return `value`, True or False or NumPy's scalar of them, as a bool."""
    given = _plain(value)
    if not isinstance(given, bool):
        raise InputError(f"{name} must be True or False, not {described(value)}")
    return given


def listed(name: str, value: object, wanted: str) -> tuple[Any, ...]:
    """Return the items of a list, an array, a set, a generator or the like as a tuple.

    Parameters
    ----------
    name : of the argument.
    value : of the argument; text is not a list of its letters, a mapping not one of its keys.
    wanted : what it must be, in words, such as "a list of rods".
    """
    given: Any = value
    if not isinstance(value, list | tuple):  # most are, and the rest takes longer
        single = isinstance(value, str | bytes | Mapping) or getattr(value, "ndim", None) == 0
        if single or not isinstance(value, Iterable):
            raise InputError(f"{name} must be {wanted}, not {described(value)}")
    return tuple(given)


def some(name: str, value: object, wanted: str) -> tuple[Any, ...]:
    """As `listed`, of one item or more."""
    items = listed(name, value, wanted)
    if not items:
        raise InputError(f"{name} must be {wanted}, not an empty list")
    return items


def texts(name: str, value: object, wanted: str) -> tuple[str, ...]:
    """Return a list of texts as a tuple; see `listed`."""
    items = listed(name, value, wanted)
    for item in items:
        instance(f"each of {name}", item, str, "text")
    return tuple(map(str, items))


def mapping(name: str, value: object, wanted: str) -> Mapping[Any, Any]:
    """Return `value` if it is a mapping; `wanted` is what it must be, in words."""
    if not isinstance(value, Mapping):
        raise InputError(f"{name} must be {wanted}, not {described(value)}")
    return value


def numbers(name: str, value: object, wanted: str, count: int) -> tuple[float, ...]:
    """Return `value` as a tuple of finite floats.

    Parameters
    ----------
    name : of the argument.
    value : a sequence or an array.
    wanted : what it must be, in words, such as "two finite numbers x, y in m".
    count : how many numbers.
    """
    given: Any = value if hasattr(value, "__len__") and not isinstance(value, str | bytes | dict) else ()
    if len(given) != count or not all(_is_finite(item) for item in given):
        raise InputError(f"{name} must be {wanted}, not {short(value)}")
    return tuple(float(item) for item in given)


def _real(name: str, value: object, unit: str) -> float:
    value = _plain(value)
    if isinstance(value, bool) or not isinstance(value, NUMBER):
        raise InputError(f"{name} must be a number{unit and ' in ' + unit}, not {described(value)}")
    return as_float(value)


def _plain(value: Any) -> Any:
    """What an array without axes, such as np.array(0.5) or np.True_, holds; anything else as it is."""
    return value.item() if getattr(value, "ndim", None) == 0 else value


def point(name: str, value: object) -> tuple[float, float]:
    """Return a pair of finite numbers [m] as floats."""
    x, y = numbers(name, value, "two finite numbers x, y in m", 2)
    return x, y


def is_auto(value: object) -> bool:
    """Whether a value is left to rodshell; arrays are not compared with a word."""
    return isinstance(value, str) and value == "auto"


def file_path(name: str, value: object) -> Path:
    """Return `value` as a path, with ~ resolved.

    Raises
    ------
    InputError : it is neither text nor a path, no system could have such a path, or nobody knows that home folder.
    """
    if not isinstance(value, str | PathLike):
        raise InputError(f"{name} must be the path of a file, not {described(value)}")
    path = Path(value)
    try:
        os.fsencode(path)
        path = path.expanduser()
        path.lstat()
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        pass
    except UnicodeEncodeError:
        raise InputError(f"{name} = {shown(str(path))} has characters that no file name here can have") from None
    except RuntimeError:
        raise InputError(f"{name} = {shown(str(path))}: there is no such user; write the path in full") from None
    except ValueError as reason:  # a character NUL
        raise InputError(f"{name} = {shown(str(path))} is not a path: {reason}") from None
    except OSError as reason:  # such as a name of 5,000 characters
        raise InputError(f"{name} = {shown(str(path))} cannot be looked up: {reason.strerror}") from None
    return path


def finite(name: str, given: "ArrayLike", *shape: int) -> "Floats":
    """Return `given` as an array of finite numbers.

    Parameters
    ----------
    name : of the argument.
    given : numbers of the `shape`, or of one that can be broadcast to it.
    shape : of the result; none for a single number.
    """
    import numpy as np  # here, so that the command line's help need not wait for it

    try:
        array = np.asarray(given, dtype=float)
        if array.shape != shape:
            array = np.broadcast_to(array, shape)
    except (TypeError, ValueError):
        wanted = "one number" if not shape else f"numbers of the shape {shape}"
        raise InputError(f"{name} must be {wanted}, not {short(given)}") from None
    if not np.isfinite(array).all():
        raise InputError(f"{name} must be finite, not {short(given)}")
    return array


def array(name: str, given: "ArrayLike", kind: type[_Scalar], *shape: int | None) -> "NDArray[_Scalar]":
    """Return `given` as an array; whether its numbers are finite is not checked.

    Parameters
    ----------
    name : of the argument.
    given : an array or nested sequences.
    kind : of the array's elements.
    shape : length along each axis, None for any.
    """
    import numpy as np

    wanted, whole = ", ".join("n" if count is None else str(count) for count in shape), issubclass(kind, np.integer)
    try:
        result = np.asarray(given)
        if result.size and result.dtype.kind not in ("iu" if whole else "fiu"):  # np.asarray([]) is an array of floats
            raise TypeError
        result = result.astype(kind, copy=False)
    except (TypeError, ValueError):
        what = "integers" if whole else "numbers"
        raise InputError(f"{name} must be {what} of the shape ({wanted}), not {short(given)}") from None
    if result.ndim != len(shape) or any(n not in (None, m) for n, m in zip(shape, result.shape, strict=True)):
        raise InputError(f"{name} must have the shape ({wanted}), not {result.shape}")
    return result


def vector(name: str, given: "ArrayLike") -> "Floats":
    """Return `given` as an array (3,) of finite numbers."""
    import numpy as np

    if np.shape(given) != (3,):
        raise InputError(f"{name} must be three numbers (x, y, z), not {short(given)}")
    return finite(name, given, 3)


def direction(name: str, given: "ArrayLike") -> "Floats":
    """Return the unit vector (3,) along `given`."""
    array = vector(name, given)
    length = float((array @ array) ** 0.5)
    if length == 0:
        raise InputError(f"{name} must not be zero: it has no direction")
    unit: Floats = array / length
    return unit


def _is_finite(value: object) -> bool:
    return isinstance(value, NUMBER) and not isinstance(value, bool) and isfinite(as_float(value))


def described(value: object) -> str:
    """A number or text as it is, a class as such, anything else by its class."""
    if isinstance(value, type):
        return f"the class {value.__name__} itself"
    if isinstance(value, str | Real):
        return shown(value)
    name = type(value).__name__
    return "None" if value is None else f"a{'n' * (name[0] in 'AEIOUaeiou')} {name}"


def brief(record: Any) -> str:
    """A dataclass in one line, as its `__repr__`: arrays by their shape, and without what is at its default.

    `Pin(eccentricity=0.02)`, `Stretch(blocks=(240, 2), rest_lengths=(240,), ...)`.
    """
    shown = []
    for field in fields(record):
        value = getattr(record, field.name)
        if hasattr(value, "dtype") and hasattr(value, "shape"):  # NumPy is not imported: cases show records without it
            shown.append(f"{field.name}={value.shape}")
        elif field.default is MISSING or type(value) is not type(field.default) or value != field.default:
            shown.append(f"{field.name}={value!r}")
    return f"{type(record).__name__}({', '.join(shown)})"
