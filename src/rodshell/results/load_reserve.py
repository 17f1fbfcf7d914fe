"""What is said of how far a shell carries a combination of loads: whether it falls, and with what reserve it stands.

One rule: with imperfections, every combination is carried `reserve` times by the shell as erected, and a permanent one
again by the shell after years of creep. Below the reserve a shell has to be checked, below 1 it cannot be built.
"""

from collections.abc import Callable, Iterator
from math import inf

from rodshell.figures.findings import Said, said
from rodshell.figures.loads import AfterYears, LoadedShell
from rodshell.figures.records import Ends
from rodshell.results.results import Results
from rodshell.results.wording import rounded, rounded_down

Length = Callable[[float | None], str]
NOT_FOLLOWED, UNSTABLE = "not followed", "unstable unloaded"


def fall(found: LoadedShell, name: str, ends: Ends) -> Iterator[Said]:
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


def open_points(found: LoadedShell, name: str, ends: Ends, shown: Length) -> Iterator[Said]:
    """What is not known of a shell that is not known to fall, that it moves too far, and that its reserve is less than
    was asked for."""
    limit, imperfect, years = found.limit_factor or 0.0, found.imperfect_factor, found.after_years
    if found.limit_kind == NOT_FOLLOWED:
        sentence = "not_followed" if limit < 1 else "not_followed: above"
        yield said(sentence, ends, limit, 1, place=name, factor=rounded_down(limit))
    if found.imperfect_kind == NOT_FOLLOWED:
        sentence = "imperfect_unknown: no equilibrium" if imperfect is None else "imperfect_unknown"
        yield said(sentence, ends, imperfect, 1, place=name, factor=rounded_down(imperfect or 0.0))
    if years is not None and _lost(years):
        yield said("not_followed: years", ends, _least(years), 1, place=name, factor=rounded_down(_least(years)))
    yield from _deflection(found, name, ends, shown)
    asked, least, what = found.reserve or 0.0, *least_carried(found)
    if 1 <= least < asked:
        carries, wanted = rounded_down(least), rounded(asked)
        yield said("reserve_under_loads", ends, least, asked, place=name, what=what, factor=carries, asked=wanted)


def _deflection(found: LoadedShell, name: str, ends: Ends, shown: Length) -> Iterator[Said]:
    later = found.after_years.max_deflection if found.after_years else None
    limit, moved = found.deflection_limit, max(found.max_deflection or 0.0, later or 0.0)
    if limit is not None and moved > limit:
        years = " after years" * (moved == later)
        allowed, far = shown(limit), shown(moved)
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


def _lost(years: AfterYears) -> bool:
    return NOT_FOLLOWED in (years.limit_kind, years.imperfect_kind)
