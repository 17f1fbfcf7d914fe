"""Supports that differ by groups of rod ends: held, free, sliding, on springs that yield, or joined by beams.

Rod ends are moved to their places and held there while the shell pops up; then each group is let go as it can move.
Beams along the edge are fitted before that. A rod end on a beam is held as another group says, and by the beam alone
where none has it.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING, Annotated, ClassVar, NamedTuple, Self

import numpy as np

from rodshell.arrays import Bools, Floats, Ints
from rodshell.errors import InputError
from rodshell.quantities import Direction3, Share, Stiffness, Stiffness3, Value
from rodshell.rods.section import Rod
from rodshell.rods.supports import BeamAlong, Support
from rodshell.schema import Inline, checked
from rodshell.units import read_quantity, shown
from rodshell.validation import brief, described, direction, instance, listed, texts

if TYPE_CHECKING:
    from rodshell.rods.elements import Elements

ALL = "all"
AXES = "xyz"
NO_FORCE = 1e-6  # of the largest: a rod end with less is free: that is round-off
COINCIDENT = 1e-6  # of the size: rod ends nearer to each other have no beam between them
_GROUPS = "rodshell.HeldEnds, ClampedEnds, FreeEnds, SlidingEnds, SprungEnds, EdgeBeam, Ring or Arch"
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
        checked(
            self,
            {
                "at": "the rod ends of a support",
                "stiffness": "the {} of a support",
                "creep": "the {} of an edge beam",
                "turning": "the stiffness of a clamp",
            },
        )

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
        """(k, 3) directions along which something always acts against it; these alone must keep the shell from moving
        as a whole."""
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
class ClampedEnds(HeldEnds):
    """Rod ends that are held in place and against turning; a rod may spin in its clamp.

    Args:
        turning: of the clamp, such as that of a column's foot [N m/rad]; None: rigid.
    """

    kind: ClassVar = "clamped"
    turning: Annotated[Stiffness | None, "stiffness against turning; default: rigid"] = None


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


@dataclass(frozen=True, kw_only=True, repr=False)
class EdgeBeam(_Group):
    """Rod ends joined by a beam along the edge from the first of them to the last, each free to turn on it.

    The beam is made to the edge as drawn, where it is free of stress; the first axis of its section points along the
    normal of the shell.

    Args:
        rod: its section and material.
        creep: by how much its deflections grow under permanent loads, 0 of steel; None: as its material's preset says.
    """

    kind: ClassVar = "edge_beam"
    closed: ClassVar = False
    rod: Annotated[Rod, Inline]
    creep: Annotated[Share | None, "growth of its deflections under permanent loads; default: its preset's"] = None

    def __post_init__(self) -> None:
        super().__post_init__()
        instance("the rod of an edge beam", self.rod, Rod)


@dataclass(frozen=True, kw_only=True, repr=False)
class Ring(EdgeBeam):
    """As `EdgeBeam`, closed."""

    kind: ClassVar = "ring"
    closed: ClassVar = True


@dataclass(frozen=True, kw_only=True, repr=False)
class Arch(EdgeBeam):
    """As `EdgeBeam`, its first and last rod end held where no other group has them."""

    kind: ClassVar = "arch"


Group = HeldEnds | ClampedEnds | FreeEnds | SlidingEnds | SprungEnds | EdgeBeam | Ring | Arch


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
        groups = tuple(listed("groups of supports", self.groups, "rodshell.FreeEnds(...) and the like"))
        for group in groups:
            instance("a group of supports", group, Group, _GROUPS)
        object.__setattr__(self, "groups", groups)
        object.__setattr__(self, "holds_directions", any(isinstance(group, ClampedEnds) for group in groups))
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
        beams = self.beams(points)
        for along in beams:
            for end in (*along.ends, *along.twins):
                found[end] = FreeEnds()
        for end in (end for along in beams if along.kind == Arch.kind for end in along.ends[[0, -1]]):
            found[end] = HeldEnds()
        for group in self.groups:
            if not isinstance(group, EdgeBeam):
                for end in group.numbers(points, self.ends_named):
                    found[end] = group
        return found

    def turning(self, points: Floats) -> Floats:
        """See `Support.turning`."""
        clamps = (group.turning if isinstance(group, ClampedEnds) else 0.0 for group in self.group_of(points))
        return np.array([np.inf if turning is None else turning for turning in clamps])

    def beams(self, points: Floats) -> list[BeamAlong]:
        """See `Support.beams`.

        Raises:
            InputError: a group has too few rod ends for a beam, or they do not lie along one curve.
        """
        from rodshell.geometry.chains import along_curve  # here, as it needs SciPy

        found = list[BeamAlong]()
        for group in self.groups:
            if not isinstance(group, EdgeBeam):
                continue
            ends = group.numbers(points, self.ends_named)
            here = np.round(points[ends] / (COINCIDENT * float(np.ptp(points, axis=0).max())))
            _, first = np.unique(here + 0.0, axis=0, return_index=True)
            if len(first) < 3:
                raise InputError(
                    f"a beam ({group.kind}) joins three rod ends or more: {shown(group.at)} has {len(first)}"
                )
            order = along_curve(points[ends[first]])
            if order is None:
                raise InputError(
                    f"the rod ends of a beam ({group.kind}), {shown(group.at)}, do not lie one after the other along "
                    "one curve: give each edge a beam of its own"
                )
            twins = np.delete(ends, first)
            name, along = f"E{len(found) + 1}", ends[first][order]
            found.append(BeamAlong(name, group.kind, along, twins, group.rod, group.closed, group.creep))
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
        each = {"of a rod end that no support holds": without, "of a support": ~without}
        largest = {what: float(far[rows].max(initial=0.0)) for what, rows in each.items()}
        return {f"largest displacement {what}": (most, "m") for what, most in largest.items() if most}


def unheld(forces: Floats) -> Bools:
    """(2m,) which rod ends nothing holds, by the forces (2m, 3) of the supports [N]."""
    size = np.sqrt((np.nan_to_num(forces) ** 2).sum(axis=1))
    return np.asarray(size <= NO_FORCE * size.max(initial=0.0))
