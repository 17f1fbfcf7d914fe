"""What holds the ends of rods: named values, the two that every case knows, and how those asked for are read.

A support of one's own is a class of `Support` with `free`, `energies` or both, and with its own `figures`; everything
else goes by its name.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from re import fullmatch
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, Self, get_args

import numpy as np
from numpy.typing import ArrayLike

from rodshell.arrays import Floats, Ints
from rodshell.errors import InputError
from rodshell.rods.section import Rod
from rodshell.units import shown
from rodshell.validation import NAME, choice, described, flag

if TYPE_CHECKING:
    from rodshell.rods.elements import Elements

SupportName = Literal["pinned", "clamped"]
AskedName = Literal[SupportName, "both"]
BOTH: Literal["both"] = "both"  # short for all supports of the table

_RESERVED = (BOTH, "draped", "deployment", "stress", "mode", "buckling")  # would be ambiguous in names of states


class BeamAlong(NamedTuple):
    """A beam along rod ends.

    Args:
        kind: what it is called in the case.
        ends: (b,) numbers of the rod ends on it in their order along it; of those in one place the first.
        twins: numbers of the others.
        closed: whether its last rod end is joined to its first.
        creep: by how much its deflections grow under permanent loads; None: not given.
    """

    name: str
    kind: str
    ends: Ints
    twins: Ints
    rod: Rod
    closed: bool
    creep: float | None = None


@dataclass(frozen=True)
class Support:
    """A support of all rod ends. This class holds them in place.

    Args:
        name: a word of small letters and digits, by which results know it.
        holds_directions: whether it holds the rods' directions too; a rod may spin in its clamp.
    """

    name: str
    holds_directions: bool = False

    def __post_init__(self) -> None:
        flag("holds_directions", self.holds_directions)
        if not isinstance(self.name, str) or not fullmatch(NAME, self.name) or self.name in _RESERVED:
            raise InputError(
                f"the name of a support must be a word of small letters and digits, and none of "
                f"{', '.join(_RESERVED)}; not {described(self.name)}"
            )

    def __str__(self) -> str:
        return self.name

    @property
    def note(self) -> str:
        """What it holds, in words."""
        return "directions held" if self.holds_directions else "free to turn"

    def named(self, names: Sequence[str]) -> Self:
        """The same, which may find its rod ends by their names (2m,), such as "U03.0"."""
        return self

    def free(self, points: Floats) -> Mapping[int, Sequence[ArrayLike]]:
        """Directions (up to three, at right angles) along which rod ends may move, by the number of the end.

        Args:
            points: (2m, 3) where the ends are before they move [m]: 2 i is the start of rod i, 2 i + 1 its end.
        """
        return {}

    def turning(self, points: Floats) -> Floats:
        """(2m,) stiffness against turning of each rod end at `points` (2m, 3) [N m/rad]: `inf` holds its direction."""
        return np.full(len(points), np.inf if self.holds_directions else 0.0)

    def beams(self, points: Floats) -> Sequence[BeamAlong]:
        """Beams along rod ends, which are at `points` (2m, 3) before they move [m]."""
        return ()

    def energies(self, ends: Ints, points: Floats) -> "Sequence[Elements]":
        """What acts on the ends, such as the energies of springs; those with `times(factor)`, which gives them so many
        times as stiff, are followed over years of creep too.

        Args:
            ends: (2m,) number of the node of each rod end.
            points: (2m, 3) where the ends are before they move [m].
        """
        return ()

    def figures(self, moved: Floats, forces: Floats) -> Mapping[str, tuple[float, str]]:
        """What it says of itself on the unloaded shell: value and SI unit of each figure, by what it is. Results,
        summary and report list them. Of any support whose rod ends moved it is how far.

        Args:
            moved: (2m, 3) displacement of each rod end from where it is before ends move [m].
            forces: (2m, 3) by which it acts on each rod end [N].
        """
        largest = float(np.sqrt((moved**2).sum(axis=1)).max(initial=0.0))
        return {"largest displacement of a rod end": (largest, "m")} if largest else {}


SUPPORTS = {name: Support(name, holds_directions=name != "pinned") for name in get_args(SupportName)}
PINNED, CLAMPED = SUPPORTS.values()


Asked = Support | str | Sequence[Support | str]


def supports_of(given: Any) -> tuple[Support, ...]:
    """The different supports of one or several names and supports, in their order; "both" is all of the table.

    Raises:
        InputError: a name is not known, or is that of another support.
    """
    items = [given] if isinstance(given, str | Support) else list(given) if isinstance(given, Sequence) else None
    words = (*SUPPORTS, BOTH)
    if items is None:
        raise InputError(f"ends must be one or several of {', '.join(map(shown, words))}, not {described(given)}")
    found = [item if isinstance(item, Support) else choice("ends", item, words) for item in items]
    if BOTH in found:
        found = [*SUPPORTS, *(item for item in found if item != BOTH)]
    by_name = dict[str, Support]()
    for item in found:
        support = support_of(item)
        if by_name.setdefault(support.name, SUPPORTS.get(support.name, support)) != support:
            raise InputError(f"two supports have the name {shown(support.name)}: give each a name of its own")
    return tuple(by_name.values())


def support_of(given: Any) -> Support:
    """The support of a name; a support is its own. An InputError where the name is not known."""
    return given if isinstance(given, Support) else SUPPORTS[choice("ends", given, tuple(SUPPORTS))]


def finals_first(names: Iterable[str]) -> list[str]:
    """Names of supports, the one whose shape counts as the final one first: of one's own, else clamped, else pinned."""
    ranks = {name: rank for rank, name in enumerate(reversed(SUPPORTS), start=1)}
    return sorted(names, key=lambda name: ranks.get(name, 0))


def clamped_among(names: Iterable[str], clamped: bool = True) -> str | None:
    """The first of these names whose support is known to hold directions, or known not to."""
    return next((name for name in names if name in SUPPORTS and SUPPORTS[name].holds_directions is clamped), None)
