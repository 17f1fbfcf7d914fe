"""The tables of loads: each kind of load, their combinations, the bracing and how stability is looked at."""

from collections.abc import Mapping
from math import inf
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import BeforeValidator, Field, model_validator

from rodshell.case.rod_tables import (
    CircleTable,
    EllipseTable,
    GivenTable,
    MaterialTable,
    RectangleTable,
    TubeTable,
)
from rodshell.case.values import (
    Angle,
    Distance,
    Factor,
    Force,
    ForcePerLength3,
    Forces3,
    KelvinChange,
    MassPerArea,
    Point,
    Point3,
    Pressure,
    Share,
    SlipMoment,
    Stiffness,
    Stress,
    Table,
    Whole,
    not_negative,
    polylines,
    positive,
)
from rodshell.errors import InputError
from rodshell.units import read_quantity, shown

if TYPE_CHECKING:
    from rodshell.loads.bracing import Cables
    from rodshell.loads.combinations import Stability
    from rodshell.loads.kinds import Load
    from rodshell.loads.laths import Laths
    from rodshell.loads.locked_joints import LockedJoints
    from rodshell.loads.strength import Strength
    from rodshell.rods.section import Rod


def _coefficient(value: object) -> float | str:
    """A number, or a formula."""
    try:
        return read_quantity(value, "number")
    except ValueError:
        if isinstance(value, str):
            return value
        raise


def _line(value: object) -> tuple[tuple[float, float], ...]:
    """Points of one line: [[x, y], [x, y]], or "x, y; x, y"."""
    rows = polylines(value if isinstance(value, str) else [value])
    if len(rows) != 1:
        raise ValueError('give one line of two points or more, such as "-1, 0; 1, 0"')
    return rows[0]


def _pattern(value: object) -> str:
    """ "both", "one" or "every = n"."""
    from rodshell.layout.cells import Pattern

    if not isinstance(value, str):
        raise ValueError('give "both", "one" or "every = 2"')
    try:
        Pattern.of(value)
    except InputError as reason:
        raise ValueError(str(reason)) from None
    return value


DiagonalPattern = Annotated[str, BeforeValidator(_pattern)]


def _names(value: object) -> tuple[str, ...]:
    """Names: ["U01.0", "U02.0"] or "U01.0, U02.0"."""
    items = [item.strip() for item in value.split(",")] if isinstance(value, str) else value
    if not isinstance(items, list | tuple) or not items or not all(isinstance(item, str) and item for item in items):
        raise ValueError('give names of rod ends, such as ["U01.0", "U02.1"]')
    return tuple(items)


def _factors(value: object) -> dict[str, float]:
    """A factor for each load: { own = 1.35, snow = 1.5 }."""
    if not isinstance(value, Mapping) or not value:
        raise ValueError("give a factor for each of its loads, such as { own = 1.35, snow = 1.5 }")
    found = {}
    for name, factor in value.items():
        try:
            found[str(name)] = not_negative("number")(factor)
        except ValueError as reason:
            raise ValueError(f"{name} = {shown(factor)}: {reason}") from None
    return found


def _imperfection(value: object) -> str | float:
    """A length, or a part of the span as "span/500"."""
    before, _, part = value.partition("/") if isinstance(value, str) else ("", "", "")
    try:
        if before.strip() != "span":
            return positive("length")(value)
        return f"span/{positive('number')(part):g}"
    except ValueError as reason:
        raise ValueError(f'{reason}, or a part of the span such as "span/500"') from None


LoadDuration = Literal["permanent", "long", "medium", "short", "instantaneous"]


class LoadTable(Table):
    """Keys of every load."""

    name: str = Field(min_length=1, description="name of the load, for combinations")
    duration: LoadDuration | None = Field(
        default=None, description="how long it acts, for strengths; default: by the kind of load"
    )

    def build(self) -> "Load":
        """The load.

        Raises
        ------
        InputError : values do not fit together.
        """
        from rodshell.loads import kinds

        classes = {
            "self_weight": kinds.SelfWeight, "snow": kinds.Snow, "wind": kinds.Wind, "point": kinds.PointLoad,
            "line": kinds.LineLoad, "settlement": kinds.Settlement, "temperature": kinds.Temperature,
        }  # fmt: skip
        made: Load = classes[self.kind](**self.model_dump(exclude={"kind", "name", "duration"}))  # type: ignore[attr-defined]
        return made


class SelfWeightTable(LoadTable):
    kind: Literal["self_weight"] = "self_weight"
    cladding: MassPerArea = Field(default=0.0, description="mass of the cladding, of the surface")


class SnowTable(LoadTable):
    kind: Literal["snow"] = "snow"
    value: Pressure = Field(description="snow load, of the plan")
    distribution: Literal["uniform", "half", "drifted"] = Field(
        default="uniform", description="everywhere, on one half, or as a drift"
    )
    direction: Angle = Field(default=0.0, description="towards which a half or drifted load lies, seen from above")


class WindTable(LoadTable):
    kind: Literal["wind"] = "wind"
    value: Pressure = Field(description="velocity pressure")
    coefficient: Annotated[float | str, BeforeValidator(_coefficient)] = Field(
        description="pressure coefficient, positive onto the shell: a number, or a formula in x along the wind and y"
    )
    direction: Angle = Field(default=0.0, description="in which the wind blows, seen from above")


class PointTable(LoadTable):
    kind: Literal["point"] = "point"
    at: Point = Field(description="point x,y of the plan")
    force: Forces3 = Field(description="force along x,y,z; upwards positive")


class LineTable(LoadTable):
    kind: Literal["line"] = "line"
    line: Annotated[tuple[tuple[float, float], ...], BeforeValidator(_line)] = Field(
        description='line "x,y; x,y" of the plan'
    )
    force: ForcePerLength3 = Field(description="force along x,y,z per length of the line's plan")


class SettlementTable(LoadTable):
    kind: Literal["settlement"] = "settlement"
    supports: Annotated[tuple[str, ...], BeforeValidator(_names)] = Field(description='rod ends such as "U03.1"')
    move: Point3 = Field(description="movement along x,y,z")


class TemperatureTable(LoadTable):
    kind: Literal["temperature"] = "temperature"
    change: KelvinChange = Field(description="change of temperature of all rods")
    expansion: Annotated[float, BeforeValidator(positive("number"))] = Field(
        description="coefficient of thermal expansion along the rods, per kelvin"
    )


AnyLoad = SelfWeightTable | SnowTable | WindTable | PointTable | LineTable | SettlementTable | TemperatureTable
LoadKinds = Annotated[AnyLoad, Field(discriminator="kind")]


class CombinationTable(Table):
    name: str = Field(min_length=1, description="name of the combination")
    factors: Annotated[dict[str, float], BeforeValidator(_factors)] = Field(
        description="factor of each load in it, such as { own = 1.35, snow = 1.5 }"
    )


BracingSection = CircleTable | TubeTable | RectangleTable | EllipseTable | GivenTable


class BracingMaterialTable(MaterialTable):
    """The material of the bracing."""

    _path = "bracing.material"


class BracingTable(Table):
    """Keys of every bracing."""

    @model_validator(mode="before")
    @classmethod
    def _without_empty_tables(cls, given: dict[str, Any]) -> dict[str, Any]:
        """A table without keys stands for none; keys without a kind of bracing for a mistake."""
        kept = {key: value for key, value in given.items() if value not in ({}, None)}
        if kept.get("kind") == "none" and len(kept) > 1:
            path, value = next(item for item in kept.items() if item[0] != "kind")
            while isinstance(value, Mapping):
                name, value = next(((key, item) for key, item in value.items() if key != "kind"), ("kind", "circle"))
                path = f"{path}.{name}"
            raise ValueError(
                f'bracing.{path} = {shown(value)}: there is no bracing: set bracing.kind to "cables" or "laths"'
            )
        return kept

    def _rod(self) -> "Rod | None":
        """Section and material; None where neither is given."""
        section, material = getattr(self, "section", None), getattr(self, "material", None)
        if section is None and material is None:
            return None
        if section is None:
            raise InputError(
                "bracing.section is missing: give the section of the bracing, or leave its material out too"
            )
        if getattr(section, "radius", None) == "auto":
            raise InputError('bracing.section.radius = "auto": nothing decides it: give a length such as "3 mm"')
        if section.kind != "given" and material is None:
            raise InputError("bracing.material is missing: give the material of the bracing")
        from rodshell.rods.section import Rod

        return Rod(section.build(), None if material is None else material.build())


class NoBracingTable(BracingTable):
    kind: Literal["none"] = "none"

    def build(self) -> None:
        """No bracing."""


class CablesTable(BracingTable):
    kind: Literal["cables"] = "cables"
    pattern: DiagonalPattern = Field(default="both", description='diagonals: "both" of a cell, "one", or "every = n"')
    prestrain: Share = Field(default=0.0, description="strain by which cables are shortened when they are put in")
    ends_at: Literal["joints", "supports"] = Field(
        default="joints", description="where cables end: at the outermost joints, or at the supports"
    )
    across_openings: Literal["refuse", "leave out"] = Field(
        default="refuse", description="what becomes of diagonals across an opening"
    )
    section: BracingSection | None = Field(default=None, discriminator="kind")
    material: BracingMaterialTable | None = None

    def build(self) -> "Cables":
        """The cables.

        Raises
        ------
        InputError : section or material is missing.
        """
        from rodshell.loads.bracing import Cables

        rod = self._rod()
        if rod is None:
            raise InputError("bracing.section is missing: give section and material of the cables")
        given = self.model_dump(exclude={"kind", "section", "material"})
        return Cables(rod=rod, **given)


class LathsTable(BracingTable):
    kind: Literal["laths"] = "laths"
    pattern: DiagonalPattern = Field(default="one", description='diagonals: "both" of a cell, "one", or "every = n"')
    eccentricity: Distance = Field(default=0.0, description="distance of the laths' centre lines from the outer rods'")
    across_openings: Literal["refuse", "leave out"] = Field(
        default="refuse", description="what becomes of diagonals across an opening"
    )
    section: BracingSection | None = Field(default=None, discriminator="kind")
    material: BracingMaterialTable | None = None

    def build(self) -> "Laths":
        """The laths; without section and material they are rods of the grid.

        Raises
        ------
        InputError : section or material is missing.
        """
        from rodshell.loads.laths import Laths

        return Laths(rod=self._rod(), **self.model_dump(exclude={"kind", "section", "material"}))


BracingKinds = NoBracingTable | CablesTable | LathsTable


class LockedJointsTable(Table):
    shear: Stiffness | None = Field(
        default=None,
        description="stiffness about the normal of pins tightened after erection",
    )
    slip: SlipMoment | None = Field(default=None, description="moment at which they slip; default: not checked")

    def build(self) -> "LockedJoints | None":
        """What it says; None where no joint is locked.

        Raises
        ------
        InputError : a moment without a stiffness, or a stiffness of zero.
        """
        if self.shear is None:
            if self.slip is not None:
                raise InputError("locked_joints.shear is missing: give the stiffness of the tightened pins")
            return None
        from rodshell.loads.locked_joints import LockedJoints

        return LockedJoints(shear=inf if isinstance(self.shear, str) else self.shear, slip=self.slip)


class StabilityTable(Table):
    imperfection: Annotated[str | float, BeforeValidator(_imperfection)] | None = Field(
        default=None, description='largest imperfection: a length, or "span/500"; default: none'
    )
    modes: Whole = Field(default=3, description="number of buckling modes, each of which is tried as imperfection")

    def build(self) -> "Stability":
        """What it says."""
        from rodshell.loads.combinations import Stability

        return Stability(imperfection=self.imperfection, modes=self.modes)


def _service_class(value: object) -> int | None:
    """1, 2 or 3."""
    if value is None:
        return None
    found = read_quantity(value, "number")
    if found not in (1, 2, 3):
        raise ValueError("must be 1 (inside), 2 (covered) or 3 (in the weather)")
    return int(found)


ServiceClass = Annotated[Literal[1, 2, 3], BeforeValidator(_service_class)]


class StrengthTable(Table):
    permanent: Stress | None = Field(
        default=None,
        description="design strength under permanent loads; default: a preset's",
    )
    long: Stress | None = Field(default=None, description="under loads of months; default: permanent")
    medium: Stress | None = Field(default=None, description="the same under loads of weeks; default: the long one")
    short: Stress | None = Field(default=None, description="the same under loads of days; default: the medium one")
    instantaneous: Stress | None = Field(default=None, description="the same under gusts; default: the short one")
    erection: Stress | None = Field(default=None, description="the same during deployment; default: the short one")
    service_class: ServiceClass | None = Field(
        default=None, description="of timber: 1 inside, 2 covered (default), 3 in the weather"
    )
    hole: Distance = Field(default=0.0, description="diameter of the bolts' holes through the rods at joints")
    slip: Force | None = Field(default=None, description="axial force that a joint transfers before it slips")
    effective_length: Factor = Field(
        default=1.0, description="effective length of a span between joints, over its length"
    )

    def build(self) -> "Strength":
        """What it says."""
        from rodshell.loads.strength import Strength

        return Strength(**self.model_dump())
