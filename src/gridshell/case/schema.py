"""The tables and keys of a case file: the one place that lists each, with its type, default and help."""

from math import floor, inf, log10
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

from pydantic import BaseModel, ConfigDict, Field, model_validator

from gridshell.case.toml import toml_text
from gridshell.case.values import (
    Acceleration,
    Angle,
    AngleOrAuto,
    Angles,
    Coordinate,
    Corners,
    Counts,
    Density,
    Distance,
    Factor,
    Length,
    LengthOrAuto,
    LengthsOrAuto,
    Point,
    Point3,
    PointOrAuto,
    PoissonRatio,
    Size,
    Stiffness,
    Stress,
    Unit,
    Whole,
)

if TYPE_CHECKING:
    from gridshell.joints import Joint
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


class PlacedTable(Table):
    """Keys of every target that comes from a file."""

    file: str = Field(description="path of the file; in a case file from the case file's folder")
    base: Coordinate | None = Field(default=None, description="z of the base plane; of a cap: its sphere's centre is 0")
    boundary: str | None = Field(default=None, description="OBJ or DXF with closed curves: the shell's edge, openings")
    scale: Factor = Field(default=1.0, description="factor, about the origin")
    turn: Angles = Field(default=(0.0, 0.0, 0.0), description="angles about x, y, z, in that order")
    move: Point3 = Field(default=(0.0, 0.0, 0.0), description="shift along x, y, z")

    def options(self) -> dict[str, Any]:
        """Keyword arguments that all files have."""
        from gridshell.targets import Placement

        placement = Placement(scale=self.scale, turn=self.turn, move=self.move)
        return {"base": self.base, "boundary": self.boundary, "placement": placement}


class SurfaceTable(PlacedTable):
    unit: Unit | None = Field(default=None, description="the file's unit, such as mm")
    object: str | None = Field(default=None, description="name of the object, of several; 3dm: or of its layer")

    def build(self) -> "Target":
        from gridshell.targets import surface_from

        return surface_from(self.file, unit=self.unit, name=self.object, **self.options())


class MeshTable(SurfaceTable):
    kind: Literal["mesh"] = "mesh"


class NurbsTable(SurfaceTable):
    kind: Literal["nurbs"] = "nurbs"


class HeightsTable(PlacedTable):
    kind: Literal["heights"] = "heights"
    size: Size = Field(description="width along x and depth along y of a rectangle")
    height: Length | None = Field(
        default=None, description="of a paraboloid; of an image: of white; of a CSV: its unit"
    )

    def build(self) -> "Target":
        from gridshell.targets import heights_from

        return heights_from(self.file, size=self.size, height=self.height, **self.options())


class LayoutTable(Table):
    rods: Counts = Field(default="auto", description='rods along x and y: 17x17, or "auto" for all that touch')
    spacing: LengthsOrAuto = Field(
        default=(0.03, 0.03), description='between neighbouring rods: one length, or u,v, or "auto"'
    )
    length: LengthOrAuto = Field(default="auto", description='length of every rod before trimming, or "auto"')
    edge: LengthOrAuto = Field(default=0.005, description='longest edge of the mesh, or "auto"')
    rotate: AngleOrAuto = Field(
        default=0.0, description='turn of the grid about the vertical through the anchor, or "auto": the best found'
    )
    offset: Point = Field(default=(0.0, 0.0), description="shift x,y of the lattice against the axes")

    def build(self, size: float) -> "GridLayout":
        """The layout on a target of this size [m]: "auto" stands for some 17 rods each way and six edges a span."""
        from gridshell.layout import GridLayout

        spacing = (_round(size / 8),) * 2 if self.spacing == "auto" else self.spacing
        rotate = 0.0 if self.rotate == "auto" else self.rotate
        edge = min(spacing) / 6 if self.edge == "auto" else self.edge
        return GridLayout.orthogonal(**self.model_dump() | {"spacing": spacing, "edge": edge, "rotate": rotate})


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
    """Keys of every joint; `build` takes the kind from the table's own."""

    def build(self) -> "Joint":
        from gridshell import joints

        kinds = {"ball": joints.Ball, "pin": joints.Pin, "spring": joints.Spring, "rigid": joints.Rigid}
        given = self.model_dump(exclude={"kind"}, exclude_none=True)
        given = {name: inf if value == "rigid" else value for name, value in given.items()}
        return (kinds | {"linker": joints.Linker})[self.kind](**given)  # type: ignore[attr-defined,no-any-return]


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


class DrapeTable(Table):
    method: Literal["bound", "gravity"] = Field(default="bound", description="slide on the target, or fall on it")
    anchor: PointOrAuto | None = Field(
        default=None, description='point x,y where the axes cross; default: the highest; "auto": the best found'
    )
    objective: Literal["shear", "curvature", "gap"] = Field(
        default="shear", description='what an "auto" anchor or rotate makes smallest'
    )
    gravity: Acceleration = Field(default=9.81, description="acceleration of gravity, for method gravity")
    height: Length = Field(default=0.05, description="height of a fall; an equilibrium does not depend on it")


class PopUpTable(Table):
    ends: Literal["pinned", "clamped", "both"] = Field(default="both", description="how the rod ends are held")


class ChecksTable(Table):
    strength: Stress | None = Field(default=None, description="of the rods' material, by which utilisation is counted")
    stages: Whole = Field(default=8, description="equilibria of the way up from flat; 0: it is not followed")


class FabricationTable(Table):
    end_allowance: Coordinate = Field(default=0.0, description="added to each end of a rod, to be held by its support")
    stock_length: Length | None = Field(
        default=None, description="of the bars that rods are cut from; default: no limit"
    )
    kerf: Coordinate = Field(default=0.0, description="lost at each saw cut")


class LayersTable(Table):
    """Other names for the layers of DXF files."""

    cut: str | None = Field(default=None, description="name of the DXF layer CUT")
    mark: str | None = Field(default=None, description="name of the DXF layer MARK")
    label: str | None = Field(default=None, description="name of the DXF layer LABEL")
    boundary_flat: str | None = Field(default=None, description="name of the DXF layer BOUNDARY-FLAT")
    boundary_final: str | None = Field(default=None, description="name of the DXF layer BOUNDARY-FINAL")
    dim: str | None = Field(default=None, description="name of the DXF layer DIM")
    title: str | None = Field(default=None, description="name of the DXF layer TITLE")


class DrawingsTable(Table):
    paper: Literal["A4", "A3", "A2", "A1", "A0"] = Field(default="A3", description="of the PDF's sheets, landscape")
    project: str = Field(default="", description="for the title block")
    revision: str = Field(default="", description="for the title block")
    tolerance: Length | None = Field(default=None, description="of lengths, for the title block")
    layers: LayersTable = LayersTable()


class Built(NamedTuple):
    """A case as library objects; `drape_options` are keyword arguments of `formfinding.find_form`."""

    target: "Target"
    layout: "GridLayout"
    rod: "Rod"
    drape_options: dict[str, Any]


TargetTable = (
    HemisphereTable
    | CapTable
    | ParaboloidTable
    | EllipsoidTable
    | HeightFieldTable
    | MeshTable
    | NurbsTable
    | HeightsTable
)


JointKinds = BallTable | PinTable | SpringTable | LinkerTable | RigidTable


def _round(length: float) -> float:
    """The nearest length below of 1, 1.5, 2, 3, 5 or 7 times a power of ten [m]."""
    decade = 10.0 ** floor(log10(length))
    return max(decade * step for step in (1.0, 1.5, 2.0, 3.0, 5.0, 7.0) if decade * step <= length * (1 + 1e-9))


class Case(Table):
    """Everything that decides one job, complete and in SI. Make one with `load_case`."""

    target: TargetTable = Field(default=HemisphereTable(), discriminator="kind")
    layout: LayoutTable = LayoutTable()
    rod: RodTable = RodTable()
    joint: JointKinds = Field(default=BallTable(), discriminator="kind")
    drape: DrapeTable = DrapeTable()
    pop_up: PopUpTable = PopUpTable()
    checks: ChecksTable = ChecksTable()
    fabrication: FabricationTable = FabricationTable()
    drawings: DrawingsTable = DrawingsTable()

    def to_toml(self) -> str:
        """The full input as a case file with SI numbers: loading it gives an equal case."""
        return toml_text(self.model_dump(exclude_none=True))

    @property
    def undecided(self) -> bool:
        """Whether anchor or heading are to be searched for."""
        return "auto" in (self.drape.anchor, self.layout.rotate)

    def decided(self, anchor: tuple[float, float], rotate: float) -> "Case":
        """The same case with its anchor [m] and heading [rad]."""
        layout = self.layout.model_copy(update={"rotate": rotate})
        return self.model_copy(update={"layout": layout, "drape": self.drape.model_copy(update={"anchor": anchor})})

    def build(self) -> Built:
        """The target, layout, rod and drape options.

        Raises
        ------
        InputError : values that are fine alone do not fit together, or the formula cannot be used.
        """
        ends = ("pinned", "clamped") if self.pop_up.ends == "both" else (self.pop_up.ends,)
        drape = self.drape
        anchor = None if drape.anchor == "auto" else drape.anchor
        options = {"method": drape.method, "anchor": anchor, "gravity": drape.gravity, "ends": ends}
        options["joint"] = self.joint.build()
        target = self.target.build()
        return Built(target, self.layout.build(target.size), self.rod.build(), options)

    def takeaway(self) -> "Takeaway":
        """What checks, workshop and drawings are told.

        Raises
        ------
        InputError : a value cannot be used.
        """
        from gridshell.fabrication import Fabrication
        from gridshell.output.takeaway import DrawingStyle, Takeaway

        style = self.drawings.model_dump(exclude={"layers"})
        layers = self.drawings.layers.model_dump(exclude_none=True)
        style["layers"] = {name.upper().replace("_", "-"): shown for name, shown in layers.items()}
        return Takeaway(
            self.checks.strength,
            self.checks.stages,
            Fabrication(**self.fabrication.model_dump()),
            DrawingStyle(**style),
        )
