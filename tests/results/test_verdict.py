"""The verdict as a function of the figures: what makes a result good, what has to be checked, what cannot be built."""

from copy import deepcopy
from typing import Any

import pytest

from rodshell.results import Results, Verdict
from rodshell.results.verdict import facts, verdict, verdict_of
from rodshell.results.wording import rounded_down


def good() -> dict[str, Any]:
    """Figures of a shell without any fault, 4 m wide."""
    both = ("pinned", "clamped")
    return {
        "status": "converged",
        "warnings": [],
        "target": {"kind": "cap", "reference_size": 2.0},
        "boundary": [[-2.0, -2.0, 0.0], [2.0, 2.0, 0.0]],
        "pop_up": {ends: {"status": "converged", "stable": True, "negative_modes": 0} for ends in both},
        "agreement": {
            "pinned": {"max": 0.03, "max_relative": 0.015, "rms": 0.01, "where": [0.0, 0.0, 1.0]},
            "clamped": {"max": 0.002, "max_relative": 0.001, "rms": 0.001, "where": [0.0, 0.0, 1.0]},
        },
        "bending": {
            "strength": 1e8,
            **{key: {"utilisation": 0.4, "max_bending_strain": 0.004} for key in (*both, "pop_up", "deployment")},
        },
        "contact": {key: {"clearance": 0.2, "pairs": 0, "rods": ["U1", "U2"], "where": [0, 0, 0]} for key in both},
        "self_weight": {
            "pinned": {"load_factor": 3.0, "deflection": 0.01, "limit": "bifurcation"},
            "clamped": {"load_factor": None, "deflection": 0.001, "limit": "none"},
        },
        "other_shapes": {"pinned": {"tried": 4, "found": []}, "clamped": {"tried": 4, "found": []}},
        "deployment": {
            "stages": [{"share": 0.0}, {"share": 0.5}, {"share": 1.0}],
            "snaps": [],
            "lost_at": None,
            "guided": None,
            "reached_from_flat": True,
            "clamped": {"reached_from_flat": True},
        },
    }


def changed(*changes: tuple[str, Any]) -> Results:
    """The good figures with some of them, named by paths such as "pop_up.pinned.stable", replaced."""
    return Results.model_validate(figures(*changes))


def figures(*changes: tuple[str, Any]) -> dict[str, Any]:
    """The plain content of `changed`."""
    result = deepcopy(good())
    for path, value in changes:
        *tables, key = path.split(".")
        entry = result
        for table in tables:
            entry = entry[table]
        if value is MISSING:
            del entry[key]
        else:
            entry[key] = value
    return result


MISSING = object()
OF_GFRP = [
    ("strength", {"permanent": 8e7, "erection": 1.2e8}), ("bending.erection_strength", 1.2e8),
    ("bending.strength_of", "gfrp"),
    ("rod", {"preset": {"name": "gfrp", "bending_strength": 2.4e8}}),
]  # fmt: skip
TOUCHING = {"clearance": -0.003, "pairs": 5, "rods": ["U03", "U04"], "where": [0.1, 0.2, 0.3]}


def test_a_result_without_fault_is_good_and_says_what_was_not_checked() -> None:
    found = verdict(changed())
    assert found.level == "good"
    assert found.headline == (
        "Good: with pinned and clamped ends the shell is stable and carries at least 3 times its own weight; with "
        "clamped ends the gap to the target is at most 0.1 % of its size"
    )
    assert "(snow, wind, people) and imperfections were not checked" in found.reasons[-1]


@pytest.mark.parametrize("fault", [
    ("stable", False), ("status", "stalled"), ("utilisation", 1.2), ("max_bending_strain", 0.12), ("contact", TOUCHING),
])  # fmt: skip
def test_one_end_condition_with_a_fault_is_to_be_checked_and_two_cannot_be_built(fault: tuple[str, Any]) -> None:
    name, value = fault
    table = {"stable": "pop_up.{}.stable", "status": "pop_up.{}.status", "contact": "contact.{}"}
    path = table.get(name, "bending.{}." + name)
    one = verdict(changed((path.format("pinned"), value)))
    assert one.level == "check"
    assert "pinned ends" in one.headline
    both = verdict(changed((path.format("pinned"), value), (path.format("clamped"), value)))
    assert both.level == "unbuildable"
    assert both.headline.startswith("Not buildable: ")
    assert {"pinned", "clamped"} == {ends for ends in ("pinned", "clamped") if any(ends in r for r in both.reasons)}


def test_different_faults_of_all_end_conditions_leave_none_to_build() -> None:
    found = verdict(changed(("pop_up.pinned.stable", False), ("bending.clamped.utilisation", 1.3)))
    assert found.level == "unbuildable"


@pytest.mark.parametrize(
    ("changes", "words"),
    [([("bending.deployment", {"utilisation": 1.69, "share": 0.25, "rod": "U03", "at": 0.2})],
      "at 25 % of the deployment the rods would break: 169 % of their strength in U03, 200 mm from its"),
     ([("bending.deployment", {"utilisation": 2.01, "share": 0.25}), *OF_GFRP],
      "at 25 % of the deployment the rods use 201 % of gfrp's design strength for erection"),
     ([("bending.pinned.utilisation", 1.14), ("bending.clamped.utilisation", 1.0001), *OF_GFRP],
      "with pinned ends the rods use 114 % of gfrp's permanent design strength"),
     ([("bending.deployment.max_bending_strain", 0.08)], "too thick for this curvature"),
     ([("contact.deployment", TOUCHING)], "5 pairs of rods touch or cross, worst: U03 and U04 overlap by 3.00 mm"),
     ([("target.flat", True)], "the target is flat, nothing pops up"),
     ([("agreement.pinned.max_relative", 0.2), ("agreement.clamped.max_relative", 0.051)], "deviates from the target"),
     ([("pop_up", {}), ("status", "drape stalled")], "did not converge: drape stalled")],
)  # fmt: skip
def test_what_no_support_can_cure_cannot_be_built(changes: list[tuple[str, Any]], words: str) -> None:
    found = verdict(changed(*changes))
    assert found.level == "unbuildable"
    assert words in found.headline


def test_no_more_is_promised_than_the_shell_carries() -> None:
    factor = ("self_weight.pinned.load_factor", 4.7152)
    assert "carries at least 4.71 times its own weight" in verdict(changed(factor)).headline
    for value, shown in ((3.0, "3"), (0.3, "0.3"), (0.99961, "0.999"), (1234.9, "1230"), (0.0, "0")):
        assert rounded_down(value) == shown


def test_a_shell_that_cannot_be_built_says_too_that_it_does_not_carry_its_own_weight() -> None:
    broken = [(f"bending.{ends}.utilisation", 1.2) for ends in ("pinned", "clamped")]
    found = verdict(changed(*broken, ("self_weight.pinned.load_factor", 0.42)))
    assert found.level == "unbuildable"
    assert any("it carries only 42 % of its own weight with pinned ends" in reason for reason in found.reasons)


@pytest.mark.parametrize(
    ("changes", "words"),
    [([("agreement.pinned.max_relative", 0.2), ("agreement.clamped.max_relative", 0.021)], "deviates from the target"),
     ([("self_weight.pinned.load_factor", 0.024), ("self_weight.clamped.load_factor", 0.051)],
      "2.4 % of its own weight with pinned ends and 5.1 % of its own weight with clamped ends"),
     ([("self_weight", MISSING)], "own weight was not checked"),
     ([("deployment", MISSING)], "reached from flat was not checked: "),
     ([("other_shapes.clamped.found", [{"distance": 0.49, "energy": 1.16, "mirror": False}])],
      "another stable shape, 49 % of its size away at 1.16 times the energy"),
     ([("bending.strength", None)], "no strength was given"),
     ([("contact", MISSING)], "whether rods touch and are thin enough for their curvature was not checked"),
     ([("bending.clamped.max_bending_strain", None)], "rod.section.fibre_distances"),
     ([("agreement.pinned", MISSING)], "the gap to the target was not checked"),
     ([("deployment.clamped.reached_from_flat", None)], "whether the clamped shape is reached from the pinned one"),
     ([("bending.strength_of", "larch"), ("bending.pinned.utilisation", 0.99)], "permanently use 99 %"),
     ([("bending.deployment", {"utilisation": 1.99, "share": 0.25}), *OF_GFRP],
      "the ends moved evenly, the rods use 199 % of gfrp's design strength for erection: erect it in another way"),
     ([("deployment", MISSING), ("status", "out of time after 3 s: not checked: the deployment from flat"),
       ("warnings", ["out of time after 3 s: not checked: the deployment from flat"])], "was not checked"),
     ([("pop_up.pinned.stable", None)], "stable was not checked"),
     ([("status", "out of time after 10 s: checks are missing")], "not complete: out of time"),
     ([("warnings", ["the smallest angle is 14 degrees"])], "the smallest angle is 14 degrees")],
)  # fmt: skip
def test_what_has_to_be_looked_at_first(changes: list[tuple[str, Any]], words: str) -> None:
    found = verdict(changed(*changes))
    assert found.level == "check"
    assert any(words in reason for reason in found.reasons)


@pytest.mark.parametrize(
    "changes",
    [[("other_shapes.clamped.found", [{"distance": 0.7, "energy": 1.1, "mirror": False}])],
     [("other_shapes.clamped.found", [{"distance": 0.3, "energy": 1.6, "mirror": False}])],
     [("other_shapes.clamped.found", [{"distance": 0.3, "energy": 1.0, "mirror": True}])],
     [("bending.strength", None), ("boundary", [[0.0, 0.0, 0.0], [0.9, 0.9, 0.0]])],
     [("bending.strength_of", "larch"), ("bending.deployment.utilisation", 0.99)],
     [("bending.pinned.utilisation", 0.99)],
     [("agreement.pinned.max_relative", 0.5)],
     [("bending.pinned.utilisation", 1.0)]],
)  # fmt: skip
def test_what_does_not_matter_leaves_a_result_good(changes: list[tuple[str, Any]]) -> None:
    assert verdict(changed(*changes)).level == "good"


def test_the_gravest_reason_comes_first() -> None:
    changes = [(f"pop_up.{ends}.stable", False) for ends in ("pinned", "clamped")]
    found = verdict(changed(("warnings", ["a long tail"]), *changes))
    assert "unstable" in found.headline
    assert found.reasons[-1] == "a long tail"


def test_the_verdict_of_a_result_is_the_one_that_it_holds() -> None:
    held = changed(("verdict", {"level": "check", "reasons": ["so it was"]}))
    assert verdict_of(held) == Verdict(level="check", reasons=("so it was",))
    assert verdict_of(changed()) == verdict(changed())


def test_supports_are_recommended_only_where_both_can_be_used() -> None:
    advice = "improve little here: pinned ones are enough"
    close = ("agreement.pinned", {"max": 0.003, "max_relative": 0.0015})
    near = changed(close)
    assert any(advice in fact for fact in facts(near))
    far = changed(("agreement.pinned", {"max": 0.531, "max_relative": 0.26}),
                  ("agreement.clamped", {"max": 0.53, "max_relative": 0.26}))  # fmt: skip
    assert not any(advice in fact for fact in facts(far))
    near = changed(close, ("pop_up.pinned.stable", False))
    assert not any(advice in fact or "of the gap that" in fact for fact in facts(near))


def test_what_was_not_reached_in_time_is_said_once_and_without_advice() -> None:
    late = "out of time after 3 s in stage deployment; not checked: the deployment from flat"
    found = verdict(changed(("deployment", MISSING), ("status", late), ("warnings", [late])))
    assert found.level == "check"
    assert sum(late in reason for reason in found.reasons) == 1
    assert not any("checks.stages" in reason for reason in found.reasons)


def test_without_a_pinned_shell_the_deployment_is_not_blamed_on_options() -> None:
    found = verdict(changed(("deployment", MISSING), ("pop_up.pinned.status", "stalled")))
    assert any("not checked, since the pinned shell was not found" in reason for reason in found.reasons)
    assert not any("checks.stages" in reason or "no strength" in reason for reason in found.reasons)


def test_no_more_than_a_lower_bound_is_made_of_a_path_that_was_lost() -> None:
    lost = {"load_factor": 0.12, "deflection": None, "limit": "not followed"}
    words = "with pinned ends the shell carries at least 12 % of its own weight; above, its path could not be followed"
    found = verdict(changed(("self_weight.pinned", lost), ("warnings", [words])))
    assert found.reasons == (words,)


def test_dips_are_no_cause_where_joints_hold_the_net() -> None:
    gaps = {ends: {"max": 2 * off, "max_relative": off} for ends, off in (("pinned", 0.04), ("clamped", 0.03))}
    bound = ("drape", {"method": "bound"})
    off = [verdict(changed(("agreement", gaps), bound, ("joint", {"kind": kind}))) for kind in ("pin", "rigid")]
    assert ["dips and ridges" in found.headline for found in off] == [True, False]


def test_guiding_is_no_part_of_what_is_known_of_the_strength() -> None:
    (said,) = [fact for fact in facts(changed(("deployment.guided", [0.77, 1.0]))) if "strength" in fact]
    assert said.endswith("the stress while the shell is guided from 77 % to 100 % is not known.")
