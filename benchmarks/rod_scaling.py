"""Time of one implicit Euler step of a rod against its number of nodes, and against one banded solve alone.

`python benchmarks/rod_scaling.py` prints a table for each kind of rod, its log-log slope, and the memory.

A *step* is all that `simulate` does between two records for a heavy cantilever that swings down: one Newton iteration
(one Hessian, one factorisation, two solutions, one more evaluation of the forces) and the refresh of the frames. A
*banded solve* is one factorisation and one solution of a symmetric positive system of the same size and band, which
is given as a band: by LAPACK (`scipy.linalg.solveh_banded`), and by `rodshell.solve.newton_matrix`. The three
take turns in one thread, and the least processor time of each is taken: other work on the machine can only add to it.
"""

import resource
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.linalg import solveh_banded
from threadpoolctl import threadpool_limits

import rodshell as rs
from rodshell.model.elastic_rod import ElasticRod
from rodshell.solve.implicit_euler import Step
from rodshell.solve.newton_matrix import Banded
from rodshell.solve.problem import NO_CURVATURE

NODES = (100, 316, 1000, 3162, 10_000, 31_623, 100_000)
EDGE = 0.01
STEP = 2e-4  # short enough that one Newton iteration does at every size, so that all sizes do the same work a step
STEEL = rs.Material(youngs_modulus=1e9, density=1e3)
KINDS: dict[str, tuple[rs.Rod, bool]] = {
    "isotropic, without twist angles": (rs.Rod(rs.Circle(1e-3), STEEL), False),
    "isotropic, with twist": (rs.Rod(rs.Circle(1e-3), STEEL), True),
    "elliptic, with twist": (rs.Rod(rs.Ellipse(1e-3, 2e-3), STEEL), True),
}


@dataclass(frozen=True)
class Scaling:
    """Least seconds for each number of nodes, and peak memory of the process after it [bytes].

    factorizations : of a step, on average.
    """

    nodes: tuple[int, ...]
    step: tuple[float, ...]
    lapack: tuple[float, ...]
    own: tuple[float, ...]
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
        head = "  nodes  step ms  us/node  factorisations  LAPACK ms  ratio   own ms  ratio  memory MB"
        rows = [
            f"{n:7d} {1e3 * s:8.3f} {1e6 * s / n:8.2f} {f:15.2f} {1e3 * a:10.3f} {s / a:6.2f} {1e3 * b:8.3f}"
            f" {s / b:6.2f} {m / 1e6:10.0f}"
            for n, s, a, b, m, f in zip(
                self.nodes, self.step, self.lapack, self.own, self.memory, self.factorizations, strict=True
            )
        ]
        return "\n".join([head, *rows, f"log-log slope {self.slope:.3f}"])


@threadpool_limits.wrap(limits=1)  # so that LAPACK has one thread too
def measure(kind: rs.Rod, *, twist: bool, nodes: tuple[int, ...] = NODES) -> Scaling:
    columns = list(zip(*(_of_size(n, kind, twist) for n in nodes), strict=True))
    return Scaling(nodes, *columns)  # type: ignore[arg-type]


def _of_size(n: int, kind: rs.Rod, twist: bool) -> tuple[float, float, float, int, float]:
    repeats = max(30, min(300, 1_000_000 // n))
    rest = np.column_stack([EDGE * np.arange(n), np.zeros(n), np.zeros(n)])
    rod = ElasticRod.of(rest, kind, clamped=("start",), twist=twist)
    swing, lapack, own = _Swing(rod), *_banded_solves(rod)
    least = [np.inf, np.inf, np.inf]
    for k in range(repeats + 2):
        for which, call in enumerate((swing.step, lapack, own)):
            begin = time.thread_time()
            call()
            if k >= 2:  # the first plans the matrix and may compile
                least[which] = min(least[which], time.thread_time() - begin)
    memory = 1024 * resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return (*least, memory, swing.factorizations / swing.taken)  # type: ignore[return-value]


class _Swing:
    """A heavy cantilever let go, step by step."""

    def __init__(self, rod: ElasticRod) -> None:
        self._motion = rs.Motion.of(rod, forces=(rs.GravityForce(rod.nodes),)).in_parts()
        self._stepper = rs.ImplicitEuler()
        self._state, self._velocity = rod.state(), np.zeros_like(rod.mass)
        self.taken, self.factorizations = 0, 0

    def step(self) -> None:
        found = self._stepper.take(
            self._motion, self._state, self._velocity, time=STEP * self.taken, step=STEP
        )  # fmt: skip
        assert isinstance(found, Step), found
        self._state, self._velocity = found.state, found.velocity
        self._motion = self._motion.refreshed(found.state)
        self.taken += 1
        self.factorizations += found.factorizations


def _banded_solves(rod: ElasticRod) -> tuple[Callable[[], object], Callable[[], object]]:
    """One factorisation and solution of a stiffness, made positive, by LAPACK and by ourselves.

    The rod is crumpled a little: of a straight one half of the band is zeros, which LAPACK passes over.
    """
    parts, free = (*rod.elements, rod.stretch), rod.freedom()
    state = rod.state() + free.expand(0.05 * EDGE * np.random.default_rng(1).normal(size=free.size))
    matrix = Banded([part.blocks for part in parts], free)
    for which, part in enumerate(parts):
        hessians = np.empty((len(part.blocks), 3 * part.blocks.shape[1], 3 * part.blocks.shape[1]))
        part.evaluate(state, np.zeros_like(rod.mass), hessians)
        matrix.add(which, hessians, part.blocks, free)
    positive = np.full_like(rod.mass, 4.0 * np.abs(matrix.values).max())
    matrix.add_blocks(positive, NO_CURVATURE, free)
    filled = matrix.values.copy()
    upside_down = np.ascontiguousarray(filled[: matrix.size, : matrix.half_bandwidth + 1].T)
    right = np.random.default_rng(0).normal(size=rod.mass.shape)
    reduced = free.reduce(right)

    def own() -> None:
        matrix.values[:] = filled
        matrix.factor()
        matrix.solve(right, free)

    return lambda: solveh_banded(upside_down, reduced, lower=True, check_finite=False), own


if __name__ == "__main__":
    for name, (kind, twist) in KINDS.items():
        print(name)
        print(measure(kind, twist=twist), flush=True)
    sys.exit(0)
