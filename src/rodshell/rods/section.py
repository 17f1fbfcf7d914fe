"""Cross-sections of a rod, the sizes in trade, and the stiffnesses that follow from a section and a material.

A section has two axes, those of the material directors m1 and m2. The second moments (I1, I2) resist bends
*towards* m1 and m2: I1 is the integral of the square of the coordinate along m1.

`section_from` and `section_keys` read a section as a supplier calls it, and `size_text` writes it: "tube 32 x 3 mm".
"""

import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from math import pi, tanh
from typing import Annotated, ClassVar

from rodshell.errors import InputError
from rodshell.quantities import (
    BendingStiffness,
    Force,
    InertiaPerLength,
    Length,
    Lengths,
    MassPerLength,
    SectionModulus,
    Stress,
    Value,
)
from rodshell.rods.materials import Material as Material
from rodshell.rods.materials import PresetName
from rodshell.schema import Table, Twice, checked, read, value_of, written
from rodshell.units import length_text, read_quantity
from rodshell.validation import brief, instance


class _Shape:
    """What follows from a section's outline: an ellipse, or else a box."""

    boxed: ClassVar = False
    shear_peak: ClassVar[float | None] = 4.0 / 3.0  # largest shear stress of a shear force over its mean; None: unknown

    @property
    def half_widths(self) -> tuple[float, float] | None:
        """Half the outline's width along m1 and along m2 [m]; None: unknown."""
        raise NotImplementedError

    @property
    def round(self) -> bool:
        """Whether the outline is a circle."""
        half = self.half_widths
        return half is not None and not self.boxed and half[0] == half[1]

    @property
    def depth(self) -> float:
        """The larger width [m]; 0: unknown."""
        return 2 * max(self.half_widths or (0.0,))

    def hole(self, diameter: float) -> tuple[float, float]:
        """Area [m2] and second moment against bends towards m1 [m4] that a hole along m1 takes away."""
        depth = 2 * (self.half_widths or (0.0,))[0]
        return diameter * depth, diameter * depth**3 / 12


class _Round(_Shape):
    """A circle, solid or with a hole, whose second moment of area is the same about every diameter."""

    round = True
    radius: float

    @property
    def outer_radius(self) -> float:
        """[m]"""
        return self.radius

    @property
    def inner_radius(self) -> float:
        """[m]"""
        return 0.0

    @property
    def area(self) -> float:
        """[m2]"""
        return pi * (self.radius**2 - self.inner_radius**2)

    @property
    def second_moment(self) -> float:
        """Second moment of area about any diameter [m4]."""
        return pi * (self.radius**4 - self.inner_radius**4) / 4

    @property
    def second_moments(self) -> tuple[float, float]:
        """(I1, I2) [m4]"""
        return self.second_moment, self.second_moment

    @property
    def torsion_constant(self) -> float:
        """J [m4]: of circles and tubes the polar second moment of area."""
        return 2 * self.second_moment

    @property
    def half_widths(self) -> tuple[float, float]:
        return self.outer_radius, self.outer_radius


@dataclass(frozen=True)
class Circle(_Round):
    """Solid circular section."""

    kind: ClassVar = "circle"
    radius: Annotated[Length, Twice("diameter"), "radius (of a tube: outer)"]

    def __post_init__(self) -> None:
        checked(self, "section {}")


@dataclass(frozen=True)
class Tube(_Round):
    """Circular tube, whose wall is not thicker than its radius."""

    kind: ClassVar = "tube"
    shear_peak: ClassVar = 2.0
    radius: Annotated[Length, Twice("diameter"), "outer radius"]
    thickness: Annotated[Length, "thickness of the tube's wall"]

    def __post_init__(self) -> None:
        checked(self, "section {}")
        if self.thickness > self.radius:
            raise InputError(
                f"a tube's wall of {length_text(self.thickness)} is thicker than half of its diameter, "
                f'{length_text(2 * self.radius)}: give the diameter and then the wall, such as "tube 32x3"'
            )

    @property
    def inner_radius(self) -> float:
        """[m]"""
        return self.radius - self.thickness

    def hole(self, diameter: float) -> tuple[float, float]:
        """As of every section, through both walls."""
        return 2 * diameter * self.thickness, 2 * diameter * (self.radius**3 - self.inner_radius**3) / 3


@dataclass(frozen=True)
class Ellipse(_Shape):
    """Solid ellipse with half-axes along m1 and m2."""

    kind: ClassVar = "ellipse"
    a: Annotated[Length, "half-axis along the grid's normal"]
    b: Annotated[Length, "half-axis within the grid"]

    def __post_init__(self) -> None:
        checked(self, "half-axis {}")

    @property
    def area(self) -> float:
        """[m2]"""
        return pi * self.a * self.b

    @property
    def second_moments(self) -> tuple[float, float]:
        """(I1, I2) [m4]"""
        return pi * self.a**3 * self.b / 4, pi * self.a * self.b**3 / 4

    @property
    def torsion_constant(self) -> float:
        """J [m4] by Saint-Venant, exact."""
        return pi * (self.a * self.b) ** 3 / (self.a**2 + self.b**2)

    @property
    def half_widths(self) -> tuple[float, float]:
        return self.a, self.b


@dataclass(frozen=True)
class RectangularSection(_Shape):
    """Solid rectangle with sides along m1 and m2. (`rodshell.Rectangle` is a target's domain.)"""

    kind: ClassVar = "rectangle"
    boxed: ClassVar = True
    shear_peak: ClassVar = 1.5
    width: Annotated[Length, "side along the grid's normal: of a flat lath its thickness"]
    height: Annotated[Length, "side within the grid: of a flat lath its breadth"]

    def __post_init__(self) -> None:
        checked(self, "section {}")

    @property
    def area(self) -> float:
        """[m2]"""
        return self.width * self.height

    @property
    def second_moments(self) -> tuple[float, float]:
        """(I1, I2) [m4]"""
        return self.width**3 * self.height / 12, self.width * self.height**3 / 12

    @property
    def torsion_constant(self) -> float:
        """J [m4] by Saint-Venant's series [Timoshenko and Goodier, section 109]."""
        thin, wide = sorted((self.width, self.height))
        # the terms fall as n^-5: 25 of them leave 1e-9 of the sum
        series = sum(tanh(n * pi * wide / (2 * thin)) / n**5 for n in range(1, 50, 2))
        return wide * thin**3 * (1 / 3 - 64 / pi**5 * thin / wide * series)

    @property
    def half_widths(self) -> tuple[float, float]:
        return 0.5 * self.width, 0.5 * self.height


@dataclass(frozen=True)
class GivenSection(_Shape):
    """Stiffnesses and masses as they are, of a composite or a measured rod; such a rod takes no material.

    EI1 and EI2 are against bends towards m1 and m2. The rotary inertia is needed only for dynamics with twist. With the
    fibres' distances along m1 and m2 and their modulus the stress is known, which a check of strength needs; of twisted
    rods also with the torsion modulus.
    """

    kind: ClassVar = "given"
    boxed: ClassVar = True
    shear_peak: ClassVar = None
    EA: Annotated[Force, "axial stiffness"]
    EI1: Annotated[BendingStiffness, "bending stiffness out of the grid"]
    EI2: Annotated[BendingStiffness, "bending stiffness within the grid"]
    GJ: Annotated[BendingStiffness, "torsional stiffness"]
    mass: Annotated[MassPerLength, "mass per length"] = 0.0
    rotary_inertia: Annotated[InertiaPerLength, "rotary inertia about the rod's axis, per length"] = 0.0
    fibre_distances: Annotated[
        Lengths | None, "distances of the outermost fibres, across the grid and within it"
    ] = None  # fmt: skip
    fibre_modulus: Annotated[Stress | None, "Young's modulus of the outermost fibres"] = None
    torsion_modulus: Annotated[
        SectionModulus | None, "torsional section modulus: torque over the largest shear stress"
    ] = None  # fmt: skip

    __repr__ = brief

    def __post_init__(self) -> None:
        checked(self)

    @property
    def half_widths(self) -> tuple[float, float] | None:
        """Of the box that its fibre distances span."""
        return self.fibre_distances


Sized = Ellipse | RectangularSection
Section = Circle | Tube | Sized
SECTIONS = "a circle, tube, ellipse, rectangular or given section"


# In words

_MEASURES = {
    "rod": ("rod 12", "the diameter"),
    "tube": ("tube 32x3", "the outer diameter and the wall"),
    "lath": ("lath 12x40", "the thickness and the breadth"),
    "strip": ("strip 2x40", "the thickness and the height"),
    "ellipse": ("ellipse 20x30", "the width across the grid and that within it"),
}
"""What sections are called: an example, and the measures that follow the name."""


def section_keys(words: object) -> Table:
    """The keys of a section in words, in SI; measures are in mm unless a unit is written.

    Raises:
        ValueError: it is not understood; with the reason.
    """
    name, given = next(iter(re.findall(r"^\s*([a-z]+)\s*(.*)", str(words), re.I)), ("", ""))
    example, measures = _MEASURES.get(name.lower(), ("", ""))
    if not example:
        known = ", ".join(f'"{known}"' for known, _ in _MEASURES.values())
        raise ValueError(f"give a section with its measures in mm, such as {known}")
    parts = [part.strip() for part in re.split("[x\N{MULTIPLICATION SIGN}]", given)]
    wanted = f'after "{name}" comes {measures}, in mm unless a unit is written: "{example}"'
    if len(parts) != example.count("x") + 1 or not all(parts):
        raise ValueError(wanted)
    unit = parts[-1].lstrip("+-.0123456789e ") or "mm"  # also of those before that have none
    sizes = [f"{part} {unit}" if part[-1] in ".0123456789" else part for part in parts]
    try:
        first, second = (read_quantity(size, "length", size=True) for size in (*sizes, sizes[-1])[:2])
    except ValueError as reason:
        raise ValueError(f"{str(reason).partition(';')[0]}; {wanted}") from None
    thin, wide = sorted((first, second))
    keys: Table = {"kind": RectangularSection.kind, "width": wide, "height": thin}
    match name.lower():
        case "rod":
            keys = {"kind": Circle.kind, "radius": first / 2}
        case "tube":
            keys = {"kind": Tube.kind, "radius": first / 2, "thickness": second}
        case "ellipse":
            keys = {"kind": Ellipse.kind, "a": first / 2, "b": second / 2}
        case "lath":
            keys = {"kind": RectangularSection.kind, "width": thin, "height": wide}
    try:
        read(SHAPES[keys["kind"]], keys)
    except InputError as reason:  # such as a wall that has no room in its tube
        raise ValueError(str(reason)) from None
    return keys


IN_WORDS = Value(section_keys)
"""Mark of a section that words may stand for."""
SHAPES: dict[str, type[Section]] = {shape.kind: shape for shape in (Circle, Tube, Ellipse, RectangularSection)}
SectionKeys = Annotated[Table, IN_WORDS]
SECTION_HELP = 'in words, in mm: "rod 12", "tube 32x3", "lath 12x40", "strip 2x40"'


def section_from(words: str) -> Section:
    """A section as a supplier calls it, in mm unless a unit is written: "rod 12", "tube 32x3", "lath 12x40" (it lies
    flat), "strip 2x40" (it stands upright), "ellipse 20x30" (across the grid, within it).

    Raises:
        InputError: it is not understood, or there is no such section.
    """
    keys = value_of(SectionKeys, "section", words)
    return read(SHAPES[keys["kind"]], keys)


def size_text(section: Section) -> str:
    """A section in the words that `section_from` reads: "tube 32 x 3 mm"."""
    if isinstance(section, RectangularSection):
        name, measures = "lath", (section.width, section.height)
        if section.width > section.height:
            name, measures = "strip", (section.height, section.width)
    elif isinstance(section, Ellipse):
        name, measures = "ellipse", (2 * section.a, 2 * section.b)
    elif isinstance(section, Tube):
        name, measures = "tube", (2 * section.radius, section.thickness)
    else:
        return f"rod {2e3 * section.radius:g} mm"
    return f"{name} {' x '.join(f'{1e3 * measure:g}' for measure in measures)} mm"


@dataclass(frozen=True)
class Rod:
    """One kind of rod; its section and material give the stiffnesses of HQK Eq 1.

    Args:
        section: its cross-section. A `GivenSection` has the stiffnesses itself.
        material: what it is made of; None only with a `GivenSection`.

    Raises:
        InputError: section or material are something else, or exclude each other.
    """

    section: Annotated[Section | GivenSection, IN_WORDS, SECTION_HELP]
    material: Material | None = None

    __repr__ = brief

    @classmethod
    def completed(cls, given: Table, path: str) -> Table:
        """As it is, with a material or a section that needs none."""
        section = given.get("section")
        if isinstance(section, Mapping) and section.get("kind") != GivenSection.kind and not given.get("material"):
            raise InputError(f"{path}.material is missing: give the material")
        return given

    def __post_init__(self) -> None:
        instance("section", self.section, Section | GivenSection, SECTIONS)
        if self.material is not None:
            instance("material", self.material, Material)
        if isinstance(self.section, GivenSection):
            if self.material is not None:
                raise InputError("a given section has all stiffnesses and masses itself: leave the material out")
        elif self.material is None:
            raise InputError(f"a rod of section {type(self.section).__name__} needs a material")

    @cached_property
    def stretch_stiffness(self) -> float:
        """EA [N]"""
        if isinstance(self.section, GivenSection):
            return self.section.EA
        return self._material.youngs_modulus * self.section.area

    @cached_property
    def bend_stiffnesses(self) -> tuple[float, float]:
        """(EI1, EI2) against bends towards m1 and m2 [N m2]."""
        if isinstance(self.section, GivenSection):
            return self.section.EI1, self.section.EI2
        i1, i2 = self.section.second_moments
        return self._material.youngs_modulus * i1, self._material.youngs_modulus * i2

    @cached_property
    def bend_stiffness(self) -> float:
        """EI [N m2] of a rod with the same bending stiffness in all directions.

        Raises:
            InputError: it has two.
        """
        first, second = self.bend_stiffnesses
        if first != second:
            raise InputError(
                f"this rod has two bending stiffnesses, {first:g} and {second:g} N m2: use bend_stiffnesses"
            )
        return first

    @cached_property
    def twist_stiffness(self) -> float:
        """GJ [N m2]"""
        if isinstance(self.section, GivenSection):
            return self.section.GJ
        return self._material.shear_modulus * self.section.torsion_constant

    @cached_property
    def mass_per_length(self) -> float:
        """[kg/m]"""
        if isinstance(self.section, GivenSection):
            return self.section.mass
        return self._material.density * self.section.area

    @cached_property
    def rotary_inertia(self) -> float:
        """About the tangent, per length [kg m]: density times the polar second moment of area."""
        if isinstance(self.section, GivenSection):
            return self.section.rotary_inertia
        return self._material.density * sum(self.section.second_moments)

    @property
    def _material(self) -> Material:
        assert self.material is not None
        return self.material

    def parameters(self) -> dict[str, dict[str, object]]:
        """Section and material in SI, as they stand in a case file."""
        return written(self)


def scaled(section: Section, factor: float) -> Section:
    """The same shape of section with all its lengths times `factor` [-]."""
    return type(section)(**{key: factor * value for key, value in vars(section).items()})


# Sizes in trade


def _rods(*diameters: float) -> tuple[Section, ...]:
    return tuple(Circle(d / 2e3) for d in diameters)


def _tubes(*sizes: tuple[float, float]) -> tuple[Section, ...]:
    """Outer diameter and wall [mm]."""
    return tuple(Tube(round(d / 2e3, 9), wall / 1e3) for d, wall in sizes)


def _laths(*sizes: tuple[float, float]) -> tuple[Section, ...]:
    """Thickness and breadth [mm] of laths that lie flat."""
    return tuple(RectangularSection(width=thickness / 1e3, height=breadth / 1e3) for thickness, breadth in sizes)


_TIMBER = _laths(
    (3, 10), (5, 15), (8, 20), (10, 30), (12, 30), (15, 40), (20, 40), (24, 48), (30, 50), (40, 60), (50, 80)
)

TRADE_SIZES: dict[PresetName, tuple[Section, ...]] = {
    "larch": _TIMBER,
    "spruce": _TIMBER,
    "oak": _TIMBER,
    "glulam": _laths((40, 60), (60, 80), (60, 100), (80, 100), (80, 120)),
    "bamboo": _tubes((15, 2), (20, 3), (30, 4), (40, 5), (60, 6), (80, 8), (100, 10)),  # walls of about a tenth
    "gfrp": (
        *_rods(1, 1.5, 2, 3, 4, 5, 6, 8, 10, 12),
        *_tubes((16, 2.5), (20, 2.5), (25, 3), (32, 3), (38, 3.5), (42, 3.5), (50, 4), (60, 5), (76, 6), (90, 6)),
    ),
    "plywood": _laths((4, 20), (6.5, 25), (9, 30), (12, 40), (15, 50), (18, 50), (21, 60), (24, 70)),
    "petg": _rods(1.75, 2.85, 4, 5, 6, 8, 10, 12, 15, 20),  # the first two are printers' filament
    "steel": (  # EN 10219-2
        *_tubes((21.3, 2), (26.9, 2.5), (33.7, 3), (42.4, 3), (48.3, 3), (60.3, 3), (76.1, 3), (88.9, 4), (101.6, 4)),
        *_tubes((114.3, 4), (139.7, 5), (168.3, 5)),
    ),
    "spring-steel": _rods(0.3, 0.4, 0.5, 0.6, 0.8, 1, 1.2, 1.5, 2, 2.5, 3),
    "rubber": (),
}
"""Sections in which each preset material is usually sold, thin ones first; what a supplier has may differ."""
