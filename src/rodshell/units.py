"""Quantities as people write them, "30 mm", "45 deg", "25 GPa", converted to SI numbers and back.

Only input and messages use this: inside, everything is in SI units.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from decimal import Decimal
from difflib import get_close_matches
from math import floor, fmod, inf, isfinite, log10, tau
from numbers import Real
from typing import Literal

from rodshell.errors import InputError
from rodshell.printed import visible

Kind = Literal[
    "length",
    "angle",
    "stress",
    "density",
    "acceleration",
    "rotational stiffness",
    "force",
    "moment",
    "bending stiffness",
    "section modulus",
    "mass",
    "mass per length",
    "inertia per length",
    "time",
    "stiffness",
    "pressure",
    "mass per area",
    "force per length",
    "temperature",
    "memory",
    "number",
]


@dataclass(frozen=True)
class _Units:
    """One kind of quantity: its name in a sentence, an example, and the SI value of each unit, SI first."""

    name: str
    example: str
    factors: dict[str, Decimal]

    @property
    def si(self) -> str:
        """The SI unit; "" of a plain number."""
        return next(iter(self.factors), "")

    @property
    def wanted(self) -> str:
        return f"{self.name} such as {self.example}" + (f", or a plain number in {self.si}" if self.si else "")


def _factors(*groups: str) -> dict[str, Decimal]:
    """{"mm": 0.001} from "factor spelling spelling"; exact decimals, so that "17 mm" is 0.017 to the bit."""
    rows = (group.split() for group in groups)
    return {spelling: Decimal(factor) for factor, *spellings in rows for spelling in spellings}


LONGEST = 80  # characters of a value in a message
_FULL_TURN = 6.3  # rad, rounded up: a larger plain angle is probably in degrees, its unit forgotten
_DEGREE = Decimal("3.14159265358979323846264338327950288") / 180

_KINDS: dict[Kind, _Units] = {
    "length": _Units(
        "a length",
        '"200 mm"',
        _factors(
            "1 m metre metres meter meters",
            "0.001 mm",
            "0.01 cm",
            "0.1 dm",
            "1000 km",
            "0.000001 um µm μm",
            '0.0254 in inch inches "',
            "0.3048 ft foot feet '",
        ),
    ),
    "angle": _Units("an angle", '"45 deg"', _factors("1 rad", f"{_DEGREE} deg ° degree degrees")),
    "stress": _Units(
        "a stress",
        '"25 GPa"',
        _factors(
            "1 Pa N/m2",
            "1e3 kPa kN/m2",
            "1e6 MPa N/mm2 MN/m2",
            "1e9 GPa kN/mm2 GN/m2",
            "6894.757293168361 psi",
            "6894757.293168361 ksi",
        ),
    ),
    "pressure": _Units(
        "a pressure", '"0.5 kN/m2"', _factors("1 N/m2 Pa", "1e3 kN/m2 kPa", "47.88025898033584 psf lbf/ft2")
    ),
    "mass per area": _Units("a mass per area", '"5 kg/m2"', _factors("1 kg/m2", "0.001 g/m2")),
    "force per length": _Units("a force per length", '"0.8 kN/m"', _factors("1 N/m", "1e3 kN/m N/mm")),
    "temperature": _Units("a change of temperature", '"30 K"', _factors("1 K °C degC C")),
    "time": _Units("a time", '"10 ms"', _factors("1 s second seconds", "0.001 ms", "60 min minutes", "3600 h hours")),
    "stiffness": _Units("a stiffness", '"0.8 N/m"', _factors("1 N/m", "1e3 N/mm kN/m")),
    "density": _Units(
        "a density",
        '"1000 kg/m3"',
        _factors("1 kg/m3", "1000 g/cm3 kg/dm3 t/m3", "16.01846337396014 lb/ft3"),
    ),
    "acceleration": _Units(
        "an acceleration", '"9.81 m/s2"', _factors("1 m/s2", "0.01 cm/s2", "0.001 mm/s2", "0.3048 ft/s2")
    ),
    "rotational stiffness": _Units(
        "a rotational stiffness", '"0.5 N m/rad"', _factors("1 Nm/rad Nm", "1000 kNm/rad kNm", "0.001 Nmm/rad Nmm")
    ),
    "moment": _Units("a moment", '"50 N m"', _factors("1 Nm", "1000 kNm", "0.001 Nmm")),
    "force": _Units("a force", '"5 kN"', _factors("1 N", "1000 kN", "1e6 MN", "4.4482216152605 lbf")),
    "bending stiffness": _Units(
        "a bending stiffness",
        '"2.5 kN m2"',
        _factors("1 Nm2", "1000 kNm2", "1e6 MNm2", "0.000001 Nmm2", "0.001 kNmm2", "1e-4 Ncm2", "0.1 kNcm2"),
    ),
    "section modulus": _Units("a section modulus", '"1.2 cm3"', _factors("1 m3", "0.000001 cm3", "1e-9 mm3")),
    "mass": _Units("a mass", '"1.2 kg"', _factors("1 kg", "0.001 g", "1000 t", "0.45359237 lb")),
    "mass per length": _Units("a mass per length", '"1.2 kg/m"', _factors("1 kg/m", "0.001 g/m", "1 g/mm")),
    "inertia per length": _Units("an inertia per length", '"0.001 kg m"', _factors("1 kgm", "0.001 gm", "0.001 kgmm")),
    "memory": _Units("a size of memory", '"2 GB"', _factors("1 B", "1e6 MB", "1e9 GB", "1073741824 GiB")),
    "number": _Units("a plain number", "0.5", {}),
}

RANGES: dict[str, tuple[float, float]] = {
    "m": (1e-9, 1e6),
    "m3": (1e-27, 1e18),
    "rad": (1e-9, 1e6),
    "s": (1e-12, 1e9),
    "kg": (1e-18, 1e9),
    "kg/m": (1e-18, 1e9),
    "kgm": (1e-30, 1e9),
    "kg/m2": (1e-9, 1e9),
    "kg/m3": (1e-6, 1e12),
    "m/s2": (1e-9, 1e6),
    "N": (1e-18, 1e18),
    "N/m": (1e-12, 1e15),
    "N/m2": (1e-9, 1e12),
    "Nm": (1e-30, 1e18),
    "Nm/rad": (1e-30, 1e18),
    "Nm2": (1e-30, 1e18),
    "Pa": (1.0, 1e15),
    "K": (1e-9, 1e6),
    "B": (1.0, 1e18),
    "": (1e-12, 1e12),
}
"""The least and the most that a size of each SI unit may be, from rods of micrometres to what nobody builds: powers and
quotients of such numbers stay numbers. Only what must be positive has a least size: a coordinate may be 1e-17 m."""

NUMBER = (float, Real)  # floats first: to ask an abstract class takes ten times as long

_QUANTITY = re.compile(r"\s*([+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)\s*(.*?)\s*", re.DOTALL)


def parse_quantity(value: object, kind: Kind, key: str) -> float:
    """Convert a quantity to SI.

    Args:
        value: number in SI, or text such as "30 mm", "1 g/cm3", "1.5e-3" (SI without a unit).
        kind: the expected kind of quantity.
        key: the user's name for the value, for the error message.

    Raises:
        InputError: not a number, not finite, an unknown unit or a unit of another kind.
    """
    try:
        return read_quantity(value, kind)
    except ValueError as reason:
        raise InputError(f"{key} = {shown(value)}: {reason}") from None


def read_quantity(value: object, kind: Kind, *, size: bool = False) -> float:
    """As `parse_quantity`, but raises ValueError with the reason only: the caller adds the key. A `size` is positive.

    An angle of more than a full turn needs a unit, and is reduced to one turn.
    """
    units = _KINDS[kind]
    if isinstance(value, str):
        match = _matched(value)
        if match is None:
            raise ValueError(f"not a finite number; give {units.wanted}")
        number = _scaled(match[1], read_unit(match[2], kind) if match[2] else Decimal(1))
    elif isinstance(value, NUMBER) and not isinstance(value, bool):
        number = as_float(value)
    else:
        raise ValueError(f"not a number; give {units.wanted}")
    if not isfinite(number):
        raise ValueError(f"not finite; give {units.wanted}")
    if size and number <= 0:
        raise ValueError(f"must be larger than zero; give {units.wanted}")
    if allowed := out_of_range(number, units.si, size=size):
        raise ValueError(f"must be {allowed}")
    if kind == "angle" and abs(number) > _FULL_TURN:
        if not _unit_of(value):
            raise ValueError(f'a plain number is in radians, and this is more than a full turn; write "{number:g} deg"')
        number = fmod(number, tau)
    return number


def out_of_range(number: float, unit: str, *, size: bool = False) -> str:
    """What a number in an SI unit may be, where it is something else (see `RANGES`): "at most 1e+06 m"; else "".

    Args:
        size: whether it must be positive, so that it may also be too small.
    """
    least, most = RANGES.get(unit.replace(" ", ""), RANGES[""])
    low = least if size else -most
    if low <= number <= most:
        return ""
    return f"at most {most:g} {unit}".rstrip() if number > most else f"at least {low:g} {unit}".rstrip()


def require_unit_of_all(values: Iterable[object]) -> None:
    """Raise ValueError where only some values of one text have a unit, as in "30, 40 mm"; 0 needs none."""
    texts = [text.strip() for text in values if isinstance(text, str) and _matched(text)]
    bare = [text for text in texts if not _unit_of(text) and float(text) != 0]
    full = [text for text in texts if _unit_of(text)]
    if bare and full:
        unit = _unit_of(full[-1])
        raise ValueError(
            "only some of these have a unit, and a decimal takes a point, not a comma: give each its "
            f'unit, such as "{bare[0]} {unit}, {full[-1]}"'
        )


def _unit_of(value: object) -> str:
    """The unit in a text; empty without one."""
    match = _matched(value)
    return match[2] if match else ""


def _matched(value: object) -> re.Match[str] | None:
    """Number and unit of a text; None of anything else, and of a text longer than any quantity."""
    return _QUANTITY.fullmatch(value) if isinstance(value, str) and len(value) <= LONGEST else None


def read_unit(text: str, kind: Kind) -> Decimal:
    """The SI value of one unit of this kind.

    Raises:
        ValueError: an unknown unit, or a unit of another kind.
    """
    unit = re.sub(r"\s|\^|\*\*", "", text).replace("²", "2").replace("³", "3")
    units = _KINDS[kind]
    if unit in units.factors:
        return units.factors[unit]
    for other in _KINDS.values():
        if unit in other.factors:
            raise ValueError(f"{text} is a unit of {other.name.split(' ', 1)[1]}; give {units.wanted}")
    if not units.factors:
        raise ValueError(f'takes no unit, and "{text}" follows the number; give {units.wanted}')
    near = {name.lower(): name for name in reversed(units.factors)}
    close = _mistyped(unit.lower(), near) or get_close_matches(unit.lower(), near, n=1, cutoff=0.5)
    hint = f" (did you mean {near[close[0]]}?)" if close else ""
    raise ValueError(f'unknown unit "{text}"{hint}; give {units.wanted}')


def _mistyped(unit: str, names: Iterable[str]) -> list[str]:
    """The names from which only one letter differs, and not the first; the most usual one first.

    By shared letters alone "mn" is as near to "m" as to "mm".
    """
    alike = (name for name in reversed(list(names)) if len(name) == len(unit) > 1 and name[0] == unit[0])
    return [name for name in alike if sum(a != b for a, b in zip(name, unit, strict=True)) == 1]


def si_unit(kind: Kind) -> str:
    """The SI unit of a kind as messages show it, such as "N m"; "" of a plain number."""
    return re.sub("^(N|kg)m", r"\1 m", _KINDS[kind].si)


def wanted(kind: Kind) -> str:
    """The input that is accepted for this kind: 'a length such as "200 mm", or a plain number in m'."""
    return _KINDS[kind].wanted


def shown(value: object) -> str:
    """A value as it is written in a case file, on one line of at most 80 characters."""
    text = ""
    for part in _parts(value):
        text += part
        if len(text) > LONGEST:  # the rest, which may be endless, is not looked at
            return text[: LONGEST - 3] + "..."
    return text


def _parts(value: object) -> Iterator[str]:
    """What `shown` shows, piece by piece."""
    if isinstance(value, str):
        yield '"' + visible(value[: LONGEST + 1].replace("\n", " ")) + '"'
    elif isinstance(value, bool):
        yield str(value).lower()
    elif isinstance(value, list | tuple):
        yield "["
        for n, item in enumerate(value):
            yield ", " if n else ""
            yield from _parts(item)
        yield "]"
    elif isinstance(value, dict):
        yield "{ "
        for n, (key, item) in enumerate(value.items()):
            yield f"{', ' if n else ''}{key} = "
            yield from _parts(item)
        yield " }"
    else:
        try:
            yield str(value).replace("\n", " ")
        except ValueError:  # Python writes no integer of more than 4,300 digits
            yield "a number of thousands of digits"


def rounded_down(length: float) -> float:
    """Round a length [m] down to 1, 1.5, 2, 3, 5 or 7 times a power of ten."""
    decade = 10.0 ** floor(log10(length))
    return max(decade * step for step in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if decade * step <= length * (1 + 1e-9))


def length_text(metres: float) -> str:
    """A length [m] as text, in mm or m: 83.3 mm, 20 m."""
    in_mm = metres < 0.9995
    return f"{float(f'{1e3 * metres if in_mm else metres:.3g}'):g} {'mm' if in_mm else 'm'}"


DRAWN_IN = {"m": 1.0, "mm": 1e-3, "cm": 0.01, "in": 0.0254, "ft": 0.3048}  # units of files [m]
BUILT = (2.0, 200.0)  # m: widths of shells that people walk under


def as_built(width: float, unit: float) -> dict[str, float]:
    """Units of a file by which a width [m] that was read in `unit` [m] would be that of a building; and that width."""
    if BUILT[0] <= width <= BUILT[1]:
        return {}
    widths = {name: width / unit * length for name, length in DRAWN_IN.items()}
    return {name: wide for name, wide in widths.items() if BUILT[0] <= wide <= BUILT[1]}


PRESSURES = ((1e9, "GPa"), (1e6, "MPa"), (1e3, "kPa"), (1.0, "Pa"))


def stress_text(pascals: float) -> str:
    """A stress [Pa] as text, in a unit of a suitable size: 14.4 MPa, 83 kPa."""
    size, name = next((unit for unit in PRESSURES if abs(pascals) >= unit[0]), PRESSURES[-1])
    return f"{float(f'{pascals / size:.3g}'):g} {name}"


def percent_text(share: float) -> str:
    """A share as a percentage with two significant digits, above 100 % in whole percents."""
    if abs(share) < 1e-9:
        return "0 %"
    return f"{100 * share:.2g} %" if abs(share) < 0.995 else f"{100 * share:.0f} %"


def point_text(point: Iterable[float]) -> str:
    """A point by its coordinates [m]: "(0.1, 0.25, -0.03) m"."""
    return f"({', '.join(f'{x:.4g}' for x in point)}) m"


FEW = 4  # places that are named one by one


def places_text(shares: Sequence[float]) -> str:
    """Where something happens on a way, by its shares: "at 20 % and 34 %", or "7 times from 20 % to 94 %"."""
    words = [f"{min(100 * share, 99):.0f} %" for share in shares]  # at 100 % it would be behind
    if len(words) > FEW:
        return f"{len(words)} times from {words[0]} to {words[-1]}"
    return f"at {' and '.join(filter(None, [', '.join(words[:-1]), words[-1]]))}"


def as_float(value: float | Real) -> float:
    """`value` as a float; infinite where it is too large for one."""
    try:
        return float(value)
    except OverflowError:  # an integer larger than any float
        return inf


def _scaled(number: str, factor: Decimal) -> float:
    """number * factor, rounded once; infinite where it is too large for a float."""
    try:
        return float(Decimal(number) * factor)
    except ArithmeticError:
        return inf
