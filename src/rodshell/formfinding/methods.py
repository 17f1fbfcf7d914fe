"""The three ways of draping, each with its own options.

Bound     the inextensible net, to which the grid is bound: no load, no scale, no material
Gravity   static equilibrium under the rods' weight, in frictionless unilateral contact
Fall      the paper's: the grid falls on the target in time and comes to rest there [HQK 3]
"""

from dataclasses import dataclass, field
from numbers import Integral
from pathlib import Path
from typing import ClassVar, Literal, get_args

from rodshell.contact.modified_mass import Stopped
from rodshell.errors import InputError
from rodshell.joints import Coupling, ExplicitPenalty, ImplicitPenalty, SharedDofs
from rodshell.validation import choice, instance, not_negative, positive

STANDARD_GRAVITY = 9.81  # m/s2, as in the paper
STOPPED: tuple[Stopped, ...] = get_args(Stopped)

MethodName = Literal["bound", "gravity", "paper"]
METHOD_NAMES: tuple[MethodName, ...] = get_args(MethodName)


@dataclass(frozen=True)
class Bound:
    """The grid slides on the target without friction; bending alone decides what the net leaves open."""

    name: ClassVar[MethodName] = "bound"


@dataclass(frozen=True, kw_only=True)
class Gravity:
    """The grid hangs on the target at rest, under its weight.

    Parameters
    ----------
    acceleration : of gravity [m/s2].

    Raises
    ------
    InputError : the acceleration is not a positive number.
    """

    acceleration: float = STANDARD_GRAVITY

    name: ClassVar[MethodName] = "gravity"

    def __post_init__(self) -> None:
        positive("the acceleration of gravity", self.acceleration, "m/s2")


@dataclass(frozen=True, kw_only=True)
class Fall:
    """The grid falls on the target in time, by implicit Euler steps with impacts, until it is at rest [HQK 3].

    Parameters
    ----------
    acceleration : of gravity [m/s2].
    height : of the flat grid above the target's highest point [m].
    coupling : how the rods hold together: shared DOFs, implicit or explicit penalty [HQK 2.2].
    time_step : [s]; default: 10 ms on a target of 0.2 m, and as the square root of its size; with explicit ties at
        most nine tenths of their stability limit, whatever touches.
    duration : longest simulated time [s]; default: 6 s on a target of 0.2 m, and as the square root of its size.
    stopped : what an impact takes of a node's velocity, see `ModifiedMass`.
    friction : Coulomb's coefficient between rods and target [-].
    drag : rate at which all velocities decay [1/s].
    stream : folder for the frames, which holds none yet, read with `TimeSeries.load`; None keeps none.
    every : number of steps from one frame to the next.
    settle : end as soon as the grid is at rest; otherwise at the end of the duration.

    Raises
    ------
    InputError : a value is of the wrong kind or sign.
    """

    acceleration: float = STANDARD_GRAVITY
    height: float = 0.05
    coupling: Coupling = field(default_factory=SharedDofs)
    time_step: float | None = None
    duration: float | None = None
    stopped: Stopped = "all"
    friction: float = 0.0
    drag: float = 0.0
    stream: str | Path | None = None
    every: int = 1
    settle: bool = True

    name: ClassVar[MethodName] = "paper"

    def __post_init__(self) -> None:
        positive("the acceleration of gravity", self.acceleration, "m/s2")
        positive("the fall's height", self.height, "m")
        for name in ("time_step", "duration"):
            value = getattr(self, name)
            if value is not None:
                positive(f"the fall's {name}", value, "s")
        not_negative("the fall's friction", self.friction)
        not_negative("the fall's drag", self.drag, "1/s")
        require_coupling("the fall's coupling", self.coupling)
        choice("the fall's stopped", self.stopped, STOPPED)
        if isinstance(self.every, bool) or not isinstance(self.every, Integral) or self.every < 1:
            raise InputError(f"the fall's every must be a number of steps, 1 or more, not {self.every!r}")
        if self.stream is not None:
            instance("the fall's stream", self.stream, str | Path, "the path of a folder")
        instance("the fall's settle", self.settle, bool, "True or False")


Method = Bound | Gravity | Fall
"""One of the three."""


def require_method(value: object) -> None:
    """Refuse all but the three methods, with one sentence that names them.

    Raises
    ------
    InputError : `value` is a word, a class, or anything else.
    """
    if not isinstance(value, Bound | Gravity | Fall):
        what = f"the class {value.__name__} itself" if isinstance(value, type) else repr(value)
        raise InputError(f"method must be rodshell.Bound(), rodshell.Gravity() or rodshell.Fall(), not {what}")


def require_coupling(name: str, value: object) -> None:
    """Refuse all but the three couplings, with one sentence that calls the argument by its `name`.

    Raises
    ------
    InputError : `value` is a word, a class, or anything else.
    """
    kinds = "rodshell.SharedDofs(), rodshell.ImplicitPenalty() or rodshell.ExplicitPenalty()"
    instance(name, value, SharedDofs | ImplicitPenalty | ExplicitPenalty, kinds)
