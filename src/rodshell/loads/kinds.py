"""Kinds of loads, each as fixed forces on the nodes: they keep their size and direction while the shell moves.

Weight, snow and wind act on the areas that belong to each node (`tributary`), of the shell as it stands unloaded. Wind
acts along the surface's normal there and does not turn with it: it is not a follower load. Settlement and temperature
are not forces: they move supports, or change the length at which rods are free of stress.

A new kind is a class here and a member of `Load`. How long each acts where that is not given, `lasting`, is that of
[EN 1995-1-1, table 2.2; imposed loads: medium]; codes of some countries count snow as medium.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from math import degrees, pi
from typing import TYPE_CHECKING, Annotated, ClassVar, Literal, Protocol, runtime_checkable

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.quantities import (
    Angle,
    ForcePerLength3,
    Forces3,
    KelvinChange,
    Line,
    MassPerArea,
    PerKelvin,
    Point,
    Point3,
    Pressure,
    Value,
    Whole,
)
from rodshell.rods.design_strength import Duration
from rodshell.schema import checked
from rodshell.units import read_quantity, shown
from rodshell.validation import listed, number, point, texts, whole

if TYPE_CHECKING:
    from rodshell.loads.nodes import LoadedNodes
    from rodshell.targets.heightfield import Formula

GRAVITY = 9.81  # [m/s2]
SAMPLES = 400  # parts of a line load
_ROOF_SNOW = np.radians([30.0, 60.0]), [0.8, 0.0]  # on what lies on the ground, by slope
_LARGEST_COEFFICIENT = 20.0  # of wind on a surface; codes have up to about 3


@dataclass(frozen=True, kw_only=True)
class SelfWeight:
    """Weight of rods and joints, and of cladding [kg/m2]."""

    kind: ClassVar = "self_weight"
    lasting: ClassVar[Duration] = "permanent"
    cladding: Annotated[MassPerArea, "mass of the cladding, of the surface"] = 0.0

    def __post_init__(self) -> None:
        checked(self, "the {}")

    def forces(self, nodes: "LoadedNodes") -> Floats:
        """(n, 3) [N].

        Raises:
            InputError: the rods have no mass.
        """
        if not nodes.mass.all():
            raise InputError("the rods have no mass, so that their weight is not known: give rod.section.mass")
        return nodes.downwards(GRAVITY * (nodes.mass + self.cladding * nodes.tributary.area))


@dataclass(frozen=True)
class Snow:
    """Snow on the plan.

    Args:
        distribution: "uniform"; "half": on the half of the plan that lies towards `direction`, none on the other;
            "drifted": on both halves a triangle, from 0 at the edge and the middle to the value at the quarter towards
            `direction`, to half of it at the other quarter, as the drifted load of cylindrical roofs [EN 1991-1-3,
            5.3.5].
        of: "roof": the value is what lies there; "ground": 0.8 of it where the surface rises by up to 30 degrees, none
            from 60 degrees on, and linear in between [EN 1991-1-3, table 5.2].
    """

    kind: ClassVar = "snow"
    lasting: ClassVar[Duration] = "short"
    value: Annotated[Pressure, "snow load, of the plan"]
    distribution: Annotated[
        Literal["uniform", "half", "drifted"], "everywhere, on one half, or as a drift"
    ] = "uniform"  # fmt: skip
    direction: Annotated[Angle, "towards which a half or drifted load lies, seen from above"] = 0.0
    of: Annotated[Literal["roof", "ground"], "where the value is measured; the ground's lies by slope"] = "roof"

    def __post_init__(self) -> None:
        checked(self, "the snow's {}")

    def forces(self, nodes: "LoadedNodes") -> Floats:
        """(n, 3) [N]."""
        plan = nodes.tributary.plan
        if self.of == "ground":
            plan = plan * np.interp(nodes.slopes, *_ROOF_SNOW)
        if self.distribution == "uniform":
            return nodes.downwards(self.value * plan)
        along = nodes.along(self.direction)[:, 0]
        half = float(np.abs(along).max())
        if self.distribution == "half":
            share = 0.5 * (1.0 + np.sign(np.where(np.abs(along) > 1e-9 * half, along, 0.0)))
        else:
            peak = np.where(along > 0, 1.0, 0.5)
            share = peak * (1.0 - np.abs(np.abs(along) / (0.5 * half) - 1.0))
        return nodes.downwards(self.value * share * plan)


DOME = "dome"
_DOME = "-0.8 - 0.35*x + 0.95*x^2"  # 0.5 at its windward edge, x = -1, and -0.2 at its lee, x = 1


def _coefficient(value: object) -> float | str:
    """A number, a formula, or "dome"."""
    try:
        return read_quantity(value, "number")
    except ValueError:
        if isinstance(value, str):
            return value
        raise


@dataclass(frozen=True)
class Wind:
    """Wind pressure along the surface's normal.

    Args:
        coefficient: pressure coefficient, positive towards the surface from above: a number, or a formula in x along
            the wind and y across it, from the middle of the plan's extent in both [m], such as "-1.2 + 0.1*x"; or
            "dome": about that of low domes [after EN 1991-1-4, 7.2.8], from the windward edge of the plan to its lee.
    """

    kind: ClassVar = "wind"
    lasting: ClassVar[Duration] = "short"
    value: Annotated[Pressure, "velocity pressure"]
    coefficient: Annotated[
        float | str,
        Value(_coefficient),
        'pressure coefficient, positive onto the shell: a number, "dome", or a formula in x along the wind and y',
    ]
    direction: Annotated[Angle, "in which the wind blows, seen from above"] = 0.0
    directions: Annotated[Whole, "number of directions, all around from that one: a combination for each"] = 1

    def __post_init__(self) -> None:
        checked(self, "the wind's {}")
        whole("the number of the wind's directions", self.directions, 1, 360)
        if self._formula is None:
            object.__setattr__(self, "coefficient", number("the wind's coefficient", self.coefficient))
            self._require_usual(abs(float(self.coefficient)), "")

    def _require_usual(self, largest: float, where: str) -> None:
        """InputError where that is not the pressure coefficient of any surface."""
        if largest > _LARGEST_COEFFICIENT:
            raise InputError(
                f"the wind's coefficient {shown(self.coefficient)} reaches {largest:.4g}{where}: pressure coefficients "
                f"lie between -3 and 3, and none above {_LARGEST_COEFFICIENT:g} is taken"
            )

    @property
    def each(self) -> "dict[str, Wind]":
        """The wind from each of its directions, by what is said of it; of one that is nothing."""
        if self.directions == 1:
            return {"": self}
        turns = [2.0 * pi * k / self.directions for k in range(self.directions)]
        names = [f", wind at {degrees(self.direction + turn) % 360:.4g} deg" for turn in turns]
        winds = [replace(self, direction=self.direction + turn, directions=1) for turn in turns]
        return dict(zip(names, winds, strict=True))

    @cached_property
    def _formula(self) -> "Formula | None":
        if not isinstance(self.coefficient, str):
            return None
        from rodshell.targets.heightfield import parse_formula  # here, as it needs SciPy

        return parse_formula(_DOME if self.coefficient == DOME else self.coefficient)

    def forces(self, nodes: "LoadedNodes") -> Floats:
        """(n, 3) [N].

        Raises:
            InputError: the formula is not finite at a node.
        """
        coefficient = np.full(len(nodes.positions), 0.0 if self._formula else float(self.coefficient))
        if self._formula is not None:
            x, y = nodes.along(self.direction).T
            x = x / np.abs(x).max() if self.coefficient == DOME else x
            with np.errstate(all="ignore"):  # what is not finite is refused
                coefficient = np.broadcast_to(np.asarray(self._formula(x, y), dtype=float), x.shape)
            if not np.isfinite(coefficient).all():
                k = int(np.argmin(np.isfinite(coefficient)))
                raise InputError(
                    f"the wind's coefficient {shown(self.coefficient)} is {coefficient[k]} at x = {x[k]:.4g} m, "
                    f"y = {y[k]:.4g} m: give a formula that is finite everywhere on the shell"
                )
            k = int(np.argmax(np.abs(coefficient)))
            self._require_usual(float(np.abs(coefficient[k])), f" at x = {x[k]:.4g} m, y = {y[k]:.4g} m")
        return np.asarray(-self.value * coefficient[:, None] * nodes.tributary.vectors)


@dataclass(frozen=True)
class PointLoad:
    """A force [N] on the node that is nearest in plan."""

    kind: ClassVar = "point"
    lasting: ClassVar[Duration] = "medium"
    at: Annotated[Point, "point x,y of the plan"]
    force: Annotated[Forces3, "force along x,y,z; upwards positive"]

    def __post_init__(self) -> None:
        checked(self, {"at": "the point of a load", "force": "the force of a point load"})

    def forces(self, nodes: "LoadedNodes") -> Floats:
        """(n, 3) [N].

        Raises:
            InputError: no rod is near.
        """
        result = np.zeros_like(nodes.positions)
        result[nodes.nearest(self.at, "a point load")] = self.force
        return result


@dataclass(frozen=True)
class LineLoad:
    """A load along a line of two points or more of the plan [N/m]."""

    kind: ClassVar = "line"
    lasting: ClassVar[Duration] = "medium"
    line: Annotated[Line, 'line "x,y; x,y" of the plan']
    force: Annotated[ForcePerLength3, "force along x,y,z per length of the line's plan"]

    def __post_init__(self) -> None:
        line = listed("the line of a load", self.line, "points x, y in m")
        if len(line) < 2:
            raise InputError("a line load needs two points or more")
        object.__setattr__(self, "line", tuple(point("a point of a line load", place) for place in line))
        checked(self, "the {} of a line load")

    def forces(self, nodes: "LoadedNodes") -> Floats:
        """(n, 3) [N].

        Raises:
            InputError: a part of the line is away from every rod.
        """
        result, line = np.zeros_like(nodes.positions), np.array(self.line)
        lengths = np.linalg.norm(np.diff(line, axis=0), axis=1)
        for a, b, length in zip(line[:-1], line[1:], lengths, strict=True):
            count = max(1, round(SAMPLES * float(length / lengths.sum())))
            for share in (np.arange(count) + 0.5) / count:
                node = nodes.nearest((1 - share) * a + share * b, "a line load")
                result[node] += np.array(self.force) * length / count
        return result


def _rod_ends(value: object) -> tuple[str, ...]:
    """Names: ["U01.0", "U02.0"] or "U01.0, U02.0"."""
    items = [item.strip() for item in value.split(",")] if isinstance(value, str) else value
    if not isinstance(items, list | tuple) or not items or not all(isinstance(item, str) and item for item in items):
        raise ValueError('give names of rod ends, such as ["U01.0", "U02.1"]')
    return tuple(items)


@dataclass(frozen=True)
class Settlement:
    """Movement [m] of supports, which are rod ends such as "U03.1" (0 the start, 1 the end)."""

    kind: ClassVar = "settlement"
    lasting: ClassVar[Duration] = "permanent"
    supports: Annotated[tuple[str, ...], Value(_rod_ends), 'rod ends such as "U03.1"']
    move: Annotated[Point3, "movement along x,y,z"]

    def __post_init__(self) -> None:
        wanted = 'a list of rod ends such as ["U03.1"]'
        object.__setattr__(self, "supports", texts("the supports of a settlement", self.supports, wanted))
        if not self.supports:
            raise InputError('a settlement needs supports: give rod ends such as "U03.1"')
        checked(self, "the {}ment of supports")


@dataclass(frozen=True)
class Temperature:
    """Change of temperature of all rods, not of the bracing."""

    kind: ClassVar = "temperature"
    lasting: ClassVar[Duration] = "medium"
    change: Annotated[KelvinChange, "change of temperature of all rods"]
    expansion: Annotated[PerKelvin, "coefficient of thermal expansion along the rods, per kelvin"]

    def __post_init__(self) -> None:
        checked(self, {"change": "the {} of temperature", "expansion": "the thermal {}"})

    @property
    def strain(self) -> float:
        """Strain of rods free of stress [-]."""
        return self.change * self.expansion


@runtime_checkable
class Forces(Protocol):
    """Loads that are forces; one's own, which no case file names, need no more than this (`examples/own_load.py`)."""

    lasting: ClassVar[Duration]

    def forces(self, nodes: "LoadedNodes") -> Floats:
        """(n, 3) on each node [N]."""
        ...


Load = SelfWeight | Snow | Wind | PointLoad | LineLoad | Settlement | Temperature
