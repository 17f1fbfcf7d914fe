"""Cut list, layers, splices, stock and bracing of a grid, in one call, and the lengths that decide the cutting."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
from pydantic import Field

from rodshell.arrays import Floats, Ints
from rodshell.fabrication.cutting import splices
from rodshell.fabrication.nesting import nest
from rodshell.fabrication.settings import Fabrication
from rodshell.figures import fabrication as figures
from rodshell.figures.fabrication import Brace, Piece
from rodshell.figures.findings import Said, said
from rodshell.figures.records import Found
from rodshell.formfinding.finite_sections import joint_angles, rod_breadth
from rodshell.layout import GridMesh, Profile
from rodshell.layout.cells import Pattern, diagonals, rim_diagonals
from rodshell.layout.flatgrid import layers
from rodshell.rods.section import Rod
from rodshell.rods.varied import varied
from rodshell.units import length_text
from rodshell.validation import array, flag, instance, listed, number

SHORT = 2.0  # joint distances: shorter pieces are avoided where that takes no more bars


@dataclass(frozen=True)
class Lath:
    """A lath as it is cut: a rod, or what lies on it over a part of its length.

    Args:
        name: that of its rod, of the second on it "U07-2".
        number: 1 is the rod itself, whole.
        start, stop: its cut ends, allowances included, from the rod's start [m].
        splices: distances from the rod's start [m].
    """

    rod: int
    name: str
    number: int
    start: float
    stop: float
    splices: tuple[float, ...] = ()

    @property
    def pieces(self) -> list[Piece]:
        """What it is cut into, named by it and a number along it."""
        lengths = np.diff([self.start, *self.splices, self.stop]).tolist()
        return [Piece(piece=f"{self.name}.{k}", length=length) for k, length in enumerate(lengths, start=1)]


class Fabricated(figures.Fabrication):
    """Cut list, stock and bracing, and more of each rod in the order of the grid; the mass is that of the rods alone.

    There is no stock where there is no stock length, or a piece does not fit.
    """

    cut_length: Found[Floats] = Field(description="(m,) with both end allowances [m]")
    mass: Found[Floats] = Field(description="(m,) as cut [kg]")
    layer: Found[Ints] = Field(description="(m,) 1 the lowest")
    laths: Found[tuple[Lath, ...]] = Field(
        description="of every rod, rod by rod; more than one of a rod over part of which laths lie on each other"
    )
    slots: Found[Floats] = Field(description="(c,) widths at the crossings [m]; none where there are no slots")
    pieces: Found[tuple[Piece, ...]] = Field(description="all that is cut from stock, in the order of the laths")
    warnings: Found[tuple[Said, ...]] = Field(description="sentences on how the rods are cut")

    @property
    def splices(self) -> tuple[tuple[float, ...], ...]:
        """Of each rod itself, distances from its start, its allowance not counted [m]."""
        return tuple(lath.splices for lath in self.laths if lath.number == 1)


def fabricate(
    mesh: GridMesh, rod: Rod, options: Fabrication, *, curvature: Floats | None = None, final: Floats | None = None,
    pattern: Pattern = Pattern(), prestrain: float | None = None, to_supports: bool = False,
    slotted: Sequence[Floats] = (),
) -> Fabricated:  # fmt: skip
    """Cut list, layers, splices, stock and bracing of a grid.

    Args:
        curvature: (k,) the sharpest bend that each entry of `rod_nodes` sees [1/m], which splices avoid.
        final: (n, 3) the final shape, for the bracing [m].
        pattern: of the bracing; default: both diagonals of every cell.
        prestrain: by which cables are shortened when they are put in [-]; None: the bracing is not of cables.
        to_supports: diagonals also from the outermost joints to the rod ends.
        slotted: shapes (n, 3) in which upright strips fit into each other's slots [m]; none: there are no slots.

    Raises:
        InputError: a value is of the wrong kind.
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
    slotted = [
        array("each shape of slotted", shape, np.float64, mesh.node_count, 3)
        for shape in listed("slotted", slotted, "shapes with a point for each node")
    ]
    rods, crossings = mesh.grid.rods, mesh.grid.crossings
    cut = np.array([rod_line.length for rod_line in rods]) + 2 * options.end_allowance
    made, warnings = _laths(mesh, rod, options, curvature)
    more = dict[str, Any]()
    if options.stock_length is not None and any(line.curve is not None for line in rods):
        warnings += (said("not_nested"),)
    elif options.stock_length is not None and not warnings:
        bars = partial(nest, stock=options.stock_length, kerf=options.kerf)
        longer, _ = _laths(mesh, rod, options, curvature, short=SHORT)
        more["stock"], tried = bars(_pieces_of(made)), bars(_pieces_of(longer))
        if len(tried.bars) <= len(more["stock"].bars):
            made, more["stock"] = longer, tried
    bracing: tuple[Brace, ...] = ()
    if final is not None:
        ends = mesh.ends.ravel()
        flat = np.vstack([mesh.flat[mesh.joint_nodes], mesh.flat[ends]])
        there = np.vstack([final[mesh.joint_pairs].mean(axis=1), final[ends]])
        pairs = diagonals(mesh.grid, pattern)
        if to_supports:
            pairs = np.vstack([pairs, rim_diagonals(mesh.grid, pattern) + [0, len(mesh.joint_pairs)]])
        names = [*mesh.grid.joint_names, *mesh.grid.support_names]
        both = np.stack([flat, there], axis=1)
        lengths = np.linalg.norm(both[pairs[:, 0]] - both[pairs[:, 1]], axis=2).tolist()
        bracing = tuple(
            Brace(start=names[a], end=names[b], flat=laid, final=spanned)
            for (a, b), (laid, spanned) in zip(pairs.tolist(), lengths, strict=True)
        )
        if prestrain is not None:
            bracing = tuple(brace.changed(cut=(brace.final or 0.0) / (1.0 + prestrain)) for brace in bracing)
    slots = _slots(mesh, rod, options, slotted)
    if len(slots) and rod.section.half_widths:
        more["slot_depth"] = rod.section.half_widths[0] + options.slot_clearance
        warnings += (*_remains(mesh, rod, options, slots, more["slot_depth"]), said("slots_weaken"))
    mass = rod.mass_per_length * (cut + _more(mesh, rod, options))
    return Fabricated(
        end_allowance=options.end_allowance,
        stock_length=options.stock_length,
        kerf=options.kerf,
        total_mass=float(mass.sum()),
        bracing=bracing,
        cut_length=cut,
        mass=mass,
        layer=layers(len(rods), crossings.rods.tolist()),
        laths=made,
        slots=slots,
        pieces=_pieces_of(made),
        warnings=warnings,
        **more,
    )


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


def _slots(mesh: GridMesh, rod: Rod, options: Fabrication, shapes: Sequence[Floats]) -> Floats:
    """(c,) widths of the slots at the crossings [m], those that the most acute angle of some shapes takes; or none.

    A slot's walls are square to the strip's faces: another strip of the same thickness t, at an angle a, is
    t / sin(a) long on the middle plane, and t cos(a) / sin(a) more from face to face.
    """
    if not len(shapes) or any(line.profile is not None for line in mesh.grid.rods):
        return np.empty(0)
    angle = np.min([joint_angles(mesh, shape) for shape in shapes], axis=0)
    return np.asarray(rod_breadth(rod) / np.tan(0.5 * angle) + options.slot_clearance)


def _remains(mesh: GridMesh, rod: Rod, options: Fabrication, slots: Floats, depth: float) -> tuple[Said, ...]:
    """A sentence where less of a strip remains next to a slot than that is deep."""
    crossings, found = mesh.grid.crossings, list[tuple[float, str, float]]()
    for k, line in enumerate(mesh.grid.rods):
        here, side = np.nonzero(crossings.rods == k)
        order = np.argsort(crossings.at[here, side])
        at, wide = crossings.at[here, side][order], slots[here][order]
        low, high = line.start - options.end_allowance, line.end + options.end_allowance
        left = np.append(at - 0.5 * wide, high) - np.insert(at + 0.5 * wide, 0, low)
        nearest = int(left.argmin())
        found.append((float(left.min()), line.name, float(wide[max(nearest - 1, 0) : nearest + 1].max())))
    least, name, width = min(found)
    if least >= depth:
        return ()
    angle = f"{np.degrees(2.0 * np.arctan2(rod_breadth(rod), width - options.slot_clearance)):.0f} degrees"
    return (
        said(
            "slots", None, least, depth, "m", place=name, angle=angle, width=length_text(width),
            left=length_text(max(least, 0.0)), depth=length_text(depth),
        ),
    )  # fmt: skip


def _laths(
    mesh: GridMesh, kind: Rod, options: Fabrication, curvature: Floats | None, *, short: float = 0.0
) -> tuple[tuple[Lath, ...], tuple[Said, ...]]:
    """All laths with their splices, pieces of under `short` joint distances being avoided, and a sentence about those
    that cannot be spliced."""
    stock, crossings = options.stock_length, mesh.grid.crossings
    broad = rod_breadth(kind)  # by which a curved piece's board may be longer than the piece
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
                bar = stock if rod.curve is None else stock - broad
                found = splices(
                    stop - start, inside - start, bar, stations=stations - start, curvature=bend[here],
                    short=short * apart, taken=np.array(spliced) - start,
                )  # fmt: skip
            if found is None:
                hopeless.setdefault(k, rod.name if lath == 1 else f"{rod.name} (lath {lath})")
            mine = tuple(at + start for at in found or ())
            spliced += mine
            name = rod.name if lath == 1 else f"{rod.name}-{lath}"
            made.append(Lath(k, name, lath, start, stop, mine))
    if not hopeless:
        return tuple(made), ()
    first = next(iter(hopeless.values()))
    named = f"rod {first}" if len(hopeless) == 1 else f"{len(hopeless)} rods (the first: {first})"
    assert stock is not None
    return tuple(made), (said("not_spliced", None, stock, unit="m", place=first, rods=named, stock=length_text(stock)),)


def _pieces_of(laths: Iterable[Lath]) -> tuple[Piece, ...]:
    return tuple(piece for lath in laths for piece in lath.pieces)
