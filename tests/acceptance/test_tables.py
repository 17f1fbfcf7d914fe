"""Cheap rows of every acceptance table, so that none is missed unseen between the runs of `make accept-...`."""

import re
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

import pytest

from tests.acceptance import (
    drawn,
    drawn_meshes,
    drawn_reserve,
    drawn_scale,
    house,
    joints,
    lattices,
    loads_shells,
    loads_stability,
    paper,
    refine_derivatives,
    signed,
    signed_shells,
    verdict_drawings,
    verdict_layers,
    verdict_levels,
    verdict_paths,
    verdict_rods,
    verdict_stress,
    verdict_targets,
)
from tests.acceptance.rows import Row
from tests.acceptance.test_acceptance import check_reached
from tests.refining.test_families import EVERY

pytestmark = pytest.mark.slow

Rows = Callable[[], Iterator[Row]]
CHEAP: dict[str, tuple[Rows, ...]] = {
    "drawn": (
        partial(drawn.end_rows, 8), partial(drawn.crease_rows, ["valley"]), drawn_scale.bifurcation_rows,
        partial(drawn_meshes.mesh_rows, ("slivers",), (1_000, 10_000)), partial(drawn_meshes.cost_rows, 1),
        partial(drawn_reserve.rows, (21, 26), least=2),
    ),
    "house": (house.tree_rows,),
    "joints": (joints.structure_rows, joints.lattice_rows, joints.symmetry_rows),
    "lattices": (
        lattices.geodesic_rows, lattices.straight_rows, lattices.shell_rows, lattices.family_rows, lattices.curve_rows,
        lattices.flat_rows, lattices.twin_rows,
        partial(lattices.gallery_rows, ("saddle",)),
    ),
    "loads": (
        loads_stability.benchmark_rows, loads_stability.closed_form_rows, loads_stability.vibration_rows,
        loads_shells.work_rows, loads_shells.cable_rows,
    ),
    "paper": (paper.tail_rows, paper.pop_up_rows),
    "refine": tuple(partial(refine_derivatives.adjoint_rows, *case, laths=False) for case in EVERY[:2]),
    "signed": (
        signed.section_rows, signed.preset_rows, signed_shells.support_rows, signed_shells.creep_rows,
        partial(signed_shells.chance_rows, 3),
    ),
    "verdict": (
        verdict_drawings.hostile_rows, verdict_layers.lath_rows, verdict_layers.thick_rows,
        partial(verdict_levels.rows, ("strength exceeded", "the paper's hemisphere")), verdict_paths.work_rows,
        verdict_rods.preset_rows, verdict_stress.curvature_rows, verdict_stress.design_rows,
        verdict_stress.strength_rows, verdict_targets.stair_rows,
    ),
}  # fmt: skip
ELSEWHERE = {
    "accept": "test_acceptance.py",
    "output": "test_output_rows.py",
    "rods": "test_rods.py",
    "rods_dynamics": "test_rods.py",
    "studio": "test_studio_rows.py",
    "sweep": "test_sweep_rows.py",
    "targets": "test_any_target.py",
}
HOURS = {
    "advised": "tests/cli/test_advise.py",
    "designed": "tests/test_design.py",
    "hosts": "tests/output/test_opensees.py",
}
"""Tables without a cheap row, the last as it needs OpenSees, and what tests the same in small."""


@pytest.mark.parametrize(("table", "number"), [(table, n) for table, rows in CHEAP.items() for n in range(len(rows))])
def test_cheap_rows_of_every_table_reach_their_figures(table: str, number: int) -> None:
    check_reached(CHEAP[table][number]())


def test_every_table_that_make_prints_has_rows_that_are_tests() -> None:
    here = Path(__file__)
    tables = set(re.findall(r"-m tests\.acceptance\.(\w+)", here.parents[2].joinpath("Makefile").read_text()))
    assert tables - {"house_figures", *HOURS} == {*CHEAP, *ELSEWHERE}
    assert all(here.parents[2].joinpath(name).exists() for name in HOURS.values())
    for table, name in ELSEWHERE.items():
        assert f"tests.acceptance.{table.removesuffix('accept')}" in here.with_name(name).read_text()
