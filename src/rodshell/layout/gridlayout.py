"""Two families of parallel rods, orthogonal in the flat grid, before they are cut to a target."""

from dataclasses import dataclass, fields, replace
from math import degrees, pi
from numbers import Real
from string import ascii_lowercase
from typing import ClassVar, Literal

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.layout.flatgrid import FlatGrid, FlatRod, refuse_too_many
from rodshell.layout.lattices import EDGES_A_SPAN, Asymptotic, Curves, Geodesic
from rodshell.units import NUMBER
from rodshell.validation import flag, instance, is_auto, number, numbers, positive, short, texts, whole

Auto = Literal["auto"]

FAMILIES = ("u", "v")  # along x and along y, in the order of all pairs
FLATTEST = pi / 6 - 1e-9  # smallest crossing angle; and its supplement is the largest


@dataclass(frozen=True, repr=False)
class GridLayout:
    """Two orthogonal families of rods [HQK section 3.2]; make one with `GridLayout.orthogonal`.

    Args:
        rods: number of rods of family u (along x) and of family v (along y), or "auto" for every line that touches the
            target.
        spacing: distance between neighbouring rods of family u (measured along y) and of family v (along x) [m].
        length: of every rod before trimming [m], or "auto" for the length that is needed.
        edge: longest edge of the mesh [m].
        rotate: angle of family u against the target's x axis [rad].
        offset: shift (x, y) of the lattice against the axes through the anchor [m].
        lines: ascending offsets of rods of families u and v that are not equally spaced [m]; before the first and after
            the last of them the spacing continues. Empty for a family whose rods are all equally spaced.
        left_out: names of rods that are not built; their lines still shape the net.
        crossing: angle between the families on the target, where its axes cross [rad]; the flat grid stays orthogonal.
        auto_edge: whether the edge was left to the method of draping, see `with_edges`.

    Raises:
        InputError: a value of the wrong kind or not finite; a count below 2; a spacing, length or edge that is not
            positive; an edge longer than the spacing; a crossing angle below 30 or above 150 degrees.
    """

    rods: tuple[int, int] | Auto
    spacing: tuple[float, float]
    length: float | Auto
    edge: float
    rotate: float = 0.0
    offset: tuple[float, float] = (0.0, 0.0)
    lines: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    left_out: tuple[str, ...] = ()
    crossing: float = pi / 2
    auto_edge: bool = False

    kind: ClassVar[str] = "chebyshev"
    upright: ClassVar[bool] = False
    closer: ClassVar[str] = "a smaller spacing"
    elsewhere: ClassVar[str] = "another offset, anchor or heading"

    def __post_init__(self) -> None:
        for name in ("spacing", "offset"):
            _require_two(name, getattr(self, name))
        values: dict[str, object] = {
            "spacing": tuple(positive("layout spacing", value, "m") for value in self.spacing),
            "offset": tuple(number("layout offset", value, "m") for value in self.offset),
            "edge": positive("layout edge", self.edge, "m"),
            "rotate": number("layout rotate", self.rotate, "rad"),
            "lines": _offsets(self.lines),
            "crossing": number("layout crossing", self.crossing, "rad"),
            "auto_edge": flag("layout auto_edge", self.auto_edge),
        }
        if not is_auto(self.length):
            values["length"] = positive("layout length", self.length, "m")
        if not is_auto(self.rods):
            values["rods"] = _counts(self.rods)
        values["left_out"] = texts("layout left_out", self.left_out, "names of rods")
        for name, value in values.items():
            object.__setattr__(self, name, value)
        if not FLATTEST <= self.crossing <= pi - FLATTEST:
            raise InputError(
                f"layout crossing {degrees(self.crossing):.4g} degrees: both families can begin at 30 to 150 degrees "
                "to each other: choose an angle between these"
            )
        if self.edge > min(self.spacing):
            raise InputError(
                f"layout edge {self.edge} m is longer than the spacing {min(self.spacing)} m: use a shorter edge"
            )

    def __repr__(self) -> str:
        values = {field.name: getattr(self, field.name) for field in fields(self)}
        if values.pop("auto_edge"):
            values["edge"] = "auto"
        if any(self.lines):
            values["lines"] = "..."
        if self.crossing == pi / 2:
            del values["crossing"]
        if len(self.left_out) > 2:
            values["left_out"] = f"{len(self.left_out)} rods"
        shown = (f"{name}={value!r}" for name, value in values.items() if value not in (0.0, (0.0, 0.0), ((), ()), ()))
        return f"GridLayout({', '.join(shown)})"

    @staticmethod
    def orthogonal(
        *,
        rods: tuple[int, int] | Auto = "auto",
        spacing: float | tuple[float, float] | Floats,
        length: float | Auto = "auto",
        edge: float | Auto = "auto",
        rotate: float = 0.0,
        offset: tuple[float, float] = (0.0, 0.0),
        left_out: tuple[str, ...] = (),
        crossing: float = pi / 2,
    ) -> "GridLayout":
        """Make a layout of equally spaced rods along x and along y; arguments and errors as of `GridLayout`.

        Args:
            spacing: one length for both families, or one for each [m].
            edge: "auto" for a sixth of the smaller spacing, and half of it for a `Fall`.
        """
        instance("layout spacing", spacing, tuple | list | Real | np.ndarray, "one or two lengths in m")
        pair = spacing if isinstance(spacing, tuple | list | np.ndarray) else (spacing, spacing)
        _require_two("spacing", pair)
        pair = (positive("layout spacing", pair[0], "m"), positive("layout spacing", pair[1], "m"))
        longest = auto_edge(pair) if isinstance(edge, str) and edge == "auto" else edge
        auto = longest is not edge
        return GridLayout(
            rods, pair, length, longest, rotate, offset, left_out=left_out, crossing=crossing, auto_edge=auto
        )

    @property
    def least_spacing(self) -> float:
        """The smaller spacing [m]."""
        return min(self.spacing)

    @property
    def most_spacing(self) -> float:
        """The larger spacing [m]."""
        return max(self.spacing)

    @property
    def longest_edge(self) -> float:
        """Of the mesh [m]."""
        return self.edge

    def with_edges(self, a_span: int) -> "GridLayout":
        """The layout with so many edges to the smaller spacing, unless its edge was given."""
        edge = min(self.spacing) / whole("edges a span", a_span, 1)
        return replace(self, edge=edge) if self.auto_edge else self

    def phase(self, family: int) -> float:
        """Offset of one line of the lattice of a family [m]; the others are whole spacings away."""
        half = 0.0 if self.rods == "auto" else (self.rods[family] - 1) / 2 % 1
        return self.offset[1 - family] + half * self.spacing[family]

    def lattice(self, family: int, low: float, high: float) -> Floats:
        """Offsets of the lines of a family [m], from at most a spacing below `low` to at most one above `high` [m].

        Args:
            family: 0 or 1, of `FAMILIES`.
            low, high: ends of the range of offsets that the lines have to cover [m].
        """
        spacing, given = self.spacing[family], self.lines[family]
        if given:
            before = given[0] + spacing * np.arange(min(np.floor((low - given[0]) / spacing), 0), 0)
            after = given[-1] + spacing * np.arange(1, max(np.ceil((high - given[-1]) / spacing), 0) + 1)
            return np.concatenate([before, given, after])
        phase = self.phase(family)
        first, last = np.floor((low - phase) / spacing), np.ceil((high - phase) / spacing)
        return np.asarray(phase + spacing * np.arange(first, last + 1))

    def offsets(self, family: int) -> Floats | None:
        """Ascending offsets of the rods of a family [m], or None where the count is "auto"."""
        if self.rods == "auto":
            return None
        count = self.rods[family]
        return np.asarray(self.offset[1 - family] + (np.arange(count) - (count - 1) / 2) * self.spacing[family])

    def middle(self, rod: FlatRod) -> float:
        """Material coordinate of the middle of one of the rods [m]: the layout moves with its offset."""
        return self.offset[FAMILIES.index(rod.family)]

    def parameters(self) -> dict[str, object]:
        """The layout in SI, as it is written in a case file."""
        keys = (key.name for key in fields(self) if key.name not in ("lines", "left_out", "auto_edge"))
        return {"kind": self.kind, **{key: getattr(self, key) for key in keys}}

    def flat_grid(self, counts: tuple[int, int], length: float) -> FlatGrid:
        """The rectangular grid before trimming.

        Args:
            counts: number of rods of families u and v, used instead of those of the layout.
            length: of every rod, used instead of that of the layout [m].
        """
        whole = GridLayout(counts, self.spacing, length, self.edge, self.rotate, self.offset)
        rods = list[FlatRod]()
        for family, middle in enumerate(whole.offset):
            offsets = whole.offsets(family)
            assert offsets is not None
            rods += [
                lattice_rod(family, name, c, middle - length / 2, middle + length / 2)
                for name, c in zip(rod_names(family, len(offsets)), offsets.tolist(), strict=True)
            ]
        return FlatGrid.of(rods)


def lattice_rod(family: int, name: str, offset: float, start: float, end: float, *, virtual: bool = False) -> FlatRod:
    """A rod of the lattice: of the first family along x at y = `offset`, of the second along y at x = `offset`.

    Args:
        family: 0 or 1, of `FAMILIES`.
        name, start, end, virtual: as of `FlatRod`.
    """
    line = ((0.0, offset), (1.0, 0.0)) if family == 0 else ((offset, 0.0), (0.0, 1.0))
    return FlatRod(name, FAMILIES[family], offset, start, end, *line, virtual)


def auto_edge(spacing: tuple[float, float]) -> float:
    """The default edge of the mesh [m] for the spacings of both families [m]."""
    return min(spacing) / EDGES_A_SPAN


def _require_two(name: str, pair: object) -> None:
    """Refuse what is not a pair of numbers [m]."""
    given = pair.tolist() if isinstance(pair, np.ndarray) else pair
    if not isinstance(given, tuple | list) or len(given) != 2 or not all(isinstance(value, NUMBER) for value in given):
        raise InputError(f"layout {name} must be two lengths in m, not {short(pair)}")


def _offsets(lines: object) -> tuple[tuple[float, ...], ...]:
    sentence = "two lists of finite offsets in m"
    families = lines if isinstance(lines, tuple | list) else ()
    if len(families) != 2:
        raise InputError(f"layout lines must be {sentence}, not {short(lines)}")
    sizes = (len(family) if isinstance(family, tuple | list) else np.size(family) for family in families)
    return tuple(numbers("layout lines", family, sentence, size) for family, size in zip(families, sizes, strict=True))


def _counts(rods: object) -> tuple[int, int]:
    sentence = 'two counts of at least 2, or "auto"'
    first, second = numbers("layout rods", rods, sentence, 2)
    if not (first.is_integer() and second.is_integer() and min(first, second) >= 2):
        raise InputError(f"layout rods must be {sentence}, not {short(rods)}")
    refuse_too_many(int(first + second))
    return int(first), int(second)


def rod_names(family: int, count: int) -> list[str]:
    """Names of the rods of a family: U01, U02, ... in ascending offset.

    Args:
        count: number of rods of the family, which determines the number of digits.
    """
    letter, digits = FAMILIES[family].upper(), max(2, len(str(count)))
    return [letter + str(k + 1).zfill(digits) for k in range(count)]


def piece_names(rod: str, count: int) -> list[str]:
    """Names of the pieces of a rod: U07, or U07a, U07b, ... if there are several.

    Args:
        rod: name of the whole rod.
    """
    return [rod] if count == 1 else [f"{rod}{ascii_lowercase[k] if k < 26 else f'.{k + 1}'}" for k in range(count)]


Layout = GridLayout | Geodesic | Asymptotic | Curves
"""How the rods of a form are laid out: in the flat grid, or along curves of the target."""


def require_chebyshev(layout: Layout, what: str) -> GridLayout:
    """The layout, which must be of straight rods in the flat grid.

    Raises:
        InputError: it is another lattice, for which `what` is not offered.
    """
    if isinstance(layout, GridLayout):
        return layout
    raise InputError(
        f'{what} need the lattice "chebyshev", not "{layout.kind}": leave them out, or set layout.kind to "chebyshev"'
    )
