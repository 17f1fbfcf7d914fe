"""A cantilever let go under gravity, by rodshell and by PyElastica: seconds of work for one simulated second.

`python benchmarks/pyelastica_cantilever.py [--budget SECONDS]` (pip install -e ".[bench]"). A rod of 1 m, radius 10 mm,
1000 kg/m3, damped at 5 1/s, at 100 and 1000 nodes, E = 1 MPa and 50 GPa. Equal accuracy: at ten times in the second
the tip is within 2 % of its largest deflection from the truth. For 50 GPa that is the sum of the modes of Euler and
Bernoulli's beam, which sags by 1 mm; for 1 MPa rodshell's own motion of a fine mesh, extrapolated to no step.
PyElastica holds its first edge, half an edge inside the rod, and is therefore given a rod that is half an edge longer.
Each code takes the largest step that reaches the accuracy, by halves: rodshell from 20 ms, PyElastica, which is
explicit, from its stability limit. A run that would exceed the budget is stopped, and its time projected from the part
done. Compilation is not counted.
"""

import argparse
import time
import warnings
from dataclasses import dataclass
from math import pi, sqrt

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import brentq

import rodshell as rs
from rodshell.model.elastic_rod import ElasticRod

Floats = NDArray[np.float64]

LENGTH, RADIUS, DENSITY, DAMPING, G = 1.0, 0.01, 1e3, 5.0, 9.81
TOLERANCE = 2e-2  # of the largest deflection
SAMPLES = 10  # in the second
CASES = ((100, 1e6), (1000, 1e6), (100, 50e9), (1000, 50e9))


@dataclass(frozen=True)
class Outcome:
    """One code on one case; `seconds` is projected where the run was stopped. `said`: why there is no error."""

    seconds: float
    step: float
    error: float | None
    said: str = ""

    def __str__(self) -> str:
        if self.error is None and not np.isfinite(self.seconds):
            return f"fails: {self.said}"
        error = f"off by {100 * self.error:.2f} %" if self.error is not None else self.said
        return f"{self.seconds:9.3g} s, step {self.step:.2g} s, {error}"


def rodshell_tips(nodes: int, youngs_modulus: float, step: float) -> tuple[Floats, float]:
    """Tip (SAMPLES, 3) and seconds."""
    kind = rs.Rod(rs.Circle(RADIUS), rs.Material(youngs_modulus, DENSITY, 0.5))
    rest = np.column_stack([np.linspace(0, LENGTH, nodes), np.zeros(nodes), np.zeros(nodes)])
    rod = ElasticRod.of(rest, kind, clamped=("start",))
    motion = rs.Motion.of(rod, forces=(rs.GravityForce(rod.nodes), rs.Damping(rate=DAMPING)))
    per_sample = round(1 / (SAMPLES * step))
    begin = time.perf_counter()
    series = rs.simulate(motion, rod.state(), until=1.0, step=step, every=per_sample)
    return series.states[1:, nodes - 1], time.perf_counter() - begin


def by_rodshell(nodes: int, youngs_modulus: float, truth: Floats) -> Outcome:
    outcome = Outcome(np.inf, 0.0, None)
    for halvings in range(14):
        step = 0.02 / 2**halvings
        tips, seconds = rodshell_tips(nodes, youngs_modulus, step)
        outcome = Outcome(seconds, step, _error(tips, truth))
        if outcome.error is not None and outcome.error <= TOLERANCE:
            break
    return outcome


def by_pyelastica(nodes: int, youngs_modulus: float, truth: Floats, budget: float) -> Outcome:
    """From the time that a stretch wave takes along an edge, or across the section, down."""
    edge, wave = LENGTH / (nodes - 1), sqrt(youngs_modulus / DENSITY)
    step = min(edge, RADIUS) / wave
    said, spent = "", time.perf_counter()
    for _ in range(8):
        outcome = _pyelastica_run(nodes, youngs_modulus, step, truth, budget)
        if outcome.error is not None and outcome.error <= TOLERANCE:
            return outcome
        if outcome.error is None and np.isfinite(outcome.seconds):
            return outcome  # stopped by the budget: half the step would take twice as long
        said = outcome.said or f"off by {100 * (outcome.error or np.nan):.1f} % with a step of {step:.2g} s"
        if time.perf_counter() - spent > 2 * budget:
            break
        step /= 2
    return Outcome(np.inf, step, None, said)


def _pyelastica_run(nodes: int, youngs_modulus: float, step: float, truth: Floats, budget: float) -> Outcome:
    import elastica as ea

    class Simulator(ea.BaseSystemCollection, ea.Constraints, ea.Forcing, ea.Damping):  # type: ignore[misc]
        pass

    simulator = Simulator()
    more = 0.5 * LENGTH / (nodes - 1.5)  # half an edge
    rod = ea.CosseratRod.straight_rod(
        nodes - 1, np.array([-more, 0, 0]), np.array([1.0, 0, 0]), np.array([0.0, 0, 1]), LENGTH + more, RADIUS,
        DENSITY,
        youngs_modulus=youngs_modulus, shear_modulus=youngs_modulus / 3,
    )  # fmt: skip
    simulator.append(rod)
    simulator.constrain(rod).using(ea.OneEndFixedBC, constrained_position_idx=(0,), constrained_director_idx=(0,))
    simulator.add_forcing_to(rod).using(ea.GravityForces, acc_gravity=np.array([0, 0, -G]))
    simulator.dampen(rod).using(ea.AnalyticalLinearDamper, uniform_damping_constant=DAMPING, time_step=step)
    simulator.finalize()
    stepper = ea.PositionVerlet()
    per_sample = max(1, round(1 / (SAMPLES * step)))
    h = 1 / (SAMPLES * per_sample)
    tips, now, done, begin = [], 0.0, 0, None
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for _ in range(SAMPLES):
            for _ in range(per_sample):
                now = stepper.step(simulator, now, h)
                done += 1
                if begin is None:  # the first step compiles
                    begin = time.perf_counter()
                if done % 1000 == 0 and time.perf_counter() - begin > budget:
                    seconds = (time.perf_counter() - begin) / (done * h)
                    if not np.isfinite(rod.position_collection).all():
                        return Outcome(np.inf, h, None, f"not finite after {now:.2g} s, step {h:.2g} s")
                    return Outcome(seconds, h, None, f"projected, stopped at {now:.2g} s by the budget of {budget:g} s")
            if not np.isfinite(rod.position_collection).all():
                printed = f"; it printed: {caught[0].message}" if caught else ""
                return Outcome(np.inf, h, None, f"not finite after {now:.2g} s, step {h:.2g} s{printed}")
            tips.append(rod.position_collection[:, -1].copy())
    assert begin is not None
    return Outcome(time.perf_counter() - begin, h, _error(np.array(tips), truth))


def _error(tips: Floats, truth: Floats) -> float:
    """Largest distance of the tip from the truth, over its largest deflection."""
    deflection = np.linalg.norm(truth - [LENGTH, 0, 0], axis=1).max()
    return float(np.linalg.norm(tips - truth, axis=1).max() / deflection)


def true_tips(youngs_modulus: float) -> Floats:
    """(SAMPLES, 3) of the stiff rod by linear theory, of the soft one by rodshell, 200 nodes, extrapolated."""
    sag = DENSITY * G * LENGTH**4 / (2 * youngs_modulus * RADIUS**2)
    if sag < 1e-2 * LENGTH:
        return _modal_tips(youngs_modulus)
    coarse, fine = (rodshell_tips(200, youngs_modulus, step)[0] for step in (5e-4, 2.5e-4))
    return 2 * fine - coarse


def _modal_tips(youngs_modulus: float) -> Floats:
    """Modes phi^(4) = b^4 phi of a cantilever: q'' + c q' + w^2 q = -g times the mode's share of an even load."""
    times, drop = np.arange(1, SAMPLES + 1) / SAMPLES, np.zeros(SAMPLES)
    for k in range(8):
        b = brentq(lambda b: np.cos(b) + 1 / np.cosh(b), k * pi + 1e-9, (k + 1) * pi)
        s = (np.cosh(b) + np.cos(b)) / (np.sinh(b) + np.sin(b))
        tip = np.cosh(b) - np.cos(b) - s * (np.sinh(b) - np.sin(b))
        w = (b / LENGTH) ** 2 * sqrt(youngs_modulus / DENSITY) * RADIUS / 2
        turn = sqrt(w**2 - DAMPING**2 / 4)
        swing = np.exp(-DAMPING * times / 2) * (np.cos(turn * times) + DAMPING / (2 * turn) * np.sin(turn * times))
        drop += tip * 2 * s / b * G / w**2 * (1 - swing)  # the integral of phi is 2 s / b, that of phi^2 is 1
    return np.column_stack([np.full(SAMPLES, LENGTH), np.zeros(SAMPLES), -drop])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--budget", type=float, default=60.0, help="seconds of work allowed to each run of PyElastica")
    budget = parser.parse_args().budget
    rodshell_tips(10, 1e6, 0.02)  # compiles
    for nodes, youngs_modulus in CASES:
        truth = true_tips(youngs_modulus)
        deflection = np.linalg.norm(truth - [LENGTH, 0, 0], axis=1).max()
        print(f"{nodes} nodes, E {youngs_modulus:.0e} Pa, largest deflection {1e3 * deflection:.4g} mm")
        print(f"    rodshell   {by_rodshell(nodes, youngs_modulus, truth)}", flush=True)
        print(f"    PyElastica  {by_pyelastica(nodes, youngs_modulus, truth, budget)}", flush=True)


if __name__ == "__main__":
    main()
