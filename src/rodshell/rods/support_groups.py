"""Supports that differ by groups of rod ends: held, free, sliding, or on springs that yield.

Rod ends are moved to their places and held there while the shell pops up; then each group is let go as it can move.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, ClassVar, NamedTuple, Self

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.quantities import Direction3, Stiffness3, Value
from rodshell.rods.supports import Support
from rodshell.schema import checked
from rodshell.units import read_quantity, shown
from rodshell.validation import brief, described, direction, instance, listed, texts

if TYPE_CHECKING:
    from rodshell.rods.elements import Elements

ALL = "all"
AXES = "xyz"
NO_FORCE = 1e-6  # of the largest: a rod end with less is free: that is round-off
_WANTED = 'give "all", names such as "U03.0, U04.1", or where they are, such as "y > 3.9 m" or "x < 0 m and z < 1 m"'


class _Side(NamedTuple):
    """The rod ends on one side of a plane: whose coordinate times `sign` is larger than `least` times it [m]."""

    axis: int
    sign: float
    least: float

    def holds(self, points: Floats) -> Bools:
        return np.asarray(self.sign * points[:, self.axis] > self.sign * self.least)


def _sides(text: str) -> tuple[_Side, ...] | None:
    """Of a condition on places; None: it is not one."""
    found = []
    for part in text.split(" and "):
        sign = 1.0 if ">" in part else -1.0
        axis, _, limit = part.replace("<", ">").partition(">")
        if axis.strip() not in tuple(AXES) or not limit.strip():
            return None
        found.append(_Side(AXES.index(axis.strip()), sign, read_quantity(limit.strip(), "length")))
    return tuple(found)


def _at(value: object) -> str:
    """Which rod ends, as text."""
    if isinstance(value, list | tuple) and value and all(isinstance(name, str) for name in value):
        value = ", ".join(value)
    if not isinstance(value, str) or not value.strip():
        raise ValueError(_WANTED)
    text = value.strip()
    if text != ALL and ("<" in text or ">" in text) and _sides(text) is None:
        raise ValueError(_WANTED)
    return text


def _checked_at(name: str, value: object) -> str:
    try:
        return _at(value)
    except ValueError as reason:
        raise InputError(f"{name}: {reason}, not {described(value)}") from None


At = Annotated[str, Value(_at, _checked_at), "rod ends: all, names, or where they are"]


@dataclass(frozen=True, kw_only=True)
class _Group:
    """Rod ends that are supported alike.

    Args:
        at: "all"; names such as "U03.0, U04.1"; or a condition such as "y > 3.9 m" on where they are supported.
    """

    at: At = ALL

    __repr__ = brief

    def __post_init__(self) -> None:
        checked(self, {"at": "the rod ends of a support", "stiffness": "the {} of a support"})

    def numbers(self, points: Floats, names: Sequence[str]) -> Ints:
        """Numbers of its rod ends, at `points` (2m, 3) and with these names.

        Raises:
            InputError: there are none, or not one of a name.
        """
        if self.at == ALL:
            return np.arange(len(points))
        if sides := _sides(self.at):
            found = np.flatnonzero(np.logical_and.reduce([side.holds(points) for side in sides]))
            if not len(found):
                low, high = points.min(axis=0), points.max(axis=0)
                extent = ", ".join(
                    f"{axis} from {a:.4g} to {b:.4g} m" for axis, a, b in zip(AXES, low, high, strict=True)
                )
                raise InputError(f"no rod end is where a support says, {shown(self.at)}: they have {extent}")
            return found
        wanted = [name.strip() for name in self.at.split(",")]
        for name in wanted:
            if name not in names:
                raise InputError(
                    f"a support is for the rod end {shown(name)}, which the shell does not have: its rod ends are "
                    f'{names[0]}, {names[1]} to {names[-1]}; or say where they are, such as "y > 3.9 m"'
                )
        return np.array([names.index(name) for name in wanted], dtype=np.intp)

    def ways(self) -> tuple[Sequence[float], ...]:
        """Directions at right angles along which its rod ends move."""
        return tuple(np.eye(3))

    def against(self) -> Floats:
        """(k, 3) directions along which something acts against it."""
        return np.zeros((0, 3))


@dataclass(frozen=True, kw_only=True, repr=False)
class HeldEnds(_Group):
    """Rod ends that are held in place, free to turn."""

    kind: ClassVar = "held"

    def ways(self) -> tuple[Sequence[float], ...]:
        return ()

    def against(self) -> Floats:
        return np.eye(3)


@dataclass(frozen=True, kw_only=True, repr=False)
class FreeEnds(_Group):
    """Rod ends that nothing holds, as along the open side of a shell."""

    kind: ClassVar = "free"


@dataclass(frozen=True, kw_only=True, repr=False)
class SlidingEnds(_Group):
    """Rod ends that slide along a line without friction."""

    kind: ClassVar = "sliding"
    along: Annotated[Direction3, "direction along which they slide, x, y, z"]

    def __post_init__(self) -> None:
        super().__post_init__()
        along = direction("the direction along which rod ends slide", self.along)
        object.__setattr__(self, "along", tuple(along.tolist()))

    def ways(self) -> tuple[Sequence[float], ...]:
        return (self.along,)

    def against(self) -> Floats:
        return np.asarray(np.eye(3) - np.outer(self.along, self.along))


@dataclass(frozen=True, kw_only=True, repr=False)
class SprungEnds(_Group):
    """Rod ends on springs along x, y and z, at rest where the ends are to stand.

    Args:
        stiffness: of the three springs [N/m]; one value is for all.
    """

    kind: ClassVar = "sprung"
    stiffness: Annotated[Stiffness3, "of springs along x, y and z; one value is for all"]

    def against(self) -> Floats:
        return np.eye(3)[np.flatnonzero(self.stiffness)]


Group = HeldEnds | FreeEnds | SlidingEnds | SprungEnds


@dataclass(frozen=True)
class SupportGroups(Support):
    """Supports by groups of rod ends; one that is in several is as the last of them says, in none is held.

    Args:
        groups: in this order.
        ends_named: (2m,) names of the rod ends, by which groups find them; set where a shell is popped up.
    """

    name: str = "given"
    groups: tuple[Group, ...] = ()
    ends_named: tuple[str, ...] = field(default=(), repr=False, compare=False)

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.holds_directions:
            raise InputError("groups of supports hold no directions: give each group its kind")
        groups = tuple(listed("groups of supports", self.groups, "rodshell.FreeEnds(...) and the like"))
        for group in groups:
            instance("a group of supports", group, Group, "rodshell.HeldEnds, FreeEnds, SlidingEnds or SprungEnds")
        object.__setattr__(self, "groups", groups)
        object.__setattr__(self, "ends_named", texts("the names of rod ends", self.ends_named, "names such as U01.0"))

    @property
    def note(self) -> str:
        return " and ".join(dict.fromkeys(group.kind for group in self.groups)) or "held"

    def named(self, names: Sequence[str]) -> Self:
        return replace(self, ends_named=tuple(names))

    def group_of(self, points: Floats) -> list[Group]:
        """Of each rod end.

        Raises:
            InputError: a group has no rod end.
        """
        found: list[Group] = [HeldEnds()] * len(points)
        for group in self.groups:
            for end in group.numbers(points, self.ends_named):
                found[end] = group
        return found

    def free(self, points: Floats) -> Mapping[int, Sequence[Sequence[float]]]:
        """See `Support.free`.

        Raises:
            InputError: the shell can move as a whole; a group has no rod end.
        """
        groups = self.group_of(points)
        away = (points - points.mean(axis=0)) / max(float(np.ptp(points, axis=0).max()), 1e-300)
        held = [
            (way, np.cross(place, way)) for group, place in zip(groups, away, strict=True) for way in group.against()
        ]
        if not held or np.linalg.matrix_rank(np.reshape(held, (-1, 6)), tol=1e-6) < 6:
            raise InputError(
                "the supports let the shell move as a whole: hold, or put on springs, three rod ends that do not lie "
                "in a line"
            )
        return {end: ways for end, group in enumerate(groups) if (ways := group.ways())}

    def energies(self, ends: Ints, points: Floats) -> "Sequence[Elements]":
        from rodshell.rods.point_springs import PointSprings  # here, as it needs Numba

        groups = self.group_of(points)
        sprung = [end for end, group in enumerate(groups) if isinstance(group, SprungEnds)]
        stiffness = [group.stiffness for group in groups if isinstance(group, SprungEnds)]
        return [PointSprings(ends[sprung, None], points[sprung], np.array(stiffness))] if sprung else []

    def figures(self, moved: Floats, forces: Floats) -> Mapping[str, tuple[float, str]]:
        far, without = np.sqrt((moved**2).sum(axis=1)), unheld(forces)
        each = {"of a free rod end": without, "of a support": ~without}
        largest = {what: float(far[rows].max(initial=0.0)) for what, rows in each.items()}
        return {f"largest displacement {what}": (most, "m") for what, most in largest.items() if most}


def unheld(forces: Floats) -> Bools:
    """(2m,) which rod ends nothing holds, by the forces (2m, 3) of the supports [N]."""
    size = np.sqrt((np.nan_to_num(forces) ** 2).sum(axis=1))
    return np.asarray(size <= NO_FORCE * size.max(initial=0.0))
