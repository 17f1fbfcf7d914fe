"""Time of one implicit Euler step of a rod against its number of nodes, and against one banded solve alone.

`python benchmarks/rod_scaling.py` prints a table, its log-log slope, and the memory. A heavy cantilever with twist
swings down at a step that needs one factorisation. The banded solve is one factorisation and one solution of
a symmetric positive system of the same size and band (10), by LAPACK (`scipy.linalg.solveh_banded`) and by
`gridshell.solve.banded`. Medians, one thread.
"""

import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from statistics import median

import numpy as np
from scipy.linalg import solveh_banded

import gridshell as gs
from gridshell.model import Assembly
from gridshell.model.elastic_rod import ElasticRod
from gridshell.solve.banded import Banded
from gridshell.solve.implicit_euler import Step

NODES = (100, 316, 1000, 3162, 10_000, 31_623, 100_000)
HALF_BANDWIDTH = 10
EDGE = 0.01
STEP = 1e-3


@dataclass(frozen=True)
class Scaling:
    """Seconds for each number of nodes, and peak memory of the process after it [bytes]."""

    nodes: tuple[int, ...]
    step: tuple[float, ...]
    lapack: tuple[float, ...]
    banded: tuple[float, ...]
    memory: tuple[int, ...]
    factorizations: tuple[float, ...]

    @property
    def slope(self) -> float:
        return float(np.polyfit(np.log(self.nodes), np.log(self.step), 1)[0])

    @property
    def ratios(self) -> list[float]:
        """Step over one banded solve of that size by LAPACK."""
        return [step / solve for step, solve in zip(self.step, self.lapack, strict=True)]

    def __str__(self) -> str:
        head = "  nodes  step ms  us/node  factorisations  LAPACK ms  ratio  own ms  ratio  memory MB"
        rows = [
            f"{n:7d} {1e3 * s:8.2f} {1e6 * s / n:8.2f} {f:15.2f} {1e3 * a:10.2f} {s / a:6.2f} {1e3 * b:7.2f}"
            f" {s / b:6.2f} {m / 1e6:10.0f}"
            for n, s, a, b, m, f in zip(
                self.nodes, self.step, self.lapack, self.banded, self.memory, self.factorizations, strict=True
            )
        ]
        return "\n".join([head, *rows, f"log-log slope {self.slope:.3f}"])


def measure(nodes: tuple[int, ...] = NODES, *, twist: bool = True) -> Scaling:
    columns = list(zip(*(_of_size(n, twist) for n in nodes), strict=True))
    return Scaling(nodes, *columns)  # type: ignore[arg-type]


def _of_size(n: int, twist: bool) -> tuple[float, float, float, int, float]:
    repeats = max(5, min(40, 200_000 // n))
    rest = np.column_stack([EDGE * np.arange(n), np.zeros(n), np.zeros(n)])
    kind = gs.Rod(section=gs.Circle(radius=1e-3), material=gs.Material(youngs_modulus=1e9, density=1e3))
    rod = ElasticRod.of(rest, kind, clamped=("start",), twist=twist)
    motion = gs.Motion.of(rod, forces=(gs.Gravity(rod.nodes),)).in_parts()
    stepper = gs.ImplicitEuler()
    state, velocity, factorizations, times = rod.state(), np.zeros_like(rod.mass), 0, list[float]()
    for k in range(repeats + 2):
        begin = time.perf_counter()
        taken = stepper.take(motion, state, velocity, time=k * STEP, step=STEP)
        assert isinstance(taken, Step), taken
        state, velocity = taken.state, taken.velocity
        motion = motion.refreshed(state)
        if k >= 2:  # the first plans the assembly and may compile
            times.append(time.perf_counter() - begin)
            factorizations += taken.factorizations
    memory = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    lapack, own = _banded_solves(rod, repeats)
    return median(times), lapack, own, memory, factorizations / repeats


def _banded_solves(rod: ElasticRod, repeats: int) -> tuple[float, float]:
    """Seconds of one factorisation and solution alone."""
    free = rod.freedom()
    assembly = Assembly.of([element.blocks for element in (*rod.elements, rod.stretch)], free)
    rng = np.random.default_rng(0)
    data = rng.normal(size=len(assembly.indices))
    data[assembly.diagonal] += 4.0 * HALF_BANDWIDTH  # diagonally dominant
    solver, right = Banded(assembly.indptr, assembly.indices), rng.normal(size=free.size)
    band = np.zeros((solver.half_bandwidth + 1, free.size))
    band[0], band[1:] = 4.0 * HALF_BANDWIDTH, rng.normal(size=(solver.half_bandwidth, free.size))

    def own() -> None:
        solver.factor(data)
        solver.solve(right)

    return (
        _seconds(lambda: solveh_banded(band, right, lower=True, check_finite=False), repeats),
        _seconds(own, repeats),
    )


def _seconds(call: Callable[[], object], repeats: int) -> float:
    call()
    times = []
    for _ in range(repeats):
        begin = time.perf_counter()
        call()
        times.append(time.perf_counter() - begin)
    return median(times)


if __name__ == "__main__":
    for twist in (True, False):
        print("with twist angles" if twist else "isotropic, without twist angles")
        print(measure(twist=twist), flush=True)
    sys.exit(0)
