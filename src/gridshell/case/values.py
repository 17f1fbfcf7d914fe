"""The types of single values in a case file. A reader raises ValueError with the reason, without the key."""

import re
from collections.abc import Callable
from typing import Annotated, Literal

from pydantic import BeforeValidator

from gridshell.units import Kind, read_quantity, wanted

Auto = Literal["auto"]
Reader = Callable[[object], float]


def quantity(kind: Kind) -> Reader:
    return lambda value: read_quantity(value, kind)


def positive(kind: Kind) -> Reader:
    def read(value: object) -> float:
        number = read_quantity(value, kind)
        if number <= 0:
            raise ValueError(f"must be larger than zero; give {wanted(kind)}")
        return number

    return read


def or_auto(reader: Reader) -> Callable[[object], float | str]:
    def read(value: object) -> float | str:
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
        items = value.split(",") if isinstance(value, str) else value
        if not isinstance(items, list | tuple):
            items = [items]
        if len(items) == 1 and one_for_both:
            return reader(items[0]), reader(items[0])
        if len(items) != 2:
            needs = "one or two values" if one_for_both else "two values"
            raise ValueError(f'needs {needs}, such as ["30 mm", "40 mm"] or "30 mm, 40 mm"')
        return _named("first", reader, items[0]), _named("second", reader, items[1])

    return read


def _named(which: str, reader: Reader, item: object) -> float:
    try:
        return reader(item)
    except ValueError as reason:
        raise ValueError(f"{which} value: {reason}") from None


def counts(value: object) -> tuple[int, int] | str:
    """Numbers of rods: [17, 17], "17x17", "17,17" or "auto"."""
    if is_auto(value):
        return "auto"
    items = value
    if isinstance(value, str):
        items = [int(n) if n.strip().isdecimal() else n for n in re.split("[x×,]", value)]
    if isinstance(items, list | tuple) and len(items) == 2 and all(type(n) is int and n >= 2 for n in items):
        return items[0], items[1]
    raise ValueError('give two counts of at least 2, such as [17, 17] or "17x17", or "auto"')


def is_auto(value: object) -> bool:
    return isinstance(value, str) and value.strip() == "auto"


def poisson_ratio(value: object) -> float:
    number = read_quantity(value, "number")
    if not -1 < number <= 0.5:
        raise ValueError("must lie above -1 and not above 0.5; give 0.5 for an incompressible material")
    return number


Length = Annotated[float, BeforeValidator(positive("length"))]
LengthOrAuto = Annotated[float | Auto, BeforeValidator(or_auto(positive("length")))]
Coordinate = Annotated[float, BeforeValidator(quantity("length"))]
Lengths = Annotated[tuple[float, float], BeforeValidator(pair(positive("length"), one_for_both=True))]
Size = Annotated[tuple[float, float], BeforeValidator(pair(positive("length")))]
Point = Annotated[tuple[float, float], BeforeValidator(pair(quantity("length")))]
Counts = Annotated[tuple[int, int] | Auto, BeforeValidator(counts)]
Angle = Annotated[float, BeforeValidator(quantity("angle"))]
Stress = Annotated[float, BeforeValidator(positive("stress"))]
Density = Annotated[float, BeforeValidator(positive("density"))]
Acceleration = Annotated[float, BeforeValidator(positive("acceleration"))]
PoissonRatio = Annotated[float, BeforeValidator(poisson_ratio)]
