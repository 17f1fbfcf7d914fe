"""Two orthogonal families of parallel rods: what the user asks for, before it meets a target."""

from dataclasses import asdict, dataclass
from math import isfinite
from numbers import Real
from typing import Literal

import numpy as np

from rodshell.arrays import Floats
from rodshell.errors import InputError
from rodshell.layout.flatgrid import Family, FlatGrid, FlatRod
from rodshell.validation import positive

Auto = Literal["auto"]

EDGES_A_SPAN = 6  # of the mesh to a spacing, where the edge is "auto"


@dataclass(frozen=True)
class GridLayout:
    """Two orthogonal families of rods [HQK section 3.2]; make one with `GridLayout.orthogonal`.

    Parameters
    ----------
    rods : number of rods (along x: family u, along y: family v), or "auto": every line that touches the target.
    spacing : (su, sv) [m]; su is the distance between neighbouring rods of family u (measured along y),
        sv that between rods of family v (measured along x).
    length : of every rod before trimming [m], or "auto": long enough to be trimmed.
    edge : longest edge of the mesh [m].
    rotate : angle of family u against the target's x axis [rad].
    offset : (x, y) shift of the lattice against the axes through the anchor [m].
    lines : ascending offsets of some rods of families u and v [m], where these do not lie at equal spacing; beyond the
        first and the last of them the spacing goes on. Empty for a family whose rods all lie at equal spacing.
    left_out : names of rods that are not built; their lines still shape the net.

    Raises
    ------
    InputError : a count below 2, a spacing, length or edge that is not positive, an edge above the spacing.
    """

    rods: tuple[int, int] | Auto
    spacing: tuple[float, float]
    length: float | Auto
    edge: float
    rotate: float = 0.0
    offset: tuple[float, float] = (0.0, 0.0)
    lines: tuple[tuple[float, ...], tuple[float, ...]] = ((), ())
    left_out: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name, two in (("spacing", self.spacing), ("offset", self.offset)):
            _require_two(name, two)
        for name, value in (("spacing", self.spacing[0]), ("spacing", self.spacing[1]), ("edge", self.edge)):
            positive(f"layout {name}", value, "m")
        if self.length != "auto":
            positive("layout length", self.length, "m")
        if self.rods != "auto":
            counts = tuple(self.rods) if isinstance(self.rods, tuple | list) else ()
            if len(counts) != 2 or not all(isinstance(n, Real) and int(n) == n >= 2 for n in counts):
                raise InputError(f'layout rods must be "auto" or two counts of at least 2, not {self.rods}')
            object.__setattr__(self, "rods", (int(counts[0]), int(counts[1])))
        if self.edge > min(self.spacing):
            raise InputError(
                f"layout edge {self.edge} m is longer than the spacing {min(self.spacing)} m: use a shorter edge"
            )
        if not all(isfinite(one) for one in (self.rotate, *self.offset)):
            raise InputError(f"layout rotate and offset must be finite, not {self.rotate} and {self.offset}")
        object.__setattr__(self, "spacing", (float(self.spacing[0]), float(self.spacing[1])))

    @staticmethod
    def orthogonal(
        *,
        rods: tuple[int, int] | Auto = "auto",
        spacing: float | tuple[float, float],
        length: float | Auto = "auto",
        edge: float | Auto = "auto",
        rotate: float = 0.0,
        offset: tuple[float, float] = (0.0, 0.0),
    ) -> "GridLayout":
        """Rods along x and along y; an edge "auto" is a sixth of the smaller spacing.

        Raises
        ------
        InputError : as of the class.
        """
        pair = spacing if isinstance(spacing, tuple | list) else (spacing, spacing)
        _require_two("spacing", pair)
        return GridLayout(rods, pair, length, auto_edge(pair) if edge == "auto" else edge, rotate, offset)

    def phase(self, family: Family) -> float:
        """Offset [m] of one line of the lattice of this family; the others lie whole spacings away."""
        side = 0 if family == "u" else 1
        half = 0.0 if self.rods == "auto" else (self.rods[side] - 1) / 2 % 1
        return self.offset[1 - side] + half * self.spacing[side]

    def lattice(self, family: Family, low: float, high: float) -> Floats:
        """Offsets [m] of the lines of a family from `low` to `high`, both within a spacing."""
        spacing, given = self.spacing[0 if family == "u" else 1], self.lines[0 if family == "u" else 1]
        if given:
            before = given[0] + spacing * np.arange(min(np.floor((low - given[0]) / spacing), 0), 0)
            after = given[-1] + spacing * np.arange(1, max(np.ceil((high - given[-1]) / spacing), 0) + 1)
            return np.concatenate([before, given, after])
        phase = self.phase(family)
        first, last = np.floor((low - phase) / spacing), np.ceil((high - phase) / spacing)
        return np.asarray(phase + spacing * np.arange(first, last + 1))

    def offsets(self, family: Family) -> Floats | None:
        """Offsets [m] of the rods of a family, ascending, or None where the count is "auto"."""
        if self.rods == "auto":
            return None
        side = 0 if family == "u" else 1
        count = self.rods[side]
        return np.asarray(self.offset[1 - side] + (np.arange(count) - (count - 1) / 2) * self.spacing[side])

    def half_length(self) -> float:
        """Half the length of every rod [m]; infinite where the length is "auto"."""
        return np.inf if self.length == "auto" else self.length / 2

    def middle(self, family: Family) -> float:
        """Material coordinate [m] of the middle of the rods of a family: the layout moves with its offset."""
        return self.offset[0 if family == "u" else 1]

    def parameters(self) -> dict[str, object]:
        """The layout in SI, as it stands in a case file."""
        own = asdict(self)
        return {key: value for key, value in own.items() if key not in ("lines", "left_out")}

    def flat_grid(self, counts: tuple[int, int], length: float) -> FlatGrid:
        """The whole rectangular grid before trimming, with `counts` and `length` [m] standing in for "auto"."""
        whole = GridLayout(counts, self.spacing, length, self.edge, self.rotate, self.offset)
        rods = list[FlatRod]()
        families: tuple[Family, ...] = ("u", "v")
        for family in families:
            make = FlatRod.u if family == "u" else FlatRod.v
            middle = whole.middle(family)
            offsets = whole.offsets(family)
            assert offsets is not None
            rods += [
                make(rod_name(family, k, len(offsets)), float(c), middle - length / 2, middle + length / 2)
                for k, c in enumerate(offsets)
            ]
        return FlatGrid.of(rods)


def auto_edge(spacing: tuple[float, float]) -> float:
    """The edge of the mesh [m] that goes with spacings [m]."""
    return min(spacing) / EDGES_A_SPAN


def _require_two(name: str, two: object) -> None:
    """Refuse what is not a pair of numbers [m]."""
    if not isinstance(two, tuple | list) or len(two) != 2 or not all(isinstance(one, Real) for one in two):
        raise InputError(f"layout {name} must be two lengths in m, not {two!r}")


def rod_name(family: Family, index: int, count: int) -> str:
    """U01, U02, ... in ascending offset."""
    return f"{family.upper()}{index + 1:0{max(2, len(str(count)))}d}"
