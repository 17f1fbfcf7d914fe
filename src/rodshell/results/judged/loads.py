"""What is said of how far a shell carries a combination of loads: whether it falls, and with what reserve it stands.

One rule: with imperfections, every combination is carried `reserve` times by the shell as erected, and a permanent one
again by the shell after years of creep. Below the reserve a shell has to be checked, below 1 it cannot be built.
"""

from collections.abc import Iterator
from math import inf

from rodshell.figures.findings import Said, said
from rodshell.figures.loads import AfterYears, LoadedShell
from rodshell.figures.records import Ends
from rodshell.figures.sentences import USES
from rodshell.results.judged.stress import LARGE, bent_of, by_code
from rodshell.results.judged.supports import width
from rodshell.results.results import Results
from rodshell.results.wording import drawn_length, percent, rounded, rounded_down, too_much

NOT_FOLLOWED, UNSTABLE = "not followed", "unstable unloaded"
SAME_USE = 1.02  # of what the erected shell uses: more is the loads' doing
SCATTER, SURE = 2e-3, 10.0  # m, of cables as cut and fitted on site; times that, lengths decide their forces
UNLOADED = ("permanent", "slip_unloaded")  # of these no load is the cause


def load_faults(results: Results, ends: Ends) -> Iterator[Said]:
    """Combinations of loads under which the shell falls or breaks, and what is too much before they act."""
    unloaded = dict[str, Said]()
    for name, end, found in results.loaded_shells():
        if end != ends:
            continue
        used = found.utilisation
        yield from _fall(found, name, ends)
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
        where = "" if place is None else f" in {place.rod}, {drawn_length(results, place.at)} from its start"
        for by, share in before.items():
            if share > 1:
                sentence = "slip: unloaded" if by == "slip_unloaded" else "strength: unloaded"
                rod, what = place.rod if place else None, USES[by].format(too_much(share), by_code(results))
                word = said(sentence, ends, share, 1, place=rod, what=what, where=where * (by == governs))
                if len(word) > len(unloaded.get(by, "")):  # the same under all, or with its place
                    unloaded[by] = word
        worst = max(uses, key=lambda by: uses[by], default="")
        if uses.get(worst, 0.0) > 1:
            at = "" if found.at_factor == 1 else f" already at {rounded_down(found.at_factor or 0.0)} times these loads"
            what = USES.get(worst, USES["bending"]).format(too_much(uses[worst]), by_code(results))
            code, where = "slip" if worst == "slip" else "strength_under_loads", where * (worst == governs)
            yield said(code, ends, uses[worst], 1, place=name, what=what, at=at, where=where)
        if (braced := found.bracing_utilisation) is not None and braced > 1:
            yield said("strength_of_bracing", ends, braced, 1, place=name, share=too_much(braced))
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


def load_points(results: Results, ends: list[Ends]) -> Iterator[Said]:
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
                moved = drawn_length(results, found.max_deflection)
                yield said("linear_buckling", end, linear, 1, place=name, factor=rounded_down(linear), moved=moved)
            yield from _not_known(found, name, end, results)
            lower, share = lowered(results, found)
            if lower < 1 and stands and (imperfect is None or imperfect >= 1):
                factor = rounded_down(lower)
                yield said("low_stiffness", end, lower, 1, place=name, factor=factor, share=share)


def lowered(results: Results, found: LoadedShell) -> tuple[float, str]:
    """The smallest limit factor with the modulus that a code asks for in stability, and how that is said; infinite: no
    code asks, or no limit was met."""
    strength, limits = results.strength, [found.limit_factor, found.imperfect_factor]
    known = [limit for limit in limits if limit is not None]
    if strength is None or strength.stiffness is None or not known:
        return inf, ""
    imperfect = "imperfections and " * (found.imperfect_factor is not None)
    share = f"{imperfect}{percent(strength.stiffness)} of the mean modulus, which {strength.code} asks for in stability"
    return strength.stiffness * min(known), share


def _fall(found: LoadedShell, name: str, ends: Ends) -> Iterator[Said]:
    """That the shell falls under a combination: as a perfect one, or else with imperfections, or else after years."""
    limit, imperfect, years = found.limit_factor, found.imperfect_factor, found.after_years
    if found.limit_kind == UNSTABLE:
        yield said("unstable: unloaded", ends, place=name)
    elif limit is not None and limit < 1 and found.limit_kind != NOT_FOLLOWED:
        how = "snaps through" if found.limit_kind == "limit point" else "buckles"
        yield said("falls_under_loads", ends, limit, 1, place=name, how=how, factor=rounded_down(limit))
    elif found.imperfect_kind == UNSTABLE:
        yield said("imperfect: unloaded", ends, place=name)
    elif imperfect is not None and imperfect < 1 and found.imperfect_kind != NOT_FOLLOWED:
        yield said("imperfect", ends, imperfect, 1, place=name, factor=rounded_down(imperfect))
    elif years is not None and (least := _least(years)) < 1 and not _lost(years):
        factor, creep = rounded_down(least), rounded(years.creep or 0.0)
        also = " and imperfections" * (years.imperfect_factor == least)
        yield said("falls_after_years", ends, least, 1, place=name, factor=factor, creep=creep, imperfections=also)


def _not_known(found: LoadedShell, name: str, ends: Ends, results: Results) -> Iterator[Said]:
    """What is not known of a shell that is not known to fall, that it moves too far, and that its reserve is less than
    was asked for. A path that was followed beyond that reserve has shown it."""
    limit, imperfect, years = found.limit_factor or 0.0, found.imperfect_factor, found.after_years
    enough = found.reserve or inf
    if found.limit_kind == NOT_FOLLOWED and limit < enough:
        sentence = "not_followed" if limit < 1 else "not_followed: above"
        yield said(sentence, ends, limit, 1, place=name, factor=rounded_down(limit))
    if found.imperfect_kind == NOT_FOLLOWED and (imperfect or 0.0) < enough:
        sentence = "imperfect_unknown: no equilibrium" if imperfect is None else "imperfect_unknown"
        yield said(sentence, ends, imperfect, 1, place=name, factor=rounded_down(imperfect or 0.0))
    if years is not None and _lost(years) and (_least(years) < enough or _not_found(years)):
        yield said("not_followed: years", ends, _least(years), 1, place=name, factor=rounded_down(_least(years)))
    yield from _deflection(found, name, ends, results)
    asked, least, what = found.reserve or 0.0, *least_carried(found)
    if 1 <= least < asked:
        carries, wanted = rounded_down(least), rounded(asked)
        yield said("reserve_under_loads", ends, least, asked, place=name, what=what, factor=carries, asked=wanted)


def _deflection(found: LoadedShell, name: str, ends: Ends, results: Results) -> Iterator[Said]:
    later = found.after_years.max_deflection if found.after_years else None
    limit, moved = found.deflection_limit, max(found.max_deflection or 0.0, later or 0.0)
    if limit is not None and moved > limit:
        years = " after years" * (moved == later)
        allowed, far = drawn_length(results, limit), drawn_length(results, moved)
        yield said("deflection", ends, moved, limit, "m", place=name, moved=far, allowed=allowed, years=years)


def creep_unknown(results: Results) -> Iterator[Said]:
    """That creep is not known of a shell that was checked under loads: its weight is permanent."""
    unknown = results.strength is None or results.strength.creep is None
    permanent = [found for _, _, found in results.loaded_shells() if found.duration == "permanent"]
    if results.loads and (unknown or any(found.after_years is None and found.reserve for found in permanent)):
        yield said("creep_unknown")


def least_carried(found: LoadedShell) -> tuple[float, str]:
    """The smallest factor on a combination that decides on its reserve, and of what it is; infinite: above 100."""
    with_imperfections = " with imperfections" if found.imperfect_kind is not None else ""
    least = {f"as erected{with_imperfections}": _least(found)}
    if found.after_years is not None:
        least[f"after years of creep{with_imperfections}"] = _least(found.after_years)
    what = min(least, key=lambda key: least[key])
    return least[what], what


def _least(found: LoadedShell | AfterYears) -> float:
    known = (found.limit_factor, found.imperfect_factor)
    return min((factor for factor in known if factor is not None), default=inf)


def _not_found(years: AfterYears) -> bool:
    """Whether no equilibrium with imperfections is known."""
    return years.imperfect_kind == NOT_FOLLOWED and years.imperfect_factor is None


def _lost(years: AfterYears) -> bool:
    return NOT_FOLLOWED in (years.limit_kind, years.imperfect_kind)


def is_braced(results: Results) -> bool:
    """Whether the shell has bracing under its loads; its own weight alone is checked without."""
    return any(shell.bracing for _, _, shell in results.loaded_shells())


def cable_points(results: Results) -> Iterator[Said]:
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
