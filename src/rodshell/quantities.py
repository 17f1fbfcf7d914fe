"""Types of the values that a user gives, for fields of dataclasses: `pressure: Pressure`.

Each says how a value is read from a case file or an option, with its unit, and what is accepted from Python.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from difflib import get_close_matches
from math import inf
from numbers import Integral
from typing import Annotated, Any, Literal, TypeVar

from rodshell.errors import InputError
from rodshell.units import Kind, read_quantity, require_unit_of_all, shown, si_unit, wanted
from rodshell.validation import described, is_auto, not_negative, number, numbers, positive, whole

Auto = Literal["auto"]
_Reader = Callable[[object], Any]
_Sign = Callable[..., float]
T = TypeVar("T")
MOST_STAGES = 1000  # of a deployment


@dataclass(frozen=True)
class Value:
    """How a value is given.

    Args:
        read: from a case file or an option, to SI. A ValueError says what is wrong, without the key.
        check: as read(name, value) of what Python gives; None: it is checked elsewhere.
        words: that it may also be.
        role: "name": it is text that is not empty; "file": the path of a file to be read; "folder": of one to be
            written.
        unit: of a number without a unit, or of several; "" where that has none.
    """

    read: _Reader
    check: Callable[[str, Any], Any] | None = None
    words: tuple[str, ...] = ()
    role: Literal["", "name", "file", "folder"] = ""
    unit: str = ""


def quantity(kind: Kind, sign: _Sign = number, unit: str | None = None) -> Value:
    """A number with a unit.

    Args:
        sign: `number`, `positive` or `not_negative` of `validation`.
        unit: in messages of Python; None: the SI unit of the kind.
    """
    si = si_unit(kind) if unit is None else unit

    def read(value: object) -> float:
        found = read_quantity(value, kind, size=sign is positive)
        if sign is not_negative and found < 0:
            raise ValueError(f"must not be negative; give {wanted(kind)}")
        return found

    return Value(read, lambda name, value: sign(name, value, si), unit=si_unit(kind))


def _or_auto(value: Value) -> Value:
    def read(given: object) -> object:
        if is_auto(given.strip() if isinstance(given, str) else given):
            return "auto"
        try:
            return value.read(given)
        except ValueError as reason:
            raise ValueError(f'{reason}, or "auto"') from None

    return Value(read, unit=value.unit)


def pair(value: Value, words: str, *, one_for_both: bool = False) -> Value:
    """[a, b] or "a, b"; a single value may stand for both.

    Args:
        words: what Python has to give.
    """
    needs = f"needs {'one or two' if one_for_both else 'two'} values, such as "
    return _several(2, value, needs + '["30 mm", "40 mm"] or "30 mm, 40 mm"', words, one_for_all=one_for_both)


def _triple(kind: Kind) -> Value:
    """[a, b, c] or "a, b, c"."""
    needs = f"needs three values, along or about x, y and z; each is {wanted(kind)}"
    return _several(3, quantity(kind), needs, f"three finite numbers in {si_unit(kind)}")


_ORDER = ("first", "second", "third")


def _several(count: int, value: Value, needs: str, words: str, *, one_for_all: bool = False) -> Value:
    """So many values, each read and checked as one is; `needs` and `words` say what a file and Python have to give."""
    assert value.check is not None
    check = value.check

    def read(given: object) -> tuple[float, ...]:
        items = _parted(given)
        if not isinstance(items, list | tuple):
            items = [items]
        if len(items) == 1 and one_for_all:
            return (value.read(items[0]),) * count
        if len(items) != count:
            raise ValueError(needs)
        return tuple(_named(ordinal, value, item) for ordinal, item in zip(_ORDER, items, strict=False))

    def checked(name: str, given: Any) -> tuple[float, ...]:
        return tuple(check(name, item) for item in numbers(name, given, words, count))

    return Value(read, checked, unit=value.unit)


def _parted(value: object) -> object:
    """The values of a text "a, b", which all have a unit or none has; anything else as it is."""
    if not isinstance(value, str):
        return value
    items = value.split(",")
    require_unit_of_all(items)
    return items


def _named(ordinal: str, value: Value, item: object) -> float:
    try:
        return float(value.read(item))
    except ValueError as reason:
        raise ValueError(f"{ordinal} value: {reason}") from None


def _unit(value: object) -> float:
    """A unit of length: "mm", or its length "25.4 mm"."""
    if isinstance(value, str) and value.strip().isalpha():
        value = f"1 {value.strip()}"
    return read_quantity(value, "length", size=True)


def _counts(value: object) -> tuple[int, int] | str:
    """Numbers of rods: [17, 17], "17x17", "17,17" or "auto"."""
    if isinstance(value, str) and value.strip() == "auto":
        return "auto"
    items = value
    if isinstance(value, str):
        items = [int(n) if n.strip().isdecimal() else n for n in re.split("[x×,]", value)]
    if (
        isinstance(items, list | tuple)
        and len(items) == 2
        and all(isinstance(n, Integral) and int(n) >= 2 for n in items)
    ):
        return int(items[0]), int(items[1])
    raise ValueError('give two counts of at least 2, such as [17, 17] or "17x17", or "auto"')


def _stiffness(value: object) -> float:
    """Of a joint [N m/rad], 0 or more, or "rigid"."""
    if isinstance(value, str) and value.strip() == "rigid":
        return inf
    try:
        found = read_quantity(value, "rotational stiffness")
    except ValueError as reason:
        raise ValueError(f'{reason}, or "rigid"') from None
    if found < 0:
        raise ValueError(f'must not be negative; give {wanted("rotational stiffness")}, or "rigid"')
    return found


def _corners(value: object) -> int:
    """Of a crossing: 2 or 4."""
    if value in (2, 4) or (isinstance(value, str) and value.strip() in ("2", "4")):
        return int(value)
    raise ValueError("give 2, opposite corners as in the paper, or 4")


def _checked_corners(_: str, value: object) -> int:
    if not isinstance(value, Integral) or value not in (2, 4):
        raise InputError(f"a joint has linkers in 2 or 4 of its corners, not in {described(value)}")
    return int(value)


def _whole(value: object) -> int:
    """A whole number, not negative."""
    found = int(value) if isinstance(value, str) and value.strip().isdecimal() else value
    if isinstance(found, bool) or not isinstance(found, Integral) or found < 0:
        raise ValueError("give a whole number of at least 0, such as 8")
    return int(found)


def _poisson_ratio(value: object) -> float:
    found = read_quantity(value, "number")
    if not -1 < found <= 0.5:
        raise ValueError("must lie above -1 and not above 0.5; give 0.5 for an incompressible material")
    return found


def _polylines(value: object) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Rows of points of the plan: [[[x, y], [x, y]], ...], or "x, y; x, y | x, y; x, y"."""
    rows = value
    if isinstance(value, str):
        rows = [row.split(";") for row in value.split("|")]
        require_unit_of_all(re.split("[|;,]", value))
    if not isinstance(rows, list | tuple) or not all(isinstance(row, list | tuple) and len(row) > 1 for row in rows):
        raise ValueError('give rows of two points or more, such as [[[-1, 0], [1, 0]]] or "-1, 0; 1, 0 | 0, -1; 0, 1"')
    return tuple(tuple(_POINT.read(point) for point in row) for row in rows)


def _strokes(value: object) -> tuple[tuple[tuple[float, ...], ...], ...]:
    """Rows of points in plan or in space: [[[x, y, z], [x, y, z]], ...], or "x, y, z; x, y, z | x, y; x, y"."""
    rows = value
    if isinstance(value, str):
        rows = [[point.split(",") for point in row.split(";")] for row in value.split("|")]
    wanted = 'give rows of two points or more, of x, y or x, y, z: [[[-1, 0], [1, 0]]] or "-1, 0; 1, 0"'
    if not isinstance(rows, list | tuple):
        raise ValueError(wanted)
    for row in rows:
        sizes = {len(point) if isinstance(point, list | tuple) else 0 for point in row} if len(row) > 1 else {0}
        if sizes not in ({2}, {3}):
            raise ValueError(wanted)
    return tuple(tuple(tuple(read_quantity(x, "length") for x in point) for point in row) for row in rows)


def _line(value: object) -> tuple[tuple[float, float], ...]:
    """Points of one line: [[x, y], [x, y]], or "x, y; x, y"."""
    rows = _polylines(value if isinstance(value, str) else [value])
    if len(rows) != 1:
        raise ValueError('give one line of two points or more, such as "-1, 0; 1, 0"')
    return rows[0]


def _ratio(value: object) -> float:
    found = read_quantity(value, "number")
    if found <= 1:
        raise ValueError("must be larger than 1, such as 4")
    return found


def _numbers(value: object) -> tuple[float, ...]:
    """Plain numbers: [1, 2, 3], or "1, 2, 3"."""
    items = value.split(",") if isinstance(value, str) else value
    if not isinstance(items, list | tuple) or not items:
        raise ValueError("give numbers, such as [0.1, -0.3]")
    return tuple(read_quantity(item, "number") for item in items)


def words(choices: Sequence[str]) -> Value:
    """Some of these words, each once: ["a", "b"], or "a, b"."""

    def read(value: object) -> tuple[str, ...]:
        items = value.split(",") if isinstance(value, str) else value
        if not isinstance(items, list | tuple) or not all(isinstance(item, str) for item in items):
            raise ValueError(f"give one or several of {', '.join(choices)}")
        found = tuple(item.strip() for item in items if item.strip())
        for word in found:
            if word not in choices:
                near = get_close_matches(word, choices, n=1)
                hint = f": did you mean {near[0]}?" if near else ""
                raise ValueError(f"{shown(word)} is not one of {', '.join(choices)}{hint}")
        if len(set(found)) < len(found):
            raise ValueError("give each word once")
        return found

    return Value(read)


def _iso_date(value: object) -> str:
    """A day as "2026-11-22"; "" for none; TOML's own dates too."""
    try:
        return date.fromisoformat(str(value)).isoformat() if value != "" else ""
    except ValueError:
        raise ValueError('must be a day; write it as "2026-11-22"') from None


def _checked_day(name: str, value: object) -> str:
    try:
        return _iso_date(value)
    except ValueError:
        raise InputError(f'{name} cannot be {shown(value)}: write a day as "2026-11-22"') from None


def _names(value: object) -> tuple[str, ...]:
    """Names: ["U01", "V03"] or "U01, V03"."""
    items = value.split(",") if isinstance(value, str) and value.strip() else value or []
    if not isinstance(items, list | tuple) or not all(
        isinstance(item, str) and re.fullmatch(r"[\w.-]+", item.strip()) for item in items
    ):
        raise ValueError('give names such as ["U01", "V03"], or "U01, V03"')
    return tuple(dict.fromkeys(item.strip() for item in items))


_POINT = pair(quantity("length"), "two finite numbers x, y in m")
_TWO = "two lengths in m"
_LENGTH, _ANGLE = quantity("length", positive), quantity("angle")
_LENGTHS = pair(_LENGTH, _TWO, one_for_both=True)

Name = Annotated[str, Value(str, role="name")]
FileToRead = Annotated[str, Value(str, role="file")]
FolderToWrite = Annotated[str, Value(str, role="folder")]
IsoDate = Annotated[str, Value(_iso_date, _checked_day)]
Names = Annotated[tuple[str, ...], Value(_names)]
Whole = Annotated[int, Value(_whole)]
Stages = Annotated[int, Value(_whole, lambda name, value: whole(name, value, 0, MOST_STAGES))]
Counts = Annotated[tuple[int, int] | Auto, Value(_counts)]
Corners = Annotated[Literal[2, 4], Value(_corners, _checked_corners)]
Unit = Annotated[float, Value(_unit)]
Ratio = Annotated[float, Value(_ratio)]
Numbers = Annotated[tuple[float, ...], Value(_numbers)]
Polylines = Annotated[tuple[tuple[tuple[float, float], ...], ...], Value(_polylines)]
Line = Annotated[tuple[tuple[float, float], ...], Value(_line)]
Strokes = Annotated[tuple[tuple[tuple[float, ...], ...], ...], Value(_strokes)]
PoissonRatio = Annotated[float, Value(_poisson_ratio, lambda name, value: number(name, value))]
Stiffness = Annotated[
    float,
    Value(_stiffness, lambda name, value: not_negative(name, value, "N m/rad", infinite=True), words=("rigid",)),
]

Length = Annotated[float, _LENGTH]
Distance = Annotated[float, quantity("length", not_negative)]
Coordinate = Annotated[float, quantity("length")]
Angle = Annotated[float, _ANGLE]
LengthOrAuto = Annotated[float | Auto, _or_auto(_LENGTH)]
AngleOrAuto = Annotated[float | Auto, _or_auto(_ANGLE)]
Lengths = Annotated[tuple[float, float], _LENGTHS]
LengthsOrAuto = Annotated[tuple[float, float] | Auto, _or_auto(_LENGTHS)]
Size = Annotated[tuple[float, float], pair(_LENGTH, _TWO)]
Point = Annotated[tuple[float, float], _POINT]
PointOrAuto = Annotated[tuple[float, float] | Auto, _or_auto(_POINT)]
Point3 = Annotated[tuple[float, float, float], _triple("length")]
Direction3 = Annotated[tuple[float, float, float], _triple("number")]
_STIFF = _several(
    3, quantity("stiffness", not_negative), 'needs one or three values, such as "200 kN/m"',
    "three stiffnesses along x, y and z in N/m, or one", one_for_all=True,
)  # fmt: skip


def _stiffnesses(name: str, given: object) -> Any:
    assert _STIFF.check is not None
    return _STIFF.check(name, [given] * 3 if isinstance(given, int | float) else given)


Stiffness3 = Annotated[float | tuple[float, float, float], Value(_STIFF.read, _stiffnesses)]
Angles = Annotated[tuple[float, float, float], _triple("angle")]

Factor = Annotated[float, quantity("number", positive)]
Share = Annotated[float, quantity("number", not_negative)]
PerKelvin = Annotated[float, quantity("number", positive, "1/K")]
Force = Annotated[float, quantity("force", positive)]
Forces3 = Annotated[tuple[float, float, float], _triple("force")]
ForcePerLength3 = Annotated[tuple[float, float, float], _triple("force per length")]
SlipMoment = Annotated[float, quantity("moment", positive)]
Stress = Annotated[float, quantity("stress", positive)]
Pressure = Annotated[float, quantity("pressure", not_negative)]
BendingStiffness = Annotated[float, quantity("bending stiffness", positive)]
NodeStiffness = Annotated[float, quantity("stiffness", positive)]
AngleStiffness = Annotated[float, quantity("rotational stiffness", positive)]
SectionModulus = Annotated[float, quantity("section modulus", positive)]
Mass = Annotated[float, quantity("mass", not_negative)]
MassPerLength = Annotated[float, quantity("mass per length", not_negative)]
MassPerArea = Annotated[float, quantity("mass per area", not_negative)]
InertiaPerLength = Annotated[float, quantity("inertia per length", not_negative)]
Density = Annotated[float, quantity("density", positive)]
Acceleration = Annotated[float, quantity("acceleration", positive)]
Duration = Annotated[float, quantity("time", positive)]
Memory = Annotated[float, quantity("memory", positive)]
KelvinChange = Annotated[float, quantity("temperature")]
