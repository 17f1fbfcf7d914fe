"""Kinds of loads, each as fixed forces on the nodes: they keep their size and direction while the shell moves.

Weight, snow and wind act on the areas that belong to each node (`tributary`), of the shell as it stands unloaded. Wind
acts along the surface's normal there and does not turn with it: it is not a follower load. Settlement and temperature
are not forces: they move supports, or change the length at which rods are free of stress.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from math import cos, sin
from typing import Literal, get_args

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.loads.tributary import Tributary
from rodshell.targets.heightfield import Formula, parse_formula
from rodshell.units import length_text, shown
from rodshell.validation import brief, choice, keep, listed, not_negative, number, numbers, point, positive, texts

GRAVITY = 9.81  # [m/s2]
Distribution = Literal["uniform", "half", "drifted"]
REACH = 1.0  # distances of two rods: a point load farther from every rod is refused
SAMPLES = 400  # parts of a line load
LARGEST_COEFFICIENT = 20.0  # of wind on a surface; codes have up to about 3


@dataclass(frozen=True, eq=False)
class LoadedNodes:
    """The nodes of a shell that loads act on.

    Parameters
    ----------
    positions : (n, 3) of the unloaded shell [m].
    mass : (n,) of rods and joints, lumped [kg].
    tributary : areas of the target that each node takes.
    spacing : distance of two neighbouring rods [m].
    """

    positions: Floats
    mass: Floats
    tributary: Tributary
    spacing: float

    __repr__ = brief

    def along(self, direction: float) -> Floats:
        """(n, 2) middles of the nodes' plan areas in axes along a `direction` [rad] and across it, from the middle of
        the plan's extent in each of them [m]."""
        x, y = self.tributary.plan_positions.T
        axes = np.array([cos(direction) * x + sin(direction) * y, cos(direction) * y - sin(direction) * x])
        return np.asarray((axes - 0.5 * (axes.min(axis=1) + axes.max(axis=1))[:, None]).T)

    def nearest(self, at: Sequence[float], what: str) -> int:
        """The node that is nearest to a point of the plan [m].

        Raises
        ------
        InputError : `what` acts there, and no rod is near.
        """
        away = np.linalg.norm(self.positions[:, :2] - np.asarray(at), axis=1)
        nearest = int(np.argmin(away))
        if away[nearest] > REACH * self.spacing:
            raise InputError(
                f"{what} acts at ({at[0]:g}, {at[1]:g}) m, {length_text(float(away[nearest]))} away from the nearest "
                "rod: move it onto the shell"
            )
        return nearest


@dataclass(frozen=True, kw_only=True)
class SelfWeight:
    """Weight of rods and joints, and of cladding.

    Parameters
    ----------
    cladding : mass of the cladding, of the surface [kg/m2].
    """

    cladding: float = 0.0

    def __post_init__(self) -> None:
        keep(self, not_negative, "kg/m2", "cladding", what="the {}")

    def forces(self, nodes: LoadedNodes) -> Floats:
        """(n, 3) [N].

        Raises
        ------
        InputError : the rods have no mass.
        """
        if not nodes.mass.all():
            raise InputError("the rods have no mass, so that their weight is not known: give rod.section.mass")
        return _downwards(GRAVITY * (nodes.mass + self.cladding * nodes.tributary.area))


@dataclass(frozen=True)
class Snow:
    """Snow on the plan.

    Parameters
    ----------
    value : of the plan [N/m2].
    distribution : "uniform"; "half": on the half of the plan that lies towards `direction`, none on the other;
        "drifted": on both halves a triangle, from 0 at the edge and the middle to the value at the quarter towards
        `direction`, to half of it at the other quarter, as the drifted load of cylindrical roofs [EN 1991-1-3, 5.3.5].
    direction : towards which the snow lies or is blown, in plan from the x axis [rad].
    """

    value: float
    distribution: Distribution = "uniform"
    direction: float = 0.0

    def __post_init__(self) -> None:
        keep(self, not_negative, "N/m2", "value", what="the snow")
        keep(self, number, "rad", "direction", what="the snow's {}")
        choice("the snow's distribution", self.distribution, get_args(Distribution))

    def forces(self, nodes: LoadedNodes) -> Floats:
        """(n, 3) [N]."""
        if self.distribution == "uniform":
            return _downwards(self.value * nodes.tributary.plan)
        along = nodes.along(self.direction)[:, 0]
        half = float(np.abs(along).max())
        if self.distribution == "half":
            share = 0.5 * (1.0 + np.sign(np.where(np.abs(along) > 1e-9 * half, along, 0.0)))
        else:
            peak = np.where(along > 0, 1.0, 0.5)
            share = peak * (1.0 - np.abs(np.abs(along) / (0.5 * half) - 1.0))
        return _downwards(self.value * share * nodes.tributary.plan)


@dataclass(frozen=True)
class Wind:
    """Wind pressure along the surface's normal.

    Parameters
    ----------
    value : velocity pressure [N/m2].
    coefficient : pressure coefficient, positive towards the surface from above: a number, or a formula in x along the
        wind and y across it, from the middle of the plan's extent in both [m], such as "-1.2 + 0.1*x".
    direction : in which it blows, in plan from the x axis [rad].
    """

    value: float
    coefficient: float | str
    direction: float = 0.0

    def __post_init__(self) -> None:
        keep(self, not_negative, "N/m2", "value", what="the wind")
        keep(self, number, "rad", "direction", what="the wind's {}")
        if isinstance(self.coefficient, str):
            parse_formula(self.coefficient)
        else:
            keep(self, number, "", "coefficient", what="the wind's {}")
            self._require_usual(np.array([self.coefficient], dtype=float), "")

    def _require_usual(self, coefficients: Floats, where: str) -> None:
        """InputError where one is not the pressure coefficient of any surface."""
        if (largest := float(np.abs(coefficients).max(initial=0.0))) > LARGEST_COEFFICIENT:
            raise InputError(
                f"the wind's coefficient {shown(self.coefficient)} reaches {largest:.4g}{where}: pressure coefficients "
                f"lie between -3 and 3, and none above {LARGEST_COEFFICIENT:g} is taken"
            )

    @cached_property
    def _formula(self) -> Formula | None:
        return parse_formula(self.coefficient) if isinstance(self.coefficient, str) else None

    def forces(self, nodes: LoadedNodes) -> Floats:
        """(n, 3) [N].

        Raises
        ------
        InputError : the formula is not finite at a node.
        """
        coefficient = np.full(len(nodes.positions), 0.0 if self._formula else float(self.coefficient))
        if self._formula is not None:
            x, y = nodes.along(self.direction).T
            with np.errstate(all="ignore"):  # what is not finite is refused
                coefficient = np.broadcast_to(np.asarray(self._formula(x, y), dtype=float), x.shape)
            if not np.isfinite(coefficient).all():
                k = int(np.argmin(np.isfinite(coefficient)))
                raise InputError(
                    f"the wind's coefficient {shown(self.coefficient)} is {coefficient[k]} at x = {x[k]:.4g} m, "
                    f"y = {y[k]:.4g} m: give a formula that is finite everywhere on the shell"
                )
            k = int(np.argmax(np.abs(coefficient)))
            self._require_usual(coefficient, f" at x = {x[k]:.4g} m, y = {y[k]:.4g} m")
        return np.asarray(-self.value * coefficient[:, None] * nodes.tributary.vectors)


@dataclass(frozen=True)
class PointLoad:
    """A force on the node that is nearest in plan.

    Parameters
    ----------
    at : x, y of the plan [m].
    force : [N], upwards positive.
    """

    at: tuple[float, float]
    force: tuple[float, float, float]

    def __post_init__(self) -> None:
        force = numbers("the force of a point load", self.force, "three finite numbers in N", 3, "N")
        object.__setattr__(self, "at", point("the point of a load", self.at))
        object.__setattr__(self, "force", force)

    def forces(self, nodes: LoadedNodes) -> Floats:
        """(n, 3) [N].

        Raises
        ------
        InputError : no rod is near.
        """
        result = np.zeros_like(nodes.positions)
        result[nodes.nearest(self.at, "a point load")] = self.force
        return result


@dataclass(frozen=True)
class LineLoad:
    """A load along a line of the plan.

    Parameters
    ----------
    line : x, y of two points or more of the plan [m].
    force : of the line's length in plan [N/m], upwards positive.
    """

    line: tuple[tuple[float, float], ...]
    force: tuple[float, float, float]

    def __post_init__(self) -> None:
        line = listed("the line of a load", self.line, "points x, y in m")
        if len(line) < 2:
            raise InputError("a line load needs two points or more")
        force = numbers("the force of a line load", self.force, "three finite numbers in N/m", 3, "N/m")
        object.__setattr__(self, "line", tuple(point("a point of a line load", place) for place in line))
        object.__setattr__(self, "force", force)

    def forces(self, nodes: LoadedNodes) -> Floats:
        """(n, 3) [N].

        Raises
        ------
        InputError : a part of the line is away from every rod.
        """
        result, line = np.zeros_like(nodes.positions), np.array(self.line)
        lengths = np.linalg.norm(np.diff(line, axis=0), axis=1)
        for a, b, length in zip(line[:-1], line[1:], lengths, strict=True):
            count = max(1, round(SAMPLES * float(length / lengths.sum())))
            for share in (np.arange(count) + 0.5) / count:
                node = nodes.nearest((1 - share) * a + share * b, "a line load")
                result[node] += np.array(self.force) * length / count
        return result


@dataclass(frozen=True)
class Settlement:
    """Movement of supports.

    Parameters
    ----------
    supports : names of rod ends, such as "U03.1" (0 the start, 1 the end).
    move : [m].
    """

    supports: tuple[str, ...]
    move: tuple[float, float, float]

    def __post_init__(self) -> None:
        wanted = 'a list of rod ends such as ["U03.1"]'
        object.__setattr__(self, "supports", texts("the supports of a settlement", self.supports, wanted))
        if not self.supports:
            raise InputError('a settlement needs supports: give rod ends such as "U03.1"')
        move = numbers("the movement of supports", self.move, "three finite numbers in m", 3, "m")
        object.__setattr__(self, "move", move)


@dataclass(frozen=True)
class Temperature:
    """Change of temperature of all rods, not of the bracing.

    Parameters
    ----------
    change : [K].
    expansion : coefficient of thermal expansion along the rods [1/K].
    """

    change: float
    expansion: float

    def __post_init__(self) -> None:
        keep(self, number, "K", "change", what="the {} of temperature")
        keep(self, positive, "1/K", "expansion", what="the thermal {}")

    @property
    def strain(self) -> float:
        """Strain of rods free of stress [-]."""
        return self.change * self.expansion


Load = SelfWeight | Snow | Wind | PointLoad | LineLoad | Settlement | Temperature
Forces = SelfWeight | Snow | Wind | PointLoad | LineLoad
"""Loads that are forces."""


def _downwards(size: Floats) -> Floats:
    result = np.zeros((len(size), 3))
    result[:, 2] = -size
    return result
