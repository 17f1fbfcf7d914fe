"""The verdict on a result, computed once from all that was found: good, check, unbuildable or unknown, and the
reasons.

Summary, report, JSON and exit code show what stands here and judge nothing themselves. A figure that is missing was
not checked, and then the result is not good.
"""

from collections.abc import Iterable, Iterator
from functools import partial
from math import inf, isinf

from rodshell.figures.checks import OTHER_SHAPES, Clearance, Deployment, WorstBent
from rodshell.figures.findings import RANKS, Finding, Level, Said, level_of, said
from rodshell.figures.form import Agreement, PopUp
from rodshell.figures.loads import LoadedShell
from rodshell.figures.records import Ends
from rodshell.figures.sentences import ANOTHER_WAY, SENTENCES
from rodshell.results.load_reserve import creep_unknown, fall, least_carried, open_points
from rodshell.results.own_weight import falling, is_braced, none_stands, reserve, weight_findings
from rodshell.results.results import Results, Verdict
from rodshell.results.sizes_sold import thinner_than_sold
from rodshell.results.strength_used import (
    THIN,
    bent_of,
    by_code,
    by_design_strength,
    holds_while_erected,
    strength_name,
)
from rodshell.results.supports import air_findings, width
from rodshell.results.wording import (
    FORM_AGAIN,
    millimetres,
    percent,
    place,
    rounded,
    rounded_down,
    rounding_of,
    shown_factor,
    snow_text,
    whole_percent,
)
from rodshell.rods.design_strength import RESERVED
from rodshell.rods.supports import PINNED, clamped_among, finals_first

FAR_OFF, OFF = 0.05, 0.02  # largest gap over the size: another shape than the target; with clamped ends a convex shell
# leaves a tenth of the second
FLAT = SENTENCES["flat"]
NEAR, AKIN = 0.6, 1.5  # distance over the size and energy ratio below which another stable shape may be met by accident
SCATTER, SURE = 2e-3, 10.0  # m, of cables as cut and fitted on site; times that, lengths decide their forces
LARGE = 1.0  # m; for a wider shell a strength is needed, since people stand under it
MUCH_LESS = 0.5  # clamped supports are recommended when they leave less than this share of the pinned gap,
NEGLIGIBLE = 1e-3  # unless that gap is below this share of the target's size already
CONVERGED, BUCKLED = "converged", "buckled"  # statuses that say something about the shell: it crumples in the second


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
    faults = {ends: [*_shell_faults(results, ends)] for ends in shells}
    usable = [ends for ends, found in faults.items() if not found]
    deployment = [] if _on_the_way(results) else [*_contact_faults(results, "deployment")]
    lost = [ends for ends, shell in shells.items() if _status(shell) not in (CONVERGED, BUCKLED)]
    in_order = [*(ends for ends in shells if ends not in lost), *lost]  # what is known of a shell comes first
    grave = [sentence for ends in in_order for sentence in faults[ends]] + deployment + [*_erection(results)]
    if results.target and results.target.flat:
        warned = [word for word in results.warnings if word.startswith(FLAT)]
        return _verdict(results, "unbuildable", [Said(word, said("flat").finding) for word in warned or [FLAT]])
    failed = [] if results.status == CONVERGED else [said("not_computed", status=results.status)]
    if not shells:
        return _verdict(results, "unknown", failed or [said("not_computed: nothing")])
    best = _best(results, usable)
    off = 0.0 if best is None else best[1].max_relative or 0.0
    far = [_off(results, *best)] if best is not None and off > OFF else []
    there = [ends for ends in shells if _status(shells[ends]) == CONVERGED and shells[ends].stable is not False]
    weight, stands = weight_findings(results, usable or there)
    lead = weight if there and not stands else []
    lead = [*_not_designed(results), *lead]
    gravest = [*lead, *far, *grave] if off > FAR_OFF else [*lead, *grave, *far]
    sinks = _sinks(results, usable)
    to_check = [
        *gravest, *weight, *sinks, *_loads(results, usable or there), *creep_unknown(results), *air_findings(results),
        *_open_points(results, usable), *(word if isinstance(word, Said) else Said(word) for word in results.warnings),
    ]  # fmt: skip
    standing, in_doubt = set(usable) - falling(results), none_stands(results, usable, lost)
    if lost and not standing and not deployment:
        return _verdict(results, "unknown", [*failed, *in_doubt, *to_check])
    if not standing or deployment or off > FAR_OFF:
        return _verdict(results, "unbuildable", to_check)
    if in_doubt:
        return _verdict(results, "unknown", [*in_doubt, *to_check])
    if to_check:
        return _verdict(results, "check", [*to_check, *_flat(results), *_assumed(results)])
    return _verdict(results, "good", [*_merits(results, usable), *_flat(results), *_assumed(results)])


def unknown_below(results: Results) -> float:
    """Share of the deployment below which nothing is known: 0 all was followed, 1 only the final shape is known."""
    deployment = results.deployment
    if deployment and deployment.lost_at is None:
        return 0.0
    return min((stage.share for stage in (deployment.stages if deployment else ()) if stage.share > 0), default=1.0)


def utilisation(results: Results) -> float | None:
    """The largest of all shapes that are known, those of the deployment among them; None without a strength."""
    shapes = results.bending.shapes().values() if results.bending else ()
    return max((bent.utilisation for bent in shapes if bent.utilisation is not None), default=None)


def facts(results: Results) -> list[str]:
    """What was found, in sentences that judge nothing: gaps, supports, strength."""
    return [*_gaps(results), *_strength(results)]


def _verdict(results: Results, level: Level, reasons: Iterable[Said]) -> Verdict:
    """Each reason once, with what it says in figures; what rules out one shell is less grave where another stands."""
    once = dict[str, Finding]()
    for each in reasons:
        finding = each.finding
        far = finding.code == "off_target" and (finding.figure or 0.0) > FAR_OFF
        alone = "unbuildable" if far else level_of(finding.code)
        once.setdefault(str(each), finding.changed(level=min(alone, level, key=RANKS.index)))
    stands_alone = level in ("good", "check") and not results.loads
    return Verdict(
        level=level, unloaded=stands_alone or None, reasons=tuple(once), findings=tuple(once.values())
    )  # fmt: skip


def _status(shell: PopUp | None) -> str:
    """Of a shell; those of the first versions that kept none had converged."""
    return (shell.status if shell else None) or CONVERGED


def _shell_faults(results: Results, ends: Ends) -> Iterator[Said]:
    """Why the shell with these ends cannot be built."""
    shell = results.pop_up[ends]
    if _status(shell) != CONVERGED:
        yield said("not_computed: pop-up", ends, status=shell.status)
        return
    if shell.stable is False:
        modes = shell.negative_modes
        count = f" ({modes} buckling mode{'s' if modes != 1 else ''})" if modes else ""
        yield said("unstable", ends, modes, 0, count=count)
    yield from _contact_faults(results, ends)
    yield from _fibre_faults(results, ends)
    yield from _load_faults(results, ends)


BY_WORDS = {
    "bending": "the rods use {} of their design strength{}",
    "shear": "the rods use {} of their design strength in shear{}",
    "slip": "a joint has to transfer {} of the force at which it slips",
    "permanent": "the erected shell, before loads act, uses {} of the rods' permanent design strength{}",
    "slip_unloaded": "before loads act a joint of the erected shell has to transfer {} of the force at which it slips",
}
"""What is used too much, and by which code."""
SAME_USE = 1.02  # of what the erected shell uses: more is the loads' doing
UNLOADED = ("permanent", "slip_unloaded")  # of these no load is the cause


def _load_faults(results: Results, ends: Ends) -> Iterator[Said]:
    """Combinations of loads under which the shell falls or breaks, and what is too much before they act."""
    unloaded = dict[str, Said]()
    for name, end, found in results.loaded_shells():
        if end != ends:
            continue
        used = found.utilisation
        yield from fall(found, name, ends)
        place, parts = found.governs, found.utilisations
        governs = (place.by if place else None) or ""
        uses = {governs: used or 0.0}
        if parts is not None:
            uses |= {by: getattr(parts, by) or 0.0 for by in ("bending", "shear", "slip", *UNLOADED)}
        before = {by: uses.pop(by, 0.0) for by in UNLOADED}
        if before["permanent"] <= (bent_of(results, ends).utilisation or 0.0):
            before["permanent"] = 0.0  # is said of the unloaded shell
        for by in _not_of_loads(results, found):
            uses.pop(by, None)
        where = "" if place is None else f" in {place.rod}, {_mm(results, place.at)} from its start"
        for by, share in before.items():
            if share > 1:
                sentence = "slip: unloaded" if by == "slip_unloaded" else "strength: unloaded"
                rod, what = place.rod if place else None, BY_WORDS[by].format(_too_much(share), by_code(results))
                word = said(sentence, ends, share, 1, place=rod, what=what, where=where * (by == governs))
                if len(word) > len(unloaded.get(by, "")):  # the same under all, or with its place
                    unloaded[by] = word
        worst = max(uses, key=lambda by: uses[by], default="")
        if uses.get(worst, 0.0) > 1:
            at = "" if found.at_factor == 1 else f" already at {rounded_down(found.at_factor or 0.0)} times these loads"
            what = BY_WORDS.get(worst, BY_WORDS["bending"]).format(_too_much(uses[worst]), by_code(results))
            code, where = "slip" if worst == "slip" else "strength_under_loads", where * (worst == governs)
            yield said(code, ends, uses[worst], 1, place=name, what=what, at=at, where=where)
        if (braced := found.bracing_utilisation) is not None and braced > 1:
            yield said("strength_of_bracing", ends, braced, 1, place=name, share=_too_much(braced))
    yield from unloaded.values()


def _not_of_loads(results: Results, found: LoadedShell) -> Iterator[str]:
    """What is used as much without the loads: slip, and the rods by the strength for so long as the loads act."""
    parts, strength = found.utilisations, results.strength
    if parts is None:
        return
    if (parts.slip_unloaded or 0.0) > 1:
        yield "slip"
    staying, lasting = (getattr(strength, name or "", None) for name in ("staying", found.duration))
    if staying and lasting:
        alone = (parts.permanent or 0.0) * staying / lasting
        yield from (by for by in ("bending", "shear") if (getattr(parts, by) or 0.0) <= SAME_USE * alone)


def _too_much(share: float) -> str:
    """A share above 1, never shown as 100 %."""
    return f"{max(101, round(100 * share))} %"


def _contact_faults(results: Results, shape: str) -> Iterator[Said]:
    touching = results.contact.of(shape) if results.contact else None
    if not touching or not touching.pairs:
        return
    first, second = touching.rods or ("a rod", "another")
    rods = f"{first} and {second} overlap" if first != second else f"{first} runs into itself"
    worst = f"{touching.pairs} pairs of rods touch or cross, worst: " if touching.pairs > 1 else "rods touch: "
    where = f" near ({place(touching.where, rounding_of(results))})" if touching.where else ""
    yield said(
        "contact", _ends(shape), touching.clearance, 0, "m", place=first, shape=_shape(shape, touching), worst=worst,
        rods=rods, depth=_mm(results, -(touching.clearance or 0.0)), where=where,
    )  # fmt: skip


def _fibre_faults(results: Results, shape: str) -> Iterator[Said]:
    """Stress above the strength, strain beyond thin rods."""
    bent = bent_of(results, shape)
    used, strain = bent.utilisation, bent.max_bending_strain
    where = "" if bent.rod is None or bent.at is None else f" in {bent.rod}, {_mm(results, bent.at)} from its start"
    if used is not None and used > 1 and not (shape in OTHER_SHAPES and holds_while_erected(results, used)):
        if shape not in OTHER_SHAPES and results.rod and "section" in (results.rod.chosen or {}):
            where += ": the section that was chosen is too thick; give a thinner one (rod.section)"
        yield said(
            "strength" if by_design_strength(results) else "strength: given", _ends(shape), used, 1, place=bent.rod,
            shape=_shape(shape, bent), share=_too_much(used), whose=strength_name(results, shape), where=where,
        )  # fmt: skip
    if strain is not None and strain > THIN:
        yield said(
            "too_thick", _ends(shape), strain, THIN, place=bent.rod,
            shape=_shape(shape, bent), strain=percent(strain), valid=percent(THIN),
        )  # fmt: skip


def _on_the_way(results: Results) -> bool:
    """Whether the rods are nearest to each other while the grid is erected, not in the flat grid."""
    met = results.contact.deployment if results.contact else None
    return met is not None and (met.share or 0.0) > 0


def _erection(results: Results) -> Iterator[Said]:
    """What the rods do not withstand on the way that was computed, and other ways, which may spare them."""
    bent, asked = bent_of(results, "deployment"), reserve(results)
    borne = [each.load_factor for each in results.self_weight.values() if each.load_factor is not None]
    thinner = min(borne, default=asked) >= asked  # else its own weight asks for thicker ones
    used = bent.utilisation
    faults = [*_fibre_faults(results, "deployment")]
    if used is not None and used > 1 and holds_while_erected(results, used):
        faults.append(said(
            "strength", None, used, 1, place=bent.rod, shape=_shape("deployment", bent), share=_too_much(used),
            whose=strength_name(results, "deployment"), where="",
        ))  # fmt: skip
    if _on_the_way(results):
        faults += _contact_faults(results, "deployment")
    for k, fault in enumerate(faults, start=1):
        other_way = ANOTHER_WAY + ", or use thinner rods" * thinner if k == len(faults) else ""
        yield Said(fault + other_way, fault.finding.changed(code=f"erection_{fault.finding.code}"))


def _ends(shape: str) -> Ends | None:
    """The support of a shape; None for the flat grid and the deployment."""
    return None if shape in OTHER_SHAPES else shape


def _shape(shape: str, found: WorstBent | Clearance) -> str:
    """The shape that a sentence is about."""
    if shape not in OTHER_SHAPES:
        return f"with {shape} ends"
    return "during deployment" if found.share is None else f"at {whole_percent(found.share)} of the deployment"


def _best(results: Results, usable: list[Ends]) -> tuple[Ends, Agreement] | None:
    """Of the shells that can be used the nearest to the target, and its gap; None without a target."""
    known = {ends: gap for ends, gap in results.agreement.items() if ends in usable and gap.max_relative is not None}
    return min(known.items(), key=lambda pair: pair[1].max_relative or 0.0, default=None)


def _off(results: Results, ends: Ends, gap: Agreement) -> Said:
    """How far the best shell deviates; with clamped ends a convex shell fits the target, and dips are the cause."""
    where = f", near ({place(gap.where, rounding_of(results))})" if gap.where else ""
    drape = results.drape
    strong = drape.strong_bending if drape else None
    buckles = strong is not None and (strong.beyond or 0.0) > 0
    kind = (results.joint.kind if results.joint else None) or "ball"
    against_shear = kind not in ("ball", "pin")
    bound = drape is not None and drape.method == "bound"
    dips = clamped_among([ends]) and bound and not buckles and not against_shear
    advice = ": dips and ridges need seams, graded stiffness or supports" if dips else ""
    return said(
        "off_target", ends, gap.max_relative, OFF,
        gap=_mm(results, gap.max), share=percent(gap.max_relative), where=where, advice=advice,
    )  # fmt: skip


def _sinks(results: Results, usable: list[Ends]) -> list[Said]:
    """That every shell that can be used takes another shape under its own weight: gaps are those without weight."""
    sizes = [gap.max / gap.max_relative for gap in results.agreement.values() if gap.max and gap.max_relative]
    sunk = {ends: results.self_weight[ends].deflection for ends in usable if ends in results.self_weight}
    known = {ends: depth for ends, depth in sunk.items() if depth is not None}
    if not sizes or not known or min(known.values()) <= OFF * sizes[0]:
        return []
    (ends, depth), *others = sorted(known.items(), key=lambda pair: pair[1])
    further = "".join(f", by {_mm(results, more)} with {other} ends" for other, more in others)
    share = depth / sizes[0]
    return [said("sinks", ends, share, OFF, depth=_mm(results, depth), share=percent(share), further=further)]


def _open_points(results: Results, usable: list[Ends]) -> Iterator[Said]:
    """What has to be looked at although the shell can be built, and what is not known; more is among the warnings."""
    shells, status = results.pop_up, results.status
    stopped = any(_status(shell) != CONVERGED for shell in shells.values())
    if status not in (CONVERGED, "unknown") and not stopped and not any(status in word for word in results.warnings):
        yield said("not_computed: job", status=status)
    if any(shells[ends].stable is None for ends in usable):
        yield said("not_checked: stability")
    yield from _from_flat(results, usable, late=status != CONVERGED)
    yield from _other_shapes(results, usable)
    yield from _rods(results, usable)
    if results.target and not set(usable) <= set(results.agreement):
        yield said("not_checked: gap")


def _loads(results: Results, ends: list[Ends]) -> Iterator[Said]:
    """How far shells are known under loads where they could not be followed, and where imperfect ones fall."""
    for name, by_ends in results.loads.items():
        for end in ends:
            if end not in by_ends:
                yield said("not_checked: loads", end, place=name)
                continue
            found = by_ends[end]
            imperfect, linear = found.imperfect_factor, found.linear_factor
            stands = found.limit_factor is None or found.limit_factor >= 1
            if linear is not None and linear < 1 and stands:
                moved = _mm(results, found.max_deflection)
                yield said("linear_buckling", end, linear, 1, place=name, factor=rounded_down(linear), moved=moved)
            yield from open_points(found, name, end, partial(_mm, results))
            lower, share = _lowered(results, found)
            if lower < 1 and stands and (imperfect is None or imperfect >= 1):
                factor = rounded_down(lower)
                yield said("low_stiffness", end, lower, 1, place=name, factor=factor, share=share)


def _lowered(results: Results, found: LoadedShell) -> tuple[float, str]:
    """The smallest limit factor with the modulus that a code asks for in stability, and how that is said; infinite: no
    code asks, or no limit was met."""
    strength, limits = results.strength, [found.limit_factor, found.imperfect_factor]
    known = [limit for limit in limits if limit is not None]
    if strength is None or strength.stiffness is None or not known:
        return inf, ""
    imperfect = "imperfections and " * (found.imperfect_factor is not None)
    share = f"{imperfect}{percent(strength.stiffness)} of the mean modulus, which {strength.code} asks for in stability"
    return strength.stiffness * min(known), share


def _rods(results: Results, usable: list[Ends]) -> Iterator[Said]:
    """Whether rods hold and pass each other."""
    met = results.contact
    if any(
        (met.of(ends) if met else None) is None or bent_of(results, ends).max_bending_strain is None for ends in usable
    ):
        yield said("not_checked: contact")
    if results.rod and (thin := thinner_than_sold(results.rod)):
        yield said("not_sold", thin=thin)
    if results.bending is None or results.bending.strength is None:
        if width(results) > LARGE:
            yield said("no_strength")
        return
    name = results.bending.strength_of
    used = max((bent_of(results, ends).utilisation or 0.0 for ends in usable), default=0.0)
    if name and used > RESERVED and not by_design_strength(results):
        whose = strength_name(results, usable[0])
        yield said("strength_not_reduced", None, used, RESERVED, share=percent(used), whose=whose)


def _from_flat(results: Results, usable: list[Ends], *, late: bool) -> Iterator[Said]:
    """Whether the deployment was checked; what was found there is among a result's warnings."""
    deployment, flat = results.deployment, results.flat_state
    if flat is not None and not flat.lies_flat:
        return  # it is assembled in place
    if not deployment:
        remedy = "" if late else f": this needs {PINNED} ends (pop_up.ends) and checks.stages above 0"
        upright = clamped_among(results.pop_up, False)
        failed = upright and _status(results.pop_up[upright]) != CONVERGED
        why = f", since the {upright} shell was not found" if failed else remedy
        yield said("not_checked: deployment", why=why)
    elif (
        (clamped := clamped_among(usable))
        and deployment.reached_from_flat
        and (deployment.clamped is None or deployment.clamped.reached_from_flat is None)
    ):
        yield said("not_checked: clamped", clamped, pinned=deployment.ends or PINNED)


def _other_shapes(results: Results, usable: list[Ends]) -> Iterator[Said]:
    for ends, searched in results.other_shapes.items():
        near = [
            (shape.distance, shape.energy)
            for shape in searched.found
            if not shape.mirror and shape.distance is not None and shape.energy is not None
            if shape.distance < NEAR and shape.energy < AKIN
        ]
        if ends in usable and near:
            distance, energy = min(near, key=lambda pair: pair[0])
            yield said("other_shape", ends, distance, NEAR, distance=percent(distance), energy=rounded(energy))


def _flat(results: Results) -> Iterator[Said]:
    """Whether rods along curves of the target can be laid out flat, which decides how the shell is erected."""
    if flat := results.flat_state:
        strain, limit = flat.in_plane_strain, flat.limit or 0.0
        sentence = "lies_flat" if flat.lies_flat else "in_place" if (strain or 0.0) > limit else "in_place: unstable"
        yield said(sentence, None, strain, limit, bent=percent(strain or 0.0), withstood=percent(limit))


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
        lower, share = min((_lowered(results, by_ends[ends]) for ends in usable if ends in by_ends), default=(inf, ""))
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
        offer = f'{FORM_AGAIN} --stability.imperfection "span/500"'
        yield said("no_imperfections", offers=(offer,), offer=offer)
    if strength is not None and strength.code and strength.service_class is None:
        yield said("assumed_class")
    if strength is not None and strength.relaxed:
        yield said("relaxed", None, strength.relaxed, share=percent(strength.relaxed))
    yield from _cables(results)


def _cables(results: Results) -> Iterator[Said]:
    """That lengths do not decide the forces of cables which are hardly shortened, and what scatter of them does."""
    known = ((brace.cut, brace.final) for brace in results.bracing if brace.cut and brace.final)
    shortened = [final - cut for cut, final in known if final > cut]
    if not shortened or min(shortened) >= SURE * SCATTER or width(results) <= LARGE:
        return
    least, most = min(shortened), max(shortened)
    slack = "is slack" if most <= SCATTER else "may be slack" if least <= SCATTER else "loses a part of its force"
    short = f"{1e3 * least:.1f} to {1e3 * most:.1f} mm"
    times, scatter = rounded(1.0 + SCATTER / least, 2), f"{1e3 * SCATTER:g} mm"
    yield said("cables_short", None, least, SURE * SCATTER, "m", short=short, scatter=scatter, slack=slack, times=times)


def _mm(results: Results, metres: float | None) -> str:
    """A length as fine as on the drawings."""
    return millimetres(metres, rounding=rounding_of(results))


def _gaps(results: Results) -> Iterator[str]:
    """How near the converged shells come to the target, and which of two supports that can be used is worth it."""
    known = dict[Ends, float]()
    for ends in finals_first(results.agreement):
        gap, shell = results.agreement[ends], results.pop_up.get(ends)
        if gap.max is not None and shell is not None and shell.status == CONVERGED:
            known[ends] = gap.max
            share = "" if gap.max_relative is None else f" ({percent(gap.max_relative)} of its size)"
            yield f"With {ends} ends the largest gap to the target is {_mm(results, gap.max)}{share}."
    clamped, pinned = clamped_among(known), clamped_among(known, False)
    if clamped and pinned and not any([*_shell_faults(results, ends)] for ends in results.pop_up):
        relative = results.agreement[pinned].max_relative
        held = f"Supports that hold the rods' directions ({clamped})"
        if known[clamped] < MUCH_LESS * known[pinned] and (relative is None or relative > NEGLIGIBLE):
            yield f"{held} leave {percent(known[clamped] / known[pinned])} of the gap that {pinned} ones leave."
        elif relative is None or relative <= OFF:
            yield f"{held} bring the unloaded shell little nearer to the target."
    elif results.pop_up and not results.target:
        yield "This result has no target, so no gap can be stated."


def _strength(results: Results) -> Iterator[str]:
    """How much of the strength is used, and in which shapes that is known."""
    used = utilisation(results)
    if used is not None:
        where = _known(results.deployment, unknown_below(results))
        design = "design " if by_design_strength(results) else ""
        yield f"Unloaded, the rods use {percent(used)} of their {design}strength at most, {where}"
    elif results.bending and results.bending.strength is not None:
        yield "How much of their strength the rods use is not known, since no shell was found."
    elif results.bending:
        yield "No strength was given, so it is not known whether the rods hold (checks.strength)."


def _known(deployment: Deployment | None, unknown: float) -> str:
    """In which shapes the stress is known; no more is said of the deployment than was followed."""
    if not deployment:
        return "in the final shape; the deployment from flat was not followed."
    if unknown >= 1:
        return "in the final shape; for the deployment, which could not be followed, the stress is not known."
    if unknown:
        return (
            f"in the final shape and above {whole_percent(unknown)} of the deployment; below that share the stress is "
            "not known."
        )
    if deployment.guided:
        low, high = (whole_percent(share) for share in deployment.guided)
        return (
            f"in the final shape and the stages of the deployment; the stress while the shell is guided from {low} to "
            f"{high} is not known."
        )
    if deployment.snaps:
        return "in the final shape and the stages of the deployment; the stress during a snap is not known."
    return "deployment included."
