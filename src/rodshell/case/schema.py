"""The tables and keys of a case file, each listed once, with its type, default and help.

Those of targets, and of rods and joints, have modules of their own.
"""

from pathlib import Path, PureWindowsPath
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Self

from pydantic import Field, field_validator, model_validator

from rodshell.case.rod_tables import BallTable, JointKinds, RodTable
from rodshell.case.table import Table
from rodshell.case.target_tables import HemisphereTable, TargetTable
from rodshell.case.toml import toml_text
from rodshell.case.values import (
    Acceleration,
    Angle,
    AngleOrAuto,
    AngleStiffness,
    Coordinate,
    Counts,
    Duration,
    IsoDate,
    Length,
    LengthOrAuto,
    Lengths,
    LengthsOrAuto,
    NodeStiffness,
    Point,
    PointOrAuto,
    Polylines,
    Share,
    Stress,
    Unit,
    Whole,
    polylines,
    unit,
)
from rodshell.errors import InputError
from rodshell.units import length_text, rounded_down, shown

if TYPE_CHECKING:
    from rodshell.checks.sizing import Fit
    from rodshell.formfinding.fall import Fall
    from rodshell.formfinding.sewn import PatchLayout
    from rodshell.layout import GridLayout
    from rodshell.output.options import OutputOptions
    from rodshell.rods.section import Rod
    from rodshell.targets import Target


class LayoutTable(Table):
    rods: Counts = Field(default="auto", description='rods along x and y: 17x17, or "auto" for all that touch')
    spacing: LengthsOrAuto = Field(
        default="auto", description='between neighbouring rods: one length, or u,v, or "auto"'
    )
    length: LengthOrAuto = Field(default="auto", description='length of every rod before trimming, or "auto"')
    edge: LengthOrAuto = Field(default="auto", description='longest edge of the mesh, or "auto"')
    rotate: AngleOrAuto = Field(default=0.0, description='turn of the grid seen from above, or "auto": the best found')
    offset: Point = Field(default=(0.0, 0.0), description="shift x,y of the lattice against the axes")

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
    frames: str | None = Field(default=None, description="folder below --out for the frames of a fall; default: none")

    @field_validator("frames")
    @classmethod
    def _inside(cls, value: str | None) -> str | None:
        """A case from somebody else must not write to any place."""
        parts = PureWindowsPath("frames" if value is None else value).parts  # it knows both kinds of paths
        if not parts or ".." in parts or any(one in part for part in parts for one in "/\\:"):
            raise ValueError('frames are kept in the result\'s own folder: give a name in it such as "frames"')
        return value

    @model_validator(mode="after")
    def _uses_all(self) -> Self:
        for name in IDLE[self.method]:
            methods = " or ".join(f'"{method}"' for method in IDLE if name not in IDLE[method])
            self._refuse(name, f'method "{self.method}" has no {name}: leave it out, or set drape.method to {methods}')
        if self.coupling == "shared":
            for name in ("C1", "C2"):
                springs = 'leave it out, or set drape.coupling to "implicit" or "explicit"'
                self._refuse(name, f'coupling "shared" has no springs: {springs}')
        return self

    def _refuse(self, name: str, why: str) -> None:
        """ValueError where a key that does nothing is set."""
        if getattr(self, name) != type(self).model_fields[name].default:
            raise ValueError(f"drape.{name} = {shown(getattr(self, name))}: {why}")

    def fall(self) -> "Fall":
        """How the paper's method falls."""
        from rodshell.formfinding.fall import Fall
        from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs

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


class PatchTable(Table):
    """What a patch has of its own."""

    name: str = Field(description="name of the patch: A, B, ... from left to right")
    anchor: Point | None = Field(default=None, description="point x,y where its axes cross; default: its middle")
    rotate: Angle | None = Field(default=None, description="turn of its grid seen from above; default: as the whole's")
    spacing: Lengths | None = Field(default=None, description="between neighbouring rods: one length, or u,v")

    def build(self) -> "PatchLayout":
        from rodshell.formfinding.sewn import PatchLayout

        return PatchLayout(self.anchor, self.rotate, self.spacing)


class SeamsTable(Table):
    lines: Polylines = Field(default=(), description='lines x,y; x,y that cut the target, prolonged; "|" between two')
    file: str | None = Field(default=None, description="OBJ or DXF with such lines")
    unit: Unit = Field(default=1.0, description="the unit of that file, such as mm")
    patches: tuple[PatchTable, ...] = Field(default=(), description="what patches, by their names, have of their own")

    @model_validator(mode="before")
    @classmethod
    def _read_now(cls, given: dict[str, Any]) -> dict[str, Any]:
        """The lines of the file become lines of the case, which then needs the file no longer."""
        if given.get("file") is None:
            return given
        from rodshell.targets.curvefile import read_lines

        rest = {key: value for key, value in given.items() if key not in ("file", "unit")}
        try:
            drawn = read_lines(Path(given["file"]), unit(given.get("unit", 1.0)))
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

    def own(self) -> "dict[str, PatchLayout]":
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
    strength: Stress | None = Field(default=None, description="of the rods' material, by which utilisation is counted")
    stages: Whole = Field(default=8, description="equilibria of the way up from flat; 0: it is not followed")
    shear_strength: Stress | None = Field(
        default=None, description="in shear along the fibres; default: as von Mises has it"
    )


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
    tolerance: Length | None = Field(default=None, description="of lengths; they are shown to a tenth of it or finer")
    layers: LayersTable = LayersTable()
    name: str = Field(default="", description="title of the drawings; default: the target's name")
    author: str = Field(default="", description="for the title block: who drew or answers for the drawings")
    date: IsoDate = Field(default="", description='for the title block, "2026-11-22"; default: the day of writing')


class Built(NamedTuple):
    """A case as library objects; `drape_options` are keyword arguments of `formfinding.find_form`."""

    target: "Target"
    layout: "GridLayout"
    rod: "Rod"
    drape_options: dict[str, Any]


class Case(Table):
    """Everything that decides one job, complete and in SI. Make one with `load_case`."""

    target: TargetTable = Field(default=HemisphereTable(), discriminator="kind")
    layout: LayoutTable = LayoutTable()
    rod: RodTable = RodTable()
    joint: JointKinds = Field(default=BallTable(), discriminator="kind")
    drape: DrapeTable = DrapeTable()
    pop_up: PopUpTable = PopUpTable()
    seams: SeamsTable = SeamsTable()
    checks: ChecksTable = ChecksTable()
    fabrication: FabricationTable = FabricationTable()
    drawings: DrawingsTable = DrawingsTable()

    def to_toml(self) -> str:
        """The full input as a case file with SI numbers: loading it from anywhere gives the same case."""
        content = self.model_dump(exclude_none=True)
        for key in ("file", "boundary"):
            if key in content["target"]:
                content["target"][key] = str(Path(content["target"][key]).absolute())
        return toml_text(content)

    def rod_on(self, target: "Target", layout: "GridLayout", *, anchor: tuple[float, float] | None = None) -> "Rod":
        """The rod; material and section that were left to the target are chosen by the bends of its net."""
        return self.rod.build(lambda: self.fit_on(target, layout, anchor=anchor), strength=self.checks.strength)

    def fit_on(self, target: "Target", layout: "GridLayout", *, anchor: tuple[float, float] | None = None) -> "Fit":
        """What a rod that is left to the target has to fit."""
        from rodshell.checks.sizing import Fit

        return Fit.on(target, layout, anchor=anchor, joint=self.joint.build())

    def with_rod(self, rod: "Rod") -> "Case":
        """The same case with this rod spelled out."""
        return self.model_copy(update={"rod": RodTable.model_validate(rod.parameters())})

    @property
    def undecided(self) -> bool:
        """Whether anchor or heading are to be searched for."""
        return "auto" in (self.drape.anchor, self.layout.rotate)

    def decided(self, anchor: tuple[float, float], rotate: float) -> "Case":
        """The same case with its anchor [m] and heading [rad]: nothing is left to an objective."""
        drape = self.drape.model_copy(update={"anchor": anchor, "objective": "shear"})
        return self.headed(rotate).model_copy(update={"drape": drape})

    def headed(self, rotate: float) -> "Case":
        """The same case with its heading [rad]."""
        return self.model_copy(update={"layout": self.layout.model_copy(update={"rotate": rotate})})

    def build(self) -> Built:
        """The target, layout, rod and drape options.

        Raises
        ------
        InputError : values that are fine alone do not fit together, or the formula cannot be used.
        """
        ends = ("pinned", "clamped") if self.pop_up.ends == "both" else (self.pop_up.ends,)
        drape = self.drape
        if drape.objective != "shear" and not self.undecided:
            raise InputError(
                f"drape.objective = {shown(drape.objective)}: nothing is searched for: set drape.anchor or "
                'layout.rotate to "auto", or leave it out'
            )
        anchor = None if drape.anchor == "auto" else drape.anchor
        options: dict[str, Any] = {"method": drape.method, "anchor": anchor, "ends": ends}
        options["gravity"] = None if drape.method == "bound" else drape.gravity
        options["fall"] = drape.fall() if drape.method == "paper" else None
        options["joint"] = self.joint.build()
        target = self.target.build()
        layout = self.layout.build(target)
        self._require_stock(layout)
        rod = self.rod_on(target, layout, anchor=anchor)
        self.output_options().require_known_stress(rod, options["joint"])
        return Built(target, layout, rod, options)

    def _require_stock(self, layout: "GridLayout") -> None:
        """InputError where bars of stock are shorter than any two joints are apart: no rod could be spliced of them."""
        own = [patch.spacing for patch in self.seams.patches if patch.spacing is not None]
        shortest, stock = min(map(min, (layout.spacing, *own))), self.fabrication.stock_length
        if stock is not None and stock < shortest:
            raise InputError(
                f"fabrication.stock_length = {shown(stock)}: shorter than the {length_text(shortest)} between joints, "
                "of which no rod could be spliced: give longer stock"
            )

    def build_sewn(self) -> Built:
        """The same of a case with seams; the options are those of `rodshell.sew`.

        Raises
        ------
        InputError : moreover, keys that a form in patches does not have.
        """
        patches = "each patch of a target cut by seams has its own"
        for key, value, default, instead in (
            ("layout.rods", self.layout.rods, "auto", f'{patches}: use "auto"'),
            ("layout.length", self.layout.length, "auto", f'{patches}: use "auto"'),
            ("layout.offset", self.layout.offset, (0.0, 0.0), f"{patches}: leave it out"),
            ("drape.method", self.drape.method, "bound", 'seams need the bound drape: use "bound", or no seams'),
            ("drape.anchor", self.drape.anchor, None, f"{patches}: leave it out, or give it in seams.patches"),
            ("drape.objective", self.drape.objective, "shear", "with seams the fewest rods are left out: leave it out"),
        ):
            if value != default:
                raise InputError(f"{key} = {shown(value)}: {instead}")
        target, layout, rod, options = self.build()
        kept = {key: options[key] for key in ("joint", "ends")}
        return Built(target, layout, rod, {"seams": self.seams.lines, "own": self.seams.own(), **kept})

    def output_options(self) -> "OutputOptions":
        """What checks, workshop and drawings are told.

        Raises
        ------
        InputError : a value cannot be used.
        """
        from rodshell.fabrication import Fabrication
        from rodshell.output.options import DrawingStyle, OutputOptions

        style = self.drawings.model_dump(exclude={"layers"})
        layers = self.drawings.layers.model_dump(exclude_none=True)
        style["layers"] = {name.upper().replace("_", "-"): shown for name, shown in layers.items()}
        return OutputOptions(
            self.checks.strength,
            self.checks.stages,
            Fabrication(**self.fabrication.model_dump()),
            DrawingStyle(**style),
            rod_chosen=self.rod.left_open,
            shear_strength=self.checks.shear_strength,
        )
