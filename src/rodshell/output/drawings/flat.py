"""Drawings for the workshop: the flat plan of both families as cut, and a strip for each rod.

The plan has rods, joints, labels, the footprint, and the diagonals by which the grid is set out. On a strip all
distances start at one end, so that errors do not add up. `text` is the usual size of a drawing's texts [mm at 1:1].
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import product

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from rodshell.arrays import Bools, Floats, Ints
from rodshell.figures.form import Stiffness
from rodshell.geometry.boxes import lines_meet
from rodshell.output.blanks import Blank, blanks_of
from rodshell.output.drawing import FAMILIES, INK, LETTER, LINE, PAPER, SMALL, Drawing, Pen, Pencil, Text
from rodshell.output.grid import GridJoint, GridRod, family_numbers, holes_text, joints_of, opens, outlines_of, rods_of
from rodshell.output.labels import Label, Room, callouts, closed_segments, outward, place, segments, spread, take
from rodshell.output.schedules import Show
from rodshell.results import Archive
from rodshell.results.archive import made_once
from rodshell.results.laths import laths_text
from rodshell.results.wording import Rounding, nice_ticks, rounding_of

_FLAT_TITLE = "Flat plan"
ROD = 0.18  # width of a rod's line, in text sizes
LARGEST = 0.85  # size of a joint's id at most, in text sizes
GAP = 0.06  # from an id to a rod, in text sizes
CORNERS = ((1, 1), (-1, 1), (1, -1), (-1, -1))
_STRIPS_TITLE = "Rod strips, distances from the cut end of the rod's start in mm"
TURNED = "*"  # after the name of a rod that equals the others of its strip when it is turned end for end
_STRIPS_LEGEND = (
    "Datum: left, the cut end of the rod's start. Full mark: the other rod lies over this one. S: splice "
    "(table Splices); S2: of the second lath.",
    f"Equal rods: the rods met and full marks are those of the first; {TURNED} turned, measured from its other end.",
    "Open triangle: support. Arrow: the section's size there [mm], or from there on the number of laths (L).",
)
_CURVED = "Curved laths: distances along the centre line of the blank, seen from above."
_SLOTS = "Slots: {} deep, their width at each of them; walls square to the strip's faces."
# On a strip, in text sizes: points, whether the line is closed, its width.
_SIGNS = {
    "splice": (((0.0, -0.5), (0.0, 0.5)), False, 0.2),
    "section": (((-0.25, -0.5), (0.0, 0.0), (0.25, -0.5)), False, 0.07),
    "support": (((0.0, 0.0), (-0.4, -0.7), (0.4, -0.7)), True, 0.07),
}
TALL = 15.0  # text sizes from strip to strip
SLOT = 5.0  # further ones where widths of slots are written
MOST_EQUAL = 16  # rods that one strip stands for: their names have room below it
ALIKE = 1e-4  # m: by which lengths and holes of equal rods differ at most, or half a digit where that is less
LEADING = 1.4  # text sizes from line to line of the legend


@dataclass(frozen=True, eq=False)
class FlatPlan:
    """The content of the flat plan.

    Args:
        rods, joints: as in the result [m].
        lines: (r, 2, 2) start and end of each rod on the footprint [mm].
        cuts: (r, 2, 2) start and end of each rod as it is cut, with its allowances [mm].
        courses: (k, 2) of each rod along it, from cut to cut [mm].
        marks: (c, 2) the joints, in the order of `joints` [mm].
        outlines: rod ends around the grid and around each opening, see `outlines_of`.
        footprint: closed curves (f, 2) through them [mm].
        boundary: closed curves (f, 3) through the final rod ends [mm], vertex by vertex those of `footprint`; none if
            they are not known.
        laths: how much lies on the rods, in words; "" where nothing does.
        blanks: outlines by the names of rods that are more than a length, see `blanks_of` [m].
        slot_depth: of strips that cross by slots [m].
        holes: at the joints, in words; "" where there are slots.
    """

    rods: list[GridRod]
    joints: list[GridJoint]
    lines: Floats
    cuts: Floats
    courses: list[Floats]
    marks: Floats
    outlines: list[Ints]
    footprint: list[Floats]
    boundary: list[Floats]
    rounding: Rounding
    laths: str
    blanks: dict[str, Blank]
    slot_depth: float | None
    holes: str

    @cached_property
    def extent(self) -> float:
        """The longer side of the plan [mm]."""
        return float(np.ptp(self.lines.reshape(-1, 2), axis=0).max()) if len(self.lines) else 1.0

    @cached_property
    def spacing(self) -> float:
        """The median distance of neighbouring joints on a rod [mm]."""
        steps = [np.diff(np.sort([at for _, at in rod.joints])) for rod in self.rods]
        steps = [step[step > 1e-6] for step in steps]
        known = np.concatenate(steps) if steps else np.empty(0)
        return 1e3 * np.median(known) if len(known) else self.extent / 10

    @cached_property
    def notes(self) -> list[str]:
        """Of each joint: its id, and where it is on both rods."""

        def place(rod: int, at: float) -> str:
            return f"{self.rods[rod].id} at {self.rounding.mm(self.rods[rod].from_cut_end(at))} mm"

        return [f"{joint.id}: {', '.join(map(place, joint.rods, joint.at))}" for joint in self.joints]

    @cached_property
    def diagonals(self) -> list[tuple[Floats, Floats]]:
        """The two of each grid's largest rectangle with a joint at every crossing: by them it is set out square.

        No diagonal runs over an opening; grids that do not touch each other, as patches with seams, have two each.
        """
        found = []
        for patch in _patches(self):
            x, y = (np.unique(np.round([_offset(self.rods[pair[k]]) for pair in patch], 9)) for k in (1, 0))
            met = np.zeros((len(y), len(x)), dtype=bool)
            for u, v in patch:
                row, column = (int(np.abs(at - _offset(self.rods[k])).argmin()) for at, k in ((y, u), (x, v)))
                met[row, column] = True
            best = _largest_full(met, x, y)
            if best is not None:
                left, right, low, high = (1e3 * value for value in best)
                found.append((np.array([left, low]), np.array([right, high])))
                found.append((np.array([left, high]), np.array([right, low])))
        return found

    @cached_property
    def text(self) -> float:
        """Size of the rods' labels at 1:1 [mm]: joint ids find room between the rods."""
        longest = max((len(joint.id) for joint in self.joints), default=1)
        return min(self.spacing / (SMALL * LETTER * longest + 0.95), 0.25 * self.spacing, 0.015 * self.extent)

    @cached_property
    def summary(self) -> str:
        """The cut list in one line; lengths as cut."""
        lengths = [rod.cut_length for rod in self.rods]
        laths = f" and {self.laths}" if self.laths else ""
        return (
            f"{len(self.rods)} rods, {len(self.joints)} joints, {sum(lengths):.1f} m in total{laths}, "
            f"longest {self.rounding.mm(max(lengths, default=0.0))} mm"
            + (", with allowances" if self.allowances else "")
        )

    @cached_property
    def equal(self) -> dict[str, list[str]]:
        """The first of rods that are cut and drilled alike within ALIKE, and all of them, at most MOST_EQUAL; those
        that have to be turned end for end for it have a `TURNED` after their names."""
        groups = list[tuple[object, Floats, list[str]]]()
        for rod in self.rods:
            blank, along, end = self.blanks.get(rod.id), rod.record.stiffness, rod.length
            holes = np.array([(joint.at, joint.slot or 0.0) for joint in rod.record.joints]).reshape(-1, 2)
            cuts, outline = np.array(rod.record.splices), np.empty(0) if blank is None else blank.outline.ravel()
            words, lengths = (along, len(holes), len(cuts)), [rod.cut_length, rod.allowance]
            sizes = np.concatenate([lengths, *holes, cuts, outline])
            turned = np.concatenate([lengths, *((end, 0.0) + (-1.0, 1.0) * holes[::-1]), end - cuts[::-1]])
            ways = [("", sizes), (TURNED, turned)] if blank is None and along is None else [("", sizes)]
            found = (
                (ids, mark)
                for same, first, ids in groups
                for mark, way in ways
                if same == words and len(ids) < MOST_EQUAL and first.shape == way.shape
                and np.allclose(first, way, rtol=0.0, atol=min(ALIKE, 0.5e-3 * self.rounding.step))
            )  # fmt: skip
            ids, mark = next(found, (None, ""))
            if ids is None:
                groups.append((words, sizes, [rod.id]))
            else:
                ids.append(rod.id + mark)
        return {ids[0]: ids for _, _, ids in groups}

    @property
    def allowances(self) -> bool:
        """Whether rods are cut longer than they are between their supports."""
        return any(rod.allowance for rod in self.rods)


@made_once
def flat_plan(archive: Archive) -> FlatPlan:
    """The flat plan of an archive."""
    rods = rods_of(archive)
    joints = joints_of(rods)
    lines = np.array([rod.flat for rod in rods]).reshape(-1, 2, 2)
    courses = [1e3 * rod.as_cut for rod in rods]
    cuts = np.array([course[[0, -1]] for course in courses]).reshape(-1, 2, 2)
    marks = np.array([rods[joint.rods[0]].point(joint.at[0]) for joint in joints]).reshape(-1, 2)
    footprint = np.array(archive.results.footprint or lines.reshape(-1, 2), dtype=float).reshape(-1, 2)
    boundary = np.array(archive.results.boundary, dtype=float).reshape(-1, 3)
    loops = outlines_of(archive)
    return FlatPlan(
        rods, joints, 1e3 * lines, cuts, courses, 1e3 * marks, loops,
        [1e3 * footprint[loop] for loop in loops],
        [1e3 * boundary[loop] for loop in loops] if len(boundary) == len(footprint) else [],
        rounding_of(archive.results), laths_text(archive.results), blanks_of(archive),
        archive.results.fabrication.slot_depth if archive.results.fabrication else None, holes_text(archive),
    )  # fmt: skip


def flat_drawing(plan: FlatPlan, text: float) -> Drawing:
    """The flat plan [mm], its rods labelled in the size `text` [mm]."""
    pencil = Pencil()
    for outline in plan.footprint:
        pencil.line(outline, "BOUNDARY-FLAT", closed=True)
    for outline in plan.boundary:
        pencil.line(outline, "BOUNDARY-FINAL", closed=True)
    _rods(pencil, plan, text)
    lines = np.concatenate([segments(plan.courses), *map(closed_segments, plan.footprint)])
    _labels(pencil, plan, text, lines)
    room = _joints(pencil, plan, text, lines, np.array(plan.diagonals).reshape(-1, 2, 2))
    for a, b in plan.diagonals:
        _dimension(pencil, plan, a, b, text, room)
    _axes(pencil, plan, text)
    return pencil.done("plan", _FLAT_TITLE, text)


def _rods(pencil: Pencil, plan: FlatPlan, text: float) -> None:
    """Each rod as cut; a dot at the cut end from which its joints are measured, a tick where it is held."""
    families = family_numbers(rod.family for rod in plan.rods)
    for rod, cut, line, family in zip(plan.rods, plan.courses, plan.lines, families, strict=True):
        pen = Pen(FAMILIES[family % len(FAMILIES)], ROD * text)
        pencil.line(cut, "CUT", pen=pen, name=rod.id, note=f"{rod.id}: {plan.rounding.mm(rod.cut_length)} mm")
        pencil.mark(cut[0], min(0.2 * text, 0.08 * plan.spacing), "DIM", pen=Pen(INK, 0.0, fill=INK))
        if rod.allowance > 0:
            along = line[1] - line[0]
            across = 0.3 * text * np.array([-along[1], along[0]]) / np.linalg.norm(along)
            for end in line:
                pencil.line([end - across, end + across], "DIM")


def _joints(pencil: Pencil, plan: FlatPlan, text: float, lines: Floats, across: Floats) -> Room:
    """A mark at each joint, and its id in a corner of the mesh next to it, nearer to it than to the next joint; returns
    the room that all texts take.

    It is clear of all `lines` (m, 2, 2), and of those `across` (d, 2, 2) if it can be.
    An id that finds no room, or only in letters too small to read, is left to the mark's note and the schedule.
    """
    radius = min(0.25 * text, 0.04 * plan.spacing, 1.0)
    clear = max(radius, 0.5 * ROD * text) + GAP * text
    room, both, left_out = Room(plan.spacing), np.concatenate([lines, across]), 0
    for there in pencil.texts:
        room.take(there.box())
    for joint, mark, note in zip(plan.joints, plan.marks, plan.notes, strict=True):
        pencil.mark(mark, radius, "MARK", note=note)
        size = min(LARGEST * text, (plan.spacing - 3 * clear) / (LETTER * len(joint.id)))
        off = clear + 0.5 * size * np.array([LETTER * len(joint.id), LINE])
        labels = [Label(joint.id, mark + off * corner, 0.0, mark, moved=False).written(size) for corner in CORNERS]
        tried = product((both, lines), labels if size >= SMALL * text else ())
        left_out += not room.write(
            pencil, (label for clear_of, label in tried if not lines_meet(label.box(), clear_of))
        )
    pencil.leave_out(left_out, len(plan.joints), "joint ids (named by the rods that cross)")
    return room


def _labels(pencil: Pencil, plan: FlatPlan, text: float, lines: Floats) -> None:
    """Each rod's label at its ends, on its line; in an opening, around it."""
    names = [rod.id for rod in plan.rods]
    inside = [loop for loop in plan.outlines if opens(plan.lines.reshape(-1, 2)[loop])]
    outside = np.ones(2 * len(names), dtype=bool)
    outside[[end for loop in inside for end in loop]] = False
    labels, room = place(names, plan.cuts, text, at=outside.reshape(-1, 2)), Room(4 * text)
    named = {label.text for label in labels}
    for label in labels:
        pencil.texts.append(label.written(text))
        take(label, text, room)
        if label.moved:
            pencil.line(label.leader(text), "DIM")
    for loop in inside:
        points = plan.cuts.reshape(-1, 2)[loop]
        away = outward(points)
        for callout in callouts([names[end // 2] for end in loop], points, away, text, room, lines):
            named.add(callout.written.text)
            pencil.texts.append(callout.written)
            pencil.line(callout.line, "DIM")
    pencil.leave_out(len(set(names) - named), len(names), "names of rods")


def _offset(rod: GridRod) -> float:
    return rod.record.offset or 0.0


def _patches(plan: FlatPlan) -> list[list[tuple[int, int]]]:
    """The rods along x and y of each joint of such two, grid by grid."""
    pairs = [joint.rods for joint in plan.joints if [plan.rods[k].axis for k in joint.rods] == [0, 1]]
    first, second = np.array(pairs, dtype=np.intp).reshape(-1, 2).T
    met = coo_array((np.ones(len(pairs)), (first, second)), shape=2 * (len(plan.rods),))
    patch = connected_components(met)[1][first]
    return [[pair for pair, k in zip(pairs, patch, strict=True) if k == name] for name in dict.fromkeys(patch)]


def _largest_full(met: Bools, x: Floats, y: Floats) -> tuple[float, float, float, float] | None:
    """Lowest and highest x, then y, of the largest rectangle of a lattice within which all of it is there."""
    best: tuple[float, tuple[float, float, float, float] | None] = (0.0, None)
    for low in range(len(y)):
        full = met[low].copy()
        for high in range(low + 1, len(y)):
            full &= met[high]
            steps = np.diff(np.concatenate([[False], full, [False]]).astype(int))
            begin, end = np.flatnonzero(steps > 0), np.flatnonzero(steps < 0) - 1
            for left, right in zip(x[begin], x[end], strict=True):
                area = float((right - left) * (y[high] - y[low]))
                if area > best[0]:
                    best = (area, (float(left), float(right), float(y[low]), float(y[high])))
    return best[1]


def _dimension(pencil: Pencil, plan: FlatPlan, a: Floats, b: Floats, text: float, room: Room) -> None:
    """A thin line with its length, written off what takes `room`, a third of the way along if it can be."""
    along = b - a
    pencil.line([a, b], "DIM", pen=Pen("#b08a2e", 0.05 * text, (1.5 * text, 0.5 * text, 0.3 * text, 0.5 * text)))
    words, angle = plan.rounding.mm(1e-3 * float(np.linalg.norm(along))), float(np.arctan2(along[1], along[0]))
    shares = sorted(np.linspace(0.1, 0.9, 81).tolist(), key=lambda share: abs(share - 0.33))
    tried = (
        Text(words, a + share * along, size, "DIM", "middle", angle, colour="#8a6a1c")
        for size, share in product((text, SMALL * text), shares)
    )
    room.write(pencil, tried)


def _axes(pencil: Pencil, plan: FlatPlan, text: float) -> None:
    """A frame with millimetre ticks along its lower and left side, and a scale bar of one tick."""
    corners = np.concatenate([plan.cuts.reshape(-1, 2), *(label.box() for label in pencil.texts), np.zeros((1, 2))])
    low, high = corners.min(axis=0) - text, corners.max(axis=0) + text
    frame = [low, (high[0], low[1]), high, (low[0], high[1])]
    pencil.line(frame, "DIM", closed=True)
    side_ticks(pencil, low, high, text, 8, names="xy")


def side_ticks(pencil: Pencil, low: Floats, high: Floats, text: float, count: int, *, names: str = "") -> None:
    """Ticks [mm] within the lower and the left side of a box, `count` at most, and the names of the axes at their
    ends."""
    for axis, (inwards, off, anchor) in enumerate((((0, 1), (0, -1.1), "middle"), ((1, 0), (-0.4, -0.3), "end"))):
        for value in nice_ticks(low[axis], high[axis] - (2 * text if names else 0), count):
            foot = np.where(np.arange(2) == axis, value, low)
            pencil.line([foot, foot + 0.4 * text * np.array(inwards)], "DIM")
            pencil.write(f"{value:g}", foot + text * np.array(off), 0.8 * text, "DIM", anchor=anchor)
        if names:
            end = (high[0], low[1] - 1.1 * text) if axis == 0 else (low[0] - 0.4 * text, high[1] - text)
            pencil.write(names[axis], end, 0.8 * text, "DIM", anchor="end")


# Strips


def strips_drawing(plan: FlatPlan, text: float, rods: Sequence[GridRod] | None = None) -> Drawing:
    """The strips of some rods, each for all that equal it (default: each rod's own), one below the other [mm], all
    starting at x = 0."""
    pencil, y = Pencil(), 0.0
    layer = {rod.id: rod.record.layer for rod in plan.rods}
    chosen = plan.rods if rods is None else rods
    for k, rod in enumerate(chosen):
        y -= strip_size(plan, rod, text)[1]
        ids = [rod.id] if rods is None else plan.equal.get(rod.id, [rod.id])
        _strip(pencil, rod, ids, plan.blanks.get(rod.id), y - k * TALL * text, text, layer, plan.rounding.mm)
    for row, line in enumerate(_legend(plan)):
        pencil.write(line, (0.0, y - len(chosen) * TALL * text + (9.0 - LEADING * row) * text), text, "DIM")
    return pencil.done("strips", _STRIPS_TITLE, text)


def sheets_of_strips(plan: FlatPlan, height: float, text: float) -> list[list[GridRod]]:
    """The rods whose strips find room one below the other in a height [mm], with texts of a size [mm]; of equal rods
    the first."""
    sheets, left = list[list[GridRod]](), 0.0
    for rod in (rod for rod in plan.rods if rod.id in plan.equal):
        taken = TALL * text + strip_size(plan, rod, text)[1]
        if not sheets or taken > left + 1e-9 * height:
            sheets.append([])
            left = height - 3 * text - LEADING * text * len(_legend(plan)[len(_STRIPS_LEGEND) :])
        sheets[-1].append(rod)
        left -= taken
    return sheets


def strip_size(plan: FlatPlan, rod: GridRod, text: float) -> tuple[float, float]:
    """Length of a rod's strip, and what it takes across in addition to that of a line, with texts of a size [mm]."""
    length, width = plan.blanks[rod.id].board if rod.id in plan.blanks else (0.0, 0.0)
    return 1e3 * max(rod.cut_length, length), 1e3 * width + SLOT * text * any(on.slot for on in rod.record.joints)


def _legend(plan: FlatPlan) -> list[str]:
    curved = [_CURVED] if any(rod.record.rest_curvature for rod in plan.rods) else []
    slots = [] if plan.slot_depth is None else [_SLOTS.format(plan.rounding.mm(plan.slot_depth))]
    holes = [f"Round marks: {plan.holes}."] if plan.holes else []
    return [*_STRIPS_LEGEND, *holes, *curved, *slots]


def _strip(
    pencil: Pencil, rod: GridRod, ids: list[str], blank: Blank | None, y: float, text: float,
    layer: dict[str, int | None], mm: Show,
) -> None:  # fmt: skip
    """One rod, or equal ones: above it the distances and the rods that are met there, below it what it is."""
    cut, start = 1e3 * rod.cut_length, 1e3 * rod.from_cut_end(0.0)
    note = f"{rod.id}: {mm(rod.cut_length)} mm"
    by_layer = dict[int | None, list[str]]()
    for name in ids:
        by_layer.setdefault(layer.get(name.removesuffix(TURNED)), []).append(name)
    named = ", ".join(f"{', '.join(some)}{f' (layer {on})' if on is not None else ''}" for on, some in by_layer.items())
    words = [f"{len(ids)} \N{MULTIPLICATION SIGN} {named}" if len(ids) > 1 else named, f"cut {mm(rod.cut_length)}"]
    if blank is None:
        pencil.line([(0.0, y), (cut, y)], "CUT", name=rod.id, note=note)
    else:
        pencil.line(1e3 * blank.outline + (0.0, y), "CUT", closed=True, name=rod.id, note=note)
        words.append(f"board {' x '.join(map(mm, blank.board))}")
    if start > 0:
        words.append(f"with {mm(rod.allowance)} at each end for the supports")
    pencil.write("   ".join(filter(None, words)), (0.0, y - 2.2 * text), 1.1 * text, "LABEL", bold=True)
    joints = ((1e3 * rod.from_cut_end(joint.at), joint.other, "slot" if joint.slot else "joint")
              for joint in rod.record.joints)  # fmt: skip
    slots = {joint.other: f"  slot {mm(joint.slot)}" for joint in rod.record.joints if joint.slot}
    along = rod.record.stiffness
    first, last = map(_size, (along.sizes[0], along.sizes[-1])) if along and along.sizes else ("", "")
    stops = [(0.0, first, ""), *joints, (cut, last, "")]
    stops += [(1e3 * rod.from_cut_end(at), "S", "splice") for at in rod.record.splices]
    if along is not None:
        beyond = enumerate(along.splices, start=2)
        stops += [(1e3 * rod.from_cut_end(at), f"S{lath}", "splice") for lath, spliced in beyond for at in spliced]
        stops += [(1e3 * rod.from_cut_end(at), size, "section") for at, size in _section_marks(along)]
    if start > 0:
        stops += [(start, "", "support"), (cut - start, "", "support")]

    def place(at: float) -> Floats:
        return np.array([at, y]) if blank is None else 1e3 * blank.at(1e-3 * (at - start)) + (0.0, y)

    marks = {at: place(at) for at, _, _ in stops}
    stops.sort(key=lambda stop: float(marks[stop[0]][0]))
    top = y if blank is None else y + 1e3 * blank.board[1]
    spaced = spread([float(marks[at][0]) for at, _, _ in stops], 1.15 * text)
    for (at, name, kind), x in zip(stops, spaced, strict=True):
        below = _over(layer.get(name), rod.record.layer)
        said = f"{mm(1e-3 * at)}  {name}{slots.get(name, '')}".rstrip()
        ends = None if blank is None else 1e3 * blank.across(1e-3 * (at - start)) + (0.0, y)
        _stop(pencil, marks[at], ends, (float(x), top), text, said, kind, named=bool(name), full=below)


def _over(other: int | None, here: int | None) -> bool:
    """Whether a layer is known to lie over that of a rod."""
    return here is not None and other is not None and other > here


def _section_marks(along: Stiffness) -> list[tuple[float, str]]:
    """Where a rod's section is marked between its ends [m], and what it is there: a size in mm, or the laths that lie
    on each other from there on."""
    if along.varies == "laths":
        inner = range(1, len(along.at))
        return [(along.at[k], f"{along.factors[k]:g} L") for k in inner if along.at[k] == along.at[k - 1]]
    return [(at, _size(size)) for at, size in zip(along.at[1:-1], along.sizes[1:-1], strict=False)]


def _size(metres: float) -> str:
    return f"\N{EMPTY SET}{1e3 * metres:.3g}"


def _stop(
    pencil: Pencil, at: Floats, ends: Floats | None, to: tuple[float, float], text: float, words: str, kind: str, *,
    named: bool, full: bool,
) -> None:  # fmt: skip
    """A mark at `at` (2,), its text above `to`, and a line from the text through the middle of the mark; a splice ends
    at the edges `ends` (2, 2) of a blank."""
    (u, v), (x, y) = at.tolist(), to
    way = [(x, y + 1.87 * text), (u, y + 0.7 * text), (u, y if kind == "slot" else v - 0.7 * text if named else v)]
    pencil.line(way if abs(x - u) > 1e-6 else [way[0], way[-1]], "DIM")
    pencil.write(words, (x + 0.35 * text, y + 2.0 * text), text, "LABEL", angle=np.pi / 2)
    if kind == "joint":
        pencil.mark((u, v), 0.35 * text, "MARK", pen=Pen("#b3372c", 0.07 * text, fill="#b3372c" if full else PAPER))
    elif kind == "splice" and ends is not None:
        pencil.line(ends, "MARK")
    elif kind in _SIGNS:
        points, closed, width = _SIGNS[kind]
        pencil.line(
            [(u + a * text, v + b * text) for a, b in points], "MARK", closed=closed, pen=Pen(INK, width * text)
        )
