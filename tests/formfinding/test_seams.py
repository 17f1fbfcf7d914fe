"""Targets cut by seams: patches that are formed alone, whose rods end at the same points on the seams."""

import re
from dataclasses import replace
from functools import cache
from itertools import pairwise, product
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.spatial import cKDTree

import rodshell as rs
from rodshell.checks.self_weight import self_weight
from rodshell.cli import main
from rodshell.errors import InputError, NetLimitError
from rodshell.formfinding import Draped, pipeline
from rodshell.formfinding.end_matching import LEAVE_OUT, choose_families
from rodshell.formfinding.seams import End, in_a_row, patches_of, transported_heading
from rodshell.geometry.curves import closed_loops, join_end_to_end
from rodshell.layout.mesh import side_by_side
from rodshell.results import read
from rodshell.solve.equilibrium import Status
from rodshell.solve.load_path import CLOSE
from rodshell.targets import Freeform
from rodshell.targets.patch import Seam
from tests.targets.meshes import sheet

Floats = NDArray[np.float64]

ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
DOME = rs.Hemisphere(radius=0.2)
BUMPS = rs.HeightField(
    formula="0.09*exp(-((x - 0.09)^2 + y^2)/0.0072) + 0.07*exp(-((x + 0.09)^2 + y^2)/0.0072)", domain=rs.Disc(0.2)
)
VAULT = rs.HeightField(formula="0.08*cos(14*x)", domain=rs.Rectangle((0.18, 0.6)))
BALL = rs.Cap(radius=0.2, base=-0.13)  # no net covers it from its top
ACROSS, DIAGONAL = [(-1.0, 0.0), (1.0, 0.0)], [(-1.0, -1.0), (1.0, 1.0)]
CROWN = [(0.1 * np.cos(angle), 0.1 * np.sin(angle)) for angle in np.linspace(0, 2 * np.pi, 40)[:-1]]

CASES: dict[str, tuple[rs.Target, list[list[tuple[float, float]]], float]] = {
    "dome, diagonal": (DOME, [DIAGONAL], 0.04),
    "dome, across": (DOME, [ACROSS], 0.04),
    "dome, aside": (DOME, [[(-1.0, 0.2), (0.0, -0.05), (1.0, 0.1)]], 0.03),
    "dome in quarters": (DOME, [ACROSS, [(0.0, -1.0), (0.0, 1.0)]], 0.03),
    "crown": (DOME, [[*CROWN, CROWN[0]]], 0.03),
    "two bumps, in the valley": (BUMPS, [[(0.0, -1.0), (0.0, 1.0)]], 0.032),
    "vault in three": (VAULT, [[(-1.0, -0.1), (1.0, -0.1)], [(-1.0, 0.1), (1.0, 0.14)]], 0.02),
    "ball": (BALL, [ACROSS], 0.035),
}
HEADINGS = {"dome, aside": 0.6}


def layout_of(spacing: float, **options: float) -> rs.GridLayout:
    return rs.GridLayout.orthogonal(spacing=spacing, edge=spacing / 5, **options)


@cache
def sewn(name: str) -> rs.Form:
    target, seams, spacing = CASES[name]
    return rs.find_form(target, layout_of(spacing, rotate=HEADINGS.get(name, 0.0)), ROD, seams=seams)


every_case = pytest.mark.parametrize("name", CASES)


def place_of(form: rs.Form, end: End) -> Floats:
    """Where the popped-up pinned shell of a patch has an end."""
    shell = form.stages.patches[end.patch]
    rods = [rod.name for rod in shell.footprint.rods]
    return shell.popped["pinned"].positions[shell.footprint.mesh.ends[rods.index(end.rod), end.side]]


def off_seams(form: rs.Form, x: Floats) -> Floats:
    """(n,) distance in plan to the nearest seam's line, by dense points along it."""
    dense = []
    for seam in form.seams:
        for a, b in zip(seam.points[:-1], seam.points[1:], strict=True):
            dense.append(a + np.linspace(0, 1, 40001)[:, None] * (b - a))
    return np.asarray(cKDTree(np.vstack(dense)).query(x[:, :2])[0])


@pytest.mark.slow
@every_case
def test_both_patches_end_at_the_same_points(name: str) -> None:
    form = sewn(name)
    assert form.status == "converged"
    assert len(form.meetings) > 8
    for meeting in form.meetings:
        first, second = meeting.ends
        assert first.patch != second.patch
        np.testing.assert_array_equal(place_of(form, first), place_of(form, second))
        np.testing.assert_array_equal(place_of(form, first), meeting.point)


@pytest.mark.slow
@every_case
def test_these_points_lie_on_target_and_seam(name: str) -> None:
    form = sewn(name)
    points = np.array([meeting.point for meeting in form.meetings])
    assert np.abs(form.target.gap(points).distance).max() < 1e-12
    assert off_seams(form, points).max() < 3e-5  # the dense points lie 5e-5 apart


@pytest.mark.slow
@every_case
def test_no_rod_ends_alone_on_a_seam(name: str) -> None:
    """Each end off the target's own edge belongs to exactly one meeting."""
    form = sewn(name)
    met = [end for meeting in form.meetings for end in meeting.ends]
    assert len(met) == len(set(met)) == 2 * len(form.meetings)
    inside = 0
    for patch, found in form.stages.patches.items():
        ends = found.trimmed.boundary.points
        for k in np.flatnonzero(form.target.margin(ends) > 2e-3 * form.target.size):
            assert End(patch, found.footprint.rods[k // 2].name, int(k % 2)) in met
            inside += 1
    assert inside >= 0.8 * len(met)


@pytest.mark.slow
@every_case
def test_every_patch_lies_on_the_target_on_its_own_side(name: str) -> None:
    form = sewn(name)
    for found, laid in zip(form.stages.patches.values(), form.stages.seams.nets.values(), strict=True):
        x = found.trimmed.positions
        assert np.abs(form.target.gap(x).distance).max() < 1e-9 * form.target.size
        assert laid.patch.margin(x).min() > -3e-3 * form.target.size  # straight chords beside a curved edge
    assert sum(len(found.footprint.rods) for found in form.stages.patches.values()) == len(form.footprint.rods)


@pytest.mark.slow
@every_case
def test_shells_are_stable_and_stay_near(name: str) -> None:
    form = sewn(name)
    for ends, allowed in (("pinned", 0.025), ("clamped", 0.005)):
        report = form.popped[ends].report
        assert report.stable
        assert form.agreement[ends].rms_relative < allowed


@pytest.mark.slow
@every_case
def test_ends_hardly_move_to_their_points(name: str) -> None:
    """What the mesh of a patch alone misses them by; second order in its edges."""
    assert max(sewn(name).stages.seams.moved.values()) < 3e-3 * CASES[name][0].size


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dome, aside", "two bumps, in the valley", "vault in three"])
def test_lines_of_the_net_are_led_through_the_points(name: str) -> None:
    """Across the rod; along it the net itself is known to 1e-4 only. Without a correction 4e-6 to 7e-5 are left."""
    form = sewn(name)
    for meeting in form.meetings:
        end = meeting.ends[1]
        laid = form.stages.seams.nets[end.patch]
        rod = next(rod for rod in laid.rods if rod.name == end.rod)
        if [other.ends[1].rod for other in form.meetings if other.ends[1].patch == end.patch].count(end.rod) > 1:
            continue
        near = (rod.end if end.side else rod.start) + np.array([-1.0, 0.0, 1.0]) * 1e-3 * laid.layout.edge
        behind, at, ahead = laid.net.positions(rod, near)
        along = (ahead - behind) / np.linalg.norm(ahead - behind)
        across = np.cross(along, form.target.on_surface(meeting.point[None]).normal[0])
        assert abs((at - meeting.point) @ across) < 1.5e-6 * form.target.size


def test_a_patch_alone_is_the_same_form() -> None:
    """One job with the patch's boundary and rods; only its ends are not moved (0.03 mm) to where the others are."""
    form = sewn("dome, diagonal")
    for name, laid in form.stages.seams.nets.items():
        alone = rs.find_form(laid.patch, laid.layout, ROD, anchor=laid.anchor, ends=("clamped",))
        found = form.stages.patches[name]
        held = found.footprint.mesh.ends.ravel()
        free = np.setdiff1d(np.arange(found.footprint.mesh.node_count), held)
        np.testing.assert_array_equal(found.trimmed.positions[free], alone.trimmed.positions[free])
        np.testing.assert_array_equal(found.footprint.points, alone.footprint.points)
        apart = np.linalg.norm(found.popped["clamped"].positions - alone.popped["clamped"].positions, axis=1)
        assert apart.max() < 3 * form.stages.seams.moved[name] < 1.2e-4


@pytest.mark.slow
@pytest.mark.parametrize("name", ["dome, across", "dome, diagonal", "ball"])
def test_patches_of_a_mirrored_target_mirror_each_other(name: str) -> None:
    form = sewn(name)
    first, second = form.stages.patches.values()
    swapped = [1, 0, 2] if name == "dome, diagonal" else [0, 1, 2]
    sign = 1 if name == "dome, diagonal" else np.array([1, -1, 1])
    for here, there in ((first, second), (second, first)):
        reflected = here.trimmed.boundary.points[:, swapped] * sign
        assert cKDTree(there.trimmed.boundary.points).query(reflected)[0].max() < 1e-3 * form.target.size
    lengths = [sorted(rod.length for rod in found.footprint.rods) for found in (first, second)]
    np.testing.assert_allclose(lengths[0], lengths[1], atol=1e-3 * form.target.size)


@pytest.mark.slow
def test_seams_carry_what_the_patches_do_not() -> None:
    """Forces on the seam and at the edge balance; each is the sum of both rods'."""
    form = sewn("two bumps, in the valley")
    archive = form.archive()
    held = archive.results.plain()["reactions"]["clamped"]
    forces = np.array(held["forces"])
    (seam,) = archive.results.plain()["seams"]
    rows = {f"{rod.name}.{side}": 2 * k + side for k, rod in enumerate(form.footprint.rods) for side in (0, 1)}
    both = [[rows[end] for end in meeting["ends"]] for meeting in seam["meetings"]]
    each = np.array(seam["forces"]["clamped"]["each"])
    np.testing.assert_allclose(each, forces[both].sum(axis=1), atol=1e-15)
    edge = np.delete(forces, np.ravel(both), axis=0).sum(axis=0)
    np.testing.assert_allclose(edge + seam["forces"]["clamped"]["sum"], 0.0, atol=1e-8 * held["largest_force"])
    assert seam["forces"]["clamped"]["largest"] > 0.01 * held["largest_force"]


@pytest.mark.slow
def test_of_patches_the_weakest_says_what_share_of_the_own_weight_is_borne() -> None:
    form = sewn("two bumps, in the valley")
    archive = form.archive()
    for ends, weighed in archive.results.plain()["self_weight"].items():
        popped = [patch.popped[ends] for patch in form.patches]
        own = [self_weight(patch.shell, patch.equilibrium)[0] for patch in popped]
        # followed as one shell: each path ends within CLOSE of its limit
        assert weighed["load_factor"] == pytest.approx(min(patch.load_factor for patch in own), rel=CLOSE)
    assert archive.summary(verbose=True).count("(weakest patch, its seam held)") == 2


def test_a_patch_that_stands_is_reported_where_another_does_not() -> None:
    """The laths of the steep bump would buckle in many places, those of the flat one stand as they do alone."""
    bumps = "0.09*exp(-((x + 0.09)^2 + y^2)/0.0072) + 0.02*exp(-((x - 0.09)^2 + y^2)/0.0072)"
    target = rs.HeightField(formula=bumps, domain=rs.Disc(0.2))
    lath = rs.Rod(rs.RectangularSection(width=4.5e-3, height=1e-3), rs.Material(youngs_modulus=1e9, density=1e3))
    seam = [(0.0, -1.0), (0.0, 1.0)]
    form = rs.find_form(target, layout_of(0.04), lath, seams=[seam], joint=rs.Pin(), ends="pinned")
    steep, flat = form.results().plain()["patches"]
    assert form.popped["pinned"].report.status.value == steep["pop_up"]["pinned"]["status"] == "buckled"
    assert form.status.startswith("pop-up (pinned) was given up at its start")
    assert not steep["agreement"]
    assert flat["status"] == flat["pop_up"]["pinned"]["status"] == "converged"
    assert flat["pop_up"]["pinned"]["stable"]
    assert flat["agreement"]["pinned"]["rms_relative"] < 0.02
    stands = form.patches[1]
    alone = rs.pop_up(stands.footprint, stands.boundary, lath, ends="pinned", joint=rs.Pin())
    np.testing.assert_allclose(stands.popped["pinned"].positions, alone.positions, rtol=0, atol=1e-12)
    first = stands.footprint.mesh.node_count
    np.testing.assert_array_equal(form.popped["pinned"].positions[-first:], stands.popped["pinned"].positions)


def test_patches_whose_laths_lean_to_either_side_lean_as_each_does_alone() -> None:
    """Released, these mirrored patches are on saddles, which they leave to sides that neither decides for the other."""
    lath = rs.Rod(rs.RectangularSection(width=2e-3, height=1e-3), rs.Material(youngs_modulus=1e9, density=1e3))
    target, seams, spacing = CASES["two bumps, in the valley"]
    form = rs.find_form(target, layout_of(spacing), lath, seams=seams, joint=rs.Pin(), ends="pinned")
    assert form.popped["pinned"].report.iterations > sum(
        patch.popped["pinned"].report.iterations for patch in form.patches
    )
    for patch in form.patches:
        alone = rs.pop_up(patch.footprint, patch.boundary, lath, ends="pinned", joint=rs.Pin())
        np.testing.assert_allclose(patch.popped["pinned"].positions, alone.positions, rtol=0, atol=1e-10)


def test_a_patch_pops_up_where_another_was_not_draped(monkeypatch: pytest.MonkeyPatch) -> None:
    drape = pipeline.drape

    def stalled(*args: Any, **options: Any) -> Draped:
        found = drape(*args, **options)
        lost = found.target.middle[1] > 0  # of the two patches of a dome cut along x
        return replace(found, levels=(replace(found.report, status=Status.STALLED),)) if lost else found

    monkeypatch.setattr(pipeline, "drape", stalled)
    form = rs.find_form(DOME, layout_of(0.06), ROD, seams=[ACROSS], ends="pinned")
    assert form.popped == {}
    assert form.status.startswith("drape stopped at the largest number of iterations")
    assert form.status.endswith("(patch B)")
    stands, lost = form.archive().results.plain()["patches"]
    assert stands["status"] == stands["pop_up"]["pinned"]["status"] == "converged"
    assert stands["agreement"]["pinned"]["rms_relative"] < 0.02
    assert lost["pop_up"] == lost["agreement"] == {}


@pytest.mark.slow
def test_a_sphere_beyond_the_nets_limit_is_formed_in_two() -> None:
    with pytest.raises(NetLimitError):
        rs.find_form(BALL, layout_of(0.035), ROD)
    form = sewn("ball")
    assert min(laid.net.min_angle for laid in form.stages.seams.nets.values()) > np.radians(20)
    assert all("would swing" in why for _, why in form.dropped)


@pytest.mark.slow
def test_a_valley_with_a_seam_holds_the_grid_down() -> None:
    whole = rs.find_form(BUMPS, layout_of(0.032), ROD, ends=("clamped",))
    assert sewn("two bumps, in the valley").agreement["clamped"].rms < 0.3 * whole.agreement["clamped"].rms


@pytest.mark.slow
def test_the_search_leaves_out_no_more_rods_than_the_default_heading() -> None:
    target, seams, spacing = CASES["dome, aside"]
    layout = layout_of(1.2 * spacing)
    jobs = [rs.Job(target, layout, ROD, seams=seams, ends=(), rotate=turn) for turn in (None, "auto")]
    default, found = (job.run(until="pop-up") for job in jobs)
    assert len(found.dropped) < len(default.dropped)
    assert any("rods are left out" in word for word in default.warnings)


def test_a_patch_may_have_its_own_spacing_and_anchor() -> None:
    own = {"B": rs.PatchLayout(anchor=(0.1, -0.1), spacing=(0.05, 0.05))}
    form = rs.find_form(DOME, layout_of(0.04), ROD, seams=[DIAGONAL], patches=own, ends=())
    assert form.stages.seams.nets["B"].layout.spacing == (0.05, 0.05)
    np.testing.assert_allclose(form.stages.seams.nets["B"].anchor, (0.1, -0.1), atol=0.03 * 0.05)
    assert len(form.meetings) > 10


@pytest.mark.slow
def test_the_strong_bending_of_patches_is_that_of_the_worst() -> None:
    """Here not of the patch whose rods meet at the smallest angle."""
    lath = rs.Rod(rs.RectangularSection(width=1e-3, height=8e-3), rs.Material(youngs_modulus=1e9, density=1e3))
    target, seams, spacing = CASES["two bumps, in the valley"]
    result = rs.find_form(target, layout_of(spacing), lath, seams=seams, joint=rs.Pin(), ends=()).results().plain()
    bent = [patch["drape"]["strong_bending"] for patch in result["patches"]]
    assert bent[0]["beyond"] > 1.05 * bent[1]["beyond"]
    assert result["patches"][0]["drape"]["min_angle_deg"] > result["patches"][1]["drape"]["min_angle_deg"]
    assert result["drape"]["strong_bending"] == bent[0]


@pytest.mark.slow
def test_running_a_result_again_gives_the_same(tmp_path, monkeypatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "seams.obj").write_text("v -300 -300 0\nv 0 -10 0\nv 300 300 0\nl 1 2\nl 2 3\n")
    (tmp_path / "dome.toml").write_text(
        '[target]\nkind = "hemisphere"\n[layout]\nspacing = "50 mm"\nedge = "12 mm"\n'
        '[seams]\nfile = "seams.obj"\nunit = "mm"\npatches = [{ name = "B", rotate = "12 deg" }]\n'
        "[checks]\nstages = 0\n"
    )
    assert main(["form", "dome.toml", "--out", "first", "--only", "csv", "-q"]) == 0
    (tmp_path / "seams.obj").unlink()
    assert main(["form", "first/case.toml", "--out", "second", "--only", "csv", "-q"]) == 0
    first, second = read("first"), read("second")
    assert first.case_toml == second.case_toml
    for state, positions in first.states.items():
        np.testing.assert_array_equal(positions, second.states[state])
    assert first.results.plain()["patches"][1]["rotate"] == pytest.approx(np.radians(12))
    assert {rod["id"][:2] for rod in first.results.plain()["rods"]} == {"A-", "B-"}
    assert (tmp_path / "first/schedule/seams.csv").read_text().count("\n") == 1 + len(
        first.results.plain()["seams"][0]["meetings"]
    )


@pytest.mark.slow
def test_an_archive_of_patches_gives_itself_again(tmp_path, capsys) -> None:
    form = rs.find_form(DOME, layout_of(0.06), ROD, seams=[DIAGONAL])
    form.save(tmp_path / "dome")
    assert main(["popup", str(tmp_path / "dome"), "--out", str(tmp_path / "popped")]) == 2
    assert "one patch's rods" in capsys.readouterr().err
    again = ["form", str(tmp_path / "dome/case.toml"), "--out", str(tmp_path / "again"), "--only", "csv", "-q"]
    assert main(again) == 4  # it falls by its weight
    np.testing.assert_array_equal(read(tmp_path / "again").states["popped_clamped"], form.popped["clamped"].positions)


BAD = {
    "--seams.lines=1,-1;1,1": "in one piece",
    "--seams.lines=0,0;0,0": "two different points",
    "--seams.lines=0,0": "rows of two points or more",
    "--seams.lines=a,0;1,1": "length",
    "--seams.file=none.dxf": "none.dxf",
    "--seams.lines=-1,0;1,0 --layout.rods=7x7": 'use "auto"',
    "--seams.lines=-1,0;1,0 --method=gravity": 'use "bound"',
    "--seams.lines=-1,0;1,0 --anchor=0,0": "leave it out",
    "--seams.lines=-1,0;1,0 --spacing=500mm": "wider than the shell of 400 mm",
}


@pytest.mark.parametrize("words", BAD)
def test_bad_seams_are_one_sentence(words: str, tmp_path, capsys) -> None:
    arguments = ["hemisphere", "--rods=auto", "--length=auto", *words.split(" ")]
    assert main(["form", *arguments, "--out", str(tmp_path / "out"), "-q"]) == 2
    said = capsys.readouterr().err.strip()
    assert BAD[words] in said
    assert said.count("\n") == 0


@pytest.mark.parametrize(
    ("own", "words"),
    [({"C": rs.PatchLayout()}, "no patch"), ({"A": rs.PatchLayout(anchor=(1.0, 0.0))}, "patch A|no point")],
)
def test_patches_that_are_not_there_are_refused(own: dict[str, rs.PatchLayout], words: str) -> None:
    with pytest.raises(InputError, match=words):
        rs.find_form(DOME, layout_of(0.04), ROD, seams=[DIAGONAL], patches=own)


def test_a_patch_that_is_nowhere_seen_from_above_is_refused_in_one_sentence():
    """Squares of a groin vault that are split across its creases: the smooth surface through the teeth folds over."""
    x, faces = sheet(lambda x, y: np.maximum(np.sqrt(36 - x**2), np.sqrt(36 - y**2)), 5.0, 21)
    (a, b, c), d = faces[: len(faces) // 2].T, faces[len(faces) // 2 :, 2]
    turn = (np.linalg.norm(x[a] - x[c], axis=1) > np.linalg.norm(x[b] - x[d], axis=1))[:, None]
    first = np.where(turn, np.column_stack([a, b, d]), np.column_stack([a, b, c]))
    second = np.where(turn, np.column_stack([b, c, d]), np.column_stack([a, c, d]))
    target = Freeform.of(x, np.vstack([first, second]))
    with pytest.raises(InputError, match=r"nothing of the patch around \(.*\) m is seen from above"):
        rs.find_form(target, layout_of(0.6), ROD, seams=[[(-6, -6), (6, 6)], [(-6, 6), (6, -6)]])


@pytest.mark.parametrize("rotate", [0.0, 0.4])
def test_a_heading_carried_over_a_sphere_keeps_its_angle_with_the_way(rotate: float) -> None:
    """Parallel transport along the great circle from the top."""
    for x, y in ((0.12, 0.0), (-0.1, 0.13), (0.05, -0.17)):
        top, there = np.array([0.0, 0.0, 0.2]), np.array([x, y, np.sqrt(0.04 - x**2 - y**2)])
        carried = transported_heading(DOME, (x, y), rotate)
        plan = np.array([np.cos(carried), np.sin(carried)])
        heading = np.array([*(plan * there[2]), -plan @ there[:2]])  # the tangent over this direction of the plan
        heading /= np.linalg.norm(heading)
        way = np.array([x, y, 0.0]) / np.hypot(x, y)
        on_arrival = np.cross(np.cross(top, there), there)
        on_arrival /= np.linalg.norm(on_arrival)
        assert heading @ on_arrival == pytest.approx([np.cos(rotate), np.sin(rotate), 0.0] @ way, abs=1e-12)


def test_patches_are_named_from_left_to_right() -> None:
    seams = tuple(Seam.of(row) for row in ([(-0.05, -1), (-0.05, 1)], [(0.1, -1), (0.1, 1)]))
    middles = [patch.middle[0] for patch in patches_of(DOME, seams).values()]
    assert middles == sorted(middles)
    assert list(patches_of(DOME, seams)) == ["A", "B", "C"]


@pytest.mark.parametrize("closed", [False, True])
def test_the_side_of_a_seam_is_that_of_its_polygon(closed: bool) -> None:
    """Against the crossing rule, in a polygon that the open seam closes far to its left."""
    corners = np.array([(-1.0, 0.0), (-0.2, 0.3), (0.0, -0.2), (0.4, 0.5), (1.0, 0.0)])
    if closed:
        corners = np.vstack([corners, [(0.1, 0.95)]])
    seam = Seam.of([*corners, corners[0]] if closed else corners)
    rng = np.random.default_rng(1)
    x = rng.uniform(-0.9, 0.9, (2000, 2))
    loop = corners if closed else np.vstack([corners, [(9.0, 0.0), (9.0, 9.0), (-9.0, 9.0), (-9.0, 0.0)]])
    a, b = loop, np.roll(loop, -1, axis=0)
    hit = (a[:, 1] > x[:, 1:]) != (b[:, 1] > x[:, 1:])
    with np.errstate(all="ignore"):
        right = a[:, 0] + (x[:, 1:] - a[:, 1]) / (b[:, 1] - a[:, 1]) * (b[:, 0] - a[:, 0]) > x[:, :1]
    inside = np.count_nonzero(hit & right, axis=1) % 2 == 1
    clear = np.abs(seam.distance(x)) > 1e-9
    if not closed:  # past its ends the seam goes on straight, not level
        clear &= np.abs(x[:, 0]) < 0.7
    np.testing.assert_array_equal((seam.distance(x) > 0)[clear], inside[clear])


def test_families_are_chosen_as_by_trying_all() -> None:
    rng = np.random.default_rng(3)
    for _ in range(20):
        count = 6
        place = np.cumsum(rng.uniform(-0.2, 1.2, (count, 2)), axis=0)
        points = np.cumsum(rng.uniform(0.2, 1.0, (count, 1)), axis=0) * [1.0, 0.0, 0.0]
        price = rng.uniform(0, 0.5, (count, 2))

        def cost(chosen: tuple[int, ...], place=place, points=points, price=price) -> float:
            total = 0.0
            for k, family in enumerate(chosen):
                if family < 0:
                    total += LEAVE_OUT
                    continue
                total += price[k, family]
                before = [j for j in range(k) if chosen[j] == family]
                if before:
                    j = before[-1]
                    apart = max(
                        np.abs(np.diff(place[j : k + 1, 1 - family])).sum(), (points[k, 0] - points[j, 0]) / 4.0
                    )
                    total += np.log(apart) ** 2
            return total

        best = min(product((0, 1, -1), repeat=count), key=cost)
        assert cost(tuple(choose_families(place, points, price, (1.0, 1.0)).tolist())) == pytest.approx(cost(best))


def test_points_are_put_in_a_row_along_an_overhanging_curve() -> None:
    angle = np.sort(np.random.default_rng(4).uniform(-0.7, np.pi + 0.7, 60))
    points = np.column_stack([np.cos(angle), 0 * angle, np.sin(angle)])
    mixed = np.random.default_rng(5).permutation(60)
    order = mixed[in_a_row(points[mixed])]
    assert order.tolist() in (list(range(60)), list(range(59, -1, -1)))


@pytest.mark.slow
def test_grids_side_by_side_are_the_same_grids() -> None:
    form = sewn("vault in three")
    meshes = {name: found.footprint.mesh for name, found in form.stages.patches.items()}
    both = side_by_side(meshes, 0.05)
    at = 0
    for mesh in meshes.values():
        moved = both.flat[at : at + mesh.node_count]
        shift = moved[0] - mesh.flat[0]
        np.testing.assert_allclose(moved - mesh.flat, np.broadcast_to(shift, moved.shape), atol=1e-15)
        at += mesh.node_count
    spans = [
        (x.min(), x.max()) for x in np.split(both.flat[:, 0], np.cumsum([m.node_count for m in meshes.values()])[:-1])
    ]
    for (_, end), (start, _) in pairwise(spans):
        assert start - end == pytest.approx(0.05)
    for (a, b), (s, t) in zip(both.grid.crossings.rods, both.grid.crossings.at, strict=True):
        rods = both.grid.rods
        np.testing.assert_allclose(rods[a].point(s), rods[b].point(t), atol=1e-14)
    for k, rod in enumerate(both.grid.rods):
        np.testing.assert_allclose(
            both.flat[both.nodes_of(k), :2], rod.point(both.stations[both.rod_slice(k)]), atol=1e-14
        )


def test_strokes_are_joined_at_both_ends() -> None:
    x = np.column_stack([np.arange(7.0), np.zeros((7, 2))])
    middle_last = [x[[2, 1, 0]], x[4:7], x[2:5]]
    (line,) = join_end_to_end(middle_last)
    assert len(line) == 7
    assert abs(line[0, 0] - line[-1, 0]) == 6.0
    assert closed_loops(middle_last) == []


LEFT_OUT = {
    "dome, diagonal": 0, "dome, across": 8, "dome, aside": 7, "crown": 0, "two bumps, in the valley": 4, "ball": 6,
}  # fmt: skip


@pytest.mark.slow
@pytest.mark.parametrize("name", LEFT_OUT)
def test_hardly_a_rod_is_left_out_where_rods_can_meet(name: str) -> None:
    """Of 40 to 70: those in corners, which have too few joints."""
    assert len(sewn(name).dropped) <= LEFT_OUT[name]


@pytest.mark.slow
def test_figures_of_all_patches_are_joined() -> None:
    form = sewn("two bumps, in the valley")
    for ends, gap in form.agreement.items():
        parts = [found.agreement[ends] for found in form.stages.patches.values()]
        assert gap.max == max(part.max for part in parts)
        assert min(part.rms for part in parts) <= gap.rms <= max(part.rms for part in parts)
        np.testing.assert_array_equal(gap.gaps, np.concatenate([part.gaps for part in parts]))
        # the edges' middles count too, so all nodes alone give it nearly
        assert gap.rms == pytest.approx(np.sqrt(np.mean(gap.gaps**2)), rel=0.05)
        report = form.popped[ends].report
        assert report.dofs == sum(found.popped[ends].report.dofs for found in form.stages.patches.values())


@pytest.mark.slow
def test_the_way_up_of_all_patches_ends_where_they_stand() -> None:
    form = sewn("dome in quarters")
    archive = form.archive()
    history, share = archive.states["history"], archive.states["history_share"]
    assert len(history) == len(share) > 3
    plain = archive.results.plain()
    work = sum(found["factorizations"] for found in [*plain["pop_up"].values(), *plain["self_weight"].values()])
    each = plain["deployment"]["factorizations"] / len(form.patches)  # of one patch takes as long as a part of all
    assert sum(found["factorizations"] for found in plain["other_shapes"].values()) <= 0.5 * (work + each)
    np.testing.assert_allclose(history[-1], form.popped["pinned"].positions, atol=1e-8)
    assert np.ptp(history[0].reshape(-1, 3)[:, 2]) < 1e-3
    assert archive.states["history_curvature"].shape == (len(share), len(archive.states["rod_nodes"]))
    sharpest = archive.states["history_curvature"].max(axis=1)
    np.testing.assert_allclose(
        [1 / stage["min_radius"] for stage in archive.results.plain()["deployment"]["stages"]], sharpest, rtol=1e-5
    )


def rods_said_to_be_in_pieces(form: rs.Form) -> set[str]:
    """The patches and rods that the warnings name so, such as A-U07."""
    said = [re.match(r"patch (\w): .* several pieces, each with its own ends: (.*?);", word) for word in form.warnings]
    return {f"{found[1]}-{name}" for found in said if found for name in found[2].split(", ")}


@pytest.mark.slow
def test_no_rod_is_warned_of_whose_pieces_are_all_left_out() -> None:
    """Around an oval seam, askew: some rods meet none of the oval's rods, and both their pieces are left out."""
    angles = np.append(np.linspace(0, 2 * np.pi, 40)[:-1], 0.0)
    oval = np.column_stack([0.12 * np.cos(angles) + 0.02, 0.07 * np.sin(angles)])
    form = rs.find_form(DOME, layout_of(0.025, rotate=0.2), ROD, seams=[oval], ends="pinned")
    built = {rod.name[:-1] for rod in form.footprint.rods if rod.name[-1] in "ab"}
    left_out = {name[:-1] for name, _ in form.dropped if name[-1] in "ab"}
    assert len(left_out - built) > 3
    assert rods_said_to_be_in_pieces(form) == built


@pytest.mark.slow
def test_a_rod_is_warned_of_whose_pieces_are_built() -> None:
    form = sewn("crown")
    built = {rod.name[:-1] for rod in form.footprint.rods if rod.name[-1] in "ab"}
    assert len(built) == 14
    assert rods_said_to_be_in_pieces(form) == built
