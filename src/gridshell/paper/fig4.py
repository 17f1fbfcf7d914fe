"""Figure 4: does rod 2 follow, and how far behind? Both demonstrations, every coupling, linkers and pins; the files."""

import csv
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from os import PathLike
from pathlib import Path
from typing import Any

import numpy as np

from gridshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, Joint, Linker, Pin, SharedDofs
from gridshell.output.folder import FORMAT, VERSION, replacing
from gridshell.paper.fig4_pictures import animation_svg, instants_svg, lag_svg
from gridshell.paper.two_rods import RATE, Demonstration, Run, run, run_statics

DEMONSTRATIONS: tuple[Demonstration, ...] = ("twisting", "bending")
LETTER = {"twisting": "a", "bending": "b"}
SHOWN: tuple[tuple[Demonstration, str], ...] = (("twisting", "linker"), ("bending", "linker"), ("bending", "pin"))
COLUMNS = (
    "demonstration", "joint", "coupling", "step [ms]", "start-up lag [deg]", "steady lag [deg]",
    "rate error [%]", "rod 2 follows",
)  # fmt: skip

Progress = Callable[[str, str, float], None]


@dataclass(frozen=True)
class Fig4:
    """All runs of the figure. Each says itself whether rod 2 follows: not to follow is a result, too."""

    runs: tuple[Run, ...]
    status = "converged"

    def rows(self) -> list[tuple[str, ...]]:
        """The table, a row for each run."""
        return [
            (
                f"({LETTER[one.demonstration]}) {one.demonstration}", one.joint, one.coupling,
                "statics" if one.step is None else f"{1e3 * one.step:.3g}",
                f"{np.degrees(one.start_up_lag):.3g}", f"{np.degrees(one.steady_lag):.2g}",
                f"{100 * one.rate_error:.2g}", "yes" if one.follows else "no",
            )
            for one in self.runs
        ]  # fmt: skip

    def summary(self) -> str:
        """The table as text."""
        table = [COLUMNS, *self.rows()]
        widths = [max(len(row[k]) for row in table) for k in range(len(COLUMNS))]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table]
        turned = np.degrees(self.runs[0].prescribed[-1])
        head = f"Fig 4 [HQK 2.3]: rod 1 of two is driven at {RATE * 30 / np.pi:g} rpm, over {turned:.0f} degrees"
        return "\n".join([head, "", *(line.rstrip() for line in lines)])

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        runs = [
            {
                "demonstration": one.demonstration, "joint": one.joint, "coupling": one.coupling, "step": one.step,
                "start_up_lag": one.start_up_lag, "steady_lag": one.steady_lag, "rate_error": one.rate_error,
                "follows": one.follows,
            }
            for one in self.runs
        ]  # fmt: skip
        return {
            "format": FORMAT,
            "version": VERSION,
            "units": "SI",
            "figure": "fig4",
            "status": self.status,
            "runs": runs,
        }

    def save(self, folder: str | PathLike[str]) -> None:
        """Write pictures, animation and tables to `folder`.

        Raises
        ------
        OutputError : it cannot be written, or holds other things than a result.
        """
        with replacing(folder) as temporary:
            (temporary / "result.json").write_text(json.dumps(self.result(), indent=1) + "\n", encoding="utf-8")
            (temporary / "table.txt").write_text(self.summary() + "\n", encoding="utf-8")
            _write_csv(temporary / "table.csv", COLUMNS, self.rows())
            for demonstration in DEMONSTRATIONS:
                mine = [one for one in self.runs if one.demonstration == demonstration]
                self._write_angles(temporary / f"angles-{LETTER[demonstration]}.csv", mine)
            shown = [self._first(*which) for which in SHOWN]
            (temporary / "fig4.svg").write_text(instants_svg(shown), encoding="utf-8")
            (temporary / "fig4-animated.svg").write_text(animation_svg(shown), encoding="utf-8")
            (temporary / "fig4-lag.svg").write_text(lag_svg(self.runs), encoding="utf-8")

    def _first(self, demonstration: Demonstration, joint: str) -> Run:
        return next(one for one in self.runs if (one.demonstration, one.joint) == (demonstration, joint))

    @staticmethod
    def _write_angles(path: Path, runs: Sequence[Run]) -> None:
        """Every run at the times of the motions; statics where they have an equilibrium."""
        times = runs[0].times
        columns = [np.round(times, 9).tolist(), np.degrees(runs[0].prescribed).tolist()]
        for one in runs:
            at = dict(zip(np.round(one.times, 6).tolist(), np.degrees(one.angles).tolist(), strict=True))
            columns.append([at.get(time, "") for time in np.round(times, 6).tolist()])
        head = ["time [s]", "rod 1 [deg]", *(f"rod 2 [deg]: {one.name}" for one in runs)]
        _write_csv(path, head, zip(*columns, strict=True))


def make(progress: Progress, *, turns: float = 1.0) -> Fig4:
    """Run all of it, over so many revolutions."""
    until = turns * 2 * np.pi / RATE
    couplings: tuple[Coupling, ...] = (SharedDofs(), ImplicitPenalty(), ExplicitPenalty())
    cases: list[tuple[Joint, Coupling]] = [(Linker(), coupling) for coupling in couplings]
    runs = []
    for demonstration in DEMONSTRATIONS:
        for joint, coupling in (*cases, (Pin(), SharedDofs())):
            progress(f"{demonstration}, {joint.name}, {coupling.name}", "in time", 0.0)
            runs.append(run(demonstration, joint, coupling, until=until))
        for joint, coupling in cases[:2]:
            progress(f"{demonstration}, {joint.name}, {coupling.name}", "statics", 0.0)
            runs.append(run_statics(demonstration, joint, coupling, until=until))
    return Fig4(tuple(runs))


def _write_csv(path: Path, head: Sequence[str], rows: Any) -> None:
    with path.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(head)
        writer.writerows(rows)
