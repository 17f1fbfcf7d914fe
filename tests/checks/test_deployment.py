"""Deployment: equilibria, found the other way round too, and whether they lead from flat to the final shape."""

import re
from collections.abc import Sequence
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

import rodshell as rs
from rodshell.checks import check
from rodshell.checks import deployment as module
from rodshell.checks.bending import bending
from rodshell.checks.deployment import LOWEST, Deployment, deploy
from rodshell.formfinding.popup import laid_below
from rodshell.formfinding.trim import Boundary
from rodshell.model import Shell
from rodshell.solve.equilibrium import find_equilibrium
from rodshell.solve.path import relax, trace
from rodshell.solve.problem import Problem, Supports
from rodshell.units import percent_text
from tests.acceptance.targets_random import random_case
from tests.checks.shells import ROD, dome, wave


def deployed(form: rs.Form, stages: int = 4) -> Deployment:
    popped = form.popped["pinned"]
    return deploy(popped.shell, popped.equilibrium, stages=stages)


def test_it_begins_flat_and_ends_in_the_popped_shell() -> None:
    way, form = deployed(dome()), dome()
    assert way.share.tolist() == [0.0, 0.0625, 0.25, 0.5625, 1.0]
    assert way.snaps == ()
    assert way.lost_at is None
    np.testing.assert_allclose(way.positions[-1], form.popped["pinned"].positions, atol=1e-8)
    assert np.ptp(way.positions[0][:, 2]) == 0
    mesh = form.footprint.mesh
    lengths = [np.linalg.norm(np.diff(one[mesh.edges], axis=1), axis=2).ravel() for one in way.positions]
    np.testing.assert_allclose(lengths[0], mesh.edge_lengths, rtol=1e-12)
    assert np.all(np.diff([np.ptp(one[:, 2]) for one in way.positions]) > 0)


def test_ends_move_straight() -> None:
    way = deployed(dome())
    ends = way.positions[:, dome().footprint.mesh.ends.ravel()]
    for share, places in zip(way.share, ends, strict=True):
        np.testing.assert_allclose(places, (1 - share) * ends[0] + share * ends[-1], atol=1e-12)


def test_a_stage_is_what_a_pop_up_from_flat_finds_there() -> None:
    """The other way round, with another start: the ends stop halfway, the grid rises from an arch."""
    way = deployed(dome())
    share, stage = way.share[3], way.positions[3]
    mesh = dome().footprint.mesh
    points = stage[mesh.ends.ravel()]
    risen = rs.pop_up(dome().footprint, Boundary(points, np.zeros_like(points)), ROD, ends="pinned", start="flat")
    assert risen.report.converged
    assert share == 0.5625
    np.testing.assert_allclose(risen.positions, stage, atol=1e-6)  # two solves to a step of 1e-6 of the size


def test_stages_do_not_depend_on_their_number() -> None:
    few, many = deployed(dome(), 4), deployed(dome(), 8)
    np.testing.assert_allclose(few.positions, many.positions[::2], atol=1e-7)


def test_stages_guessed_from_those_before_are_those_that_are_followed_to(monkeypatch: pytest.MonkeyPatch) -> None:
    ahead, reached = module._Path._ahead, list[bool]()

    def noted(*args: object) -> object:
        found = ahead(*args)  # type: ignore[arg-type]
        reached.append(found is not None)
        return found

    monkeypatch.setattr(module._Path, "_ahead", noted)
    guessed = deployed(dome(), 8)
    assert reached == [False] + 6 * [True]  # the first has but one before it
    monkeypatch.setattr(module._Path, "_ahead", lambda *_: None)
    np.testing.assert_allclose(guessed.positions, deployed(dome(), 8).positions, atol=1e-9)  # both solved to 2e-11


def test_a_pattern_serves_only_the_shell_that_it_is_of() -> None:
    """The bits are the same with a shell's own pattern, with another shell's, and without."""
    shell, other = dome().popped["pinned"], wave().popped["pinned"]
    alone = deployed(dome())
    for popped in (shell, other):
        pattern = popped.equilibrium.problem.pattern
        start = replace(shell.equilibrium, problem=replace(shell.equilibrium.problem, pattern=pattern))
        way = deploy(shell.shell, start, stages=4)
        np.testing.assert_array_equal(way.positions, alone.positions)


def test_every_stage_of_laths_is_in_equilibrium_by_its_own_frames() -> None:
    """The gradient of the energy vanishes on all that is free, twist angles of the rods included."""
    lath = rs.Rod(rs.RectangularSection(width=2e-3, height=1e-3), ROD.material)
    layout = rs.GridLayout.orthogonal(rods=(5, 5), spacing=0.09, edge=0.03)
    form = rs.find_form(rs.Hemisphere(0.2), layout, lath, joint=rs.Pin(), ends=("pinned",))
    way = deployed(form)
    assert len(way.shells) == 4
    for shell, state in way.shells:
        gradient = np.zeros_like(state)
        energy = sum(one.evaluate(state, gradient) for one in (*shell.elements, shell.stretch))
        unbalanced = np.abs(shell.held_ends().reduce(gradient)).max() / (energy / 0.2)
        assert unbalanced < 1e-8  # 4e-10 measured; 0.002 to 1.5 by the frames of the final shell


def energy_of(shell: Shell, state: np.ndarray) -> float:
    unused = np.zeros_like(state)
    return sum(one.evaluate(state, unused) for one in (*shell.elements, shell.stretch))


@pytest.mark.slow
def test_a_shell_that_rises_by_itself_is_not_said_to_need_a_push() -> None:
    """The path backwards has gaps; another path forwards, from arches and with other steps, ends in this very shell."""
    form, way = wave(), deployed(wave(), 8)
    risen = rs.pop_up(form.footprint, form.trimmed.boundary, ROD, ends="pinned", start="flat")
    np.testing.assert_allclose(risen.positions, form.popped["pinned"].positions, atol=1e-8)
    assert way.reached_from_flat
    (words,) = way.warnings
    assert words.startswith("at 82 % of the deployment from flat the shell snaps forward by itself, by up to 7.")
    np.testing.assert_allclose(way.positions[-1], form.popped["pinned"].positions, atol=1e-8)


@cache
def snapping() -> tuple[rs.Form, Deployment]:
    _, target, layout, anchor = random_case(10)
    form = rs.find_form(target, layout, ROD, anchor=anchor, ends=("pinned",))
    return form, deployed(form, 8)


def driven(form: rs.Form, way: Deployment, stage: int, shares: Sequence[float]) -> list[np.ndarray]:
    """Shapes of a stage and after it, its ends driven to each of the shares in turn, down the steepest descent."""
    shell, state = way.shells[stage]
    shapes, begin = [shell.positions(state)], float(way.share[stage + 1])
    first, last = state[shell.ends], form.popped["pinned"].state[shell.ends]
    for share in shares:
        state = state.copy()
        state[shell.ends] = first + (share - begin) / (1 - begin) * (last - first)
        problem = Problem(
            shell.elements, shell.stretch, Supports(shell.held_ends()), 0.2, flat_coordinates=shell.flat_coordinates
        )
        there = relax(problem, state)
        assert there.report.stable
        shell, state = shell.with_elements(there.elements), there.state
        shapes.append(shell.positions(state))
    return shapes


def moved(shapes: Sequence[np.ndarray]) -> np.ndarray:
    """How far the node goes that goes farthest, from each shape to the next [m]."""
    return np.linalg.norm(np.diff(shapes, axis=0), axis=2).max(axis=1)


@pytest.mark.slow
def test_a_snap_of_little_energy_is_named_and_is_not_undone() -> None:
    """Of 0.2 % of it. In steps of 1/1000 down the steepest descent: one jump, where it is named, and on the
    way back another shape."""
    _, target, layout, anchor = random_case(1)
    form = rs.find_form(target, layout, ROD, anchor=anchor, ends=("pinned",))
    way = deployed(form, 8)
    ((start, stop),), (by,) = way.snaps, way.snapped_by
    stage = int(np.searchsorted(way.share, start)) - 2
    shares = np.arange(way.share[stage + 1] + 1e-3, stop + 0.005, 1e-3).tolist()
    shapes = driven(form, way, stage, [*shares, *shares[::-1]])
    ahead = moved(shapes[: len(shares) + 1])
    jump = int(np.argmax(ahead))
    assert start <= shares[jump] <= stop + 1e-3
    assert ahead[jump] == pytest.approx(by, rel=0.1)
    assert ahead[jump] > 10 * np.sort(ahead)[-2]
    assert np.linalg.norm(shapes[jump] - shapes[2 * len(shares) - jump + 1], axis=1).max() > 0.5 * by


@pytest.mark.slow
def test_a_fork_next_to_flat_is_no_snap_and_is_undone() -> None:
    """There the wave rises by 4 mm while its ends go 1 % of their way, and comes back the same way."""
    form, way = wave(), deployed(wave(), 8)
    shares = np.linspace(way.share[1], 0.036, 30).tolist()
    shapes = driven(form, way, 0, [*shares, *shares[::-1]])
    assert np.linalg.norm(shapes[30] - shapes[0], axis=1).max() > 4e-3
    np.testing.assert_allclose(shapes[-1], shapes[0], atol=1e-6)
    assert all(start > 0.1 for start, _ in way.snaps)


@pytest.mark.slow
def test_a_snap_forward_is_named_with_its_place_and_its_end() -> None:
    """From the stage before it, in steps of 1/200 down the steepest descent: it snaps there."""
    form, way = snapping()
    assert way.reached_from_flat
    ((start, stop),), (by,) = way.snaps, way.snapped_by
    begin = float(way.share[-2])
    shares = [*np.linspace(begin, 0.98, 8).tolist()[1:], 0.985, 0.99, 0.995, 1.0]
    shapes = driven(form, way, len(way.shells) - 2, shares)
    jumps = list(zip(shares, moved(shapes), strict=True))
    np.testing.assert_allclose(shapes[-1], form.popped["pinned"].positions, atol=1e-6)
    share, moved_by = max(jumps[7:], key=lambda one: one[1])
    assert start <= share <= stop
    assert moved_by == pytest.approx(by, rel=0.3)  # the steps begin and end elsewhere
    assert moved_by > 5 * jumps[7][1]


def test_many_snaps_are_counted() -> None:
    (words,) = deployed(frequent(), 8).warnings
    many, *_ = re.findall(r"^(\d+) times from (\d+) % to (\d+) % of the deployment", words)
    assert int(many[0]) == len(deployed(frequent(), 8).snaps)
    assert words.endswith("; a small difference can make it snap elsewhere")


@pytest.mark.slow
def test_snaps_are_said_to_go_on_to_the_final_shape() -> None:
    _, way = snapping()
    (words,) = way.warnings
    assert words.startswith("at 99 % of the deployment from flat the shell snaps forward by itself, by up to ")
    assert words.endswith(" mm, and continues to its final shape")


def test_every_stage_of_a_path_forwards_is_a_stable_equilibrium_with_its_ends_on_their_lines() -> None:
    form, way = snapping()
    ends = way.positions[:, form.footprint.mesh.ends.ravel()]
    assert way.share.tolist() == [(k / 8) ** 2 for k in range(9)]
    for share, places, (shell, state) in zip(way.share[1:], ends[1:], way.shells, strict=True):
        np.testing.assert_allclose(places, (1 - share) * ends[0] + share * ends[-1], atol=1e-12)
        problem = Problem(
            shell.elements, shell.stretch, Supports(shell.held_ends()), 0.2, flat_coordinates=shell.flat_coordinates
        )
        found = find_equilibrium(problem, state, shell.stretch.stiffness * shell.stretch.strains(state))
        assert found.report.stable
        np.testing.assert_allclose(found.state, state, atol=1e-8)


@cache
def frequent() -> rs.Form:
    """A shell that snaps several times between flat and its final shape."""
    _, target, layout, anchor = random_case(12)
    return rs.find_form(target, layout, ROD, anchor=anchor, ends=("pinned",))


def test_a_path_forwards_that_snaps_often_is_not_given_up_before_it_arrives() -> None:
    """Backwards it ends next to the final shape, so that all stages are those of the path forwards."""
    way = deployed(frequent(), 8)
    assert way.reached_from_flat
    assert way.lost_at is None
    assert way.snaps
    for share, (shell, state) in zip(way.share[1:], way.shells, strict=True):
        supports, forces = Supports(shell.held_ends()), shell.stretch.stiffness * shell.stretch.strains(state)
        found = find_equilibrium(Problem(shell.elements, shell.stretch, supports, 0.2), state, forces)
        assert found.report.stable, share
        np.testing.assert_allclose(found.state, state, atol=1e-8)


def test_a_lost_path_leaves_stages_out_and_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    """Backwards it ends at 56 %, and forwards nothing is found."""
    trace = module.trace

    def gives_up(problem_at, here, start, stop, **options):  # type: ignore[no-untyped-def]
        way = trace(problem_at, here, start, stop, **options)
        return way if stop > 0.5 and not options["snap"] else replace(way, t=start)

    monkeypatch.setattr(module, "trace", gives_up)
    monkeypatch.setattr(module._Path, "_ahead", lambda *_: None)
    way = deployed(dome())
    assert way.share.tolist() == [0.0, 0.5625, 1.0]
    assert len(way.positions) == 3
    assert way.lost_at == 0.5625
    assert way.reached_from_flat is None
    (words,) = way.warnings
    assert words == (
        "the deployment could not be followed all the way: from flat up to 1.6 %, and from the final shape back down "
        "to 1.6 %; stages are missing, and whether the shell reaches its final shape from flat is not known"
    )


def test_a_lost_path_says_from_both_ends_where_and_in_what_point(monkeypatch: pytest.MonkeyPatch) -> None:
    """The limit point by arc length, against steps of the share that shrink until Newton's method fails."""
    popped = frequent().popped["pinned"]
    monkeypatch.setattr(module, "MOST", 300)
    way = deploy(popped.shell, popped.equilibrium, stages=8)
    assert way.lost_at == 1.0
    assert way.gap is not None
    assert way.gap.limit == "limit point"
    path = module._Path(popped.shell, popped.equilibrium, lambda share: None)
    (stage,) = path.backwards(popped.equilibrium, [1.0])
    short = trace(
        lambda share: path._problem(share, popped.shell.elements), stage[1], 1.0, 0.5,
        shortest=1e-4, snap=False, most_factorizations=1000,
    )  # fmt: skip
    assert way.gap.left == pytest.approx(short.t, abs=4e-4)
    assert LOWEST < way.gap.reached < 1
    (words,) = way.warnings
    assert f"from flat up to {percent_text(way.gap.reached)}, " in words
    assert f"down to {percent_text(way.gap.left)}, where the path ends in a limit point" in words


@pytest.mark.slow
def test_the_worst_bend_may_be_on_the_way() -> None:
    """The wave ends flatter than it is on its way: the final state alone would hide it."""
    form = wave()
    checks = check(form.popped, ROD, stages=8)
    final = checks.bending["pinned"].curvature.max()
    assert max(bent.curvature.max() for bent in checks.deployment_bending) > 1.5 * final


def test_the_bending_of_a_stage_is_that_of_its_shape() -> None:
    checks, mesh = check(dome().popped, ROD, stages=4), dome().footprint.mesh
    assert checks.deployment is not None
    for bent, shape in zip(checks.deployment_bending, checks.deployment.positions, strict=True):
        np.testing.assert_allclose(bent.curvature, bending(mesh, shape, ROD).curvature, atol=1e-9)


def test_no_stages_no_deployment() -> None:
    form = dome()
    checks = check(form.popped, ROD, stages=0)
    assert checks.deployment is None
    assert set(checks.bending) == {"pinned", "clamped"}


def test_the_flat_grid_is_laid_under_the_shell_whichever_way_that_is_turned() -> None:
    """A shell that is the flat grid itself, turned, moved and lifted, lies right over it."""
    mesh, angle = dome().footprint.mesh, 0.7
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    there = mesh.flat @ turn.T + np.array([3.0, -2.0, 0.5])
    ends = there[mesh.ends.ravel()]
    np.testing.assert_allclose(laid_below(mesh, ends, 0.5), there, atol=1e-12)
    ends[::2, 2] += 0.1  # starts higher than ends: the ways in the plane stay the same
    np.testing.assert_allclose(laid_below(mesh, ends, 0.5), there, atol=1e-12)
