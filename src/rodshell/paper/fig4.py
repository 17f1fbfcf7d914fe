"""Figure 4: does rod 2 follow, and how far behind? Both demonstrations, every coupling, linkers and pins; the files."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from os import PathLike
from typing import Any

import numpy as np

from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, Joint, Linker, Pin, SharedDofs
from rodshell.paper.fig4_pictures import animation_svg, instants_svg, lag_svg
from rodshell.paper.tables import aligned, result_of, write
from rodshell.paper.two_rods import RATE, Demonstration, Run, run, run_statics
from rodshell.results.folder import ResultFolder

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
        turned = np.degrees(self.runs[0].prescribed[-1])
        head = f"Fig 4 [HQK 2.3]: rod 1 of two is driven at {RATE * 30 / np.pi:g} rpm, over {turned:.0f} degrees"
        return f"{head}\n\n{aligned(COLUMNS, self.rows())}"

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
        return result_of("fig4", self.status, runs=runs)

    def save(self, folder: str | PathLike[str] | ResultFolder) -> None:
        """Write pictures, animation and tables to `folder`."""
        shown = [self._first(*which) for which in SHOWN]
        pictures = {
            "fig4": instants_svg(shown), "fig4-animated": animation_svg(shown), "fig4-lag": lag_svg(self.runs),
        }  # fmt: skip
        angles = {
            f"angles-{LETTER[one]}": _angles([run for run in self.runs if run.demonstration == one])
            for one in DEMONSTRATIONS
        }
        write(folder, self.result(), self.summary(), COLUMNS, self.rows(), pictures, angles)

    def _first(self, demonstration: Demonstration, joint: str) -> Run:
        return next(one for one in self.runs if (one.demonstration, one.joint) == (demonstration, joint))


def _angles(runs: Sequence[Run]) -> list[Sequence[object]]:
    """Every run at the times of the motions; statics where they have an equilibrium."""
    times = runs[0].times
    columns = [np.round(times, 9).tolist(), np.degrees(runs[0].prescribed).tolist()]
    for one in runs:
        at = dict(zip(np.round(one.times, 6).tolist(), np.degrees(one.angles).tolist(), strict=True))
        columns.append([at.get(time, "") for time in np.round(times, 6).tolist()])
    head = ["time [s]", "rod 1 [deg]", *(f"rod 2 [deg]: {one.name}" for one in runs)]
    return [head, *zip(*columns, strict=True)]


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
