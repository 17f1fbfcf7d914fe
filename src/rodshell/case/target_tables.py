"""The target's tables, one for each kind."""

from typing import TYPE_CHECKING, Any, Literal

from pydantic import Field, model_validator

from rodshell.case.values import Angles, Coordinate, Factor, FileToRead, Length, Point3, Size, Table, Unit

if TYPE_CHECKING:
    from rodshell.targets import Target


class HemisphereTable(Table):
    kind: Literal["hemisphere"] = "hemisphere"
    radius: Length = Field(default=0.2, description="radius")

    def build(self) -> "Target":
        from rodshell.targets import Hemisphere

        return Hemisphere(radius=self.radius)


class CapTable(Table):
    kind: Literal["cap"] = "cap"
    radius: Length = Field(default=0.25, description="radius")
    base: Coordinate = Field(
        default=0.1, description="z of the plane at which the shell ends; of a cap: from its centre"
    )

    def build(self) -> "Target":
        from rodshell.targets import Cap

        return Cap(radius=self.radius, base=self.base)


class ParaboloidTable(Table):
    kind: Literal["paraboloid"] = "paraboloid"
    radius: Length = Field(default=0.2, description="radius")
    height: Length = Field(default=0.12, description="height of the top; of a CSV: of its unit; of an image: of white")

    def build(self) -> "Target":
        from rodshell.targets import Paraboloid

        return Paraboloid(radius=self.radius, height=self.height)


class EllipsoidTable(Table):
    kind: Literal["ellipsoid"] = "ellipsoid"
    a: Length = Field(default=0.2, description="half-axis along x")
    b: Length = Field(default=0.15, description="half-axis along y")
    c: Length = Field(default=0.12, description="half-axis along z")

    def build(self) -> "Target":
        from rodshell.targets import Ellipsoid

        return Ellipsoid(a=self.a, b=self.b, c=self.c)


class HeightFieldTable(Table):
    kind: Literal["heightfield"] = "heightfield"
    formula: str = Field(description='height z = f(x, y) in metres, such as "0.1 - 2*x**2 - y**2"')
    domain: Literal["disc", "rectangle"] = Field(
        default="disc", description="plan of the target, centred on the origin"
    )
    radius: Length | None = Field(default=None, description="radius of the disc")
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
        from rodshell.targets import Disc, HeightField, Rectangle

        if self.radius is not None:
            return HeightField(formula=self.formula, domain=Disc(self.radius))
        assert self.size is not None
        return HeightField(formula=self.formula, domain=Rectangle(self.size))


class PlacedTable(Table):
    """Keys of every target that comes from a file."""

    file: FileToRead = Field(description="path of the file; in a case file from the case file's folder")
    base: Coordinate | None = Field(default=None, description="z of the plane at which the shell ends")
    boundary: FileToRead | None = Field(
        default=None, description="OBJ, DXF or 3dm file with closed curves: the shell's edge, openings"
    )
    scale: Factor = Field(default=1.0, description="factor by which it is scaled about the origin")
    turn: Angles = Field(
        default=(0.0, 0.0, 0.0), description="angles by which it is turned about x, y, z, in that order"
    )
    move: Point3 = Field(default=(0.0, 0.0, 0.0), description="shift along x, y, z")

    def options(self) -> dict[str, Any]:
        """Keyword arguments that all files have."""
        from rodshell.targets import Placement

        placement = Placement(up=getattr(self, "up", None), scale=self.scale, turn=self.turn, move=self.move)
        return {"base": self.base, "boundary": self.boundary, "placement": placement}


class SurfaceTable(PlacedTable):
    unit: Unit | None = Field(default=None, description="the file's unit, such as mm")
    object: str | None = Field(
        default=None, description="name of an object or layer; of a 3dm surface or STEP face also its number"
    )
    up: Literal["z", "y"] | None = Field(
        default=None, description="axis of the file that points upwards; default: y of glTF, z of others"
    )

    def build(self) -> "Target":
        from rodshell.targets import surface_from

        return surface_from(self.file, unit=self.unit, name=self.object, **self.options())


class MeshTable(SurfaceTable):
    kind: Literal["mesh"] = "mesh"


class NurbsTable(SurfaceTable):
    kind: Literal["nurbs"] = "nurbs"


class HeightsTable(PlacedTable):
    kind: Literal["heights"] = "heights"
    size: Size = Field(description="width along x and depth along y of a rectangle")
    height: Length | None = Field(default=None, description="height of a CSV's unit; of an image: of white")

    def build(self) -> "Target":
        from rodshell.targets import heights_from

        return heights_from(self.file, size=self.size, height=self.height, **self.options())


class HeldTarget(Table):
    """In place of a target that no key describes: a Python function, a mesh made in Python, a table of rods."""

    kind: Literal["python", "table"]


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
