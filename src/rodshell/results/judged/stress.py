"""How much of their strength the rods of a result use, and by which strength that is counted."""

from collections.abc import Iterator

from rodshell.figures.checks import OTHER_SHAPES, WorstBent
from rodshell.figures.findings import Said, said
from rodshell.figures.records import Ends
from rodshell.results.judged.shape import shape_words, support_of
from rodshell.results.judged.supports import width
from rodshell.results.results import Results
from rodshell.results.sizes_sold import thinner_than_sold
from rodshell.results.wording import drawn_length, percent, too_much
from rodshell.rods.design_strength import RESERVED

LARGE = 1.0  # m; for a wider shell a strength is needed, since people stand under it
THIN = 0.05  # bending strain up to which the theory of thin rods holds: radii of ten depths


def bent_of(results: Results, shape: str) -> WorstBent:
    """The worst bending of a shape, that on a support by its name or one of the deployment; one without figures where
    nothing is known."""
    return (results.bending.shapes() if results.bending else {}).get(shape) or WorstBent()


def strength_name(results: Results, shape: str) -> str:
    """By what the utilisation of a shape is counted: design strengths, if they are known."""
    preset = results.bending.strength_of if results.bending else None
    if preset is None:
        return "the given strength"
    if not by_design_strength(results):
        return f"{preset}'s strength, which is characteristic and short-term"
    what = "design strength for erection" if shape in OTHER_SHAPES else "permanent design strength"
    gone = results.strength.relaxed if results.strength and shape not in OTHER_SHAPES else None
    relaxed = f", once {percent(gone)} of the stress is gone" if gone else ""
    return f"{preset}'s {what}{by_code(results)}{relaxed}"


def by_code(results: Results) -> str:
    """By which building code strengths and how they go together are, in words; "": by none."""
    code = results.strength.code if results.strength else None
    return f" by {code}" if code else ""


def by_design_strength(results: Results) -> bool:
    """Whether utilisation is counted by design strengths."""
    return results.strength is not None and results.strength.permanent is not None


def holds_while_erected(results: Results, used: float) -> bool:
    """Whether a preset's rods that use so much of their design strength for erection stay below what breaks them."""
    bending, preset = results.bending, results.rod.preset if results.rod else None
    if bending is None or not bending.strength_of or not bending.erection_strength or preset is None:
        return False
    return used * bending.erection_strength <= (preset.bending_strength or 0.0)


def utilisation(results: Results) -> float | None:
    """The largest of all shapes that are known, those of the deployment among them; None without a strength."""
    shapes = results.bending.shapes().values() if results.bending else ()
    return max((bent.utilisation for bent in shapes if bent.utilisation is not None), default=None)


def fibre_faults(results: Results, shape: str) -> Iterator[Said]:
    """Stress above the strength, strain beyond thin rods."""
    bent = bent_of(results, shape)
    used, strain = bent.utilisation, bent.max_bending_strain
    known = bent.rod is not None and bent.at is not None
    where = f" in {bent.rod}, {drawn_length(results, bent.at)} from its start" if known else ""
    if used is not None and used > 1 and not (shape in OTHER_SHAPES and holds_while_erected(results, used)):
        if shape not in OTHER_SHAPES and results.rod and "section" in (results.rod.chosen or {}):
            where += ": the section that was chosen is too thick; give a thinner one (rod.section)"
        yield said(
            "strength" if by_design_strength(results) else "strength: given", support_of(shape), used, 1,
            place=bent.rod, shape=shape_words(shape, bent), share=too_much(used),
            whose=strength_name(results, shape), where=where,
        )  # fmt: skip
    if strain is not None and strain > THIN:
        yield said(
            "too_thick", support_of(shape), strain, THIN, place=bent.rod,
            shape=shape_words(shape, bent), strain=percent(strain), valid=percent(THIN),
        )  # fmt: skip


def rod_points(results: Results, usable: list[Ends]) -> Iterator[Said]:
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
