"""Figure 1: three shells, and the boundaries between which their rods' ends move [HQK 1].

The shells are popped up, as in the paper, with their ends pinned on G; the table also has clamped ends, which hold the
rods' direction.
"""

from dataclasses import dataclass, replace
from time import perf_counter
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.formfinding import Stages, find_stages
from rodshell.output.svg import tag
from rodshell.paper.figure import (
    CASES,
    FINAL,
    FLAT,
    ROD,
    SOFT,
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
from rodshell.progress import Progress
from rodshell.rods.supports import PINNED, SUPPORTS

EDGE = 0.005  # [m], the paper's
TITLE = "Fig 1 [HQK]: three shells popped up, their ends moved from G0 to G"
COLUMNS = (
    "target", "rods", "joints", "rods' lengths [mm]", "area of G0 [cm2]", "of G", "gap pinned, rms [mm]", "max",
    "clamped, rms", "max", "stable", "time [s]",
)  # fmt: skip
ROWS = (
    "(a)  three gridshells, popped up",
    "(b)  the flat grids, their initial boundary G0 (green) and the final boundary G (violet)",
)


@dataclass(frozen=True)
class PopUpCase(Part):
    """One shell, and the time from target to popped up, pinned and clamped [s]."""

    case: Case
    form: Stages
    seconds: float

    @property
    def status(self) -> str:
        """ "converged", or the first stage that did not converge."""
        return self.form.status

    @property
    def stable(self) -> bool:
        """Whether it is stable, pinned and clamped."""
        return all(popup.report.stable for popup in self.form.popped.values())

    def rows(self) -> list[Row]:
        grid, gaps = self.form.footprint.mesh.grid, self.form.agreement
        lengths = [1e3 * (rod.end - rod.start) for rod in grid.rods]
        curves = (self.form.footprint.points, self.form.trimmed.boundary.points)
        areas = [1e4 * _area(points[:, :2]) for points in curves]
        return [(
            self.case.target.name, f"{self.case.rods[0]}x{self.case.rods[1]}", str(len(grid.crossings.rods)),
            f"{min(lengths):.1f} to {max(lengths):.1f}", *(f"{area:.0f}" for area in areas),
            *(f"{1e3 * gap:.3f}" for ends in SUPPORTS for gap in (gaps[ends].rms, gaps[ends].max)),
            "yes" if self.stable else "no", f"{self.seconds:.2g}",
        )]  # fmt: skip

    def result(self) -> dict[str, Any]:
        return {
            "case": self.case.label, "target": self.case.target.parameters(), "status": self.status,
            "stable": self.stable, "seconds": self.seconds, "footprint": self.form.footprint.points.tolist(),
            "boundary": self.form.trimmed.boundary.points.tolist(),
            "gap": {ends: {"rms": gap.rms, "max": gap.max} for ends, gap in self.form.agreement.items()},
        }  # fmt: skip

    def shell(self) -> list[str]:
        """The shell on its target, whose body hides its far side."""
        popped = self.form.popped[PINNED.name]
        return standing(self.case.target, popped.footprint.mesh, popped.positions)

    def plan(self) -> list[str]:
        """The flat grid, G0 and G, and the displacements of the rods' ends."""
        mesh = self.form.footprint.mesh
        start, end = (from_above(points) for points in (self.form.footprint.points, self.form.trimmed.boundary.points))
        to_panel = PanelScale(np.vstack([start, end]))
        start, end = to_panel(start), to_panel(end)
        displacements = [
            tag("line", x1=a[0], y1=a[1], x2=b[0], y2=b[1], stroke=SOFT, stroke_width=0.6, stroke_dasharray="2 2")
            for a, b in zip(start.tolist(), end.tolist(), strict=True)
        ]
        grid = rod_lines(mesh, to_panel(from_above(mesh.flat)))
        curves = [closed(start, FLAT), closed(end, FINAL, stroke_width=1.6)]
        return [*grid, *displacements, *curves, *dots(start, FLAT, 1.8), *dots(end, FINAL, 1.8)]


@dataclass(frozen=True)
class Fig1(Figure):
    """The three shells."""

    parts: tuple[PopUpCase, ...]
    name, title, columns, key = "fig1", TITLE, COLUMNS, "shells"

    def pictures(self) -> dict[str, str]:
        """The paper's layout: shells above, boundaries below."""
        names = [f"{k}  {shell.case.target.name}" for k, shell in enumerate(self.parts, start=1)]
        shells, plans = ([draw(shell) for shell in self.parts] for draw in (PopUpCase.shell, PopUpCase.plan))
        above, below = (list(zip(names, panels, strict=True)) for panels in (shells, plans))
        return {"fig1": rows_of_panels([(ROWS[0], above), (ROWS[1], below)])}


def make(progress: Progress, *, cases: tuple[Case, ...] = CASES, edge: float = EDGE) -> Fig1:
    """Form and pop up all `cases` with edges of the length `edge` [m], the first twice: compilation does not count."""
    _popped(replace(cases[0], edge=edge), progress)
    return Fig1(tuple(_popped(replace(case, edge=edge), progress) for case in cases))


def _popped(case: Case, progress: Progress) -> PopUpCase:
    def case_progress(stage: str, detail: str, residual: float) -> None:
        progress(f"{case.target.name}, {stage}", detail, residual)

    begun = perf_counter()
    form = find_stages(case.target, case.layout, ROD, progress=case_progress)
    return PopUpCase(case, form, perf_counter() - begun)


def _area(points: Floats) -> float:
    """[m2] inside a curve of points (n, 2), in the order of their angle about their middle."""
    apart = points - points.mean(axis=0)
    x, y = apart[np.argsort(np.arctan2(apart[:, 1], apart[:, 0]))].T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
