"""Whole jobs, warm and in one thread: each stage, against the linear algebra that they cannot do without."""

import importlib
from collections.abc import Callable
from dataclasses import replace
from statistics import median

import numpy as np

import rodshell as rs
from benchmarks.rows import Row, Section, clock, ms, timed
from rodshell.nets import chebyshev_net
from rodshell.solve.newton_step import NewtonStep

RADIUS = 0.2
ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
DOME = rs.Hemisphere(radius=RADIUS)
bound = importlib.import_module("rodshell.formfinding.bound_drape")


def auto(spacing: float = 0.03, edge: float = 0.005) -> rs.GridLayout:
    return rs.GridLayout.orthogonal(spacing=spacing, edge=edge)


def square(spacing: float = 0.03) -> rs.GridLayout:
    """17 x 17 rods, 5 mm edges."""
    return rs.GridLayout.orthogonal(rods=(17, 17), spacing=spacing, length=1.4, edge=0.005)


def whole_job(runs: int) -> Section:
    """Net, bound drape, trim, map back, both pop-ups, agreement; the hemisphere with every line a rod. Medians; units
    are measured after each job, and ratios are those of each job."""
    unit_work, dofs = _unit()
    jobs = list[dict[str, float]]()
    for _ in range(runs + 1):
        jobs.append(_stages() | {UNIT: timed(unit_work)})
        for whole, stages in WHOLE.items():
            jobs[-1][whole] = sum(jobs[-1][stage] for stage in stages)
    times = {name: [job[name] for job in jobs[1:]] for name in jobs[0]}
    each = {name: median(seconds) for name, seconds in times.items()}

    def units(name: str) -> float:
        return median(seconds / unit for seconds, unit in zip(times[name], times[UNIT], strict=True))

    rows = [
        Row(f"net + bound drape + trim + map back, over one assembly, factorisation and solve of its {dofs} unknowns",
            f"{units(FORMED):.1f} ({ms(each[FORMED])} / {ms(each[UNIT])})", "at most 5"),
        Row("with both pop-ups", f"{units(POPPED):.1f} ({ms(each[POPPED])})", "at most 24, target 12"),
        *(Row(name, f"{ms(each[name])}, {units(name):.2f} units") for name in STAGES),
    ]  # fmt: skip
    return Section("Whole job: hemisphere, 30 mm, automatic rods, 5 mm edges", _first(whole_job), rows)


STAGES = ("net", "rest of the drape", "trim and map back", "pop-up pinned", "agreement, twice", "pop-up clamped")
UNIT, FORMED, POPPED = "unit", "formed", "popped up"
WHOLE = {FORMED: STAGES[:3], POPPED: (*STAGES[:4], STAGES[5])}


def _stages() -> dict[str, float]:
    told = dict[str, float]()
    last = clock()

    def stage(name: str) -> None:
        nonlocal last
        now = clock()
        told[name] = told.get(name, 0.0) + now - last
        last = now

    chebyshev_net(DOME, auto())
    stage("net")
    draped = rs.drape(auto(), ROD, DOME)
    stage("rest of the drape")
    told["rest of the drape"] -= told["net"]
    trimmed = rs.trim(draped)
    footprint = rs.map_back(trimmed)
    stage("trim and map back")
    for ends in ("pinned", "clamped"):
        popped = rs.pop_up(footprint, trimmed.boundary, ROD, ends=ends)
        stage(f"pop-up {ends}")
        rs.agreement(popped, DOME)
        stage("agreement, twice")
    return told


def _unit() -> tuple[Callable[[], object], int]:
    """One Newton step of the bound system (assembly, factorisation, solve); the number of its unknowns."""
    step, state, forces = bound_system(auto())
    start = step.start(state, forces)

    def newton() -> None:
        step.take(start)

    newton()
    return newton, step.assembly.pattern.assembly.upper(step.matrix.values).shape[0]


def bound_system(layout: rs.GridLayout) -> tuple[NewtonStep, np.ndarray, np.ndarray]:
    """The bound drape's own system, and where its solve starts."""
    asked = list[tuple[object, ...]]()
    solve: Callable[..., object] = bound.find_equilibrium

    def listen(*given: object, **options: object) -> object:
        asked.append(given)
        return solve(*given, **options)

    bound.find_equilibrium = listen
    try:
        rs.drape(layout, ROD, DOME)
    finally:
        bound.find_equilibrium = solve
    problem, state, forces = asked[0][:3]
    return NewtonStep(problem, state), state, forces  # type: ignore[arg-type]


def slider(runs: int) -> Section:
    """Spacing, heading, size or anchor changed a little, the net looked for near the last: net, drape and map back."""
    rows = []
    for name, at in SLIDERS.items():
        target, layout, anchor = at(0.0)
        draped, times = rs.drape(layout, ROD, target, anchor=anchor), list[float]()
        for t in np.linspace(0.0, 1.0, runs + 2)[1:]:
            target, layout, anchor = at(float(t))
            begin = clock()
            draped = rs.drape(layout, ROD, target, anchor=anchor, warm_start=draped)
            rs.map_back(rs.trim(draped))
            times.append(clock() - begin)
        rows.append(Row(f"{name} changed", f"{1 / median(times[1:]):.1f} updates a second", "at least 10"))
    return Section("Slider: 17 x 17 rods, 5 mm edges", _first(slider), rows)


SLIDERS: dict[str, Callable[[float], tuple[rs.Target, rs.GridLayout, tuple[float, float]]]] = {
    "spacing": lambda t: (DOME, square(0.03 + 0.001 * t), (0.0, 0.0)),
    "heading": lambda t: (DOME, replace(square(), rotate=0.1 * t), (0.0, 0.0)),
    "anchor": lambda t: (DOME, square(), (0.01 * t, 0.0)),
    "size": lambda t: (rs.Hemisphere(radius=RADIUS + 0.005 * t), square(), (0.0, 0.0)),
}

BUMPS = rs.HeightField(
    formula="0.08*(exp(-((x-.09)^2/.06^2 + y^2/.07^2)/2) + exp(-((x+.09)^2/.06^2 + y^2/.07^2)/2))",
    domain=rs.Disc(RADIUS),
)


def warm(runs: int) -> Section:
    """A form found again after its spacing grew, from nothing and from the last form (`warm_start=`), by turns.

    From nothing there is little to save: the drape starts from the net in either case, and a new spacing is a new mesh,
    whose matrices are planned and factorised again. What is saved are steps of Newton's method in pop-ups that are far
    from the draped state.
    """
    rows = []
    for name, target in (("hemisphere", DOME), ("two bumps with a dip", BUMPS)):
        last = rs.find_form(target, auto(), ROD)
        for change in (0.02, 0.002):
            layout = auto(0.03 * (1 + change))
            cold, again = list[float](), list[float]()
            for _ in range(runs + 1):
                for start, times in ((None, cold), (last, again)):
                    begin = clock()
                    form = rs.find_form(target, layout, ROD, warm_start=start)
                    times.append(clock() - begin)
                    solves = [popped.report.factorizations for popped in form.popped.values()]
                    counts = f"{form.draped.report.factorizations} + {' + '.join(map(str, solves))}"
                    if start is None:
                        before = counts
            ratio = median(again[1:]) / median(cold[1:])
            rows.append(
                Row(
                    f"{name}, spacing +{100 * change:g} %: from the last form, over from nothing",
                    f"{ratio:.2f} ({ms(median(again[1:]))} / {ms(median(cold[1:]))}; factorisations of drape and "
                    f"pop-ups {counts} against {before})",
                    "at most 0.33" if change == 0.02 else "",
                )
            )
    return Section("Found again", _first(warm), rows)


def _first(work: Callable[..., object]) -> str:
    assert work.__doc__ is not None
    return work.__doc__.replace("\n    ", " ")
