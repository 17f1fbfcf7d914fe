"""The tables of a case's stages: layout, drape, pop-up, seams, checks, fabrication and drawings."""

from math import pi
from pathlib import PureWindowsPath
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import BeforeValidator, Field, ValidationInfo, field_validator, model_validator

from rodshell.case.values import (
    Acceleration,
    Angle,
    AngleOrAuto,
    AngleStiffness,
    Coordinate,
    Counts,
    Duration,
    FileToRead,
    FolderToWrite,
    IsoDate,
    Length,
    LengthOrAuto,
    Lengths,
    LengthsOrAuto,
    Names,
    NodeStiffness,
    Numbers,
    Point,
    PointOrAuto,
    Polylines,
    Ratio,
    Share,
    Stress,
    Table,
    Unit,
    Whole,
    file_to_read,
    polylines,
    unit,
    words,
)
from rodshell.errors import InputError
from rodshell.units import rounded_down, shown
from rodshell.validation import file_path

if TYPE_CHECKING:
    from rodshell.formfinding.methods import Method
    from rodshell.formfinding.patches import PatchLayout
    from rodshell.layout import GridLayout
    from rodshell.refining.variables import Family
    from rodshell.targets import Target


class LayoutTable(Table):
    rods: Counts = Field(default="auto", description='numbers of rods along x and y: 17x17, or "auto": all that touch')
    spacing: LengthsOrAuto = Field(
        default="auto", description='distance between neighbouring rods: one length, or u,v, or "auto"'
    )
    length: LengthOrAuto = Field(default="auto", description='length of every rod before trimming, or "auto"')
    edge: LengthOrAuto = Field(default="auto", description='longest edge of the mesh, or "auto"')
    rotate: AngleOrAuto = Field(
        default=0.0, description='angle of the grid, seen from above, or "auto": the best found'
    )
    offset: Point = Field(
        default=(0.0, 0.0), description="shift x,y of the grid lines from the axes through the anchor"
    )
    crossing: Angle = Field(default=pi / 2, description="angle between both families on the target, at the anchor")
    left_out: Names = Field(default=(), description="names of rods that are not built, such as U01, V03")

    def build(self, target: "Target | None" = None) -> "GridLayout":
        """The layout; a spacing "auto" stands for some 17 rods each way over the target."""
        from rodshell.layout import GridLayout

        spacing = self.spacing
        if spacing == "auto":
            spacing = (rounded_down((target.size if target else 0.2) / 8),) * 2
        rotate = 0.0 if self.rotate == "auto" else self.rotate
        return GridLayout.orthogonal(**self.model_dump() | {"spacing": spacing, "rotate": rotate})


FALLING = ("height", "coupling", "C1", "C2", "time_step", "duration", "friction", "drag", "frames")
IDLE: dict[str, tuple[str, ...]] = {"bound": ("gravity", *FALLING), "gravity": FALLING, "paper": ()}
"""Keys of [drape] that a method does not use."""


class DrapeTable(Table):
    method: Literal["bound", "gravity", "paper"] = Field(
        default="bound", description="bound to the target; hung on it by gravity; or dropped on it (paper)"
    )
    anchor: PointOrAuto | None = Field(
        default=None, description='point x,y where the axes cross; default: the highest point; or "auto"'
    )
    objective: Literal["shear", "curvature", "gap"] = Field(
        default="shear", description='what the search for an "auto" anchor or angle minimises'
    )
    gravity: Acceleration = Field(default=9.81, description="acceleration of gravity, for methods gravity and paper")
    height: Length = Field(default=0.05, description="height from which the rods fall (method paper)")
    coupling: Literal["shared", "implicit", "explicit"] = Field(
        default="shared", description="joints of falling rods: a shared node, or springs (method paper)"
    )
    C1: NodeStiffness | None = Field(
        default=None, description="stiffness of the springs between nodes; default: from the rods"
    )
    C2: AngleStiffness | None = Field(
        default=None, description="stiffness of the springs between twists; default: from the rods"
    )
    time_step: Duration | None = Field(
        default=None, description="time step of a fall; default: 10 ms, or by the stability limit"
    )
    duration: Duration | None = Field(
        default=None, description="longest duration of a fall; default: 6 s at a size of 0.2 m"
    )
    friction: Share = Field(default=0.0, description="coefficient of friction between falling rods and target")
    drag: Share | None = Field(default=None, description="air drag: rate in 1/s; default: 12 on a target of 0.2 m")
    frames: FolderToWrite | None = Field(
        default=None, description="subfolder of the result for the steps of a fall; default: none"
    )

    @field_validator("frames")
    @classmethod
    def _inside(cls, value: str | None) -> str | None:
        """A case from somebody else must not write to any place."""
        parts = PureWindowsPath("frames" if value is None else value).parts  # it knows both kinds of paths
        if not parts or ".." in parts or any(letter in part for part in parts for letter in "/\\:"):
            raise ValueError('frames are kept in the result\'s folder: give a name in it such as "frames"')
        return value

    @model_validator(mode="after")
    def _uses_all(self) -> Self:
        defaults = type(self).model_fields
        idle = [*IDLE[self.method], *(("C1", "C2") if self.coupling == "shared" else ())]
        for name in idle:
            value = getattr(self, name)
            if value != defaults[name].default:
                raise ValueError(f"drape.{name} = {shown(value)}: {self._why_idle(name)}")
        return self

    def _why_idle(self, name: str) -> str:
        """Why a key does nothing here, and what to do."""
        if name in IDLE[self.method]:
            methods = " or ".join(f'"{method}"' for method in IDLE if name not in IDLE[method])
            return f'method "{self.method}" has no {name}: leave it out, or set drape.method to {methods}'
        return 'coupling "shared" has no springs: leave it out, or set drape.coupling to "implicit" or "explicit"'

    def build(self) -> "Method":
        """The method with its options."""
        from rodshell.formfinding.methods import Bound, Fall, Gravity
        from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs

        if self.method == "bound":
            return Bound()
        if self.method == "gravity":
            return Gravity(acceleration=self.gravity)
        coupling: Coupling = SharedDofs()
        if self.coupling != "shared":
            penalty = ImplicitPenalty if self.coupling == "implicit" else ExplicitPenalty
            coupling = penalty(C1=self.C1, C2=self.C2)
        return Fall(
            acceleration=self.gravity, height=self.height, coupling=coupling, time_step=self.time_step,
            duration=self.duration, friction=self.friction, drag=self.drag, stream=self.frames,
        )  # fmt: skip


class PopUpTable(Table):
    ends: Literal["pinned", "clamped", "both"] = Field(
        default="both", description="supports: free to turn, with fixed direction, or one form with each"
    )


FAMILIES = ("taper", "double", "sections", "tails", "clamps", "supports", "holes", "offsets")
Families = Annotated[tuple[str, ...], BeforeValidator(words(FAMILIES))]


class RefineTable(Table):
    vary: Families = Field(default=(), description=", ".join(FAMILIES))
    ends: Literal["pinned", "clamped"] | None = Field(
        default=None, description="supports of the refined shell; default: the first of pop_up.ends"
    )
    ratio: Ratio = Field(default=8.0, description="of the largest EI to the smallest along a taper")
    per: Literal["shell", "family", "rod"] = Field(
        default="shell", description="one taper for the shell, one for each family, or for each rod"
    )
    varies: Literal["size", "width", "height", "a", "b"] = Field(
        default="size", description="what of the section a taper changes: all lengths, or one"
    )
    under: str = Field(
        default="nothing",
        description="meet the target under nothing, weight, or a combination of loads",
    )
    tolerance: Length | None = Field(
        default=None,
        description="largest error of a span as it is built; default: 0.05 % of the size",
    )
    start: Numbers | None = Field(default=None, description="design to begin with, as an interrupted search prints it")
    offer: Literal["on", "off"] = Field(default="on", description="say of any form what double laths would gain")

    def build(self) -> "tuple[Family, ...]":
        """The families that are varied."""
        if not self.vary:
            return ()
        from rodshell.refining.refine import FAMILIES as KNOWN
        from rodshell.refining.stiffness_families import Taper

        taper = Taper(ratio=self.ratio, per=self.per, varies=self.varies)
        return tuple(taper if name == "taper" else KNOWN[name] for name in self.vary)


class PatchTable(Table):
    """What a patch has of its own."""

    name: str = Field(description="name of the patch: A, B, ... from left to right")
    anchor: Point | None = Field(default=None, description="point x,y where its axes cross; default: its middle")
    rotate: Angle | None = Field(
        default=None, description="angle of its grid, seen from above; default: that of the whole grid"
    )
    spacing: Lengths | None = Field(default=None, description="distance between neighbouring rods: one length, or u,v")

    def build(self) -> "PatchLayout":
        from rodshell.formfinding.patches import PatchLayout

        return PatchLayout(self.anchor, self.rotate, self.spacing)


class SeamsTable(Table):
    lines: Polylines = Field(default=(), description='cuts "x,y; x,y" through the whole target; "|" between two')
    file: FileToRead | None = Field(default=None, description="OBJ, DXF or 3dm file with such lines")
    unit: Unit = Field(default=1.0, description="unit of that file, such as mm; a 3dm file states its own")
    patches: tuple[PatchTable, ...] = Field(
        default=(), description="overrides for patches, by name; in a case file only"
    )

    @model_validator(mode="before")
    @classmethod
    def _read_now(cls, given: dict[str, Any], info: ValidationInfo) -> dict[str, Any]:
        """The lines of the file become lines of the case, which then needs the file no longer."""
        if given.get("file") is None:
            return given
        from rodshell.targets.curve_files import read_lines

        rest = {key: value for key, value in given.items() if key not in ("file", "unit")}
        try:
            drawn = read_lines(file_path("the file", file_to_read(given["file"], info)), unit(given.get("unit", 1.0)))
        except InputError as reason:
            raise InputError(f"seams.file = {shown(given['file'])}: {reason}") from None
        return {**rest, "lines": [*polylines(given.get("lines", ())), *(line[:, :2].tolist() for line in drawn)]}

    @model_validator(mode="after")
    def _uses_all(self) -> Self:
        if self.unit != 1.0:  # with a file there is none left
            raise ValueError("seams.unit is the unit of seams.file, which is missing: leave it out, or give the file")
        if self.patches and not self.lines:
            raise ValueError("seams.patches needs seams: give seams.lines or seams.file, or leave it out")
        return self

    def patch_layouts(self) -> "dict[str, PatchLayout]":
        """What patches have of their own, by name.

        Raises
        ------
        InputError : two tables for one patch.
        """
        names = [patch.name for patch in self.patches]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"seams.patches has patch {shown(name)} twice: put all that it has in one table")
        return {patch.name: patch.build() for patch in self.patches}


class ChecksTable(Table):
    strength: Stress | None = Field(
        default=None, description="design strength in bending; default: a preset's by its code"
    )
    stages: Whole = Field(default=8, description="equilibria of the deployment from flat; 0: it is not computed")
    shear_strength: Stress | None = Field(
        default=None, description="shear strength along the fibres; default: a preset's, or von Mises"
    )


class FabricationTable(Table):
    end_allowance: Coordinate = Field(default=0.0, description="length added to each end of a rod, for its support")
    stock_length: Length | None = Field(
        default=None, description="length of the bars that rods are cut from; default: no limit"
    )
    kerf: Coordinate = Field(default=0.0, description="width of a saw cut; needs stock_length")


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
    paper: Literal["A4", "A3", "A2", "A1", "A0"] = Field(
        default="A3", description="size of the PDF's sheets, landscape"
    )
    project: str = Field(default="", description="project, for the title block")
    revision: str = Field(default="", description="revision, for the title block")
    tolerance: Length | None = Field(
        default=None, description="tolerance of lengths, which are shown to a tenth of it or finer"
    )
    layers: LayersTable = Field(default_factory=LayersTable)
    name: str = Field(default="", description="title of the drawings; default: the target's name")
    author: str = Field(default="", description="who drew them or is responsible for them, for the title block")
    date: IsoDate = Field(default="", description='date for the title block, such as "2026-11-22"; default: today')
