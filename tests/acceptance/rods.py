"""The rod on its own, statics: `python -m tests.acceptance.rods` prints its rows; exit 1 where a figure is missed."""

import sys
from collections.abc import Iterator, Sequence
from dataclasses import replace
from math import radians

import numpy as np

from rodshell.rods.bend_twist import BendTwist
from tests.acceptance.rows import Row, print_table
from tests.rods import test_elements as elements
from tests.solve import rod_problems as exact

MESHES = (40, 80, 160)


def derivative_rows() -> Iterator[Row]:
    """Taylor slopes and symmetry at random states, by element; with and without natural curvature."""
    cases = dict(elements.CASES)
    for name, (element, state) in elements.CASES.items():
        if isinstance(element, BendTwist):
            none = replace(
                element, natural_curvature=0 * element.natural_curvature, natural_twist=0 * element.natural_twist
            )
            cases[f"{name}, naturally straight"] = none, state
    for name, (element, state) in cases.items():
        energy, gradient, hessian = elements.evaluate(element, state)
        ray = elements.moved(np.random.default_rng(1), 0 * state, 1.0)
        along, bend = np.sum(gradient * ray), (hessian @ ray.ravel()).reshape(ray.shape)

        def energy_left(h: float) -> float:
            return abs(elements.evaluate(element, state + h * ray)[0] - energy - h * along)  # noqa: B023

        def gradient_left(h: float) -> float:
            return float(np.linalg.norm(elements.evaluate(element, state + h * ray)[1] - gradient - h * bend))  # noqa: B023

        yield Row(name, "Taylor slope of the energy off 2", abs(elements.taylor_slope(energy_left) - 2), 0.05)
        yield Row(name, "Taylor slope of the gradient off 2", abs(elements.taylor_slope(gradient_left) - 2), 0.05)
        skew = np.linalg.norm(hessian - hessian.T) / np.linalg.norm(hessian)
        yield Row(name, "skew part of the Hessian over its norm", float(skew), 1e-12)


def rigid_rows() -> Iterator[Row]:
    """A rigid motion of positions and material frames changes no energy."""
    for options in ({}, {"closed": True}, {"clamped": ("start", "end")}):
        change = exact.rigid_motion_change(**options)
        yield Row("rod, bent and twisted", "energy changed by a rigid motion", change, 1e-12, note=str(options))


def slope_rows(case: str, meshes: Sequence[int], **errors: Sequence[float]) -> Iterator[Row]:
    """Order of convergence of each error."""
    for what, column in errors.items():
        slope = exact.order(1 / np.array(meshes), column)
        note = f"slope {slope:.3f}, error {abs(column[-1]):.1e} at {meshes[-1]} edges"
        yield Row(case, f"slope off 2: {what.replace('_', ' ')}", abs(slope - 2), 0.1, note=note)


def convergence_rows() -> Iterator[Row]:
    for tip in (20, 50, 80):
        place, moment, angle = zip(*(exact.elastica_errors(n, radians(tip)) for n in MESHES), strict=True)
        yield from slope_rows(f"elastica, tip {tip} degrees", MESHES, tip=place, moment=moment, tip_angle=angle)
    for weight in (5.0, 20.0):
        finer = (80, 160, 320)
        tips = [exact.heavy_error(n, weight) for n in finer]
        yield from slope_rows(f"heavy cantilever, w L3/EI = {weight:g}", finer, tip=tips)
    radius, pitch, _ = zip(*(exact.helix_errors(n) for n in MESHES), strict=True)
    yield from slope_rows("naturally helical strip", MESHES, radius=radius, pitch=pitch)
    force, moment = np.array([1.0, 2.0, -3.0]), np.array([2.0, 3.0, 1.0])
    for name, stiffness in (("isotropic", (1.0, 1.0, 0.7)), ("anisotropic", (1.0, 2.5, 0.6))):
        rod = exact.Kirchhoff(*stiffness, force, moment)
        shape, pull, turn = zip(*(exact.kirchhoff_errors(n, rod, force) for n in MESHES), strict=True)
        case = f"Kirchhoff, clamped, {name}"
        yield from slope_rows(case, MESHES, shape=shape, end_force=pull, end_moment=turn)


def buckling_rows() -> Iterator[Row]:
    yield Row("ring", "Michell's twist, relative error", abs(exact.michell_twist(128) - 1), 5e-3, note="128 edges")
    yield Row("pinned column", "Euler's load, relative error", abs(exact.euler_load(80) - 1), 1e-3, note="80 edges")
    yield Row(
        "cantilever strip", "Prandtl's load, relative error", abs(exact.lateral_load(40) - 1), 1e-2, note="40 edges"
    )
    meshes = (400, 800, 1600)
    found = [exact.localised_error(n) for n in meshes]
    yield from slope_rows("stretched and twisted rod", meshes, envelope=[one[0] for one in found])
    yield Row(
        "stretched and twisted rod", "envelope off Bergou's tanh^2", found[-1][0], 1e-3, note="1600 edges, 27 turns"
    )


def holonomy_rows() -> Iterator[Row]:
    for name, carry in (("in time", exact.holonomy), ("along a curve", exact.holonomy_along)):
        for colatitude in (0.4, 1.2, 2.0):
            error = exact.holonomy_error(carry, colatitude)
            yield Row(f"frames carried {name}", "turn off the solid angle, in the limit", error, 1e-9, "rad")


def all_rows() -> Iterator[Row]:
    yield from derivative_rows()
    yield from rigid_rows()
    yield from convergence_rows()
    yield from buckling_rows()
    yield from holonomy_rows()


if __name__ == "__main__":
    sys.exit(print_table("rods", all_rows()))
