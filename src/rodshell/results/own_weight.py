"""What is said of shells that do not carry their own weight, or are not known to, and which rods would carry theirs.

By similarity: with other rods of the same material the shell has the same shape, its rods bend by the same curvatures,
and it carries as many times its own weight as EI over the weight has grown, with the square of the radius of gyration.
That holds where joints have no stiffness of their own: within 4 % on the example roof and a hemisphere.
"""

from collections.abc import Mapping
from math import inf, sqrt

from rodshell.results.records import Ends, RodType
from rodshell.results.records import Section as RodSection
from rodshell.results.results import Results, SelfWeight
from rodshell.results.sizes_sold import half_sides, sizes_sold
from rodshell.results.strength_used import THIN, bent_of, holds_while_erected, strength_name
from rodshell.results.wording import part_of_weight, percent, rounded, rounded_down, shown_factor
from rodshell.rods.section import Section, size_text

WITHOUT_STIFFNESS = ("ball", "pin", "rigid")  # joints
ENOUGH = 1.05  # times its own weight: beyond what similarity is off
RESERVE = 1.5  # times its own weight: a shell that carries less has none for creep, imperfections or a thin snow


def weight_findings(results: Results, ends: list[Ends]) -> tuple[list[str], bool]:
    """What is said of shells that do not carry their own weight, or are not known to; and whether one of them does.

    Of shells with bracing the loads say whether they stand.

    Parameters
    ----------
    results : with the checks of the self-weight.
    ends : whose shells are meant.
    """
    found = {end: results.self_weight[end] for end in ends if end in results.self_weight}
    parts = light(results, ends)
    lost = {end for end, weighed in found.items() if weighed.limit == "not followed"}
    if is_braced(results):
        carries = "is known to carry only" if lost & set(parts) else "carries only"
        weight = _parts(parts, "its own weight")
        words = f"{_alone(parts)}the shell {carries} {weight} without its bracing: support it until that is in place"
        return [words] if parts else [], True
    standing = [end for end, weighed in found.items() if end not in parts and weighed.limit != "no mass"]
    falling = {end: part for end, part in parts.items() if end not in lost}
    unknown = {end: part for end, part in parts.items() if end in lost}
    said = []
    if falling:
        others = "".join(f"; with {end} ends it carries {_times(found[end])} its own weight" for end in standing)
        said.append(
            f"{_alone(falling)}the shell does not stand under its own weight: it carries only {_parts(falling)}"
            f"{others}{_other_rods(results, falling)}"
        )
    known = {end: found[end].load_factor for end in standing if end not in lost}
    if known and not results.loads and all(factor is not None and factor < RESERVE for factor in known.values()):
        weights = " and ".join(f"{_times(found[end])} its own weight with {end} ends" for end in known)
        said.append(f"the shell carries only {weights}, with little reserve for creep, imperfections and loads")
    if unknown:
        said.append(
            f"{_alone(unknown)}it is not known whether the shell stands under its own weight: it could be followed "
            f"only up to {_parts(unknown)}"
        )
    said += [
        f"with {end} ends the shell carries {_times(found[end])} its own weight; above, it could not be followed, and "
        "nothing is known"
        for end in standing
        if end in lost
    ]
    if any(weighed.limit == "no mass" for weighed in found.values()):
        said.append(
            "no mass was given, so that it is not known what share of its own weight the shell carries: give "
            "rod.section.mass"
        )
    if set(found) != set(ends):
        said.append("whether it carries its own weight was not checked")
    return said, bool(standing)


def is_braced(results: Results) -> bool:
    """Whether the shell has bracing under its loads; its own weight alone is checked without.

    Parameters
    ----------
    results : with the checks under loads.
    """
    return any(shell.bracing for supported in results.loads.values() for shell in supported.values())


def _alone(factors: Mapping[Ends, float]) -> str:
    """The end condition of a sentence that is about one."""
    return "".join(f"with {ends} ends " for ends in factors) if len(factors) == 1 else ""


def _parts(factors: Mapping[Ends, float], of: str = "it") -> str:
    """Parts of the weight, by end condition if there are several."""
    several = len(factors) > 1
    each = [f"{part_of_weight(part)} of {of}{f' with {ends} ends' * several}" for ends, part in factors.items()]
    return " and ".join(each)


def _times(weighed: SelfWeight) -> str:
    least = "at least " if weighed.limit == "not followed" else ""
    return f"{least}{shown_factor(weighed.load_factor)} times"


def light(results: Results, ends: list[Ends]) -> dict[Ends, float]:
    """By end condition, the factors on its own weight that a shell carries, or is known to, where they are below 1.

    Parameters
    ----------
    results : with the checks of the self-weight.
    ends : whose shells are meant.
    """
    found = {end: results.self_weight[end].load_factor for end in ends if end in results.self_weight}
    return {end: factor for end, factor in found.items() if factor is not None and factor < 1}


def _other_rods(results: Results, factors: Mapping[Ends, float]) -> str:
    """Which rods of the same material would carry their own weight: a size that is sold, or rods in proportion.

    Parameters
    ----------
    factors : on the weight, below 1, that is carried with these ends.
    """
    ends, factor = max(factors.items(), key=lambda pair: pair[1])
    rod, kind = results.rod, (results.joint.kind if results.joint else None) or "ball"
    if factor <= 0 or rod is None or kind not in WITHOUT_STIFFNESS:
        return ""
    for section in () if results.refinement else sizes_sold(rod):  # a refined rod's section varies along it
        gain, sharper = _gain(rod, section), _sharper(rod, section)
        if factor * gain >= ENOUGH and not _too_much(results, ends, sharper):
            return (
                f"; made of {size_text(section)}, it would carry about {rounded_down(factor * gain)} times its own "
                f"weight or more with {ends} ends{_share(results, ends, sharper)}"
            )
    thicker = sqrt(ENOUGH / factor)
    rods = f"rods about {rounded(thicker, 2)} times as thick"
    made = f"; made of {rods}, it would just carry its own weight with {ends} ends, by an estimate"
    if too_much := _too_much(results, ends, thicker):
        return (
            f"{made}, but they would {too_much}: support it, or take another material; rodshell check finds what "
            "bracing adds"
        )
    return made + _share(results, ends, thicker)


def _gain(rod: RodType, section: Section) -> float:
    """How many times as many of its own weights a shell carries with this section, at least."""
    now = [stiffness for stiffness in (rod.EI1 or rod.EI, rod.EI2 or rod.EI) if stiffness]
    if len(now) < 2 or not rod.EA:
        return 0.0
    other = [moment / section.area for moment in section.second_moments]  # squares of the radii of gyration
    return min(square * rod.EA / stiffness for square, stiffness in zip(other, now, strict=True))


def _sharper(rod: RodType, section: Section) -> float:
    """How many times as much the same bends strain this section, at most."""
    other = half_sides(RodSection.model_validate(section.parameters()))
    now = half_sides(rod.section) if rod.section else ()
    return max((new / old for new, old in zip(other, now, strict=False)), default=inf)


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
