"""Factorisations of the pop-up's own matrices, with twist: ours against SciPy's SuperLU, in one run.

    python -m benchmarks.factorisation [unknowns ...]        default 8000 32000 100000

Each time is the least of several repetitions, one thread, the symbolic phase done before where a solver keeps it.
A solver that took more than `PATIENCE` seconds is left out of larger systems.
"""

import sys
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib.util import find_spec

import numpy as np
from scipy.sparse import csc_matrix, csr_matrix, diags
from scipy.sparse.linalg import splu
from threadpoolctl import threadpool_limits

import rodshell as rs
from benchmarks.rows import Row, Section, clock, ms
from rodshell.solve.newton_step import NewtonStep
from rodshell.solve.problem import Problem, Supports
from rodshell.solve.sparse_ldl import Multifrontal

PATIENCE = 20.0
RADIUS = 0.2


def system(unknowns: int) -> tuple[csc_matrix, np.ndarray]:
    """Upper triangle of a pinned hemisphere's tangent stiffness, with twist, and where its unknowns lie."""
    rods = max(5, round(np.sqrt(unknowns / 31)))
    spacing = 3.14 * RADIUS / rods
    rod = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
    layout = rs.GridLayout.orthogonal(rods="auto", spacing=spacing, length="auto", edge=spacing / 6)
    trimmed = rs.trim(rs.drape(layout, rod, rs.Hemisphere(radius=RADIUS)))
    shell = rs.Shell.of(trimmed.mesh, rod, joint=rs.Pin())
    state, free = shell.state(trimmed.positions), shell.held_ends()
    step = NewtonStep(
        Problem(shell.elements, shell.stretch, Supports(free), RADIUS, flat_coordinates=shell.flat_coordinates), state
    )
    step.take(step.start(state, np.zeros(len(shell.stretch.blocks))))
    return step.assembly.pattern.assembly.upper(step.matrix.values), np.repeat(
        shell.flat_coordinates, free.count, axis=0
    )


def least(work: Callable[[], object]) -> float:
    """Seconds of the fastest of five runs, or of one that takes long."""
    times = list[float]()
    for _ in range(5):
        begin = clock()
        work()
        times.append(clock() - begin)
        if times[-1] > 2.0:
            break
    return min(times)


@dataclass(frozen=True)
class Factorised:
    """One solver on one system: seconds of a factorisation, the same over ours, and the residual of a solution."""

    unknowns: int
    solver: str
    seconds: float
    over_ours: float
    residual: float


@threadpool_limits.wrap(limits=1)
def measure(sizes: Sequence[int]) -> Iterator[Factorised]:
    """Every solver on every size; pypardiso too where it is installed."""
    slow = set[str]()
    for size in sizes:
        upper, places = system(size)
        whole = csc_matrix(upper + upper.T - diags(upper.diagonal()))
        right = np.sin(np.arange(upper.shape[0]))
        reference = None
        for name, make in SOLVERS.items():
            if name in slow:
                continue
            factor, solve = make(upper, whole, places)
            factor()
            seconds = least(factor)
            reference = reference or seconds
            slow |= {name} if seconds > PATIENCE else set()
            x = solve(right)
            residual = np.abs(whole @ x - right).max() / (np.abs(whole) @ np.abs(x)).max()
            yield Factorised(upper.shape[0], name, seconds, seconds / reference, float(residual))


Solver = tuple[Callable[[], object], Callable[[np.ndarray], np.ndarray]]


def _ours(upper: csc_matrix, whole: csc_matrix, places: np.ndarray) -> Solver:
    solver = Multifrontal(upper.indptr, upper.indices, places)
    factors = solver.factor(upper.data)

    def factor() -> None:
        nonlocal factors
        factors = solver.factor(upper.data, reuse=factors)

    return factor, lambda right: factors.solve(right)


def _splu(upper: csc_matrix, whole: csc_matrix, places: np.ndarray) -> Solver:
    options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
    return lambda: splu(whole, **options), lambda right: splu(whole, **options).solve(right)


def _pardiso(upper: csc_matrix, whole: csc_matrix, places: np.ndarray) -> Solver:
    from pypardiso import PyPardisoSolver

    solver, rows = PyPardisoSolver(mtype=-2), csr_matrix(upper)
    solver.set_phase(11)
    solver._call_pardiso(rows, np.zeros((rows.shape[0], 1)))  # the symbolic phase, once

    def factor() -> None:
        solver.set_phase(22)
        solver._call_pardiso(rows, np.zeros((rows.shape[0], 1)))

    def solve(right: np.ndarray) -> np.ndarray:
        solver.set_phase(33)
        return np.asarray(solver._call_pardiso(rows, right[:, None])).ravel()

    return factor, solve


SOLVERS: dict[str, Callable[[csc_matrix, csc_matrix, np.ndarray], Solver]] = {
    "multifrontal": _ours,
    "scipy splu": _splu,
}
if find_spec("pypardiso"):
    SOLVERS["pypardiso"] = _pardiso


def factorisation(quick: bool) -> Section:
    """Tangent stiffness of pinned hemispheres with twist angles: factorisations, the least of five, one thread; the
    symbolic phase done before where a solver keeps it."""
    asked = {32_000: "2.5", 100_000: "10"}
    rows, details = list[Row](), list[Row]()
    for size in (8_000, 32_000) if quick else (8_000, 32_000, 100_000, 300_000, 1_000_000):
        found = list(measure([size]))
        for theirs in (one for one in found if one.solver == "scipy splu"):
            limit = f"at least {asked[size]} times" if size in asked else ""
            rows.append(Row(f"{theirs.unknowns} unknowns, SciPy's SuperLU over ours", f"{theirs.over_ours:.1f}", limit))
        details += [
            Row(f"   {one.unknowns} unknowns, {one.solver}", f"{ms(one.seconds)}, residual {one.residual:.0e}")
            for one in found
        ]
    assert factorisation.__doc__ is not None
    return Section("Factorisation", factorisation.__doc__.replace("\n    ", " "), rows + details)


def main(sizes: Sequence[int]) -> None:
    print(f"{'unknowns':>9} {'solver':>12} {'factor ms':>10} {'over ours':>10} {'residual':>9}")
    for one in measure(sizes):
        times = f"{1e3 * one.seconds:10.1f} {one.over_ours:10.1f}"
        print(f"{one.unknowns:9d} {one.solver:>12} {times} {one.residual:9.1e}", flush=True)


if __name__ == "__main__":
    main([int(n) for n in sys.argv[1:]] or [8_000, 32_000, 100_000])
