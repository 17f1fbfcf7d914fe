"""Offers of findings: each is an option that the case takes; what helps is one order, in which nothing leads back."""

import random
import re
import shlex
from functools import cache
from itertools import permutations
from pathlib import Path

import click
import pytest

import rodshell as rs
from docs.generators.findings import WHAT_TO_DO
from rodshell.case import Case
from rodshell.cli import form
from rodshell.cli.advise import case_of
from rodshell.figures.design import Design
from rodshell.figures.findings import CODES, RANKS, Finding, level_of
from rodshell.figures.sentences import SENTENCES
from rodshell.results import Archive, Verdict
from rodshell.results.offers import REMEDIES, bracing_keys, figure_of, helps, offered, offers_of, standing
from rodshell.results.wording import FORM_AGAIN

ROOT = Path(__file__).parents[2]
COARSE = {"layout.spacing": "2 m", "layout.edge": "1 m", "checks.stages": 0}
PAPER = {"layout.edge": "30 mm", "checks.stages": 0}
CASES: dict[str, tuple[str | dict[str, object], dict[str, object]]] = {
    "tubes": ("pavilion", COARSE),
    "the paper's": ("hemisphere", PAPER),
    "clamped": ("pavilion", COARSE | {"pop_up.ends": "clamped"}),
    "geodesics": ("pavilion", COARSE | {"layout.kind": "geodesic"}),
    "laths": ("pavilion", COARSE | {"rod": "lath 12x40", "rod.material.preset": "larch", "joint.kind": "pin"}),
    "seams": ("hemisphere", PAPER | {"seams.lines": "-1,-1; 1,1", "layout.spacing": "60 mm"}),
    "two spacings": ("pavilion", COARSE | {"layout.spacing": "2 m, 1.5 m"}),
    "braced": ("pavilion", COARSE | {"loads": [{"name": "own", "kind": "self_weight"}], "combinations": [
        {"name": "permanent", "factors": {"own": 1.35}}]} | bracing_keys("laths", 0.03)),
    "loads": ("pavilion", COARSE | {"loads": [{"name": "own", "kind": "self_weight"}], "combinations": [
        {"name": "permanent", "factors": {"own": 1.35}}]}),
    "stiffnesses": ({"target": {"kind": "paraboloid", "radius": 6.0, "height": 3.0}}, COARSE | {
        "rod.section.kind": "given", "rod.section.EA": 6e6, "rod.section.EI1": 700.0, "rod.section.EI2": 700.0,
        "rod.section.GJ": 180.0}),
}  # fmt: skip


GIVEN = ('--stability.imperfection "span/500"', "--joint.kind pin")  # of findings that such a case has not


@cache
def made(name: str) -> Archive:
    source, keys = CASES[name]
    return rs.Job.load(source, keys).run().archive()


def taken(case: Path, offer: str) -> Case:
    """The case that the command line makes of an offer."""
    assert shlex.split(offer)[:3] == ["rodshell", "form", "case.toml"]
    return case_of(case, offer)


@pytest.mark.parametrize("name", ["tubes", *(pytest.param(name, marks=pytest.mark.slow) for name in [*CASES][1:])])
def test_the_command_line_takes_every_offer_of_every_code(name: str, tmp_path: Path) -> None:
    """Findings on either support and either side of their limit; each offer is another case than the one it is for."""
    archive, file = made(name), tmp_path / "case.toml"
    file.write_text(archive.case_toml)
    case, offers = taken(file, FORM_AGAIN), set[str]()
    for code in CODES:
        findings = [
            Finding(code=code, support=support, figure=figure, limit=1.0)
            for support in ("pinned", "clamped", None)
            for figure in (0.4, 1.7, None)
        ]
        offers |= {offer for finding in findings for offer in offers_of(archive.results, finding)}
    assert len(offers) > 5
    for offer in offers:
        assert taken(file, offer) != case or offer.endswith(GIVEN), offer
    kinds = {shlex.split(offer)[3] for offer in offers}
    assert ("--rod" in kinds) == (name != "stiffnesses")
    assert ("--rotate" in kinds) == (name not in ("geodesics", "seams"))
    assert ("--own" in kinds) == (name not in ("braced", "loads"))
    assert ("--bracing.kind" in kinds) == (name == "loads")


@pytest.mark.slow
def test_a_design_with_given_parts_is_offered_to_be_left_open_and_one_with_none_clamped_ends(tmp_path: Path) -> None:
    archive, file = made("loads"), tmp_path / "case.toml"
    file.write_text(archive.case_toml)
    for given, count in ((("section",), 2), (("section", "bracing", "spacing"), 1)):
        results = archive.results.changed(design=Design(open=given, found=False, limits="strength", steps=()))
        offers = offers_of(results, Finding(code="no_design", level="unbuildable"))
        assert len(offers) == count
        for offer in offers:
            case = taken(file, offer)
            assert case.left_open == case.design.open == ("section", "bracing", "spacing")
        assert taken(file, offers[-1]).pop_up.ends == "clamped"


def test_what_the_command_line_does_not_take_is_seen(tmp_path: Path) -> None:
    file = tmp_path / "case.toml"
    file.write_text(rs.Job.load("pavilion").to_toml())
    for wrong in ("--spacings 1", '--rod "tube 3x32"', "--spacing"):
        with pytest.raises((rs.InputError, click.UsageError)):
            taken(file, f"{FORM_AGAIN} {wrong}")


def test_every_finding_has_a_remedy_or_says_that_no_option_mends_it() -> None:
    for code in CODES:
        text = WHAT_TO_DO[code]
        none = "No option" in text or text.startswith("Nothing has to be done")
        assert none != (code in REMEDIES), code
    assert set(REMEDIES) <= set(CODES)


@pytest.mark.parametrize(
    ("figure", "limit", "size"), [(1.2, 1, "tube 25 x 3"), (1.02, 1, "tube 25 x 3"), (1.9, 1, "tube 16 x 2.5")]
)
def test_thinner_rods_are_as_thin_as_their_bends_ask_for(figure: float, limit: float, size: str) -> None:
    """Of tubes of 32 mm: 26.7, 31.4 and 16.8 mm are asked for, and the next thinner ones that are sold are offered."""
    first, *_ = offers_of(made("tubes").results, Finding(code="strength", support="pinned", figure=figure, limit=limit))
    assert first == f'{FORM_AGAIN} --rod "{size} mm"'


def test_a_mesh_that_is_too_coarse_offers_the_edge_that_its_warning_names() -> None:
    warned = rs.Job.load("pavilion", COARSE | {"layout.edge": "2 m"}).run().verdict
    sentence, finding = next(
        (reason, each) for reason, each in zip(warned.reasons, warned.findings, strict=True) if each.code == "warning"
    )
    assert finding.offers == (f'{FORM_AGAIN} --edge "{sentence.rpartition(" of ")[2]}"',)


def test_a_deployment_that_was_not_asked_for_is_offered() -> None:
    of = Finding(code="not_checked")
    assert offers_of(made("tubes").results, of) == (f"{FORM_AGAIN} --checks.stages 8",)


@pytest.mark.parametrize(
    ("support", "offered"), [("pinned", ["clamped"]), ("clamped", ["pinned"]), (None, ["clamped"])]
)
def test_ends_are_offered_that_a_finding_is_not_about(support: str | None, offered: list[str]) -> None:
    found = offers_of(made("tubes").results, Finding(code="strength", support=support, figure=1.2, limit=1.0))
    assert [offer.split()[-1] for offer in found if "--ends" in offer] == offered


def verdict_of(draw: random.Random) -> Verdict:
    codes = draw.sample(["falls", "strength", "reserve", "off_target", "contact", "snaps", "no_loads"], 3)
    findings = tuple(
        Finding(
            code=code, level=level_of(code), figure=draw.choice([0.3, 0.9, 1.2, 1.21]), limit=draw.choice([1.0, None])
        )
        for code in codes
    )
    level = max((each.level or "good" for each in findings), key=RANKS.index)
    return Verdict(level=level, reasons=tuple(codes), findings=findings)


def test_what_helps_is_one_order_so_that_no_offers_lead_in_a_circle() -> None:
    """Of any three verdicts at most one order of them goes downwards, and none returns."""
    draw = random.Random(7)
    for _ in range(200):
        three = [verdict_of(draw) for _ in range(3)]
        for a, b, c in permutations(three):
            assert not (standing(a) < standing(b) < standing(a))
            assert not (standing(a) < standing(b) < standing(c) < standing(a))
            assert (standing(a) < standing(c)) or not (standing(a) < standing(b) < standing(c))


def test_the_level_counts_before_any_figure_and_a_fault_without_figure_before_all_others() -> None:
    def of(level: str, *findings: Finding) -> tuple[int, list[tuple[int, float]]]:
        return standing(Verdict(level=level, reasons=("a",), findings=findings))

    slight = Finding(code="reserve", level="check", figure=1.4, limit=1.5)
    worse, falls = slight.changed(figure=0.5), Finding(code="falls", level="unbuildable", figure=0.99, limit=1.0)
    assert of("good") < of("check", slight) < of("check", worse) < of("unbuildable", falls)
    assert of("unbuildable", falls) < of("unbuildable", Finding(code="unstable", level="unbuildable"))
    assert of("check", slight) < of("check", slight, Finding(code="snaps", level="check"))
    assert of("check", Finding(code="snaps", level="check")) < of("check", slight)  # something to be looked at
    assert of("check", slight) == of("check", slight.changed(figure=1.4001))


def test_a_figure_is_found_in_a_result_that_has_no_such_finding() -> None:
    """The least of the factors on the own weight, and the largest use of the strength, on each support and on both."""
    results = made("tubes").results
    weighed = {ends: each.load_factor for ends, each in results.self_weight.items()}
    assert results.bending is not None
    for ends in ("pinned", "clamped"):
        assert figure_of(results, Finding(code="falls", support=ends, figure=0.5, limit=1)) == weighed[ends]
        used = results.bending.shapes()[ends].utilisation
        assert figure_of(results, Finding(code="strength", support=ends, figure=1.5, limit=1)) == used
    assert figure_of(results, Finding(code="reserve", figure=0.5, limit=1)) == min(weighed.values())
    assert figure_of(results, Finding(code="falls_under_loads", place="winter", figure=0.5, limit=1)) is None


def test_an_offer_that_betters_its_figure_but_not_the_whole_does_not_help() -> None:
    results = made("tubes").results
    assert results.verdict is not None
    finding = Finding(code="reserve", level="check", support="pinned", figure=0.5, limit=1.5)
    before = results.verdict.changed(level="check", findings=(finding,))
    assert helps(before, finding, results)
    grave = Finding(code="contact", level="unbuildable", figure=-0.1, limit=0.0, unit="m")
    broken = results.changed(verdict=results.verdict.changed(level="unbuildable", findings=(grave,)))
    assert not helps(before, finding, broken)
    assert not helps(before, finding.changed(figure=figure_of(results, finding)), results)  # its figure is the same
    unknown = results.changed(verdict=before.changed(findings=()), self_weight={})
    assert not helps(before, finding, unknown)  # the finding is gone as nothing was checked


def test_offers_of_the_gravest_finding_come_first_and_once() -> None:
    check = Finding(code="reserve", level="check", offers=("a", "b"))
    grave, good = (
        Finding(code="falls", level="unbuildable", offers=("b", "c")),
        Finding(code="no_loads", level="good", offers=("d",)),
    )
    found = offered(Verdict(level="unbuildable", reasons=("x",), findings=(check, grave, good)))
    assert [(offer, finding.code) for offer, finding in found.items()] == [
        ("b", "falls"),
        ("c", "falls"),
        ("a", "reserve"),
    ]


ROWS = {
    "does not stand under its own weight, or carries too little of it": {
        "falls": "does not stand under its own weight", "reserve": "carries only",
    },
    "uses 140 % of the permanent design strength": {"strength": "the rods use {share} of"},
    "breaks, or uses more than its strength, during erection": {"erection_strength": "rods would break"},
    "falls under a combination, or its reserve is below 1.5": {
        "falls_under_loads": "falls under {place}", "reserve_under_loads": "times are asked for",
    },
    "the gap to the target is large": {"off_target": "deviates from the target"},
    "rods touch, or smallest angle": {"contact": "{worst}"},
    "rod ends lie above the lowest": {"ends_in_the_air": "rod ends lie up to {high} above the lowest"},
    "supports are off the end of the target": {"warning": ""},
    "creep is not known, was not checked": {
        "creep_unknown": "creep of these rods is not known", "not_checked": "was not checked",
    },
}  # fmt: skip
"""Findings of each row of the README's table, with what is said of them."""


def test_every_row_of_the_readme_is_of_findings_and_options_that_exist() -> None:
    """What a row names is an option of `rodshell form`, and one at least is offered for its findings."""
    table = (ROOT / "README.md").read_text().partition("| it says |")[2].partition("\n\n")[0]
    rows = [[cell.strip() for cell in line.split("|")[1:-1]] for line in table.splitlines()[2:]]
    assert [said for said, *_ in rows] == list(ROWS)
    known = {name for option in form.command.params for name in option.opts}
    for said, _, advice in rows:
        for code, words in ROWS[said].items():
            plain = code.removeprefix("erection_")
            assert code in CODES
            assert (
                any(words in text for name, text in SENTENCES.items() if name.partition(":")[0] == plain) or not words
            )
            named = set(re.findall(r"(--[\w.]+)", advice))
            assert named <= known, said
            finding = Finding(code=code, support="pinned", figure=0.5, limit=1.0)
            offers = " ".join(offers_of(made("tubes").results, finding)).split()
            assert not named or not offers or named & set(offers), said
