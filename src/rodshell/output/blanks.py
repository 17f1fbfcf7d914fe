"""How rods are cut that are more than a length: laths along a curve from a board, and strips with slots."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import sqrt

import numpy as np
from scipy.spatial import ConvexHull

from rodshell.arrays import Floats
from rodshell.figures.form import RodJoint
from rodshell.layout.rest_curve import RestCurve
from rodshell.output.grid import GridRod, rods_of
from rodshell.output.sections import section_outline, widths_along
from rodshell.results.archive import Archive, made_once
from rodshell.results.laths import laths_on

POINTS = 250  # along a blank that turns by 1 rad: its chords lie within 2e-6 of its length
MOST_POINTS = 4000
QUARTER = np.array([[0.0, 1.0], [-1.0, 0.0]])  # directions times it are turned to the left


@dataclass(frozen=True, eq=False)
class Blank:
    """The outline of a rod in the board that it is cut from, whose lowest left corner is at 0, 0; the rod's start lies
    on the left.

    Args:
        stations: (k,) distances from the rod's start, from cut end to cut end [m].
        edges: (2, k, 2) its right and its left edge there [m].
        outline: (p, 2) its closed outline, with slots [m].
    """

    stations: Floats
    edges: Floats
    outline: Floats

    def across(self, s: float) -> Floats:
        """(2, 2) points of its right and its left edge at a distance from the rod's start [m]."""
        return np.array([[np.interp(s, self.stations, axis) for axis in edge.T] for edge in self.edges])

    def at(self, s: float) -> Floats:
        """(2,) the point of its centre line there [m]."""
        return np.asarray(self.across(s).mean(axis=0))

    @property
    def board(self) -> tuple[float, float]:
        """Length and width of the smallest board of its direction [m]."""
        length, width = self.outline.max(axis=0).tolist()
        return length, width


@made_once
def blanks_of(archive: Archive) -> dict[str, Blank]:
    """The blanks of all rods that are curved at rest or have slots, by their names."""
    rods = rods_of(archive)
    layers = {rod.id: rod.record.layer or 0 for rod in rods}
    made = archive.results.fabrication
    found = dict[str, Blank]()
    for rod in rods:
        if rod.record.rest_curvature is not None:
            found[rod.id] = curved_blank(archive, rod, -rod.allowance, rod.length + rod.allowance)
        elif made is not None and made.slot_depth and any(joint.slot for joint in rod.record.joints):
            across = _section(archive)[1]
            found[rod.id] = _slotted(rod, across, made.slot_depth, layers)
    return found


def boards_of(archive: Archive, rod: GridRod) -> Iterator[tuple[float, float]]:
    """Length and width of the smallest board for each piece of a rod that is curved at rest, those of laths on it being
    the last; nothing of a rod that is straight [m]."""
    if rod.record.rest_curvature is None:
        return
    along = rod.record.stiffness
    beyond = zip(laths_on(rod.record), along.splices or ((),) * 2, strict=False) if along else ()
    for (start, stop), splices in (((-rod.allowance, rod.length + rod.allowance), rod.record.splices), *beyond):
        for piece in pairwise((start, *splices, stop)):
            yield curved_blank(archive, rod, *piece).board


def curved_blank(archive: Archive, rod: GridRod, start: float, stop: float) -> Blank:
    """A part of a lath between cut ends, distances from the rod's start [m], laid so that its board is as narrow as can
    be; past its ends its curvature continues."""
    known, along = rod.record.rest_curvature, rod.record.stiffness
    assert known is not None
    turn = max(map(abs, known.curvatures)) * (stop - start)
    s = np.linspace(start, stop, min(int(POINTS * sqrt(turn)) + 3, MOST_POINTS))
    centre = RestCurve(known.at, known.curvatures).line(s)
    tangent = np.gradient(centre, s, axis=0, edge_order=2)
    half = 0.5 * _section(archive)[0] * (1.0 if along is None else widths_along(along, s)[:, :1])
    off = half * (tangent @ QUARTER)
    edges = np.array([centre - off, centre + off])
    points = edges.reshape(-1, 2)
    corners = points[ConvexHull(points, qhull_options="QJ").vertices]
    sides = np.roll(corners, -1, axis=0) - corners
    lengths = np.linalg.norm(sides, axis=1)
    sides = sides[lengths > 0] / lengths[lengths > 0, None]
    x, y = sides[np.ptp(corners @ (sides @ QUARTER).T, axis=0).argmin()]
    turned = np.array([[x, -y], [y, x]]) * np.copysign(1.0, (centre[-1] - centre[0]) @ (x, y))
    edges = edges @ turned - (points @ turned).min(axis=0)
    return Blank(s, edges, np.vstack([edges[0], edges[1, ::-1]]))


def _slotted(rod: GridRod, height: float, depth: float, layers: dict[str, int]) -> Blank:
    """A straight strip, seen from the side; the lower one of two is slotted from above."""
    ends = np.array([-rod.allowance, rod.length + rod.allowance])
    below, above = list[Floats](), list[Floats]()
    for joint in sorted(rod.record.joints, key=lambda joint: joint.at):
        if joint.slot:
            lower = layers[rod.id] < layers[joint.other]
            (above if lower else below).append(_slot(joint, -ends[0], height, depth, lower))
    length = ends[1] - ends[0]
    outline = np.vstack([(0.0, 0.0), *below, (length, 0.0), (length, height), *above[::-1], (0.0, height)])
    return Blank(ends, np.array([[(0.0, y), (length, y)] for y in (0.0, height)]), outline)


def _slot(joint: RodJoint, before: float, height: float, depth: float, lower: bool) -> Floats:
    """(4, 2) the edge of a slot, from left to right below the strip and from right to left above it [m]."""
    left, right = (before + joint.at + 0.5 * side * (joint.slot or 0.0) for side in (-1.0, 1.0))
    if lower:
        return np.array([(right, height), (right, height - depth), (left, height - depth), (left, height)])
    return np.array([(left, 0.0), (left, depth), (right, depth), (right, 0.0)])


def _section(archive: Archive) -> tuple[float, float]:
    """Widths of the rods' section within the grid and along its normal [m]; 0 where its shape is not known."""
    section = archive.results.rod and archive.results.rod.section
    within, along = np.ptp(section_outline(section or None, 0.0), axis=0).tolist()
    return within, along
