"""Cross-sections of a rod, and the stiffnesses that follow from one and a material.

A section has two axes, those of the material directors m1 and m2. The second moments (I1, I2) resist bends
*towards* m1 and m2: I1 is the integral of the square of the coordinate along m1.
"""

from dataclasses import asdict, dataclass
from functools import cached_property
from math import inf, pi, tanh

from rodshell.errors import InputError
from rodshell.rods.materials import Material as Material
from rodshell.validation import instance, positive


class _Round:
    """Second moments of a section with one for all diameters."""

    @property
    def second_moment(self) -> float:
        raise NotImplementedError

    @property
    def second_moments(self) -> tuple[float, float]:
        """(I1, I2) [m4]"""
        return self.second_moment, self.second_moment

    @property
    def torsion_constant(self) -> float:
        """J [m4]: of circles and tubes the polar second moment of area."""
        return 2 * self.second_moment


@dataclass(frozen=True)
class Circle(_Round):
    """Solid circular section of the given `radius` [m]."""

    radius: float

    def __post_init__(self) -> None:
        positive("section radius", self.radius, "m")

    @property
    def outer_radius(self) -> float:
        return self.radius

    @property
    def area(self) -> float:
        """[m2]"""
        return pi * self.radius**2

    @property
    def second_moment(self) -> float:
        """Second moment of area about any diameter [m4]."""
        return pi * self.radius**4 / 4

    def parameters(self) -> dict[str, object]:
        """The section's kind and numbers in SI, as they stand in a case file."""
        return {"kind": "circle", "radius": self.radius}


@dataclass(frozen=True)
class Tube(_Round):
    """Circular tube: outer `radius` and wall `thickness` [m]."""

    radius: float
    thickness: float

    def __post_init__(self) -> None:
        positive("section radius", self.radius, "m")
        positive("section thickness", self.thickness, "m")
        if self.thickness > self.radius:
            raise InputError(f"tube thickness {self.thickness} m is larger than its radius {self.radius} m")

    @property
    def outer_radius(self) -> float:
        return self.radius

    @property
    def inner_radius(self) -> float:
        return self.radius - self.thickness

    @property
    def area(self) -> float:
        """[m2]"""
        return pi * (self.radius**2 - self.inner_radius**2)

    @property
    def second_moment(self) -> float:
        """Second moment of area about any diameter [m4]."""
        return pi * (self.radius**4 - self.inner_radius**4) / 4

    def parameters(self) -> dict[str, object]:
        """The section's kind and numbers in SI, as they stand in a case file."""
        return {"kind": "tube", "radius": self.radius, "thickness": self.thickness}


@dataclass(frozen=True)
class Ellipse:
    """Solid ellipse with half-axes `a` along m1 and `b` along m2 [m]."""

    a: float
    b: float

    def __post_init__(self) -> None:
        positive("half-axis a", self.a, "m")
        positive("half-axis b", self.b, "m")

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

    def parameters(self) -> dict[str, object]:
        """The section's kind and numbers in SI, as they stand in a case file."""
        return {"kind": "ellipse", "a": self.a, "b": self.b}


@dataclass(frozen=True)
class RectangularSection:
    """Solid rectangle: `width` along m1, `height` along m2 [m]. (`rodshell.Rectangle` is a target's domain.)"""

    width: float
    height: float

    def __post_init__(self) -> None:
        positive("section width", self.width, "m")
        positive("section height", self.height, "m")

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

    def parameters(self) -> dict[str, object]:
        """The section's kind and numbers in SI, as they stand in a case file."""
        return {"kind": "rectangle", "width": self.width, "height": self.height}


@dataclass(frozen=True)
class GivenSection:
    """Stiffnesses and masses as they are, of a composite or a measured rod; such a rod takes no material.

    Parameters
    ----------
    EA : stretch stiffness [N].
    EI1, EI2 : stiffnesses against bends towards m1 and m2 [N m2].
    GJ : twist stiffness [N m2].
    mass : per length [kg/m].
    rotary_inertia : about the tangent, per length [kg m]; wanted by dynamics with twist only.
    fibre_distances : of the outermost fibres from the axis, along m1 and m2 [m]. With this and the next two its stress
        is known, which a strength needs.
    fibre_modulus : Young's modulus of the outermost fibres [Pa].
    torsion_modulus : twisting moment over the largest shear stress that it causes [m3]; of rods that are twisted.
    """

    EA: float
    EI1: float
    EI2: float
    GJ: float
    mass: float = 0.0
    rotary_inertia: float = 0.0
    fibre_distances: tuple[float, float] | None = None
    fibre_modulus: float | None = None
    torsion_modulus: float | None = None

    def __post_init__(self) -> None:
        for name, unit in (("EA", "N"), ("EI1", "N m2"), ("EI2", "N m2"), ("GJ", "N m2")):
            positive(name, getattr(self, name), unit)
        for distance in self.fibre_distances or ():
            positive("fibre distance", distance, "m")
        for name, unit in (("fibre_modulus", "Pa"), ("torsion_modulus", "m3")):
            if getattr(self, name) is not None:
                positive(name, getattr(self, name), unit)
        for name, unit in (("mass", "kg/m"), ("rotary_inertia", "kg m")):
            if not 0 <= getattr(self, name) < inf:
                raise InputError(f"{name} must not be negative, but is {getattr(self, name)} {unit}")

    def parameters(self) -> dict[str, object]:
        """The section's kind and numbers in SI, as they stand in a case file."""
        known = {name: value for name, value in asdict(self).items() if value is not None}
        return {"kind": "given", **known}


Section = Circle | Tube | Ellipse | RectangularSection
SECTIONS = "a circle, tube, ellipse, rectangular or given section"


@dataclass(frozen=True)
class Rod:
    """One kind of rod: its section and material give the stiffnesses of HQK Eq 1; a `GivenSection` brings its own."""

    section: Section | GivenSection
    material: Material | None = None

    def __post_init__(self) -> None:
        instance("section", self.section, Section | GivenSection, SECTIONS)
        if self.material is not None:
            instance("material", self.material, Material)
        if isinstance(self.section, GivenSection):
            if self.material is not None:
                raise InputError("a given section says all stiffnesses and masses itself: leave the material out")
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
        """EI [N m2] of a rod that bends alike in all directions."""
        first, second = self.bend_stiffnesses
        if first != second:
            raise InputError(
                f"this rod has two bending stiffnesses, {first:g} and {second:g} N m2: no one EI says both"
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
        material = {} if self.material is None else {"material": self.material.parameters()}
        return {"section": self.section.parameters(), **material}
