"""The paper's drape in time against gravity statics, which shares only the energies with it."""

import os
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest

import rodshell as rs
from rodshell.case import load_case
from rodshell.cli import main
from rodshell.errors import InputError, OutputError, StabilityError
from rodshell.formfinding import fall_drape
from rodshell.formfinding.methods import Draped, Fall
from rodshell.formfinding.rest import energy_decay, rest_advice
from rodshell.joints import ExplicitPenalty, ImplicitPenalty, Linker, SharedDofs
from rodshell.results.manifest import read_manifest
from rodshell.solve.equilibrium import Status
from rodshell.solve.simulate import TimeSeries
from rodshell.targets import Ellipsoid
from tests.formfinding.falls import HEMISPHERE, PAPER_ROD, RADIUS, coarse_layout
from tests.nets.sphere_net import sphere_net_end

TENTH = 0.1e-3  # [m]
DRAG = 5.0  # 1/s: the hanging tails, pendulums of 0.3 m, stop swinging within two seconds
FALLS = {
    "shared": Fall(coupling=SharedDofs(), drag=DRAG),
    "along the normal": Fall(coupling=SharedDofs(), drag=DRAG, stopped="normal"),
    "implicit": Fall(coupling=ImplicitPenalty(), drag=DRAG),
}


@cache
def fallen(name: str) -> Draped:
    return rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=FALLS[name])


@cache
def at_rest_by_statics() -> Draped:
    return rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=rs.Gravity())


def apart(one: Draped, other: Draped) -> float:
    """Largest distance of nodes on the target [m]: tails that hang may still swing."""
    on = HEMISPHERE.margin(other.positions) > 0
    return float(np.linalg.norm(one.positions - other.positions, axis=1)[on].max())


@pytest.mark.slow
@pytest.mark.parametrize("name", list(FALLS))
def test_the_fall_comes_to_rest_where_statics_does(name: str) -> None:
    draped = fallen(name)
    assert draped.converged
    assert draped.rest is not None
    assert draped.rest.at_rest
    assert apart(draped, at_rest_by_statics()) < TENTH
    assert draped.figures.max_gap < 1e-9  # nodes are on the planes of their closest points, which lie outside a sphere


@pytest.mark.slow
def test_stiff_springs_part_by_little_and_shared_unknowns_by_nothing() -> None:
    shared, implicit = fallen("shared").rest, fallen("implicit").rest
    assert shared is not None
    assert implicit is not None
    assert shared.joint_gap == 0.0
    assert 0.0 < implicit.joint_gap < 1e-6


@pytest.mark.slow
def test_explicit_springs_part_by_the_force_over_their_stiffness() -> None:
    """Half as stiff, twice the gap: the forces at the joints are the same to first order."""
    gaps = []
    for stiffness in (1.0, 2.0):
        fall = Fall(coupling=ExplicitPenalty(C1=stiffness), drag=DRAG)
        rest = rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=fall).rest
        assert rest is not None
        assert rest.at_rest
        gaps.append(rest.joint_gap)
    assert abs(gaps[0] / gaps[1] - 2.0) < 0.05


@pytest.mark.slow
def test_the_rest_without_friction_is_unstable_sideways_and_says_so() -> None:
    draped = fallen("shared")
    assert draped.rest is not None
    growth = np.array(draped.rest.growth)
    assert np.all(np.diff(growth) >= 0)
    assert abs(growth[1] / growth[0] - 1) < 1e-3  # along x and along y alike
    assert 3.0 < draped.rest.fastest_growth < 8.0  # a rope over a pulley: sqrt(g / length) is 5 to 6 per second
    assert any("unstable sideways" in warning for warning in draped.warnings)


def test_a_fall_that_is_cut_short_says_that_it_is_not_at_rest() -> None:
    draped = rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=Fall(duration=0.3))
    assert not draped.converged
    assert draped.report.status is Status.MOVING
    assert "NOT AT REST after 0.3 s" in draped.warnings[0]


@pytest.mark.parametrize("size", [0.2, 27.0])
def test_a_fall_has_two_edges_a_spacing_unless_the_edge_is_given(size: float) -> None:
    """15 mm on the paper's grids, by the same rule at any size; a given edge is kept, be it the usual sixth."""
    target, spacing = rs.Hemisphere(size), 0.4 * size
    for edge, wanted in (("auto", spacing / 2), (spacing / 6, spacing / 6)):
        layout = rs.GridLayout.orthogonal(rods=(3, 3), spacing=spacing, length=4.0 * size, edge=edge)
        draped = rs.drape(layout, PAPER_ROD, target, method=Fall(duration=1e-3))
        assert draped.layout.edge == pytest.approx(wanted)
        assert draped.mesh.edge_lengths.max() == pytest.approx(wanted)
        assert rs.drape(layout, PAPER_ROD, target).layout.edge == pytest.approx(spacing / 6)


def test_the_built_in_hemisphere_falls_with_the_papers_unknowns() -> None:
    found = load_case("hemisphere", {"drape.method": "paper"}).build()
    assert found.layout.edge == 0.015  # some 8000 unknowns [HQK 3.3], E21
    assert load_case("hemisphere").build().layout.edge == 0.005


def test_a_slow_fall_says_what_makes_it_slow(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fall_drape, "SLOW", 0.0)
    said: dict[str, str] = {}
    for coupling in (SharedDofs(), ImplicitPenalty()):
        fall = Fall(coupling=coupling, duration=0.1)
        rs.drape(
            coarse_layout(), PAPER_ROD, HEMISPHERE, method=fall, joint=Linker(),
            progress=lambda stage, detail, residual, name=coupling.name: said.update({name: detail}),
        )  # fmt: skip
    assert "a step, for" in said["shared"]
    assert said["shared"].endswith("a longer layout.edge has fewer")
    assert said["implicit"].endswith('drape.coupling "shared" has fewer, and the same rest')


@pytest.mark.slow
def test_the_summary_of_a_fall_begins_with_its_rest_and_its_ends_against_the_exact_net(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    options = [
        "--rods",
        "9x9",
        "--spacing",
        "40 mm",
        "--pop_up.ends",
        "pinned",
        "--checks.stages",
        "0",
        "--only",
        "csv",
    ]
    main(["form", "hemisphere", "--method", "paper", *options, "--verbose", "--out", str(tmp_path / "fallen")])
    first, second = capsys.readouterr().out.splitlines()[:2]
    found = re.search(
        r"at rest after [\d.]+ s; rod ends off the exact net's: max ([\d.]+) mm, median ([\d.]+) mm", first
    )
    assert found
    assert "own weight" in second
    rods = rs.read(tmp_path / "fallen").results.rods
    errors = [abs(end - sphere_net_end(RADIUS, abs(rod.offset))) for rod in rods for end in (rod.end, -rod.start)]
    assert float(found[1]) == pytest.approx(1e3 * max(errors), abs=0.006)  # as it is printed
    assert float(found[2]) == pytest.approx(1e3 * np.median(errors), abs=0.006)


@pytest.mark.slow
@pytest.mark.parametrize("key", ["drag", "duration"])
def test_what_a_fall_that_is_not_at_rest_asks_for_brings_it_to_rest(key: str) -> None:
    short = rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=Fall(drag=1.0, duration=2.5))
    assert not short.converged
    found = re.search(rf"([\d.]+) \S+ \(drape\.{key}\)", short.warnings[0])
    assert found
    fall = Fall(drag=float(found[1])) if key == "drag" else Fall(drag=1.0, duration=float(found[1]))
    assert rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=fall).converged


@pytest.mark.slow
def test_a_grid_that_creeps_on_says_so_and_rests_with_the_friction_that_is_advised():
    """Linkers on an ellipsoid: its kinetic energy stays what it was after 2 s, however long the fall."""
    ellipsoid = Ellipsoid(0.2, 0.15, 0.12)

    def fall(**given: float) -> Draped:
        return rs.drape(coarse_layout(), PAPER_ROD, ellipsoid, joint=Linker(), method=Fall(height=0.05, **given))

    creeping = fall(duration=4.0)
    assert creeping.report.status is Status.MOVING
    assert "its kinetic energy no longer falls" in creeping.report.reason
    assert "(drape.friction)" in creeping.report.reason
    assert creeping.warnings == (creeping.report.reason,)
    assert fall(friction=0.1).converged


@pytest.mark.parametrize("rate", [0.3, 2.0])
def test_decay_is_that_of_a_damped_swing(rate: float) -> None:
    """Energy of x = exp(-c t / 2) cos(w t), whose peaks fall as exp(-c t)."""
    times = np.linspace(0.0, 8.0, 801)
    seen = list(zip(times, np.exp(-rate * times) * np.sin(12 * times) ** 2, strict=True))
    found, peak = energy_decay(seen)
    assert abs(found / rate - 1) < 0.05  # windows begin anywhere in a swing of 0.26 s, of 2 s
    assert abs(peak / np.exp(-6 * rate) - 1) < 0.25 * rate
    assert energy_decay([]) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("drag", "rate", "says"),
    [(0.0, 1.0, "a drag of 5 1/s (drape.drag), or some 14 s (drape.duration)"),
     (0.0, 0.02, "a drag of 5 1/s (drape.drag)"),
     (6.0, 1.0, "some 14 s (drape.duration)"),
     (6.0, 0.02, "friction (drape.friction)")],
)  # fmt: skip
def test_a_remedy_that_would_not_help_is_not_named(drag: float, rate: float, says: str) -> None:
    """A swing that must lose a factor exp(5) more: 5 s longer at a rate of 1/s, times the spare half."""
    times = np.linspace(0.01, 6.0, 600)
    energies = np.exp(-rate * times)
    still = float(energies[times > 4.5].max()) * np.exp(-5.0)
    seen = [(0.0, still * np.exp(15.0)), *zip(times, energies, strict=True)]
    assert rest_advice(seen, still, 1.0, 6.0, drag) == says


def test_beyond_the_step_limit_of_explicit_springs_a_fall_is_refused() -> None:
    fall = Fall(coupling=ExplicitPenalty(C1=100.0), time_step=0.02)
    with pytest.raises(StabilityError, match=r"unstable at a time step of 0\.02 s \(limit 0\.00"):
        rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=fall)


def test_without_a_time_step_explicit_springs_take_one_that_they_bear() -> None:
    fall = Fall(coupling=ExplicitPenalty(C1=100.0), duration=0.05)
    draped = rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=fall)
    assert draped.rest is not None
    assert draped.rest.steps >= 6


def test_linkers_fall_alike_with_shared_unknowns_and_with_springs() -> None:
    """Just past the first impact, where linkers that did not land would go on; later the chiral grid slides."""
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.08, edge=0.04, length=0.9)
    ends = []
    for coupling in (SharedDofs(), ImplicitPenalty()):
        fall = Fall(coupling=coupling, drag=DRAG, duration=0.15)
        draped = rs.drape(layout, PAPER_ROD, HEMISPHERE, method=fall, joint=Linker())
        ends.append(draped.positions)
    assert np.linalg.norm(ends[0] - ends[1], axis=1).max() < 1e-3 * RADIUS


def test_frames_stream_to_disk(tmp_path: Path) -> None:
    fall = Fall(duration=0.1, stream=tmp_path / "frames", every=2)
    draped = rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=fall)
    series = TimeSeries.load(tmp_path / "frames")
    np.testing.assert_allclose(series.times, np.arange(6) * 0.02, atol=1e-12)
    nodes = len(draped.positions)
    np.testing.assert_allclose(series.states[0, :nodes, 2], RADIUS + 0.05, atol=1e-12)
    np.testing.assert_allclose(series.states[-1, :nodes], draped.positions, atol=1e-12)


@pytest.mark.parametrize("name", ["times.npy", "states.npy", "energies.npy"])
def test_frames_replace_no_file(name: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("mine")
    with pytest.raises(OutputError, match=f"will not replace .*{name}"):
        rs.drape(coarse_layout(), PAPER_ROD, HEMISPHERE, method=Fall(duration=0.1, stream=tmp_path))
    assert (tmp_path / name).read_text() == "mine"
    assert os.listdir(tmp_path) == [name]


def test_frames_of_a_case_are_files_of_its_result(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """They stand in its folder and nowhere else, and a second run replaces them with the rest."""
    monkeypatch.chdir(tmp_path)
    options = ["--rods", "3x3", "--spacing", "60mm", "--length", "700mm", "--edge", "60mm", "--drape.duration", "0.1s"]
    command = ["form", "hemisphere", "--method", "paper", *options, "--only", "csv", "--out", "dome", "-q"]
    for _ in range(2):
        assert main([*command, "--drape.frames", "my frames"]) == 3
        series = TimeSeries.load("dome/my frames")
        np.testing.assert_allclose(series.times, np.arange(11) * 0.01, atol=1e-12)
    assert "my frames/states.npy" in read_manifest(Path("dome"))
    assert os.listdir() == ["dome"]
    Path("dome/my frames/states.npy").write_bytes(b"mine")
    assert main([*command, "--drape.frames", "my frames"]) == 2
    assert Path("dome/my frames/states.npy").read_bytes() == b"mine"


@pytest.mark.parametrize("frames", ["/tmp/frames", "../frames", "a/../../b", "C:\\frames", "C:frames", ".", ""])
def test_a_case_writes_frames_nowhere_else(frames: str) -> None:
    with pytest.raises(rs.InputError, match=r"drape\.frames.*result's folder"):
        load_case("hemisphere", {"drape.method": "paper", "drape.frames": frames})


@pytest.mark.slow
def test_friction_holds_what_else_slides_off() -> None:
    """Started 1 mm off the middle: with friction it stays, without it the offset grows."""
    offsets = {}
    for friction in (0.0, 0.2):
        layout = rs.GridLayout.orthogonal(rods=(7, 7), spacing=0.06, edge=0.03, length=0.9)
        fall = Fall(friction=friction, drag=DRAG, stopped="normal", duration=2.0)
        draped = rs.drape(layout, PAPER_ROD, HEMISPHERE, method=fall, anchor=(1e-3, 0.0))
        middle = draped.positions[np.argmin(np.linalg.norm(draped.mesh.flat, axis=1))]
        offsets[friction] = abs(float(middle[0]))
    assert offsets[0.2] < 1.5e-3
    assert offsets[0.0] > 10e-3


@pytest.mark.parametrize("name", ["height", "time_step", "duration"])
def test_a_fall_refuses_what_is_not_positive(name: str) -> None:
    with pytest.raises(InputError, match=f"the fall's {name} must be positive, not -1"):
        Fall(**{name: -1.0})
