"""The tables of rods, by their sections and material, and of joints, one for each kind."""

from math import inf
from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, model_validator

from rodshell.case.table import Table
from rodshell.case.values import (
    Angle,
    BendingStiffness,
    Corners,
    Density,
    Distance,
    Force,
    InertiaPerLength,
    Length,
    LengthOrAuto,
    Mass,
    MassPerLength,
    PoissonRatio,
    Stiffness,
    Stress,
)
from rodshell.errors import InputError

if TYPE_CHECKING:
    from rodshell.joints import Joint
    from rodshell.rods.section import GivenSection, Rod, Section
    from rodshell.targets import Target

SLENDER = 1 / 200  # radius over the target's size [HQK section 3.1]


def _decided(radius: float | Literal["auto"]) -> float:
    if radius == "auto":
        raise InputError('rod.section.radius = "auto": there is no target whose size it could be taken from: give it')
    return radius


class CircleTable(Table):
    kind: Literal["circle"] = "circle"
    radius: LengthOrAuto = Field(
        default="auto", description='radius; "auto": 1/200 of the target\'s size; of a tube: outer radius'
    )

    def build(self) -> "Section":
        from rodshell.rods.section import Circle

        return Circle(radius=_decided(self.radius))


class TubeTable(Table):
    kind: Literal["tube"] = "tube"
    radius: LengthOrAuto = Field(default="auto", description="outer radius")
    thickness: Length = Field(description="thickness of the tube's wall")

    def build(self) -> "Section":
        from rodshell.rods.section import Tube

        return Tube(radius=_decided(self.radius), thickness=self.thickness)


class EllipseTable(Table):
    kind: Literal["ellipse"] = "ellipse"
    a: Length = Field(description="half-axis along the grid's normal; of a target: along x")
    b: Length = Field(description="half-axis within the grid; of a target: along y")

    def build(self) -> "Section":
        from rodshell.rods.section import Ellipse

        return Ellipse(a=self.a, b=self.b)


class RectangleTable(Table):
    kind: Literal["rectangle"] = "rectangle"
    width: Length = Field(description="side along the grid's normal: of a flat lath its thickness")
    height: Length = Field(description="side within the grid: of a flat lath its breadth")

    def build(self) -> "Section":
        from rodshell.rods.section import RectangularSection

        return RectangularSection(width=self.width, height=self.height)


class GivenTable(Table):
    kind: Literal["given"] = "given"
    EA: Force = Field(description="stretch stiffness")
    EI1: BendingStiffness = Field(description="stiffness against bends out of the grid")
    EI2: BendingStiffness = Field(description="stiffness against bends within the grid")
    GJ: BendingStiffness = Field(description="twist stiffness")
    mass: MassPerLength = Field(default=0.0, description="mass per length")
    rotary_inertia: InertiaPerLength = Field(default=0.0, description="rotary inertia about the rod's line, per length")

    def build(self) -> "GivenSection":
        from rodshell.rods.section import GivenSection

        return GivenSection(**self.model_dump(exclude={"kind"}))


class MaterialTable(Table):
    youngs_modulus: Stress = Field(default=1e6, description="Young's modulus")
    poisson_ratio: PoissonRatio | None = Field(default=None, description="Poisson's ratio; default 0.5")
    shear: Stress | None = Field(default=None, description="shear modulus, in place of Poisson's ratio: timber")
    density: Density = Field(default=1000.0, description="density")

    @model_validator(mode="before")
    @classmethod
    def _one_of_two(cls, given: dict[str, Any]) -> dict[str, Any]:
        if "shear" not in given:
            return {"poisson_ratio": 0.5, **given}
        if "poisson_ratio" in given:
            raise ValueError("rod.material.shear stands in place of poisson_ratio: leave one of them out")
        return given


class RodTable(Table):
    section: CircleTable | TubeTable | EllipseTable | RectangleTable | GivenTable = Field(
        default=CircleTable(), discriminator="kind"
    )
    material: MaterialTable | None = MaterialTable()

    @model_validator(mode="before")
    @classmethod
    def _given_needs_no_material(cls, given: dict[str, Any]) -> dict[str, Any]:
        section = given.get("section")
        if not (isinstance(section, dict) and section.get("kind") == "given"):
            return given
        if given.get("material"):
            raise ValueError("rod.material: a given section says all stiffnesses and masses itself; leave it out")
        return {**given, "material": None}

    def sized(self, target: "Target") -> "RodTable":
        """A radius left to the target's size decided: rods are then as slender as the paper's on its hemisphere."""
        if getattr(self.section, "radius", None) == "auto":
            return self.model_copy(
                update={"section": self.section.model_copy(update={"radius": SLENDER * target.size})}
            )
        return self

    def build(self) -> "Rod":
        from rodshell.rods.section import Material, Rod

        if self.material is None:
            return Rod(section=self.section.build())
        return Rod(section=self.section.build(), material=Material(**self.material.model_dump(exclude_none=True)))


class JointTable(Table):
    """Keys of every joint; `build` takes the kind from the table's own."""

    mass: Mass = Field(default=0.0, description="mass of one joint: its bolt, coupler or clamp")

    def build(self) -> "Joint":
        from rodshell import joints

        kinds = {"ball": joints.Ball, "pin": joints.Pin, "spring": joints.Spring, "rigid": joints.Rigid}
        given = self.model_dump(exclude={"kind"}, exclude_none=True)
        given = {name: inf if value == "rigid" else value for name, value in given.items()}
        return (kinds | {"linker": joints.Linker})[self.kind](**given)  # type: ignore[attr-defined]


class BallTable(JointTable):
    kind: Literal["ball"] = "ball"


class PinTable(JointTable):
    kind: Literal["pin"] = "pin"
    eccentricity: Distance = Field(default=0.0, description="distance of the two rods' centre lines at a joint")


class RigidTable(PinTable):
    kind: Literal["rigid"] = "rigid"  # type: ignore[assignment]
    rest_angle: Angle | None = Field(default=None, description="between the rods at rest; without: as laid out flat")


class SpringTable(RigidTable):
    kind: Literal["spring"] = "spring"  # type: ignore[assignment]
    shear: Stiffness = Field(default=0.0, description='of the joint about its normal, or "rigid"')
    out_of_plane: Stiffness = Field(default=0.0, description="of a corner across its bisector")
    twist: Stiffness = Field(default=0.0, description="of a corner about its bisector")


class LinkerTable(JointTable):
    kind: Literal["linker"] = "linker"
    corners: Corners = Field(default=2, description="corners of a crossing with a linker: 2 as in the paper, or 4")


JointKinds = BallTable | PinTable | SpringTable | LinkerTable | RigidTable
