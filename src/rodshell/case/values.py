"""What a table of a case file is, and the types of its values.

A reader of a value raises ValueError with the reason, without the key.
"""

import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from datetime import date
from difflib import get_close_matches
from numbers import Integral
from typing import Annotated, Any, Literal, Self, TypeVar

from pydantic import BaseModel, BeforeValidator, ConfigDict, PrivateAttr, ValidationInfo

from rodshell.units import Kind, read_quantity, require_unit_of_all, shown, wanted

Auto = Literal["auto"]
Reader = Callable[[object], float]
T = TypeVar("T")


class Table(BaseModel):
    """A table of a case file: frozen, and every key in it must be known."""

    model_config = ConfigDict(extra="forbid", frozen=True, defer_build=True)

    _held: "Held | None" = PrivateAttr(default=None)

    @property
    def held(self) -> "Held | None":
        """The object that the table was made of, where its keys do not describe it."""
        return self._held

    def holding(self, held: "Held") -> Self:
        """The same table, which holds an object."""
        table = self.model_copy()
        table._held = held
        return table


@dataclass(frozen=True, eq=False)
class Held:
    """An object of which a table was made whose keys do not describe it: a Python function as a target, say.

    Parameters
    ----------
    by_value : whether two such objects are the same that are equal; else only one object is the same as itself.
    writable : whether a case file that leaves out what the keys do not describe gives the same form.
    """

    value: Any
    what: str
    by_value: bool = True
    writable: bool = False
    note: str = ""

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Held):
            return NotImplemented
        return self.value is other.value or (self.by_value and other.by_value and bool(self.value == other.value))

    def __hash__(self) -> int:
        return hash(self.what)


def quantity(kind: Kind) -> Reader:
    return lambda value: read_quantity(value, kind)


def positive(kind: Kind) -> Reader:
    return lambda value: read_quantity(value, kind, size=True)


def or_auto(reader: Callable[[object], T]) -> Callable[[object], T | str]:
    def read(value: object) -> T | str:
        if is_auto(value):
            return "auto"
        try:
            return reader(value)
        except ValueError as reason:
            raise ValueError(f'{reason}, or "auto"') from None

    return read


def pair(reader: Reader, *, one_for_both: bool = False) -> Callable[[object], tuple[float, float]]:
    """[a, b] or "a, b"; a single value may stand for both."""

    def read(value: object) -> tuple[float, float]:
        items = _parted(value)
        if not isinstance(items, list | tuple):
            items = [items]
        if len(items) == 1 and one_for_both:
            return reader(items[0]), reader(items[0])
        if len(items) != 2:
            needs = "one or two values" if one_for_both else "two values"
            raise ValueError(f'needs {needs}, such as ["30 mm", "40 mm"] or "30 mm, 40 mm"')
        return _named("first", reader, items[0]), _named("second", reader, items[1])

    return read


def _parted(value: object) -> object:
    """The values of a text "a, b", which all have a unit or none has; anything else as it is."""
    if not isinstance(value, str):
        return value
    items = value.split(",")
    require_unit_of_all(items)
    return items


def _named(ordinal: str, reader: Reader, item: object) -> float:
    try:
        return reader(item)
    except ValueError as reason:
        raise ValueError(f"{ordinal} value: {reason}") from None


def triple(kind: Kind) -> Callable[[object], tuple[float, ...]]:
    """[a, b, c] or "a, b, c"."""

    def read(value: object) -> tuple[float, ...]:
        items = _parted(value)
        if not isinstance(items, list | tuple) or len(items) != 3:
            raise ValueError(f"needs three values, along or about x, y and z; each is {wanted(kind)}")
        return tuple(_named(ordinal, quantity(kind), item) for ordinal, item in zip(_ORDER, items, strict=True))

    return read


_ORDER = ("first", "second", "third")


def unit(value: object) -> float:
    """A unit of length: "mm", or its length "25.4 mm"."""
    if isinstance(value, str) and value.strip().isalpha():
        return positive("length")(f"1 {value.strip()}")
    return positive("length")(value)


def counts(value: object) -> tuple[int, int] | str:
    """Numbers of rods: [17, 17], "17x17", "17,17" or "auto"."""
    if is_auto(value):
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


def stiffness(value: object) -> float | str:
    """Of a joint [N m/rad], 0 or more, or "rigid"."""
    if isinstance(value, str) and value.strip() == "rigid":
        return "rigid"
    try:
        number = read_quantity(value, "rotational stiffness")
    except ValueError as reason:
        raise ValueError(f'{reason}, or "rigid"') from None
    if number < 0:
        raise ValueError(f'must not be negative; give {wanted("rotational stiffness")}, or "rigid"')
    return number


def corners(value: object) -> int:
    """Of a crossing: 2 or 4."""
    if value in (2, 4) or (isinstance(value, str) and value.strip() in ("2", "4")):
        return int(value)
    raise ValueError("give 2, opposite corners as in the paper, or 4")


def not_negative(kind: Kind) -> Reader:
    def read(value: object) -> float:
        number = read_quantity(value, kind)
        if number < 0:
            raise ValueError(f"must not be negative; give {wanted(kind)}")
        return number

    return read


def whole(value: object) -> int:
    """A whole number, not negative."""
    number = int(value) if isinstance(value, str) and value.strip().isdecimal() else value
    if isinstance(number, bool) or not isinstance(number, Integral) or number < 0:
        raise ValueError("give a whole number of at least 0, such as 8")
    return int(number)


def is_auto(value: object) -> bool:
    return isinstance(value, str) and value.strip() == "auto"


def poisson_ratio(value: object) -> float:
    number = read_quantity(value, "number")
    if not -1 < number <= 0.5:
        raise ValueError("must lie above -1 and not above 0.5; give 0.5 for an incompressible material")
    return number


def polylines(value: object) -> tuple[tuple[tuple[float, float], ...], ...]:
    """Rows of points of the plan: [[[x, y], [x, y]], ...], or "x, y; x, y | x, y; x, y"."""
    rows = value
    if isinstance(value, str):
        rows = [row.split(";") for row in value.split("|")]
        require_unit_of_all(re.split("[|;,]", value))
    if not isinstance(rows, list | tuple) or not all(isinstance(row, list | tuple) and len(row) > 1 for row in rows):
        raise ValueError('give rows of two points or more, such as [[[-1, 0], [1, 0]]] or "-1, 0; 1, 0 | 0, -1; 0, 1"')
    return tuple(tuple(pair(quantity("length"))(point) for point in row) for row in rows)


def ratio(value: object) -> float:
    number = read_quantity(value, "number")
    if number <= 1:
        raise ValueError("must be larger than 1, such as 4")
    return number


def numbers(value: object) -> tuple[float, ...]:
    """Plain numbers: [1, 2, 3], or "1, 2, 3"."""
    items = value.split(",") if isinstance(value, str) else value
    if not isinstance(items, list | tuple) or not items:
        raise ValueError("give numbers, such as [0.1, -0.3]")
    return tuple(read_quantity(item, "number") for item in items)


def words(choices: Sequence[str]) -> Callable[[object], tuple[str, ...]]:
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

    return read


def iso_date(value: object) -> str:
    """A day as "2026-11-22"; "" for none; TOML's own dates too."""
    try:
        return date.fromisoformat(str(value)).isoformat() if value != "" else ""
    except ValueError:
        raise ValueError('must be a day; write it as "2026-11-22"') from None


def names(value: object) -> tuple[str, ...]:
    """Names: ["U01", "V03"] or "U01, V03"."""
    items = value.split(",") if isinstance(value, str) and value.strip() else value or []
    if not isinstance(items, list | tuple) or not all(
        isinstance(item, str) and re.fullmatch(r"[\w.-]+", item.strip()) for item in items
    ):
        raise ValueError('give names such as ["U01", "V03"], or "U01, V03"')
    return tuple(dict.fromkeys(item.strip() for item in items))


def file_to_read(value: Any, info: ValidationInfo) -> Any:
    """The path of a file, which whoever loads the case may give or refuse: see `load_case`."""
    return value if info.context is None else info.context(value)


def folder_to_write(value: object, info: ValidationInfo) -> object:
    """As it is, but refused in a case that may read only some files."""
    if info.context is not None:
        raise ValueError("nothing is written for a case from somebody else: leave it out")
    return value


FileToRead = Annotated[str, BeforeValidator(file_to_read)]
FolderToWrite = Annotated[str, BeforeValidator(folder_to_write)]
IsoDate = Annotated[str, BeforeValidator(iso_date)]
Length = Annotated[float, BeforeValidator(positive("length"))]
LengthOrAuto = Annotated[float | Auto, BeforeValidator(or_auto(positive("length")))]
Coordinate = Annotated[float, BeforeValidator(quantity("length"))]
Lengths = Annotated[tuple[float, float], BeforeValidator(pair(positive("length"), one_for_both=True))]
LengthsOrAuto = Annotated[
    tuple[float, float] | Auto, BeforeValidator(or_auto(pair(positive("length"), one_for_both=True)))
]
Size = Annotated[tuple[float, float], BeforeValidator(pair(positive("length")))]
Point = Annotated[tuple[float, float], BeforeValidator(pair(quantity("length")))]
Whole = Annotated[int, BeforeValidator(whole)]
Names = Annotated[tuple[str, ...], BeforeValidator(names)]
Counts = Annotated[tuple[int, int] | Auto, BeforeValidator(counts)]
Polylines = Annotated[tuple[tuple[tuple[float, float], ...], ...], BeforeValidator(polylines)]
Point3 = Annotated[tuple[float, float, float], BeforeValidator(triple("length"))]
Angles = Annotated[tuple[float, float, float], BeforeValidator(triple("angle"))]
Numbers = Annotated[tuple[float, ...], BeforeValidator(numbers)]
Ratio = Annotated[float, BeforeValidator(ratio)]
Factor = Annotated[float, BeforeValidator(positive("number"))]
Unit = Annotated[float, BeforeValidator(unit)]
Stiffness = Annotated[float | Literal["rigid"], BeforeValidator(stiffness)]
Corners = Annotated[Literal[2, 4], BeforeValidator(corners)]
Distance = Annotated[float, BeforeValidator(not_negative("length"))]
Angle = Annotated[float, BeforeValidator(quantity("angle"))]
AngleOrAuto = Annotated[float | Auto, BeforeValidator(or_auto(quantity("angle")))]
PointOrAuto = Annotated[tuple[float, float] | Auto, BeforeValidator(or_auto(pair(quantity("length"))))]
Force = Annotated[float, BeforeValidator(positive("force"))]
SlipMoment = Annotated[float, BeforeValidator(positive("moment"))]
BendingStiffness = Annotated[float, BeforeValidator(positive("bending stiffness"))]
Mass = Annotated[float, BeforeValidator(not_negative("mass"))]
MassPerLength = Annotated[float, BeforeValidator(not_negative("mass per length"))]
InertiaPerLength = Annotated[float, BeforeValidator(not_negative("inertia per length"))]
SectionModulus = Annotated[float, BeforeValidator(positive("section modulus"))]
Stress = Annotated[float, BeforeValidator(positive("stress"))]
Duration = Annotated[float, BeforeValidator(positive("time"))]
NodeStiffness = Annotated[float, BeforeValidator(positive("stiffness"))]
AngleStiffness = Annotated[float, BeforeValidator(positive("rotational stiffness"))]
Share = Annotated[float, BeforeValidator(not_negative("number"))]
Density = Annotated[float, BeforeValidator(positive("density"))]
Acceleration = Annotated[float, BeforeValidator(positive("acceleration"))]
Pressure = Annotated[float, BeforeValidator(not_negative("pressure"))]
MassPerArea = Annotated[float, BeforeValidator(not_negative("mass per area"))]
Forces3 = Annotated[tuple[float, float, float], BeforeValidator(triple("force"))]
ForcePerLength3 = Annotated[tuple[float, float, float], BeforeValidator(triple("force per length"))]
KelvinChange = Annotated[float, BeforeValidator(quantity("temperature"))]
PoissonRatio = Annotated[float, BeforeValidator(poisson_ratio)]
