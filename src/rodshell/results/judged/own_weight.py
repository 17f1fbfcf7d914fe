"""What is said of shells that do not carry their own weight with a reserve, or are not known to, and which rods would.

By similarity: with other rods of the same material the shell has the same shape, its rods bend by the same curvatures,
and it carries as many times its own weight as EI over the weight has grown, with the square of the radius of gyration.
That holds where joints have no stiffness of their own: within 4 % on the example roof and a hemisphere.
"""

from collections.abc import Mapping, Sequence
from math import inf, sqrt

from rodshell.figures.checks import SelfWeight
from rodshell.figures.findings import Said, said
from rodshell.figures.form import RodType
from rodshell.figures.records import Ends
from rodshell.results.judged.loads import is_braced
from rodshell.results.judged.stress import THIN, bent_of, holds_while_erected, strength_name
from rodshell.results.results import Results
from rodshell.results.sizes_sold import half_sides, sizes_sold
from rodshell.results.wording import FORM_AGAIN, part_of_weight, percent, rounded, rounded_down, shown_factor
from rodshell.rods.section import Section, size_text

WITHOUT_STIFFNESS = ("ball", "pin", "rigid")  # joints
NOT_KNOWN = ("not followed", "no mass", None)  # limits of which no factor follows
ENOUGH = 1.05  # of a factor: beyond what similarity is off
RESERVE = 1.5  # times its own weight that the perfect shell carries: imperfections and supports that yield take a part


def reserve(results: Results) -> float:
    """How many times its own weight a good shell carries: creep divides stiffness by 1 + k_def [EN 1995-1-1,
    2.3.2.2]."""
    return RESERVE * (1.0 + ((results.strength.creep if results.strength else None) or 0.0))


def falling(results: Results) -> set[Ends]:
    """The end conditions with which the shell, braced if it is to be, falls under its own weight."""
    ends = list(results.self_weight)
    found = self_weights(results, ends)
    return {end for end in _below(found, 1.0) if found[end].limit not in NOT_KNOWN}


def none_stands(results: Results, usable: Sequence[Ends], lost: Sequence[Ends]) -> list[Said]:
    """That no end condition is shown to stand, where the shell falls with some and nothing is known of the others.

    Args:
        usable: with which there is a shell without another fault.
        lost: with which the pop-up did not converge.
    """
    fallen, found = falling(results), self_weights(results, usable)
    falls, why = [end for end in usable if end in fallen], dict.fromkeys(lost, "the pop-up did not converge")
    for end in usable:
        weighed = found.get(end) or SelfWeight()
        if end in fallen:
            continue
        if weighed.limit == "not followed" and (weighed.load_factor or 0.0) < 1:
            why[end] = f"it could be followed only up to {part_of_weight(weighed.load_factor or 0.0)} of it"
        elif weighed.limit in NOT_KNOWN[1:]:
            why[end] = "this was not checked"
        else:
            return []
    if not falls or not why:
        return []
    unknown = " and ".join(f"with {end} ends this is not known, as {reason}" for end, reason in why.items())
    return [said("none_stands", falls=" and ".join(falls), bracing=_bracing(results), unknown=unknown)]


def _bracing(results: Results) -> str:
    return " with its bracing" * is_braced(results)


def weight_findings(results: Results, ends: list[Ends]) -> tuple[list[Said], bool]:
    """What is said of shells that do not carry their own weight with the reserve that is asked for, or are not known
    to; and whether one of them stands."""
    found, bracing, asked = self_weights(results, ends), _bracing(results), reserve(results)
    findings, parts = list[Said](), _below(found, 1.0)
    lost = {end for end, weighed in found.items() if weighed.limit == "not followed"}
    bare = _below({end: results.self_weight[end] for end in ends if end in results.self_weight}, 1.0)
    if bracing and bare:
        unknown_above = any(results.self_weight[end].limit == "not followed" for end in bare)
        carries = "is known to carry only" if unknown_above else "carries only"
        findings.append(_of_parts("needs_bracing", bare, carries=carries, weight=_parts(bare, "its own weight")))
    standing = [end for end, weighed in found.items() if end not in parts and weighed.limit not in (None, "no mass")]
    falling = {end: part for end, part in parts.items() if end not in lost}
    unknown = {end: part for end, part in parts.items() if end in lost}
    if falling:
        others = "".join(f"; with {end} ends it carries {_times(found[end])} its own weight" for end in standing)
        advice, offers = _other_rods(results, falling)
        findings.append(_of_parts("falls", falling, offers=offers, bracing=bracing, others=others, advice=advice))
    short = {end: part for end, part in _below(found, asked).items() if end in standing and end not in lost}
    if short:
        weights = " and ".join(f"{_times(found[end])} its own weight with {end} ends" for end in short)
        others = "".join(f"; with {end} ends it carries {_times(found[end])}" for end in standing if end not in short)
        advice, offers = _other_rods(results, short)
        findings.append(_of_parts(
            "reserve", short, asked, offers=offers, bracing=bracing, weights=weights, asked=_asked(results),
            others=others, advice=advice,
        ))  # fmt: skip
    if unknown:
        findings.append(_of_parts("not_followed: weight", unknown, bracing=bracing))
    for end in standing:
        if end in lost:
            factor, times = found[end].load_factor, _times(found[end])
            findings.append(said("not_followed: reserve", end, factor, asked, bracing=bracing, times=times))
    if any(weighed.limit == "no mass" for weighed in found.values()):
        findings.append(said("no_mass"))
    if any(end not in found or found[end].limit is None for end in ends):
        findings.append(said("not_checked: weight", bracing=bracing))
    return findings, bool(standing or (bracing and not falling))


def _of_parts(
    sentence: str, factors: Mapping[Ends, float], limit: float = 1.0, *, offers: tuple[str, ...] = (), **words: str
) -> Said:
    """A finding on shells by the factors on their weight that they carry; of a single shell it names the ends."""
    ends = next(iter(factors)) if len(factors) == 1 else None
    words |= {"alone": f"with {ends} ends " if ends else "", "parts": _parts(factors)}
    return said(sentence, ends, min(factors.values()), limit, offers=offers, **words)


def self_weights(results: Results, ends: Sequence[Ends]) -> dict[Ends, SelfWeight]:
    """How much of its own weight the shell carries with these ends, with its bracing if it has any."""
    found = {end: results.self_weight[end] for end in ends if end in results.self_weight}
    if not is_braced(results):
        return found
    return {end: SelfWeight(load_factor=each.braced_factor, limit=each.braced_limit) for end, each in found.items()}


def _below(found: Mapping[Ends, SelfWeight], least: float) -> dict[Ends, float]:
    """Factors on the own weight that are below `least`."""
    factors = {end: each.load_factor for end, each in found.items()}
    return {end: factor for end, factor in factors.items() if factor is not None and factor < least}


def _asked(results: Results) -> str:
    """The reserve that is asked for, and what for."""
    asked, creep = reserve(results), results.strength.creep if results.strength else None
    if creep:
        return (
            f"{rounded(asked)} times are asked for: {RESERVE} for imperfections and supports that yield, "
            f"{rounded(1 + creep)} times that for creep (k_def)"
        )
    creeps = "creep, " * (creep is None)
    return f"{rounded(asked)} times are asked for, of which {creeps}imperfections and supports that yield take a part"


def _parts(factors: Mapping[Ends, float], of: str = "it") -> str:
    """Parts of the weight, by end condition if there are several."""
    several = len(factors) > 1
    each = [f"{part_of_weight(part)} of {of}{f' with {ends} ends' * several}" for ends, part in factors.items()]
    return " and ".join(each)


def _times(weighed: SelfWeight) -> str:
    least = "at least " if weighed.limit == "not followed" else ""
    return f"{least}{shown_factor(weighed.load_factor)} times"


def _other_rods(results: Results, factors: Mapping[Ends, float]) -> tuple[str, tuple[str, ...]]:
    """Which rods of the same material would carry the shell with the reserve, a size that is sold or in proportion, and
    the command that forms it of them; `factors` on the weight, too low, are those that are carried now."""
    rod, kind = results.rod, (results.joint.kind if results.joint else None) or "ball"
    factors = {ends: factor for ends, factor in factors.items() if factor > 0}
    chosen = rod is not None and "section" in (rod.chosen or {})
    why = "; its section was chosen to withstand its bends" * chosen
    if not factors or rod is None or kind not in WITHOUT_STIFFNESS or is_braced(results):
        return why, ()
    sold = () if results.refinement else sizes_sold(rod)  # a refined rod's section varies along it
    enough = ENOUGH * reserve(results)
    for ends, factor in sorted(factors.items(), key=lambda pair: pair[1]):
        for section in sold:
            gain, sharper = _gain(rod, section), _sharper(rod, section)
            if factor * gain >= enough and not _too_much(results, ends, sharper):
                words = (
                    f"{why}; made of {size_text(section)}, it would carry about {rounded_down(factor * gain)} times "
                    f"its own weight or more with {ends} ends{_share(results, ends, sharper)}"
                )
                offers = _again(results, section)
                return words + "".join(f" ({offer})" for offer in offers), offers
    if chosen and sold:
        why += ", and no size that is sold is likely to carry it and to withstand its bends"
        why += _too_sharp(results, rod, sold, factors)
    ends, factor = max(factors.items(), key=lambda pair: pair[1])
    thicker = sqrt(enough / factor)
    made = (
        f"{why}; made of rods about {rounded(thicker, 2)} times as thick, it would carry {rounded(reserve(results))} "
        f"times its own weight with {ends} ends, by an estimate"
    )
    if too_much := _too_much(results, ends, thicker):
        words = "support it, or take another material; rodshell check finds what bracing adds"
        return f"{made}, but they would {too_much}: {words}", ()
    return made + _share(results, ends, thicker), ()


def _too_sharp(results: Results, rod: RodType, sold: Sequence[Section], factors: Mapping[Ends, float]) -> str:
    """Where the surface is too sharp for the thinnest size that would carry the weight, and how flat it has to be; "":
    none does, or it is not known where."""
    ends, factor = min(factors.items(), key=lambda pair: pair[1])
    bent = bent_of(results, ends)
    for section in sold:
        used = _sharper(rod, section) * (bent.utilisation or 0.0)
        if factor * _gain(rod, section) >= ENOUGH * reserve(results) and used > 1 and bent.where and bent.min_radius:
            x, y, _ = bent.where
            return (
                f": its weight asks for {size_text(section)}, and the radius of {rounded(bent.min_radius)} m at "
                f"{rounded(x or 0.0)}, {rounded(y or 0.0)} m is too sharp for it: make it flatter than "
                f"{rounded(used * bent.min_radius)} m there"
            )
    return ""


def _again(results: Results, section: Section) -> tuple[str, ...]:
    """The command that forms the shell with another section; none without a target."""
    return () if results.target is None else (f'{FORM_AGAIN} --rod "{size_text(section)}"',)


def _gain(rod: RodType, section: Section) -> float:
    """How many times as many of its own weights a shell carries with this section, at least."""
    now = [stiffness for stiffness in (rod.EI1 or rod.EI, rod.EI2 or rod.EI) if stiffness]
    if len(now) < 2 or not rod.EA:
        return 0.0
    other = [moment / section.area for moment in section.second_moments]  # squares of the radii of gyration
    return min(square * rod.EA / stiffness for square, stiffness in zip(other, now, strict=True))


def _sharper(rod: RodType, section: Section) -> float:
    """How many times as much the same bends strain this section, at most."""
    sides = zip(section.half_widths, half_sides(rod), strict=False)
    return max((new / old for new, old in sides), default=inf)


def _too_much(results: Results, ends: Ends, sharper: float) -> str:
    """What keeps rods that are strained so many times as much from being bent to the shape, or ""."""
    bent, way = bent_of(results, ends), bent_of(results, "deployment")
    if (used := sharper * (bent.utilisation or 0.0)) > 1:
        return f"use {percent(used)} of {strength_name(results, ends)}"
    if sharper * (bent.max_bending_strain or 0.0) > THIN:
        return "be too thick for this curvature"
    erected = sharper * (way.utilisation or 0.0)
    if erected > 1 and not holds_while_erected(results, erected):
        return "break during deployment"
    return ""


def _share(results: Results, ends: Ends, sharper: float) -> str:
    """How much of their strength rods use that are strained so many times as much, if it is known."""
    used = bent_of(results, ends).utilisation
    return f", using {percent(sharper * used)} of {strength_name(results, ends)}" if used else ""
