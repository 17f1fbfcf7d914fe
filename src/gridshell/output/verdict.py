"""A result in words: does it converge, is it stable, does it reach the target, and which supports are worth it."""

from dataclasses import dataclass
from math import isfinite
from typing import Any, Literal

from gridshell.output.archive import Archive

ENDS = ("clamped", "pinned")
MUCH_LESS = 0.5  # clamped supports are recommended when they leave less than this share of the pinned gap,
NEGLIGIBLE = 1e-3  # unless that gap is below this share of the target's size already

Level = Literal["good", "caution", "bad"]


@dataclass(frozen=True)
class Verdict:
    """What to think of a result: a level, one headline, and the sentences that carry it."""

    level: Level
    headline: str
    sentences: list[str]


def verdict(archive: Archive) -> Verdict:
    """The verdict on an archive."""
    result = archive.result
    failed, unstable = _failed(result), _unstable(result)
    sentences = [*failed, *unstable, *_gaps(result)]
    if failed:
        return Verdict("bad", "Not converged: do not build from these drawings", sentences)
    if unstable:
        return Verdict("caution", "Converged, but not stable with every kind of support", sentences)
    known = [entry.get("stable") for entry in entries(result, "pop_up").values()]
    if not known:
        return Verdict("caution", "Not checked: there is no pop-up in this result", sentences)
    if not all(known):
        return Verdict("caution", "Converged; whether it is stable was not checked", sentences)
    return Verdict("good", "Converged and stable", sentences)


def entries(result: dict[str, Any], table: str) -> dict[str, dict[str, Any]]:
    """What `result[table]` holds for each kind of ends; empty where nothing is known."""
    known = result.get(table) or {}
    return {ends: entry for ends, entry in known.items() if isinstance(entry, dict)}


def millimetres(metres: float | None, digits: int = 3) -> str:
    """A length [m] in mm with about three significant digits."""
    if metres is None or not isfinite(metres):
        return "unknown"
    value = 1e3 * metres
    if value and abs(value) < 1e-3:
        return "under 0.001 mm"
    decimals = max(0, digits - 1 - max(0, len(str(int(abs(value)))) - 1))
    return f"{value:.{min(decimals + (abs(value) < 1), 3)}f} mm"


def percent(share: float | None) -> str:
    return "unknown" if share is None or not isfinite(share) else f"{100 * share:.2g} %"


def _failed(result: dict[str, Any]) -> list[str]:
    """What did not converge, one sentence each."""
    words = [
        f"The pop-up with {ends} ends did not converge: {entry.get('status')}."
        for ends, entry in entries(result, "pop_up").items() if not _converged(entry)
    ]  # fmt: skip
    status = result.get("status", "unknown")
    return words if words or status == "converged" else [f"The computation did not converge: {status}."]


def _unstable(result: dict[str, Any]) -> list[str]:
    words = []
    for ends, entry in entries(result, "pop_up").items():
        if entry.get("stable") is False and _converged(entry):
            modes = entry.get("negative_modes")
            count = f" ({modes} buckling mode{'s' if modes != 1 else ''})" if modes else ""
            words.append(f"With {ends} ends the shell is an unstable equilibrium{count}: it would snap away from it.")
    return words


def _gaps(result: dict[str, Any]) -> list[str]:
    """How near the converged shells come to the target, and what the better support is."""
    shells = entries(result, "pop_up")
    gaps = {
        ends: entry for ends, entry in entries(result, "agreement").items()
        if entry.get("max") is not None and _converged(shells.get(ends, {}))
    }  # fmt: skip
    words = []
    for ends in ENDS:
        if ends in gaps:
            share = gaps[ends].get("max_relative")
            size = "" if share is None else f" ({percent(share)} of its size)"
            words.append(f"With {ends} ends the shell stays within {millimetres(gaps[ends]['max'])} of the target{size}.")
    if all(ends in gaps for ends in ENDS):
        words.append(_advice(gaps["clamped"]["max"], gaps["pinned"]["max"], gaps["pinned"].get("max_relative")))
    elif shells and not result.get("target"):
        words.append("There is no target in this result, so there is no gap to tell.")
    return words


def _advice(clamped: float, pinned: float, pinned_relative: float | None) -> str:
    if clamped < MUCH_LESS * pinned and (pinned_relative is None or pinned_relative > NEGLIGIBLE):
        return (
            "A support that holds the rod's direction (clamped) is worth it: it leaves "
            f"{percent(clamped / pinned)} of the gap that is left by one that is free to turn (pinned)."
        )
    return "A support that holds the rod's direction (clamped) gains little here: one that is free to turn will do."


def _converged(entry: dict[str, Any]) -> bool:
    return bool(entry.get("status", "converged") == "converged")
