"""The tables of rods, by their sections and material, and of joints, one for each kind."""

from collections.abc import Callable
from math import inf
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self, get_args

from pydantic import Field, model_validator

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
    Lengths,
    Mass,
    MassPerLength,
    PoissonRatio,
    SectionModulus,
    Stiffness,
    Stress,
    Table,
)
from rodshell.errors import InputError
from rodshell.rods.materials import Material, PresetName, preset_values

if TYPE_CHECKING:
    from rodshell.checks.sizing import Fit
    from rodshell.joints import Joint
    from rodshell.rods.section import Circle, GivenSection, Rod, Section, Tube
UNSIZED = 1.0  # m, in place of a radius that is still to be found


class AutoTable(Table):
    """A section that is chosen to fit its target."""

    kind: Literal["auto"] = "auto"

    def build(self) -> "Circle":
        from rodshell.rods.section import Circle

        return Circle(radius=UNSIZED)


class CircleTable(Table):
    kind: Literal["circle"] = "circle"
    radius: LengthOrAuto = Field(
        default="auto", description='radius (of a tube: outer), or "auto": from the bends on the target'
    )

    def build(self) -> "Circle":
        from rodshell.rods.section import Circle

        return Circle(radius=UNSIZED if self.radius == "auto" else self.radius)


class TubeTable(Table):
    kind: Literal["tube"] = "tube"
    radius: LengthOrAuto = Field(default="auto", description="outer radius")
    thickness: Length = Field(description="thickness of the tube's wall")

    def build(self) -> "Tube":
        from rodshell.rods.section import Tube

        return Tube(radius=UNSIZED if self.radius == "auto" else self.radius, thickness=self.thickness)


class EllipseTable(Table):
    kind: Literal["ellipse"] = "ellipse"
    a: Length = Field(description="half-axis along the grid's normal")
    b: Length = Field(description="half-axis within the grid")

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
    EA: Force = Field(description="axial stiffness")
    EI1: BendingStiffness = Field(description="bending stiffness out of the grid")
    EI2: BendingStiffness = Field(description="bending stiffness within the grid")
    GJ: BendingStiffness = Field(description="torsional stiffness")
    mass: MassPerLength = Field(default=0.0, description="mass per length")
    rotary_inertia: InertiaPerLength = Field(default=0.0, description="rotary inertia about the rod's axis, per length")
    fibre_distances: Lengths | None = Field(
        default=None, description="distances of the outermost fibres, across the grid and within it"
    )
    fibre_modulus: Stress | None = Field(default=None, description="Young's modulus of the outermost fibres")
    torsion_modulus: SectionModulus | None = Field(
        default=None, description="torsional section modulus: torque over the largest shear stress"
    )

    def build(self) -> "GivenSection":
        from rodshell.rods.section import GivenSection

        return GivenSection(**self.model_dump(exclude={"kind"}))


class MaterialTable(Table):
    preset: PresetName | None = Field(
        default=None, description="a named material; other keys of [rod.material] replace its values"
    )
    youngs_modulus: Stress | None = Field(default=None, description="Young's modulus")
    poisson_ratio: PoissonRatio | None = Field(default=None, description="Poisson's ratio; default 0.5")
    shear: Stress | None = Field(default=None, description="shear modulus, in place of Poisson's ratio, as for timber")
    density: Density = Field(default=1000.0, description="density")

    _path: ClassVar[str] = "rod.material"

    @model_validator(mode="before")
    @classmethod
    def _complete(cls, given: dict[str, Any]) -> dict[str, Any]:
        """What the preset says of the keys that are left out; and not both of Poisson's ratio and a shear modulus."""
        given = {key: value for key, value in given.items() if value is not None}
        if "shear" in given and "poisson_ratio" in given:
            raise ValueError(f"{cls._path}.shear stands in place of poisson_ratio: leave one of them out")
        if given.get("preset") in get_args(PresetName):
            given = preset_values(given["preset"], given)
        return given if "shear" in given else {"poisson_ratio": 0.5, **given}

    @model_validator(mode="after")
    def _has_a_modulus(self) -> Self:
        if self.youngs_modulus is None:
            names = ", ".join(get_args(PresetName))
            raise ValueError(f"{self._path} has no youngs_modulus: give it, or a preset ({names})")
        return self

    def build(self) -> Material:
        given = self.model_dump(exclude={"preset"}, exclude_none=True)
        return Material(**given, name=self.preset)


class RodTable(Table):
    """Section and material; what is left out, or "auto", is chosen to fit the target."""

    section: AutoTable | CircleTable | TubeTable | EllipseTable | RectangleTable | GivenTable = Field(
        default_factory=AutoTable, discriminator="kind"
    )
    material: MaterialTable | None = None

    @model_validator(mode="before")
    @classmethod
    def _given_needs_no_material(cls, given: dict[str, Any]) -> dict[str, Any]:
        section = given.get("section")
        if isinstance(section, dict) and section.get("kind") == "given" and given.get("material"):
            raise ValueError("rod.material: a given section says all stiffnesses and masses itself; leave it out")
        return {key: value for key, value in given.items() if key != "material" or value}

    @property
    def left_open(self) -> tuple[str, ...]:
        """Which of "material" and "section" are left to the target."""
        section = self.section
        sized = section.kind == "auto" or getattr(section, "radius", None) == "auto"
        material = self.material is None and section.kind != "given"
        return (*(["material"] if material else []), *(["section"] if sized else []))

    def build(
        self, fit: "Callable[[], Fit] | None" = None, *, strength: "Callable[[Material], float | None] | None" = None
    ) -> "Rod":
        """The rod.

        fit : what material and section have to fit; called where one is left open.
        strength : the permanent one of a material [Pa]; default: a preset's.

        Raises
        ------
        InputError : something is left open, and there is nothing to fit.
        """
        from rodshell.rods.section import Rod

        section = self.section.build()
        if not self.left_open:
            return Rod(section, self.material.build() if self.material else None)
        if fit is None:
            raise InputError("rod: there is no target that material and section could be taken from: give both")
        room = fit()
        material = self.material.build() if self.material else Material.preset(room.preset)
        if "section" not in self.left_open:
            return Rod(section, material)
        withstood = strength(material) if strength is not None else None
        return Rod(room.section(material, strength=withstood, shape=self.shape), material)

    @property
    def shape(self) -> "Circle | Tube | None":
        """The circle or tube of which only the radius is looked for; None: of any shape that is sold."""
        from rodshell.rods.section import Circle, Tube

        section = self.section.build()
        return section if isinstance(section, Circle | Tube) and self.section.kind != "auto" else None


class JointTable(Table):
    """Keys of every joint; `build` takes the kind from the table's own."""

    mass: Mass = Field(default=0.0, description="mass of one joint: its bolt, coupler or clamp")

    def build(self) -> "Joint":
        from rodshell import joints

        kinds = {"ball": joints.Ball, "pin": joints.Pin, "spring": joints.Spring, "rigid": joints.Rigid}
        given = self.model_dump(exclude={"kind"}, exclude_none=True)
        given = {name: inf if value == "rigid" else value for name, value in given.items()}
        joint: Joint = (kinds | {"linker": joints.Linker})[self.kind](**given)  # type: ignore[attr-defined]
        return joint


class BallTable(JointTable):
    kind: Literal["ball"] = "ball"


class PinTable(JointTable):
    kind: Literal["pin"] = "pin"
    eccentricity: Distance = Field(default=0.0, description="distance between the two rods' centre lines at a joint")


class RigidTable(PinTable):
    kind: Literal["rigid"] = "rigid"  # type: ignore[assignment]
    rest_angle: Angle | None = Field(
        default=None, description="angle between the rods at rest; default: as in the flat grid"
    )


class SpringTable(RigidTable):
    kind: Literal["spring"] = "spring"  # type: ignore[assignment]
    shear: Stiffness = Field(default=0.0, description="stiffness of the joint about its normal")
    out_of_plane: Stiffness = Field(default=0.0, description="stiffness of a corner across its bisector")
    twist: Stiffness = Field(default=0.0, description="stiffness of a corner about its bisector")


class LinkerTable(JointTable):
    kind: Literal["linker"] = "linker"
    corners: Corners = Field(default=2, description="corners of a crossing that have a linker: 2 as in the paper, or 4")


JointKinds = BallTable | PinTable | SpringTable | LinkerTable | RigidTable
