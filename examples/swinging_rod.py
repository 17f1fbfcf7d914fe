"""A released rod swings on its clamped end; the record streams to disk, and the motion continues from where it stopped.

Implicit Euler is of first order: the example shows how much of the energy the step takes, and that half the step
takes about half as much.
"""

import tempfile
from pathlib import Path

import numpy as np

import rodshell as rs

ROD = rs.Rod(section=rs.Circle(radius=2e-3), material=rs.Material(youngs_modulus=1e9, density=1e3))
NODES = 41
UNTIL = 0.6  # s


def swing(step: float, until: float = UNTIL, stream: Path | None = None) -> rs.TimeSeries:
    """A straight cantilever of 1 m, let go under its own weight."""
    rest = np.column_stack([np.linspace(0, 1, NODES), np.zeros(NODES), np.zeros(NODES)])
    rod = rs.ElasticRod.of(rest, ROD, clamped=("start",))
    motion = rs.Motion.of(rod, forces=(rs.GravityForce(rod.nodes),))
    return rs.simulate(motion, rod.state(), until=until, step=step, stream=stream)


def energy(series: rs.TimeSeries) -> np.ndarray:
    """Elastic, kinetic and of the height [J] at each time."""
    assert series.last is not None
    weight = 9.81 * series.last.motion.mass[:NODES, 2]
    return series.energies.sum(axis=1) + series.states[:, :NODES, 2] @ weight


def main() -> None:
    lost = []
    for step in (2e-3, 1e-3, 5e-4):
        series = swing(step)
        total = energy(series)
        tip = series.states[:, NODES - 1]
        turned = series.energies[:, 0].max()
        lost.append((total[0] - total[-1]) / turned)
        lowest = tip[:, 2].min()
        print(f"step {step:.1e} s: lowest tip {lowest:.4f} m, energy lost {100 * lost[-1]:.1f} % of {turned:.2e} J")
        assert np.diff(total).max() <= 1e-10 * turned, "implicit Euler gives no energy to a swing"
        assert np.abs(tip[:, 1]).max() < 1e-9, "the swing stays in its plane"
    assert lost[0] > lost[1] > lost[2], "a shorter step loses less"

    with tempfile.TemporaryDirectory() as folder:
        first = swing(1e-3, until=UNTIL / 2, stream=Path(folder))
        on_disk = rs.TimeSeries.load(folder)
        assert np.array_equal(on_disk.states, first.states)
    last = first.last
    assert last is not None
    rest = rs.simulate(last.motion, last.state, last.velocity, start=UNTIL / 2, until=UNTIL, step=1e-3)
    apart = np.abs(rest.states[-1] - swing(1e-3).states[-1]).max()
    print(f"stopped half way and continued: {apart:.1e} from the uninterrupted swing")
    assert apart < 1e-9


if __name__ == "__main__":
    main()
