"""Figure 1: three shells, and the boundaries between which their rods' ends move [HQK 1].

The shells are popped up, as in the paper, their ends pinned on G; ends held in the rods' direction stand beside them
in the table.
"""

from dataclasses import dataclass, replace
from os import PathLike
from time import perf_counter
from typing import Any

import numpy as np

from rodshell.arrays import Floats
from rodshell.formfinding import PatchForm, find_stages
from rodshell.output.svg import tag
from rodshell.paper.drapes import ROD, Case, Progress
from rodshell.paper.fig6 import CASES
from rodshell.paper.panels import FINAL, FLAT, SOFT, Place, closed, dots, from_above, rods, rows_of_panels, standing
from rodshell.paper.tables import aligned, result_of, write
from rodshell.results.folder import ResultFolder

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
class PoppedCase:
    """One shell, and the seconds it took from target to popped up, pinned and clamped."""

    case: Case
    form: PatchForm
    seconds: float

    @property
    def stable(self) -> bool:
        return all(one.report.stable for one in self.form.popped.values())

    def row(self) -> tuple[str, ...]:
        """Of the table."""
        grid, gaps = self.form.footprint.mesh.grid, self.form.agreement
        lengths = [1e3 * (rod.end - rod.start) for rod in grid.rods]
        curves = (self.form.footprint.points, self.form.trimmed.boundary.points)
        areas = [1e4 * _area(points[:, :2]) for points in curves]
        return (
            self.case.target.name, f"{self.case.rods[0]}x{self.case.rods[1]}", str(len(grid.crossings.rods)),
            f"{min(lengths):.1f} to {max(lengths):.1f}", *(f"{area:.0f}" for area in areas),
            *(f"{1e3 * one:.3f}" for ends in ("pinned", "clamped") for one in (gaps[ends].rms, gaps[ends].max)),
            "yes" if self.stable else "no", f"{self.seconds:.2g}",
        )  # fmt: skip

    def result(self) -> dict[str, Any]:
        """Of result.json, SI."""
        return {
            "case": self.case.label, "target": self.case.target.parameters(), "status": self.form.status,
            "stable": self.stable, "seconds": self.seconds, "footprint": self.form.footprint.points.tolist(),
            "boundary": self.form.trimmed.boundary.points.tolist(),
            "gap": {ends: {"rms": one.rms, "max": one.max} for ends, one in self.form.agreement.items()},
        }  # fmt: skip

    def shell(self) -> list[str]:
        """The shell on its target, whose body hides its far side."""
        popped = self.form.popped["pinned"]
        return standing(self.case.target, popped.footprint.mesh, popped.positions)

    def plan(self) -> list[str]:
        """The flat grid, G0 and G, and the ways of the rods' ends."""
        mesh = self.form.footprint.mesh
        start, end = (from_above(points) for points in (self.form.footprint.points, self.form.trimmed.boundary.points))
        place = Place(np.vstack([start, end]))
        start, end = place(start), place(end)
        ways = [
            tag("line", x1=a[0], y1=a[1], x2=b[0], y2=b[1], stroke=SOFT, stroke_width=0.6, stroke_dasharray="2 2")
            for a, b in zip(start.tolist(), end.tolist(), strict=True)
        ]
        grid = rods(mesh, place(from_above(mesh.flat)))
        curves = [closed(start, FLAT), closed(end, FINAL, stroke_width=1.6)]
        return [*grid, *ways, *curves, *dots(start, FLAT, 1.8), *dots(end, FINAL, 1.8)]


@dataclass(frozen=True)
class Fig1:
    """The three of them."""

    shells: tuple[PoppedCase, ...]

    @property
    def status(self) -> str:
        """ "converged", or that of the first shell that is not."""
        return next((one.form.status for one in self.shells if one.form.status != "converged"), "converged")

    def rows(self) -> list[tuple[str, ...]]:
        """The table, a row for each shell."""
        return [one.row() for one in self.shells]

    def summary(self) -> str:
        """The table as text."""
        return f"{TITLE}\n\n{aligned(COLUMNS, self.rows())}"

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return result_of("fig1", self.status, shells=[one.result() for one in self.shells])

    def picture(self) -> str:
        """The paper's layout: shells above, boundaries below."""
        names = [f"{k}  {one.case.target.name}" for k, one in enumerate(self.shells, start=1)]
        shells, plans = ([draw(one) for one in self.shells] for draw in (PoppedCase.shell, PoppedCase.plan))
        above, below = (list(zip(names, panels, strict=True)) for panels in (shells, plans))
        return rows_of_panels([(ROWS[0], above), (ROWS[1], below)])

    def save(self, folder: str | PathLike[str] | ResultFolder) -> None:
        """Write picture and tables to `folder`."""
        write(folder, self.result(), self.summary(), COLUMNS, self.rows(), {"fig1": self.picture()})


def make(progress: Progress, *, cases: tuple[Case, ...] = CASES, edge: float = EDGE) -> Fig1:
    """Form and pop up all of them, the first twice: what it waits for once does not count."""
    _popped(replace(cases[0], edge=edge), progress)
    return Fig1(tuple(_popped(replace(case, edge=edge), progress) for case in cases))


def _popped(case: Case, progress: Progress) -> PoppedCase:
    def told(stage: str, detail: str, residual: float) -> None:
        progress(f"{case.target.name}, {stage}", detail, residual)

    begun = perf_counter()
    form = find_stages(case.target, case.layout, ROD, progress=told)
    return PoppedCase(case, form, perf_counter() - begun)


def _area(points: Floats) -> float:
    """[m2] inside a curve of points (n, 2), in the order of their angle about their middle."""
    apart = points - points.mean(axis=0)
    x, y = apart[np.argsort(np.arctan2(apart[:, 1], apart[:, 0]))].T
    return 0.5 * abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1)))
