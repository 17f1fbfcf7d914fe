"""Lattices whose rods follow curves of the target: geodesics, for laths that lie flat, and asymptotic lines, for strips
that stand upright."""

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar, Protocol, Self

from rodshell.errors import InputError
from rodshell.quantities import Angle, LengthOrAuto, LengthsOrAuto, Names, Whole
from rodshell.units import NUMBER, rounded_down
from rodshell.validation import is_auto, number, numbers, positive, texts, whole

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

    @property
    def family_count(self) -> int:
        return 2
