"""The tables of loads: each with its name, and their combinations; what they hold is defined in `loads`."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Annotated, ClassVar

from rodshell.loads.kinds import DOME, Load
from rodshell.loads.settings import Bracing, PartOfSpan
from rodshell.quantities import Name, Share, Value
from rodshell.rods.design_strength import Duration
from rodshell.schema import Inline, Rows, value_of


def _factors(value: object) -> dict[str, float]:
    """A factor for each load: { own = 1.35, snow = 1.5 }."""
    if not isinstance(value, Mapping) or not value:
        raise ValueError("give a factor for each of its loads, such as { own = 1.35, snow = 1.5 }")
    return {str(name): float(value_of(Share, str(name), factor)) for name, factor in value.items()}


@dataclass(frozen=True, kw_only=True)
class NamedLoad:
    name: Annotated[Name, "name of the load, for combinations"]
    duration: Annotated[Duration | None, "how long it acts, for strengths; default: by the kind of load"] = None
    load: Annotated[Load, Inline]


@dataclass(frozen=True, kw_only=True)
class Combination:
    name: Annotated[Name, "name of the combination"]
    factors: Annotated[
        dict[str, float], Value(_factors), "factor of each load in it, such as { snow = 1.5 }"
    ] = field(hash=False)  # fmt: skip
    deflection: Annotated[PartOfSpan | None, 'how far a node may move: a length, or "span/200"'] = None


OWN, ACTING = 1.35, 1.5  # factors of permanent loads and of others [EN 1990, table A1.2(B), set B]
LIFTING = 1.0  # factor of a weight that holds the shell down
DIRECTIONS = 4


def usual_loads(snow: str | None = None, wind: str | None = None) -> dict[str, object]:
    """Own weight, and snow and wind where there are some, in the usual combinations: overrides for a case.

    Args:
        snow, wind: load on the plan, velocity pressure, such as "0.5 kN/m2".
    """
    loads: list[dict[str, object]] = [{"name": "own", "kind": "self_weight"}]
    combinations: list[dict[str, object]] = [{"name": "permanent", "factors": {"own": OWN}}]
    if snow is not None:
        loads.append({"name": "snow", "kind": "snow", "value": snow})
        combinations.append({"name": "winter", "factors": {"own": OWN, "snow": ACTING}})
    if wind is not None:
        loads.append({"name": "wind", "kind": "wind", "value": wind, "coefficient": DOME, "directions": DIRECTIONS})
        combinations.append({"name": "storm", "factors": {"own": LIFTING, "wind": ACTING}})
    return {"loads": loads, "combinations": combinations}


@dataclass(frozen=True)
class NoBracing:
    kind: ClassVar = "none"


BracingKinds = NoBracing | Bracing
LoadRows = Annotated[
    tuple[NamedLoad, ...],
    Rows("load", '[{ name = "snow", kind = "snow", value = "0.5 kN/m2" }]'),
    "file with [[loads]] and their [[combinations]]; in a case file tables",
]
CombinationRows = Annotated[
    tuple[Combination, ...],
    Rows("combination", '[{ name = "winter", factors = { snow = 1.5 } }]'),
    "combinations of loads; in a case file only",
]
