"""Schedules tell of each rod, joint, support and bar what the mechanics found."""

import csv
import io
from pathlib import Path

import numpy as np
import pytest

from rodshell.checks.reactions import JointLoads
from rodshell.output.files import export
from rodshell.output.grid import joints_of, rods_of
from rodshell.results.wording import rounding_of
from tests.output.forms import ROD, archive, form, wished

STEP = 0.1  # mm, to which a tolerance of 0.5 mm has lengths shown


@pytest.fixture(scope="module")
def tables(tmp_path_factory: pytest.TempPathFactory) -> dict[str, list[dict[str, str]]]:
    folder = tmp_path_factory.mktemp("schedules")
    names = export(wished(), folder, ["csv"])
    return {Path(name).stem: list(csv.DictReader(io.StringIO((folder / name).read_text()))) for name in names}


def test_each_rod_weighs_what_is_cut(tables: dict[str, list[dict[str, str]]]) -> None:
    for row in tables["rods"]:
        length = float(row["length_mm"])
        assert float(row["cut_length_mm"]) == pytest.approx(length + 24.0, abs=1.01 * STEP)
        assert float(row["mass_kg"]) == pytest.approx(1e-3 * (length + 24.0) * ROD.mass_per_length, rel=1e-3)
    assert len({row["mass_kg"] for row in tables["rods"]}) > 2


def test_lengths_are_shown_by_the_rule() -> None:
    assert rounding_of(wished().results).step == STEP


def test_the_sharpest_bend_is_that_of_the_rod_s_own_nodes(tables: dict[str, list[dict[str, str]]]) -> None:
    """Against circles through three neighbouring nodes, away from the clamps."""
    made = wished()
    for rod, row in zip(rods_of(made), tables["rods"], strict=True):
        a, b, c = (made.states["popped_clamped"][rod.nodes[k : len(rod.nodes) - 2 + k]] for k in range(3))
        area = np.linalg.norm(np.cross(b - a, c - a), axis=1)
        sides = [np.linalg.norm(p - q, axis=1) for p, q in ((a, b), (b, c), (a, c))]
        radius = np.min(np.prod(sides, axis=0) / (2 * area))
        assert float(row["min_radius_mm"]) <= 1e3 * radius * 1.01
        strain = float(row["max_strain"])
        assert strain >= 1.0 / float(row["min_radius_mm"]) * 0.999  # a rod of 1 mm radius, and some axial strain
        assert float(row["max_stress_MPa"]) == pytest.approx(strain, rel=1e-2)  # E = 1 MPa
        assert float(row["max_stress_pop_up_MPa"]) >= float(row["max_stress_MPa"])
        assert float(row["utilisation_pop_up"]) == pytest.approx(float(row["max_stress_pop_up_MPa"]) / 0.02, abs=1e-3)


def test_the_rod_of_the_higher_layer_lies_over_the_other(tables: dict[str, list[dict[str, str]]]) -> None:
    layer = {row["id"]: int(row["layer"]) for row in tables["rods"]}
    for row in tables["joints"]:
        low, high = sorted((row["rod_a"], row["rod_b"]), key=layer.__getitem__)
        assert layer[low] < layer[high]
        assert row["over"] == high


def test_joints_scissor_by_what_their_angles_differ(tables: dict[str, list[dict[str, str]]]) -> None:
    """To the digits of the table; in the result by another estimate of the same tangents."""
    loads = {"/".join(one["rods"]): one["scissor_deg"] for one in wished().results.plain()["joint_loads"]["clamped"]}
    for row in tables["joints"]:
        grown = float(row["final_deg"]) - float(row["flat_deg"])
        assert float(row["scissor_deg"]) == pytest.approx(grown, abs=0.0101)
        assert loads[row["id"]] == pytest.approx(grown, abs=0.5)
    assert max(abs(float(row["scissor_deg"])) for row in tables["joints"]) > 5.0


def test_a_joint_scissors_alike_whichever_rod_is_the_first() -> None:
    none = np.zeros((2, 3))
    flat, now = np.radians([90.0, -90.0]), np.radians([80.0, -80.0])
    loads = JointLoads(none, np.zeros((2, 2, 3)), none, flat, now)
    np.testing.assert_allclose(np.degrees(loads.scissor), -10.0)


def test_supports_stand_on_the_boundary_and_balance(tables: dict[str, list[dict[str, str]]]) -> None:
    rows, boundary = tables["supports"], form("dome").trimmed.boundary
    places = np.array([[float(row[f"{axis}_mm"]) for axis in "xyz"] for row in rows])
    np.testing.assert_allclose(places, 1e3 * boundary.points, atol=0.501 * STEP)
    tangents = np.array([[float(row[f"tangent_{axis}"]) for axis in "xyz"] for row in rows])
    np.testing.assert_allclose(tangents, boundary.tangents, atol=1e-5)
    for ends in ("pinned", "clamped"):
        forces = np.array([[float(row[f"force_{axis}_N_{ends}"]) for axis in "xyz"] for row in rows])
        moments = np.array([[float(row[f"moment_{axis}_Nm_{ends}"]) for axis in "xyz"] for row in rows])
        largest = np.linalg.norm(forces, axis=1).max()
        assert np.linalg.norm(forces.sum(axis=0)) < 1e-4 * largest  # six digits in the table
        turning = np.cross(1e-3 * places, forces) + moments
        assert np.linalg.norm(turning.sum(axis=0)) < 1e-3 * np.linalg.norm(turning, axis=1).max()


def test_bracing_is_the_distance_of_its_joints(tables: dict[str, list[dict[str, str]]]) -> None:
    made = wished()
    rods = rods_of(made)
    node = {}
    for joint in joints_of(rods):
        (node[joint.id],) = np.intersect1d(*(rods[k].nodes for k in joint.rods))
    assert len(tables["bracing"]) > len(node)
    for row in tables["bracing"]:
        a, b = node[row["from"]], node[row["to"]]
        for column, state in (("flat_mm", "flat"), ("final_mm", "popped_clamped")):
            apart = 1e3 * np.linalg.norm(made.states[state][a] - made.states[state][b])
            assert float(row[column]) == pytest.approx(apart, abs=0.501 * STEP)


def test_stock_holds_every_piece_of_every_rod(tables: dict[str, list[dict[str, str]]]) -> None:
    """Row by row as many bars are cut as are numbered, each by the pieces in their order, and marked."""
    total: dict[str, float] = {}
    last = 0
    for row in tables["stock"]:
        lengths, marks = [*map(float, row["pieces_mm"].split("; "))], row["marks"].split("; ")
        numbers = [*map(int, row["bars"].split(" to "))]
        assert numbers[0] == last + 1
        last = numbers[-1]
        assert last - numbers[0] + 1 == int(row["times"]) == len(marks)
        for bar in marks:
            for mark, length in zip(bar.split(" + "), lengths, strict=True):
                total[mark.split(".")[0]] = total.get(mark.split(".")[0], 0.0) + length
        assert (row["stock_mm"], row["saw_cut_mm"]) == ("400.0", "3.0")
        used = sum(lengths) + 3.0 * len(lengths)
        assert float(row["offcut_mm"]) == pytest.approx(max(400.0 - used, 0.0), abs=3 * STEP)
    assert last == len(wished().results.plain()["fabrication"]["stock"]["bars"])
    assert total == pytest.approx({row["id"]: float(row["cut_length_mm"]) for row in tables["rods"]}, abs=3 * STEP)


def test_splices_pass_on_the_moment_and_the_force_of_the_rod_there(tables: dict[str, list[dict[str, str]]]) -> None:
    """By the states of the final shape: EI times the curvature of the nodes on both sides, and the force in them."""
    made = wished()
    rods = {rod.id: (rod, start) for rod, start in zip(made.results.rods, made.states["rod_start"], strict=True)}
    assert len(tables["splices"]) == sum(len(rod.splices) for rod, _ in rods.values()) > 0
    for row in tables["splices"]:
        name, _, number = row["after_piece"].partition(".")
        rod, start = rods[name]
        at = rod.splices[int(number) - 1]
        assert float(row["from_cut_end_mm"]) == pytest.approx(1e3 * at + 12.0, abs=0.501 * STEP)
        nodes = made.states["rod_nodes"][start:]
        at_nodes = np.cumsum(np.linalg.norm(np.diff(made.states["flat"][nodes], axis=0), axis=1))
        near = start + int(np.searchsorted(at_nodes, at))  # the last node before the splice
        for column, state, share in (
            ("moment_Nm", "curvature_clamped", made.results.rod.EI), ("axial_force_N", "force_clamped", 1.0)
        ):  # fmt: skip
            low, high = np.sort(share * made.states[state][near : near + 2])
            assert low - 1e-5 * abs(low) <= float(row[column]) <= high + 1e-5 * abs(high)
        before, after = (joint.split("/") for joint in row["between_joints"].split(" and "))
        places = {joint.other: joint.at for joint in rod.joints}
        assert before[0] == after[0] == name
        assert places[before[1]] < at < places[after[1]]
        assert row["type"] == "to be given"


def test_end_paths_go_from_flat_to_the_supports(tables: dict[str, list[dict[str, str]]]) -> None:
    made = wished()
    rows = tables["end_paths"]
    last = [row for row in rows if row["share"] == "1.000000"]
    first = [row for row in rows if row["share"] == "0.000000"]
    assert len(first) == len(last) == 2 * len(made.results.plain()["rods"])
    assert len(rows) == len(last) * len(made.states["history_share"])
    for row, start, place in zip(last, first, made.results.plain()["boundary"], strict=True):
        at, moved, flat = (
            [float(one[f"{w}{axis}_mm"]) for axis in "xyz"] for one, w in ((row, ""), (row, "u"), (start, ""))
        )
        np.testing.assert_allclose(at, 1e3 * np.array(place), atol=2e-3)
        np.testing.assert_allclose(np.array(flat) + moved, at, atol=2e-3)
        assert (row["rod"], row["end"]) == (start["rod"], start["end"])


def test_without_wishes_there_is_no_stock_and_no_utilisation(tmp_path: Path) -> None:
    names = export(archive("ridge"), tmp_path, ["csv"])
    assert "schedule/stock.csv" not in names
    rows = list(csv.DictReader(io.StringIO((tmp_path / "schedule/rods.csv").read_text())))
    assert all(row["utilisation_pop_up"] == row["splices_from_cut_end_mm"] == "" for row in rows)
    assert all(row["cut_length_mm"] == row["length_mm"] for row in rows)
