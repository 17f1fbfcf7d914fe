"""How a grid falls on a target: the options of the paper's drape."""

from dataclasses import dataclass, field
from math import isfinite
from pathlib import Path

from rodshell.contact.modified_mass import Stopped
from rodshell.errors import InputError
from rodshell.joints import Coupling, SharedDofs


@dataclass(frozen=True)
class Fall:
    """How the grid falls.

    Parameters
    ----------
    coupling : how the rods hold together (shared DOFs, implicit or explicit penalty).
    height : of the flat grid above the target's highest point [m].
    time_step, duration : [s]; None: 10 ms and 6 s on a target of 0.2 m, and as the square root of its size; explicit
        ties nine tenths of what they bear whatever touches. The fall ends when the grid is at rest.
    stopped : what an impact takes of a node's velocity, see `ModifiedMass`.
    friction : Coulomb's coefficient between rods and target.
    drag : rate at which all velocities decay [1/s].
    stream : folder for the frames, which holds none yet, read with `TimeSeries.load`; None keeps none.
    every : frames are streamed each so many steps.
    settle : end as soon as the grid is at rest; else go on for the whole duration.
    """

    coupling: Coupling = field(default_factory=SharedDofs)
    height: float = 0.05
    time_step: float | None = None
    duration: float | None = None
    stopped: Stopped = "all"
    friction: float = 0.0
    drag: float = 0.0
    stream: str | Path | None = None
    every: int = 1
    settle: bool = True

    def __post_init__(self) -> None:
        for name in ("height", "time_step", "duration"):
            value = getattr(self, name)
            if value is not None and not (isfinite(value) and value > 0):
                raise InputError(f"the fall's {name} must be positive, not {value}")

    def parameters(self) -> dict[str, object]:
        """As it stands in a case file, in SI; without `stream`, which a case file may not have everywhere."""
        ties = {name: getattr(self.coupling, name, None) for name in ("C1", "C2")}
        given = {name: getattr(self, name) for name in ("height", "time_step", "duration", "friction", "drag")}
        known = {name: value for name, value in (given | ties).items() if value is not None}
        return {**known, "coupling": self.coupling.name}
