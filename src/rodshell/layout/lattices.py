"""Lattices whose rods follow curves of the target: geodesics, for laths that lie flat, asymptotic lines, for strips
that stand upright, and curves that are given."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Literal, Protocol, Self, get_args

import numpy as np

from rodshell.errors import InputError
from rodshell.quantities import Angle, LengthOrAuto, LengthsOrAuto, Names, Strokes, Whole
from rodshell.units import NUMBER, rounded_down
from rodshell.validation import array, choice, finite, is_auto, listed, number, numbers, positive, texts, whole

Rest = Literal["straight", "curved"]
EDGES_A_SPAN = 6  # edges of the mesh per spacing, where the edge is "auto"


class Sized(Protocol):
    """A target, as far as it matters here."""

    @property
    def size(self) -> float:
        """Half its largest width [m]."""


@dataclass(frozen=True, kw_only=True)
class SurfaceLattice(ABC):
    """Families of rods along curves of the target.

    Args:
        spacing: between the rods of a family, where they cross the curve through the anchor from which they are set out
            [m]: of the first family and of the others, or one length for all; "auto" for an eighth of the target's
            size.
        edge: longest edge of the mesh [m]; "auto" for a sixth of the smaller spacing.
        rotate: angle of the first family against the target's x axis, in plan at the anchor [rad].
        left_out: names of rods that are not built.

    Raises:
        InputError: a value of the wrong kind or not finite; a spacing or an edge that is not positive; an edge longer
            than the spacing.
    """

    spacing: Annotated[LengthsOrAuto | float, "distance between neighbouring rods: one, or first,others"] = "auto"
    edge: Annotated[LengthOrAuto, 'longest edge of the mesh, or "auto"'] = "auto"
    rotate: Annotated[Angle, "angle of the first family at the anchor, seen from above"] = 0.0
    left_out: Annotated[Names, "names of rods that are not built, such as U01, V03"] = ()

    kind: ClassVar[str]
    upright: ClassVar[bool] = False  # whether its rods are strips that stand on edge
    closer: ClassVar[str] = "a smaller spacing"
    elsewhere: ClassVar[str] = "another anchor or layout.rotate"
    """What sets its rods closer, or elsewhere on the target, in words."""

    @property
    @abstractmethod
    def family_count(self) -> int:
        """Number of families."""

    @property
    def spacings(self) -> tuple[float, ...]:
        """Of each family [m].

        Raises:
            InputError: they are "auto", which `build` decides for a target.
        """
        if not isinstance(self.spacing, tuple):
            raise InputError('the spacing "auto" depends on the target: build(target) gives the lattice there')
        return (*self.spacing, *self.spacing[1:] * (self.family_count - 2))

    @property
    def least_spacing(self) -> float:
        """The smallest spacing [m]."""
        return min(self.spacings)

    @property
    def most_spacing(self) -> float:
        """The largest spacing [m]."""
        return max(self.spacings)

    @property
    def longest_edge(self) -> float:
        """Of the mesh [m]."""
        return self.least_spacing / EDGES_A_SPAN if self.edge == "auto" else self.edge

    def __post_init__(self) -> None:
        values: dict[str, object] = {
            "rotate": number("layout rotate", self.rotate, "rad"),
            "left_out": texts("layout left_out", self.left_out, "names of rods"),
        }
        if not is_auto(self.edge):
            values["edge"] = positive("layout edge", self.edge, "m")
        if not is_auto(self.spacing):
            given = (self.spacing,) * 2 if isinstance(self.spacing, NUMBER) else self.spacing
            pair = numbers("layout spacing", given, "one length or two in m", 2)
            values["spacing"] = tuple(positive("layout spacing", size, "m") for size in pair)
        for name, value in values.items():
            object.__setattr__(self, name, value)
        if {"edge", "spacing"} <= values.keys() and self.longest_edge > self.least_spacing:
            raise InputError(
                f"layout edge {self.edge} m is longer than the spacing {self.least_spacing} m: use a shorter edge"
            )

    def parameters(self) -> dict[str, object]:
        """The lattice in SI."""
        known: dict[str, object] = {"kind": self.kind, "families": self.family_count, "rotate": self.rotate}
        return known | {"spacing": self.spacings[:2], "edge": self.longest_edge}

    def build(self, target: Sized | None = None) -> Self:
        """The lattice with the spacing for a target."""
        size = target.size if target else 0.2
        return replace(self, spacing=rounded_down(size / 8)) if self.spacing == "auto" else self


@dataclass(frozen=True, kw_only=True)
class Geodesic(SurfaceLattice):
    """Laths that lie flat on the target, along geodesics, set out at equal arcs of a geodesic through the anchor that
    they cross at right angles. Developed, each lath is straight.

    Args:
        families: 2, at right angles at the anchor, or 3, at 60 degrees; the third is shifted by half a spacing, so that
            two laths meet at each crossing, not nearly three.
    """

    families: Annotated[Whole, "number of families of laths, 2 or 3"] = 2

    kind = "geodesic"

    def __post_init__(self) -> None:
        super().__post_init__()
        if whole("layout families", self.families, 2) > 3:
            raise InputError(f"layout families must be 2 or 3, not {self.families}")

    @property
    def family_count(self) -> int:
        return self.families


@dataclass(frozen=True, kw_only=True)
class Asymptotic(SurfaceLattice):
    """Strips that stand upright on a saddle-shaped target, along its two families of asymptotic lines. Of the two lines
    through the anchor the one nearer to `rotate` is of the first family."""

    kind = "asymptotic"
    upright = True

    @property
    def family_count(self) -> int:
        return 2


@dataclass(frozen=True, kw_only=True)
class Curves(SurfaceLattice):
    """Rods along curves that are given, in plan or in space; they are joined wherever two of them cross.

    Args:
        lines: points (n, 2) or (n, 3) of each rod [m]: in plan, which are lifted onto the target, or near the target,
            which are moved onto it. A smooth curve leads through the points of a rod, of two a straight one in plan. A
            rod that leads past the end of the target ends there.
        names: of the rods; none: R01, R02 and so on.
        rest: "straight"; or "curved", as the line is when the target's surface along it is unrolled, so that a lath
            does not bend about its strong axis where it lies on the target.
        rotate: angle by which the lines are turned about the z axis [rad].
        spacing: that is usual between the rods, on which edges and the least distance of a joint from a rod's end
            depend [m]; "auto": twice the area that the lines cover over their length.

    Raises:
        InputError: also a line of other points; another number of names, or one that occurs twice.
    """

    lines: Annotated[Strokes, 'points of each rod, "x,y,z; x,y,z" or in plan; "|" between two rods'] = ()
    names: Annotated[Names, "names of the rods; default: R01, R02, ..."] = ()
    rest: Annotated[Rest, "straight rods, or rods cut so that none bends within the surface"] = "straight"

    kind = "curves"
    closer, elsewhere = "lines that lie closer", "other lines"

    def __post_init__(self) -> None:
        super().__post_init__()
        lines = []
        for k, line in enumerate(listed("layout lines", self.lines, "the points of each rod"), start=1):
            points = array(f"line {k} of the layout", line, np.float64, None, None)
            if len(points) < 2 or points.shape[1] not in (2, 3):
                raise InputError(
                    f"line {k} of the layout is of the shape {points.shape}: a rod needs two or more points, of two or "
                    "three coordinates"
                )
            lines.append(tuple(map(tuple, finite(f"line {k} of the layout", points, *points.shape).tolist())))
        object.__setattr__(self, "lines", tuple(lines))
        choice("layout rest", self.rest, get_args(Rest))
        names = texts("layout names", self.names, "names of rods") or tuple(f"R{k + 1:02d}" for k in range(len(lines)))
        object.__setattr__(self, "names", names)
        if len(names) != len(lines) or len(set(names)) != len(names):
            raise InputError(
                f"layout names has {len(set(names))} different names for {len(lines)} lines: give each line "
                "its own, or leave them out"
            )

    @property
    def family_count(self) -> int:
        return 1

    def build(self, target: Sized | None = None) -> Self:
        """The lattice with a spacing.

        Raises:
            InputError: there are no lines.
        """
        if not self.lines:
            raise InputError('a layout of kind "curves" needs lines: give layout.file, or layout.lines')
        if self.spacing != "auto":
            return self
        plans = [np.array(line)[:, :2] for line in self.lines]
        first, last = (np.concatenate([plan[part] for plan in plans]) for part in (slice(None, -1), slice(1, None)))
        lengths = np.linalg.norm(last - first, axis=1)
        points = np.vstack([first, 0.5 * (first + last), last])
        weights = np.outer([1, 4, 1], lengths).ravel()  # Simpson
        about = points - np.average(points, axis=0, weights=weights)
        spread = np.linalg.det(about.T @ (weights[:, None] * about) / max(weights.sum(), 1e-300))
        area = 12.0 * np.sqrt(max(float(spread), 0.0))  # of a rectangle, whose sides have the variances a^2 / 12
        if not area > 1e-6 * lengths.sum() ** 2 / len(plans) ** 2:
            raise InputError("the lines of the layout cover no area: give curves that cross each other")
        spacing = rounded_down(2.0 * area / float(lengths.sum()))
        return replace(self, spacing=(spacing, spacing))
