"""Figure 8: computing time against the time step and the number of unknowns, and ours beside it [HQK 3.3].

One thread, one run, each program warm. The paper does not say how long its falls were; here they last `FALLING`, in
which the grid lands and drapes but does not come to rest, and no pop-up follows on either side.
"""

import csv
import json
from dataclasses import asdict, dataclass
from os import PathLike
from time import perf_counter
from typing import Any

import numpy as np

from gridshell.formfinding import Fall, drape, map_back, trim
from gridshell.formfinding.progress import silent
from gridshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs
from gridshell.layout import mesh_grid
from gridshell.model import Shell
from gridshell.output.folder import FORMAT, VERSION, replacing
from gridshell.paper.drapes import LENGTH, ROD, Case, Progress
from gridshell.paper.fig6 import CASES
from gridshell.paper.fig8_pictures import times_svg
from gridshell.solve.banded import Banded
from gridshell.solve.implicit_euler import Motion

FALLING = 1.0  # [s]
STEPS = (0.01, 0.005)  # [s]; explicit ties of C1 = 1e6 EI allow 14 ms at 15 mm edges
EDGES = (0.03, 0.015)  # [m]
C1 = 1e6 * ROD.bend_stiffness  # the paper's number, taken as N/m
REPEATS = 4  # of our own drape; the least time counts
COLUMNS = (
    "target", "method", "step [ms]", "edge [mm]", "unknowns", "time [s]", "factorisations",
    "time of each, in bare solves",
)  # fmt: skip


@dataclass(frozen=True)
class Timing:
    """One run.

    Parameters
    ----------
    method : "explicit", "implicit", "shared" in time, or "ours".
    step : [s], 0 for ours; edge : [m]; seconds : of drape, for ours with trim and map back.
    in_solves : seconds by factorisation, by those of the bare banded factorisation and solution of all rods; 0 where
        there is no band.
    """

    target: str
    method: str
    step: float
    edge: float
    dofs: int
    seconds: float
    factorizations: int
    in_solves: float

    def row(self) -> tuple[str, ...]:
        return (
            self.target, self.method, f"{1e3 * self.step:g}" if self.step else "-", f"{1e3 * self.edge:g}",
            str(self.dofs), f"{self.seconds:.3g}", str(self.factorizations),
            f"{self.in_solves:.1f}" if self.in_solves else "-",
        )  # fmt: skip


@dataclass(frozen=True)
class Fig8:
    """All runs. Time is all that they tell: whether each came to rest does not matter."""

    timings: tuple[Timing, ...]
    status = "converged"

    def ratios(self) -> dict[str, float]:
        """For each target how many times longer the paper's explicit scheme takes at its largest step and our mesh."""
        ours = {one.target: one for one in self.timings if one.method == "ours"}
        theirs = [one for one in self.timings if one.method == "explicit" and one.step == max(STEPS)]
        return {
            one.target: one.seconds / ours[one.target].seconds for one in theirs if one.edge == ours[one.target].edge
        }

    def summary(self) -> str:
        """The table as text."""
        table = [COLUMNS, *(one.row() for one in self.timings)]
        widths = [max(len(row[k]) for row in table) for k in range(len(COLUMNS))]
        lines = ["  ".join(cell.ljust(width) for cell, width in zip(row, widths, strict=True)) for row in table]
        ratios = "; ".join(f"{target} {ratio:.0f}" for target, ratio in self.ratios().items())
        head = f"Fig 8 [HQK 3.3]: computing time, one thread; {FALLING:g} s of fall in the paper's scheme"
        return "\n".join([head, "", *(line.rstrip() for line in lines), "", f"times as long as ours: {ratios}"])

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        return {
            "format": FORMAT, "version": VERSION, "units": "SI", "figure": "fig8", "status": self.status,
            "falling": FALLING, "timings": [asdict(one) for one in self.timings], "ratios": self.ratios(),
        }  # fmt: skip

    def save(self, folder: str | PathLike[str]) -> None:
        """Write picture and tables to `folder`.

        Raises
        ------
        OutputError : it cannot be written, or holds other things than a result.
        """
        with replacing(folder) as temporary:
            (temporary / "result.json").write_text(json.dumps(self.result(), indent=1) + "\n", encoding="utf-8")
            (temporary / "table.txt").write_text(self.summary() + "\n", encoding="utf-8")
            with (temporary / "table.csv").open("w", newline="", encoding="utf-8") as file:
                csv.writer(file).writerows([COLUMNS, *(one.row() for one in self.timings)])
            (temporary / "fig8.svg").write_text(times_svg(self.timings), encoding="utf-8")


def make(progress: Progress, *, cases: tuple[Case, ...] = CASES, falling: float = FALLING) -> Fig8:
    """Time all of it; the first run of each kind, which compiles, does not count."""
    explicit = ExplicitPenalty(C1=C1)
    couplings: tuple[Coupling, ...] = (explicit, SharedDofs(), ImplicitPenalty())
    for coupling in couplings:
        _in_time(cases[0], coupling, max(STEPS), 0.05, silent)
    timings = list[Timing]()
    for case in cases:
        runs: list[tuple[Coupling, float, float]] = [(explicit, step, case.edge) for step in STEPS]
        runs += [(explicit, max(STEPS), edge) for edge in EDGES if edge != case.edge]
        runs += [(coupling, max(STEPS), case.edge) for coupling in couplings[1:]]
        timings += [
            _in_time(Case(case.label, case.target, case.rods, case.spacing, edge), coupling, step, falling, progress)
            for coupling, step, edge in runs
        ]
        timings.append(_ours(case))
    return Fig8(tuple(timings))


def _in_time(case: Case, coupling: Coupling, step: float, falling: float, progress: Progress) -> Timing:
    def told(stage: str, detail: str, residual: float) -> None:
        progress(f"{case.target.name}, {coupling.name}, {1e3 * step:g} ms, {stage}", detail, residual)

    fall = Fall(coupling=coupling, time_step=step, duration=falling, settle=False)
    report = drape(case.layout, ROD, case.target, method="paper", fall=fall, progress=told).report
    bare = bare_solves(case, coupling, step)
    share = report.seconds / report.factorizations / bare if bare else 0.0
    name, count = case.target.name, report.factorizations
    return Timing(name, coupling.name, step, case.edge, report.dofs, report.seconds, count, share)


def bare_solves(case: Case, coupling: Coupling, step: float) -> float:
    """Least time [s] of factorising and solving the banded systems of all rods once; 0 where they are not banded."""
    if not isinstance(coupling, ExplicitPenalty):
        return 0.0
    shell = Shell.of(mesh_grid(case.layout.flat_grid(case.rods, LENGTH), case.edge), ROD, coupling=coupling)
    motion, free = Motion.of(shell), shell.freedom()
    state = shell.state(shell.mesh.flat)
    matrix = Banded([element.blocks for element in motion.elements], free)
    times = []
    for _ in range(5):
        matrix.clear()
        for which, element in enumerate(motion.elements):
            width = 3 * element.blocks.shape[1]
            hessians = np.zeros((len(element.blocks), width, width))
            element.evaluate(state, np.zeros_like(state), hessians)
            matrix.add(which, hessians, element.blocks, free)
        matrix.add_blocks(motion.mass / step**2, np.empty((0, 3, 3)), free)
        begun = perf_counter()
        matrix.factor()
        matrix.solve(np.ones_like(state), free)
        times.append(perf_counter() - begun)
    return min(times)


def _ours(case: Case) -> Timing:
    times = []
    for _ in range(REPEATS):
        begun = perf_counter()
        draped = drape(case.layout, ROD, case.target)
        map_back(trim(draped))
        times.append(perf_counter() - begun)
    report = draped.report
    return Timing(case.target.name, "ours", 0.0, case.edge, report.dofs, min(times), report.factorizations, 0.0)
