"""The rows of the paper's Figs 6 and 7: setup, draped, trimmed, and the flat grid with its ends."""

from collections.abc import Sequence

import numpy as np

from rodshell.arrays import Floats
from rodshell.layout import FlatGrid
from rodshell.paper.drapes import HEIGHT, WORDS, Drape
from rodshell.paper.genetic_history import stored_footprint
from rodshell.paper.panels import FINAL, FLAT, INK, Place, closed, dots, from_above, rods, rows_of_panels, standing

TITLES = (
    "1  the flat grid above the target",
    "2  draped",
    "3  trimmed",
    "4  ends of the drape (dots), of the exact net (dashed)",
)
WITH_SOUGHT = "4  drape (dots), net (dashed), genetic (violet)"


def rows_svg(drapes: Sequence[Drape]) -> str:
    """A row of four panels for each."""
    rows = []
    for one in drapes:
        name, spacing = one.case.target.name, 1e3 * one.case.spacing
        title = f"({one.case.label})  {name}, spacing {spacing:g} mm: {WORDS[one.method]}"
        captions = TITLES if _sought(one) is None else (*TITLES[:3], WITH_SOUGHT)
        rows.append((title, list(zip(captions, _panels(one), strict=True))))
    return rows_of_panels(rows)


def _panels(one: Drape) -> list[list[str]]:
    target, whole, cut = one.case.target, one.draped.mesh, one.trimmed
    top = float(target.lift(np.array([target.summit]))[0, 2])
    above = whole.flat + [*target.summit, top + HEIGHT]
    return [
        standing(target, whole, above, hides=False),
        standing(target, whole, one.draped.positions),
        standing(target, cut.mesh, cut.positions),
        _plan(one),
    ]


def _plan(one: Drape) -> list[str]:
    """The trimmed grid in its plane, the drape's ends, those of the net and those that the genetic algorithm found."""
    mesh, sought = one.trimmed.mesh, _sought(one)
    ends, net = (from_above(_in_the_grid(mesh.grid, some)) for some in (one.ends, one.net))
    others = [] if sought is None else [from_above(sought)]
    place = Place(np.vstack([ends, net, *others]))
    dashed = closed(place(net), INK, stroke_dasharray="5 3")
    found = [closed(place(other), FINAL) for other in others]
    return [*rods(mesh, place(from_above(mesh.flat))), *found, dashed, *dots(place(ends), FLAT)]


def _sought(one: Drape) -> Floats | None:
    """(2m, 2) G0 by the genetic algorithm [m], where it has been looked for on this target with these rods."""
    found = stored_footprint(one.case.target.name)
    return found if found is not None and len(found) == 2 * sum(one.case.rods) else None


def _in_the_grid(grid: FlatGrid, ends: Floats) -> Floats:
    """(2m, 2) ends of rods (m, 2) in the plane of the flat grid [m]."""
    along, across = ends.ravel(), np.repeat([rod.offset for rod in grid.rods], 2)
    of_u = np.repeat([rod.family == "u" for rod in grid.rods], 2)
    return np.column_stack([np.where(of_u, along, across), np.where(of_u, across, along)])
