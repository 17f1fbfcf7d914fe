"""Figure 8: computing time against the time step and the number of unknowns, and ours beside it [HQK 3.3].

Processor time of one run, each program warm. The paper does not say how long its falls were; here they last
`FALLING`, in which the grid lands and drapes but does not come to rest, and no pop-up follows on either side. What the
paper's scheme costs is also counted in bare solves of its rods (`BareSolves`), to show that it is no straw man.
"""

from dataclasses import asdict, dataclass
from os import PathLike
from time import process_time
from typing import Any

from rodshell.formfinding import Draped, Fall, drape, map_back, trim
from rodshell.formfinding.progress import silent
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs
from rodshell.paper.bare_solves import BareSolves
from rodshell.paper.drapes import ROD, Case, Progress
from rodshell.paper.fig6 import CASES
from rodshell.paper.fig8_pictures import times_svg
from rodshell.paper.tables import aligned, result_of, write
from rodshell.results.folder import ResultFolder

FALLING = 2.0  # [s]
STEPS = {"explicit": (0.01, 0.005, 0.0025), "shared": (0.1, 0.05, 0.02, 0.01), "implicit": (0.01,)}  # [s]
USUAL_STEP = 0.01  # [s]; explicit ties of C1 = 1e6 EI bear 10.8 ms at 15 mm edges
EDGES = (0.03, 0.015)  # [m]
C1 = 1e6 * ROD.bend_stiffness  # the paper's number, taken as N/m
REPEATS = 4  # of our own drape; the least time counts
COLUMNS = (
    "target", "method", "step [ms]", "edge [mm]", "unknowns", "time [s]", "steps", "factorisations",
    "each, in bare solves by LAPACK", "by our band", "a step, in bare solves by LAPACK",
)  # fmt: skip


@dataclass(frozen=True)
class Timing:
    """One run.

    Parameters
    ----------
    method : "explicit", "implicit", "shared" in time, or "ours".
    step : [s], 0 for ours; edge : [m]; seconds : processor time of drape, for ours with trim and map back.
    steps : taken; those refused and tried again in halves count among the factorisations.
    in_lapack, in_own : that of the steps alone by factorisation, in bare solves; 0 where there is no band.
    step_in_lapack : that of a step with all its iterations and corrections for contact.
    """

    target: str
    method: str
    step: float
    edge: float
    dofs: int
    seconds: float
    steps: int
    factorizations: int
    in_lapack: float = 0.0
    in_own: float = 0.0
    step_in_lapack: float = 0.0

    def row(self) -> tuple[str, ...]:
        return (
            self.target, self.method, f"{1e3 * self.step:g}" if self.step else "-", f"{1e3 * self.edge:g}",
            str(self.dofs), f"{self.seconds:.3g}", str(self.steps) if self.steps else "-", str(self.factorizations),
            *(f"{one:.1f}" if one else "-" for one in (self.in_lapack, self.in_own, self.step_in_lapack)),
        )  # fmt: skip


@dataclass(frozen=True)
class Fig8:
    """All runs. Time is all that they tell: whether each came to rest does not matter."""

    timings: tuple[Timing, ...]
    status = "converged"

    def ratios(self) -> dict[str, float]:
        """For each target how many times longer the paper's explicit scheme takes at its largest step and our mesh."""
        ours = {one.target: one for one in self.timings if one.method == "ours"}
        theirs = [one for one in self.timings if one.method == "explicit" and one.step == USUAL_STEP]
        return {
            one.target: one.seconds / ours[one.target].seconds for one in theirs if one.edge == ours[one.target].edge
        }

    def rows(self) -> list[tuple[str, ...]]:
        """The table, a row for each run."""
        return [one.row() for one in self.timings]

    def summary(self) -> str:
        """The table as text."""
        ratios = "; ".join(f"{target} {ratio:.0f}" for target, ratio in self.ratios().items())
        head = f"Fig 8 [HQK 3.3]: processor time; {FALLING:g} s of fall in the paper's scheme"
        return f"{head}\n\n{aligned(COLUMNS, self.rows())}\n\ntimes as long as ours: {ratios}"

    def result(self) -> dict[str, Any]:
        """The content of result.json."""
        timings = [asdict(one) for one in self.timings]
        return result_of("fig8", self.status, falling=FALLING, timings=timings, ratios=self.ratios())

    def save(self, folder: str | PathLike[str] | ResultFolder) -> None:
        """Write picture and tables to `folder`."""
        write(folder, self.result(), self.summary(), COLUMNS, self.rows(), {"fig8": times_svg(self.timings)})


def make(progress: Progress, *, cases: tuple[Case, ...] = CASES, falling: float = FALLING) -> Fig8:
    """Time all of it; the first run of each kind, which compiles, does not count."""
    couplings: tuple[Coupling, ...] = (ExplicitPenalty(C1=C1), SharedDofs(), ImplicitPenalty())
    for coupling in couplings:
        _fall(cases[0], coupling, USUAL_STEP, 0.05, silent)
    timings = list[Timing]()
    for case in cases:
        for coupling in couplings:
            timings += [timed_fall(case, coupling, step, falling, progress) for step in STEPS[coupling.name]]
        others = [Case(case.label, case.target, case.rods, case.spacing, e) for e in EDGES if e != case.edge]
        timings += [timed_fall(other, couplings[0], USUAL_STEP, falling, progress) for other in others]
        timings.append(timed_ours(case))
    return Fig8(tuple(timings))


def timed_fall(case: Case, coupling: Coupling, step: float, falling: float, progress: Progress) -> Timing:
    """A fall in the paper's scheme; its bare solves take turns with its steps, and do not count in its time."""
    bare = BareSolves(case, coupling, step) if isinstance(coupling, ExplicitPenalty) else None

    def told(stage: str, detail: str, residual: float) -> None:
        progress(f"{case.target.name}, {coupling.name}, {1e3 * step:g} ms, {stage}", detail, residual)
        if bare:
            bare.once()

    begun = process_time()
    draped = _fall(case, coupling, step, falling, told)
    seconds = process_time() - begun - (bare.spent if bare else 0.0)
    assert draped.rest is not None
    report, steps, shares = draped.report, draped.rest.steps, (0.0, 0.0, 0.0)
    if bare:
        begun = process_time()
        _fall(case, coupling, step, step, silent)  # one step: all that comes before and after
        stepping = seconds - (process_time() - begun)
        lapack, own = bare.times
        each = stepping / report.factorizations
        shares = (each / lapack, each / own, stepping / steps / lapack)
    return Timing(
        case.target.name, coupling.name, step, case.edge, report.dofs, seconds, steps, report.factorizations, *shares
    )


def _fall(case: Case, coupling: Coupling, step: float, falling: float, progress: Progress) -> Draped:
    fall = Fall(coupling=coupling, time_step=step, duration=falling, settle=False)
    return drape(case.layout, ROD, case.target, method=fall, progress=progress)


def timed_ours(case: Case) -> Timing:
    """Drape, trim and map back."""
    times = []
    for _ in range(REPEATS):
        begun = process_time()
        draped = drape(case.layout, ROD, case.target)
        map_back(trim(draped))
        times.append(process_time() - begun)
    report = draped.report
    return Timing(case.target.name, "ours", 0.0, case.edge, report.dofs, min(times), 0, report.factorizations)
