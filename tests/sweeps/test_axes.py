"""The axes of a sweep: what is combined with what, units, samples; and what is refused before anything runs."""

from itertools import product
from math import radians
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.sweeps.plan import SweepPlan, read_plan


def plan_of(axes: dict[str, object], **more: object) -> SweepPlan:
    return read_plan({"base": "hemisphere", "axes": axes, **more})


def values_of(plan: SweepPlan) -> list[tuple[object, ...]]:
    return [values for values, _ in plan.designs()]


def test_axes_are_combined_and_the_first_changes_slowest():
    plan = plan_of({"layout.spacing": ["25 mm", 0.03], "joint.kind": ["ball", "pin", "rigid"]})
    assert values_of(plan) == list(product((0.025, 0.03), ("ball", "pin", "rigid")))
    assert plan.keys == ("layout.spacing", "joint.kind")


def test_a_range_has_both_ends_and_equal_steps_or_equal_ratios():
    turns = [turn for (turn,) in values_of(plan_of({"layout.rotate": {"from": "0 deg", "to": "45 deg", "count": 4}}))]
    np.testing.assert_allclose(turns, np.radians([0, 15, 30, 45]), rtol=1e-14)
    assert turns[-1] == radians(45)
    spec = {"from": "1 MPa", "to": "1 GPa", "count": 4, "scale": "log"}
    moduli = [value for (value,) in values_of(plan_of({"rod.material.youngs_modulus": spec}))]
    np.testing.assert_allclose(moduli, [1e6, 1e7, 1e8, 1e9], rtol=1e-13)


def test_a_range_of_whole_numbers_has_whole_numbers():
    values = values_of(plan_of({"checks.stages": {"from": 1, "to": 5, "count": 5}}))
    assert values == [(1,), (2,), (3,), (4,), (5,)]
    assert all(type(value) is int for (value,) in values)


def test_a_range_of_pairs_goes_from_pair_to_pair():
    spec = {"from": "20 mm, 40 mm", "to": "30 mm, 20 mm", "count": 3}
    found = [value for (value,) in values_of(plan_of({"layout.spacing": spec}))]
    np.testing.assert_allclose(found, [(0.02, 0.04), (0.025, 0.03), (0.03, 0.02)], rtol=1e-14)


def test_zipped_keys_change_together():
    plan = plan_of({"layout.spacing, layout.rods": [["25 mm", "17x17"], ["30 mm", "15x13"]], "joint.kind": ["ball"]})
    assert values_of(plan) == [(0.025, (17, 17), "ball"), (0.03, (15, 13), "ball")]
    assert [job.case.layout.rods for _, job in plan.designs()] == [(17, 17), (15, 13)]


def test_the_same_quantity_in_any_unit_is_the_same_design():
    metres, millimetres = (plan_of({"layout.spacing": [value]}) for value in (0.025, "25 mm"))
    assert list(metres.designs()) == list(millimetres.designs())


def test_each_base_and_each_target_is_combined_with_all_values():
    plan = read_plan({"base": ["hemisphere", "ellipsoid"], "axes": {"layout.spacing": ["30 mm", "35 mm"]}})
    assert values_of(plan) == list(product(("hemisphere", "ellipsoid"), (0.03, 0.035)))
    assert [job.case.target.kind for _, job in plan.designs()] == ["hemisphere"] * 2 + ["ellipsoid"] * 2
    targets = [{"kind": "cap", "radius": "0.3 m", "base": "0.1 m"}, {"kind": "hemisphere", "radius": "0.25 m"}]
    kinds = [job.case.target.kind for _, job in plan_of({"target": targets}).designs()]
    assert kinds == ["cap", "hemisphere"]


@pytest.mark.parametrize("seed", [0, 5])
def test_a_latin_hypercube_has_one_design_in_each_nth_of_each_axis(seed: int):
    axes = {"layout.spacing": {"from": 0.02, "to": 0.04}, "layout.rotate": {"from": "0 deg", "to": "90 deg"}}
    count = 40
    found = np.array(values_of(plan_of(axes, sample={"count": count, "seed": seed})), dtype=float)
    for column, low, high in zip(found.T, (0.02, 0.0), (0.04, np.pi / 2), strict=True):
        strata = np.floor((column - low) / (high - low) * count)
        assert sorted(strata) == list(range(count))


def test_sobol_points_fill_each_half_equally_and_need_a_power_of_two():
    axes = {"layout.spacing": {"from": 0.02, "to": 0.04}, "layout.rotate": {"from": 0.0, "to": 1.0}}
    found = np.array(values_of(plan_of(axes, sample={"method": "sobol", "count": 64})), dtype=float)
    quarters = np.histogram2d(found[:, 0], found[:, 1], bins=2, range=[[0.02, 0.04], [0, 1]])[0]
    assert quarters.tolist() == [[16, 16], [16, 16]]
    with pytest.raises(rs.InputError, match="powers of two: give 64 or 128"):
        plan_of(axes, sample={"method": "sobol", "count": 100})


def test_a_sample_is_combined_with_other_axes_and_depends_on_its_seed_alone():
    axes = {"layout.spacing": {"from": 0.02, "to": 0.04}, "joint.kind": ["ball", "pin"]}
    first, again, other = (values_of(plan_of(axes, sample={"count": 3, "seed": seed})) for seed in (1, 1, 2))
    assert first == again != other
    assert [kind for _, kind in first] == ["ball", "pin"] * 3


def test_sampled_whole_numbers_are_equally_frequent_with_both_ends():
    found = values_of(plan_of({"checks.stages": {"from": 1, "to": 4}}, sample={"count": 40}))
    assert sorted(value for (value,) in found) == [1] * 10 + [2] * 10 + [3] * 10 + [4] * 10


def test_files_lie_beside_the_sweep_file(tmp_path: Path):
    for name in ("a.obj", "b.obj"):
        (tmp_path / name).write_text("v 0 0 0\n")
    (tmp_path / "base.toml").write_text('[target]\nkind = "mesh"\nfile = "a.obj"\n')
    (tmp_path / "sweep.toml").write_text('base = "base.toml"\n[axes]\n"target.file" = ["a.obj", "b.obj"]\n')
    designs = list(read_plan(tmp_path / "sweep.toml").designs())
    assert [job.case.files for _, job in designs] == [{str(tmp_path / name)} for name in ("a.obj", "b.obj")]


EXAMPLES = Path(__file__).parents[2] / "examples"


@pytest.mark.parametrize(("name", "count"), [("sweep", 6), ("studies", 14)])
def test_examples_are_valid(name: str, count: int):
    assert len(list(read_plan(EXAMPLES / f"{name}.toml").designs())) == count


TOO_MANY = {f"layout.{key}": {"from": 0.01, "to": 0.02, "count": 2000} for key in ("edge", "length")}


@pytest.mark.parametrize(
    ("given", "sentence"),
    [
        ({"axes": {"layout.spacin": ["25 mm"]}}, "unknown key layout.spacin: did you mean layout.spacing?"),
        ({"axes": {"layout.spacing": ["25 mm", "-3 mm"]}}, r'layout.spacing = -0.003: .*larger than zero|"-3 mm"'),
        ({"axes": {"layout.spacing": "25 mm"}}, "give a list of values"),
        ({"axes": {"layout.spacing": []}}, "give a list of values"),
        ({"axes": {"layout.spacing": {"from": "2 mm"}}}, "to is missing"),
        ({"axes": {"layout.spacing": {"from": "2 mm", "to": "3 mm"}}}, "give its count, or say in"),
        ({"axes": {"layout.spacing": {"from": "2 mm", "to": "2 mm", "count": 2}}}, "are the same value"),
        ({"axes": {"layout.spacing": {"from": "2 mm", "to": "3 mm", "cout": 2}}}, "unknown key cout"),
        ({"axes": {"layout.spacing": {"from": "2 mm", "to": "3 mm", "count": 1}}}, "whole number of at least 2"),
        ({"axes": {"layout.rotate": {"from": "0 deg", "to": "360 deg", "count": 5}}}, "stay below 360 deg"),
        ({"axes": {"layout.rotate": {"from": 0, "to": 1, "count": 5, "scale": "log"}}}, "above zero"),
        ({"axes": {"joint.kind": {"from": "ball", "to": "pin", "count": 2}}}, "is not a number"),
        ({"axes": {"a, b": [[1, 2, 3]]}}, "must be a list of 2 values"),
        ({"axes": {"joint.kind": ["ball"], "joint.kind, layout.rods": [["pin", "5x5"]]}}, "occurs twice"),
        ({"axes": TOO_MANY}, "more than 1000000"),
        ({"axes": {}}, r"\[axes\] is missing"),
        ({"axes": {"joint.kind": ["ball"]}, "sample": {"count": 3}}, "no axis is sampled"),
        ({"axes": {"joint.kind": ["ball", "glue"]}}, 'must be "ball"'),
        ({"base": "hemisfere", "axes": {"joint.kind": ["ball"]}}, "no case and no file"),
        ({"base": [], "axes": {"joint.kind": ["ball"]}}, "at least one case"),
        ({"axes": {"joint.kind": ["ball"]}, "rum": {}}, "unknown key rum: did you mean run?"),
        ({"axes": {"joint.kind": ["ball"]}, "run": {"worker": 2}}, "unknown key run.worker: did you mean workers?"),
        ({"axes": {"joint.kind": ["ball"]}, "run": {"workers": 0}}, "from 1 to 1024"),
        ({"axes": {"joint.kind": ["ball"]}, "run": {"engine": "ray"}}, 'must be "processes" or "dask"'),
        ({"axes": {"joint.kind": ["ball"]}, "run": {"address": "tcp://x"}}, "type --address ADDRESS"),
        ({"axes": {"joint.kind": ["ball"]}, "run": {"time_limit": "2 m"}}, "unit of"),
        ({"axes": {"joint.kind": ["ball"]}, "run": {"memory_limit": "-2 GB"}}, "larger than zero"),
        ({"axes": {"joint.kind": ["ball"]}, "columns": ["net.min_angle"]}, "did you mean net.min_angle_at?"),
        ({"axes": {"joint.kind": ["ball"]}, "columns": ["net"]}, "net is a table"),
        ({"axes": {"joint.kind": ["ball"]}, "columns": ["rods.length"]}, "use rods"),
        ({"axes": {"joint.kind": ["ball"]}, "columns": ["status"]}, "is a column already"),
        ({"axes": {"joint.kind": ["ball"]}, "columns": "status"}, "give a list of keys"),
    ],
)
def test_what_cannot_be_computed_is_refused_in_a_sentence(given: dict[str, object], sentence: str):
    with pytest.raises(rs.InputError, match=sentence) as refusal:
        list(read_plan({"base": "hemisphere", **given}).designs())
    assert "\n" not in str(refusal.value)
