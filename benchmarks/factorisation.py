"""Factorisations of the pop-up's own matrices, with twist: ours against QDLDL and SciPy's SuperLU, in one run.

    python benchmarks/factorisation.py [unknowns ...]        default 8000 32000 100000

Each time is the least of several repetitions, one thread, the symbolic phase done before where a solver keeps it.
A solver that took more than `PATIENCE` seconds is left out of larger systems.
"""

import sys
import time
from collections.abc import Callable

import numpy as np
import qdldl
from scipy.sparse import csc_matrix, diags
from scipy.sparse.linalg import splu
from threadpoolctl import threadpool_limits

import gridshell as gs
from gridshell.solve.constraint import Supports
from gridshell.solve.mixed_newton import Problem
from gridshell.solve.mixed_newton import _Step as Newton
from gridshell.solve.multifrontal import Multifrontal

PATIENCE = 20.0
RADIUS = 0.2


def system(unknowns: int) -> tuple[csc_matrix, np.ndarray]:
    """Upper triangle of a pinned hemisphere's tangent stiffness, with twist, and where its unknowns lie."""
    rods = max(5, round(np.sqrt(unknowns / 31)))
    spacing = 3.14 * RADIUS / rods
    rod = gs.Rod(section=gs.Circle(radius=1e-3), material=gs.Material(youngs_modulus=1e6, density=1e3))
    layout = gs.GridLayout.orthogonal(rods="auto", spacing=spacing, length="auto", edge=spacing / 6)
    trimmed = gs.trim(gs.drape(layout, rod, gs.Hemisphere(radius=RADIUS)))
    shell = gs.Shell.of(trimmed.mesh, rod, joint=gs.Pin())
    state, free = shell.state(trimmed.positions), shell.held_ends()
    step = Newton(Problem(shell.elements, shell.stretch, Supports(free), RADIUS, places=shell.places), state)
    step.take(state, np.zeros(len(shell.stretch.blocks)), False)
    pattern = step._assembly
    matrix = csc_matrix((step._data, pattern.indices, pattern.indptr), shape=(free.size, free.size))
    return matrix, np.repeat(shell.places, free.count, axis=0)


def least(work: Callable[[], object]) -> float:
    """Seconds of the fastest of five runs, or of one that takes long."""
    times = list[float]()
    for _ in range(5):
        begin = time.perf_counter()
        work()
        times.append(time.perf_counter() - begin)
        if times[-1] > 2.0:
            break
    return min(times)


def main(sizes: list[int]) -> None:
    slow = set[str]()
    print(f"{'unknowns':>9} {'solver':>12} {'factor ms':>10} {'over ours':>10} {'residual':>9}")
    for size in sizes:
        upper, places = system(size)
        whole = csc_matrix(upper + upper.T - diags(upper.diagonal()))
        right = np.sin(np.arange(upper.shape[0]))
        ours = Multifrontal(upper.indptr, upper.indices, places)
        ours.factor(upper.data)
        reference = least(lambda: ours.factor(upper.data))  # noqa: B023
        row(upper.shape[0], "multifrontal", reference, reference, whole, ours.solve(right), right)
        if "qdldl" not in slow:
            theirs = qdldl.Solver(upper, upper=True)
            seconds = least(lambda: theirs.update(upper, upper=True))  # noqa: B023
            row(upper.shape[0], "qdldl", seconds, reference, whole, theirs.solve(right), right)
            slow |= {"qdldl"} if seconds > PATIENCE else set()
        if "splu" not in slow:
            options = {"permc_spec": "MMD_AT_PLUS_A", "diag_pivot_thresh": 0.0, "options": {"SymmetricMode": True}}
            seconds = least(lambda: splu(whole, **options))  # noqa: B023
            row(upper.shape[0], "scipy splu", seconds, reference, whole, splu(whole, **options).solve(right), right)
            slow |= {"splu"} if seconds > PATIENCE else set()


def row(
    unknowns: int, name: str, seconds: float, reference: float, whole: csc_matrix, x: np.ndarray, right: np.ndarray
) -> None:
    residual = np.abs(whole @ x - right).max() / (np.abs(whole) @ np.abs(x)).max()
    print(f"{unknowns:9d} {name:>12} {1e3 * seconds:10.1f} {seconds / reference:10.1f} {residual:9.1e}", flush=True)


if __name__ == "__main__":
    with threadpool_limits(1):
        main([int(n) for n in sys.argv[1:]] or [8_000, 32_000, 100_000])
