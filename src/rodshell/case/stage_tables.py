"""The tables of a case's stages: layout, drape, pop-up and seams."""

from dataclasses import dataclass, fields
from math import pi
from pathlib import PureWindowsPath
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal

from rodshell.case.held import Holding
from rodshell.errors import InputError
from rodshell.layout.lattices import Asymptotic, Curves, Geodesic
from rodshell.quantities import (
    Acceleration,
    Angle,
    AngleOrAuto,
    AngleStiffness,
    Counts,
    Duration,
    FileToRead,
    FolderToWrite,
    Length,
    LengthOrAuto,
    LengthsOrAuto,
    Names,
    NodeStiffness,
    Numbers,
    Point,
    PointOrAuto,
    Polylines,
    Ratio,
    Share,
    Unit,
    words,
)
from rodshell.rods.support_groups import Group
from rodshell.rods.supports import BOTH, AskedName, SupportName
from rodshell.schema import Inline, Rows, written
from rodshell.targets.patch_layout import PatchLayout
from rodshell.units import rounded_down, shown

if TYPE_CHECKING:
    from rodshell.formfinding.methods import Method
    from rodshell.layout import GridLayout
    from rodshell.refining.variables import Family
    from rodshell.targets import Target


@dataclass(frozen=True, kw_only=True)
class LayoutTable(Holding):
    """An inextensible net of straight rods: a lattice of equal spacing in the flat grid."""

    rods: Annotated[Counts, 'numbers of rods along x and y: 17x17, or "auto": all that touch'] = "auto"
    spacing: Annotated[LengthsOrAuto, 'distance between neighbouring rods: one length, or u,v, or "auto"'] = "auto"
    length: Annotated[LengthOrAuto, 'length of every rod before trimming, or "auto"'] = "auto"
    edge: Annotated[LengthOrAuto, 'longest edge of the mesh, or "auto"'] = "auto"
    rotate: Annotated[AngleOrAuto, 'angle of the grid, seen from above, or "auto": the best found'] = 0.0
    offset: Annotated[Point, "shift x,y of the grid lines from the axes through the anchor"] = (0.0, 0.0)
    crossing: Annotated[Angle, "angle between both families on the target, at the anchor"] = pi / 2
    left_out: Annotated[Names, "names of rods that are not built, such as U01, V03"] = ()

    kind: ClassVar[str] = "chebyshev"

    def build(self, target: "Target | None" = None) -> "GridLayout":
        """The layout; a spacing "auto" stands for some 17 rods each way over the target."""
        from rodshell.layout import GridLayout

        spacing = self.spacing
        if spacing == "auto":
            spacing = (rounded_down((target.size if target else 0.2) / 8),) * 2
        rotate = 0.0 if self.rotate == "auto" else self.rotate
        keys = {name: value for name, value in written(self).items() if name != "kind"}
        return GridLayout.orthogonal(**(keys | {"spacing": spacing, "rotate": rotate}))


@dataclass(frozen=True, kw_only=True)
class DrawnCurves(Curves):
    """Curves, of which a file may give the lines; a case that was read has them itself."""

    file: Annotated[FileToRead | None, "CSV table (rod,x,y[,z]), OBJ, DXF or 3dm file with a curve a rod"] = None
    unit: Annotated[Unit, "unit of that file, such as mm; a 3dm file states its own"] = 1.0

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.unit != 1.0:
            raise InputError("layout.unit is the unit of layout.file, which is missing: leave it out, or give the file")


LayoutKinds = LayoutTable | Geodesic | Asymptotic | DrawnCurves


FALLING = ("height", "coupling", "C1", "C2", "time_step", "duration", "friction", "drag", "frames")
IDLE: dict[str, tuple[str, ...]] = {"bound": ("gravity", *FALLING), "gravity": FALLING, "paper": ()}
"""Keys of [drape] that a method does not use."""


@dataclass(frozen=True, kw_only=True)
class DrapeTable(Holding):
    method: Annotated[
        Literal["bound", "gravity", "paper"], "bound to the target; hung on it by gravity; or dropped on it (paper)"
    ] = "bound"
    anchor: Annotated[PointOrAuto | None, 'point x,y where the axes cross; default: the highest point; or "auto"'] = (
        None
    )
    objective: Annotated[
        Literal["shear", "curvature", "gap"], 'what the search for an "auto" anchor or angle minimises'
    ] = "shear"
    gravity: Annotated[Acceleration, "acceleration of gravity, for methods gravity and paper"] = 9.81
    height: Annotated[Length, "height from which the rods fall (method paper)"] = 0.05
    coupling: Annotated[
        Literal["shared", "implicit", "explicit"], "joints of falling rods: a shared node, or springs (method paper)"
    ] = "shared"
    C1: Annotated[NodeStiffness | None, "stiffness of the springs between nodes; default: from the rods"] = None
    C2: Annotated[AngleStiffness | None, "stiffness of the springs between twists; default: from the rods"] = None
    time_step: Annotated[Duration | None, "time step of a fall; default: 10 ms, or by the stability limit"] = None
    duration: Annotated[Duration | None, "longest duration of a fall; default: 6 s at a size of 0.2 m"] = None
    friction: Annotated[Share, "coefficient of friction between falling rods and target"] = 0.0
    drag: Annotated[Share | None, "air drag: rate in 1/s; default: 12 on a target of 0.2 m"] = None
    frames: Annotated[FolderToWrite | None, "subfolder of the result for the steps of a fall; default: none"] = None

    def __post_init__(self) -> None:
        parts = PureWindowsPath("frames" if self.frames is None else self.frames).parts  # it knows both kinds of paths
        if not parts or ".." in parts or any(letter in part for part in parts for letter in "/\\:"):
            raise InputError(  # a case from somebody else must not write to any place
                f"drape.frames = {shown(self.frames)}: frames are kept in the result's folder: give a name in it such "
                'as "frames"'
            )
        defaults: dict[str, tuple[object, ...]] = {each.name: (each.default,) for each in fields(self)}
        defaults["drag"] = (None, 0.0)  # until November 2026, which cases of results hold
        for name in [*IDLE[self.method], *(("C1", "C2") if self.coupling == "shared" else ())]:
            if getattr(self, name) not in defaults[name]:
                raise InputError(f"drape.{name} = {shown(getattr(self, name))}: {self._why_idle(name)}")

    def _why_idle(self, name: str) -> str:
        """Why a key does nothing here, and what to do."""
        if name in IDLE[self.method]:
            methods = " or ".join(f'"{method}"' for method in IDLE if name not in IDLE[method])
            return f'method "{self.method}" has no {name}: leave it out, or set drape.method to {methods}'
        return 'coupling "shared" has no springs: leave it out, or set drape.coupling to "implicit" or "explicit"'

    def build(self) -> "Method":
        """The method with its options."""
        from rodshell.formfinding.methods import Bound, Fall, Gravity
        from rodshell.joints import ExplicitPenalty, ImplicitPenalty, SharedDofs

        if self.method == "bound":
            return Bound()
        if self.method == "gravity":
            return Gravity(acceleration=self.gravity)
        penalty = ImplicitPenalty if self.coupling == "implicit" else ExplicitPenalty
        coupling = SharedDofs() if self.coupling == "shared" else penalty(C1=self.C1, C2=self.C2)
        return Fall(
            acceleration=self.gravity, height=self.height, coupling=coupling, time_step=self.time_step,
            duration=self.duration, friction=self.friction, drag=self.drag, stream=self.frames,
        )  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class PopUpTable(Holding):
    ends: Annotated[AskedName, "supports: free to turn, with fixed direction, or one form with each"] = BOTH


SupportRows = Annotated[
    tuple[Group, ...],
    Rows("support", '[{ at = "y > 3.9 m", kind = "free" }]'),
    "groups of rod ends that are supported alike; in a case file only",
]


FAMILIES = ("taper", "double", "sections", "tails", "clamps", "supports", "holes", "offsets")


@dataclass(frozen=True, kw_only=True)
class RefineTable:
    vary: Annotated[Annotated[tuple[str, ...], words(FAMILIES)], ", ".join(FAMILIES)] = ()
    ends: Annotated[SupportName | None, "supports of the refined shell; default: the first of pop_up.ends"] = None
    ratio: Annotated[Ratio, "of the largest EI to the smallest along a taper"] = 8.0
    per: Annotated[
        Literal["shell", "family", "rod"], "one taper for the shell, one for each family, or for each rod"
    ] = "shell"
    varies: Annotated[
        Literal["size", "width", "height", "a", "b"], "what of the section a taper changes: all lengths, or one"
    ] = "size"
    under: Annotated[str, "meet the target under nothing, weight, or a combination of loads"] = "nothing"
    tolerance: Annotated[Length | None, "largest error of a span as it is built; default: 0.05 % of the size"] = None
    start: Annotated[Numbers | None, "design to begin with, as an interrupted search prints it"] = None

    def build(self) -> "tuple[Family, ...]":
        """The families that are varied."""
        if not self.vary:
            return ()
        from rodshell.refining.refine import FAMILIES as KNOWN
        from rodshell.refining.stiffness_families import Taper

        taper = Taper(ratio=self.ratio, per=self.per, varies=self.varies)
        return tuple(taper if name == "taper" else KNOWN[name] for name in self.vary)


OPEN = ("section", "bracing", "spacing")


@dataclass(frozen=True, kw_only=True)
class DesignTable:
    """What is chosen so that the shell carries the loads of the case with their reserve."""

    open: Annotated[
        Annotated[tuple[str, ...], words(OPEN)], f"what the loads decide: {', '.join(OPEN)}"
    ] = ()  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class NamedPatch:
    name: Annotated[str, "name of the patch: A, B, ... from left to right"]
    layout: Annotated[PatchLayout, Inline]


@dataclass(frozen=True, kw_only=True)
class SeamsTable:
    lines: Annotated[Polylines, 'cuts "x,y; x,y" through the whole target; "|" between two'] = ()
    file: Annotated[FileToRead | None, "OBJ, DXF or 3dm file with such lines"] = None
    unit: Annotated[Unit, "unit of that file, such as mm; a 3dm file states its own"] = 1.0
    patches: Annotated[
        tuple[NamedPatch, ...],
        Rows("patch", '[{ name = "B", rotate = "10 deg" }]'),
        "overrides for patches, by name; in a case file only",
    ] = ()

    def __post_init__(self) -> None:
        if self.unit != 1.0:  # the lines of a file were read, which leaves none
            raise InputError("seams.unit is the unit of seams.file, which is missing: leave it out, or give the file")
        if self.patches and not self.lines:
            raise InputError("seams.patches needs seams: give seams.lines or seams.file, or leave it out")

    def patch_layouts(self) -> dict[str, PatchLayout]:
        """What patches have of their own, by name.

        Raises:
            InputError: two tables for one patch.
        """
        names = [patch.name for patch in self.patches]
        for name in names:
            if names.count(name) > 1:
                raise InputError(f"seams.patches has patch {shown(name)} twice: put all that it has in one table")
        return {patch.name: patch.layout for patch in self.patches}
