"""Joint kinds. With shared DOFs (the paper's *mapping*), rods that meet at a joint have one node there."""

from dataclasses import dataclass
from typing import Protocol


class Joint(Protocol):
    """What a joint does beyond holding its rods together."""

    @property
    def name(self) -> str: ...

    @property
    def turns_frames(self) -> bool:
        """Whether it carries moments between the frames of its rods, so that their twist matters."""
        ...


@dataclass(frozen=True)
class Ball:
    """Holds the rods' centre lines together and leaves every rotation free [Baek et al., cited in HQK section 1]."""

    @property
    def name(self) -> str:
        return "ball"

    @property
    def turns_frames(self) -> bool:
        return False
