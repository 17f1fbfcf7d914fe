"""What a shell is checked under: loads and their combinations, its bracing, and how stability is looked at."""

from dataclasses import dataclass, field

from rodshell.errors import InputError
from rodshell.loads.kinds import Forces, Load, SelfWeight, Wind
from rodshell.loads.settings import Bracing, LockedJoints, Stability, Strength, part_of_span
from rodshell.rods.design_strength import DURATIONS, Duration
from rodshell.units import shown
from rodshell.validation import brief, choice, described, instance, mapping, not_negative


@dataclass(frozen=True, kw_only=True)
class Loads:
    """What a shell is checked under.

    Args:
        combinations: by name, the factors of loads by their names.
        bracing: that is put in before the loads act; None: none.
        locked_joints: how pins are tightened after that, before the loads act; None: they stay free.
        stability: how stability is looked at.
        strength: what rods and joints withstand.
        durations: by a load's name, how long it acts; default: by its kind, see `loads.kinds`.
        deflections: by a combination's name, how far a node may move under it [m], or a part of the span: "span/200".

    A combination with wind from several directions becomes one for each.

    Raises:
        InputError: a combination names a load that is not there; there is no combination; a factor is not a number.
    """

    loads: dict[str, Load | Forces]
    combinations: dict[str, dict[str, float]]
    bracing: Bracing | None = None
    locked_joints: LockedJoints | None = None
    stability: Stability = field(default_factory=Stability)
    strength: Strength = field(default_factory=Strength)
    durations: dict[str, Duration] = field(default_factory=dict)
    deflections: dict[str, float | str] = field(default_factory=dict)

    __repr__ = brief

    @property
    def cladding(self) -> float:
        """The most of it that is in one load [kg/m2]."""
        return max((load.cladding for load in self.loads.values() if isinstance(load, SelfWeight)), default=0.0)

    def duration(self, combination: str) -> Duration:
        """How long a combination acts: as long as the load in it that acts for the shortest time."""
        acting = [name for name, factor in self.combinations[combination].items() if factor > 0]
        each = [self.durations.get(name, self.loads[name].lasting) for name in acting]
        return max(each, key=DURATIONS.index, default="permanent")

    def __post_init__(self) -> None:
        instance("strength", self.strength, Strength)
        instance("stability", self.stability, Stability)
        if self.bracing is not None:
            instance("bracing", self.bracing, Bracing, "rodshell.Cables(...) or rodshell.Laths(...)")
        if self.locked_joints is not None:
            instance("locked_joints", self.locked_joints, LockedJoints, "rodshell.LockedJoints(...)")
        for name, load in mapping(
            "loads", self.loads, 'loads by their names, such as {"snow": rodshell.Snow(500.0)}'
        ).items():
            if not isinstance(load, Load | Forces):
                raise InputError(
                    f"the load {shown(name)} must be a load such as rodshell.Snow(500.0), not {described(load)}"
                )
        by_name = 'factors by the names of loads, such as {"winter": {"snow": 1.5}}'
        combinations = mapping("combinations", self.combinations, by_name)
        if not self.loads or not combinations:
            missing, example = "loads", 'name = "own", kind = "self_weight"'
            if self.loads:
                missing, example = "combinations", 'name = "winter", factors = { snow = 1.5 }'
            raise InputError(f"the shell has no {missing} to be checked under: give [[{missing}]], {{ {example} }}")
        for name, factors in combinations.items():
            mapping(f"the combination {shown(name)}", factors, 'factors by the names of loads, such as {"snow": 1.5}')
            if not factors:
                raise InputError(f"the combination {shown(name)} has no loads: give factors such as {{ snow = 1.5 }}")
            for load_name, factor in factors.items():
                self._require(load_name, f"the combination {shown(name)} has a factor for")
                not_negative(f"the factor of {shown(load_name)} in the combination {shown(name)}", factor)
        mapping("durations", self.durations, 'durations by the names of loads, such as {"snow": "short"}')
        for name, duration in self.durations.items():
            self._require(name, "durations has")
            choice(f"the duration of {shown(name)}", duration, DURATIONS)
        for name, limit in mapping("deflections", self.deflections, '{"winter": "span/200"}').items():
            if name not in combinations:
                raise InputError(f"deflections has {shown(name)}, which is not a combination: give one of them")
            part_of_span(f"the deflection allowed under {shown(name)}", limit, 1.0)
        self._turn_winds()

    def _turn_winds(self) -> None:
        """Put a combination for each direction in the place of one with wind from several."""
        winds = {key: load for key, load in self.loads.items() if isinstance(load, Wind) and load.directions > 1}
        loads: dict[str, Load | Forces] = {key: load for key, load in self.loads.items() if key not in winds}
        combinations, deflections, durations = (
            dict[str, dict[str, float]](),
            dict(self.deflections),
            dict(self.durations),
        )
        for name, factors in self.combinations.items():
            turning = [key for key in factors if key in winds]
            if len(turning) > 1:
                raise InputError(f"the combination {shown(name)} has two winds from several directions: give it one")
            for words, wind in winds[turning[0]].each.items() if turning else ():
                turned = {key + words * (key in winds): factor for key, factor in factors.items()}
                loads[turning[0] + words], combinations[name + words] = wind, turned
                if name in self.deflections:
                    deflections[name + words] = self.deflections[name]
                if turning[0] in self.durations:
                    durations[turning[0] + words] = self.durations[turning[0]]
            if not turning:
                combinations[name] = factors
        found = {"loads": loads, "combinations": combinations, "deflections": deflections, "durations": durations}
        for field_name, value in found.items():
            object.__setattr__(self, field_name, value)

    def _require(self, name: str, what: str) -> None:
        if name not in self.loads:
            raise InputError(f"{what} {shown(name)}, which is not a load: the loads are {', '.join(self.loads)}")
