"""What decides the fabrication of a grid."""

from dataclasses import dataclass
from typing import Annotated

from rodshell.errors import InputError
from rodshell.quantities import Distance, Length
from rodshell.rods.joints import Joint
from rodshell.rods.section import Rod
from rodshell.schema import checked


@dataclass(frozen=True)
class Fabrication:
    """Lengths that decide the cutting. Without a stock length every rod comes in one piece."""

    end_allowance: Annotated[Distance, "length added to each end of a rod, for its support"] = 0.0
    stock_length: Annotated[Length | None, "length of the bars that rods are cut from; default: no limit"] = None
    kerf: Annotated[Distance, "width of a saw cut; needs stock_length"] = 0.0
    slot_clearance: Annotated[Distance, "by which slots of upright strips are wider and deeper than needed"] = 0.0

    def __post_init__(self) -> None:
        checked(self, {"end_allowance": "the end allowance", "kerf": "the kerf", "stock_length": "the stock length",
                       "slot_clearance": "the slots' clearance"})  # fmt: skip
        if self.stock_length is None and self.kerf > 0:
            raise InputError(
                f"the kerf of {self.kerf} m is lost where stock is cut: give its stock_length, or leave the kerf out"
            )
        if self.stock_length is not None and not self.stock_length > self.kerf:
            raise InputError(
                f"stock of {self.stock_length} m cannot be cut with a kerf of {self.kerf} m: give longer bars"
            )


def has_slots(upright: bool, rod: Rod, joint: Joint) -> bool:
    """Whether rods cross by slots at half their height: strips that stand `upright`, without bolts through them."""
    half = rod.section.half_widths
    return upright and rod.section.kind == "rectangle" and half is not None and half[0] > half[1] and not joint.locks
