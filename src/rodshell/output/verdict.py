"""A result in words: is it converged, stable, near the target, and which supports are worth it."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal

from rodshell.output.archive import Archive
from rodshell.output.wording import millimetres, percent, stage

ENDS = ("clamped", "pinned")
MUCH_LESS = 0.5  # clamped supports are recommended when they leave less than this share of the pinned gap,
NEGLIGIBLE = 1e-3  # unless that gap is below this share of the target's size already
SPRUNG = 0.02  # of the target's size: with clamped ends a convex shell leaves a tenth of it

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
    used, unknown = utilisation(result), unknown_below(result)
    sentences = [*failed, *unstable, *_gaps(result), *_strength(result, used, unknown)]
    if failed:
        return Verdict("bad", "Not converged: do not build from these drawings", sentences)
    if used is not None and used > 1:
        return Verdict("bad", "Converged, but the rods would break", sentences)
    if unstable:
        return Verdict("caution", "Converged, but not stable with every kind of support", sentences)
    known = [entry.get("stable") for entry in entries(result, "pop_up").values()]
    if not known:
        return Verdict("caution", "Not checked: there is no pop-up in this result", sentences)
    if not all(known):
        return Verdict("caution", "Converged; whether it is stable was not checked", sentences)
    left = [gap["max_relative"] for gap in entries(result, "agreement").values() if gap.get("max_relative") is not None]
    if min(left, default=0.0) > SPRUNG:
        return Verdict("caution", "Converged and stable, but it does not keep to the target", sentences)
    if used is not None and (unknown or _snaps(result)):
        headline = "Converged and stable; whether the rods hold on the way up is not known"
        return Verdict("caution", headline, sentences)
    return Verdict("good", "Converged and stable", sentences)


def entries(result: Mapping[str, Any], table: str) -> dict[str, dict[str, Any]]:
    """What `result[table]` holds for each kind of ends; empty where nothing is known."""
    known = result.get(table) or {}
    return {ends: entry for ends, entry in known.items() if isinstance(entry, dict)}


def unknown_below(result: Mapping[str, Any]) -> float:
    """Share of the way from flat below which nothing is known: 0 all of it was followed, 1 the final shape alone is."""
    way = result.get("deployment") or {}
    if way and way.get("lost_at") is None:
        return 0.0
    return min((float(stage["share"]) for stage in way.get("stages") or [] if stage["share"] > 0), default=1.0)


def utilisation(result: Mapping[str, Any]) -> float | None:
    """The largest of all shapes that are known, those of the way up among them; None where no strength was given."""
    bent = (result.get("bending") or {}).values()
    known = [entry["utilisation"] for entry in bent if isinstance(entry, dict) and entry.get("utilisation") is not None]
    return max(known, default=None)


def _failed(result: Mapping[str, Any]) -> list[str]:
    """What did not converge, one sentence each."""
    shells, status = entries(result, "pop_up"), result.get("status", "unknown")
    failed = {ends: entry.get("status") for ends, entry in shells.items() if not _converged(entry)}
    words = [f"The pop-up with {ends} ends did not converge: {how}." for ends, how in failed.items()]
    return words if words or status == "converged" else [f"The computation did not converge: {status}."]


def _unstable(result: Mapping[str, Any]) -> list[str]:
    words = []
    for ends, entry in entries(result, "pop_up").items():
        if entry.get("stable") is False and _converged(entry):
            modes = entry.get("negative_modes")
            count = f" ({modes} buckling mode{'s' if modes != 1 else ''})" if modes else ""
            words.append(f"With {ends} ends the shell would snap away from this unstable equilibrium{count}.")
    return words


def _gaps(result: Mapping[str, Any]) -> list[str]:
    """How near the converged shells come to the target, and what the better support is."""
    shells, gaps = entries(result, "pop_up"), entries(result, "agreement")
    known = [ends for ends in ENDS if gaps.get(ends, {}).get("max") is not None and _converged(shells.get(ends, {}))]
    words = []
    for ends in known:
        size = gaps[ends].get("max_relative")
        share = "" if size is None else f" ({percent(size)} of its size)"
        words.append(f"With {ends} ends the shell stays within {millimetres(gaps[ends]['max'])} of the target{share}.")
    if len(known) == len(ENDS):
        words.append(_advice(gaps["clamped"], gaps["pinned"]))
    elif shells and not result.get("target"):
        words.append("There is no target in this result, so there is no gap to tell.")
    return words


def _strength(result: Mapping[str, Any], used: float | None, unknown: float) -> list[str]:
    """How much of the strength is used, and whether the way up is smooth."""
    words = []
    if used is not None:
        words.append(f"The rods use {percent(used)} of their strength at most, {_known(result, unknown)}")
    elif result.get("bending"):
        words.append("No strength was given, so it is not known whether the rods hold (checks.strength).")
    if not unknown and not _snaps(result):
        words.append("On the way up from flat the shell moves smoothly, as far as its stages tell.")
    return words


def _known(result: Mapping[str, Any], unknown: float) -> str:
    """In which shapes that is; no more is said of the way up than was followed."""
    if not result.get("deployment"):
        return "in the final shape; the way up from flat was not followed."
    if unknown >= 1:
        return "in the final shape; nothing is known of the way up, which could not be followed."
    if unknown:
        return f"in the final shape and above {stage(unknown)} of the way up; below, nothing is known of it."
    if _snaps(result):
        return "in the final shape and the stages of the way up; what a snap asks of them is not known."
    return "the way up included."


def _snaps(result: Mapping[str, Any]) -> bool:
    return bool((result.get("deployment") or {}).get("snaps"))


def _advice(clamped: Mapping[str, Any], pinned: Mapping[str, Any]) -> str:
    relative = pinned.get("max_relative")
    if clamped["max"] < MUCH_LESS * pinned["max"] and (relative is None or relative > NEGLIGIBLE):
        return (
            "A support that holds the rod's direction (clamped) is worth it: it leaves "
            f"{percent(clamped['max'] / pinned['max'])} of the gap left by one that is free to turn (pinned)."
        )
    return "A support that holds the rod's direction (clamped) gains little here: pinned supports will do."


def _converged(entry: dict[str, Any]) -> bool:
    return bool(entry.get("status", "converged") == "converged")
