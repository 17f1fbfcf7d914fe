"""Checks of arguments: kind, sign, shape and spelling; and the texts that show values in messages and records.

Every check raises InputError with one sentence, which calls the argument by its `name`.
"""

import os
import reprlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import MISSING, fields
from difflib import get_close_matches
from inspect import signature
from math import inf, isfinite
from numbers import Integral, Real
from os import PathLike
from pathlib import Path
from types import UnionType
from typing import Any, TypeVar, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.units import NUMBER, as_float, out_of_range, shown

MOST = 10**12  # of a count
LARGEST = 1e18  # of the numbers in an array, whatever their unit: see `units.RANGES`
_Choice = TypeVar("_Choice", bound=str)
_Scalar = TypeVar("_Scalar", bound=np.generic)
NAME = "[a-z0-9]{1,40}"  # of a support: it stands in names of states and files
Ends = str  # the name of a support


def instance(name: str, value: object, kind: type | UnionType, wanted: str = "") -> None:
    """Refuse a `value` that is not of a `kind`.

    Args:
        kind: class or union of classes.
        wanted: what the value must be, in words; default "a rodshell KIND".
    """
    if not isinstance(value, kind):
        kinds = [each.__name__ for each in (get_args(kind) or (kind,))]
        what = wanted or f"a rodshell {' or '.join(kinds)}"
        raise InputError(f"{name} must be {what}, not {described(value)}")


def choice(name: str, value: object, choices: Sequence[_Choice]) -> _Choice:
    """Return `value` if it is one of the words in `choices`; the message suggests the closest of them."""
    for word in choices:
        if isinstance(value, str) and value == word:  # an array is compared with none
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


def choices_of(name: str, value: Any, choices: Sequence[_Choice]) -> tuple[_Choice, ...]:
    """Return `value` as a tuple of different words out of `choices`.

    Args:
        value: one word, or a sequence of words, which may be empty.
        choices: the words that are allowed.
    """
    words = [value] if isinstance(value, str) else list(value) if isinstance(value, Sequence) else None
    if words is None:
        raise InputError(f"{name} must be one or several of {', '.join(map(shown, choices))}, not {described(value)}")
    return tuple(dict.fromkeys(choice(name, word, choices) for word in words))


def number(name: str, value: object, unit: str = "") -> float:
    """Return `value`, a finite number in the range of its SI unit (`units.RANGES`), as a float; the message names both.

    Args:
        unit: "" for a plain number.
    """
    real = _real(name, value, unit)
    wanted = out_of_range(real, unit) if isfinite(real) else "finite"
    return _allowed(name, value, unit, real, wanted)


def positive(name: str, value: object, unit: str = "", *, infinite: bool = False) -> float:
    """Return `value`, a number above 0, as a float; infinity only where it is allowed; see `number`."""
    real = _real(name, value, unit)
    wanted = out_of_range(real, unit, size=True) if 0 < real < inf else "" if real == inf and infinite else "positive"
    return _allowed(name, value, unit, real, wanted)


def not_negative(name: str, value: object, unit: str = "", *, infinite: bool = False) -> float:
    """Return `value`, a number of 0 or more, as a float; infinity only where it is allowed; see `number`."""
    real = _real(name, value, unit)
    wanted = out_of_range(real, unit) if 0 <= real < inf else "" if real == inf and infinite else "0 or more"
    return _allowed(name, value, unit, real, wanted)


def _allowed(name: str, value: object, unit: str, real: float, wanted: str) -> float:
    """Return `real`, unless it is `wanted` to be otherwise."""
    if wanted:
        raise InputError(f"{name} must be {wanted}, not {described(value)}{unit and ' ' + unit}")
    return real


def whole(name: str, value: object, least: int, most: int = MOST) -> int:
    """Return `value`, a whole number from `least` to `most`, as an int."""
    value = _plain(value)
    if isinstance(value, Integral) and not isinstance(value, bool):
        given = int(value)
        if least <= given <= most:
            return given
    wanted = f" of {least} or more" if most == MOST else f", {least} to {most}"
    raise InputError(f"{name} must be a whole number{wanted}, not {described(value)}")


def flag(name: str, value: object) -> bool:
    """Return `value`, True or False or NumPy's scalar of them, as a bool."""
    given = _plain(value)
    if not isinstance(given, bool):
        raise InputError(f"{name} must be True or False, not {described(value)}")
    return given


def listed(name: str, value: object, wanted: str) -> tuple[Any, ...]:
    """Return the items of a list, an array, a set, a generator or the like as a tuple.

    Args:
        value: of the argument; text is not a list of its letters, a mapping not one of its keys.
        wanted: what it must be, in words, such as "a list of rods".
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


def numbers(name: str, value: object, wanted: str, count: int, unit: str = "") -> tuple[float, ...]:
    """Return `value` as a tuple of finite floats in the range of their SI unit; see `number`.

    Args:
        value: a sequence or an array.
        wanted: what it must be, in words, such as "two finite numbers x, y in m".
        unit: of each; "" for plain numbers.
    """
    single = not hasattr(value, "__len__") or isinstance(value, str | bytes | dict) or getattr(value, "ndim", 1) == 0
    given: Any = () if single else value
    if len(given) != count or not all(_is_finite(item) for item in given):
        raise InputError(f"{name} must be {wanted}, not {short(value)}")
    return tuple(number(name, item, unit) for item in given)


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
    x, y = numbers(name, value, "two finite numbers x, y in m", 2, "m")
    return x, y


def function_of(name: str, value: object, wanted: str, *example: object, **named: object) -> None:
    """Refuse what cannot be called with arguments as in this example; `wanted` is what it must be, in words."""
    try:
        signature(value).bind(*example, **named)  # type: ignore[arg-type]
    except (TypeError, ValueError):
        found = "one of other arguments" if callable(value) else described(value)
        raise InputError(f"{name} must be {wanted}, not {found}") from None


def is_auto(value: object) -> bool:
    """Whether a value is left to rodshell; arrays are not compared with a word."""
    return isinstance(value, str) and value == "auto"


def file_path(name: str, value: object) -> Path:
    """Return `value` as a path, with ~ resolved.

    Raises:
        InputError: it is neither text nor a path, no system could have such a path, or nobody knows that home folder.
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


def finite(name: str, given: ArrayLike, *shape: int) -> Floats:
    """Return `given` as an array of finite numbers.

    Args:
        given: numbers of the `shape`, or of one that can be broadcast to it.
        shape: of the result; none for a single number.
    """
    try:
        array = np.asarray(given, dtype=float)
        if array.shape != shape:
            array = np.broadcast_to(array, shape)
    except (TypeError, ValueError, OverflowError):
        wanted = "one number" if not shape else f"numbers of the shape {shape}"
        raise InputError(f"{name} must be {wanted}, not {short(given)}") from None
    if not (allowed := np.abs(array) <= LARGEST).all():
        where = np.argwhere(~allowed)[0].tolist()
        wanted = f"at most {LARGEST:g}" if np.isfinite(value := array[tuple(where)]) else "finite"
        raise InputError(f"{name} must be {wanted}, not {value}{f' at {where}' if where else ''}")
    return array


def array(name: str, given: ArrayLike, kind: type[_Scalar], *shape: int | None) -> NDArray[_Scalar]:
    """Return `given` as an array; whether its numbers are finite is not checked.

    Args:
        given: an array or nested sequences.
        shape: length along each axis, None for any.
    """
    wanted, whole = ", ".join("n" if count is None else str(count) for count in shape), issubclass(kind, np.integer)
    try:
        result = np.asarray(given)
        if result.size and result.dtype.kind not in ("iu" if whole else "fiu"):  # np.asarray([]) is an array of floats
            raise TypeError
        result = result.astype(kind, copy=False)
    except (TypeError, ValueError, OverflowError):
        what = "integers" if whole else "numbers"
        raise InputError(f"{name} must be {what} of the shape ({wanted}), not {short(given)}") from None
    if result.ndim != len(shape) or any(n not in (None, m) for n, m in zip(shape, result.shape, strict=True)):
        raise InputError(f"{name} must have the shape ({wanted}), not {result.shape}")
    return result


def vector(name: str, given: ArrayLike) -> Floats:
    """Return `given` as an array (3,) of finite numbers."""
    try:
        shape = np.shape(given)
    except ValueError:  # rows of several lengths, or without end
        shape = ()
    if shape != (3,):
        raise InputError(f"{name} must be three numbers (x, y, z), not {short(given)}")
    return finite(name, given, 3)


def direction(name: str, given: ArrayLike) -> Floats:
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


def short(value: object) -> str:
    """A value as Python shows it, on one line and shortened."""
    try:
        text = reprlib.repr(value)
    except ValueError:
        text = shown(value)  # of thousands of digits
    return " ".join(text.split())


def keep(record: Any, check: Callable[..., object], unit: str, *names: str, what: str = "{}", **options: Any) -> None:
    """Check numbers of a frozen dataclass in its `__post_init__`, and keep them as Python's floats.

    Args:
        record: the dataclass; a field with the default None may be None.
        check: `number`, `positive` or `not_negative`.
        what: what messages call a field, with {} for its name.
        options: of `check`.
    """
    optional = {field.name for field in fields(record) if field.default is None}
    for name in names:
        value = getattr(record, name)
        if value is not None or name not in optional:
            object.__setattr__(record, name, check(what.format(name), value, unit, **options))


def brief(record: Any) -> str:
    """A dataclass in one line, as its `__repr__`: arrays by their shape, and without what is at its default.

    `Pin(eccentricity=0.02)`, `Stretch(blocks=(240, 2), rest_lengths=(240,), ...)`.
    """
    shown = []
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray):
            shown.append(f"{field.name}={value.shape}")
        elif field.default is MISSING or type(value) is not type(field.default) or value != field.default:
            shown.append(f"{field.name}={value!r}")
    return f"{type(record).__name__}({', '.join(shown)})"
