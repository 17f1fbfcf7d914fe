"""Out of time at any call of its progress, a job hands out what it has, says where it was, and invents nothing."""

from functools import cache

import numpy as np
import pytest

import rodshell as rs
from rodshell import OutOfTimeError
from rodshell import progress as module
from rodshell.progress import TimeLimit, silent
from rodshell.solve.equilibrium import Status

ROD = rs.Rod(section=rs.Circle(radius=1e-3), material=rs.Material(youngs_modulus=1e6, density=1e3))
HEMISPHERE = rs.Hemisphere(0.2)
LAYOUT = rs.GridLayout.orthogonal(spacing=0.06, edge=0.03)


@cache
def whole_form():
    return rs.find_form(HEMISPHERE, LAYOUT, ROD)


@pytest.fixture
def clock(monkeypatch):
    """A clock that goes on by a second at each call of a limited progress."""

    def ticking():
        ticking.now += 1.0
        return ticking.now

    ticking.now = 0.0
    monkeypatch.setattr(module, "monotonic", ticking)


def test_a_time_limit_raises_from_the_first_late_call_on_and_names_the_first(clock):
    calls = []
    limit = TimeLimit(lambda *call: calls.append(call), 2.0)
    limit("net", "marching", 0.0)
    limit("drape", "iteration 1", 1e-3)
    for stage in ("drape", "pop-up"):
        with pytest.raises(OutOfTimeError, match=r"out of time after 2 s in stage drape \(iteration 2\)"):
            limit(stage, "iteration 2", 1e-6)
    assert len(calls) == 4


@pytest.mark.parametrize("seconds", [0.0, -1.0, float("nan")])
def test_a_time_limit_must_be_positive(seconds):
    with pytest.raises(rs.InputError, match="time_limit must be positive"):
        rs.find_form(HEMISPHERE, LAYOUT, ROD, time_limit=seconds)


def test_out_of_time_at_any_call_the_finished_stages_are_those_of_the_whole_job(clock):
    whole, seconds, kinds = whole_form(), 0, set()
    while True:
        seconds += 1
        try:
            form = rs.find_form(HEMISPHERE, LAYOUT, ROD, time_limit=seconds - 0.5)
        except OutOfTimeError:
            kinds.add("nothing")
            continue
        if form.status == "converged":
            break
        assert form.status.startswith("out of time after ")
        late = [form.draped.report, *(shell.report for shell in form.popped.values())][-1]
        assert late.status is Status.OUT_OF_TIME
        if form.draped.converged:
            np.testing.assert_array_equal(form.draped.positions, whole.draped.positions)
        for ends, shell in form.popped.items():
            if shell.report.converged:
                np.testing.assert_array_equal(shell.positions, whole.popped[ends].positions)
        assert not any("sharply" in word or "minimum" in word for word in form.warnings)
        kinds.add(tuple(form.popped))
    assert kinds == {"nothing", (), ("pinned",), ("pinned", "clamped")}


@pytest.mark.slow
def test_checks_that_were_not_reached_are_named_and_the_result_is_not_called_converged(clock):
    form, seconds, kinds = whole_form(), 0, set()
    while True:
        seconds += 1
        result = form.finished(TimeLimit(silent, seconds - 0.5)).archive().results.plain()
        if result["status"] == "converged":
            break
        assert result["status"].startswith(f"out of time after {seconds - 0.5:g} s in stage ")
        assert result["status"] in result["warnings"]
        missing = result["status"].partition("not checked: ")[2].split(", ")
        assert "other stable shapes" in missing
        assert ("the deployment from flat" in missing) == ("deployment" not in result)
        for ends in ("pinned", "clamped"):
            assert (f"self-weight with {ends} ends" in missing) == (ends not in result["self_weight"])
        kinds.add(len(missing))
    assert kinds == {6, 4, 2, 1}  # own weight and snow, of either end condition


@pytest.mark.parametrize("method", [rs.Gravity(), rs.Fall()], ids=["gravity", "fall"])
def test_a_fall_that_is_cut_short_keeps_its_last_state(clock, method):
    layout = rs.GridLayout.orthogonal(rods=(3, 3), spacing=0.06, length=0.7, edge=0.06)
    form = rs.find_form(HEMISPHERE, layout, ROD, method=method, time_limit=3)
    assert form.status.startswith("out of time after 3 s in stage drape")
    assert form.popped == {}
    assert not any("saddle" in word for word in form.warnings)  # of an iterate that is no equilibrium
    assert np.isfinite(form.draped.positions).all()


def test_a_path_from_flat_ends_where_it_was(clock):
    form = whole_form()
    flat = rs.pop_up(
        form.footprint, form.trimmed.boundary, ROD, ends="clamped", start="flat", progress=TimeLimit(silent, 4.5)
    )
    assert flat.report.status is Status.OUT_OF_TIME
    assert "from flat" in flat.report.reason


@cache
def whole_sewn():
    return sewn_form()


def sewn_form(**options):
    layout = rs.GridLayout.orthogonal(spacing=0.08, edge=0.04)
    return rs.find_form(HEMISPHERE, layout, ROD, seams=[[(-1, 0), (1, 0)]], **options)


@pytest.mark.slow
def test_seams_end_with_the_shells_that_are_finished_or_before_all_have_their_nets(clock):
    """All patches are one shell: they are pinned before any is clamped."""
    whole, seconds, kinds = whole_sewn(), -1.5, set()
    while True:
        seconds += 4
        try:
            form = sewn_form(time_limit=seconds)
        except OutOfTimeError as error:
            kinds.add(str(error).partition(" in stage ")[2])
            continue
        if form.status == "converged":
            break
        assert form.status.startswith(f"out of time after {seconds:g} s in stage ")
        assert form.status.count("(patch ") == 1
        assert form.archive().results.plain()["status"] == form.status
        finished = []
        for patch, same in zip(form.patches, whole.patches, strict=True):
            for ends, shell in patch.popped.items():
                if shell.report.converged:
                    np.testing.assert_array_equal(shell.positions, same.popped[ends].positions)
                    finished.append(f"{patch.name} {ends}")
        kinds.add(tuple(finished))
    nothing = {kind for kind in kinds if isinstance(kind, str)}
    assert nothing == {"seams (laying patch B)"}
    assert kinds - nothing >= {(), ("A pinned", "B pinned")}


@pytest.mark.slow
def test_checks_that_any_patch_did_not_reach_are_named_and_left_out_of_the_joined_result(clock):
    form, seconds, kinds = whole_sewn(), -2.5, set()
    while True:
        seconds += 4
        result = form.finished(TimeLimit(silent, seconds)).archive().results.plain()
        if result["status"] == "converged":
            break
        assert result["status"] in result["warnings"]
        missing = result["status"].partition("not checked: ")[2].split(", ")
        assert len(set(missing)) == len(missing)
        assert ("the deployment from flat" in missing) == ("deployment" not in result)
        assert ("other stable shapes" in missing) == (set(result.get("other_shapes", ())) != {"pinned", "clamped"})
        for ends in ("pinned", "clamped"):
            assert (f"self-weight with {ends} ends" in missing) == (ends not in result["self_weight"])
        kinds.add(len(missing))
    assert kinds >= {6, 4, 2, 1}


def test_a_search_that_is_cut_short_says_what_was_best_until_then(clock):
    from rodshell.formfinding.search import search

    with pytest.raises(OutOfTimeError, match=r"search \(4 of 30\); the best of 3 tried: anchor 0,0 m, rotate"):
        search(HEMISPHERE, LAYOUT, ROD, progress=TimeLimit(silent, 3.5))
