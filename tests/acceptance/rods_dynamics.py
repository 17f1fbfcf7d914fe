"""The dynamics rows of the rod's acceptance table: `python -m tests.acceptance.rods_dynamics`."""

import sys
from collections.abc import Iterator

import numpy as np

import gridshell as gs
from benchmarks.rod_scaling import measure
from tests.acceptance.rows import Row
from tests.analytic.test_rod_dynamics import (
    G,
    angular_momentum,
    exact_frequencies,
    kind,
    linear_momentum,
    measured_frequency,
    modes,
    order,
    straight,
    thrown,
)


def frequency_rows() -> Iterator[Row]:
    """By the eigenproblem of the assembled K and M, and in time, extrapolated to no step."""
    exact = exact_frequencies(kind())
    rod = straight(61, clamped=("start",), twist=False)
    frequencies, shapes = modes(rod)
    for mode in range(3):
        f, shape = frequencies[2 * mode], shapes[2 * mode]
        coarse, fine = (measured_frequency(rod, shape, f, steps_per_period=n) for n in (200, 400))
        for how, found in (("eigenproblem", f), ("in time", (4 * fine - coarse) / 3)):
            off = 100 * abs(found / exact[mode] - 1)
            yield Row("cantilever", f"bending frequency {mode + 1}, {how}", off, 0.5, "%", f"{found:.4f} Hz, 60 edges")


def order_rows() -> Iterator[Row]:
    rod = straight(21, kind(1e8), clamped=("start",))
    motion = gs.Motion.of(rod, forces=(gs.Gravity(rod.nodes, G),))
    counts = np.array([160, 320, 640, 1280, 2560])
    tips = [gs.simulate(motion, rod.state(), until=0.2, step=0.2 / n).states[-1][20] for n in counts]
    slope = order(1 / counts[:-1], np.linalg.norm(np.diff(tips, axis=0), axis=1))
    yield Row("heavy cantilever let go", "order in the step, off 1", abs(slope - 1), 0.1, "", f"slope {slope:.3f}")


def conservation_rows() -> Iterator[Row]:
    rod = straight(31)
    series = gs.simulate(gs.Motion.of(rod), rod.state(), thrown(rod), until=0.5, step=2e-3)
    momentum = linear_momentum(rod, series.velocities)
    drift = float(np.abs(momentum - momentum[0]).max() / np.abs(momentum[0]).max())
    yield Row("free rod", "linear momentum drifts, relative", drift, 1e-10, "", f"{series.report.steps} steps")

    counts, lost = np.array([200, 400, 800, 1600]), []
    rod = straight(21, kind(1e8), twist=False)
    for n in counts:
        series = gs.simulate(gs.Motion.of(rod), rod.state(), thrown(rod), until=0.1, step=0.1 / n)
        turning = angular_momentum(rod, series.states, series.velocities)
        lost.append(float(np.linalg.norm(turning[-1] - turning[0]) / np.linalg.norm(turning[0])))
    slope = order(1 / counts, lost)
    note = f"slope {slope:.3f}; {lost[-1]:.1e} lost at the finest"
    yield Row("free rod", "angular momentum: order off 1", abs(slope - 1), 0.1, "", note)

    growth = -np.inf
    for stiffness in (1e6, 1e8, 5e10):
        rod = straight(15, kind(stiffness))
        series = gs.simulate(gs.Motion.of(rod), rod.state(), thrown(rod, 3.0), until=0.3, step=3e-3)
        total = series.energies.sum(axis=1)
        growth = max(growth, float(np.diff(total).max() / total[0]))
    yield Row("free rod, 3 m/s, E 1e6 to 5e10", "energy grows in a step, relative", growth, 1e-12)


def scaling_rows() -> Iterator[Row]:
    """Times of this machine, alone: other work on it shows."""
    for name, twist in (("rod with twist", True), ("isotropic rod", False)):
        scaling = measure(twist=twist)
        span = f"{scaling.nodes[0]} to {scaling.nodes[-1]} nodes"
        note = f"slope {scaling.slope:.3f}, {span}; {scaling.memory[-1] / 1e6:.0f} MB"
        yield Row(name, "log-log slope of a step, off 1", abs(scaling.slope - 1), 0.1, "", note)
        for label, solves in (("LAPACK's", scaling.lapack), ("our own", scaling.banded)):
            ratio = scaling.step[-1] / solves[-1]
            note = f"step {1e3 * scaling.step[-1]:.0f} ms, solve {1e3 * solves[-1]:.0f} ms"
            yield Row(name, f"step over one banded solve, {label}", ratio, 3.0, "", note)


def dynamics_rows() -> Iterator[Row]:
    yield from frequency_rows()
    yield from order_rows()
    yield from conservation_rows()


def main() -> int:
    missed = 0
    for rows in (dynamics_rows, scaling_rows):
        for row in rows():
            print(row, flush=True)
            missed += not row.reached
    return 1 if missed else 0


if __name__ == "__main__":
    sys.exit(main())
