"""The tables of loads: each kind of load, their combinations, the bracing and how stability is looked at."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Literal

from pydantic import BeforeValidator, Field

from rodshell.case.values import (
    Angle,
    ForcePerLength3,
    Forces3,
    KelvinChange,
    MassPerArea,
    Point,
    Point3,
    Pressure,
    Table,
    Whole,
    not_negative,
    polylines,
    positive,
)
from rodshell.units import read_quantity, shown

if TYPE_CHECKING:
    from rodshell.loads.kinds import Load, Stability


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


class LoadTable(Table):
    """Keys of every load."""

    name: str = Field(min_length=1, description="name of the load, for combinations")

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
        made: Load = classes[self.kind](**self.model_dump(exclude={"kind", "name"}))  # type: ignore[attr-defined]
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


AnyLoad = (
    SelfWeightTable | SnowTable | WindTable | PointTable | LineTable | SettlementTable | TemperatureTable
)
LoadKinds = Annotated[AnyLoad, Field(discriminator="kind")]


class CombinationTable(Table):
    name: str = Field(min_length=1, description="name of the combination")
    factors: Annotated[dict[str, float], BeforeValidator(_factors)] = Field(
        description="factor of each load in it, such as { own = 1.35, snow = 1.5 }"
    )


class StabilityTable(Table):
    imperfection: Annotated[str | float, BeforeValidator(_imperfection)] | None = Field(
        default=None, description='largest imperfection: a length, or "span/500"; default: none'
    )
    modes: Whole = Field(default=3, description="number of buckling modes that imperfections have")

    def build(self) -> "Stability":
        """What it says."""
        from rodshell.loads.kinds import Stability

        return Stability(imperfection=self.imperfection, modes=self.modes)
