"""Supports of one's own in a form: found, checked, said and kept by their names."""

from dataclasses import dataclass, replace

import numpy as np
import pytest

import rodshell as rs
from rodshell.formfinding.supports import figures_of
from rodshell.loads.locked_joints import locked
from rodshell.loads.structure import Structure
from rodshell.rods.supports import SUPPORTS, supports_of

ROD = rs.Rod(rs.Circle(radius=1e-3), rs.Material(25e9, 1900))
LAYOUT = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.08, length="auto", edge=0.02)


@dataclass(frozen=True)
class Posts(rs.Support):
    """Ends that move along x alone, against springs."""

    stiffness: float = 200.0

    def free(self, points):
        return {end: [(1, 0, 0)] for end in range(len(points))}

    def energies(self, ends, points):
        return [rs.LocalEnergy(ends[:, None], lambda x: self.stiffness / 2 * (x[:, 0, 0] - points[:, 0]) ** 2)]

    def figures(self, moved, forces):
        return {**super().figures(moved, forces), "stroke of a damper": (float(np.ptp(moved[:, 0])), "m")}


@pytest.fixture(scope="module")
def form() -> rs.Form:
    return rs.find_form(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends=("pinned", Posts("posts")))


def ends_of(form: rs.Form, name: str) -> np.ndarray:
    return form.popped[name].positions[form.footprint.mesh.ends.ravel()]


def test_ends_slide_along_their_direction_alone_and_the_reaction_is_the_springs_force(form):
    slid = ends_of(form, "posts") - form.boundary.points
    assert np.abs(slid[:, 0]).max() > 1e-3
    assert np.abs(slid[:, 1:]).max() == 0
    held = form.checks.reactions["posts"]
    largest = np.abs(held.forces).max()
    np.testing.assert_allclose(held.forces[:, 0], -200.0 * slid[:, 0], rtol=0, atol=1e-8 * largest)
    assert max(held.force_imbalance, held.moment_imbalance) < 1e-8  # sums of both, see `Reactions`


def test_stiff_posts_are_pins_and_soft_ones_store_what_the_rods_lose(form):
    stiff, soft = (
        rs.find_form(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends=Posts("posts", stiffness=k)) for k in (1e8, 50.0)
    )
    apart = np.abs(stiff.popped["posts"].positions - form.popped["pinned"].positions).max()
    assert apart < 1e-6  # m: 20 N over 1e8 N/m, and its share in the shell
    energies = [each.popped["posts"].equilibrium.energy for each in (stiff, form, soft)]
    assert energies[0] > energies[1] > energies[2]  # a minimum over more freedom is lower


def test_checks_summary_and_result_know_the_support_by_its_name(form, tmp_path):
    form.save(tmp_path / "dome", kinds="report, obj")
    archive = rs.read(tmp_path / "dome")
    results = archive.results
    for table in (results.pop_up, results.agreement, results.reactions, results.joint_loads, results.self_weight):
        assert list(table) == ["pinned", "posts"]
    for shapes in (results.bending.shapes(), results.contact.shapes()):
        assert list(shapes)[:2] == ["pinned", "posts"]
    assert results.bending.shapes()["posts"].max_stress == pytest.approx(form.checks.bending["posts"].stress.max())
    np.testing.assert_array_equal(results.reactions["posts"].forces, form.checks.reactions["posts"].forces)
    assert archive.final == "popped_posts"
    for text in (form.summary(verbose=True), (tmp_path / "dome" / "report.html").read_text()):
        assert "posts" in text
    assert archive.summary() == form.summary()
    assert (tmp_path / "dome" / "model" / "popped_posts.obj").exists()
    np.testing.assert_array_equal(archive.states["popped_posts"], form.popped["posts"].positions)


def test_what_a_support_says_of_itself_stands_in_result_summary_and_report(form, tmp_path):
    slid = ends_of(form, "posts") - form.boundary.points
    largest, stroke = np.linalg.norm(slid, axis=1).max(), np.ptp(slid[:, 0])
    form.save(tmp_path / "dome")
    held = rs.read(tmp_path / "dome").results.reactions
    assert held["pinned"].figures == {}
    assert {*held["posts"].figures} == {"largest displacement of a rod end", "stroke of a damper"}
    assert held["posts"].figures["largest displacement of a rod end"] == (pytest.approx(largest, rel=1e-6), "m")
    assert held["posts"].figures["stroke of a damper"] == (pytest.approx(stroke, rel=1e-6), "m")
    assert f"stroke of a damper {1e3 * stroke:.2f} mm" in form.summary(verbose=True)
    report = (tmp_path / "dome" / "report.html").read_text()
    row = report[report.index("Stroke of a damper") :].split("</tr>")[0]
    assert f"{1e3 * stroke:.2f} mm" in row  # of the posts
    assert "\N{EN DASH}" in row  # of the pinned ends


@pytest.mark.parametrize("said", [["stroke"], {"stroke": 0.1}, {"stroke": ("long", "m")}, {1: (0.1, "m")}])
def test_figures_that_are_no_values_with_units_are_refused(said):
    @dataclass(frozen=True)
    class Wrong(rs.Support):
        def figures(self, moved, forces):
            return said

    moved = np.zeros((4, 3))
    with pytest.raises(rs.InputError, match="figure"):
        figures_of(Wrong("wrong"), moved, moved)


def test_what_other_supports_find_does_not_change(form):
    alone = rs.find_form(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends="pinned")
    np.testing.assert_array_equal(alone.popped["pinned"].positions, form.popped["pinned"].positions)
    np.testing.assert_array_equal(alone.checks.reactions["pinned"].forces, form.checks.reactions["pinned"].forces)
    np.testing.assert_array_equal(alone.checks.deployment.positions, form.checks.deployment.positions)


def test_another_support_of_the_same_name_is_found_again(form):
    job = rs.Job(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends=("pinned", Posts("posts", stiffness=50.0)))
    assert job != rs.Job(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends=("pinned", Posts("posts")))
    again = job.run(warm_start=form, until="pop-up")
    assert again.popped["pinned"] is form.popped["pinned"]
    slid = [np.abs(ends_of(each, "posts") - form.boundary.points).max() for each in (form, again)]
    assert slid[1] > 1.2 * slid[0]


def test_a_form_on_own_supports_alone_is_checked_but_not_followed_from_flat():
    form = rs.find_form(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends=Posts("posts"))
    assert form.checks.deployment is None
    assert any("reached from flat was not checked: this needs pinned ends" in said for said in form.verdict.reasons)
    assert form.verdict.findings[0].support == "posts"


def test_no_case_file_describes_it(form):
    with pytest.raises(rs.InputError, match="no case file can describe the support posts"):
        form.case.to_toml()


@pytest.mark.parametrize("name", ["both", "draped", "Posts", "my posts", "../posts", "", 3, "stress"])
def test_a_name_that_files_could_not_bear_is_refused(name):
    with pytest.raises(rs.InputError, match="the name of a support must be a word"):
        rs.Support(name)


@pytest.mark.parametrize(
    ("ends", "sentence"),
    [
        ((Posts("posts"), Posts("posts", stiffness=1.0)), 'two supports have the name "posts"'),
        (Posts("pinned"), 'two supports have the name "pinned"'),
        (Posts("posts", holds_directions=True), "a posts rod end cannot be set free"),
    ],
)
def test_what_does_not_fit_is_refused_in_one_sentence(ends, sentence):
    with pytest.raises(rs.InputError, match=sentence):
        rs.find_form(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends=ends)


def test_patches_stand_on_supports_that_every_case_knows():
    with pytest.raises(rs.InputError, match='patches stand on "pinned" or "clamped" supports, not on posts'):
        rs.find_form(
            rs.Hemisphere(radius=0.2), replace(LAYOUT, rods="auto"), ROD, ends=Posts("posts"), seams=[[(-1, 0), (1, 0)]]
        )


def test_supports_are_read_in_their_order():
    pinned, clamped = SUPPORTS.values()
    assert supports_of("both") == supports_of(("clamped", "both")) == (pinned, clamped)
    assert supports_of(["clamped", "pinned", clamped]) == (clamped, pinned)
    assert supports_of(()) == ()


@pytest.mark.parametrize("tightened", [None, rs.LockedJoints(shear=1.0)])
def test_under_loads_stiff_posts_are_pins_and_reactions_are_the_loads(tightened):
    ends = ("pinned", Posts("stiff", stiffness=1e8), Posts("posts"))
    form = rs.find_form(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends=ends, joint=rs.Pin())
    force = (0.3, 0.0, -1.0)
    loads = rs.Loads(
        loads={"push": rs.PointLoad(force=force, at=(0.0, 0.05))}, combinations={"all": {"push": 1.0}},
        locked_joints=tightened,
    )  # fmt: skip
    found = rs.check_loads(form, loads).shells["all"]
    for shell in found.values():
        np.testing.assert_allclose(shell.reactions.sum(axis=0), -np.array(force), atol=1e-8)
    pinned, stiff, posts = (shell.max_deflection for shell in found.values())
    assert stiff == pytest.approx(pinned, rel=1e-4)  # 1e8 N/m against some 1e3 N/m of the shell
    assert posts > 1.001 * pinned


def test_locked_joints_come_before_the_springs_of_supports():
    form = rs.find_form(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends=Posts("posts"), joint=rs.Pin())
    structure = locked(rs.LockedJoints(shear=1.0), Structure.erected(form.popped["posts"], ROD))
    shell, elements = structure.shell, structure.equilibrium.problem.elements
    assert [element.blocks.shape for element in shell.elements] == [element.blocks.shape for element in elements]
    assert len(shell.springs) == 1
    assert structure.locked_moments(structure.equilibrium) == pytest.approx(0.0, abs=1e-9)  # at rest as it stands


def test_a_deployment_is_that_of_the_support_that_it_leads_to():
    form = rs.find_form(rs.Hemisphere(radius=0.2), LAYOUT, ROD, ends=rs.Support("feet"))
    assert form.checks.deployment.ends == "feet"
    assert form.archive().deployed == "popped_feet"
