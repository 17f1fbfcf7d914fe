"""What refinement reaches: gaps, factorisations, eigenvalues, curvature and compression of refined shells.

The shells are those of the README's targets with 30 mm spacing and 15 mm edges, unless a row says otherwise.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import rodshell as rs
from rodshell.formfinding import Stages
from rodshell.formfinding.popup import Ends
from rodshell.refining.refine import Refinement, refine
from rodshell.refining.stiffness_families import Taper
from rodshell.refining.variables import Family
from rodshell.rods.isotropic import IsotropicBend
from tests.acceptance.cases import FURTHER, ROD
from tests.acceptance.rows import Row

DATA = Path(__file__).parents[2] / "examples" / "data"


@dataclass(frozen=True)
class Case:
    """A shell, what of it varies, and what must be reached: the rms gap [%] and the number of factorisations."""

    name: str
    shell: str
    vary: tuple[str | Family, ...]
    gap: float
    most: int
    ends: Ends = "pinned"
    edge: float = 0.015
    settings: tuple[tuple[str, Any], ...] = ()


ROD_BY_ROD = Taper(ratio=4.0, per="rod")
CASES = [
    Case("a taper for all, ratio 8", "hemisphere", ("taper",), 0.11, 25),
    Case("a taper for all, ratio 8", "ellipsoid", ("taper",), 0.25, 25),
    Case("a taper for all, ratio 8", "126 rods", ("taper",), 0.095, 25),
    Case("a taper a rod, ratio 4", "hemisphere", (ROD_BY_ROD,), 0.15, 60),
    Case("a taper a rod, ratio 4", "paraboloid", (ROD_BY_ROD,), 0.03, 60),
    Case("a taper a rod, ratio 4", "freeform.obj", (ROD_BY_ROD,), 0.016, 60),
    Case("double laths, one variable, 10 mm", "hemisphere", ("double",), 0.21, 25, edge=0.01),
    Case("clamps and a taper a rod, ratio 8", "two bumps", ("clamps", Taper(per="rod", stations=3)), 0.06, 100,
         "clamped", settings=(("least_eigenvalue", 0.2), ("most_evaluations", 60))),
    Case("tails", "hemisphere", ("tails",), 0.45, 60),
    Case("tails", "paraboloid", ("tails",), 0.20, 60),
]  # fmt: skip


def stages_of(shell: str, ends: Ends, edge: float) -> Stages:
    """A shell before refinement."""
    if shell == "126 rods":
        layout = rs.GridLayout.orthogonal(spacing=0.01, edge=0.0034)
        form = rs.find_form(rs.Hemisphere(0.2), layout, ROD, ends=ends)
    elif shell == "two bumps":
        (case,) = [case for case in FURTHER if case.name == shell]
        form = rs.find_form(case.target, case.grid(edge=edge), ROD, ends=ends)
    elif shell == "freeform.obj":
        changes = {"target.unit": "mm", "layout.spacing": 0.9, "layout.edge": 0.45}
        form = rs.Job.load(DATA / shell, changes).run(until="pop-up")
    else:
        form = rs.Job.load(shell, {"layout.edge": edge, "pop_up.ends": ends}).run(until="pop-up")
    return form.stages


def largest_curvature(popped: rs.PopUp) -> float:
    """[1/m], of round rods."""
    (bends,) = [element for element in popped.equilibrium.elements if isinstance(element, IsotropicBend)]
    mesh = popped.shell.mesh
    return float(np.max(bends.strains(popped.state)[: len(mesh.bends), 0] / mesh.voronoi_lengths))


def lowest_eigenvalue(popped: rs.PopUp) -> float:
    """Of the tangent stiffness itself [N/m]."""
    return float(popped.equilibrium.tangent.lowest_modes(1).values[0])


def rows() -> Iterator[Row]:
    for case in CASES:
        stages = stages_of(case.shell, case.ends, case.edge)
        yield from rows_of(case, refine(stages, case.vary, ends=case.ends, **dict(case.settings)))


def rows_of(case: Case, found: Refinement) -> Iterator[Row]:
    name = f"{case.shell}, {case.ends}: {case.name}"
    after = found.designs[-1]
    gap = 100 * found.gap_after.rms_relative
    note = f"before {100 * found.gap_before.rms_relative:.3f} %, {len(after.values)} variables"
    yield Row(name, "gap rms over the size", gap, case.gap, "%", note)
    yield Row(name, "factorisations", found.factorizations, case.most, note=f"{len(found.steps)} evaluations")
    first, last = (stages.popped[found.ends] for stages in (found.before, found.after))
    lowest = lowest_eigenvalue(last) / lowest_eigenvalue(first)
    compression = f"N up to {after.euler_share.max():.2f} of Euler's load"
    yield Row(name, "not stable", float(not last.report.stable), 0, note=compression)
    if case.vary == ("taper",):
        yield Row(name, "lowest eigenvalue before, over after", 1 / lowest, 1.0)
        yield Row(name, "largest curvature over before", largest_curvature(last) / largest_curvature(first), 1.15)
    elif case.ends == "clamped":
        yield Row(name, "lowest eigenvalue before, over after", 1 / lowest, 5.0)
    elif case.vary == ("tails",):
        yield Row(name, "largest compression over Euler's load", float(after.euler_share.max()), 0.5)
