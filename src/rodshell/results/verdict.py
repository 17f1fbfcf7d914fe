"""The verdict on a result, computed once from all that was found: good, check, unbuildable or unknown, and the
reasons.

Summary, report, JSON and exit code show what stands here and judge nothing themselves. A figure that is missing was
not checked, and then the result is not good.
"""

from collections.abc import Iterable, Iterator
from math import inf, isinf

from rodshell.figures.findings import RANKS, Finding, Level, Said, level_of, said
from rodshell.figures.records import Ends
from rodshell.figures.sentences import SENTENCES
from rodshell.results.judged.deployment import deployment_points, erection_faults, laid_out
from rodshell.results.judged.loads import (
    cable_points,
    creep_unknown,
    is_braced,
    least_carried,
    load_faults,
    load_points,
    lowered,
)
from rodshell.results.judged.own_weight import falling, none_stands, reserve, weight_findings
from rodshell.results.judged.shape import (
    BUCKLED,
    CONVERGED,
    FAR_OFF,
    OFF,
    contact_faults,
    met_on_the_way,
    near_shapes,
    nearest,
    off_target,
    sinking,
    status_of,
    unstable,
)
from rodshell.results.judged.stress import fibre_faults, rod_points
from rodshell.results.judged.supports import air_findings, beam_faults, beams_to_check
from rodshell.results.offers import offers_of
from rodshell.results.results import Results, Verdict
from rodshell.results.wording import percent, rounded, rounded_down, shown_factor, snow_text

FLAT = SENTENCES["flat"]


def verdict_of(results: Results) -> Verdict:
    """The verdict that a result holds, or that on its figures (results of versions before verdicts)."""
    return results.verdict or verdict(results)


def verdict(results: Results) -> Verdict:
    """The verdict on the figures of a result; one that is missing counts as not checked.

    An end condition can be used if its shell converged, is stable and carries its own weight, its rods do not touch,
    hold, and are thin enough for their bends. Without one that can be used, or far off the target, the result is
    unbuildable; unknown if one that might be was not computed: a computation that does not converge says nothing about
    the shell, nor of its own weight that could not be followed, if the shell falls with the other ends. The deployment
    that is computed is one of several ways to erect the shell: what breaks on it has to be checked, but where rods of
    the flat grid touch, no way begins.

    The gravest reason comes first: that there is no shell, or none that is stable unloaded; that none is known to stand
    under its own weight; that shells break, touch or fall under loads; the gap to the target; what else is not known;
    then the warnings.
    """
    shells = results.pop_up
    faults = {ends: [*shell_faults(results, ends)] for ends in shells}
    usable = [ends for ends, found in faults.items() if not found]
    deployment = [] if met_on_the_way(results) else [*contact_faults(results, "deployment")]
    lost = [ends for ends, shell in shells.items() if status_of(shell) not in (CONVERGED, BUCKLED)]
    in_order = [*(ends for ends in shells if ends not in lost), *lost]  # what is known of a shell comes first
    grave = [sentence for ends in in_order for sentence in faults[ends]] + deployment + [*erection_faults(results)]
    if results.target and results.target.flat:
        warned = [word for word in results.warnings if word.startswith(FLAT)]
        return _verdict(results, "unbuildable", [Said(word, said("flat").finding) for word in warned or [FLAT]])
    failed = [] if results.status == CONVERGED else [said("not_computed", status=results.status)]
    if not shells:
        return _verdict(results, "unknown", failed or [said("not_computed: nothing")])
    best = nearest(results, usable)
    off = 0.0 if best is None else best[1].max_relative or 0.0
    far = [off_target(results, *best)] if best is not None and off > OFF else []
    there = [ends for ends in shells if status_of(shells[ends]) == CONVERGED and shells[ends].stable is not False]
    weight, stands = weight_findings(results, usable or there)
    lead = weight if there and not stands else []
    lead = [*_not_designed(results), *lead]
    gravest = [*lead, *far, *grave] if off > FAR_OFF else [*lead, *grave, *far]
    to_check = [
        *gravest, *weight, *sinking(results, usable), *load_points(results, usable or there),
        *creep_unknown(results), *beams_to_check(results), *air_findings(results), *_open_points(results, usable),
        *(word if isinstance(word, Said) else Said(word) for word in results.warnings),
    ]  # fmt: skip
    standing, in_doubt = set(usable) - falling(results), none_stands(results, usable, lost)
    if lost and not standing and not deployment:
        return _verdict(results, "unknown", [*failed, *in_doubt, *to_check])
    if not standing or deployment or off > FAR_OFF:
        return _verdict(results, "unbuildable", to_check)
    if in_doubt:
        return _verdict(results, "unknown", [*in_doubt, *to_check])
    if to_check:
        return _verdict(results, "check", [*to_check, *laid_out(results), *_assumed(results)])
    return _verdict(results, "good", [*_merits(results, usable), *laid_out(results), *_assumed(results)])


def _verdict(results: Results, level: Level, reasons: Iterable[Said]) -> Verdict:
    """Each reason once, with what it says in figures; what rules out one shell is less grave where another stands."""
    once = dict[str, Finding]()
    for each in reasons:
        finding = each.finding
        far = finding.code == "off_target" and (finding.figure or 0.0) > FAR_OFF
        alone = "unbuildable" if far else level_of(finding.code)
        offers = tuple(dict.fromkeys([*finding.offers, *offers_of(results, finding, each)]))
        once.setdefault(str(each), finding.changed(level=min(alone, level, key=RANKS.index), offers=offers))
    stands_alone = level in ("good", "check") and not results.loads
    return Verdict(
        level=level, unloaded=stands_alone or None, reasons=tuple(once), findings=tuple(once.values())
    )  # fmt: skip


def shell_faults(results: Results, ends: Ends) -> Iterator[Said]:
    """Why the shell with these ends cannot be built."""
    shell = results.pop_up[ends]
    if status_of(shell) != CONVERGED:
        yield said("not_computed: pop-up", ends, status=shell.status)
        return
    yield from unstable(shell, ends)
    yield from contact_faults(results, ends)
    yield from fibre_faults(results, ends)
    yield from load_faults(results, ends)
    yield from beam_faults(results, ends)


def _open_points(results: Results, usable: list[Ends]) -> Iterator[Said]:
    """What has to be looked at although the shell can be built, and what is not known; more is among the warnings."""
    shells, status = results.pop_up, results.status
    stopped = any(status_of(shell) != CONVERGED for shell in shells.values())
    if status not in (CONVERGED, "unknown") and not stopped and not any(status in word for word in results.warnings):
        yield said("not_computed: job", status=status)
    if any(shells[ends].stable is None for ends in usable):
        yield said("not_checked: stability")
    yield from deployment_points(results, usable, late=status != CONVERGED)
    yield from near_shapes(results, usable)
    yield from rod_points(results, usable)
    if results.target and not set(usable) <= set(results.agreement):
        yield said("not_checked: gap")


def _merits(results: Results, usable: list[Ends]) -> Iterator[Said]:
    """Why a result is good."""
    braced = is_braced(results)
    weighed = [results.self_weight[ends] for ends in usable]
    borne = [each.braced_factor if braced else each.load_factor for each in weighed]
    least = min((factor for factor in borne if factor is not None), default=None)
    weight = "at least " * (least is not None and len(usable) > 1) + shown_factor(least)
    gaps = [
        f"{percent(gap.max_relative)} with {ends} ends"
        for ends in usable
        if (gap := results.agreement.get(ends)) and gap.max_relative is not None
    ]
    near = f"; the gap to the target is at most {' and '.join(gaps)}, of its size" if gaps else ""
    yield said(
        "stands", usable[0] if len(usable) == 1 else None, least, reserve(results), all=" and ".join(usable),
        bracing=" with its bracing" * braced, weight=weight, asked=rounded(reserve(results)), near=near,
    )  # fmt: skip
    if not results.loads:
        known = results.strength is not None and results.strength.creep is not None
        snow = [f"{snow_text(results.snow[ends])} with {ends} ends" for ends in usable if ends in results.snow]
        yield said(
            "no_loads",
            snow=f"; on top of its weight it carries even snow up to {' and '.join(snow)}" if snow else "",
            creep="" if known else ", nor creep, which is not known of these rods",
        )
    for name, by_ends in results.loads.items():
        factor, what = min((least_carried(by_ends[ends]) for ends in usable if ends in by_ends), default=(inf, ""))
        least = None if isinf(factor) else factor
        lower, share = min((lowered(results, by_ends[ends]) for ends in usable if ends in by_ends), default=(inf, ""))
        words = f", and {rounded_down(lower)} times with {share}" if share else ""
        carries = shown_factor(least)
        yield said("stands_under_loads", None, least, 1, place=name, factor=carries, what=what, stiffness=words)


def _not_designed(results: Results) -> Iterator[Said]:
    """That nothing that was left open carries the loads, and what limits."""
    if (design := results.design) is not None and not design.found:
        yield said("no_design", count=len(design.steps), limits=design.limits)


def _assumed(results: Results) -> Iterator[Said]:
    """What was taken or chosen where nothing was given: a design by its loads; creep; a service class; that
    imperfections were left out; what strengths count on; and how cables are to be stressed."""
    strength, design = results.strength, results.design
    if design is not None and design.found:
        *before, last = design.open
        what = f"{', '.join(before)} and {last} were" if before else f"{last} was"
        yield said("designed", what=what, design=design.steps[-1].words, count=len(design.steps))
    if design is not None and design.assumed_creep is not None:
        yield said("assumed_creep", None, design.assumed_creep, creep=percent(design.assumed_creep))
    if any(found.imperfect_kind is None for _, _, found in results.loaded_shells()):
        yield said("no_imperfections")
    if strength is not None and strength.code and strength.service_class is None:
        yield said("assumed_class")
    if strength is not None and strength.relaxed:
        yield said("relaxed", None, strength.relaxed, share=percent(strength.relaxed))
    yield from cable_points(results)
