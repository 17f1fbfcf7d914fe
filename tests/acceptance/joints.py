"""Joints and couplings: `python -m tests.acceptance.joints` prints their rows; exit 1 where a figure is missed."""

import sys
from collections.abc import Iterator
from math import radians

import numpy as np

import rodshell as rs
from rodshell.paper.fig4 import Demonstration, run_in_time, run_statics
from rodshell.solve.linear_stability import step_limit
from tests.acceptance.rows import Row, print_table
from tests.joints import coupling_problems as couplings
from tests.joints import joint_problems as joints
from tests.solve.rod_problems import order

STEPS = np.array([200, 400, 800, 1600])
SOME = {"pin": rs.Pin(), "rigid": rs.Rigid(), "spring": rs.Spring(0.002, 0.01, 0.01)}


def converging(case: str, what: str, errors: list[float], bound: float = 0.5) -> Iterator[Row]:
    slope = order(joints.MESHES, errors)
    yield Row(case, f"{what} off beam theory", 100 * abs(errors[-1]), bound, "%", f"edge {joints.MESHES[-1]} m")
    yield Row(case, f"{what}: order off 2", abs(slope - 2), 0.1, "", f"slope {slope:.3f}")


def structure_rows() -> Iterator[Row]:
    for name, joint in (("rigid", rs.Rigid()), ("spring 5 N m", rs.Spring(5.0)), ("spring 0.3 N m", rs.Spring(0.3))):
        errors = [joints.portal_sway(edge, joint) - 1 for edge in joints.MESHES]
        yield from converging(f"portal frame, {name}", "sway", errors)
    for star, rods in joints.STARS.items():
        for name, joint in joints.JOINTS.items():
            errors = [joints.Star(rods, joint).error(edge) for edge in joints.MESHES]
            yield from converging(f"{star}, {name}", "compliance", errors)
    for name, joint in (("pin", rs.Pin()), ("rigid, rest angle given", rs.Rigid(rest_angle=np.pi / 2))):
        star = joints.Star(joints.STARS["two crossing rods"], joint)
        apart = star.compliance(0.1, turned=radians(50)) / star.compliance(0.1) - 1
        yield Row(f"grid sheared by 50 degrees, {name}", "off one built so", abs(apart), 1e-6)
    for rods in (3, 4, 8):
        off = 100 * abs(joints.michell_twist(192, rods) - 1)
        yield Row(f"ring of {rods} rods, rigid joints", "Michell's twist, error", off, 0.5, "%", "192 edges")


def lattice_rows() -> Iterator[Row]:
    for angle in (60, -60):
        free, force = joints.folding_energy(rs.Pin(), radians(angle))
        stiff, _ = joints.folding_energy(rs.Rigid(), radians(angle))
        case = f"lattice folded by {angle} degrees"
        yield Row(case, "energy, pins over rigid joints", free / stiff, 1e-6, "", f"force {force:.0e} N")
    pinned, rigid = (joints.bending_stiffness(joint) for joint in (rs.Pin(), rs.Rigid()))
    yield Row("lattice bent along its rods", "pins and rigid joints apart", abs(pinned / rigid - 1), 1e-9)
    exact = 3 * joints.EI / 1.1
    yield Row("lattice bent along its rods", "off three rods alone", abs(pinned / exact - 1), 1e-8)


def symmetry_rows() -> Iterator[Row]:
    for name, joint in (("ball", rs.Ball()), *SOME.items(), ("four linkers", rs.Linker(corners=4))):
        planes, diagonal = joints.asymmetry(joint)
        yield Row(f"symmetric shell, {name}", "off its mirror images, over R", max(planes, diagonal), 1e-9)
    planes, _ = joints.asymmetry(rs.Linker())
    note = f"it is there: {planes:.1e} R"
    yield Row("symmetric shell, the paper's linkers", "chirality not seen", float(planes < 1e-6), 0, "", note)
    for angle, known in ((37.6, 2.7e-4), (142.4, 2.4e-3)):
        energy = joints.linker_energy(radians(angle), 2)
        note = f"{energy:.3e} J"
        yield Row(f"two linkers at {angle} degrees", "energy off that of E10", abs(energy / known - 1), 0.02, "", note)
    stiffer = 100 * (joints.bending_stiffness(rs.Linker()) / joints.bending_stiffness(rs.Pin()) - 1)
    note = f"{stiffer:.1f} % at 3 edges a spacing"
    yield Row("the paper's linkers", "do not stiffen the rods along themselves", float(stiffer < 1), 0, "", note)


def coupling_rows() -> Iterator[Row]:
    for name, joint in couplings.KINDS.items():
        for what, errors in (
            ("response at rest", couplings.static_errors(joint)),
            ("one step", couplings.step_errors(joint)),
        ):
            slope = order(couplings.DECADES, errors)
            note = f"slope {slope:.4f}; {errors[0]:.0e} to {errors[-1]:.0e}"
            yield Row(f"implicit ties, {name}", f"{what}: slope in C off -1", abs(slope + 1), 0.05, "", note)
        errors = couplings.explicit_errors(joint, STEPS)
        slope = order(1 / STEPS, errors)
        note = f"slope {slope:.3f}"
        yield Row(f"explicit ties, {name}", "to implicit: slope in h off 1", abs(slope - 1), 0.1, "", note)
        whole = couplings.masses(couplings.bent(joint, rs.SharedDofs()))
        for coupling in (rs.ImplicitPenalty(), rs.ExplicitPenalty()):
            mass = couplings.masses(couplings.bent(joint, coupling))
            off = max(abs(a / b - 1) for a, b in zip(mass, whole, strict=True))
            yield Row(f"{coupling.name} ties, {name}", "total mass and inertia off", off, 1e-14)
        below, above = couplings.growth(joint, 0.95, 10_000), couplings.growth(joint, 1.05, 10_000)
        shell = couplings.element(joint)
        limit = step_limit(rs.Motion.of(shell), joints.flat_state(shell))
        case = f"explicit ties, {name}"
        yield Row(case, "growth in 1e4 steps, 5 % below", below, 3, "", f"limit {1e3 * limit:.3f} ms")
        yield Row(case, "does not blow up 5 % above", float(np.isfinite(above)), 0)
        width, count = couplings.systems(couplings.bent(joint, rs.ExplicitPenalty()))
        note = f"{count} systems of their own"
        yield Row(case, "half bandwidth off one rod's, 10", abs((width or np.inf) - 10), 0, "", note)
    for name, ratio in couplings.closed_form_limits().items():
        yield Row(f"explicit ties alone, {name}", "limit off its closed form", abs(ratio - 1), 1e-6)


def demonstration_rows() -> Iterator[Row]:
    cases: list[tuple[Demonstration, rs.Linker | rs.Pin]] = [("twisting", rs.Linker()), ("bending", rs.Linker())]
    for demonstration, joint in (*cases, ("twisting", rs.Pin())):
        for coupling in (rs.SharedDofs(), rs.ImplicitPenalty(), rs.ExplicitPenalty()):
            one = run_in_time(demonstration, joint, coupling, until=3.0)
            case = f"Fig 4 {demonstration}, {joint.name}, {coupling.name}"
            lag = float(np.degrees(one.start_up_lag))
            assert one.step is not None
            note = f"h = {1e3 * one.step:.3g} ms, start-up lag {lag:.3f} degrees"
            yield Row(case, "rate of rod 2 off, second half", 100 * abs(one.rate_error), 0.1, "%", note)
            if coupling.name != "explicit":
                yield Row(case, "start-up lag", lag, 0.25, "deg")
    for demonstration, joint in cases:
        for coupling in (rs.SharedDofs(), rs.ImplicitPenalty()):
            still = run_statics(demonstration, joint, coupling)
            case = f"Fig 4 {demonstration}, {joint.name}, {coupling.name}, statics"
            yield Row(case, "lag", float(np.degrees(still.start_up_lag)), 1e-4, "deg")
    behind = run_in_time("bending", rs.Pin(), rs.SharedDofs(), until=3.0)
    note = f"rod 2 turned by {np.degrees(np.ptp(behind.angles)):.1g} of 180 degrees"
    yield Row("Fig 4 bending, pin, shared", "passes, though it must not", float(behind.follows), 0, "", note)


def all_rows() -> Iterator[Row]:
    yield from structure_rows()
    yield from lattice_rows()
    yield from symmetry_rows()
    yield from coupling_rows()
    yield from demonstration_rows()


if __name__ == "__main__":
    sys.exit(print_table("joints", all_rows()))
