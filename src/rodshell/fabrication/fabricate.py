"""Cut list, layers, splices, stock and bracing of a grid, in one call, and the lengths that decide the cutting."""

from dataclasses import dataclass
from functools import partial

import numpy as np

from rodshell.arrays import Floats, Ints
from rodshell.fabrication.cutting import Nesting, nest, splices
from rodshell.fabrication.settings import Fabrication
from rodshell.layout import GridMesh, Profile
from rodshell.layout.cells import Pattern, diagonals, rim_diagonals
from rodshell.layout.flatgrid import layers
from rodshell.rods.section import Rod
from rodshell.rods.varied import varied
from rodshell.units import length_text
from rodshell.validation import array, flag, instance, number

SHORT = 2.0  # joint distances: shorter pieces are avoided where that takes no more bars


@dataclass(frozen=True)
class Diagonal:
    """One diagonal of a cell: the joints that it ties, rod ends being counted on from them, and their distance flat and
    in the final shape [m]; of a cable also its length free of stress [m]."""

    joints: tuple[int, int]
    flat: float
    final: float
    cut: float | None = None


@dataclass(frozen=True)
class Lath:
    """A lath as it is cut: a rod, or what lies on it over a part of its length.

    Parameters
    ----------
    number : 1 is the rod itself, whole.
    start, stop : its cut ends, allowances included, from the rod's start [m].
    splices : distances from the rod's start [m].
    """

    rod: int
    number: int
    start: float
    stop: float
    splices: tuple[float, ...] = ()

    @property
    def pieces(self) -> list[float]:
        """Lengths of its pieces [m]."""
        lengths: list[float] = np.diff([self.start, *self.splices, self.stop]).tolist()
        return lengths


@dataclass(frozen=True, eq=False)
class Fabricated:
    """Cut list and more, rod by rod in the order of the grid.

    Parameters
    ----------
    cut_length : (m,) with both end allowances [m]; mass : (m,) of it [kg]; layer : (m,) 1 the lowest.
    laths : of every rod, one rod after the other; more than one of a rod over part of which laths lie on each other.
    pieces : (rod, lath, number along the lath, length [m]) of all that is cut from stock, in the order of the laths.
    nesting : of the pieces; None where there is no stock length, or a piece does not fit.
    bracing : diagonals between joints, by their index among the grid's crossings, and to rod ends.
    """

    options: Fabrication
    cut_length: Floats
    mass: Floats
    layer: Ints
    laths: tuple[Lath, ...]
    pieces: tuple[tuple[int, int, int, float], ...]
    nesting: Nesting | None
    bracing: tuple[Diagonal, ...]
    warnings: tuple[str, ...]

    @property
    def splices(self) -> tuple[tuple[float, ...], ...]:
        """Of each rod itself, distances from its start, its allowance not counted [m]."""
        return tuple(lath.splices for lath in self.laths if lath.number == 1)


def fabricate(
    mesh: GridMesh, rod: Rod, options: Fabrication, *, curvature: Floats | None = None, final: Floats | None = None,
    pattern: Pattern = Pattern(), prestrain: float | None = None, to_supports: bool = False,
) -> Fabricated:  # fmt: skip
    """Cut list, layers, splices, stock and bracing of a grid.

    Parameters
    ----------
    curvature : (k,) the sharpest bend that each entry of `rod_nodes` sees [1/m], which splices avoid.
    final : (n, 3) the final shape, for the bracing [m].
    pattern : of the bracing; default: both diagonals of every cell.
    prestrain : by which cables are shortened when they are put in [-]; None: the bracing is not of cables.
    to_supports : diagonals also from the outermost joints to the rod ends.

    Raises
    ------
    InputError : a value is of the wrong kind.
    """
    instance("mesh", mesh, GridMesh)
    instance("rod", rod, Rod)
    instance("options", options, Fabrication)
    instance("pattern", pattern, Pattern)
    flag("to_supports", to_supports)
    if curvature is not None:
        curvature = array("curvature", curvature, np.float64, len(mesh.rod_nodes))
    if final is not None:
        final = array("final", final, np.float64, mesh.node_count, 3)
    if prestrain is not None:
        number("prestrain", prestrain)
    rods, crossings = mesh.grid.rods, mesh.grid.crossings
    lengths = np.array([rod_line.length for rod_line in rods])
    cut = lengths + 2 * options.end_allowance
    made, warnings = _laths(mesh, options, curvature)
    pieces = _pieces_of(made)
    nesting = None
    if options.stock_length is not None and not warnings:
        bars = partial(nest, stock=options.stock_length, kerf=options.kerf)
        nesting = bars([length for *_, length in pieces])
        longer, _ = _laths(mesh, options, curvature, short=SHORT)
        others = _pieces_of(longer)
        tried = bars([length for *_, length in others])
        if len(tried.bars) <= len(nesting.bars):
            made, pieces, nesting = longer, others, tried
    bracing: tuple[Diagonal, ...] = ()
    if final is not None:
        ends = mesh.ends.ravel()
        flat = np.vstack([mesh.flat[mesh.joint_nodes], mesh.flat[ends]])
        there = np.vstack([final[mesh.joint_pairs].mean(axis=1), final[ends]])
        pairs = diagonals(mesh.grid, pattern)
        if to_supports:
            pairs = np.vstack([pairs, rim_diagonals(mesh.grid, pattern) + [0, len(mesh.joint_pairs)]])

        def apart(points: Floats) -> list[float]:
            distances: list[float] = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1).tolist()
            return distances

        bracing = tuple(
            Diagonal((a, b), laid, spanned, None if prestrain is None else spanned / (1.0 + prestrain))
            for (a, b), laid, spanned in zip(pairs.tolist(), apart(flat), apart(there), strict=True)
        )
    mass = rod.mass_per_length * (cut + _more(mesh, rod, options))
    return Fabricated(
        options, cut, mass, layers(len(rods), crossings.rods.tolist()), made, pieces, nesting, bracing, warnings
    )  # fmt: skip


def _more(mesh: GridMesh, rod: Rod, options: Fabrication) -> Floats:
    """(m,) length of the unchanged rod that weighs as much as a rod whose section changes is heavier than it [m]."""
    more = np.zeros(len(mesh.grid.rods))
    for k, line in enumerate(mesh.grid.rods):
        if line.profile is not None:
            profile, ends = line.profile, np.array([0.0, 1.0])
            mean = profile.mean(partial(_stretch, rod, profile), ends[:1], ends[1:])[0, 0]
            at_ends = _stretch(rod, profile, np.array([profile.factors[0], profile.factors[-1]])).sum()
            more[k] = line.length * (mean - 1.0) + options.end_allowance * (at_ends - 2.0)
    return more


def _stretch(rod: Rod, profile: Profile, factors: Floats) -> Floats:
    return varied(rod, profile.varies, factors).stretch


def _laths(
    mesh: GridMesh, options: Fabrication, curvature: Floats | None, *, short: float = 0.0
) -> tuple[tuple[Lath, ...], tuple[str, ...]]:
    """All laths with their splices, and a sentence about those that cannot be spliced.

    short : pieces of so many joint distances are avoided.
    """
    stock, crossings = options.stock_length, mesh.grid.crossings
    bend = np.zeros(len(mesh.rod_nodes)) if curvature is None else curvature
    made, hopeless = list[Lath](), dict[int, str]()
    for k, rod in enumerate(mesh.grid.rods):
        here, more = mesh.rod_slice(k), options.end_allowance
        joints, stations = crossings.at[crossings.rods == k] - rod.start, mesh.stations[here] - rod.start
        apart = np.median(np.diff(np.sort(joints))) if len(joints) > 1 else 0.0
        beyond = () if rod.profile is None else rod.profile.laths(rod.length, more)
        spliced = list[float]()
        for lath, (start, stop) in enumerate([(-more, rod.length + more), *beyond], start=1):
            found: list[float] | None = []
            if stock is not None:
                inside = joints[(joints > start) & (joints < stop)]
                found = splices(
                    stop - start, inside - start, stock, stations=stations - start, curvature=bend[here],
                    short=short * apart, taken=np.array(spliced) - start,
                )  # fmt: skip
            if found is None:
                hopeless.setdefault(k, rod.name if lath == 1 else f"{rod.name} (lath {lath})")
            mine = tuple(at + start for at in found or ())
            spliced += mine
            made.append(Lath(k, lath, start, stop, mine))
    if not hopeless:
        return tuple(made), ()
    first = next(iter(hopeless.values()))
    named = f"rod {first}" if len(hopeless) == 1 else f"{len(hopeless)} rods (the first: {first})"
    assert stock is not None
    return tuple(made), (
        f"{named} cannot be spliced between joints from stock of {length_text(stock)}: give longer stock",
    )


def _pieces_of(laths: tuple[Lath, ...]) -> tuple[tuple[int, int, int, float], ...]:
    """(rod, lath, number along the lath, length [m]) of every piece."""
    return tuple(
        (lath.rod, lath.number, number, length) for lath in laths for number, length in enumerate(lath.pieces, start=1)
    )
