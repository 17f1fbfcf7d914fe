"""The axes of a sweep: which keys of the case take which values, in SI.

An axis is a table of values with a column for each of its keys: one for a list or a range, several where keys change
together. A sample (Latin hypercube, Sobol) is such a table too, so that a sweep is always the product of its axes.
"""

import re
from collections.abc import Iterator, Mapping, Sequence, Set
from contextlib import suppress
from dataclasses import dataclass
from math import isfinite, pi, prod, tau
from pathlib import Path
from typing import Any

import numpy as np
from scipy.stats import qmc

from rodshell.arrays import Floats
from rodshell.case import Case
from rodshell.case.load import FILE_KEYS
from rodshell.errors import InputError
from rodshell.job import Job
from rodshell.units import shown
from rodshell.validation import choice

BASE = "base"
_BELOW_ONE = 1 - 1e-12
MOST = 1_000_000  # designs
METHODS = ("latin-hypercube", "sobol")
SCALES = ("linear", "log")
_PATHS = {f"{table}.{key}" for table, keys in FILE_KEYS.items() for key in keys}


@dataclass(frozen=True)
class Axis:
    """Values of one key, or of several that change together.

    Args:
        keys: of the case, dotted; "base" for the base itself.
        rows: values of these keys, in SI where they are numbers.
    """

    keys: tuple[str, ...]
    rows: tuple[tuple[Any, ...], ...]

    def row(self, share: float) -> tuple[Any, ...]:
        """The values at a share of the axis in [0, 1]."""
        return self.rows[min(int(share * len(self.rows)), len(self.rows) - 1)]


@dataclass(frozen=True)
class Span:
    """An interval of one key.

    Args:
        low, high: its ends in SI: numbers, or as many numbers in a tuple.
        whole: whether its values are whole numbers, both ends included.
        scale: "linear", or "log" with equal ratios.
    """

    key: str
    low: Any
    high: Any
    whole: bool
    scale: str

    @property
    def keys(self) -> tuple[str, ...]:
        """Its key, as `Axis.keys`."""
        return (self.key,)

    def row(self, share: float) -> tuple[Any, ...]:
        """As `Axis.row`."""
        return (self.drawn(min(share, _BELOW_ONE) if self.whole else share),)

    def at(self, share: float) -> Any:
        """The value at a share in [0, 1] of the interval."""
        if isinstance(self.low, tuple):
            parts = zip(self.low, self.high, strict=True)
            return tuple(Span(self.key, low, high, self.whole, self.scale).at(share) for low, high in parts)
        if self.scale == "log":
            between = float(self.low * (self.high / self.low) ** share)
        else:
            between = float(self.low + share * (self.high - self.low))
        return round(between) if self.whole else self.high if share == 1.0 else between

    def drawn(self, share: float) -> Any:
        """As `at`; each whole number stands for an equal part of the interval."""
        if not self.whole or self.scale == "log":
            return self.at(share)
        return int(self.low + share * (self.high + 1 - self.low))


def read_axes(given: Mapping[str, Any], sample: Mapping[str, Any] | None, base: Job, folder: Path) -> tuple[Axis, ...]:
    """The axes of the tables [axes] and [sample].

    Args:
        given: by key, or by keys with commas: a list of values, { from, to, count, scale }, or without count what is
            sampled.
        sample: { method, count, seed }; None without a sample.
        base: a job by whose case quantities are read.
        folder: in which files lie whose paths are relative.

    Raises:
        InputError: a value cannot be used, a key occurs twice, or there are too many designs.
    """
    axes, spans = list[Axis | None](), list[Span]()
    for name, values in flat_keys(given):
        if prod(len(axis.rows) for axis in axes if axis) > MOST:
            break  # and no more are made
        if isinstance(values, Mapping):
            span = read_span(name, values, base, ("from", "to", "count", "scale"))
            if "count" in values:
                axes.append(Axis((name,), tuple((value,) for value in _evenly(span, values["count"]))))
                continue
            if not spans:
                axes.append(None)  # the place of the sample
            spans.append(span)
        else:
            axes.append(read_listed(name, values, base, folder))
    if spans and sample is None:
        raise InputError(
            f"axes {shown(spans[0].key)}: give its count, or say in [sample] how values between from and to are drawn"
        )
    if sample is not None and not spans:
        raise InputError("[sample]: no axis is sampled: give from and to without count for each key to be sampled")
    found = tuple(_sampled(spans, sample or {}) if axis is None else axis for axis in axes)
    keys = [key for axis in found for key in axis.keys]
    twice = next((key for k, key in enumerate(keys) if key in keys[:k]), None)
    if twice is not None:
        raise InputError(f"axes: the key {twice} occurs twice: leave one out")
    count = prod(len(axis.rows) for axis in found)
    if count > MOST:
        raise InputError(f"axes: {count} designs are more than {MOST}: give fewer values")
    return found


def flat_keys(
    given: Mapping[str, Any], ends: Set[str] = frozenset({"from", "to"}), closed: Sequence[str] = (), prefix: str = ""
) -> Iterator[tuple[str, Any]]:
    """Values by dotted key; tables in tables, as [axes.layout], are opened, but not with `ends` or `closed`."""
    for name, value in given.items():
        if not isinstance(name, str):
            raise InputError(f"keys are words such as layout.spacing, not {name!r}")
        if isinstance(value, Mapping) and name not in closed and not ends & value.keys():
            yield from flat_keys(value, ends, closed, f"{prefix}{name}.")
        else:
            yield prefix + name, value


def read_span(key: str, given: Mapping[str, Any], base: Job, known: Sequence[str]) -> Span:
    """The interval of a key.

    Args:
        given: { from, to, scale }.
        base: a job by whose case quantities are read.
        known: the names that `given` may have.

    Raises:
        InputError: an end is missing or not a number, both are the same, or zero with a logarithmic scale.
    """
    for name in given:
        if name not in known:
            raise InputError(f"axes {shown(key)}: unknown key {name}: a range has {', '.join(known)}")
    for name in ("from", "to"):
        if name not in given:
            raise InputError(f'axes {shown(key)}: {name} is missing, as in {{ from = "20 mm", to = "30 mm" }}')
    low, high = (_resolved(base, key, given[name]) for name in ("from", "to"))
    lows, highs = _numbers(low), _numbers(high)
    if not lows or len(lows) != len(highs):
        wrong = "to" if lows else "from"
        raise InputError(f"axes {shown(key)}: {wrong} = {shown(given[wrong])} is not a number between which values lie")
    if lows == highs:
        raise InputError(f"axes {shown(key)}: from and to are the same value, {shown(low)}: give different ones")
    scale = choice(f"axes {shown(key)}: scale", given.get("scale", "linear"), SCALES)
    if scale == "log" and min(*lows, *highs) <= 0:
        raise InputError(f"axes {shown(key)}: a log scale needs from and to above zero")
    return Span(key, low, high, all(type(number) is int for number in (*lows, *highs)), scale)


def _evenly(span: Span, count: object) -> list[Any]:
    """So many values from one end to the other."""
    count = count_of(f"axes {shown(span.key)}: count", count, 2)
    values = [span.at(k / (count - 1)) for k in range(count)]
    if len(set(values)) < count:
        raise InputError(f"axes {shown(span.key)}: count = {count}: there are fewer whole numbers from from to to")
    return values


def _sampled(spans: Sequence[Span], sample: Mapping[str, Any]) -> Axis:
    """All sampled keys as one axis."""
    for name in sample:
        if name not in ("method", "count", "seed"):
            raise InputError(f"unknown key sample.{name}: [sample] has method, count, seed")
    if "count" not in sample:
        raise InputError("sample.count is missing: give the number of designs to be drawn")
    method = choice("sample.method", sample.get("method", METHODS[0]), METHODS)
    count = count_of("sample.count", sample["count"], 2)
    shares = drawn_shares(method, len(spans), count, count_of("sample.seed", sample.get("seed", 0), 0))
    return Axis(
        tuple(span.key for span in spans),
        tuple(tuple(span.drawn(float(u)) for span, u in zip(spans, row, strict=True)) for row in shares),
    )


def drawn_shares(method: str, dimensions: int, count: int, seed: int) -> Floats:
    """(count, dimensions) points in the unit cube [0, 1), by one of `METHODS`.

    Raises:
        InputError: Sobol points, whose count is not a power of two.
    """
    if method == "sobol":
        power = (count - 1).bit_length()
        if count != 1 << power:
            raise InputError(
                f"sample.count = {count}: Sobol points fill the space evenly in powers of two: give {1 << power - 1} "
                f"or {1 << power}"
            )
        return np.asarray(qmc.Sobol(dimensions, seed=seed).random_base2(power))
    return np.asarray(qmc.LatinHypercube(dimensions, seed=seed).random(count))


def read_listed(name: str, values: object, base: Job, folder: Path) -> Axis:
    """An axis of listed values; `base` and `folder` as of `read_axes`.

    Args:
        name: of its key; of several keys, "a, b", whose values are rows.

    Raises:
        InputError: it is not such a list.
    """
    keys = tuple(key.strip() for key in name.split(","))
    if not isinstance(values, list | tuple) or not values:
        raise InputError(
            f'axes {shown(name)} = {shown(values)}: give a list of values, or {{ from = "20 mm", to = "30 mm", '
            "count = 5 }"
        )
    rows = []
    for value in values:
        row = value if len(keys) > 1 else (value,)
        if not isinstance(row, list | tuple) or len(row) != len(keys):
            raise InputError(
                f"axes {shown(name)}: {shown(value)} must be a list of {len(keys)} values, one for each key"
            )
        rows.append(tuple(_plain(base, key, _placed(key, item, folder)) for key, item in zip(keys, row, strict=True)))
    return Axis(keys, tuple(rows))


def _placed(key: str, value: Any, folder: Path) -> Any:
    """A value whose files lie in the sweep's folder, unless they are given from the root."""
    if isinstance(value, Mapping):
        return {name: _placed(f"{key}.{name}", item, folder) for name, item in value.items()}
    return str(folder / value) if key in _PATHS and isinstance(value, str) else value


def _plain(base: Job, key: str, given: Any) -> Any:
    """A value in SI where it is a number; else as it was given; so where it is valid in combinations only."""
    if isinstance(given, Mapping):
        return given
    with suppress(InputError):
        found = _resolved(base, key, given)
        if _numbers(found):
            return found
    return given


def _resolved(base: Job, key: str, given: Any) -> Any:
    """What a value becomes in the case; one number that stands for a pair stays one number.

    Raises:
        InputError: the case cannot have it.
    """
    _require_one_turn(key, given)
    found = _at(base.changed({key: given}).case, key)
    numbers = _numbers(found)
    if isinstance(found, tuple) and len(numbers) == len(found) and len(set(numbers)) == 1:
        with suppress(InputError):
            if _at(base.changed({key: numbers[0]}).case, key) == found:
                return numbers[0]
    return found


def _require_one_turn(key: str, given: object) -> None:
    """InputError for an angle of a full turn or more: a case reduces it, so that 0 to 360 deg would be empty."""
    if not isinstance(given, str):
        return
    number = re.fullmatch(r"\s*([+-]?[\d.]+)\s*(deg|°|degrees?|rad)\s*", given)
    if number and abs(float(number[1])) * (pi / 180 if number[2] != "rad" else 1.0) > tau * (1 - 1e-9):
        raise InputError(f"axes {shown(key)}: {shown(given)} is a full turn or more: stay below 360 deg")


def _at(case: Case, key: str) -> Any:
    """The value of a dotted key of a case; None where it has none."""
    found: Any = case
    for name in key.split("."):
        found = getattr(found, name, None)
    return found


def _numbers(value: object) -> tuple[float, ...]:
    """The finite numbers that a value consists of; none where it is something else."""
    items = value if isinstance(value, tuple) else (value,)
    real = all(isinstance(item, int | float) and not isinstance(item, bool) and isfinite(item) for item in items)
    return tuple(items) if real else ()


def count_of(name: str, value: object, least: int) -> int:
    """A count from a table; InputError for anything but a whole number of at least so many."""
    if type(value) is not int or value < least:
        raise InputError(f"{name} = {shown(value)}: give a whole number of at least {least}")
    if value > MOST:
        raise InputError(f"{name} = {value}: give at most {MOST}")
    return value
