"""Supports by groups of rod ends: bows against the elastica, shells against code of the tests' own, what is refused."""

import tomllib
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import brentq
from scipy.special import ellipe, ellipk

import rodshell as rs
from rodshell.checks.reactions import reactions
from rodshell.errors import InputError
from rodshell.layout import straight_rods
from rodshell.refining.refine import structure_of
from tests.checks.loaded_twin import LoadedTwin, _coordinates
from tests.loads.shells import TUBE, grid, shell

LENGTH, SPAN = 2.0, 1.8  # of a bow [m]
RADIUS, MODULUS = 0.01, 10e9
ROD = rs.Rod(rs.Circle(RADIUS), rs.Material(MODULUS, 600.0))
STIFF = 20e3  # N/m


def groups(*each: rs.HeldEnds | rs.FreeEnds | rs.SlidingEnds | rs.SprungEnds) -> rs.SupportGroups:
    return rs.SupportGroups(groups=each)


def thrust(span: float) -> float:
    """Of a rod of `LENGTH` that is pinned at both ends [N]: Euler's elastica."""
    m = brentq(lambda m: 2 * ellipe(m) / ellipk(m) - 1 - span / LENGTH, 1e-9, 0.95)
    return MODULUS * np.pi * RADIUS**4 / 4 * (2 * ellipk(m) / LENGTH) ** 2


def bows(support: rs.SupportGroups) -> np.ndarray:
    """(4, 3) forces of the supports of two bows that cross at their tops, where alike ones do not act on each other."""
    flat = np.array([[[-1.0, 0], [1, 0]], [[0, -1], [0, 1]]])
    mesh = rs.mesh_grid(straight_rods(0.5 * LENGTH * flat), 0.02)
    points = np.pad(0.5 * SPAN * flat.reshape(-1, 2), [(0, 0), (0, 1)])
    tangents = np.repeat(np.eye(3)[:2], 2, axis=0)
    popped = rs.pop_up(rs.Footprint(mesh), rs.Boundary(points, tangents), ROD, ends=support, start="flat")
    assert popped.report.stable
    return reactions(popped.shell, popped.equilibrium).forces


@pytest.mark.parametrize("stiffness", [2.5e3, 1e4, 1e6])
def test_bows_on_springs_push_them_aside_as_the_elastica_says(stiffness: float) -> None:
    forces = bows(groups(rs.SprungEnds(stiffness=(stiffness, stiffness, 1e6))))
    aside = brentq(lambda u: thrust(SPAN + 2 * u) - stiffness * u, 0.0, 0.09999)
    assert forces[0] == pytest.approx([stiffness * aside, 0.0, 0.0], rel=1e-3, abs=1e-6)
    assert forces[3] == pytest.approx([0.0, -stiffness * aside, 0.0], rel=1e-3, abs=1e-6)
    assert stiffness > 1e5 or aside > 5e-3


def test_groups_are_told_by_place_and_by_name_and_the_last_one_counts() -> None:
    """The first bow pushes springs, the second is held."""
    soft = rs.SprungEnds(stiffness=(2.5e3, 2.5e3, 1e6))
    first, *others = (
        bows(given)
        for given in (
            groups(rs.SprungEnds(at="y < 0.1 m and y > -10 cm", stiffness=soft.stiffness)),
            groups(soft, rs.HeldEnds(at="R02.0, R02.1")),
            groups(soft, rs.HeldEnds(at="y > 0.5 m"), rs.HeldEnds(at="y < -500 mm")),
        )
    )
    for other in others:
        assert other == pytest.approx(first, rel=1e-9, abs=1e-9)
    alike = bows(groups(soft))
    assert abs(first[0, 0] - first[2, 1]) > 1.0 > abs(alike[0, 0] - alike[2, 1])


class SprungTwin(LoadedTwin):
    """On springs in every direction [N/m] at the rod ends `sprung`; `free` ones are not held, the others are."""

    def __init__(self, pinned, rod, stiffness, sprung, free=()):
        super().__init__(pinned, rod)
        at = _coordinates(self.ends[sprung][:, None])
        points = self.state[at].copy()
        self.terms.append((lambda x: (0.5 * stiffness * (x[:, 0] - points) ** 2).sum(axis=1), at, 3))
        loose = _coordinates(self.ends[[*sprung, *free]][:, None]).ravel()
        self.free = np.union1d(self.free, loose)


@cache
def on(support: rs.SupportGroups) -> rs.Form:
    return rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=support)


def test_a_shell_on_springs_is_that_of_other_code_and_carries_as_much() -> None:
    form = on(groups(rs.SprungEnds(stiffness=STIFF)))
    ends = range(2 * len(form.footprint.rods))
    twin = SprungTwin(shell("tubes").popped["pinned"], TUBE, STIFF, [*ends])
    state, negative = twin.settled(twin.state, 0.0, most=20)
    assert negative == 0
    found = form.popped["given"].positions
    assert found == pytest.approx(state[: found.size].reshape(-1, 3), abs=1e-6 * form.target.size)
    twin.state = state
    factor, _ = twin.load_factor(2e-3)
    assert form.checks.self_weight["given"].load_factor == pytest.approx(factor, rel=0.01)
    assert factor < 0.99 * shell("tubes").checks.self_weight["pinned"].load_factor


@pytest.mark.slow
def test_an_open_side_is_free_in_other_code_too_and_no_edge_beam_is_asked_for_there() -> None:
    form = on(groups(rs.SprungEnds(stiffness=STIFF), rs.FreeEnds(at="y > 6 m")))
    points = form.boundary.points
    free = np.flatnonzero(points[:, 1] > 6)
    assert len(free) >= 3
    twin = SprungTwin(shell("tubes").popped["pinned"], TUBE, STIFF, np.setdiff1d(np.arange(len(points)), free), free)
    found = form.popped["given"]
    state, negative = twin.settled(np.append(found.positions.ravel(), twin.state[found.positions.size :]), 0.0, most=20)
    assert negative == 0
    assert found.positions == pytest.approx(state[: found.positions.size].reshape(-1, 3), abs=1e-6 * form.target.size)
    forces = form.checks.reactions["given"].forces
    assert np.abs(forces[free]).max() < 1e-6 * np.abs(forces).max()
    said = form.checks.reactions["given"].figures
    moved = np.linalg.norm(found.positions[form.footprint.mesh.ends.ravel()] - points, axis=1)
    assert said["largest displacement of a rod end that no support holds"] == (pytest.approx(moved[free].max()), "m")
    assert said["largest displacement of a support"] == (pytest.approx(np.delete(moved, free).max()), "m")


def test_rod_ends_that_slide_are_pushed_across_their_way_alone() -> None:
    form = on(groups(rs.SlidingEnds(at="x > 7 m", along=(1.0, 0.0, 0.0))))
    sliding = form.boundary.points[:, 0] > 7
    forces = form.checks.reactions["given"].forces
    assert np.abs(forces[sliding, 0]).max() < 1e-6 * np.abs(forces).max()
    assert np.abs(forces[sliding, 2]).max() > 1e-3 * np.abs(forces).max()
    assert np.abs(forces[~sliding, 0]).max() > 0.1 * np.abs(forces).max()


def test_a_case_has_them_and_its_result_runs_again(tmp_path: Path) -> None:
    text = """
[target]
kind = "cap"
radius = "10 m"
base = "4 m"
[layout]
spacing = "3 m"
edge = "1.5 m"
[rod.section]
kind = "tube"
radius = "20.85 mm"
thickness = "3.5 mm"
[rod.material]
youngs_modulus = "25 GPa"
density = 1750
poisson_ratio = 0.3
[checks]
stages = 0
[[supports]]
at = "all"
kind = "sprung"
stiffness = "20 kN/m"
[[supports]]
at = ["U01.0", "U01.1"]
kind = "held"
"""
    (tmp_path / "case.toml").write_text(text)
    form = rs.Job.load(tmp_path / "case.toml").run()
    same = on(groups(rs.SprungEnds(stiffness=STIFF), rs.HeldEnds(at="U01.0, U01.1")))
    assert np.array_equal(form.popped["given"].positions, same.popped["given"].positions)
    written = rs.Job.load(tomllib.loads(same.case.to_toml()))  # a case that was made from objects can be written
    assert np.array_equal(written.run(until="pop-up").popped["given"].positions, same.popped["given"].positions)
    folder = form.save(tmp_path / "out", kinds=["report"])
    again = rs.Job.load(folder / "case.toml").run()
    assert np.array_equal(again.popped["given"].positions, form.popped["given"].positions)
    assert "given ends" in (folder / "report.html").read_text(encoding="utf-8")


def test_a_case_may_compare_them_with_pinned_ends() -> None:
    for ends in ("pinned", "clamped"):
        job = rs.Job.load({"supports": [{"kind": "free", "at": "y > 6 m"}], "pop_up": {"ends": ends}})
        assert [support.name for support in job.case.popped_on] == [ends, "given"]
        again = rs.Job.load(tomllib.loads(job.case.to_toml()))
        assert again.case.popped_on == job.case.popped_on
    made = rs.Job(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=["pinned", groups(rs.FreeEnds(at="y > 6 m"))])
    assert rs.Job.load(tomllib.loads(made.case.to_toml())).case.popped_on == made.case.popped_on
    three = rs.Job(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=["both", groups(rs.FreeEnds())])
    with pytest.raises(InputError, match="no case file can describe the support given"):
        three.case.to_toml()


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda: rs.FreeEnds(at="q > 1 m"), 'the rod ends of a support: give "all", names'),
        (lambda: rs.FreeEnds(at=""), "the rod ends of a support: give"),
        (lambda: rs.FreeEnds(at="y > 1 kg"), "kg"),
        (lambda: rs.SprungEnds(stiffness=-1.0), "stiffness"),
        (lambda: rs.SprungEnds(stiffness=(1.0, 2.0)), "three stiffnesses"),
        (lambda: rs.SlidingEnds(along=(0.0, 0.0, 0.0)), "must not be zero"),
        (lambda: rs.SupportGroups(groups=("free",)), "a group of supports must be"),
        (
            lambda: structure_of(on(groups(rs.SprungEnds(stiffness=STIFF))).stages, "given"),
            "supports yield, which no refinement knows",
        ),
        (
            lambda: structure_of(on(groups(rs.ClampedEnds(at="y > 6 m"))).stages, "given"),
            "supports yield, which no refinement knows",
        ),
        (lambda: on(groups(rs.FreeEnds())), "let the shell move as a whole"),
        (lambda: on(groups(rs.SprungEnds(stiffness=0.0))), "let the shell move as a whole"),
        (lambda: on(groups(rs.SprungEnds(stiffness=(1e5, 1e5, 0.0)))), "let the shell move as a whole"),
        (lambda: on(groups(rs.SlidingEnds(along=(0.0, 0.0, 1.0)))), "let the shell move as a whole"),
        (lambda: on(groups(rs.FreeEnds(), rs.HeldEnds(at="U01.0, U01.1"))), "let the shell move as a whole"),
        (lambda: on(groups(rs.FreeEnds(at="z > 90 m"))), "no rod end is where a support says"),
        (lambda: on(groups(rs.FreeEnds(at="U99.0"))), 'the rod end "U99.0", which the shell does not have'),
        (lambda: rs.Job.load({"supports": [{"kind": "free", "at": "y > 3 > 2 m"}]}), "at of support 1"),
        (lambda: rs.Job.load({"supports": [{"kind": "fixed"}]}), "fixed"),
    ],
)
def test_what_no_group_can_be_is_said(make: object, said: str) -> None:
    with pytest.raises(InputError, match="") as raised:
        make()  # type: ignore[operator]
    assert said in str(raised.value)


@cache
def clamped_form() -> rs.Form:
    return rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends="clamped")


class ClampedTwin(LoadedTwin):
    """Its clamps yield: what they turn counts as a longer piece of the rod in them, EI over the stiffness [N m/rad]."""

    def __init__(self, clamped, rod, turning):
        self.turning = turning
        super().__init__(clamped, rod)
        in_clamps = np.isin(self.bends, self.ghosts).any(axis=1)
        ends = np.where(
            np.isin(self.bends[in_clamps, 0], self.ghosts), self.bends[in_clamps, 0], self.bends[in_clamps, 2]
        )
        self.voronoi[in_clamps] += rod.bend_stiffnesses[0] / np.asarray(turning)[ends - self.nodes]


@pytest.mark.parametrize("where", ["all", "y > 6 m"])
def test_clamps_that_yield_hold_a_shell_as_in_other_code(where: str) -> None:
    form = on(groups(rs.ClampedEnds(at=where, turning=1e3)))
    points = form.boundary.points
    turning = np.where((points[:, 1] > 6) | (where == "all"), 1e3, 1e-9)
    twin = ClampedTwin(clamped_form().popped["clamped"], TUBE, turning)
    state, negative = twin.settled(twin.state, 0.0, most=20)
    assert negative == 0
    found = form.popped["given"].positions
    assert found == pytest.approx(state[: found.size].reshape(-1, 3), abs=1e-6 * form.target.size)
    twin.state = state
    factor, _ = twin.load_factor(2e-3)
    carried = form.checks.self_weight["given"].load_factor
    assert carried == pytest.approx(factor, rel=0.01)
    pinned = shell("tubes").checks.self_weight["pinned"].load_factor
    clamped = clamped_form().checks.self_weight["clamped"].load_factor
    assert 1.02 * pinned < carried < 0.98 * clamped
    moments = np.linalg.norm(form.checks.reactions["given"].moments, axis=1)
    assert np.array_equal(moments > 1e-6 * moments.max(), turning > 1)


def test_a_group_of_all_rod_ends_that_is_clamped_is_the_clamped_shell() -> None:
    same = on(groups(rs.ClampedEnds())).popped["given"]
    assert np.array_equal(same.positions, clamped_form().popped["clamped"].positions)
    assert not same.shell.yields


def test_a_shell_clamped_in_part_is_not_the_one_that_turned_ends_lead_to() -> None:
    """What turning the ends of the pinned shell leads to is held against a shell with all ends clamped, or none."""
    part = groups(rs.ClampedEnds(at="y > 6 m"))
    form = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=("pinned", part))
    assert form.archive().results.deployment.clamped.reached_from_flat is None
    whole = rs.find_form(rs.Cap(10.0, 4.0), grid(3.0, 1.5), TUBE, ends=("pinned", "clamped"))
    assert whole.archive().results.deployment.clamped.reached_from_flat is not None
