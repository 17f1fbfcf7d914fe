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
    AngleStiffness,
    BendingStiffness,
    Coordinate,
    Corners,
    Counts,
    Density,
    Distance,
    Duration,
    Factor,
    Force,
    InertiaPerLength,
    Length,
    LengthOrAuto,
    LengthsOrAuto,
    MassPerLength,
    NodeStiffness,
    Point,
    Point3,
    PointOrAuto,
    PoissonRatio,
    Share,
    Size,
    Stiffness,
    Stress,
    Unit,
    Whole,
)

if TYPE_CHECKING:
    from gridshell.formfinding.fall import Fall
    from gridshell.joints import Joint
    from gridshell.layout import GridLayout
    from gridshell.output.takeaway import Takeaway
    from gridshell.rods.section import GivenSection, Rod, Section
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
    rotate: AngleOrAuto = Field(default=0.0, description='turn of the grid seen from above, or "auto": the best found')
    offset: Point = Field(default=(0.0, 0.0), description="shift x,y of the lattice against the axes")

    def build(self, target: "Target | None" = None) -> "GridLayout":
        """The layout; "auto" stands for some 17 rods each way over the target, and six edges a span."""
        from gridshell.layout import GridLayout

        spacing = self.spacing
        if spacing == "auto":
            spacing = (_round((target.size if target else 0.2) / 8),) * 2
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


class EllipseTable(Table):
    kind: Literal["ellipse"] = "ellipse"
    a: Length = Field(description="half-axis along the grid's normal; of a target: along x")
    b: Length = Field(description="half-axis within the grid; of a target: along y")

    def build(self) -> "Section":
        from gridshell.rods.section import Ellipse

        return Ellipse(a=self.a, b=self.b)


class RectangleTable(Table):
    kind: Literal["rectangle"] = "rectangle"
    width: Length = Field(description="side along the grid's normal: of a flat lath its thickness")
    height: Length = Field(description="side within the grid: of a flat lath its breadth")

    def build(self) -> "Section":
        from gridshell.rods.section import RectangularSection

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
        from gridshell.rods.section import GivenSection

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

    def build(self) -> "Rod":
        from gridshell.rods.section import Material, Rod

        if self.material is None:
            return Rod(section=self.section.build())
        return Rod(section=self.section.build(), material=Material(**self.material.model_dump(exclude_none=True)))


class JointTable(Table):
    """Keys of every joint; `build` takes the kind from the table's own."""

    def build(self) -> "Joint":
        from gridshell import joints

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


class DrapeTable(Table):
    method: Literal["bound", "gravity", "paper"] = Field(
        default="bound", description="slide on the target, hang on it at rest, or fall on it in time"
    )
    anchor: PointOrAuto | None = Field(
        default=None, description='point x,y where the axes cross; default: the highest; or "auto"'
    )
    objective: Literal["shear", "curvature", "gap"] = Field(
        default="shear", description='what an "auto" anchor or rotate makes smallest'
    )
    gravity: Acceleration = Field(default=9.81, description="acceleration of gravity, for methods gravity and paper")
    height: Length = Field(default=0.05, description="of a fall (paper); an equilibrium does not depend on it")
    coupling: Literal["shared", "implicit", "explicit"] = Field(
        default="shared", description="how falling rods hold together: one node at a joint, or springs"
    )
    C1: NodeStiffness | None = Field(default=None, description="of the springs between nodes; default from the rods")
    C2: AngleStiffness | None = Field(default=None, description="of the springs between twist angles; default as C1")
    time_step: Duration | None = Field(default=None, description="of a fall; default 10 ms, or what springs bear")
    duration: Duration | None = Field(default=None, description="longest fall; default 6 s at a size of 0.2 m")
    friction: Share = Field(default=0.0, description="Coulomb's coefficient between falling rods and target")
    drag: Share = Field(default=0.0, description="rate in 1/s at which falling rods lose velocity to the air")
    frames: str | None = Field(default=None, description="folder for the frames of a fall; default: none are kept")

    def fall(self) -> "Fall":
        """How the paper's method falls."""
        from gridshell.formfinding.fall import Fall
        from gridshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs

        coupling: Coupling = SharedDofs()
        if self.coupling != "shared":
            penalty = ImplicitPenalty if self.coupling == "implicit" else ExplicitPenalty
            coupling = penalty(C1=self.C1, C2=self.C2)
        return Fall(
            coupling=coupling, height=self.height, time_step=self.time_step, duration=self.duration,
            friction=self.friction, drag=self.drag, stream=self.frames,
        )  # fmt: skip


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
        options: dict[str, Any] = {"method": drape.method, "anchor": anchor, "gravity": drape.gravity, "ends": ends}
        options["fall"] = drape.fall() if drape.method == "paper" else None
        options["joint"] = self.joint.build()
        target = self.target.build()
        return Built(target, self.layout.build(target), self.rod.build(), options)

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
