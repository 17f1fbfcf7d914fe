"""Figure 8: computing time of the paper's scheme and of ours against the time step and the unknowns [HQK 3.3].

Processor time of one run, compiled. The paper does not say how long its falls were; here they last `FALLING`, in which
the grid lands and drapes but does not come to rest, and neither method includes a pop-up. The cost of the paper's
scheme is also counted in bare solves of its rods (`BareSolves`), to show that our implementation of it is efficient.
"""

from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from statistics import median
from time import process_time
from typing import Any

import numpy as np
from scipy.linalg import solveh_banded
from threadpoolctl import threadpool_limits

from rodshell.formfinding import Draped, Fall, drape, map_back, trim
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs
from rodshell.layout import mesh_grid
from rodshell.model import Potential, Shell
from rodshell.paper.figure import (
    CASES,
    INK,
    LENGTH,
    ROD,
    TARGET_COLOURS,
    Case,
    Chart,
    Figure,
    Part,
    Row,
    Series,
    charts_svg,
)
from rodshell.progress import Progress, silent
from rodshell.solve.implicit_euler import Motion
from rodshell.solve.newton_matrix import Banded
from rodshell.solve.problem import NO_CURVATURE

FALLING = 2.0  # [s]
STEPS = {"explicit": (0.01, 0.005, 0.0025), "shared": (0.1, 0.01), "implicit": (0.01,)}  # [s]
USUAL_STEP = 0.01  # [s]; explicit ties of C1 = 1e6 EI are stable up to 10.8 ms at 15 mm edges
_SIZE_STEP = 0.005  # [s] of the falls of all sizes: explicit ties are stable up to 5.5 ms at 4 mm edges
SIZES = ((2.0, 1.0), (2.0, 0.5), (1.0, 1.0), (1.0, 0.5), (1.0, 0.25), (1.0, 2 / 15))
"""Spacings over the paper's, and edges a spacing: from 1,000 to 31,000 unknowns. The fourth is the usual mesh."""
STATED = {"hemisphere": 50.0, "paraboloid": 30.0, "ellipsoid": 20.0}  # [s] at _STATED_DOFS [HQK 3.3]
_STATED_DOFS = 8000
C1 = 1e6 * ROD.bend_stiffness  # the paper's number, taken as N/m
REPEATS = 4  # of our own drape, and of all that a fall costs but its steps; the least time counts
COLUMNS = (
    "target", "method", "step [ms]", "edge [mm]", "unknowns", "time [s]", "steps", "factorisations",
    "each, in bare solves by LAPACK", "by our band", "a step, in bare solves by LAPACK",
)  # fmt: skip
_SIGNS = {
    "explicit": "\N{BLACK CIRCLE}",
    "shared": "\N{WHITE CIRCLE}",
    "implicit": "\N{WHITE SQUARE}",
    "ours": "\N{BLACK DIAMOND}",
    "the paper's own": "\N{WHITE DIAMOND}",
}


@dataclass(frozen=True)
class Timing(Part):
    """One run.

    Args:
        method: "explicit", "implicit", "shared" in time, or "ours".
        step: time step [s], 0 for ours.
        edge: length of the edges [m].
        seconds: processor time of the drape, for ours with trim and map back.
        steps: taken; those refused and repeated in halves count among the factorisations.
        in_lapack, in_own: time of the steps per factorisation, in bare solves by LAPACK and by our band; 0 without a
            band.
        step_in_lapack: time of a step with all its iterations and corrections for contact, in bare solves by LAPACK.
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

    def rows(self) -> list[Row]:
        return [(
            self.target, self.method, f"{1e3 * self.step:g}" if self.step else "-", f"{1e3 * self.edge:g}",
            str(self.dofs), f"{self.seconds:.3g}", str(self.steps) if self.steps else "-", str(self.factorizations),
            *(f"{timing:.1f}" if timing else "-" for timing in (self.in_lapack, self.in_own, self.step_in_lapack)),
        )]  # fmt: skip

    def result(self) -> dict[str, Any]:
        return asdict(self)


@dataclass(frozen=True)
class Fig8(Figure):
    """All runs. Only times are compared: whether each came to rest does not matter."""

    parts: tuple[Timing, ...]
    name, columns, key = "fig8", COLUMNS, "timings"
    title = f"Fig 8 [HQK 3.3]: processor time; {FALLING:g} s of fall in the paper's scheme"

    def ratios(self) -> dict[str, float]:
        """Time of the paper's explicit scheme at `USUAL_STEP` over ours with the same mesh, by target [-]."""
        ours = {(timing.target, timing.edge): timing for timing in self.parts if timing.method == "ours"}
        paper = [timing for timing in self.parts if timing.method == "explicit" and timing.step == USUAL_STEP]
        return {timing.target: timing.seconds / ours[timing.target, timing.edge].seconds for timing in paper}

    def slopes(self) -> dict[str, dict[str, float]]:
        """Exponents of the unknowns in the times of the sizes, by least squares of logarithms; by method and target."""
        slopes = dict[str, dict[str, float]]()
        for method in ("explicit", "ours"):
            runs = of_sizes(self.parts, method)
            for target in dict.fromkeys(run.target for run in runs):
                same = [run for run in runs if run.target == target]
                slope = np.polyfit(np.log([run.dofs for run in same]), np.log([run.seconds for run in same]), 1)[0]
                slopes.setdefault(method, {})[target] = float(slope)
        return slopes

    def footing(self) -> str:
        """The ratios, and the slopes."""
        ratios = "; ".join(f"{target} {ratio:.0f}" for target, ratio in self.ratios().items())
        lines = [f"explicit, {1e3 * USUAL_STEP:g} ms, over ours on the same mesh, times as long: {ratios}"]
        for method, slopes in self.slopes().items():
            found = "; ".join(f"{target} {slope:.2f}" for target, slope in slopes.items())
            lines.append(f"time grows with the unknowns, {method}, to the power: {found}")
        return "\n".join(lines)

    def content(self) -> dict[str, Any]:
        """The runs, the ratios and the slopes."""
        return {"falling": FALLING, **super().content(), "ratios": self.ratios(), "slopes": self.slopes()}

    def pictures(self) -> dict[str, str]:
        """Both charts."""
        return {"fig8": _times_svg(self.parts)}


def make(progress: Progress, *, cases: tuple[Case, ...] = CASES, falling: float = FALLING) -> Fig8:
    """Time everything, falls of `falling` seconds; the first run of each kind, which compiles, does not count."""
    couplings: tuple[Coupling, ...] = (ExplicitPenalty(C1=C1), SharedDofs(), ImplicitPenalty())
    for coupling in couplings:
        _fall(cases[0], coupling, USUAL_STEP, 0.05, silent)
    timings = list[Timing]()
    for case in cases:
        for coupling in couplings:
            timings += [_timed_fall(case, coupling, step, falling, progress) for step in STEPS[coupling.name]]
        for size in sizes_of(case):
            if size.edge != case.edge:
                timings.append(_timed_fall(size, couplings[0], _SIZE_STEP, falling, progress, counted=False))
            timings.append(_timed_ours(size))
    return Fig8(tuple(timings))


def sizes_of(case: Case) -> list[Case]:
    """The case with fewer rods, and with other edges."""
    sizes = []
    for wider, edges in SIZES:
        first, second = (int((count - 1) / wider) // 2 * 2 + 1 for count in case.rods)
        spacing = wider * case.spacing
        sizes.append(Case(case.label, case.target, (first, second), spacing, edges * spacing))
    return sizes


def of_sizes(timings: Sequence[Timing], method: str) -> list[Timing]:
    """The runs of a method at all sizes."""
    return [run for run in timings if run.method == method and run.step in (0.0, _SIZE_STEP)]


def _timed_fall(
    case: Case, coupling: Coupling, step: float, falling: float, progress: Progress, *, counted: bool = True
) -> Timing:
    """A fall of `falling` seconds in the paper's scheme, with the time step `step` [s]; without its bare solves.

    Args:
        counted: whether explicit ties are counted in bare solves.
    """
    bare = BareSolves(case, coupling, step) if counted and isinstance(coupling, ExplicitPenalty) else None

    def case_progress(stage: str, detail: str, residual: float) -> None:
        progress(f"{case.target.name}, {coupling.name}, {1e3 * step:g} ms, {stage}", detail, residual)
        if bare:
            bare.once()

    begun = process_time()
    draped = _fall(case, coupling, step, falling, case_progress)
    seconds = process_time() - begun - (bare.spent if bare else 0.0)
    assert draped.rest is not None
    report, steps, shares = draped.report, draped.rest.steps, (0.0, 0.0, 0.0)
    if bare:
        # a fall of one step has all that comes before and after
        stepping = seconds - _least_time(lambda: _fall(case, coupling, step, step, silent))[0]
        lapack, band = bare.times
        each = stepping / report.factorizations
        shares = (each / lapack, each / band, stepping / steps / lapack)
    return Timing(
        case.target.name, coupling.name, step, case.edge, report.dofs, seconds, steps, report.factorizations, *shares
    )


def _fall(case: Case, coupling: Coupling, step: float, falling: float, progress: Progress) -> Draped:
    fall = Fall(coupling=coupling, time_step=step, duration=falling, drag=0.0, settle=False)
    return drape(case.layout, ROD, case.target, method=fall, progress=progress)


def _timed_ours(case: Case) -> Timing:
    """Our drape, trim and map back."""

    def form() -> Draped:
        draped = drape(case.layout, ROD, case.target)
        map_back(trim(draped))
        return draped

    seconds, draped = _least_time(form)
    report = draped.report
    return Timing(case.target.name, "ours", 0.0, case.edge, report.dofs, seconds, 0, report.factorizations)


def _least_time(run: Callable[[], Draped]) -> tuple[float, Draped]:
    """The least processor time of several equal runs [s], and the result of the last."""
    times = []
    for _ in range(REPEATS):
        begun = process_time()
        draped = run()
        times.append(process_time() - begun)
    return min(times), draped


class BareSolves:
    """Bare solves of the rods of a case, alternating with the steps of a fall, so that other load slows both alike.

    A bare solve factorises the banded matrices of all rods once, the matrix of Newton's method in the flat grid, and
    solves once; it starts from the band, nothing is summed. It is done by LAPACK (`scipy.linalg.solveh_banded`, all
    rods in one call, which is faster than a call for each) and by our `solve.banded`, on one thread.

    Args:
        case, coupling: the grid and its ties.
        step: time step [s] of the matrix.

    Attributes:
        spent: processor time of all of them [s].
    """

    def __init__(self, case: Case, coupling: ExplicitPenalty, step: float) -> None:
        shell = Shell.of(mesh_grid(case.layout.flat_grid(case.rods, LENGTH), case.edge), ROD, coupling=coupling)
        motion, self._free = Motion.of(shell), shell.freedom()
        state = shell.state(shell.mesh.flat)
        self._matrix = Banded(Potential(motion.elements).blocks, self._free)
        self._matrix.clear()
        implicit = Potential(motion.elements)
        for index, (blocks, hessians) in enumerate(zip(implicit.blocks, implicit.hessians(state), strict=True)):
            self._matrix.add(index, hessians, blocks, self._free)
        self._matrix.add_blocks(motion.mass / step**2, NO_CURVATURE, self._free)
        self._summed, self._field = self._matrix.values.copy(), np.ones_like(state)
        self._band = np.asfortranarray(self._summed[: self._matrix.size, : self._matrix.half_bandwidth + 1].T)
        self._lapack_times, self._own_times, self.spent = list[float](), list[float](), 0.0
        self.once()
        self.spent = 0.0

    def once(self) -> None:
        """Solve twice by each; the second counts."""
        begun = process_time()
        for times, solve in ((self._lapack_times, self._lapack), (self._own_times, self._own)):
            solve()
            times.append(solve())
        self.spent += process_time() - begun

    @property
    def times(self) -> tuple[float, float]:
        """Median processor time of a bare solve by LAPACK, and by our band [s]."""
        return median(self._lapack_times), median(self._own_times)

    def _lapack(self) -> float:
        with threadpool_limits(limits=1):
            begun = process_time()
            solveh_banded(self._band, self._field.ravel(), lower=True, check_finite=False)
            return process_time() - begun

    def _own(self) -> float:
        self._matrix.values[:] = self._summed
        begun = process_time()
        self._matrix.factor()
        self._matrix.solve(self._field, self._free)
        return process_time() - begun


def _times_svg(timings: Sequence[Timing]) -> str:
    """Both charts, and what the signs mean."""
    edge = next(timing.edge for timing in timings if timing.in_lapack)  # the usual mesh
    by_step = [timing for timing in timings if timing.step and timing.edge == edge]
    by_size = [*of_sizes(timings, "explicit"), *of_sizes(timings, "ours")]
    names = dict.fromkeys(timing.target for timing in timings)
    stated = [
        Series([_STATED_DOFS], [STATED[name]], TARGET_COLOURS[name], _SIGNS["the paper's own"])
        for name in names
        if name in STATED
    ]
    legend = [(name, TARGET_COLOURS.get(name, INK)) for name in names]
    charts = (
        Chart(_series(by_step, lambda timing: 1e3 * timing.step), "(a)  time step [ms]", "time [s]", legend),
        Chart([*_series(by_size, lambda timing: float(timing.dofs)), *stated], "(b)  unknowns", "time [s]"),
    )
    methods = {*(timing.method for timing in timings), "the paper's own"}
    return charts_svg(charts, "   ".join(f"{sign} {method}" for method, sign in _SIGNS.items() if method in methods))


def _series(timings: Sequence[Timing], across: Callable[[Timing], float]) -> list[Series]:
    """A series for each target and method."""
    result = []
    for target, method in dict.fromkeys((timing.target, timing.method) for timing in timings):
        same = [timing for timing in timings if (timing.target, timing.method) == (target, method)]
        points = sorted((across(timing), timing.seconds) for timing in same)
        x, y = zip(*points, strict=True)
        result.append(Series(x, y, TARGET_COLOURS.get(target, INK), _SIGNS[method], lined=True))
    return result
