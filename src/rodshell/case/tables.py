"""Tables as TOML or Python gives them, within limits: what would cost minutes or gigabytes is refused."""

import re
import tomllib
from collections.abc import Iterator, Mapping
from itertools import islice
from typing import Any

from rodshell.errors import InputError
from rodshell.units import shown
from rodshell.untrusted import limit, raised

TEXT = 2e6  # bytes of a case; tomllib takes about 1 us and 50 bytes for each
DEEPEST = 10  # tables and lists within each other: points of a line of a load in a row take seven
_LONGEST_KEY = 200  # characters
_MOST_KEYS = 1000  # of one table
_TOO_DEEP = f"tables or lists are within each other more than {DEEPEST} deep: a case has none such"
_MANY_DOTS = re.compile(r"""(?<![\w-])(?:(?:[\w-]++|"(?:[^"\\\n]|\\.)*+"|'[^'\n]*+')[ \t]*+\.[ \t]*+){20}""")
"""A dotted key of more than twenty tables, for which tomllib takes memory by the square of their number."""


def toml_of(name: str, text: str, wrong_type: str = "") -> dict[str, Any]:
    """The tables of a text; `tomllib` is given none that it would take minutes or gigabytes for.

    Args:
        name: of the text, for messages.
        wrong_type: what is wrong with a file of this name, if anything.

    Raises:
        InputError: it is too large, or no TOML.
    """
    if len(text) > limit(TEXT):
        raise InputError(f"{name} has more than {limit(TEXT) / 1e6:g} MB: shorten it, {raised(TEXT, len(text))}")
    if _MANY_DOTS.search(text):
        raise InputError(f"{name} has a key of more than twenty tables: the keys of a case have three at most")
    try:
        return tomllib.loads(text)
    except tomllib.TOMLDecodeError as reason:
        raise InputError(f"{name}: {wrong_type}" if wrong_type else f"{name} is not valid TOML: {reason}") from None
    except ValueError:  # of Python's int
        raise InputError(f"{name} has an integer of thousands of digits: write numbers such as 0.2 or 1e6") from None
    except RecursionError:
        raise InputError(_TOO_DEEP) from None


def plain(value: Any, depth: int = 0) -> Any:
    """A value as TOML gives it, NumPy's arrays as lists.

    Raises:
        InputError: tables and lists within each other, or keys, beyond what any case has: they would cost minutes.
    """
    if depth > DEEPEST:
        raise InputError(_TOO_DEEP)
    if hasattr(value, "dtype") and not isinstance(value, type):
        value = value.tolist()
    if isinstance(value, Iterator):
        value = tuple(islice(value, _MOST_KEYS + 1))
    if isinstance(value, list | tuple):
        items = (plain(item, depth + 1) for item in value)
        return tuple(items) if isinstance(value, tuple) else [*items]
    if not isinstance(value, Mapping):
        return value
    if len(value) > _MOST_KEYS:
        raise InputError(f"a table has {len(value)} keys; at most {_MOST_KEYS} are read: leave some out")
    if long := next((key for key in value if isinstance(key, str) and len(key) > _LONGEST_KEY), None):
        raise InputError(f"unknown key {shown(long)}: it has {len(long)} characters")
    return {key: plain(item, depth + 1) for key, item in value.items()}
