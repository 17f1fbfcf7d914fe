"""Laths that lie on the rods of a result over part of their length: where, what they are called, how long all are."""

from rodshell.figures.form import Rod
from rodshell.layout import Profile
from rodshell.results.results import Results


def laths_on(rod: Rod) -> tuple[tuple[float, float], ...]:
    """The cut ends of each lath beyond the first, from the rod's start [m]."""
    along = rod.stiffness
    if along is None or along.varies != "laths":
        return ()
    length = along.at[-1]
    profile = Profile(tuple(at / length for at in along.at), along.factors, "laths")
    return profile.laths(length, 0.5 * (_cut(rod) - length))


def lengths_text(results: Results) -> str:
    """All that is cut: "286.2 m, and 186.2 m of second laths"."""
    text, laths = f"{sum(map(_cut, results.rods)):.1f} m", laths_text(results)
    return f"{text}, and {laths}" if laths else text


def laths_text(results: Results) -> str:
    """All that lies on the rods: "186.2 m of second laths"; "" where nothing does."""
    laths = [laths_on(rod) for rod in results.rods]
    total = sum(stop - start for on_rod in laths for start, stop in on_rod)
    kind = "second" if max(map(len, laths), default=0) <= 1 else "further"
    return f"{total:.1f} m of {kind} laths" if total else ""


def _cut(rod: Rod) -> float:
    """Its length as cut, or as much of it as is known [m]."""
    return rod.cut_length or rod.length or rod.end - rod.start
