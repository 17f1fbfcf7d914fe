"""Cross-sections and material of a rod, and the stiffnesses that follow."""

from dataclasses import asdict, dataclass
from functools import cached_property
from math import inf, isfinite, pi

from gridshell.errors import InputError


@dataclass(frozen=True)
class Circle:
    """Solid circular section of the given `radius` [m]."""

    radius: float

    def __post_init__(self) -> None:
        _positive("section radius", self.radius, "m")

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
class Tube:
    """Circular tube: outer `radius` and wall `thickness` [m]."""

    radius: float
    thickness: float

    def __post_init__(self) -> None:
        _positive("section radius", self.radius, "m")
        _positive("section thickness", self.thickness, "m")
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


Section = Circle | Tube


@dataclass(frozen=True)
class Material:
    """Linear elastic material: `youngs_modulus` [Pa], `poisson_ratio` [-], `density` [kg/m3]."""

    youngs_modulus: float
    density: float
    poisson_ratio: float = 0.5

    def __post_init__(self) -> None:
        _positive("Young's modulus", self.youngs_modulus, "Pa")
        _positive("density", self.density, "kg/m3")
        if not -1 < self.poisson_ratio <= 0.5:
            raise InputError(f"Poisson's ratio must lie above -1 and not above 0.5, not {self.poisson_ratio}")

    @property
    def shear_modulus(self) -> float:
        """E / 2(1 + nu) [Pa]; E/3 for an incompressible material, as in the paper."""
        return self.youngs_modulus / (2 * (1 + self.poisson_ratio))


@dataclass(frozen=True)
class Rod:
    """One kind of rod: its section and material give the stiffnesses of HQK Eq 1."""

    section: Section
    material: Material

    @cached_property
    def stretch_stiffness(self) -> float:
        """EA [N]"""
        return self.material.youngs_modulus * self.section.area

    @cached_property
    def bend_stiffness(self) -> float:
        """EI [N m2]"""
        return self.material.youngs_modulus * self.section.second_moment

    @cached_property
    def twist_stiffness(self) -> float:
        """GJ [N m2]; J is twice the second moment of area for circles and tubes."""
        return self.material.shear_modulus * 2 * self.section.second_moment

    @cached_property
    def mass_per_length(self) -> float:
        """[kg/m]"""
        return self.material.density * self.section.area

    def parameters(self) -> dict[str, dict[str, object]]:
        """Section and material in SI, as they stand in a case file."""
        return {"section": self.section.parameters(), "material": asdict(self.material)}


def _positive(name: str, value: float, unit: str) -> None:
    if not (isfinite(value) and 0 < value < inf):
        raise InputError(f"{name} must be positive, not {value} {unit}")
