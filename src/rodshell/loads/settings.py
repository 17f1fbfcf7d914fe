"""What decides a check under loads, except the loads: bracing, locked joints, stability, strength."""

from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal

from rodshell.errors import InputError
from rodshell.quantities import Distance, Factor, Force, Share, SlipMoment, Stiffness, Stress, Value, Whole
from rodshell.rods.design_strength import DURATIONS, Duration
from rodshell.rods.joints import Joint
from rodshell.rods.section import Rod
from rodshell.schema import Inline, checked
from rodshell.units import read_quantity, shown
from rodshell.validation import brief, instance, not_negative, whole

AcrossOpenings = Literal["refuse", "leave out"]


def _pattern(value: str) -> str:
    """ "both", "one" or "every = n"."""
    from rodshell.layout.cells import Pattern  # here, as it needs SciPy

    Pattern.of(value)
    return value


Diagonals = Annotated[
    str, Value(_pattern, lambda _, value: _pattern(value)), 'diagonals: "both" of a cell, "one", or "every = n"'
]  # fmt: skip
OnOpenings = Annotated[AcrossOpenings, "what becomes of diagonals across an opening"]


@dataclass(frozen=True, kw_only=True)
class Cables:
    """Cables that carry tension alone, straight from joint to joint, in the outer layer of rods.

    Of the stiffnesses of their rod EA counts. A pattern of "every = n" has lines of both diagonals through every n-th
    joint. Slack cables brace nothing: factors without a prestrain are small. Lines that end at the outermost joints
    leave the fields at the rim without bracing.
    """

    kind: ClassVar = "cables"
    pattern: Diagonals = "both"
    prestrain: Annotated[Share, "strain by which cables are shortened when they are put in"] = 0.0
    ends_at: Annotated[
        Literal["joints", "supports"], "where cables end: at the outermost joints, or at the supports"
    ] = "joints"  # fmt: skip
    across_openings: OnOpenings = "refuse"
    rod: Annotated[Rod, Inline]

    __repr__ = brief

    def __post_init__(self) -> None:
        instance("the bracing's rod", self.rod, Rod)
        checked(self, {"prestrain": "the {}"})


@dataclass(frozen=True, kw_only=True)
class Laths:
    """A third layer of laths: by default of the grid's rods, which share the joints' nodes where they have no
    eccentricity."""

    kind: ClassVar = "laths"
    pattern: Diagonals = "one"
    eccentricity: Annotated[Distance, "distance of the laths' centre lines from the outer rods'"] = 0.0
    across_openings: OnOpenings = "refuse"
    rod: Annotated[Rod | None, Inline] = None

    __repr__ = brief

    def __post_init__(self) -> None:
        if self.rod is not None:
            instance("the bracing's rod", self.rod, Rod)
        checked(self, {"eccentricity": "the bracing's {}"})


Bracing = Cables | Laths


@dataclass(frozen=True, kw_only=True)
class LockedJoints:
    """Pins that are tightened before loads act.

    Args:
        shear: [N m/rad]; `inf` is rigid.
        slip: [N m]; with `Strength.slip` both count together.
    """

    shear: Annotated[Stiffness, "stiffness about the normal of pins tightened after erection"]
    slip: Annotated[SlipMoment | None, "moment at which they slip; default: not checked"] = None

    __repr__ = brief

    def __post_init__(self) -> None:
        checked(self, {"shear": "the {} stiffness of locked joints", "slip": "the moment at which locked joints {}"})
        if self.shear == 0:
            raise InputError("locked joints without shear stiffness are free: give one, or leave locked_joints out")

    def require_pins(self, joint: Joint) -> None:
        """Raise InputError where joints of a kind cannot be locked."""
        if not joint.locks:
            raise InputError(
                f"locked_joints: {joint.name} joints cannot be locked: pins are free about their normal until they are "
                'tightened: set joint.kind = "pin", or leave locked_joints out'
            )


def _of_span(value: object) -> str | float:
    """A length, 0 for none, or a part of the span as "span/500"."""
    before, _, part = value.partition("/") if isinstance(value, str) else ("", "", "")
    try:
        if value == 0:
            return 0.0
        if before.strip() != "span":
            return read_quantity(value, "length", size=True)
        return f"span/{read_quantity(part, 'number', size=True):g}"
    except ValueError as reason:
        raise ValueError(f'{reason}, or a part of the span such as "span/500"') from None


def part_of_span(name: str, given: float | str, span: float) -> float:
    """A length [m] that is given as one, or as a part of a `span` [m]."""
    if not isinstance(given, str):
        return not_negative(name, given, "m")
    before, _, part = given.partition("/")
    if before.strip() != "span" or not part.strip().replace(".", "", 1).isdecimal() or not float(part) > 0:
        raise InputError(f'{name} must be a length in m, or "span/500", not {shown(given)}')
    return span / float(part)


PartOfSpan = Annotated[
    float | str, Value(_of_span, lambda name, value: part_of_span(name, value, 1.0) and value)
]  # fmt: skip


@dataclass(frozen=True, kw_only=True)
class Stability:
    """How stability is looked at: of the perfect shell, and with an imperfection in each mode, of either sign.

    Args:
        imperfection: largest displacement [m], or a part of the span such as "span/500"; 0: the perfect shell alone.
        reserve: how many times every combination of loads a good shell carries, with the imperfection; permanent ones
            again after years.
    """

    imperfection: Annotated[
        float | str, Value(_of_span), 'largest imperfection: a length, "span/500", or 0 for none'
    ] = "span/500"  # fmt: skip
    modes: Annotated[Whole, "number of buckling modes, each of which is tried as imperfection"] = 3
    reserve: Annotated[Factor, "times the loads that a good shell carries, with the imperfection"] = 1.5

    def __post_init__(self) -> None:
        checked(self, {"modes": "the number of {}", "reserve": "the {} asked for"})
        self.amplitude(1.0)
        whole("the number of modes", self.modes, 1, 1000)
        if self.reserve < 1:
            raise InputError(f"the reserve asked for is {self.reserve:g}: give 1 or more, since at 1 the shell falls")

    def amplitude(self, span: float) -> float:
        """Largest displacement of an imperfect shell of a `span` [m], in m; 0: the perfect one alone."""
        return part_of_span("the imperfection", self.imperfection, span)


def _service_class(value: object) -> int:
    """1, 2 or 3."""
    found = read_quantity(value, "number")
    if found not in (1, 2, 3):
        raise ValueError("must be 1 (inside), 2 (covered) or 3 (in the weather)")
    return int(found)


@dataclass(frozen=True, kw_only=True)
class Strength:
    """What rods and joints withstand, where it is not that of the material's preset.

    Args:
        permanent, long, medium, short, instantaneous: design strength in bending for loads that act so long [Pa]. Given
            ones stand in place of all of the preset's; one that is missing is that of the next longer duration.
        erection: the same while the shell is erected [Pa]; None: the short one.
        effective_length: for the Euler load of a span.
    """

    permanent: Annotated[Stress | None, "design strength under permanent loads; default: a preset's"] = None
    long: Annotated[Stress | None, "under loads of months; default: permanent"] = None
    medium: Annotated[Stress | None, "the same under loads of weeks; default: the long one"] = None
    short: Annotated[Stress | None, "the same under loads of days; default: the medium one"] = None
    instantaneous: Annotated[Stress | None, "the same under gusts; default: the short one"] = None
    erection: Annotated[Stress | None, "the same during deployment; default: the short one"] = None
    service_class: Annotated[
        int | None,
        Value(_service_class, lambda name, value: whole(name, value, 1, 3)),
        "of timber: 1 inside, 2 covered (default), 3 in the weather",
    ] = None
    relaxed: Annotated[
        Share | None, "share of timber's unloaded stress that is gone after months"
    ] = None  # fmt: skip
    creep: Annotated[Share | None, "growth of deflections under permanent loads; default: k_def"] = None
    hole: Annotated[Distance, "diameter of the bolts' holes through the rods at joints"] = 0.0
    slip: Annotated[Force | None, "axial force that a joint transfers before it slips"] = None
    effective_length: Annotated[Factor, "effective length of a span between joints, over its length"] = 1.0

    def __post_init__(self) -> None:
        others = {"hole": "the diameter of holes", "effective_length": "the effective length",
                  "creep": "the growth of deflections by {}",
                  "relaxed": "the {} share of stress", "service_class": "the service class"}  # fmt: skip
        checked(self, dict.fromkeys((*DURATIONS, "erection", "slip"), "the strength ({})") | others)
        if self.relaxed is not None and self.relaxed >= 1:
            raise InputError(f"the relaxed share of stress must be below 1, not {self.relaxed:g}: some stress stays")

    @property
    def given(self) -> dict[Duration, float]:
        """The given strengths by duration [Pa]."""
        return {name: getattr(self, name) for name in DURATIONS if getattr(self, name) is not None}
