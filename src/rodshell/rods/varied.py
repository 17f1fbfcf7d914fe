"""What follows from a factor on a rod's bending stiffness: its other stiffnesses, its mass and its fibre distances.

A section that changes along a rod keeps its shape and its material. Which of its lengths change is said by one word
(`layout.profile.Varies`); with f the factor on EI1, the stiffness against bends out of the grid:

    size         all lengths as f^(1/4): EI2 and GJ as f, EA and mass as f^(1/2)
    width, a     the length along m1, out of the grid, as f^(1/3): EA, mass and EI2 likewise
    height, b    the length along m2, within the grid, as f: EA and mass likewise, EI2 as f^3
    laths        f equal laths that slip on each other: all as f, fibre distances as of one

GJ of a rectangle and of an ellipse is that of the changed section.
"""

from dataclasses import dataclass

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.rods.section import Ellipse, GivenSection, RectangularSection, Rod

TERMS = np.arange(1, 16, 2)  # of the series of a rectangle's torsion constant, which fall as n^-5: 1e-6 of the sum
_OUT_OF_GRID = ("width", "a")


@dataclass(frozen=True, eq=False)
class Varied:
    """Factors (n,) on the values of the unchanged rod.

    Args:
        bend1, bend2, twist: on EI1, EI2 and GJ.
        stretch: on EA and on the mass per length.
        fibre1, fibre2: on the distances of the outermost fibres along m1 and m2.
        depth1, depth2: on the extents of the outline along m1 and m2: of laths on each other those of all.
        shear: on the largest shear stress of torsion over the twist per length.
    """

    bend1: Floats
    bend2: Floats
    twist: Floats
    stretch: Floats
    rotary: Floats
    fibre1: Floats
    fibre2: Floats
    depth1: Floats
    depth2: Floats
    shear: Floats


def varied(rod: Rod, varies: str, factors: Floats) -> Varied:
    """Everything that changes with the factor on EI1.

    Args:
        rod: the unchanged section and material.
        varies: what is changed, see the module.
        factors: (n,) on EI1 [-].

    Raises:
        InputError: the section has no such length.
    """
    _require_varies(rod, varies)
    same = np.ones_like(factors)
    if varies == "laths":
        return Varied(factors, factors, factors, factors, factors, same, same, factors, same, same)
    if varies == "size":
        half, quarter = np.sqrt(factors), np.sqrt(np.sqrt(factors))
        return Varied(factors, factors, factors, half, factors, quarter, quarter, quarter, quarter, quarter)
    first, second = (np.cbrt(factors), same) if varies in _OUT_OF_GRID else (same, factors)
    area, bend1, bend2 = first * second, first**3 * second, first * second**3
    section = rod.section
    if isinstance(section, Ellipse):
        i1, i2 = section.second_moments
        a, b = section.a * first, section.b * second
        twist = (a * b) ** 3 / (a**2 + b**2) / ((section.a * section.b) ** 3 / (section.a**2 + section.b**2))
        lever = 2 * a * b * np.maximum(a, b) / (a**2 + b**2)
        unchanged = np.asarray(2 * section.a * section.b * max(section.a, section.b) / (section.a**2 + section.b**2))
    else:
        assert isinstance(section, RectangularSection)
        i1, i2 = section.second_moments
        sides = section.width * first, section.height * second
        (constant, lever), (of_one, unchanged) = _rectangle(*sides), _rectangle(section.width, section.height)
        twist = constant / of_one
    rotary = (i1 * bend1 + i2 * bend2) / (i1 + i2)
    return Varied(bend1, bend2, twist, area, rotary, first, second, first, second, lever / unchanged)


def _require_varies(rod: Rod, varies: str) -> None:
    """Refuse a length that a rod's section does not have."""
    known = _lengths(rod)
    if varies not in known:
        raise InputError(
            f"a {type(rod.section).__name__} has no {varies} that could vary along a rod: choose {' or '.join(known)}"
        )


def sizes(rod: Rod, varies: str, factors: Floats) -> Floats | None:
    """(n,) the length of the section that is changed, as it is cut: of a round rod its diameter [m].

    None for a given section, which has no lengths, and for laths. Parameters as of `varied`.
    """
    section = rod.section
    if isinstance(section, GivenSection) or varies == "laths":
        return None
    if varies == "size":
        return np.asarray(section.depth * np.sqrt(np.sqrt(factors)))
    change = np.cbrt(factors) if varies in _OUT_OF_GRID else factors
    whole = 2.0 if isinstance(section, Ellipse) else 1.0
    return np.asarray(whole * getattr(section, varies) * change)


def _lengths(rod: Rod) -> tuple[str, ...]:
    """What can vary along a rod of this section."""
    if isinstance(rod.section, RectangularSection):
        return ("size", "width", "height", "laths")
    return ("size", "a", "b", "laths") if isinstance(rod.section, Ellipse) else ("size", "laths")


def _rectangle(width: Floats | float, height: Floats | float) -> tuple[Floats, Floats]:
    """Torsion constant [m4], and the largest shear stress of torsion over G theta' [m], in the middle of a long side
    [Timoshenko and Goodier, section 109]."""
    thin, wide = np.minimum(width, height), np.maximum(width, height)
    n = TERMS * np.pi / 2 * np.asarray(wide / thin)[..., None]
    series = (np.tanh(n) / TERMS**5).sum(axis=-1)
    constant = wide * thin**3 * (1 / 3 - 64 / np.pi**5 * thin / wide * series)
    lever = thin * (1 - 8 / np.pi**2 * (1 / (TERMS**2 * np.cosh(np.minimum(n, 300.0)))).sum(axis=-1))
    return np.asarray(constant), np.asarray(lever)
