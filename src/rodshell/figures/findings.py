"""What is judged, as data: a code for each kind, so that scripts and sweeps need not read sentences."""

from typing import Literal, Self

from pydantic import Field

from rodshell.figures.records import Ends, Flag, Number, Record, Rows, Text, key, rows
from rodshell.figures.sentences import SENTENCES

CODES = {
    "assumed_class": "strengths are those of a service class that was taken, as none was given",
    "assumed_creep": "creep of the rods was taken, as none was given",
    "cables_short": "cables are shortened by so little that they have to be stressed to their forces",
    "contact": "rods touch or cross",
    "creep_unknown": "creep is not known of these rods",
    "deflection": "the shell moves by more than was allowed under a combination of loads",
    "designed": "loads decided section, bracing or spacing",
    "ends_in_the_air": "rod ends lie above the lowest: what holds them has to be designed",
    "erection_contact": "rods touch or cross on the way that was computed",
    "erection_strength": "rods use more than their strength on the way that was computed",
    "erection_too_thick": "rods are too thick for their bends on the way that was computed",
    "falls": "the shell falls under its own weight",
    "falls_after_years": "after years of creep the shell falls under a permanent combination of loads",
    "falls_under_loads": "the shell falls under a combination of loads",
    "flat": "the target is flat",
    "guided": "lifted and driven by its ends, the shell comes to rest in another shape than the final one",
    "imperfect": "with imperfections the shell falls under a combination of loads",
    "imperfect_unknown": "of the shell with imperfections it is not known how far it carries a combination of loads",
    "in_place": "flat, the rods would bend by more than they withstand: the shell is assembled in place",
    "lies_flat": "the rods can be laid out flat, although they follow curves of the target",
    "linear_buckling": "linear buckling is below the loads, which the shell carries in another shape",
    "lost": "the deployment could not be followed all the way",
    "low_stiffness": "with the modulus that a code asks for, the shell falls under a combination of loads",
    "needs_bracing": "without its bracing the shell does not carry its own weight",
    "no_design": "of what was left open nothing carries the loads",
    "no_imperfections": "imperfections were left out",
    "no_loads": "loads other than the own weight and even snow were not checked",
    "no_mass": "no mass was given",
    "no_room": "rods pass each other so near that there is hardly any room for joints",
    "no_shear_strength": "torsion counts, and the shear strength of timber or a fibre composite was not given",
    "no_strength": "no strength was given",
    "none_stands": "with some supports the shell falls under its own weight, and with the others that is not known",
    "not_checked": "something was not checked",
    "not_computed": "a computation did not converge or is not complete",
    "not_followed": "the shell could be followed only up to a part of the loads",
    "not_nested": "rods are cut from boards, curved at rest, and are in no plan of cutting bars",
    "not_refined": "the form was not refined, or not to the end",
    "not_sold": "the chosen section is thinner than any that is sold",
    "not_spliced": "rods cannot be spliced from the stock",
    "off_target": "the shell deviates from the target",
    "other_shape": "another stable shape is near",
    "relaxed": "strengths count on stress that relaxes",
    "reserve": "the shell carries its own weight, but not with the reserve that is asked for",
    "reserve_under_loads": "the shell carries a combination of loads, but not with the reserve that is asked for",
    "sinks": "under its own weight the shell takes another shape",
    "slip": "a joint transfers more than the force at which it slips",
    "slots": "little of a strip remains next to one of its slots",
    "slots_weaken": "strips are weaker at their slots than they were judged",
    "snaps": "the shell snaps forward by itself during the deployment",
    "stands": "the shell carries its own weight with the reserve that is asked for",
    "stands_under_loads": "the shell carries a combination of loads",
    "strength": "rods use more than their strength before loads act",
    "strength_not_reduced": "rods permanently use a strength that is not reduced for duration and moisture",
    "strength_of_beam": "a beam along the edge uses more than its strength",
    "strength_of_bracing": "bracing uses more than its strength under a combination of loads",
    "strength_under_loads": "rods use more than their strength under a combination of loads",
    "too_thick": "rods are too thick for their bends",
    "turned": "turned into their clamps, the ends lead to another than the clamped shape",
    "unstable": "the shell is unstable",
    "warning": "a warning of the form finding, as its sentence says",
}
"""What each code means."""


Level = Literal["good", "check", "unbuildable", "unknown"]
RANKS: tuple[Level, ...] = ("good", "check", "unbuildable", "unknown")  # each graver than those before
GOOD = frozenset({
    "assumed_class", "assumed_creep", "cables_short", "designed", "in_place", "lies_flat", "no_imperfections",
    "no_loads", "not_nested", "relaxed", "stands", "stands_under_loads",
})  # fmt: skip
FAULTS = frozenset({
    "contact", "falls", "falls_after_years", "falls_under_loads", "flat", "imperfect", "slip", "strength",
    "strength_of_beam", "strength_of_bracing", "strength_under_loads", "too_thick", "unstable",
})  # fmt: skip
"""Of these a shell cannot be built; another on other supports may be."""
NOT_KNOWN = frozenset({"none_stands", "not_computed"})


def level_of(code: str) -> Level:
    """How grave a finding is by itself."""
    if code in GOOD:
        return "good"
    return "unbuildable" if code in FAULTS else "unknown" if code in NOT_KNOWN else "check"


class Finding(Record):
    """What one sentence of a verdict says, as data."""

    code: Text = Field(description="what is judged, one of the codes in docs/files.md")
    level: Text | None = key("good, check, unbuildable or unknown: that of the verdict is the gravest of its findings'")
    support: Text | None = key("the end condition; null: of all, or of none")
    figure: Number = key("what was found, in `unit`")
    limit: Number = key("what is compared with it, in the same unit")
    unit: Text = Field(default="", description='"m", or "" for a number or a share')
    place: Text | None = key("the rod, or the combination of loads")
    offers: Rows[Text] = rows("commands that may mend it, to be run in the folder of the result")


class Tried(Record):
    """What an offer of a finding came to when `rodshell advise` tried it."""

    offer: Text = Field(description="the command, as among the finding's offers")
    code: Text = Field(description="of the finding")
    before: Number = key("the finding's figure in this result, in its unit")
    after: Number = key("that figure with the offer; null: not known")
    level: Text | None = key("of the verdict with the offer; null: no form was found")
    helps: Flag | None = key("whether that figure is better, and the findings as a whole are")
    said: Text = Field(default="", description="the verdict's first sentence with the offer, or why there is no form")


class Said(str):
    """A sentence that says a finding; wherever a sentence is read, this is one."""

    finding: Finding

    def __new__(cls, text: str, finding: Finding = Finding(code="warning")) -> Self:
        found = super().__new__(cls, text)
        found.finding = finding
        return found


def said(
    sentence: str, support: Ends | None = None, figure: float | None = None, limit: float | None = None,
    unit: str = "", *, place: str | None = None, offers: tuple[str, ...] = (), **words: object,
) -> Said:  # fmt: skip
    """A finding in the words of `SENTENCES`.

    Args:
        sentence: its name there: the code, or the code and a variant.
        support, figure, limit, unit, place, offers: see `Finding`.
        words: that the sentence needs in addition.
    """
    finding = Finding(
        code=sentence.partition(":")[0], support=support, figure=figure, limit=limit, unit=unit, place=place,
        offers=offers,
    )  # fmt: skip
    return Said(SENTENCES[sentence].format(ends=support, place=place, **words), finding)
