"""Cut list, layers, splices, stock and bracing of a grid, in one call, and the lengths that decide the cutting."""

from dataclasses import dataclass
from functools import partial
from math import isfinite

import numpy as np

from rodshell.arrays import Floats, Ints, median
from rodshell.errors import InputError
from rodshell.fabrication.cutting import Nesting, nest, splices
from rodshell.layout import GridMesh, Profile
from rodshell.layout.cells import Pattern, diagonals, rim_diagonals
from rodshell.layout.flatgrid import layers
from rodshell.rods.section import Rod
from rodshell.rods.varied import varied
from rodshell.units import length_text

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
class Fabrication:
    """Lengths that decide the cutting.

    Parameters
    ----------
    end_allowance : added to a rod at each end [m], to be held by the support.
    stock_length : of the bars that rods are cut from [m]; None if every rod comes in one piece.
    kerf : lost at each saw cut of that stock [m].
    """

    end_allowance: float = 0.0
    stock_length: float | None = None
    kerf: float = 0.0

    def __post_init__(self) -> None:
        for name, value in (("end allowance", self.end_allowance), ("kerf", self.kerf)):
            if not (isfinite(value) and value >= 0):
                raise InputError(f"the {name} must not be negative, but is {value} m")
        if self.stock_length is None and self.kerf > 0:
            raise InputError(
                f"the kerf of {self.kerf} m is lost where stock is cut: give its stock_length, or leave the kerf out"
            )
        if self.stock_length is not None and not self.stock_length > self.kerf:
            raise InputError(
                f"stock of {self.stock_length} m cannot be cut with a kerf of {self.kerf} m: give longer bars"
            )


@dataclass(frozen=True)
class Fabricated:
    """Cut list and more, rod by rod in the order of the grid.

    Parameters
    ----------
    cut_length : (m,) with both end allowances [m]; mass : (m,) of it [kg]; layer : (m,) 1 the lowest.
    splices : distances from each rod's start, its allowance not counted [m].
    pieces : (rod, number along the rod, length [m]) of all that is cut from stock, rods one after the other.
    nesting : of the pieces; None where there is no stock length, or a piece does not fit.
    bracing : diagonals between joints, by their index among the grid's crossings, and to rod ends.
    """

    options: Fabrication
    cut_length: Floats
    mass: Floats
    layer: Ints
    splices: tuple[tuple[float, ...], ...]
    pieces: tuple[tuple[int, int, float], ...]
    nesting: Nesting | None
    bracing: tuple[Diagonal, ...]
    warnings: tuple[str, ...]


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
    """
    rods, crossings = mesh.grid.rods, mesh.grid.crossings
    lengths = np.array([rod_line.length for rod_line in rods])
    cut = lengths + 2 * options.end_allowance
    made, warnings = _splices(mesh, options, curvature)
    pieces = _pieces_of(lengths, made, options)
    nesting = None
    if options.stock_length is not None and not warnings:
        bars = partial(nest, stock=options.stock_length, kerf=options.kerf)
        nesting = bars([piece for _, _, piece in pieces])
        longer, _ = _splices(mesh, options, curvature, short=SHORT)
        others = _pieces_of(lengths, longer, options)
        tried = bars([piece for _, _, piece in others])
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


def _splices(
    mesh: GridMesh, options: Fabrication, curvature: Floats | None, *, short: float = 0.0
) -> tuple[tuple[tuple[float, ...], ...], tuple[str, ...]]:
    """Splices of each rod [m from its start], and a sentence about rods that cannot be spliced.

    short : pieces of so many joint distances are avoided.
    """
    rods, stock = mesh.grid.rods, options.stock_length
    if stock is None:
        return ((),) * len(rods), ()
    bend = np.zeros(len(mesh.rod_nodes)) if curvature is None else curvature
    made, hopeless = list[tuple[float, ...]](), list[str]()
    for k, rod in enumerate(rods):
        here, crossings = mesh.rod_slice(k), mesh.grid.crossings
        shift = options.end_allowance - rod.start  # from material coordinates to the cut rod
        joints = crossings.at[crossings.rods == k] + shift
        cut = rod.length + 2 * options.end_allowance
        apart = median(np.diff(np.sort(joints))) if len(joints) > 1 else 0.0
        found = splices(
            cut, joints, stock, stations=mesh.stations[here] + shift, curvature=bend[here], short=short * apart
        )
        if found is None:
            hopeless.append(rod.name)
        made.append(tuple(at - options.end_allowance for at in found or ()))
    if not hopeless:
        return tuple(made), ()
    named = f"rod {hopeless[0]}" if len(hopeless) == 1 else f"{len(hopeless)} rods (the first: {hopeless[0]})"
    return tuple(made), (
        f"{named} cannot be spliced between joints from stock of {length_text(stock)}: give longer stock",
    )


def _pieces_of(
    lengths: Floats, made: tuple[tuple[float, ...], ...], options: Fabrication
) -> tuple[tuple[int, int, float], ...]:
    """(rod, number along the rod, length [m]) of every piece."""
    return tuple(
        (k, number, piece)
        for k, at in enumerate(made)
        for number, piece in enumerate(_pieces(float(lengths[k]), at, options), start=1)
    )


def _pieces(length: float, at: tuple[float, ...], options: Fabrication) -> list[float]:
    stops = [-options.end_allowance, *at, length + options.end_allowance]
    return np.diff(stops).tolist()
