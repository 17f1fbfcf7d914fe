"""Figures 6 and 7: the paper's targets draped by its method, by gravity statics and bound, against the exact net."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from time import perf_counter
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.formfinding import Bound, Draped, Fall, Gravity, Method, Trimmed, drape, trim
from rodshell.formfinding.methods import MethodName
from rodshell.formfinding.trim import ends_past_net
from rodshell.layout import FlatGrid
from rodshell.output.drawing import FAMILIES
from rodshell.output.svg import label, tag
from rodshell.paper.figure import (
    CASES,
    FINAL,
    FLAT,
    HEIGHT,
    INK,
    LINE,
    PANEL,
    ROD,
    SOFT,
    WIDE_CASES,
    Case,
    Figure,
    PanelScale,
    Part,
    Row,
    closed,
    dots,
    from_above,
    rod_lines,
    rows_of_panels,
    standing,
)
from rodshell.paper.genetic_records import stored
from rodshell.progress import Progress
from rodshell.results.wording import nice_ticks

FALL = Fall(height=HEIGHT)  # shared DOFs: the paper's *mapping*
METHODS: tuple[MethodName, ...] = ("paper", "gravity", "bound")
_METHOD_COLOURS = {"paper": FAMILIES[1], "gravity": FAMILIES[0], "bound": FLAT}
WORDS = {"paper": "paper's, in time", "gravity": "gravity statics", "bound": "bound to the target"}
COLUMNS = (
    "target", "rods", "method", "unknowns", "time [s]", "ends off the net, max [mm]", "rms [mm]", "how it rests",
)  # fmt: skip
TITLES = (
    "1  the flat grid above the target",
    "2  draped",
    "3  trimmed",
    "4  ends of the drape (dots), of the exact net (dashed)",
)
_WITH_SOUGHT = "4  drape (dots), net (dashed), genetic (violet)"


@dataclass(frozen=True, eq=False)
class DrapeRun(Part):
    """One case by one method.

    Args:
        case, method: what was draped, and how.
        seconds: time of drape and trim.
        ends: (m, 2) start and end of each rod at the target's end [m]: those of G0; for the bound drape, whose G0 is
            that of the net, those of the draped rods.
        net: (m, 2) those of the exact net [m].
    """

    case: Case
    method: MethodName
    draped: Draped
    trimmed: Trimmed
    seconds: float
    ends: Floats
    net: Floats

    @property
    def errors(self) -> Floats:
        """(2m,) distance by which the rod ends of the drape lie beyond those of the net [m]."""
        return np.column_stack([self.net[:, 0] - self.ends[:, 0], self.ends[:, 1] - self.net[:, 1]]).ravel()

    @property
    def status(self) -> str:
        """ "converged", or that it did not come to rest."""
        if self.draped.converged:
            return "converged"
        return f"({self.case.label}) by method {self.method} {self.draped.report.status.sentence}"

    @property
    def rest(self) -> str:
        """Whether it is at rest, and stable, in a few words."""
        rest = self.draped.rest
        if rest is not None:
            if not rest.at_rest:
                return f"NOT AT REST after {rest.time:.1f} s"
            growth = rest.fastest_growth
            return f"after {rest.time:.1f} s; " + (f"unstable sideways, {growth:.1f} per s" if growth else "stable")
        if not self.draped.converged:
            return self.draped.report.status.value.upper()
        held = ", one joint and its heading held" if self.method == "gravity" else ""
        modes = self.draped.report.negative_modes
        return ("stable" if modes == 0 else f"{modes} negative modes") + held

    def rows(self) -> list[Row]:
        error = 1e3 * np.abs(self.errors)
        return [(
            f"({self.case.label}) {self.case.target.name}, {1e3 * self.case.spacing:g} mm",
            f"{self.case.rods[0]}x{self.case.rods[1]}", WORDS[self.method], str(self.draped.report.dofs),
            f"{self.seconds:.3g}", f"{error.max():.2f}", f"{np.sqrt(np.mean(error**2)):.2f}", self.rest,
        )]  # fmt: skip

    def result(self) -> dict[str, Any]:
        rods = self.trimmed.mesh.grid.rods
        return {
            "case": self.case.label, "target": self.case.target.parameters(), "method": self.method,
            "spacing": self.case.spacing, "edge": self.case.edge, "dofs": self.draped.report.dofs,
            "status": self.draped.report.status.value, "seconds": self.seconds,
            "error_max": float(np.abs(self.errors).max()), "error_rms": float(np.sqrt(np.mean(self.errors**2))),
            "rods": [
                {"id": rod.name, "offset": rod.offset, "start": ends[0], "end": ends[1], "net": net}
                for rod, ends, net in zip(rods, self.ends.tolist(), self.net.tolist(), strict=True)
            ],
        }  # fmt: skip


def drape_all(
    cases: Sequence[Case], progress: Progress, *, fall: Fall = FALL, methods: Sequence[MethodName] = METHODS
) -> tuple[DrapeRun, ...]:
    """Every case by every method, the falls with the settings `fall`."""
    return tuple(_drape(case, method, fall, progress) for case in cases for method in methods)


def _drape(case: Case, method: MethodName, fall: Fall, progress: Progress) -> DrapeRun:
    def case_progress(stage: str, detail: str, residual: float) -> None:
        progress(f"({case.label}) {case.target.name}, {stage}", detail, residual)

    begun = perf_counter()
    options: dict[MethodName, Method] = {"paper": fall, "gravity": Gravity(), "bound": Bound()}
    draped = drape(case.layout, ROD, case.target, method=options[method], progress=case_progress)
    trimmed = trim(draped)
    seconds = perf_counter() - begun
    past, cuts = ends_past_net(trimmed), np.array([(rod.start, rod.end) for rod in trimmed.mesh.grid.rods])
    assert past is not None
    outwards = past * [-1.0, 1.0]
    net = cuts if method == "bound" else cuts - outwards
    return DrapeRun(case, method, draped, trimmed, seconds, net + outwards, net)


def rows_svg(drapes: Sequence[DrapeRun]) -> str:
    """A row of four panels for each drape: setup, draped, trimmed, and the flat grid with its ends."""
    rows = []
    for run in drapes:
        name, spacing = run.case.target.name, 1e3 * run.case.spacing
        title = f"({run.case.label})  {name}, spacing {spacing:g} mm: {WORDS[run.method]}"
        captions = TITLES if _sought(run) is None else (*TITLES[:3], _WITH_SOUGHT)
        rows.append((title, list(zip(captions, _panels(run), strict=True))))
    return rows_of_panels(rows)


def _panels(run: DrapeRun) -> list[list[str]]:
    target, whole, cut = run.case.target, run.draped.mesh, run.trimmed
    top = float(target.lift(np.array([target.summit]))[0, 2])
    above = whole.flat + [*target.summit, top + HEIGHT]
    return [
        standing(target, whole, above, hides=False),
        standing(target, whole, run.draped.positions),
        standing(target, cut.mesh, cut.positions),
        _plan(run),
    ]


def _differences_svg(drapes: Sequence[DrapeRun]) -> str:
    """A panel for each case: how far each rod end lies past the exact net's, by every method, in mm."""
    panels = []
    for name in dict.fromkeys(run.case.label for run in drapes if run.draped.converged):
        same = [run for run in drapes if run.case.label == name and run.draped.converged]
        drawn = [(WORDS[run.method], _METHOD_COLOURS[run.method], 1e3 * run.errors) for run in same]
        if (sought := _sought(same[0])) is not None:
            rods = same[0].trimmed.mesh.grid.rods
            along = np.abs((sought * np.repeat([rod.direction for rod in rods], 2, axis=0)).sum(axis=1))
            drawn.append(("genetic algorithm", FINAL, 1e3 * (along - np.abs(same[0].net.ravel()))))
        offsets = 1e3 * np.repeat([rod.offset for rod in same[0].trimmed.mesh.grid.rods], 2)
        panels.append((f"({name})  {same[0].case.target.name}", list(_scatter(offsets, drawn))))
    return rows_of_panels([("Rod ends past those of the exact net [mm], against the offset of their rod [mm]", panels)])


def _scatter(x: Floats, drawn: Sequence[tuple[str, str, Floats]]) -> Iterator[str]:
    """Dots of some series (name, colour, y) over the same x, with axes; the zero line is the net."""
    everything = np.concatenate([[0.0], *(y for _, _, y in drawn)])
    low, high, wide = float(everything.min()), float(everything.max()), float(np.abs(x).max())
    foot = PANEL - 14.0 * len(drawn) - 16.0

    def at(across: Floats | float, up: Floats | float) -> tuple[Floats, Floats]:
        return 30 + (PANEL - 36) * (np.asarray(across) / wide + 1) / 2, foot * (high - np.asarray(up)) / (high - low)

    for tick in nice_ticks(low, high, 5):
        height = float(at(0.0, tick)[1])
        yield tag("line", x1=30, x2=PANEL, y1=height, y2=height, stroke=INK if tick == 0 else LINE, stroke_width=0.8)
        yield label(f"{tick:g}", 26, height + 3, 9.0, fill=SOFT, text_anchor="end")
    for tick in (-wide, 0.0, wide):
        yield label(f"{tick:.0f}", float(at(tick, 0.0)[0]), foot + 12, 9.0, fill=SOFT, text_anchor="middle")
    for k, (name, colour, y) in enumerate(drawn):
        yield from dots(np.column_stack(at(x, y)), colour, 2.6 - 0.9 * (k % 2))  # where two agree, both are seen
        yield label(name, 30, foot + 26 + 14 * k, 10.0, fill=colour)


def _plan(run: DrapeRun) -> list[str]:
    """The trimmed grid in its plane, the drape's ends, those of the net and those that the genetic algorithm found."""
    mesh, sought = run.trimmed.mesh, _sought(run)
    ends, net = (from_above(_in_the_grid(mesh.grid, spans)) for spans in (run.ends, run.net))
    others = [] if sought is None else [from_above(sought)]
    to_panel = PanelScale(np.vstack([ends, net, *others]))
    dashed = closed(to_panel(net), INK, stroke_dasharray="5 3")
    found = [closed(to_panel(other), FINAL) for other in others]
    return [*rod_lines(mesh, to_panel(from_above(mesh.flat))), *found, dashed, *dots(to_panel(ends), FLAT)]


def _sought(run: DrapeRun) -> Floats | None:
    """(2m, 2) G0 by the best of the stored genetic searches [m], if there are any for this target with these rods."""
    best = next(iter(stored(run.case.target.name)), None)
    return best.footprint if best is not None and len(best.footprint) == 2 * sum(run.case.rods) else None


def _in_the_grid(grid: FlatGrid, ends: Floats) -> Floats:
    """(2m, 2) ends of rods (m, 2) in the plane of the flat grid [m]."""
    return np.vstack([rod.point(cuts) for rod, cuts in zip(grid.rods, ends, strict=True)])


@dataclass(frozen=True)
class DrapeFigure(Figure):
    """Every case by every method.

    Args:
        parts: case by case, each by every method.
    """

    name: str
    title: str
    parts: tuple[DrapeRun, ...]
    columns, key = COLUMNS, "drapes"

    def pictures(self) -> dict[str, str]:
        """The paper's method in NAME.svg, each other in NAME-METHOD.svg; the ends of all in NAME-differences.svg."""
        return {f"{self.name}-differences": _differences_svg(self.parts)} | {
            self.name if method == "paper" else f"{self.name}-{method}": rows_svg(
                [run for run in self.parts if run.method == method]
            )
            for method in METHODS
        }


def make_fig6(progress: Progress) -> DrapeFigure:
    """Figure 6: the three targets, from the flat grid to G0 [HQK 3.2]."""
    title = "Fig 6 [HQK 3.2]: from the flat grid to G0, by three methods; where each ends against the inextensible net"
    return DrapeFigure("fig6", title, drape_all(CASES, progress))


def make_fig7(progress: Progress) -> DrapeFigure:
    """Figure 7: the hemisphere with wider spacings [HQK 3.2]."""
    title = "Fig 7 [HQK 3.2]: the hemisphere at spacings of 4 and 5 cm, by three methods; ends against the net's"
    return DrapeFigure("fig7", title, drape_all(WIDE_CASES, progress))
