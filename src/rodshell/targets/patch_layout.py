"""What a patch of a target may have of its own."""

from dataclasses import dataclass
from typing import Annotated

from rodshell.quantities import Angle, Lengths, Point
from rodshell.schema import checked


@dataclass(frozen=True)
class PatchLayout:
    """Settings of one patch that replace those of the layout; None: as in the layout.

    Args:
        rotate: angle of family u against x at the anchor, seen from above [rad]; default: the layout's heading at
            the target's summit, transported to the anchor.
    """

    anchor: Annotated[Point | None, "point x,y where its axes cross; default: its middle"] = None
    rotate: Annotated[Angle | None, "angle of its grid, seen from above; default: that of the whole grid"] = None
    spacing: Annotated[Lengths | None, "distance between neighbouring rods: one length, or u,v"] = None

    def __post_init__(self) -> None:
        checked(self, "a patch's {}")
