"""What a verdict judged, as data: a code for each kind, so that scripts and sweeps need not read sentences."""

from dataclasses import dataclass, replace
from typing import Self

from rodshell.figures.records import Ends
from rodshell.results.results import Finding

CODES = {
    "contact": "rods touch or cross",
    "ends_in_the_air": "rod ends lie above the lowest: what holds them has to be designed",
    "erection_contact": "rods touch or cross on the way that was computed",
    "erection_strength": "rods use more than their strength on the way that was computed",
    "erection_too_thick": "rods are too thick for their bends on the way that was computed",
    "falls": "the shell falls under its own weight",
    "falls_under_loads": "the shell falls under a combination of loads",
    "flat": "the target is flat",
    "imperfect": "with imperfections the shell falls under a combination of loads, or nothing is known of it",
    "linear_buckling": "linear buckling is below the loads, which the shell carries in another shape",
    "needs_bracing": "without its bracing the shell does not carry its own weight",
    "no_imperfections": "imperfections were not looked at",
    "no_loads": "loads other than the own weight were not checked",
    "no_mass": "no mass was given",
    "no_strength": "no strength was given",
    "not_checked": "something was not checked",
    "not_computed": "a computation did not converge or is not complete",
    "not_followed": "the shell could be followed only up to a part of the loads",
    "not_sold": "the chosen section is thinner than any that is sold",
    "off_target": "the shell deviates from the target",
    "other_shape": "another stable shape is near",
    "reserve": "the shell carries its own weight, but not with the reserve that is asked for",
    "sinks": "under its own weight the shell takes another shape",
    "slip": "a joint transfers more than the force at which it slips",
    "stands": "the shell carries its own weight with the reserve that is asked for",
    "stands_under_loads": "the shell carries a combination of loads",
    "strength": "rods use more than their strength before loads act",
    "strength_not_reduced": "rods permanently use a strength that is not reduced for duration and moisture",
    "strength_of_bracing": "bracing uses more than its strength under a combination of loads",
    "strength_under_loads": "rods use more than their strength under a combination of loads",
    "too_thick": "rods are too thick for their bends",
    "unstable": "the shell is unstable",
    "warning": "a warning of the form finding, as its sentence says",
}
"""What each code means."""


@dataclass(frozen=True)
class Said:
    """A sentence of the verdict with what it says in figures; see `Finding`."""

    text: str
    code: str
    support: Ends | None = None
    figure: float | None = None
    limit: float | None = None
    unit: str = ""
    place: str | None = None
    offers: tuple[str, ...] = ()

    def finding(self) -> Finding:
        """The figures without the sentence."""
        assert self.code in CODES, self.code
        return Finding(
            code=self.code, support=self.support, figure=self.figure, limit=self.limit, unit=self.unit,
            place=self.place, offers=self.offers,
        )  # fmt: skip

    def and_so(self, words: str) -> Self:
        """The same, whose sentence continues."""
        return replace(self, text=self.text + words)
