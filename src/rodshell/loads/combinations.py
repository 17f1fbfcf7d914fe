"""What a shell is checked under: loads and their combinations, its bracing, and how stability is looked at."""

from dataclasses import dataclass, field

from rodshell.errors import InputError
from rodshell.loads.bracing import Cables
from rodshell.loads.kinds import LineLoad, Load, PointLoad, SelfWeight, Settlement, Snow, Temperature, Wind
from rodshell.loads.laths import Laths
from rodshell.loads.locked_joints import LockedJoints
from rodshell.loads.strength import Strength
from rodshell.rods.design_strength import DURATIONS, Duration
from rodshell.units import shown
from rodshell.validation import brief, choice, described, instance, mapping, not_negative, positive, whole

Bracing = Cables | Laths
LASTING: dict[type, Duration] = {
    SelfWeight: "permanent", Settlement: "permanent", Snow: "short", Wind: "short",
    PointLoad: "medium", LineLoad: "medium", Temperature: "medium",
}  # fmt: skip
"""How long a load acts where that is not given [EN 1995-1-1, table 2.2; imposed loads: medium]. Codes of some countries
count snow as medium."""


@dataclass(frozen=True, kw_only=True)
class Stability:
    """How stability is looked at.

    Parameters
    ----------
    imperfection : largest displacement of the geometry with imperfections [m], or a part of the span such as
        "span/500"; None: the perfect geometry alone.
    modes : lowest buckling modes that are looked for; an imperfection in each of them is tried, with either sign.
    """

    imperfection: float | str | None = None
    modes: int = 3

    def __post_init__(self) -> None:
        if self.imperfection is not None:
            self.amplitude(1.0)
        whole("the number of modes", self.modes, 1, 1000)

    def amplitude(self, span: float) -> float | None:
        """Largest displacement of the geometry with imperfections [m]; None: the perfect geometry alone.

        Parameters
        ----------
        span : of the shell [m].
        """
        given = self.imperfection
        if not isinstance(given, str):
            return None if given is None else positive("the imperfection", given, "m")
        before, _, part = given.partition("/")
        if before.strip() != "span" or not part.strip().replace(".", "", 1).isdecimal() or not float(part) > 0:
            raise InputError(f'the imperfection must be a length in m, or "span/500", not {shown(given)}')
        return span / float(part)


@dataclass(frozen=True, kw_only=True)
class Loads:
    """What a shell is checked under.

    Parameters
    ----------
    combinations : by name, the factors of loads by their names.
    bracing : that is put in before the loads act; None: none.
    locked_joints : how pins are tightened after that, before the loads act; None: they stay free.
    stability : how stability is looked at.
    strength : what rods and joints withstand.
    durations : by a load's name, how long it acts; default: by its kind, see `LASTING`.

    Raises
    ------
    InputError : a combination names a load that is not there; there is no combination; a factor is not a number.
    """

    loads: dict[str, Load]
    combinations: dict[str, dict[str, float]]
    bracing: Bracing | None = None
    locked_joints: LockedJoints | None = None
    stability: Stability = field(default_factory=Stability)
    strength: Strength = field(default_factory=Strength)
    durations: dict[str, Duration] = field(default_factory=dict)

    __repr__ = brief

    def duration(self, combination: str) -> Duration:
        """How long a combination acts: as long as the load in it that acts for the shortest time."""
        acting = [name for name, factor in self.combinations[combination].items() if factor > 0]
        each = [self.durations.get(name, LASTING[type(self.loads[name])]) for name in acting]
        return max(each, key=DURATIONS.index, default="permanent")

    def __post_init__(self) -> None:
        instance("strength", self.strength, Strength)
        instance("stability", self.stability, Stability)
        mapping("loads", self.loads, 'loads by their names, such as {"snow": rodshell.Snow(500.0)}')
        by_name = 'factors by the names of loads, such as {"winter": {"snow": 1.5}}'
        for name, factors in mapping("combinations", self.combinations, by_name).items():
            mapping(f"the combination {shown(name)}", factors, 'factors by the names of loads, such as {"snow": 1.5}')
        mapping("durations", self.durations, 'durations by the names of loads, such as {"snow": "short"}')
        for name, duration in self.durations.items():
            if name not in self.loads:
                raise InputError(
                    f"durations has {shown(name)}, which is not a load: the loads are {', '.join(self.loads)}"
                )
            choice(f"the duration of {shown(name)}", duration, DURATIONS)
        if not self.loads or not self.combinations:
            missing, example = "loads", 'name = "own", kind = "self_weight"'
            if self.loads:
                missing, example = "combinations", 'name = "winter", factors = { snow = 1.5 }'
            raise InputError(f"the shell has no {missing} to be checked under: give [[{missing}]], {{ {example} }}")
        if self.bracing is not None:
            instance("bracing", self.bracing, Bracing, "rodshell.Cables(...) or rodshell.Laths(...)")
        if self.locked_joints is not None:
            instance("locked_joints", self.locked_joints, LockedJoints, "rodshell.LockedJoints(...)")
        for name, load in self.loads.items():
            if not isinstance(load, Load):
                raise InputError(
                    f"the load {shown(name)} must be a load such as rodshell.Snow(500.0), not {described(load)}"
                )
        for name, factors in self.combinations.items():
            if not factors:
                raise InputError(f"the combination {shown(name)} has no loads: give factors such as {{ snow = 1.5 }}")
            for load_name, factor in factors.items():
                if load_name not in self.loads:
                    known = ", ".join(self.loads)
                    raise InputError(
                        f"the combination {shown(name)} has a factor for {shown(load_name)}, which is not a load: the "
                        f"loads are {known}"
                    )
                not_negative(f"the factor of {shown(load_name)} in the combination {shown(name)}", factor)
