"""Shells of any size, mirrored, turned and far away: rows of `make accept-drawn`."""

from collections.abc import Iterator
from math import pi, radians

import numpy as np
from scipy.spatial import cKDTree

import rodshell as rs
from rodshell.solve.equilibrium import find_stable
from tests.acceptance.rows import Row
from tests.solve.fans import fans
from tests.solve.scaled import LATH, TUBE, Placed, boundary_placed, cap, form, others

JOINTS = "pin", "spring", "rigid", "four linkers", "two layers"
HERE = Placed()
POWERS = range(-20, 11)
OPENED = 8.84, 8.86, 8.9, 9.0, 9.2, 9.5, 10.0  # degrees: the bifurcation is at 8.83


def size_rows() -> Iterator[Row]:
    """Every length times 2^k: counts, energies over the cube of the size, and positions over the size."""
    for kind in (TUBE, LATH):
        for joint in JOINTS:
            here, sizes = form(kind, joint, HERE), [2.0**k for k in POWERS]
            for ends, shell in here.popped.items():
                there = [form(kind, joint, Placed(size)).popped[ends] for size in sizes]
                counts = [abs(one.report.factorizations - shell.report.factorizations) for one in there]
                pairs = list(zip(sizes, there, strict=True))
                energy = shell.equilibrium.energy
                energies = [abs(one.equilibrium.energy / size**3 / energy - 1) for size, one in pairs]
                apart = [float(np.abs(one.positions / size - shell.positions).max()) for size, one in pairs]
                case, note = f"2^-20 to 2^10, {kind}, {joint}, {ends}", f"{shell.report.factorizations} factorisations"
                yield Row(case, "not stable", float(not all(one.report.stable for one in there)), 0)
                yield Row(case, "factorisations apart", max(counts), 0, "", note)
                yield Row(case, "energies over s^3 apart", max(energies), 1e-12)
                yield Row(case, "shapes over s apart", max(apart), 1e-12)


def other_rows() -> Iterator[Row]:
    here = others(cap(1.0), 200)
    yield Row(
        "cap, other shapes", "none found", float(not here.found), 0, "", f"{len(here.found)} of {here.tried} starts"
    )
    apart = []
    for k in POWERS:
        there = others(cap(2.0**k), 200)
        same = len(there.found) == len(here.found) and there.factorizations == here.factorizations
        pairs = zip(here.found, there.found, strict=False)
        apart.append(max(float(np.abs(b.positions / 2.0**k - a.positions).max()) for a, b in pairs) if same else np.inf)
    yield Row("cap, other shapes", "apart at 2^-20 to 2^10", max(apart), 1e-12)


def placed_rows() -> Iterator[Row]:
    """The target mirrored or turned; rods come in another order, so that nodes are compared with the nearest."""
    for kind in (TUBE, LATH):
        for joint in JOINTS:
            here = form(kind, joint, HERE)
            for placed in (
                Placed(mirrored=True),
                Placed(turned=0.6),
                Placed(turned=pi / 2),
                Placed(2.0**-7, 2.5, True),
            ):
                there = form(kind, joint, placed)
                mirror = ", mirrored" if placed.mirrored else ""
                case = f"turned by {placed.turned:.2f}{mirror}, {kind}, {joint}"
                apart = [
                    float(cKDTree(there.popped[ends].positions).query(placed(shell.positions))[0].max()) / placed.size
                    for ends, shell in here.popped.items()
                ]
                yield Row(case, "shapes apart", max(apart), 1e-9)


def boundary_rows() -> Iterator[Row]:
    """The boundary alone turned and moved, from its draped state."""
    for kind in (TUBE, LATH):
        for joint in JOINTS:
            here = form(kind, joint, HERE)
            for turned, moved, bound in ((1.0, 0.0, 1e-9), (pi, 0.0, 1e-9), (0.0, 3000.0, 1e-8), (pi, 3000.0, 1e-8)):
                case, apart, counts = f"boundary by {turned:.2f} and {moved:g} m, {kind}, {joint}", [], []
                for ends, shell in here.popped.items():
                    boundary = boundary_placed(shell.boundary, turned, moved)
                    there = rs.pop_up(shell.footprint, boundary, here.rod, ends=ends, joint=HERE.joint(joint))
                    expected = Placed(turned=turned)(shell.positions) + (moved, 0.0, 0.0)
                    apart.append(float(np.abs(there.positions - expected).max()))
                    counts.append(abs(there.report.factorizations - shell.report.factorizations))
                yield Row(case, "shapes apart", max(apart), bound)
                yield Row(case, "factorisations apart", max(counts), 0)


def bifurcation_rows() -> Iterator[Row]:
    for opened in OPENED:
        problem, flat = fans(1.0, radians(opened))
        found = find_stable(problem, flat, np.zeros(len(problem.stretch.blocks)), limit_steps=True)
        case = f"flat linkage opened by {opened} degrees"
        yield Row(case, "factorisations past its bifurcation", found.report.factorizations, 40)
        yield Row(case, "not a minimum", found.tangent.negative_modes, 0)


def rows() -> Iterator[Row]:
    yield from size_rows()
    yield from other_rows()
    yield from placed_rows()
    yield from boundary_rows()
    yield from bifurcation_rows()
