"""Records of a design to load: what was tried, and what is chosen, or what limits."""

from typing import Literal

from pydantic import Field

from rodshell.figures.records import Flag, Number, Record, Rows, Text, key, rows

KnownBy = Literal["estimate", "path", "checks"]


class DesignStep(Record):
    """A design that was tried."""

    section: Text = Field(description="of the rods, as it is sold")
    bracing: Text = Field(description="none, cables or laths")
    spacing: Number = key("between neighbouring rods", "m")
    known_by: KnownBy = Field(
        description="how it was judged: by linear buckling, by the path of one combination, or by all checks"
    )
    factor: Number = key("times the loads that it carries with imperfections, at least; null: not known")
    used: Number = key("share of the design strength that its rods use at most; null: not known")
    said: Text = Field(description="what came of it")

    @property
    def words(self) -> str:
        """Section, bracing and spacing."""
        braced = "without bracing" if self.bracing == "none" else f"with {self.bracing}"
        return f"{self.section}, {braced}, rods {round(1e3 * (self.spacing or 0.0))} mm apart"


class Design(Record):
    """How the case was designed to its loads."""

    open: Rows[Text] = rows("what was chosen")
    found: Flag = Field(description="whether it carries its loads with their reserve and within its strength")
    limits: Text = Field(default="", description="what limits them where none does")
    steps: Rows[DesignStep] = rows("what was tried, in this order")
    assumed_creep: Number = key("growth of deflections that was taken, as none is known of these rods")
