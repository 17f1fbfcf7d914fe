"""The structure for finite-element programs: what it holds, what it refuses; OpenSees finds the shape from it."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.rods.joints import Joint
from tests.acceptance import hosts
from tests.loads.shells import ROPE, SNOW, TUBE, grid, one, shell


def structure(archive: rs.Archive, folder: Path, state: str = "popped_pinned") -> dict:  # type: ignore[type-arg]
    assert "opensees/replay.py" in rs.export(archive, folder, "opensees")
    return json.loads((folder / "opensees" / f"{state}.json").read_text())  # type: ignore[no-any-return]


def braced() -> rs.Archive:
    """Tubes braced by cables, under snow."""
    form, loads = shell("tubes"), one(rs.Snow(0.1 * SNOW), bracing=rs.Cables(rod=ROPE), stability=rs.Stability(modes=1))
    case = replace(form.case, bracing=rs.Cables(rod=ROPE))
    return replace(form, case=case).knowing(loaded=rs.check_loads(form, loads)).archive()


def test_it_begins_flat_and_ends_popped_up(tmp_path: Path) -> None:
    found, archive = structure(shell("tubes").archive(), tmp_path), shell("tubes").archive()
    stages, nodes = np.array(found["stages"]), archive.states["rod_nodes"]
    assert np.ptp(stages[0, :, 2]) == 0
    np.testing.assert_allclose(stages[-1], archive.states["popped_pinned"][nodes], atol=1e-8)  # written to 1e-9 m
    for rod, record in zip(found["rods"], archive.results.rods, strict=True):  # edges at rest: the rod's length
        length = np.linalg.norm(np.diff(stages[0, rod["nodes"]], axis=0), axis=1).sum()
        assert length == pytest.approx(record.length, rel=1e-6)


def test_masses_are_those_of_rods_and_joints(tmp_path: Path) -> None:
    joint = rs.Pin(mass=1.16)
    form = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends="pinned", joint=joint)
    found = structure(form.archive(), tmp_path)
    rods = TUBE.mass_per_length * sum(rod.length or 0.0 for rod in form.footprint.rods)
    assert sum(found["mass"]) == pytest.approx(rods + 1.16 * len(found["joints"]), rel=1e-9)


def test_joints_tie_nodes_of_two_rods_at_one_place(tmp_path: Path) -> None:
    found = structure(shell("laths").archive(), tmp_path)
    for stage in np.array(found["stages"]):
        a, b = np.array([joint["nodes"] for joint in found["joints"]]).T
        np.testing.assert_allclose(stage[a], stage[b], atol=1e-12)
    assert {joint["kind"] for joint in found["joints"]} == {"pin"}


def test_loads_and_cables_are_those_of_the_check(tmp_path: Path) -> None:
    archive = braced()
    found, loaded = structure(archive, tmp_path), archive.results.loads["all"]["pinned"]
    np.testing.assert_allclose(np.sum([row[1:] for row in found["loads"]["all"]], axis=0) * loaded.at_factor,
                               loaded.load_sum, atol=1e-6)  # fmt: skip
    assert len(found["cables"]) == len(archive.results.bracing)
    ends = np.array([cable["nodes"] for cable in found["cables"]])
    lengths = np.linalg.norm(np.subtract(*np.array(found["stages"])[-1][ends.T]), axis=1)
    np.testing.assert_allclose([cable["length"] for cable in found["cables"]], lengths, rtol=1e-6)  # no prestrain
    assert {cable["EA"] for cable in found["cables"]} == {ROPE.stretch_stiffness}


def test_clamped_ends_have_their_tangents(tmp_path: Path) -> None:
    form = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends="clamped")
    found = structure(form.archive(), tmp_path, "popped_clamped")
    np.testing.assert_allclose([each["tangent"] for each in found["supports"]], form.boundary.tangents)


@pytest.mark.parametrize(
    ("joint", "words"),
    [(rs.Spring(shear=1.0, out_of_plane=1.0, twist=1.0), "kind spring"), (rs.Linker(), "kind linker")],
)
def test_what_the_format_does_not_hold_is_refused_in_a_sentence(joint: Joint, words: str, tmp_path: Path) -> None:
    form = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends="pinned", joint=joint)
    with pytest.raises(rs.InputError, match=rf"no OpenSees model is written: .*{words}"):
        rs.export(form.archive(), tmp_path, "opensees")


@pytest.mark.slow
def test_opensees_finds_the_shell_from_the_flat_grid() -> None:
    """With coarse edges, whose second-order errors are 16 times those of the acceptance table."""
    python = hosts.python_with_opensees()
    if python is None:
        pytest.skip("openseespy cannot be imported")
    form = shell("laths")
    found = hosts.replayed(form, python)
    archive = form.archive()
    apart = np.array(found["positions"]) - archive.states["popped_pinned"][archive.states["rod_nodes"]]
    assert np.linalg.norm(apart, axis=1).max() < 2e-3 * form.target.size
    ours = archive.states["stress_pinned"].max()
    assert hosts.stress(form, np.array(found["forces"])).max() == pytest.approx(ours, rel=0.05)
