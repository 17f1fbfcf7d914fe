"""The tables and keys of a case file: the one place that lists each, with its type, default and help."""

from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, model_validator

from gridshell.case.toml import toml_text
from gridshell.case.values import (
    Acceleration,
    Angle,
    Coordinate,
    Counts,
    Density,
    Length,
    LengthOrAuto,
    Lengths,
    Point,
    PoissonRatio,
    Size,
    Stress,
)

if TYPE_CHECKING:
    from gridshell.layout import GridLayout
    from gridshell.rods.section import Rod, Section
    from gridshell.targets import Target


class Table(BaseModel):
    """A table of a case file: frozen, and every key in it must be known."""

    model_config = ConfigDict(extra="forbid", frozen=True)


class HemisphereTable(Table):
    kind: Literal["hemisphere"] = "hemisphere"
    radius: Length = Field(default=0.2, description="radius")

    def build(self) -> "Target":
        from gridshell.targets import Hemisphere

        return Hemisphere(radius=self.radius)


class CapTable(Table):
    kind: Literal["cap"] = "cap"
    radius: Length = Field(default=0.25, description="radius")
    base: Coordinate = Field(default=0.1, description="z of the base plane, the sphere's centre being z = 0")

    def build(self) -> "Target":
        from gridshell.targets import Cap

        return Cap(radius=self.radius, base=self.base)


class ParaboloidTable(Table):
    kind: Literal["paraboloid"] = "paraboloid"
    radius: Length = Field(default=0.2, description="radius")
    height: Length = Field(default=0.12, description="height of the top above the base")

    def build(self) -> "Target":
        from gridshell.targets import Paraboloid

        return Paraboloid(radius=self.radius, height=self.height)


class EllipsoidTable(Table):
    kind: Literal["ellipsoid"] = "ellipsoid"
    a: Length = Field(default=0.2, description="half-axis along x")
    b: Length = Field(default=0.15, description="half-axis along y")
    c: Length = Field(default=0.12, description="half-axis along z")

    def build(self) -> "Target":
        from gridshell.targets import Ellipsoid

        return Ellipsoid(a=self.a, b=self.b, c=self.c)


class HeightFieldTable(Table):
    kind: Literal["heightfield"] = "heightfield"
    formula: str = Field(description='height z = f(x, y) in metres, such as "0.1 - 2*x**2 - y**2"')
    domain: Literal["disc", "rectangle"] = Field(default="disc", description="the plan, centred on the origin")
    radius: Length | None = Field(default=None, description="radius; of a height field: of its disc")
    size: Size | None = Field(default=None, description="width along x and depth along y of a rectangle")

    @model_validator(mode="before")
    @classmethod
    def _domain_decides(cls, given: dict[str, Any]) -> dict[str, Any]:
        domain = given.get("domain", "disc")
        if domain == "disc":
            if "size" in given:
                raise ValueError('target.size is for domain "rectangle": leave it out, or set target.domain')
            return {"radius": 0.2, **given}
        if domain == "rectangle":
            if "radius" in given:
                raise ValueError('target.radius is for domain "disc": leave it out, or set target.domain')
            if "size" not in given:
                raise ValueError('target.size is missing: give width and depth, such as ["400 mm", "300 mm"]')
        return given

    def build(self) -> "Target":
        from gridshell.targets import Disc, HeightField, Rectangle

        if self.radius is not None:
            return HeightField(formula=self.formula, domain=Disc(self.radius))
        assert self.size is not None
        return HeightField(formula=self.formula, domain=Rectangle(self.size))


class LayoutTable(Table):
    rods: Counts = Field(default="auto", description='rods along x and y: 17x17, or "auto" for all that touch')
    spacing: Lengths = Field(default=(0.03, 0.03), description="between neighbouring rods: one length, or u,v")
    length: LengthOrAuto = Field(default="auto", description='length of every rod before trimming, or "auto"')
    edge: Length = Field(default=0.005, description="longest edge of the mesh")
    rotate: Angle = Field(default=0.0, description="turn of the grid about the vertical through the target's centre")
    offset: Point = Field(default=(0.0, 0.0), description="shift x,y of the lattice against the axes")

    def build(self) -> "GridLayout":
        from gridshell.layout import GridLayout

        return GridLayout.orthogonal(**self.model_dump())


class CircleTable(Table):
    kind: Literal["circle"] = "circle"
    radius: Length = Field(default=0.001, description="radius; of a tube: outer radius")

    def build(self) -> "Section":
        from gridshell.rods.section import Circle

        return Circle(radius=self.radius)


class TubeTable(Table):
    kind: Literal["tube"] = "tube"
    radius: Length = Field(default=0.001, description="outer radius")
    thickness: Length = Field(description="thickness of the tube's wall")

    def build(self) -> "Section":
        from gridshell.rods.section import Tube

        return Tube(radius=self.radius, thickness=self.thickness)


class MaterialTable(Table):
    youngs_modulus: Stress = Field(default=1e6, description="Young's modulus")
    poisson_ratio: PoissonRatio = Field(default=0.5, description="Poisson's ratio")
    density: Density = Field(default=1000.0, description="density")


class RodTable(Table):
    section: CircleTable | TubeTable = Field(default=CircleTable(), discriminator="kind")
    material: MaterialTable = MaterialTable()

    def build(self) -> "Rod":
        from gridshell.rods.section import Material, Rod

        return Rod(section=self.section.build(), material=Material(**self.material.model_dump()))


class JointTable(Table):
    kind: Literal["ball"] = Field(default="ball", description="what holds two rods together where they cross")


class DrapeTable(Table):
    method: Literal["bound", "gravity"] = Field(default="bound", description="slide on the target, or fall on it")
    anchor: Point | None = Field(default=None, description="point x,y where the axes cross; default: the highest")
    gravity: Acceleration = Field(default=9.81, description="acceleration of gravity, for method gravity")
    height: Length = Field(default=0.05, description="height of a fall; an equilibrium does not depend on it")


class PopUpTable(Table):
    ends: Literal["pinned", "clamped", "both"] = Field(default="both", description="how the rod ends are held")


class Built(NamedTuple):
    """A case as library objects; `drape_options` are keyword arguments of `formfinding.find_form`."""

    target: "Target"
    layout: "GridLayout"
    rod: "Rod"
    drape_options: dict[str, Any]


TargetTable = HemisphereTable | CapTable | ParaboloidTable | EllipsoidTable | HeightFieldTable


class Case(Table):
    """Everything that decides one job, complete and in SI. Make one with `load_case`."""

    target: TargetTable = Field(default=HemisphereTable(), discriminator="kind")
    layout: LayoutTable = LayoutTable()
    rod: RodTable = RodTable()
    joint: JointTable = JointTable()
    drape: DrapeTable = DrapeTable()
    pop_up: PopUpTable = PopUpTable()

    def to_toml(self) -> str:
        """The full input as a case file with SI numbers: loading it gives an equal case."""
        return toml_text(self.model_dump(exclude_none=True))

    def build(self) -> Built:
        """The target, layout, rod and drape options.

        Raises
        ------
        InputError : values that are fine alone do not fit together, or the formula cannot be used.
        """
        ends = ("pinned", "clamped") if self.pop_up.ends == "both" else (self.pop_up.ends,)
        drape = self.drape
        options = {"method": drape.method, "anchor": drape.anchor, "gravity": drape.gravity, "ends": ends}
        return Built(self.target.build(), self.layout.build(), self.rod.build(), options)
