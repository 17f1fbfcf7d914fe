"""The target's tables, one for each kind."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal

from rodshell.case.held import Holding
from rodshell.errors import InputError
from rodshell.progress import Progress, silent
from rodshell.quantities import Angles, Coordinate, Factor, FileToRead, Length, Point3, Size, Unit
from rodshell.schema import written

if TYPE_CHECKING:
    from rodshell.targets import Target


class TargetTable(Holding):
    """Keys of a target whose class has the same name."""

    kind: ClassVar[str]

    def build(self, progress: Progress = silent) -> "Target":
        """The target; `progress` is called while a file is read and its field fitted."""
        from rodshell import targets

        keys = written(self)
        del keys["kind"]
        made: Target = getattr(targets, type(self).__name__)(**keys)
        return made


@dataclass(frozen=True, kw_only=True)
class Hemisphere(TargetTable):
    kind: ClassVar = "hemisphere"
    radius: Annotated[Length, "radius"] = 0.2


@dataclass(frozen=True, kw_only=True)
class Cap(TargetTable):
    kind: ClassVar = "cap"
    radius: Annotated[Length, "radius"] = 0.25
    base: Annotated[Coordinate, "z of the plane at which the shell ends; of a cap: from its centre"] = 0.1


@dataclass(frozen=True, kw_only=True)
class Paraboloid(TargetTable):
    kind: ClassVar = "paraboloid"
    radius: Annotated[Length, "radius"] = 0.2
    height: Annotated[Length, "height of the top; of a CSV: of its unit; of an image: of white"] = 0.12


@dataclass(frozen=True, kw_only=True)
class Ellipsoid(TargetTable):
    kind: ClassVar = "ellipsoid"
    a: Annotated[Length, "half-axis along x"] = 0.2
    b: Annotated[Length, "half-axis along y"] = 0.15
    c: Annotated[Length, "half-axis along z"] = 0.12


@dataclass(frozen=True, kw_only=True)
class HeightField(TargetTable):
    kind: ClassVar = "heightfield"
    formula: Annotated[str, 'height z = f(x, y) in metres, such as "0.1 - 2*x**2 - y**2"']
    domain: Annotated[Literal["disc", "rectangle"], "plan of the target, centred on the origin"] = "disc"
    radius: Annotated[Length | None, "radius of the disc"] = None
    size: Annotated[Size | None, "width along x and depth along y of a rectangle"] = None

    @classmethod
    def completed(cls, given: Mapping[str, Any], path: str) -> Mapping[str, Any]:
        """With the radius of a disc."""
        domain = given.get("domain", "disc")
        if domain == "disc":
            if "size" in given:
                raise InputError(f'{path}.size is for domain "rectangle": leave it out, or set {path}.domain')
            return {"radius": 0.2, **given}
        if domain == "rectangle":
            if "radius" in given:
                raise InputError(f'{path}.radius is for domain "disc": leave it out, or set {path}.domain')
            if "size" not in given:
                raise InputError(f'{path}.size is missing: give width and depth, such as ["400 mm", "300 mm"]')
        return given

    def build(self, progress: Progress = silent) -> "Target":
        from rodshell import targets

        if self.radius is not None:
            return targets.HeightField(formula=self.formula, domain=targets.Disc(self.radius))
        assert self.size is not None
        return targets.HeightField(formula=self.formula, domain=targets.Rectangle(self.size))


@dataclass(frozen=True, kw_only=True)
class Placed(Holding):
    """Keys of every target that comes from a file."""

    file: Annotated[FileToRead, "path of the file; in a case file from the case file's folder"]
    base: Annotated[Coordinate | None, "z of the plane at which the shell ends"] = None
    boundary: Annotated[
        FileToRead | None, "OBJ, DXF or 3dm file with closed curves: the shell's edge, openings"
    ] = None  # fmt: skip
    scale: Annotated[Factor, "factor by which it is scaled about the origin"] = 1.0
    turn: Annotated[Angles, "angles by which it is turned about x, y, z, in that order"] = (0.0, 0.0, 0.0)
    move: Annotated[Point3, "shift along x, y, z"] = (0.0, 0.0, 0.0)

    def options(self) -> dict[str, Any]:
        """Keyword arguments that all files have."""
        from rodshell.targets import Placement

        placement = Placement(up=getattr(self, "up", None), scale=self.scale, turn=self.turn, move=self.move)
        return {"base": self.base, "boundary": self.boundary, "placement": placement}


@dataclass(frozen=True, kw_only=True)
class Surface(Placed):
    unit: Annotated[Unit | None, "the file's unit, such as mm"] = None
    object: Annotated[str | None, "name of an object or layer; in 3dm and STEP files also a number"] = None
    up: Annotated[
        Literal["z", "y"] | None, "axis of the file that points upwards; default: y of glTF, z of others"
    ] = None  # fmt: skip

    def build(self, progress: Progress = silent) -> "Target":
        from rodshell.targets import surface_from

        return surface_from(self.file, unit=self.unit, name=self.object, progress=progress, **self.options())


class Mesh(Surface):
    kind: ClassVar = "mesh"


class Nurbs(Surface):
    kind: ClassVar = "nurbs"


@dataclass(frozen=True, kw_only=True)
class Heights(Placed):
    kind: ClassVar = "heights"
    size: Annotated[Size, "width along x and depth along y of a rectangle"]
    height: Annotated[Length | None, "height of a CSV's unit; of an image: of white"] = None

    def build(self, progress: Progress = silent) -> "Target":
        from rodshell.targets import heights_from

        return heights_from(self.file, size=self.size, height=self.height, progress=progress, **self.options())


@dataclass(frozen=True, kw_only=True)
class HeldTarget(Holding):
    """In place of a target that no key describes: a Python function, a mesh made in Python, a table of rods."""

    kind: Literal["python", "table"]


TargetKinds = Hemisphere | Cap | Paraboloid | Ellipsoid | HeightField | Mesh | Nurbs | Heights
