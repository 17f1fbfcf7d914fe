"""Numbers in words, with their units, and how finely lengths are shown: one rule for drawings, tables and texts."""

import re
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import ceil, floor, isfinite, log10, pi
from typing import Any

from rodshell.errors import InputError
from rodshell.figures.checks import SelfWeight
from rodshell.figures.form import Section
from rodshell.figures.records import Record
from rodshell.results.results import Results
from rodshell.rods.section import SHAPES, size_text
from rodshell.schema import read
from rodshell.units import percent_text, stress_text

FINEST, COARSEST = 1e-3, 1.0  # mm
FORM, CASE = "rodshell form", "case.toml"
FORM_AGAIN = f"{FORM} {CASE}"  # for the folder of a result, which holds this case
OF_ROD = 1e-4  # share of the longest rod to which lengths are shown where no tolerance is given


@dataclass(frozen=True)
class Rounding:
    """Lengths to the next `step` [mm], a power of ten; each from its exact value, never from rounded ones."""

    step: float

    @cached_property
    def digits(self) -> int:
        """Decimals of a length in mm."""
        return max(round(-log10(self.step)), 0)

    def mm(self, metres: float | None) -> str:
        """A length [m] in mm, without its unit and without a minus before a zero; "" where it is not known."""
        if metres is None or not isfinite(metres):
            return ""
        return f"{round(1e3 * float(metres), self.digits) + 0.0:.{self.digits}f}"  # NumPy's numbers round slowly

    @property
    def words(self) -> str:
        return f"{self.step:g} mm"


def rounding_of(results: Results) -> Rounding:
    """The rule for a result: the power of ten not above half of the tolerance, so that rounding takes a quarter of it.

    Where no tolerance is given, the power of ten not above a ten-thousandth of the longest rod.
    """
    tolerance = results.drawings.tolerance if results.drawings else None
    return rounding_to(tolerance, max((rod.length or 0.0 for rod in results.rods), default=0.0))


def rounding_to(tolerance: float | None, longest: float) -> Rounding:
    """The rule of `rounding_of`, by the tolerance of the drawings and the length of the longest rod [m]."""
    asked = 1e3 * OF_ROD * longest if tolerance is None else 0.5 * 1e3 * tolerance
    power = 10.0 ** floor(log10(max(asked, FINEST)) + 1e-9)
    return Rounding(min(max(power, FINEST), COARSEST))


EXACT = Rounding(FINEST)
UNKNOWN = "\N{EN DASH}"
MINUS = "\N{MINUS SIGN}"
UNDER = "under "  # before the smallest length that is shown

CASE_UNITS: dict[str, tuple[float, str]] = {  # factor and unit of a number of the case, by its key
    **dict.fromkeys(
        ("radius", "height", "base", "size", "reference_size", "a", "b", "c", "spacing", "length"), (1e3, "mm")
    ),
    **dict.fromkeys(("edge", "offset", "move", "thickness", "width"), (1e3, "mm")),
    **dict.fromkeys(("EI", "EI1", "EI2", "GJ"), (1.0, "N m\N{SUPERSCRIPT TWO}")),
    **dict.fromkeys(("mass", "mass_per_length"), (1.0, "kg/m")),
    "EA": (1.0, "N"),
    **dict.fromkeys(("youngs_modulus", "shear", "fibre_modulus"), (1e-6, "MPa")),
    "fibre_distances": (1e3, "mm"),
    "torsion_modulus": (1e6, "cm\N{SUPERSCRIPT THREE}"),
    "density": (1.0, "kg/m\N{SUPERSCRIPT THREE}"),
    **dict.fromkeys(("rotate", "turn", "crossing"), (180 / pi, "\N{DEGREE SIGN}")),
}
TURNING = (1.0, "N m/rad")
JOINT_UNITS = {
    "eccentricity": (1e3, "mm"),
    "mass": (1.0, "kg"),
    **dict.fromkeys(("shear", "out_of_plane", "twist"), TURNING),
    "rest_angle": (180 / pi, "\N{DEGREE SIGN}"),
}
NAMES = {
    "youngs_modulus": "Young's modulus",
    "poisson_ratio": "Poisson's ratio",
    "shear": "shear modulus",
    "reference_size": "size, for relative gaps",
}


def rounded(value: float, digits: int = 3) -> str:
    """A number with so many significant digits; a large one in full, never as 1.42e+03."""
    text = f"{value:.{digits}g}"
    return f"{float(text):.0f}" if abs(float(text)) >= 10**digits else text


def rounded_down(value: float) -> str:
    """A limit above 0 that must not be promised too high, such as a load factor: three significant digits, never
    rounded up."""
    step = 10.0 ** (floor(log10(value)) - 2) if value > 0 else 1.0
    return rounded(floor(value / step + 1e-9) * step)


def shown_factor(limit: float | None) -> str:
    """A load factor up to which a shell is stable, or at which it buckles; none was met up to 100."""
    return "over 100" if limit is None else rounded_down(limit)


def millimetres(metres: float | None, digits: int = 3, rounding: Rounding = EXACT) -> str:
    """A length [m] in mm with about `digits` significant digits, no finer than its rounding."""
    if metres is None or not isfinite(metres):
        return UNKNOWN
    value = 1e3 * metres
    if value and abs(value) < rounding.step:
        return f"{UNDER}{rounding.words}"
    whole = len(str(int(abs(value)))) if abs(value) >= 1 else 0
    return f"{value:.{min(max(digits - whole, 0), rounding.digits)}f} mm"


def drawn_length(results: Results, metres: float | None) -> str:
    """A length [m] as fine as on the drawings."""
    return millimetres(metres, rounding=rounding_of(results))


def nice_step(span: float, count: int) -> float:
    """A step of 1, 2 or 5 times a power of ten that divides `span` into `count` parts or a few less."""
    if span <= 0:
        return 1.0
    power = 10.0 ** floor(log10(span / count))
    return next(k * power for k in (1.0, 2.0, 5.0, 10.0) if k * power >= span / count * (1 - 1e-9))


def nice_ticks(low: float, high: float, count: int) -> list[float]:
    """Round numbers from `low` to `high`, `count` + 1 at most."""
    step = nice_step(high - low, count)
    first, last = ceil(low / step - 1e-9), floor(high / step + 1e-9)
    return [k * step for k in range(first, last + 1)]


def percent(share: float | None) -> str:
    """A share as `units.percent_text` shows it; None or not finite: not known."""
    return UNKNOWN if share is None or not isfinite(share) else percent_text(share)


def too_much(share: float) -> str:
    """A share above 1, never shown as 100 %."""
    return f"{max(101, round(100 * share))} %"


def share_of_weight(found: SelfWeight) -> str:
    """How much of its own weight a shell carries."""
    factor = found.load_factor
    if found.limit == "no mass":
        return "unknown: no mass was given"
    if factor is None:
        return "more than 100 times"
    if found.limit == "unstable unloaded":
        return "none: unstable unloaded"
    share = part_of_weight(factor) if factor < 1 else f"{rounded_down(factor)} times"
    return f"at least {share}, unknown above" if found.limit == "not followed" else share


def snow_text(found: float | None) -> str:
    """How much snow a shell carries [Pa], never shown as more."""
    return "10 kN/m2 or more" if found is None else f"{rounded_down(1e-3 * found)} kN/m2"


def part_of_weight(factor: float) -> str:
    """A load factor below 1 as a percentage, never as 100 %."""
    return percent(factor) if factor < 0.995 else f"{rounded_down(100 * factor)} %"


def whole_percent(share: float) -> str:
    """A share of the deployment in whole percents, as warnings and drawings name stages."""
    return f"{100 * share:.0f} %"


def _in(unit: str, factor: float = 1.0) -> Callable[[float], str]:
    """How a number of SI is shown in a unit, of which it is `factor` times as many."""
    return lambda value: f"{rounded(factor * value)}{unit}"


newtons, newton_metres, curvature = _in(" N"), _in(" N m"), _in(" 1/m")
twist_rate = _in("\N{DEGREE SIGN}/m", 180 / pi)
stress = stress_text
seconds, degrees = "{:.2f} s".format, "{:.1f}\N{DEGREE SIGN}".format


def figure(value: float | None, unit: str, rounding: Rounding = EXACT) -> str:
    """A value in an SI unit, in the unit in which texts show it."""
    if value is None:
        return UNKNOWN
    if unit == "m":
        return millimetres(value, rounding=rounding)
    return stress(value) if unit == "Pa" else f"{rounded(value)} {unit}".rstrip()


def small(value: float | None) -> str:
    """A number of which the power of ten matters."""
    return UNKNOWN if value is None else f"{value:.1e}"


def place(point: Sequence[float | None], rounding: Rounding = EXACT) -> str:
    """A point (3,) [m] in mm; a coordinate of None is not known."""
    known = [rounding.mm(x).replace("-", MINUS) for x in point if x is not None]
    return f"{', '.join(known)} mm" if len(known) == 3 else UNKNOWN


def yes_or_no(value: object) -> str:
    return "yes" if value else "no"


def plain(value: object) -> str:
    """A value of which no more is known than that it was recorded."""
    return UNKNOWN if value is None else f"{value:.4g}" if isinstance(value, float) else str(value)


def section_text(section: Section | None) -> str:
    """A rod's section as a supplier calls it: "tube 32 x 3 mm"; where its stiffnesses alone are known, these."""
    keys = section.plain() if section else {}
    shape = SHAPES.get(keys.get("kind", ""))
    try:
        if shape:
            return size_text(read(shape, keys))
    except InputError:  # of an archive that was changed
        pass
    return ", ".join(value if key == "kind" else f"{key} {value}" for key, value in case_rows(section))


def case_rows(table: Record | None, rounding: Rounding = EXACT) -> list[tuple[str, str]]:
    """The entries of a table of the case, in the units of a drawing, files by their names."""
    return [
        (NAMES.get(key, key.replace("_", " ")), _case_value(key, value, CASE_UNITS, rounding))
        for key, value in (table.plain() if table else {}).items()
        if value is not None and key != "unit" and not isinstance(value, dict)  # all is shown in units of its own
    ]


def joint_rows(joint: Record | None) -> list[tuple[str, str]]:
    """The same of the joints, without what they do not have: "pin", eccentricity, mass, stiffnesses."""
    return [
        (key.replace("_", " "), _case_value(key, value, JOINT_UNITS, EXACT))
        for key, value in (joint.plain() if joint else {}).items()
        if value and not isinstance(value, dict)
    ]


def shown_length(results: Results) -> Callable[[float | None], str]:
    """How texts show lengths [m]: to three figures, no finer than on the drawings."""
    rounding = rounding_of(results)

    def shown(metres: float | None) -> str:
        if metres is None:
            return UNKNOWN
        if abs(metres) >= 1.0:
            return f"{rounded(metres)} m"
        return millimetres(metres, rounding=rounding) if abs(metres) >= 1e-9 else "0 mm"

    return shown


def _case_value(key: str, value: Any, units: Mapping[str, tuple[float, str]], rounding: Rounding) -> str:
    if isinstance(value, list | tuple):
        between = ", " if key in ("offset", "move", "turn") else " \N{MULTIPLICATION SIGN} "
        return between.join(_case_value(key, item, units, rounding) for item in value)
    if key in ("file", "boundary"):
        return re.split(r"[/\\]", str(value))[-1]
    if isinstance(value, bool):
        return "yes" if value else "no"
    if not isinstance(value, int | float):
        return str(value)
    factor, unit = units.get(key, (1.0, ""))
    if unit == "MPa" and value >= 1e8:
        factor, unit = 1e-9, "GPa"
    number = factor * value
    if unit == "mm":
        number = round(number, rounding.digits) or number
    shown = rounded(number, 5).replace("-", MINUS)
    return f"{shown}{unit}" if unit == "\N{DEGREE SIGN}" else f"{shown} {unit}".strip()
