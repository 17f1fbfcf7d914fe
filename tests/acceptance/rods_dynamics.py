"""The dynamics rows of the rod's acceptance table: `python -m tests.acceptance.rods_dynamics`."""

import sys
from collections.abc import Iterator

import numpy as np

from tests.acceptance.rows import Row, print_table
from tests.solve import rod_motions as motions
from tests.solve.rod_problems import order


def frequency_rows() -> Iterator[Row]:
    """By the eigenproblem of the assembled K and M, and in time, in the limit of small steps."""
    exact = motions.exact_frequencies(motions.kind())
    rod = motions.straight(61, clamped=("start",), twist=False)
    frequencies, shapes = motions.modes(rod)
    for mode in range(3):
        f = frequencies[2 * mode]  # each twice: along y and z
        for how, found in (("eigenproblem", f), ("in time", motions.frequency_limit(rod, shapes[2 * mode], f))):
            off = 100 * abs(found / exact[mode] - 1)
            yield Row("cantilever", f"bending frequency {mode + 1}, {how}", off, 0.5, "%", f"{found:.4f} Hz, 60 edges")


def order_rows() -> Iterator[Row]:
    slope = motions.swing_order(twist=True)
    yield Row("heavy cantilever let go", "order in the step, off 1", abs(slope - 1), 0.1, "", f"slope {slope:.3f}")


def conservation_rows() -> Iterator[Row]:
    yield Row("free rod", "linear momentum drifts, relative", motions.linear_drift(motions.straight(31)), 1e-10)

    counts = np.array([200, 400, 800, 1600])
    lost = motions.angular_losses(motions.straight(21, motions.kind(1e8), twist=False), counts)
    slope = order(1 / counts, lost)
    note = f"slope {slope:.3f}; {lost[-1]:.1e} lost at the finest"
    yield Row("free rod", "angular momentum: order off 1", abs(slope - 1), 0.1, "", note)

    rods = (motions.straight(15, motions.kind(stiffness)) for stiffness in (1e6, 1e8, 5e10))
    growth = max(motions.energy_growth(rod, speed=3.0)[0] for rod in rods)
    yield Row("free rod, 3 m/s, E 1e6 to 5e10", "energy grows in a step, relative", growth, 1e-12)


def dynamics_rows() -> Iterator[Row]:
    yield from frequency_rows()
    yield from order_rows()
    yield from conservation_rows()


if __name__ == "__main__":
    sys.exit(print_table("rods-dynamics", dynamics_rows()))
