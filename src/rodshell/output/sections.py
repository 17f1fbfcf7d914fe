"""The outline of the rods' section, and how it changes along a rod."""

import numpy as np

from rodshell.arrays import Floats
from rodshell.figures.form import Section, Stiffness
from rodshell.output.grid import GridRod, node_stations
from rodshell.results import Archive

ROUND = 8  # sides of a circle
SLENDER = 1e-3  # of the shell's size: thickness of a rod whose section has no shape


def section_outline(section: Section | None, size: float) -> Floats:
    """(s, 2) corners of the rods' section [m], across and up; of a section without a shape, a thin circle.

    Up is m1, the normal of the grid: a rectangle's width and an ellipse's a lie there.

    Args:
        size: of the shell [m], for the thickness of a section without a shape.
    """
    section = section or Section()
    if section.kind == "rectangle" and section.height is not None and section.width is not None:
        w, h = 0.5 * section.height, 0.5 * section.width
        return np.array([[w, -h], [w, h], [-w, h], [-w, -h]])
    radius = section.radius or SLENDER * size
    a, b = section.a or radius, section.b or radius
    angle = np.linspace(0, 2 * np.pi, ROUND, endpoint=False)
    return np.column_stack([b * np.cos(angle), a * np.sin(angle)])


def section_widths(archive: Archive, rod: GridRod) -> Floats | None:
    """(k, 2) widths across and up of a rod's section at its nodes, over those of the unchanged one; None: it does not
    change, or the flat grid is not known."""
    along = rod.record.stiffness
    return None if along is None or "flat" not in archive.states else widths_along(along, node_stations(archive, rod))


def widths_along(along: Stiffness, stations: Floats) -> Floats:
    """The same at distances (k,) from the rod's start [m]."""
    factors = np.interp(stations, along.at, along.factors)
    same = np.ones_like(factors)
    if along.varies in ("laths", "width", "a"):
        return np.column_stack([same, factors if along.varies == "laths" else np.cbrt(factors)])
    return np.column_stack([factors, same] if along.varies in ("height", "b") else 2 * [np.sqrt(np.sqrt(factors))])
