"""What a shell is checked under: loads and their combinations, its bracing, and how stability is looked at."""

from dataclasses import dataclass, field

from rodshell.errors import InputError
from rodshell.loads.bracing import Cables
from rodshell.loads.kinds import Load
from rodshell.loads.laths import Laths
from rodshell.units import shown
from rodshell.validation import brief, instance, not_negative, positive

Bracing = Cables | Laths


@dataclass(frozen=True, kw_only=True)
class Stability:
    """How stability is looked at.

    Parameters
    ----------
    imperfection : largest displacement of the geometry with imperfections [m], or a part of the span such as
        "span/500"; None: the perfect geometry alone.
    modes : lowest buckling modes that are looked for, in which imperfections are.
    """

    imperfection: float | str | None = None
    modes: int = 3

    def __post_init__(self) -> None:
        if self.imperfection is not None:
            self.amplitude(1.0)
        if isinstance(self.modes, bool) or not isinstance(self.modes, int) or self.modes < 1:
            raise InputError(f"the number of modes must be 1 or more, not {self.modes!r}")

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
    loads : by name.
    combinations : by name, the factors of loads by their names.
    bracing : that is put in before the loads act; None: none.
    stability : how stability is looked at.

    Raises
    ------
    InputError : a combination names a load that is not there; there is no combination; a factor is not a number.
    """

    loads: dict[str, Load]
    combinations: dict[str, dict[str, float]]
    bracing: Bracing | None = None
    stability: Stability = field(default_factory=Stability)

    __repr__ = brief

    def __post_init__(self) -> None:
        if not self.loads or not self.combinations:
            missing, example = "loads", 'name = "own", kind = "self_weight"'
            if self.loads:
                missing, example = "combinations", 'name = "winter", factors = { snow = 1.5 }'
            raise InputError(f"the shell has no {missing} to be checked under: give [[{missing}]], {{ {example} }}")
        if self.bracing is not None:
            instance("bracing", self.bracing, Bracing, "rodshell.Cables(...) or rodshell.Laths(...)")
        for name, load in self.loads.items():
            if not isinstance(load, Load):
                raise InputError(f"the load {shown(name)} must be a load such as rodshell.Snow(500.0), not {load!r}")
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
